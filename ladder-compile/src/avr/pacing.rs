//! Paces scans with timer 1 in CTC mode: one scan per compare match, the k-th match at floor(k P), where P is
//! the cycle time in clocks.
//!
//! The timer counts ticks of `prescale` clocks. If P is a whole number of ticks, the compare register is set
//! once. If not, the code carries the fraction: after each match it decides whether the next period is one
//! tick longer, as Bresenham's line algorithm does. The error never exceeds one tick.

use emu_avr::isa::AvrOpKind;

use super::arch::AvrCodeWriter;
use super::layout::{AvrCellPlace, AvrLayout};
use super::registers::{self, AvrRegisters};
use crate::map::Ratio;
use crate::period::{PeriodRange, ReducedFraction, reduce_fraction};
use crate::target::CodeMark;

/// Prescalers and their clock select bits (DS40002061, table 16-5).
const PRESCALERS: [(u32, u8); 5] = [(1, 1), (8, 2), (64, 3), (256, 4), (1024, 5)];

/// Maximum number of ticks of a period: the compare register holds one less, in 16 bits.
const MAX_PERIOD_TICKS: u128 = 65536;

/// Settings of the pacing timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrPacing {
    /// P in clocks.
    pub period: Ratio,
    /// Clocks per tick.
    pub prescale: u32,
    /// Clock select bits.
    pub select: u8,
    /// Ticks per period, rounded down.
    pub ticks: u32,
    /// Fraction of a tick per period, if P is not a whole number of ticks.
    pub fraction: Option<AvrPeriodFraction>,
    /// Ticks of the first period.
    pub first: u32,
}

/// The fraction of a tick, `numerator / denominator`, by which a period is longer than [`AvrPacing::ticks`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrPeriodFraction {
    /// Numerator.
    pub numerator: u32,
    /// Denominator.
    pub denominator: u32,
    /// Initial value of the remainder counter, after the decision for the first period; always below
    /// `denominator`.
    ///
    /// After each match the code subtracts `numerator`; if this borrows, the next period is one tick longer
    /// and `denominator` is added.
    pub start: u32,
    /// Width of the remainder counter in bytes.
    pub bytes: u16,
}

/// Clocks from the reset of the prescaler to the start of the timer, which the OUT or STS that selects the
/// clock takes.
#[must_use]
pub fn prescaler_reset_clocks(regs: &AvrRegisters) -> u64 {
    if registers::is_io(regs.addr(&["TCCR1B"])) { 1 } else { 2 }
}

/// Chooses the finest tick for which a period fits; `lead` is the result of [`prescaler_reset_clocks`].
///
/// # Errors
/// The possible periods, if this one is not among them.
pub fn plan_pacing(clock_hz: u64, cycle_us: u64, lead: u64) -> Result<AvrPacing, PeriodRange> {
    let clock_hz = clock_hz.max(1);
    let ReducedFraction { num, den } = reduce_fraction(u128::from(clock_hz) * u128::from(cycle_us), 1_000_000);
    for (prescale, select) in PRESCALERS {
        let ReducedFraction { num: all, den: whole } = reduce_fraction(num, den * u128::from(prescale));
        let (ticks, rest) = (all / whole, all % whole);
        if all.div_ceil(whole) > MAX_PERIOD_TICKS || ticks == 0 {
            continue;
        }
        let mut first = ticks;
        let mut fraction = None;
        if rest != 0 {
            // The prescaler is `lead` clocks ahead of the timer, so every match is early by that much; the
            // remainder counter starts with the corresponding part of a tick.
            let lead = if prescale == 1 { 0 } else { u128::from(lead) * whole / u128::from(prescale) };
            let before = whole - 1 - lead;
            let start = if before < rest { before + whole - rest } else { before - rest };
            first += u128::from(before < rest);
            let bytes = (128 - (whole - 1).leading_zeros()).div_ceil(8);
            fraction = Some(AvrPeriodFraction {
                numerator: rest as u32,
                denominator: whole as u32,
                start: start as u32,
                bytes: bytes as u16,
            });
        }
        return Ok(AvrPacing {
            period: Ratio { num: num as u64, den: den as u64 },
            prescale,
            select,
            ticks: ticks as u32,
            fraction,
            first: first as u32,
        });
    }
    let slowest = PRESCALERS.last().map_or(1, |&(prescale, _)| prescale);
    let longest = MAX_PERIOD_TICKS * u128::from(slowest) * 1_000_000 / u128::from(clock_hz);
    Err(PeriodRange { shortest_us: 1_000_000u64.div_ceil(clock_hz), longest_us: longest as u64 })
}

