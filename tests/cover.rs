//! Coverage and profiles of the benchmark programs: the reports match the execution, and observation changes
//! nothing.

use std::collections::BTreeMap;

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::cpu::{Cpu, Probe, RamInit};
use emu_core::image::{Image, load_hex};
use emu_core::table::FlowKind;
use emu_debug::{CodeCoverage, CycleProfile};
use emu_pic16::Pic16;

#[path = "../benches/programs/assemble.rs"]
mod programs;
#[path = "../benches/programs51/programs.rs"]
mod programs51;

/// Machine cycles of a run.
const CYCLES: u64 = 300_000;

/// Coverage that sees every iteration, plus a count of every instruction and of every pair of successive
/// instructions.
#[derive(Default)]
struct Every {
    coverage: CodeCoverage,
    counts: BTreeMap<u32, u64>,
    ways: BTreeMap<(u32, u32), u64>,
    interrupted: BTreeMap<u32, u64>,
    last: Option<u32>,
}

impl Probe for Every {
    const INSN: bool = true;
    const FLOW: bool = true;
    fn on_instruction(&mut self, _at: u64, pc: u32) -> bool {
        *self.counts.entry(pc).or_default() += 1;
        if let Some(last) = self.last.replace(pc) {
            *self.ways.entry((last, pc)).or_default() += 1;
        }
        false
    }
    fn on_interrupt(&mut self, _at: u64, _vector: u8) {
        if let Some(last) = self.last.take() {
            *self.interrupted.entry(last).or_default() += 1;
        }
    }
    fn on_branch(&mut self, next: u32, to: u32, taken: bool) {
        self.coverage.on_branch(next, to, taken);
    }
    fn on_flow_start(&mut self, pc: u32) {
        self.coverage.on_flow_start(pc);
    }
    fn on_flow_end(&mut self, pc: u32) {
        self.coverage.on_flow_end(pc);
    }
}

/// Returns the state of a machine at the end, for comparisons.
fn ended<C: Cpu>(cpu: &C) -> (u64, u64, u32, Vec<Option<u32>>) {
    let regs = cpu.chip().cpu_regs.iter().map(|name| cpu.reg(name)).collect();
    (cpu.cycle(), cpu.instructions(), cpu.pc(), regs)
}

/// Returns the instructions, whether each was executed, and which outcomes of conditional ones occurred.
fn seen<C: Cpu>(cpu: &C, coverage: &CodeCoverage, image: &Image) -> Vec<(u32, bool, Option<[bool; 2]>)> {
    let reached = coverage.covered_instructions(cpu.chip(), image);
    reached
        .iter()
        .map(|one| (one.instruction.pc, one.count > 0, one.counts_by_outcome.map(|ways| ways.map(|n| n > 0))))
        .collect()
}

fn looked_at<C: Cpu>(name: &str, start: &C, image: &Image) {
    let (mut bare, mut quick, mut slow, mut timed) = (start.clone(), start.clone(), start.clone(), start.clone());
    let begun = start.cycle();
    bare.run(begun + CYCLES, &mut ());
    let mut coverage = CodeCoverage::default();
    quick.run(begun + CYCLES, &mut coverage);
    let mut every = Every::default();
    // In slices: an execution that continues in the next slice is counted once.
    for slice in 1..=7 {
        slow.run(begun + CYCLES / 7 * slice, &mut every);
    }
    slow.run(begun + CYCLES, &mut every);
    let mut profile = CycleProfile::new(start.chip(), image, begun);
    // In slices, which must not change a profile.
    for slice in 1..=10 {
        timed.run(begun + CYCLES / 10 * slice, &mut profile);
    }
    profile.finish(timed.cycle());
    assert_eq!(ended(&quick), ended(&bare), "{name}: coverage");
    assert_eq!(ended(&slow), ended(&bare), "{name}: every turn");
    assert_eq!(ended(&timed), ended(&bare), "{name}: profile");
    assert_eq!(seen(&quick, &coverage, image), seen(&slow, &every.coverage, image), "{name}");
    assert_eq!(profile.total_cycles(), timed.cycle() - begun, "{name}");
    let reached = every.coverage.covered_instructions(start.chip(), image);
    let counts: BTreeMap<u32, u64> =
        reached.iter().filter(|one| one.count > 0).map(|one| (one.instruction.pc, one.count)).collect();
    assert_eq!(counts, every.counts, "{name}: every instruction is counted once");
    assert!(!counts.is_empty(), "{name}");
    for one in reached.iter().filter(|one| one.count > 0) {
        let (pc, next) = (one.instruction.pc, one.instruction.pc + one.instruction.len);
        let Some([_, elsewhere]) = one.counts_by_outcome else { continue };
        let seen: u64 = every.ways.range((pc, 0)..(pc + 1, 0)).filter(|(way, _)| way.1 != next).map(|(_, n)| n).sum();
        // The successor before an interrupt or the end is known only to the coverage.
        let unseen = every.interrupted.get(&pc).copied().unwrap_or(0) + u64::from(every.last == Some(pc));
        assert!((seen..=seen + unseen).contains(&elsewhere), "{name} {pc:x}: {elsewhere}, not {seen} and {unseen}");
    }
}

