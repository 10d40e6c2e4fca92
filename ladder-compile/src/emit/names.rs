//! Converts names of a ladder program to C identifiers.

use std::collections::HashSet;

/// Assigns a unique identifier to every name.
pub(super) struct IdentifierPool {
    used: HashSet<String>,
}

impl IdentifierPool {
    /// Creates a pool that never assigns the names in `reserved`.
    pub(super) fn new(reserved: &[&str]) -> IdentifierPool {
        IdentifierPool { used: reserved.iter().map(|name| (*name).to_owned()).collect() }
    }

    /// Returns `prefix` and `name`, with invalid characters replaced by `_`, and a number appended if that is
    /// already taken.
    pub(super) fn unique_identifier(&mut self, prefix: &str, name: &str) -> String {
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let first = format!("{prefix}{plain}");
        let mut identifier = first.clone();
        let mut number = 2;
        while !self.used.insert(identifier.clone()) {
            identifier = format!("{first}_{number}");
            number += 1;
        }
        identifier
    }
}

/// Makes a text safe inside a C comment: one line of plain ASCII that contains no start or end of a comment
/// and no trigraph.
pub(super) fn comment_text(text: &str) -> String {
    let plain = text.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '.' });
    let mut safe = String::new();
    for c in plain {
        if matches!((safe.chars().last(), c), (Some('*'), '/') | (Some('/'), '*') | (Some('?'), '?')) {
            safe.push(' ');
        }
        safe.push(c);
    }
    // A backslash at the end of a line would continue a `//` comment on the next line.
    if safe.ends_with('\\') {
        safe.push(' ');
    }
    safe
}
