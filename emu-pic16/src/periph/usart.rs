//! The USART: universal synchronous asynchronous receiver and transmitter (DS30292 and DS39582, chapter 10;
//! DS33023, section 18).
//!
//! The baud rate generator divides the oscillator by 4 (SPBRG + 1). Its period is one bit in synchronous
//! mode, and a quarter (BRGH = 1) or a sixteenth (BRGH = 0) of a bit in asynchronous mode. It stops with the
//! oscillator, so everything that depends on it is kept in *running clocks*: the clock minus the clocks spent
//! in sleep. A synchronous slave is clocked by CK alone and works in sleep.

mod device;
mod fifo;
mod receiver;
mod sender;

use emu_core::NEVER;

use self::fifo::ReceiveFifo;
use self::receiver::{LevelHistory, UsartReceiver};
use self::sender::OutgoingWord;
use super::map::{InterruptFlag, Pic16Line};
use super::{Pic16Drive, Pic16Outbox, Pic16Signal};

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
/// TXSTA: transmit shift register is empty.
pub const TRMT: u8 = 1 << 1;
/// TXSTA: ninth bit to transmit.
pub const TX9D: u8 = 1 << 0;

/// Bits of TXSTA that a program can write (DS30292, register 10-1).
const TXSTA_WRITTEN: u8 = CSRC | TX9 | TXEN | SYNC | BRGH | TX9D;
/// Bits of RCSTA that a program can write (DS30292, register 10-2).
const RCSTA_WRITTEN: u8 = SPEN | RX9 | SREN | CREN | ADDEN;
/// Clocks per instruction cycle, the time from TXREG to TSR (DS30292, 10.2.1).
const TCY: u64 = 4;

/// The USART.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Usart {
    /// Bits of TXSTA that a program writes.
    txsta: u8,
    /// Bits of RCSTA that a program writes.
    rcsta: u8,
    txreg: u8,
    baud: BaudClock,
    /// Clocks for which the oscillator has been stopped so far, and the clock at which it was stopped, while
    /// it is.
    slept: u64,
    asleep: Option<u64>,

    /// True if TXREG holds a byte that TSR has not taken.
    full: bool,
    /// True if TXREG is empty as TXIF shows it, one cycle late; then the clock at which that changes.
    empty_seen: bool,
    empty_change: u64,
    /// Clock at which the idle TSR takes the byte in TXREG.
    load: u64,
    /// Word in the shift register TSR.
    word: Option<OutgoingWord>,
    /// Bit on the output: TX, or DT in synchronous mode.
    out_bit: bool,

    receiver: UsartReceiver,
    past: LevelHistory,
    fifo: ReceiveFifo,
    oerr: bool,

    /// Levels of the lines TX and RX.
    tx_line: bool,
    rx_line: bool,
    /// Clocks since which TXIF and RCIF are set, and the last overrides sent.
    txif: Option<u64>,
    rcif: Option<u64>,
    drives: [Pic16Drive; 2],
    /// True if TRMT is set at the start of the stop bit.
    early_trmt: bool,
}

emu_core::state! {
    Pic16Usart {
        txsta, rcsta, txreg, baud, slept, asleep, full, empty_seen, empty_change, load, word, out_bit, receiver, past, fifo, oerr, tx_line,
        rx_line, txif, rcif, drives,
    } stays { early_trmt } if |usart, now| usart.slept <= now && usart.asleep.is_none_or(|since| since <= now + 4)
}

/// The baud rate generator, in running clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct BaudClock {
    spbrg: u8,
    /// Running clock at which it was cleared; its periods end whole periods later.
    origin: u64,
}

emu_core::state! { BaudClock { spbrg, origin } if |baud, now| baud.origin <= now + 4 }

impl BaudClock {
    /// Returns the clocks of a period.
    fn period(self) -> u64 {
        4 * (u64::from(self.spbrg) + 1)
    }

    /// Returns the first running clock at or after `at` that is a multiple of `step` after the origin, plus
    /// `lag`.
    fn edge(self, step: u64, lag: u64, at: u64) -> u64 {
        let first = self.origin.saturating_add(lag);
        first.saturating_add(at.saturating_sub(first).div_ceil(step).saturating_mul(step))
    }

