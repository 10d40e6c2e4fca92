//! Names of a ladder program as identifiers of C.

use std::collections::HashSet;

/// Gives every name an identifier of its own.
pub(super) struct IdentifierPool {
    taken: HashSet<String>,
}

impl IdentifierPool {
    /// None of `reserved` is given out.
    pub(super) fn new(reserved: &[&str]) -> IdentifierPool {
        IdentifierPool { taken: reserved.iter().map(|name| (*name).to_owned()).collect() }
    }

    /// `prefix`, then `name` with everything that no identifier may hold as `_`, then a number where that is taken.
    pub(super) fn unique_identifier(&mut self, prefix: &str, name: &str) -> String {
        let plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let first = format!("{prefix}{plain}");
        let mut given = first.clone();
        let mut number = 2;
        while !self.taken.insert(given.clone()) {
            given = format!("{first}_{number}");
            number += 1;
        }
        given
    }
}

/// Text for the inside of a comment: nothing that ends it, opens another, or is a trigraph; one line of plain ASCII.
pub(super) fn comment_text(text: &str) -> String {
    let plain = text.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '.' });
    let mut safe = String::new();
    for c in plain {
        if matches!((safe.chars().last(), c), (Some('*'), '/') | (Some('/'), '*') | (Some('?'), '?')) {
            safe.push(' ');
        }
        safe.push(c);
    }
    // A backslash at the end of a line would join the next one to it where a comment ends with its line.
    if safe.ends_with('\\') {
        safe.push(' ');
    }
    safe
}
