//! Timer 1, timer 2 and the CCP modules (DS33023 sections 12 to 14; DS30292 and DS39582 sections 6 to 8).
//! They are in one peripheral because the modules capture timer 1, compare with it and reset it, and generate
//! pulses with timer 2.
//!
//! Decisions where the data sheets are not specific:
//!
//! - Timer 1: an edge of a synchronized external clock counts at the first cycle boundary 3 clocks or more
//!   after it, and a cycle counts at most once. TMR1ON is after the prescaler, as in the block diagram. A
//!   change of the clock path loses the edges in the synchronizer, and so does sleep. A write replaces a
//!   count, a carry and a special event at the same clock.
//! - Compare: match, flag and pin change with the count, or the write, that makes TMR1 equal to CCPRx, also
//!   in asynchronous mode. The module that resets timer 1 does so if both are equal at the next count.
//! - Capture: TMR1, CCPRx and the flag have the values at the clock of the edge, also in sleep and in
//!   asynchronous mode.
//! - PWM: the output is low from entering the mode to the next period.

mod ccp;
mod timer1;
mod timer2;

use emu_core::NEVER;

use super::map::{InterruptFlag, Pic16Line, Sfr};
use super::{Device, Pic16Drive, Pic16Outbox, Pic16Signal};
use ccp::{CcpMode, CcpModule};
use timer1::Timer1;
pub use timer1::Timer1Crystal;
use timer2::Timer2;

/// Line and flag of each of the two modules.
const MODULES: [(Pic16Line, InterruptFlag); 2] =
    [(Pic16Line::Ccp1, InterruptFlag::CCP1IF), (Pic16Line::Ccp2, InterruptFlag::CCP2IF)];

/// Timer 1, timer 2 and 0 to 2 CCP modules. They have the registers `TMR1L TMR1H T1CON TMR2 T2CON PR2` and
/// `CCPRxL CCPRxH CCPxCON`, the flags `TMR1IF TMR2IF CCP1IF CCP2IF`, and the lines `T1cki Ccp1 Ccp2`. Other
/// registers, and those of a missing module, read 0 and ignore writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Timers {
    timer1: Timer1,
    timer2: Timer2,
    ccp: [CcpModule; 2],
    ccps: usize,
    listener: bool,
    asleep: bool,
    /// Next clocks at which timer 1 and timer 2 do more than count.
    next: [u64; 2],
}

emu_core::state! { Pic16Timers { timer1, timer2, ccp, listener, asleep, next } stays { ccps } }

/// A register of a CCP module.
#[derive(Debug, Clone, Copy)]
struct CcpRegister {
    /// The index of the module.
    index: usize,
    /// The register: 0 CCPRxL, 1 CCPRxH, 2 CCPxCON.
    which: u8,
}

impl Pic16Timers {
    /// Returns the timers after power-on at clock 0, with all lines low.
    ///
    /// `ccps` is the number of CCP modules, 0 to 2; the special event of the last one starts a conversion.
    /// `crystal` is `None` if there is no crystal at T1OSI and T1OSO; a crystal faster than the oscillator
    /// counts as equally fast. The crystal oscillates while T1OSCEN is set.
    #[must_use]
    pub fn new(ccps: u8, crystal: Option<Timer1Crystal>) -> Pic16Timers {
        Pic16Timers {
            timer1: Timer1::new(crystal),
            timer2: Timer2::new(0),
            ccp: Default::default(),
            ccps: usize::from(ccps).min(2),
            listener: false,
            asleep: false,
            next: [NEVER; 2],
        }
    }

    /// Sets whether every end of a timer 2 period after `t` sends [`Pic16Signal::Timer2`]; the clock of the
    /// SSP has half that frequency.
    pub fn set_timer2_listener(&mut self, on: bool, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.settle(t);
        self.listener = on;
        self.update_deadlines();
    }

    /// Returns the clock of the first end of a timer 2 period after `t`, if no register is written; `NEVER`
    /// if it is stopped.
    #[must_use]
    pub fn timer2_match_next(&self, t: u64) -> u64 {
        self.timer2.end_after(t)
    }

