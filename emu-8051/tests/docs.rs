//! Checks that the page of instructions agrees with the table.
//! `EMU_BLESS=1 cargo test -p plcemu-8051 --test docs` writes the page again.

use emu_core::table::SyntaxAlias;
use emu_test_support::assert_file;

#[test]
fn the_page_of_instructions_is_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/isa/8051.md");
    let mut page = String::from(
        "# Instructions of the MCS-51 (8051, 8052 and their kin)\n\nRead off the table in `emu-8051/src/isa.rs`. In the column of bits a \
         letter is a bit of that operand; cycles are\nmachine cycles of 12 clocks, the same whether a jump is taken or not; flags are \
         CY, AC (A) and OV (O). P always is the\nparity of A. A5h is not an instruction. Source: Intel MCS 51 Microcontroller Family User's \
         Manual 272383.\n\n",
    );
    page.push_str(&emu_core::table::instruction_list_markdown(emu_8051::isa::ROWS));
    page.push_str("\nOther spellings that the assembler takes:\n\n| written | means |\n|---|---|\n");
    for SyntaxAlias { mnemonic: name, syntax, row_mnemonic: target, row_operands: text } in emu_8051::isa::ALIASES {
        page.push_str(&format!("| `{name} {syntax}` | `{target} {}` |\n", text.replace(',', ", ")));
    }
    assert_file(path, &page);
}
