//! Paces scans with timer 0 or timer 2: one scan per period, the k-th match at floor(k P), where P is the
//! cycle time in machine cycles.
//!
//! A period is divided into the fewest equal timer *rounds* that fit 16 bits; the match is the overflow that
//! ends the last round. If a round is not a whole number of machine cycles, the code carries the fraction: at
//! each overflow it decides whether a round is one cycle longer, as Bresenham's line algorithm does. So the
//! k-th match never drifts.
//!
//! - Timer 2 (8052) reloads itself. Its reload value for an overflow is written one round earlier.
//! - Timer 0 (mode 1) continues from 0. The code stops it, adds the reload value and the constant length of
//!   the stop, and starts it again. So the counts since the overflow are kept.

use emu_8051::isa::Mcs51OpKind;

use super::arch::{Mcs51Arch, Mcs51Jump};
use super::registers::{B, DPL, Mcs51Registers};
use crate::code::{CodeLabel, CodeWriter};
use crate::map::Ratio;
use crate::period::{PeriodRange, ReducedFraction, reduce_fraction};
use crate::target::CodeMark;

/// Machine cycles for which timer 0 is stopped while its value changes: from CLR to SETB, with six one-cycle
/// instructions.
const TIMER_STOP_CYCLES: u32 = 7;

/// Maximum counts of a round.
const MAX_ROUND_COUNTS: u64 = 65536;

/// Maximum number of rounds per period, because they are counted in a byte.
const MAX_ROUNDS: u64 = 255;

/// Settings of the pacing timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mcs51Pacing {
    /// P in machine cycles.
    pub period: Ratio,
    /// Number of rounds per period.
    pub timer_rounds: u8,
    /// Machine cycles per round, rounded down.
    pub round_cycles: u32,
    /// Fraction of a cycle per round, if a round is not a whole number of cycles.
    pub fraction: Option<Mcs51PeriodFraction>,
}

/// The fraction of a cycle, `numerator / denominator`, by which a round is longer than
/// [`Mcs51Pacing::round_cycles`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mcs51PeriodFraction {
    /// Numerator.
    pub numerator: u32,
    /// Denominator, greater than the numerator.
    pub denominator: u32,
}

impl Mcs51PeriodFraction {
    /// Width of the fraction counter in bytes.
    fn bytes(self) -> usize {
        ((32 - (self.denominator - 1).leading_zeros()).div_ceil(8) as usize).max(1)
    }

    /// Offset that makes the counter overflow when the sum of the fractions reaches one.
    fn carry_offset(self) -> u64 {
        (1u64 << (8 * self.bytes())) - u64::from(self.denominator)
    }
}

/// Plans the period.
///
/// # Errors
/// The possible periods, if this one is not among them.
pub fn plan_pacing(clock_hz: u64, cycle_us: u64) -> Result<Mcs51Pacing, PeriodRange> {
    let ReducedFraction { num, den } = reduce_fraction(u128::from(clock_hz) * u128::from(cycle_us), 12_000_000);
    let us = |cycles: u64| u128::from(cycles) * 12_000_000;
    let hz = u128::from(clock_hz.max(1));
    let range = || PeriodRange {
        shortest_us: us(1).div_ceil(hz) as u64,
        longest_us: (us(MAX_ROUND_COUNTS * MAX_ROUNDS) / hz) as u64,
    };
    if num < den {
        return Err(range());
    }
    let turns = num.div_ceil(den * u128::from(MAX_ROUND_COUNTS));
    if turns > u128::from(MAX_ROUNDS) {
        return Err(range());
    }
    let ReducedFraction { num: all, den: whole } = reduce_fraction(num, den * turns);
    let (length, rest) = (all / whole, all % whole);
    let fraction = (rest != 0).then_some(Mcs51PeriodFraction { numerator: rest as u32, denominator: whole as u32 });
    let period = Ratio { num: num as u64, den: den as u64 };
    Ok(Mcs51Pacing { period, timer_rounds: turns as u8, round_cycles: length as u32, fraction })
}

