//! Variants of the external interrupts in the AVR family, and their registers.

/// The registers, in the layout of ATmega48 to 328 and, for INT4 to INT7, of ATmega64 and 128. Other chips
/// have the same bits in other registers: ISC of INT0 and INT1 in MCUCR, EIMSK in GIMSK or GICR, EIFR in
/// GIFR.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExternalRegister {
    /// ISCn1 and ISCn0 of INT0 to INT3, two bits each. ISC2 of ATmega16, 32 and 162 is bit 4, ISC20; bit 5
    /// reads 0.
    EICRA,
    /// ISCn1 and ISCn0 of INT4 to INT7, two bits each.
    EICRB,
    /// Bit `n` enables INT`n`.
    EIMSK,
    /// Bit `n` is INTF`n`.
    EIFR,
    /// Bit `n` is PCIE`n`.
    PCICR,
    /// Bit `n` is PCIF`n`.
    PCIFR,
    /// Mask of the enabled pins PCINT0 to PCINT7.
    PCMSK0,
    /// Mask of the enabled pins PCINT8 to PCINT15.
    PCMSK1,
    /// Mask of the enabled pins PCINT16 to PCINT23.
    PCMSK2,
    /// Mask of the enabled pins PCINT24 to PCINT31.
    PCMSK3,
}

/// INT0 to INT2, of which INT2 has only ISC2.
const WITH_INT2: &[ExternalSense] = &[ExternalSense::Clocked, ExternalSense::Clocked, ExternalSense::EdgeWithoutClock];

/// INT0 to INT7, of which the first four need no clock.
const WITH_INT7: &[ExternalSense] = &[
    ExternalSense::WithoutClock,
    ExternalSense::WithoutClock,
    ExternalSense::WithoutClock,
    ExternalSense::WithoutClock,
    ExternalSense::Clocked,
    ExternalSense::Clocked,
    ExternalSense::Clocked,
    ExternalSense::Clocked,
];

/// What an INT input can detect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExternalSense {
    /// ISCn1 and ISCn0: low level, any change, falling or rising edge. Changes need a clock.
    Clocked,
    /// ISCn1 and ISCn0: low level, falling or rising edge. Edges need no clock, and there is no any change.
    WithoutClock,
    /// ISCn0 alone: falling or rising edge, without a clock and without a level.
    EdgeWithoutClock,
}

/// Variant of the external interrupts of a chip: one of the constants. INT inputs and pin groups together are
/// at most eight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ExternalKind {
    /// What each INT input can detect, INT0 first.
    senses: &'static [ExternalSense],
    /// Number of INT inputs.
    pub(super) ints: u8,
    /// Mask of the inputs whose edges are detected without a clock, and which cannot detect any change.
    pub(super) asynchronous: u8,
    /// Mask of the asynchronous inputs that have only ISCn0: falling or rising edge, no level.
    pub(super) edge_only: u8,
    /// True if clocked edges set their flag, and so wake the core, while the clock is stopped: the silicon
    /// differs from its data sheet.
    pub edges_wake: bool,
    /// True if the data sheet itself says that these edges wake the core.
    pub(super) wake_by_sheet: bool,
    /// Existing bits of PCMSK0 to PCMSK3; a group without bits does not exist.
    pub(super) masks: [u8; 4],
}

impl ExternalKind {
    /// The first ATmega48, 88 and 168 (Atmel 2545, external interrupts): interrupts 0 and 1 are INT0 and
    /// INT1, 2 to 4 PCINT0 to PCINT2.
    pub const MEGA48: ExternalKind = ExternalKind::new(&[ExternalSense::Clocked; 2], [0xFF, 0x7F, 0xFF, 0]);
    /// ATmega328 and 328P, and the A, P and PA variants of the others (DS40002061, 13). Note 3 of table 10-1,
    /// that only a level wakes the core, is an error in the data sheet: boards wake on any edge, and the
    /// manufacturer has confirmed it.
    pub const MEGA328: ExternalKind = ExternalKind { edges_wake: true, ..ExternalKind::MEGA48 };
    /// ATmega8 (Atmel 2486, external interrupts): INT0 and INT1.
    pub const MEGA8: ExternalKind = ExternalKind::new(&[ExternalSense::Clocked; 2], [0; 4]);
    /// ATmega16 and 32 (Atmel 2466 and 2503, external interrupts): INT0 to INT2.
    pub const MEGA16: ExternalKind = ExternalKind::new(WITH_INT2, [0; 4]);
    /// ATmega162 (Atmel 2513, external interrupts): interrupts 0 to 2 are INT0 to INT2, 3 and 4 PCINT0 and
    /// PCINT1.
    pub const MEGA162: ExternalKind = ExternalKind::new(WITH_INT2, [0xFF, 0xFF, 0, 0]);
    /// ATmega164, 324, 644 and 1284 (Atmel 8272, external interrupts): interrupts 0 to 2 are INT0 to INT2, 3
    /// to 6 PCINT0 to PCINT3. The data sheet has edges registered without a clock, so they wake the core.
    pub const MEGA644: ExternalKind = ExternalKind {
        edges_wake: true,
        wake_by_sheet: true,
        ..ExternalKind::new(&[ExternalSense::Clocked; 3], [0xFF; 4])
    };
    /// ATmega64 and 128 (Atmel 2490 and 2467, external interrupts): INT0 to INT7.
    pub const MEGA128: ExternalKind = ExternalKind::new(WITH_INT7, [0; 4]);

    /// External interrupts with these INT inputs and pins of groups, as their data sheet says.
    const fn new(senses: &'static [ExternalSense], masks: [u8; 4]) -> ExternalKind {
        let (mut asynchronous, mut edge_only, mut n) = (0, 0, 0);
        while n < senses.len() {
            match senses[n] {
                ExternalSense::Clocked => {}
                ExternalSense::WithoutClock => asynchronous |= 1 << n,
                ExternalSense::EdgeWithoutClock => {
                    asynchronous |= 1 << n;
                    edge_only |= 1 << n;
                }
            }
            n += 1;
        }
        let ints = senses.len() as u8;
        ExternalKind { senses, ints, asynchronous, edge_only, edges_wake: false, wake_by_sheet: false, masks }
    }

    /// What the input INT`n` can detect; `None` if the chip does not have it.
    #[must_use]
    pub fn sense(&self, n: usize) -> Option<ExternalSense> {
        self.senses.get(n).copied()
    }

    /// Mask of the existing INT inputs.
    #[must_use]
    pub const fn int_mask(&self) -> u8 {
        ((1u16 << self.ints) - 1) as u8
    }

    /// Returns the existing bits of PCMSK`group`.
    #[must_use]
    pub fn group_mask(&self, group: usize) -> u8 {
        self.masks.get(group).copied().unwrap_or(0)
    }

    /// Mask of the existing pin groups.
    pub(super) fn groups(&self) -> u8 {
        super::groups_matching(|group| self.masks[group] != 0)
    }
}
