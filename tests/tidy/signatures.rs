//! Signatures name their parts: no anonymous tuples, and items that other files use have documentation.

use std::fs;

use super::{crates, root, rust_files};

/// Functions whose signatures may have a tuple, by name, each with the reason.
const MAY_HAVE_TUPLES: &[(&str, &str)] = &[
    ("div_rem", "quotient and remainder, in this order everywhere"),
    ("complete", "the signature is that of rustyline"),
    ("from_raw_id", "the signature is that of gdbstub"),
];

/// Functions with tuples that still have to be named, by crate. A number may only become smaller.
const STILL_WITH_TUPLES: &[(&str, usize)] = &[
    ("emu-asm", 50),
    ("emu-avr", 1),
    ("emu-pic16", 5),
    ("emu-debug", 1),
    ("emu-gdb", 3),
    ("emu-dap", 6),
    ("ladder", 56),
    ("ladder-eval", 2),
    ("ladder-compile", 72),
    ("ladder-view", 6),
    ("emu-check", 32),
    ("scenario", 9),
    ("emu-tui", 7),
    ("test-support", 1),
    ("fuzz", 3),
    ("emu", 73),
];

/// Returns a source without comments, and with empty strings and characters, so that brackets are those of
/// code. Tests at its end are left out.
fn code_of(source: &str) -> String {
    let (mut code, mut rest) = (String::new(), source);
    while let Some(c) = rest.chars().next() {
        let mut after = rest.get(c.len_utf8()..).unwrap_or_default();
        match c {
            '/' if rest.starts_with("//") => after = rest.find('\n').and_then(|at| rest.get(at..)).unwrap_or_default(),
            '"' => {
                let mut escaped = false;
                let end = after.find(|c| {
                    let ends = c == '"' && !escaped;
                    escaped = c == '\\' && !escaped;
                    ends
                });
                after = end.and_then(|at| after.get(at + 1..)).unwrap_or_default();
                code.push_str("\"\"");
            }
            // A character, not a lifetime.
            '\'' if after.starts_with('\\') || after.chars().nth(1) == Some('\'') => {
                let skipped = if after.starts_with('\\') { 2 } else { after.chars().next().map_or(0, char::len_utf8) };
                let end = after.get(skipped..).and_then(|text| text.find('\'')).map_or(0, |at| skipped + at + 1);
                after = after.get(end..).unwrap_or_default();
            }
            _ => code.push(c),
        }
        rest = after;
    }
    let tests = code.find("#[cfg(test)]\nmod ").unwrap_or(code.len());
    code.truncate(tests);
    code
}

/// Returns the position behind the bracket that closes the one at the start of `text`.
fn closing(text: &str) -> usize {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '<' | '(' | '[' | '{' => depth += 1,
            '>' if text[..at].ends_with(['-', '=']) => {}
            '>' | ')' | ']' | '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at + c.len_utf8();
        }
    }
    text.len()
}

/// Returns whether a type contains a tuple of two or more types. The arguments of a closure are no tuple.
fn has_tuple(kind: &str) -> bool {
    let mut at = 0;
    while let Some(next) = kind[at..].find('(') {
        let open = at + next;
        let inner = &kind[open..open + closing(&kind[open..])];
        let is_call = ["fn", "Fn", "FnMut", "FnOnce"].iter().any(|word| {
            kind[..open].ends_with(word) && !kind[..open - word.len()].ends_with(|c: char| c.is_alphanumeric())
        });
        if is_call {
            at = open + inner.len();
            continue;
        }
        let mut depth = 0;
        let mut commas = inner.char_indices().filter(|&(at, c)| {
            match c {
                '<' | '(' | '[' => depth += 1,
                '>' if inner[..at].ends_with('-') => {}
                '>' | ')' | ']' => depth -= 1,
                _ => {}
            }
            depth == 1 && c == ',' && !inner[at + 1..].trim_start().starts_with(')')
        });
        if commas.next().is_some() {
            return true;
        }
        at = open + 1;
    }
    false
}

/// Returns the names of the functions and type aliases of a source whose types contain tuples.
fn names_with_tuples(source: &str) -> Vec<String> {
    let code = code_of(source);
    let mut found = Vec::new();
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    for (at, word) in code.match_indices("fn ").chain(code.match_indices("type ")) {
        if code[..at].ends_with(is_word) {
            continue;
        }
        let rest = &code[at + word.len()..];
        let name = &rest[..rest.find(|c| !is_word(c)).unwrap_or(rest.len())];
        let mut behind = &rest[name.len()..];
        if name.is_empty() || !behind.starts_with(['(', '<', ' ']) {
            continue;
        }
        if word == "type " {
            let alias =
                behind.split_once(" = ").and_then(|(before, _)| (!before.contains(['{', ';'])).then_some(before));
            let Some(before) = alias else { continue };
            let kind = &behind[before.len() + 3..];
            let mut depth = 0;
            let end = kind.find(|c| {
                depth += i32::from("([{".contains(c)) - i32::from(")]}".contains(c));
                c == ';' && depth == 0
            });
            if has_tuple(&kind[..end.unwrap_or(kind.len())]) {
                found.push(name.to_owned());
            }
            continue;
        }
        if behind.starts_with('<') {
            behind = &behind[closing(behind)..];
        }
        if !behind.starts_with('(') {
            continue;
        }
        let arguments = &behind[..closing(behind)];
        // The types of the arguments are behind their patterns.
        let mut pieces = arguments[1..arguments.len() - 1].to_owned();
        let mut has = false;
        while let Some(colon) = pieces.find(": ") {
            let kind = pieces[colon + 2..].to_owned();
            let mut depth = 0;
            let end = kind.char_indices().find(|&(at, c)| {
                match c {
                    '<' | '(' | '[' => depth += 1,
                    '>' if kind[..at].ends_with('-') => {}
                    '>' | ')' | ']' => depth -= 1,
                    _ => {}
                }
                depth == 0 && c == ','
            });
            let end = end.map_or(kind.len(), |(at, _)| at);
            has |= has_tuple(&kind[..end]);
            pieces = kind[end..].to_owned();
        }
        let result = &behind[arguments.len()..];
        let mut depth = 0;
        let end = result.find(|c| {
            depth += i32::from("([".contains(c)) - i32::from(")]".contains(c));
            depth == 0 && (c == '{' || c == ';')
        });
        let result = &result[..end.unwrap_or(result.len())];
        has |= has_tuple(result.split("where").next().unwrap_or_default());
        if has {
            found.push(name.to_owned());
        }
    }
    found
}

