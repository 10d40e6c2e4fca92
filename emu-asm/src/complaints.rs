//! What is said of lines that are none.

use std::ops::Range;

use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;

impl Assembler<'_> {
    /// What stands where a word should, and is none.
    pub fn no_word(&mut self, text: &str, at: Range<usize>) {
        let what = text.get(at.clone()).unwrap_or_default();
        // Lines for a compiler of C.
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
                let cause = format!("`{what}` is no instruction, directive or label");
                (cause, "a line is `label: word operands ; comment`")
            }
        };
        self.report(LineFault::new("ASM005", at, cause, hint));
    }

    /// Tells of a word that stands where labels do.
    pub fn warn_column_one(&mut self, directive: bool, call: &DirectiveCall<'_>) {
        let (code, what) = if directive { ("ASM041", "directive") } else { ("ASM040", "instruction") };
        let cause = format!("the {what} `{}` stands in column 1, where labels stand", call.get(call.word.clone()));
        self.report(LineFault::new(code, call.word.clone(), cause, "put a space before it").warning());
    }
}
