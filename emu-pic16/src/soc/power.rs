//! Configuration, start-up, resets, standby, supply (DS30292, chapter 12).

use emu_core::cpu::{NEVER, Reset};
use emu_core::pins::{Level, PinId, Time};

use super::pins::Put;
use super::{Order, Soc, at, every_part};
use crate::chips::{Internal, NO_PIN, Oscillator, Part};
use crate::cpu::{Corner, Options};
use crate::periph::map::Sfr;
use crate::periph::{Device, Outbox};

/// Clocks of the start-up timer of a crystal (12.6).
const OST: u64 = 1024;
/// Supply below which a brown-out begins, in millivolts (DS30292, D005: 3.7 to 4.35 V), by corner.
const BROWN_OUT: [u32; 3] = [3_700, 4_000, 4_350];
/// OSCF in PCON of the 16F62x: the fast oscillator, after power-on (DS40300, register PCON).
const OSCF: u8 = 0x08;
/// How long it has to last, in microseconds (parameter 35).
const BROWN_OUT_US: u64 = 100;
/// Supply below which RAM and everything else is lost and the next rise is a power-on, in millivolts (D003: near ground).
const POWER_OFF: u32 = 700;
/// Times in clocks of the oscillator.
#[derive(Debug, Clone, Copy)]
pub struct Clocks {
    /// Watchdog without prescaler.
    pub watchdog: u64,
    /// Power-up timer.
    pub power_up: u64,
    /// Writing a byte of EEPROM.
    pub eeprom: u64,
    /// Writing program memory.
    pub flash: u64,
    /// TAD of the converter's own oscillator: this many clocks, divided by the second number.
    pub adc_rc: (u64, u64),
    /// A brown-out.
    brown_out: u64,
    /// Its threshold, in millivolts.
    brown_out_mv: u32,
    /// The start-up timers run after power-on.
    start_up: bool,
}

impl Clocks {
    /// The times of a chip at the frequency and the corner of `options`.
    pub fn new(part: &Part, options: &Options) -> Clocks {
        let corner = match options.corner {
            Corner::Min => 0,
            Corner::Typ => 1,
            Corner::Max => 2,
        };
        let clocks = |micros: u64| (u128::from(micros) * u128::from(options.hz) / 1_000_000).max(1) as u64;
        let times = &part.times;
        Clocks {
            watchdog: clocks(times.wdt[corner].into()),
            power_up: clocks(times.pwrt[corner].into()),
            eeprom: clocks(times.eeprom[corner].into()),
            flash: clocks(times.flash[corner].into()),
            adc_rc: (u64::from(times.adc_rc_ns[corner]) * options.hz.max(1), 1_000_000_000),
            brown_out: clocks(BROWN_OUT_US),
            brown_out_mv: BROWN_OUT[corner],
            start_up: options.start_up,
        }
    }
}

/// The words from 2000h on: those of the image, what it leaves out as erased; `first` stands in for the first
/// configuration word.
pub(super) fn configuration(part: &Part, first: Option<u16>, image: &[u16]) -> [u16; 16] {
    let mut words = [0x3FFF; 16];
    for (word, &given) in words.iter_mut().zip(image) {
        // The cells of an image that nothing fills are FFFFh.
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

/// What the configuration words say.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settings {
    /// The watchdog is on.
    pub watchdog: bool,
    /// The power-up timer is on.
    pub power_up: bool,
    /// Brown-outs reset.
    pub brown_out: bool,
    /// The reset pin resets.
    pub master_clear: bool,
    /// The oscillator has a start-up timer.
    pub crystal: bool,
    /// The pin of CCP1, where there is a choice.
    pub ccp1: Option<PinId>,
    /// Pins that are no port pins, as a set by number.
    pub withheld: u64,
    /// Program words that the program may write, first and after the last.
    pub writable: (u16, u16),
}

impl Settings {
    fn new(part: &Part, word: u16) -> Settings {
        let layout = &part.config;
        let set = |mask: u16| word & mask != 0;
        let crystals = [Oscillator::Lp, Oscillator::Xt, Oscillator::Hs];
        let mclr = layout.mclre == 0 || set(layout.mclre);
        // The oscillator's pins, the reset pin, and the pin that low-voltage programming takes.
        let oscillator = OSCILLATOR_BITS & !layout.ports_of_oscillator(word);
        let shared = (0..8).filter(|bit| !layout.osc_ports.is_empty() && oscillator >> bit & 1 == 1);
        let pins = shared.filter_map(|bit| part.ports.first()?.pins.get(bit as usize).copied());
        let others = [(mclr, part.mclr), (set(layout.lvp), layout.pgm)];
        let pins = pins.chain(others.into_iter().filter(|&(taken, _)| taken).map(|(_, pin)| pin));
        Settings {
            watchdog: set(layout.wdte),
            power_up: layout.waits_at_power_on(word),
            brown_out: set(layout.boren),
            master_clear: mclr,
            crystal: crystals.contains(&layout.oscillator(word)),
            ccp1: layout.ccp1(word).filter(|&pin| pin != NO_PIN),
            withheld: pins.fold(0, |set, pin| set | 1u64.checked_shl(pin.into()).unwrap_or(0)),
            writable: writable(part, word),
        }
    }
}

/// The program words that the program may write, first and after the last; the rows of the chips have no more than one range.
fn writable(part: &Part, word: u16) -> (u16, u16) {
    let words = (part.chip.flash / 2) as u16;
    let may = |addr: &u16| part.config.may_write(word, *addr);
    let first = (0..words).find(may).unwrap_or(words);
    (first, (first..words).find(|addr| !may(addr)).unwrap_or(words))
}

/// The bits of port A that share pins with the oscillator, on chips where they do.
const OSCILLATOR_BITS: u8 = 0xC0;

/// What the core does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Executes instructions.
    Runs,
    /// Standby: until something wakes it.
    Standby,
    /// Waits for the start-up timers up to a clock.
    Starts { until: u64, woken: Option<bool> },
    /// Held in reset by the reset pin or by the supply.
    Held,
}
emu_core::state! { enum State { 0 = Runs, 1 = Standby, 2 = Starts { until, woken }, 3 = Held } }

