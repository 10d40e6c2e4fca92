//! The chip around the core: registers by address, and the times at which something is due.
//!
//! Nothing is ticked. `deadline` is the next cycle at which a peripheral changes something visible from
//! outside of it: a pin, a bit of the serial port, an enabled interrupt, a reset. Everything else is computed
//! when it is read.
//!
//! Internal time is that of the oscillator. In power-down the oscillator is stopped (`stopped_cycles` so
//! far), while the machine cycles, in which pins are driven and events are logged, continue.

use std::collections::VecDeque;
use std::ops::Range;

use emu_core::cpu::{NEVER, ResetCause};
use emu_core::device::Scheduler;
use emu_core::external_io::{DriveQueue, EventLog};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};

mod bus;
mod irq;
mod movx;
mod power;
mod regs;
mod state;

use crate::chips::Mcs51Part;
use crate::cpu::{Mcs51Readings, Options};
use crate::periph::map::{pin, sfr};
use crate::periph::ports::{Mcs51Ports, PINS};
use crate::periph::serial::{BaudClocks, Mcs51Serial, SerialEdge, SerialLine};
use crate::periph::timer::Mcs51Timers;
use crate::periph::timer2::Mcs51Timer2;
use crate::periph::watchdog::Mcs51Watchdog;
use crate::periph::{Device, Mcs51Outbox, Mcs51Signal, SignalReceiver};
use irq::InterruptSystem;
pub use movx::BusTransfer;
use power::PowerState;

emu_core::device_list!($ TIMERS: timers, TIMER2: timer2, SERIAL: serial, WATCHDOG: watchdog);

/// The chip without its core and memories.
#[derive(Debug, Clone)]
pub struct Mcs51Soc {
    part: &'static Mcs51Part,
    readings: Mcs51Readings,
    clocks_per_cycle: u8,
    ports: Mcs51Ports,
    timers: Mcs51Timers,
    /// On chips without timer 2 it stays in its state after reset.
    timer2: Mcs51Timer2,
    serial: Mcs51Serial,
    interrupts: InterruptSystem,
    power: PowerState,
    watchdog: Mcs51Watchdog,
    pcon: u8,
    auxr: u8,
    /// Machine cycles in which the oscillator was stopped.
    stopped_cycles: u64,
    /// Levels of the sampled pins, as the peripherals know them.
    sampled_levels: [bool; SAMPLED_PINS.len()],
    /// Future changes of the serial lines.
    edges: VecDeque<SerialEdge>,
    drives: DriveQueue,
    log: EventLog,
    /// Whether edges of MOVX are logged too.
    logs_bus: bool,
    /// In oscillator time.
    schedule: Scheduler<{ unit_index::COUNT }>,
    /// The cycle up to which the timers were last advanced.
    timers_synced_to: u64,
    /// The first boundary at which an interrupt can be served, in oscillator time; 0 if it must be computed.
    next_interrupt_boundary: u64,
    /// The last deadline given to the core, in machine cycles.
    core_deadline: u64,
    /// The cycle in which pins that have changed are to be sampled.
    sample_at: u64,
    /// Signals that wait; empty between calls.
    out: Mcs51Outbox,
}

/// Pins that peripherals of the chip sample.
const SAMPLED_PINS: [PinId; 8] = [pin::INT0, pin::INT1, pin::T0, pin::T1, pin::RXD, pin::T2, pin::T2EX, pin::RST];

/// Index of the reset pin in [`SAMPLED_PINS`].
const RST_INDEX: usize = SAMPLED_PINS.len() - 1;

/// Whether a register can change in every cycle, so that a loop that reads it is never skipped.
#[must_use]
pub const fn volatile_register(addr: u8) -> bool {
    matches!(addr, sfr::TL0 | sfr::TL1 | sfr::TH0 | sfr::TH1 | sfr::TL2 | sfr::TH2)
}

impl Mcs51Soc {
    /// The chip at cycle 0 after power-on. `bus` means that at least a part of program memory is external.
    #[must_use]
    pub fn new(part: &'static Mcs51Part, options: Options, bus: bool) -> Mcs51Soc {
        let mut soc = Mcs51Soc {
            part,
            readings: options.readings,
            clocks_per_cycle: if options.x2 { 6 } else { 12 },
            ports: Mcs51Ports::new(part, bus),
            timers: Mcs51Timers::new(0),
            timer2: Mcs51Timer2::new(0),
            serial: Mcs51Serial::new(),
            interrupts: InterruptSystem::new([true; 2]),
            power: PowerState::START,
            watchdog: Mcs51Watchdog::OFF,
            pcon: 0,
            auxr: 0,
            stopped_cycles: 0,
            sampled_levels: [true, true, true, true, true, true, true, false],
            edges: VecDeque::new(),
            drives: DriveQueue::NONE,
            log: EventLog::OFF,
            logs_bus: false,
            schedule: Scheduler::START,
            timers_synced_to: 0,
            next_interrupt_boundary: 0,
            core_deadline: NEVER,
            sample_at: NEVER,
            out: Mcs51Outbox::new(),
        };
        soc.reset(ResetCause::PowerOn, 0);
        soc
    }

