//! Commands about breakpoints and watchpoints.

use emu_debug::debug::{
    AccessKind, CallEnd, CallFrame, DebugError, DebugExpression, DebugPoint, ExpressionPlace, ExpressionValue,
    FileLine, PointTrigger, WatchedRange,
};
use emu_debug::stimulus::parse_pin_level;

use super::command_error::CommandError;
use super::shell::{CommandResult, DebugShell};

/// Splits `LOCATION if EXPR` into the location and the condition.
fn split_condition(args: &str) -> (&str, Option<&str>) {
    let found = args.strip_prefix("if ").map(|condition| ("", condition));
    let found = found.or_else(|| args.split_once(" if "));
    found.map_or((args.trim(), None), |(place, condition)| (place.trim(), Some(condition.trim())))
}

/// `break`: sets a breakpoint.
pub(super) fn set_break(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    code_point(shell, args, false, out)
}

/// `tbreak`: sets a breakpoint that is deleted at its first hit.
pub(super) fn set_tbreak(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    code_point(shell, args, true, out)
}

fn code_point(shell: &mut DebugShell, args: &str, temporary: bool, out: &mut String) -> CommandResult {
    let (place, condition) = split_condition(args);
    let words = if place.is_empty() { vec![shell.session.machine().pc()] } else { shell.parse_line_location(place)? };
    let places: Vec<String> = words.iter().map(|word| shell.word_with_rung(*word)).collect();
    let text = if place.is_empty() || place.starts_with(['*', '$']) {
        places.first().cloned().unwrap_or_default()
    } else {
        shell
            .parse_line_number(place)
            .map_or_else(|| place.to_owned(), |FileLine { file, line }| format!("{file}:{line}"))
    };
    let id = add_point(shell, PointTrigger::Code(words), &text, condition, temporary)?;
    let kind = if temporary { "Temporary breakpoint" } else { "Breakpoint" };
    out.push_str(&format!("{kind} {id} at {}\n", shell.places_of_point(id, &places)));
    Ok(())
}

/// Adds a point with its condition, which is parsed first.
fn add_point(
    shell: &mut DebugShell,
    what: PointTrigger,
    text: &str,
    condition: Option<&str>,
    temporary: bool,
) -> Result<u32, CommandError> {
    // A name in the condition of a breakpoint is resolved at the breakpoint.
    let at = if let PointTrigger::Code(words) = &what { words.first().copied() } else { None };
    let wanted = condition;
    let condition = condition.map(|text| condition_at(shell, text, at)).transpose()?;
    let id = shell.session.points.add(what, text, temporary);
    if let Some(point) = shell.session.points.get_mut(id) {
        point.condition = condition;
        point.condition_text = wanted.unwrap_or_default().to_owned();
    }
    shell.session.scope.values.set("bpnum", DebugExpression::Number(id.into()));
    Ok(id)
}

fn condition_at(shell: &DebugShell, text: &str, word: Option<u32>) -> Result<DebugExpression, CommandError> {
    Ok(match word {
        Some(word) => shell.session.scope.parse_expression_at_word(text, word)?,
        None => shell.session.scope.parse_expression_in_frame(text, shell.session.machine(), 0)?,
    })
}

/// `watch`: stops when a place changes or is written.
pub(super) fn watch(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (text, condition) = split_condition(args);
    let (text, by_place) = without_location_flag(text);
    if text.is_empty() {
        return Err("the place is missing (memory, a register, a bit or a pin): watch buf".into());
    }
    let what = parse_watch(shell, text)?;
    if by_place && !matches!(what, PointTrigger::Change(DebugExpression::Place(_)) | PointTrigger::Pin(..)) {
        return Err(
            format!("`{text}` is not in memory or has more than four bytes, so its place cannot be watched").into()
        );
    }
    // A watchpoint on a variable of a call ends with the call; a watchpoint on a place does not.
    let name = if by_place { format!("-location {text}") } else { text.to_owned() };
    let end = if by_place {
        None
    } else {
        shell.parse_expression(text).is_ok_and(|expr| expr.is_local()).then(|| shell.call_end()).flatten()
    };
    let id = add_point(shell, what, &name, condition, false)?;
    if let Some(point) = shell.session.points.get_mut(id) {
        point.call_end = end;
    }
    let is_pin = shell.session.points.get(id).is_some_and(|point| matches!(point.trigger, PointTrigger::Pin(..)));
    let kind = if is_pin { "Watchpoint" } else { "Hardware watchpoint" };
    out.push_str(&format!("{kind} {id}: {name}\n"));
    Ok(())
}

