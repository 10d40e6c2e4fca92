//! The chip around the core: parts, pins, interrupts, power, as one [`Bus`].
//!
//! Inside, time is counted in clocks of the oscillator ([`crate::periph`]); the core counts instruction cycles of four.

mod irq;
mod pins;
mod power;
mod regs;
mod state;

use std::collections::VecDeque;

use emu_core::cpu::{Bus, NEVER, Reset, Wake};
use emu_core::outside::Log;
use emu_core::pins::{Event, Level, Pin, PinId, Time};

use crate::chips::{self, Part};
use crate::cpu::Options;
use crate::periph::adc::Adc;
use crate::periph::comparator::Comparators;
use crate::periph::eeprom::{Eeprom, Flash};
use crate::periph::map::Sfr;
use crate::periph::ports::Ports;
use crate::periph::psp::Psp;
use crate::periph::ssp::Ssp;
use crate::periph::timer0::Timer0;
use crate::periph::timers::Timers;
use crate::periph::usart::Usart;
use crate::periph::{Device, Outbox, Signal};

pub use irq::Interrupts;
use pins::{Outside, Put};
pub use power::Clocks;
use power::Power;

/// What the chip asks of the core between two instructions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Order {
    /// Standby has ended.
    Woken {
        /// By the watchdog.
        by_watchdog: bool,
    },
    /// A word of program memory is wanted.
    ReadWord {
        /// Its address.
        addr: u16,
    },
    /// Words of program memory are written.
    WriteWords {
        /// Address of the first.
        addr: u16,
        /// The words.
        words: Vec<u16>,
        /// They replace what was there; else only bits that are 0 in them change, to 0.
        erased: bool,
    },
    /// The core stands still up to a machine cycle.
    Stand {
        /// Machine cycle.
        until: u64,
    },
    /// Instructions up to a machine cycle are fetched, but not executed.
    Ignore {
        /// Machine cycle.
        until: u64,
    },
}

/// The chip around the core.
#[derive(Debug, Clone)]
pub struct Soc {
    part: &'static Part,
    /// Configuration words and IDs from 2000h on.
    config: [u16; 16],
    ports: Ports,
    timer0: Timer0,
    timers: Timers,
    usart: Usart,
    ssp: Ssp,
    eeprom: Eeprom,
    adc: Adc,
    comparators: Comparators,
    psp: Psp,
    irq: Interrupts,
    power: Power,
    pcon: u8,
    /// What a program has written to OSCCON and OSCTUNE; the clock stays what the host says.
    osc: [u8; 2],
    outside: Outside,
    orders: VecDeque<Order>,
    /// The core stands still up to this machine cycle.
    stall: u64,
    /// From the first of these machine cycles on and before the second, instructions are not executed.
    ignored: (u64, u64),
    log: Log,
    /// When every part next has something to do,
    nexts: [u64; at::COUNT],
    /// but for the parts of this set, which have been touched since that was asked.
    touched: u8,
    /// The next clock at which anything is due.
    due: u64,
    /// The clock up to which everything has been run.
    ran: u64,
    /// The deadline that the core was told last, in machine cycles.
    told: u64,
    /// Signals that are being carried out; empty between calls.
    out: Outbox,
}

/// Does something with every part.
macro_rules! every_part {
    ($soc:ident, $part:ident => $what:expr) => { every_part!($soc, $part, _number => $what) };
    ($soc:ident, $part:ident, $number:ident => $what:expr) => {{
        { let ($part, $number) = (&mut $soc.timer0, at::TIMER0); $what; }
        { let ($part, $number) = (&mut $soc.timers, at::TIMERS); $what; }
        { let ($part, $number) = (&mut $soc.usart, at::USART); $what; }
        { let ($part, $number) = (&mut $soc.ssp, at::SSP); $what; }
        { let ($part, $number) = (&mut $soc.eeprom, at::EEPROM); $what; }
        { let ($part, $number) = (&mut $soc.adc, at::ADC); $what; }
        { let ($part, $number) = (&mut $soc.comparators, at::COMPARATORS); $what; }
        { let ($part, $number) = (&mut $soc.psp, at::PSP); $what; }
    }};
}
use every_part;

/// Parts by number.
#[rustfmt::skip]
mod at {
    pub(super) const TIMER0:      usize = 0;
    pub(super) const TIMERS:      usize = 1;
    pub(super) const USART:       usize = 2;
    pub(super) const SSP:         usize = 3;
    pub(super) const EEPROM:      usize = 4;
    pub(super) const ADC:         usize = 5;
    pub(super) const COMPARATORS: usize = 6;
    pub(super) const PSP:         usize = 7;
    pub(super) const COUNT:       usize = 8;
}

