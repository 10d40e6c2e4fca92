//! Macros and texts that stand for others.

use std::collections::HashMap;
use std::rc::Rc;

use crate::dialect::{Dialect, Flow};
use crate::engine::{Asm, Call};
use crate::fault::Fault;
use crate::reader::Macro;
use crate::statement::code_end;
use crate::text::{Changed, Line, behind_name, byte, cut, skip_space, step, trim};

/// A parameter of a macro.
#[derive(Debug, Clone)]
pub(crate) struct Param {
    /// Its name.
    pub name: String,
    /// What stands for it when nothing is given.
    pub default: Option<String>,
    /// Something must be given.
    pub required: bool,
    /// It is a label of its own in each call that gives nothing for it.
    pub label: bool,
    /// It takes all that is left.
    pub rest: bool,
}

/// A text that stands for another.
#[derive(Debug, Clone)]
pub(crate) struct Define {
    /// Its parameters; none where it has no brackets.
    pub params: Option<Vec<String>>,
    /// The text.
    pub text: String,
}

/// Texts within texts.
const DEEPEST: usize = 32;
/// Bytes that are read while a line has its names replaced, those of texts within texts counted too.
const MOST: usize = 1 << 20;
/// Bytes that a line may grow to.
const LONGEST: usize = 1 << 16;

/// The names whose texts are being put in.
#[derive(Default)]
struct Within {
    /// The names, the outermost first; an empty one is the argument of a text.
    names: Vec<String>,
    /// Bytes read so far.
    read: usize,
}

