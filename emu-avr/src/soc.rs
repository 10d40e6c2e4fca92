//! The chip around the core: its units, the registers at their addresses, and what is due when.
//!
//! Nothing ticks. `due` is the next cycle at which anything can be noticed outside of a unit: a pin that moves, a byte that ends,
//! an enabled interrupt, a reset. Everything else is worked out when it is read.

use std::{collections::VecDeque, sync::Arc};

use emu_core::cpu::{Bus, NEVER, Reset, Wake};
use emu_core::outside::{Drives, Log};
use emu_core::parts::prescaler::Prescaler;
use emu_core::pins::{Event, Level, Pin, PinId, Time};

use crate::chips::{Fuses, Part, Site, unit};
use crate::cpu::Options;
use crate::periph::adc::Adc;
use crate::periph::comparator::Comparator;
use crate::periph::eeprom::Eeprom;
use crate::periph::external::External;
use crate::periph::guard::{self, Watchdog};
use crate::periph::ports::Ports;
use crate::periph::spi::Spi;
use crate::periph::spm::{Bytes, Spm};
use crate::periph::timers::Timer;
use crate::periph::twi::Twi;
use crate::periph::usart::Usart;
use crate::periph::{Device, Outbox, Signal, timers};
use crate::turn::RAM;

/// Does something with the unit of a number.
macro_rules! unit {
    ($soc:expr, $number:expr, $unit:ident => $what:expr) => {
        match $number {
            n @ unit::TIMER..unit::USART => {
                let $unit = &mut $soc.timers[n - unit::TIMER];
                $what
            }
            n @ unit::USART..unit::SPI => {
                let $unit = &mut $soc.usarts[n - unit::USART];
                $what
            }
            unit::SPI => {
                let $unit = &mut $soc.spi;
                $what
            }
            unit::TWI => {
                let $unit = &mut $soc.twi;
                $what
            }
            unit::ADC => {
                let $unit = &mut $soc.adc;
                $what
            }
            unit::COMPARATOR => {
                let $unit = &mut $soc.comparator;
                $what
            }
            unit::EEPROM => {
                let $unit = &mut $soc.eeprom;
                $what
            }
            unit::SPM => {
                let $unit = &mut $soc.spm;
                $what
            }
            unit::WATCHDOG => {
                let $unit = &mut $soc.watchdog;
                $what
            }
            _ => {
                let $unit = &mut $soc.external;
                $what
            }
        }
    };
}
use unit as with_unit;

mod lint;
mod memory;
mod pins;
mod power;
mod regs;
mod sleep;
mod state;

pub use memory::LOW;
pub use pins::Put;
use pins::Wiring;
use power::Power;
pub use sleep::SleepMode;

/// What the chip wants of its core between two instructions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Order {
    /// A page of program memory is erased, from this byte address on.
    Erase {
        /// Byte address of its first byte.
        addr: u32,
        /// Bytes.
        len: u32,
    },
    /// Words are programmed into program memory: bits that are 0 become 0.
    Program {
        /// Byte address of the first.
        addr: u32,
        /// The words.
        words: Vec<u16>,
    },
}

/// The chip without its core and RAM.
#[derive(Debug, Clone)]
pub struct Soc {
    part: &'static Part,
    wiring: Arc<Wiring>,
    ports: Ports,
    timers: [Timer; 4],
    usarts: [Usart; 2],
    spi: Spi,
    twi: Twi,
    adc: Adc,
    comparator: Comparator,
    eeprom: Eeprom,
    spm: Spm,
    watchdog: Watchdog,
    external: External,
    /// The prescaler of timers 0, 1 and 3, and that of timer 2 (17, 18.10).
    prescalers: [Prescaler; 2],
    gtccr: u8,
    mcusr: u8,
    mcucr: u8,
    smcr: u8,
    prr: u8,
    osccal: u8,
    rampz: u8,
    /// Bytes that are only kept.
    kept: [u8; 4],
    /// RAM below 100h, where a chip has it, from 60h on.
    low: [u8; RAM - LOW],
    /// When the register that URSEL shares out was read last.
    ursel_read: [u64; 2],
    power: Power,
    /// Levels, voltages and supply that are to come.
    drives: Drives<Put>,
    log: Log,
    /// When each unit is next due, what it asks for, and which of them were touched since that was asked.
    nexts: [u64; unit::COUNT],
    asks: [u8; unit::COUNT],
    touched: u16,
    /// The vector of the interrupt that goes first.
    first: Option<u8>,
    due: u64,
    /// The deadline that the core was told last.
    told: u64,
    orders: VecDeque<Order>,
    /// The core stands still up to this cycle; 0 where it does not.
    stall: u64,
    out: Outbox,
    pub(crate) lints: crate::lint::Lints,
}

