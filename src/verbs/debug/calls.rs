//! Commands about active calls: bt, frame, up, down, and the parameters and variables of a call.

use emu_debug::debug::{CallFrame, FileLine, FrameName, NamedObject, ValueAtCall};

use emu_core::image::BlockInfo;

use super::shell::{CommandResult, DebugShell};

/// Text of a value that the compiler has optimized out.
const OPTIMIZED_OUT: &str = "<optimized out>";

/// Prints the active calls, the innermost first; a count limits them, `full` adds the variables of each.
pub(super) fn backtrace(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (mut count, mut outermost, mut full) = (usize::MAX, usize::MAX, false);
    for word in args.split_whitespace() {
        match word.parse::<isize>() {
            Ok(wanted) if wanted < 0 => outermost = wanted.unsigned_abs(),
            Ok(wanted) => count = wanted.unsigned_abs(),
            Err(_) if matches!(word, "full" | "-full") => full = true,
            Err(_) => return Err(format!("`{word}` is not a count of calls; write bt, bt 3, bt -3 or bt full").into()),
        }
    }
    let frames = shell.calls();
    let skipped = shell.not_entered.max(frames.len().saturating_sub(outermost));
    for (level, frame) in frames.iter().enumerate().skip(skipped).take(count) {
        out.push_str(&shell.frame_line(level, frame));
        if full {
            let own = shell.variables(level, false);
            out.push_str(&indented(if own.is_empty() { shell.nothing_known(level, "No locals.\n") } else { &own }));
        }
    }
    if frames.len().saturating_sub(skipped) > count {
        out.push_str("(More stack frames follow...)\n");
    }
    Ok(())
}

/// Indents lines of `name = value`.
fn indented(lines: &str) -> String {
    lines.lines().map(|line| format!("        {line}\n")).collect()
}

/// `frame`: selects a call by number, by function or by address.
pub(super) fn frame(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let args = args.strip_prefix("level ").unwrap_or(args).trim();
    if args.is_empty() {
        return shell.select_frame(shell.level, out);
    }
    if let Some(name) = args.strip_prefix("function ") {
        let is = |frame: &CallFrame| {
            shell
                .session
                .scope
                .calls()
                .frame_name(shell.session.machine(), frame)
                .is_some_and(|own| own.function == name.trim())
        };
        let found = shell.calls().iter().skip(shell.not_entered).position(is);
        let level = found.ok_or_else(|| format!("no call of {} is in progress; bt lists them", name.trim()))?;
        return shell.select_frame(level + shell.not_entered, out);
    }
    let level = shell.integer_value(args)?;
    let level = usize::try_from(level).map_err(|_| format!("there is no call {level}; bt lists them"))?;
    shell.select_frame(level.saturating_add(shell.not_entered), out)
}

/// `select-frame`: selects a call like `frame`, but prints nothing.
pub(super) fn select(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    frame(shell, args, &mut String::new())
}

/// `up`: selects the caller.
pub(super) fn up(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let count = usize::try_from(shell.parse_count(args)?).unwrap_or(usize::MAX);
    let last = shell.calls().len().saturating_sub(1);
    if shell.level >= last {
        return Err("Initial frame selected; you cannot go up.".into());
    }
    shell.select_frame(shell.level.saturating_add(count).min(last), out)
}

/// `down`: selects the called function.
pub(super) fn down(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let count = usize::try_from(shell.parse_count(args)?).unwrap_or(usize::MAX);
    if shell.level <= shell.not_entered {
        return Err("Bottom (innermost) frame selected; you cannot go down.".into());
    }
    shell.select_frame(shell.level.saturating_sub(count).max(shell.not_entered), out)
}

/// `info locals` and `info args`: prints the variables or the parameters of the selected call.
pub(super) fn info_variables(shell: &DebugShell, parameters: bool, out: &mut String) -> CommandResult {
    let found = shell.variables(shell.level, parameters);
    let nothing = shell.nothing_known(shell.level, if parameters { "No arguments.\n" } else { "No locals.\n" });
    out.push_str(if found.is_empty() { nothing } else { &found });
    Ok(())
}

