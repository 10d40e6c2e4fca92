//! One scan per match of a timer, the k-th match at floor(k P), P being the cycle time in machine cycles.
//!
//! Timer 2 where its prescaler, period and postscaler make P exactly and no PWM needs it: nothing is left to do at run time.
//! Else timer 1, reset by the special event of CCP1. The event comes with the count after the match, so a period is
//! CCPR1 + 1 counts (DS33023, 14.5.3). Where P is no whole number of counts, the code carries the fraction: after each
//! match it decides whether the period that has begun has one count more, so that the error never grows beyond one.
//! Where CCP1 makes the pulse of a PWM output, or P is longer than it counts, timer 1 alone, lengthened in RAM ([`super::extend`]).

use emu_pic16::isa::Kind;
use emu_pic16::periph::map::Sfr;

use super::out::{C, Out, STATUS};
use super::select::Select;
use super::{chip::Silicon, extend};
use crate::map::Ratio;
use crate::target::Mark;

/// Machine cycles from the write of TMR1L, which clears the prescaler, to the start of the timer.
const LEAD: u64 = 2;

/// How the timer is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    /// P in machine cycles.
    pub period: Ratio,
    /// Machine cycles of a count.
    pub prescale: u32,
    /// Counts of a period, rounded down.
    pub ticks: u32,
    /// The timer.
    pub by: By,
}

/// The timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// Timer 2: PR2 and periods to a match.
    Timer2(u8, u8),
    /// Timer 1 and CCP1: counts of the first period, and what is missing where something is.
    Timer1(u32, Option<Fraction>),
    /// Timer 1 from overflow to overflow, lengthened by so many bytes of RAM; and what is missing where something is.
    Extended(u8, Option<Fraction>),
}

/// What nothing else needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Free {
    /// Timer 2.
    pub timer2: bool,
    /// The module CCP1.
    pub ccp1: bool,
}

impl Free {
    /// What a program leaves free that uses PWM, or does not: timer 2 and the last CCP module make the pulse.
    #[must_use]
    pub fn beside(pwm: bool, chip: &Silicon) -> Free {
        Free { timer2: !pwm, ccp1: !pwm || chip.has_bit("CCP2M3") }
    }
}

/// A period is `rest / whole` counts longer than [`Pace::ticks`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fraction {
    /// Numerator.
    pub rest: u32,
    /// Denominator.
    pub whole: u32,
    /// What the count-down holds after it has decided on the first period: always below `whole`; a period is one count longer
    /// when taking `rest` away borrows.
    pub start: u32,
    /// Bytes of the count-down.
    pub bytes: u8,
}