/// The pacing timer and the RAM that it needs.
#[derive(Debug, Clone, Copy)]
pub struct Mcs51PacingTimer<'a> {
    /// Settings.
    pub pace: Mcs51Pacing,
    /// True for timer 2, false for timer 0.
    pub is_timer2: bool,
    /// Bytes of RAM: first those of the fraction, then the round counter.
    pub ram: &'a [u8],
    /// Registers of the chip.
    pub regs: Mcs51Registers,
}

impl Mcs51Pacing {
    /// Shortest period in machine cycles.
    #[must_use]
    pub fn shortest(&self) -> u64 {
        self.period.num / self.period.den
    }

    /// Number of bytes of RAM needed.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.fraction.map_or(0, Mcs51PeriodFraction::bytes) + usize::from(self.timer_rounds > 1)
    }

    /// Low and high reload byte for a round of `cycles` machine cycles.
    fn reload(cycles: u32) -> (i32, i32) {
        let [low, high] = (cycles.wrapping_neg() as u16).to_le_bytes();
        (low.into(), high.into())
    }
}

impl Mcs51PacingTimer<'_> {
    fn fraction_address(&self, n: usize) -> i32 {
        self.ram.get(n).map_or(0, |&at| at.into())
    }

    fn rounds_address(&self) -> i32 {
        self.ram.last().map_or(0, |&at| at.into())
    }

    /// Bit address of the overflow flag.
    #[must_use]
    pub fn flag(&self) -> i32 {
        self.regs.bit(if self.is_timer2 { "TF2" } else { "TF0" })
    }

    /// Emits the set-up and start of the timer; its registers have their reset values, except TMOD, which is
    /// already set.
    pub fn start(&self, asm: &mut CodeWriter<Mcs51Arch>) {
        let Mcs51Pacing { round_cycles: length, fraction, timer_rounds: turns, .. } = self.pace;
        let set = |asm: &mut CodeWriter<Mcs51Arch>, reg: &str, value: i32| {
            asm.op(Mcs51OpKind::MovDirImm, &[self.regs.byte(reg), value]);
        };
        let (low, high) = Mcs51Pacing::reload(length);
        // Number of rounds whose reload value is decided before the first overflow.
        let decided = if self.is_timer2 { 2 } else { 1 };
        if let Some(f) = fraction {
            let done = u64::from(f.numerator) * decided % u64::from(f.denominator) + f.carry_offset();
            for (n, byte) in done.to_le_bytes().into_iter().take(f.bytes()).enumerate() {
                asm.op(Mcs51OpKind::MovDirImm, &[self.fraction_address(n), byte.into()]);
            }
        }
        if turns > 1 {
            asm.op(Mcs51OpKind::MovDirImm, &[self.rounds_address(), turns.into()]);
        }
        let (low_reg, high_reg, run) = if self.is_timer2 { ("TL2", "TH2", "TR2") } else { ("TL0", "TH0", "TR0") };
        set(asm, low_reg, low);
        set(asm, high_reg, high);
        if self.is_timer2 {
            let longer = fraction.is_some_and(|f| 2 * u64::from(f.numerator) >= u64::from(f.denominator));
            let (low, high) = Mcs51Pacing::reload(length + u32::from(longer));
            set(asm, "RCAP2L", low);
            set(asm, "RCAP2H", high);
        }
        asm.mark(CodeMark::TimerStart);
        asm.op(Mcs51OpKind::SetbBit, &[self.regs.bit(run)]);
    }

    /// Emits the wait for a match and the start of a scan.
    pub fn wait(&self, asm: &mut CodeWriter<Mcs51Arch>, poll: CodeLabel) {
        asm.mark(CodeMark::Section("wait for the match"));
        asm.mark(CodeMark::PollLoop);
        asm.place_label(poll);
        asm.jump_back(Mcs51Jump::conditional(Mcs51OpKind::Jnb, &[self.flag()]), poll, 1);
        if self.pace.timer_rounds > 1 {
            self.set_next_round(asm);
            asm.jump_back(Mcs51Jump::conditional(Mcs51OpKind::DjnzDir, &[self.rounds_address()]), poll, 1);
        }
        asm.mark(CodeMark::ScanStart);
        if self.pace.timer_rounds > 1 {
            asm.op(Mcs51OpKind::MovDirImm, &[self.rounds_address(), self.pace.timer_rounds.into()]);
        } else {
            self.set_next_round(asm);
        }
    }

    /// Emits the code just after an overflow: clears the flag and sets the length of a later round.
    fn set_next_round(&self, asm: &mut CodeWriter<Mcs51Arch>) {
        asm.op(Mcs51OpKind::ClrBit, &[self.flag()]);
        let Mcs51Pacing { round_cycles: length, fraction, .. } = self.pace;
        if self.is_timer2 {
            let Some(f) = fraction else { return };
            let (low, high) = (self.regs.byte("RCAP2L"), self.regs.byte("RCAP2H"));
            self.choose_reload(asm, f, Mcs51Pacing::reload(length), Mcs51Pacing::reload(length + 1), (low, high));
            return;
        }
        // Timer 0: the value to add is in B and DPL if it varies.
        let (low, high) = Mcs51Pacing::reload(length.wrapping_sub(TIMER_STOP_CYCLES));
        let (mut add_low, mut add_high) = ((Mcs51OpKind::AddImm, low), (Mcs51OpKind::AddcImm, high));
        if let Some(f) = fraction {
            let long = Mcs51Pacing::reload((length + 1).wrapping_sub(TIMER_STOP_CYCLES));
            self.choose_reload(asm, f, (low, high), long, (B, DPL));
            add_low = (Mcs51OpKind::AddDir, B);
            if long.1 != high {
                add_high = (Mcs51OpKind::AddcDir, DPL);
            }
        }
        let (timer_low, timer_high) = (self.regs.byte("TL0"), self.regs.byte("TH0"));
        for (kind, operand) in [
            (Mcs51OpKind::ClrBit, self.regs.bit("TR0")),
            (Mcs51OpKind::MovADir, timer_low),
            add_low,
            (Mcs51OpKind::MovDirA, timer_low),
            (Mcs51OpKind::MovADir, timer_high),
            add_high,
            (Mcs51OpKind::MovDirA, timer_high),
            (Mcs51OpKind::SetbBit, self.regs.bit("TR0")),
        ] {
            asm.op(kind, &[operand]);
        }
    }

    /// Sets the bytes at `at` to `short`, or to `long` if the sum of the fractions reaches one.
    ///
    /// A high byte that is the same in both cases is not written.
    fn choose_reload(
        &self,
        asm: &mut CodeWriter<Mcs51Arch>,
        f: Mcs51PeriodFraction,
        short: (i32, i32),
        long: (i32, i32),
        at: (i32, i32),
    ) {
        let set = |asm: &mut CodeWriter<Mcs51Arch>, value: (i32, i32)| {
            asm.op(Mcs51OpKind::MovDirImm, &[at.0, value.0]);
            if short.1 != long.1 {
                asm.op(Mcs51OpKind::MovDirImm, &[at.1, value.1]);
            }
        };
        let add = |asm: &mut CodeWriter<Mcs51Arch>, value: u64| {
            for (n, byte) in value.to_le_bytes().into_iter().take(f.bytes()).enumerate() {
                asm.op(Mcs51OpKind::MovADir, &[self.fraction_address(n)]);
                asm.op(if n == 0 { Mcs51OpKind::AddImm } else { Mcs51OpKind::AddcImm }, &[byte.into()]);
                asm.op(Mcs51OpKind::MovDirA, &[self.fraction_address(n)]);
            }
        };
        let same = asm.new_label();
        set(asm, short);
        add(asm, f.numerator.into());
        asm.jump(Mcs51Jump::conditional(Mcs51OpKind::Jnc, &[]), same);
        add(asm, f.carry_offset());
        set(asm, long);
        asm.place_label(same);
    }
}
