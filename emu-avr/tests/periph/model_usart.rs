//! A model of the serial port that steps cycle by cycle and sample by sample, compared with the chip.

use emu_core::parts::uart::FrameEdge;
use std::collections::VecDeque;

use crate::script::chip;
use emu_core::CycleTime;
use emu_core::external_io::OutsideInput;
use emu_core::parts::uart::frame_edges;
use emu_core::rng::Rng;
use emu_core::{Bus, ChipEvent, PinLevel};

const RXD: u16 = 16;
const TXD: u16 = 17;
const UCSR0A: u16 = 0xC0;
const UCSR0B: u16 = 0xC1;
const UBRR0L: u16 = 0xC4;
const UDR0: u16 = 0xC6;

#[derive(Debug, Default)]
struct Model {
    ubrr: u8,
    per_bit: u32,
    /// Down-counter of the baud rate generator, then the transmitter's divider after it.
    down: u8,
    divider: u32,
    tx_on: bool,
    buffer: Option<u8>,
    /// Bits to send, and their number; the first one waits for an edge.
    shift: Option<(u16, u32)>,
    byte: u8,
    txc: bool,
    txd: bool,
    sent: Vec<u8>,
    rx_on: bool,
    /// Number of samples since the start edge; 1 is the first low one, 0 is between frames.
    sample: u32,
    last: bool,
    votes: u32,
    bits: u16,
    fifo: VecDeque<(u8, u8)>,
    waiting: Option<(u8, u8)>,
    lost: bool,
}

#[derive(Debug, Clone, Copy)]
enum Write {
    Baud(u8),
    Control(bool, bool),
    Data(u8),
    ClearTxc,
}

impl Model {
    /// Executes one clock edge; `line` is RXD one cycle before.
    fn edge(&mut self, line: bool, write: Option<Write>) {
        if let Some(Write::ClearTxc) = write {
            self.txc = false;
        }
        if self.down == 0 {
            self.down = self.ubrr;
            self.divider += 1;
            self.receive(line);
            if self.divider.is_multiple_of(self.per_bit) {
                self.send();
            }
        } else {
            self.down -= 1;
        }
        match write {
            Some(Write::Baud(value)) => (self.ubrr, self.down, self.divider) = (value, value, 0),
            Some(Write::Control(rx, tx)) => {
                if rx != self.rx_on {
                    (self.sample, self.last, self.waiting, self.lost) = (0, false, None, false);
                    self.fifo.clear();
                }
                (self.rx_on, self.tx_on) = (rx, tx);
            }
            Some(Write::Data(byte)) if self.buffer.is_none() => self.buffer = Some(byte),
            _ => {}
        }
        if self.tx_on && self.shift.is_none() {
            self.load();
        }
        if !self.tx_on && self.shift.is_none() {
            self.txd = true;
        }
    }

    fn load(&mut self) {
        if let Some(byte) = self.buffer.take() {
            self.byte = byte;
            self.shift = Some((0x200 | u16::from(byte) << 1, 10));
        }
    }

    fn send(&mut self) {
        let Some((bits, left)) = self.shift else { return };
        if left == 0 {
            self.sent.push(self.byte);
            self.shift = None;
            self.load();
            if self.shift.is_none() {
                self.txc = true;
                return;
            }
            return self.send();
        }
        self.txd = bits & 1 == 1;
        self.shift = Some((bits >> 1, left - 1));
    }

    fn receive(&mut self, line: bool) {
        if !self.rx_on {
            return;
        }
        let fell = self.last && !line;
        self.last = line;
        if self.sample == 0 {
            if fell {
                (self.sample, self.votes, self.bits) = (1, 0, 0);
            }
            return;
        }
        self.sample += 1;
        let (bit, place) = ((self.sample - 1) / self.per_bit, (self.sample - 1) % self.per_bit + 1);
        let middle = self.per_bit / 2;
        if place < middle || place > middle + 2 {
            return;
        }
        self.votes += u32::from(line);
        if place < middle + 2 {
            return;
        }
        let high = std::mem::take(&mut self.votes) >= 2;
        match bit {
            0 if high => self.sample = 0,
            0 => {
                if self.waiting.take().is_some() {
                    self.lost = true;
                }
            }
            1..=8 => self.bits |= u16::from(high) << (bit - 1),
            _ => {
                self.sample = 0;
                let errors = u8::from(!high) << 4 | u8::from(std::mem::take(&mut self.lost)) << 3;
                let frame = (self.bits as u8, errors);
                if self.fifo.len() < 2 { self.fifo.push_back(frame) } else { self.waiting = Some(frame) }
            }
        }
    }

    fn read(&mut self) -> Option<u8> {
        let frame = self.fifo.pop_front()?;
        if let Some(next) = self.waiting.take() {
            self.fifo.push_back(next);
        }
        Some(frame.0)
    }

    fn status(&self) -> u8 {
        let errors = self.fifo.front().map_or(0, |frame| 0x80 | frame.1);
        let double = u8::from(self.per_bit == 8) << 1;
        errors | u8::from(self.txc) << 6 | u8::from(self.buffer.is_none()) << 5 | double
    }
}

