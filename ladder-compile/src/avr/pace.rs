//! One scan per match of timer 1 in CTC mode, the k-th match at floor(k P), P being the cycle time in clocks.
//!
//! The timer counts ticks of `prescale` clocks. Where P is a whole number of ticks, the compare register is set once. Where it
//! is not, the code carries the fraction: after each match it decides whether the next period has one tick more, as
//! a line is drawn on a grid (Bresenham), so that the error never grows beyond one tick.

use emu_avr::isa::Kind;

use super::emit::{Asm, Mark};
use super::select::Regs;
use crate::map::Ratio;

/// Clocks from the reset of the prescaler to the start of the timer: the STS that selects the clock.
const LEAD: u64 = 2;

/// Prescalers and their clock select bits (DS40002061, table 16-5).
const PRESCALERS: [(u32, u8); 5] = [(1, 1), (8, 2), (64, 3), (256, 4), (1024, 5)];

/// Most ticks of one period: the compare register holds one less, in 16 bits.
const MOST_TICKS: u128 = 65536;

/// How the timer is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    /// P in clocks.
    pub period: Ratio,
    /// Clocks per tick.
    pub prescale: u32,
    /// Clock select bits.
    pub select: u8,
    /// Ticks of a period, rounded down.
    pub ticks: u32,
    /// What is missing, where something is.
    pub fraction: Option<Fraction>,
    /// Ticks of the first period.
    pub first: u32,
}

/// A period is `rest / whole` ticks longer than [`Pace::ticks`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fraction {
    /// Numerator.
    pub rest: u32,
    /// Denominator.
    pub whole: u32,
    /// What the count-down holds after it has decided on the first period: always below `whole`; a period is one tick longer
    /// when taking `rest` away borrows.
    pub start: u32,
    /// Bytes of the count-down.
    pub bytes: u16,
}

/// Why a cycle time cannot be paced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoPace {
    /// Zero.
    Zero,
    /// Longer than so many microseconds.
    Longer(u64),
}

/// Chooses the finest tick with which a period fits.
///
/// # Errors
/// The cycle is zero, or longer than the timer can pace.
pub fn pace(clock_hz: u64, cycle_us: u64) -> Result<Pace, NoPace> {
    if cycle_us == 0 || clock_hz == 0 {
        return Err(NoPace::Zero);
    }
    let (num, den) = reduced(u128::from(clock_hz) * u128::from(cycle_us), 1_000_000);
    for (prescale, select) in PRESCALERS {
        let (all, whole) = reduced(num, den * u128::from(prescale));
        let (ticks, rest) = (all / whole, all % whole);
        if all.div_ceil(whole) > MOST_TICKS || ticks == 0 {
            continue;
        }
        let mut first = ticks;
        let mut fraction = None;
        if rest != 0 {
            // The prescaler is LEAD clocks ahead of the timer, so every match comes that much early; the count-down starts
            // with as much of a tick in hand.
            let lead = if prescale == 1 { 0 } else { u128::from(LEAD) * whole / u128::from(prescale) };
            let before = whole - 1 - lead;
            let start = if before < rest { before + whole - rest } else { before - rest };
            first += u128::from(before < rest);
            let bytes = (128 - (whole - 1).leading_zeros()).div_ceil(8);
            fraction =
                Some(Fraction { rest: rest as u32, whole: whole as u32, start: start as u32, bytes: bytes as u16 });
        }
        return Ok(Pace {
            period: Ratio { num: num as u64, den: den as u64 },
            prescale,
            select,
            ticks: ticks as u32,
            fraction,
            first: first as u32,
        });
    }
    let slowest = PRESCALERS.last().map_or(1, |&(prescale, _)| prescale);
    Err(NoPace::Longer((MOST_TICKS * u128::from(slowest) * 1_000_000 / u128::from(clock_hz)) as u64))
}

fn reduced(num: u128, den: u128) -> (u128, u128) {
    let (mut a, mut b) = (num, den);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    (num / a, den / a)
}

impl Pace {
    /// Clocks of the shortest period.
    #[must_use]
    pub fn shortest(&self) -> u64 {
        u64::from(self.ticks) * u64::from(self.prescale)
    }

    /// Starts the timer; its registers are as reset leaves them.
    pub fn start(&self, asm: &mut Asm, regs: &Regs, fraction_at: u16) {
        const CTC: i32 = 1 << 3;
        const PRESCALER_RESET: i32 = 1;
        if let Some(fraction) = self.fraction {
            for (n, byte) in fraction.start.to_le_bytes().into_iter().take(fraction.bytes.into()).enumerate() {
                asm.op(Kind::Ldi, &[24, i32::from(byte)]);
                asm.op(Kind::Sts, &[24, i32::from(fraction_at) + n as i32]);
            }
        }
        let [low, high] = ((self.first - 1) as u16).to_le_bytes();
        asm.op(Kind::Ldi, &[24, i32::from(high)]);
        asm.op(Kind::Sts, &[24, regs.data("OCR1AH")]);
        asm.op(Kind::Ldi, &[24, i32::from(low)]);
        asm.op(Kind::Sts, &[24, regs.data("OCR1AL")]);
        asm.op(Kind::Ldi, &[24, PRESCALER_RESET]);
        asm.op(Kind::Ldi, &[25, CTC | i32::from(self.select)]);
        asm.op(Kind::Out, &[regs.io("GTCCR"), 24]);
        asm.mark(Mark::TimerStart);
        asm.op(Kind::Sts, &[25, regs.data("TCCR1B")]);
    }

    /// Just after a match: the length of the period that has begun, where the periods differ.
    pub fn next(&self, asm: &mut Asm, regs: &Regs, fraction_at: u16) {
        let Some(fraction) = self.fraction else { return };
        let reg = |n: usize| 18 + n as i32;
        let bytes = usize::from(fraction.bytes);
        let subtract = |asm: &mut Asm, value: u32| {
            for (n, byte) in value.to_le_bytes().into_iter().take(bytes).enumerate() {
                asm.op(if n == 0 { Kind::Subi } else { Kind::Sbci }, &[reg(n), i32::from(byte)]);
            }
        };
        (0..bytes).for_each(|n| asm.op(Kind::Lds, &[reg(n), i32::from(fraction_at) + n as i32]));
        let [low, high] = ((self.ticks - 1) as u16).to_le_bytes();
        asm.op(Kind::Ldi, &[24, i32::from(low)]);
        asm.op(Kind::Ldi, &[25, i32::from(high)]);
        subtract(asm, fraction.rest);
        let same = asm.label();
        asm.branch(Kind::Brcc, same);
        subtract(asm, fraction.whole.wrapping_neg());
        asm.op(Kind::Adiw, &[24, 1]);
        asm.place(same);
        asm.op(Kind::Sts, &[25, regs.data("OCR1AH")]);
        asm.op(Kind::Sts, &[24, regs.data("OCR1AL")]);
        (0..bytes).for_each(|n| asm.op(Kind::Sts, &[reg(n), i32::from(fraction_at) + n as i32]));
    }
}
