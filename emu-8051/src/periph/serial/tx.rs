//! The transmitter of modes 1 to 3: a free-running divide-by-16 counter, and a shift register that shifts at
//! its rollovers.

use emu_core::state;

/// A byte that is being sent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct OutgoingFrame {
    byte: u8,
    /// The bits after the one on the line, the next one lowest: data, TB8 in modes 2 and 3, the stop bit.
    bits: u16,
    /// Rollovers until the stop bit begins; 0 while the stop bit is on the line.
    left: u8,
}

state! { OutgoingFrame { byte, bits, left } if |frame, _now| frame.left <= 10 }

/// The transmitter.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SerialSender {
    /// Ticks since the last rollover, 0 to 15.
    count: u8,
    /// A byte that was written and begins at the next rollover.
    next: Option<OutgoingFrame>,
    /// The byte on the line.
    out: Option<OutgoingFrame>,
}

state! { SerialSender { count, next, out } if |sender, _now| sender.count < 16 }

/// The effects of a rollover.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SenderStep {
    /// The new level of TXD.
    pub(super) line: Option<bool>,
    /// A stop bit begins; sets TI.
    pub(super) ti: bool,
    /// The byte whose stop bit has ended.
    pub(super) sent: Option<u8>,
}

impl SerialSender {
    /// Nothing to send.
    pub(super) const IDLE: SerialSender = SerialSender { count: 0, next: None, out: None };

    /// Loads a byte, in modes 2 and 3 with its ninth bit.
    pub(super) fn load(&mut self, byte: u8, ninth: Option<bool>) {
        let data = u16::from(byte);
        self.next = Some(match ninth {
            None => OutgoingFrame { byte, bits: data | 1 << 8, left: 9 },
            Some(tb8) => OutgoingFrame { byte, bits: data | u16::from(tb8) << 8 | 1 << 9, left: 10 },
        });
    }

    /// Drops everything but the count. Returns a byte whose stop bit is on the line, which counts as sent
    /// because the line stays high.
    pub(super) fn abort(&mut self) -> Option<u8> {
        self.next = None;
        self.out.take().filter(|frame| frame.left == 0).map(|frame| frame.byte)
    }

    /// Whether a byte is waiting or on the line.
    pub(super) fn is_busy(&self) -> bool {
        self.next.is_some() || self.out.is_some()
    }

    /// The byte whose stop bit is on the line.
    pub(super) fn byte_in_stop_bit(&self) -> Option<u8> {
        self.out.filter(|frame| frame.left == 0).map(|frame| frame.byte)
    }

    /// Ticks until the next rollover, 1 to 16; `None` if there is nothing to send.
    pub(super) fn ticks_to_next_step(&self) -> Option<u64> {
        self.is_busy().then(|| 16 - u64::from(self.count))
    }

    /// Lets `n` ticks pass without a rollover.
    pub(super) fn advance(&mut self, n: u64) {
        debug_assert!(
            self.ticks_to_next_step().is_none_or(|wait| n < wait),
            "{n} ticks pass over a rollover: {self:?}"
        );
        self.count = (self.count + (n & 15) as u8) & 15;
    }

    /// Executes a rollover.
    pub(super) fn step(&mut self) -> SenderStep {
        debug_assert!(self.count == 15, "no rollover is due: {self:?}");
        self.count = 0;
        let over = self.byte_in_stop_bit();
        if let Some(frame) = self.next.take() {
            self.out = Some(frame);
            return SenderStep { line: Some(false), ti: false, sent: over };
        }
        let Some(frame) = &mut self.out else { return SenderStep::default() };
        if frame.left == 0 {
            self.out = None;
            return SenderStep { sent: over, ..SenderStep::default() };
        }
        let bit = frame.bits & 1 != 0;
        frame.bits >>= 1;
        frame.left -= 1;
        SenderStep { line: Some(bit), ti: frame.left == 0, sent: None }
    }
}
