//! Configuration, start-up, resets, standby, supply (DS30292, chapter 12).

use emu_core::cpu::{NEVER, ResetCause};
use emu_core::pins::{PinId, PinLevel};

use super::{CoreRequest, Pic16Soc, for_each_unit, unit_index};
use crate::chips::{InternalOscillator, NO_PIN, OscillatorMode, Pic16Part};
use crate::cpu::{Options, TimingCorner};
use crate::periph::{Device, Pic16Outbox, SignalReceiver, adc::ClockFraction, map::Sfr};

/// Clocks of the start-up timer of a crystal (12.6).
const OSCILLATOR_START_CLOCKS: u64 = 1024;
/// Supply in millivolts below which a brown-out begins (DS30292, D005: 3.7 to 4.35 V), by corner.
const BROWN_OUT: [u32; 3] = [3_700, 4_000, 4_350];
/// Mask of OSCF in PCON of the 16F62x: the fast oscillator, set after power-on (DS40300, register PCON).
const OSCF: u8 = 0x08;
/// Minimum duration of a brown-out in microseconds (parameter 35).
const BROWN_OUT_US: u64 = 100;
/// Supply in millivolts below which all state is lost and the next rise is a power-on (D003: near ground).
const POWER_OFF_MV: u32 = 700;
/// Durations in clocks of the oscillator.
#[derive(Debug, Clone, Copy)]
pub struct TimingClocks {
    /// Watchdog period without prescaler.
    pub watchdog: u64,
    /// Duration of the power-up timer.
    pub power_up: u64,
    /// Time to write a byte of EEPROM.
    pub eeprom: u64,
    /// Time to write program memory.
    pub flash: u64,
    /// TAD of the converter's own oscillator.
    pub adc_rc: ClockFraction,
    /// Minimum duration of a brown-out.
    brown_out: u64,
    /// Threshold of a brown-out in millivolts.
    brown_out_mv: u32,
    /// True if the start-up timers run after power-on.
    start_up: bool,
}

impl TimingClocks {
    /// Computes the durations of a chip from the frequency and the corner in `options`.
    pub fn new(part: &Pic16Part, options: &Options) -> TimingClocks {
        let corner = match options.corner {
            TimingCorner::Min => 0,
            TimingCorner::Typ => 1,
            TimingCorner::Max => 2,
        };
        let clocks = |micros: u64| (u128::from(micros) * u128::from(options.hz) / 1_000_000).max(1) as u64;
        let times = &part.times;
        TimingClocks {
            watchdog: clocks(times.wdt[corner].into()),
            power_up: clocks(times.pwrt[corner].into()),
            eeprom: clocks(times.eeprom[corner].into()),
            flash: clocks(times.flash[corner].into()),
            adc_rc: ClockFraction { num: u64::from(times.adc_rc_ns[corner]) * options.hz.max(1), den: 1_000_000_000 },
            brown_out: clocks(BROWN_OUT_US),
            brown_out_mv: BROWN_OUT[corner],
            start_up: options.start_up,
        }
    }
}

/// Returns the words from 2000h on, missing ones erased; `first` overrides the first configuration word.
pub(super) fn config_words(part: &Pic16Part, first: Option<u16>, image: &[u16]) -> [u16; 16] {
    let mut words = [0x3FFF; 16];
    for (word, &given) in words.iter_mut().zip(image) {
        // Cells that the image does not fill are FFFFh.
        *word = given & 0x3FFF;
    }
    const FIRST: usize = 7;
    const DEVICE: usize = 6;
    if let Some(word) = first {
        words[FIRST] = word & 0x3FFF;
    }
    if let Some(id) = part.device_id {
        words[DEVICE] = id;
    }
    words
}

/// Settings of the configuration words.
#[derive(Debug, Clone, Copy)]
pub(super) struct ConfigSettings {
    /// True if the watchdog is on.
    pub watchdog: bool,
    /// True if the power-up timer is on.
    pub power_up: bool,
    /// True if a brown-out resets the chip.
    pub brown_out: bool,
    /// True if the reset pin resets the chip.
    pub master_clear: bool,
    /// True if the oscillator has a start-up timer.
    pub crystal: bool,
    /// Pin of CCP1, if the configuration selects it.
    pub ccp1: Option<PinId>,
    /// Mask of the pins that are not port pins.
    pub reserved_pins: u64,
    /// Program words that the program may write: first, and end (exclusive).
    pub writable: (u16, u16),
}

