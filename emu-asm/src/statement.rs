//! One line: its labels, its word, and what is done with it.

mod definitions;

use std::ops::Range;

use crate::dialect::{AsmDialect, AsmDirective, DirectiveAction, LabelUse, ReadFlow};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{AsmLine, RewrittenText, behind_name, byte, skip_space, step, trim};
use crate::output::ListedLine;

/// The start of a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StatementHead {
    /// A name before the word: a label, or the name that the directive defines.
    pub label: Option<Range<usize>>,
    /// The label has a colon or is in column 1, so it is an address whatever follows.
    pub is_address: bool,
    /// The instruction, directive or macro; empty if there is none.
    pub word: Range<usize>,
    /// What follows the word.
    pub rest: Range<usize>,
}

/// A directive that does nothing.
const NOTHING: AsmDirective = AsmDirective::run("", |_, _| ());

/// Returns where the comment of a line begins.
pub(crate) fn code_end(d: &AsmDialect, text: &str) -> usize {
    if let Some(code_end) = d.hooks.code_end {
        return code_end(text);
    }
    let start = skip_space(text, 0);
    let rest = text.get(start..).unwrap_or_default();
    if d.line_comments.iter().any(|mark| rest.starts_with(mark)) && !is_hash_word(rest) {
        return start;
    }
    let mut at = start;
    while at < text.len() {
        let c = byte(text, at);
        if d.comments.iter().any(|mark| mark.as_bytes().first() == Some(&c) && text[at..].starts_with(mark)) {
            return at;
        }
        at = step(d, text, at);
    }
    text.len()
}

/// Returns the position of `#v(`.
fn find_value(text: &str) -> Option<usize> {
    text.as_bytes().windows(3).position(|three| three.eq_ignore_ascii_case(b"#v("))
}

/// Reports whether the line begins with `#define` or a similar word and is therefore no comment.
fn is_hash_word(text: &str) -> bool {
    let Some(rest) = text.strip_prefix('#') else { return false };
    let word: String = rest.trim_start().chars().take_while(char::is_ascii_alphabetic).collect();
    let words = [
        "define", "undef", "undefine", "include", "ifdef", "ifndef", "if", "elif", "else", "endif", "error", "warning",
        "cseg", "dseg", "eseg",
    ];
    words.iter().any(|known| word.eq_ignore_ascii_case(known))
}