/// Strips `-l` or `-location` from the front, and returns whether it was there.
fn without_location_flag(text: &str) -> (&str, bool) {
    let rest = ["-location ", "-l "].iter().find_map(|flag| text.strip_prefix(flag));
    (rest.unwrap_or(text).trim(), rest.is_some())
}

impl DebugShell {
    /// Returns the return address of the selected call as a program word, and the stack pointer after the
    /// return.
    fn call_end(&self) -> Option<CallEnd> {
        let frames = self.calls();
        let own = frames.get(self.level)?;
        let outer = frames.iter().skip(self.level + 1);
        let end = |frame: &CallFrame| CallEnd { return_word: frame.word, stack_pointer: frame.sp };
        outer.map(end).find(|found| *found != end(own))
    }
}

/// Parses what to watch: a pin by its edges, `PB5=1` for a level, anything else by its value.
fn parse_watch(shell: &DebugShell, text: &str) -> Result<PointTrigger, CommandError> {
    let scope = &shell.session.scope;
    if let Some((name, level)) =
        text.split_once('=').filter(|(name, level)| !name.ends_with(['=', '!', '<', '>']) && !level.starts_with('='))
    {
        let DebugExpression::Place(ExpressionPlace::Pin(pin)) = shell.parse_expression(name)? else {
            return Err(format!("`{}` is not a pin; write watch {} if {text}=..", name.trim(), name.trim()).into());
        };
        let name = scope.chip().pins.get(usize::from(pin)).map_or("", |pin| pin.name);
        return Ok(PointTrigger::Pin(
            pin,
            Some(parse_pin_level(scope.chip(), &format!("{name}={}", level.trim()))?.level),
        ));
    }
    Ok(match shell.parse_expression(text)?.bind_to_place(shell.session.machine()) {
        DebugExpression::Place(ExpressionPlace::Pin(pin)) => PointTrigger::Pin(pin, None),
        DebugExpression::Place(ExpressionPlace::Cycle | ExpressionPlace::Instructions) => {
            return Err("time changes with every instruction; run-to-cycle stops at one".into());
        }
        expr if expr.object().is_some_and(|of| of.is_computed()) && expr.is_optimized_out(shell.session.machine()) => {
            return Err("value has been optimized out".into());
        }
        expr if expr.depends_only_on_time() => {
            return Err(
                "time advances during sleep, where no watchpoint is checked; run-to-cycle stops at a cycle".into()
            );
        }
        expr if expr.is_constant() => return Err(format!("cannot watch a constant: nothing changes `{text}`").into()),
        expr if expr.object().is_none_or(|of| of.is_computed())
            && matches!(expr.evaluate(shell.session.machine()), Some(ExpressionValue::Real(..))) =>
        {
            return Err("a floating-point expression cannot be watched; watch its variables".into());
        }
        expr => PointTrigger::Change(expr),
    })
}

/// `rwatch`: stops when a place is read.
pub(super) fn rwatch(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    access(shell, args, AccessKind::Read, out)
}

/// `awatch`: stops when a place is read or written.
pub(super) fn awatch(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    access(shell, args, AccessKind::Any, out)
}

fn access(shell: &mut DebugShell, args: &str, access: AccessKind, out: &mut String) -> CommandResult {
    let (text, condition) = split_condition(args);
    let text = without_location_flag(text).0;
    let found = shell.session.scope.parse_watched_range(text, shell.session.machine());
    let WatchedRange { range, description: name } = found.map_err(|why| match why {
        DebugError::UnknownSymbolHere { .. } => why.to_string(),
        why => format!("{why}; watch {text} detects its changes"),
    })?;
    let id = add_point(shell, PointTrigger::Access(range, access), &name, condition, false)?;
    let kind = if access == AccessKind::Read { "read" } else { "access (read/write)" };
    out.push_str(&format!("Hardware {kind} watchpoint {id}: {name}\n"));
    Ok(())
}

