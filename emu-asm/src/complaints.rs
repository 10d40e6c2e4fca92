//! Diagnostics about lines that are not statements.

use std::ops::Range;

use crate::dialect::AsmDirective;
use crate::dialect::pic16::special::is_special;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{behind_name, byte, trim};

impl Assembler<'_> {
    /// Reports text where a word is expected and none is found.
    pub fn no_word(&mut self, text: &str, at: Range<usize>) {
        let what = text.get(at.clone()).unwrap_or_default();
        // Lines for a C compiler.
        let for_c = ["#pragma", "#line"].iter().any(|word| what.starts_with(word));
        if what.is_empty() || self.dialect.controls && for_c {
            return;
        }
        let macro_language =
            self.dialect.controls && what.trim_start_matches(['%', '*']).to_ascii_lowercase().starts_with("define");
        let (cause, hint) = match what.starts_with("/*") && self.dialect.block_comments {
            true => ("the comment is not closed".to_owned(), "close it with `*/`"),
            false if what.starts_with('%') && macro_language => (
                "the macro processing language (MPL) of A51 is not taken".to_owned(),
                "write `name macro a, b` and `endm`",
            ),
            false => {
                let cause = format!("`{what}` is not an instruction, directive or label");
                (cause, "a line is `label: word operands ; comment`")
            }
        };
        self.report(LineFault::new("ASM005", at, cause, hint));
    }

    /// Warns of a directive or instruction in column 1, where labels belong.
    pub fn warn_column_one(&mut self, directive: bool, call: &DirectiveCall<'_>) {
        let special = is_special(call.get(call.word.clone()));
        let (code, what) = if directive && !special { ("ASM041", "directive") } else { ("ASM040", "instruction") };
        let cause = format!("the {what} `{}` is in column 1, which is for labels", call.get(call.word.clone()));
        self.report(LineFault::new(code, call.word.clone(), cause, "put a space before it").warning());
    }

    /// Reports a label before a directive that may have none, unless the directive ends the reading of lines.
    pub fn check_without_label(
        &mut self,
        directive: Option<&AsmDirective>,
        label: Option<Range<usize>>,
        call: &DirectiveCall<'_>,
    ) {
        let refused = directive.is_some_and(|d| self.dialect.hooks.without_label.contains(&d.name));
        let Some(label) = label.filter(|_| refused && self.is_reading()) else { return };
        let cause = format!("`{}` may have no label before it", call.get(call.word.clone()));
        self.report(LineFault::new("ASM023", label, cause, "put the label into a line of its own"));
    }

    /// Reports an instruction in column 1 that is meant as a name, because a directive with values follows:
    /// `b res 1`. Returns whether this is such a line.
    pub fn is_instruction_as_name(&mut self, directive: bool, call: &DirectiveCall<'_>) -> bool {
        let rest = trim(call.text, call.rest.clone());
        let end = behind_name(call.text, rest.start, true).min(rest.end);
        let name = call.get(call.word.clone());
        let next = call.get(rest.start..end);
        let meant = (!directive || is_special(name))
            && end < rest.end
            && byte(call.text, end).is_ascii_whitespace()
            && self.directive_of(next).is_some();
        if meant {
            let cause = format!("`{name}` is an instruction and cannot be the name before `{next}`");
            self.report(LineFault::new("ASM008", call.word.clone(), cause, "choose another name"));
        }
        meant
    }
}
