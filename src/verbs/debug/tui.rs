//! `emu debug --tui`: a session on a full screen. Keys and command lines go to the [`DebugShell`] that the
//! prompt also uses.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use emu_core::chip::PinDef;
use emu_core::pins::{ChipEvent, PinLevel};
use emu_debug::debug::{DynMachine, FileLine, PointTrigger, RunGoal, SessionStopReason};
use emu_debug::trace::register_bits;
use emu_tui::debugger::{
    CodeLine, CommandAnswer, DebuggedMachine, DebuggerScreen, DebuggerSnapshot, MemoryExcerpt, NamedValue, PinTrace,
    ScreenQuery, SourceExcerpt,
};
use emu_tui::rung_picture::{self, PowerFlowSource};
use emu_tui::screen;
use ladder::ElementId;
use ladder_eval::ElementPower;
use ladder_view::ScanPosition;

use super::shell::{DebugShell, ShellFlow};
use super::stop::level;
use crate::shared::fail::VerbFailure;
use crate::shared::full_screen;
use crate::shared::full_screen::ScriptedKeys;
use crate::shared::report::MessageStyle;
use crate::shared::sources::SourceFiles;

/// Maximum number of program words of an instruction.
const MAX_INSTRUCTION_WORDS: u32 = 3;

/// A session on the full screen.
struct TuiSession {
    shell: DebugShell,
    title: String,
    /// The machine before the last command, to show what has changed since.
    previous: Box<dyn DynMachine>,
    /// The machine runs continuously, so `previous` is kept.
    running: bool,
    interrupt: Arc<AtomicBool>,
    /// A user is at the terminal and may press Ctrl-C.
    live: bool,
    sources: RefCell<SourceFiles>,
}

/// Shows a session until the user leaves it, and returns the exit code. `message` is shown before the first
/// key.
pub fn show(
    shell: DebugShell,
    title: &str,
    interrupt: Arc<AtomicBool>,
    message: &str,
    played: &ScriptedKeys,
    style: &MessageStyle,
) -> Result<u8, VerbFailure> {
    let live = !played.is_given();
    let before = shell.session.machine().fork();
    let sources = RefCell::new(shell.sources.without_cache());
    let session =
        TuiSession { sources, shell, title: title.to_owned(), previous: before, running: false, interrupt, live };
    let mut screen = DebuggerScreen::new(session, !live).with_message(message);
    full_screen::show_view(&mut screen, played, "--tui", style)
}

impl DebuggedMachine for TuiSession {
    fn debugger_snapshot(&self, wants: &ScreenQuery) -> DebuggerSnapshot {
        let session = &self.shell.session;
        let target = session.machine();
        let (pc, cycle) = (target.pc(), target.cycle());
        DebuggerSnapshot {
            title: self.title.clone(),
            time: self.time(),
            pc,
            cycle,
            code: if wants.lines > 0 { self.code(wants.around.unwrap_or(pc), wants.lines) } else { Vec::new() },
            registers: self.registers(),
            pins: self.pins(),
            symbols: self.symbols(),
            rung: if wants.rung > 0 { self.rung(wants.rung) } else { None },
            source: if wants.source > 0 { self.source(wants.line, wants.source) } else { None },
            serial: if wants.serial { self.serial() } else { Vec::new() },
            memory: if wants.memory.2 > 0 { self.memory(wants.memory) } else { None },
            traces: if wants.since <= cycle { self.traces(wants.since) } else { Vec::new() },
        }
    }

    fn run_command(&mut self, line: &str) -> CommandAnswer {
        (self.previous, self.running) = (self.shell.session.machine().fork(), false);
        let mut text = String::new();
        let (at, shell) = (self.position(), &mut self.shell);
        shell.forget_interrupt();
        let flow = match self.live {
            true => screen::run_interruptible(&self.interrupt, || shell.execute(line, &mut text)),
            false => shell.execute(line, &mut text),
        };
        if at != self.position() {
            text = self.stop_message(&text);
        }
        self.answer(flow, text)
    }