impl AvrPacing {
    /// Clocks of the shortest period.
    #[must_use]
    pub fn shortest_period(&self) -> u64 {
        u64::from(self.ticks) * u64::from(self.prescale)
    }

    /// Width of the remainder counter in bytes; 0 without one.
    #[must_use]
    pub fn fraction_bytes(&self) -> u16 {
        self.fraction.map_or(0, |fraction| fraction.bytes)
    }

    /// Emits the start of the timer; its registers have their reset values.
    pub fn start(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, layout: &AvrLayout) {
        if let Some(fraction) = self.fraction {
            for (byte, n) in fraction.start.to_le_bytes().into_iter().take(fraction.bytes.into()).zip(0..) {
                match layout.fraction {
                    AvrCellPlace::Reg(reg) => asm.op(AvrOpKind::Ldi, &[i32::from(reg) + n, byte.into()]),
                    AvrCellPlace::Ram(addr) => {
                        asm.op(AvrOpKind::Ldi, &[24, byte.into()]);
                        layout.store(asm, addr + n as u16, 24);
                    }
                }
            }
        }
        let [low, high] = ((self.first - 1) as u16).to_le_bytes();
        // Write the high byte first: the chip holds it until the low byte is written.
        registers::write_constant(asm, regs.addr(&["OCR1AH"]), high.into(), 24);
        registers::write_constant(asm, regs.addr(&["OCR1AL"]), low.into(), 24);
        let (prescaler, control) = (regs.addr(&["GTCCR", "SFIOR"]), regs.addr(&["TCCR1B"]));
        // The prescalers run since reset, so reset them; without a prescaler this is not needed.
        if self.prescale > 1 {
            let reset = regs.mask(&[&["PSRSYNC", "PSR10", "PSR321", "PSR310"]]);
            asm.op(AvrOpKind::Ldi, &[25, reset]);
        }
        asm.op(AvrOpKind::Ldi, &[24, regs.mask(&[&["WGM12", "CTC1"]]) | i32::from(self.select)]);
        if self.prescale > 1 {
            registers::write(asm, prescaler, 25);
        }
        asm.mark(CodeMark::TimerStart);
        registers::write(asm, control, 24);
    }

    /// Emits the code just after a match: sets the length of the period that has begun, if the periods
    /// differ.
    pub fn set_next_period(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, layout: &AvrLayout) {
        let Some(fraction) = self.fraction else { return };
        let bytes = i32::from(fraction.bytes);
        let first = match layout.fraction {
            AvrCellPlace::Reg(reg) => i32::from(reg),
            AvrCellPlace::Ram(addr) => {
                (0..bytes).for_each(|n| layout.load(asm, 18 + n, addr + n as u16));
                18
            }
        };
        let subtract = |asm: &mut AvrCodeWriter, value: u32| {
            for (byte, n) in value.to_le_bytes().into_iter().zip(0..bytes) {
                asm.op(if n == 0 { AvrOpKind::Subi } else { AvrOpKind::Sbci }, &[first + n, byte.into()]);
            }
        };
        let [low, high] = ((self.ticks - 1) as u16).to_le_bytes();
        asm.op(AvrOpKind::Ldi, &[24, low.into()]);
        asm.op(AvrOpKind::Ldi, &[25, high.into()]);
        subtract(asm, fraction.numerator);
        let same = asm.new_label();
        asm.jump(super::arch::AvrJump::If(AvrOpKind::Brcc), same);
        subtract(asm, fraction.denominator.wrapping_neg());
        asm.op(AvrOpKind::Adiw, &[24, 1]);
        asm.place_label(same);
        registers::write(asm, regs.addr(&["OCR1AH"]), 25);
        registers::write(asm, regs.addr(&["OCR1AL"]), 24);
        if let AvrCellPlace::Ram(addr) = layout.fraction {
            (0..bytes).for_each(|n| layout.store(asm, addr + n as u16, 18 + n));
        }
    }
}
