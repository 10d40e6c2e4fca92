//! Macros and text definitions.

use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

use crate::NamedText;
use crate::arguments::{
    ArgumentJoin, parse_parameter, scan_name, skip_comma, split_arguments, split_parts, substitute_parameters,
    unescape, unquoted_argument,
};
use crate::dialect::avr::atmel::ARGUMENTS;
use crate::dialect::{AsmDialect, ReadFlow};
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{AsmLine, RewrittenText, behind_name, byte, cut, skip_space, step, trim};
use crate::reader::AsmMacro;
use crate::statement::code_end;

/// A parameter of a macro.
#[derive(Debug, Clone)]
pub(crate) struct MacroParameter {
    /// Its name.
    pub name: String,
    /// Its value if the call gives none.
    pub default: Option<String>,
    /// The call must give a value.
    pub required: bool,
    /// It is a unique label in each call that gives no value.
    pub label: bool,
    /// It takes all remaining arguments.
    pub rest: bool,
}

/// A text that replaces a name.
#[derive(Debug, Clone)]
pub(crate) struct TextDefine {
    /// Its parameters; `None` if it has no parentheses.
    pub params: Option<Vec<String>>,
    /// The text.
    pub text: String,
}

/// The maximum nesting of expansions.
const MAX_DEPTH: usize = 32;
/// The maximum number of bytes read during the expansion of one line, with nested expansions.
const MAX_BYTES_READ: usize = 1 << 20;
/// The maximum length of an expanded line in bytes.
const MAX_LINE_BYTES: usize = 1 << 16;

/// The names that are being expanded.
#[derive(Default)]
struct ExpansionStack {
    /// The names, the outermost first; an empty one is the argument of a text.
    names: Vec<String>,
    /// Bytes read so far.
    read: usize,
}

