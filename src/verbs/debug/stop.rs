//! Reports of stops: reason, location, time, and what has changed.

use emu_core::cpu::ProgramError;
use emu_core::pins::{ChipEvent, PinLevel};
use emu_core::table::DisassembledInstruction;
use emu_debug::debug::{
    AccessKind, DebugPoint, DebugPoints, FileLine, ObjectExpr, PointHit, PointTrigger, SessionStopReason,
};
use emu_debug::text_escapes::escape;

use super::numbers::{hex, short_hex};
use super::shell::DebugShell;

/// Maximum number of words of an instruction of any family.
const MAX_INSTRUCTION_WORDS: u32 = 3;

/// First command of a point that suppresses the report of its stop.
const SILENT: &str = "silent";

impl DebugShell {
    /// Reports a stop. `before` is the points as they were when the run began.
    pub(super) fn report_stop(&mut self, halt: &SessionStopReason, before: &DebugPoints, out: &mut String) {
        self.set_faulted(matches!(halt, SessionStopReason::Error(_)));
        let hits: &[PointHit] = if let SessionStopReason::Points(hits) = &halt { hits } else { &[] };
        let commands: Vec<String> =
            hits.iter().filter_map(|hit| before.get(hit.id)).flat_map(|point| point.commands.clone()).collect();
        if self.next_not_entered.is_none() && self.is_of_inlined(hits, before) {
            self.next_not_entered = Some(0);
        }
        if commands.first().is_some_and(|first| first == SILENT) {
            self.select_innermost_call();
            self.registers = self.core_registers();
        } else {
            self.select_innermost_call();
            out.push_str(&self.describe_reason(halt, before));
            self.report_frame(halt, before, out);
            self.print_position(out);
        }
        self.stopped_in = self.present_call();
        self.enqueue(commands);
    }

    /// Reports the location, the time, what has changed, and the displays.
    pub(super) fn report_position(&mut self, out: &mut String) {
        self.select_innermost_call();
        self.stopped_in = self.present_call();
        self.print_position(out);
    }

    fn print_position(&mut self, out: &mut String) {
        self.print_location(out);
        out.push_str(&self.describe_time());
        if let Some(resets) = self.session.resets_since(self.reported_to) {
            out.push_str(&format!("{resets}\n"));
        }
        if let Some(sent) = self.sent_text() {
            out.push_str(&format!("sent {sent}\n"));
        }
        if let Some(changes) = self.take_register_changes() {
            out.push_str(&format!("{changes}\n"));
        }
        self.reported_to = self.session.machine().cycle();
        self.show_displays(out);
    }

    /// Returns the function of the selected call, and the address of its frame.
    fn present_call(&self) -> Option<(String, Option<u32>)> {
        let frame = self.calls().into_iter().nth(self.level)?;
        let name = self.session.scope.calls().frame_name(self.session.machine(), &frame)?.function;
        Some((name.to_owned(), frame.cfa))
    }

    /// Returns the selected call as gdb prints it, with its parameters; `None` if the program does not
    /// describe it.
    fn present_call_text(&self) -> Option<String> {
        let frame = self.calls().into_iter().nth(self.level).filter(|frame| self.is_described(frame))?;
        let line = self.frame_line(self.level, &frame);
        let text = line.trim_end().split_once("  ").map_or(line.trim_end(), |(_, text)| text);
        self.view.is_none().then(|| text.to_owned())
    }

    /// Prints the selected call, unless a breakpoint reports it, or a step has ended in the call of the last
    /// stop.
    fn report_frame(&self, halt: &SessionStopReason, before: &DebugPoints, out: &mut String) {
        let is_breakpoint =
            |hit: &PointHit| before.get(hit.id).is_some_and(|point| matches!(point.trigger, PointTrigger::Code(_)));
        match &halt {
            SessionStopReason::Points(hits) if hits.iter().any(is_breakpoint) => return,
            SessionStopReason::Done if self.stopped_in == self.present_call() => return,
            _ => {}
        }
        out.extend(self.present_call_text().map(|text| format!("{text}\n")));
    }

    /// Selects the innermost call.
    fn select_innermost_call(&mut self) {
        let byte = self.session.machine().pc().saturating_mul(self.session.scope.chip().word_bytes);
        self.not_entered = self.next_not_entered.take().unwrap_or_else(|| self.session.scope.calls().call_sites(byte));
        (self.listed, self.level) = (None, self.not_entered);
    }