impl Asm<'_> {
    /// Begins a macro: its lines up to `endm` are kept.
    pub fn define_macro(&mut self, call: &Call<'_>) {
        let text = call.text;
        let (name, params) = match &call.label {
            Some(label) => (label.clone(), call.rest.clone()),
            None => {
                let rest = trim(text, call.rest.clone());
                let end = behind_name(text, rest.start, true).min(rest.end);
                (rest.start..end, skip_comma(text, end)..rest.end.max(end))
            }
        };
        let Some(body) = self.collect(call, Flow::Macro) else { return };
        if name.is_empty() {
            let hint = "write `name macro a, b`, or `.macro name a, b`";
            return self.tell(Fault::new("ASM023", call.word.clone(), "the macro has no name", hint));
        }
        let written = call.get(name.clone()).to_owned();
        let params = parts(self.d, text, params).into_iter().map(|part| param(call.get(part))).collect();
        let mut locals = Vec::new();
        for line in body.iter() {
            locals.extend(self.locals_of(line));
        }
        let found = Macro { name: written.clone(), params, locals, body };
        self.macros.insert(written.to_ascii_lowercase(), Rc::new(found));
    }

    /// The names that a `local` line of a macro gives.
    fn locals_of(&self, line: &Line) -> Vec<String> {
        let text = &line.text;
        let head = self.head(text, 0, code_end(self.d, text));
        let word = text.get(head.word.clone()).unwrap_or_default().trim_start_matches('.');
        if !word.eq_ignore_ascii_case("local") {
            return Vec::new();
        }
        let names = cut(text, head.rest).into_iter();
        names
            .map(|range| {
                text.get(range.start..behind_name(text, range.start, !self.d.dot_is_bit)).unwrap_or_default().to_owned()
            })
            .collect()
    }

    /// Reads a macro: its lines with the arguments put in.
    pub fn call_macro(&mut self, found: &Macro, call: &Call<'_>) {
        self.calls += 1;
        let number = self.calls;
        let mut values: Vec<(String, Option<String>)> = found.params.iter().map(|p| (p.name.clone(), None)).collect();
        let mut next = 0;
        for range in arguments(self.d, call.text, call.rest.clone()) {
            let text = call.get(range.clone());
            let named = text.split_once('=').and_then(|(name, value)| {
                let at = found.params.iter().position(|p| p.name == name.trim())?;
                Some((at, value.trim()))
            });
            let (at, text) = match named {
                Some((at, value)) => (at, value),
                None => (next, text),
            };
            next = at + 1;
            let rest = found.params.get(at).is_some_and(|p| p.rest);
            match values.get_mut(at) {
                Some((_, value)) if rest => {
                    *value = Some(call.get(range.start..call.rest.end).trim().to_owned());
                    break;
                }
                Some((_, value)) => *value = Some(text.to_owned()),
                None => {
                    let cause = format!("`{}` takes {} arguments, and here are more", found.name, found.params.len());
                    self.tell(Fault::new(
                        "ASM023",
                        range,
                        cause,
                        "a text with commas in it stands in brackets or quotes",
                    ));
                    return;
                }
            }
        }
        for (param, (_, value)) in found.params.iter().zip(&mut values) {
            if value.is_none() && param.required {
                let cause = format!("`{}` needs a value for `{}`", found.name, param.name);
                self.tell(Fault::new("ASM023", call.word.clone(), cause, "give it behind the others, or by its name"));
            }
            *value = value.take().or_else(|| param.default.clone());
        }
        // sdas: a parameter with a question mark is another label in each call when nothing is given for it.
        for (i, (param, (_, value))) in found.params.iter().zip(&mut values).enumerate() {
            if param.label && value.is_none() {
                *value = Some(format!("{}$", 10_000 + number as usize * 16 + i));
            }
        }
        let locals = found.locals.iter().map(|name| (name.clone(), format!("{name}?{number}")));
        let values: Vec<(String, String)> =
            values.into_iter().map(|(name, value)| (name, value.unwrap_or_default())).chain(locals).collect();
        let lines = found.body.iter().map(|line| put_in(self.d, line, &values, number)).collect();
        self.enter(found, lines, call);
    }

    /// Defines the names given from outside and those of the chip.
    pub fn define_given(&mut self) {
        self.defines = HashMap::new();
        let all = (self.d.defines)(self.chip).into_iter().chain(self.given.clone());
        for (name, text) in all {
            self.defines.insert(name, Rc::new(Define { params: None, text }));
        }
    }

    /// A text stands for a name.
    pub fn define_name(&mut self, name: String, text: &str) {
        self.defines.insert(name, Rc::new(Define { params: None, text: text.to_owned() }));
    }

    /// `#define name text` and `#define name(a, b) text`.
    pub fn define_text(&mut self, call: &Call<'_>) {
        let rest = trim(call.text, call.rest.clone());
        let end = behind_name(call.text, rest.start, true).min(rest.end);
        if end <= rest.start {
            let hint = "write `#define name text`";
            return self.tell(Fault::new("ASM023", call.word.clone(), "a name is missing behind #define", hint));
        }
        let name = call.get(rest.start..end).to_owned();
        let close = (byte(call.text, end) == b'(')
            .then(|| call.text.get(end..rest.end)?.find(')').map(|at| end + at))
            .flatten();
        let (params, from) = match close {
            Some(close) => {
                let names = cut(call.text, end + 1..close).into_iter().map(|range| call.get(range).to_owned());
                (Some(names.collect()), close + 1)
            }
            None => (None, end),
        };
        let text = call.get(from..rest.end.max(from)).trim().to_owned();
        self.defines.insert(name, Rc::new(Define { params, text }));
    }

    /// A condition with 1 or 0 for each `defined(NAME)`, as C's preprocessor has it.
    pub fn decide_defined(&self, line: &Line, end: usize) -> Option<Line> {
        let text = line.text.get(..end)?;
        if !text.contains("defined") || !self.directive_of(text.split_whitespace().next()?)?.name.contains("if") {
            return None;
        }
        let mut changed = Changed::default();
        let mut done = 0;
        for (at, word) in text.match_indices("defined") {
            let mut name = skip_space(text, at + word.len());
            let bracket = byte(text, name) == b'(';
            name = skip_space(text, name + usize::from(bracket));
            let mut end = behind_name(text, name, false);
            let found = text.get(name..end).filter(|name| !name.is_empty())?;
            let known = self.defines.contains_key(found) || self.known.get(found).is_some();
            if bracket {
                end = skip_space(text, end) + 1;
            }
            changed.copy(text, done..at);
            changed.put(if known { "1" } else { "0" }, at);
            done = end.min(text.len());
        }
        changed.copy(text, done..text.len());
        Some(changed.into_line(line))
    }

    /// The line with the texts put in for which defined names stand.
    pub fn expand(&mut self, line: &Line, end: usize) -> Option<Line> {
        if self.defines.is_empty() {
            return None;
        }
        let mut changed = Changed::default();
        let code = line.text.get(..end).unwrap_or_default();
        let mut within = Within::default();
        if !self.put_texts(code, &mut changed, &mut within, None) {
            return None;
        }
        if within.read >= MOST {
            let cause = format!("the texts that stand for names of the line come to more than {MOST} characters");
            self.tell(Fault::new("ASM014", 0..end, cause, "look for texts that stand in each other"));
            return None;
        }
        if changed.text.len() >= LONGEST {
            let cause =
                format!("the line grows to more than {LONGEST} characters when names are replaced by their texts");
            self.tell(Fault::new("ASM014", 0..end, cause, "look for a text that doubles itself"));
            return None;
        }
        Some(changed.into_line(line))
    }

    /// Copies `code` with texts put in; true where there was one. `old` is the place for all of it where it is itself a text.
    fn put_texts(&self, code: &str, out: &mut Changed, within: &mut Within, old: Option<usize>) -> bool {
        let (mut at, mut done, mut any) = (0, 0, false);
        while at < code.len() && out.text.len() < LONGEST {
            let end = behind_name(code, at, !self.d.dot_is_bit);
            if end == at {
                // Digits and letters that stand together are one number.
                at = match byte(code, at) {
                    c if c.is_ascii_digit() => {
                        at + code
                            .get(at..)
                            .map_or(1, |rest| rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len()))
                    }
                    _ => step(code, at),
                };
                continue;
            }
            let name = code.get(at..end).unwrap_or_default();
            // B'1010' is a number.
            let found = if byte(code, end) == b'\'' { None } else { self.defines.get(name).cloned() };
            let open = within.read < MOST && within.names.len() < DEEPEST;
            let found = found.filter(|_| open && !within.names.iter().any(|n| n == name));
            let put = found.and_then(|define| self.text_of(code, end, &define, within));
            if let Some((text, behind)) = put {
                copy(out, code, done..at, old);
                any = true;
                within.read += text.len();
                within.names.push(name.to_owned());
                self.put_texts(&text, out, within, Some(old.unwrap_or(at)));
                within.names.pop();
                (at, done) = (behind, behind);
            } else {
                at = end;
            }
        }
        copy(out, code, done..code.len(), old);
        any
    }

    /// The text that stands for a name which ends at `end`, and where what it replaces ends.
    fn text_of(&self, code: &str, end: usize, define: &Define, within: &mut Within) -> Option<(String, usize)> {
        let Some(params) = &define.params else { return Some((define.text.clone(), end)) };
        let open = skip_space(code, end);
        if byte(code, open) != b'(' {
            return None;
        }
        let (mut depth, mut at) = (0, open);
        while at < code.len() {
            match byte(code, at) {
                b'(' => depth += 1,
                b')' if depth == 1 => break,
                b')' => depth -= 1,
                _ => {}
            }
            at = step(code, at);
        }
        within.read += at - open + define.text.len() + 1;
        // What is given has its texts put in first, so that a text may stand in itself: `X(X(2))`.
        within.names.push(String::new());
        let mut put = |range| {
            let mut changed = Changed::default();
            self.put_texts(code.get(range).unwrap_or_default(), &mut changed, within, Some(0));
            changed.text
        };
        let given: Vec<String> = cut(code, open + 1..at).into_iter().map(&mut put).collect();
        within.names.pop();
        let values: Vec<(String, String)> = params.iter().cloned().zip(given).collect();
        let line = Line { text: define.text.as_str().into(), file: 0, number: 0, map: None };
        let plain = Dialect { plain_arguments: true, ..*self.d };
        Some((put_in(&plain, &line, &values, 0).text.to_string(), (at + 1).min(code.len())))
    }
}

