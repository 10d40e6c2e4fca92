//! What every stop tells: why, where, when, and what has changed.

use emu_core::pins::{Event, Level};
use emu_core::table::Line;
use emu_debug::debug::{Halt, Hit, Point, Points, What, Why};
use emu_debug::text::escape;

use super::numbers::{brief, hex};
use super::shell::Shell;

/// Words of the longest instruction of any family.
const LONGEST: u32 = 3;

/// What a point that is told first may say to keep a stop silent.
const SILENT: &str = "silent";

impl Shell {
    /// Tells how the machine stands; `before`: the points as they were when it started.
    pub(super) fn stopped(&mut self, halt: &Halt, before: &Points, out: &mut String) {
        self.fault(matches!(halt.why, Why::Illegal { .. } | Why::Fault { .. }));
        let hits: &[Hit] = if let Why::Points(hits) = &halt.why { hits } else { &[] };
        let commands: Vec<String> =
            hits.iter().filter_map(|hit| before.get(hit.id)).flat_map(|point| point.commands.clone()).collect();
        if commands.first().is_some_and(|first| first == SILENT) {
            self.registers = self.core_registers();
        } else {
            out.push_str(&self.reason(halt, before));
            self.here(out);
        }
        self.enqueue(commands);
    }

    /// Where the machine stands, since when, and what is displayed.
    pub(super) fn here(&mut self, out: &mut String) {
        (self.listed, self.level) = (None, 0);
        self.place(out);
        out.push_str(&self.time());
        if let Some(resets) = self.session.resets_since(self.told) {
            out.push_str(&format!("{resets}\n"));
        }
        if let Some(sent) = self.sent() {
            out.push_str(&format!("sent {sent}\n"));
        }
        if let Some(changes) = self.changes() {
            out.push_str(&format!("{changes}\n"));
        }
        self.told = self.session.target().cycle();
        self.show_displays(out);
    }

    /// The machine is another one now: what was known of the one before is forgotten, and how it stands is told.
    pub(super) fn begun(&mut self, out: &mut String) {
        self.registers = self.core_registers();
        self.disassembly = None;
        self.told = self.session.target().cycle();
        self.fault(false);
        self.here(out);
    }

    /// Why it stands, line by line.
    fn reason(&self, halt: &Halt, before: &Points) -> String {
        let place = |word| self.spot(word);
        match &halt.why {
            Why::Done => String::new(),
            Why::Limit => format!("Cycle {} is reached\n", self.session.target().cycle()),
            Why::Halted => "Halted: nothing enabled can wake the chip (drive a pin, reset it, or go back)\n".to_owned(),
            Why::Waits => {
                "Waits: only something from outside can change what it does (drive a pin, reset it, or go back)\n"
                    .to_owned()
            }
            Why::Illegal { pc, word } => {
                let digits = self.session.scope.chip().word_bytes as usize * 2;
                format!("No instruction: 0x{word:0digits$x} at {}\n", place(*pc))
            }
            Why::Fault { pc, fault } => format!("A fault of the program at {}: {fault}\n", place(*pc)),
            Why::Interrupted => "Interrupted\n".to_owned(),
            Why::Beginning => "No more history: it begins here\n".to_owned(),
            Why::Points(hits) => {
                let told = hits.iter().filter_map(|hit| Some(self.hit(hit, before.get(hit.id)?)));
                told.map(|line| format!("{line}\n")).collect()
            }
        }
    }

    fn hit(&self, hit: &Hit, point: &Point) -> String {
        let id = format!("{}{}", point.id, if point.temporary { " (temporary)" } else { "" });
        let by = || self.spot(hit.pc);
        let value = |value: Option<i64>| value.map_or("nothing".to_owned(), brief);
        match &point.what {
            What::Code(_) => format!("Breakpoint {id}, {}", point.text),
            What::Access(..) => {
                let how = if hit.write == Some(true) { "written" } else { "read" };
                format!("Watchpoint {id}: {} {how}, {}, by {}", point.text, value(hit.new), by())
            }
            What::Change(_) => format!("Watchpoint {id}: {} {} -> {}", point.text, value(hit.old), value(hit.new)),
            What::Pin(pin, _) => {
                let name = self.session.scope.chip().pins.get(usize::from(*pin)).map_or("?", |pin| pin.name);
                format!("Watchpoint {id}: {name} is {}", level(self.session.target().level(*pin)))
            }
        }
    }

    /// The instruction that is next, with its source line.
    fn place(&mut self, out: &mut String) {
        let word = self.session.target().pc();
        let source = self.session.scope.source();
        out.push_str(&format!("{}: {}\n", source.place(word), self.instruction(word).text));
        if let Some(line) = source.line_at(word).cloned()
            && let Some(text) = self.sources.text(&self.session.scope.lines, &line)
        {
            out.push_str(&format!("{:>5}  {text}\n", line.line));
        }
        self.drawn().iter().for_each(|line| out.push_str(&format!("{line}\n")));
    }

    /// Cycle, time and what is known of the program.
    fn time(&self) -> String {
        let cycle = self.session.target().cycle();
        let mut text = format!("cycle {cycle}, {} s", self.session.clock().seconds(cycle));
        if let Some(scan) = self.session.scan() {
            text.push_str(&format!(", scan {scan}"));
        }
        if let Some(rung) = self.rung_and_element() {
            text.push_str(&format!(", {rung}"));
        }
        text.push('\n');
        text
    }

    /// What the chip has sent since the last stop.
    fn sent(&self) -> Option<String> {
        let sent = self.session.events().filter_map(|event| match event {
            Event::Sent { at, byte, .. } if at.cycle > self.told => Some(*byte),
            _ => None,
        });
        let bytes: Vec<u8> = sent.collect();
        (!bytes.is_empty()).then(|| escape(&bytes))
    }

    /// Values of the core's registers but for the program counter.
    pub(super) fn core_registers(&self) -> Vec<Option<u32>> {
        let names = self.session.scope.chip().cpu_regs.iter();
        names.map(|name| self.session.target().reg(name)).collect()
    }

    /// Registers that are not what they were at the last stop.
    fn changes(&mut self) -> Option<String> {
        let now = self.core_registers();
        let before = std::mem::replace(&mut self.registers, now);
        let names = self.session.scope.chip().cpu_regs.iter().filter(|name| !matches!(**name, "PC" | "NA"));
        let values = |values: &[Option<u32>], name: &str| {
            let at = self.session.scope.chip().cpu_regs.iter().position(|known| *known == name)?;
            values.get(at).copied().flatten()
        };
        let changed = names.filter_map(|name| {
            let (old, new) = (values(&before, name)?, values(&self.registers, name)?);
            (old != new).then(|| format!("{name} {} -> {}", hex(old.into(), 2), hex(new.into(), 2)))
        });
        let changed: Vec<String> = changed.collect();
        (!changed.is_empty()).then(|| changed.join(", "))
    }

    /// The instruction at a program word.
    pub(super) fn instruction(&self, word: u32) -> Line {
        let words: Vec<u16> = (0..LONGEST).map(|n| self.session.word(word.saturating_add(n))).collect();
        (self.session.scope.chip().isa.disassemble)(&words, word)
    }
}

/// A level in a character.
pub(super) fn level(level: Level) -> &'static str {
    match level {
        Level::High | Level::PullUp => "1",
        Level::Low | Level::PullDown => "0",
        Level::Float => "z",
    }
}
