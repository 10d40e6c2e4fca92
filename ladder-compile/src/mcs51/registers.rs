//! Finds special function registers and their bits by their data-sheet names.

use emu_core::chip::Chip;

/// A bit of a byte or of a register.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ByteBit {
    /// Address of the byte.
    pub byte: u8,
    /// Bit number, 0 to 7.
    pub bit: u8,
}

/// Registers of a chip.
#[derive(Debug, Clone, Copy)]
pub struct Mcs51Registers(pub &'static Chip);

/// Address of the accumulator ACC, which every chip has; its bits are addressable.
pub const ACC: i32 = 0xE0;
/// Address of B.
pub const B: i32 = 0xF0;
/// Address of DPL; DPH follows it.
pub const DPL: i32 = 0x82;
/// Bit address of the user flag F0 in PSW, which saves the rung state while the carry is in use.
pub const F0: i32 = 0xD5;
/// Bit address of PSW.1, a user bit, which holds the sign of a quotient.
pub const SIGN: i32 = 0xD1;
/// Bit address of the overflow flag.
pub const OV: i32 = 0xD2;

impl Mcs51Registers {
    /// Address of a register by name.
    #[must_use]
    pub fn byte(self, name: &str) -> i32 {
        self.0.reg(name).map_or(0, i32::from)
    }

    /// Bit address of a bit by name.
    #[must_use]
    pub fn bit(self, name: &str) -> i32 {
        self.0.bit(name).map_or(0, i32::from)
    }

    /// Mask of a bit in its register.
    #[must_use]
    pub fn mask(self, name: &str) -> i32 {
        1 << (self.bit(name) & 7)
    }

    /// True if the chip has timer 2.
    #[must_use]
    pub fn has_timer2(self) -> bool {
        self.0.reg("RCAP2L").is_some()
    }

    /// Port register and bit number of a pin such as `P1.0`.
    #[must_use]
    pub fn pin(self, pin: &str) -> ByteBit {
        let at = self.bit(pin) as u8;
        ByteBit { byte: at & 0xF8, bit: at & 7 }
    }
}