    /// Reports whether a pin can still change without a program: a module generates pulses while timer 2
    /// runs, or waits to set or clear its pin.
    #[must_use]
    pub fn moves_pins(&self) -> bool {
        let waits = |ccp: &CcpModule| match ccp.mode() {
            CcpMode::Pwm => self.timer2.end_after(0) != NEVER,
            _ => ccp.drive() != Pic16Drive::Port && self.next[0] != NEVER,
        };
        !self.asleep && self.ccp.iter().any(waits)
    }

    /// Recomputes the next events; must be called after every change other than the passing of time.
    fn update_deadlines(&mut self) {
        self.next = [self.next_timer1_event(), self.next_timer2_event()];
    }

    /// Advances both timers to `t`, the reference for later queries.
    fn settle(&mut self, t: u64) {
        self.timer1.settle(t);
        self.timer2.settle(t);
    }

    fn drives(&self) -> [Pic16Drive; 2] {
        [self.ccp[0].drive(), self.ccp[1].drive()]
    }

    /// Sends the overrides of the lines that have changed from `before`.
    fn drive_outputs(&self, before: [Pic16Drive; 2], t: u64, out: &mut Pic16Outbox) {
        for ((before, drive), (line, _)) in before.into_iter().zip(self.drives()).zip(MODULES) {
            if drive != before {
                out.push(Pic16Signal::Drive { t, line, drive });
            }
        }
    }

    /// Returns which modules compare with timer 1 and match `value`.
    fn modules_equal_to(&self, value: u16) -> [bool; 2] {
        [self.ccp[0].compare_value() == Some(value), self.ccp[1].compare_value() == Some(value)]
    }

    /// Handles the modules that match `value` of timer 1 at `t` and did not in `before`; `drives` are the
    /// overrides before.
    fn compare(&mut self, before: [bool; 2], drives: [Pic16Drive; 2], value: u16, t: u64, out: &mut Pic16Outbox) {
        let last = self.ccps;
        let now = self.modules_equal_to(value).into_iter().zip(before).map(|(now, before)| now && !before);
        for (i, ((ccp, matches), (_, flag))) in self.ccp.iter_mut().zip(now).zip(MODULES).enumerate() {
            if matches {
                out.push(Pic16Signal::Flag { t, flag });
                if ccp.apply_match() && i + 1 == last {
                    out.push(Pic16Signal::Convert { t });
                }
            }
        }
        self.drive_outputs(drives, t, out);
    }

    /// Handles one count of timer 1 at `t`, from the value `old`.
    fn on_timer1_count(&mut self, old: u16, t: u64, out: &mut Pic16Outbox) {
        let reset = self.ccp.iter().any(|ccp| ccp.resets_timer1(old));
        let value = if reset { 0 } else { old.wrapping_add(1) };
        self.timer1.set(value);
        if value == 0 && !reset {
            out.push(Pic16Signal::Flag { t, flag: InterruptFlag::TMR1IF });
        }
        self.compare(self.modules_equal_to(old), self.drives(), value, t, out);
    }

    /// Returns the next clock at which timer 1 does more than count: a first edge that does not count, an
    /// overflow, a match, a reset by the special event.
    fn next_timer1_event(&self) -> u64 {
        let value = self.timer1.settled();
        let left = |to: u16| match to.wrapping_sub(value) {
            0 => 0x1_0000,
            n => u64::from(n),
        };
        let counts = self.ccp.iter().fold(left(0), |n, ccp| match ccp.compare_value() {
            Some(_) if ccp.resets_timer1(value) => 1,
            Some(to) => n.min(left(to)),
            None => n,
        });
        self.timer1.clock_of_count(counts).min(self.timer1.uncounted())
    }

    fn run_timer1_event(&mut self, t: u64, out: &mut Pic16Outbox) {
        if self.timer1.uncounted() == t {
            self.timer1.arm(t);
        } else {
            let old = self.timer1.before(t);
            self.timer1.settle(t);
            self.on_timer1_count(old, t, out);
        }
    }

    /// Returns the clock at which the pulse of `ccp` ends.
    fn pwm_fall_clock(&self, ccp: &CcpModule) -> u64 {
        ccp.duty_count().map_or(NEVER, |duty| self.timer2.clock_of_duty(duty))
    }