    fn advance(&mut self, cycles: Option<u64>, host: Option<Duration>) -> Option<CommandAnswer> {
        if !std::mem::replace(&mut self.running, true) {
            self.previous = self.shell.session.machine().fork();
        }
        let points = self.shell.session.points.clone();
        let until = cycles.map(|cycles| self.shell.session.machine().cycle().saturating_add(cycles));
        let begin = Instant::now();
        let keep_running = &mut || host.is_none_or(|host| begin.elapsed() < host);
        let halt = self.shell.session.run(&RunGoal { until, ..RunGoal::default() }, keep_running);
        if matches!(halt, SessionStopReason::Limit | SessionStopReason::Interrupted) {
            return None;
        }
        self.running = false;
        let mut text = String::new();
        self.shell.forget_interrupt();
        self.shell.report_stop(&halt, &points, &mut text);
        // Points may have commands of their own.
        let mut flow = self.shell.run_next_command(&mut text);
        while flow == ShellFlow::PointCommands {
            flow = self.shell.run_next_command(&mut text);
        }
        text = self.stop_message(&text);
        Some(self.answer(flow, text))
    }

    fn hertz(&self) -> f64 {
        let clock = self.shell.session.clock();
        clock.hz as f64 / f64::from(clock.clocks_per_cycle.max(1))
    }
}

impl TuiSession {
    fn position(&self) -> (u64, u32) {
        (self.shell.session.machine().cycle(), self.shell.session.machine().pc())
    }

    /// Returns the text of a stop without what the screen shows anyway: the instruction, the rung, the time.
    fn stop_message(&self, text: &str) -> String {
        let pc = self.shell.session.machine().pc();
        let here =
            format!("{}: {}", self.shell.session.scope.source().describe_word(pc), self.shell.instruction(pc).text);
        let known = |line: &&str| *line == here || line.starts_with("cycle ") || line.contains(" ||");
        text.lines().filter(|line| !known(line)).map(|line| format!("{line}\n")).collect()
    }

    fn answer(&self, flow: ShellFlow, text: String) -> CommandAnswer {
        let mut text = text.replace('\t', "    ");
        let quit = matches!(flow, ShellFlow::Quit(_));
        let failed = if let ShellFlow::Failed(why) = flow {
            text.push_str(&why);
            true
        } else {
            false
        };
        CommandAnswer { text, failed, quit }
    }

    /// Returns cycle, seconds, scan and rung.
    fn time(&self) -> String {
        let session = &self.shell.session;
        let cycle = session.machine().cycle();
        let mut text = format!("cycle {cycle}  {:.6} s", cycle as f64 / self.hertz());
        if let Some(scan) = session.scan() {
            text.push_str(&format!("  scan {scan}"));
        }
        if let Some(rung) = self.shell.view.as_ref().and_then(|view| view.rung_at(view.current_word(session.machine())))
        {
            text.push_str(&format!("  rung {rung}"));
        }
        text
    }

    /// Returns instructions before and after a program word.
    fn code(&self, around: u32, lines: usize) -> Vec<CodeLine> {
        let chip = self.shell.session.scope.chip();
        let end = chip.flash_bytes / chip.word_bytes.max(1);
        let next = |word: u32| word.saturating_add(self.shell.instruction(word).len.max(1) as u32);
        // The starts of earlier instructions are unknown; a sequence that leads to this word is assumed to be
        // right.
        let reach = u32::try_from(lines).unwrap_or(u32::MAX).saturating_mul(MAX_INSTRUCTION_WORDS);
        let preceding = (around.saturating_sub(reach)..around).find_map(|from| {
            let mut words = vec![from];
            while let Some(last) = words.last().map(|word| next(*word)).filter(|word| *word < around) {
                words.push(last);
            }
            (words.last().map(|word| next(*word)) == Some(around)).then_some(words)
        });
        let mut words = preceding.unwrap_or_default();
        words.drain(..words.len().saturating_sub(lines));
        let mut word = around;
        for _ in 0..=lines {
            if word >= end {
                break;
            }
            words.push(word);
            word = next(word);
        }
        let rungs: BTreeMap<u32, u32> =
            self.shell.view.iter().flat_map(|view| view.rung_starts()).map(|start| (start.word, start.rung)).collect();
        words.iter().map(|word| self.line(*word, rungs.get(word).copied())).collect()
    }

