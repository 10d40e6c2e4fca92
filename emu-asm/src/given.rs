//! Whether the word of a directive in front of `equ`, `bit`, `data` or `set` is a name of the program: `RS equ P1.0`.

use std::ops::Range;

use crate::dialect::{Arithmetic, Directive};
use crate::engine::Asm;
use crate::expr::{Names, Value, evaluate};
use crate::fault::Fault;
use crate::text::{byte, trim};

/// Directives that take any text.
const TEXTS: &[&str] =
    &["title", "subtitle", "subtitl", "stitle", "sbttl", "name", "module", "error", "warning", "messg", "print"];
/// Directives that take a list of names, with classes of segments in front.
const LISTS: &[&str] = &["extrn", "extern", "public", "globl", "global"];

/// Reads names without a word about them, to find out what an expression is.
struct Readable<'r, 'a> {
    asm: &'r Asm<'a>,
    /// Only names that have a value belong to one.
    known: bool,
}

impl Names for Readable<'_, '_> {
    fn name(&mut self, name: &str, at: Range<usize>) -> Result<Value, Fault> {
        let asm = self.asm;
        let known = asm.symbols.get(name, asm.d.any_case).is_some() || asm.known.get(name).is_some();
        match known || !self.known {
            true => Ok(Value { unknown: true, ..Value::default() }),
            false => Err(Fault::new("ASM006", at, "the name has no value", "give it one")),
        }
    }

    fn here(&self, _: &str) -> i64 {
        0
    }

    fn radix(&self) -> u32 {
        self.asm.radix
    }

    fn arithmetic(&self) -> Arithmetic {
        Arithmetic::Signed
    }

    fn local(&self, digits: &str, _: u8) -> String {
        digits.to_owned()
    }
}

impl Asm<'_> {
    /// The name that stands there is given with -D, and cannot be given again: that is told.
    pub(crate) fn is_given_outside(&mut self, text: &str, at: Range<usize>) -> bool {
        let name = text.get(at.clone()).unwrap_or_default();
        let Some(given) = self.given_name(name).filter(|given| self.defines.contains_key(*given)) else { return false };
        let cause = format!("`{name}` is already given with -D {given}");
        let hint = "choose another name, leave the -D out, or put the line between `ifndef NAME` and `endif`";
        self.tell(Fault::new("ASM007", at, cause, hint));
        true
    }

    /// The word of a directive is a name here, which the directive behind it gives the value `text[rest]`.
    pub(crate) fn is_given(
        &self,
        first: Option<&Directive>,
        text: &str,
        word: Range<usize>,
        rest: Range<usize>,
    ) -> bool {
        let name = first.map_or("", |first| first.name);
        let dotted = matches!(byte(text, word.start), b'.' | b'#' | b'$');
        let mut names = Readable { asm: self, known: TEXTS.contains(&name) };
        let rest = trim(text, rest);
        let mut value = || {
            let alias = text.get(rest.clone()).is_some_and(|word| self.is_register(word));
            alias || evaluate(self.d, text, rest.clone(), &mut names).is_ok()
        };
        !dotted && !LISTS.contains(&name) && !self.macros.contains_key(name) && value()
    }
}