/// Chooses the timer and the finest count with which a period fits.
///
/// # Errors
/// Shortest and longest period in microseconds.
pub fn pace(clock_hz: u64, cycle_us: u64, free: Free) -> Result<Pace, (u64, u64)> {
    // With one more, CCPR1 would be what the timer starts from.
    const MOST: u128 = 65535;
    let (num, den) = reduced(u128::from(clock_hz) * u128::from(cycle_us), 4_000_000);
    let period = Ratio { num: num as u64, den: den as u64 };
    if free.timer2 && den == 1 {
        for prescale in [1u128, 4, 16] {
            let whole = |post: &u128| num % (prescale * post) == 0 && (1..=256).contains(&(num / (prescale * post)));
            if let Some(post) = (1..=16u128).find(whole) {
                let by = By::Timer2((num / (prescale * post) - 1) as u8, post as u8);
                return Ok(Pace { period, prescale: prescale as u32, ticks: (num / prescale) as u32, by });
            }
        }
    }
    for prescale in [1u64, 2, 4, 8].into_iter().filter(|_| free.ccp1) {
        let (all, whole) = reduced(num, den * u128::from(prescale));
        let (ticks, rest) = (all / whole, all % whole);
        if all.div_ceil(whole) > MOST || ticks < 2 || whole > 1 << 31 {
            continue;
        }
        let (mut first, mut fraction) = (ticks, None);
        if rest != 0 {
            // The prescaler is ahead of the timer, so every match comes that much early; the count-down starts with as much
            // of a count in hand.
            let lead = u128::from(LEAD % prescale) * whole / u128::from(prescale);
            let before = whole - 1 - lead;
            let start = if before < rest { before + whole - rest } else { before - rest };
            first += u128::from(before < rest);
            let bytes = bytes_for(whole);
            fraction = Some(Fraction { rest: rest as u32, whole: whole as u32, start: start as u32, bytes });
        }
        let by = By::Timer1(first as u32, fraction);
        return Ok(Pace { period, prescale: prescale as u32, ticks: ticks as u32, by });
    }
    let (ticks, rest) = (num / den, num % den);
    if !(extend::FEWEST..extend::MOST).contains(&ticks) || den > 1 << 31 {
        let (us, hz) = (|cycles: u128| cycles * 4_000_000, u128::from(clock_hz.max(1)));
        let fewest = if free.ccp1 { 2 } else { extend::FEWEST };
        // A period of MOST machine cycles is one too many.
        return Err((us(fewest).div_ceil(hz) as u64, ((us(extend::MOST) - 1) / hz) as u64));
    }
    let (rest, whole) = (rest as u32, den as u32);
    // The first period is the short one: what is left of it is below the whole.
    let fraction = (rest != 0).then(|| Fraction { rest, whole, start: whole - 1 - rest, bytes: bytes_for(den) });
    let by = By::Extended(extend::bytes(ticks), fraction);
    Ok(Pace { period, prescale: 1, ticks: ticks as u32, by })
}

/// Bytes of a count-down that stays below `whole`.
fn bytes_for(whole: u128) -> u8 {
    (128 - (whole - 1).leading_zeros()).div_ceil(8) as u8
}

fn reduced(num: u128, den: u128) -> (u128, u128) {
    let (mut a, mut b) = (num, den);
    while b != 0 {
        (a, b) = (b, a % b);
    }
    (num / a.max(1), den / a.max(1))
}

impl Pace {
    /// Machine cycles of the shortest period.
    #[must_use]
    pub fn shortest(&self) -> u64 {
        u64::from(self.ticks) * u64::from(self.prescale)
    }

    /// Bytes of RAM for the count-down.
    #[must_use]
    pub fn bytes(&self) -> u8 {
        if let By::Timer1(_, Some(fraction)) | By::Extended(_, Some(fraction)) = self.by { fraction.bytes } else { 0 }
    }

    /// Bytes of RAM that lengthen the timer.
    #[must_use]
    pub fn extension(&self) -> u8 {
        if let By::Extended(bytes, _) = self.by { bytes } else { 0 }
    }

    /// The longest time in machine cycles from a match to its scan: one turn of the loop that just missed the match, and the
    /// look that sees it; each byte that lengthens the timer adds a skip, and the flag is cleared before.
    #[must_use]
    pub fn poll(&self) -> u64 {
        let bytes = u64::from(self.extension());
        5 + if bytes > 0 { 1 + 2 * bytes } else { 0 }
    }

