//! Paces scans with a timer: one scan per match, the k-th match at floor(k P), where P is the cycle time in
//! machine cycles.
//!
//! - Timer 2, if its prescaler, period and postscaler make P exactly and PWM does not use it. It needs no
//!   code at run time.
//! - Otherwise timer 1, reset by the special event of CCP1. The event comes one count after the match, so a
//!   period has CCPR1 + 1 counts (DS33023, 14.5.3). If P is not a whole number of counts, the code carries
//!   the fraction: after each match it decides whether the period that has begun is one count longer. The
//!   error never exceeds one count.
//! - If PWM uses CCP1, or P is too long for it, timer 1 alone, extended in RAM ([`super::timer_extension`]).

use emu_pic16::isa::Pic16OpKind;
use emu_pic16::periph::map::Sfr;

use super::select::Pic16Selector;
use super::timer_extension;
use super::writer::{C, Pic16Writer, STATUS};
use crate::map::Ratio;
use crate::period::{PeriodRange, ReducedFraction, reduce_fraction};
use crate::target::CodeMark;

/// Machine cycles from the write of TMR1L, which clears the prescaler, to the start of the timer.
const TIMER_START_CYCLES: u64 = 2;

/// Settings of the pacing timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pic16Pacing {
    /// P in machine cycles.
    pub period: Ratio,
    /// Machine cycles per count.
    pub prescale: u32,
    /// Counts per period, rounded down.
    pub ticks: u32,
    /// Timer in use.
    pub timer: PacingTimer,
}

/// The timer that paces scans, with its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PacingTimer {
    /// Timer 2: PR2, and the number of timer periods per match.
    Timer2(u8, u8),
    /// Timer 1 with CCP1: counts of the first period, and the fraction if P is not a whole number of counts.
    Timer1(u32, Option<Pic16PeriodFraction>),
    /// Timer 1 from overflow to overflow, extended by this many bytes of RAM, and the fraction if P is not a
    /// whole number.
    Extended(u8, Option<Pic16PeriodFraction>),
}

/// Timers that no other function needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FreeTimers {
    /// True if timer 2 is free.
    pub timer2: bool,
    /// True if the CCP1 module is free.
    pub ccp1: bool,
}

impl FreeTimers {
    /// Timers that PWM outputs with these CCP modules leave free: each of them uses timer 2.
    #[must_use]
    pub fn free_beside_pwm(modules: &[u8]) -> FreeTimers {
        FreeTimers { timer2: modules.is_empty(), ccp1: !modules.contains(&1) }
    }
}

/// The fraction of a count, `numerator / denominator`, by which a period is longer than
/// [`Pic16Pacing::ticks`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pic16PeriodFraction {
    /// Numerator.
    pub numerator: u32,
    /// Denominator.
    pub denominator: u32,
    /// Initial value of the remainder counter, after the decision for the first period; always below
    /// `denominator`.
    ///
    /// After each match the code subtracts `numerator`; if this borrows, the period is one count longer and
    /// `denominator` is added.
    pub start: u32,
    /// Width of the remainder counter in bytes.
    pub bytes: u8,
}