    /// Returns the next clock at which timer 2 does more than count and wrap.
    fn next_timer2_event(&self) -> u64 {
        let pulses = self.ccp.iter().any(|ccp| ccp.mode() == CcpMode::Pwm);
        let period = if pulses || self.listener { self.timer2.period_end(1) } else { self.timer2.flag_clock() };
        self.ccp.iter().map(|ccp| self.pwm_fall_clock(ccp)).fold(period, u64::min)
    }

    fn run_timer2_event(&mut self, t: u64, out: &mut Pic16Outbox) {
        let before = self.drives();
        for i in 0..self.ccp.len() {
            if self.pwm_fall_clock(&self.ccp[i]) == t {
                self.ccp[i].fall();
            }
        }
        let settled = self.timer2.settle(t);
        if settled.period_ended {
            self.ccp.iter_mut().for_each(CcpModule::start_period);
            if settled.postscaler_full {
                out.push(Pic16Signal::Flag { t, flag: InterruptFlag::TMR2IF });
            }
            if self.listener {
                out.push(Pic16Signal::Timer2 { t });
            }
        }
        self.drive_outputs(before, t, out);
    }

    /// Executes what is due of timer 1 up to `t1` and of timer 2 up to `t2`.
    fn run_events(&mut self, t1: u64, t2: u64, out: &mut Pic16Outbox) {
        loop {
            let [next1, next2] = self.next;
            if next1 <= t1 && (next1 <= next2 || next2 > t2) {
                self.run_timer1_event(next1, out);
                self.next[0] = self.next_timer1_event();
            } else if next2 <= t2 {
                self.run_timer2_event(next2, out);
                self.next[1] = self.next_timer2_event();
            } else {
                return;
            }
        }
    }

    /// Returns the index of the module, if it exists, and its register: 0 CCPRxL, 1 CCPRxH, 2 CCPxCON.
    fn module(&self, reg: Sfr) -> Option<CcpRegister> {
        let (i, which) = match reg {
            Sfr::CCPR1L => (0, 0),
            Sfr::CCPR1H => (0, 1),
            Sfr::CCP1CON => (0, 2),
            Sfr::CCPR2L => (1, 0),
            Sfr::CCPR2H => (1, 1),
            Sfr::CCP2CON => (1, 2),
            _ => return None,
        };
        (i < self.ccps).then_some(CcpRegister { index: i, which })
    }

    /// Writes a register of a module.
    fn write_module(&mut self, i: usize, which: u8, value: u8, t: u64, out: &mut Pic16Outbox) {
        self.settle(t);
        let timer1 = self.timer1.settled();
        let (before, drives) = (self.modules_equal_to(timer1), self.drives());
        let ccp = &mut self.ccp[i];
        match which {
            0 => ccp.low = value,
            1 => ccp.write_high(value),
            _ => {
                if ccp.write_con(value) {
                    ccp.capture(timer1);
                    out.push(Pic16Signal::Flag { t, flag: MODULES[i].1 });
                }
            }
        }
        self.compare(before, drives, timer1, t, out);
    }
}

impl Device<Pic16Signal> for Pic16Timers {
    type Reg = Sfr;

    fn run_due(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_events(t, t, out);
    }

    /// Sometimes too early, never too late: a reset of timer 1 by the special event counts as an event too.
    fn next_deadline(&self) -> u64 {
        self.next[0].min(self.next[1])
    }

    fn peek(&self, reg: Sfr, t: u64) -> u8 {
        match reg {
            Sfr::TMR1L => self.timer1.value(t) as u8,
            Sfr::TMR1H => (self.timer1.value(t) >> 8) as u8,
            Sfr::T1CON => self.timer1.con(),
            Sfr::TMR2 => self.timer2.value(t),
            Sfr::T2CON => self.timer2.con(),
            Sfr::PR2 => self.timer2.pr(),
            _ => match self.module(reg) {
                Some(CcpRegister { index: i, which: 0 }) => self.ccp[i].low,
                Some(CcpRegister { index: i, which: 1 }) => self.ccp[i].high(),
                Some(CcpRegister { index: i, .. }) => self.ccp[i].con(),
                None => 0,
            },
        }
    }