impl Assembler<'_> {
    /// Reads one line.
    pub fn read_statement(&mut self, line: &AsmLine) {
        // The text of a `#define` keeps `#v(..)`, which is evaluated where the text is used.
        let named = if self.defines_text(line) { None } else { self.expand_value_names(line) };
        let line = named.as_ref().unwrap_or(line);
        let end = code_end(self.dialect, &line.text);
        if line.text.get(..end).is_none_or(|code| code.trim().is_empty()) {
            return self.begin_listing_line(line);
        }
        let first = self.parse_head(&line.text, 0, end);
        let word = line.text.get(first.word.clone()).unwrap_or_default();
        let directive = self.directive_of(word);
        let keeps = directive.is_some_and(|d| {
            matches!(d.name, "define" | "undef" | "undefine" | "lit")
                || d.name.ends_with("def") && d.name.contains("if")
        });
        // A condition of a branch after one that was not read; it may be read now.
        let asks = directive.is_some_and(|d| matches!(d.action, DirectiveAction::Flow(ReadFlow::Elif(_))));
        let decided = self.replace_defined(line, end);
        let (line, end) = decided.as_ref().map_or((line, end), |line| (line, line.text.len()));
        if let Some(label) = first.label.clone().filter(|_| self.is_reading() && !keeps)
            && self.check_not_given_outside(&line.text, label)
        {
            return self.begin_listing_line(line);
        }
        let expanded = if keeps || !(self.is_reading() || asks) { None } else { self.expand_defines(line, end) };
        match expanded {
            Some(line) => {
                self.line = Some(line.clone());
                let line = self.expand_value_names(&line).unwrap_or(line);
                let text = line.text.clone();
                self.line = Some(line.clone());
                self.begin_listing_line(&line);
                self.read_statements(&text, text.len());
            }
            None => {
                self.begin_listing_line(line);
                let text = line.text.clone();
                self.read_statements(&text, end);
            }
        }
        self.end_listing_line();
    }

    /// Reports whether the line is a `#define`.
    fn defines_text(&self, line: &AsmLine) -> bool {
        let head = self.parse_head(&line.text, 0, line.text.len());
        line.text.get(head.word).and_then(|word| self.directive_of(word)).is_some_and(|d| d.name == "define")
    }

    /// Returns the line with the values of `#v(expression)` substituted.
    pub fn expand_value_names(&mut self, line: &AsmLine) -> Option<AsmLine> {
        let text: &str = &line.text;
        if !self.dialect.hooks.value_names || !self.is_reading() || find_value(text).is_none() {
            return None;
        }
        let end = code_end(self.dialect, text);
        let (mut changed, mut done) = (RewrittenText::default(), 0);
        while let Some(at) = text.get(done..end).and_then(find_value).map(|at| done + at) {
            let open = at + 2;
            let close = (open..end).scan(0, |depth, at| {
                *depth += i32::from(byte(text, at) == b'(') - i32::from(byte(text, at) == b')');
                Some((*depth, at))
            });
            let (_, close) = close.into_iter().find(|(depth, _)| *depth == 0)?;
            let inner = AsmLine { text: text.get(open + 1..close)?.into(), ..line.clone() };
            let n = match self.expand_defines(&inner, inner.text.len()) {
                Some(inner) => self.evaluate_number(&inner.text, 0..inner.text.len()),
                None => self.evaluate_number(text, open + 1..close),
            };
            let n = n.unwrap_or(0);
            changed.copy(text, done..at);
            changed.put(&n.to_string(), at);
            done = close + 1;
        }
        if done == 0 {
            return None;
        }
        changed.copy(text, done..text.len());
        let line = changed.into_line(line);
        self.line = Some(line.clone());
        Some(line)
    }

    /// Begins a line of the listing.
    pub fn begin_listing_line(&mut self, line: &AsmLine) {
        let depth = self.frames.iter().filter(|frame| frame.called_from.is_some()).count() as u32;
        let (addr, unit, start) = (self.out.next_address(), self.out.unit(), self.out.bytes.len());
        self.out.list.push(ListedLine { line: line.clone(), depth, addr, value: None, bytes: start..start, unit });
    }

    /// Ends the line of the listing.
    fn end_listing_line(&mut self) {
        let end = self.out.bytes.len();
        if let Some(last) = self.out.list.last_mut() {
            last.bytes.end = end.max(last.bytes.start);
        }
    }

    /// Reads the statements of a line.
    fn read_statements(&mut self, text: &str, end: usize) {
        let (mut from, mut at) = (0, 0);
        // A preprocessor line is one statement, whatever text it defines.
        let one = self.dialect.separators.is_empty() || is_hash_word(text.trim_start());
        while at < end && !one {
            let next = byte(text, at + 1);
            if self.dialect.separators.contains(&byte(text, at)) && (next == 0 || next.is_ascii_whitespace()) {
                self.read_code(text, from, at);
                from = at + 1;
            }
            at = step(self.dialect, text, at);
        }
        self.read_code(text, from, end);
    }

    fn read_code(&mut self, text: &str, mut from: usize, end: usize) {
        self.line_address = self.out.next_address();
        let mut before = None;
        loop {
            let head = self.parse_head(text, from, end);
            let word = text.get(head.word.clone()).unwrap_or_default();
            let directive = self.directive_of(word);
            let flow = match directive {
                Some(AsmDirective { action: DirectiveAction::Flow(flow), .. }) => Some(*flow),
                _ => None,
            };
            if !self.is_reading() {
                if let (Some(flow), true) = (
                    flow,
                    matches!(
                        flow,
                        Some(
                            ReadFlow::If(_)
                                | ReadFlow::Elif(_)
                                | ReadFlow::Within(_)
                                | ReadFlow::WithinLine(_)
                                | ReadFlow::Else
                                | ReadFlow::Endif
                        )
                    ),
                ) {
                    let call = DirectiveCall { text, label: None, word: head.word, rest: head.rest };
                    self.run_flow_directive(flow, &call);
                    self.check_without_label(directive, head.label, &call);
                }
                return;
            }
            let named = directive.is_some_and(|d| d.label == LabelUse::Name);
            if let Some(label) = head.label.clone().filter(|_| !named) {
                self.give_label(text, label.clone());
                before = Some(label);
                if head.word.is_empty() && head.rest.start < end && head.rest.start > from {
                    from = head.rest.start;
                    continue;
                }
            }
            if head.word.is_empty() {
                return self.no_word(text, trim(text, head.rest));
            }
            let call = DirectiveCall { text, label: head.label.filter(|_| named), word: head.word, rest: head.rest };
            self.run_word(directive, flow, &call);
            return self.check_without_label(directive, before, &call);
        }
    }

    /// Reads the statement `call.text[from..]` after a one-line condition; refuses another such condition
    /// within it.
    pub fn inner_statement(&mut self, call: &DirectiveCall<'_>, from: usize) {
        let end = call.rest.end.max(from);
        if call.get(from..end).to_ascii_lowercase().contains(".iif") {
            let cause = "a condition of one line is inside another";
            return self.report(LineFault::new(
                "ASM023",
                from..end,
                cause,
                "put the two on lines of their own with if",
            ));
        }
        self.read_code(call.text, from, end);
    }

    fn run_word(&mut self, directive: Option<&'static AsmDirective>, flow: Option<ReadFlow>, call: &DirectiveCall<'_>) {
        let word = call.get(call.word.clone());
        if word.starts_with('.')
            && directive.is_some()
            && let Some(dotted) = (self.dialect.hooks.with_dots)()
        {
            self.dialect = dotted;
            self.chip_name_redefined = true;
        }
        let lower = word.to_ascii_lowercase();
        if let Some(found) = self.macros.get(&lower).cloned() {
            return self.call_macro(&found, call);
        }
        if self.dialect.warns_in_column_one && call.word.start == 0 && call.label.is_none() && !word.starts_with('#') {
            if self.is_instruction_as_name(directive.is_some(), call) {
                return;
            }
            self.warn_column_one(directive.is_some(), call);
        }
        if let Some(flow) = flow {
            return self.run_flow_directive(flow, call);
        }
        match directive {
            Some(AsmDirective { action: DirectiveAction::Run(run), .. }) => run(self, call),
            _ if self.table.forms(&lower).is_empty() => {
                let cause = format!("`{word}` is not an instruction, directive or macro");
                let next = trim(call.text, call.rest.clone()).start;
                let next = call.get(next..behind_name(call.text, next, true));
                let hint = format!("if `{word}` is a label, it begins in column 1");
                let fault = match self.dialect.labels_in_column_one && call.word.start > 0 && self.is_word(next) {
                    true => LineFault::new("ASM001", call.word.clone(), cause, hint),
                    false => {
                        let hint = "docs/isa lists the instructions, docs/formats/asm.md the directives";
                        LineFault::new("ASM001", call.word.clone(), cause, hint).with_similar_name(word)
                    }
                };
                self.report(fault);
            }
            _ => {
                let place = self.image_address();
                let words = self.assemble_instruction(call.text, &lower, call.word.clone(), call.rest.clone());
                // Only the first of several in a row is reported.
                let odd = !place.is_multiple_of(u64::from(self.chip.word_bytes.max(1)));
                if !std::mem::replace(&mut self.at_odd_address, odd) & odd {
                    let hint = "put `.balign 2` before it, or another byte";
                    self.report(LineFault::new(
                        "ASM022",
                        call.word.clone(),
                        "an instruction is at an odd address",
                        hint,
                    ));
                }
                // The fault is reported; what follows keeps its address.
                let words = words.unwrap_or_else(|| {
                    let len = self.shortest_form(&lower);
                    vec![0; len]
                });
                self.emit_words(&words, call.word.clone());
            }
        }
    }

    /// Returns the length in words of the shortest form of an instruction.
    fn shortest_form(&self, mnemonic: &str) -> usize {
        let rows = self.chip.isa.rows.iter().filter(|row| row.mnemonic == mnemonic);
        rows.map(|row| row.len() as usize).min().unwrap_or(1)
    }

    fn give_label(&mut self, text: &str, at: Range<usize>) {
        let name = text.get(at.clone()).unwrap_or_default();
        if let Some(digits) = name.strip_suffix('$').filter(|d| d.bytes().all(|c| c.is_ascii_digit())) {
            let name = format!("{digits}$\u{1}{}", self.dollar_label_scope);
            return self.define_label(&name, at);
        }
        if name.bytes().all(|c| c.is_ascii_digit()) {
            let given = self.numbered.entry(name.to_owned()).or_insert(0);
            *given += 1;
            let name = format!("{name}\u{1}{given}");
            return self.define_label(&name, at);
        }
        self.dollar_label_scope += 1;
        // C programs have variables named x and y; if case matters, they are not pointers.
        let word = self.dialect.ignores_case && self.is_register(name);
        if (word || self.chip_register(name)) && self.chip_names.get(name).is_none() {
            return self.report(self.name_taken_fault(name, at, "a label"));
        }
        self.define_label(name, at);
    }

    /// Returns the fault of a name that the instructions use for something else.
    fn name_taken_fault(&self, name: &str, at: Range<usize>, what: &str) -> LineFault {
        let known = match (self.dialect.zones, self.chip_register(name)) {
            (true, true) => "the address of a bit",
            (true, false) => "what marks an indexed address",
            _ => "a register of the core",
        };
        LineFault::new("ASM008", at, format!("`{name}` is {known} and cannot be {what}"), "choose another name")
    }

    /// Returns the directive for a word: always with a dot; without one only if no instruction has that name.
    pub fn directive_of(&self, word: &str) -> Option<&'static AsmDirective> {
        if word.is_empty() {
            return None;
        }
        let lower = word.to_ascii_lowercase();
        // A macro may have the name of a directive that only other assemblers have.
        if self.macros.contains_key(&lower) {
            return None;
        }
        if let Some(control) = lower.strip_prefix('$').filter(|_| self.dialect.controls) {
            return self.dialect.find_directive(match control {
                "include" | "inc" | "ic" => "include",
                "set" => "$set",
                "reset" => "$reset",
                "if" | "ifdef" | "ifndef" | "elseif" | "else" | "endif" | "error" | "warning" => control,
                _ => "$",
            });
        }
        if lower.strip_prefix('.').is_some_and(|bare| self.dialect.hooks.ignored_dotted.contains(&bare)) {
            return Some(&NOTHING);
        }
        let bare = match (lower.strip_prefix('.'), lower.strip_prefix('#')) {
            (Some(bare), _) => bare,
            (_, Some(bare)) => bare.trim_start(),
            _ if !self.table.forms(&lower).is_empty() => return None,
            _ => &lower,
        };
        self.dialect.find_directive(bare)
    }

    /// Returns the flow directive of a line.
    pub fn flow_of(&self, line: &AsmLine) -> Option<ReadFlow> {
        let text: &str = &line.text;
        let end = code_end(self.dialect, text);
        let word = text.get(self.parse_head(text, 0, end).word)?;
        // `I&k MACRO v`: the name of a macro within a macro may have parameters.
        let is_joined = |name: &&str| name.contains('&') && self.dialect.hooks.angle_arguments;
        let mut words = text.get(..end)?.split_whitespace();
        let second = words.next().filter(is_joined).and_then(|_| self.directive_of(words.next()?));
        let directive = second.filter(|d| d.label == LabelUse::Name).or_else(|| self.directive_of(word))?;
        match directive.action {
            DirectiveAction::Flow(flow) => Some(flow),
            DirectiveAction::Run(_) => None,
        }
    }

    /// Reports whether an instruction, directive or macro has this name.
    fn is_word(&self, word: &str) -> bool {
        let lower = word.to_ascii_lowercase();
        self.macros.contains_key(&lower) || !self.table.forms(&lower).is_empty() || self.directive_of(word).is_some()
    }

    /// Parses the start of `text[from..end]`.
    pub fn parse_head(&self, text: &str, from: usize, end: usize) -> StatementHead {
        let start = skip_space(text, from).min(end);
        let none = StatementHead { label: None, is_address: false, word: start..start, rest: start..end };
        let get = |range: Range<usize>| text.get(range).unwrap_or_default();
        let digits = get(start..end).bytes().take_while(u8::is_ascii_digit).count();
        if digits > 0 {
            let dollar = usize::from(self.dialect.dollar_labels && byte(text, start + digits) == b'$');
            let name_end = start + digits + dollar;
            let colon = skip_space(text, name_end);
            let known = self.dialect.numbered_labels || dollar == 1;
            if known && byte(text, colon) == b':' && colon < end {
                return self.head_with_label(text, start..name_end, colon, end);
            }
            return none;
        }
        if byte(text, start) == b'#' {
            let word_end = behind_name(text, skip_space(text, start + 1), false).min(end);
            return if is_hash_word(get(start..end)) {
                StatementHead { word: start..word_end, rest: word_end..end, ..none }
            } else {
                none
            };
        }
        if self.dialect.controls && byte(text, start) == b'$' && byte(text, start + 1).is_ascii_alphabetic() {
            let word_end = behind_name(text, start + 1, false).min(end);
            return StatementHead { word: start..word_end, rest: word_end..end, ..none };
        }
        let name_end = behind_name(text, start, true).min(end);
        let (name_end, here) =
            match self.dialect.location_counter_names.iter().find(|token| get(start..end).starts_with(**token)) {
                Some(token) if name_end <= start + token.len() => (start + token.len(), true),
                _ => (name_end, false),
            };
        if name_end <= start {
            return none;
        }
        let name = start..name_end;
        let after = skip_space(text, name_end).min(end);
        if byte(text, after) == b':' && after < end && !here {
            return self.head_with_label(text, name, after, end);
        }
        if byte(text, after) == b'=' && after < end {
            let equals = after + get(after..end).bytes().take_while(|c| *c == b'=').count();
            let equals = equals + usize::from(self.dialect.dot_is_bit && byte(text, equals) == b':' && equals < end);
            return StatementHead { label: Some(name), is_address: false, word: after..equals, rest: equals..end };
        }
        let signs = get(after..end).bytes().take_while(|c| b"+-*/%<>&|^=".contains(c)).count();
        if self.directive_of(get(after..after + signs)).is_some_and(|d| d.label == LabelUse::Name) {
            let word = after..after + signs;
            return StatementHead { label: Some(name), is_address: false, rest: word.end..end, word };
        }
        let second_end = behind_name(text, after, true).min(end);
        let second = after..second_end.max(after);
        let about = self.directive_of(get(second.clone())).is_some_and(|d| d.label == LabelUse::Name);
        let column_one = start == 0 && from == 0;
        // In column 1, a directive of other dialects may be a label: `byte xorwf sum, f`.
        let mnemonic = |range: &Range<usize>| !self.table.forms(&get(range.clone()).to_ascii_lowercase()).is_empty();
        let foreign = self.dialect.hooks.foreign.iter().any(|word| word.eq_ignore_ascii_case(get(name.clone())))
            && (second.is_empty() && after >= end || self.is_word(get(second.clone())));
        let in_front =
            column_one && self.dialect.labels_in_column_one && (foreign || mnemonic(&second) && !mnemonic(&name));
        let known = self.is_word(get(name.clone())) && !(in_front && self.directive_of(get(name.clone())).is_some());
        let first = self.directive_of(get(name.clone()));
        let first_names = first.is_some_and(|d| d.label == LabelUse::Name);
        // `RS equ P1.0`: a name of the program that is a directive elsewhere.
        let runs = matches!(first, Some(AsmDirective { action: DirectiveAction::Run(_), .. }));
        let own = about && runs && self.is_name_being_defined(first, text, name.clone(), second.end..end);
        if own || about && !first_names && (!known || column_one && !runs) {
            return StatementHead { label: Some(name), is_address: false, rest: second.end..end, word: second };
        }
        let label = column_one && !known && (self.dialect.labels_in_column_one || self.is_word(get(second.clone())));
        if label {
            return StatementHead { label: Some(name), is_address: true, rest: second.end..end, word: second };
        }
        StatementHead { word: name, rest: name_end..end, ..none }
    }

    /// Parses a label with one or two colons, and what follows it.
    fn head_with_label(&self, text: &str, name: Range<usize>, colon: usize, end: usize) -> StatementHead {
        let mut behind = colon + 1;
        if byte(text, behind) == b':' {
            behind += 1;
        }
        let behind = behind.min(end);
        let next = self.parse_head(text, behind, end);
        let word = text.get(next.word.clone()).unwrap_or_default();
        let about = self.directive_of(word).is_some_and(|d| d.label == LabelUse::Name);
        // `name: equ 5`; after any other label, the rest is a line of its own.
        if about && next.label.is_none() {
            return StatementHead { label: Some(name), ..next };
        }
        StatementHead { label: Some(name), is_address: true, word: behind..behind, rest: behind..end }
    }
}
