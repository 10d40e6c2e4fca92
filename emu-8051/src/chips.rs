//! The chips of the family, one row each.

use emu_core::chip::Chip;

/// Timer 2 of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timer2 {
    /// There is none.
    None,
    /// As in the 8052: capture, reload, baud generator; no T2MOD.
    Nmos,
    /// With T2MOD: counts down (DCEN) and gives a clock out (T2OE).
    Full,
}

/// What a chip of the family has beyond the row that every chip has.
#[derive(Debug)]
pub struct Part {
    /// The row that every chip has.
    pub chip: Chip,
    /// Bytes of RAM on the chip: 128 or 256.
    pub iram: u16,
    /// Bytes of program memory on the chip; 0 where it must be outside (8031, 8032).
    pub internal: u32,
    /// CMOS: PCON has idle and power-down (user's manual, "Power-saving modes of operation").
    pub cmos: bool,
    /// Timer 2.
    pub timer2: Timer2,
    /// Has an external bus: P0, P2, EA. Without it there is no XDATA and no program memory outside.
    pub bus: bool,
    /// Has what the AT89S parts add: watchdog, AUXR, AUXR1 with the second data pointer, power-off flag, wake from
    /// power-down by an interrupt.
    pub at89s: bool,
    /// Has the analog comparator on P1.0 and P1.1 with its output at P3.6.
    pub comparator: bool,
    /// Can run at 6 clocks a machine cycle.
    pub x2: bool,
}