    /// Resets all registers at the machine cycle `now` (user's manual, "Reset"). Drives from outside stay.
    /// PCON.POF stays too, except at power-on, which sets it.
    pub fn reset(&mut self, why: ResetCause, now: u64) {
        self.run(now);
        self.wake_oscillator(now);
        let t = self.to_oscillator_time(now);
        self.ports.reset();
        self.edges.clear();
        self.schedule.touch_all();
        for_each_unit!(self, unit => unit.reset(why == ResetCause::PowerOn, t, &mut self.out));
        self.pcon = match why {
            ResetCause::PowerOn if self.part.is_at89s => power::POF,
            _ => self.pcon & power::POF,
        };
        self.auxr = 0;
        for pin in 0..PINS as PinId {
            self.update_pin(pin, t, 0);
        }
        // After a reset every peripheral starts with the present pin levels.
        self.interrupts = InterruptSystem::new([pin::INT0, pin::INT1].map(|pin| self.ports.pin(pin).reads_high));
        let reset_pin = self.sampled_levels[RST_INDEX];
        self.sampled_levels = [true; SAMPLED_PINS.len()];
        self.sampled_levels[RST_INDEX] = reset_pin;
        self.sample_pins(t);
        self.update_baud_clocks(t);
        self.update_deadline();
        self.next_interrupt_boundary = 0;
    }

    /// The latch of port 2.
    #[inline]
    #[must_use]
    pub fn port2(&self) -> u8 {
        self.ports.latch(2)
    }

    /// RETI: ends the interrupt in progress.
    pub fn end_interrupt(&mut self) {
        self.interrupts.reti();
        self.next_interrupt_boundary = 0;
    }

    /// Clocks per machine cycle.
    #[must_use]
    pub fn clocks_per_cycle(&self) -> u32 {
        self.clocks_per_cycle.into()
    }

    /// Executes everything that is due up to the machine cycle `now`, in order of time.
    fn run(&mut self, now: u64) {
        while self.next_due() <= now {
            let due = self.next_due();
            if self.power.is_powered_down() {
                self.run_stopped(due);
            } else {
                self.run_cycle(self.to_oscillator_time(due));
            }
            self.run_power(due);
            self.update_deadline();
        }
    }

    /// Converts the machine cycle `now` to oscillator time.
    fn to_oscillator_time(&self, now: u64) -> u64 {
        self.power.stopped_at(now).saturating_sub(self.stopped_cycles)
    }

    /// The machine cycle of the next deadline.
    fn next_due(&self) -> u64 {
        let drive = self.drives.next_cycle().min(self.power.next());
        if self.power.is_powered_down() {
            drive
        } else {
            drive.min(self.schedule.due.saturating_add(self.stopped_cycles))
        }
    }

    /// Executes everything that is due at the cycle `t`, which must be the next deadline.
    fn run_cycle(&mut self, t: u64) {
        // S1P1: pins.
        while let Some((pin, level)) = self.drives.pop_due(t + self.stopped_cycles) {
            let changed = self.ports.drive(pin, level, t);
            self.on_pin_edge(pin, changed, t, 0);
            self.sample_at = t;
        }
        while let Some(edge) = self.edges.front().copied().filter(|edge| edge.at.cycle <= t) {
            self.edges.pop_front();
            self.apply_serial_edge(edge);
        }
        self.run_units(t, 0..unit_index::SERIAL);
        // S5P2: samples, bits, flags.
        if self.sample_at <= t {
            self.sample_pins(t);
        }
        self.run_units(t, unit_index::SERIAL..unit_index::COUNT);
    }

    /// Executes what is due in some of the units at the cycle `t`.
    fn run_units(&mut self, t: u64, numbers: Range<usize>) {
        for_each_unit!(self, unit, number => {
            if self.schedule.deadlines[number] <= t && numbers.contains(&number) {
                self.schedule.touch(number);
                unit.run_due(t, &mut self.out);
                self.apply_signals(());
            }
        });
    }