/// What the core does, and why.
#[derive(Debug, Clone)]
pub(super) struct Power {
    /// The configuration.
    pub config: Settings,
    clocks: Clocks,
    state: State,
    request: Option<Reset>,
    /// The clock at which a low supply becomes a brown-out.
    brown_out_at: u64,
    /// The supply is too low to run.
    low: bool,
    /// It was lost.
    off: bool,
    /// The reset pin is low.
    cleared: bool,
    /// The clock at which the start-up timers are over: the reset pin does not begin them anew.
    ready: u64,
}
emu_core::state! { Power { state, request, brown_out_at, low, off, cleared, ready } stays { config, clocks } }

impl Power {
    /// Before power-on.
    pub(super) fn new(part: &Part, clocks: Clocks, config: &[u16; 16]) -> Power {
        Power {
            config: Settings::new(part, config[7]),
            clocks,
            state: State::Runs,
            request: None,
            brown_out_at: NEVER,
            low: false,
            off: false,
            cleared: false,
            ready: 0,
        }
    }

    /// The core executes instructions.
    #[inline]
    pub(super) const fn runs(&self) -> bool {
        matches!(self.state, State::Runs)
    }

    /// When something is due.
    pub(super) const fn next(&self) -> u64 {
        let start = match self.state {
            State::Starts { until, .. } => until,
            _ => NEVER,
        };
        if start < self.brown_out_at { start } else { self.brown_out_at }
    }

    /// The chip is held in reset at the clock `t`, or was not on before it: what pins do then is no change to a program.
    pub(super) const fn in_reset(&self, t: u64) -> bool {
        t == 0 || matches!(self.state, State::Held | State::Starts { woken: None, .. })
    }

    /// A reset is asked for.
    pub(super) const fn requests(&self) -> bool {
        self.request.is_some()
    }
}

impl Soc {
    /// Resets all registers at the machine cycle `now`. Outside drives stay, and so does what a reset does not reach.
    pub fn reset(&mut self, why: Reset, now: u64) {
        let t = 4 * now;
        self.run(t);
        // DS30292, table 12-6 has one column for both.
        let power_on = matches!(why, Reset::PowerOn | Reset::BrownOut);
        let slept = self.in_standby();
        if !self.power.runs() {
            every_part!(self, part => part.wake(t, &mut self.out));
            self.touched = u8::MAX;
        }
        self.power.state = State::Runs;
        self.reset_parts(power_on, t);
        self.ports.reset();
        // What parts let go of as they were reset is let go of already.
        self.out = Outbox::new();
        self.orders.clear();
        // DS30292, table 12-6: RBIF is left as it was but by power-on and brown-out.
        let kept = if power_on { 0 } else { self.irq.enables.intcon & super::irq::RBIF };
        self.irq = super::Interrupts::new(self.part);
        self.irq.enables.intcon = kept;
        (0..crate::periph::ports::PINS as PinId).for_each(|pin| self.settle(pin, t));
        self.set_analog();
        self.tell_all(t);
        self.written(Sfr::T1CON, self.timers.peek(Sfr::T1CON, t), t);
        self.irq.seen = self.ports.input(crate::periph::ports::PORTB);
        // What the reset itself did to pins is no change of theirs.
        self.irq.sampled = [NEVER; 2];
        self.carry_out();
        // DS30292, tables 12-3 and 12-5: POR and BOR.
        self.pcon = match why {
            Reset::PowerOn if matches!(self.part.internal, Internal::F62x(_)) => OSCF,
            Reset::PowerOn => 0,
            Reset::BrownOut => self.pcon & !1,
            Reset::External | Reset::Watchdog => self.pcon,
        };
        self.power.request = None;
        let crystal = if self.power.config.crystal { OST } else { 0 };
        let power_up = if self.power.config.power_up { self.power.clocks.power_up } else { 0 };
        // DS30292, table 12-1.
        let wait = match why {
            Reset::PowerOn if !self.power.clocks.start_up => 0,
            Reset::PowerOn => power_up + crystal,
            Reset::BrownOut => self.power.clocks.power_up + crystal,
            Reset::External if slept => crystal,
            _ => 0,
        };
        self.power.ready = self.power.ready.max((t + wait).next_multiple_of(4));
        if self.power.cleared || self.power.low {
            self.stand(State::Held, t);
        } else if self.power.ready > t {
            self.stand(State::Starts { until: self.power.ready, woken: None }, t);
        }
        self.plan();
    }

