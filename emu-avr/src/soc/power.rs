//! Power and clocks: resets and their causes, start-up times, sleep, CLKPR, PRR, fuses.

use emu_core::cpu::{NEVER, Reset};
use emu_core::parts::prescaler::Prescaler;
use emu_core::pins::PinId;

use super::Soc;
use super::with_unit;
use crate::chips::{Fuses, Part, unit};
use crate::cpu::Options;
use crate::periph::ports::PINS;
use crate::periph::spm::Bytes;
use crate::periph::{Device, Drive};

/// WDRF in MCUSR.
pub const WDRF: u8 = 1 << 3;

/// CLKPCE in CLKPR.
const CLKPCE: u8 = 1 << 7;

/// Cycles for which a timed sequence is open.
const WINDOW: u64 = 4;

/// Cycles from the start of the clock to the interrupt that woke the core (7.7.1).
const WAKE: u64 = 4;

/// Sleep modes (table 10-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SleepMode {
    /// Only the core stops.
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

impl SleepMode {
    /// The mode of the bits SM in SMCR; a reserved setting acts as idle.
    fn of(smcr: u8) -> SleepMode {
        match smcr >> 1 & 7 {
            1 => SleepMode::AdcNoiseReduction,
            2 => SleepMode::PowerDown,
            3 => SleepMode::PowerSave,
            6 => SleepMode::Standby,
            7 => SleepMode::ExtendedStandby,
            _ => SleepMode::Idle,
        }
    }

    /// The units whose clock stands, bit `n` for the unit `n`.
    const fn stops(self) -> u16 {
        const ALL: u16 = (1 << unit::COUNT) - 1;
        const RUN: u16 = 1 << unit::EEPROM | 1 << unit::SPM | 1 << unit::WATCHDOG;
        match self {
            SleepMode::Idle => 0,
            SleepMode::AdcNoiseReduction => ALL & !RUN & !(1 << unit::ADC),
            _ => ALL & !RUN,
        }
    }

    /// The oscillator of the asynchronous timer runs.
    fn keeps_crystal(self) -> bool {
        !matches!(self, SleepMode::PowerDown | SleepMode::Standby)
    }
}

/// What the chip is supplied with and clocked by, and what is under way of that.
#[derive(Debug, Clone)]
pub struct Power {
    /// Main clock in Hz, before CLKPR.
    source_hz: u64,
    /// CLKPS.
    clkps: u8,
    /// CLKPS after a reset, by CKDIV8.
    reset_clkps: u8,
    /// The edges at which CLKPCE, IVCE, BODSE and BODS are cleared.
    windows: [u64; 4],
    /// What asks for a reset.
    request: Option<Reset>,
    /// The reset pin is low.
    pub low: bool,
    /// The reset pin is one.
    pub has_reset_pin: bool,
    /// Level of the brown-out detector in millivolts, 0 is off; the supply is below it.
    pub bod_mv: u32,
    brown: bool,
    /// Supply in millivolts.
    pub supply: u32,
    /// The core starts at this cycle, after a reset; 0 when it runs.
    starts: u64,
    /// Its clock runs again from this cycle on, out of sleep; 0 when it is not about to.
    wakes: u64,
    /// Cycles of the main clock, and microseconds, from a reset to the start; none where start-up is not waited for.
    start_up: Option<(u64, u64)>,
    /// Cycles of the main clock that waking takes where the oscillator has stood.
    wake_up: u64,
    /// The core sleeps since the edge.
    asleep: Option<(SleepMode, u64)>,
    /// Units whose clock stands, and since when that of the I/O clock does.
    stopped: u16,
    /// The oscillator of the asynchronous timer runs.
    crystal: bool,
    io_stopped: u64,
    /// Voltages on pins, in millivolts, where a level does not say it all.
    pub volts: [Option<u32>; PINS],
    /// What units do to each pin.
    pins: Vec<(PinId, usize, Drive)>,
    /// What the comparator does to the capture input of timer 1.
    pub captures: Drive,
}

