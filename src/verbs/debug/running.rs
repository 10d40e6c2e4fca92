//! Commands that run the machine forwards.

use emu_core::cpu::{LAST_CYCLE, ResetCause};
use emu_core::image::TypeId;
use emu_debug::debug::{
    CallFrame, DebugExpression, DebugSession, ExpressionPlace, FileLine, NamedFunction, PointTrigger, RunGoal,
    SessionStopReason, UserAction,
};
use emu_debug::stimulus::{PinAndLevel, parse_pin_level};

use super::command_error::CommandError;
use super::ladder::chip_pin_text;
use super::shell::{CommandResult, DebugShell};
use super::steps::{CallDepth, LineStep, current_line, line_step, repeat_steps};
use crate::shared::avr;

const OUTERMOST: &str = "\"finish\" not meaningful in the outermost frame.";
const NO_LINES: &str = "note: there are no source lines here, so step and next execute single instructions";

/// Takes as many steps as the argument says and reports the last stop.
fn repeat_run(
    shell: &mut DebugShell,
    args: &str,
    out: &mut String,
    mut once: impl FnMut(&mut DebugSession, &mut dyn FnMut() -> bool) -> SessionStopReason,
) -> CommandResult {
    let count = shell.parse_count(args)?;
    shell.run_and_report(out, |session, keep_running| {
        repeat_steps(count, keep_running, |keep_running| once(session, keep_running))
    });
    Ok(())
}

/// Takes steps of source lines.
fn line_steps(shell: &mut DebugShell, args: &str, kind: LineStep, out: &mut String) -> CommandResult {
    let count = shell.parse_count(args)?;
    let mut not_entered = shell.not_entered;
    shell.run_and_report_inlined(out, |session, keep_running| {
        let halt =
            repeat_steps(count, keep_running, |keep_running| line_step(session, kind, &mut not_entered, keep_running));
        let not_entered = (halt == SessionStopReason::Done).then_some(not_entered);
        (halt, not_entered)
    });
    Ok(())
}

fn note_missing_lines(shell: &mut DebugShell, out: &mut String) {
    if current_line(&shell.session).is_some() {
        return;
    }
    match shell.session.scope.calls().function(shell.session.machine().pc()) {
        Some(NamedFunction { name, .. }) => out.push_str(&format!(
            "Single stepping until exit from function {name},\nwhich has no line number information.\n"
        )),
        None => shell.note_once(NO_LINES, out),
    }
}

/// `step`: runs to the beginning of another line, also in calls.
pub(super) fn step(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    note_missing_lines(shell, out);
    line_steps(shell, args, LineStep::Into, out)
}

/// `next`: runs to the beginning of another line of the function.
pub(super) fn next(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    note_missing_lines(shell, out);
    line_steps(shell, args, LineStep::Over, out)
}

/// `stepi`: executes instructions.
pub(super) fn stepi(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let count = shell.parse_count(args)?;
    shell.run_and_report(out, |session, keep_running| session.step_instructions(count, LAST_CYCLE, keep_running));
    Ok(())
}

/// `nexti`: executes instructions, calls as one.
pub(super) fn nexti(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    repeat_run(shell, args, out, |session, keep_running| {
        let mut depth = CallDepth::default();
        session.step_until(LAST_CYCLE, true, keep_running, &mut |_, flow, entry| {
            depth.update(flow, entry);
            depth.is_back_at_start()
        })
    })
}

/// Steps until the subroutine or service routine has returned.
fn run_out_of_subroutine(
    session: &mut DebugSession,
    keep_running: &mut dyn FnMut() -> bool,
    also: &mut dyn FnMut(&DebugSession) -> bool,
) -> SessionStopReason {
    let mut depth = CallDepth::default();
    session.step_until(LAST_CYCLE, true, keep_running, &mut |session, flow, entry| {
        depth.update(flow, entry);
        depth.calls < 0 || also(session)
    })
}

