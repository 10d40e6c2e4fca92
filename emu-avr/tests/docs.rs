//! The page of instructions is what the table says. `UPDATE=1 cargo test -p emu-avr --test docs` writes it anew.

use std::fs;

#[test]
fn the_page_of_instructions_is_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/isa/avr.md");
    let mut page = String::from(
        "# Instructions of the AVR (ATmega328P)\n\nRead off the table in `emu-avr/src/isa.rs`. In the column of bits a letter is a bit \
         of that operand; several cycle counts\nare those of the outcomes: not taken, taken, taken over an instruction of two \
         words. Source: AVR Instruction Set Manual DS40002198.\n\n",
    );
    page.push_str(&emu_core::table::markdown(emu_avr::isa::ROWS));
    page.push_str("\nOther spellings that the assembler takes:\n\n| written | means |\n|---|---|\n");
    for (name, syntax, target, text) in emu_avr::isa::ALIASES {
        page.push_str(&format!("| `{name} {syntax}` | `{target} {}` |\n", text.replace(',', ", ")));
    }
    if std::env::var_os("UPDATE").is_some() {
        fs::write(path, &page).expect("the page can be written");
    }
    let found = fs::read_to_string(path).unwrap_or_default();
    assert!(found == page, "docs/isa/avr.md is not what the table says; run with UPDATE=1");
}
