//! The checker's own model of the serial line: decodes bytes from the edges at the transmitter's pin, and
//! makes the edges of bytes for the receiver.
//!
//! A frame has eight data bits, no parity and one stop bit, least significant bit first; a bit takes `hz /
//! baud` clocks of the oscillator. All times are clocks since power-up.

use std::collections::VecDeque;

/// Number of bits of a frame: start, data, stop.
pub(crate) const BYTE_BITS: u64 = 10;

/// Maximum error of an edge, in thousandths of the time since the start of the byte (2 %).
const MAX_EDGE_PERMILLE: u64 = 20;

/// The length of a bit, as the fraction `hz / baud` of clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BitTime {
    /// Oscillator frequency in Hz.
    pub hz: u64,
    /// Bits per second.
    pub baud: u64,
}

impl BitTime {
    /// Clocks of `halves` half bits, rounded down.
    pub(crate) fn half_bit_clocks(self, halves: u64) -> u64 {
        (u128::from(halves) * u128::from(self.hz) / (2 * u128::from(self.baud.max(1)))) as u64
    }

    /// Clocks of `bits` bits, rounded down.
    pub(crate) fn bit_clocks(self, bits: u64) -> u64 {
        self.half_bit_clocks(2 * bits)
    }
}

/// A byte that was received from the line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SerialFrame {
    /// Clock at which the start bit began.
    pub start: u64,
    pub byte: u8,
    /// What is wrong with the frame, if anything.
    pub fault: Option<String>,
}

/// A receiver at the transmitter's pin; a clone receives independently.
#[derive(Debug, Clone)]
pub(crate) struct SerialListener {
    bit: BitTime,
    /// Additional tolerance of an edge in clocks: the machine cycle in which it is observed.
    tolerance_clocks: u64,
    high: bool,
    /// The byte being received: its start, the levels sampled so far, and what is wrong with it.
    current_byte: Option<(u64, Vec<bool>, Option<String>)>,
    /// Clock at which the last byte's stop bit ended.
    byte_end: u64,
    frames: VecDeque<SerialFrame>,
}

impl SerialListener {
    /// A receiver of an idle line; `tolerance_clocks` is the additional tolerance of an edge.
    pub(crate) fn new(bit: BitTime, tolerance_clocks: u64) -> SerialListener {
        SerialListener { bit, tolerance_clocks, high: true, current_byte: None, byte_end: 0, frames: VecDeque::new() }
    }

    /// Records that the line changed to `high` at clock `at`.
    pub(crate) fn note_edge(&mut self, at: u64, high: bool) {
        self.advance_to(at);
        if high == self.high {
            return;
        }
        self.high = high;
        match &mut self.current_byte {
            Some((start, _, fault)) => {
                let elapsed = at - *start;
                let bits = (elapsed + self.bit.half_bit_clocks(1)) * self.bit.baud / self.bit.hz.max(1);
                let deviation = elapsed.abs_diff(self.bit.bit_clocks(bits));
                if deviation > elapsed * MAX_EDGE_PERMILLE / 1000 + self.tolerance_clocks && fault.is_none() {
                    *fault = Some(format!("with an edge {deviation} clocks away from bit {bits}"));
                }
            }
            None if !high => {
                let early = at + (self.bit.bit_clocks(BYTE_BITS) * MAX_EDGE_PERMILLE / 1000 + self.tolerance_clocks)
                    < self.byte_end;
                let fault = early.then(|| "that begins before the last one's stop bit is over".to_owned());
                self.current_byte = Some((at, Vec::new(), fault));
            }
            None => {}
        }
    }

    /// Samples the line up to clock `now`; it has not changed until then.
    pub(crate) fn advance_to(&mut self, now: u64) {
        let Some((start, bits, _)) = &mut self.current_byte else { return };
        while (bits.len() as u64) < BYTE_BITS && *start + self.bit.half_bit_clocks(2 * bits.len() as u64 + 1) < now {
            bits.push(self.high);
        }
        if bits.len() as u64 == BYTE_BITS
            && let Some((start, bits, mut fault)) = self.current_byte.take()
        {
            let byte = (0..8).filter(|&n| bits.get(n + 1) == Some(&true)).fold(0, |byte, n| byte | 1 << n);
            if bits.first() == Some(&true) || bits.last() == Some(&false) {
                fault = Some("without a start or stop bit".to_owned());
            }
            self.byte_end = start + self.bit.bit_clocks(BYTE_BITS);
            self.frames.push_back(SerialFrame { start, byte, fault });
        }
    }

    /// Takes the next complete byte.
    pub(crate) fn take_frame(&mut self) -> Option<SerialFrame> {
        self.frames.pop_front()
    }

    /// Clock at which the byte began that is on the line now.
    pub(crate) fn current_start(&self) -> Option<u64> {
        self.current_byte.as_ref().map(|byte| byte.0)
    }
}

/// When to start a byte so that it arrives while the chip waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ByteArrival {
    /// Clock at which the start bit begins.
    pub start: u64,
    /// The scan (from 1) before which the byte has arrived.
    pub scan: u64,
}

/// Quarter bits from the start of a byte until a receiver samples the middle of the stop bit and reports the
/// byte: 37 (9.25 bits) at the earliest, 39 (9.75 bits) at the latest.
const STOP_BIT_SAMPLED: (u64, u64) = (37, 39);