/// Parses the number of a point at the front of the arguments, and returns the rest.
fn parse_point_number<'a>(shell: &DebugShell, args: &'a str) -> Result<(u32, &'a str), CommandError> {
    let (number, rest) = args.split_once(char::is_whitespace).unwrap_or((args, ""));
    Ok((find_point(shell, number)?, rest.trim()))
}

fn find_point(shell: &DebugShell, number: &str) -> Result<u32, CommandError> {
    if number.is_empty() {
        return Err("the number of a point is missing; `info break` lists them".into());
    }
    // `$bpnum`, as `save breakpoints` writes it.
    let named = || u32::try_from(shell.integer_value(number.strip_prefix('$').map(|_| number)?).ok()?).ok();
    let id = number.parse().ok().or_else(named).filter(|id| shell.session.points.get(*id).is_some());
    id.ok_or_else(|| format!("there is no point {number}; `info break` lists them").into())
}

/// Parses numbers of points: `1 2`, `1-3`.
pub(super) fn numbers(shell: &DebugShell, args: &str) -> Result<Vec<u32>, CommandError> {
    let mut found = Vec::new();
    for word in args.split_whitespace() {
        let range = word.split_once('-').and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
        match range {
            Some((first, last)) => {
                let ids = shell.session.points.all().iter().map(|point| point.id);
                let before = found.len();
                found.extend(ids.filter(|id: &u32| (first..=last).contains(id)));
                if found.len() == before {
                    return Err(format!("there is no point {word}; `info break` lists them").into());
                }
            }
            None => found.push(find_point(shell, word)?),
        }
    }
    Ok(found)
}

/// `condition`: sets or removes the condition of a point.
pub(super) fn condition(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (id, text) = parse_point_number(shell, args)?;
    let at = shell.session.points.get(id).and_then(|point| match &point.trigger {
        PointTrigger::Code(words) => words.first().copied(),
        _ => None,
    });
    let condition = if text.is_empty() { None } else { Some(condition_at(shell, text, at)?) };
    if condition.is_none() {
        out.push_str(&format!("Breakpoint {id} now unconditional.\n"));
    }
    if let Some(point) = shell.session.points.get_mut(id) {
        point.condition = condition;
        point.condition_text = text.to_owned();
    }
    Ok(())
}

/// `ignore`: ignores the next hits of a point.
pub(super) fn ignore(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (id, text) = parse_point_number(shell, args)?;
    let count = shell.integer_value(if text.is_empty() { "0" } else { text })?;
    let count = u64::try_from(count).map_err(|_| format!("{count} is not a count"))?;
    if let Some(point) = shell.session.points.get_mut(id) {
        point.ignore = count;
    }
    out.push_str(&match count {
        0 => format!("Will stop next time breakpoint {id} is reached.\n"),
        1 => format!("Will ignore next crossing of breakpoint {id}.\n"),
        _ => format!("Will ignore next {count} crossings of breakpoint {id}.\n"),
    });
    Ok(())
}

/// `commands`: reads the commands that are executed at hits of a point.
pub(super) fn commands(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    let last = shell.session.points.all().last().map(|point| point.id);
    let id = match args {
        "" => last.ok_or("there is no point yet")?,
        number => find_point(shell, number)?,
    };
    shell.begin_commands(id);
    Ok(())
}

/// `delete`: deletes points.
pub(super) fn delete(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    // gdb has `delete breakpoints`, `delete display`.
    if let Some(displays) = args.strip_prefix("display") {
        return super::displays::undisplay(shell, displays.trim(), &mut String::new());
    }
    let args = args.strip_prefix("breakpoints").unwrap_or(args).trim();
    if args.is_empty() {
        shell.session.points.clear();
    }
    numbers(shell, args)?.into_iter().for_each(|id| _ = shell.session.points.remove(id));
    Ok(())
}

/// `clear`: deletes the breakpoints at a location.
pub(super) fn clear(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let words = if args.is_empty() { vec![shell.session.machine().pc()] } else { shell.parse_line_location(args)? };
    let there =
        |what: &PointTrigger| matches!(what, PointTrigger::Code(own) if own.iter().any(|word| words.contains(word)));
    let ids: Vec<u32> =
        shell.session.points.all().iter().filter(|point| there(&point.trigger)).map(|point| point.id).collect();
    if ids.is_empty() {
        return Err("there is no breakpoint there; `info breakpoints` lists them".into());
    }
    for id in ids {
        shell.session.points.remove(id);
        out.push_str(&format!("Deleted breakpoint {id}\n"));
    }
    Ok(())
}

