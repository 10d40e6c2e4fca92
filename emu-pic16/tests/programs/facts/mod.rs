//! The table of facts in `docs/chips/pic16f873.md`: a small program on the machine measures every answer of
//! `emu`, which must equal the one derived from the data sheet; the page must have the same answer.
//!
//! `core.txt` and `parts.txt` have one fact per block:
//!
//! - `== fact`: the first cell of its line in the table;
//! - `each a b c`: the program runs once for each value, which replaces `$` in what follows;
//! - a program in the format of [`crate::script`]: directives and instructions;
//! - `watch REG.3`: records when the bit changes;
//! - `show TEXT`: the result of the run, in which `{..}` is one of `{20}`, `{TMR0}`, `{eeprom:3}` (a byte at
//!   the end, decimal), `{20h}` (the same in hexadecimal), `{W}`, `{cycles A B}`, `{clocks A B}`, `{ms A B}`
//!   (between two moments), `{seen A}` (number of occurrences), `{end}` (why it ends), `{level RB0}`. A
//!   moment is a cycle (`20.3`: with its clock), a label (`isr#2`: the second time that the program reaches
//!   it), `RB0#1` (an edge) or `REG.3#1` (a change of a watched bit);
//! - `want TEXT`: the answer of the data sheet; the answers of several runs, separated by spaces.

mod read;
mod rig;

const TEXT: &str = concat!(include_str!("core.txt"), "\n", include_str!("parts.txt"));
const PAGE: &str = include_str!("../../../../docs/chips/pic16f873.md");

/// Returns the lines of the table of facts, as cells.
fn table() -> Vec<Vec<&'static str>> {
    let from = PAGE.split("\n## Facts").nth(1).expect("the page has a table of facts");
    from.lines()
        .skip_while(|line| !line.starts_with("|---"))
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect()
}

#[test]
fn the_machine_does_what_the_sheets_say() {
    let facts = read::facts(TEXT);
    assert!(facts.len() >= 35, "only {} facts", facts.len());
    let mut wrong = Vec::new();
    for fact in &facts {
        let shown: Vec<String> = fact.runs.iter().map(rig::shown).collect();
        if shown.join(" ") != fact.want {
            wrong.push(format!("{}: {}, wanted {}", fact.name, shown.join(" "), fact.want));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_page_has_these_facts() {
    let facts = read::facts(TEXT);
    let ours: Vec<(&str, &str)> = facts.iter().map(|fact| (fact.name.as_str(), fact.want.as_str())).collect();
    let page: Vec<(&str, &str)> = table().iter().map(|cells| (cells[0], cells[2])).collect();
    for (ours, page) in ours.iter().zip(&page) {
        assert_eq!(ours, page);
    }
    assert_eq!(ours.len(), page.len());
}
