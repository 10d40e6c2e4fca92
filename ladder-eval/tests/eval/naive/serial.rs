//! The elements of the serial line in the naive interpreter, and the scans that UART_RECV holds: a log of
//! what a scan did is gone through again, without effect, until the element comes.

use super::flow::Departure;
use super::*;

/// What a scan did at an element, or at the start of a rung.
#[derive(Debug, Clone, Copy)]
pub(super) struct LoggedStep {
    pub before: bool,
    pub after: bool,
    pub departure: Option<Departure>,
}

impl NaiveInterpreter {
    /// Executes an element, or goes over it where the held scan has executed it before.
    pub(super) fn logged_leaf(&mut self, element: &Element, power: bool, program: &LadderProgram) -> bool {
        let (rung, index) = self.current_element;
        if let Some(step) = self.replay.pop_front() {
            self.log.push(step);
            if let Element::Flow { op: FlowOp::Gosub, label } = element {
                return self.flow(FlowOp::Gosub, label, step.before, program);
            }
            self.departure = step.departure;
            return step.after;
        }
        let (at, logged) = (self.seen.len(), self.log.len());
        // The held scan goes on at this element, with power.
        let before = power || self.held;
        if self.held {
            self.jumps_back = 0;
        }
        self.log.push(LoggedStep { before, after: false, departure: None });
        let after = self.leaf(element, before, program);
        match element {
            Element::UartRecv { .. } if self.held => self.log.truncate(logged),
            _ => self.log[logged] = LoggedStep { before, after, departure: self.departure },
        }
        if !matches!(element, Element::Comment(_)) {
            self.seen.insert(at, (ElementId { rung, index }, before, after));
        }
        after
    }

    /// Executes an element of the serial line.
    pub(super) fn serial(&mut self, element: &Element, power: bool, program: &LadderProgram) -> bool {
        match element {
            Element::UartSend { name, rest: Some(SerialTransfer { bytes, wait: 1 }) } => {
                self.send_at_once(name, *bytes, (power, program))
            }
            Element::UartSend { name, rest: Some(SerialTransfer { bytes: bytes @ 2.., .. }) } => {
                if power {
                    self.transfers.entry(self.current_element).or_default();
                }
                if self.now >= self.line_free
                    && let Some(mut sent) = self.transfers.remove(&self.current_element)
                {
                    let byte = self.integer(name).div_euclid(1 << (8 * sent.len())).rem_euclid(256) as u8;
                    self.transmit(byte, program);
                    sent.push(byte);
                    if sent.len() < *bytes as usize {
                        self.transfers.insert(self.current_element, sent);
                    }
                }
                self.now < self.line_free
            }
            Element::UartRecv { name, rest: Some(SerialTransfer { bytes: bytes @ 2.., wait: 1 }) } => {
                if !power {
                    return false;
                }
                let come = self.transfers.entry(self.current_element).or_default();
                come.extend(self.received_byte.take());
                let (begun, all) = (!come.is_empty(), come.len() == *bytes as usize);
                self.held = begun && !all;
                if all {
                    let number = (0..).zip(come.drain(..)).map(|(n, byte)| i64::from(byte) << (8 * n)).sum();
                    self.store(name, number);
                } else if begun {
                    self.ends = true;
                    self.departure = Some(Departure::To(program.rungs.len()));
                }
                all
            }
            Element::UartRecv { name, rest: Some(SerialTransfer { bytes: bytes @ 2.., .. }) } => {
                let Some(byte) = self.received_byte.filter(|_| power) else { return false };
                self.received_byte = None;
                let come = self.transfers.entry(self.current_element).or_default();
                come.push(byte);
                let all = come.len() == *bytes as usize;
                if all {
                    let number = (0..).zip(come.drain(..)).map(|(n, byte)| i64::from(byte) << (8 * n)).sum();
                    self.store(name, wrap_to_bits(number, 8 * bytes));
                }
                all
            }
            Element::UartSend { name, .. } => {
                if power && self.now >= self.line_free {
                    self.transmit(self.integer(name).rem_euclid(256) as u8, program);
                }
                self.now < self.line_free
            }
            Element::UartRecv { name, .. } => match (power, self.received_byte) {
                (true, Some(byte)) => {
                    self.received_byte = None;
                    self.store(name, byte.into());
                    true
                }
                _ => false,
            },
            Element::UartRecvAvail => power && self.received_byte.is_some(),
            Element::UartSendReady => power && self.now >= self.line_free,
            // The caller passes only the elements above.
            _ => power,
        }
    }
}
