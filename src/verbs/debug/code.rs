//! Commands about the program: disas and list, and the active calls.

use emu_debug::debug::{FileLine, NamedFunction};
use std::ops::Range;

use emu_core::chip::ChipFamily;
use emu_debug::address_names::decimal_offset;
use emu_debug::debug::CallFrame;
use ladder_view::LadderView;

use super::command_error::CommandError;
use super::shell::{CommandResult, DebugShell};

/// Default number of instructions or lines of a listing.
pub(super) const LINES_SHOWN: u32 = 10;

/// Maximum distance in words from the next instruction back to the start of its function, for `disas` to
/// begin there.
const MAX_FUNCTION_DISTANCE: u32 = 24;

/// Optional columns of `disas`.
#[derive(Debug, Clone, Copy, Default)]
struct ListingStyle {
    /// Show the source lines.
    lined: bool,
    /// Show the bytes of the code.
    raw: bool,
}

/// Splits the flags `/s`, `/m` and `/r` of gdb from the text after them.
fn listing_flags(args: &str) -> Result<(ListingStyle, &str), CommandError> {
    let (mut style, mut args) = (ListingStyle::default(), args);
    while let Some(rest) = args.strip_prefix('/') {
        let (flags, rest) = rest.split_once(char::is_whitespace).unwrap_or((rest, ""));
        for flag in flags.chars() {
            match flag {
                's' | 'm' => style.lined = true,
                'r' | 'b' => style.raw = true,
                _ => return Err(format!("`/{flag}` is unknown; /s shows lines of the source, /r the bytes").into()),
            }
        }
        args = rest.trim_start();
    }
    Ok((style, args))
}

/// `disas`: prints instructions.
pub(super) fn disas(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (style, args) = listing_flags(args)?;
    if let Some((first, last)) = args.split_once(',') {
        let first = shell.parse_location(first)?.first().copied().unwrap_or_default();
        let last = last.trim();
        let end = match last.strip_prefix('+') {
            Some(bytes) => {
                let words = shell.parse_count(bytes)? / u64::from(shell.session.scope.chip().code_address(1).max(1));
                first.saturating_add(u32::try_from(words).unwrap_or(u32::MAX))
            }
            None => shell.parse_location(last)?.first().copied().unwrap_or_default(),
        };
        let at = |word: u32| shell.session.scope.chip().code_address(word);
        out.push_str(&format!("Dump of assembler code from 0x{:x} to 0x{:x}:\n", at(first), at(end)));
        shell.dump(first..end, None, style, out);
        return Ok(());
    }
    let (place, count) = match args.trim().rsplit_once(char::is_whitespace) {
        Some((place, count)) if count.parse::<u32>().is_ok() => (place.trim(), count.parse().ok()),
        _ => (args.trim(), None),
    };
    let next = shell.next_disassembly().filter(|_| place.is_empty() && shell.repeated);
    let word = match (place, next) {
        ("", Some(next)) => next,
        ("", None) => shell.calls().get(shell.level).map_or(shell.session.machine().pc(), |frame| frame.word),
        _ => shell.parse_location(place)?.first().copied().unwrap_or_default(),
    };
    let function = shell.session.scope.calls().function(word).cloned();
    if let Some(NamedFunction { words, name }) = function.filter(|_| count.is_none() && next.is_none()) {
        out.push_str(&format!("Dump of assembler code for function {name}:\n"));
        shell.dump(words, Some(&name), style, out);
        return Ok(());
    }
    let start = if place.is_empty() && next.is_none() { shell.function_start() } else { word };
    let ListedCode { text, next } = shell.listing(start, count.unwrap_or(LINES_SHOWN), style);
    shell.disassembly = Some((shell.session.machine().cycle(), next));
    out.push_str(&text);
    Ok(())
}

/// Instructions as text.
#[derive(Debug, Clone)]
pub(super) struct ListedCode {
    /// The lines.
    pub(super) text: String,
    /// The program word after them.
    pub(super) next: u32,
}

impl DebugShell {
    /// Returns the word where the last `disas` ended, if the machine has not moved since.
    fn next_disassembly(&self) -> Option<u32> {
        self.disassembly.filter(|(at, _)| *at == self.session.machine().cycle()).map(|(_, next)| next)
    }

    /// Returns the start of the function of the next instruction if it is near, otherwise the next
    /// instruction.
    fn function_start(&self) -> u32 {
        let (pc, chip) = (self.session.machine().pc(), self.session.scope.chip());
        let symbols = self.session.scope.symbols.iter().filter(|symbol| symbol.space == chip.code_space);
        let words = symbols.map(|symbol| symbol.addr / chip.word_bytes).filter(|word| *word <= pc);
        words.max().filter(|word| pc - word <= MAX_FUNCTION_DISTANCE).unwrap_or(pc)
    }

