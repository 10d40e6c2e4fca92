//! Random programs and pins: compares every instruction, by cycle and address, with the model.

use emu_core::pins::{CycleTime, PinLevel};
use emu_core::rng::Rng;
use emu_core::{Cpu, Probe, StopReason};
use emu_pic16::Pic16;

use crate::model::{self, Do, GIE, Seen, Setup};
use crate::script::{self, Program};

const SEEDS: u64 = 2000;
const CYCLES: u64 = 600;

/// Addresses of the service routine, the subroutine and the program.
const ROUTINE: usize = 4;
const SUBROUTINE: usize = 0x1C;
const MAIN: usize = 0x20;

#[derive(Default)]
struct Log {
    begun: Vec<(u64, u32)>,
    entries: usize,
}

impl Probe for Log {
    const INSN: bool = true;
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.begun.push((at, pc));
        false
    }
    fn on_interrupt(&mut self, _: u64, _: u8) {
        self.entries += 1;
    }
}

/// Probe that sees only interrupt entries, so that loops are skipped and the hot loop runs.
#[derive(Default)]
struct Entries(usize);

impl Probe for Entries {
    fn on_interrupt(&mut self, _: u64, _: u8) {
        self.0 += 1;
    }
}

fn text(op: Do) -> String {
    match op {
        Do::Count => "incf 0x20, F".into(),
        // FSR is always FFh.
        Do::Skip(taken) => format!("{} FSR, 3", if taken { "btfss" } else { "btfsc" }),
        Do::Goto(to) => format!("goto 0x{to:x}"),
        Do::Call(to) => format!("call 0x{to:x}"),
        Do::Return => "return".into(),
        Do::Retfie => "retfie".into(),
        Do::Bit(bit, on) => format!("{} INTCON, {bit}", if on { "bsf" } else { "bcf" }),
        Do::Read => "movf PORTB, W".into(),
        Do::Sleep => "sleep".into(),
        Do::Clrwdt => "clrwdt".into(),
    }
}

fn op(rng: &mut Rng, at: usize, main: bool) -> Do {
    match rng.below(if main { 26 } else { 16 }) {
        0 | 1 => Do::Skip(rng.one_in(2)),
        2 => Do::Goto(at + 1),
        3 => Do::Call(SUBROUTINE),
        4 | 5 => Do::Read,
        // Flags are cleared more often than set, enables set more often than cleared.
        6..=8 => Do::Bit(rng.below(2) as u8, rng.one_in(5)),
        9 => Do::Bit([3, 4][rng.below(2) as usize], !rng.one_in(3)),
        16..=18 => Do::Bit(GIE, !rng.one_in(3)),
        19 | 20 => Do::Sleep,
        21 => Do::Clrwdt,
        _ => Do::Count,
    }
}

fn setup(rng: &mut Rng) -> Setup {
    let mut code = vec![Do::Count; MAIN];
    code[0] = Do::Goto(MAIN);
    let mut at = ROUTINE;
    for _ in 0..rng.below(12) {
        code[at] = op(rng, at, false);
        at += 1;
    }
    // Most routines clear the cause of the interrupt.
    for last in [Do::Read, Do::Bit(0, false), Do::Bit(1, false)] {
        code[at] = if rng.one_in(8) { Do::Count } else { last };
        at += 1;
    }
    code[at] = if rng.one_in(10) { Do::Return } else { Do::Retfie };
    code[at + 1] = Do::Retfie;
    (code[SUBROUTINE], code[SUBROUTINE + 1], code[SUBROUTINE + 2]) =
        (op(rng, SUBROUTINE, false), Do::Return, Do::Return);
    for _ in 0..40 {
        let next = op(rng, code.len(), true);
        code.push(next);
    }
    code.extend([Do::Bit(GIE, !rng.one_in(8)), Do::Goto(MAIN), Do::Goto(MAIN)]);
    let mut drives = Vec::new();
    for pin in [0u8, 4, 5, 6, 7, 3] {
        let (mut at, mut level) = (8 + rng.below(160), true);
        let longest = [4, 30, 300, 3000][rng.below(4) as usize];
        while at < 4 * CYCLES {
            drives.push((at, pin, level));
            level = !level;
            at += 1 + rng.below(longest);
        }
    }
    drives.sort_unstable();
    Setup {
        code,
        intcon: rng.next_u64() as u8 & 0x98,
        rising: rng.one_in(2),
        crystal: if rng.one_in(4) { 1024 } else { 0 },
        drives,
    }
}