impl Soc {
    /// The chip at cycle 0 after power-on; `eeprom` is its data memory.
    #[must_use]
    pub fn new(part: &'static Part, options: Options, bytes: Bytes, eeprom: Arc<Vec<u8>>) -> Soc {
        let timer = |n: usize| Timer::new(options.readings.timer(part.timers.get(n)));
        let hz = options.hz.max(1);
        let power = Power::new(part, options, &bytes);
        let always_on = Fuses::programmed(bytes.fuses, part.fuses.wdton);
        let mut soc = Soc {
            part,
            wiring: Arc::new(Wiring::new(part, options.package)),
            ports: Ports::new(part.ports, power.has_reset_pin.then_some(part.reset)),
            timers: std::array::from_fn(timer),
            usarts: std::array::from_fn(|_| Usart::new(0)),
            spi: Spi::new(),
            twi: Twi::new(),
            adc: Adc::new(part.adc),
            comparator: Comparator::new(part.adc.bandgap_mv, hz),
            eeprom: Eeprom::new(part.eeprom, eeprom, hz),
            spm: Spm::new(part.spm, bytes, part.boot_start(bytes.fuses), hz),
            watchdog: Watchdog::new(part.watchdog, always_on, hz),
            external: External::new(options.readings.external(part.external)),
            prescalers: [Prescaler::new(0); 2],
            gtccr: 0,
            mcusr: 0,
            mcucr: 0,
            smcr: 0,
            prr: 0,
            osccal: bytes.calibration,
            rampz: 0,
            kept: [0; 4],
            low: [0; RAM - LOW],
            ursel_read: [NEVER; 2],
            power,
            drives: Drives::NONE,
            log: Log::OFF,
            nexts: [NEVER; unit::COUNT],
            asks: [0; unit::COUNT],
            touched: u16::MAX,
            first: None,
            due: NEVER,
            told: NEVER,
            orders: VecDeque::new(),
            stall: 0,
            out: Outbox::new(),
            lints: crate::lint::Lints::default(),
        };
        soc.reset(Reset::PowerOn, 0);
        soc
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

    /// Logs edges, sent bytes and fights over pins from the cycle `now` on, those that are fought for already too, or stops and
    /// forgets them.
    pub fn log(&mut self, on: bool, now: u64) {
        let pins = 0..self.ports.pins().len() as PinId;
        self.log.switch(on, now, pins.filter(|&pin| self.ports.pin(pin).contention()));
    }

    /// Takes the oldest logged event.
    pub fn drain(&mut self) -> Option<Event> {
        self.log.take()
    }

    /// Takes the oldest order to the core.
    pub fn order(&mut self) -> Option<Order> {
        self.orders.pop_front()
    }

    /// The content of the EEPROM.
    #[must_use]
    pub fn eeprom(&self) -> &Arc<Vec<u8>> {
        self.eeprom.cells()
    }

    /// Sets a cell of the EEPROM from outside; false where there is none.
    pub fn set_eeprom(&mut self, addr: usize, value: u8) -> bool {
        self.eeprom.set_cell(addr, value)
    }

    /// Fuses, lock bits, signature and calibration.
    #[must_use]
    pub fn bytes(&self) -> &Bytes {
        self.spm.bytes()
    }

    /// Boot lock bits bar interrupts while the instruction at the byte address `pc` runs.
    #[must_use]
    pub fn locks_interrupts(&self, pc: u32) -> bool {
        self.spm.bars_interrupts(pc, self.mcucr & regs::IVSEL != 0)
    }

    /// Program word at which a reset starts: 0, or the boot section (BOOTRST).
    #[must_use]
    pub fn reset_vector(&self) -> u32 {
        let bytes = self.spm.bytes();
        let boot = Fuses::programmed(bytes.fuses, self.part.fuses.bootrst);
        if boot { self.part.boot_start(bytes.fuses) / 2 } else { 0 }
    }

    /// Program word at which the vectors begin: 0, or the boot section (IVSEL).
    #[must_use]
    pub fn vectors(&self) -> u32 {
        if self.mcucr & regs::IVSEL != 0 { self.part.boot_start(self.spm.bytes().fuses) / 2 } else { 0 }
    }

    /// WDR in the cycle `now`.
    pub fn clear_watchdog(&mut self, now: u64) {
        self.run(now);
        self.run_unit(unit::WATCHDOG, now + 1);
        self.watchdog.restart(now + 1, &mut self.out);
        self.plan();
    }

    /// Runs everything due up to `now`, in order of time.
    fn run(&mut self, now: u64) {
        while self.due <= now && self.due != NEVER {
            let due = self.due;
            self.run_outside(due);
            for number in 0..unit::COUNT {
                if self.nexts[number] <= due {
                    self.run_unit(number, due);
                }
            }
            self.run_power(due);
            self.plan();
        }
    }

    /// Does what is due in a unit up to the edge `t`.
    fn run_unit(&mut self, number: usize, t: u64) {
        self.touch(number);
        with_unit!(self, number, unit => unit.run(t, &mut self.out));
        self.carry_out(number);
    }

    fn touch(&mut self, number: usize) {
        self.touched |= 1 << number;
    }

    /// Works out when anything is due next: also the end of a write to the EEPROM, which is looked at from outside.
    fn plan(&mut self) {
        let mut touched = self.touched & ((1 << unit::COUNT) - 1);
        while touched != 0 {
            let number = touched.trailing_zeros() as usize;
            touched &= touched - 1;
            (self.nexts[number], self.asks[number]) = with_unit!(self, number, unit => (unit.next(), unit.requests()));
        }
        if self.touched >> unit::EEPROM & 1 == 1 {
            self.nexts[unit::EEPROM] = self.nexts[unit::EEPROM].min(self.eeprom.changes_at());
        }
        if std::mem::take(&mut self.touched) != 0 {
            self.first = self.find_first();
        }
        let stall = if self.stall == 0 { NEVER } else { self.stall };
        let due = self.drives.next().min(self.power.next()).min(stall);
        self.due = self.nexts.iter().fold(due, |due, &next| due.min(next));
    }

    /// Carries out what the unit `number` has put into the outbox.
    #[inline(always)]
    fn carry_out(&mut self, number: usize) {
        if !self.out.is_empty() {
            self.carry_all(number);
        }
    }

    #[inline(never)]
    fn carry_all(&mut self, number: usize) {
        let mut signals = std::mem::take(&mut self.out);
        for signal in signals.drain(..) {
            self.carry(number, signal);
        }
        // The list itself is used again.
        if self.out.is_empty() {
            self.out = signals;
        }
    }

    fn carry(&mut self, number: usize, signal: Signal) {
        match signal {
            Signal::Drive { t, line, drive } => self.take_line(number, line, drive, t),
            Signal::Sent { t, byte } => {
                let uart = (number - unit::USART) as u8;
                self.log.note(Event::Sent { at: Time::at(t), uart, byte });
            }
            Signal::Flag { t, irq } => {
                if let Some(source) = self.listened().filter(|&source| self.part.trigger(source) == Some((number, irq)))
                {
                    self.adc.trigger(source, true, t);
                    self.touch(unit::ADC);
                }
            }
            Signal::Reset { .. } => self.power.request(Reset::Watchdog),
            Signal::Stall { until } => self.stall = self.stall.max(until),
            Signal::ErasePage { addr } => self.orders.push_back(Order::Erase { addr, len: self.part.spm.page }),
            Signal::WritePage { addr, words } => self.orders.push_back(Order::Program { addr, words }),
        }
    }

    /// The trigger source that the converter listens to.
    fn listened(&self) -> Option<u8> {
        self.adc.listens()
    }

    /// What an access asks of the core, before which so many events were logged and units asked for this.
    fn wake(&self, logged: usize, asks: [u8; unit::COUNT]) -> Wake {
        let calm = self.due >= self.told
            && self.orders.is_empty()
            && self.stall == 0
            && self.log.len() == logged
            && !self.power.requests()
            && self.asks == asks;
        if calm { Wake::NONE } else { Wake::DEADLINE }
    }

    /// The interrupt that asks first, by the order of the vectors.
    fn find_first(&self) -> Option<u8> {
        if self.asks == [0; unit::COUNT] {
            return None;
        }
        let deaf = self.power.asleep.map_or(0, |asleep| asleep.0.deaf());
        let asks = |&(number, irq): &(usize, u8)| self.asks[number] >> irq & 1 == 1 && deaf >> number & 1 == 0;
        self.part.vectors.iter().position(asks).map(|at| at as u8 + 1)
    }
}

impl Bus for Soc {
    #[inline]
    fn read(&mut self, reg: u16, now: u64) -> (u8, Wake) {
        // What programs wait for goes the short way.
        if now < self.due
            && let Site::Timer(n, timers::Reg::TIFR) = self.site(reg)
            && self.prr == 0
            && let Some(flags) = self.timers[usize::from(n) % 4].calm_flags(now)
        {
            return (flags, Wake::NONE);
        }
        self.read_any(reg, now)
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        if self.due <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.show(soc.site(reg), now);
        }
        self.show(self.site(reg), now)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> Wake {
        if let Site::Low(addr) = self.site(reg) {
            self.set_low_byte(addr, value);
            return Wake::NONE;
        }
        self.write_bits(reg, 0xFF, value, now)
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> Wake {
        let due = self.due <= now;
        let (mask, value) = self.whole(reg, mask, value, now);
        self.run(now);
        let (logged, asks) = (self.log.len(), self.asks);
        self.store(self.site(reg), mask, value, now + 1);
        if self.touched != 0 {
            self.plan();
        }
        // The instruction behind a write of IVSEL runs before any interrupt (12.5.1).
        if std::mem::take(&mut self.power.moved_vectors) {
            return Wake::HOLD;
        }
        if due { Wake::DEADLINE } else { self.wake(logged, asks) }
    }

    fn fire(&mut self, now: u64) -> u64 {
        self.run(now);
        self.told = self.due;
        self.due
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.due <= now { now } else { self.steady(self.site(reg), now).min(self.due) }
    }

    fn pending(&self, now: u64) -> Option<u8> {
        if self.due <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.first;
        }
        self.first
    }