    fn write(&mut self, reg: Sfr, value: u8, _mask: u8, t: u64, out: &mut Pic16Outbox) {
        // A counter that is written takes the value instead of what is due at this clock.
        let before = t.saturating_sub(1);
        match reg {
            Sfr::TMR1L | Sfr::TMR1H => {
                self.run_events(before, t, out);
                let equal = self.modules_equal_to(self.timer1.before(t));
                self.timer1.write(t, |old| {
                    if reg == Sfr::TMR1L { old & 0xFF00 | u16::from(value) } else { old & 0xFF | u16::from(value) << 8 }
                });
                self.compare(equal, self.drives(), self.timer1.settled(), t, out);
            }
            Sfr::TMR2 => {
                self.run_events(t, before, out);
                self.timer2.write(value, t);
            }
            _ => {
                self.run_due(t, out);
                match reg {
                    Sfr::T1CON => self.timer1.write_con(value, t),
                    Sfr::T2CON => self.timer2.write_con(value, t),
                    Sfr::PR2 => self.timer2.write_pr(value, t),
                    _ => {
                        if let Some(CcpRegister { index: i, which }) = self.module(reg) {
                            self.write_module(i, which, value, t, out);
                        }
                    }
                }
            }
        }
        self.update_deadlines();
        // A pulse ends if the written value of TMR2 equals its duty.
        self.run_due(t, out);
    }

    fn on_line_changed(&mut self, line: Pic16Line, high: bool, t: u64, out: &mut Pic16Outbox) {
        match line {
            Pic16Line::T1cki => {
                let old = self.timer1.value(t);
                if self.timer1.line(high, t) {
                    self.on_timer1_count(old, t, out);
                }
            }
            Pic16Line::Ccp1 | Pic16Line::Ccp2 => {
                for (ccp, (own, flag)) in self.ccp.iter_mut().zip(MODULES) {
                    if own == line && ccp.line(high) {
                        ccp.capture(self.timer1.value(t));
                        out.push(Pic16Signal::Flag { t, flag });
                    }
                }
                // A capture does not change any deadline.
                return;
            }
            _ => {}
        }
        self.update_deadlines();
    }

    /// Resets the timers at `t` (DS30292 table 12-6): T2CON, TMR2 and CCPxCON are 0, PR2 is FFh. `power_on`
    /// is true for power-on and brown-out; only then T1CON is 0, otherwise timer 1 and CCPRx continue
    /// unchanged. The listener to timer 2 does not change. A sleep ends.
    fn reset(&mut self, power_on: bool, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        if self.asleep {
            self.restart_clock(t, out);
        }
        self.timer2 = Timer2::new(t);
        if power_on {
            self.timer1.power_on(t);
        }
        let before = self.drives();
        self.ccp.iter_mut().for_each(|ccp| ccp.reset(power_on));
        self.drive_outputs(before, t, out);
        self.update_deadlines();
    }

    fn stop_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.asleep = true;
        self.timer1.sleep(t);
        self.timer2.sleep(t);
        self.update_deadlines();
    }

    fn restart_clock(&mut self, t: u64, out: &mut Pic16Outbox) {
        self.run_due(t, out);
        self.asleep = false;
        self.timer1.wake(t);
        self.timer2.wake(t);
        self.update_deadlines();
    }

    fn steady_until(&self, reg: Sfr, t: u64) -> u64 {
        let ahead = |counts: u64| self.timer1.clock_of_count(self.timer1.counts(t) + counts).min(self.next[0]);
        match reg {
            Sfr::TMR1L => ahead(1),
            Sfr::TMR1H => ahead(0x100 - u64::from(self.timer1.value(t) & 0xFF)),
            Sfr::TMR2 => self.timer2.count_after(t),
            _ => match self.module(reg) {
                Some(CcpRegister { index: i, which: 1 }) if self.ccp[i].mode() == CcpMode::Pwm => {
                    self.timer2.end_after(t)
                }
                _ => NEVER,
            },
        }
    }
}
