//! Small programs that once ran incorrectly, each with what was observed.

use emu_8051::chips::chip;
use emu_8051::{Mcs51, Mcs51Readings, Options};
use emu_core::pins::ChipEvent;
use emu_core::{Cpu, Probe, RamInit, StopReason};

/// A machine with a program of these lines from address 0.
fn machine(name: &str, lines: &[&str], options: Options) -> Mcs51 {
    let chip = chip(name).expect("a chip of this crate");
    let image = emu_asm::assemble_text(chip, &lines.join("\n")).unwrap_or_else(|e| panic!("{lines:?}: {e}"));
    Mcs51::with(chip, &image, RamInit::Zero, options)
}

#[derive(Default)]
struct Events(Vec<ChipEvent>);

impl Probe for Events {
    const EVENTS: bool = true;
    fn on_event(&mut self, event: ChipEvent) -> bool {
        self.0.push(event);
        false
    }
}

/// Timer 2 toggles its clock output every five states. Toggles in S6 used to stay due forever.
#[test]
fn a_clock_out_toggles_in_any_state() {
    let lines =
        ["mov RCAP2H,#0xFF", "mov RCAP2L,#0xFB", "mov TH2,#0xFF", "mov TL2,#0xFB", "mov T2MOD,#2", "mov T2CON,#4"];
    let mut cpu = machine("at89s52", &[&lines[..], &["nop", "sjmp 18"]].concat(), Options::default());
    let mut events = Events::default();
    assert_eq!(cpu.run(100, &mut events), StopReason::Limit);
    // TR2 is written in cycle 11. The first state counted is number 72, the fifth is 76, then every fifth one
    // toggles.
    let states: Vec<u64> = events.0.iter().map(|e| e.time().cycle * 6 + u64::from(e.time().phase) / 2).collect();
    let wanted: Vec<u64> = (0..).map(|n| 76 + 5 * n).take_while(|&state| state < 6 * 100).collect();
    assert_eq!(states[..wanted.len()], wanted);
}

/// CJNE jumps into its own operands, which are INC R3. Skipping iterations of that loop lost its counts.
#[test]
fn a_loop_that_jumps_into_an_instruction_is_not_one_that_only_looks() {
    let lines = ["mov A,#0x20", "mov R0,#0x20", "db 0xB4, 0x0B, 0xFE", "mov A,R0", "jnc 0x0004"];
    let mut cpu = machine("8051", &lines, Options::default());
    cpu.run(2 + 7 * 1000, &mut ());
    // CJNE, INC R3, MOV R6,A, MOV A,R0 and JNC take seven cycles.
    assert_eq!((cpu.pc(), cpu.reg("r3"), cpu.instructions()), (4, Some(1000 % 256), 2 + 5 * 1000));
}

/// If every access to IE holds interrupts, a loop that reads IE holds them forever, whether its iterations
/// are skipped or not.
#[test]
fn a_loop_over_ie_holds_interrupts_where_reads_do() {
    for spare in 0..4 {
        let readings = Mcs51Readings { read_holds_interrupts: true, ..Mcs51Readings::default() };
        let lines = [&["mov TMOD,#2", "mov IE,#0x82", "setb TR0"], &vec!["nop"; spare][..], &["jnb IE.6,$"]].concat();
        let mut cpu = machine("8051", &lines, Options { readings, ..Options::default() });
        assert_eq!(cpu.run(10_000, &mut ()), StopReason::Limit);
        assert_eq!((cpu.pc(), cpu.reg("SP")), (8 + spare as u32, Some(7)), "{spare} NOPs before it");
    }
}

/// A user writes a port in power-down. Its edges used to have the cycle at which the oscillator stopped.
#[test]
fn a_hand_in_power_down_acts_now() {
    let mut cpu = machine("at89s52", &["mov IE,#0x81", "orl PCON,#2", "sjmp $"], Options::default());
    cpu.drive(emu_core::CycleTime::at(9000), 26, emu_core::PinLevel::Low);
    let mut events = Events::default();
    assert_eq!(cpu.run(500, &mut events), StopReason::Limit);
    assert!(cpu.poke("sfr", 0x90, 0xFE));
    cpu.run(600, &mut events);
    let at: Vec<u64> = events.0.iter().map(|e| e.time().cycle).collect();
    assert_eq!(at, [501], "the write ends with cycle 500");
}

/// A user writes PCON in the cycle in which a pin is driven. The oscillator stops at the end of that cycle,
/// after the edge.
#[test]
fn a_hand_puts_to_sleep_in_the_cycle_of_an_edge() {
    for name in ["P1.0", "P3.2", "P3.4"] {
        let mut cpu = machine("at89s52", &["sjmp $"], Options::default());
        let pin = cpu.chip().pins.iter().position(|pin| pin.name == name).expect("a pin") as emu_core::PinId;
        cpu.run(50, &mut ());
        assert!(cpu.poke("sfr", 0x87, 2));
        let now = cpu.cycle();
        cpu.drive(emu_core::CycleTime::at(now), pin, emu_core::PinLevel::Low);
        cpu.run(now + 100, &mut ());
        assert_eq!(cpu.pin_level(pin), emu_core::PinLevel::Low, "{name}");
    }
}

/// A user changes one bit of a register of a timer, or of AUXR. It used to clear the other bits.
#[test]
fn a_hand_changes_one_bit_and_keeps_the_others() {
    let mut cpu = machine("at89s52", &["sjmp $"], Options::default());
    for addr in [0x89, 0x8A, 0x8B, 0x8C, 0x8D, 0x8E, 0xC8, 0xCA, 0xCB, 0xCC, 0xCD] {
        assert!(cpu.poke("sfr", addr, 0x10) && cpu.poke_bit("sfr", addr, 3, true));
        assert_eq!(cpu.peek("sfr", addr), Some(0x18), "{addr:02X}");
    }
}