/// Chooses the timer and the finest count for which a period fits.
///
/// # Errors
/// The possible periods, if this one is not among them.
pub fn plan_pacing(clock_hz: u64, cycle_us: u64, free: FreeTimers) -> Result<Pic16Pacing, PeriodRange> {
    // With one more count, CCPR1 would equal the start value of the timer.
    const MOST: u128 = 65535;
    let ReducedFraction { num, den } = reduce_fraction(u128::from(clock_hz) * u128::from(cycle_us), 4_000_000);
    let period = Ratio { num: num as u64, den: den as u64 };
    if free.timer2 && den == 1 {
        for prescale in [1u128, 4, 16] {
            let whole = |post: &u128| num % (prescale * post) == 0 && (1..=256).contains(&(num / (prescale * post)));
            if let Some(post) = (1..=16u128).find(whole) {
                let by = PacingTimer::Timer2((num / (prescale * post) - 1) as u8, post as u8);
                return Ok(Pic16Pacing {
                    period,
                    prescale: prescale as u32,
                    ticks: (num / prescale) as u32,
                    timer: by,
                });
            }
        }
    }
    for prescale in [1u64, 2, 4, 8].into_iter().filter(|_| free.ccp1) {
        let ReducedFraction { num: all, den: whole } = reduce_fraction(num, den * u128::from(prescale));
        let (ticks, rest) = (all / whole, all % whole);
        if all.div_ceil(whole) > MOST || ticks < 2 || whole > 1 << 31 {
            continue;
        }
        let (mut first, mut fraction) = (ticks, None);
        if rest != 0 {
            // The prescaler is ahead of the timer, so every match is early by that much; the remainder
            // counter starts with the corresponding part of a count.
            let lead = u128::from(TIMER_START_CYCLES % prescale) * whole / u128::from(prescale);
            let before = whole - 1 - lead;
            let start = if before < rest { before + whole - rest } else { before - rest };
            first += u128::from(before < rest);
            let bytes = count_down_bytes(whole);
            fraction = Some(Pic16PeriodFraction {
                numerator: rest as u32,
                denominator: whole as u32,
                start: start as u32,
                bytes,
            });
        }
        let by = PacingTimer::Timer1(first as u32, fraction);
        return Ok(Pic16Pacing { period, prescale: prescale as u32, ticks: ticks as u32, timer: by });
    }
    let (ticks, rest) = (num / den, num % den);
    if !(timer_extension::MIN_PERIOD_CYCLES..timer_extension::MAX_PERIOD_CYCLES).contains(&ticks) || den > 1 << 31 {
        let (us, hz) = (|cycles: u128| cycles * 4_000_000, u128::from(clock_hz.max(1)));
        let fewest = if free.ccp1 { 2 } else { timer_extension::MIN_PERIOD_CYCLES };
        // A period of MOST machine cycles is one too many.
        return Err(PeriodRange {
            shortest_us: us(fewest).div_ceil(hz) as u64,
            longest_us: ((us(timer_extension::MAX_PERIOD_CYCLES) - 1) / hz) as u64,
        });
    }
    let (rest, whole) = (rest as u32, den as u32);
    // The first period is a short one, so its remainder is below the denominator.
    let fraction = (rest != 0).then(|| Pic16PeriodFraction {
        numerator: rest,
        denominator: whole,
        start: whole - 1 - rest,
        bytes: count_down_bytes(den),
    });
    let by = PacingTimer::Extended(timer_extension::extension_bytes(ticks), fraction);
    Ok(Pic16Pacing { period, prescale: 1, ticks: ticks as u32, timer: by })
}

/// Width in bytes of a remainder counter that stays below `whole`.
fn count_down_bytes(whole: u128) -> u8 {
    (128 - (whole - 1).leading_zeros()).div_ceil(8) as u8
}

impl Pic16Pacing {
    /// Shortest period in machine cycles.
    #[must_use]
    pub fn shortest(&self) -> u64 {
        u64::from(self.ticks) * u64::from(self.prescale)
    }

    /// Width of the remainder counter in bytes; 0 without one.
    #[must_use]
    pub fn bytes(&self) -> u8 {
        if let PacingTimer::Timer1(_, Some(fraction)) | PacingTimer::Extended(_, Some(fraction)) = self.timer {
            fraction.bytes
        } else {
            0
        }
    }

    /// Number of bytes of RAM that extend the timer.
    #[must_use]
    pub fn extension(&self) -> u8 {
        if let PacingTimer::Extended(bytes, _) = self.timer { bytes } else { 0 }
    }

    /// Maximum number of machine cycles from a match to its scan.
    ///
    /// It covers one iteration of the poll loop that just missed the match and the test that detects it. Each
    /// byte that extends the timer adds a skip, and the flag is cleared first.
    #[must_use]
    pub fn poll(&self) -> u64 {
        let bytes = u64::from(self.extension());
        5 + if bytes > 0 { 1 + 2 * bytes } else { 0 }
    }

