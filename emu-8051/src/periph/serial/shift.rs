//! Mode 0 of the serial port: a shift register for each direction, over one data line and one clock line.

use emu_core::NEVER;
use emu_core::state;

/// Number of machine cycles in which SEND or RECEIVE is active.
const BITS: u8 = 8;

/// A byte that is being transferred, in either direction.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct ShiftTransfer {
    byte: u8,
    /// Number of completed cycles in which SEND or RECEIVE is active.
    done: u8,
    /// The next active cycle, or the one after the last, at whose start the flag is set.
    next: u64,
}

state! { ShiftTransfer { byte, done, next } if |of, _now| of.done <= BITS && of.next != NEVER }

impl ShiftTransfer {
    /// Starts a transfer: one full cycle is between the write and the first active one.
    fn start_after(byte: u8, cycle: u64) -> ShiftTransfer {
        ShiftTransfer { byte, done: 0, next: cycle.saturating_add(2) }
    }

    fn if_due(this: Option<ShiftTransfer>, cycle: u64) -> Option<ShiftTransfer> {
        this.filter(|transfer| transfer.next == cycle)
    }

    fn advance(&mut self) {
        self.done += 1;
        self.next += 1;
    }
}

/// Both directions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ShiftRegister {
    send: Option<ShiftTransfer>,
    receive: Option<ShiftTransfer>,
}

state! { ShiftRegister { send, receive } }

/// The effects of a machine cycle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ShiftStep {
    /// Whether the shift clock pulses in this cycle.
    pub(super) clock: bool,
    /// The byte that was sent; sets TI.
    pub(super) sent: Option<u8>,
    /// The byte that was received; sets RI.
    pub(super) received: Option<u8>,
}

impl ShiftRegister {
    /// No transfer in either direction.
    pub(super) const IDLE: ShiftRegister = ShiftRegister { send: None, receive: None };

    /// Sends a byte that was written at the end of `cycle`; it replaces one in progress.
    pub(super) fn send(&mut self, byte: u8, cycle: u64) {
        self.send = Some(ShiftTransfer::start_after(byte, cycle));
    }

    /// Starts a reception by a write at the end of `cycle`, unless one is in progress.
    pub(super) fn receive(&mut self, cycle: u64) {
        self.receive.get_or_insert(ShiftTransfer::start_after(0, cycle));
    }

    /// Stops the reception.
    pub(super) fn stop_receiving(&mut self) {
        self.receive = None;
    }

    /// Whether a byte is being sent, or waits for its first step.
    pub(super) fn is_sending(&self) -> bool {
        self.send.is_some()
    }

    /// Whether a byte is being received, or waits for its first step.
    pub(super) fn is_receiving(&self) -> bool {
        self.receive.is_some()
    }

    /// The cycle of the next step of either direction, or [`NEVER`].
    pub(super) fn next(&self) -> u64 {
        let next = |transfer: Option<ShiftTransfer>| transfer.map_or(NEVER, |t| t.next);
        next(self.send).min(next(self.receive))
    }

    /// The bit on RXD in the cycle of the last step.
    pub(super) fn driven_level(&self) -> Option<bool> {
        self.send.filter(|t| t.done > 0).map(|t| t.byte >> (t.done - 1) & 1 != 0)
    }

    /// Whether the shift clock pulsed in the cycle of the last step.
    pub(super) fn is_clock_running(&self) -> bool {
        self.send.is_some_and(|t| t.done > 0) || self.receive.is_some_and(|t| t.done > 0)
    }

    /// Executes the machine cycle given by [`ShiftRegister::next`].
    pub(super) fn step(&mut self, cycle: u64, rxd: bool) -> ShiftStep {
        let mut did = ShiftStep::default();
        if let Some(mut transfer) = ShiftTransfer::if_due(self.send, cycle) {
            if transfer.done == BITS {
                did.sent = Some(transfer.byte);
                self.send = None;
            } else {
                transfer.advance();
                self.send = Some(transfer);
            }
        }
        if let Some(mut transfer) = ShiftTransfer::if_due(self.receive, cycle) {
            if transfer.done == BITS {
                did.received = Some(transfer.byte);
                self.receive = None;
            } else {
                // What the port itself drives on the line is on the pin, too.
                let high = rxd && self.driven_level() != Some(false);
                transfer.byte |= u8::from(high) << transfer.done;
                transfer.advance();
                self.receive = Some(transfer);
            }
        }
        did.clock = self.is_clock_running();
        did
    }
}