    /// Returns the start of the period in progress at `now`.
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
    /// Returns the port after a power-on reset at clock 0, with both lines low (DS30292, table 12-6).
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

    /// Sets whether TRMT is set at the start of the stop bit instead of its middle
    /// ([`Pic16Readings::trmt_as_stop_begins`](crate::Pic16Readings)).
    #[must_use]
    pub fn with_early_trmt(mut self, early: bool) -> Pic16Usart {
        self.early_trmt = early;
        self
    }

    /// Returns RCIF: there is a byte in RCREG. Call `run_due` first.
    #[must_use]
    pub fn rcif(&self) -> bool {
        self.rcif.is_some()
    }

    /// Returns the clock since which RCIF is set.
    #[must_use]
    pub fn rcif_since(&self) -> Option<u64> {
        self.rcif
    }

    /// Returns TXIF at clock `t`, with at most its own change due before: TXREG was empty one cycle ago, and
    /// TXEN is set (DS30292, 10.2.1: it is valid in the second instruction after the load of TXREG).
    #[must_use]
    pub fn txif(&self, t: u64) -> bool {
        self.txsta & TXEN != 0 && self.empty_seen != (self.empty_change <= t)
    }

    /// Returns the clock since which TXIF is set. Call `run_due` first.
    #[must_use]
    pub fn txif_since(&self) -> Option<u64> {
        self.txif
    }

    /// Returns the byte whose stop bit is on the line: a receiver needs no more of it, and its
    /// [`Pic16Signal::Sent`] is still to come.
    #[must_use]
    pub fn byte_in_stop_bit(&self) -> Option<u8> {
        self.word.filter(|word| !self.sync() && word.left == 0).map(|word| word.byte)
    }

    /// Returns TRMT at clock `t`: TSR is empty. In asynchronous mode it is set from the middle of the stop
    /// bit (DS30292, figure 10-2) or from its start, by the selected reading, unless another byte follows
    /// without a gap.
    fn trmt(&self, t: u64) -> bool {
        self.word.is_none() || !self.full && self.osc(t) >= self.trmt_due()
    }

    /// Returns the running clock at which TRMT is set before the word ends.
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

    /// Reports whether the receiver is on. SREN counts only in the synchronous master (DS30292, register
    /// 10-2).
    const fn is_receiving_enabled(&self) -> bool {
        let enables = if self.txsta & (SYNC | CSRC) == SYNC | CSRC { SREN | CREN } else { CREN };
        self.rcsta & SPEN != 0 && self.rcsta & enables != 0
    }

    /// Reports whether the baud rate generator of the synchronous master is held in reset (DS30292, 10.3.1).
    const fn is_blocked_by_overrun(&self) -> bool {
        self.sync() && !self.slave() && !self.is_sending_enabled() && !self.is_receiving_enabled()
    }

    /// Returns the running clocks up to `t`.
    fn osc(&self, t: u64) -> u64 {
        self.asleep.map_or(t, |since| since.min(t)).saturating_sub(self.slept)
    }

    /// Returns the clock at which the oscillator will have run for `osc` clocks.
    fn clock(&self, osc: u64) -> u64 {
        if self.asleep.is_some() || osc == NEVER { NEVER } else { osc.saturating_add(self.slept) }
    }

    /// Returns the clocks of a bit on the line.
    fn bit_time(&self) -> u64 {
        self.baud.period() * if self.sync() { 1 } else { self.ticks() }
    }

    /// Returns the periods of the generator per bit in asynchronous mode.
    const fn ticks(&self) -> u64 {
        if self.txsta & BRGH != 0 { 4 } else { 16 }
    }

    /// Returns the first edge of the shift clock at or after `at`, in running clocks; a slave has none.
    fn shift(&self, at: u64) -> u64 {
        if self.slave() { NEVER } else { self.baud.edge(self.bit_time(), 0, at) }
    }

    /// Returns the first falling edge of the master's CK at or after `at`.
    fn fall(&self, at: u64) -> u64 {
        self.baud.edge(self.bit_time(), self.bit_time() / 2, at)
    }

    /// Sends signals for the flags and overrides that have changed at `t`.
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

    /// Returns the overrides of TX and RX. What the USART does not drive is left to the port latch and TRIS,
    /// whose bits must be set by the data sheet (DS30292, chapter 10).
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