#[test]
fn avr() {
    for (name, source) in programs::PROGRAMS {
        let image = programs::image(source).expect("a program");
        looked_at(name, &Avr::new(&ATMEGA328P, &image, RamInit::Zero), &image);
    }
}

#[test]
fn mcs51() {
    let chip = emu_8051::chips::chip("at89s52").expect("a chip");
    for (name, source) in programs51::programs() {
        let image = emu_asm::assemble_text(chip, &source).expect("a program");
        looked_at(name, &Mcs51::new(chip, &image, RamInit::Zero), &image);
    }
}

#[test]
fn pic16() {
    let chip = emu_pic16::chips::chips().find(|chip| chip.name == "pic16f877a").expect("a chip");
    for name in ["alu", "crc", "ladder", "t1sleep", "tmr0int"] {
        let file = format!("{}/benches/programs_pic/{name}.hex", env!("CARGO_MANIFEST_DIR"));
        let bytes = std::fs::read(&file).expect("an image");
        let image = load_hex(&file, &bytes, chip.hex_spaces).expect("a program").image;
        looked_at(name, &Pic16::new(chip, &image, RamInit::Zero), &image);
    }
}

#[test]
fn ap101() {
    let chip = emu_ap101::chips::chips().next().expect("a chip");
    let file = format!("{}/tests/cli/in/ton101.hex", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&file).expect("an image");
    let image = load_hex(&file, &bytes, chip.hex_spaces).expect("a program").image;
    looked_at("ton101", &Ap101::new(&image), &image);
}

/// The conditional instructions of each family, as the tables list them.
#[test]
fn conditional_instructions_are_these() {
    let of = |chip: &emu_core::Chip| {
        let rows = chip.isa.rows.iter().enumerate().filter(|(row, _)| (chip.isa.flow)(*row) == FlowKind::Conditional);
        let mut names: Vec<&str> = rows.map(|(_, row)| row.mnemonic).collect();
        names.dedup();
        names.join(" ")
    };
    let mcs51 = emu_8051::chips::chip("8051").expect("a chip");
    assert_eq!(of(mcs51), "jc jnc jb jnb jbc jz jnz cjne djnz");
    assert_eq!(of(&emu_pic16::chips::PIC16F873.chip), "decfsz incfsz btfsc btfss");
    assert_eq!(of(emu_ap101::chips::chips().next().expect("a chip")), "jmpc");
    let skips = "cpse sbrc sbrs sbic sbis";
    let branches = "brcs breq brmi brvs brlt brhs brts brie brcc brne brpl brvc brge brhc brtc brid";
    assert_eq!(of(&ATMEGA328P), format!("{skips} {branches}"));
}

/// Pages of tracefiles of an ELF file, a listing and a ladder program.
#[test]
#[ignore = "needs genhtml of lcov"]
fn genhtml_reads_the_tracefiles() {
    use std::process::Command;
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("genhtml");
    _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    for name in ["lines.elf", "lines.c", "lines.h", "press.hex", "blinker.ld"] {
        let from = format!("{}/tests/cli/in/{name}", env!("CARGO_MANIFEST_DIR"));
        std::fs::copy(from, folder.join(name)).expect("a copy");
    }
    std::fs::write(folder.join("twice.S"), "\n\n\n\n\n\n").expect("a stand-in for the source");
    let emu = |line: &str| {
        let done = Command::new(env!("CARGO_BIN_EXE_emu")).args(line.split(' ')).current_dir(&folder).output();
        let done = done.expect("emu starts");
        assert!(done.status.success(), "{line}: {}", String::from_utf8_lossy(&done.stderr));
    };
    emu("compile blinker.ld --mcu atmega328p --map blinker.json");
    emu("run lines.elf --mcu atmega328p --coverage lines.info");
    emu("run press.hex --mcu atmega328p --set PD2=1 --coverage press.info");
    emu("run blinker.hex --mcu atmega328p --for 1s --coverage blinker.info --map blinker.json --ladder blinker.ld");
    for (name, wanted) in [("lines", "9 of 9 lines"), ("press", "5 of 6 lines"), ("blinker", "8 of 8 lines")] {
        let args = ["--branch-coverage", "-o", "pages", &format!("{name}.info")];
        let made = Command::new("genhtml").args(args).current_dir(&folder).output().expect("genhtml starts");
        let said = String::from_utf8_lossy(&made.stdout);
        assert!(made.status.success(), "{name}: {said}{}", String::from_utf8_lossy(&made.stderr));
        assert!(said.contains(wanted), "{name}: {said}");
    }
}