/// `finish`: runs until the selected function returns.
pub(super) fn finish(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    if !shell.may_return() {
        return Err(OUTERMOST.into());
    }
    let return_addresses = shell.calls();
    let frame = return_addresses
        .get(shell.level)
        .cloned()
        .ok_or("the selected call does not exist any more; bt lists the calls")?;
    if let Some(block) = shell.inlined_block(&frame) {
        // An inlined function has returned when the program is after its code.
        out.push_str(&format!("Run till exit from {}", shell.frame_line(shell.level, &frame)));
        let left = move |session: &DebugSession| {
            let byte = session.machine().pc().saturating_mul(session.scope.chip().word_bytes);
            session.machine().reg("SP").is_some_and(|sp| sp >= frame.sp) && !block.has_code_at(byte)
        };
        shell.run_and_report(out, |session, keep_running| {
            session.step_until(LAST_CYCLE, true, keep_running, &mut |session, _, _| left(session))
        });
        return Ok(());
    }
    let is_main = shell
        .session
        .scope
        .calls()
        .frame_name(shell.session.machine(), &frame)
        .is_some_and(|own| own.function == "main");
    if is_main {
        return Err(OUTERMOST.into());
    }
    out.push_str(&format!("Run till exit from {}", shell.frame_line(shell.level, &frame)));
    let kind = shell.result_type(&frame);
    if shell.level > shell.not_entered {
        // As in gdb, run until the selected call has returned.
        let target = return_addresses.get(shell.level + 1).map(|frame| (frame.word, frame.sp));
        let (word, sp) = target.ok_or("the outermost call does not return")?;
        let reached =
            move |session: &DebugSession| session.machine().pc() == word && session.machine().reg("SP") == Some(sp);
        let halt = shell.run_and_report(out, |session, keep_running| {
            session.step_until(LAST_CYCLE, true, keep_running, &mut |session, _, _| reached(session))
        });
        shell.print_result(&halt, kind, out);
        return Ok(());
    }
    let halt =
        shell.run_and_report(out, |session, keep_running| run_out_of_subroutine(session, keep_running, &mut |_| false));
    shell.print_result(&halt, kind, out);
    Ok(())
}

/// `advance`: runs to a location.
pub(super) fn advance(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("the location is missing: advance main.c:12, advance price".into());
    }
    until(shell, args, out)
}

/// Goes back to the beginning of the history. Fails if it is interrupted.
fn rewind(shell: &mut DebugShell) -> CommandResult {
    let first = shell.session.first_cycle();
    let keep_running = &mut shell.keep_running();
    match shell.session.goto_cycle(first, keep_running) {
        SessionStopReason::Interrupted => Err("interrupted".into()),
        _ => Ok(()),
    }
}

/// `run`: starts the program again from the beginning and runs it.
pub(super) fn run(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    rewind(shell)?;
    continue_running(shell, "", out)
}

/// `start`: starts the program again and runs it to `main`.
pub(super) fn start(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    let words = shell.parse_line_location("main").map_err(|why| format!("{why}; run goes to the first breakpoint"))?;
    rewind(shell)?;
    shell.run_and_report(out, |session, keep_running| {
        session.run(&RunGoal { words: words.into_iter().collect(), ..RunGoal::default() }, keep_running)
    });
    Ok(())
}

/// `jump`: moves execution to a location and runs.
pub(super) fn jump(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("the location is missing: jump main.c:12, jump 0x86".into());
    }
    let word = shell.parse_line_location(args)?.first().copied().unwrap_or_default();
    let address = shell.session.scope.chip().code_address(word);
    shell.session.apply_action(UserAction::Set(ExpressionPlace::Pc, address.into()))?;
    shell.registers = shell.core_registers();
    continue_running(shell, "", out)
}

/// `until`: runs to a location, or to a line behind the current one.
pub(super) fn until(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        note_missing_lines(shell, out);
        return line_steps(shell, "", LineStep::Forward, out);
    }
    let words = shell.parse_line_location(args)?;
    let inside = !shell.return_addresses().is_empty();
    shell.run_and_report(out, |session, keep_running| match inside {
        true => run_out_of_subroutine(session, keep_running, &mut |session| words.contains(&session.machine().pc())),
        false => session.run(&RunGoal { words: words.into_iter().collect(), ..RunGoal::default() }, keep_running),
    });
    Ok(())
}

/// `continue`: runs to the next breakpoint; with a number, ignores hits of the one here.
pub(super) fn continue_running(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let count = shell.parse_count(args)?;
    if count > 1 {
        let pc = shell.session.machine().pc();
        let here = |what: &PointTrigger| matches!(what, PointTrigger::Code(words) if words.contains(&pc));
        let id = shell.session.points.enabled().find(|point| here(&point.trigger)).map(|point| point.id);
        let point = id.and_then(|id| shell.session.points.get_mut(id));
        match point {
            Some(point) => point.ignore = count - 1,
            None => out.push_str("note: there is no breakpoint here, so the count has no effect\n"),
        }
    }
    shell.run_and_report(out, |session, keep_running| session.run(&RunGoal::default(), keep_running));
    Ok(())
}

/// `until-pin`: runs until a pin has a level.
pub(super) fn until_pin(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let chip = shell.session.scope.chip();
    let named = shell.view.as_ref().map_or_else(|| args.to_owned(), |view| chip_pin_text(view, args));
    let own = avr::chip_pin_text(chip, &shell.session.scope.source().names.replace_channel_name(&named));
    let PinAndLevel { pin, level } = parse_pin_level(chip, &own)?;
    let id = shell.session.points.add(PointTrigger::Pin(pin, Some(level)), args, true);
    shell.run_and_report(out, |session, keep_running| session.run(&RunGoal::default(), keep_running));
    shell.session.points.remove(id);
    Ok(())
}

