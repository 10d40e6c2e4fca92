//! Commands that let the machine run forwards.

use emu_core::cpu::{LAST_CYCLE, ResetCause};
use emu_core::image::TypeId;
use emu_debug::debug::{UserAction, CallFlow, RunGoal, HaltResult, ExpressionPlace, DebugSession, PointTrigger, HaltReason};
use emu_debug::stimulus::parse_pin_level;

use super::ladder::chip_pin_text;
use super::shell::{CommandResult, DebugShell};
use crate::avr;

const NO_LINES: &str = "note: there are no source lines here, so step and next go by instructions";

/// How deep the machine is in calls, as seen from where it started, and whether it is in a service routine that began since.
#[derive(Debug, Clone, Copy, Default)]
struct CallDepth {
    calls: i64,
    /// Calls within a service routine, itself counted.
    service: u64,
}

impl CallDepth {
    /// After an instruction, or the entry of an interrupt.
    fn update(&mut self, flow: CallFlow, entry: bool) {
        match (self.service, flow) {
            (service, _) if entry => self.service = service + 1,
            (0, CallFlow::Call) => self.calls += 1,
            (0, CallFlow::Return) => self.calls -= 1,
            (_, CallFlow::Call) => self.service += 1,
            (_, CallFlow::Return) => self.service -= 1,
            _ => {}
        }
    }

    /// It stands where it started, or below.
    fn is_back_at_start(self) -> bool {
        self.calls <= 0 && self.service == 0
    }
}

/// The line that an instruction belongs to.
fn line(session: &DebugSession) -> Option<(String, u32)> {
    let source = session.scope.source();
    let line = source.line_at(session.machine().pc())?;
    Some((line.file.to_string(), line.line))
}

/// The code of a line begins where the machine is.
fn begins_line(session: &DebugSession) -> bool {
    let (source, pc) = (session.scope.source(), session.machine().pc());
    source.line_at(pc).is_some_and(|line| line.addr == pc.saturating_mul(session.scope.chip().word_bytes))
}

/// One step of a source line; `over`: calls are passed. Without lines one instruction.
fn line_step(session: &mut DebugSession, over: bool, forward_only: bool, go_on: &mut dyn FnMut() -> bool) -> HaltResult {
    let (mut start, from) = (line(session), session.machine().pc());
    let (mut depth, mut last) = (CallDepth::default(), from);
    // Where the prologue of the function ends that it has come into, and how deep that is.
    let mut entered: Option<(u32, i64)> = None;
    session.step_until(LAST_CYCLE, true, go_on, &mut |session, flow, entry| {
        depth.update(flow, entry);
        if depth.service > 0 {
            return false;
        }
        if let Some((word, calls)) = entered.filter(|(_, calls)| depth.calls >= *calls) {
            return depth.calls == calls && session.machine().pc() == word;
        }
        if depth.calls > 0 && over {
            return false;
        }
        // A jump to itself: nothing but service routines leads out of it, and those return.
        let before = std::mem::replace(&mut last, session.machine().pc());
        if !entry && flow == CallFlow::Plain && before == last {
            return true;
        }
        let here = line(session);
        // A call into code without lines is passed.
        if depth.calls > 0 && start.is_some() && here.is_none() {
            return false;
        }
        // Back in the middle of the line that has called, it goes on to the end of that, as in gdb.
        if depth.calls < 0 && flow == CallFlow::Return && here.is_some() && here != start && !begins_line(session) {
            start = here;
            return false;
        }
        if depth.calls > 0 && flow == CallFlow::Call && here.is_some() {
            let pc = session.machine().pc();
            entered = session.scope.word_after_prologue(pc).map(|word| (word, depth.calls));
            if entered.is_some() {
                return false;
            }
        }
        let passed = start.is_none() || here != start || flow == CallFlow::Call && !over;
        passed && (!forward_only || depth.calls < 0 || session.machine().pc() > from)
    })
}

/// Does something up to `count` times, as long as nothing else stops it; only the last is told.
fn repeat_run(
    shell: &mut DebugShell,
    args: &str,
    out: &mut String,
    mut once: impl FnMut(&mut DebugSession, &mut dyn FnMut() -> bool) -> HaltResult,
) -> CommandResult {
    let count = shell.parse_count(args)?;
    shell.run_and_report(out, |session, go_on| {
        let mut halt = HaltResult { reason: HaltReason::Done };
        for _ in 0..count {
            halt = once(session, go_on);
            if halt.reason != HaltReason::Done {
                break;
            }
        }
        halt
    });
    Ok(())
}

fn note_missing_lines(shell: &mut DebugShell, out: &mut String) {
    if line(&shell.session).is_none() {
        shell.note_once(NO_LINES, out);
    }
}