    /// Prints instructions as gdb dumps them, with their offsets from a function or from the nearest symbol.
    fn dump(&mut self, words: Range<u32>, function: Option<&str>, style: ListingStyle, out: &mut String) {
        let chip = self.session.scope.chip();
        let (mut word, pc) = (words.start, self.session.machine().pc());
        let end = words.end.min(chip.flash_bytes / chip.word_bytes.max(1));
        let mut listed: Option<FileLine> = None;
        while word < end {
            if style.lined {
                self.dump_lines(word, &mut listed, out);
            }
            let line = self.instruction(word);
            let source = self.session.scope.source();
            let distance = match function {
                Some(_) => format!(" <+{}>", chip.code_address(word - words.start)),
                None => source.names.nearest_symbol(word * chip.word_bytes).map_or(String::new(), |name| {
                    let name = decimal_offset(&name);
                    format!(" <{name}{}>", if name.contains('+') { "" } else { "+0" })
                }),
            };
            let meant = source.describe_operands(&line.operands).join(", ");
            let meant = if meant.is_empty() { meant } else { format!("  ; {meant}") };
            let here = if word == pc { "=>" } else { "  " };
            let raw = if style.raw { format!("{}  ", self.code_bytes(word, line.len as u32)) } else { String::new() };
            out.push_str(&format!("{here} 0x{:04x}{distance}:  {raw}{}{meant}\n", chip.code_address(word), line.text));
            word += line.len.max(1) as u32;
        }
        out.push_str("End of assembler dump.\n");
    }

    /// Prints the source lines after the last listed one up to the line of an instruction, with the file name
    /// if it is new.
    fn dump_lines(&mut self, word: u32, listed: &mut Option<FileLine>, out: &mut String) {
        let line = self
            .session
            .scope
            .source()
            .line_at(word)
            .map(|line| FileLine { file: line.file.to_string(), line: line.line });
        let Some(FileLine { file, line: number }) = line else { return };
        let first = match listed {
            Some(FileLine { file: known, line: last }) if *known == file && *last == number => return,
            // Lines without code belong to the next line with code.
            Some(FileLine { file: known, line: last })
                if *known == file && *last < number && number - *last < LINES_SHOWN =>
            {
                *last + 1
            }
            Some(FileLine { file: known, .. }) if *known == file => number,
            _ => {
                out.push_str(&format!("{file}:\n"));
                number
            }
        };
        if let Some(lines) = self.sources.file(&self.session.scope.lines, &file) {
            let texts = (1..).zip(lines).skip(first.saturating_sub(1) as usize).take((number - first + 1) as usize);
            texts.for_each(|(number, text)| {
                out.push_str(format!("{number}  {text}").trim_end());
                out.push('\n');
            });
        }
        *listed = Some(FileLine { file, line: number });
    }

    /// Returns the bytes of an instruction in hex.
    fn code_bytes(&self, word: u32, words: u32) -> String {
        let chip = self.session.scope.chip();
        let bytes = word * chip.word_bytes..(word + words.max(1)) * chip.word_bytes;
        let bytes = bytes.filter_map(|byte| self.session.machine().peek(chip.code_space, byte));
        bytes.map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ")
    }

    /// Returns some instructions as text, and the word after them. For a C program they have symbols, as in
    /// gdb.
    pub(super) fn instructions(&self, from: u32, count: u32) -> ListedCode {
        let (chip, pc, mut word, mut text) =
            (self.session.scope.chip(), self.session.machine().pc(), from, String::new());
        let end = chip.flash_bytes / chip.word_bytes.max(1);
        if !self.session.scope.has_debug_info() {
            return self.listing(from, count, ListingStyle::default());
        }
        for _ in 0..count {
            if word >= end {
                break;
            }
            let (line, source) = (self.instruction(word), self.session.scope.source());
            let here = if word == pc { "=>" } else { "  " };
            let name = source.names.nearest_symbol(word * chip.word_bytes);
            let name = name.map_or(String::new(), |name| format!(" <{}>", decimal_offset(&name)));
            let meant = source.describe_operands(&line.operands).join(", ");
            let meant = if meant.is_empty() { meant } else { format!("\t; {meant}") };
            let address = chip.code_address(word);
            text.push_str(&format!("{here} 0x{address:x}{name}:\t{}{meant}\n", line.text));
            word += line.len.max(1) as u32;
        }
        ListedCode { text, next: word }
    }

