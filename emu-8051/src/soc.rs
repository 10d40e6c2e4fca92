//! The chip around the core: the registers at their addresses, and what is due when.
//!
//! Nothing ticks. `deadline` is the next cycle at which something can be seen from outside of a part: a pin that moves, a bit
//! of the serial port, an enabled interrupt, a reset. Everything else is worked out when it is read.
//!
//! Inside, time is that of the oscillator: in power-down it stands still (`frozen` cycles so far), while the machine's
//! cycles, by which pins are driven and events are logged, go on.

use std::collections::VecDeque;

use emu_core::cpu::{Bus, NEVER, Reset, Wake};
use emu_core::outside::{Drives, Log};
use emu_core::pins::{Event, Level, Pin, PinId, Time};

mod baud;
mod bus;
mod clock;
mod irq;
mod power;
mod regs;
mod state;

use crate::chips::{self, Part};
use crate::cpu::{Options, Readings};
use crate::periph::map::{at, pin};
use crate::periph::ports::{PINS, Ports};
use crate::periph::serial::{Edge, Line, Serial, Step};
use crate::periph::timer::Timers;
use crate::periph::timer2::Timer2;
use baud::Baud;
pub use bus::Transfer;
use irq::Interrupts;
use power::{Power, Watchdog};

/// The chip without its core and memories.
#[derive(Debug, Clone)]
pub struct Soc {
    part: &'static Part,
    readings: Readings,
    clocks_per_cycle: u8,
    ports: Ports,
    timers: Timers,
    timer2: Option<Timer2>,
    /// Overflows of timer 2 whose toggle is on the pin.
    toggled: u64,
    serial: Serial,
    baud: Baud,
    interrupts: Interrupts,
    power: Power,
    watchdog: Watchdog,
    pcon: u8,
    auxr: u8,
    /// Cycles that the oscillator has stood still.
    frozen: u64,
    /// Levels of the pins that are sampled, as the parts know them.
    sampled: [bool; SAMPLED.len()],
    /// Changes of the serial lines to come.
    edges: VecDeque<Edge>,
    drives: Drives,
    log: Log,
    /// Edges of MOVX are logged too.
    shows_bus: bool,
    /// In oscillator time.
    deadline: u64,
    /// The cycle up to which timers were brought last.
    synced: u64,
    /// The first boundary at which an interrupt can be served, in oscillator time; 0 where that is to be found out.
    irq_at: u64,
    /// The deadline that the core was told last, in machine cycles.
    told: u64,
    /// Pins have changed and are to be sampled in this cycle.
    sample_at: u64,
}

/// Pins that parts of the chip listen to.
const SAMPLED: [PinId; 8] = [pin::INT0, pin::INT1, pin::T0, pin::T1, pin::RXD, pin::T2, pin::T2EX, pin::RST];

/// Place of the reset pin among them.
const RST: usize = SAMPLED.len() - 1;

/// True for registers that may read otherwise in every cycle: a loop over one of them can never be jumped over.
#[must_use]
pub const fn restless(addr: u8) -> bool {
    matches!(addr, at::TL0 | at::TL1 | at::TH0 | at::TH1 | at::TL2 | at::TH2)
}

impl Soc {
    /// The chip at cycle 0 after power-on. `bus`: program memory is outside, at least in part.
    #[must_use]
    pub fn new(part: &'static Part, options: Options, bus: bool) -> Soc {
        let mut soc = Soc {
            part,
            readings: options.readings,
            clocks_per_cycle: if options.x2 { 6 } else { 12 },
            ports: Ports::new(part, bus),
            timers: Timers::new(0),
            timer2: None,
            toggled: 0,
            serial: Serial::new(),
            baud: Baud::START,
            interrupts: Interrupts::new([true; 2]),
            power: Power::START,
            watchdog: Watchdog::OFF,
            pcon: 0,
            auxr: 0,
            frozen: 0,
            sampled: [true, true, true, true, true, true, true, false],
            edges: VecDeque::new(),
            drives: Drives::NONE,
            log: Log::OFF,
            shows_bus: false,
            deadline: NEVER,
            synced: 0,
            irq_at: 0,
            told: NEVER,
            sample_at: NEVER,
        };
        soc.reset(Reset::PowerOn, 0);
        soc
    }

