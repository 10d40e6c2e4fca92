//! PWM outputs with timers 0 and 2: a timer counts through all 256 values, up or up and down, and each of its
//! compare registers controls a pin.

use emu_avr::isa::AvrOpKind;
use emu_avr::periph::timers::ClockTap;

use super::arch::{AvrCodeWriter, AvrJump};
use super::registers::{self, A, AvrRegisters, LOW_ZERO, SCRATCH, ZERO};
use crate::ir::IrPwm;
use crate::target::{BuildRefusal, CompileJob, PwmPin, check_pwm_timers};

/// Settings of a PWM output and its timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrPwmSetup {
    /// The pin with its timer and channel.
    at: PwmPin,
    /// True for the first output of its timer.
    pub starts_timer: bool,
    /// True if another output has the same timer, so that its bits of the mode register are kept.
    is_shared: bool,
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

    /// Value of the compare register for a duty cycle of 0 to 100 percent.
    ///
    /// `None` if the pin must be low but the compare register cannot express it: fast PWM is high for at
    /// least one tick.
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

/// Chooses for each output the setting nearest to the frequency that the program requests.
///
/// # Errors
/// The nearest frequency is more than 5 % off, or two outputs of a timer have different frequencies.
pub fn plan_pwm(job: &CompileJob<'_>) -> Result<Vec<AvrPwmSetup>, BuildRefusal> {
    check_pwm_timers(job)?;
    let timers = emu_avr::chips::part(job.target.chip.name).map_or(&[][..], |part| part.timers);
    let outputs: Vec<(&IrPwm, PwmPin)> = job.pwm_outputs().collect();
    let mut setups: Vec<AvrPwmSetup> = Vec::new();
    for &(output, at) in &outputs {
        let taps = timers.get(usize::from(at.timer)).map_or(&[][..], |timer| &timer.taps);
        let setup = nearest_setup(job.clock_hz, output.hertz.into(), (at, taps))?;
        let starts_timer = setups.iter().all(|other| other.at.timer != at.timer);
        let is_shared = outputs.iter().filter(|(_, of)| of.timer == at.timer).count() > 1;
        setups.push(AvrPwmSetup { starts_timer, is_shared, ..setup });
    }
    Ok(setups)
}

/// The setting of a timer nearest to a frequency; fails if that is more than 5 % off.
fn nearest_setup(clock: u64, hertz: u64, (at, taps): (PwmPin, &[ClockTap])) -> Result<AvrPwmSetup, BuildRefusal> {
    let settings = taps.iter().zip(0..).filter_map(|(tap, select)| match tap {
        ClockTap::Div(prescale) => Some((*prescale, select)),
        _ => None,
    });
    let settings = settings.flat_map(|(prescale, select)| {
        [false, true].map(|phase| AvrPwmSetup { at, starts_timer: true, is_shared: false, select, prescale, phase })
    });
    // |clock / period - hertz|, with a denominator that is a multiple of all periods.
    let off = |pwm: &AvrPwmSetup| u128::from(clock.abs_diff(hertz.saturating_mul(pwm.period())));
    let best = settings.min_by_key(|pwm| off(pwm) * (1 << 40) / u128::from(pwm.period()));
    let Some(best) = best else { return Err(BuildRefusal::PwmOutOfRange { hertz, nearest: 0 }) };
    if off(&best) * 20 > u128::from(hertz) * u128::from(best.period()) {
        return Err(BuildRefusal::PwmOutOfRange { hertz, nearest: (2 * clock / best.period()).div_ceil(2) });
    }
    Ok(best)
}

/// Holds the mode register while the duty cycle is computed.
const MODE_WORK_REGISTER: i32 = registers::BYTE;

impl AvrPwmSetup {
    /// Address of the mode register: TCCRn on older chips, TCCRnA on the others.
    fn mode_register(&self, regs: &AvrRegisters) -> i32 {
        let n = self.at.timer;
        regs.addr(&[&format!("TCCR{n}A"), &format!("TCCR{n}")])
    }

    /// Address of the compare register.
    fn compare_register(&self, regs: &AvrRegisters) -> i32 {
        let n = self.at.timer;
        match self.at.channel {
            0 => regs.addr(&[&format!("OCR{n}A"), &format!("OCR{n}")]),
            _ => regs.addr(&[&format!("OCR{n}B")]),
        }
    }

    /// Name of the register that selects the clock, where it is not the mode register.
    fn select_register(&self) -> String {
        format!("TCCR{}B", self.at.timer)
    }

