//! Timer 1 lengthened by a byte or two of RAM, for periods that no other part paces: it counts machine cycles from minus the period
//! up to 0, each overflow counts one in RAM, and the match is the overflow that makes RAM 0 as well.
//!
//! After a match the timer stands still for some cycles, always the same, while minus the period and the cycles of the stop are
//! added to what it has counted since: nothing is lost, so there is no drift. Where the fraction of the period says so,
//! it stands still for one cycle more. The prescaler is 1, since stopping and writing would lose what a longer one holds.

use emu_pic16::isa::Kind;
use emu_pic16::periph::map::Sfr;

use super::pacing::Pic16PeriodFraction;
use super::select::Pic16Selector;
use super::writer::{C, Pic16Label, Pic16Writer, STATUS};

/// Machine cycles of a period, at least: those of the stop and some of a scan.
pub const MIN_PERIOD_CYCLES: u128 = 16;
/// Machine cycles of a period stay below this: timer 1 and two bytes, and a cycle of the fraction.
pub const MAX_PERIOD_CYCLES: u128 = (1 << 32) - 1;
/// Machine cycles of a scan and the wait, at most, where RAM counts: it sees every overflow only if no two fall into one scan.
pub const MAX_SCAN_CYCLES: u64 = 65_500;

/// Cycles that the timer stands still while its value is changed: from the BCF to the BSF, with an addition to two bytes
/// between them, at most six words.
const TIMER_STOP_CYCLES: u32 = 7;

/// Bytes of RAM for periods of `ticks` machine cycles, or one more.
#[must_use]
pub fn extension_bytes(ticks: u128) -> u8 {
    match ticks + 1 {
        0..=0x1_0000 => 0,
        0x1_0001..=0xFF_FFFF => 1,
        _ => 2,
    }
}

/// Registers and RAM for the first period, which begins when the timer does.
pub fn prepare_extension(out: &mut Pic16Writer<'_>, ticks: u32, bytes: u8, extension_at: u16) {
    let [low, high, more @ ..] = ticks.wrapping_neg().to_le_bytes();
    for (at, k) in (extension_at..).zip(more).take(bytes.into()) {
        out.set_byte(at, k);
    }
    out.set_byte(out.chip.reg(Sfr::TMR1L), low);
    out.set_byte(out.chip.reg(Sfr::TMR1H), high);
}

/// In the loop that waits, after an overflow: counts it, and goes back unless it was the last one. Leaves the flag alone where
/// the first is the last.
pub fn count_overflow(out: &mut Pic16Writer<'_>, flag: (u16, u8), bytes: u8, extension_at: u16, poll: Pic16Label) {
    if bytes > 0 {
        out.set_bit(flag, false);
    }
    for at in (extension_at..).take(bytes.into()) {
        out.byte_op(Kind::IncfszF, at);
        out.goto_back(poll, 1);
    }
}

impl Pic16Selector<'_, '_> {
    /// Just after a match: minus the period is added to timer and RAM.
    pub(super) fn next_extended(&mut self, ticks: u32, bytes: u8, fraction: Option<Pic16PeriodFraction>) {
        let (on, timer) = (self.out.chip.bit("TMR1ON"), self.out.chip.reg(Sfr::TMR1L));
        if let Some(fraction) = fraction {
            self.add_constant(self.layout.fraction, fraction.bytes, (fraction.numerator as i32).wrapping_neg(), true);
            self.refill_count_down(fraction, |out| {
                // From the one to the other the timer misses one cycle: this period has one more.
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
            self.out.implied_op(Kind::Nop);
        }
        self.out.set_bit(on, true);
        // The carry, which an overflow since the match has used up, goes on into RAM.
        let [_, _, more @ ..] = k.to_le_bytes();
        let mut may_carry = true;
        for (at, k) in (self.layout.extension..).zip(more).take(bytes.into()) {
            self.out.literal_op(Kind::Movlw, k);
            if may_carry {
                self.out.skip_unless((STATUS, C), true);
                self.out.literal_op(Kind::Movlw, k.wrapping_add(1));
            }
            self.out.byte_op(Kind::Movwf, at);
            may_carry &= k == 0xFF;
        }
    }
}
