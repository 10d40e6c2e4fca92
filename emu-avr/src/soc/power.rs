//! Power and clocks: resets and their causes, start-up times, sleep, CLKPR, PRR, fuses.

use emu_core::cpu::{NEVER, ResetCause};
use emu_core::parts::prescaler::Prescaler;
use emu_core::pins::PinId;
use emu_core::state;

use super::AvrSoc;
use super::sleep::SleepMode;
use crate::chips::{AvrPart, FuseLayout, StartUpTime, unit_index};
use crate::cpu::Options;
use crate::periph::ports::PIN_COUNT;
use crate::periph::spm::ConfigBytes;
use crate::periph::{AvrDrive, Device};

/// Mask of WDRF in MCUSR.
pub(super) const WDRF: u8 = 1 << 3;

/// Mask of CLKPCE in CLKPR.
const CLKPCE: u8 = 1 << 7;

/// Cycles for which a timed sequence stays open.
const UNLOCK_CYCLES: u64 = 4;

/// State of supply, clock, reset and sleep.
#[derive(Debug, Clone)]
pub(super) struct PowerState {
    /// Main clock in Hz, before CLKPR.
    source_hz: u64,
    /// CLKPS.
    pub(super) clkps: u8,
    /// CLKPS after a reset, by CKDIV8.
    reset_clkps: u8,
    /// Edges at which CLKPCE, IVCE, BODSE and BODS are cleared.
    unlock_ends: [u64; 4],
    /// Requested reset, if any.
    pub reset_request: Option<ResetCause>,
    /// True while the reset pin is low.
    pub reset_pin_low: bool,
    /// True if the reset pin is not a port pin.
    pub has_reset_pin: bool,
    /// Threshold of the brown-out detector in millivolts, 0 if it is off; then whether the supply is below
    /// it.
    pub bod_mv: u32,
    is_browned_out: bool,
    /// Supply voltage in millivolts.
    pub supply: u32,
    /// Cycle at which the core starts after a reset; 0 while it runs.
    pub start_cycle: u64,
    /// True if IVSEL has just been written.
    pub moved_vectors: bool,
    /// Cycle from which the core's clock runs again after sleep; 0 if it is not waking.
    pub(super) wake_cycle: u64,
    /// From a reset to the start; none where start-up is not waited for.
    start_up: Option<StartUpTime>,
    /// Cycles of the main clock that waking takes where the oscillator has stood.
    pub(super) wake_up: u64,
    /// Sleep mode, and the edge at which the core went to sleep.
    pub(super) asleep: Option<(SleepMode, u64)>,
    /// Mask of the units whose clock is stopped.
    pub(super) stopped_units: u16,
    /// True if the main clock continues in this sleep, for timer 2.
    pub(super) keeps_timer2: bool,
    /// True while the oscillator of the asynchronous timer runs; then, in `io_stopped`, the edge at which the
    /// I/O clock stopped.
    pub(super) crystal: bool,
    /// The edge of the crystal at which the I/O clock stopped; valid while `crystal` is true.
    pub(super) io_stopped: u64,
    /// Voltages on pins in millivolts, for pins driven by a voltage instead of a level.
    pub volts: [Option<u32>; PIN_COUNT],
    /// Overrides of pins by units.
    drivers: Vec<(PinId, usize, AvrDrive)>,
    /// Override of timer 1's capture input by the comparator.
    pub capture_driver: AvrDrive,
}

state! {
    PowerState {
        source_hz, clkps, unlock_ends, reset_request, reset_pin_low, is_browned_out, supply, start_cycle, moved_vectors, wake_cycle, asleep, stopped_units, keeps_timer2, crystal,
        io_stopped, volts, drivers, capture_driver,
    } stays { reset_clkps, has_reset_pin, bod_mv, start_up, wake_up }
    if |power, _now| power.source_hz != NEVER && power.clkps <= 8 && power.stopped_units >> unit_index::COUNT == 0
        && ![power.start_cycle, power.wake_cycle, power.io_stopped].contains(&NEVER) && !power.unlock_ends.contains(&NEVER)
}

