//! The ELF file of a program built by avr-gcc, and the HEX file that avr-objcopy makes from it, give the same
//! flash.

use emu_core::image::{ImageSpace, load};
use emu_test_support::{run_tool, test_folder};

use crate::AVR;
use crate::elf::MEMORIES;

const SOURCE: &str = "
#include <avr/io.h>
#include <avr/eeprom.h>
volatile char text[5] = \"abcd\";
uint8_t cells[3] EEMEM = {1, 2, 3};
int counter[10];
const char tag[3] __attribute__((section(\".tag\"), used)) = \"ab\";
int main(void) {
    PORTB = text[1];
    eeprom_read_byte(cells);
    counter[1] = PINB;
    for (;;) {}
}
";

#[test]
#[ignore = "needs avr-gcc"]
fn elf_and_objcopy_agree() {
    let folder = test_folder!("image-avr-gcc");
    std::fs::write(folder.join("a.c"), SOURCE).unwrap();
    run_tool("avr-gcc", &["-mmcu=atmega328p", "-Os", "a.c", "-o", "a.elf"], &folder);
    run_tool("avr-objcopy", &["-O", "ihex", "-R", ".eeprom", "a.elf", "flash.hex"], &folder);
    run_tool("avr-objcopy", &["-O", "ihex", "a.elf", "all.hex"], &folder);
    run_tool("avr-objcopy", &["-O", "ihex", "-j", ".eeprom", "a.elf", "eeprom.hex"], &folder);
    let get = |name: &str, hex: &[ImageSpace]| {
        let bytes = std::fs::read(folder.join(name)).unwrap();
        load(name, &bytes, hex, MEMORIES, AVR).unwrap_or_else(|e| panic!("{name}: {e:?}")).image
    };
    let elf = get("a.elf", &[]);
    let flash = get("flash.hex", &MEMORIES[..1]);
    // In its HEX file the EEPROM starts at 0x810000, as in the ELF file.
    let eeprom = get("eeprom.hex", &MEMORIES[2..]);
    // All memories in one file, as avr-objcopy writes it without flags: each memory is at its ELF address.
    let all = get("all.hex", &MEMORIES[..1]);
    assert_eq!(all.segments, elf.segments);
    assert!(elf.end("flash") > 100);
    assert_eq!(elf.bytes_in("flash").collect::<Vec<_>>(), flash.bytes_in("flash").collect::<Vec<_>>());
    assert_eq!(elf.bytes_in("eeprom").map(|one| (one.addr, one.byte)).collect::<Vec<_>>(), [(0, 1), (1, 2), (2, 3)]);
    assert_eq!(elf.bytes_in("eeprom").collect::<Vec<_>>(), eeprom.bytes_in("eeprom").collect::<Vec<_>>());
    assert_eq!(elf.bytes_in("data").count(), 0);
    let find = |name: &str| elf.symbols.iter().find(|s| s.name == name).map(|s| (s.space, s.size));
    assert_eq!(find("text"), Some(("data", 5)));
    assert_eq!(find("counter"), Some(("data", 20)));
    assert_eq!(find("cells"), Some(("eeprom", 3)));
    assert!(matches!(find("main"), Some(("flash", 1..))));

    run_tool("avr-gcc", &["-mmcu=atmega328p", "-Os", "-c", "a.c", "-o", "a.o"], &folder);
    let object = std::fs::read(folder.join("a.o")).unwrap();
    let found = load("a.o", &object, &[], MEMORIES, AVR).unwrap_err();
    assert_eq!(found.iter().map(|d| d.code).collect::<Vec<_>>(), ["ELF005"]);
}
