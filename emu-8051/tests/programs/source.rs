//! Reads programs as text, with the levels that drive their pins.
//!
//! A program begins with `== name`. Then follow directives and instructions, one per line:
//!
//! - `chip NAME [x2] [ea-low] [von-neumann] [now] [access]`: the chip (default 8052), its wiring, and the
//!   alternative readings of the manual (flags polled now, interrupts held after any access of IE or IP);
//! - `drive PIN 20L 30H 40F`: levels from outside, each from a cycle on;
//! - `0x30:` continues at an address, `name:` is a label, `text*3` repeats a line three times; `;` begins a
//!   comment.
//!
//! Every `-- {a|b} rest` is a case: `$1`, `$2` in the program and in the rest are replaced by a, b. Lines
//! after it that begin with three blanks continue it. `#` begins a comment line.

use emu_8051::{Mcs51, Mcs51Readings, Options, chips};
use emu_core::image::{Image, Segment};
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::{Chip, Cpu, RamInit};
use std::collections::BTreeMap;

/// One program on its chip.
pub struct Program {
    pub name: String,
    chip: String,
    options: Options,
    drives: Vec<(u64, PinId, PinLevel)>,
    image: Image,
}

impl Program {
    /// The chip after power-up, with its drives queued.
    pub fn machine(&self) -> Mcs51 {
        let chip = chips::chip(&self.chip).unwrap_or_else(|| panic!("{}: no chip {}", self.name, self.chip));
        let mut mcs51 = Mcs51::with(chip, &self.image, RamInit::Zero, self.options);
        for &(at, pin, level) in &self.drives {
            mcs51.drive(CycleTime::at(at), pin, level);
        }
        mcs51
    }
}

/// A pin by its name, such as `P3.2` or `RST`.
pub fn pin(text: &str) -> Option<PinId> {
    if text == "RST" {
        return Some(32);
    }
    let (port, bit) = text.strip_prefix('P')?.split_once('.')?;
    let (port, bit) = (port.parse::<PinId>().ok()?, bit.parse::<PinId>().ok()?);
    (port < 4 && bit < 8).then_some(port * 8 + bit)
}

/// A level by its letter.
pub fn level(letter: &str) -> Option<PinLevel> {
    [("L", PinLevel::Low), ("H", PinLevel::High), ("F", PinLevel::Float)].iter().find(|l| l.0 == letter).map(|l| l.1)
}

/// Parses an edge `20L` or `20.4H`: cycle, clock, level.
pub fn edge(text: &str) -> Option<(CycleTime, PinLevel)> {
    let (at, letter) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let (cycle, phase) = at.split_once('.').unwrap_or((at, "0"));
    Some((CycleTime { cycle: cycle.parse().ok()?, phase: phase.parse().ok()? }, level(letter)?))
}

/// All cases of a text: name, program and rest.
pub fn texts(text: &str) -> Vec<(String, String, String)> {
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
            all.push((name, fill(&source.join("\n")), fill(case)));
        }
    }
    all
}

/// Parses a number, decimal or with 0x.
pub fn number(name: &str, text: &str) -> u64 {
    let hex = text.strip_prefix("0x").map(|h| u64::from_str_radix(h, 16));
    hex.unwrap_or_else(|| text.parse()).unwrap_or_else(|_| panic!("{name}: {text} is not a number"))
}

/// Reads a program and returns it with its labels.
pub fn program(name: &str, source: &str) -> (Program, BTreeMap<String, u32>) {
    let mut program = Program {
        name: name.to_owned(),
        chip: "8052".to_owned(),
        options: Options::default(),
        drives: vec![],
        image: Image::default(),
    };
    let mut lines = Vec::new();
    for line in source.lines().map(|l| l.split(';').next().unwrap_or("").trim()).filter(|l| !l.is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["chip", chip, ref wiring @ ..] => {
                let is = |word: &str| wiring.contains(&word);
                program.chip = chip.to_owned();
                program.options = Options {
                    von_neumann: is("von-neumann"),
                    ea: !is("ea-low"),
                    x2: is("x2"),
                    readings: Mcs51Readings {
                        samples_interrupt_at_once: is("now"),
                        read_holds_interrupts: is("access"),
                    },
                };
            }
            ["drive", wire, ref edges @ ..] => {
                let pin = pin(wire).unwrap_or_else(|| panic!("{name}: no pin {wire}"));
                for text in edges {
                    let (at, level) = edge(text).unwrap_or_else(|| panic!("{name}: no edge {text}"));
                    program.drives.push((at.cycle, pin, level));
                }
            }
            _ => lines.push(line.to_owned()),
        }
    }
    program.drives.sort_by_key(|drive| drive.0);
    let mut labels = BTreeMap::new();
    let chip = chips::chip(&program.chip).unwrap_or_else(|| panic!("{name}: no chip {}", program.chip));
    let bytes = assemble(name, chip, &lines, &mut labels);
    program.image.segments.push(Segment { space: "code", addr: 0, bytes });
    (program, labels)
}

/// Assembles a program. Returns its bytes from address 0 on, with zeros in gaps, and adds its labels.
fn assemble(name: &str, chip: &'static Chip, lines: &[String], labels: &mut BTreeMap<String, u32>) -> Vec<u8> {
    let mut text = String::new();
    for line in lines {
        let mut line = line.as_str();
        while let Some((label, rest)) = line.split_once(':') {
            let place = if label.starts_with("0x") { format!(".org {label}\n") } else { format!("{label}:\n") };
            text += &place;
            line = rest.trim();
        }
        let (line, times) = line.split_once('*').map_or((line, 1), |(l, n)| (l.trim(), number(name, n.trim())));
        (0..times).for_each(|_| text += &format!(" {line}\n"));
    }
    let image = emu_asm::assemble_text(chip, &text).unwrap_or_else(|e| panic!("{name}:\n{e}"));
    labels.extend(image.symbols.iter().map(|symbol| (symbol.name.clone(), symbol.addr)));
    let mut bytes = vec![0; image.end("code") as usize];
    image.fill("code", &mut bytes);
    bytes
}
