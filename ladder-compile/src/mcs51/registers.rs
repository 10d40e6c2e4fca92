//! Special function registers and their bits by the names of the data sheet.

use emu_core::chip::Chip;

/// The registers of a chip.
#[derive(Debug, Clone, Copy)]
pub struct Mcs51Registers(pub &'static Chip);

/// The accumulator's address (every chip has it): its bits are reached one by one.
pub const ACC: i32 = 0xE0;
/// Address of B.
pub const B: i32 = 0xF0;
/// Address of DPL; DPH follows.
pub const DPL: i32 = 0x82;
/// Bit address of the user flag F0 in PSW, in which the rung state waits while the carry works.
pub const F0: i32 = 0xD5;
/// Bit address of PSW.1, a bit of the program's own, in which the sign of a quotient waits.
pub const SIGN: i32 = 0xD1;
/// Bit address of the overflow flag.
pub const OV: i32 = 0xD2;

impl Mcs51Registers {
    /// Address of a register.
    #[must_use]
    pub fn byte(self, name: &str) -> i32 {
        self.0.reg(name).map_or(0, i32::from)
    }

    /// Address of a bit.
    #[must_use]
    pub fn bit(self, name: &str) -> i32 {
        self.0.bit(name).map_or(0, i32::from)
    }

    /// The bit as a mask in its register.
    #[must_use]
    pub fn mask(self, name: &str) -> i32 {
        1 << (self.bit(name) & 7)
    }

    /// The chip has a timer 2.
    #[must_use]
    pub fn has_timer2(self) -> bool {
        self.0.reg("RCAP2L").is_some()
    }

    /// Port register and bit of a pin such as `P1.0`.
    #[must_use]
    pub fn pin(self, pin: &str) -> (u8, u8) {
        let at = self.bit(pin) as u8;
        (at & 0xF8, at & 7)
    }
}
