//! Finds registers and bits of a chip by their data-sheet names, and emits the shortest access to an address.

use emu_avr::isa::AvrOpKind;
use emu_core::chip::{Chip, NamedConstant};

use super::arch::AvrCodeWriter;
use crate::target::CompileTarget;

/// Register that is always zero, as is [`LOW_ZERO`] below it, except between MUL and the use of its product.
pub const ZERO: i32 = 1;
/// Low register of the pair that is always zero.
pub const LOW_ZERO: i32 = 0;
/// Registers of the left operand and of results, least significant byte first.
pub const A: [i32; 4] = [24, 25, 26, 27];
/// Registers of the right operand, least significant byte first.
pub const B: [i32; 4] = [22, 23, 20, 21];
/// Holds a byte from RAM, or an address.
pub const BYTE: i32 = 18;
/// Holds a mask, a byte of a constant, or the old value of an edge memory.
pub const SCRATCH: i32 = 19;

/// Names of the registers and bits of one chip.
#[derive(Debug, Clone)]
pub struct AvrRegisters {
    /// The chip.
    pub chip: &'static Chip,
    bits: Vec<NamedConstant>,
    /// True if the compiler uses the first of two serial lines.
    uses_first_usart: bool,
}

impl AvrRegisters {
    /// Creates the lookup for the chip of `target`, whose pins select the serial line.
    #[must_use]
    pub fn new(target: &CompileTarget) -> Self {
        let chip = target.chip;
        let first = emu_avr::chips::part(chip.name).and_then(|part| part.transmit_pin(0));
        let uses_first_usart = target.uart.is_some_and(|(transmit, _)| first == Some(transmit));
        AvrRegisters { chip, bits: (chip.constants)(), uses_first_usart }
    }

    /// Data address of a register of the serial line, by its names for the second, the first and an only
    /// line.
    #[must_use]
    pub fn serial(&self, names: &[&str]) -> i32 {
        self.addr(names.get(usize::from(self.uses_first_usart)..).unwrap_or_default())
    }

    /// True if the chip has a register of that name.
    #[must_use]
    pub fn has(&self, name: &str) -> bool {
        self.chip.reg(name).is_some()
    }

    /// Data address of the first of these registers that the chip has; -1, which no instruction can encode,
    /// if it has none.
    #[must_use]
    pub fn addr(&self, names: &[&str]) -> i32 {
        names.iter().find_map(|name| self.chip.reg(name)).map_or(-1, i32::from)
    }

    /// Data address of a register of a port: `PORT`, `DDR` or `PIN` followed by the letter.
    #[must_use]
    pub fn port(&self, register: &str, letter: char) -> i32 {
        self.addr(&[&format!("{register}{letter}")])
    }

    /// Number of the first of these bits that the chip has; -1, which no instruction can encode, if it has
    /// none.
    #[must_use]
    pub fn bit(&self, names: &[&str]) -> i32 {
        let find = |name: &&str| self.bits.iter().find(|NamedConstant { name: known, .. }| known == name);
        names.iter().find_map(find).map_or(-1, |&NamedConstant { value: bit, .. }| bit)
    }

    /// Mask of these bits, each by the first of its names that the chip has.
    #[must_use]
    pub fn mask(&self, bits: &[&[&str]]) -> i32 {
        bits.iter().map(|names| self.bit(names)).filter(|bit| (0..8).contains(bit)).fold(0, |all, bit| all | 1 << bit)
    }
}

/// True if SBI, CBI, SBIC and SBIS reach the data address.
#[must_use]
pub fn is_bit_addressable(addr: i32) -> bool {
    (0x20..0x40).contains(&addr)
}

/// True if IN and OUT reach the data address.
#[must_use]
pub fn is_io(addr: i32) -> bool {
    (0x20..0x60).contains(&addr)
}

/// Emits `reg` := the I/O register at a data address.
pub fn read(asm: &mut AvrCodeWriter, reg: i32, addr: i32) {
    if is_io(addr) { asm.op(AvrOpKind::In, &[reg, addr - 0x20]) } else { asm.op(AvrOpKind::Lds, &[reg, addr]) }
}

/// Emits the I/O register at a data address := `reg`.
pub fn write(asm: &mut AvrCodeWriter, addr: i32, reg: i32) {
    if is_io(addr) { asm.op(AvrOpKind::Out, &[addr - 0x20, reg]) } else { asm.op(AvrOpKind::Sts, &[reg, addr]) }
}

/// Emits the I/O register at a data address := a constant, loaded through `reg`.
pub fn write_constant(asm: &mut AvrCodeWriter, addr: i32, value: i32, reg: i32) {
    let from = if value == 0 { ZERO } else { reg };
    if value != 0 {
        asm.op(AvrOpKind::Ldi, &[reg, value]);
    }
    write(asm, addr, from);
}