fn copy(out: &mut Changed, code: &str, range: std::ops::Range<usize>, old: Option<usize>) {
    if range.is_empty() {
        return;
    }
    match old {
        Some(old) => out.put(code.get(range).unwrap_or_default(), old),
        None => out.copy(code, range),
    }
}

/// Arguments between commas, each without the angles that may be around it in the dialects that have them: `<1, 2>, <>`.
pub(crate) fn arguments(d: &Dialect, text: &str, range: std::ops::Range<usize>) -> Vec<std::ops::Range<usize>> {
    if !d.hooks.angles || !text.get(range.clone()).is_some_and(|all| all.contains('<')) {
        return parts(d, text, range);
    }
    let mut all = Vec::new();
    let mut at = range.start;
    loop {
        let start = skip_space(text, at).min(range.end);
        let next = match in_angles(text, start..range.end) {
            Some(inside) => {
                let behind = skip_space(text, inside.end + 1);
                all.push(inside);
                behind
            }
            None => {
                let first = cut(text, start..range.end).first().map_or(start..range.end, |first| {
                    let comma = skip_space(text, first.end);
                    start..comma
                });
                all.push(trim(text, first.clone()));
                first.end
            }
        };
        if next >= range.end {
            return all;
        }
        at = next + 1;
    }
}

