//! Timer 1 lengthened by a byte or two of RAM, for periods that no other part paces: it counts machine cycles from minus the period
//! up to 0, each overflow counts one in RAM, and the match is the overflow that makes RAM 0 as well.
//!
//! After a match the timer stands still for some cycles, always the same, while minus the period and the cycles of the stop are
//! added to what it has counted since: nothing is lost, so there is no drift. Where the fraction of the period says so,
//! it stands still for one cycle more. The prescaler is 1, since stopping and writing would lose what a longer one holds.

use emu_pic16::isa::Kind;
use emu_pic16::periph::map::Sfr;

use super::out::{C, Lab, Out, STATUS};
use super::pace::Fraction;
use super::select::Select;

/// Machine cycles of a period, at least: those of the stop and some of a scan.
pub const FEWEST: u128 = 16;
/// Machine cycles of a period stay below this: timer 1 and two bytes, and a cycle of the fraction.
pub const MOST: u128 = (1 << 32) - 1;
/// Machine cycles of a scan and the wait, at most, where RAM counts: it sees every overflow only if no two fall into one scan.
pub const LONGEST_SCAN: u64 = 65_500;

/// Cycles that the timer stands still while its value is changed: from the BCF to the BSF, with an addition to two bytes
/// between them, at most six words.
const STOP: u32 = 7;

/// Bytes of RAM for periods of `ticks` machine cycles, or one more.
#[must_use]
pub fn bytes(ticks: u128) -> u8 {
    match ticks + 1 {
        0..=0x1_0000 => 0,
        0x1_0001..=0xFF_FFFF => 1,
        _ => 2,
    }
}

/// Registers and RAM for the first period, which begins when the timer does.
pub fn prepare(out: &mut Out<'_>, ticks: u32, bytes: u8, extension_at: u16) {
    let [low, high, more @ ..] = ticks.wrapping_neg().to_le_bytes();
    for (at, k) in (extension_at..).zip(more).take(bytes.into()) {
        out.set(at, k);
    }
    out.set(out.chip.reg(Sfr::TMR1L), low);
    out.set(out.chip.reg(Sfr::TMR1H), high);
}

/// In the loop that waits, after an overflow: counts it, and goes back unless it was the last one. Leaves the flag alone where
/// the first is the last.
pub fn count(out: &mut Out<'_>, flag: (u16, u8), bytes: u8, extension_at: u16, poll: Lab) {
    if bytes > 0 {
        out.put(flag, false);
    }
    for at in (extension_at..).take(bytes.into()) {
        out.f(Kind::IncfszF, at);
        out.back(poll, 1);
    }
}

impl Select<'_, '_> {
    /// Just after a match: minus the period is added to timer and RAM.
    pub(super) fn next_extended(&mut self, ticks: u32, bytes: u8, fraction: Option<Fraction>) {
        let (on, timer) = (self.out.chip.bit("TMR1ON"), self.out.chip.reg(Sfr::TMR1L));
        if let Some(fraction) = fraction {
            self.add_constant(self.layout.fraction, fraction.bytes, (fraction.rest as i32).wrapping_neg(), true);
            self.refill(fraction, |out| {
                // From the one to the other the timer misses one cycle: this period has one more.
                out.put(on, false);
                out.put(on, true);
            });
        }
        let k = STOP.wrapping_sub(ticks);
        self.out.put(on, false);
        let stopped = self.out.save();
        if k & 0xFFFF == 0 {
            self.out.put((STATUS, C), false);
        }
        self.add_constant(timer, 2, k as i32, true);
        while self.out.words_since(&stopped) < STOP - 1 {
            self.out.bare(Kind::Nop);
        }
        self.out.put(on, true);
        // The carry, which an overflow since the match has used up, goes on into RAM.
        let [_, _, more @ ..] = k.to_le_bytes();
        let mut may_carry = true;
        for (at, k) in (self.layout.extension..).zip(more).take(bytes.into()) {
            self.out.lit(Kind::Movlw, k);
            if may_carry {
                self.out.only_if((STATUS, C), true);
                self.out.lit(Kind::Movlw, k.wrapping_add(1));
            }
            self.out.f(Kind::Movwf, at);
            may_carry &= k == 0xFF;
        }
    }
}
