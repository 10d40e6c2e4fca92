//! The USART: universal synchronous asynchronous receiver and transmitter (DS30292 and DS39582, chapter 10; DS33023,
//! section 18).
//!
//! The baud rate generator divides the oscillator by 4 (SPBRG + 1). A period of it is a bit in synchronous mode, and a
//! quarter (BRGH = 1) or a sixteenth (BRGH = 0) of a bit in asynchronous mode. It stands while the oscillator does, so what
//! hangs on it is kept in *clocks of the oscillator that have run*: the clock less the clocks slept. A slave is clocked by
//! CK alone and works in sleep.

mod device;
mod fifo;
mod receiver;
mod sender;

use emu_core::NEVER;

use self::fifo::ReceiveFifo;
use self::receiver::{LevelHistory, UsartReceiver};
use self::sender::OutgoingWord;
use super::map::{InterruptFlag, Pic16Line};
use super::{Pic16Device, Pic16Drive, Pic16Outbox, Pic16Signal};

/// RCSTA: serial port enable.
pub const SPEN: u8 = 1 << 7;
/// RCSTA: nine-bit reception.
pub const RX9: u8 = 1 << 6;
/// RCSTA: single reception, synchronous master only.
pub const SREN: u8 = 1 << 5;
/// RCSTA: continuous reception.
pub const CREN: u8 = 1 << 4;
/// RCSTA: address detection, asynchronous with nine bits only.
pub const ADDEN: u8 = 1 << 3;
/// RCSTA: framing error of the byte in RCREG.
pub const FERR: u8 = 1 << 2;
/// RCSTA: overrun error.
pub const OERR: u8 = 1 << 1;
/// RCSTA: ninth bit of the byte in RCREG.
pub const RX9D: u8 = 1 << 0;
/// TXSTA: synchronous master.
pub const CSRC: u8 = 1 << 7;
/// TXSTA: nine-bit transmission.
pub const TX9: u8 = 1 << 6;
/// TXSTA: transmit enable.
pub const TXEN: u8 = 1 << 5;
/// TXSTA: synchronous mode.
pub const SYNC: u8 = 1 << 4;
/// TXSTA: high baud rate.
pub const BRGH: u8 = 1 << 2;
/// TXSTA: the transmit shift register is empty.
pub const TRMT: u8 = 1 << 1;
/// TXSTA: ninth bit to transmit.
pub const TX9D: u8 = 1 << 0;

/// The bits of TXSTA that a program writes (DS30292, register 10-1).
const TXSTA_WRITTEN: u8 = CSRC | TX9 | TXEN | SYNC | BRGH | TX9D;
/// The bits of RCSTA that a program writes (DS30292, register 10-2).
const RCSTA_WRITTEN: u8 = SPEN | RX9 | SREN | CREN | ADDEN;
/// Clocks of an instruction cycle: what the way from TXREG to TSR takes (DS30292, 10.2.1).
const TCY: u64 = 4;

/// The serial port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Usart {
    /// The bits that a program writes.
    txsta: u8,
    /// The bits that a program writes.
    rcsta: u8,
    txreg: u8,
    baud: BaudClock,
    /// Clocks for which the oscillator has stood so far, and since when it stands now.
    slept: u64,
    asleep: Option<u64>,

    /// TXREG holds a byte that TSR has not taken.
    full: bool,
    /// TXREG is empty as TXIF has it, one cycle late, and the clock at which it changes its mind.
    empty_seen: bool,
    empty_change: u64,
    /// The clock at which TSR, being idle, takes what is in TXREG.
    load: u64,
    /// TSR.
    word: Option<OutgoingWord>,
    /// The bit on the way out: TX, or DT of synchronous mode.
    out_bit: bool,

    receiver: UsartReceiver,
    past: LevelHistory,
    fifo: ReceiveFifo,
    oerr: bool,

    /// Levels of the lines.
    tx_line: bool,
    rx_line: bool,
    /// What has been said to the rest of the chip.
    txif: Option<u64>,
    rcif: Option<u64>,
    drives: [Pic16Drive; 2],
    /// TRMT is set as the stop bit begins.
    early_trmt: bool,
}

emu_core::state! {
    Pic16Usart {
        txsta, rcsta, txreg, baud, slept, asleep, full, empty_seen, empty_change, load, word, out_bit, receiver, past, fifo, oerr, tx_line,
        rx_line, txif, rcif, drives,
    } stays { early_trmt } if |usart, now| usart.slept <= now && usart.asleep.is_none_or(|since| since <= now + 4)
}

