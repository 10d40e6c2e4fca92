//! Complete programs: interfaces on one bus with the software of section 22.7.

use emu_avr::periph::twi::{AvrTwi, TWEA, TWEN, TWIE, TWINT, TWSTA, TWSTO, TwiRegister};
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal, Device};

/// An interface with its program.
struct Node {
    part: AvrTwi,
    out: Vec<AvrSignal>,
    pulls: [bool; 2],
    /// Bytes that it sends as a master, address first; then the number of bytes that it reads if the address
    /// is for reading.
    message: Vec<u8>,
    asks: usize,
    /// Byte that it sends as a slave.
    answer: u8,
    done: bool,
    got: Vec<u8>,
    seen: Vec<u8>,
}

impl Node {
    fn new(address: u8, rate: u8) -> Node {
        let mut node = Node {
            part: AvrTwi::new(),
            out: Vec::new(),
            pulls: [false; 2],
            message: Vec::new(),
            asks: 0,
            answer: 0,
            done: false,
            got: Vec::new(),
            seen: Vec::new(),
        };
        node.write(TwiRegister::TWAR, address << 1, 0);
        node.write(TwiRegister::TWBR, rate, 0);
        node.write(TwiRegister::TWCR, TWEN | TWEA | TWIE, 0);
        node
    }

    fn write(&mut self, reg: TwiRegister, value: u8, t: u64) {
        self.part.write(reg, value, 0xFF, t, &mut self.out);
    }

    fn sends(mut self, message: &[u8], asks: usize) -> Node {
        self.message = message.to_vec();
        self.asks = asks;
        self.write(TwiRegister::TWCR, TWINT | TWSTA | TWEN | TWEA | TWIE, 10);
        self
    }

    /// The program of the interrupt.
    fn serve(&mut self, t: u64) {
        let status = self.part.peek(TwiRegister::TWSR, t);
        self.seen.push(status);
        let mut go = TWINT | TWEN | TWIE | TWEA;
        let sent = self.seen.iter().rev().take_while(|&&status| !matches!(status, 0x08 | 0x10)).count();
        match status {
            0x08 | 0x10 => self.write(TwiRegister::TWDR, self.message[0], t),
            0x18 | 0x28 if sent < self.message.len() => self.write(TwiRegister::TWDR, self.message[sent], t),
            0x18 | 0x20 | 0x28 | 0x30 | 0x48 | 0x58 => {
                if status == 0x58 {
                    self.got.push(self.part.peek(TwiRegister::TWDR, t));
                }
                go |= TWSTO;
                self.done = true;
            }
            0x40 | 0x50 => {
                if status == 0x50 {
                    self.got.push(self.part.peek(TwiRegister::TWDR, t));
                }
                if self.got.len() + 1 >= self.asks {
                    go &= !TWEA;
                }
            }
            0x38 | 0x68 | 0x78 | 0xB0 => go |= TWSTA,
            0x80 | 0x90 => self.got.push(self.part.peek(TwiRegister::TWDR, t)),
            _ => {}
        }
        if matches!(status, 0xA8 | 0xB0 | 0xB8) {
            self.write(TwiRegister::TWDR, self.answer, t);
            self.answer = self.answer.wrapping_add(1);
        }
        // A START that waits for the bus stays requested.
        if !self.done && !self.message.is_empty() && status >= 0x60 {
            go |= TWSTA;
        }
        self.write(TwiRegister::TWCR, go, t);
    }
}

fn settle(nodes: &mut [Node], wires: &mut [bool; 2], t: u64) {
    loop {
        for node in nodes.iter_mut() {
            for signal in std::mem::take(&mut node.out) {
                if let AvrSignal::Drive { line, drive, .. } = signal {
                    node.pulls[usize::from(line == AvrLine::Sda)] = drive == AvrDrive::Output(false);
                }
            }
        }
        let mut same = true;
        for (n, line) in [AvrLine::Scl, AvrLine::Sda].into_iter().enumerate() {
            let high = !nodes.iter().any(|node| node.pulls[n]);
            if std::mem::replace(&mut wires[n], high) != high {
                same = false;
                nodes.iter_mut().for_each(|node| node.part.on_line_changed(line, high, t, &mut node.out));
            }
        }
        if same {
            return;
        }
    }
}

