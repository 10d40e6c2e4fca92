//! The chip around the core: its units, the registers at their addresses, and the deadlines.
//!
//! Nothing runs in every cycle. `due` is the next cycle with an effect outside a unit: a pin that changes, a
//! byte that ends, an enabled interrupt, a reset. Everything else is computed when it is read.

use std::{collections::VecDeque, sync::Arc};

use emu_core::cpu::{BusEffect, NEVER, ResetCause};
use emu_core::device::Scheduler;
use emu_core::external_io::{DriveQueue, EventLog, OutsideInput};
use emu_core::parts::prescaler::Prescaler;
use emu_core::pins::{ChipEvent, CycleTime};

use crate::chips::{AdcTrigger, AvrPart, FuseLayout, unit_index};
use crate::cpu::Options;
use crate::executor::RAM_START;
use crate::periph::adc::AvrAdc;
use crate::periph::comparator::AvrComparator;
use crate::periph::eeprom::AvrEeprom;
use crate::periph::external::ExternalInterrupts;
use crate::periph::ports::AvrPorts;
use crate::periph::spi::AvrSpi;
use crate::periph::spm::{ConfigBytes, SelfProgramming};
use crate::periph::timers::AvrTimer;
use crate::periph::twi::AvrTwi;
use crate::periph::usart::AvrUsart;
use crate::periph::watchdog::AvrWatchdog;
use crate::periph::{AvrOutbox, AvrSignal, Device, SignalReceiver};

const _: () = assert!(
    unit_index::COUNT == unit_index::EXTERNAL + 1,
    "a new unit needs an arm in with_unit! and in enables (soc/lint.rs); the last unit is their `_`"
);

