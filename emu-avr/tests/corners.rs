//! Interactions of peripherals: small programs for what the data sheet says about two of them at once. Each
//! runs in one go and cycle by cycle.

use emu_avr::chips::ATMEGA328P;
use emu_avr::{Avr, Options};
use emu_core::{ChipEvent, Cpu, CycleTime, PinLevel, Probe, RamInit, StopReason};

/// Returns a machine with a program, lock bits and fuses.
fn machine(source: &str, lock: u8, fuses: [u8; 3]) -> Avr {
    let image = emu_asm::assemble_text(&ATMEGA328P, source).unwrap_or_else(|e| panic!("{e}\n{source}"));
    let options = Options { fuses: Some(fuses), lock: Some(lock), ..Options::at_hz(1_000_000) };
    Avr::with(&ATMEGA328P, &image, RamInit::Zero, options)
}

const FUSES: [u8; 3] = [0xFF, 0xD9, 0xFF];

/// Returns the bytes from 0x100 on after `cycles` cycles; they must not depend on how the run is sliced.
fn after(mut avr: Avr, cycles: u64) -> [u8; 4] {
    let mut slow = avr.clone();
    let stop = avr.run(cycles, &mut ());
    while slow.cycle() < cycles && slow.run(slow.cycle() + 1, &mut ()) == StopReason::Limit {}
    let seen = |avr: &Avr| [0x100, 0x101, 0x102, 0x103].map(|addr| avr.peek("data", addr).unwrap_or(0));
    assert_eq!(seen(&avr), seen(&slow), "cycle by cycle, {stop:?}");
    seen(&avr)
}

/// Timer 0 matches at 5, long before `main` continues: OCF0A is pending. Its service routine records that it
/// ran, and r20.
const MATCH: &str = "
    .org 0x38, 0xFF
    ldi r21, 1
    sts 0x100, r21
    sts 0x101, r20
    sts 0x6E, r22
    reti
";
const PENDING: &str = "
    ldi r16, 5
    out 0x27, r16
    ldi r16, 1
    out 0x25, r16
    nop
    nop
    nop
    nop
    nop
    nop
    nop
    nop
    ldi r17, 2
";

/// Interrupts that BLB12 blocks in the boot section are taken after the jump out of it (12.5, 27.3).
#[test]
fn barred_interrupts_are_taken_outside_of_the_boot_section() {
    let source = format!(
        "{MATCH}\n.org 0x7000, 0xFF\n{PENDING} sts 0x6E, r17\n sei\n inc r20\n jmp 0x400\n.org 0x400\n inc r20\n rjmp .-4"
    );
    assert_eq!(after(machine(&source, 0xDF, [0xFF, 0xD8, 0xFF]), 500), [1, 1, 0, 0]);
    assert_eq!(after(machine(&source, 0xFF, [0xFF, 0xD8, 0xFF]), 500), [1, 1, 0, 0]);
    // They do not wake the core there either.
    let sleeps = source.replace("jmp 0x400", "ldi r16, 1\n out 0x33, r16\n sleep\n sts 0x102, r16\n rjmp .-2");
    assert_eq!(after(machine(&sleeps, 0xDF, [0xFF, 0xD8, 0xFF]), 500), [0; 4]);
    // Without a jump out of the boot section they are never taken.
    let stays = source.replace("jmp 0x400", "rjmp .-4\n nop");
    assert_eq!(after(machine(&stays, 0xDF, [0xFF, 0xD8, 0xFF]), 500), [0; 4]);
}

/// IVCE blocks interrupts for its four cycles, or until the instruction after the write of IVSEL (12.5.1).
#[test]
fn ivce_holds_interrupts() {
    let main = |then: &str| {
        format!(
            "jmp 0x200\n{MATCH}\n.org 0x200, 0xFF\n{PENDING}\n sei\n ldi r18, 1\n out 0x35, r18\n {then}\n rjmp .-2"
        )
    };
    let four = main("sts 0x6E, r17\n inc r20\n inc r20\n inc r20\n inc r20");
    assert_eq!(after(machine(&four, 0xFF, FUSES), 500), [1, 2, 0, 0]);
    let written = main("out 0x35, r22\n sts 0x6E, r17\n inc r20\n inc r20");
    assert_eq!(after(machine(&written, 0xFF, FUSES), 500), [1, 0, 0, 0]);
    let behind = main("sts 0x6E, r17\n out 0x35, r22\n inc r20\n inc r20\n inc r20");
    assert_eq!(after(machine(&behind, 0xFF, FUSES), 500), [1, 1, 0, 0]);
}

