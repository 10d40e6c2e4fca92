//! Reads programs as text with expectations, and checks them on any machine.
//!
//! A program begins with `== name`; then its lines follow (see `asm`). Every `-- {a|b} item ; item` is a case
//! of it: `$1`, `$2` in the program and the items are replaced by a, b. Lines after it that begin with three
//! blanks continue it; `#` begins a comment. Items:
//!
//! - `drive PIN 5H 9.1L`: levels from machine cycles (and clocks) on; pins are `I1`, `E1` (a glitch),
//!   `POWER`, `CLEAR`;
//! - `@30 E1=1 A=0 M5=1 R1=0 value:1=7 preset:1=9 I1=1 NA=3`: values when cycle 30 is reached (decimal
//!   numbers);
//! - `edges E1 8H 12L`: all changes of the output up to the last cycle named, or to the end;
//! - `truth I1 I2 -> E1 0001`: the output after two program cycles for all values of the inputs, the last
//!   input changing fastest;
//! - `halted 30`, `watchdog NA 30`, `jump NA TARGET 30`: how and in which cycle the run ends. Without one of
//!   these it reaches the last cycle that is checked.

use emu_test_support::case_lines;

use super::machine::{End, Line, When};

/// A machine as a subject of these tests.
pub trait Subject: Sized {
    /// Makes a machine from the bytes of an image. The error is the offset of a fault in the block.
    fn make(bytes: &[Option<u8>]) -> Result<Self, usize>;
    fn drive(&mut self, when: When, line: Line, level: bool);
    fn run(&mut self, until: u64) -> End;
    fn cycle(&self) -> u64;
    fn instructions(&self) -> u64;
    fn reg(&self, name: &str) -> Option<u32>;
    fn peek(&self, space: &str, at: usize) -> Option<u8>;
    /// Level of an output's pin.
    fn output(&self, n: usize) -> bool;
    /// Loses the supply and gets it back immediately, with CLEAR if `cold`.
    fn reset(&mut self, cold: bool);
    /// Writes a bit of M from outside.
    fn poke_ram(&mut self, at: usize, bit: bool);
    fn edges(&self) -> Vec<(When, usize, bool)>;

    /// Runs to a machine cycle even if the machine halts because nothing changes any more: a drive without
    /// effect keeps it running.
    fn run_on(&mut self, until: u64) -> End {
        match self.run(until) {
            End::Halted => {
                let clear = self.clear();
                self.drive((until, 0), Line::Clear, clear);
                self.run(until)
            }
            end => end,
        }
    }
    /// Whether CLEAR is high.
    fn clear(&self) -> bool;
}

/// One case of one program.
pub struct Case {
    pub name: String,
    pub source: String,
    pub items: Vec<String>,
}

/// All cases of a text.
pub fn cases(text: &str) -> Vec<Case> {
    let mut all = Vec::new();
    for part in format!("\n{text}").split("\n== ").skip(1) {
        let (name, rest) = part.split_once('\n').expect("a name line");
        let mut source = String::new();
        let mut wanted: Vec<String> = Vec::new();
        for line in case_lines(rest) {
            if let Some(case) = line.strip_prefix("-- ") {
                wanted.push(case.to_string());
            } else if let (Some(more), Some(last)) = (line.strip_prefix("   "), wanted.last_mut()) {
                last.push_str(more);
            } else {
                source.push_str(line);
                source.push('\n');
            }
        }
        assert!(!wanted.is_empty(), "{name}: no case");
        all.extend(wanted.iter().map(|case| filled(name, &source, case)));
    }
    all
}

fn filled(name: &str, source: &str, case: &str) -> Case {
    let (arguments, items) = match case.strip_prefix('{').and_then(|case| case.split_once('}')) {
        Some((arguments, items)) => (arguments.split('|').collect(), items),
        None => (Vec::new(), case),
    };
    let fill = |text: &str| {
        arguments.iter().enumerate().fold(text.to_string(), |text, (n, a)| text.replace(&format!("${}", n + 1), a))
    };
    let items = fill(items).split(';').map(|item| item.trim().to_string()).filter(|item| !item.is_empty()).collect();
    Case { name: name.to_string(), source: fill(source), items }
}

/// Parses a time, `20` or `20.1`.
fn moment(text: &str) -> When {
    let (cycle, clock) = text.split_once('.').unwrap_or((text, "0"));
    (cycle.parse().expect("a cycle"), clock.parse().expect("a clock"))
}

fn edge(text: &str) -> (When, bool) {
    (moment(text.trim_end_matches(['H', 'L'])), text.ends_with('H'))
}

fn line(name: &str) -> Line {
    match name {
        "POWER" => Line::Power,
        "CLEAR" => Line::Clear,
        _ if name.starts_with('I') => Line::Input(name[1..].parse().expect("an input")),
        _ => Line::Output(name[1..].parse().expect("an output")),
    }
}

