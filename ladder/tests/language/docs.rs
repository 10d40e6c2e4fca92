//! Tests that the page on the language lists every diagnostic and every element.

use std::collections::BTreeSet;

const PAGE: &str = include_str!("../../../docs/languages/ldmicro.md");

#[test]
fn the_page_lists_every_code_with_its_title() {
    let missing: Vec<String> = ladder::CODES
        .iter()
        .map(|c| format!("| {} | {} |", c.code, c.title))
        .filter(|row| !PAGE.contains(row.as_str()))
        .collect();
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn the_page_lists_every_element() {
    let missing: Vec<&str> =
        ladder::element_keywords().filter(|keyword| !PAGE.contains(&format!("`{keyword}"))).collect();
    assert!(missing.is_empty(), "docs/languages/ldmicro.md has no row for {}", missing.join(", "));
}

#[test]
fn the_page_on_meaning_names_every_element() {
    let page = include_str!("../../../docs/semantics.md");
    let words: BTreeSet<&str> = page.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
    let missing: Vec<&str> = ladder::element_keywords().filter(|keyword| !words.contains(keyword)).collect();
    assert!(missing.is_empty(), "docs/semantics.md does not define {}", missing.join(", "));
}

#[test]
fn the_program_on_the_page_is_drawn_as_on_the_page() {
    let blocks: Vec<&str> = PAGE.split("```\n").skip(1).step_by(2).collect();
    let [program, drawing] = blocks.as_slice() else { panic!("two blocks") };
    let program = ladder::parse("page", program).expect("reads").program;
    assert!(ladder::check(&program).is_empty());
    assert_eq!(ladder::draw_rung(&program, 0).lines.join("\n"), drawing.trim_end());
}
