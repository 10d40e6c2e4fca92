//! The registers of the internal oscillator: writable bits, and the read values of the others.

use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_pic16::{Pic16, chips};

/// Chip, register, written value, read value (DS39598, registers 4-1 and 4-2; DS30487, registers 4-1 and
/// 4-2). IOFS reads 1: oscillators are stable at once. OSTS reads 1 while SCS selects the primary clock.
const CASES: &str = "
    pic16f818 OSCCON  00 04
    pic16f818 OSCCON  FF 74
    pic16f819 OSCCON  8B 04
    pic16f819 OSCCON  60 64
    pic16f819 OSCTUNE FF 3F
    pic16f819 OSCTUNE C0 00
    pic16f87  OSCCON  00 0C
    pic16f87  OSCCON  FC 7C
    pic16f88  OSCCON  FF 77
    pic16f88  OSCCON  72 76
    pic16f88  OSCCON  01 05
    pic16f88  OSCTUNE FF 3F
";

#[test]
fn registers_keep_what_they_have() {
    for line in CASES.lines().map(str::trim).filter(|line| !line.is_empty()) {
        let cells: Vec<&str> = line.split_whitespace().collect();
        let chip = &chips::part(cells[0]).unwrap().chip;
        let hex = |text: &str| u8::from_str_radix(text, 16).unwrap();
        let mut cpu = Pic16::new(chip, &Image::default(), RamInit::Zero);
        let addr = chip.reg(cells[1]).unwrap().into();
        assert!(cpu.poke(chip.reg_space, addr, hex(cells[2])), "{line}");
        assert_eq!(cpu.peek(chip.reg_space, addr), Some(hex(cells[3])), "{line}");
    }
}
