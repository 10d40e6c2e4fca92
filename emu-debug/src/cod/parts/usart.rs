//! A serial port at the other end of the wires: 8 data bits, no parity, one stop bit.

use std::collections::VecDeque;

use crate::cod::value::CodValue;

/// Bits of a frame: start, 8 data bits, stop.
const BITS_PER_FRAME: u64 = 10;

/// The serial port. Times are clocks of the chip's oscillator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodUsart {
    /// Bits per second when sending.
    pub txbaud: u64,
    /// Bits per second when receiving.
    pub rxbaud: u64,
    /// Whether it sends back each byte it receives.
    pub echo: bool,
    /// The last received byte.
    pub rx: u8,
    send_queue: VecDeque<u8>,
    /// The byte being sent, and the clock at which its start bit begins.
    sending: Option<(u8, u64)>,
    /// The frame being received: the clock at which its start bit began, the number of bits sampled, and
    /// their values.
    receiving: Option<(u64, u64, u8)>,
    /// Level of the line, high while nothing is sent.
    line: bool,
}

impl Default for CodUsart {
    fn default() -> Self {
        CodUsart {
            txbaud: 9600,
            rxbaud: 9600,
            echo: false,
            rx: 0,
            send_queue: VecDeque::new(),
            sending: None,
            receiving: None,
            line: true,
        }
    }
}

/// Returns the clocks from the start of a frame to the end of `halves` half bits. Each bit is computed from
/// the start, so errors do not add up.
fn half_bits(halves: u64, hz: u64, baud: u64) -> u64 {
    let clocks = (u128::from(halves) * u128::from(hz)).div_ceil(2 * u128::from(baud.max(1)));
    // At least one clock per half bit, at any rate.
    u64::try_from(clocks).unwrap_or(u64::MAX).max(halves)
}

impl CodUsart {
    /// Returns the level of the sending pin at a clock.
    #[must_use]
    pub fn tx_level(&self, t: u64, hz: u64) -> bool {
        let Some((byte, start)) = self.sending else { return true };
        if t < start {
            return true;
        }
        let bits = (1..=BITS_PER_FRAME)
            .take_while(|bit| start.saturating_add(half_bits(2 * bit, hz, self.txbaud)) <= t)
            .count();
        match bits {
            0 => false,
            1..=8 => byte >> (bits - 1) & 1 == 1,
            _ => true,
        }
    }

    /// Returns the next clock after `t` at which the sending pin may change, or the next byte may begin.
    #[must_use]
    pub fn next_drive(&self, t: u64, hz: u64) -> Option<u64> {
        let (_, start) = self.sending?;
        let times = (0..=BITS_PER_FRAME).map(|bit| start.saturating_add(half_bits(2 * bit, hz, self.txbaud)));
        times.into_iter().enumerate().find(|(bit, at)| *at > t || (*bit == 0 && start > t)).map(|(_, at)| at)
    }

    /// Ends the byte whose stop bit has passed at `t`, and begins the next.
    pub fn advance(&mut self, t: u64, hz: u64) {
        while let Some((_, start)) = self.sending {
            let end = start.saturating_add(half_bits(2 * BITS_PER_FRAME, hz, self.txbaud));
            if end > t {
                return;
            }
            self.sending = self.send_queue.pop_front().map(|byte| (byte, end));
        }
    }

    /// Sends a byte: after the queued bytes, or one bit time from now.
    pub fn send(&mut self, byte: u8, t: u64, hz: u64) {
        if self.sending.is_some() {
            self.send_queue.push_back(byte);
        } else {
            self.sending = Some((byte, t.saturating_add(half_bits(2, hz, self.txbaud))));
        }
    }

    /// Returns the next clock at which the line is sampled.
    #[must_use]
    pub fn next_sample(&self, hz: u64) -> Option<u64> {
        let (start, looked, _) = self.receiving?;
        Some(start.saturating_add(half_bits(2 * looked + 1, hz, self.rxbaud)))
    }

    /// Takes all samples that are due up to `t`; the level of the line is constant until then.
    pub fn sample(&mut self, t: u64, hz: u64) {
        while let (Some(due), Some((start, looked, byte))) = (self.next_sample(hz), self.receiving) {
            if due > t {
                return;
            }
            self.receiving = match looked {
                0 if self.line => None,
                0 => Some((start, 1, 0)),
                1..=8 => Some((start, looked + 1, byte >> 1 | u8::from(self.line) << 7)),
                _ => None,
            };
            if looked == BITS_PER_FRAME - 1 && self.line {
                self.rx = byte;
                if self.echo {
                    self.send(byte, due, hz);
                }
            }
        }
    }

    /// Reports a change of the line at `t`.
    pub fn on_rx_change(&mut self, high: bool, t: u64, hz: u64) {
        // Earlier samples see the old level.
        self.sample(t.saturating_sub(1), hz);
        if high == self.line {
            return;
        }
        self.line = high;
        if !high && self.receiving.is_none() {
            self.receiving = Some((t, 0, 0));
        }
    }

    /// Sets `txbaud`, `rxbaud` or `loop`, or sends a byte or a text with `tx`. Returns false if there is no
    /// such attribute or the value has another type.
    pub fn assign(&mut self, attribute: &str, value: &CodValue, t: u64, hz: u64) -> bool {
        match (attribute, value, value.to_integer()) {
            ("tx", CodValue::Text(text), _) => unescaped(text).into_iter().for_each(|byte| self.send(byte, t, hz)),
            ("tx", _, Some(byte)) => self.send(byte as u8, t, hz),
            ("txbaud", _, Some(baud @ 1..)) => self.txbaud = baud.unsigned_abs(),
            ("rxbaud", _, Some(baud @ 1..)) => self.rxbaud = baud.unsigned_abs(),
            ("loop", _, Some(on)) => self.echo = on != 0,
            // Only affects the display.
            ("console" | "crlf" | "hex", _, Some(_)) => {}
            _ => return false,
        }
        true
    }
}

/// Returns the bytes of a text with the escapes `\r \n \t \\`.
fn unescaped(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut from = text.bytes();
    while let Some(byte) = from.next() {
        let next = if byte == b'\\' { from.next().unwrap_or(b'\\') } else { 0 };
        bytes.push(match next {
            0 => byte,
            b'n' => b'\n',
            b'r' => b'\r',
            b't' => b'\t',
            other => other,
        });
    }
    bytes
}