impl Power {
    /// As the fuses say.
    pub fn new(part: &Part, options: Options, bytes: &Bytes) -> Power {
        let rows = &part.fuses;
        let value = |fuse| Fuses::value(bytes.fuses, fuse);
        let (cksel, sut) = (value(rows.cksel), value(rows.sut));
        let (clocks, us) = (rows.start_up)(cksel, sut);
        Power {
            source_hz: options.hz.max(1),
            clkps: 0,
            reset_clkps: if Fuses::programmed(bytes.fuses, rows.ckdiv8) { 3 } else { 0 },
            windows: [0; 4],
            request: None,
            low: false,
            has_reset_pin: !Fuses::programmed(bytes.fuses, rows.rstdisbl),
            bod_mv: rows.bod_mv.get(usize::from(value(rows.bodlevel))).copied().unwrap_or(0),
            brown: false,
            supply: 5_000,
            starts: 0,
            wakes: 0,
            start_up: options.start_up.then_some((clocks + rows.reset_clocks, us)),
            wake_up: clocks,
            asleep: None,
            stopped: 0,
            crystal: true,
            io_stopped: 0,
            volts: [None; PINS],
            pins: Vec::new(),
            captures: Drive::Port,
        }
    }

    /// Asks for a reset.
    pub fn request(&mut self, why: Reset) {
        // The weightier cause stays.
        if self.request != Some(Reset::PowerOn) {
            self.request = Some(why);
        }
    }

    /// A reset is asked for.
    pub const fn requests(&self) -> bool {
        self.request.is_some()
    }

    /// The chip is held in reset from outside.
    pub const fn held(&self) -> bool {
        self.low || self.brown
    }

    /// The cycle at which something comes of this by itself.
    pub fn next(&self) -> u64 {
        let starts = if self.starts != 0 && !self.held() { self.starts } else { NEVER };
        if self.wakes != 0 { starts.min(self.wakes) } else { starts }
    }

    /// Cycles in a second.
    pub fn hz(&self) -> u64 {
        (self.source_hz >> self.clkps).max(1)
    }

    /// Cycles from the end of a reset to the first instruction.
    fn start_wait(&self) -> u64 {
        let Some((clocks, us)) = self.start_up else { return 0 };
        (clocks >> self.clkps) + (u128::from(us) * u128::from(self.hz())).div_ceil(1_000_000) as u64
    }

    /// CLKPR.
    pub const fn clkpr(&self, t: u64) -> u8 {
        self.clkps | if t < self.windows[0] { CLKPCE } else { 0 }
    }

    /// IVCE reads as one.
    pub const fn ivce_open(&self, t: u64) -> bool {
        t < self.windows[1]
    }

    /// IVCE is set at the edge `t`.
    pub fn open_ivce(&mut self, t: u64) {
        self.windows[1] = t + WINDOW;
    }

    /// IVSEL is written.
    pub fn close_ivce(&mut self) {
        self.windows[1] = 0;
    }

    /// BODSE and BODS are set at the edge `t`.
    pub fn open_bods(&mut self, t: u64) {
        self.windows[2] = t + WINDOW;
    }

    /// BODS alone is set: the detector is off in a sleep that begins within three cycles (10.11.2).
    pub fn set_bods(&mut self, t: u64) {
        if t <= self.windows[2] {
            self.windows[3] = t + 3;
        }
    }

    /// A unit does something to a pin.
    pub fn drives_pin(&mut self, pin: PinId, number: usize, drive: Drive) {
        self.pins.retain(|row| (row.0, row.1) != (pin, number));
        if drive != Drive::Port {
            self.pins.push((pin, number, drive));
        }
    }

    /// What becomes of a pin that several units want: who overrides its direction comes before who gives a value (14.3).
    pub fn driver(&self, pin: PinId) -> Drive {
        let mut of = self.pins.iter().filter(|row| row.0 == pin).map(|row| row.2);
        let all = of.clone().find(|drive| !matches!(drive, Drive::Value(_)));
        all.or_else(|| of.next()).unwrap_or_default()
    }

    /// Nothing is under way, at a reset.
    fn reset(&mut self) {
        self.clkps = self.reset_clkps;
        self.windows = [0; 4];
        self.request = None;
        self.asleep = None;
        self.wakes = 0;
        self.stopped = 0;
        self.crystal = true;
        self.pins.clear();
        self.captures = Drive::Port;
    }
}

/// The first byte of the boot section, by BOOTSZ: the largest one is four times the next but one.
pub fn boot_start(part: &Part, bytes: &Bytes) -> u32 {
    let flash = part.spm.flash;
    let size = part.fuses.bootsz.map_or(0, |fuse| (flash - part.spm.nrww) >> Fuses::value(bytes.fuses, fuse));
    flash - size
}