/// `info frame`: prints the selected call with its addresses, in the layout of gdb.
pub(super) fn info_frame(shell: &DebugShell, out: &mut String) -> CommandResult {
    let frames = shell.calls();
    let chip = shell.session.scope.chip();
    let frame = frames.get(shell.level).ok_or("the selected call does not exist any more; bt lists the calls")?;
    let linked = chip.family_traits().linked_data.unwrap_or(0);
    let at = |addr: u32| format!("0x{:x}", linked + addr);
    let frame_at = |frame: &CallFrame| frame.cfa.map(|cfa| at(cfa.saturating_sub(1)));
    let number = shell.level.saturating_sub(shell.not_entered);
    out.push_str(&format!(
        "Stack level {number}{}:\n",
        frame_at(frame).map_or(String::new(), |at| format!(", frame at {at}"))
    ));
    out.push_str(&format!(" pc = {}", shell.place_of_frame(frame)));
    if shell.inlined_block(frame).is_some() {
        out.push_str(&format!("\n inlined into frame {}\n", number + 1));
    } else if let Some(caller) = frames.get(shell.level + 1) {
        out.push_str(&format!("; saved pc = 0x{:x}\n called by ", chip.code_address(caller.word)));
        let caller_at = frame_at(caller).map(|at| format!("frame at {at}"));
        out.push_str(&format!("{}\n", caller_at.unwrap_or_else(|| shell.describe_call(caller))));
    } else {
        out.push_str("\n caller unknown\n");
    }
    let (place, own) = (shell.describe_call(frame), at(frame.sp));
    if let Some((_, arguments)) = place.split_once(" (").filter(|_| shell.is_described(frame)) {
        let arguments = arguments.rsplit_once(") at ").map_or(arguments.trim_end_matches(')'), |(own, _)| own);
        out.push_str(&format!(" source language c.\n Arglist at {own}, args: {arguments}\n Locals at {own}"));
    } else {
        out.push_str(&format!(" Locals at {own}"));
    }
    out.push_str(&frame.cfa.map_or("\n".to_owned(), |cfa| format!(", Previous frame's sp is 0x{cfa:x}\n")));
    let Some(caller) = frames.get(shell.level + 1) else { return Ok(()) };
    let saved = (0..).zip(caller.saved_registers.iter().zip(&frame.saved_registers));
    let saved = saved.filter(|(_, (now, before))| now != before);
    let saved: Vec<String> = saved.filter_map(|(n, (addr, _))| Some(format!("r{n} at {}", at((*addr)?)))).collect();
    if !saved.is_empty() {
        out.push_str(&format!(" Saved registers:\n  {}\n", saved.join(", ")));
    }
    Ok(())
}

impl DebugShell {
    /// Selects the call of a level, and prints it.
    fn select_frame(&mut self, level: usize, out: &mut String) -> CommandResult {
        let frames = self.calls();
        let frame = frames.get(level).ok_or_else(|| format!("there is no call {level}; bt lists them"))?;
        (self.level, self.listed) = (level, None);
        out.push_str(&self.frame_line(level, frame));
        if let Some(FileLine { file, line: number }) = self.current_line()
            && let Some(text) = self.source_text(&file, number)
        {
            out.push_str(&format!("{number}\t{text}\n"));
        }
        Ok(())
    }

    /// Returns the text of a source line.
    pub(super) fn source_text(&mut self, file: &str, number: u32) -> Option<String> {
        let lines = self.sources.file(&self.session.scope.lines, file)?;
        (number as usize).checked_sub(1).and_then(|at| lines.get(at)).map(|text| text.trim_end().to_owned())
    }

    /// Returns the inlined block of the function of a call, if that function was inlined.
    pub(super) fn inlined_block(&self, frame: &CallFrame) -> Option<BlockInfo> {
        let bytes = self.session.scope.chip().word_bytes;
        let byte = frame.call_word.saturating_mul(bytes);
        self.session.scope.calls().inlined(byte).get(frame.inlined_skipped).map(|block| (*block).clone())
    }

    /// Returns a call as gdb prints it, with its parameters if the program describes its function; otherwise
    /// its location.
    pub(super) fn frame_line(&self, level: usize, frame: &CallFrame) -> String {
        let place = self.describe_call(frame);
        let innermost = level == self.not_entered;
        let level = level.saturating_sub(self.not_entered);
        match self.is_described(frame) {
            true if frame.inlined_skipped > 0 || innermost && self.begins_line(frame) => format!("#{level}  {place}\n"),
            true => {
                let address = self.session.scope.chip().code_address(frame.word);
                format!("#{level}  0x{address:08x} in {place}\n")
            }
            false => format!("#{level}  {}\n", self.session.scope.source().describe_word(frame.word)),
        }
    }

