//! What differs between the external interrupts of the family, and the registers that they share.

/// The registers, in the layout of ATmega48 to 328 and, for INT4 to INT7, ATmega64 and 128. Other chips have the same bits
/// elsewhere: ISC of INT0 and INT1 in MCUCR, EIMSK in GIMSK or GICR, EIFR in GIFR.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExternalRegister {
    /// ISCn1 and ISCn0 of INT0 to INT3, two bits each. ISC2 of ATmega16, 32 and 162 is bit 4, ISC20; bit 5 reads 0.
    EICRA,
    /// The same of INT4 to INT7.
    EICRB,
    /// Bit `n` enables INT`n`.
    EIMSK,
    /// Bit `n` is INTF`n`.
    EIFR,
    /// Bit `n` is PCIE`n`.
    PCICR,
    /// Bit `n` is PCIF`n`.
    PCIFR,
    /// Which of PCINT0 to PCINT7 count.
    PCMSK0,
    /// Which of PCINT8 to PCINT15 count.
    PCMSK1,
    /// Which of PCINT16 to PCINT23 count.
    PCMSK2,
    /// Which of PCINT24 to PCINT31 count.
    PCMSK3,
}

/// What differs between the external interrupts of the family: one of the constants. The inputs INT and the groups of pins
/// together are never more than eight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExternalKind {
    /// Number of inputs INT.
    pub(super) ints: u8,
    /// Inputs whose edges are registered without a clock, and that cannot look for any change.
    pub(super) asynchronous: u8,
    /// Those of them that have ISCn0 alone: falling or rising edge, no level.
    pub(super) edge_only: u8,
    /// Edges that are looked for with a clock set their flag, and so wake, while the clock stands: silicon against its sheet.
    pub edges_wake: bool,
    /// The bits of PCMSK0 to PCMSK3 that there are; a group without any does not exist.
    pub(super) masks: [u8; 4],
}

impl ExternalKind {
    /// The first ATmega48, 88 and 168 (Atmel 2545, external interrupts): interrupts 0 and 1 are INT0 and INT1, 2 to 4 PCINT0 to
    /// PCINT2.
    pub const MEGA48: ExternalKind =
        ExternalKind { ints: 2, asynchronous: 0, edge_only: 0, edges_wake: false, masks: [0xFF, 0x7F, 0xFF, 0] };
    /// ATmega328 and 328P, and the A, P and PA variants of the others (DS40002061, 13). That only a level wakes, note 3 of table
    /// 10-1, is a fault of the sheet: boards wake by any edge, and the maker has confirmed it.
    pub const MEGA328: ExternalKind = ExternalKind { edges_wake: true, ..ExternalKind::MEGA48 };
    /// ATmega8 (Atmel 2486, external interrupts): INT0 and INT1.
    pub const MEGA8: ExternalKind = ExternalKind { masks: [0; 4], ..ExternalKind::MEGA48 };
    /// ATmega16 and 32 (Atmel 2466 and 2503, external interrupts): INT0 to INT2.
    pub const MEGA16: ExternalKind = ExternalKind { ints: 3, asynchronous: 4, edge_only: 4, ..ExternalKind::MEGA8 };
    /// ATmega162 (Atmel 2513, external interrupts): interrupts 0 to 2 are INT0 to INT2, 3 and 4 PCINT0 and PCINT1.
    pub const MEGA162: ExternalKind = ExternalKind { masks: [0xFF, 0xFF, 0, 0], ..ExternalKind::MEGA16 };
    /// ATmega64 and 128 (Atmel 2490 and 2467, external interrupts): INT0 to INT7.
    pub const MEGA128: ExternalKind = ExternalKind { ints: 8, asynchronous: 0x0F, ..ExternalKind::MEGA8 };

    /// The inputs INT that there are, a bit for each.
    #[must_use]
    pub const fn int_mask(&self) -> u8 {
        ((1u16 << self.ints) - 1) as u8
    }

    /// The bits of EICRA that exist on chips where it is a register of its own: ISCn1 and ISCn0 of INT0 to INT3.
    #[must_use]
    pub const fn sense_mask(&self) -> u8 {
        ((1u16 << (2 * if self.ints > 4 { 4 } else { self.ints })) - 1) as u8
    }

    /// The bits of PCMSK0 to PCMSK3 that there are, by number.
    #[must_use]
    pub fn group_mask(&self, group: usize) -> u8 {
        self.masks.get(group).copied().unwrap_or(0)
    }

    /// The groups of pins that there are, a bit for each.
    pub(super) fn groups(&self) -> u8 {
        super::groups_matching(|group| self.masks[group] != 0)
    }
}