    fn reset_parts(&mut self, power_on: bool, t: u64) {
        self.touched = u8::MAX;
        let out = &mut self.out;
        self.timer0.reset(t);
        self.timers.reset(power_on, t, out);
        self.usart.reset(power_on, t, out);
        self.ssp.reset(power_on, t, out);
        self.timers.set_timer2_listener(false, t, out);
        self.eeprom.reset(power_on, t);
        self.adc.reset(t);
        self.comparators.reset(t, out);
        self.psp.reset();
    }

    /// The core stops, and the oscillator with it.
    fn stand(&mut self, state: State, t: u64) {
        if self.power.runs() {
            every_part!(self, part => part.sleep(t, &mut self.out));
            self.touched = u8::MAX;
            self.carry_out();
        }
        self.power.state = state;
    }

    /// The core does not execute instructions.
    #[must_use]
    pub fn asleep(&self) -> bool {
        !self.power.runs()
    }

    /// SLEEP has been executed, and nothing has ended it.
    #[must_use]
    pub fn in_standby(&self) -> bool {
        matches!(self.power.state, State::Standby | State::Starts { woken: Some(_), .. })
    }

    /// SLEEP in the machine cycle `now`; false where an enabled flag is set, which makes it a NOP (12.13.1).
    pub fn sleep(&mut self, now: u64) -> bool {
        self.run(4 * now + 3);
        let t = 4 * now + 4;
        if self.wanted(t) {
            return false;
        }
        self.restart_watchdog(t);
        self.run(t);
        self.stand(State::Standby, t);
        // What is sampled while the oscillator stands needs no edge of it.
        for sampled in &mut self.irq.sampled {
            *sampled = if *sampled == NEVER { NEVER } else { t };
        }
        self.irq.at = NEVER;
        // What has come with the end of the instruction wakes at once.
        self.flag_raised(t);
        self.plan();
        true
    }

    /// CLRWDT in the machine cycle `now`.
    pub fn clear_watchdog(&mut self, now: u64) {
        self.run(4 * now + 3);
        self.restart_watchdog(4 * now + 4);
    }

    /// Clears the watchdog at the clock `t`, at which TMR0 may come round too.
    fn restart_watchdog(&mut self, t: u64) {
        self.touched |= 1 << at::TIMER0;
        self.timer0.clear_watchdog(t, &mut self.out);
        self.carry_out();
        self.plan();
    }

    /// A flag was set at the clock `t`: it may end standby.
    pub(super) fn flag_raised(&mut self, t: u64) {
        if self.power.state == State::Standby && self.wanted(t) {
            self.begin_to_wake(t, false);
        }
    }

    /// The watchdog has run out at the clock `t`: it resets, or ends standby.
    pub(super) fn watchdog_ran_out(&mut self, t: u64) {
        match self.power.state {
            State::Runs => self.power.request = Some(Reset::Watchdog),
            State::Standby => self.begin_to_wake(t, true),
            _ => {}
        }
    }

    fn begin_to_wake(&mut self, t: u64, by_watchdog: bool) {
        let wait = if self.power.config.crystal { OST } else { 0 };
        self.power.state = State::Starts { until: (t + wait).next_multiple_of(4), woken: Some(by_watchdog) };
    }

    /// The reset pin has changed.
    pub(super) fn master_clear(&mut self, high: bool, t: u64) {
        if !self.power.config.master_clear {
            return;
        }
        self.power.cleared = !high;
        if !high {
            self.power.request = Some(Reset::External);
        } else {
            self.release(t);
        }
    }

    /// Nothing holds the chip in reset any more, perhaps.
    fn release(&mut self, t: u64) {
        if self.power.state != State::Held || self.power.cleared || self.power.low {
            return;
        }
        self.power.state = State::Starts { until: t.next_multiple_of(4).max(self.power.ready), woken: None };
        if std::mem::take(&mut self.power.off) {
            self.power.request = Some(Reset::PowerOn);
        }
    }