    /// Returns true if a breakpoint of an inlined function, or of a line in it, has stopped the machine, so
    /// that the machine is in that function.
    fn is_of_inlined(&self, hits: &[PointHit], before: &DebugPoints) -> bool {
        let (scope, pc) = (&self.session.scope, self.session.machine().pc());
        let blocks = scope.calls().inlined(pc.saturating_mul(scope.chip().word_bytes));
        let line = scope.source().line_text(pc).unwrap_or_default();
        let is_own = |text: &str| {
            let name = text.rsplit(':').next().unwrap_or(text);
            text == line || blocks.iter().any(|block| block.inlined.as_deref() == Some(name))
        };
        let points = hits.iter().filter_map(|hit| before.get(hit.id));
        points.filter(|point| matches!(point.trigger, PointTrigger::Code(_))).any(|point| is_own(&point.text))
    }

    /// Forgets what was reported of the previous machine after a `load`, and reports the location of the new
    /// one.
    pub(super) fn restart_reports(&mut self, out: &mut String) {
        self.registers = self.core_registers();
        self.disassembly = None;
        self.reported_to = self.session.machine().cycle();
        self.set_faulted(false);
        self.report_position(out);
    }

    /// Returns the reason of a stop, one line per cause.
    fn describe_reason(&self, halt: &SessionStopReason, before: &DebugPoints) -> String {
        let place = |word| self.word_with_rung(word);
        match &halt {
            SessionStopReason::Done => String::new(),
            SessionStopReason::Limit => format!("Cycle {} is reached\n", self.session.machine().cycle()),
            SessionStopReason::Halted => {
                "Halted: nothing enabled can wake the chip (drive a pin, reset it, or go back)\n".to_owned()
            }
            SessionStopReason::BlockedOnInput => {
                "Waits: only an external stimulus can change what the program does (drive a pin, reset it, or go back)\n"
                    .to_owned()
            }
            SessionStopReason::Error(ProgramError::Illegal { pc, word }) => {
                let digits = self.session.scope.chip().word_bytes as usize * 2;
                format!("Illegal instruction: 0x{word:0digits$x} at {}\n", place(*pc))
            }
            SessionStopReason::Error(ProgramError::Fault { pc, fault }) => format!("Fault of the program at {}: {fault}\n", place(*pc)),
            SessionStopReason::Interrupted => "Interrupted\n".to_owned(),
            SessionStopReason::Beginning => "No more history: it begins here\n".to_owned(),
            SessionStopReason::Points(hits) => {
                let lines = hits.iter().filter_map(|hit| Some(self.describe_hit(hit, before.get(hit.id)?)));
                lines.map(|line| format!("{line}\n")).collect()
            }
        }
    }

    fn describe_hit(&self, hit: &PointHit, point: &DebugPoint) -> String {
        let id = point.id;
        let by = || self.word_with_rung(hit.pc);
        let value = |value: Option<i64>| value.map_or("nothing".to_owned(), short_hex);
        match &point.trigger {
            PointTrigger::Code(_) => {
                let kind = if point.temporary { "Temporary breakpoint" } else { "Breakpoint" };
                format!("{kind} {id}, {}", self.present_call_text().unwrap_or_else(|| point.text.clone()))
            }
            PointTrigger::Access(_, kind) if let Some(object) = self.watched_object(&point.text) => {
                let kind = if *kind == AccessKind::Read { "read" } else { "access (read/write)" };
                let how = if hit.write == Some(true) { "written" } else { "read" };
                let value = object.text_without_type(&self.session.scope, self.session.machine());
                format!("\nHardware {kind} watchpoint {id}: {}\n\nValue = {value}\n{how} by {}", point.text, by())
            }
            PointTrigger::Access(..) => {
                let how = if hit.write == Some(true) { "written" } else { "read" };
                format!("Watchpoint {id}: {} {how}, {}, by {}", point.text, value(hit.new), by())
            }
            PointTrigger::Change(_) if point.call_end.is_some() && hit.old.is_none() && hit.new.is_none() => format!(
                "Watchpoint {id} deleted because the program has left the block in\nwhich its expression is valid."
            ),
            PointTrigger::Change(_) if let Some((old, new)) = self.watched_values(&point.text, hit) => {
                format!("\nHardware watchpoint {id}: {}\n\nOld value = {old}\nNew value = {new}", point.text)
            }
            PointTrigger::Change(_) => {
                format!("Watchpoint {id}: {} {} -> {}", point.text, value(hit.old), value(hit.new))
            }
            PointTrigger::Pin(pin, _) => {
                let name = self.session.scope.chip().pins.get(usize::from(*pin)).map_or("?", |pin| pin.name);
                format!("Watchpoint {id}: {name} is {}", level(self.session.machine().pin_level(*pin)))
            }
        }
    }

