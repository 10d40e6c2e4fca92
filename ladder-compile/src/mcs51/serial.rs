//! Set-up of the serial line and choice of the timer for its baud rate.

use emu_8051::isa::Mcs51OpKind;

use super::arch::Mcs51Arch;
use super::registers::Mcs51Registers;
use crate::code::CodeWriter;
use crate::map::Ratio;
use crate::period::{ReducedFraction, reduce_fraction};

/// Settings of the baud rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mcs51BaudSetup {
    /// True for timer 2, false for timer 1 in mode 2.
    pub uses_timer2: bool,
    /// SMOD: doubles the rate of timer 1.
    pub double: bool,
    /// Counts of the timer between two overflows.
    pub counts: u64,
    /// Machine cycles per bit.
    pub bit: Ratio,
}

/// Sources of a baud rate: timer 2, SMOD, clocks per bit and count of the timer, maximum number of counts
/// (user's manual, "Baud rates").
const BAUD_SOURCES: [(bool, bool, u64, u64); 3] =
    [(false, false, 384, 256), (false, true, 192, 256), (true, false, 32, 65536)];

/// Number of scans per byte, as the language defines it.
fn scans_per_byte(baud: u64, cycle_us: u64) -> u128 {
    10_000_000u128.div_ceil(u128::from(baud.max(1)) * u128::from(cycle_us.max(1))).max(1)
}

/// Chooses the nearest baud rate that is at most 2 % off and completes a byte before the next scan that may
/// send.
///
/// Timer 1 is preferred.
///
/// # Errors
/// The nearest possible baud rate.
pub fn plan_baud(clock_hz: u64, baud: u64, cycle_us: u64, has_timer2: bool) -> Result<Mcs51BaudSetup, u64> {
    let byte = scans_per_byte(baud, cycle_us) * u128::from(cycle_us) * u128::from(clock_hz);
    let mut best: Option<(u128, Mcs51BaudSetup)> = None;
    let mut nearest: Option<(u64, u64)> = None;
    for (second, double, clocks, most) in BAUD_SOURCES.into_iter().filter(|source| has_timer2 || !source.0) {
        if second && best.is_some() {
            break;
        }
        let about = clock_hz / (clocks.saturating_mul(baud)).max(1);
        for counts in [about, about + 1].map(|counts| counts.clamp(1, most)) {
            let bit = clocks * counts;
            let got = (clock_hz + bit / 2) / bit;
            if nearest.is_none_or(|(off, _)| got.abs_diff(baud) < off) {
                nearest = Some((got.abs_diff(baud), got));
            }
            // Error relative to `bit * baud`.
            let off = u128::from(clock_hz).abs_diff(u128::from(bit) * u128::from(baud));
            let near = 50 * off <= u128::from(bit) * u128::from(baud);
            let in_time = 10 * u128::from(bit) * 1_000_000 <= byte;
            // In parts per billion, so that rates of different sources can be compared.
            let error = off * 1_000_000_000 / (u128::from(bit) * u128::from(baud)).max(1);
            if near && in_time && best.is_none_or(|(known, _)| error < known) {
                let ReducedFraction { num, den } = reduce_fraction(bit.into(), 12);
                best = Some((
                    error,
                    Mcs51BaudSetup {
                        uses_timer2: second,
                        double,
                        counts,
                        bit: Ratio { num: num as u64, den: den as u64 },
                    },
                ));
            }
        }
    }
    best.map(|(_, speed)| speed).ok_or(nearest.map_or(0, |(_, got)| got))
}

/// Minimum machine cycles between the scans that can send a byte.
pub(super) fn cycles_between_sends(baud: u64, cycle_us: u64, period: Ratio) -> u64 {
    (scans_per_byte(baud, cycle_us) * u128::from(period.num) / u128::from(period.den)) as u64
}

impl Mcs51BaudSetup {
    /// Maximum machine cycles from writing a byte until the next can follow.
    #[must_use]
    pub fn byte_cycles(&self) -> u64 {
        (10 * self.bit.num).div_ceil(self.bit.den)
    }

    /// Bits of TMOD that timer 1 needs.
    #[must_use]
    pub fn tmod(&self) -> i32 {
        const RELOAD: i32 = 2 << 4;
        if self.uses_timer2 { 0 } else { RELOAD }
    }

    /// Emits the set-up of line and timer; a byte can be sent at once. `first` is the time to the first scan
    /// in machine cycles.
    pub fn start(&self, asm: &mut CodeWriter<Mcs51Arch>, regs: Mcs51Registers, receive: bool, first: u64) {
        let mut set = |reg: &str, value: i32| asm.op(Mcs51OpKind::MovDirImm, &[regs.byte(reg), value]);
        let [low, high] = (self.counts.wrapping_neg() as u16).to_le_bytes();
        if self.uses_timer2 {
            set("RCAP2L", low.into());
            set("RCAP2H", high.into());
            // Make the first overflow come at once instead of after 65,536 counts.
            set("TH2", 0xFF);
            set("T2CON", regs.mask("RCLK") | regs.mask("TCLK") | regs.mask("TR2"));
        } else {
            set("TH1", low.into());
            // The first overflow takes up to 256 cycles, which matters only for short periods.
            if first < 512 {
                set("TL1", low.into());
            }
            if self.double {
                set("PCON", 0x80);
            }
        }
        // Eight data bits, baud rate from the timer.
        let receive = if receive { regs.mask("REN") } else { 0 };
        set("SCON", regs.mask("SM1") | receive | regs.mask("TI"));
        if !self.uses_timer2 {
            asm.op(Mcs51OpKind::SetbBit, &[regs.bit("TR1")]);
        }
    }
}