impl ConfigSettings {
    fn new(part: &Pic16Part, word: u16) -> ConfigSettings {
        let layout = &part.config;
        let set = |mask: u16| word & mask != 0;
        let crystals = [OscillatorMode::Lp, OscillatorMode::Xt, OscillatorMode::Hs];
        let mclr = layout.mclre == 0 || set(layout.mclre);
        // The pins of the oscillator, the reset pin, and the pin for low-voltage programming.
        let oscillator = OSCILLATOR_BITS & !layout.ports_of_oscillator(word);
        let shared = (0..8).filter(|bit| !layout.osc_ports.is_empty() && oscillator >> bit & 1 == 1);
        let pins = shared.filter_map(|bit| part.ports.first()?.pins.get(bit as usize).copied());
        let others = [(mclr, part.mclr), (set(layout.lvp), layout.pgm)];
        let pins = pins.chain(others.into_iter().filter(|&(taken, _)| taken).map(|(_, pin)| pin));
        ConfigSettings {
            watchdog: set(layout.wdte),
            power_up: layout.has_power_up_timer(word),
            brown_out: set(layout.boren),
            master_clear: mclr,
            crystal: crystals.contains(&layout.oscillator_mode(word)),
            ccp1: layout.ccp1(word).filter(|&pin| pin != NO_PIN),
            reserved_pins: pins.fold(0, |set, pin| set | 1u64.checked_shl(pin.into()).unwrap_or(0)),
            writable: writable(part, word),
        }
    }
}

/// Returns the program words that the program may write, first and end (exclusive): one range on any chip.
fn writable(part: &Pic16Part, word: u16) -> (u16, u16) {
    let words = (part.chip.flash_bytes / 2) as u16;
    let may = |addr: &u16| part.config.may_write(word, *addr);
    let first = (0..words).find(may).unwrap_or(words);
    (first, (first..words).find(|addr| !may(addr)).unwrap_or(words))
}

/// Mask of the port A bits that share pins with the oscillator, on chips where they do.
const OSCILLATOR_BITS: u8 = 0xC0;

/// State of the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PowerPhase {
    /// Executes instructions.
    Runs,
    /// Standby, until a wake-up.
    Standby,
    /// Waits for the start-up timers until clock `until`. `woken`: None after a reset, true by the watchdog.
    Starts { until: u64, woken: Option<bool> },
    /// Held in reset by the reset pin or by the supply.
    Held,
}
emu_core::state! { enum PowerPhase { 0 = Runs, 1 = Standby, 2 = Starts { until, woken }, 3 = Held } }

/// State of core, resets and supply.
#[derive(Debug, Clone)]
pub(super) struct PowerState {
    /// Settings of the configuration words.
    pub config: ConfigSettings,
    clocks: TimingClocks,
    state: PowerPhase,
    pub request: Option<ResetCause>,
    /// Clock at which a low supply becomes a brown-out.
    brown_out_at: u64,
    /// True if the supply is too low to run.
    low: bool,
    /// True if the supply was off.
    off: bool,
    /// True while the reset pin is low.
    cleared: bool,
    /// Clock at which the start-up timers end; the reset pin does not restart them.
    ready: u64,
}
emu_core::state! { PowerState { state, request, brown_out_at, low, off, cleared, ready } stays { config, clocks } }

impl PowerState {
    /// Returns the state before power-on.
    pub(super) fn new(part: &Pic16Part, clocks: TimingClocks, config: &[u16; 16]) -> PowerState {
        PowerState {
            config: ConfigSettings::new(part, config[7]),
            clocks,
            state: PowerPhase::Runs,
            request: None,
            brown_out_at: NEVER,
            low: false,
            off: false,
            cleared: false,
            ready: 0,
        }
    }

    /// Reports whether the core executes instructions.
    #[inline]
    pub(super) const fn is_running(&self) -> bool {
        matches!(self.state, PowerPhase::Runs)
    }

    /// Returns the clock of the next event.
    pub(super) const fn next(&self) -> u64 {
        let start = match self.state {
            PowerPhase::Starts { until, .. } => until,
            _ => NEVER,
        };
        if start < self.brown_out_at { start } else { self.brown_out_at }
    }

    /// Reports whether the chip is in reset at the clock `t`, or was off: no program sees pin changes then.
    pub(super) const fn in_reset(&self, t: u64) -> bool {
        t == 0 || matches!(self.state, PowerPhase::Held | PowerPhase::Starts { woken: None, .. })
    }

    /// Reports whether a reset is requested.
    pub(super) const fn has_reset_request(&self) -> bool {
        self.request.is_some()
    }
}

