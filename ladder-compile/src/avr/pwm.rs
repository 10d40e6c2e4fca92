//! PWM output with timer 2: the timer counts through all 256 values, up or up and down, and OCR2 controls its
//! pin.

use emu_avr::isa::Kind;
use emu_avr::periph::timers::ClockTap;

use super::arch::{AvrCodeWriter, AvrJump};
use super::registers::{self, A, AvrRegisters, LOW_ZERO, SCRATCH, ZERO};
use crate::target::{BuildRefusal, CompileJob};

/// Settings of timer 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrPwmSetup {
    /// Clock select bits.
    select: u8,
    /// Clocks per tick.
    prescale: u16,
    /// True for phase-correct PWM (the timer counts up and down), false for fast PWM (it counts up).
    phase: bool,
}

/// Ticks per period of fast PWM; below, of phase-correct PWM.
const FAST_PERIOD_TICKS: u64 = 256;
const PHASE_CORRECT_PERIOD_TICKS: u64 = 510;

impl AvrPwmSetup {
    /// Clocks per period.
    #[must_use]
    pub fn period(&self) -> u64 {
        u64::from(self.prescale) * if self.phase { PHASE_CORRECT_PERIOD_TICKS } else { FAST_PERIOD_TICKS }
    }

    /// Number of steps of the duty cycle.
    #[must_use]
    pub fn steps(&self) -> u32 {
        if self.phase { 255 } else { 256 }
    }

    /// Value of OCR2 for a duty cycle of 0 to 100 percent.
    ///
    /// `None` if the pin must be low but OCR2 cannot express it: fast PWM is high for at least one tick.
    fn compare(&self, percent: i32) -> Option<i32> {
        match (self.phase, percent) {
            (false, 0) => None,
            _ => Some(((percent * self.factor()) >> 8) - i32::from(!self.phase)),
        }
    }

    /// Steps per percent times 256, rounded so that 100 percent gives all steps.
    fn factor(&self) -> i32 {
        if self.phase { 653 } else { 656 }
    }
}

/// Chooses the setting nearest to the frequency that the program requests.
///
/// # Errors
/// The nearest frequency is more than 5 % off.
pub fn plan_pwm(job: &CompileJob<'_>, taps: &[ClockTap]) -> Result<Option<AvrPwmSetup>, BuildRefusal> {
    let Some(hertz) = job.ir.pwm_hz.map(u64::from) else { return Ok(None) };
    let clock = job.clock_hz;
    let settings = taps.iter().zip(0..).filter_map(|(tap, select)| match tap {
        ClockTap::Div(prescale) => Some((*prescale, select)),
        _ => None,
    });
    let settings =
        settings.flat_map(|(prescale, select)| [false, true].map(|phase| AvrPwmSetup { select, prescale, phase }));
    // |clock / period - hertz|, with a denominator that is a multiple of all periods.
    let off = |pwm: &AvrPwmSetup| u128::from(clock.abs_diff(hertz.saturating_mul(pwm.period())));
    let best = settings.min_by_key(|pwm| off(pwm) * (1 << 40) / u128::from(pwm.period()));
    let Some(best) = best else { return Err(BuildRefusal::PwmOutOfRange { nearest: 0 }) };
    if off(&best) * 20 > u128::from(hertz) * u128::from(best.period()) {
        return Err(BuildRefusal::PwmOutOfRange { nearest: (2 * clock / best.period()).div_ceil(2) });
    }
    Ok(Some(best))
}

/// Mode register: TCCR2 on older chips, TCCR2A on the others.
const MODE: &[&str] = &["TCCR2A", "TCCR2"];
const COMPARE: &[&str] = &["OCR2A", "OCR2"];
/// Holds MODE while the duty cycle is computed.
const MODE_WORK_REGISTER: i32 = registers::BYTE;

impl AvrPwmSetup {
    /// Value of MODE with the pin driven by the timer, or by its port.
    fn mode(&self, regs: &AvrRegisters, driven: bool) -> i32 {
        let mut bits: Vec<&[&str]> = vec![&["WGM20"]];
        if !self.phase {
            bits.push(&["WGM21"]);
        }
        if driven {
            bits.push(&["COM2A1", "COM21"]);
        }
        let clock = if regs.has("TCCR2B") { 0 } else { i32::from(self.select) };
        regs.mask(&bits) | clock
    }

    /// Emits the start of the timer with the pin low.
    pub fn start(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters) {
        registers::write_constant(asm, regs.addr(MODE), self.mode(regs, false), 24);
        if regs.has("TCCR2B") {
            registers::write_constant(asm, regs.addr(&["TCCR2B"]), self.select.into(), 24);
        }
    }

    /// Emits the setting of a constant duty cycle in percent.
    pub fn set_constant_duty(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, duty: i32) {
        let compare = self.compare(duty.clamp(0, 100));
        if let Some(compare) = compare {
            registers::write_constant(asm, regs.addr(COMPARE), compare, SCRATCH);
        }
        registers::write_constant(asm, regs.addr(MODE), self.mode(regs, compare.is_some()), SCRATCH);
    }

    /// Emits the setting of the duty cycle to the lowest `bytes` bytes of A, which are destroyed.
    pub fn set_variable_duty(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, bytes: usize) {
        let in_range = asm.new_label();
        let low = A[0];
        let high = A.into_iter().take(bytes).next_back().unwrap_or(low);
        asm.op(Kind::Cpi, &[low, 101]);
        A.into_iter().take(bytes).skip(1).for_each(|reg| asm.op(Kind::Cpc, &[reg, ZERO]));
        asm.jump(AvrJump::If(Kind::Brlt), in_range);
        asm.op(Kind::Ldi, &[low, 100]);
        asm.place_label(in_range);
        asm.op(Kind::Sbrc, &[high, 7]);
        asm.op(Kind::Ldi, &[low, 0]);
        if !self.phase {
            let driven = asm.new_label();
            asm.op(Kind::Ldi, &[MODE_WORK_REGISTER, self.mode(regs, true)]);
            asm.op(Kind::And, &[low, low]);
            asm.jump(AvrJump::If(Kind::Brne), driven);
            asm.op(Kind::Ldi, &[MODE_WORK_REGISTER, self.mode(regs, false)]);
            asm.place_label(driven);
        }
        // The factor exceeds 512; MUL multiplies by the excess, and two additions add the rest.
        asm.op(Kind::Ldi, &[SCRATCH, self.factor() - 512]);
        asm.op(Kind::Mul, &[low, SCRATCH]);
        asm.op(Kind::Add, &[low, low]);
        asm.op(Kind::Add, &[low, ZERO]);
        if !self.phase {
            asm.op(Kind::Dec, &[low]);
        }
        asm.op(Kind::Eor, &[ZERO, ZERO]);
        asm.op(Kind::Eor, &[LOW_ZERO, LOW_ZERO]);
        registers::write(asm, regs.addr(COMPARE), low);
        if self.phase {
            registers::write_constant(asm, regs.addr(MODE), self.mode(regs, true), SCRATCH);
        } else {
            registers::write(asm, regs.addr(MODE), MODE_WORK_REGISTER);
        }
    }
}
