//! Tests the diagnostics of the AVR with the cases in `lint/programs.txt`: a program, and every lint that it
//! reports with its cycle.

use emu_avr::{Avr, Options, chips};
use emu_core::cpu::{Cpu, Probe, RamInit, StopReason};
use emu_core::image::{Image, Segment, SymbolAt};
use emu_core::lint::{LINT_CODES, Lint};
use emu_core::pins::{CycleTime, PinLevel};
use emu_core::rng::Rng;
use emu_test_support::case_lines;

#[derive(Default)]
struct Seen(Vec<String>);

impl Probe for Seen {
    const LINT: bool = true;

    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        let more = match lint {
            Lint::UnwrittenUse { addr, .. } | Lint::UnimplementedAddress { addr } => format!("{addr:X}"),
            Lint::StackCollision { limit } => format!("{limit:X}"),
            Lint::ReservedBits { addr, bits } => format!("{addr:X}/{bits:02X}"),
            Lint::FloatingRead { port, bits } => format!("{port:X}/{bits:02X}"),
            Lint::Baud { uart, baud } => format!("{uart}/{baud}"),
            Lint::TakenWithoutHandler { vector } | Lint::EnabledWithoutHandler { vector } => vector.to_string(),
            Lint::CaptureWritten { addr } => format!("{addr:X}"),
            Lint::WokenByEdge { int } => format!("INT{int}"),
            Lint::MissingChannel { channel } => format!("ADC{channel}"),
            other => panic!("{other:?}"),
        };
        self.0.push(format!("{at} {:X} {} {more}", 2 * pc, lint.code()));
    }
}

fn hex(text: &str) -> u32 {
    u32::from_str_radix(text, 16).unwrap_or_else(|_| panic!("{text}: no number"))
}

/// Returns the machine of a case, and the length of its run in cycles.
fn machine(chip: &str, program: &str, wiring: &str) -> (Avr, u64) {
    let chip = chips::chip(&format!("atmega{chip}")).unwrap_or_else(|| panic!("no atmega{chip}"));
    let lines = program.replace(';', "\n");
    let mut image = emu_asm::assemble_text(chip, &lines).unwrap_or_else(|e| panic!("{program}: {e}"));
    let (mut drives, mut cycles, mut options) = (Vec::new(), 100, Options::at_hz(16_000_000));
    for word in wiring.split_whitespace() {
        match word.split_once('=').expect("a level or a number") {
            ("for", number) => cycles = number.parse().expect("cycles"),
            ("hz", number) => options.hz = number.parse().expect("a clock"),
            ("package", name) => options.package = chip.package(name).map(|package| package.name),
            ("int-wake", how) => options.readings.edges_wake = Some(how == "edge"),
            ("icr-write", which) => options.readings.icr_only_as_top = which == "top",
            ("fill", addr) => image.segments.push(Segment { space: "data", addr: hex(addr), bytes: vec![0] }),
            (name, addr) if name.starts_with('_') => {
                image.symbols.push(SymbolAt::new(name, "data", hex(addr), 0));
            }
            (pin, level) => {
                let level = match level {
                    "1" => PinLevel::High,
                    "0" => PinLevel::Low,
                    "up" => PinLevel::PullUp,
                    other => panic!("{other}: no level"),
                };
                let (at, pin) = pin.split_once(':').unwrap_or(("0", pin));
                let pin = chip.pin(pin).unwrap_or_else(|| panic!("no {pin}"));
                drives.push((CycleTime::at(at.parse().expect("a cycle")), pin, level));
            }
        }
    }
    let mut avr = Avr::with(chip, &image, RamInit::Zero, options);
    for (at, pin, level) in drives {
        avr.drive(at, pin, level);
    }
    (avr, cycles)
}

/// Returns the state that a program could see.
fn state(avr: &Avr) -> (u64, u32, Vec<Option<u8>>) {
    (avr.cycle(), avr.pc(), (0..0x300).map(|addr| avr.peek("data", addr)).collect())
}