impl Soc {
    /// The chip at cycle 0, after power-on. `config`: the words from 2000h on that the image fills, the rest erased; `eeprom`: its
    /// data memory.
    #[must_use]
    pub fn new(part: &'static Part, options: Options, config: &[u16], eeprom: &[u8]) -> Soc {
        let config = power::configuration(part, options.config, config);
        let clocks = Clocks::new(part, &options);
        let power = Power::new(part, clocks, &config);
        let settings = power.config;
        let outside = Outside::new(part, settings.ccp1);
        let mut soc = Soc {
            part,
            config,
            ports: Ports::new(part, settings.withheld),
            timer0: Timer0::new(settings.watchdog, clocks.watchdog, part.has(Sfr::WDTCON)),
            timers: Timers::new(part.ccps, options.timer1_hz.map(|hz| (options.hz, hz))),
            usart: Usart::new().with_early_trmt(options.readings.trmt_as_stop_begins),
            ssp: Ssp::new(part.ssp != chips::Ssp::Basic)
                .with_stretch(part.ssp == chips::Ssp::MasterStretch)
                .with_kept_bits(options.readings.ss_keeps_bits),
            eeprom: Eeprom::new(
                part.memory,
                eeprom,
                clocks.eeprom,
                Flash {
                    words: (part.chip.flash / 2) as u16,
                    writable: settings.writable.0..settings.writable.1,
                    clocks: clocks.flash,
                },
            ),
            adc: Adc::new(part.adc, part.analog.len() as u8, clocks.adc_rc, options.hz)
                .with_ideal_acquisition(options.ideal_acquisition),
            comparators: Comparators::new(part.comparators),
            psp: Psp::new(),
            irq: Interrupts::new(part),
            power,
            pcon: 0,
            osc: [0; 2],
            outside,
            orders: VecDeque::new(),
            stall: 0,
            ignored: (0, 0),
            log: Log::OFF,
            nexts: [NEVER; at::COUNT],
            touched: u8::MAX,
            due: 0,
            ran: 0,
            told: NEVER,
            out: Outbox::new(),
        };
        soc.reset(Reset::PowerOn, 0);
        soc
    }