impl Soc {
    /// Resets all units to their initial values at the cycle `now`, MCUSR by cause (11.9.1). Outside drives stay.
    pub fn reset(&mut self, why: Reset, now: u64) {
        self.run(now);
        self.lints.reset();
        self.mcusr = match why {
            Reset::PowerOn => 1,
            Reset::External => self.mcusr | 1 << 1,
            Reset::BrownOut => self.mcusr | 1 << 2,
            Reset::Watchdog => self.mcusr | WDRF,
        };
        (self.mcucr, self.smcr, self.prr, self.gtccr, self.rampz, self.kept) = (0, 0, 0, 0, 0, [0; 4]);
        self.osccal = self.spm.bytes().calibration;
        self.stall = 0;
        self.watchdog.forced(self.mcusr & WDRF != 0, now, &mut self.out);
        self.ports.reset();
        for number in 0..unit::COUNT {
            if self.power.stopped >> number & 1 == 1 {
                with_unit!(self, number, unit => unit.wake(now, &mut self.out));
            }
            with_unit!(self, number, unit => unit.reset(now, &mut self.out));
        }
        self.power.reset();
        // What units said to the pins is over with them.
        self.out.clear();
        self.touched = u16::MAX;
        self.prescalers = [Prescaler::new(now); 2];
        self.tell_prescaler(0, now);
        self.tell_prescaler(1, now);
        self.set_rate(now);
        self.hold(now);
        self.power.starts = match self.power.start_wait() {
            0 if !self.power.held() => 0,
            wait => (now + wait).max(1),
        };
        self.watchdog.hold(self.power.starts != 0, now, &mut self.out);
        self.settle_all(now);
        self.tell_all(now);
        self.out.clear();
        self.listen(now);
        self.plan();
    }

    /// Takes the reset that is asked for, up to `now`.
    #[inline]
    pub fn reset_requested(&mut self, now: u64) -> Option<Reset> {
        self.run(now);
        self.power.request.take()
    }