    /// Returns the source line that a call is at; for a function with an inlined call it is the line of that
    /// call.
    pub(super) fn line_of_frame(&self, frame: &CallFrame) -> Option<FileLine> {
        let scope = &self.session.scope;
        let own = scope
            .source()
            .line_at(frame.call_word)
            .map(|line| FileLine { file: line.file.to_string(), line: line.line });
        let Some(FrameName { call: Some((file, line)), .. }) = scope.calls().frame_name(self.session.machine(), frame)
        else {
            return own;
        };
        let is = |known: &str| known.rsplit('/').next() == Some(file.as_str());
        let file = scope.lines.all_lines().iter().map(|line| &*line.file).find(|known| is(known));
        file.map(|file| FileLine { file: file.to_owned(), line: *line }).or(own)
    }

    /// Returns true if a call is at the first instruction of a row of the line table.
    fn begins_line(&self, frame: &CallFrame) -> bool {
        let scope = &self.session.scope;
        let byte = frame.word.saturating_mul(scope.chip().word_bytes);
        scope.source().line_at(frame.word).is_some_and(|line| line.addr == byte)
    }

    /// Returns the location of a call: `0x228 in turn (pump.c:11)`.
    fn place_of_frame(&self, frame: &CallFrame) -> String {
        let scope = &self.session.scope;
        match (scope.calls().frame_name(self.session.machine(), frame), self.line_of_frame(frame)) {
            (Some(FrameName { function: name, .. }), Some(FileLine { file, line })) => {
                format!("0x{:x} in {name} ({file}:{line})", scope.chip().code_address(frame.word))
            }
            _ => scope.source().describe_word(frame.word),
        }
    }

    /// Returns whether debugging information describes the function of a call.
    pub(super) fn is_described(&self, frame: &CallFrame) -> bool {
        let byte = frame.call_word.saturating_mul(self.session.scope.chip().word_bytes);
        self.session.scope.calls().info.function_at(byte).is_some()
    }

    /// Returns a call with its arguments and line: `total (of=0x8ee, count=3) at main.c:13`.
    fn describe_call(&self, frame: &CallFrame) -> String {
        let scope = &self.session.scope;
        let Some(FrameName { function: name, .. }) = scope.calls().frame_name(self.session.machine(), frame) else {
            return scope.source().describe_word(frame.word);
        };
        let level = self.calls().iter().position(|known| known == frame).unwrap_or(0);
        let value = |NamedObject { name, object }: NamedObject| {
            // As in gdb, structs and arrays are left out.
            if !object.is_scalar() {
                return format!("{name}=...");
            }
            let (text, target) = (object.text_without_type(scope, self.session.machine()), self.session.machine());
            match object.text_at_call(scope, target) {
                Some(ValueAtCall { text: before, unchanged: true }) => format!("{name}={name}@entry={before}"),
                Some(ValueAtCall { text: before, .. }) if text == OPTIMIZED_OUT => {
                    format!("{name}={text}, {name}@entry={before}")
                }
                _ => format!("{name}={text}"),
            }
        };
        let parameters: Vec<String> =
            scope.locals(self.session.machine(), level, true).into_iter().map(value).collect();
        let line =
            self.line_of_frame(frame).map_or(String::new(), |FileLine { file, line }| format!(" at {file}:{line}"));
        format!("{name} ({}){line}", parameters.join(", "))
    }

    /// Returns the text for a call without variables: `nothing` if the program describes its function,
    /// otherwise that there is no symbol table.
    fn nothing_known(&self, level: usize, nothing: &'static str) -> &'static str {
        let (calls, frames) = (self.session.scope.calls(), self.calls());
        let has_function =
            frames.get(level).is_some_and(|frame| calls.frame_name(self.session.machine(), frame).is_some());
        if has_function { nothing } else { "No symbol table info available.\n" }
    }

    /// Returns the parameters, or the other variables, of a call, one per line.
    fn variables(&self, level: usize, parameters: bool) -> String {
        let (scope, target) = (&self.session.scope, self.session.machine());
        let found = scope.locals(target, level, parameters).into_iter();
        found
            .map(|NamedObject { name, object }| format!("{name} = {}\n", object.text_without_type(scope, target)))
            .collect()
    }
}
