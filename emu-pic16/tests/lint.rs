//! Tests the diagnostics of the PIC16 with the cases in `lint.txt`: a program, and every lint that it reports
//! with its cycle.

use emu_core::cpu::{Cpu, Probe, RamInit, StopReason};
use emu_core::image::Image;
use emu_core::lint::{LINT_CODES, Lint};
use emu_core::pins::{CycleTime, PinLevel};
use emu_pic16::chips::PIC16F873;
use emu_pic16::{Options, Pic16};
use emu_test_support::case_lines;

/// Configuration word: no watchdog, no low-voltage programming, a crystal.
const CONFIG: u16 = 0x3F31;

#[derive(Default)]
struct Seen(Vec<String>);

impl Probe for Seen {
    const LINT: bool = true;

    fn on_lint(&mut self, at: u64, pc: u32, lint: Lint) {
        let more = match lint {
            Lint::EarlyConversion { channel } => format!(" {channel}"),
            Lint::AnalogRead { port, bits } | Lint::UnintendedLatchChange { port, bits } => {
                format!(" {port:02X} {bits:02X}")
            }
            Lint::PageNotSelected { target } => format!(" {target:04X}"),
            Lint::NotSaved { register } => format!(" {register}"),
            Lint::UnwrittenRead { addr, .. } => format!(" {addr:02X}"),
            _ => String::new(),
        };
        self.0.push(format!("{at} {pc:04X} {}{more}", lint.code()));
    }
}

fn image(program: &str) -> Image {
    let lines = program.replace(';', "\n");
    emu_asm::assemble_text(&PIC16F873.chip, &lines).unwrap_or_else(|e| panic!("{program}: {e}"))
}

/// Returns the machine of a case, and the length of its run in cycles.
fn machine(program: &str, wiring: &str) -> (Pic16, u64) {
    let options = Options { config: Some(CONFIG), start_up: false, ..Options::default() };
    let mut pic = Pic16::with(&PIC16F873.chip, &image(program), RamInit::Zero, options);
    let (mut pins, mut cycles) = (Vec::new(), 40);
    for word in wiring.split_whitespace() {
        match word.split_once('=').expect("a level or a number") {
            ("for", number) => cycles = number.parse().expect("cycles"),
            (pin, level) => pins.push((pin, if level == "1" { PinLevel::High } else { PinLevel::Low })),
        }
    }
    for (pin, level) in pins {
        let pin = pic.chip().pin(pin).expect("a pin");
        pic.drive(CycleTime::default(), pin, level);
    }
    (pic, cycles)
}

/// Returns the state that a program could see.
fn state(pic: &Pic16) -> (u64, u32, Vec<Option<u8>>) {
    (pic.cycle(), pic.pc(), (0..0x200).map(|addr| pic.peek("data", addr)).collect())
}

#[test]
fn lints() {
    let (mut wrong, mut fired) = (Vec::new(), Vec::new());
    for line in case_lines(include_str!("lint.txt")) {
        let columns: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, program, wiring, wanted] = columns[..] else { panic!("four columns wanted: {line}") };
        let (start, cycles) = machine(program, wiring);

        let (mut pic, mut seen) = (start.clone(), Seen::default());
        pic.run(cycles, &mut seen);
        let found = seen.0.join("; ");
        if found != wanted {
            wrong.push(format!("{line}\n    found {found}"));
        }
        fired.extend(seen.0);

        // The reports are the same if the run is cut into single cycles, and no diagnostic changes the
        // machine.
        let (mut steps, mut seen) = (start.clone(), Seen::default());
        _ = (1..=cycles).any(|until| steps.run(until, &mut seen) == StopReason::Halted);
        let mut plain = start;
        plain.run(cycles, &mut ());
        if seen.0.join("; ") != found || state(&steps) != state(&pic) || state(&plain) != state(&pic) {
            wrong.push(format!("{line}\n    differs when it is cut or not looked at"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Codes that the core does not report are reported by tools; LINT009 to LINT019 are for other families.
    let silent = |code: &str| fired.iter().all(|seen| !seen.contains(code));
    let codes = LINT_CODES.iter().map(|row| row.code).filter(|&code| code < "LINT009" || code == "LINT022");
    let silent: Vec<&str> = codes.filter(|code| silent(code)).collect();
    assert_eq!(silent, [Lint::UnwrittenRead { space: "data", addr: 0 }.code()]);
}
