//! Every sentence of the reference about what the machine or its language does has a number in
//! `sentences.txt`, and every number has tests that exist.

use std::path::Path;

use emu_test_support::case_lines;

const LIST: &str = include_str!("sentences.txt");

const PROGRAMS: [&str; 4] = [
    include_str!("programs/logic.txt"),
    include_str!("programs/outputs.txt"),
    include_str!("programs/jumps.txt"),
    include_str!("programs/modules.txt"),
];

/// Number, words by which to find it, contents, tests.
struct Row<'a> {
    number: usize,
    words: &'a str,
    says: &'a str,
    tests: Vec<&'a str>,
}

fn rows() -> impl Iterator<Item = Row<'static>> {
    case_lines(LIST).map(|line| {
        let parts: Vec<&str> = line.split(" | ").map(str::trim).collect();
        let [number, words, says, tests] = parts[..] else { panic!("four parts: {line}") };
        let number = number.parse().unwrap_or_else(|_| panic!("a number: {line}"));
        Row { number, words, says, tests: tests.split(" ; ").map(str::trim).collect() }
    })
}

/// Whether a test is in a table of programs, or is a function of a file.
fn exists(test: &str) -> bool {
    let Some((file, function)) = test.split_once("::") else {
        return PROGRAMS.iter().any(|text| text.lines().any(|line| line.strip_prefix("== ") == Some(test)));
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(file);
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let mut lines = text.lines().peekable();
    let mut found = false;
    while let Some(line) = lines.next() {
        let named = lines.peek().is_some_and(|next| next.starts_with(&format!("fn {function}()")));
        found |= line.trim() == "#[test]" && named;
    }
    found
}

#[test]
fn sentences_are_numbered_without_a_gap() {
    for (at, row) in rows().enumerate() {
        assert_eq!(row.number, at + 1, "{}", row.says);
        assert!(!row.says.is_empty(), "{}: says nothing", row.number);
        // Enough words to find the sentence, and no more.
        assert!((1..=4).contains(&row.words.split_whitespace().count()), "{}: {}", row.number, row.words);
    }
    assert!(rows().count() > 50, "the list is cut off");
}

#[test]
fn every_sentence_has_a_test_and_every_test_is_there() {
    let mut faults = Vec::new();
    for row in rows() {
        let missing = row.tests.iter().filter(|test| !exists(test));
        faults.extend(missing.map(|test| format!("{}: no test `{test}`", row.number)));
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(!exists("no such program") && !exists("sentences.rs::exists"), "what is no test is taken for one");
}

#[test]
fn sentences_that_the_model_cites_are_in_the_list() {
    let last = rows().count();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/naive");
    let mut cited = 0;
    for file in ["decode.rs", "machine.rs", "machine/execute.rs"] {
        let text = std::fs::read_to_string(folder.join(file)).expect(file);
        for comment in text.lines().filter_map(|line| line.split_once("//")) {
            for word in comment.1.split(|letter: char| !letter.is_alphanumeric()) {
                if let Some(number) = word.strip_prefix('S').and_then(|rest| rest.parse::<usize>().ok()) {
                    assert!((1..=last).contains(&number), "{}", comment.1);
                    cited += 1;
                }
            }
        }
    }
    assert!(cited > 10, "the model cites {cited} sentences");
}
