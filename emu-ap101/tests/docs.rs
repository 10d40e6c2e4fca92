//! Checks that the page of instructions agrees with the table.
//! `EMU_BLESS=1 cargo test -p plcemu-ap101 --test docs` writes the page again.

use emu_test_support::assert_file;

#[test]
fn the_page_of_instructions_is_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/isa/ap101.md");
    let mut page = String::from(
        "# Instructions of AP101\n\nRead off the table in `emu-ap101/src/isa.rs`. In the column of bits a letter is a bit of that \
         operand, a stroke one that may be\neither; cycles are machine cycles of 2 clocks. The column of flags says which instructions \
         write A. An address `a` is a zone and\na number: `I1`, `E1`, `R1`, `M1`; a target `t` is a word address. With `,X` the address is \
         relative to the index register.\n`M256` and on are the images of outputs; `R128` and on the running bits of modules, `R256` and \
         on their preset ports.\n\n",
    );
    page.push_str(&emu_core::table::instruction_list_markdown(emu_ap101::isa::ROWS));
    assert_file(path, &page);
}