    /// Name of the flag that signals a match.
    #[must_use]
    pub fn flag(&self) -> &'static str {
        match self.timer {
            PacingTimer::Timer2(..) => "TMR2IF",
            PacingTimer::Timer1(..) => "CCP1IF",
            PacingTimer::Extended(..) => "TMR1IF",
        }
    }

    /// Emits the set-up of registers in bank 1.
    pub fn prepare(&self, out: &mut Pic16Writer<'_>) {
        if let PacingTimer::Timer2(period, _) = self.timer
            && period != 0xFF
        {
            out.set_byte(out.chip.reg(Sfr::PR2), period);
        }
    }

    /// Emits the start of the timer.
    pub fn start(&self, out: &mut Pic16Writer<'_>, fraction_at: u16, extension_at: u16) {
        let chip = out.chip;
        if let PacingTimer::Timer1(_, Some(fraction)) | PacingTimer::Extended(_, Some(fraction)) = self.timer {
            for (at, k) in (fraction_at..).zip(fraction.start.to_le_bytes()).take(fraction.bytes.into()) {
                // RAM is already cleared.
                if k != 0 {
                    out.set_byte(at, k);
                }
            }
        }
        let prescale = |names: [&str; 2], code: u32| {
            let bit = |n: usize| if code >> n & 1 == 1 { chip.mask(&[names[n]]) } else { 0 };
            bit(0) | bit(1)
        };
        let (reg, control) = match self.timer {
            PacingTimer::Timer2(_, post) => {
                let code = self.prescale.trailing_zeros() / 2;
                let posts = (post - 1) << chip.bit("TOUTPS0").1;
                (Sfr::T2CON, posts | chip.mask(&["TMR2ON"]) | prescale(["T2CKPS0", "T2CKPS1"], code))
            }
            PacingTimer::Timer1(first, _) => {
                let [low, high] = ((first - 1) as u16).to_le_bytes();
                out.set_byte(chip.reg(Sfr::CCPR1L), low);
                out.set_byte(chip.reg(Sfr::CCPR1H), high);
                // 1011: special event trigger.
                out.set_byte(chip.reg(Sfr::CCP1CON), chip.mask(&["CCP1M3", "CCP1M1", "CCP1M0"]));
                // Start one before 0: the first count of the period then makes it 0.
                out.set_byte(chip.reg(Sfr::TMR1H), 0xFF);
                out.set_byte(chip.reg(Sfr::TMR1L), 0xFF);
                let code = self.prescale.trailing_zeros();
                (Sfr::T1CON, chip.mask(&["TMR1ON"]) | prescale(["T1CKPS0", "T1CKPS1"], code))
            }
            PacingTimer::Extended(bytes, _) => {
                timer_extension::prepare_extension(out, self.ticks, bytes, extension_at);
                (Sfr::T1CON, chip.mask(&["TMR1ON"]))
            }
        };
        let at = chip.reg(reg);
        out.select_bank(chip.reachable_banks(at));
        out.load_w(control);
        out.mark(CodeMark::TimerStart);
        out.byte_op(Pic16OpKind::Movwf, at);
    }
}

impl Pic16Selector<'_, '_> {
    /// Emits the code just after a match: sets the length of the period that has begun, if the periods
    /// differ.
    pub fn next_period(&mut self, pace: &Pic16Pacing) {
        let fraction = match pace.timer {
            PacingTimer::Extended(bytes, fraction) => return self.next_extended(pace.ticks, bytes, fraction),
            PacingTimer::Timer1(_, Some(fraction)) => fraction,
            _ => return,
        };
        // The special event comes one count after the match, and CCPR1 must not change before it.
        for _ in 0..pace.prescale / 2 {
            let next = self.out.label();
            self.out.goto(next);
            self.out.place(next);
        }
        let at = self.layout.fraction;
        self.add_constant(at, fraction.bytes, (fraction.numerator as i32).wrapping_neg(), true);
        let registers = [self.out.chip.reg(Sfr::CCPR1L), self.out.chip.reg(Sfr::CCPR1H)];
        let (short, long) = (((pace.ticks - 1) as u16).to_le_bytes(), (pace.ticks as u16).to_le_bytes());
        for ((reg, short), long) in registers.into_iter().zip(short).zip(long) {
            if short != long {
                self.out.select_bank(self.out.chip.reachable_banks(reg));
                self.out.literal_op(Pic16OpKind::Movlw, short);
                self.out.skip_unless((STATUS, C), false);
                self.out.literal_op(Pic16OpKind::Movlw, long);
                self.out.byte_op(Pic16OpKind::Movwf, reg);
            }
        }
        self.refill_count_down(fraction, |_| ());
    }

    /// If the remainder counter has borrowed, executes `longer` and adds the denominator.
    pub(super) fn refill_count_down(
        &mut self,
        fraction: Pic16PeriodFraction,
        longer: impl FnOnce(&mut Pic16Writer<'_>),
    ) {
        let enough = self.out.label();
        self.out.skip_unless((STATUS, C), true);
        self.out.goto(enough);
        longer(&mut self.out);
        self.add_constant(self.layout.fraction, fraction.bytes, fraction.denominator as i32, false);
        self.out.place(enough);
    }
}
