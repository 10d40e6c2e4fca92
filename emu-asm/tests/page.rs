//! Checks docs/formats/asm.md: its examples assemble, and it describes every directive.

mod common;

use common::{chip, chips};

fn page() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/formats/asm.md")).expect("the page")
}

#[test]
fn its_examples_assemble() {
    let page = page();
    let named = |head: &str| chip(head).unwrap_or_else(|| panic!("no chip {head}"));
    let mut families = std::collections::BTreeSet::new();
    for example in page.split("```asm ").skip(1) {
        let (head, rest) = example.split_once('\n').expect("an example has lines");
        let text = rest.split("```").next().expect("an example ends");
        let image = emu_asm::assemble_text(named(head), text).unwrap_or_else(|e| panic!("{head}:\n{text}\n{e}"));
        assert!(!image.segments.is_empty(), "{head}: {text}");
        families.insert(format!("{:?}", named(head).family));
    }
    assert!(families.len() >= 3, "{families:?}");
}

#[test]
fn the_page_lists_every_directive() {
    let page = page();
    let words: std::collections::BTreeSet<&str> =
        page.split(|c: char| !c.is_ascii_alphanumeric() && !"_$=".contains(c)).collect();
    let known = |name: &str| words.contains(name) || page.contains(&format!("`{name}`"));
    let mut missing = std::collections::BTreeSet::new();
    for chip in chips() {
        let names =
            emu_asm::directive_names(chip).into_iter().filter(|name| !known(name) && !known(&name.to_uppercase()));
        missing.extend(names.map(|name| format!("{:?}: {name}", chip.family)));
    }
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn codes_are_in_order_and_explained() {
    for pair in emu_asm::CODES.windows(2) {
        assert!(pair[0].code < pair[1].code, "{} and {}", pair[0].code, pair[1].code);
    }
    assert!(emu_asm::CODES.iter().all(|code| code.code.starts_with("ASM") && code.explain.len() > 40));
}
