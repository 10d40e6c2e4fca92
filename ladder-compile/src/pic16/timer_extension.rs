//! Extends timer 1 by one or two bytes of RAM, for periods that no other timer can pace.
//!
//! The timer counts machine cycles from minus the period up to 0. Each overflow increments the bytes in RAM;
//! the match is the overflow that makes these 0 as well.
//!
//! After a match the timer is stopped for a constant number of cycles, while minus the period plus the length
//! of the stop is added to its value. No counts are lost, so there is no drift. If the fraction of the period
//! requires it, the timer stops for one cycle more. The prescaler is 1, because stopping and writing the
//! timer would lose the content of a longer one.

use emu_pic16::isa::Pic16OpKind;
use emu_pic16::periph::map::Sfr;

use super::pacing::Pic16PeriodFraction;
use super::select::Pic16Selector;
use super::writer::{C, Pic16Label, Pic16Writer, STATUS};

/// Minimum period in machine cycles: the stop and a short scan.
pub const MIN_PERIOD_CYCLES: u128 = 16;
/// Upper limit of a period in machine cycles (exclusive): timer 1, two bytes, and one cycle for the fraction.
pub const MAX_PERIOD_CYCLES: u128 = (1 << 32) - 1;
/// Maximum machine cycles of a scan and the wait with extension bytes: two overflows in one scan would be
/// counted as one.
pub const MAX_SCAN_CYCLES: u64 = 65_500;

/// Machine cycles for which the timer is stopped while its value changes: from BCF to BSF, with a two-byte
/// addition of at most six words between them.
const TIMER_STOP_CYCLES: u32 = 7;

/// Number of extension bytes for periods of `ticks` or `ticks` + 1 machine cycles.
#[must_use]
pub fn extension_bytes(ticks: u128) -> u8 {
    match ticks + 1 {
        0..=0x1_0000 => 0,
        0x1_0001..=0xFF_FFFF => 1,
        _ => 2,
    }
}

/// Emits the set-up of registers and RAM for the first period, which begins when the timer starts.
pub fn prepare_extension(out: &mut Pic16Writer<'_>, ticks: u32, bytes: u8, extension_at: u16) {
    let [low, high, more @ ..] = ticks.wrapping_neg().to_le_bytes();
    for (at, k) in (extension_at..).zip(more).take(bytes.into()) {
        out.set_byte(at, k);
    }
    out.set_byte(out.chip.reg(Sfr::TMR1L), low);
    out.set_byte(out.chip.reg(Sfr::TMR1H), high);
}

/// Emits the count of an overflow in the poll loop: continues waiting unless it was the last one.
///
/// Without extension bytes the flag is not changed.
pub fn count_overflow(out: &mut Pic16Writer<'_>, flag: (u16, u8), bytes: u8, extension_at: u16, poll: Pic16Label) {
    if bytes > 0 {
        out.set_bit(flag, false);
    }
    for at in (extension_at..).take(bytes.into()) {
        out.byte_op(Pic16OpKind::IncfszF, at);
        out.goto_back(poll, 1);
    }
}

impl Pic16Selector<'_, '_> {
    /// Emits the code just after a match: adds minus the period to timer and RAM.
    pub(super) fn next_extended(&mut self, ticks: u32, bytes: u8, fraction: Option<Pic16PeriodFraction>) {
        let (on, timer) = (self.out.chip.bit("TMR1ON"), self.out.chip.reg(Sfr::TMR1L));
        if let Some(fraction) = fraction {
            self.add_constant(self.layout.fraction, fraction.bytes, (fraction.numerator as i32).wrapping_neg(), true);
            self.refill_count_down(fraction, |out| {
                // Between these two instructions the timer misses one cycle, so this period is one cycle
                // longer.
                out.set_bit(on, false);
                out.set_bit(on, true);
            });
        }
        let k = TIMER_STOP_CYCLES.wrapping_sub(ticks);
        self.out.set_bit(on, false);
        let stopped = self.out.checkpoint();
        if k & 0xFFFF == 0 {
            self.out.set_bit((STATUS, C), false);
        }
        self.add_constant(timer, 2, k as i32, true);
        while self.out.words_since(&stopped) < TIMER_STOP_CYCLES - 1 {
            self.out.implied_op(Pic16OpKind::Nop);
        }
        self.out.set_bit(on, true);
        // Propagate the carry into RAM; it is set if an overflow since the match was consumed.
        let [_, _, more @ ..] = k.to_le_bytes();
        let mut may_carry = true;
        for (at, k) in (self.layout.extension..).zip(more).take(bytes.into()) {
            self.out.literal_op(Pic16OpKind::Movlw, k);
            if may_carry {
                self.out.skip_unless((STATUS, C), true);
                self.out.literal_op(Pic16OpKind::Movlw, k.wrapping_add(1));
            }
            self.out.byte_op(Pic16OpKind::Movwf, at);
            may_carry &= k == 0xFF;
        }
    }
}