    /// Drives a pin from outside, at once when that moment has passed. `now` is the machine cycle of the boundary.
    pub fn drive(&mut self, at: Time, now: u64, pin: PinId, level: Level) {
        self.put_outside(at, now, Put::Level(pin, level));
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

    /// Takes the oldest order to the core at the machine cycle `now`.
    pub fn order(&mut self, now: u64) -> Option<Order> {
        if let Some(order) = self.orders.pop_front() {
            return Some(order);
        }
        if now < self.stall {
            return Some(Order::Stand { until: std::mem::take(&mut self.stall) });
        }
        let (from, until) = self.ignored;
        ((from..until).contains(&now)).then_some(Order::Ignore { until })
    }

    /// A word of program memory that was asked for.
    pub fn word_read(&mut self, word: u16) {
        self.eeprom.flash_data(word);
    }

    /// EEPROM.
    #[must_use]
    pub fn eeprom(&self) -> &[u8] {
        self.eeprom.bytes()
    }

    /// Writes a byte of EEPROM from outside.
    pub fn set_eeprom(&mut self, addr: usize, value: u8) {
        self.eeprom.set_byte(addr, value);
    }

    /// The configuration word at 2000h and on; erased ones behind its end.
    #[must_use]
    pub fn config(&self, index: usize) -> u16 {
        self.config.get(index).copied().unwrap_or(0x3FFF)
    }

    /// The byte whose stop bit is being sent, where the program has been told already that it is sent.
    #[must_use]
    pub fn stopping(&self) -> Option<u8> {
        self.usart.stopping()
    }

    /// Runs everything due up to the clock `t`, in order of time.
    #[inline(always)]
    fn run(&mut self, t: u64) {
        self.ran = self.ran.max(t);
        if self.due <= t {
            self.run_due(t);
        }
    }

    #[inline(never)]
    fn run_due(&mut self, t: u64) {
        while self.due <= t {
            let due = self.due;
            self.run_outside(due);
            self.run_samples(due);
            every_part!(self, part, number => if self.nexts[number] <= due {
                self.touched |= 1 << number;
                part.run(due, &mut self.out);
            });
            self.carry_out();
            self.run_power(due);
            self.plan();
        }
    }

    /// Works out when anything is due next.
    fn plan(&mut self) {
        let due = self.outside.drives.next().min(self.irq.next_sample()).min(self.power.next());
        if self.touched != 0 {
            every_part!(self, part, number => if self.touched >> number & 1 == 1 { self.nexts[number] = part.next() });
            self.touched = 0;
        }
        self.due = self.nexts.into_iter().fold(due, u64::min);
    }

    /// Carries out what parts have put into the outbox, and what comes of that.
    #[inline(always)]
    fn carry_out(&mut self) {
        if !self.out.is_empty() {
            self.carry_all();
        }
    }

    #[inline(never)]
    fn carry_all(&mut self) {
        while !self.out.is_empty() {
            let mut signals = std::mem::take(&mut self.out);
            for signal in signals.drain(..) {
                self.carry(signal);
            }
            // The list itself is used again.
            if self.out.is_empty() {
                self.out = signals;
                return;
            }
        }
    }

    fn carry(&mut self, signal: Signal) {
        match signal {
            Signal::Flag { t, flag } => {
                self.raise(flag, t);
                self.flag_raised(t);
            }
            Signal::Drive { t, line, drive } => self.take_line(line, drive, t),
            Signal::Sent { t, byte } => self.log.note(Event::Sent { at: time(t), uart: 0, byte }),
            Signal::Convert { t } => {
                self.touched |= 1 << at::ADC;
                self.adc.start(t, &mut self.out);
            }
            Signal::Timer2 { t } => {
                self.touched |= 1 << at::SSP;
                self.ssp.timer2(t, &mut self.out);
            }
            Signal::Watchdog { t } => self.watchdog_ran_out(t),
            Signal::FlashRead { addr } => self.orders.push_back(Order::ReadWord { addr }),
            Signal::FlashWrite { addr, words } => {
                self.orders.push_back(Order::WriteWords { addr, words, erased: true })
            }
            Signal::FlashProgram { addr, words } => {
                self.orders.push_back(Order::WriteWords { addr, words, erased: false })
            }
            Signal::Stall { until } => self.stall = until.div_ceil(4),
            Signal::Ignore { from, until } => self.ignored = (from.div_ceil(4), until.div_ceil(4)),
        }
    }

    /// What an access asks of the core.
    fn wake(&mut self, now: u64) -> Wake {
        let sooner = self.due.div_ceil(4).min(self.irq.at) < self.told;
        if sooner
            || !self.orders.is_empty()
            || self.stall > now
            || self.ignored.1 > now
            || !self.log.is_empty()
            || self.power.requests()
        {
            Wake::DEADLINE
        } else {
            Wake::NONE
        }
    }
}

/// The number of the port whose register this is.
#[inline(always)]
fn latch_of(reg: Sfr) -> Option<usize> {
    let port = (reg as usize).wrapping_sub(Sfr::PORTA as usize);
    (port <= Sfr::PORTE as usize - Sfr::PORTA as usize).then_some(port)
}

/// The moment of a clock.
fn time(t: u64) -> Time {
    Time { cycle: t / 4, phase: (t % 4) as u8 }
}

impl Bus for Soc {
    fn read(&mut self, reg: u16, now: u64) -> (u8, Wake) {
        let due = self.due <= 4 * now;
        self.run(4 * now);
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return (0, Wake::NONE) };
        // Ports go the short way.
        if let Some(port) = latch_of(sfr).filter(|_| sfr != Sfr::PORTD) {
            if sfr == Sfr::PORTB {
                self.see_b();
            }
            return (self.ports.input(port), if due { Wake::DEADLINE } else { Wake::NONE });
        }
        let value = self.load(sfr, 4 * now);
        let wake = self.wake(now);
        (value, if due { Wake::DEADLINE } else { wake })
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return 0 };
        if self.due <= 4 * now {
            let mut soc = self.clone();
            soc.run(4 * now);
            return soc.show(sfr, 4 * now);
        }
        self.show(sfr, 4 * now)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> Wake {
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return Wake::NONE };
        let due = self.due <= 4 * now + 3;
        if sfr == Sfr::PORTB {
            // A write of the port sees it as a read does, in Q2 (DS30292, 3.2).
            self.run(4 * now);
            self.see_b();
        }
        self.run(4 * now + 3);
        self.store(sfr, value, 4 * now + 4);
        let wake = self.wake(now);
        if due { Wake::DEADLINE } else { wake }
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> Wake {
        let old = self.peek(reg, now);
        self.write(reg, old & !mask | value & mask, now)
    }

    fn fire(&mut self, now: u64) -> u64 {
        self.run(4 * now);
        self.told = self.due.div_ceil(4).min(if self.ignored.0 > now { self.ignored.0 } else { NEVER });
        if self.power.runs() {
            self.told = self.told.min(self.irq.at);
        }
        self.told
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.due <= 4 * now {
            return now;
        }
        let sfr = Sfr::ALL.get(usize::from(reg)).copied();
        sfr.map_or(NEVER, |sfr| self.steady(sfr, 4 * now).min(self.due)).div_ceil(4)
    }

    fn pending(&self, now: u64) -> Option<u8> {
        if self.due <= 4 * now {
            let mut soc = self.clone();
            soc.run(4 * now);
            return soc.interrupt_since(now).map(|_| 1);
        }
        self.interrupt_since(now).map(|_| 1)
    }

    fn take(&mut self, _: u8, now: u64) {
        self.run(4 * now);
        self.irq.enables.intcon &= !irq::GIE;
        self.irq.at = NEVER;
    }

    fn can_wake(&self, _: bool) -> bool {
        self.wakes()
    }

    fn busy(&self) -> bool {
        let parts = [self.usart.next(), self.ssp.next(), self.eeprom.next(), self.adc.next()];
        let clocked = self.ssp.waits_for_timer2() && self.timers.timer2_match_next(self.ran) != NEVER;
        let due = parts.iter().any(|&next| next != NEVER) || self.outside.drives.next() != NEVER;
        due || clocked || self.timers.moves_pins()
    }
}
