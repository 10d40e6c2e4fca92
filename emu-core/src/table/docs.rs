//! Writes the instruction list of a family as a page of the documentation.

use std::fmt::Write;

use super::InstructionRow;

/// Returns a Markdown table of all rows: syntax, bits, cycles, flags and description.
#[must_use]
pub fn instruction_list_markdown(rows: &[InstructionRow]) -> String {
    let mut out = String::from("| instruction | bits | cycles | flags | what it does |\n|---|---|---|---|---|\n");
    for row in rows {
        let cycles: Vec<String> = row.cycles.possible_counts().iter().map(u8::to_string).collect();
        let syntax = format!("{} {}", row.mnemonic, row.syntax);
        let flags = if row.flags.is_empty() { "-" } else { row.flags };
        let _ = writeln!(
            out,
            "| `{}` | `{}` | {} | {} | {} |",
            syntax.trim_end(),
            row.pattern,
            cycles.join("/"),
            flags,
            row.doc.trim()
        );
    }
    out
}
