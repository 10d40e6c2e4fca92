//! Commands that go back in time.

use emu_debug::debug::{
    AccessKind, DebugExpression, EarlierHit, ExpressionPlace, NameScope, PassedPosition, PointHit, PointTrigger,
    SessionStopReason, TimedAction, UserAction,
};

use super::command_error::CommandError;
use super::frames::{CallScope, FrameSearch};
use super::numbers::short_hex;
use super::shell::{CommandResult, DebugShell};
use super::steps::repeat_steps;

/// `reverse-stepi`: goes back by instructions.
pub(super) fn stepi(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let count = shell.parse_count(args)?;
    shell.run_and_report(out, |session, keep_running| session.step_back(count, keep_running));
    Ok(())
}

/// `reverse-continue`: goes back to the last hit of a breakpoint or watchpoint.
pub(super) fn reverse_continue(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    shell.run_and_report(out, |session, keep_running| session.run_back(keep_running));
    Ok(())
}

/// `goto-cycle`: goes to a cycle, forwards or backwards.
pub(super) fn goto_cycle(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let cycle = shell.parse_cycle(args)?;
    shell.run_and_report(out, |session, keep_running| {
        let halt = session.goto_cycle(cycle, keep_running);
        // Reaching the requested cycle is the normal end and is not reported.
        if halt == SessionStopReason::Limit { SessionStopReason::Done } else { halt }
    });
    Ok(())
}