pub(super) fn step(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    note_missing_lines(shell, out);
    repeat_run(shell, args, out, |session, go_on| line_step(session, false, false, go_on))
}

pub(super) fn next(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    note_missing_lines(shell, out);
    repeat_run(shell, args, out, |session, go_on| line_step(session, true, false, go_on))
}

pub(super) fn stepi(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let count = shell.parse_count(args)?;
    shell.run_and_report(out, |session, go_on| session.step_instructions(count, LAST_CYCLE, go_on));
    Ok(())
}

pub(super) fn nexti(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    repeat_run(shell, args, out, |session, go_on| {
        let mut depth = CallDepth::default();
        session.step_until(LAST_CYCLE, true, go_on, &mut |_, flow, entry| {
            depth.update(flow, entry);
            depth.is_back_at_start()
        })
    })
}

/// Steps until the subroutine or service routine has returned.
fn run_out_of_subroutine(session: &mut DebugSession, go_on: &mut dyn FnMut() -> bool, also: &mut dyn FnMut(&DebugSession) -> bool) -> HaltResult {
    let mut depth = CallDepth::default();
    session.step_until(LAST_CYCLE, true, go_on, &mut |session, flow, entry| {
        depth.update(flow, entry);
        depth.calls < 0 || also(session)
    })
}

pub(super) fn finish(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    if !shell.may_return() {
        return Err("there is nothing to finish: the stack tells of no call".to_owned());
    }
    if shell.level > 0 {
        // As in gdb: up to where the call that is looked at goes on.
        let target = shell.calls().get(shell.level + 1).map(|frame| (frame.word, frame.sp));
        let (word, sp) = target.ok_or("the outermost call does not return")?;
        let reached = move |session: &DebugSession| session.machine().pc() == word && session.machine().reg("SP") == Some(sp);
        shell.run_and_report(out, |session, go_on| session.step_until(LAST_CYCLE, true, go_on, &mut |session, _, _| reached(session)));
        return Ok(());
    }
    let kind = shell.result_type();
    let halt = shell.run_and_report(out, |session, go_on| run_out_of_subroutine(session, go_on, &mut |_| false));
    if let (HaltReason::Done, Some(kind)) = (halt.reason, kind)
        && let Some(object) = shell.session.scope.calls().result(kind)
    {
        let value = object.text(&shell.session.scope, shell.session.machine(), None);
        out.push_str(&format!("Value returned is {value}\n"));
    }
    Ok(())
}

pub(super) fn advance(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("where to? advance main.c:12, advance price".to_owned());
    }
    until(shell, args, out)
}

/// Back to where the history begins; it is told only where that cannot be.
fn rewind(shell: &mut DebugShell) -> CommandResult {
    let first = shell.session.first_cycle();
    let go_on = &mut shell.keep_running();
    match shell.session.goto_cycle(first, go_on).reason {
        HaltReason::Interrupted => Err("interrupted".to_owned()),
        _ => Ok(()),
    }
}

pub(super) fn run(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    rewind(shell)?;
    continue_running(shell, "", out)
}

pub(super) fn start(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let words = shell.parse_line_location("main").map_err(|why| format!("{why}; run goes to the first breakpoint"))?;
    rewind(shell)?;
    shell.run_and_report(out, |session, go_on| session.run(&RunGoal { words: words.into_iter().collect(), ..RunGoal::default() }, go_on));
    Ok(())
}

pub(super) fn jump(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("where to? jump main.c:12, jump 0x86".to_owned());
    }
    let word = shell.parse_line_location(args)?.first().copied().unwrap_or_default();
    let address = shell.session.scope.chip().code_address(word);
    shell.session.apply_action(UserAction::Set(ExpressionPlace::Pc, address.into()))?;
    shell.registers = shell.core_registers();
    continue_running(shell, "", out)
}

pub(super) fn until(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        note_missing_lines(shell, out);
        shell.run_and_report(out, |session, go_on| line_step(session, true, true, go_on));
        return Ok(());
    }
    let words = shell.parse_line_location(args)?;
    let inside = !shell.return_addresses().is_empty();
    shell.run_and_report(out, |session, go_on| match inside {
        true => run_out_of_subroutine(session, go_on, &mut |session| words.contains(&session.machine().pc())),
        false => session.run(&RunGoal { words: words.into_iter().collect(), ..RunGoal::default() }, go_on),
    });
    Ok(())
}

pub(super) fn continue_running(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let count = shell.parse_count(args)?;
    if count > 1 {
        let pc = shell.session.machine().pc();
        let here = |what: &PointTrigger| matches!(what, PointTrigger::Code(words) if words.contains(&pc));
        let id = shell.session.points.enabled().find(|point| here(&point.trigger)).map(|point| point.id);
        let point = id.and_then(|id| shell.session.points.get_mut(id));
        point.ok_or("a count is for a breakpoint that has stopped it here; there is none")?.ignore = count - 1;
    }
    shell.run_and_report(out, |session, go_on| session.run(&RunGoal::default(), go_on));
    Ok(())
}