/// The baud rate generator, in clocks of the oscillator that have run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct BaudClock {
    spbrg: u8,
    /// It was cleared then: its periods end a whole number of them later.
    origin: u64,
}

emu_core::state! { BaudClock { spbrg, origin } if |baud, now| baud.origin <= now + 4 }

impl BaudClock {
    /// Clocks of a period.
    fn period(self) -> u64 {
        4 * (u64::from(self.spbrg) + 1)
    }

    /// The first multiple of `step` clocks from the origin on, and `lag` more, that is not before `at`.
    fn edge(self, step: u64, lag: u64, at: u64) -> u64 {
        let first = self.origin.saturating_add(lag);
        first.saturating_add(at.saturating_sub(first).div_ceil(step).saturating_mul(step))
    }

    /// When the period began that is under way at `now`.
    fn began(self, now: u64) -> u64 {
        self.origin.saturating_add(now.saturating_sub(self.origin) / self.period() * self.period())
    }
}

impl Default for Pic16Usart {
    fn default() -> Pic16Usart {
        Pic16Usart::new()
    }
}

impl Pic16Usart {
    /// The port as after a power-on reset at clock 0, both lines low. (DS30292, table 12-6.)
    #[must_use]
    pub const fn new() -> Pic16Usart {
        Pic16Usart {
            txsta: 0,
            rcsta: 0,
            txreg: 0,
            baud: BaudClock { spbrg: 0, origin: 0 },
            slept: 0,
            asleep: None,
            full: false,
            empty_seen: true,
            empty_change: NEVER,
            load: NEVER,
            word: None,
            out_bit: true,
            receiver: UsartReceiver::Idle,
            past: LevelHistory::LOW,
            fifo: ReceiveFifo::EMPTY,
            oerr: false,
            tx_line: false,
            rx_line: false,
            txif: None,
            rcif: None,
            drives: [Pic16Drive::Port; 2],
            early_trmt: false,
        }
    }

    /// TRMT is set as the stop bit begins, not in its middle ([`Pic16Readings::trmt_as_stop_begins`](crate::Pic16Readings)).
    #[must_use]
    pub fn with_early_trmt(mut self, early: bool) -> Pic16Usart {
        self.early_trmt = early;
        self
    }

    /// A reset at clock `t`: every kind has the same effect here. (DS30292, table 12-6.) It says nothing about the
    /// oscillator: a reset out of sleep takes a [`Pic16Device::wake`] as well.
    pub fn reset(&mut self, power_on: bool, t: u64, out: &mut Pic16Outbox) {
        let _ = power_on;
        self.run_due(t, out);
        let now = self.osc(t);
        *self = Pic16Usart {
            baud: BaudClock { spbrg: 0, origin: now },
            slept: self.slept,
            asleep: self.asleep,
            past: self.past,
            tx_line: self.tx_line,
            rx_line: self.rx_line,
            drives: self.drives,
            early_trmt: self.early_trmt,
            ..Pic16Usart::new()
        };
        self.settle(t, out);
    }

    /// RCIF: there is a byte in RCREG. Everything due has been done.
    #[must_use]
    pub fn rcif(&self) -> bool {
        self.rcif.is_some()
    }

    /// The clock since which RCIF is set.
    #[must_use]
    pub fn rcif_since(&self) -> Option<u64> {
        self.rcif
    }

    /// TXIF at clock `t`, nothing but its own change being due before: TXREG was empty a cycle ago, and TXEN is set.
    /// (DS30292, 10.2.1; it becomes valid in the second instruction after the load of TXREG.)
    #[must_use]
    pub fn txif(&self, t: u64) -> bool {
        self.txsta & TXEN != 0 && self.empty_seen != (self.empty_change <= t)
    }

    /// The clock since which TXIF is set. Everything due has been done.
    #[must_use]
    pub fn txif_since(&self) -> Option<u64> {
        self.txif
    }

    /// The byte whose stop bit is on the line: all that a receiver needs of it has been sent, and its [`Pic16Signal::Sent`] is
    /// still to come.
    #[must_use]
    pub fn byte_in_stop_bit(&self) -> Option<u8> {
        self.word.filter(|word| !self.sync() && word.left == 0).map(|word| word.byte)
    }

    /// TRMT at clock `t`: TSR is empty. In asynchronous mode it is so from the middle of the stop bit on
    /// (DS30292, figure 10-2) or from its begin on, as it is read, unless a byte waits that follows without a gap.
    fn trmt(&self, t: u64) -> bool {
        self.word.is_none() || !self.full && self.osc(t) >= self.trmt_due()
    }