    /// Returns the source around a line, or around the location of the machine, or around main if the machine
    /// is in no line.
    fn source(&self, line: Option<u32>, lines: usize) -> Option<SourceExcerpt> {
        if self.shell.view.is_some() {
            return None;
        }
        let present = self.shell.current_line();
        let FileLine { file, line: own } = present.clone().or_else(|| self.shell.main_line())?;
        let around = line.unwrap_or(own);
        let scope = &self.shell.session.scope;
        let mut sources = self.sources.borrow_mut();
        let text = sources.file(&scope.lines, &file)?;
        let point = |number: u32| {
            let here = |word: &u32| {
                let source = scope.source();
                source.line_at(*word).is_some_and(|known| *known.file == *file && known.line == number)
            };
            let on = |what: &PointTrigger| matches!(what, PointTrigger::Code(words) if words.iter().any(here));
            self.shell.session.points.enabled().find(|point| on(&point.trigger)).map(|point| point.id)
        };
        let first = around.saturating_sub(u32::try_from(lines).unwrap_or(u32::MAX)).max(1);
        let shown = (1u32..).zip(text).skip(first as usize - 1).take(2 * lines + 1);
        let lines = shown.map(|(number, text)| (number, text.replace('\t', "    "), point(number))).collect();
        Some(SourceExcerpt { current_line: present.map(|FileLine { line, .. }| line), file, around, lines })
    }

    /// Returns the output of the serial port, in lines.
    fn serial(&self) -> Vec<String> {
        let sent = self.shell.session.events().filter_map(|event| match event {
            ChipEvent::Sent { byte, .. } => Some(*byte),
            _ => None,
        });
        let sent: Vec<u8> = sent.collect();
        let plain = |line: &[u8]| {
            emu_debug::text_escapes::escape(line.strip_suffix(b"\r").unwrap_or(line)).trim_matches('"').to_owned()
        };
        if sent.is_empty() { Vec::new() } else { sent.split(|byte| *byte == b'\n').map(plain).collect() }
    }

    fn line(&self, word: u32, rung: Option<u32>) -> CodeLine {
        let session = &self.shell.session;
        let (chip, source) = (session.scope.chip(), session.scope.source());
        let line = self.shell.instruction(word);
        let own = source.names.symbols.iter().find(|s| s.space == chip.code_space && s.addr == word * chip.word_bytes);
        let label = own.map(|symbol| format!("{}:", symbol.name)).or_else(|| rung.map(|rung| format!("rung {rung}:")));
        let of = |word: u32| source.line_at(word).map(|line| (line.file.to_string(), line.line));
        let begins = of(word).filter(|here| word == 0 || of(word - 1).as_ref() != Some(here));
        let point =
            session.points.enabled().find(|p| matches!(&p.trigger, PointTrigger::Code(words) if words.contains(&word)));
        CodeLine {
            word,
            address: format!("0x{:04x}", chip.code_address(word)),
            label,
            source: begins.map(|(file, line)| format!("{}:{line}", file.rsplit('/').next().unwrap_or(&file))),
            text: line.text,
            operand_meaning: source.describe_operands(&line.operands).join(", "),
            breakpoint: point.map(|point| point.id),
        }
    }