/// `run-to-cycle`: runs to a cycle.
pub(super) fn run_to_cycle(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let cycle = shell.parse_cycle(args)?;
    let now = shell.session.machine().cycle();
    if cycle < now {
        return Err(format!("cycle {cycle} is in the past, the current cycle is {now}; goto-cycle goes back").into());
    }
    shell.run_and_report(out, |session, keep_running| {
        session.run(&RunGoal { until: Some(cycle), runs_while_halted: true, ..RunGoal::default() }, keep_running)
    });
    Ok(())
}

/// `reset`: resets the chip.
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
        found.ok_or_else(|| format!("`{args}` is not a reset; the resets are power, external, watchdog, brownout"))?;
    shell.session.apply_action(UserAction::Reset(*why))?;
    shell.report_position(out);
    Ok(())
}

impl DebugShell {
    /// Parses a machine cycle or a time: `16000`, `$cycle + 100`, `10ms`.
    pub(super) fn parse_cycle(&self, text: &str) -> Result<u64, CommandError> {
        if text.trim().is_empty() {
            return Err("a cycle or a time is missing: 16000, $cycle+100, 10ms".into());
        }
        let is_time = text.trim().ends_with(['s', 'c']) && text.trim().starts_with(|c: char| c.is_ascii_digit());
        if is_time {
            return Ok(self.session.clock().parse_cycles(text.trim())?);
        }
        let value = self.integer_value(text)?;
        u64::try_from(value).map_err(|_| format!("cycle {value} is before power-up").into())
    }

    /// Returns the type of the result of the function of a call; `None` if it is unknown or `void`.
    fn result_type(&self, frame: &CallFrame) -> Option<TypeId> {
        let byte = frame.call_word.saturating_mul(self.session.scope.chip().word_bytes);
        self.session.scope.calls().info.function_at(byte)?.result
    }

    /// Prints the result of a function.
    fn print_result(&mut self, halt: &SessionStopReason, kind: Option<TypeId>, out: &mut String) {
        let chip = self.session.scope.chip();
        let object = kind.and_then(|kind| self.session.scope.calls().result(kind, chip));
        let Some(object) = object.filter(|_| *halt == SessionStopReason::Done) else { return };
        let machine = self.session.machine();
        let value = object.text(&self.session.scope, machine, None);
        let kept = DebugExpression::Object(Box::new(object)).kept(machine);
        let number = self.session.scope.values.push(kept);
        out.push_str(&format!("Value returned is ${number} = {value}\n"));
    }

    /// Parses a location like [`DebugShell::parse_location`], except that a number alone is a line if the
    /// program has lines, as in gdb.
    pub(super) fn parse_line_location(&self, text: &str) -> Result<Vec<u32>, CommandError> {
        let text = text.trim();
        let named = text
            .rsplit_once(':')
            .and_then(|(file, line)| Some(FileLine { file: self.source_file(file)?, line: line.parse().ok()? }));
        match self.parse_line_number(text).or(named) {
            Some(FileLine { file, line }) => {
                // A line without code means the next line with code.
                let lines = self
                    .session
                    .scope
                    .lines
                    .all_lines()
                    .iter()
                    .filter(|known| *known.file == *file && known.line >= line);
                let line = lines.map(|known| known.line).min().unwrap_or(line);
                let scope = &self.session.scope;
                let words = scope.source().parse_words(&format!("{file}:{line}"));
                let words = words.map_err(|why| match scope.has_debug_info() {
                    true => format!("No line {line} in file \"{file}\"."),
                    false => why.to_string(),
                })?;
                let bytes: Vec<u32> = words.iter().map(|word| word * scope.chip().word_bytes).collect();
                Ok(scope.line_words(&bytes))
            }
            None => match self.session.scope.function_words(text) {
                words if words.is_empty() => self.parse_location(text).map_err(|why| self.unknown_location(text, why)),
                words => Ok(words),
            },
        }
    }

    /// Returns why a location is unknown: for a name alone in a C program with the text of gdb.
    fn unknown_location(&self, text: &str, why: CommandError) -> CommandError {
        let is_name = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        match is_name && self.session.scope.has_debug_info() {
            true => format!("Function \"{text}\" not defined.").into(),
            false => why,
        }
    }

    /// Parses a location into program words: an address, a symbol, `main.c:12`, `*EXPR`, `$pc`.
    pub(super) fn parse_location(&self, text: &str) -> Result<Vec<u32>, CommandError> {
        let text = text.trim();
        if let Some(words) = self.rung_location(text) {
            return words;
        }
        // `file.c:function`, which is not the name of a symbol.
        if text.contains(':')
            && let words = self.session.scope.function_starts(text)
            && !words.is_empty()
        {
            return Ok(words);
        }
        let computed = text.strip_prefix('*').or_else(|| text.starts_with('$').then_some(text));
        let Some(expr) = computed else { return Ok(self.session.scope.source().parse_words(text)?) };
        let value = self.integer_value(expr)?;
        let address = u32::try_from(value).map_err(|_| format!("`{text}` is not an address: {value}"))?;
        Ok(self.session.scope.source().parse_words(&format!("0x{address:x}"))?)
    }
}