impl PowerState {
    /// Returns the state that the fuses select.
    pub(super) fn new(part: &AvrPart, options: Options, bytes: &ConfigBytes) -> PowerState {
        let rows = &part.fuses;
        let value = |fuse| FuseLayout::value(bytes.fuses, fuse);
        let (cksel, sut) = (value(rows.cksel), value(rows.sut));
        let start_up = (rows.start_up)(cksel, sut);
        PowerState {
            source_hz: options.hz.max(1),
            clkps: 0,
            reset_clkps: if FuseLayout::is_programmed(bytes.fuses, rows.ckdiv8) { 3 } else { 0 },
            unlock_ends: [0; 4],
            reset_request: None,
            reset_pin_low: false,
            has_reset_pin: !FuseLayout::is_programmed(bytes.fuses, rows.rstdisbl),
            bod_mv: rows.bod_mv.get(usize::from(value(rows.bodlevel))).copied().unwrap_or(0),
            is_browned_out: false,
            supply: 5_000,
            start_cycle: 0,
            wake_cycle: 0,
            moved_vectors: false,
            start_up: options
                .start_up
                .then_some(StartUpTime { clocks: start_up.clocks + rows.reset_clocks, ..start_up }),
            wake_up: start_up.clocks,
            asleep: None,
            stopped_units: 0,
            keeps_timer2: false,
            crystal: true,
            io_stopped: 0,
            volts: [None; PIN_COUNT],
            drivers: Vec::new(),
            capture_driver: AvrDrive::Port,
        }
    }

    /// Requests a reset.
    pub(super) fn request(&mut self, why: ResetCause) {
        // A power-on reset has priority over other causes.
        if self.reset_request != Some(ResetCause::PowerOn) {
            self.reset_request = Some(why);
        }
    }

    /// Reports whether a reset is requested.
    pub(super) const fn has_reset_request(&self) -> bool {
        self.reset_request.is_some()
    }

    /// Reports whether the reset pin or the supply holds the chip in reset.
    pub(super) const fn is_held_in_reset(&self) -> bool {
        self.reset_pin_low || self.is_browned_out
    }

    /// Returns the cycle of the next event: start after a reset, or wake-up.
    pub(super) fn next(&self) -> u64 {
        let starts = if self.start_cycle != 0 && !self.is_held_in_reset() { self.start_cycle } else { NEVER };
        if self.wake_cycle != 0 { starts.min(self.wake_cycle) } else { starts }
    }

    /// Returns the clock of the core in Hz.
    pub(super) fn hz(&self) -> u64 {
        (self.source_hz >> self.clkps).max(1)
    }

    /// Returns the cycles from the end of a reset to the first instruction.
    fn start_wait(&self) -> u64 {
        let Some(StartUpTime { clocks, delay_us }) = self.start_up else { return 0 };
        (clocks >> self.clkps) + (u128::from(delay_us) * u128::from(self.hz())).div_ceil(1_000_000) as u64
    }

    /// Returns CLKPR.
    pub(super) const fn clkpr(&self, t: u64) -> u8 {
        self.clkps | if t < self.unlock_ends[0] { CLKPCE } else { 0 }
    }

    /// Reports whether IVCE reads as one.
    pub(super) const fn ivce_open(&self, t: u64) -> bool {
        t < self.unlock_ends[1]
    }

    /// Sets IVCE at the edge `t`.
    pub(super) fn open_ivce(&mut self, t: u64) {
        self.unlock_ends[1] = t + UNLOCK_CYCLES;
    }

    /// Clears IVCE after a write of IVSEL.
    pub(super) fn close_ivce(&mut self) {
        self.unlock_ends[1] = 0;
        self.moved_vectors = true;
    }

