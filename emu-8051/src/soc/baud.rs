//! The clocks of the serial port (user's manual, "Baud rates"): timer 1, timer 2 or the oscillator, and the
//! divider by two that SMOD bypasses.

use emu_core::NEVER;
use emu_core::state;

use super::Mcs51Soc;
use super::power::SMOD;
use crate::periph::map::pin;

/// T2CON bits: timer 2 clocks the receiver, the transmitter.
const RCLK: u8 = 0x20;
const TCLK: u8 = 0x10;

/// The source of the ticks of a 16x baud clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BaudSource {
    /// No source: mode 0.
    None,
    /// Overflows of timer 1, or every second one.
    Timer1,
    /// Overflows of timer 2.
    Timer2,
    /// States of the oscillator (six per machine cycle), or every second one.
    States,
}

/// A side of the port: transmitter or receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SerialSide {
    Tx,
    Rx,
}

/// The counts of the sources up to which the ticks of both sides have been applied.
#[derive(Debug, Clone, Copy)]
pub(super) struct BaudClock {
    tx: u64,
    rx: u64,
}

state! { BaudClock { tx, rx } }

impl BaudClock {
    /// No counts.
    pub(super) const START: BaudClock = BaudClock { tx: 0, rx: 0 };
}

impl Mcs51Soc {
    fn source(&self, side: SerialSide) -> BaudSource {
        let clock = if side == SerialSide::Tx { TCLK } else { RCLK };
        match self.serial.mode() {
            0 => BaudSource::None,
            2 => BaudSource::States,
            _ if self.timer2.as_ref().is_some_and(|t| t.t2con() & clock != 0) => BaudSource::Timer2,
            _ => BaudSource::Timer1,
        }
    }

    /// The count of a source up to S5P2 of cycle `t`.
    fn source_ticks(&self, source: BaudSource, t: u64) -> u64 {
        match source {
            BaudSource::None => 0,
            BaudSource::Timer1 => self.timers.overflows_by(t),
            BaudSource::Timer2 => {
                self.timer2.as_ref().map_or(0, |timer2| timer2.overflows_by(t.saturating_mul(6).saturating_add(4)))
            }
            BaudSource::States => t.saturating_mul(6).saturating_add(5),
        }
    }

    /// Counts of the source per tick: 1, or 2 if SMOD is clear.
    const fn divider(&self, source: BaudSource) -> u64 {
        match source {
            BaudSource::Timer1 | BaudSource::States if self.pcon & SMOD == 0 => 2,
            _ => 1,
        }
    }

    /// The sources of transmitter and receiver.
    pub(super) fn sources(&self) -> [BaudSource; 2] {
        [self.source(SerialSide::Tx), self.source(SerialSide::Rx)]
    }

    /// Restarts the baud clocks after a write at the end of cycle `t`. A source that differs from `before`
    /// starts with its present count. A source that stays continues, including counts that the write itself
    /// caused.
    pub(super) fn rebase(&mut self, before: [BaudSource; 2], t: u64) {
        let now = self.sources();
        if now[0] != before[0] {
            self.baud.tx = self.source_ticks(now[0], t);
        }
        if now[1] != before[1] {
            self.baud.rx = self.source_ticks(now[1], t);
        }
    }

    /// Advances the serial port to S5P2 of cycle `t`, if it has something to do. `t` must be the first such
    /// cycle.
    pub(super) fn run_serial(&mut self, t: u64) {
        let idle = self.serial.tx_ticks_to_next_step().is_none() && self.serial.rx_ticks_to_next_step().is_none();
        if !idle || self.serial.next_shift_cycle() <= t {
            self.pass_ticks(t);
        }
    }

    /// As [`Mcs51Soc::run_serial`], but also applies the ticks of an idle port. It must be called before the
    /// port or its clocks are changed.
    pub(super) fn pass_ticks(&mut self, t: u64) {
        while self.serial.next_shift_cycle() <= t {
            let cycle = self.serial.next_shift_cycle();
            let step = self.serial.step_shifter(cycle, self.ports.pin(pin::RXD).reads_high);
            self.on_serial_step(step, cycle);
        }
        if self.serial.mode() == 0 {
            return;
        }
        let mut ticks = self.ticks(SerialSide::Tx, t);
        while let Some(wait) = self.serial.tx_ticks_to_next_step().filter(|&wait| wait <= ticks) {
            self.serial.tx_advance(wait - 1);
            let step = self.serial.step_transmitter(t);
            self.on_serial_step(step, t);
            ticks -= wait;
        }
        self.serial.tx_advance(ticks);
        let mut ticks = self.ticks(SerialSide::Rx, t);
        while let Some(wait) = self.serial.rx_ticks_to_next_step().filter(|&wait| wait <= ticks) {
            self.serial.rx_advance(wait - 1);
            let sample = self.ports.pin(pin::RXD).reads_high;
            let step = self.serial.step_receiver(t, sample);
            self.on_serial_step(step, t);
            ticks -= wait;
        }
        self.serial.rx_advance(ticks);
    }

    /// Ticks of a side since the last call; they count as applied.
    fn ticks(&mut self, side: SerialSide, t: u64) -> u64 {
        let source = self.source(side);
        let (counted, divider) = (self.source_ticks(source, t), self.divider(source));
        let before = if side == SerialSide::Tx { &mut self.baud.tx } else { &mut self.baud.rx };
        let ticks = (counted / divider).saturating_sub(*before / divider);
        *before = counted.max(*before);
        ticks
    }

    /// The cycle of the serial port's next step; NEVER if it has none or its clock is stopped.
    pub(super) fn next_serial(&self) -> u64 {
        let side = |side: SerialSide, wait: Option<u64>, counted: u64| {
            let Some(wait) = wait else { return NEVER };
            let source = self.source(side);
            let divider = self.divider(source);
            let target = (counted / divider).saturating_add(wait).saturating_mul(divider);
            match source {
                BaudSource::None => NEVER,
                BaudSource::Timer1 => self.timers.cycle_of_overflow(target),
                BaudSource::Timer2 => match self.timer2.as_ref().map_or(NEVER, |t| t.state_of_overflow(target)) {
                    NEVER => NEVER,
                    state => state.saturating_add(1) / 6,
                },
                BaudSource::States => target / 6,
            }
        };
        let tx = side(SerialSide::Tx, self.serial.tx_ticks_to_next_step(), self.baud.tx);
        let rx = side(SerialSide::Rx, self.serial.rx_ticks_to_next_step(), self.baud.rx);
        tx.min(rx).min(self.serial.next_shift_cycle())
    }
}