    /// The flag of a match.
    #[must_use]
    pub fn flag(&self) -> &'static str {
        match self.by {
            By::Timer2(..) => "TMR2IF",
            By::Timer1(..) => "CCP1IF",
            By::Extended(..) => "TMR1IF",
        }
    }

    /// Registers of bank 1.
    pub fn prepare(&self, out: &mut Out<'_>) {
        if let By::Timer2(period, _) = self.by
            && period != 0xFF
        {
            out.set(out.chip.reg(Sfr::PR2), period);
        }
    }

    /// Starts the timer.
    pub fn start(&self, out: &mut Out<'_>, fraction_at: u16, extension_at: u16) {
        let chip = out.chip;
        if let By::Timer1(_, Some(fraction)) | By::Extended(_, Some(fraction)) = self.by {
            for (at, k) in (fraction_at..).zip(fraction.start.to_le_bytes()).take(fraction.bytes.into()) {
                // RAM is clear already.
                if k != 0 {
                    out.set(at, k);
                }
            }
        }
        let prescale = |names: [&str; 2], code: u32| {
            let bit = |n: usize| if code >> n & 1 == 1 { chip.mask(&[names[n]]) } else { 0 };
            bit(0) | bit(1)
        };
        let (reg, control) = match self.by {
            By::Timer2(_, post) => {
                let code = self.prescale.trailing_zeros() / 2;
                let posts = (post - 1) << chip.bit("TOUTPS0").1;
                (Sfr::T2CON, posts | chip.mask(&["TMR2ON"]) | prescale(["T2CKPS0", "T2CKPS1"], code))
            }
            By::Timer1(first, _) => {
                let [low, high] = ((first - 1) as u16).to_le_bytes();
                out.set(chip.reg(Sfr::CCPR1L), low);
                out.set(chip.reg(Sfr::CCPR1H), high);
                // 1011: special event.
                out.set(chip.reg(Sfr::CCP1CON), chip.mask(&["CCP1M3", "CCP1M1", "CCP1M0"]));
                // One before 0: the first count of the period is the one that makes it 0.
                out.set(chip.reg(Sfr::TMR1H), 0xFF);
                out.set(chip.reg(Sfr::TMR1L), 0xFF);
                let code = self.prescale.trailing_zeros();
                (Sfr::T1CON, chip.mask(&["TMR1ON"]) | prescale(["T1CKPS0", "T1CKPS1"], code))
            }
            By::Extended(bytes, _) => {
                extend::prepare(out, self.ticks, bytes, extension_at);
                (Sfr::T1CON, chip.mask(&["TMR1ON"]))
            }
        };
        let at = chip.reg(reg);
        out.select(chip.reach(at));
        out.load(control);
        out.mark(Mark::TimerStart);
        out.f(Kind::Movwf, at);
    }
}

impl Select<'_, '_> {
    /// Just after a match: the length of the period that has begun, where the periods differ.
    pub fn next_period(&mut self, pace: &Pace) {
        let fraction = match pace.by {
            By::Extended(bytes, fraction) => return self.next_extended(pace.ticks, bytes, fraction),
            By::Timer1(_, Some(fraction)) => fraction,
            _ => return,
        };
        // The special event comes one count after the match, and CCPR1 must not change before.
        for _ in 0..pace.prescale / 2 {
            let next = self.out.label();
            self.out.goto(next);
            self.out.place(next);
        }
        let at = self.layout.fraction;
        self.add_constant(at, fraction.bytes, (fraction.rest as i32).wrapping_neg(), true);
        let registers = [self.out.chip.reg(Sfr::CCPR1L), self.out.chip.reg(Sfr::CCPR1H)];
        let (short, long) = (((pace.ticks - 1) as u16).to_le_bytes(), (pace.ticks as u16).to_le_bytes());
        for ((reg, short), long) in registers.into_iter().zip(short).zip(long) {
            if short != long {
                self.out.select(self.out.chip.reach(reg));
                self.out.lit(Kind::Movlw, short);
                self.out.only_if((STATUS, C), false);
                self.out.lit(Kind::Movlw, long);
                self.out.f(Kind::Movwf, reg);
            }
        }
        self.refill(fraction, |_| ());
    }

    /// Where the count-down borrowed: does `longer`, and adds the whole to it.
    pub(super) fn refill(&mut self, fraction: Fraction, longer: impl FnOnce(&mut Out<'_>)) {
        let enough = self.out.label();
        self.out.only_if((STATUS, C), true);
        self.out.goto(enough);
        longer(&mut self.out);
        self.add_constant(self.layout.fraction, fraction.bytes, fraction.whole as i32, false);
        self.out.place(enough);
    }
}