    /// Resets all registers at the machine cycle `now` (user's manual, "Reset"). Outside drives stay, and so does PCON.POF
    /// except at power-on, which sets it.
    pub fn reset(&mut self, why: Reset, now: u64) {
        self.run(now);
        self.wake_oscillator(now);
        let t = self.inner(now);
        self.ports.reset();
        self.edges.clear();
        self.timers = Timers::new(t);
        self.timer2 = (self.part.timer2 != chips::Timer2::None).then(|| Timer2::new(t));
        self.toggled = 0;
        self.serial = Serial::new();
        self.pcon = match why {
            Reset::PowerOn if self.part.at89s => power::POF,
            _ => self.pcon & power::POF,
        };
        self.auxr = 0;
        self.watchdog = Watchdog::OFF;
        for pin in 0..PINS as PinId {
            self.settle(pin, t, 0);
        }
        // After reset every part takes the pins for what they are.
        self.interrupts = Interrupts::new([pin::INT0, pin::INT1].map(|pin| self.ports.pin(pin).high));
        let reset_pin = self.sampled[RST];
        self.sampled = [true; SAMPLED.len()];
        self.sampled[RST] = reset_pin;
        self.baud = Baud::START;
        self.sample(t);
        self.schedule();
        self.irq_at = 0;
    }

    /// Drives a pin from outside at the machine cycle `at`, at once when that has passed.
    pub fn drive(&mut self, at: u64, now: u64, pin: PinId, level: Level) {
        self.run(now);
        let at = at.max(now);
        self.drives.add(at, (pin, level));
        self.schedule();
        self.run(now);
    }

    /// Level of a pin after everything that was run so far; [`Level::Float`] for one that does not exist.
    #[must_use]
    pub fn level(&self, pin: PinId) -> Level {
        self.ports.pin(pin).level()
    }

    /// All pins.
    #[must_use]
    pub fn pins(&self) -> &[Pin] {
        self.ports.pins()
    }

    /// Takes the oldest logged event.
    pub fn drain(&mut self) -> Option<Event> {
        self.log.take()
    }

    /// The latch of port 2.
    #[inline]
    #[must_use]
    pub fn port2(&self) -> u8 {
        self.ports.latch(2)
    }

    /// RETI.
    pub fn reti(&mut self) {
        self.interrupts.reti();
        self.irq_at = 0;
    }

    /// Clocks of a machine cycle.
    #[must_use]
    pub fn clocks_per_cycle(&self) -> u32 {
        self.clocks_per_cycle.into()
    }

    /// Runs everything due up to the machine cycle `now`, in order of time.
    fn run(&mut self, now: u64) {
        while self.due() <= now {
            let due = self.due();
            if self.power.down() {
                self.run_stopped(due);
            } else {
                self.run_cycle(self.inner(due));
            }
            self.run_power(due);
            self.schedule();
        }
    }

    /// Oscillator time of the machine cycle `now`.
    fn inner(&self, now: u64) -> u64 {
        self.power.stopped_at(now).saturating_sub(self.frozen)
    }

    /// The machine cycle of the next deadline.
    fn due(&self) -> u64 {
        let drive = self.drives.next().min(self.power.next());
        if self.power.down() { drive } else { drive.min(self.deadline.saturating_add(self.frozen)) }
    }

    /// Everything that is due at the cycle `t`, the next one at which anything is.
    fn run_cycle(&mut self, t: u64) {
        // S1P1: pins.
        while let Some((pin, level)) = self.drives.take(t + self.frozen) {
            let changed = self.ports.drive(pin, level, t);
            self.edge(pin, changed, t, 0);
            self.sample_at = t;
        }
        while let Some(edge) = self.edges.front().copied().filter(|edge| edge.at.cycle <= t) {
            self.edges.pop_front();
            self.put(edge);
        }
        self.clock_out(t);
        // S5P2: samples, bits, flags.
        if self.sample_at <= t {
            self.sample(t);
        }
        self.run_serial(t);
        self.run_watchdog(t);
    }