    /// Handles a write of BODSE and BODS at the edge `t`.
    pub(super) fn open_bods(&mut self, t: u64) {
        self.unlock_ends[2] = t + UNLOCK_CYCLES;
    }

    /// Handles a write of BODS alone: the detector is off in a sleep that starts within three cycles
    /// (10.11.2).
    pub(super) fn set_bods(&mut self, t: u64) {
        if t <= self.unlock_ends[2] {
            self.unlock_ends[3] = t + 3;
        }
    }

    /// Sets or removes the override of a pin by a unit.
    pub(super) fn drives_pin(&mut self, pin: PinId, number: usize, drive: AvrDrive) {
        self.drivers.retain(|row| (row.0, row.1) != (pin, number));
        if drive != AvrDrive::Port {
            self.drivers.push((pin, number, drive));
        }
    }

    /// Returns the resulting override of a pin for which several units have one. An override of the direction
    /// has priority over a value, and values are ORed (14.3: MOSI and OC2A on PB3).
    pub(super) fn driver(&self, pin: PinId) -> AvrDrive {
        let of = self.drivers.iter().filter(|row| row.0 == pin).map(|row| row.2);
        let all = of.clone().find(|drive| !matches!(drive, AvrDrive::Value(_)));
        let any = |one: AvrDrive, other| if one == AvrDrive::Value(true) { one } else { other };
        all.or_else(|| of.reduce(any)).unwrap_or_default()
    }

    /// Clears all pending operations at a reset.
    fn reset(&mut self) {
        self.clkps = self.reset_clkps;
        self.unlock_ends = [0; 4];
        self.reset_request = None;
        self.asleep = None;
        self.wake_cycle = 0;
        self.stopped_units = 0;
        self.keeps_timer2 = false;
        self.crystal = true;
        self.drivers.clear();
        self.capture_driver = AvrDrive::Port;
    }
}

impl AvrSoc {
    /// Resets all units to their initial values at the cycle `now`, and MCUSR by cause (11.9.1). Outside
    /// drives do not change.
    pub fn reset(&mut self, why: ResetCause, now: u64) {
        self.run(now);
        self.lints.reset();
        self.mcusr = match why {
            ResetCause::PowerOn => 1,
            ResetCause::External => self.mcusr | 1 << 1,
            ResetCause::BrownOut => self.mcusr | 1 << 2,
            ResetCause::Watchdog => self.mcusr | WDRF,
        };
        (self.mcucr, self.smcr, self.prr, self.gtccr, self.rampz, self.kept_bytes) = (0, 0, 0, 0, 0, [0; 4]);
        self.osccal = self.spm.config_bytes().calibration;
        self.stall = 0;
        self.watchdog.set_forced_on(self.mcusr & WDRF != 0, now, &mut self.out);
        self.ports.reset();
        for number in 0..unit_index::COUNT {
            if self.power.stopped_units >> number & 1 == 1 {
                with_unit!(self, number, unit => unit.restart_clock(now, &mut self.out));
            }
            with_unit!(self, number, unit => unit.reset(why == ResetCause::PowerOn, now, &mut self.out));
        }
        self.power.reset();
        // Overrides that units requested before the reset are discarded.
        self.out.clear();
        self.schedule.touch_all();
        self.prescalers = [Prescaler::new(now); 2];
        self.notify_prescaler(0, now);
        self.notify_prescaler(1, now);
        self.update_clock(now);
        self.hold_in_reset(now);
        self.power.start_cycle = match self.power.start_wait() {
            0 if !self.power.is_held_in_reset() => 0,
            wait => (now + wait).max(1),
        };
        self.watchdog.hold(self.power.start_cycle != 0, now, &mut self.out);
        self.update_all_pins(now);
        self.notify_all_lines(now);
        self.out.clear();
        self.update_trigger_listeners(now);
        self.update_deadlines();
    }

    /// Reports whether IVCE is set at the cycle `now`: no interrupt is taken then (12.5.1).
    #[must_use]
    pub const fn ivce(&self, now: u64) -> bool {
        self.power.ivce_open(now)
    }