    /// Returns some instructions as text, with their source lines if the style asks for them, and the word
    /// after them.
    fn listing(&self, from: u32, count: u32, style: ListingStyle) -> ListedCode {
        let (chip, source) = (self.session.scope.chip(), self.session.scope.source());
        let (mut text, mut word, pc) = (String::new(), from, self.session.machine().pc());
        let end = chip.flash_bytes / chip.word_bytes.max(1);
        let mut last = None;
        for _ in 0..count {
            if word >= end {
                break;
            }
            let line = source.line_at(word).filter(|_| style.lined).map(|line| (line.file.to_string(), line.line));
            if let Some((file, number)) = line.clone().filter(|_| line != last) {
                text.push_str(&format!("{file}:{number}\n"));
            }
            last = line;
            let labels = source.names.symbols.iter();
            let labels = labels.filter(|s| s.space == chip.code_space && s.addr == word * chip.word_bytes);
            labels.for_each(|label| text.push_str(&format!("{}:\n", label.name)));
            let rung = self.view.iter().flat_map(LadderView::rung_starts).find(|start| start.word == word);
            rung.iter().for_each(|start| text.push_str(&format!("; rung {}\n", start.rung)));
            let line = self.instruction(word);
            let here = if word == pc { "=>" } else { "  " };
            let meant = source.describe_operands(&line.operands).join(", ");
            let meant = if meant.is_empty() { meant } else { format!("  ; {meant}") };
            let raw = if style.raw { format!("{}  ", self.code_bytes(word, line.len as u32)) } else { String::new() };
            text.push_str(&format!("{here} 0x{:04x}  {raw}{}{meant}\n", chip.code_address(word), line.text));
            word += line.len.max(1) as u32;
        }
        ListedCode { text, next: word }
    }

    /// Returns the active calls, the innermost first.
    pub(super) fn calls(&self) -> Vec<CallFrame> {
        self.session.scope.calls().frames(self.session.machine())
    }

    /// Returns the return addresses of the active calls as program words, the innermost first. Inlined calls
    /// have none.
    pub(super) fn return_addresses(&self) -> Vec<u32> {
        let calls = self.calls();
        let real = calls
            .iter()
            .zip(calls.iter().skip(1))
            .filter(|(inner, outer)| inner.sp != outer.sp || inner.word != outer.word);
        real.map(|(_, frame)| frame.word).collect()
    }

    /// Returns true if the program may be in a call, or in a service routine, which leaves no call on the
    /// stack.
    pub(super) fn may_return(&self) -> bool {
        let (chip, target) = (self.session.scope.chip(), self.session.machine());
        if !self.return_addresses().is_empty() {
            return true;
        }
        let sp = target.reg("SP").unwrap_or(0);
        match chip.family {
            // The entry of an interrupt clears flag I and pushes two bytes.
            ChipFamily::Avr => {
                let end = u32::from(chip.ram_start) + u32::from(chip.ram_len);
                sp != 0 && sp + 2 < end && target.reg("SREG").unwrap_or(0) & 0x80 == 0
            }
            ChipFamily::Mcs51 => sp > 0x08 && target.peek("sfr", 0xA8).unwrap_or(0) & 0x80 != 0,
            ChipFamily::Pic16 => target.stack_depth() > 0,
            ChipFamily::Ap101 => false,
        }
    }
}

/// `list`: prints source lines, or rungs of a ladder program.
pub(super) fn list(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if shell.view.is_some() {
        return super::rungs::list(shell, args, out);
    }
    let ListRange { file, first, count } = shell.parse_list_range(args)?;
    let lines = shell.sources.file(&shell.session.scope.lines, &file);
    let lines = lines.ok_or_else(|| format!("the source file {file} is not found"))?;
    let shown: Vec<(u32, &String)> =
        (1..).zip(lines).skip(first.saturating_sub(1) as usize).take(count as usize).collect();
    if shown.is_empty() {
        return Err(format!("{file} ends before line {first}").into());
    }
    for (number, text) in &shown {
        out.push_str(format!("{number}\t{text}").trim_end());
        out.push('\n');
    }
    shell.listed = Some(FileLine { file, line: first + shown.len() as u32 });
    Ok(())
}

/// Lines of a source file.
struct ListRange {
    file: String,
    /// Number of the first line, from 1.
    first: u32,
    /// Number of lines.
    count: u32,
}