    /// Gives peripherals the levels that have changed, as sampled in cycle `t`.
    fn sample_pins(&mut self, t: u64) {
        self.sample_at = NEVER;
        for (i, pin) in SAMPLED_PINS.into_iter().enumerate() {
            let high = self.ports.pin(pin).reads_high;
            if high == self.sampled_levels[i] {
                continue;
            }
            self.sampled_levels[i] = high;
            self.next_interrupt_boundary = 0;
            match pin {
                pin::INT0 | pin::INT1 => {
                    self.timers.on_line_changed(pin, high, t, &mut self.out);
                    self.interrupts.external[usize::from(pin == pin::INT1)].sample(high, t);
                }
                pin::T0 | pin::T1 => self.timers.on_line_changed(pin, high, t, &mut self.out),
                pin::RXD => self.serial.on_line_changed(pin, high, t, &mut self.out),
                pin::T2 | pin::T2EX => self.timer2.on_line_changed(pin, high, t, &mut self.out),
                _ => self.power.set_reset_pin(high && !self.ports.rst_high, t + self.stopped_cycles),
            }
        }
        self.update_baud_clocks(t);
        self.apply_signals(());
    }

    /// Gives the serial port the present clocks, after a change of a timer or of their selection in cycle
    /// `t`.
    fn update_baud_clocks(&mut self, t: u64) {
        self.schedule.touch(unit_index::SERIAL);
        self.serial.set_clocks(self.baud_clocks(), t);
    }

    fn baud_clocks(&self) -> BaudClocks {
        BaudClocks {
            timer1: self.timers.ticks(),
            timer2: self.timer2.ticks(),
            uses_timer2: self.timer2.clocks_serial(),
            is_double: self.pcon & power::SMOD != 0,
        }
    }

    /// Applies a change of a serial line.
    fn apply_serial_edge(&mut self, edge: SerialEdge) {
        let pin = match edge.line {
            SerialLine::Txd => {
                self.ports.txd_low = !edge.level;
                pin::TXD
            }
            SerialLine::Rxd => {
                self.ports.rxd_low = !edge.level;
                pin::RXD
            }
        };
        self.update_pin(pin, edge.at.cycle, edge.at.phase);
    }

    /// Updates a pin at clock `phase` of cycle `t` after the chip has changed how it drives it.
    fn update_pin(&mut self, pin: PinId, t: u64, phase: u8) {
        let changed = self.ports.update_level(pin, t);
        self.on_pin_edge(pin, changed, t, phase);
    }

    /// Logs a change and a contention of a pin, and schedules the sampling of a pin that peripherals use.
    fn on_pin_edge(&mut self, pin: PinId, changed: Option<PinLevel>, t: u64, phase: u8) {
        let at = CycleTime { cycle: t + self.stopped_cycles, phase: phase * self.clocks_per_cycle / 12 };
        if self.log.is_enabled() {
            self.log.record_pin(at, pin, self.ports.has_contention(pin), changed);
        }
        if changed.is_none() {
            return;
        }
        if SAMPLED_PINS.contains(&pin) {
            self.sample_at = self.sample_at.min(t);
        }
        if self.part.has_comparator && matches!(pin, 8 | 9) {
            self.update_pin(pin::OUT, t, phase);
        }
    }

    /// Computes the next deadline, without interrupts.
    fn update_deadline(&mut self) {
        if self.schedule.touched != 0 {
            for_each_unit!(self, unit, number => if self.schedule.touched >> number & 1 == 1 { self.schedule.ask(number, unit) });
        }
        let edge = self.edges.front().map_or(NEVER, |edge| edge.at.cycle);
        self.schedule.update_due(edge.min(self.sample_at));
    }
}

impl SignalReceiver for Mcs51Soc {
    type Signal = Mcs51Signal;
    type Sender = ();

    #[inline(always)]
    fn outbox(&mut self) -> &mut Mcs51Outbox {
        &mut self.out
    }

    fn apply_signal(&mut self, _: (), signal: Mcs51Signal) {
        match signal {
            Mcs51Signal::Edge { t, edge } if edge.at.cycle <= t && edge.at.phase == 0 => self.apply_serial_edge(edge),
            Mcs51Signal::Edge { edge, .. } => self.edges.push_back(edge),
            Mcs51Signal::Sent { t, byte } => {
                self.log.record(ChipEvent::Sent { at: CycleTime::at(t + self.stopped_cycles), uart: 0, byte })
            }
            Mcs51Signal::Flag => self.next_interrupt_boundary = 0,
            Mcs51Signal::ClockOut { at, high } => {
                if self.ports.t2_low == high {
                    self.ports.t2_low = !high;
                    self.update_pin(pin::T2, at.cycle, at.phase);
                }
            }
            Mcs51Signal::Watchdog { t } => self.watchdog_ran_out(t),
        }
    }
}
