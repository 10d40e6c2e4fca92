//! Helpers that the table tests share.

use diag::Diagnostic;

/// Program head that a leading `H` in a table row represents.
pub const HEAD: &str = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n";

/// Rows of a table with their line numbers, without blank lines and lines that begin with `#`.
pub fn rows(table: &str) -> impl Iterator<Item = (usize, &str)> {
    table.lines().enumerate().map(|(i, l)| (i + 1, l)).filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'))
}

/// Expands a table row to `.ld` text: ` | ` separates lines, and the escapes of the tables are replaced.
///
/// A leading `H` represents the head, `S` for the head with a serial rate, `V` for the head under the 0.2
/// header.
pub fn text(row: &str) -> String {
    let text: Vec<&str> = row.trim().split(" | ").collect();
    let text = text.join("\n").replace("\\t", "\t").replace("\\r", "\r").replace("\\0", "\0");
    let text = text.replace("\\uFEFF", "\u{feff}").replace("\\\\n", "\\n");
    let headed = |head: &str, rest: &str| format!("{head}{}", rest.trim_start_matches('\n'));
    match text.split_at_checked(1) {
        Some(("H", rest)) => headed(HEAD, rest),
        Some(("S", rest)) => headed(&HEAD.replace("PROGRAM", "BAUD=2400\nPROGRAM"), rest),
        Some(("V", rest)) => headed(&HEAD.replace("0.1", "0.2"), rest),
        _ => text,
    }
}

/// Formats each diagnostic as `CODE@line:column+width`.
pub fn diagnostic_codes(diagnostics: &[Diagnostic]) -> Vec<String> {
    let place = |d: &Diagnostic| format!("{}@{}:{}+{}", d.code, d.pos.line, d.pos.column, d.pos.width);
    diagnostics.iter().map(place).collect()
}
