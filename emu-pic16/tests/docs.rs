//! The page of instructions matches the table. `EMU_BLESS=1 cargo test -p plcemu-pic16 --test docs` writes it
//! again.

use emu_test_support::assert_file;

#[test]
fn the_page_of_instructions_is_the_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/isa/pic16.md");
    let mut page = String::from(
        "# Instructions of the mid-range PIC16\n\nRead off the table in `emu-pic16/src/isa.rs`. In the column of bits a letter is a bit \
         of that operand, a stroke one that\nmay be either, as is a plus, which assemblers write as 1; cycles are instruction cycles of 4 clocks, `1/2` where a skip takes a second \
         one. Any instruction with PCL\nas its target takes one cycle more. Flags are C, DC (D) and Z of STATUS. Addresses of file \
         registers may be written with\ntheir bank (`0x86`); the instruction has the lower seven bits. Source: Microchip PICmicro \
         Mid-Range MCU Family Reference\nManual, DS33023, section 29.\n\n",
    );
    page.push_str(&emu_core::table::instruction_list_markdown(emu_pic16::isa::ROWS));
    assert_file(path, &page);
}