/// Runs until all masters are done and the bus is idle. Each program responds after `delay` cycles and a few
/// more.
fn run(mut nodes: Vec<Node>, delay: u64) -> Vec<Node> {
    let mut wires = [false; 2];
    settle(&mut nodes, &mut wires, 10);
    let mut answers: Vec<Option<u64>> = vec![None; nodes.len()];
    let mut t = 10;
    while t < 1_000_000 {
        let next = nodes.iter().map(|node| node.part.next_deadline()).chain(answers.iter().flatten().copied()).min();
        let Some(next) = next.filter(|&next| next < 1_000_000) else { break };
        t = next;
        for (n, (node, answer)) in nodes.iter_mut().zip(&mut answers).enumerate() {
            node.part.run_due(t, &mut node.out);
            if answer.take_if(|at| *at <= t).is_some() {
                node.serve(t);
            } else if node.part.interrupt_requests() != 0 && answer.is_none() {
                *answer = Some(t + delay + 3 * n as u64 + 1);
            }
        }
        settle(&mut nodes, &mut wires, t);
    }
    assert!(nodes.iter().all(|node| node.done || node.message.is_empty()), "a master has not come to an end");
    nodes
}

#[test]
fn a_master_writes_to_a_slave() {
    for (rate, delay) in [(0, 1), (0, 40), (12, 5), (72, 100)] {
        let nodes = run(vec![Node::new(1, rate).sends(&[0x40, 1, 2, 0xFF], 0), Node::new(0x20, 0)], delay);
        assert_eq!(nodes[0].seen, [0x08, 0x18, 0x28, 0x28, 0x28]);
        assert_eq!(nodes[1].seen, [0x60, 0x80, 0x80, 0x80, 0xA0]);
        assert_eq!(nodes[1].got, [1, 2, 0xFF]);
    }
}

#[test]
fn a_master_reads_from_a_slave() {
    for (rate, delay) in [(0, 1), (0, 40), (12, 5), (72, 100)] {
        let mut slave = Node::new(0x20, 0);
        slave.answer = 0x7F;
        let nodes = run(vec![Node::new(1, rate).sends(&[0x41], 3), slave], delay);
        assert_eq!(nodes[0].seen, [0x08, 0x40, 0x50, 0x50, 0x58]);
        assert_eq!(nodes[1].seen, [0xA8, 0xB8, 0xB8, 0xC0]);
        assert_eq!(nodes[0].got, [0x7F, 0x80, 0x81]);
    }
}

#[test]
fn nobody_answers() {
    let nodes = run(vec![Node::new(1, 3).sends(&[0x42, 1], 0), Node::new(0x20, 0)], 5);
    assert_eq!((&nodes[0].seen[..], &nodes[1].seen[..]), (&[0x08, 0x20][..], &[][..]));
}

#[test]
fn two_masters_start_at_once_and_both_get_through() {
    // The lower address wins; the other master starts again after the STOP.
    let masters = || vec![Node::new(1, 3).sends(&[0x40, 5], 0), Node::new(2, 3).sends(&[0x44, 6], 0)];
    let mut nodes = masters();
    nodes.extend([Node::new(0x20, 0), Node::new(0x22, 0)]);
    let nodes = run(nodes, 7);
    assert_eq!(nodes[0].seen, [0x08, 0x18, 0x28]);
    assert_eq!(nodes[1].seen, [0x08, 0x38, 0x08, 0x18, 0x28]);
    assert_eq!((&nodes[2].got[..], &nodes[3].got[..]), (&[5][..], &[6][..]));
}

#[test]
fn a_master_that_loses_is_the_slave_that_is_called() {
    let nodes = vec![Node::new(1, 3).sends(&[0x04, 9], 0), Node::new(2, 3).sends(&[0x44, 6], 0), Node::new(0x22, 0)];
    let nodes = run(nodes, 7);
    assert_eq!(nodes[0].seen, [0x08, 0x18, 0x28]);
    assert_eq!(nodes[1].seen, [0x08, 0x68, 0x80, 0xA0, 0x08, 0x18, 0x28]);
    assert_eq!((&nodes[1].got[..], &nodes[2].got[..]), (&[9][..], &[6][..]));
}

#[test]
fn the_same_address_and_other_data() {
    let nodes = vec![Node::new(1, 3).sends(&[0x40, 7], 0), Node::new(2, 3).sends(&[0x40, 3], 0), Node::new(0x20, 0)];
    let nodes = run(nodes, 7);
    assert_eq!(nodes[1].seen, [0x08, 0x18, 0x28]);
    assert_eq!(nodes[0].seen, [0x08, 0x18, 0x38, 0x08, 0x18, 0x28]);
    assert_eq!(nodes[2].got, [3, 7]);
}