impl Pic16Soc {
    /// Resets all registers at the machine cycle `now`. Outside drives do not change, and neither do
    /// registers that this reset does not affect.
    pub fn reset(&mut self, why: ResetCause, now: u64) {
        let t = 4 * now;
        self.run(t);
        // DS30292, table 12-6 has one column for both.
        let power_on = matches!(why, ResetCause::PowerOn | ResetCause::BrownOut);
        let slept = self.in_standby();
        if !self.power.is_running() {
            for_each_unit!(self, part => part.restart_clock(t, &mut self.out));
            self.schedule.touch_all();
        }
        self.power.state = PowerPhase::Runs;
        self.reset_parts(power_on, t);
        self.ports.reset();
        // Overrides released during the reset have already been removed.
        self.out = Pic16Outbox::new();
        self.requests.clear();
        // DS30292, table 12-6: RBIF does not change except at power-on and brown-out.
        let kept = if power_on { 0 } else { self.irq.enables.intcon & super::irq::RBIF };
        self.irq = super::Pic16Interrupts::new(self.part);
        self.irq.enables.intcon = kept;
        (0..crate::periph::ports::PIN_COUNT as PinId).for_each(|pin| self.update_pin(pin, t));
        self.set_analog();
        self.notify_all_lines(t);
        self.on_register_written(Sfr::T1CON, self.timers.peek(Sfr::T1CON, t), t);
        self.irq.seen_port_b = self.ports.input(crate::periph::ports::PORTB);
        // Pin changes caused by the reset itself do not count.
        self.irq.sampled = [NEVER; 2];
        self.apply_signals(());
        // POR and BOR by DS30292, tables 12-3 and 12-5.
        self.pcon = match why {
            ResetCause::PowerOn if matches!(self.part.internal, InternalOscillator::F62x(_)) => OSCF,
            ResetCause::PowerOn => 0,
            ResetCause::BrownOut => self.pcon & !1,
            ResetCause::External | ResetCause::Watchdog => self.pcon,
        };
        self.power.request = None;
        let crystal = if self.power.config.crystal { OSCILLATOR_START_CLOCKS } else { 0 };
        let power_up = if self.power.config.power_up { self.power.clocks.power_up } else { 0 };
        // DS30292, table 12-1.
        let wait = match why {
            ResetCause::PowerOn if !self.power.clocks.start_up => 0,
            ResetCause::PowerOn => power_up + crystal,
            ResetCause::BrownOut => self.power.clocks.power_up + crystal,
            ResetCause::External if slept => crystal,
            _ => 0,
        };
        self.power.ready = self.power.ready.max((t + wait).next_multiple_of(4));
        if self.power.cleared || self.power.low {
            self.enter_phase(PowerPhase::Held, t);
        } else if self.power.ready > t {
            self.enter_phase(PowerPhase::Starts { until: self.power.ready, woken: None }, t);
        }
        self.update_deadlines();
    }

    fn reset_parts(&mut self, power_on: bool, t: u64) {
        self.schedule.touch_all();
        for_each_unit!(self, part => part.reset(power_on, t, &mut self.out));
        self.timers.set_timer2_listener(false, t, &mut self.out);
    }

    /// Stops the core and the oscillator.
    fn enter_phase(&mut self, state: PowerPhase, t: u64) {
        if self.power.is_running() {
            for_each_unit!(self, part => part.stop_clock(t, &mut self.out));
            self.schedule.touch_all();
            self.apply_signals(());
        }
        self.power.state = state;
    }

    /// Reports whether the core is in standby after SLEEP.
    #[must_use]
    pub fn in_standby(&self) -> bool {
        matches!(self.power.state, PowerPhase::Standby | PowerPhase::Starts { woken: Some(_), .. })
    }

    /// Executes SLEEP in the cycle `now`; returns false if an enabled flag makes it a NOP (12.13.1).
    pub fn sleep(&mut self, now: u64) -> bool {
        self.run(4 * now + 3);
        let t = 4 * now + 4;
        if self.has_request(t) {
            return false;
        }
        self.restart_watchdog(t);
        self.run(t);
        self.enter_phase(PowerPhase::Standby, t);
        // Sampling needs no clock edge while the oscillator is stopped.
        for sampled in &mut self.irq.sampled {
            *sampled = if *sampled == NEVER { NEVER } else { t };
        }
        self.irq.at = NEVER;
        // A flag set at the end of the instruction wakes the core at once.
        self.flag_raised(t);
        self.update_deadlines();
        true
    }

    /// Executes CLRWDT in the machine cycle `now`.
    pub fn clear_watchdog(&mut self, now: u64) {
        self.run(4 * now + 3);
        self.restart_watchdog(4 * now + 4);
    }

    /// Clears the watchdog at the clock `t`, at which TMR0 may also overflow.
    fn restart_watchdog(&mut self, t: u64) {
        self.schedule.touch(unit_index::TIMER0);
        self.timer0.clear_watchdog(t, &mut self.out);
        self.apply_signals(());
        self.update_deadlines();
    }

    /// Ends standby if an enabled flag was set at the clock `t`.
    pub(super) fn flag_raised(&mut self, t: u64) {
        if self.power.state == PowerPhase::Standby && self.has_request(t) {
            self.begin_wake(t, false);
        }
    }