/// EE_READY wakes the core only from idle and ADC noise reduction; a synchronous timer 2 from power-save and
/// extended standby (table 10-1, 10.6).
#[test]
fn who_wakes_from_which_sleep() {
    let sleeps = |mode: u8, enable: &str| {
        format!(
            "jmp 0x200
            .org 0x24
            inc r20
            sts 0x100, r20
            sts 0x70, r22
            reti
            .org 0x58
            inc r20
            sts 0x100, r20
            out 0x1F, r22
            reti
            .org 0x200
            {enable}
            ldi r16, {}
            out 0x33, r16
            sei
            sleep
            nop
            rjmp .-2",
            mode << 1 | 1
        )
    };
    let ready = "ldi r16, 8\n out 0x1F, r16";
    let timer = "ldi r16, 4\n sts 0xB1, r16\n ldi r16, 1\n sts 0x70, r16";
    let woken = |mode, enable| after(machine(&sleeps(mode, enable), 0xFF, FUSES), 60_000)[0] == 1;
    let modes = [0, 1, 2, 3, 6, 7];
    assert_eq!(modes.map(|mode| woken(mode, ready)), [true, true, false, false, false, false]);
    assert_eq!(modes.map(|mode| woken(mode, timer)), [true, false, false, true, false, true]);
}

/// PRTIM2 does not stop an asynchronous timer 2 (10.11.3), but stops it as soon as it is synchronous.
#[test]
fn prtim2_and_as2() {
    let source = "ldi r16, 0x20
        sts 0xB6, r16
        ldi r17, 0x40
        sts 0x64, r17
        lds r18, 0xB6
        sts 0x100, r18
        sts 0xB6, r22
        sts 0xB6, r16
        lds r18, 0xB6
        sts 0x101, r18
        rjmp .-2";
    assert_eq!(after(machine(source, 0xFF, FUSES), 100), [0x20, 0, 0, 0]);
}

/// An enabled pin change keeps the input of a pin on even if DIDR switches its input buffer off (14.3,
/// DIEOE).
#[test]
fn pin_changes_win_over_didr() {
    let source = "ldi r16, 0x3F
        sts 0x7E, r16
        nop
        in r18, 0x06
        sts 0x100, r18
        ldi r16, 2
        sts 0x68, r16
        ldi r16, 1
        sts 0x6C, r16
        in r18, 0x06
        sts 0x101, r18
        rjmp .-2";
    let mut avr = machine(source, 0xFF, FUSES);
    for name in ["PC0", "PC1"] {
        avr.drive(CycleTime::at(0), ATMEGA328P.pin(name).expect("a pin"), PinLevel::High);
    }
    assert_eq!(after(avr, 100), [0, 1, 0, 0]);
}

/// MOSI and OC2A on PB3 are ORed (14.3.1): while OC2A is low, the byte is visible.
#[test]
fn mosi_and_oc2a_share_a_pin() {
    struct Edges(Vec<PinLevel>);
    impl Probe for Edges {
        const EVENTS: bool = true;
        fn on_event(&mut self, event: ChipEvent) -> bool {
            if let ChipEvent::Edge { pin, level, .. } = event
                && Some(pin) == ATMEGA328P.pin("PB3")
            {
                self.0.push(level);
            }
            false
        }
    }
    let source = "ldi r16, 0x2C
        out 0x04, r16
        ldi r16, 0x80
        sts 0xB0, r16
        ldi r16, 0x50
        out 0x2C, r16
        ldi r16, 0x55
        out 0x2E, r16
        rjmp .-2";
    let mut edges = Edges(Vec::new());
    machine(source, 0xFF, FUSES).run(200, &mut edges);
    // 0 1 0 1 0 1 0 1, after the edge that makes the pin an output.
    let bits: Vec<PinLevel> = edges.0.into_iter().skip_while(|&level| level != PinLevel::High).collect();
    assert_eq!(bits.iter().filter(|&&level| level == PinLevel::High).count(), 4, "{bits:?}");
}

/// A reset takes effect while the core does not run: during the start of its clock (16K clocks), and while it
/// is halted.
#[test]
fn a_reset_ends_every_wait() {
    let source = "inc r20
        sts 0x100, r20
        ldi r16, 1
        out 0x1D, r16
        ldi r16, 5
        out 0x33, r16
        sei
        sleep
        nop
        rjmp .-2";
    let mut avr = machine(source, 0xFF, FUSES);
    let pin = |name| ATMEGA328P.pin(name).expect("a pin");
    avr.drive(CycleTime::at(1000), pin("PD2"), PinLevel::Low);
    avr.drive(CycleTime::at(1100), pin("PD2"), PinLevel::High);
    avr.drive(CycleTime::at(2000), pin("PC6"), PinLevel::Low);
    avr.drive(CycleTime::at(2010), pin("PC6"), PinLevel::High);
    let mut early = avr.clone();
    assert_eq!((early.run(1500, &mut ()), early.cycle()), (StopReason::Limit, 1500));
    assert_eq!(after(avr, 2030)[0], 2);
}
