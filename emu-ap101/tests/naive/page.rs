//! The programs in `docs/chips/ap101.md` have the results that the page gives.

use super::core::Core;
use super::machine::Naive;
use super::script::{Case, Subject};

const PAGE: &str = include_str!("../../../docs/chips/ap101.md");

/// Each program of the page, with the line below it.
pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    for part in PAGE.split("\n```asm\n").skip(1) {
        let (source, rest) = part.split_once("\n```\n").expect("the end of a program");
        let found = rest.trim_start().lines().next().and_then(|line| line.strip_prefix("Found: `"));
        let found = found.and_then(|line| line.strip_suffix('`')).unwrap_or_else(|| panic!("nothing found:\n{source}"));
        let items = found.split(';').map(|item| item.trim().to_string()).collect();
        all.push(Case { name: "page".to_string(), source: format!("{source}\n"), items });
    }
    all
}

fn check<S: Subject>() {
    for case in cases() {
        if let Err(fault) = case.check::<S>() {
            panic!("{}{}\n{fault}", case.source, case.items.join(" ; "));
        }
    }
}

#[test]
fn programs_of_the_page_do_what_it_says() {
    assert!(cases().len() >= 7, "programs of the page are missing");
    check::<Naive>();
    check::<Core>();
}

#[test]
fn rules_that_are_cited_are_on_the_page() {
    let (_, rules) = PAGE.split_once("\n## Rules\n").expect("the rules");
    let sources = [
        include_str!("machine.rs"),
        include_str!("machine/execute.rs"),
        include_str!("modules.rs"),
        include_str!("config.rs"),
        include_str!("decode.rs"),
        include_str!("asm.rs"),
    ];
    let mut cited = 0;
    for part in sources.iter().flat_map(|source| source.split("ule ").skip(1)) {
        let number: String = part.chars().take_while(char::is_ascii_digit).collect();
        if !number.is_empty() {
            assert!(rules.contains(&format!("\n{number}. ")), "rule {number}");
            cited += 1;
        }
    }
    assert!(cited > 20, "{cited} rules are cited");
}
