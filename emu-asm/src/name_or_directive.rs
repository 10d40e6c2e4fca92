//! Decides whether a word that is also a directive is a name of the program before `equ`, `bit`, `data` or
//! `set`: `RS equ P1.0`.

use std::ops::Range;

use crate::dialect::{AsmArithmetic, AsmDirective};
use crate::engine::Assembler;
use crate::expression::{NameValues, evaluate};
use crate::fault::LineFault;
use crate::lines::{byte, trim};
use crate::value::AsmValue;

/// Directives that take any text.
const TEXT_DIRECTIVES: &[&str] =
    &["title", "subtitle", "subtitl", "stitle", "sbttl", "name", "module", "error", "warning", "messg", "print"];
/// Directives that take a list of names, which may begin with segment classes.
const NAME_LIST_DIRECTIVES: &[&str] = &["extrn", "extern", "public", "globl", "global"];

/// Reads names without reporting faults, to find out what an expression is.
struct ExpressionCheck<'r, 'a> {
    asm: &'r Assembler<'a>,
    /// Only names that have a value belong to an expression.
    only_known: bool,
}

impl NameValues for ExpressionCheck<'_, '_> {
    fn value_of_name(&mut self, name: &str, at: Range<usize>) -> Result<AsmValue, LineFault> {
        let asm = self.asm;
        let known = asm.symbols.get(name, asm.dialect.ignores_case).is_some() || asm.chip_names.get(name).is_some();
        match known || !self.only_known {
            true => Ok(AsmValue { is_unknown: true, ..AsmValue::default() }),
            false => Err(LineFault::new("ASM006", at, "the name has no value", "give it one")),
        }
    }

    fn location_counter(&self, _: &str) -> i64 {
        0
    }

    fn radix(&self) -> u32 {
        self.asm.radix
    }

    fn arithmetic(&self) -> AsmArithmetic {
        AsmArithmetic::Signed
    }

    fn local_label_name(&self, digits: &str, _: u8) -> String {
        digits.to_owned()
    }
}

impl Assembler<'_> {
    /// Reports an error if the name at `at` is defined with -D and therefore cannot be defined again.
    pub(crate) fn check_not_given_outside(&mut self, text: &str, at: Range<usize>) -> bool {
        let name = text.get(at.clone()).unwrap_or_default();
        let Some(given) = self.given_name(name).filter(|given| self.defines.contains_key(*given)) else { return false };
        let cause = format!("`{name}` is already given with -D {given}");
        let hint = "choose another name, leave the -D out, or put the line between `ifndef NAME` and `endif`";
        self.report(LineFault::new("ASM007", at, cause, hint));
        true
    }

    /// Reports whether a directive's word is a name here, which the next directive defines as `text[rest]`.
    pub(crate) fn is_name_being_defined(
        &self,
        first: Option<&AsmDirective>,
        text: &str,
        word: Range<usize>,
        rest: Range<usize>,
    ) -> bool {
        let name = first.map_or("", |first| first.name);
        let dotted = matches!(byte(text, word.start), b'.' | b'#' | b'$');
        let mut names = ExpressionCheck { asm: self, only_known: TEXT_DIRECTIVES.contains(&name) };
        let rest = trim(text, rest);
        let mut value = || {
            let alias = text.get(rest.clone()).is_some_and(|word| self.is_register(word));
            alias || evaluate(self.dialect, text, rest.clone(), &mut names).is_ok()
        };
        !dotted && !NAME_LIST_DIRECTIVES.contains(&name) && !self.macros.contains_key(name) && value()
    }
}