    /// Handles a watchdog time-out at the clock `t`: it resets the chip, or ends standby.
    pub(super) fn watchdog_ran_out(&mut self, t: u64) {
        match self.power.state {
            PowerPhase::Runs => self.power.request = Some(ResetCause::Watchdog),
            PowerPhase::Standby => self.begin_wake(t, true),
            _ => {}
        }
    }

    fn begin_wake(&mut self, t: u64, by_watchdog: bool) {
        let wait = if self.power.config.crystal { OSCILLATOR_START_CLOCKS } else { 0 };
        self.power.state = PowerPhase::Starts { until: (t + wait).next_multiple_of(4), woken: Some(by_watchdog) };
    }

    /// Handles a level change of the reset pin.
    pub(super) fn master_clear(&mut self, high: bool, t: u64) {
        if !self.power.config.master_clear {
            return;
        }
        self.power.cleared = !high;
        if !high {
            self.power.request = Some(ResetCause::External);
        } else {
            self.release_reset(t);
        }
    }

    /// Releases the chip from reset, if neither the reset pin nor the supply holds it.
    fn release_reset(&mut self, t: u64) {
        if self.power.state != PowerPhase::Held || self.power.cleared || self.power.low {
            return;
        }
        self.power.state = PowerPhase::Starts { until: t.next_multiple_of(4).max(self.power.ready), woken: None };
        if std::mem::take(&mut self.power.off) {
            self.power.request = Some(ResetCause::PowerOn);
        }
    }

    /// Sets the supply voltage from the clock `t` on.
    pub(super) fn set_supply(&mut self, millivolts: u32, t: u64) {
        self.pin_inputs.supply = millivolts;
        self.schedule.touched |= 1 << unit_index::ADC | 1 << unit_index::COMPARATORS;
        self.adc.set_supply(millivolts, t);
        self.comparators.set_supply(millivolts, t, &mut self.out);
        let clocks = self.power.clocks;
        let low = self.power.config.brown_out && millivolts < clocks.brown_out_mv || millivolts < POWER_OFF_MV;
        self.power.off |= millivolts < POWER_OFF_MV;
        if low && !self.power.low && self.power.brown_out_at == NEVER {
            let wait = if millivolts < POWER_OFF_MV { 0 } else { clocks.brown_out };
            self.power.brown_out_at = t + wait;
        } else if low && millivolts < POWER_OFF_MV && !self.power.low {
            self.power.brown_out_at = t;
        } else if !low {
            self.power.brown_out_at = NEVER;
            if std::mem::take(&mut self.power.low) {
                self.power.state = PowerPhase::Held;
                self.power.request =
                    Some(if std::mem::take(&mut self.power.off) { ResetCause::PowerOn } else { ResetCause::BrownOut });
            }
        }
    }

    /// Executes what is due in the power state at the clock `t`.
    pub(super) fn run_power(&mut self, t: u64) {
        if self.power.brown_out_at <= t {
            self.power.brown_out_at = NEVER;
            self.power.low = true;
            self.enter_phase(PowerPhase::Held, t);
        }
        if let PowerPhase::Starts { until, woken } = self.power.state
            && until <= t
        {
            self.power.state = PowerPhase::Runs;
            for_each_unit!(self, part => part.restart_clock(t, &mut self.out));
            self.schedule.touch_all();
            self.apply_signals(());
            match woken {
                Some(by_watchdog) => {
                    self.requests.push_back(CoreRequest::EndStandby { by_watchdog });
                    // The instruction after SLEEP executes before the interrupt (12.13.2).
                    self.irq.at = NEVER;
                    self.update_request(t / 4);
                }
                None => self.restart_watchdog(t),
            }
        }
    }

    /// Reports whether an enabled source can still interrupt, wake or reset the chip without outside input:
    /// the watchdog, or an interrupt source while an event is due.
    pub(super) fn can_wake_up(&self) -> bool {
        let starts = matches!(self.power.state, PowerPhase::Starts { .. });
        let watched = self.timer0.has_running_watchdog();
        let heard = self.irq.enables.intcon & super::irq::GIE != 0 || !self.power.is_running();
        let rows = || self.part.flags.iter();
        let enabled = || rows().any(|row| self.is_enabled(self.irq.enables, row.enable, row.peripheral));
        self.power.state != PowerPhase::Held
            && (starts || watched || self.irq.at != NEVER || heard && self.schedule.due != NEVER && enabled())
    }

    /// Writes a register from outside between two instructions.
    pub fn poke(&mut self, reg: u16, value: u8, now: u64) {
        self.run(4 * now);
        if let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) {
            self.write_register(sfr, value, 4 * now);
        }
    }

    /// Reports whether nothing drives the pin.
    #[must_use]
    pub fn is_floating(&self, pin: PinId) -> bool {
        self.ports.pin(pin).level() == PinLevel::Float
    }
}
