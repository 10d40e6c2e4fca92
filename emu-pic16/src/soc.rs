//! The chip around the core: peripherals, pins, interrupts and power, as one [`Bus`].
//!
//! Internally, time is counted in clocks of the oscillator ([`crate::periph`]); the core counts instruction
//! cycles of four clocks.

mod irq;
mod pins;
mod power;
mod regs;
mod state;

use emu_core::RegisterRead;
use std::collections::VecDeque;

use emu_core::cpu::{Bus, BusEffect, NEVER, ResetCause};
use emu_core::device::Scheduler;
use emu_core::external_io::{EventLog, OutsideInput};
use emu_core::pins::{ChipEvent, CycleTime, PinState};

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
use crate::periph::timers::{Pic16Timers, Timer1Crystal};
use crate::periph::usart::Pic16Usart;
use crate::periph::{Device, Pic16Outbox, Pic16Signal, SignalReceiver};

pub use irq::Pic16Interrupts;
use pins::PinInputs;
use power::PowerState;
pub use power::TimingClocks;

/// A request of the chip to the core, executed between two instructions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CoreRequest {
    /// Standby has ended.
    EndStandby {
        /// True if the watchdog ended it.
        by_watchdog: bool,
    },
    /// A word of program memory must be read.
    ReadWord {
        /// Word address.
        addr: u16,
    },
    /// Words of program memory must be written.
    WriteWords {
        /// Word address of the first word.
        addr: u16,
        /// The words.
        words: Vec<u16>,
        /// If true, the words replace the old ones; otherwise bits that are 0 become 0, and the others do not
        /// change.
        erased: bool,
    },
    /// The core halts up to a machine cycle.
    Stall {
        /// Machine cycle at which the core continues.
        until: u64,
    },
    /// Instructions up to a machine cycle are fetched, but not executed.
    Ignore {
        /// End of the ignored instructions, as a machine cycle (exclusive).
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
    /// Written values of OSCCON and OSCTUNE; they do not change the clock of the model.
    osc: [u8; 2],
    pin_inputs: PinInputs,
    requests: VecDeque<CoreRequest>,
    /// Machine cycle up to which the core is halted.
    stall: u64,
    /// Machine cycles in which instructions are not executed: first, and end (exclusive).
    ignored_cycles: (u64, u64),
    log: EventLog,
    /// In clocks.
    schedule: Scheduler<{ unit_index::COUNT }>,
    /// Clock up to which everything has been executed.
    run_to_clock: u64,
    /// Last deadline that the core was given, in machine cycles.
    core_deadline: u64,
    /// Signals being processed; empty between calls.
    out: Pic16Outbox,
}

emu_core::device_list!($
    TIMER0: timer0, TIMERS: timers, USART: usart, SSP: ssp, EEPROM: eeprom,
    ADC: adc, COMPARATORS: comparators, PSP: psp,
);
use for_each_unit;