    /// The parts are told of the levels that have changed, as sampled in cycle `t`.
    fn sample(&mut self, t: u64) {
        self.sample_at = NEVER;
        for (i, pin) in SAMPLED.into_iter().enumerate() {
            let high = self.ports.pin(pin).high;
            if high == self.sampled[i] {
                continue;
            }
            self.sampled[i] = high;
            self.irq_at = 0;
            match pin {
                pin::INT0 | pin::INT1 => {
                    let n = usize::from(pin == pin::INT1);
                    self.timers.sync(t.saturating_sub(1));
                    self.timers.pin_int(n, high, t);
                    self.interrupts.external[n].pin(high, t);
                }
                pin::T0 | pin::T1 => {
                    self.timers.sync(t.saturating_sub(1));
                    self.timers.pin_t(usize::from(pin == pin::T1), high, t);
                }
                pin::RXD => {
                    self.pass_ticks(t.saturating_sub(1));
                    self.serial.line(high);
                }
                pin::T2 => {
                    if let Some(timer2) = &mut self.timer2 {
                        timer2.sync(t.saturating_sub(1));
                        timer2.pin_t2(high, t);
                    }
                }
                pin::T2EX => {
                    if let Some(timer2) = &mut self.timer2 {
                        timer2.sync(t.saturating_sub(1));
                        timer2.pin_t2ex(high, t);
                    }
                }
                _ => self.power.reset_pin(high && !self.ports.rst_high, t + self.frozen),
            }
        }
    }

    /// Steps of the serial port: lines that change now or later, bytes that have gone out.
    fn took(&mut self, step: Step, t: u64) {
        if step.flags != 0 {
            self.irq_at = 0;
        }
        for edge in step.edges() {
            if edge.at.cycle <= t && edge.at.phase == 0 { self.put(edge) } else { self.edges.push_back(edge) }
        }
        if let Some(byte) = step.sent {
            self.log.note(Event::Sent { at: Time::at(t + self.frozen), uart: 0, byte });
        }
    }

    /// A change of a serial line.
    fn put(&mut self, edge: Edge) {
        let pin = match edge.line {
            Line::Txd => {
                self.ports.txd_low = !edge.level;
                pin::TXD
            }
            Line::Rxd => {
                self.ports.rxd_low = !edge.level;
                pin::RXD
            }
        };
        self.settle(pin, edge.at.cycle, edge.at.phase);
    }

    /// Settles a pin at clock `phase` of cycle `t` after the chip changed what it does to it.
    fn settle(&mut self, pin: PinId, t: u64, phase: u8) {
        let changed = self.ports.settle(pin, t);
        self.edge(pin, changed, t, phase);
    }

    /// Logs the edge of a pin, if there was one, and a fight over it; parts that listen to it will be told.
    fn edge(&mut self, pin: PinId, changed: Option<Level>, t: u64, phase: u8) {
        let at = Time { cycle: t + self.frozen, phase: phase * self.clocks_per_cycle / 12 };
        if self.log.is_on() {
            self.log.pin(at, pin, self.ports.contention(pin), changed);
        }
        if changed.is_none() {
            return;
        }
        if SAMPLED.contains(&pin) {
            self.sample_at = self.sample_at.min(t);
        }
        if self.part.comparator && matches!(pin, 8 | 9) {
            self.settle(pin::OUT, t, phase);
        }
    }

    /// Works out the next deadline, interrupts aside.
    fn schedule(&mut self) {
        let edge = self.edges.front().map_or(NEVER, |edge| edge.at.cycle);
        let toggle = self.next_toggle().map_or(NEVER, |(state, _)| state / 6);
        self.deadline = edge.min(toggle).min(self.sample_at).min(self.next_serial()).min(self.watchdog.next());
    }
}