    /// The supply is this from the clock `t` on.
    pub(super) fn supplied(&mut self, millivolts: u32, t: u64) {
        self.outside.supply = millivolts;
        self.touched |= 1 << at::ADC | 1 << at::COMPARATORS;
        self.adc.set_supply(millivolts, t);
        self.comparators.set_supply(millivolts, t, &mut self.out);
        let clocks = self.power.clocks;
        let low = self.power.config.brown_out && millivolts < clocks.brown_out_mv || millivolts < POWER_OFF;
        self.power.off |= millivolts < POWER_OFF;
        if low && !self.power.low && self.power.brown_out_at == NEVER {
            let wait = if millivolts < POWER_OFF { 0 } else { clocks.brown_out };
            self.power.brown_out_at = t + wait;
        } else if low && millivolts < POWER_OFF && !self.power.low {
            self.power.brown_out_at = t;
        } else if !low {
            self.power.brown_out_at = NEVER;
            if std::mem::take(&mut self.power.low) {
                self.power.state = State::Held;
                self.power.request =
                    Some(if std::mem::take(&mut self.power.off) { Reset::PowerOn } else { Reset::BrownOut });
            }
        }
    }

    /// What is due in the state of the core at the clock `t`.
    pub(super) fn run_power(&mut self, t: u64) {
        if self.power.brown_out_at <= t {
            self.power.brown_out_at = NEVER;
            self.power.low = true;
            self.stand(State::Held, t);
        }
        if let State::Starts { until, woken } = self.power.state
            && until <= t
        {
            self.power.state = State::Runs;
            every_part!(self, part => part.wake(t, &mut self.out));
            self.touched = u8::MAX;
            self.carry_out();
            match woken {
                Some(by_watchdog) => {
                    self.orders.push_back(Order::Woken { by_watchdog });
                    // The instruction behind SLEEP is executed before the interrupt (12.13.2).
                    self.irq.at = NEVER;
                    self.look_again(t / 4);
                }
                None => self.restart_watchdog(t),
            }
        }
    }

    /// Takes the reset that the chip asks for.
    pub fn reset_requested(&mut self) -> Option<Reset> {
        self.power.request.take()
    }

    /// Puts a voltage on a pin from the machine cycle and clock `at` on, at once when that has passed.
    pub fn put_volts(&mut self, at: Time, now: u64, pin: PinId, millivolts: u32) {
        self.put_outside(at, now, Put::Volts(pin, millivolts));
    }

    /// Sets the supply, in millivolts, from the machine cycle and clock `at` on, at once when that has passed.
    pub fn put_supply(&mut self, at: Time, now: u64, millivolts: u32) {
        self.put_outside(at, now, Put::Supply(millivolts));
    }

    /// Something comes from outside at the machine cycle and clock `at`.
    pub(super) fn put_outside(&mut self, at: Time, now: u64, put: Put) {
        self.run(4 * now);
        let t = at.cycle.saturating_mul(4).saturating_add(u64::from(at.phase.min(3)));
        self.outside.drives.add(t.max(4 * now), put);
        self.plan();
        self.run(4 * now);
    }

    /// Something enabled could still interrupt, wake or reset the chip by itself: the watchdog, or a source that can interrupt
    /// while something is due.
    pub(super) fn wakes(&self) -> bool {
        let starts = matches!(self.power.state, State::Starts { .. });
        let watched = self.timer0.watches();
        let heard = self.irq.enables.intcon & super::irq::GIE != 0 || !self.power.runs();
        let rows = || self.part.flags.iter();
        let enabled = || rows().any(|row| self.enabled(self.irq.enables, row.enable, row.peripheral));
        self.power.state != State::Held
            && (starts || watched || self.irq.at != NEVER || heard && self.due != NEVER && enabled())
    }

    /// Logs edges, sent bytes and fights over pins from the machine cycle `now` on, those that are fought for already too, or
    /// stops and forgets them.
    pub fn log(&mut self, on: bool, now: u64) {
        let pins = 0..crate::periph::ports::PINS as PinId;
        self.log.switch(on, now, pins.filter(|&pin| self.ports.pin(pin).contention()));
        self.ports.set_concerned(if on { u64::MAX } else { self.outside.concerned() });
    }

    /// Writes a register by hand between two instructions.
    pub fn poke(&mut self, reg: u16, value: u8, now: u64) {
        self.run(4 * now);
        if let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) {
            self.store(sfr, value, 4 * now);
        }
    }

    /// True when nothing from outside holds the pin of a level.
    #[must_use]
    pub fn floats(&self, pin: PinId) -> bool {
        self.level(pin) == Level::Float
    }
}