/// Plans a byte that begins after `now` and arrives while the chip waits: finds the first scan, from `next`
/// on, before which it can arrive. Scan n starts at `starts(n)` and ends `scan_clocks` clocks later.
pub(crate) fn plan_arrival(
    bit: BitTime,
    now: u64,
    next: u64,
    scan_clocks: u64,
    starts: impl Fn(u64) -> u64,
) -> Option<ByteArrival> {
    let quarter = |n: u64| bit.half_bit_clocks(n) / 2;
    let (first, last) = (quarter(STOP_BIT_SAMPLED.0), quarter(STOP_BIT_SAMPLED.1));
    let most = next + bit.bit_clocks(BYTE_BITS) / (starts(next + 1) - starts(next)).max(1) + 3;
    (next..=most).find_map(|scan| {
        // The middle of the time between the end of the previous scan and the start of this one.
        let from = (starts(scan - 1) + scan_clocks).checked_sub(first)?;
        let to = starts(scan).checked_sub(last)?;
        (from < to).then_some(())?;
        let start = (from + (to - from) / 2).max(now);
        (start < to).then_some(ByteArrival { start, scan })
    })
}

/// The edges of a byte as (clocks after its start, level). The line is high afterwards.
pub(crate) fn byte_levels(bit: BitTime, byte: u8) -> impl Iterator<Item = (u64, bool)> {
    let level = move |n: u64| match n {
        0 => false,
        1..=8 => byte >> (n - 1) & 1 == 1,
        _ => true,
    };
    (0..BYTE_BITS).filter(move |&n| n == 0 || level(n) != level(n - 1)).map(move |n| (bit.bit_clocks(n), level(n)))
}

/// The timing of a program, to find when a byte may arrive. All times are clocks since power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArrivalWindow {
    /// Oscillator frequency in Hz.
    pub hz: u64,
    /// Bits per second, above 0.
    pub baud: u64,
    /// The earliest clock at which the byte may begin.
    pub now: u64,
    /// Clock at which a scan starts, and its duration in clocks.
    pub scan: (u64, u64),
    /// Clocks from the start of one scan to the start of the next.
    pub period: u64,
    /// The byte arrives before a scan that is at least this many scans after that one; at least 1.
    pub scans_later: u64,
}

/// The edges of a byte that arrives while the chip waits for the next scan; empty if no scan leaves enough
/// time.
#[must_use]
pub fn byte_edges(byte: u8, window: ArrivalWindow) -> Vec<(u64, bool)> {
    let bit = BitTime { hz: window.hz, baud: window.baud.max(1) };
    let starts = |scan: u64| window.scan.0.saturating_add(scan.saturating_mul(window.period.max(1)));
    let arrival = plan_arrival(bit, window.now, window.scans_later.max(1), window.scan.1, starts);
    arrival.map_or(Vec::new(), |at| byte_levels(bit, byte).map(|(after, high)| (at.start + after, high)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIT: BitTime = BitTime { hz: 4_000_000, baud: 9_600 };

    /// Decodes a byte whose speed is `permille` thousandths of the nominal one.
    fn heard(byte: u8, permille: u64) -> SerialFrame {
        let mut listener = SerialListener::new(BIT, 4);
        for (after, high) in byte_levels(BIT, byte) {
            listener.note_edge(1_000 + after * 1000 / permille, high);
        }
        listener.advance_to(20_000);
        listener.take_frame().expect("a byte")
    }

    #[test]
    fn every_byte_is_heard() {
        for byte in 0..=255 {
            assert_eq!(heard(byte, 1000), SerialFrame { start: 1_000, byte, fault: None });
        }
    }

    /// Rows are `permille of the speed | accepted`.
    #[test]
    fn speeds_beyond_two_percent_are_found() {
        for (permille, good) in [(1000, true), (1019, true), (982, true), (1025, false), (976, false), (1100, false)] {
            assert_eq!(heard(0x55, permille).fault.is_none(), good, "{permille}");
            assert_eq!(heard(0x00, permille).fault.is_none(), good, "{permille}");
        }
    }

    #[test]
    fn a_line_that_stays_low_is_no_byte() {
        let mut listener = SerialListener::new(BIT, 4);
        listener.note_edge(1_000, false);
        listener.advance_to(20_000);
        assert!(listener.take_frame().expect("a break").fault.is_some());
    }

    /// Rows are `clocks per scan, clocks busy, first scan before which a byte that begins now can arrive`.
    #[test]
    fn bytes_arrive_while_the_chip_waits() {
        for (period, busy, wanted) in [(40_000, 4_000, Some(1)), (4_000, 400, Some(2)), (1_000, 100, Some(5))] {
            let starts = |scan: u64| scan * period;
            let found = plan_arrival(BIT, busy, 1, busy, starts);
            assert_eq!(found.map(|f| f.scan), wanted, "{period}");
            let Some(ByteArrival { start, scan }) = found else { continue };
            assert!(start >= busy);
            let (middle, detected) = (start + BIT.half_bit_clocks(37) / 2, start + BIT.half_bit_clocks(39) / 2);
            assert!(middle >= starts(scan - 1) + busy && detected < starts(scan), "{period}: {start}");
        }
        // A chip that never waits cannot receive a byte.
        assert_eq!(plan_arrival(BIT, 0, 1, 1_000, |scan| scan * 1_000), None);
    }
}
