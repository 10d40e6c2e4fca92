//! Programs as text, with the drives of their pins and the expectations; this module reads them, its users
//! check them.
//!
//! A program starts with `== name`. Then directives and instructions follow, one per line:
//!
//! - `chip NAME`: the chip (default pic16f873); `config HEX`: its configuration word (default 3F3B: RC
//!   oscillator, all else off); `hz N`: the oscillator (4,000,000); `start-up`: the start-up timers run;
//!   `corner min|typ|max`;
//! - `drive PIN 20L 30.2H 40F`: levels from outside, each from a cycle and clock on; `until N`: the end of
//!   the run (default 2000);
//! - `volts PIN 0=1500 90=2000`, `supply 20=3500`: voltages of a pin and of the supply, by cycle in
//!   millivolts;
//! - `0x30:` continues at an address, `name:` is a label, `text*3` repeats a line three times; `;` starts a
//!   comment. Registers and bits have the names of the chip.
//!
//! Every `-- {a|b} wanted; wanted` is a case: `$1`, `$2` in the program and in the expectations are replaced
//! by a, b. Lines after it that start with three blanks continue it. `#` starts a comment line.

use std::collections::BTreeMap;

use emu_core::image::{Image, Segment};
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::{Cpu, RamInit};
use emu_pic16::chips::{self, Pic16Part};
use emu_pic16::{Options, Pic16, TimingCorner};

/// A program, its chip, and its inputs from outside.
pub struct Program {
    pub part: &'static Pic16Part,
    pub options: Options,
    pub labels: BTreeMap<String, u32>,
    pub until: u64,
    image: Image,
    drives: Vec<(CycleTime, PinId, PinLevel)>,
    /// Voltages of pins by cycle, in millivolts.
    volts: Vec<(u64, PinId, u32)>,
    /// Supply voltage by cycle, in millivolts.
    supply: Vec<(u64, u32)>,
}

/// One case of a program.
pub struct Case {
    pub name: String,
    pub program: Program,
    pub wanted: Vec<String>,
}

/// Returns a pin by its name.
pub fn pin(part: &Pic16Part, name: &str) -> Option<PinId> {
    part.chip.pins.iter().position(|pin| pin.name == name).map(|at| at as PinId)
}

/// Returns the address of a register by its name.
pub fn register(part: &Pic16Part, name: &str) -> Option<u16> {
    part.chip.regs.iter().find(|reg| reg.name == name).map(|reg| reg.addr)
}

/// Parses `20` or `20.3`: cycle and clock.
pub fn moment(text: &str) -> Option<CycleTime> {
    let (cycle, phase) = text.split_once('.').unwrap_or((text, "0"));
    Some(CycleTime { cycle: cycle.parse().ok()?, phase: phase.parse().ok()? })
}

/// Parses `20L` or `20.3H`: moment and level.
fn edge(text: &str) -> Option<(CycleTime, PinLevel)> {
    let (at, letter) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let level = [("L", PinLevel::Low), ("H", PinLevel::High), ("F", PinLevel::Float)].iter().find(|l| l.0 == letter)?.1;
    Some((moment(at)?, level))
}

/// Returns all cases of a text.
pub fn cases(text: &str) -> Vec<Case> {
    let mut all = Vec::new();
    for part in format!("\n{text}").split("\n== ").skip(1) {
        let (name, rest) = part.split_once('\n').expect("a name line");
        let mut source = Vec::new();
        let mut wanted: Vec<String> = Vec::new();
        for line in rest.lines().filter(|line| !line.starts_with('#')) {
            match (line.strip_prefix("-- "), wanted.last_mut()) {
                (Some(case), _) => wanted.push(case.to_owned()),
                (None, Some(case)) => *case = format!("{case} {}", line.trim()),
                (None, None) => source.push(line),
            }
        }
        assert!(!wanted.is_empty(), "{name}: nothing is wanted");
        for case in wanted {
            let (values, case) = match case.strip_prefix('{').and_then(|c| c.split_once('}')) {
                Some((values, case)) => (values.split('|').map(str::trim).collect(), case),
                None => (vec![], case.as_str()),
            };
            let fill = |text: &str| {
                values.iter().enumerate().fold(text.to_owned(), |t, (i, v)| t.replace(&format!("${}", i + 1), v))
            };
            let name = if values.is_empty() { name.to_owned() } else { format!("{name} {{{}}}", values.join("|")) };
            let wanted = fill(case);
            all.push(Case {
                program: Program::new(&name, &fill(&source.join("\n"))),
                wanted: wanted.split(';').map(|w| w.trim().to_owned()).filter(|w| !w.is_empty()).collect(),
                name,
            });
        }
    }
    all
}