#[test]
fn random_traffic_agrees_with_a_stepped_port_at_every_cycle() {
    let mut seen = [0u32; 4];
    for seed in 0..40 {
        let mut rng = Rng::new(seed);
        let double = rng.one_in(2);
        let ubrr = rng.below(4) as u8;
        let mut soc = chip();
        soc.set_event_log(true, 0);
        let mut model = Model { per_bit: if double { 8 } else { 16 }, txd: true, ..Model::default() };
        let mut now = 0;
        let mut sent = Vec::new();
        let mut wire = true;
        let mut drives: VecDeque<(u64, PinLevel)> = VecDeque::new();
        let mut line_free = 100;
        let reads = 200 + rng.below(3000);
        soc.write(UCSR0A, u8::from(double) << 1, 0);
        soc.queue_input(CycleTime::at(0), 0, OutsideInput::Level(RXD, PinLevel::High));
        while now < 9_000 {
            while let Some(&(_, level)) = drives.front().filter(|drive| drive.0 <= now) {
                wire = level == PinLevel::High;
                drives.pop_front();
            }
            if rng.one_in(20) {
                soc.fire(now);
            }
            let place = || format!("seed {seed}, cycle {now}, {model:?}");
            assert_eq!(soc.peek(UCSR0A, now), model.status(), "UCSR0A, {}", place());
            soc.fire(now);
            if model.tx_on || model.shift.is_some() {
                assert_eq!(soc.level(TXD), PinLevel::from_bit(model.txd), "TXD, {}", place());
            } else {
                assert_eq!(soc.level(TXD), PinLevel::Float, "TXD, {}", place());
            }
            while let Some(event) = soc.event_log().pop() {
                if let ChipEvent::Sent { byte, at, .. } = event {
                    assert_eq!(at.cycle, now);
                    sent.push(byte);
                }
            }
            assert_eq!(sent, model.sent, "sent, {}", place());
            if now > line_free && rng.one_in(100) {
                // A frame whose bits are up to 3 % off, sometimes with a glitch.
                let bit = u64::from(model.per_bit) * (u64::from(ubrr) + 1);
                let num = bit * (97 + rng.below(7));
                let mut edges: Vec<_> = frame_edges(rng.next_u64() as u8, now + 3, num, 100).collect();
                line_free = now + 3 + bit * 11;
                match rng.below(8) {
                    0 => edges.truncate(1),
                    1 => {
                        edges = vec![
                            FrameEdge { cycle: now + 3, level: PinLevel::Low },
                            FrameEdge { cycle: now + 3 + rng.below(bit), level: PinLevel::High },
                        ]
                    }
                    2 => edges.retain(|edge| edge.cycle < now + 3 + 9 * bit),
                    3 => edges.push(FrameEdge { cycle: line_free, level: PinLevel::High }),
                    _ => {}
                }
                if edges.last().is_some_and(|edge| edge.level == PinLevel::Low) {
                    edges.push(FrameEdge { cycle: line_free + rng.below(bit), level: PinLevel::High });
                    line_free += bit;
                }
                for FrameEdge { cycle: at, level } in edges {
                    soc.queue_input(CycleTime::at(at), now, OutsideInput::Level(RXD, level));
                    drives.push_back((at, level));
                }
            }
            if rng.one_in(reads) && !model.fifo.is_empty() {
                seen[0] += 1;
                seen[1] += u32::from(model.fifo[0].1 & 0x10 != 0);
                seen[2] += u32::from(model.fifo[0].1 & 0x08 != 0);
                let want = model.read();
                assert_eq!(Some(soc.read(UDR0, now).value), want, "UDR0, seed {seed}, cycle {now}");
            }
            let write = match now {
                1 => Some(Write::Baud(ubrr)),
                2 => Some(Write::Control(true, true)),
                _ if rng.one_in(150) => Some(Write::Data(rng.next_u64() as u8)),
                _ if rng.one_in(400) => Some(Write::ClearTxc),
                _ if rng.one_in(2500) => Some(Write::Baud(ubrr)),
                _ if rng.one_in(2000) => Some(Write::Control(rng.one_in(2), rng.one_in(2))),
                _ if rng.one_in(500) => Some(Write::Control(true, true)),
                _ => None,
            };
            match write {
                Some(Write::Baud(value)) => _ = soc.write(UBRR0L, value, now),
                Some(Write::Control(rx, tx)) => _ = soc.write(UCSR0B, u8::from(rx) << 4 | u8::from(tx) << 3, now),
                Some(Write::Data(byte)) => _ = soc.write(UDR0, byte, now),
                Some(Write::ClearTxc) => _ = soc.write(UCSR0A, 0x40 | u8::from(double) << 1, now),
                None => {}
            }
            model.edge(wire, write);
            now += 1;
        }
        seen[3] += sent.len() as u32;
    }
    assert!(seen.iter().all(|&n| n > 10), "too little was seen: bytes read, FE, DOR, sent: {seen:?}");
}