/// A reader of a call or a signature sees what each value is.
#[test]
fn signatures_have_no_anonymous_tuples() {
    for (source, wanted) in [
        ("fn a(x: (u8, u8)) {}", true),
        ("fn a() -> Option<(u8, &'static str)> {}", true),
        ("pub fn a(x: u8) -> impl Iterator<Item = (u8, u8)> {}", true),
        ("fn a<'a>((x, y): (u8, &'a str)) {}", true),
        ("type A<'a> = (u8, [u8; 4]);", true),
        ("fn a(x: impl Fn(u8, u8) -> u8, y: &mut dyn FnMut((u8, u8))) -> (u8) {}", false),
        ("fn a(x: u8) -> Result<(), u8> {\n    let b: (u8, u8) = (1, ',' as u8);\n}", false),
        ("// fn a(x: (u8, u8))\nfn a() { f(\"fn a(x: (u8, u8))\") }", false),
        ("fn a() {}\n#[cfg(test)]\nmod tests { fn b(x: (u8, u8)) {} }", false),
    ] {
        assert_eq!(!names_with_tuples(source).is_empty(), wanted, "{source}");
    }
    let mut wrong = Vec::new();
    for (name, dir) in crates() {
        let mut files = Vec::new();
        rust_files(&dir.join("src"), &mut files);
        files.retain(|file| !file.to_string_lossy().contains("tests"));
        let mut found = Vec::new();
        for file in files {
            let source = fs::read_to_string(&file).expect("source");
            let names = names_with_tuples(&source).into_iter();
            let place = file.strip_prefix(root()).unwrap_or(&file).display().to_string();
            let names = names.filter(|name| !MAY_HAVE_TUPLES.iter().any(|(known, _)| known == name));
            found.extend(names.map(|name| format!("{place}: {name}")));
        }
        let known = STILL_WITH_TUPLES.iter().find(|(known, _)| *known == name).map_or(0, |(_, count)| *count);
        if found.len() > known {
            wrong.push(format!("{name}: {} instead of {known}: name the parts in a struct: {found:#?}", found.len()));
        } else if found.len() < known {
            wrong.push(format!("{name}: {} instead of {known}: write the smaller number here", found.len()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Returns whether a line begins an item or field that other files of its crate may use, but no other crate.
fn is_shared_in_crate(line: &str) -> bool {
    let line = line.trim_start();
    let rest = line.strip_prefix("pub(").and_then(|rest| rest.split_once(") ")).map(|(_, rest)| rest);
    // `$` is in the text of a macro.
    rest.is_some_and(|rest| {
        !["use ", "mod ", "extern "].iter().any(|word| rest.starts_with(word)) && !line.contains('$')
    })
}

/// What several files use has a description where it is defined, as public items have (`missing_docs`).
#[test]
fn items_that_other_files_use_have_documentation() {
    assert!(is_shared_in_crate("    pub(super) fn a() {}") && is_shared_in_crate("pub(in crate::a) a: u8,"));
    assert!(!is_shared_in_crate("pub(crate) use a::b;") && !is_shared_in_crate("pub fn a() {}"));
    let mut wrong = Vec::new();
    for (_, dir) in crates() {
        let mut files = Vec::new();
        rust_files(&dir.join("src"), &mut files);
        for file in files {
            let source = fs::read_to_string(&file).expect("source");
            let lines: Vec<&str> = source.lines().take_while(|line| *line != "#[cfg(test)]").collect();
            for (n, line) in lines.iter().enumerate().filter(|(_, line)| is_shared_in_crate(line)) {
                // Attributes, also over several lines, are between an item and its description.
                let mut before = lines[..n].iter().rev().map(|line| line.trim()).peekable();
                while before.peek().is_some_and(|line| line.ends_with(']') && !line.starts_with("//")) {
                    while before.next().is_some_and(|line| !line.starts_with("#[")) {}
                }
                if !before.next().is_some_and(|line| line.starts_with("///")) {
                    wrong.push(format!("{}:{}: {}", file.display(), n + 1, line.trim()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{} items without documentation:\n{}", wrong.len(), wrong.join("\n"));
}