impl Program {
    /// Creates a program from its lines, directives and instructions; `name` is for messages.
    pub fn new(name: &str, source: &str) -> Program {
        let mut program = Program {
            part: &chips::PIC16F873,
            options: Options { config: Some(0x3F3B), start_up: false, ..Options::default() },
            labels: BTreeMap::new(),
            until: 2000,
            image: Image::default(),
            drives: vec![],
            volts: vec![],
            supply: vec![],
        };
        let mut lines = Vec::new();
        for line in source.lines().map(|l| l.split(';').next().unwrap_or("").trim()).filter(|l| !l.is_empty()) {
            if !program.directive(name, line) {
                lines.push(line.to_owned());
            }
        }
        let bytes = assemble(name, program.part, &lines, &mut program.labels);
        program.image.segments.push(Segment { space: "flash", addr: 0, bytes });
        program
    }

    /// Executes a directive; returns false if the line is an instruction.
    fn directive(&mut self, name: &str, line: &str) -> bool {
        let words: Vec<&str> = line.split_whitespace().collect();
        let wire = |wire: &str| pin(self.part, wire).unwrap_or_else(|| panic!("{name}: no pin {wire}"));
        let millivolts = |text: &str| {
            let (at, value) = text.split_once('=').unwrap_or_else(|| panic!("{name}: {text} is not a voltage"));
            (number(name, at), number(name, value) as u32)
        };
        match words[..] {
            ["chip", chip] => self.part = chips::part(chip).unwrap_or_else(|| panic!("{name}: no chip {chip}")),
            ["config", word] => self.options.config = Some(number(name, &format!("0x{word}")) as u16),
            ["hz", hz] => self.options.hz = number(name, hz),
            ["start-up"] => self.options.start_up = true,
            ["corner", corner] => {
                let corners = [("min", TimingCorner::Min), ("typ", TimingCorner::Typ), ("max", TimingCorner::Max)];
                let found = corners.iter().find(|c| c.0 == corner);
                self.options.corner = found.unwrap_or_else(|| panic!("{name}: no corner {corner}")).1;
            }
            ["until", n] => self.until = number(name, n),
            ["drive", on, ref edges @ ..] => {
                let on = wire(on);
                let edge = |text: &&str| edge(text).unwrap_or_else(|| panic!("{name}: no edge {text}"));
                self.drives.extend(edges.iter().map(edge).map(|(at, level)| (at, on, level)));
            }
            ["volts", on, ref voltages @ ..] => {
                let on = wire(on);
                self.volts.extend(voltages.iter().map(|text| millivolts(text)).map(|(at, volts)| (at, on, volts)));
            }
            ["supply", ref voltages @ ..] => self.supply.extend(voltages.iter().map(|text| millivolts(text))),
            _ => return false,
        }
        true
    }

    /// Returns the chip after power-up, with the inputs from outside queued.
    pub fn machine(&self) -> Pic16 {
        let mut pic = Pic16::with(&self.part.chip, &self.image, RamInit::Zero, self.options);
        for &(at, pin, level) in &self.drives {
            pic.drive(at, pin, level);
        }
        for &(at, pin, millivolts) in &self.volts {
            assert!(pic.drive_volts(CycleTime::at(at), pin, millivolts), "pin {pin} takes no voltage");
        }
        for &(at, millivolts) in &self.supply {
            assert!(pic.set_supply(CycleTime::at(at), millivolts), "no supply");
        }
        pic
    }
}

fn number(name: &str, text: &str) -> u64 {
    let hex = text.strip_prefix("0x").map(|h| u64::from_str_radix(h, 16));
    hex.unwrap_or_else(|| text.parse()).unwrap_or_else(|_| panic!("{name}: {text} is not a number"))
}

/// Returns the program's bytes from address 0 on, with zeros in gaps, and its labels by word address.
fn assemble(name: &str, part: &'static Pic16Part, lines: &[String], labels: &mut BTreeMap<String, u32>) -> Vec<u8> {
    let mut text = String::from(" radix dec\n");
    for line in lines {
        let mut line = line.as_str();
        while let Some((label, rest)) = line.split_once(':') {
            let place = if label.starts_with("0x") { format!(" org {label}\n") } else { format!("{label}:\n") };
            text += &place;
            line = rest.trim();
        }
        let (line, times) = line.split_once('*').map_or((line, 1), |(l, n)| (l.trim(), number(name, n.trim())));
        (0..times).for_each(|_| text += &format!(" {line}\n"));
    }
    let image = emu_asm::assemble_text(&part.chip, &text).unwrap_or_else(|e| panic!("{name}:\n{e}"));
    labels.extend(image.symbols.iter().map(|symbol| (symbol.name.clone(), symbol.addr / 2)));
    let mut bytes = vec![0; image.end("flash") as usize];
    image.fill("flash", &mut bytes);
    bytes
}
