//! Interrupts (DS30292, 12.10): flags, enables, and the boundary at which an interrupt is taken.
//!
//! Flags and enables are sampled at Q1 of every cycle, and the interrupt is taken at the boundary after that
//! cycle. So a pin change is sampled at the next Q1, sets its flag there, and is taken one cycle later, 3 to
//! 4 cycles before the first instruction of the service routine. A flag that a peripheral sets synchronously
//! with the clock is visible at the sample before: in the figure "TMR0 interrupt timing" the service routine
//! reads TMR0 as 2. A write by an instruction is sampled in the cycle after it: an interrupt that was sampled
//! while GIE was being cleared is taken (12.10, "GIE"), and one instruction executes between setting GIE and
//! the interrupt.

use emu_core::cpu::NEVER;

use super::Pic16Soc;
use crate::chips::{FlagLocation, Pic16Part, SfrBit, SfrBitPlace};
use crate::periph::map::{InterruptFlag, Sfr};
use crate::periph::ports::PORTB;

/// Interrupt enables as they are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct InterruptEnables {
    /// INTCON: GIE, PEIE, and the enables of TMR0, INT and port B.
    pub intcon: u8,
    /// PIE1 and PIE2.
    pub pie: [u8; 2],
}

emu_core::state! { InterruptEnables { intcon, pie } }

/// Mask of GIE in INTCON.
pub(super) const GIE: u8 = 0x80;
/// Mask of RBIF in INTCON.
pub(super) const RBIF: u8 = 0x01;
/// Mask of PEIE in INTCON.
const PEIE: u8 = 0x40;

/// Flags in PIR1, PIR2 and INTCON, their enables, and the boundary of the next interrupt.
#[derive(Debug, Clone)]
pub struct Pic16Interrupts {
    /// Enables; INTCON also holds the flags of TMR0, INT and port B.
    pub enables: InterruptEnables,
    /// PIR1 and PIR2, without the flags that are levels of other peripherals.
    pub pir: [u8; 2],
    /// Enables before the last instruction that wrote them; they still apply at the boundary `changed`.
    before: InterruptEnables,
    /// Boundary at which `before` applies.
    changed: u64,
    /// First boundary at which an interrupt is taken.
    pub at: u64,
    /// Clocks at which INTF and RBIF will be set after changes of their pins.
    pub sampled: [u64; 2],
    /// Port B as the program last read it.
    pub seen_port_b: u8,
    /// The flag in a register of its peripheral, on chips that have one.
    flag_outside_pir: Option<&'static FlagLocation>,
    /// Masks of RCIF and TXIF in PIR1, which are levels.
    pub levels: [u8; 2],
}

emu_core::state! { Pic16Interrupts { enables, pir, before, changed, at, sampled, seen_port_b } stays { flag_outside_pir, levels } }

impl Pic16Interrupts {
    /// Returns the state with no flags and no enables.
    pub fn new(part: &'static Pic16Part) -> Pic16Interrupts {
        let bit = |flag| part.flags.iter().find(|row| row.flag == flag).map_or(0, |row| 1 << row.at.bit);
        Pic16Interrupts {
            enables: InterruptEnables::default(),
            pir: [0; 2],
            before: InterruptEnables::default(),
            changed: NEVER,
            at: NEVER,
            sampled: [NEVER; 2],
            seen_port_b: 0,
            flag_outside_pir: part.flags.iter().find(|row| !matches!(row.at.sfr, Sfr::PIR1 | Sfr::PIR2 | Sfr::INTCON)),
            levels: [bit(InterruptFlag::RCIF), bit(InterruptFlag::TXIF)],
        }
    }

    /// Saves the enables before the instruction in the cycle before `boundary` writes them.
    pub fn remember(&mut self, boundary: u64) {
        self.before = self.enables;
        self.changed = boundary;
    }

    /// Returns the clock of the next sample of a pin change.
    pub fn next_sample_clock(&self) -> u64 {
        self.sampled[0].min(self.sampled[1])
    }
}

impl Pic16Soc {
    /// Sets a flag that a peripheral raises at the clock `t`.
    pub(super) fn raise(&mut self, flag: InterruptFlag, t: u64) {
        let Some(row) = self.part.flags.iter().find(|row| row.flag == flag) else { return };
        let SfrBitPlace { sfr: register, bit } = row.at;
        match register {
            // These flags are levels of the USART.
            _ if matches!(flag, InterruptFlag::RCIF | InterruptFlag::TXIF) => {}
            Sfr::INTCON => self.irq.enables.intcon |= 1 << bit,
            Sfr::PIR1 => self.irq.pir[0] |= 1 << bit,
            Sfr::PIR2 => self.irq.pir[1] |= 1 << bit,
            // The flag is in a register of the peripheral itself.
            _ => {}
        }
        let taken = t.div_ceil(4) + u64::from(matches!(flag, InterruptFlag::INTF | InterruptFlag::RBIF));
        let old = taken == self.irq.changed;
        let enables = if old { self.irq.before } else { self.irq.enables };
        let on = |enables: InterruptEnables| {
            enables.intcon & GIE != 0 && self.is_enabled(enables, row.enable, row.peripheral)
        };
        if on(enables) {
            self.irq.at = self.irq.at.min(taken);
        } else if old && on(self.irq.enables) {
            self.irq.at = self.irq.at.min(taken + 1);
        }
    }