/// Selects the positions at which a backward search may stop.
type PositionFilter = fn(&NameScope, &PassedPosition<'_>) -> bool;

/// Goes back to the last position that `wanted` and `calls` accept, as many times as `args` says.
fn reverse_search(
    shell: &mut DebugShell,
    args: &str,
    calls: CallScope,
    wanted: PositionFilter,
    out: &mut String,
) -> CommandResult {
    let count = shell.parse_count(args)?;
    shell.run_and_report(out, |session, keep_running| {
        repeat_steps(count, keep_running, |keep_running| {
            let now = session.machine().cycle();
            let halt = FrameSearch::search(session, calls, wanted, &mut *keep_running);
            match halt {
                // A breakpoint in a call that the step has crossed stops it, as in gdb.
                SessionStopReason::Done | SessionStopReason::Beginning => {
                    session.forward_to_passed_breakpoint(now, keep_running).unwrap_or(halt)
                }
                _ => halt,
            }
        })
    });
    Ok(())
}

/// Returns true if a source line begins at a position.
fn begins_line(scope: &NameScope, passed: &PassedPosition<'_>) -> bool {
    let source = scope.source();
    let (pc, bytes) = (passed.machine.pc(), scope.chip().word_bytes);
    let Some(line) = source.line_at(pc) else { return false };
    let before = source.line_at(passed.from_word).map(|line| (&line.file, line.line));
    line.addr == pc * bytes && before != Some((&line.file, line.line))
}

fn has_lines(shell: &DebugShell) -> bool {
    !shell.session.scope.lines.all_lines().is_empty()
}

/// `reverse-step`: goes back to the beginning of the last line, also in calls.
pub(super) fn step(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if !has_lines(shell) {
        return reverse_search(shell, args, CallScope::Into, |_, _| true, out);
    }
    reverse_search(shell, args, CallScope::Into, begins_line, out)
}

/// `reverse-next`: goes back to the beginning of the last line of the function.
pub(super) fn next(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if !has_lines(shell) {
        return reverse_search(shell, args, CallScope::Over, |_, _| true, out);
    }
    reverse_search(shell, args, CallScope::Over, begins_line, out)
}

/// `reverse-nexti`: goes back by instructions, over calls.
pub(super) fn nexti(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    reverse_search(shell, args, CallScope::Over, |_, _| true, out)
}

/// `reverse-finish`: goes back to the call of the function.
pub(super) fn finish(shell: &mut DebugShell, _: &str, out: &mut String) -> CommandResult {
    if shell.return_addresses().is_empty() {
        return Err("the stack contains no call to go back out of".into());
    }
    reverse_search(shell, "", CallScope::Out, |_, _| true, out)
}

/// `last-write`: finds the last change of a place; with ` go`, goes there.
pub(super) fn last_write(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (text, moves) = match args.strip_suffix(" go") {
        Some(text) => (text.trim(), true),
        None => (args.trim(), false),
    };
    if text.is_empty() {
        return Err("the place is missing: last-write buf, last-write PORTB.5, last-write data:0x100".into());
    }
    let here = shell.session.machine().cycle();
    let mut found = last_change(shell, text)?;
    // The machine is at that write already, so the write before it is meant.
    if moves && found.is_some_and(|EarlierHit { cycle, .. }| cycle == here) {
        shell.session.step_back(1, &mut || true);
        found = last_change(shell, text)?;
        if found.is_none() {
            shell.session.goto_cycle(here, &mut || true);
        }
    }
    let place = shell.parse_expression(text)?.place(shell.session.machine());
    if let Some((cycle, value)) =
        place.and_then(|place| last_set(shell, place, if moves { here } else { here.saturating_add(1) }))
        && found.is_none_or(|EarlierHit { cycle: last, .. }| cycle >= last)
    {
        out.push_str(&format!("{text} {}, set by hand at cycle {cycle}\n", short_hex(value)));
        if moves {
            shell.run_and_report(out, |session, keep_running| session.goto_cycle(cycle, keep_running));
        }
        return Ok(());
    }
    let Some(EarlierHit { cycle, hit }) = found else {
        out.push_str(&format!("{text} did not change in this history\n"));
        return Ok(());
    };
    let value = match (hit.old, hit.new) {
        (Some(old), Some(new)) => format!("{} -> {}", short_hex(old), short_hex(new)),
        (None, Some(new)) => short_hex(new),
        _ => String::new(),
    };
    let instruction = shell.instruction(hit.pc).text;
    out.push_str(&format!("{text} {value}, by {}: {instruction}, at cycle {cycle}\n", shell.word_with_rung(hit.pc)));
    if moves {
        shell.run_and_report(out, |session, keep_running| session.goto_cycle(cycle, keep_running));
    }
    Ok(())
}

/// `reverse-last`: goes back to the last change of a place.
pub(super) fn reverse_last(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    last_write(shell, &format!("{args} go"), out)
}

/// Finds the last `set` of a place, or of a part of it, before cycle `end`. Returns its cycle and the value
/// after it.
fn last_set(shell: &DebugShell, place: ExpressionPlace, end: u64) -> Option<(u64, i64)> {
    let bytes = |place: ExpressionPlace| match place {
        ExpressionPlace::Memory { space, addr, bytes, .. } => Some((space, addr..addr + u32::from(bytes))),
        ExpressionPlace::Bit { space, addr, .. } => Some((space, addr..addr + 1)),
        _ => None,
    };
    let touches = |other: ExpressionPlace| match (place, other, bytes(place), bytes(other)) {
        (ExpressionPlace::RegBit { name, .. }, ExpressionPlace::Reg(of), ..)
        | (ExpressionPlace::Reg(of), ExpressionPlace::RegBit { name, .. }, ..) => name == of,
        (ExpressionPlace::Bit { bit, .. }, ExpressionPlace::Bit { bit: set, .. }, one, two) => one == two && bit == set,
        (.., Some((space, own)), Some((of, set))) => space == of && own.start < set.end && set.start < own.end,
        _ => place == other,
    };
    let sets = shell.session.input_events().filter_map(|TimedAction { cycle, action }| match action {
        UserAction::Set(set, _) if touches(*set) => Some(cycle),
        _ => None,
    });
    let cycle = sets.filter(|cycle| *cycle < end).last()?;
    // The resulting value of the whole place, whichever part was set.
    Some((cycle, shell.session.value_at(place, cycle)?))
}

/// Finds the last change of a place, or if there is none the last write to its bytes.
fn last_change(shell: &mut DebugShell, text: &str) -> Result<Option<EarlierHit>, CommandError> {
    let interrupted = |_| CommandError::from("interrupted");
    let expr = shell.parse_expression(text)?;
    let place = expr.place(shell.session.machine()).ok_or_else(|| format!("`{text}` cannot be written"))?;
    let bytes = match place {
        ExpressionPlace::Memory { space, addr, bytes, .. } => Some((space, addr, u32::from(bytes))),
        ExpressionPlace::Bit { space, addr, .. } => Some((space, addr, 1)),
        ExpressionPlace::Pin(_) | ExpressionPlace::Reg(_) | ExpressionPlace::RegBit { .. } => None,
        ExpressionPlace::Pc | ExpressionPlace::Cycle | ExpressionPlace::Instructions => {
            return Err(format!("`{text}` changes with every instruction").into());
        }
    };
    let by_bytes = |shell: &mut DebugShell| {
        let Some((space, addr, bytes)) = bytes else { return Ok(None) };
        let width = shell.session.scope.chip().bytes_per_address(space).max(1);
        let range = emu_debug::AddressRange { space, start: addr / width, end: (addr + bytes).div_ceil(width) };
        shell
            .session
            .last_access(PointTrigger::Access(range, AccessKind::Write), &mut shell.keep_running())
            .map_err(interrupted)
    };
    let by_value = |shell: &mut DebugShell| {
        let found = shell
            .session
            .last_access(PointTrigger::Change(DebugExpression::Place(place)), &mut shell.keep_running())
            .map_err(interrupted)?;
        Ok::<_, CommandError>(found.map(|EarlierHit { cycle, hit }| {
            let pc = shell.session.step_ending_at(cycle).unwrap_or(hit.pc);
            EarlierHit { cycle, hit: PointHit { pc, ..hit } }
        }))
    };
    // The byte of a bit is also written for other bits, and a register of the chip can change without a
    // write.
    if matches!(place, ExpressionPlace::Memory { .. }) {
        let found = by_bytes(shell)?;
        return if found.is_some() { Ok(found) } else { by_value(shell) };
    }
    let found = by_value(shell)?;
    if found.is_some() { Ok(found) } else { by_bytes(shell) }
}
