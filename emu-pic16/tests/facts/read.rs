//! Facts as text: programs, how they are run, what they are to show.

use std::collections::BTreeMap;

use emu_core::image::{Image, Segment};
use emu_core::pins::{Level, PinId, Time};
use emu_pic16::chips::{self, Part};
use emu_pic16::{Corner, Options, isa};

/// A fact.
pub struct Fact {
    pub name: String,
    pub runs: Vec<Run>,
    pub want: String,
}

/// A program and how it is run.
pub struct Run {
    pub name: String,
    pub part: &'static Part,
    pub options: Options,
    pub image: Image,
    pub labels: BTreeMap<String, u32>,
    pub drives: Vec<(Time, PinId, Level)>,
    /// Supply by cycle, in millivolts.
    pub supply: Vec<(u64, u32)>,
    pub until: u64,
    /// Bits by the text that names them: address and number.
    pub watched: Vec<(String, u16, u8)>,
    pub show: String,
}

/// All facts of a text.
pub fn facts(text: &str) -> Vec<Fact> {
    format!("\n{text}").split("\n== ").skip(1).map(fact).collect()
}

fn fact(text: &str) -> Fact {
    let (name, body) = text.split_once('\n').expect("a fact has a body");
    let body: Vec<&str> =
        body.lines().map(|l| l.split(';').next().unwrap_or("").trim()).filter(|l| !l.is_empty()).collect();
    let line = |key: &str| body.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
    let each: Vec<&str> = line("each").map_or_else(|| vec!["$"], |values| values.split_whitespace().collect());
    let runs = each.iter().map(|value| run(name, &body, value)).collect();
    Fact { name: name.to_owned(), runs, want: line("want").unwrap_or_else(|| panic!("{name}: want")).to_owned() }
}

/// A number as programs write it.
fn number(name: &str, text: &str) -> u64 {
    let hex = text.strip_prefix("0x").map(|h| u64::from_str_radix(h, 16));
    hex.unwrap_or_else(|| text.parse()).unwrap_or_else(|_| panic!("{name}: {text} is no number"))
}

/// `20`, `20.3`: cycle and clock.
pub fn moment(text: &str) -> Option<Time> {
    let (cycle, phase) = text.split_once('.').unwrap_or((text, "0"));
    Some(Time { cycle: cycle.parse().ok()?, phase: phase.parse().ok()? })
}

/// A pin by its name.
pub fn pin(part: &Part, name: &str) -> Option<PinId> {
    part.chip.pins.iter().position(|pin| pin.name == name).map(|at| at as PinId)
}

/// A register by its name: its address.
pub fn register(part: &Part, name: &str) -> Option<u16> {
    part.chip.regs.iter().find(|reg| reg.name == name).map(|reg| reg.addr)
}

fn run(name: &str, body: &[&str], value: &str) -> Run {
    let mut run = Run {
        name: name.to_owned(),
        part: &chips::PIC16F873,
        options: Options { config: Some(0x3F3B), start_up: false, ..Options::default() },
        image: Image::default(),
        labels: BTreeMap::new(),
        drives: Vec::new(),
        supply: Vec::new(),
        until: 2000,
        watched: Vec::new(),
        show: String::new(),
    };
    let mut program = Vec::new();
    for line in body {
        let line = line.replace('$', value);
        let (key, rest) = line.split_once(' ').unwrap_or((&line, ""));
        match key {
            "each" | "want" => {}
            "chip" => run.part = chips::part(rest).unwrap_or_else(|| panic!("{name}: no chip {rest}")),
            "config" => run.options.config = Some(number(name, rest) as u16),
            "hz" => run.options.hz = number(name, rest),
            "start-up" => run.options.start_up = true,
            "until" => run.until = number(name, rest),
            "show" => rest.clone_into(&mut run.show),
            "corner" => {
                let corners = [("min", Corner::Min), ("typ", Corner::Typ), ("max", Corner::Max)];
                run.options.corner = corners.iter().find(|c| c.0 == rest).unwrap_or_else(|| panic!("{name}: {rest}")).1;
            }
            "watch" => {
                let (reg, bit) = rest.split_once('.').unwrap_or_else(|| panic!("{name}: {line}"));
                let addr = register(run.part, reg).unwrap_or_else(|| panic!("{name}: {line}"));
                run.watched.push((rest.to_owned(), addr, number(name, bit) as u8));
            }
            "drive" => drives(name, &mut run, rest),
            "supply" => {
                for word in rest.split_whitespace() {
                    let (at, millivolts) = word.split_once('=').unwrap_or_else(|| panic!("{name}: {word}"));
                    run.supply.push((number(name, at), number(name, millivolts) as u32));
                }
            }
            _ => program.push(line),
        }
    }
    let words = assemble(&mut run, &program);
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    run.image.segments.push(Segment { space: "flash", addr: 0, bytes });
    run
}

fn drives(name: &str, run: &mut Run, text: &str) {
    let mut words = text.split_whitespace();
    let wire = words.next().and_then(|wire| pin(run.part, wire)).unwrap_or_else(|| panic!("{name}: {text}"));
    for word in words {
        let (at, level) = word.split_at(word.len() - 1);
        let level = match level {
            "L" => Level::Low,
            "H" => Level::High,
            "F" => Level::Float,
            _ => panic!("{name}: {word}"),
        };
        run.drives.push((moment(at).unwrap_or_else(|| panic!("{name}: {word}")), wire, level));
    }
}

/// Two passes: where the labels lie, and then the words.
fn assemble(run: &mut Run, program: &[String]) -> Vec<u16> {
    let mut words = Vec::new();
    for pass in 0..2 {
        words.clear();
        for line in program {
            let mut line = line.as_str();
            while let Some((label, rest)) = line.split_once(':') {
                if label.starts_with("0x") {
                    let at = number(&run.name, label) as usize;
                    assert!(at >= words.len(), "{}: {label} lies below what is there", run.name);
                    words.resize(at, 0);
                } else {
                    run.labels.insert(label.to_owned(), words.len() as u32);
                }
                line = rest.trim();
            }
            let (line, times) =
                line.split_once('*').map_or((line, 1), |(line, n)| (line.trim(), number(&run.name, n.trim())));
            for _ in 0..if line.is_empty() { 0 } else { times } {
                words.push(instruction(run, line, words.len() as u32, pass == 0));
            }
        }
    }
    words
}

/// The word of a line; while labels are unknown they are 0.
fn instruction(run: &Run, line: &str, pc: u32, labels_unknown: bool) -> u16 {
    let (mnemonic, operands) = line.split_once(' ').unwrap_or((line, ""));
    let target = matches!(mnemonic, "goto" | "call");
    let named = |word: &str| {
        let bit = run.part.bits.iter().find(|bit| bit.1 == word).map(|bit| u32::from(bit.2));
        let label = run.labels.get(word).copied().or((target && labels_unknown).then_some(0));
        label.or(register(run.part, word).map(u32::from)).or(bit)
    };
    let operands: Vec<String> = operands
        .split(',')
        .map(|word| named(word.trim()).map_or_else(|| word.trim().to_owned(), |value| format!("0x{value:X}")))
        .collect();
    let text = format!("{mnemonic} {}", operands.join(", "));
    isa::assemble(text.trim(), pc).unwrap_or_else(|e| panic!("{}: {line}: {e}", run.name))[0]
}