    /// Reports whether the enable bit at register and bit `at` is set, and PEIE too if the flag is
    /// `peripheral`.
    pub(super) fn is_enabled(&self, enables: InterruptEnables, at: SfrBitPlace, peripheral: bool) -> bool {
        let byte = match at.sfr {
            Sfr::INTCON => enables.intcon,
            Sfr::PIE1 => enables.pie[0],
            Sfr::PIE2 => enables.pie[1],
            _ => 0,
        };
        byte >> at.bit & 1 == 1 && (!peripheral || enables.intcon & PEIE != 0)
    }

    /// Reports whether a flag is set and enabled, regardless of GIE: then it ends standby.
    pub(super) fn has_request(&self, t: u64) -> bool {
        // Flags and enables have the same bit positions, so masks test all rows at once. The rest are flags
        // that small chips have in registers of their peripherals.
        let InterruptEnables { intcon, pie } = self.irq.enables;
        let (own, peripheral) = (intcon & intcon >> 3 & 7, intcon & PEIE != 0);
        let set = || (self.irq.pir[0] | self.levels(Sfr::PIR1, pie[0], t)) & pie[0] | self.irq.pir[1] & pie[1];
        own != 0
            || peripheral && set() != 0
            || self.irq.flag_outside_pir.is_some_and(|row| {
                self.is_enabled(self.irq.enables, row.enable, row.peripheral)
                    && self.peek_register(row.at.sfr, t) >> row.at.bit & 1 == 1
            })
    }

    /// Updates the interrupt after flags or enables may have changed in the instruction whose cycle ends at
    /// `boundary`.
    pub(super) fn update_request(&mut self, boundary: u64) {
        let on = self.irq.enables.intcon & GIE != 0 && self.has_request(4 * boundary);
        // An interrupt sampled by then is taken.
        if self.irq.at > boundary {
            self.irq.at = if on { self.irq.at.min(boundary + 1) } else { NEVER };
        }
    }

    /// Returns the flags that are set and enabled at the boundary before the cycle `now`, by their names on
    /// this chip, regardless of GIE.
    #[must_use]
    pub fn requesting_flags(&self, now: u64) -> Vec<&'static str> {
        let set = self.part.flags.iter().filter(|row| {
            self.is_enabled(self.irq.enables, row.enable, row.peripheral)
                && self.peek_register(row.at.sfr, 4 * now) >> row.at.bit & 1 == 1
        });
        let name = |row: &FlagLocation| {
            let named = self
                .part
                .bits
                .iter()
                .find(|SfrBit { sfr: register, bit, .. }| SfrBitPlace { sfr: *register, bit: *bit } == row.at);
            named.map(|SfrBit { name, .. }| *name)
        };
        set.filter_map(name).collect()
    }

    /// Returns GIE.
    #[must_use]
    pub const fn interrupts_enabled(&self) -> bool {
        self.irq.enables.intcon & GIE != 0
    }

    /// Sets GIE for a RETFIE whose first cycle is `cycle`.
    pub fn interrupt_ended(&mut self, cycle: u64) {
        self.run(4 * cycle + 3);
        self.irq.remember(cycle + 1);
        self.irq.enables.intcon |= GIE;
        self.update_request(cycle + 1);
    }

    /// Returns the boundary since which the interrupt that would be taken at `now` is pending.
    #[must_use]
    pub fn interrupt_since(&self, now: u64) -> Option<u64> {
        (self.irq.at <= now && self.power.is_running()).then_some(self.irq.at)
    }

    /// Writes the flags and enables of INTCON at the clock `t`.
    pub(super) fn write_intcon(&mut self, value: u8, t: u64) {
        self.irq.remember(t / 4);
        self.irq.enables.intcon = value;
        self.on_port_b_mismatch(t);
    }

    /// Compares port B with its last read value; RBIF will be set if they differ (DS30292, 3.2).
    pub(super) fn on_port_b_mismatch(&mut self, t: u64) {
        if self.power.in_reset(t) {
            return self.sample_port_b();
        }
        if self.irq.enables.intcon & RBIF != 0 {
            return;
        }
        if self.changes_b() == 0 {
            self.irq.sampled[1] = NEVER;
        } else if self.irq.sampled[1] == NEVER {
            self.irq.sampled[1] = if self.power.is_running() { t.next_multiple_of(4) } else { t };
        }
    }

    /// Returns the bits of port B that differ from the last read value.
    fn changes_b(&self) -> u8 {
        (self.ports.input(PORTB) ^ self.irq.seen_port_b) & self.ports.tris(PORTB) & 0xF0
    }

    /// Records that the program reads port B.
    pub(super) fn sample_port_b(&mut self) {
        self.irq.seen_port_b = self.ports.input(PORTB);
        self.irq.sampled[1] = NEVER;
    }
}