impl Bus for Soc {
    fn read(&mut self, reg: u16, now: u64) -> (u8, Wake) {
        let due = self.due() <= now;
        self.run(now);
        let addr = reg as u8;
        if counts(addr) {
            self.sync(self.inner(now));
        }
        let hold = self.readings.hold_on_read && matches!(addr, at::IE | at::IP);
        let wake = Wake(if due { Wake::DEADLINE.0 } else { 0 } | if hold { Wake::HOLD.0 } else { 0 });
        (self.show(addr), wake)
    }

    fn read_latch(&mut self, reg: u16, now: u64) -> (u8, Wake) {
        match port_of(reg as u8).filter(|&port| !self.absent(port)) {
            Some(port) => (self.ports.latch(port), Wake::NONE),
            None => self.read(reg, now),
        }
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        let mut soc = self.clone();
        soc.run(now);
        soc.sync(soc.inner(now));
        soc.show(reg as u8)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> Wake {
        self.write_bits(reg, 0xFF, value, now)
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> Wake {
        let due = self.due() <= now;
        self.run(now);
        let t = self.inner(now);
        let addr = reg as u8;
        if let Some(port) = port_of(addr) {
            // A hand can write while the oscillator stands; events bear the machine's cycle.
            let ahead = now.saturating_sub(self.power.stopped_at(now));
            self.frozen += ahead;
            let quiet = self.store_port(port, mask, value, t);
            self.frozen -= ahead;
            return if quiet && !due { Wake::NONE } else { Wake::DEADLINE };
        }
        let logged = self.log.len();
        self.sync(t);
        self.store(addr, mask, value, t);
        self.schedule();
        self.irq_at = self.next_interrupt(t);
        // The core need not look before it does so anyhow.
        let sooner = self.due().min(self.irq_at.saturating_add(self.frozen)) < self.told;
        let seen = sooner || due || self.log.len() != logged || addr == at::PCON;
        match addr {
            at::IE | at::IP => Wake(Wake::DEADLINE.0 | Wake::HOLD.0),
            _ if seen => Wake::DEADLINE,
            _ => Wake::NONE,
        }
    }

    fn fire(&mut self, now: u64) -> u64 {
        self.run(now);
        self.told = self.due();
        if self.power.stops_core() {
            return self.told;
        }
        let t = self.inner(now);
        if self.irq_at <= t {
            self.sync_boundary(t);
            self.irq_at = self.next_interrupt(t);
        }
        self.told = self.told.min(self.irq_at.saturating_add(self.frozen));
        self.told
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.due() <= now { now } else { self.steady(reg as u8, now) }
    }

    fn pending(&self, now: u64) -> Option<u8> {
        if self.due() <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.pending(now);
        }
        let t = self.inner(now);
        if self.irq_at > t || self.power.stops_core() {
            return None;
        }
        if self.synced < t {
            let mut soc = self.clone();
            soc.sync(t);
            return soc.served(t);
        }
        self.served(t)
    }

    fn take(&mut self, vector: u8, now: u64) {
        self.run(now);
        let t = self.inner(now);
        self.sync(t);
        self.pcon &= !power::IDL;
        self.watchdog.resume(t);
        self.serve(vector);
        self.schedule();
        self.irq_at = 0;
    }

    fn can_wake(&self, interrupts_enabled: bool) -> bool {
        let _ = interrupts_enabled;
        self.wakes()
    }

    fn busy(&self) -> bool {
        let receives = self.serial.rx_wait().is_some() && self.next_serial() != NEVER;
        let frames = self.serial.busy() || receives || self.serial.shift_next() != NEVER;
        frames || self.next_toggle().is_some() || self.drives.next() != NEVER || !self.edges.is_empty()
    }
}

/// True for registers that change with the counts of timers.
const fn counts(addr: u8) -> bool {
    matches!(addr, at::TCON..=at::TH1 | at::T2CON..=at::TH2)
}

/// The number of the port at a direct address.
const fn port_of(addr: u8) -> Option<usize> {
    match addr {
        at::P0 => Some(0),
        at::P1 => Some(1),
        at::P2 => Some(2),
        at::P3 => Some(3),
        _ => None,
    }
}