impl Pic16Soc {
    /// Returns the chip at cycle 0, after power-on. `config` has the words from 2000h on that the image
    /// fills, the rest erased; `eeprom` is the content of the data EEPROM.
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
            timers: Pic16Timers::new(part.ccps, options.timer1_hz.map(|hz| Timer1Crystal { osc: options.hz, hz })),
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
            schedule: Scheduler { due: 0, ..Scheduler::START },
            run_to_clock: 0,
            core_deadline: NEVER,
            out: Pic16Outbox::new(),
        };
        soc.reset(ResetCause::PowerOn, 0);
        soc
    }

    /// Supplies a requested word of program memory.
    pub fn finish_flash_read(&mut self, word: u16) {
        self.eeprom.flash_data(word);
    }

    /// Returns the content of the EEPROM.
    #[must_use]
    pub fn eeprom(&self) -> &[u8] {
        self.eeprom.bytes()
    }

    /// Writes a byte of the EEPROM from outside.
    pub fn set_eeprom(&mut self, addr: usize, value: u8) {
        self.eeprom.set_byte(addr, value);
    }

    /// Returns the configuration word at 2000h plus `index`; an erased word past the end.
    #[must_use]
    pub fn config(&self, index: usize) -> u16 {
        self.config.get(index).copied().unwrap_or(0x3FFF)
    }

    /// Executes everything due up to the clock `t`, in order of time.
    #[inline(always)]
    fn run(&mut self, t: u64) {
        self.run_to_clock = self.run_to_clock.max(t);
        if self.schedule.due <= t {
            self.run_due(t);
        }
    }

    #[inline(never)]
    fn run_due(&mut self, t: u64) {
        while self.schedule.due <= t {
            let due = self.schedule.due;
            self.apply_inputs(due);
            self.run_samples(due);
            for_each_unit!(self, part, number => if self.schedule.deadlines[number] <= due {
                self.schedule.touch(number);
                part.run_due(due, &mut self.out);
            });
            self.apply_signals(());
            self.run_power(due);
            self.update_deadlines();
        }
    }

    /// Computes the next deadline.
    fn update_deadlines(&mut self) {
        if self.schedule.touched != 0 {
            for_each_unit!(self, part, number => if self.schedule.touched >> number & 1 == 1 { self.schedule.ask(number, part) });
        }
        let inputs = self.pin_inputs.drives.next_cycle().min(self.irq.next_sample_clock());
        self.schedule.update_due(inputs.min(self.power.next()));
    }

    /// Returns the effect of an access on the core.
    fn bus_effect(&mut self, now: u64) -> BusEffect {
        let sooner = self.schedule.due.div_ceil(4).min(self.irq.at) < self.core_deadline;
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

/// Returns the index of the port with this register.
#[inline(always)]
fn port_latch_index(reg: Sfr) -> Option<usize> {
    let port = (reg as usize).wrapping_sub(Sfr::PORTA as usize);
    (port <= Sfr::PORTE as usize - Sfr::PORTA as usize).then_some(port)
}

/// Converts a clock to machine cycle and phase.
fn to_cycle_time(t: u64) -> CycleTime {
    CycleTime { cycle: t / 4, phase: (t % 4) as u8 }
}

impl Bus for Pic16Soc {
    type Request = CoreRequest;

    fn read(&mut self, reg: u16, now: u64) -> RegisterRead {
        let due = self.schedule.due <= 4 * now;
        self.run(4 * now);
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else {
            return RegisterRead { value: 0, effect: BusEffect::NONE };
        };
        // Fast path for ports.
        if let Some(port) = port_latch_index(sfr).filter(|_| sfr != Sfr::PORTD) {
            if sfr == Sfr::PORTB {
                self.sample_port_b();
            }
            return RegisterRead {
                value: self.ports.input(port),
                effect: if due { BusEffect::RECHECK } else { BusEffect::NONE },
            };
        }
        let value = self.read_register(sfr, 4 * now);
        let wake = self.bus_effect(now);
        RegisterRead { value, effect: if due { BusEffect::RECHECK } else { wake } }
    }

    fn peek(&self, reg: u16, now: u64) -> u8 {
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return 0 };
        if self.schedule.due <= 4 * now {
            let mut soc = self.clone();
            soc.run(4 * now);
            return soc.peek_register(sfr, 4 * now);
        }
        self.peek_register(sfr, 4 * now)
    }

    fn write(&mut self, reg: u16, value: u8, now: u64) -> BusEffect {
        let Some(&sfr) = Sfr::ALL.get(usize::from(reg)) else { return BusEffect::NONE };
        let due = self.schedule.due <= 4 * now + 3;
        if sfr == Sfr::PORTB {
            // A write of the port reads it in Q2, as a read does (DS30292, 3.2).
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
            self.schedule.due.div_ceil(4).min(if self.ignored_cycles.0 > now { self.ignored_cycles.0 } else { NEVER });
        if self.power.is_running() {
            self.core_deadline = self.core_deadline.min(self.irq.at);
        }
        self.core_deadline
    }

    fn steady_until(&self, reg: u16, now: u64) -> u64 {
        if self.schedule.due <= 4 * now {
            return now;
        }
        let sfr = Sfr::ALL.get(usize::from(reg)).copied();
        sfr.map_or(NEVER, |sfr| self.register_steady_until(sfr, 4 * now).min(self.schedule.due)).div_ceil(4)
    }

    fn pending_interrupt(&self, now: u64) -> Option<u8> {
        if self.schedule.due <= 4 * now {
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
        let parts = [
            self.usart.next_deadline(),
            self.ssp.next_deadline(),
            self.eeprom.next_deadline(),
            self.adc.next_deadline(),
        ];
        let clocked = self.ssp.waits_for_timer2() && self.timers.timer2_match_next(self.run_to_clock) != NEVER;
        let due = parts.iter().any(|&next| next != NEVER) || self.pin_inputs.drives.next_cycle() != NEVER;
        due || clocked || self.timers.moves_pins()
    }

    fn is_core_stopped(&self) -> bool {
        !self.power.is_running()
    }

    #[inline]
    fn requested_reset(&mut self, _: u64) -> Option<ResetCause> {
        self.power.request.take()
    }

    #[inline]
    fn next_request(&mut self, now: u64) -> Option<CoreRequest> {
        if let Some(order) = self.requests.pop_front() {
            return Some(order);
        }
        if now < self.stall {
            return Some(CoreRequest::Stall { until: std::mem::take(&mut self.stall) });
        }
        let (from, until) = self.ignored_cycles;
        ((from..until).contains(&now)).then_some(CoreRequest::Ignore { until })
    }

    fn pins(&self) -> &[PinState] {
        self.ports.pins()
    }

    fn queue_input(&mut self, at: CycleTime, now: u64, input: OutsideInput) -> bool {
        self.run(4 * now);
        let t = at.cycle.saturating_mul(4).saturating_add(u64::from(at.phase.min(3)));
        self.pin_inputs.drives.push(t.max(4 * now), input);
        self.update_deadlines();
        self.run(4 * now);
        true
    }

    fn byte_in_stop_bit(&self) -> Option<u8> {
        self.usart.byte_in_stop_bit()
    }

    fn on_event_log_set(&mut self, on: bool) {
        self.ports.set_peripheral_pins(if on { u64::MAX } else { self.pin_inputs.peripheral_pins() });
    }

    #[inline]
    fn event_log(&mut self) -> &mut EventLog {
        &mut self.log
    }

    fn normalize(&mut self, now: u64) {
        self.log = EventLog::OFF;
        let t = 4 * now;
        self.run(t);
        for_each_unit!(self, part, number => {
            self.schedule.touch(number);
            part.run_due(t, &mut self.out);
        });
        self.apply_signals(());
        self.update_deadlines();
        self.run(t);
        if self.ignored_cycles.1 <= now {
            self.ignored_cycles = (0, 0);
        }
    }
}

impl SignalReceiver for Pic16Soc {
    type Signal = Pic16Signal;
    type Sender = ();

    #[inline(always)]
    fn outbox(&mut self) -> &mut Pic16Outbox {
        &mut self.out
    }

    fn apply_signal(&mut self, _: (), signal: Pic16Signal) {
        match signal {
            Pic16Signal::Flag { t, flag } => {
                self.raise(flag, t);
                self.flag_raised(t);
            }
            Pic16Signal::Drive { t, line, drive } => self.set_line_driver(line, drive, t),
            Pic16Signal::Sent { t, byte } => self.log.record(ChipEvent::Sent { at: to_cycle_time(t), uart: 0, byte }),
            Pic16Signal::Convert { t } => {
                self.schedule.touch(unit_index::ADC);
                self.adc.start(t, &mut self.out);
            }
            Pic16Signal::Timer2 { t } => {
                self.schedule.touch(unit_index::SSP);
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
}