impl Assembler<'_> {
    /// Begins a macro: stores its lines up to `endm`.
    pub fn define_macro(&mut self, call: &DirectiveCall<'_>) {
        let text = call.text;
        let (name, params) = match &call.label {
            Some(label) => (label.clone(), call.rest.clone()),
            None => {
                let rest = trim(text, call.rest.clone());
                let end = behind_name(text, rest.start, true).min(rest.end);
                (rest.start..end, skip_comma(text, end)..rest.end.max(end))
            }
        };
        let Some(body) = self.collect_block(call, ReadFlow::Macro) else { return };
        if name.is_empty() {
            let hint = "write `name macro a, b`, or `.macro name a, b`";
            return self.report(LineFault::new("ASM023", call.word.clone(), "the macro has no name", hint));
        }
        let written = call.get(name.clone()).to_owned();
        let join = ArgumentJoin::of(self.dialect, call.get(call.word.clone()));
        let params = match self.dialect.hooks.is_atmel {
            true => (0..ARGUMENTS).map(|n| parse_parameter(self.dialect, &format!("@{n}"))).collect(),
            false => split_parts(self.dialect, text, params, join)
                .into_iter()
                .map(|part| parse_parameter(self.dialect, call.get(part)))
                .collect(),
        };
        let mut locals = Vec::new();
        for line in body.iter() {
            locals.extend(self.locals_of(line));
        }
        let found = AsmMacro { name: written.clone(), params, locals, body, join };
        self.macros.insert(written.to_ascii_lowercase(), Rc::new(found));
    }

    /// Returns the names that a `local` line of a macro declares; for Atmel's assembler its labels.
    fn locals_of(&self, line: &AsmLine) -> Vec<String> {
        let text = &line.text;
        let head = self.parse_head(text, 0, code_end(self.dialect, text));
        if self.dialect.hooks.is_atmel {
            let label = head.label.filter(|_| head.is_address).and_then(|label| text.get(label));
            return label.map(str::to_owned).into_iter().collect();
        }
        let word = text.get(head.word.clone()).unwrap_or_default().trim_start_matches('.');
        if !word.eq_ignore_ascii_case("local") {
            return Vec::new();
        }
        let names = cut(self.dialect, text, head.rest).into_iter();
        names
            .map(|range| {
                text.get(range.start..behind_name(text, range.start, !self.dialect.dot_is_bit))
                    .unwrap_or_default()
                    .to_owned()
            })
            .collect()
    }

    /// Calls a macro: reads its lines with the arguments substituted.
    pub fn call_macro(&mut self, found: &AsmMacro, call: &DirectiveCall<'_>) {
        self.macro_calls += 1;
        let number = self.macro_calls;
        let mut values: Vec<(String, Option<String>)> = found.params.iter().map(|p| (p.name.clone(), None)).collect();
        let mut next = 0;
        let given = split_arguments(self.dialect, call.text, call.rest.clone(), found.join);
        let count = given.len();
        for range in given {
            let written = self.argument(call, range.clone(), found.join);
            let text = written.as_ref();
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
                Some((_, value)) => *value = Some(unquoted_argument(self.dialect, text)),
                None => {
                    let cause = format!("`{}` takes {} arguments, but here are more", found.name, found.params.len());
                    self.report(LineFault::new("ASM023", range, cause, "put a text with commas in brackets or quotes"));
                    return;
                }
            }
        }
        for (param, (_, value)) in found.params.iter().zip(&mut values) {
            if value.is_none() && param.required {
                let cause = format!("`{}` needs a value for `{}`", found.name, param.name);
                self.report(LineFault::new(
                    "ASM023",
                    call.word.clone(),
                    cause,
                    "give it after the others, or by its name",
                ));
            }
            // A blank argument is the default too.
            *value = value
                .take()
                .filter(|given| !given.is_empty() || param.default.is_none())
                .or_else(|| param.default.clone());
        }
        // sdas: a parameter with a question mark becomes a new label in each call that gives no value.
        for (i, (param, (_, value))) in found.params.iter().zip(&mut values).enumerate() {
            if param.label && value.as_ref().is_none_or(String::is_empty) {
                *value = Some(format!("{}$", 10_000 + number as usize * 16 + i));
            }
        }
        // Atmel's assembler has an operator `?`.
        let mark = if self.dialect.hooks.is_atmel { '$' } else { '?' };
        let locals = found.locals.iter().map(|name| NamedText::new(name, format!("{name}{mark}{number}")));
        let values: Vec<NamedText> = values
            .into_iter()
            .map(|(name, value)| NamedText::new(name, value.unwrap_or_default()))
            .chain(locals)
            .collect();
        let lines = found
            .body
            .iter()
            .map(|line| substitute_parameters(self.dialect, line, &values, number, found.join))
            .collect();
        self.enter_macro(found, lines, count, call);
    }

    /// Returns the text of an argument. In ASM51 and ASEM-51 a leading `%` evaluates it, and in angle
    /// brackets `!` escapes the next character, elsewhere a semicolon.
    fn argument<'t>(&mut self, call: &DirectiveCall<'t>, range: Range<usize>, join: ArgumentJoin) -> Cow<'t, str> {
        let text = call.get(range.clone());
        let in_angles = byte(call.text, range.start.wrapping_sub(1)) == b'<';
        // `%101` is a number itself.
        let value = text.strip_prefix('%').filter(|rest| !in_angles && rest.contains(|c| !matches!(c, '0' | '1')));
        match value {
            _ if join != ArgumentJoin::And => text.into(),
            Some(_) => self.evaluate_number(call.text, range.start + 1..range.end).unwrap_or(0).to_string().into(),
            None if in_angles && text.contains('!') || text.contains("!;") => unescape(text).into(),
            None => text.into(),
        }
    }

    /// Defines the names of the caller and those of the chip.
    pub fn define_given(&mut self) {
        self.defines = HashMap::new();
        for NamedText { name, text } in (self.dialect.predefined)(self.chip) {
            let (name, param) = match name.strip_suffix(')').and_then(|name| name.split_once('(')) {
                Some((name, param)) => (name.to_owned(), Some(vec![param.to_owned()])),
                None => (name, None),
            };
            self.defines.insert(name, Rc::new(TextDefine { params: param, text }));
        }
        for NamedText { name, text } in self.given_defines.clone() {
            self.defines.insert(name, Rc::new(TextDefine { params: None, text }));
        }
    }

    /// Returns the text definition of a name. Names of the caller ignore case if labels do.
    pub fn find_define(&self, name: &str) -> Option<&Rc<TextDefine>> {
        self.defines.get(name).or_else(|| self.defines.get(self.given_name(name)?))
    }

    /// Returns the caller's spelling of the name.
    pub fn given_name(&self, name: &str) -> Option<&str> {
        let is_it = |given: &str| given == name || self.dialect.ignores_case && given.eq_ignore_ascii_case(name);
        self.given_defines.iter().map(|given| given.name.as_str()).find(|given| is_it(given))
    }

    /// Defines a text for a name.
    pub fn define_name(&mut self, name: String, text: &str) {
        self.defines.insert(name, Rc::new(TextDefine { params: None, text: text.to_owned() }));
    }

    /// `#define name text` and `#define name(a, b) text`.
    pub fn define_text(&mut self, call: &DirectiveCall<'_>) {
        let rest = trim(call.text, call.rest.clone());
        let end = behind_name(call.text, rest.start, true).min(rest.end);
        if end <= rest.start {
            let hint = "write `#define name text`";
            return self.report(LineFault::new("ASM023", call.word.clone(), "a name is missing after #define", hint));
        }
        let name = call.get(rest.start..end).to_owned();
        let close = (byte(call.text, end) == b'(')
            .then(|| call.text.get(end..rest.end)?.find(')').map(|at| end + at))
            .flatten();
        let (params, from) = match close {
            Some(close) => {
                let names =
                    cut(self.dialect, call.text, end + 1..close).into_iter().map(|range| call.get(range).to_owned());
                (Some(names.collect()), close + 1)
            }
            None => (None, end),
        };
        let text = call.get(from..rest.end.max(from)).trim().to_owned();
        self.defines.insert(name, Rc::new(TextDefine { params, text }));
    }

    /// Returns a condition with each `defined(NAME)` replaced by 1 or 0, as in the C preprocessor.
    pub fn replace_defined(&self, line: &AsmLine, end: usize) -> Option<AsmLine> {
        let text = line.text.get(..end)?;
        if !text.contains("defined") || !self.directive_of(text.split_whitespace().next()?)?.name.contains("if") {
            return None;
        }
        let mut changed = RewrittenText::default();
        let mut done = 0;
        for (at, word) in text.match_indices("defined") {
            let mut name = skip_space(text, at + word.len());
            let bracket = byte(text, name) == b'(';
            name = skip_space(text, name + usize::from(bracket));
            let mut end = behind_name(text, name, false);
            let found = text.get(name..end).filter(|name| !name.is_empty())?;
            let known = self.find_define(found).is_some() || self.chip_names.get(found).is_some();
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

    /// Returns the line with all defined names replaced by their texts.
    pub fn expand_defines(&mut self, line: &AsmLine, end: usize) -> Option<AsmLine> {
        if self.defines.is_empty() {
            return None;
        }
        let mut changed = RewrittenText::default();
        let code = line.text.get(..end).unwrap_or_default();
        let mut within = ExpansionStack::default();
        if !self.expand_code(code, &mut changed, &mut within, None) {
            return None;
        }
        if within.read >= MAX_BYTES_READ {
            let cause = format!("the replacement texts of the line have more than {MAX_BYTES_READ} characters");
            self.report(LineFault::new("ASM014", 0..end, cause, "look for texts that contain each other"));
            return None;
        }
        if changed.text.len() >= MAX_LINE_BYTES {
            let cause = format!(
                "the line grows to more than {MAX_LINE_BYTES} characters when names are replaced by their texts"
            );
            self.report(LineFault::new("ASM014", 0..end, cause, "look for a text that doubles itself"));
            return None;
        }
        Some(changed.into_line(line))
    }

    /// Copies `code` with names expanded; returns whether there was one. `old` is the origin of all of it if
    /// `code` is itself an expansion.
    fn expand_code(
        &self,
        code: &str,
        out: &mut RewrittenText,
        within: &mut ExpansionStack,
        old: Option<usize>,
    ) -> bool {
        let (mut at, mut done, mut any) = (0, 0, false);
        while at < code.len() && out.text.len() < MAX_LINE_BYTES {
            let end = match scan_name(self.dialect, code, at) {
                Ok(end) => end,
                Err(behind) => {
                    at = behind;
                    continue;
                }
            };
            let name = code.get(at..end).unwrap_or_default();
            // B'1010' is a number.
            let found = if byte(code, end) == b'\'' { None } else { self.find_define(name).cloned() };
            let open = within.read < MAX_BYTES_READ && within.names.len() < MAX_DEPTH;
            let found = found.filter(|_| open && !within.names.iter().any(|n| n == name));
            let put = found.and_then(|define| self.expansion_of(code, end, &define, within));
            if let Some((text, behind)) = put {
                copy(out, code, done..at, old);
                any = true;
                within.read += text.len();
                within.names.push(name.to_owned());
                self.expand_code(&text, out, within, Some(old.unwrap_or(at)));
                within.names.pop();
                (at, done) = (behind, behind);
            } else {
                at = end;
            }
        }
        copy(out, code, done..code.len(), old);
        any
    }

    /// Returns the text for a name that ends at `end`, and the end of what it replaces.
    fn expansion_of(
        &self,
        code: &str,
        end: usize,
        define: &TextDefine,
        within: &mut ExpansionStack,
    ) -> Option<(String, usize)> {
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
            at = step(self.dialect, code, at);
        }
        within.read += at - open + define.text.len() + 1;
        // Arguments are expanded first, so a text may contain itself: `X(X(2))`.
        within.names.push(String::new());
        let mut put = |range| {
            let mut changed = RewrittenText::default();
            self.expand_code(code.get(range).unwrap_or_default(), &mut changed, within, Some(0));
            changed.text
        };
        let given: Vec<String> = cut(self.dialect, code, open + 1..at).into_iter().map(&mut put).collect();
        within.names.pop();
        let values: Vec<NamedText> = params.iter().zip(given).map(|(name, text)| NamedText::new(name, text)).collect();
        let line = AsmLine { text: define.text.as_str().into(), file: 0, number: 0, map: None };
        let plain = AsmDialect { plain_arguments: true, ..*self.dialect };
        Some((
            substitute_parameters(&plain, &line, &values, 0, ArgumentJoin::Nothing).text.to_string(),
            (at + 1).min(code.len()),
        ))
    }
}

fn copy(out: &mut RewrittenText, code: &str, range: Range<usize>, old: Option<usize>) {
    if range.is_empty() {
        return;
    }
    match old {
        Some(old) => out.put(code.get(range).unwrap_or_default(), old),
        None => out.copy(code, range),
    }
}