    /// When TRMT will be set before the word has ended, in clocks run.
    fn trmt_due(&self) -> u64 {
        let stop = self.word.filter(|word| !self.sync() && word.left == 0);
        let before = if self.early_trmt { self.bit_time() } else { self.bit_time() / 2 };
        stop.map_or(NEVER, |word| word.next.saturating_sub(before))
    }

    const fn sync(&self) -> bool {
        self.txsta & SYNC != 0
    }

    const fn slave(&self) -> bool {
        self.txsta & (SYNC | CSRC) == SYNC
    }

    const fn is_sending_enabled(&self) -> bool {
        self.rcsta & SPEN != 0 && self.txsta & TXEN != 0
    }

    /// The receiver is on. SREN counts in the synchronous master alone (DS30292, register 10-2).
    const fn is_receiving_enabled(&self) -> bool {
        let enables = if self.txsta & (SYNC | CSRC) == SYNC | CSRC { SREN | CREN } else { CREN };
        self.rcsta & SPEN != 0 && self.rcsta & enables != 0
    }

    /// The baud rate generator of the synchronous master is kept in reset (DS30292, 10.3.1).
    const fn is_blocked_by_overrun(&self) -> bool {
        self.sync() && !self.slave() && !self.is_sending_enabled() && !self.is_receiving_enabled()
    }

    /// Clocks that the oscillator has run up to `t`.
    fn osc(&self, t: u64) -> u64 {
        self.asleep.map_or(t, |since| since.min(t)).saturating_sub(self.slept)
    }

    /// When the oscillator will have run `osc` clocks.
    fn clock(&self, osc: u64) -> u64 {
        if self.asleep.is_some() || osc == NEVER { NEVER } else { osc.saturating_add(self.slept) }
    }

    /// Clocks of a bit on the line.
    fn bit_time(&self) -> u64 {
        self.baud.period() * if self.sync() { 1 } else { self.ticks() }
    }

    /// Periods of the generator in a bit of asynchronous mode.
    const fn ticks(&self) -> u64 {
        if self.txsta & BRGH != 0 { 4 } else { 16 }
    }

    /// The first edge of the shift clock that is not before `at`, in clocks run: for a slave there is none.
    fn shift(&self, at: u64) -> u64 {
        if self.slave() { NEVER } else { self.baud.edge(self.bit_time(), 0, at) }
    }

    /// The first falling edge of the master's CK that is not before `at`.
    fn fall(&self, at: u64) -> u64 {
        self.baud.edge(self.bit_time(), self.bit_time() / 2, at)
    }

    /// Says what has changed for the rest of the chip at `t`.
    fn settle(&mut self, t: u64, out: &mut Pic16Outbox) {
        for (held, since, flag) in [
            (self.txsta & TXEN != 0 && self.empty_seen, &mut self.txif, InterruptFlag::TXIF),
            (self.fifo.has_word(), &mut self.rcif, InterruptFlag::RCIF),
        ] {
            if held && since.is_none() {
                *since = Some(t);
                out.push(Pic16Signal::Flag { t, flag });
            } else if !held {
                *since = None;
            }
        }
        let drives = self.driven_lines();
        for (n, line) in [Pic16Line::Tx, Pic16Line::Rx].into_iter().enumerate() {
            if let (Some(drive), Some(last)) = (drives.get(n), self.drives.get(n))
                && drive != last
            {
                out.push(Pic16Signal::Drive { t, line, drive: *drive });
            }
        }
        self.drives = drives;
    }

    /// What the port does to TX and RX. What it does not drive it leaves to the port latch and TRIS, which the data sheet
    /// wants to be set (DS30292, chapter 10).
    fn driven_lines(&self) -> [Pic16Drive; 2] {
        let bit = if self.is_sending_enabled() { Pic16Drive::from_bit(self.out_bit) } else { Pic16Drive::Port };
        if !self.sync() {
            return [bit, Pic16Drive::Port];
        }
        let high = self.word.is_some_and(|word| word.high) || self.receiver.ck();
        let master = !self.slave() && (self.is_sending_enabled() || self.is_receiving_enabled());
        [
            if master { Pic16Drive::from_bit(high) } else { Pic16Drive::Port },
            if self.is_receiving_enabled() { Pic16Drive::Port } else { bit },
        ]
    }
}
