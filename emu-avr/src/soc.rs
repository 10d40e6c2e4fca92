//! The chip around the core: the registers at their addresses, and what is due when.
//!
//! Nothing ticks. `deadline` is the next cycle at which something can be seen from outside of a part: a pin that moves, a
//! byte that ends, an enabled interrupt, a reset. Everything else is worked out when it is read.

use emu_core::chip::Chip;
use emu_core::cpu::{Bus, NEVER, Reset, Wake};
use emu_core::outside::{Drives, Log};
use emu_core::parts::prescaler::Prescaler;
use emu_core::parts::uart::Step;
use emu_core::pins::{Event, Level, Pin, PinId, Time};

mod regs;

use crate::periph::map::{RXD, TXD, at, irq};
use crate::periph::plain::Plain;
use crate::periph::ports::{PINS, Ports};
use crate::periph::old_timer::{ICF, OCFA, OCFB, TOV, Timer};
use crate::periph::old_usart::{RXC, TXC, UDRE, Usart};
use crate::periph::watchdog::Watchdog;

/// The chip without its core and RAM.
#[derive(Debug, Clone)]
pub struct Soc {
    ports: Ports,
    /// Timer/counters 0, 1 and 2.
    timers: [Timer; 3],
    /// TEMP of the 16-bit registers (16.3).
    temp: u8,
    /// The prescaler of timers 0 and 1, and that of timer 2 (17, 18.10).
    prescalers: [Prescaler; 2],
    gtccr: u8,
    usart: Usart,
    watchdog: Watchdog,
    mcusr: u8,
    plain: Plain,
    drives: Drives,
    log: Log,
    deadline: u64,
}

/// Sleep modes (table 10-2). Only idle is modelled; the others behave as idle (QUIRKS.md).
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
    /// A setting that the data sheet reserves.
    Reserved,
}

const WDRF: u8 = 1 << 3;

/// Flag of a timer and its vector, by priority.
#[rustfmt::skip]
const TIMER_IRQS: [[(u8, u8); 4]; 3] = [
    [(OCFA, irq::TIMER0_COMPA), (OCFB, irq::TIMER0_COMPB), (TOV, irq::TIMER0_OVF), (0, 0)],
    [(ICF, irq::TIMER1_CAPT), (OCFA, irq::TIMER1_COMPA), (OCFB, irq::TIMER1_COMPB), (TOV, irq::TIMER1_OVF)],
    [(OCFA, irq::TIMER2_COMPA), (OCFB, irq::TIMER2_COMPB), (TOV, irq::TIMER2_OVF), (0, 0)],
];

const USART_IRQS: [(u8, u8); 3] = [(RXC, irq::USART_RX), (UDRE, irq::USART_UDRE), (TXC, irq::USART_TX)];

/// True for registers that may read otherwise in every cycle, or do something when they are read: a loop over one of them
/// can never be jumped over.
#[must_use]
pub const fn restless(reg: u16) -> bool {
    matches!(reg, at::TCNT0 | at::TCNT1L | at::TCNT2 | at::ICR1L | at::UDR0)
}

impl Soc {
    /// The chip at cycle 0 after power-on, at its default clock.
    #[must_use]
    pub fn new(chip: &'static Chip) -> Soc {
        let mut soc = Soc {
            ports: Ports::new(),
            timers: [Timer::new(0xFF), Timer::new(0xFFFF), Timer::new(0xFF)],
            temp: 0,
            prescalers: [Prescaler::new(0); 2],
            gtccr: 0,
            usart: Usart::new(0),
            watchdog: Watchdog::new(0, chip.default_hz.max(1), false),
            mcusr: 0,
            plain: Plain::RESET,
            drives: Drives::NONE,
            log: Log::OFF,
            deadline: NEVER,
        };
        soc.reset(Reset::PowerOn, 0);
        soc
    }

    /// Sets the system clock in Hz, from which the watchdog's own clock is reckoned. The time that the watchdog has counted
    /// so far is reckoned anew.
    pub fn set_clock_hz(&mut self, hz: u64) {
        self.watchdog.set_hz(hz);
        self.schedule();
    }