impl DebugShell {
    /// Parses the argument of `list`. It is empty for the next lines or those around the selected call, `-`
    /// for the lines before, a line, two lines with a comma, or a location.
    fn parse_list_range(&self, args: &str) -> Result<ListRange, CommandError> {
        let size = self.list_size;
        let around = |FileLine { file, line }: FileLine| ListRange {
            file,
            first: line.saturating_sub(size / 2).max(1),
            count: size,
        };
        match (args, self.listed.clone()) {
            ("" | "+", Some(FileLine { file, line: next })) => return Ok(ListRange { file, first: next, count: size }),
            ("-", Some(FileLine { file, line: next })) => {
                let end = next.saturating_sub(size).max(1);
                let first = end.saturating_sub(size).max(1);
                return Ok(ListRange { file, first, count: end - first });
            }
            ("" | "+" | "-", _) => {
                // As in gdb, before the program has reached a source line, the lines that lead to main are
                // listed.
                let before_main = || {
                    let word = self.parse_line_location("main").ok()?.first().copied()?;
                    let source = self.session.scope.source();
                    let line = source.line_at(word)?;
                    Some(FileLine {
                        file: line.file.to_string(),
                        line: line.line.saturating_sub(size.saturating_sub(1)).max(1),
                    })
                };
                let here = self.current_line().or_else(before_main);
                let here = here.ok_or("there is no source line here; disas shows the instructions")?;
                return Ok(around(here));
            }
            _ => {}
        }
        if let Some((first, last)) = args.split_once(',') {
            if first.trim().is_empty() {
                let FileLine { file, line: last } = self.parse_line(last.trim())?;
                let first = last.saturating_sub(size.saturating_sub(1)).max(1);
                return Ok(ListRange { file, first, count: last.saturating_sub(first).saturating_add(1) });
            }
            let FileLine { file, line: first } = self.parse_line(first.trim())?;
            let last = match last.trim() {
                "" => first.saturating_add(size.saturating_sub(1)),
                // After the comma, `+N` counts from the first line.
                last => match last.strip_prefix('+').and_then(|by| by.trim().parse::<u32>().ok()) {
                    Some(by) => first.saturating_add(by),
                    None => self.parse_line(last)?.line,
                },
            };
            return Ok(ListRange { file, first, count: last.saturating_sub(first).saturating_add(1) });
        }
        self.parse_line(args).map(around)
    }

    /// Parses a location into its file and line.
    pub(super) fn parse_line(&self, text: &str) -> Result<FileLine, CommandError> {
        if let Some(found) = self.parse_line_number(text) {
            return Ok(found);
        }
        // A line without code is a valid line.
        if let Some((file, line)) = text.rsplit_once(':')
            && let (Ok(line), Some(known)) = (line.parse(), self.source_file(file))
        {
            return Ok(FileLine { file: known, line });
        }
        let word = self.parse_location(text)?.first().copied().unwrap_or_default();
        let line = self.session.scope.source().line_at(word).cloned();
        let line = line.ok_or_else(|| format!("there is no source line at {text}; disas shows the instructions"))?;
        Ok(FileLine { file: line.file.to_string(), line: line.line })
    }

    /// Parses a number alone as a line of the current file, as gdb does; `+1` and `-1` count from the current
    /// line. Returns `None` if the program has no lines.
    pub(super) fn parse_line_number(&self, text: &str) -> Option<FileLine> {
        if let Some(by) = text.strip_prefix(['+', '-']).and_then(|by| by.parse::<u32>().ok()) {
            let FileLine { file, line } = self.current_line()?;
            let line = if text.starts_with('+') { line.checked_add(by)? } else { line.checked_sub(by)? };
            return Some(FileLine { file, line });
        }
        let line = text.parse().ok().filter(|_| text.bytes().all(|byte| byte.is_ascii_digit()))?;
        let here = self.listed.clone().or_else(|| self.current_line()).or_else(|| self.main_line());
        here.map(|here| FileLine { line, ..here })
    }

    /// Returns the source line of the selected call.
    pub(super) fn current_line(&self) -> Option<FileLine> {
        self.line_of_frame(self.calls().get(self.level)?)
    }

    /// Returns the line of `main`, which is listed before the program has reached a source line.
    pub(super) fn main_line(&self) -> Option<FileLine> {
        let source = self.session.scope.source();
        let line = source.line_at(source.parse_words("main").ok()?.first().copied()?)?;
        Some(FileLine { file: line.file.to_string(), line: line.line })
    }

    /// Finds a source file of the program by its name or the end of its path.
    pub(super) fn source_file(&self, name: &str) -> Option<String> {
        let lines = self.session.scope.lines.all_lines();
        let is = |file: &str| file == name || file.strip_suffix(name).is_some_and(|before| before.ends_with('/'));
        let mut found: Vec<&str> = lines.iter().map(|line| &*line.file).filter(|file| is(file)).collect();
        found.sort_unstable();
        found.dedup();
        let whole = found.iter().find(|file| **file == name);
        match (whole, found.as_slice()) {
            (Some(file), _) | (None, [file]) => Some((*file).to_owned()),
            _ => None,
        }
    }
}
