//! Sleep: its modes, the clocks that stop, waking; and PRR, which stops units one by one (section 10).

use emu_core::state;

use super::AvrSoc;
use crate::chips::unit_index;
use crate::periph::timers::AvrTimer;
use crate::periph::{Device, SignalReceiver};

/// Cycles from the start of the clock to the interrupt that woke the core (7.7.1).
const WAKE_CYCLES: u64 = 4;

/// Sleep modes (table 10-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum SleepMode {
    #[default]
    /// Idle: only the core stops.
    Idle,
    /// ADC noise reduction.
    AdcNoiseReduction,
    /// Power-down.
    PowerDown,
    /// Power-save.
    PowerSave,
    /// Standby.
    Standby,
    /// Extended standby.
    ExtendedStandby,
}

state! {
    enum SleepMode { 0 = Idle, 1 = AdcNoiseReduction, 2 = PowerDown, 3 = PowerSave, 4 = Standby, 5 = ExtendedStandby }
}

impl SleepMode {
    /// Returns the mode of the bits SM in SMCR; a reserved value acts as idle.
    pub(super) fn from_smcr(smcr: u8) -> SleepMode {
        match smcr >> 1 & 7 {
            1 => SleepMode::AdcNoiseReduction,
            2 => SleepMode::PowerDown,
            3 => SleepMode::PowerSave,
            6 => SleepMode::Standby,
            7 => SleepMode::ExtendedStandby,
            _ => SleepMode::Idle,
        }
    }

    /// Returns a mask of the units whose clock stops; bit `n` is the unit `n`.
    pub(super) const fn stopped_units(self) -> u16 {
        const ALL: u16 = (1 << unit_index::COUNT) - 1;
        const RUN: u16 = 1 << unit_index::EEPROM | 1 << unit_index::SPM | 1 << unit_index::WATCHDOG;
        match self {
            SleepMode::Idle => 0,
            SleepMode::AdcNoiseReduction => ALL & !RUN & !(1 << unit_index::ADC),
            _ => ALL & !RUN,
        }
    }

    /// Reports whether the oscillator of the asynchronous timer runs.
    pub(super) fn keeps_crystal(self) -> bool {
        !matches!(self, SleepMode::PowerDown | SleepMode::Standby)
    }

    /// Returns a mask of the units that cannot wake the core, although they continue to run (table 10-1).
    pub(super) const fn units_unable_to_wake(self) -> u16 {
        match self {
            SleepMode::Idle | SleepMode::AdcNoiseReduction => 0,
            _ => 1 << unit_index::EEPROM | 1 << unit_index::SPM,
        }
    }
}

impl AvrSoc {
    /// Reports whether PRR has switched off the unit `number`.
    pub(super) fn is_shut_off(&self, number: usize) -> bool {
        self.part.power_reduction_bits.iter().any(|&(bit, of)| of == number && self.is_shut_off_by(bit, of))
    }

    /// Reports whether the PRR bit `bit` switches off its unit: timer 2 only while it is synchronous
    /// (10.11.3).
    fn is_shut_off_by(&self, bit: u8, number: usize) -> bool {
        let asynchronous =
            || self.timers.get(number.wrapping_sub(unit_index::TIMER)).is_some_and(|timer| timer.is_asynchronous());
        self.prr >> bit & 1 == 1 && !asynchronous()
    }

    /// Executes SLEEP in the cycle `now`; returns whether the core sleeps.
    pub fn sleep(&mut self, now: u64) -> bool {
        self.run(now);
        if self.smcr & 1 == 0 {
            return false;
        }
        let mode = SleepMode::from_smcr(self.smcr);
        self.power.asleep = Some((mode, now + 1));
        // A synchronous timer 2 keeps the main clock running, only for itself (10.6). The data sheets of
        // older chips do not say so.
        let keeps =
            matches!(mode, SleepMode::PowerSave | SleepMode::ExtendedStandby) && !self.part.bit_writes_whole_register;
        self.power.keeps_timer2 = keeps && self.timers.iter().any(AvrTimer::runs_from_crystal);
        if matches!(mode, SleepMode::Idle | SleepMode::AdcNoiseReduction) {
            self.run_unit(unit_index::ADC, now + 1);
            self.adc.on_core_halted(now + 1);
            self.schedule.touch(unit_index::ADC);
        }
        self.update_clocks(now + 1);
        self.update_deadlines();
        true
    }