/// Evaluates `$what` with `$unit` as the unit number `$number`.
macro_rules! with_unit {
    ($soc:expr, $number:expr, $unit:ident => $what:expr) => {
        match $number {
            n @ unit_index::TIMER..unit_index::USART => {
                let $unit = &mut $soc.timers[n - unit_index::TIMER];
                $what
            }
            n @ unit_index::USART..unit_index::SPI => {
                let $unit = &mut $soc.usarts[n - unit_index::USART];
                $what
            }
            unit_index::SPI => {
                let $unit = &mut $soc.spi;
                $what
            }
            unit_index::TWI => {
                let $unit = &mut $soc.twi;
                $what
            }
            unit_index::ADC => {
                let $unit = &mut $soc.adc;
                $what
            }
            unit_index::COMPARATOR => {
                let $unit = &mut $soc.comparator;
                $what
            }
            unit_index::EEPROM => {
                let $unit = &mut $soc.eeprom;
                $what
            }
            unit_index::SPM => {
                let $unit = &mut $soc.spm;
                $what
            }
            unit_index::WATCHDOG => {
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

mod bus;
mod lint;
mod memory;
mod pins;
mod power;
mod regs;
mod sleep;
mod state;

pub(crate) use lint::BaudClock;
pub use memory::LOW_BYTES;
use pins::PinLines;
use power::PowerState;
pub use sleep::SleepMode;

/// A request of the chip to its core, executed between two instructions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CoreRequest {
    /// A page of program memory is erased.
    Erase {
        /// Byte address of the first byte.
        addr: u32,
        /// Number of bytes.
        len: u32,
    },
    /// Words are programmed into program memory: bits that are 0 become 0.
    Program {
        /// Byte address of the first word.
        addr: u32,
        /// The words.
        words: Vec<u16>,
    },
}

/// The chip without its core and the RAM from 100h on.
#[derive(Debug, Clone)]
pub struct AvrSoc {
    part: &'static AvrPart,
    wiring: Arc<PinLines>,
    ports: AvrPorts,
    timers: [AvrTimer; 4],
    usarts: [AvrUsart; 2],
    spi: AvrSpi,
    twi: AvrTwi,
    adc: AvrAdc,
    comparator: AvrComparator,
    eeprom: AvrEeprom,
    spm: SelfProgramming,
    watchdog: AvrWatchdog,
    external: ExternalInterrupts,
    /// Prescalers: that of timers 0, 1 and 3, and that of timer 2 (17, 18.10).
    prescalers: [Prescaler; 2],
    gtccr: u8,
    mcusr: u8,
    mcucr: u8,
    smcr: u8,
    prr: u16,
    osccal: u8,
    rampz: u8,
    /// Bytes without function, which only store what is written.
    kept_bytes: [u8; 4],
    /// RAM below 100h, from 60h on, on chips that have it there.
    low_ram: [u8; RAM_START - LOW_BYTES],
    /// Cycle of the last read of the register that UBRRH and UCSRC share, by USART.
    ursel_read: [u64; 2],
    power: PowerState,
    /// Levels, voltages and supply changes that are queued for later.
    drives: DriveQueue<OutsideInput>,
    log: EventLog,
    schedule: Scheduler<{ unit_index::COUNT }>,
    /// Vector of the pending interrupt with the highest priority.
    first_vector: Option<u8>,
    /// Last deadline that the core was given.
    core_deadline: u64,
    requests: VecDeque<CoreRequest>,
    /// Cycle up to which the core is halted; 0 if it is not.
    stall: u64,
    out: AvrOutbox,
    /// What lints need to know about the run so far.
    pub(crate) lints: crate::lint::LintState,
}

impl AvrSoc {
    /// Returns the chip at cycle 0 after power-on; `eeprom` is the content of its data EEPROM.
    #[must_use]
    pub fn new(part: &'static AvrPart, options: Options, bytes: ConfigBytes, eeprom: Arc<Vec<u8>>) -> AvrSoc {
        let timer = |n: usize| AvrTimer::new(options.readings.apply_to_timer(part.timers.get(n)));
        let hz = options.hz.max(1);
        let power = PowerState::new(part, options, &bytes);
        let always_on = FuseLayout::is_programmed(bytes.fuses, part.fuses.wdton);
        let mut soc = AvrSoc {
            part,
            wiring: Arc::new(PinLines::new(part, options.package)),
            ports: AvrPorts::new(part.ports, power.has_reset_pin.then_some(part.reset_pin)),
            timers: std::array::from_fn(timer),
            usarts: std::array::from_fn(|_| AvrUsart::new(0)),
            spi: AvrSpi::new(),
            twi: AvrTwi::new(),
            adc: AvrAdc::new(part.adc_kind),
            comparator: AvrComparator::new(part.adc_kind.bandgap_mv, hz),
            eeprom: AvrEeprom::new(part.eeprom_kind, eeprom, hz),
            spm: SelfProgramming::new(part.spm_kind, bytes, part.boot_start(bytes.fuses), hz),
            watchdog: AvrWatchdog::new(part.watchdog_kind, always_on, hz),
            external: ExternalInterrupts::new(options.readings.apply_to_external(part.external_kind)),
            prescalers: [Prescaler::new(0); 2],
            gtccr: 0,
            mcusr: 0,
            mcucr: 0,
            smcr: 0,
            prr: 0,
            osccal: bytes.calibration,
            rampz: 0,
            kept_bytes: [0; 4],
            low_ram: [0; RAM_START - LOW_BYTES],
            ursel_read: [NEVER; 2],
            power,
            drives: DriveQueue::NONE,
            log: EventLog::OFF,
            schedule: Scheduler::START,
            first_vector: None,
            core_deadline: NEVER,
            requests: VecDeque::new(),
            stall: 0,
            out: AvrOutbox::new(),
            lints: crate::lint::LintState::default(),
        };
        soc.reset(ResetCause::PowerOn, 0);
        soc
    }

    /// Returns the content of the EEPROM.
    #[must_use]
    pub fn eeprom(&self) -> &Arc<Vec<u8>> {
        self.eeprom.cells()
    }

    /// Sets a cell of the EEPROM from outside; returns false if it does not exist.
    pub fn set_eeprom(&mut self, addr: usize, value: u8) -> bool {
        self.eeprom.set_cell(addr, value)
    }

    /// Returns fuses, lock bits, signature and calibration.
    #[must_use]
    pub fn config_bytes(&self) -> &ConfigBytes {
        self.spm.config_bytes()
    }

    /// Reports whether boot lock bits block interrupts during the instruction at the byte address `pc`.
    #[must_use]
    pub fn locks_interrupts(&self, pc: u32) -> bool {
        self.spm.bars_interrupts(pc, self.mcucr & regs::IVSEL != 0)
    }

    /// Returns the program word at which a reset starts: 0, or the start of the boot section (BOOTRST).
    #[must_use]
    pub fn reset_vector(&self) -> u32 {
        let bytes = self.spm.config_bytes();
        let boot = FuseLayout::is_programmed(bytes.fuses, self.part.fuses.bootrst);
        if boot { self.part.boot_start(bytes.fuses) / 2 } else { 0 }
    }

    /// Returns the program word of the first vector: 0, or the start of the boot section (IVSEL).
    #[must_use]
    pub fn vector_base(&self) -> u32 {
        if self.mcucr & regs::IVSEL != 0 { self.part.boot_start(self.spm.config_bytes().fuses) / 2 } else { 0 }
    }

    /// Executes a WDR in the cycle `now`.
    pub fn clear_watchdog(&mut self, now: u64) {
        self.run(now);
        self.run_unit(unit_index::WATCHDOG, now + 1);
        self.watchdog.restart(now + 1, &mut self.out);
        self.update_deadlines();
    }

    /// Executes everything due up to `now`, in order of time.
    fn run(&mut self, now: u64) {
        while self.schedule.due <= now && self.schedule.due != NEVER {
            let due = self.schedule.due;
            self.apply_inputs(due);
            for number in 0..unit_index::COUNT {
                if self.schedule.deadlines[number] <= due {
                    self.run_unit(number, due);
                }
            }
            self.run_power(due);
            self.update_deadlines();
        }
    }

    /// Executes what is due in a unit up to the edge `t`.
    fn run_unit(&mut self, number: usize, t: u64) {
        self.schedule.touch(number);
        with_unit!(self, number, unit => unit.run_due(t, &mut self.out));
        self.apply_signals(number);
    }

    /// Computes the next deadline. It includes the end of an EEPROM write, which is visible from outside.
    fn update_deadlines(&mut self) {
        let touched = self.schedule.touched;
        while let Some(number) = self.schedule.take_touched() {
            with_unit!(self, number, unit => self.schedule.ask(number, unit));
        }
        if touched >> unit_index::EEPROM & 1 == 1 {
            let deadline = &mut self.schedule.deadlines[unit_index::EEPROM];
            *deadline = self.eeprom.changes_at().min(*deadline);
        }
        if touched != 0 {
            self.first_vector = self.highest_priority_vector();
        }
        let stall = if self.stall == 0 { NEVER } else { self.stall };
        self.schedule.update_due(self.drives.next_cycle().min(self.power.next()).min(stall));
    }

    /// Returns the trigger source that the converter listens to.
    fn listened_trigger(&self) -> Option<u8> {
        self.adc.listened_trigger()
    }

    /// Returns the effect of an access on the core. `logged` and `asks` are the number of logged events and
    /// the requested interrupts before the access.
    fn bus_effect(&self, logged: usize, asks: [u8; unit_index::COUNT]) -> BusEffect {
        let calm = self.schedule.due >= self.core_deadline
            && self.requests.is_empty()
            && self.stall == 0
            && self.log.len() == logged
            && !self.power.has_reset_request()
            && self.schedule.requests == asks;
        if calm { BusEffect::NONE } else { BusEffect::RECHECK }
    }

    /// Returns the vector of the requested interrupt with the highest priority, which is the first in the
    /// order of the vectors.
    fn highest_priority_vector(&self) -> Option<u8> {
        if self.schedule.requests == [0; unit_index::COUNT] {
            return None;
        }
        let deaf = self.power.asleep.map_or(0, |asleep| asleep.0.units_unable_to_wake());
        let asks =
            |&(number, irq): &(usize, u8)| self.schedule.requests[number] >> irq & 1 == 1 && deaf >> number & 1 == 0;
        self.part.interrupt_sources.iter().position(asks).map(|at| at as u8 + 1)
    }
}

impl SignalReceiver for AvrSoc {
    type Signal = AvrSignal;
    type Sender = usize;

    #[inline(always)]
    fn outbox(&mut self) -> &mut AvrOutbox {
        &mut self.out
    }

    fn apply_signal(&mut self, number: usize, signal: AvrSignal) {
        match signal {
            AvrSignal::Drive { t, line, drive } => self.set_line_driver(number, line, drive, t),
            AvrSignal::Sent { t, byte } => {
                let uart = (number - unit_index::USART) as u8;
                self.log.record(ChipEvent::Sent { at: CycleTime::at(t), uart, byte });
            }
            AvrSignal::Flag { t, irq } => {
                if let Some(source) = self.listened_trigger().filter(|&source| {
                    self.part.adc_trigger(source) == Some(AdcTrigger { unit: number, interrupt: irq })
                }) {
                    self.adc.trigger(source, true, t);
                    self.schedule.touch(unit_index::ADC);
                }
            }
            AvrSignal::Reset { .. } => self.power.request(ResetCause::Watchdog),
            AvrSignal::Stall { until } => self.stall = self.stall.max(until),
            AvrSignal::ErasePage { addr } => {
                self.requests.push_back(CoreRequest::Erase { addr, len: self.part.spm_kind.page })
            }
            AvrSignal::WritePage { addr, words } => self.requests.push_back(CoreRequest::Program { addr, words }),
        }
    }
}