/// `enable`: enables points or displays.
pub(super) fn enable(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    if let Some(displays) = after_word(args, "display") {
        return super::displays::enable_displays(shell, displays, true);
    }
    let args = after_word(args, "breakpoints").unwrap_or(args);
    if let Some(args) = after_word(args, "once") {
        return set_disposition(shell, args, |point| point.stops_left = Some(1));
    }
    if let Some(args) = after_word(args, "delete") {
        return set_disposition(shell, args, |point| point.temporary = true);
    }
    if let Some(args) = after_word(args, "count") {
        let (count, args) = args.split_once(char::is_whitespace).unwrap_or((args, ""));
        let count = shell.parse_count(count)?;
        return set_disposition(shell, args.trim(), |point| point.stops_left = Some(count));
    }
    set_enabled(shell, args, true)
}

/// `disable`: disables points or displays.
pub(super) fn disable(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    if let Some(displays) = after_word(args, "display") {
        return super::displays::enable_displays(shell, displays, false);
    }
    set_enabled(shell, after_word(args, "breakpoints").unwrap_or(args), false)
}

/// Returns the text after a word at the front of the arguments, or `None` if the word is not there.
fn after_word<'a>(args: &'a str, word: &str) -> Option<&'a str> {
    let rest = args.strip_prefix(word)?;
    (rest.is_empty() || rest.starts_with(char::is_whitespace)).then(|| rest.trim())
}

/// Enables points, and sets what happens to them when they stop the program.
fn set_disposition(shell: &mut DebugShell, args: &str, set: impl Fn(&mut DebugPoint)) -> CommandResult {
    if args.is_empty() {
        return Err("the number of a point is missing; `info break` lists them".into());
    }
    for id in numbers(shell, args)? {
        if let Some(point) = shell.session.points.get_mut(id) {
            point.enabled = true;
            (point.temporary, point.stops_left) = (false, None);
            set(point);
        }
    }
    Ok(())
}

fn set_enabled(shell: &mut DebugShell, args: &str, on: bool) -> CommandResult {
    let ids: Vec<u32> = match args {
        "" => shell.session.points.all().iter().map(|point| point.id).collect(),
        _ => numbers(shell, args)?,
    };
    for id in ids {
        if let Some(point) = shell.session.points.get_mut(id) {
            point.enabled = on;
        }
    }
    Ok(())
}

/// Returns the commands that set all points, for `source`.
pub(super) fn commands_that_set(shell: &DebugShell) -> String {
    let mut text = String::new();
    for point in shell.session.points.all() {
        let word = match (&point.trigger, point.temporary) {
            (PointTrigger::Code(_), true) => "tbreak",
            (PointTrigger::Code(_), false) => "break",
            (PointTrigger::Access(_, AccessKind::Read), _) => "rwatch",
            (PointTrigger::Access(..), _) => "awatch",
            (PointTrigger::Change(_) | PointTrigger::Pin(..), _) => "watch",
        };
        // The text of a breakpoint at an instruction is its address and a description; only the address is a
        // location.
        let at_word = point.text.starts_with("0x").then(|| point.text.split(' ').next()).flatten();
        let place = at_word.unwrap_or(&point.text);
        let place = place.strip_prefix("the byte of ").unwrap_or(place);
        text.push_str(&format!("{word} {place}\n"));
        if point.condition.is_some() {
            text.push_str(&format!("  condition $bpnum {}\n", point.condition_text));
        }
        if point.ignore > 0 {
            text.push_str(&format!("  ignore $bpnum {}\n", point.ignore));
        }
        if !point.commands.is_empty() {
            let lines: String = point.commands.iter().map(|line| format!("    {line}\n")).collect();
            text.push_str(&format!("  commands\n{lines}  end\n"));
        }
        match (point.enabled, point.stops_left) {
            (false, _) => text.push_str("disable $bpnum\n"),
            (true, Some(left)) => text.push_str(&format!("enable count {left} $bpnum\n")),
            (true, None) => {}
        }
    }
    text
}