#[test]
fn lints() {
    let (mut wrong, mut fired, mut count) = (Vec::new(), Vec::new(), 0);
    for line in case_lines(include_str!("lint/programs.txt")) {
        let columns: Vec<&str> = line.split('|').map(str::trim).collect();
        let [chip, program, wiring, wanted] = columns[..] else { panic!("four columns wanted: {line}") };
        let (start, cycles) = machine(chip, program, wiring);
        count += 1;

        let (mut avr, mut seen) = (start.clone(), Seen::default());
        avr.run(cycles, &mut seen);
        let found = seen.0.join("; ");
        if found != wanted {
            wrong.push(format!("{line}\n    found {found}"));
        }
        fired.extend(seen.0);

        // The reports are the same if the run is cut into single cycles, and no diagnostic changes the
        // machine.
        let (mut steps, mut seen) = (start.clone(), Seen::default());
        _ = (1..=cycles).any(|until| steps.run(until, &mut seen) != StopReason::Limit);
        let mut plain = start;
        plain.run(cycles, &mut ());
        if seen.0.join("; ") != found || state(&steps) != state(&avr) || state(&plain) != state(&avr) {
            wrong.push(format!("{line}\n    differs when it is cut or not looked at: {}", seen.0.join("; ")));
        }
    }
    assert!(count > 100, "only {count} cases were read");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Every code of the family is reported by some case.
    let silent = |code: &&str| fired.iter().all(|seen| !seen.contains(code));
    let ours = LINT_CODES
        .iter()
        .map(|row| row.code)
        .filter(|&code| ["LINT007", "LINT020", "LINT021"].contains(&code) || ("LINT009"..="LINT015").contains(&code));
    assert_eq!(ours.filter(silent).collect::<Vec<_>>(), Vec::<&str>::new());
}

/// A probe that is attached later does not know earlier writes, so it reports nothing about them.
#[test]
fn what_ran_before_counts_as_written() {
    let program = "ldi r16,1; nop; add r17,r16; out 0x05,r17; lds r18,0x100; out 0x05,r18; rjmp 0x0010";
    let (mut avr, _) = machine("328p", program, "");
    avr.run(1, &mut ());
    let mut seen = Seen::default();
    avr.run(100, &mut seen);
    assert!(seen.0.is_empty(), "{:?}", seen.0);
}

#[test]
fn whatever_runs_is_looked_at_and_nothing_changes() {
    for seed in 0..40 {
        let mut rng = Rng::new(seed);
        let part = chips::AVR_PARTS[rng.below(chips::AVR_PARTS.len() as u64) as usize];
        let mut bytes = vec![0; part.chip.flash_bytes as usize];
        rng.fill(&mut bytes);
        // This makes vectors, stack pointer and I/O registers occur more often.
        for pair in bytes.chunks_exact_mut(2) {
            let word: u16 = match rng.below(8) {
                0 => 0xB800 | rng.below(0x800) as u16,
                1 => 0x9200 | rng.below(0x400) as u16,
                2 => [0xBFCD, 0xBFDE, 0xB7CD, 0xB7DE, 0x9478, 0x9508, 0x9518, 0x9722][rng.below(8) as usize],
                _ => continue,
            };
            pair.copy_from_slice(&word.to_le_bytes());
        }
        let symbol = |name: &str, addr| SymbolAt::new(name, "data", addr, 2);
        let symbols = vec![symbol("_end", rng.below(0x1000) as u32), symbol("__brkval", rng.below(0x1_0000) as u32)];
        let segments = vec![Segment { space: "flash", addr: 0, bytes }];
        let image = Image { segments, symbols, ..Image::default() };
        let mut looked_at = Avr::new(part.chip, &image, RamInit::Random(seed));
        let mut plain = looked_at.clone();
        let mut seen = Seen::default();
        for _ in 0..60 {
            // Continues from wherever an illegal word has stopped it.
            let until = looked_at.cycle() + 200;
            let stops = (looked_at.run(until, &mut seen), plain.run(until, &mut ()));
            assert_eq!((stops.0, state(&looked_at)), (stops.1, state(&plain)), "seed {seed}, {}", part.chip.name);
            let pc = rng.below(0x4000) as u32;
            looked_at.set_pc(pc);
            plain.set_pc(pc);
        }
    }
}

#[test]
fn a_reset_leaves_ram_as_unknown_as_it_was() {
    let program = "sts 0x100,r1; lds r16,0x100; out 0x05,r16; rjmp 0x000A";
    let (mut avr, _) = machine("328p", program, "");
    let mut seen = Seen::default();
    avr.run(20, &mut seen);
    avr.reset(emu_core::cpu::ResetCause::External);
    avr.run(50, &mut seen);
    assert_eq!(seen.0, ["4 8 LINT007 1"]);
}