    /// The core stands in reset, from outside or while the clock starts up.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.power.held() || self.power.starts != 0 || self.power.wakes != 0
    }

    /// The chip is held in reset or let go.
    pub(super) fn hold(&mut self, t: u64) {
        let held = self.power.held();
        let released = self.ports.held && !held;
        if self.ports.held != held {
            self.ports.held = held;
            self.settle_all(t);
        }
        if released && self.power.starts != 0 {
            // Start-up begins when the reset ends (11.2).
            self.power.starts = (t + self.power.start_wait()).max(1);
        } else if held && self.power.starts == 0 {
            self.power.starts = t.max(1);
        }
    }

    /// What is due of this at or before the edge `t`.
    pub(super) fn run_power(&mut self, t: u64) {
        if self.power.starts != 0 && self.power.starts <= t && !self.power.held() {
            self.power.starts = 0;
            self.watchdog.hold(false, t, &mut self.out);
            self.touch(unit::WATCHDOG);
        }
        if self.power.wakes != 0 && self.power.wakes <= t {
            self.power.wakes = 0;
            self.power.asleep = None;
            self.clocks(t);
            self.stall = self.stall.max(t + WAKE);
        }
    }

    /// Sets the main clock in Hz from the cycle `now` on.
    pub fn set_clock_hz(&mut self, hz: u64, now: u64) {
        self.power.source_hz = hz.max(1);
        self.set_rate(now);
        self.plan();
    }

    /// Tells all units how many cycles there are to a second.
    fn set_rate(&mut self, t: u64) {
        let hz = self.power.hz();
        for number in 0..unit::COUNT {
            with_unit!(self, number, unit => unit.rate(hz, t));
        }
        self.eeprom.block_until(self.spm.busy_until(), t);
        self.spm.block_until(self.eeprom.busy_until(), t);
        self.touched = u16::MAX;
    }

    /// CLKPR: CLKPCE alone opens the window, in which CLKPS can be written (9.12.2).
    pub(super) fn store_clkpr(&mut self, value: u8, t: u64) {
        if value == CLKPCE {
            // Writing it again does not prolong the time.
            if t > self.power.windows[0] {
                self.power.windows[0] = t + WINDOW;
            }
        } else if t <= self.power.windows[0] && value & CLKPCE == 0 {
            self.power.windows[0] = 0;
            // Settings above 256 are reserved.
            self.power.clkps = (value & 0x0F).min(8);
            self.set_rate(t);
        }
    }

    /// The supply has changed.
    pub(super) fn set_supply(&mut self, millivolts: u32, t: u64) {
        let before = std::mem::replace(&mut self.power.supply, millivolts);
        self.run_unit(unit::ADC, t);
        self.adc.set_avcc(millivolts, t);
        self.adc.set_aref(millivolts, t);
        for &pin in self.part.analog.iter().chain(&self.part.ain) {
            self.tell_voltage(pin, t);
        }
        // Below the level of power-on the chip is dead (table 29-5: 1.4 V rising).
        const POWER_ON: u32 = 1_400;
        if millivolts < POWER_ON {
            self.power.request(Reset::PowerOn);
            self.power.brown = true;
        } else {
            let sleeps = self.power.asleep.filter(|_| self.power.wakes == 0);
            let off = sleeps.is_some_and(|(_, since)| since <= self.power.windows[3]);
            let below = millivolts < self.power.bod_mv && !off;
            if below && !self.power.brown {
                self.power.request(if before < POWER_ON { Reset::PowerOn } else { Reset::BrownOut });
            }
            self.power.brown = below;
        }
        self.hold(t);
        self.touched = u16::MAX;
    }

    /// Unit numbers that PRR has switched off.
    pub(super) fn shut_off(&self, number: usize) -> bool {
        self.part.prr.iter().any(|&(bit, of)| of == number && self.prr >> bit & 1 == 1)
    }

    /// SLEEP in the cycle `now`: whether the core sleeps.
    pub fn sleep(&mut self, now: u64) -> bool {
        self.run(now);
        if self.smcr & 1 == 0 {
            return false;
        }
        let mode = SleepMode::of(self.smcr);
        self.power.asleep = Some((mode, now + 1));
        if matches!(mode, SleepMode::Idle | SleepMode::AdcNoiseReduction) {
            self.run_unit(unit::ADC, now + 1);
            self.adc.halted(now + 1);
            self.touch(unit::ADC);
        }
        self.clocks(now + 1);
        self.plan();
        true
    }

    /// The interrupt that is pending in cycle `now` wakes the core, which stands until its clock has started and 4 cycles more
    /// (7.7.1).
    pub fn wake_up(&mut self, now: u64) {
        let wait = match self.power.asleep {
            Some((SleepMode::Standby | SleepMode::ExtendedStandby, _)) => 6,
            Some((SleepMode::PowerDown | SleepMode::PowerSave, _)) => self.power.wake_up >> self.power.clkps,
            _ => 0,
        };
        self.power.wakes = (now + wait).max(1);
        self.due = self.due.min(self.power.wakes);
        // The brown-out detector is on again, and sees what has come meanwhile (10.11.2).
        if self.power.supply < self.power.bod_mv {
            self.set_supply(self.power.supply, now);
        }
        self.run(now);
    }

    /// Stops and starts the clocks of units at the edge `t`, as sleep and PRR say.
    pub(super) fn clocks(&mut self, t: u64) {
        let mode = self.power.asleep.map(|asleep| asleep.0);
        let io_stood = self.power.stopped >> unit::EXTERNAL & 1 == 1;
        let shut = self.part.prr.iter().filter(|row| self.prr >> row.0 & 1 == 1);
        let stop = shut.fold(mode.map_or(0, SleepMode::stops), |units, row| units | 1 << row.1);
        let mut changed = stop ^ std::mem::replace(&mut self.power.stopped, stop);
        while changed != 0 {
            let number = changed.trailing_zeros() as usize;
            changed &= changed - 1;
            with_unit!(self, number, unit => {
                unit.run(t, &mut self.out);
                if stop >> number & 1 == 0 { unit.wake(t, &mut self.out) } else { unit.sleep(t, &mut self.out) }
            });
            self.touch(number);
            self.carry_out(number);
        }
        let crystal = mode.is_none_or(SleepMode::keeps_crystal);
        if std::mem::replace(&mut self.power.crystal, crystal) != crystal {
            for n in 0..self.part.timers.len().min(4) {
                if self.part.timers[n].asynchronous {
                    self.timers[n].oscillator(crystal, t, &mut self.out);
                    self.touch(unit::TIMER + n);
                    self.carry_out(unit::TIMER + n);
                }
            }
        }
        let io_stands = self.power.stopped >> unit::EXTERNAL & 1 == 1;
        match (io_stood, io_stands) {
            (false, true) => self.power.io_stopped = t,
            (true, false) => {
                // The dividers have stood with the I/O clock.
                for prescaler in &mut self.prescalers {
                    prescaler.shift(t.saturating_sub(self.power.io_stopped));
                }
                self.tell_prescaler(0, t);
                self.tell_prescaler(1, t);
            }
            _ => {}
        }
    }
}
