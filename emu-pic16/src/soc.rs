//! The chip around the core: parts, pins, interrupts, power, as one [`Bus`].
//!
//! Inside, time is counted in clocks of the oscillator ([`crate::periph`]); the core counts instruction cycles of four.

mod irq;
mod pins;
mod power;
mod regs;
mod state;

use std::collections::VecDeque;

use emu_core::cpu::{Bus, BusEffect, NEVER, ResetCause};
use emu_core::external_io::EventLog;
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel, PinState};

use crate::chips::{self, Pic16Part};
use crate::cpu::Options;
use crate::periph::adc::Pic16Adc;
use crate::periph::comparator::Pic16Comparators;
use crate::periph::eeprom::{FlashAccess, Pic16Eeprom};
use crate::periph::map::Sfr;
use crate::periph::ports::Pic16Ports;
use crate::periph::psp::ParallelSlavePort;
use crate::periph::ssp::Pic16Ssp;
use crate::periph::timer0::Timer0;
use crate::periph::timers::Pic16Timers;
use crate::periph::usart::Pic16Usart;
use crate::periph::{Pic16Device, Pic16Outbox, Pic16Signal};

pub use irq::Pic16Interrupts;
use pins::{OutsideInput, PinInputs};
use power::PowerState;
pub use power::TimingClocks;

