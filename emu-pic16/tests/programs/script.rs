//! Programs as text, with what drives their pins and what is to be found: read here, judged by those who use it.
//!
//! A program begins with `== name`. Then come, one a line, directives and instructions:
//!
//! - `chip NAME`: the chip (pic16f873 if not said); `config HEX`: its configuration word (3F3B if not said: RC oscillator, all
//!   else off); `hz N`: the oscillator (4,000,000); `start-up`: the start-up timers run; `corner min|typ|max`;
//! - `drive PIN 20L 30.2H 40F`: levels from outside from cycles and clocks on; `until N`: where the run ends (2000
//!   if not said);
//! - `0x30:` goes on at an address, `name:` is a label, `text*3` stands three times; `;` begins a comment. Registers and bits go
//!   by the names of the chip.
//!
//! Every `-- {a|b} wanted; wanted` is a case: `$1`, `$2` in the program and in what is wanted stand for a, b. Lines behind it
//! that begin with three blanks go on with it. `#` begins a line of comment.

use std::collections::BTreeMap;

use emu_core::image::{Image, Segment};
use emu_core::pins::{Level, PinId, Time};
use emu_core::{Cpu, RamInit};
use emu_pic16::chips::{self, Part};
use emu_pic16::{Corner, Options, Pic16, isa};

/// One case of one program.
pub struct Case {
    pub name: String,
    pub part: &'static Part,
    pub options: Options,
    pub drives: Vec<(Time, PinId, Level)>,
    pub until: u64,
    pub labels: BTreeMap<String, u32>,
    pub wanted: Vec<String>,
    image: Image,
}

impl Case {
    /// The chip after power-up, its drives queued.
    pub fn machine(&self) -> Pic16 {
        let mut pic = Pic16::with(&self.part.chip, &self.image, RamInit::Zero, self.options);
        for &(at, pin, level) in &self.drives {
            pic.drive(at, pin, level);
        }
        pic
    }
}

/// A pin by its name.
pub fn pin(part: &Part, name: &str) -> Option<PinId> {
    part.chip.pins.iter().position(|pin| pin.name == name).map(|at| at as PinId)
}

/// A register by its name: its address.
pub fn register(part: &Part, name: &str) -> Option<u16> {
    part.chip.regs.iter().find(|reg| reg.name == name).map(|reg| reg.addr)
}

/// A bit by its name: its number.
fn bit(part: &Part, name: &str) -> Option<u8> {
    part.bits.iter().find(|bit| bit.1 == name).map(|bit| bit.2)
}

/// `20L`, `20.3H`: cycle, clock, level.
pub fn edge(text: &str) -> Option<(Time, Level)> {
    let (at, letter) = text.split_at_checked(text.len().checked_sub(1)?)?;
    let (cycle, phase) = at.split_once('.').unwrap_or((at, "0"));
    let level = [("L", Level::Low), ("H", Level::High), ("F", Level::Float)].iter().find(|l| l.0 == letter)?.1;
    Some((Time { cycle: cycle.parse().ok()?, phase: phase.parse().ok()? }, level))
}

/// All cases of a text.
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
            all.push(build(name, &fill(&source.join("\n")), &fill(case)));
        }
    }
    all
}

fn number(name: &str, text: &str) -> u64 {
    let hex = text.strip_prefix("0x").map(|h| u64::from_str_radix(h, 16));
    hex.unwrap_or_else(|| text.parse()).unwrap_or_else(|_| panic!("{name}: {text} is no number"))
}

fn build(name: String, source: &str, wanted: &str) -> Case {
    let quiet = Options { config: Some(0x3F3B), start_up: false, ..Options::default() };
    let mut case = Case {
        part: &chips::PIC16F873,
        options: quiet,
        drives: vec![],
        until: 2000,
        labels: BTreeMap::new(),
        wanted: wanted.split(';').map(|w| w.trim().to_owned()).filter(|w| !w.is_empty()).collect(),
        image: Image::default(),
        name,
    };
    let mut lines = Vec::new();
    for line in source.lines().map(|l| l.split(';').next().unwrap_or("").trim()).filter(|l| !l.is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["chip", chip] => case.part = chips::part(chip).unwrap_or_else(|| panic!("{}: no chip {chip}", case.name)),
            ["config", word] => case.options.config = Some(number(&case.name, &format!("0x{word}")) as u16),
            ["hz", hz] => case.options.hz = number(&case.name, hz),
            ["start-up"] => case.options.start_up = true,
            ["corner", corner] => {
                let corners = [("min", Corner::Min), ("typ", Corner::Typ), ("max", Corner::Max)];
                let found = corners.iter().find(|c| c.0 == corner);
                case.options.corner = found.unwrap_or_else(|| panic!("{}: no corner {corner}", case.name)).1;
            }
            ["until", n] => case.until = number(&case.name, n),
            ["drive", wire, ref edges @ ..] => {
                let pin = pin(case.part, wire).unwrap_or_else(|| panic!("{}: no pin {wire}", case.name));
                for text in edges {
                    let (at, level) = edge(text).unwrap_or_else(|| panic!("{}: no edge {text}", case.name));
                    case.drives.push((at, pin, level));
                }
            }
            _ => lines.push(line.to_owned()),
        }
    }
    let words = assemble(&case.name, case.part, &lines, &mut case.labels);
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    case.image.segments.push(Segment { space: "flash", addr: 0, bytes });
    case
}

/// Two passes: where the labels lie, and then the words. A target that is not known yet is 0.
fn assemble(name: &str, part: &Part, lines: &[String], labels: &mut BTreeMap<String, u32>) -> Vec<u16> {
    let mut words = Vec::new();
    for pass in 0..2 {
        words.clear();
        for line in lines {
            let mut line = line.as_str();
            while let Some((label, rest)) = line.split_once(':') {
                if label.starts_with("0x") {
                    let at = number(name, label) as usize;
                    assert!(at >= words.len(), "{name}: {label} lies below what is there");
                    words.resize(at, 0);
                } else {
                    labels.insert(label.trim().to_owned(), words.len() as u32);
                }
                line = rest.trim();
            }
            let (line, times) = line.split_once('*').map_or((line, 1), |(l, n)| (l.trim(), number(name, n.trim())));
            for _ in 0..if line.is_empty() { 0 } else { times } {
                let (mnemonic, operands) = line.split_once(' ').unwrap_or((line, ""));
                let known = |word: &str| {
                    let named = register(part, word).map(u32::from).or_else(|| bit(part, word).map(u32::from));
                    match labels.get(word).copied().or(named) {
                        Some(value) => format!("0x{value:X}"),
                        None if pass == 0 && is_label(lines, word) => "0".to_owned(),
                        None => word.to_owned(),
                    }
                };
                let operands: Vec<String> = operands.split(',').map(|word| known(word.trim())).collect();
                let line = format!("{mnemonic} {}", operands.join(", "));
                let pc = words.len() as u32;
                let found = isa::assemble(line.trim(), pc).unwrap_or_else(|e| panic!("{name}: {line}: {e}"));
                words.extend(found);
            }
        }
    }
    words
}

fn is_label(lines: &[String], word: &str) -> bool {
    lines.iter().any(|line| line.split(':').rev().skip(1).any(|label| label.trim() == word))
}