    /// Resets all registers to their initial values at the cycle `now`, MCUSR by cause (11.9.1). Outside drives stay.
    pub fn reset(&mut self, why: Reset, now: u64) {
        self.run(now);
        self.mcusr = match why {
            Reset::PowerOn => 1,
            Reset::External => self.mcusr | 1 << 1,
            Reset::BrownOut => self.mcusr | 1 << 2,
            Reset::Watchdog => self.mcusr | WDRF,
        };
        self.ports.reset();
        self.timers = [Timer::new(0xFF), Timer::new(0xFFFF), Timer::new(0xFF)];
        self.temp = 0;
        self.prescalers = [Prescaler::new(now); 2];
        self.gtccr = 0;
        self.usart = Usart::new(now);
        self.watchdog = Watchdog::new(now, self.watchdog.hz(), self.mcusr & WDRF != 0);
        self.plain = Plain::RESET;
        for pin in 0..PINS as PinId {
            self.settle(pin, now);
        }
        self.schedule();
    }

    /// Drives a pin from outside at the cycle `at`, at once when that has passed. Drives of one cycle act in call order.
    pub fn drive(&mut self, at: u64, now: u64, pin: PinId, level: Level) {
        self.run(now);
        let at = at.max(now);
        self.drives.add(at, (pin, level));
        self.deadline = self.deadline.min(at);
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

    /// Logs edges, sent bytes and fights over pins from the cycle `now` on, those that are fought for already too, or stops and
    /// forgets them.
    pub fn log(&mut self, on: bool, now: u64) {
        self.log.switch(on, now, (0..PINS as PinId).filter(|&pin| self.ports.pin(pin).contention()));
    }

    /// Takes the oldest logged event.
    pub fn drain(&mut self) -> Option<Event> {
        self.log.take()
    }

    /// The mode that SLEEP enters; `None` while SMCR.SE is clear.
    #[must_use]
    pub fn sleep_enabled(&self) -> Option<SleepMode> {
        let smcr = self.plain.get(at::SMCR);
        let mode = match smcr >> 1 & 7 {
            0 => SleepMode::Idle,
            1 => SleepMode::AdcNoiseReduction,
            2 => SleepMode::PowerDown,
            3 => SleepMode::PowerSave,
            6 => SleepMode::Standby,
            7 => SleepMode::ExtendedStandby,
            _ => SleepMode::Reserved,
        };
        (smcr & 1 != 0).then_some(mode)
    }

    /// WDR in the cycle `now`.
    pub fn clear_watchdog(&mut self, now: u64) {
        self.run(now);
        self.watchdog.restart(now);
        self.schedule();
    }

    /// True once after the watchdog timed out for a system reset, up to `now`.
    #[inline]
    pub fn reset_requested(&mut self, now: u64) -> bool {
        self.run(now);
        let requested = self.watchdog.reset_requested();
        if requested {
            self.schedule();
        }
        requested
    }

    /// Runs everything due up to `now`, in order of time.
    fn run(&mut self, now: u64) {
        while self.deadline <= now && self.deadline != NEVER {
            let due = self.deadline;
            self.run_cycle(due);
            self.schedule();
        }
    }

    /// Everything that is due at the cycle `due`, the next one at which anything is. Samplers see the level of the cycle
    /// before, so the order within a cycle decides nothing but the order of the log.
    fn run_cycle(&mut self, due: u64) {
        while let Some((pin, level)) = self.drives.take(due) {
            let changed = self.ports.drive(pin, level, due);
            self.edge(pin, changed, due);
        }
        self.run_serial(due);
        for timer in &mut self.timers {
            timer.sync(due);
        }
        if self.watchdog.next() <= due {
            self.watchdog.fire(due);
        }
    }

    /// The serial port's steps up to `due`, the first cycle at which it has any.
    fn run_serial(&mut self, due: u64) {
        while self.usart.next() <= due {
            if self.usart.sender_first() {
                self.send(due);
            } else {
                let sample = self.ports.sample(RXD, due);
                self.usart.receive(sample, self.ports.pin(RXD).high);
            }
        }
    }

    fn send(&mut self, due: u64) {
        match self.usart.send() {
            Step::Bit(line) => self.ports.txd = Some(line),
            Step::End(byte) => {
                self.log.note(Event::Sent { at: Time::at(due), uart: 0, byte });
                // The start bit of a byte that follows begins here.
                self.ports.txd = self.usart.transmits().then_some(!self.usart.shifting());
            }
        }
        self.settle(TXD, due);
    }

    /// Settles a pin at the cycle `at` after the chip changed what it does to it.
    fn settle(&mut self, pin: PinId, at: u64) {
        let changed = self.ports.settle(pin, at);
        self.edge(pin, changed, at);
    }

    /// Logs the edge of a pin, if there was one, and a fight over it, and tells the receiver of its line.
    fn edge(&mut self, pin: PinId, changed: Option<Level>, at: u64) {
        if self.log.is_on() {
            self.log.pin(Time::at(at), pin, self.ports.pin(pin).contention(), changed);
        }
        if changed.is_some() && pin == RXD {
            self.usart.line_changed(at);
        }
    }

    /// Works out the next deadline.
    fn schedule(&mut self) {
        let drive = self.drives.next();
        let timers = self.timers.iter().map(|timer| timer.next(timer.enabled())).min().unwrap_or(NEVER);
        self.deadline = drive.min(timers).min(self.usart.next()).min(self.watchdog.next());
    }
}

impl Bus for Soc {
    fn read(&mut self, reg: u16, now: u64) -> (u8, Wake) {
        let due = self.deadline <= now;
        if due {
            self.run(now);
        }
        let value = self.load(reg, now);
        (value, if due || reg == at::UDR0 { Wake::DEADLINE } else { Wake::NONE })
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        if self.deadline <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.show(reg, now);
        }
        self.show(reg, now)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> Wake {
        self.write_bits(reg, 0xFF, value, now)
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> Wake {
        let before = (self.deadline, self.log.len());
        self.run(now);
        let quiet = self.store(reg, mask, value, now);
        if !quiet {
            self.schedule();
        }
        if quiet && (self.deadline, self.log.len()) == before { Wake::NONE } else { Wake::DEADLINE }
    }

    fn fire(&mut self, now: u64) -> u64 {
        self.run(now);
        self.deadline
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.deadline <= now { now } else { self.steady(reg, now) }
    }

    fn pending(&self, now: u64) -> Option<u8> {
        if self.deadline <= now {
            let mut soc = self.clone();
            soc.run(now);
            return soc.pending(now);
        }
        if self.watchdog.pending() {
            return Some(irq::WDT);
        }
        for timer in [2, 1, 0] {
            let set = self.timers[timer].flags() & self.timers[timer].enabled();
            if set != 0 {
                return TIMER_IRQS[timer].iter().find(|row| row.0 & set != 0).map(|row| row.1);
            }
        }
        let set = self.usart.pending();
        USART_IRQS.iter().find(|row| row.0 & set != 0).map(|row| row.1)
    }

    fn take(&mut self, vector: u8, now: u64) {
        self.run(now);
        match vector {
            irq::WDT => self.watchdog.take(),
            irq::USART_TX => self.usart.clear(TXC),
            _ => {
                for (timer, rows) in self.timers.iter_mut().zip(TIMER_IRQS) {
                    if let Some(row) = rows.iter().find(|row| row.0 != 0 && row.1 == vector) {
                        timer.clear_flags(row.0, now);
                    }
                }
            }
        }
        self.schedule();
    }

    fn can_wake(&self, interrupts_enabled: bool) -> bool {
        let timer = |t: &Timer| t.enabled() & t.flags() != 0 || t.next(t.enabled()) != NEVER;
        let interrupt = self.watchdog.running() || self.usart.can_wake() || self.timers.iter().any(timer);
        self.watchdog.resets() || interrupts_enabled && interrupt
    }

    fn busy(&self) -> bool {
        self.usart.sending() || self.drives.next() != NEVER
    }
}