/// What the chip asks of the core between two instructions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CoreRequest {
    /// Standby has ended.
    EndStandby {
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
    Stall {
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
pub struct Pic16Soc {
    part: &'static Pic16Part,
    /// Configuration words and IDs from 2000h on.
    config: [u16; 16],
    ports: Pic16Ports,
    timer0: Timer0,
    timers: Pic16Timers,
    usart: Pic16Usart,
    ssp: Pic16Ssp,
    eeprom: Pic16Eeprom,
    adc: Pic16Adc,
    comparators: Pic16Comparators,
    psp: ParallelSlavePort,
    irq: Pic16Interrupts,
    power: PowerState,
    pcon: u8,
    /// What a program has written to OSCCON and OSCTUNE; the clock stays what the host says.
    osc: [u8; 2],
    pin_inputs: PinInputs,
    requests: VecDeque<CoreRequest>,
    /// The core stands still up to this machine cycle.
    stall: u64,
    /// From the first of these machine cycles on and before the second, instructions are not executed.
    ignored_cycles: (u64, u64),
    log: EventLog,
    /// When every part next has something to do,
    unit_deadlines: [u64; unit_index::COUNT],
    /// but for the parts of this set, which have been touched since that was asked.
    touched_units: u8,
    /// The next clock at which anything is due.
    due: u64,
    /// The clock up to which everything has been run.
    run_to_clock: u64,
    /// The deadline that the core was told last, in machine cycles.
    core_deadline: u64,
    /// Signals that are being carried out; empty between calls.
    out: Pic16Outbox,
}

/// Does something with every part.
macro_rules! for_each_unit {
    ($soc:ident, $part:ident => $what:expr) => { for_each_unit!($soc, $part, _number => $what) };
    ($soc:ident, $part:ident, $number:ident => $what:expr) => {{
        { let ($part, $number) = (&mut $soc.timer0, unit_index::TIMER0); $what; }
        { let ($part, $number) = (&mut $soc.timers, unit_index::TIMERS); $what; }
        { let ($part, $number) = (&mut $soc.usart, unit_index::USART); $what; }
        { let ($part, $number) = (&mut $soc.ssp, unit_index::SSP); $what; }
        { let ($part, $number) = (&mut $soc.eeprom, unit_index::EEPROM); $what; }
        { let ($part, $number) = (&mut $soc.adc, unit_index::ADC); $what; }
        { let ($part, $number) = (&mut $soc.comparators, unit_index::COMPARATORS); $what; }
        { let ($part, $number) = (&mut $soc.psp, unit_index::PSP); $what; }
    }};
}
use for_each_unit;

/// Parts by number.
#[rustfmt::skip]
mod unit_index {
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

impl Pic16Soc {
    /// The chip at cycle 0, after power-on. `config`: the words from 2000h on that the image fills, the rest erased; `eeprom`: its
    /// data memory.
    #[must_use]
    pub fn new(part: &'static Pic16Part, options: Options, config: &[u16], eeprom: &[u8]) -> Pic16Soc {
        let config = power::config_words(part, options.config, config);
        let clocks = TimingClocks::new(part, &options);
        let power = PowerState::new(part, clocks, &config);
        let settings = power.config;
        let outside = PinInputs::new(part, settings.ccp1);
        let mut soc = Pic16Soc {
            part,
            config,
            ports: Pic16Ports::new(part, settings.reserved_pins),
            timer0: Timer0::new(settings.watchdog, clocks.watchdog, part.has(Sfr::WDTCON)),
            timers: Pic16Timers::new(part.ccps, options.timer1_hz.map(|hz| (options.hz, hz))),
            usart: Pic16Usart::new().with_early_trmt(options.readings.trmt_as_stop_begins),
            ssp: Pic16Ssp::new(part.ssp != chips::SspKind::Basic)
                .with_stretch(part.ssp == chips::SspKind::MasterStretch)
                .with_kept_bits(options.readings.ss_keeps_bits),
            eeprom: Pic16Eeprom::new(
                part.memory,
                eeprom,
                clocks.eeprom,
                FlashAccess {
                    words: (part.chip.flash_bytes / 2) as u16,
                    writable: settings.writable.0..settings.writable.1,
                    clocks: clocks.flash,
                },
            ),
            adc: Pic16Adc::new(part.adc, part.analog.len() as u8, clocks.adc_rc, options.hz)
                .with_ideal_acquisition(options.ideal_acquisition),
            comparators: Pic16Comparators::new(part.comparators),
            psp: ParallelSlavePort::new(),
            irq: Pic16Interrupts::new(part),
            power,
            pcon: 0,
            osc: [0; 2],
            pin_inputs: outside,
            requests: VecDeque::new(),
            stall: 0,
            ignored_cycles: (0, 0),
            log: EventLog::OFF,
            unit_deadlines: [NEVER; unit_index::COUNT],
            touched_units: u8::MAX,
            due: 0,
            run_to_clock: 0,
            core_deadline: NEVER,
            out: Pic16Outbox::new(),
        };
        soc.reset(ResetCause::PowerOn, 0);
        soc
    }

    /// Drives a pin from outside, at once when that moment has passed. `now` is the machine cycle of the boundary.
    pub fn drive(&mut self, at: CycleTime, now: u64, pin: PinId, level: PinLevel) {
        self.queue_input(at, now, OutsideInput::Level(pin, level));
    }

    /// Level of a pin after everything that was run so far; [`Level::Float`] for one that does not exist.
    #[must_use]
    pub fn level(&self, pin: PinId) -> PinLevel {
        self.ports.pin(pin).level()
    }

    /// All pins.
    #[must_use]
    pub fn pins(&self) -> &[PinState] {
        self.ports.pins()
    }

    /// Takes the oldest logged event.
    pub fn next_event(&mut self) -> Option<ChipEvent> {
        self.log.pop()
    }

    /// Takes the oldest order to the core at the machine cycle `now`.
    pub fn next_request(&mut self, now: u64) -> Option<CoreRequest> {
        if let Some(order) = self.requests.pop_front() {
            return Some(order);
        }
        if now < self.stall {
            return Some(CoreRequest::Stall { until: std::mem::take(&mut self.stall) });
        }
        let (from, until) = self.ignored_cycles;
        ((from..until).contains(&now)).then_some(CoreRequest::Ignore { until })
    }

    /// A word of program memory that was asked for.
    pub fn finish_flash_read(&mut self, word: u16) {
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
    pub fn byte_in_stop_bit(&self) -> Option<u8> {
        self.usart.byte_in_stop_bit()
    }

    /// Runs everything due up to the clock `t`, in order of time.
    #[inline(always)]
    fn run(&mut self, t: u64) {
        self.run_to_clock = self.run_to_clock.max(t);
        if self.due <= t {
            self.run_due(t);
        }
    }

    #[inline(never)]
    fn run_due(&mut self, t: u64) {
        while self.due <= t {
            let due = self.due;
            self.apply_inputs(due);
            self.run_samples(due);
            for_each_unit!(self, part, number => if self.unit_deadlines[number] <= due {
                self.touched_units |= 1 << number;
                part.run_due(due, &mut self.out);
            });
            self.apply_signals();
            self.run_power(due);
            self.update_deadlines();
        }
    }

    /// Works out when anything is due next.
    fn update_deadlines(&mut self) {
        let due = self.pin_inputs.drives.next_cycle().min(self.irq.next_sample_clock()).min(self.power.next());
        if self.touched_units != 0 {
            for_each_unit!(self, part, number => if self.touched_units >> number & 1 == 1 { self.unit_deadlines[number] = part.next_clock() });
            self.touched_units = 0;
        }
        self.due = self.unit_deadlines.into_iter().fold(due, u64::min);
    }

    /// Carries out what parts have put into the outbox, and what comes of that.
    #[inline(always)]
    fn apply_signals(&mut self) {
        if !self.out.is_empty() {
            self.apply_all_signals();
        }
    }

    #[inline(never)]
    fn apply_all_signals(&mut self) {
        while !self.out.is_empty() {
            let mut signals = std::mem::take(&mut self.out);
            for signal in signals.drain(..) {
                self.apply_signal(signal);
            }
            // The list itself is used again.
            if self.out.is_empty() {
                self.out = signals;
                return;
            }
        }
    }

    fn apply_signal(&mut self, signal: Pic16Signal) {
        match signal {
            Pic16Signal::Flag { t, flag } => {
                self.raise(flag, t);
                self.flag_raised(t);
            }
            Pic16Signal::Drive { t, line, drive } => self.set_line_driver(line, drive, t),
            Pic16Signal::Sent { t, byte } => self.log.record(ChipEvent::Sent { at: to_cycle_time(t), uart: 0, byte }),
            Pic16Signal::Convert { t } => {
                self.touched_units |= 1 << unit_index::ADC;
                self.adc.start(t, &mut self.out);
            }
            Pic16Signal::Timer2 { t } => {
                self.touched_units |= 1 << unit_index::SSP;
                self.ssp.timer2(t, &mut self.out);
            }
            Pic16Signal::Watchdog { t } => self.watchdog_ran_out(t),
            Pic16Signal::FlashRead { addr } => self.requests.push_back(CoreRequest::ReadWord { addr }),
            Pic16Signal::FlashWrite { addr, words } => {
                self.requests.push_back(CoreRequest::WriteWords { addr, words, erased: true })
            }
            Pic16Signal::FlashProgram { addr, words } => {
                self.requests.push_back(CoreRequest::WriteWords { addr, words, erased: false })
            }
            Pic16Signal::Stall { until } => self.stall = until.div_ceil(4),
            Pic16Signal::Ignore { from, until } => self.ignored_cycles = (from.div_ceil(4), until.div_ceil(4)),
        }
    }

    /// What an access asks of the core.
    fn bus_effect(&mut self, now: u64) -> BusEffect {
        let sooner = self.due.div_ceil(4).min(self.irq.at) < self.core_deadline;
        if sooner
            || !self.requests.is_empty()
            || self.stall > now
            || self.ignored_cycles.1 > now
            || !self.log.is_empty()
            || self.power.has_reset_request()
        {
            BusEffect::RECHECK
        } else {
            BusEffect::NONE
        }
    }
}

/// The number of the port whose register this is.
#[inline(always)]
fn port_latch_index(reg: Sfr) -> Option<usize> {
    let port = (reg as usize).wrapping_sub(Sfr::PORTA as usize);
    (port <= Sfr::PORTE as usize - Sfr::PORTA as usize).then_some(port)
}

/// The moment of a clock.
fn to_cycle_time(t: u64) -> CycleTime {
    CycleTime { cycle: t / 4, phase: (t % 4) as u8 }
}

impl Bus for Pic16Soc {
    fn read(&mut self, reg: u16, now: u64) -> (u8, BusEffect) {
        let due = self.due <= 4 * now;
        self.run(4 * now);
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return (0, BusEffect::NONE) };
        // Ports go the short way.
        if let Some(port) = port_latch_index(sfr).filter(|_| sfr != Sfr::PORTD) {
            if sfr == Sfr::PORTB {
                self.sample_port_b();
            }
            return (self.ports.input(port), if due { BusEffect::RECHECK } else { BusEffect::NONE });
        }
        let value = self.read_register(sfr, 4 * now);
        let wake = self.bus_effect(now);
        (value, if due { BusEffect::RECHECK } else { wake })
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return 0 };
        if self.due <= 4 * now {
            let mut soc = self.clone();
            soc.run(4 * now);
            return soc.peek_register(sfr, 4 * now);
        }
        self.peek_register(sfr, 4 * now)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect {
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return BusEffect::NONE };
        let due = self.due <= 4 * now + 3;
        if sfr == Sfr::PORTB {
            // A write of the port sees it as a read does, in Q2 (DS30292, 3.2).
            self.run(4 * now);
            self.sample_port_b();
        }
        self.run(4 * now + 3);
        self.write_register(sfr, value, 4 * now + 4);
        let wake = self.bus_effect(now);
        if due { BusEffect::RECHECK } else { wake }
    }

    fn write_bits(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> BusEffect {
        let old = self.peek(reg, now);
        self.write(reg, old & !mask | value & mask, now)
    }

    fn fire(&mut self, now: u64) -> u64 {
        self.run(4 * now);
        self.core_deadline =
            self.due.div_ceil(4).min(if self.ignored_cycles.0 > now { self.ignored_cycles.0 } else { NEVER });
        if self.power.is_running() {
            self.core_deadline = self.core_deadline.min(self.irq.at);
        }
        self.core_deadline
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.due <= 4 * now {
            return now;
        }
        let sfr = Sfr::ALL.get(usize::from(reg)).copied();
        sfr.map_or(NEVER, |sfr| self.register_steady_until(sfr, 4 * now).min(self.due)).div_ceil(4)
    }

    fn pending_interrupt(&self, now: u64) -> Option<u8> {
        if self.due <= 4 * now {
            let mut soc = self.clone();
            soc.run(4 * now);
            return soc.interrupt_since(now).map(|_| 1);
        }
        self.interrupt_since(now).map(|_| 1)
    }

    fn acknowledge_interrupt(&mut self, _: u8, now: u64) {
        self.run(4 * now);
        self.irq.enables.intcon &= !irq::GIE;
        self.irq.at = NEVER;
    }

    fn can_wake(&self, _: bool) -> bool {
        self.can_wake_up()
    }

    fn is_busy(&self) -> bool {
        let parts = [self.usart.next_clock(), self.ssp.next_clock(), self.eeprom.next_clock(), self.adc.next_clock()];
        let clocked = self.ssp.waits_for_timer2() && self.timers.timer2_match_next(self.run_to_clock) != NEVER;
        let due = parts.iter().any(|&next| next != NEVER) || self.pin_inputs.drives.next_cycle() != NEVER;
        due || clocked || self.timers.moves_pins()
    }
}
