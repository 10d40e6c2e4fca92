//! Power and clocks: resets and their causes, start-up times, sleep, CLKPR, PRR, fuses.

use emu_core::cpu::{NEVER, Reset};
use emu_core::parts::prescaler::Prescaler;
use emu_core::pins::PinId;
use emu_core::state;

use super::sleep::SleepMode;
use super::{Soc, with_unit};
use crate::chips::{Fuses, Part, unit};
use crate::cpu::Options;
use crate::periph::ports::PINS;
use crate::periph::spm::Bytes;
use crate::periph::{Device, Drive};

/// WDRF in MCUSR.
pub(super) const WDRF: u8 = 1 << 3;

/// CLKPCE in CLKPR.
const CLKPCE: u8 = 1 << 7;

/// Cycles for which a timed sequence is open.
const WINDOW: u64 = 4;

/// What the chip is supplied with and clocked by, and what is under way of that.
#[derive(Debug, Clone)]
pub(super) struct Power {
    /// Main clock in Hz, before CLKPR.
    source_hz: u64,
    /// CLKPS.
    pub(super) clkps: u8,
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
    /// IVSEL has just been written.
    pub moved_vectors: bool,
    /// Its clock runs again from this cycle on, out of sleep; 0 when it is not about to.
    pub(super) wakes: u64,
    /// Cycles of the main clock, and microseconds, from a reset to the start; none where start-up is not waited for.
    start_up: Option<(u64, u64)>,
    /// Cycles of the main clock that waking takes where the oscillator has stood.
    pub(super) wake_up: u64,
    /// The core sleeps since the edge.
    pub(super) asleep: Option<(SleepMode, u64)>,
    /// Units whose clock stands, and since when that of the I/O clock does.
    pub(super) stopped: u16,
    /// The main clock goes on in this sleep, for timer 2.
    pub(super) keeps_timer: bool,
    /// The oscillator of the asynchronous timer runs.
    pub(super) crystal: bool,
    pub(super) io_stopped: u64,
    /// Voltages on pins, in millivolts, where a level does not say it all.
    pub volts: [Option<u32>; PINS],
    /// What units do to each pin.
    pins: Vec<(PinId, usize, Drive)>,
    /// What the comparator does to the capture input of timer 1.
    pub captures: Drive,
}

state! {
    Power {
        source_hz, clkps, windows, request, low, brown, supply, starts, moved_vectors, wakes, asleep, stopped, keeps_timer, crystal,
        io_stopped, volts, pins, captures,
    } stays { reset_clkps, has_reset_pin, bod_mv, start_up, wake_up }
    if |power, _now| power.source_hz != NEVER && power.clkps <= 8 && power.stopped >> unit::COUNT == 0
        && ![power.starts, power.wakes, power.io_stopped].contains(&NEVER) && !power.windows.contains(&NEVER)
}

impl Power {
    /// As the fuses say.
    pub(super) fn new(part: &Part, options: Options, bytes: &Bytes) -> Power {
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
            moved_vectors: false,
            start_up: options.start_up.then_some((clocks + rows.reset_clocks, us)),
            wake_up: clocks,
            asleep: None,
            stopped: 0,
            keeps_timer: false,
            crystal: true,
            io_stopped: 0,
            volts: [None; PINS],
            pins: Vec::new(),
            captures: Drive::Port,
        }
    }

    /// Asks for a reset.
    pub(super) fn request(&mut self, why: Reset) {
        // The weightier cause stays.
        if self.request != Some(Reset::PowerOn) {
            self.request = Some(why);
        }
    }

    /// A reset is asked for.
    pub(super) const fn requests(&self) -> bool {
        self.request.is_some()
    }

    /// The chip is held in reset from outside.
    pub(super) const fn held(&self) -> bool {
        self.low || self.brown
    }

    /// The cycle at which something comes of this by itself.
    pub(super) fn next(&self) -> u64 {
        let starts = if self.starts != 0 && !self.held() { self.starts } else { NEVER };
        if self.wakes != 0 { starts.min(self.wakes) } else { starts }
    }

    /// Cycles in a second.
    pub(super) fn hz(&self) -> u64 {
        (self.source_hz >> self.clkps).max(1)
    }

    /// Cycles from the end of a reset to the first instruction.
    fn start_wait(&self) -> u64 {
        let Some((clocks, us)) = self.start_up else { return 0 };
        (clocks >> self.clkps) + (u128::from(us) * u128::from(self.hz())).div_ceil(1_000_000) as u64
    }

    /// CLKPR.
    pub(super) const fn clkpr(&self, t: u64) -> u8 {
        self.clkps | if t < self.windows[0] { CLKPCE } else { 0 }
    }

    /// IVCE reads as one.
    pub(super) const fn ivce_open(&self, t: u64) -> bool {
        t < self.windows[1]
    }

    /// IVCE is set at the edge `t`.
    pub(super) fn open_ivce(&mut self, t: u64) {
        self.windows[1] = t + WINDOW;
    }

    /// IVSEL is written.
    pub(super) fn close_ivce(&mut self) {
        self.windows[1] = 0;
        self.moved_vectors = true;
    }

    /// BODSE and BODS are set at the edge `t`.
    pub(super) fn open_bods(&mut self, t: u64) {
        self.windows[2] = t + WINDOW;
    }

    /// BODS alone is set: the detector is off in a sleep that begins within three cycles (10.11.2).
    pub(super) fn set_bods(&mut self, t: u64) {
        if t <= self.windows[2] {
            self.windows[3] = t + 3;
        }
    }

    /// A unit does something to a pin.
    pub(super) fn drives_pin(&mut self, pin: PinId, number: usize, drive: Drive) {
        self.pins.retain(|row| (row.0, row.1) != (pin, number));
        if drive != Drive::Port {
            self.pins.push((pin, number, drive));
        }
    }

    /// What becomes of a pin that several units want: who overrides its direction comes before who gives a value, and values are
    /// ORed (14.3: MOSI and OC2A on PB3).
    pub(super) fn driver(&self, pin: PinId) -> Drive {
        let of = self.pins.iter().filter(|row| row.0 == pin).map(|row| row.2);
        let all = of.clone().find(|drive| !matches!(drive, Drive::Value(_)));
        let any = |one: Drive, other| if one == Drive::Value(true) { one } else { other };
        all.or_else(|| of.reduce(any)).unwrap_or_default()
    }

    /// Nothing is under way, at a reset.
    fn reset(&mut self) {
        self.clkps = self.reset_clkps;
        self.windows = [0; 4];
        self.request = None;
        self.asleep = None;
        self.wakes = 0;
        self.stopped = 0;
        self.keeps_timer = false;
        self.crystal = true;
        self.pins.clear();
        self.captures = Drive::Port;
    }
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

    /// IVCE is set at the cycle `now`: no interrupt is taken (12.5.1).
    #[must_use]
    pub const fn ivce(&self, now: u64) -> bool {
        self.power.ivce_open(now)
    }

    /// The core stands: in reset, from outside or while the clock starts up, at waking, or while a memory halts it.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.power.held() || self.power.starts != 0 || self.power.wakes != 0 || self.stall != 0
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
        if self.stall <= t {
            self.stall = 0;
        }
        if self.power.wakes != 0 && self.power.wakes <= t {
            self.woken(t);
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
}