/// The value that an item names.
fn value<S: Subject>(machine: &S, name: &str) -> u32 {
    let byte = |space: &str, at: usize| u32::from(machine.peek(space, at).expect("an address"));
    if let Some(value) = machine.reg(name) {
        return value;
    }
    if let Some((space, at)) = name.split_once(':') {
        let at: usize = at.parse().expect("an address");
        if matches!(space, "value" | "preset" | "code") {
            return byte(space, 2 * at) + 256 * byte(space, 2 * at + 1);
        }
        return byte(space, at);
    }
    let (space, at) = name.split_at(1);
    byte(&space.to_lowercase(), at.parse().expect("an address"))
}

impl Case {
    /// Runs the case. The error describes a difference from the expectations.
    pub fn check<S: Subject>(&self) -> Result<(), String> {
        let bytes = super::asm::assemble(&self.source);
        let fresh = || S::make(&bytes).map_err(|at| format!("the block is refused at {at:#x}"));
        let mut machine = fresh()?;
        let mut drives = Vec::new();
        for item in &self.items {
            if let Some(rest) = item.strip_prefix("drive ") {
                let (pin, edges) = rest.split_once(' ').expect("a pin and edges");
                drives.extend(edges.split_whitespace().map(edge).map(|(when, level)| (when, line(pin), level)));
            }
        }
        drives.sort_by_key(|drive| drive.0);
        for (when, line, level) in drives {
            machine.drive(when, line, level);
        }
        let mut end = End::Limit;
        for item in &self.items {
            let words: Vec<&str> = item.split_whitespace().collect();
            let compare =
                |wanted: &str, got: String| if wanted == got { Ok(()) } else { Err(format!("{item}: {got}")) };
            let number = |at: usize| words[at].parse::<u64>().expect("a number");
            match words[0] {
                "drive" => {}
                "truth" => self.truth::<S>(&bytes, &words[1..])?,
                "edges" => {
                    let n = words[1][1..].parse::<usize>().expect("an output");
                    let show = |edge: &(When, usize, bool)| {
                        let clock = if edge.0.1 == 0 { String::new() } else { format!(".{}", edge.0.1) };
                        format!(" {}{clock}{}", edge.0.0, if edge.2 { 'H' } else { 'L' })
                    };
                    let all: String = machine.edges().iter().filter(|edge| edge.1 == n).map(show).collect();
                    compare(item, format!("edges {}{all}", words[1]))?;
                }
                "halted" => {
                    end = machine.run(number(1) + 100_000);
                    compare(item, format!("{end:?} {}", machine.cycle()).to_lowercase())?;
                }
                "watchdog" => {
                    end = machine.run(number(2) + 100_000);
                    let End::Watchdog { pc } = end else { return Err(format!("{item}: {end:?}")) };
                    compare(item, format!("watchdog {pc} {}", machine.cycle()))?;
                }
                "jump" => {
                    end = machine.run(number(3) + 100_000);
                    let End::Jump { pc, target } = end else { return Err(format!("{item}: {end:?}")) };
                    compare(item, format!("jump {pc} {target} {}", machine.cycle()))?;
                }
                at => {
                    let until = at.strip_prefix('@').unwrap_or_else(|| panic!("{}: {item}", self.name));
                    let until = until.parse().expect("a cycle");
                    end = machine.run_on(until);
                    for pair in &words[1..] {
                        let (name, wanted) = pair.split_once('=').expect("name=value");
                        let got = value(&machine, name);
                        if got.to_string() != wanted {
                            return Err(format!("{at}: {name} is {got}, not {wanted}"));
                        }
                    }
                    if machine.cycle() != until {
                        return Err(format!("{at}: {end:?} at {}", machine.cycle()));
                    }
                }
            }
        }
        let asked =
            self.items.iter().any(|item| ["halted", "watchdog", "jump"].iter().any(|way| item.starts_with(way)));
        if asked || end == End::Limit { Ok(()) } else { Err(format!("ended with {end:?}")) }
    }

    fn truth<S: Subject>(&self, bytes: &[Option<u8>], words: &[&str]) -> Result<(), String> {
        let arrow = words.iter().position(|word| *word == "->").expect("an arrow");
        let (inputs, output) = (&words[..arrow], words[arrow + 1]);
        let table = words[arrow + 2..].concat();
        assert_eq!(table.len(), 1 << inputs.len(), "{}: a value for each row", self.name);
        for (row, wanted) in table.chars().enumerate() {
            let mut machine = S::make(bytes).map_err(|at| format!("the block is refused at {at:#x}"))?;
            for (n, input) in inputs.iter().enumerate() {
                machine.drive((0, 0), line(input), row >> (inputs.len() - 1 - n) & 1 == 1);
            }
            machine.run(1000);
            let got = value(&machine, &format!("e:{}", &output[1..]));
            if got.to_string() != wanted.to_string() {
                return Err(format!("row {row:b}: {output} is {got}"));
            }
        }
        Ok(())
    }
}