    /// The bit of the mode register that connects the pin to the timer.
    fn connects(&self, regs: &AvrRegisters) -> i32 {
        let n = self.at.timer;
        match self.at.channel {
            0 => regs.mask(&[&[&format!("COM{n}A1"), &format!("COM{n}1")]]),
            _ => regs.mask(&[&[&format!("COM{n}B1")]]),
        }
    }

    /// Value of the mode register with the pin driven by the timer, or by its port.
    fn mode(&self, regs: &AvrRegisters, driven: bool) -> i32 {
        let n = self.at.timer;
        let mut bits = regs.mask(&[&[&format!("WGM{n}0")]]);
        if !self.phase {
            bits |= regs.mask(&[&[&format!("WGM{n}1")]]);
        }
        if driven {
            bits |= self.connects(regs);
        }
        let clock = if regs.has(&self.select_register()) { 0 } else { i32::from(self.select) };
        bits | clock
    }

    /// Emits the start of the timer with the pin low.
    pub fn start(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters) {
        registers::write_constant(asm, self.mode_register(regs), self.mode(regs, false), 24);
        if regs.has(&self.select_register()) {
            registers::write_constant(asm, regs.addr(&[&self.select_register()]), self.select.into(), 24);
        }
    }

    /// Emits `reg` := the mode with the pin driven by the timer, or by its port.
    fn load_mode(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, reg: i32, driven: bool) {
        if !self.is_shared {
            return asm.op(AvrOpKind::Ldi, &[reg, self.mode(regs, driven)]);
        }
        registers::read(asm, reg, self.mode_register(regs));
        match driven {
            true => asm.op(AvrOpKind::Ori, &[reg, self.connects(regs)]),
            false => asm.op(AvrOpKind::Andi, &[reg, 0xFF & !self.connects(regs)]),
        }
    }

    /// Emits the setting of a constant duty cycle in percent.
    pub fn set_constant_duty(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, duty: i32) {
        let compare = self.compare(duty.clamp(0, 100));
        if let Some(compare) = compare {
            registers::write_constant(asm, self.compare_register(regs), compare, SCRATCH);
        }
        self.load_mode(asm, regs, SCRATCH, compare.is_some());
        registers::write(asm, self.mode_register(regs), SCRATCH);
    }

    /// Emits the setting of the duty cycle to the lowest `bytes` bytes of A, which are destroyed.
    pub fn set_variable_duty(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, bytes: usize) {
        let in_range = asm.new_label();
        let low = A[0];
        let high = A.into_iter().take(bytes).next_back().unwrap_or(low);
        asm.op(AvrOpKind::Cpi, &[low, 101]);
        A.into_iter().take(bytes).skip(1).for_each(|reg| asm.op(AvrOpKind::Cpc, &[reg, ZERO]));
        asm.jump(AvrJump::If(AvrOpKind::Brlt), in_range);
        asm.op(AvrOpKind::Ldi, &[low, 100]);
        asm.place_label(in_range);
        asm.op(AvrOpKind::Sbrc, &[high, 7]);
        asm.op(AvrOpKind::Ldi, &[low, 0]);
        if !self.phase {
            let driven = asm.new_label();
            self.load_mode(asm, regs, MODE_WORK_REGISTER, true);
            asm.op(AvrOpKind::And, &[low, low]);
            asm.jump(AvrJump::If(AvrOpKind::Brne), driven);
            match self.is_shared {
                true => asm.op(AvrOpKind::Andi, &[MODE_WORK_REGISTER, 0xFF & !self.connects(regs)]),
                false => asm.op(AvrOpKind::Ldi, &[MODE_WORK_REGISTER, self.mode(regs, false)]),
            }
            asm.place_label(driven);
        }
        // The factor exceeds 512; MUL multiplies by the excess, and two additions add the rest.
        asm.op(AvrOpKind::Ldi, &[SCRATCH, self.factor() - 512]);
        asm.op(AvrOpKind::Mul, &[low, SCRATCH]);
        asm.op(AvrOpKind::Add, &[low, low]);
        asm.op(AvrOpKind::Add, &[low, ZERO]);
        if !self.phase {
            asm.op(AvrOpKind::Dec, &[low]);
        }
        asm.op(AvrOpKind::Eor, &[ZERO, ZERO]);
        asm.op(AvrOpKind::Eor, &[LOW_ZERO, LOW_ZERO]);
        registers::write(asm, self.compare_register(regs), low);
        if self.phase {
            self.load_mode(asm, regs, SCRATCH, true);
            registers::write(asm, self.mode_register(regs), SCRATCH);
        } else {
            registers::write(asm, self.mode_register(regs), MODE_WORK_REGISTER);
        }
    }
}