    /// Wakes the core because of the interrupt pending in cycle `now`. The core stays stopped until its clock
    /// has started, and 4 more cycles (7.7.1).
    pub fn wake_up(&mut self, now: u64) {
        self.edge_that_wakes().into_iter().for_each(|int| self.lints.edge_woke(int));
        let wait = match self.power.asleep {
            Some((SleepMode::Standby | SleepMode::ExtendedStandby, _)) => 6,
            Some((SleepMode::PowerSave, _)) if self.power.keeps_timer2 => 6,
            Some((SleepMode::PowerDown | SleepMode::PowerSave, _)) => {
                self.power.wake_up.div_ceil(1 << self.power.clkps)
            }
            _ => 0,
        };
        self.power.wake_cycle = (now + wait).max(1);
        self.schedule.due = self.schedule.due.min(self.power.wake_cycle);
        // The brown-out detector is on again, and detects a low supply that began during sleep (10.11.2).
        if self.power.supply < self.power.bod_mv {
            self.set_supply(self.power.supply, now);
        }
        self.run(now);
    }

    /// Restarts the core's clock at the edge `t`.
    pub(super) fn finish_wake(&mut self, t: u64) {
        (self.power.wake_cycle, self.power.asleep, self.power.keeps_timer2) = (0, None, false);
        self.update_clocks(t);
        self.stall = self.stall.max(t + WAKE_CYCLES);
    }

    /// Stops and restarts the clocks of units at the edge `t`, by sleep mode and PRR.
    pub(super) fn update_clocks(&mut self, t: u64) {
        let mode = self.power.asleep.map(|asleep| asleep.0);
        let io_stood = self.power.stopped_units >> unit_index::EXTERNAL & 1 == 1;
        let keeps = |n: &usize| self.power.keeps_timer2 && self.timers[*n].runs_from_crystal();
        let kept = (0..self.timers.len()).filter(keeps).fold(0, |units, n| units | 1 << (unit_index::TIMER + n));
        let shut = self.part.power_reduction_bits.iter().filter(|row| self.is_shut_off_by(row.0, row.1));
        let stop = shut.fold(mode.map_or(0, SleepMode::stopped_units) & !kept, |units, row| units | 1 << row.1);
        let stopped = std::mem::replace(&mut self.power.stopped_units, stop);
        let mut changed = stop ^ stopped;
        while changed != 0 {
            let number = changed.trailing_zeros() as usize;
            changed &= changed - 1;
            with_unit!(self, number, unit => {
                unit.run_due(t, &mut self.out);
                if stop >> number & 1 == 0 { unit.restart_clock(t, &mut self.out) } else { unit.stop_clock(t, &mut self.out) }
            });
            self.schedule.touch(number);
            self.apply_signals(number);
        }
        let crystal = mode.is_none_or(SleepMode::keeps_crystal);
        if std::mem::replace(&mut self.power.crystal, crystal) != crystal {
            for n in 0..self.part.timers.len().min(4) {
                if self.part.timers[n].asynchronous {
                    self.timers[n].set_oscillator_running(crystal, t, &mut self.out);
                    self.schedule.touch(unit_index::TIMER + n);
                    self.apply_signals(unit_index::TIMER + n);
                }
            }
        }
        let io_stands = self.power.stopped_units >> unit_index::EXTERNAL & 1 == 1;
        match (io_stood, io_stands) {
            (false, true) => self.power.io_stopped = t,
            (true, false) => {
                // The prescalers stopped with the I/O clock, except one that was kept running for its timer.
                for group in 0..self.prescalers.len() {
                    let of = |n: &usize| usize::from(self.part.timers[*n].asynchronous) == group;
                    if (0..self.part.timers.len()).filter(of).any(|n| stopped >> (unit_index::TIMER + n) & 1 == 1) {
                        self.prescalers[group].postpone(t.saturating_sub(self.power.io_stopped));
                        self.notify_prescaler(group, t);
                    }
                }
            }
            _ => {}
        }
    }
}
