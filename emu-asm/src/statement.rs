//! One line: its labels, its word, and what is done with it.

use std::ops::Range;

use crate::dialect::{Dialect, Directive, Do, Flow, Label};
use crate::engine::{Asm, Call};
use crate::expr::Value;
use crate::fault::Fault;
use crate::output::Listed;
use crate::symbols::Kind;
use crate::text::{Changed, Line, behind_name, byte, skip_space, step, trim};

/// The front of a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Head {
    /// A name in front of the word: a label, or what the directive is about.
    pub label: Option<Range<usize>>,
    /// The label has a colon, or stands in column 1: it is an address whatever follows.
    pub address: bool,
    /// The instruction, directive or macro; empty where there is none.
    pub word: Range<usize>,
    /// What stands behind it.
    pub rest: Range<usize>,
}

/// A directive that does nothing.
const NOTHING: Directive = Directive::run("", |_, _| ());

/// Where the comment of a line begins.
pub(crate) fn code_end(d: &Dialect, text: &str) -> usize {
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
        at = step(text, at);
    }
    text.len()
}

/// Where `#v(` stands.
fn find_value(text: &str) -> Option<usize> {
    text.as_bytes().windows(3).position(|three| three.eq_ignore_ascii_case(b"#v("))
}

/// `#define` and its like are no comments.
fn is_hash_word(text: &str) -> bool {
    let Some(rest) = text.strip_prefix('#') else { return false };
    let word: String = rest.trim_start().chars().take_while(char::is_ascii_alphabetic).collect();
    let words = [
        "define", "undef", "undefine", "include", "ifdef", "ifndef", "if", "elif", "else", "endif", "error", "warning",
    ];
    words.iter().any(|known| word.eq_ignore_ascii_case(known))
}

