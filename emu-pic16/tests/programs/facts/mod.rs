//! The table of facts in `docs/chips/pic16f873.md`: every answer of ours is found by a small program on the machine, and is
//! what was worked out from the data sheet; the page has the same answer.
//!
//! `core.txt` and `parts.txt` have a fact a block:
//!
//! - `== fact`: the first cell of its line in the table;
//! - `each a b c`: the program is run once for each, which stands for `$` in what follows;
//! - a program, as [`crate::script`] has it: directives and instructions;
//! - `watch REG.3`: notes when the bit changes;
//! - `show TEXT`: what the run gives, in which `{..}` is one of `{20}`, `{TMR0}`, `{eeprom:3}` (a byte at the end, decimal),
//!   `{20h}` (the same hexadecimal), `{W}`, `{cycles A B}`, `{clocks A B}`, `{ms A B}` (between two moments), `{seen A}` (how often), `{end}`
//!   (why it ends), `{level RB0}`. A moment is a cycle (`20.3`: with its clock), a label (`isr#2`: the second time that the program comes there),
//!   `RB0#1` (an edge) or `REG.3#1` (a change of a watched bit);
//! - `want TEXT`: the answer of the data sheet; behind the answers of several runs, with spaces between them.

mod read;
mod rig;

const TEXT: &str = concat!(include_str!("core.txt"), "\n", include_str!("parts.txt"));
const PAGE: &str = include_str!("../../../../docs/chips/pic16f873.md");

/// The lines of the table of facts: cells by line.
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