pub(super) fn until_pin(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let chip = shell.session.scope.chip();
    let named = shell.view.as_ref().map_or_else(|| args.to_owned(), |view| chip_pin_text(view, args));
    let own = avr::chip_pin_text(chip, &shell.session.scope.source().names.replace_channel_name(&named));
    let (pin, level) = parse_pin_level(chip, &own)?;
    let id = shell.session.points.add(PointTrigger::Pin(pin, Some(level)), args, true);
    shell.run_and_report(out, |session, go_on| session.run(&RunGoal::default(), go_on));
    shell.session.points.remove(id);
    Ok(())
}

pub(super) fn run_to_cycle(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let cycle = shell.parse_cycle(args)?;
    let now = shell.session.machine().cycle();
    if cycle < now {
        return Err(format!("cycle {cycle} is past, it is {now} now; goto-cycle goes back"));
    }
    shell.run_and_report(out, |session, go_on| session.run(&RunGoal { until: Some(cycle), runs_while_halted: true, ..RunGoal::default() }, go_on));
    Ok(())
}

pub(super) fn reset(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let kinds = [
        ("external", ResetCause::External),
        ("power", ResetCause::PowerOn),
        ("watchdog", ResetCause::Watchdog),
        ("brownout", ResetCause::BrownOut),
    ];
    let wanted = if args.is_empty() { "external" } else { args };
    let found = kinds.iter().find(|(name, _)| name.starts_with(wanted));
    let (_, why) =
        found.ok_or_else(|| format!("`{args}` is no reset; there are power, external, watchdog, brownout"))?;
    shell.session.apply_action(UserAction::Reset(*why))?;
    shell.report_position(out);
    Ok(())
}

impl DebugShell {
    /// A machine cycle or a time: `16000`, `$cycle + 100`, `10ms`.
    pub(super) fn parse_cycle(&self, text: &str) -> Result<u64, String> {
        if text.trim().is_empty() {
            return Err("a cycle or a time is missing: 16000, $cycle+100, 10ms".to_owned());
        }
        let is_time = text.trim().ends_with(['s', 'c']) && text.trim().starts_with(|c: char| c.is_ascii_digit());
        if is_time {
            return self.session.clock().parse_cycles(text.trim());
        }
        let value = self.integer_value(text)?;
        u64::try_from(value).map_err(|_| format!("cycle {value} is before power-up"))
    }

    /// The type of what the function returns that the machine is in; nothing where it is not known, or `void`.
    fn result_type(&self) -> Option<TypeId> {
        let byte = self.session.machine().pc().saturating_mul(self.session.scope.chip().word_bytes);
        self.session.scope.calls().info.function_at(byte)?.result
    }

    /// The same as [`Shell::location`], but that a number alone is a line where the program has lines, as in gdb.
    pub(super) fn parse_line_location(&self, text: &str) -> Result<Vec<u32>, String> {
        let text = text.trim();
        let named = text.rsplit_once(':').and_then(|(file, line)| Some((self.source_file(file)?, line.parse().ok()?)));
        match self.parse_line_number(text).or(named) {
            Some((file, line)) => {
                // Of a line without code the next one is meant that has some.
                let lines =
                    self.session.scope.lines.all_lines().iter().filter(|known| *known.file == *file && known.line >= line);
                let line = lines.map(|known| known.line).min().unwrap_or(line);
                let scope = &self.session.scope;
                let words = scope.source().parse_words(&format!("{file}:{line}"))?;
                let bytes: Vec<u32> = words.iter().map(|word| word * scope.chip().word_bytes).collect();
                Ok(scope.line_words(&bytes))
            }
            None => match self.session.scope.function_words(text) {
                words if words.is_empty() => self.parse_location(text),
                words => Ok(words),
            },
        }
    }

    /// Program words that a text stands for: an address, a symbol, `main.c:12`, `*EXPR`, `$pc`.
    pub(super) fn parse_location(&self, text: &str) -> Result<Vec<u32>, String> {
        let text = text.trim();
        if let Some(words) = self.rung_location(text) {
            return words;
        }
        let computed = text.strip_prefix('*').or_else(|| text.starts_with('$').then_some(text));
        let Some(expr) = computed else { return self.session.scope.source().parse_words(text) };
        let value = self.integer_value(expr)?;
        let address = u32::try_from(value).map_err(|_| format!("`{text}` is no address: {value}"))?;
        self.session.scope.source().parse_words(&format!("0x{address:x}"))
    }
}
