//! The clocks of the serial port (user's manual, "Baud rates"): timer 1, timer 2 or the oscillator, and the divider by two
//! that SMOD switches off.

use emu_core::NEVER;
use emu_core::state;

use super::Soc;
use super::power::SMOD;
use crate::periph::map::pin;

/// T2CON bits: timer 2 clocks the receiver, the transmitter.
const RCLK: u8 = 0x20;
const TCLK: u8 = 0x10;

/// Where ticks of a 16x baud clock come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// Mode 0 needs none.
    None,
    /// Overflows of timer 1, or every second one.
    Timer1,
    /// Overflows of timer 2.
    Timer2,
    /// States of the oscillator, or every second one.
    States,
}

/// A side of the port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Tx,
    Rx,
}

/// How far the clocks of both sides have come: what their sources have counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Baud {
    tx: u64,
    rx: u64,
}

state! { Baud { tx, rx } }

impl Baud {
    /// Nothing counted.
    pub(super) const START: Baud = Baud { tx: 0, rx: 0 };
}

impl Soc {
    fn source(&self, side: Side) -> Source {
        let clock = if side == Side::Tx { TCLK } else { RCLK };
        match self.serial.mode() {
            0 => Source::None,
            2 => Source::States,
            _ if self.timer2.as_ref().is_some_and(|t| t.t2con() & clock != 0) => Source::Timer2,
            _ => Source::Timer1,
        }
    }

    /// What a source has counted up to S5P2 of cycle `t`.
    fn counted(&self, source: Source, t: u64) -> u64 {
        match source {
            Source::None => 0,
            Source::Timer1 => self.timers.overflows_at(t),
            Source::Timer2 => {
                self.timer2.as_ref().map_or(0, |timer2| timer2.overflows_by(t.saturating_mul(6).saturating_add(4)))
            }
            Source::States => t.saturating_mul(6).saturating_add(5),
        }
    }

    /// Counts of the source per tick: 1, or 2 as long as SMOD is clear.
    const fn divider(&self, source: Source) -> u64 {
        match source {
            Source::Timer1 | Source::States if self.pcon & SMOD == 0 => 2,
            _ => 1,
        }
    }

    /// The sources of both sides.
    pub(super) fn sources(&self) -> [Source; 2] {
        [self.source(Side::Tx), self.source(Side::Rx)]
    }

    /// After a write at the end of cycle `t`: a source that was not `before` begins with its count there. One that stays goes
    /// on, with what the write itself has let it count.
    pub(super) fn rebase(&mut self, before: [Source; 2], t: u64) {
        let now = self.sources();
        if now[0] != before[0] {
            self.baud.tx = self.counted(now[0], t);
        }
        if now[1] != before[1] {
            self.baud.rx = self.counted(now[1], t);
        }
    }

    /// Brings the serial port up to S5P2 of cycle `t`, the first at which it has anything to do, if it has.
    pub(super) fn run_serial(&mut self, t: u64) {
        let idle = self.serial.tx_wait().is_none() && self.serial.rx_wait().is_none();
        if !idle || self.serial.shift_next() <= t {
            self.pass_ticks(t);
        }
    }

    /// The same, with the ticks that an idle port lets pass: before something is done to it or its clocks.
    pub(super) fn pass_ticks(&mut self, t: u64) {
        while self.serial.shift_next() <= t {
            let cycle = self.serial.shift_next();
            let step = self.serial.shift_step(cycle, self.ports.pin(pin::RXD).high);
            self.took(step, cycle);
        }
        if self.serial.mode() == 0 {
            return;
        }
        let mut ticks = self.ticks(Side::Tx, t);
        while let Some(wait) = self.serial.tx_wait().filter(|&wait| wait <= ticks) {
            self.serial.tx_pass(wait - 1);
            let step = self.serial.tx_step(t);
            self.took(step, t);
            ticks -= wait;
        }
        self.serial.tx_pass(ticks);
        let mut ticks = self.ticks(Side::Rx, t);
        while let Some(wait) = self.serial.rx_wait().filter(|&wait| wait <= ticks) {
            self.serial.rx_pass(wait - 1);
            let sample = self.ports.pin(pin::RXD).high;
            let step = self.serial.rx_step(t, sample);
            self.took(step, t);
            ticks -= wait;
        }
        self.serial.rx_pass(ticks);
    }

    /// Ticks of a side since the last time, which are taken for passed.
    fn ticks(&mut self, side: Side, t: u64) -> u64 {
        let source = self.source(side);
        let (counted, divider) = (self.counted(source, t), self.divider(source));
        let before = if side == Side::Tx { &mut self.baud.tx } else { &mut self.baud.rx };
        let ticks = (counted / divider).saturating_sub(*before / divider);
        *before = counted.max(*before);
        ticks
    }

    /// The cycle of the serial port's next step; NEVER when it has none, or its clock stands.
    pub(super) fn next_serial(&self) -> u64 {
        let side = |side: Side, wait: Option<u64>, counted: u64| {
            let Some(wait) = wait else { return NEVER };
            let source = self.source(side);
            let divider = self.divider(source);
            let target = (counted / divider).saturating_add(wait).saturating_mul(divider);
            match source {
                Source::None => NEVER,
                Source::Timer1 => self.timers.overflow_at(target),
                Source::Timer2 => match self.timer2.as_ref().map_or(NEVER, |t| t.overflow_state(target)) {
                    NEVER => NEVER,
                    state => state.saturating_add(1) / 6,
                },
                Source::States => target / 6,
            }
        };
        let tx = side(Side::Tx, self.serial.tx_wait(), self.baud.tx);
        let rx = side(Side::Rx, self.serial.rx_wait(), self.baud.rx);
        tx.min(rx).min(self.serial.shift_next())
    }
}
