//! The escapes of COMMENT, which differ between the releases of LDmicro.

use crate::model::{LadderDialect, LadderProgram, LdFormat};

/// Escapes of both releases: the letter behind the backslash, and what it stands for.
const ESCAPES: [(char, char); 3] = [('n', '\n'), ('r', '\r'), ('\\', '\\')];

/// Further escapes that LDmicro 5 writes.
const ESCAPES_OF_LDMICRO5: [(char, char); 6] =
    [('a', '\x07'), ('b', '\x08'), ('e', '\x1B'), ('f', '\x0C'), ('t', '\t'), ('v', '\x0B')];

/// Characters that LDmicro 5 reads with or without a backslash before them.
const ESCAPED_BY_HAND: [char; 3] = ['\'', '"', '?'];

/// What LDmicro 5 writes for a comment without text.
const NO_TEXT: &str = "(none)";

fn escapes(dialect: LadderDialect) -> impl Iterator<Item = (char, char)> {
    let more = if dialect == LadderDialect::Ldmicro5 { ESCAPES_OF_LDMICRO5.as_slice() } else { &[] };
    ESCAPES.into_iter().chain(more.iter().copied())
}

/// Replaces the escapes of a comment; any other backslash is an ordinary character.
pub(crate) fn unescape(text: &str, dialect: LadderDialect) -> String {
    let is_ldmicro5 = dialect == LadderDialect::Ldmicro5;
    if is_ldmicro5 && text == NO_TEXT {
        return String::new();
    }
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let space = ["\\x20", "\\\\x20"].into_iter().find_map(|escape| rest.strip_prefix(escape));
        if let Some(after) = space.filter(|_| is_ldmicro5) {
            out.push(' ');
            rest = after;
            continue;
        }
        let next = rest.strip_prefix('\\').and_then(|after| after.chars().next());
        let meant = next.and_then(|next| {
            let written = escapes(dialect).find_map(|(letter, meant)| (letter == next).then_some(meant));
            written.or(ESCAPED_BY_HAND.contains(&next).then_some(next).filter(|_| is_ldmicro5))
        });
        out.push(meant.unwrap_or(first));
        rest = rest.get(first.len_utf8() + usize::from(meant.is_some())..).unwrap_or("");
    }
    out
}

/// Writes the text of a comment of this program.
pub(crate) fn escape(text: &str, program: &LadderProgram) -> String {
    if text.is_empty() && program.dialect == LadderDialect::Ldmicro5 && program.format == LdFormat::V02 {
        return NO_TEXT.to_owned();
    }
    escape_in_dialect(text, program.dialect)
}

/// Writes the text of a comment with the escapes of a dialect.
pub(crate) fn escape_in_dialect(text: &str, dialect: LadderDialect) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match escapes(dialect).find(|(_, meant)| *meant == c) {
            Some((letter, _)) => out.extend(['\\', letter]),
            None => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{escape_in_dialect, unescape};
    use crate::model::LadderDialect::{Ldmicro5, Ldmicro23};

    #[test]
    fn each_release_has_its_escapes() {
        let rows = [
            ("a\\nb\\r\\\\c", "a\nb\r\\c", "a\nb\r\\c"),
            ("a\\tb\\v\\a\\b\\e\\f", "a\\tb\\v\\a\\b\\e\\f", "a\tb\x0B\x07\x08\x1B\x0C"),
            ("\\x20\\\\x20.", "\\x20\\x20.", "  ."),
            ("\\'\\\"\\?", "\\'\\\"\\?", "'\"?"),
            ("\\q \\", "\\q \\", "\\q \\"),
            ("(none)", "(none)", ""),
            ("ça \\é", "ça \\é", "ça \\é"),
        ];
        for (text, old, new) in rows {
            for (dialect, wanted) in [(Ldmicro23, old), (Ldmicro5, new)] {
                assert_eq!(unescape(text, dialect), wanted, "{text}");
                assert_eq!(unescape(&escape_in_dialect(wanted, dialect), dialect), wanted, "{text}");
            }
        }
    }
}