/// Returns the machine with the program, pins and registers of `setup`.
fn machine(setup: &Setup) -> Pic16 {
    let lines: Vec<String> = setup.code.iter().map(|&op| text(op)).collect();
    let config = if setup.crystal > 0 { "3F39" } else { "3F3B" };
    let mut pic = Program::new("random", &format!("config {config}\n{}", lines.join("\n"))).machine();
    let registers = [(0x81, 0xBF | u8::from(setup.rising) << 6), (0x04, 0xFF), (0x0B, setup.intcon)];
    for (addr, value) in registers {
        assert!(pic.poke("data", addr, value));
    }
    for &(clock, pin, high) in &setup.drives {
        let pin = script::pin(&emu_pic16::chips::PIC16F873, &format!("RB{pin}")).expect("a pin");
        pic.drive(CycleTime { cycle: clock / 4, phase: (clock % 4) as u8 }, pin, PinLevel::from_bit(high));
    }
    pic
}

fn end(pic: &Pic16) -> (u8, u8, u8) {
    let at = |addr| pic.peek("data", addr).unwrap_or(0);
    (at(0x0B), at(0x20), at(0x03) & 0x18)
}

/// Runs in slices of `slice` cycles; returns why it ended.
fn run<P: Probe>(pic: &mut Pic16, slice: u64, probe: &mut P) -> StopReason {
    let mut stop = StopReason::Limit;
    while pic.cycle() < CYCLES && stop == StopReason::Limit {
        stop = pic.run((pic.cycle() + slice).min(CYCLES), probe);
    }
    stop
}

/// Compares the instructions of a run with those of the model. The last ones of either may be past the end of
/// the other.
fn compare(seed: u64, setup: &Setup, wanted: &Seen, found: &[(u64, u32)]) {
    let n = found.iter().zip(&wanted.begun).take_while(|(f, w)| f == w).count();
    let rest = |all: &[(u64, u32)]| all[n.min(all.len())..].to_vec();
    let (f, w) = (rest(found), rest(&wanted.begun));
    let late = |rest: &[(u64, u32)]| rest.first().is_none_or(|first| first.0 >= CYCLES - 4);
    if !late(&f) || !late(&w) {
        let before = &wanted.begun[n.saturating_sub(6)..n];
        let (next, got) = (&w[..w.len().min(3)], &f[..f.len().min(3)]);
        let near = before.last().map_or(0, |last| last.0);
        let drives: Vec<_> = setup.drives.iter().filter(|d| d.0 + 60 > 4 * near && d.0 < 4 * near + 60).collect();
        panic!(
            "seed {seed}: after {before:x?} wanted {next:x?}, found {got:x?}; {:?}\ndrives {drives:?}\n{:?}",
            (setup.intcon, setup.rising, setup.crystal),
            setup.code.iter().enumerate().collect::<Vec<_>>()
        );
    }
}

#[test]
fn every_instruction_is_that_of_the_ticked_model() {
    let (mut entries, mut slept, mut begun) = (0, 0, 0);
    for seed in 0..SEEDS {
        let mut rng = Rng::new(0x1600_0000 + seed);
        let setup = setup(&mut rng);
        let wanted = model::run(&setup, CYCLES);
        let start = machine(&setup);

        let mut pic = start.clone();
        let mut log = Log::default();
        let slice = [CYCLES, 1, 7, 100][(seed % 4) as usize];
        let stop = run(&mut pic, slice, &mut log);
        compare(seed, &setup, &wanted, &log.begun);

        // Also compares the registers, if the machine is at a boundary at the end of the model.
        let (mut bare, mut counted) = (start.clone(), Entries::default());
        assert_eq!(run(&mut bare, CYCLES, &mut counted), stop, "seed {seed}");
        assert_eq!(
            (end(&bare), bare.cycle(), bare.instructions()),
            (end(&pic), pic.cycle(), pic.instructions()),
            "seed {seed}"
        );
        assert_eq!(counted.0, log.entries, "seed {seed}");
        if pic.cycle() == CYCLES && log.begun.last() == wanted.begun.last() || stop == StopReason::Halted {
            let model = (wanted.intcon, wanted.counted, wanted.to_pd);
            let same_entry = log.entries == wanted.entries;
            assert!(!same_entry || end(&pic) == model, "seed {seed}: wanted {model:x?}, found {:x?}", end(&pic));
        }
        entries += wanted.entries;
        slept += wanted.slept;
        begun += wanted.begun.len();
    }
    println!("{SEEDS} programs, {begun} instructions, {entries} interrupts, {slept} cycles of standby");
    assert!(begun > 200_000 && entries > 20_000 && slept > 100_000, "{begun} {entries} {slept}");
}