    /// Updates the pins and the start-up after the chip entered or left the held reset.
    pub(super) fn hold_in_reset(&mut self, t: u64) {
        let held = self.power.is_held_in_reset();
        let released = self.ports.held_in_reset && !held;
        if self.ports.held_in_reset != held {
            self.ports.held_in_reset = held;
            self.update_all_pins(t);
        }
        if released && self.power.start_cycle != 0 {
            // Start-up begins at the end of the reset (11.2).
            self.power.start_cycle = (t + self.power.start_wait()).max(1);
        } else if held && self.power.start_cycle == 0 {
            self.power.start_cycle = t.max(1);
        }
    }

    /// Executes what is due in power and clocks at or before the edge `t`.
    pub(super) fn run_power(&mut self, t: u64) {
        if self.power.start_cycle != 0 && self.power.start_cycle <= t && !self.power.is_held_in_reset() {
            self.power.start_cycle = 0;
            self.watchdog.hold(false, t, &mut self.out);
            self.schedule.touch(unit_index::WATCHDOG);
        }
        if self.stall <= t {
            self.stall = 0;
        }
        if self.power.wake_cycle != 0 && self.power.wake_cycle <= t {
            self.finish_wake(t);
        }
    }

    /// Sets the main clock in Hz from the cycle `now` on.
    pub fn set_clock_hz(&mut self, hz: u64, now: u64) {
        self.power.source_hz = hz.max(1);
        self.update_clock(now);
        self.update_deadlines();
    }

    /// Passes the clock in Hz to all units.
    fn update_clock(&mut self, t: u64) {
        let hz = self.power.hz();
        for number in 0..unit_index::COUNT {
            with_unit!(self, number, unit => unit.set_clock_hz(hz, t));
        }
        self.eeprom.block_until(self.spm.busy_until(), t);
        self.spm.block_until(self.eeprom.busy_until(), t);
        self.schedule.touch_all();
    }

    /// Writes CLKPR: CLKPCE alone opens the window in which CLKPS can be written (9.12.2).
    pub(super) fn write_clkpr(&mut self, value: u8, t: u64) {
        if value == CLKPCE {
            // Writing it again does not extend the window.
            if t > self.power.unlock_ends[0] {
                self.power.unlock_ends[0] = t + UNLOCK_CYCLES;
            }
        } else if t <= self.power.unlock_ends[0] && value & CLKPCE == 0 {
            self.power.unlock_ends[0] = 0;
            // Settings above 256 are reserved.
            self.power.clkps = (value & 0x0F).min(8);
            self.update_clock(t);
        }
    }

    /// Handles a change of the supply voltage.
    pub(super) fn set_supply(&mut self, millivolts: u32, t: u64) {
        let before = std::mem::replace(&mut self.power.supply, millivolts);
        self.run_unit(unit_index::ADC, t);
        self.adc.set_avcc(millivolts, t);
        self.adc.set_aref(millivolts, t);
        for &pin in self.part.analog_pins.iter().chain(&self.part.comparator_pins) {
            self.notify_voltage(pin, t);
        }
        // Below the power-on threshold the chip is in reset (table 29-5: 1.4 V rising).
        const POWER_ON_MV: u32 = 1_400;
        if millivolts < POWER_ON_MV {
            self.power.request(ResetCause::PowerOn);
            self.power.is_browned_out = true;
        } else {
            let sleeps = self.power.asleep.filter(|_| self.power.wake_cycle == 0);
            let off = sleeps.is_some_and(|(_, since)| since <= self.power.unlock_ends[3]);
            let below = millivolts < self.power.bod_mv && !off;
            if below && !self.power.is_browned_out {
                self.power.request(if before < POWER_ON_MV { ResetCause::PowerOn } else { ResetCause::BrownOut });
            }
            self.power.is_browned_out = below;
        }
        self.hold_in_reset(t);
        self.schedule.touch_all();
    }
}