    /// Returns the values of a C variable before and after a change, as text.
    fn watched_values(&self, text: &str, hit: &PointHit) -> Option<(String, String)> {
        let object = self.watched_object(text).filter(|object| object.is_scalar() && !object.is_real())?;
        let shown = |value: i64| object.text_of_number(&self.session.scope, self.session.machine(), value);
        Some((shown(hit.old?), shown(hit.new?)))
    }

    /// Returns the C variable of a watchpoint, if it is known.
    fn watched_object(&self, text: &str) -> Option<ObjectExpr> {
        let expr = self.parse_expression(text.trim_start_matches("-location ")).ok()?;
        expr.object().filter(|object| !object.is_computed()).cloned()
    }

    /// Prints the next instruction with its source line or rung.
    fn print_location(&mut self, out: &mut String) {
        let word = self.session.machine().pc();
        let source = self.session.scope.source();
        // Before an inlined function, the location is the line of its call.
        let call = self.current_line().filter(|_| self.not_entered > 0);
        if let Some(FileLine { file, line: number }) = call {
            let chip = self.session.scope.chip();
            let name = source.names.nearest_symbol(word.saturating_mul(chip.word_bytes)).unwrap_or_default();
            let place = format!("0x{:04x} ({name}, {file}:{number})", chip.code_address(word));
            out.push_str(&format!("{place}: {}\n", self.instruction(word).text));
            if let Some(text) = self.source_text(&file, number) {
                out.push_str(&format!("{number}\t{text}\n"));
            }
            return;
        }
        out.push_str(&format!("{}: {}\n", source.describe_word(word), self.instruction(word).text));
        if let Some(line) = source.line_at(word).cloned()
            && let Some(text) = self.source_text(&line.file, line.line)
        {
            out.push_str(&format!("{}\t{text}\n", line.line));
        }
        self.draw_current_rung().iter().for_each(|line| out.push_str(&format!("{line}\n")));
    }

    /// Returns cycle, time, scan and rung as a line.
    fn describe_time(&self) -> String {
        let cycle = self.session.machine().cycle();
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

    /// Returns the bytes that the chip has sent since the last stop, as text.
    fn sent_text(&self) -> Option<String> {
        let sent = self.session.events().filter_map(|event| match event {
            ChipEvent::Sent { at, byte, .. } if at.cycle > self.reported_to => Some(*byte),
            _ => None,
        });
        let bytes: Vec<u8> = sent.collect();
        (!bytes.is_empty()).then(|| escape(&bytes))
    }

    /// Returns the values of the core registers, in the order of the chip.
    pub(super) fn core_registers(&self) -> Vec<Option<u32>> {
        let names = self.session.scope.chip().cpu_regs.iter();
        names.map(|name| self.session.machine().reg(name)).collect()
    }

    /// Returns the registers that have changed since the last stop, as text.
    fn take_register_changes(&mut self) -> Option<String> {
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

    /// Disassembles the instruction at a program word.
    pub(super) fn instruction(&self, word: u32) -> DisassembledInstruction {
        let words: Vec<u16> = (0..MAX_INSTRUCTION_WORDS).map(|n| self.session.word(word.saturating_add(n))).collect();
        (self.session.scope.chip().isa.disassemble)(&words, word)
    }
}

/// Returns a level as one character.
pub(super) fn level(level: PinLevel) -> &'static str {
    match level {
        PinLevel::High | PinLevel::PullUp => "1",
        PinLevel::Low | PinLevel::PullDown => "0",
        PinLevel::Float => "z",
    }
}