impl Asm<'_> {
    /// Reads one line.
    pub fn statement(&mut self, line: &Line) {
        let named = if self.d.hooks.value_names && self.reading() { self.put_values(line) } else { None };
        let line = named.as_ref().unwrap_or(line);
        let end = code_end(self.d, &line.text);
        if line.text.get(..end).is_none_or(|code| code.trim().is_empty()) {
            return self.list(line);
        }
        let first = self.head(&line.text, 0, end);
        let word = line.text.get(first.word.clone()).unwrap_or_default();
        let directive = self.directive_of(word);
        let keeps = directive.is_some_and(|d| {
            matches!(d.name, "define" | "undef" | "undefine" | "lit")
                || d.name.ends_with("def") && d.name.contains("if")
        });
        // The condition of a part that may be read now, after one that was not.
        let asks = directive.is_some_and(|d| matches!(d.does, Do::Flow(Flow::Elif(_))));
        let decided = self.decide_defined(line, end);
        let (line, end) = decided.as_ref().map_or((line, end), |line| (line, line.text.len()));
        if let Some(label) = first.label.clone().filter(|_| self.reading() && !keeps)
            && self.is_given_outside(&line.text, label)
        {
            return self.list(line);
        }
        let expanded = if keeps || !(self.reading() || asks) { None } else { self.expand(line, end) };
        match expanded {
            Some(line) => {
                let text = line.text.clone();
                self.line = Some(line.clone());
                self.list(&line);
                self.codes(&text, text.len());
            }
            None => {
                self.list(line);
                let text = line.text.clone();
                self.codes(&text, end);
            }
        }
        self.listed();
    }

    /// The line with the values of `#v(expression)` put in.
    fn put_values(&mut self, line: &Line) -> Option<Line> {
        let text: &str = &line.text;
        let end = code_end(self.d, text);
        let (mut changed, mut done) = (Changed::default(), 0);
        while let Some(at) = text.get(done..end).and_then(find_value).map(|at| done + at) {
            let open = at + 2;
            let close = (open..end).scan(0, |depth, at| {
                *depth += i32::from(byte(text, at) == b'(') - i32::from(byte(text, at) == b')');
                Some((*depth, at))
            });
            let (_, close) = close.into_iter().find(|(depth, _)| *depth == 0)?;
            let n = self.number(text, open + 1..close).unwrap_or(0);
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
    pub fn list(&mut self, line: &Line) {
        let depth = self.frames.iter().filter(|frame| frame.called.is_some()).count() as u32;
        let (addr, unit, start) = (self.out.here(), self.out.unit(), self.out.bytes.len());
        self.out.list.push(Listed { line: line.clone(), depth, addr, value: None, bytes: start..start, unit });
    }

    /// Ends it.
    fn listed(&mut self) {
        let end = self.out.bytes.len();
        if let Some(last) = self.out.list.last_mut() {
            last.bytes.end = end.max(last.bytes.start);
        }
    }

    /// The statements of a line.
    fn codes(&mut self, text: &str, end: usize) {
        let (mut from, mut at) = (0, 0);
        // A line of the preprocessor is one statement, whatever the text that it defines.
        let one = self.d.separators.is_empty() || is_hash_word(text.trim_start());
        while at < end && !one {
            let next = byte(text, at + 1);
            if self.d.separators.contains(&byte(text, at)) && (next == 0 || next.is_ascii_whitespace()) {
                self.code(text, from, at);
                from = at + 1;
            }
            at = step(text, at);
        }
        self.code(text, from, end);
    }

    fn code(&mut self, text: &str, mut from: usize, end: usize) {
        self.line_at = self.out.here();
        loop {
            let head = self.head(text, from, end);
            let word = text.get(head.word.clone()).unwrap_or_default();
            let directive = self.directive_of(word);
            let flow = match directive {
                Some(Directive { does: Do::Flow(flow), .. }) => Some(*flow),
                _ => None,
            };
            if !self.reading() {
                if let (Some(flow), true) =
                    (flow, matches!(flow, Some(Flow::If(_) | Flow::Elif(_) | Flow::Else | Flow::Endif)))
                {
                    self.dotted = word.starts_with('.');
                    self.flow(flow, &Call { text, label: None, word: head.word, rest: head.rest });
                }
                return;
            }
            let named = directive.is_some_and(|d| d.label == Label::Name);
            if let Some(label) = head.label.clone().filter(|_| !named) {
                self.give_label(text, label);
                if head.word.is_empty() && head.rest.start < end && head.rest.start > from {
                    from = head.rest.start;
                    continue;
                }
            }
            if head.word.is_empty() {
                let rest = trim(text, head.rest);
                if !rest.is_empty() {
                    let what = text.get(rest.clone()).unwrap_or_default();
                    let (cause, hint) = match what.starts_with("/*") && self.d.block_comments {
                        true => ("the comment is not closed".to_owned(), "close it with `*/`"),
                        false => {
                            let cause = format!("`{what}` is no instruction, directive or label");
                            (cause, "a line is `label: word operands ; comment`")
                        }
                    };
                    self.tell(Fault::new("ASM005", rest, cause, hint));
                }
                return;
            }
            let call = Call { text, label: head.label.filter(|_| named), word: head.word, rest: head.rest };
            return self.word(directive, flow, &call);
        }
    }

    fn word(&mut self, directive: Option<&'static Directive>, flow: Option<Flow>, call: &Call<'_>) {
        let word = call.get(call.word.clone());
        self.dotted = word.starts_with('.');
        let lower = word.to_ascii_lowercase();
        if let Some(found) = self.macros.get(&lower).cloned() {
            return self.call_macro(&found, call);
        }
        if self.d.column_one_warns && call.word.start == 0 && call.label.is_none() && !word.starts_with('#') {
            self.in_column_one(directive.is_some(), call);
        }
        if let Some(flow) = flow {
            return self.flow(flow, call);
        }
        match directive {
            Some(Directive { does: Do::Run(run), .. }) => run(self, call),
            _ if self.table.forms(&lower).is_empty() => {
                let cause = format!("`{word}` is no instruction, directive or macro");
                let hint = "docs/isa lists the instructions, docs/formats/asm.md the directives";
                self.tell(Fault::new("ASM001", call.word.clone(), cause, hint).near(word));
            }
            _ => {
                let place = self.image_address();
                let words = self.instruction(call.text, &lower, call.word.clone(), call.rest.clone());
                // Told of the first of a row of them.
                let odd = !place.is_multiple_of(u64::from(self.chip.word_bytes.max(1)));
                if !std::mem::replace(&mut self.odd, odd) & odd {
                    let hint = "put `.balign 2` before it, or another byte";
                    self.tell(Fault::new("ASM022", call.word.clone(), "an instruction stands at an odd address", hint));
                }
                // What is wrong is told; what follows keeps its place all the same.
                let words = words.unwrap_or_else(|| {
                    let len = self.shortest(&lower);
                    vec![0; len]
                });
                self.emit_words(&words, call.word.clone());
            }
        }
    }

    /// Tells of a word that stands where labels do.
    fn in_column_one(&mut self, directive: bool, call: &Call<'_>) {
        let (code, what) = if directive { ("ASM041", "directive") } else { ("ASM040", "instruction") };
        let cause = format!("the {what} `{}` stands in column 1, where labels stand", call.get(call.word.clone()));
        self.tell(Fault::new(code, call.word.clone(), cause, "put a space before it").warning());
    }

    /// Length in words of the shortest form of an instruction.
    fn shortest(&self, mnemonic: &str) -> usize {
        let rows = self.chip.isa.rows.iter().filter(|row| row.mnemonic == mnemonic);
        rows.map(|row| row.len() as usize).min().unwrap_or(1)
    }

    fn give_label(&mut self, text: &str, at: Range<usize>) {
        let name = text.get(at.clone()).unwrap_or_default();
        if let Some(digits) = name.strip_suffix('$').filter(|d| d.bytes().all(|c| c.is_ascii_digit())) {
            let name = format!("{digits}$\u{1}{}", self.stretch);
            return self.label(&name, at);
        }
        if name.bytes().all(|c| c.is_ascii_digit()) {
            let given = self.numbered.entry(name.to_owned()).or_insert(0);
            *given += 1;
            let name = format!("{name}\u{1}{given}");
            return self.label(&name, at);
        }
        self.stretch += 1;
        // C programs call variables x and y; where case matters they are no pointers.
        let word = self.d.any_case && self.is_register(name);
        if (word || self.chip_register(name)) && self.known.get(name).is_none() {
            return self.tell(self.taken(name, at, "a label"));
        }
        self.label(name, at);
    }

    /// Tells that the instructions know a name as something else.
    fn taken(&self, name: &str, at: Range<usize>, what: &str) -> Fault {
        let known = match (self.d.zones, self.chip_register(name)) {
            (true, true) => "the address of a bit",
            (true, false) => "what marks an indexed address",
            _ => "a register of the core",
        };
        Fault::new("ASM008", at, format!("`{name}` is {known} and cannot be {what}"), "choose another name")
    }

    /// The directive that a word is: with a dot always, without one where no instruction bears that name.
    pub fn directive_of(&self, word: &str) -> Option<&'static Directive> {
        if word.is_empty() {
            return None;
        }
        let lower = word.to_ascii_lowercase();
        // A macro of the program may bear the name of a directive that only other assemblers have.
        if self.macros.contains_key(&lower) {
            return None;
        }
        if let Some(control) = lower.strip_prefix('$').filter(|_| self.d.controls) {
            return self.d.directive(match control {
                "include" | "inc" | "ic" => "include",
                "set" => "$set",
                "reset" => "$reset",
                "if" | "elseif" | "else" | "endif" | "error" | "warning" => control,
                _ => "$",
            });
        }
        if lower.strip_prefix('.').is_some_and(|bare| self.d.hooks.dotted.contains(&bare)) {
            return Some(&NOTHING);
        }
        let bare = match (lower.strip_prefix('.'), lower.strip_prefix('#')) {
            (Some(bare), _) => bare,
            (_, Some(bare)) => bare.trim_start(),
            _ if !self.table.forms(&lower).is_empty() => return None,
            _ => &lower,
        };
        self.d.directive(bare)
    }

    /// The flow that the word of a line decides.
    pub fn flow_of(&self, line: &Line) -> Option<Flow> {
        let text: &str = &line.text;
        let head = self.head(text, 0, code_end(self.d, text));
        let word = text.get(head.word)?;
        match self.directive_of(word)?.does {
            Do::Flow(flow) => Some(flow),
            Do::Run(_) => None,
        }
    }

    /// An instruction, directive or macro has this name.
    fn is_word(&self, word: &str) -> bool {
        let lower = word.to_ascii_lowercase();
        self.macros.contains_key(&lower) || !self.table.forms(&lower).is_empty() || self.directive_of(word).is_some()
    }

    /// Takes the front of `text[from..end]` apart.
    pub fn head(&self, text: &str, from: usize, end: usize) -> Head {
        let start = skip_space(text, from).min(end);
        let none = Head { label: None, address: false, word: start..start, rest: start..end };
        let get = |range: Range<usize>| text.get(range).unwrap_or_default();
        let digits = get(start..end).bytes().take_while(u8::is_ascii_digit).count();
        if digits > 0 {
            let dollar = usize::from(self.d.dollar_labels && byte(text, start + digits) == b'$');
            let name_end = start + digits + dollar;
            let colon = skip_space(text, name_end);
            let known = self.d.numbered_labels || dollar == 1;
            if known && byte(text, colon) == b':' && colon < end {
                return self.labelled(text, start..name_end, colon, end);
            }
            return none;
        }
        if byte(text, start) == b'#' {
            let word_end = behind_name(text, skip_space(text, start + 1), false).min(end);
            return if is_hash_word(get(start..end)) {
                Head { word: start..word_end, rest: word_end..end, ..none }
            } else {
                none
            };
        }
        if self.d.controls && byte(text, start) == b'$' && byte(text, start + 1).is_ascii_alphabetic() {
            let word_end = behind_name(text, start + 1, false).min(end);
            return Head { word: start..word_end, rest: word_end..end, ..none };
        }
        let name_end = behind_name(text, start, true).min(end);
        let (name_end, here) = match self.d.here.iter().find(|token| get(start..end).starts_with(**token)) {
            Some(token) if name_end <= start + token.len() => (start + token.len(), true),
            _ => (name_end, false),
        };
        if name_end <= start {
            return none;
        }
        let name = start..name_end;
        let after = skip_space(text, name_end).min(end);
        if byte(text, after) == b':' && after < end && !here {
            return self.labelled(text, name, after, end);
        }
        if byte(text, after) == b'=' && after < end {
            let equals = after + get(after..end).bytes().take_while(|c| *c == b'=').count();
            return Head { label: Some(name), address: false, word: after..equals, rest: equals..end };
        }
        let signs = get(after..end).bytes().take_while(|c| b"+-*/%<>&|^=".contains(c)).count();
        if self.directive_of(get(after..after + signs)).is_some_and(|d| d.label == Label::Name) {
            let word = after..after + signs;
            return Head { label: Some(name), address: false, rest: word.end..end, word };
        }
        let second_end = behind_name(text, after, true).min(end);
        let second = after..second_end.max(after);
        let about = self.directive_of(get(second.clone())).is_some_and(|d| d.label == Label::Name);
        let column_one = start == 0 && from == 0;
        // In column 1 a directive of other dialects may be a label: `byte xorwf sum, f`.
        let mnemonic = |range: &Range<usize>| !self.table.forms(&get(range.clone()).to_ascii_lowercase()).is_empty();
        let foreign = self.d.hooks.foreign.iter().any(|word| word.eq_ignore_ascii_case(get(name.clone())))
            && (second.is_empty() && after >= end || self.is_word(get(second.clone())));
        let in_front = column_one && self.d.column_one && (foreign || mnemonic(&second) && !mnemonic(&name));
        let known = self.is_word(get(name.clone())) && !(in_front && self.directive_of(get(name.clone())).is_some());
        let first = self.directive_of(get(name.clone()));
        let first_names = first.is_some_and(|d| d.label == Label::Name);
        // `RS equ P1.0`: a name of the program that is a directive elsewhere.
        let runs = matches!(first, Some(Directive { does: Do::Run(_), .. }));
        let own = about && runs && self.is_given(first, text, name.clone(), second.end..end);
        if own || about && !first_names && (!known || column_one && !runs) {
            return Head { label: Some(name), address: false, rest: second.end..end, word: second };
        }
        let label = column_one && !known && (self.d.column_one || self.is_word(get(second.clone())));
        if label {
            return Head { label: Some(name), address: true, rest: second.end..end, word: second };
        }
        Head { word: name, rest: name_end..end, ..none }
    }

    /// A label with a colon, or two, and what stands behind it.
    fn labelled(&self, text: &str, name: Range<usize>, colon: usize, end: usize) -> Head {
        let mut behind = colon + 1;
        if byte(text, behind) == b':' {
            behind += 1;
        }
        let behind = behind.min(end);
        let next = self.head(text, behind, end);
        let word = text.get(next.word.clone()).unwrap_or_default();
        let about = self.directive_of(word).is_some_and(|d| d.label == Label::Name);
        // `name: equ 5`; any other label, and what stands behind it, is a line of its own.
        if about && next.label.is_none() {
            return Head { label: Some(name), ..next };
        }
        Head { label: Some(name), address: true, word: behind..behind, rest: behind..end }
    }

    /// The line of the listing shows this value.
    pub fn list_value(&mut self, value: Value) {
        if let Some(last) = self.out.list.last_mut() {
            last.value = Some(value.n);
        }
    }

    /// Gives the name `label` of a directive a value.
    pub fn give(&mut self, call: &Call<'_>, kind: Kind) {
        let Some(label) = call.label.clone() else {
            let word = call.get(call.word.clone());
            let cause = format!("`{word}` needs a name in front of it");
            return self.tell(Fault::new("ASM023", call.word.clone(), cause, "write `name equ value`"));
        };
        let rest = trim(call.text, call.rest.clone());
        let name = call.get(label.clone());
        self.give_value(name, label, call.text, rest, kind);
    }

    /// Gives a name the value of `text[rest]`, or makes it another name of a register of the core.
    pub fn give_value(&mut self, name: &str, at: Range<usize>, text: &str, rest: Range<usize>, kind: Kind) {
        let rest = trim(text, rest);
        let written = text.get(rest.clone()).unwrap_or_default();
        if self.d.zones && self.is_register(name) {
            return self.tell(self.taken(name, at, "given with equ, set or ="));
        }
        if self.symbols.get(written, self.d.any_case).is_none()
            && self.known.get(written).is_none()
            && self.chip_register(written)
        {
            let again = kind == Kind::Set;
            return self.define(name, Value::default(), Kind::Alias { of: written.into(), again }, at);
        }
        let Some(value) = self.value(text, rest) else { return };
        self.list_value(value);
        self.define(name, value, kind, at);
    }
}