    fn take(&mut self, vector: u8, now: u64) {
        self.run(now);
        let source = usize::from(vector).checked_sub(1).and_then(|at| self.part.vectors.get(at));
        if let Some(&(number, irq)) = source {
            with_unit!(self, number, unit => unit.taken(irq, now, &mut self.out));
            self.touch(number);
            self.carry_out(number);
            self.tell_trigger(number, now);
        }
        self.plan();
    }

    fn can_wake(&self, interrupts_enabled: bool) -> bool {
        let deaf = self.power.asleep.map_or(0, |asleep| asleep.0.deaf());
        let waits = (0..unit::COUNT).any(|n| deaf >> n & 1 == 0 && (self.nexts[n] != NEVER || self.asks[n] != 0));
        let listens = self.usarts.iter().any(Usart::listens);
        self.watchdog.peek(guard::Reg::WDTCSR, 0) & WDE != 0
            || self.power.next() != NEVER
            || self.stall != 0
            || interrupts_enabled && (waits || listens)
    }

    fn busy(&self) -> bool {
        // What moves pins by itself: units that have something to do and no interrupt enabled for it.
        let moves = |n: usize| self.nexts[n] != NEVER && self.timers[n].peek(timers::Reg::TIMSK, 0) == 0;
        let units = [unit::SPI, unit::TWI, unit::ADC, unit::EEPROM];
        self.drives.next() != NEVER
            || self.usarts.iter().any(Usart::sending)
            || (0..4).any(moves)
            || units.iter().any(|&n| self.nexts[n] != NEVER)
    }
}

/// WDE in WDTCSR.
const WDE: u8 = 1 << 3;