    fn registers(&self) -> Vec<NamedValue> {
        let target = self.shell.session.machine();
        let value = |name: &&'static str| {
            let (now, old) = (target.reg(name)?, self.previous.reg(name));
            let digits = if register_bits(target.chip(), name) > 8 { 4 } else { 2 };
            let text = format!("{now:0digits$x}");
            Some(NamedValue { name: (*name).to_owned(), text, changed: old != Some(now) })
        };
        // The program counter is shown by the mark in the code.
        let names = target.chip().cpu_regs.iter().filter(|name| !matches!(**name, "PC" | "NA"));
        names.filter_map(value).collect()
    }

    fn pins(&self) -> Vec<NamedValue> {
        let target = self.shell.session.machine();
        let value = |(id, pin): (u16, &PinDef)| {
            let (now, old) = (target.pin_level(id), self.previous.pin_level(id));
            NamedValue { name: pin.name.to_owned(), text: level(now).to_owned(), changed: now != old }
        };
        let shown = |(id, pin): &(u16, &PinDef)| target.has_pin(*id) && pin.is_level_meaningful(target.pin_level(*id));
        (0..).zip(target.chip().pins).filter(shown).map(value).collect()
    }

    fn symbols(&self) -> Vec<NamedValue> {
        let Some(view) = &self.shell.view else { return Vec::new() };
        let now = view.values(self.shell.session.machine());
        let old = view.values(&*self.previous);
        let value = |((name, now), (_, old)): ((String, Option<i64>), (String, Option<i64>))| {
            let text = now.map_or("-".to_owned(), |value| value.to_string());
            NamedValue { name, text, changed: now != old }
        };
        now.into_iter().zip(old).map(value).collect()
    }

    fn rung(&self, width: usize) -> Option<Vec<Vec<rung_picture::PictureGlyph>>> {
        let view = self.shell.view.as_ref()?;
        let session = &self.shell.session;
        let moment = view.scan_position(session.follower(), session.machine());
        let now = moment.current_element()?;
        let values = view.values(session.machine()).into_iter().collect();
        Some(rung_picture::rung_picture(
            view.program(),
            now.rung as usize,
            width,
            &RungPowerFlow { moment, values },
            Some(now),
        ))
    }

    fn memory(&self, (which, at, count): (usize, u32, usize)) -> Option<MemoryExcerpt> {
        let target = self.shell.session.machine();
        let spaces: Vec<&str> = target.chip().spaces.iter().map(|space| space.name).collect();
        // Data memory comes first.
        let first = spaces.iter().position(|space| *space == target.chip().ram_space).unwrap_or(0);
        let name = *spaces.get((first + which) % spaces.len().max(1))?;
        let byte = |addr: u32| (target.peek(name, addr), target.peek(name, addr) != self.previous.peek(name, addr));
        let end = at.saturating_add(u32::try_from(count).unwrap_or(u32::MAX));
        Some(MemoryExcerpt { name: name.to_owned(), address: at, bytes: (at..end).map(byte).collect() })
    }

    /// Returns the waveforms of the pins whose edges are recorded.
    fn traces(&self, since: u64) -> Vec<PinTrace> {
        let target = self.shell.session.machine();
        let mut edges: BTreeMap<u16, Vec<(u64, bool)>> = BTreeMap::new();
        for event in self.shell.session.edges() {
            if let ChipEvent::Edge { at, pin, level } = event {
                let edges = edges.entry(*pin).or_default();
                if at.cycle >= since {
                    edges.push((at.cycle, is_high(*level)));
                }
            }
        }
        let trace = |(pin, edges): (u16, Vec<(u64, bool)>)| {
            let name = target.chip().pins.get(usize::from(pin))?.name.to_owned();
            Some(PinTrace { name, high: is_high(target.pin_level(pin)), edges })
        };
        edges.into_iter().filter_map(trace).collect()
    }
}

fn is_high(level: PinLevel) -> bool {
    matches!(level, PinLevel::High | PinLevel::PullUp)
}

/// The state of a scan up to an instruction, for the picture of a rung.
struct RungPowerFlow {
    moment: ScanPosition,
    /// Values of the symbols.
    values: BTreeMap<String, Option<i64>>,
}

impl PowerFlowSource for RungPowerFlow {
    fn power_flow(&self, element: ElementId) -> Option<ElementPower> {
        // The result of an element is shown only after it was computed.
        if self.moment.current_element() == Some(element) {
            Some(ElementPower { before: self.moment.is_powered_here(), after: false })
        } else {
            self.moment.power(element)
        }
    }

    fn bit_value(&self, name: &str) -> Option<bool> {
        self.values.get(name).copied().flatten().map(|value| value != 0)
    }
}