/// What stands in the angles at the front of `range`, which a comma or its end follows.
fn in_angles(text: &str, range: std::ops::Range<usize>) -> Option<std::ops::Range<usize>> {
    let (mut depth, mut at) = (0u32, range.start);
    while at < range.end {
        match byte(text, at) {
            b'<' => depth += 1,
            b'>' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth == 0 {
            let behind = skip_space(text, at + 1);
            let ends = behind >= range.end || byte(text, behind) == b',';
            return (at > range.start && ends).then_some(range.start + 1..at);
        }
        at = step(text, at);
    }
    None
}

/// Pieces between commas, and in dialects that have it so between spaces, where no operator stands on either side.
fn parts(d: &Dialect, text: &str, range: std::ops::Range<usize>) -> Vec<std::ops::Range<usize>> {
    let pieces = cut(text, range);
    if !d.spaced_arguments {
        return pieces;
    }
    let mut all = Vec::new();
    for piece in pieces {
        let (mut start, mut at, mut depth) = (piece.start, piece.start, 0u32);
        while at < piece.end {
            match byte(text, at) {
                b'(' | b'[' => depth += 1,
                b')' | b']' => depth = depth.saturating_sub(1),
                b' ' | b'\t' if depth == 0 => {
                    let next = skip_space(text, at);
                    let before = byte(text, at.saturating_sub(1));
                    let value =
                        |c: u8| c.is_ascii_alphanumeric() || matches!(c, b'_' | b'.' | b'"' | b'\'' | b'\\' | b'$');
                    if (value(before) || before == b')') && (value(byte(text, next)) || byte(text, next) == b'(') {
                        all.push(start..at);
                        start = next;
                    }
                    at = next;
                    continue;
                }
                _ => {}
            }
            at = step(text, at);
        }
        all.push(start..piece.end);
    }
    all
}

fn skip_comma(text: &str, at: usize) -> usize {
    let at = skip_space(text, at);
    if byte(text, at) == b',' { at + 1 } else { at }
}

/// `a`, `a=1`, `a:req`, `a:vararg`, `\a`.
fn param(text: &str) -> Param {
    let (name, default) =
        text.split_once('=').map_or((text, None), |(name, value)| (name, Some(value.trim().to_owned())));
    let (name, kind) = name.split_once(':').unwrap_or((name, ""));
    let kind = kind.trim();
    Param {
        name: name.trim().trim_start_matches(['\\', '?']).to_owned(),
        default,
        label: name.trim().starts_with('?'),
        required: kind.eq_ignore_ascii_case("req"),
        rest: kind.eq_ignore_ascii_case("vararg"),
    }
}

/// The line with values for names: `\name` everywhere, and in dialects that have it so the name alone outside quotes. `\@`
/// is the number of the call, `\()` nothing.
pub(crate) fn put_in(d: &Dialect, line: &Line, values: &[(String, String)], number: u32) -> Line {
    let text: &str = &line.text;
    let plain = d.plain_arguments && !values.is_empty();
    if !plain && !text.contains('\\') {
        return line.clone();
    }
    let mut out = Changed::default();
    let end = code_end(d, text);
    let (mut at, mut done) = (0, 0);
    let put = |out: &mut Changed, done: &mut usize, from: usize, to: usize, value: &str| {
        out.copy(text, *done..from);
        out.put(value, from);
        *done = to;
    };
    while at < text.len() {
        if byte(text, at) == b'\\' {
            let name_end = behind_name(text, at + 1, false);
            let name = text.get(at + 1..name_end).unwrap_or_default();
            if let Some((_, value)) = values.iter().find(|(n, _)| n == name) {
                put(&mut out, &mut done, at, name_end, value);
                at = name_end;
            } else if byte(text, at + 1) == b'@' {
                put(&mut out, &mut done, at, at + 2, &number.to_string());
                at += 2;
            } else if text.get(at + 1..at + 3) == Some("()") {
                put(&mut out, &mut done, at, at + 3, "");
                at += 3;
            } else {
                at += 1;
            }
            continue;
        }
        let name_end = behind_name(text, at, !d.dot_is_bit);
        let here = plain && at < end;
        if here && name_end > at {
            let name = text.get(at..name_end).unwrap_or_default();
            if let Some((_, value)) = values.iter().find(|(n, _)| n == name) {
                put(&mut out, &mut done, at, name_end, value);
            }
            at = name_end;
        } else if here && !text.get(at..step(text, at)).unwrap_or_default().contains('\\') {
            at = step(text, at);
        } else {
            at += text.get(at..).and_then(|rest| rest.chars().next()).map_or(1, char::len_utf8);
        }
    }
    out.copy(text, done..text.len());
    out.into_line(line)
}
