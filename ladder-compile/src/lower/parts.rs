//! Serial line, strings, converter and EEPROM.

use ladder::format::{Piece, pieces};
use ladder::{CompareOp, Element, Program};

use super::{Lower, add, when};
use crate::ir::{Bit, BitRole, Compare, Cond, Math, Op, Rel, Value, Word, WordRole, bytes_of};

/// Microseconds that a byte takes in the EEPROM, with all that a chip needs besides.
const EEPROM_US: u64 = 10_000;

/// Bits on the line for each byte, times microseconds in a second.
const BYTE_US: u64 = 10_000_000;

/// What says that the transmitter is busy: a bit where a byte is out within one scan, else the scans that it still takes.
#[derive(Debug, Clone, Copy)]
pub(super) enum Busy {
    Bit(Bit),
    Scans(Word, i32),
}

/// The cells of every PERSIST, in text order: address and bytes. They follow each other without gaps.
#[must_use]
pub fn eeprom(program: &Program) -> Vec<(u16, u8)> {
    let symbols = program.symbols();
    let mut next = 0u16;
    let mut cells = Vec::new();
    for (_, element, _) in program.elements() {
        if let Element::Persist { name } = element {
            let bytes = symbols.iter().find(|s| s.name == *name).map_or(2, |s| s.bytes);
            cells.push((next, bytes));
            next = next.saturating_add(bytes.into());
        }
    }
    cells
}

impl Lower<'_> {
    /// What the program uses of the chip, and what goes on by itself from scan to scan.
    pub(super) fn parts(&mut self) {
        let program = self.program;
        let settings = &program.settings;
        let cycle = settings.cycle_us.max(1);
        let mut duties = Vec::new();
        for (_, element, _) in program.elements() {
            if let Element::SetPwm { duty, .. } = element {
                duties.push(self.value(duty));
            }
            match element {
                Element::UartSend { .. } | Element::FormattedString { .. } => self.ir.uart.send = true,
                Element::UartRecv { .. } => self.ir.uart.receive = true,
                Element::SetPwm { hertz: ladder::Operand::Const { value, .. }, .. } => {
                    self.ir.pwm_hz = u32::try_from(*value).ok();
                }
                _ => {}
            }
        }
        if duties.len() > 1 {
            // The output must not follow each of them within one scan: the last one that acts sets it when the rungs are done.
            let width = |duty: &Value| match duty {
                Value::Cell(word) => self.ir.bytes(*word),
                Value::Const(constant) => bytes_of(*constant),
            };
            let bytes = duties.iter().map(width).max().unwrap_or(2);
            let word = self.cell("duty".to_owned(), WordRole::Temporary, bytes, 0);
            let given = self.new_bit("duty given".to_owned(), BitRole::Temporary);
            self.ir.begin.push(Op::Put { bit: given, value: false });
            let set = Op::SetPwm { duty: Value::Cell(word) };
            self.ir.end.push(Op::If { cond: Cond::Bit(given), then: vec![set], otherwise: Vec::new() });
            self.duty = Some((word, given));
        }
        if self.ir.uart.send {
            // The checks have refused a program without a rate, and one without a cycle.
            let bits = settings.baud.unwrap_or(1).max(1).saturating_mul(cycle);
            let scans = i32::try_from(BYTE_US.div_ceil(bits)).unwrap_or(i32::MAX).max(1);
            self.busy = Some(if scans == 1 {
                let bit = self.new_bit("busy".to_owned(), BitRole::Temporary);
                self.ir.begin.push(Op::Put { bit, value: false });
                Busy::Bit(bit)
            } else {
                let word = self.cell("busy".to_owned(), WordRole::Memory, bytes_of(scans), 0);
                self.ir.begin.push(count_down(word));
                Busy::Scans(word, scans)
            });
        }
        if let Some(&(addr, bytes)) = eeprom(program).last() {
            self.ir.eeprom = addr.saturating_add(bytes.into());
            let scans = i32::try_from(EEPROM_US.div_ceil(cycle)).unwrap_or(i32::MAX).max(1);
            let role = if scans == 1 { WordRole::Temporary } else { WordRole::Memory };
            let word = self.cell("writing".to_owned(), role, bytes_of(scans), 0);
            self.ir.begin.push(match scans {
                1 => Op::Move { dst: word, src: Value::Const(0) },
                _ => count_down(word),
            });
            self.writing = Some((word, scans));
        }
    }

    pub(super) fn set_pwm(&mut self, duty: &ladder::Operand) {
        let duty = self.value(duty);
        self.push(when(match self.duty {
            Some((dst, given)) => vec![Op::Move { dst, src: duty }, Op::Put { bit: given, value: true }],
            None => vec![Op::SetPwm { duty }],
        }));
    }

    pub(super) fn read_adc(&mut self, name: &str) {
        let dst = self.word(name);
        let known = self.ir.adcs.iter().position(|other| other == name);
        let input = known.unwrap_or_else(|| {
            self.ir.adcs.push(name.to_owned());
            self.ir.adcs.len() - 1
        });
        self.push(when(vec![Op::ReadAdc { dst, input: input as u32 }]));
    }

    /// `then`, which ends with a byte for the transmitter, where that is free.
    fn transmit(&self, mut then: Vec<Op>) -> Vec<Op> {
        match self.busy {
            Some(Busy::Bit(bit)) => {
                then.push(Op::Put { bit, value: true });
                vec![Op::If { cond: Cond::Bit(bit), then: Vec::new(), otherwise: then }]
            }
            Some(Busy::Scans(word, scans)) => {
                then.push(Op::Move { dst: word, src: Value::Const(scans) });
                vec![Op::If { cond: is_zero(word), then, otherwise: Vec::new() }]
            }
            None => Vec::new(),
        }
    }

    pub(super) fn send(&mut self, name: &str) {
        let value = Value::Cell(self.word(name));
        let ops = self.transmit(vec![Op::Send { value }]);
        self.push(when(ops));
        match self.busy {
            Some(Busy::Bit(bit)) => self.push(Op::Load { bit, negated: false }),
            Some(Busy::Scans(word, _)) => {
                self.push(Op::Acc(true));
                self.push(Op::AndCompare(not_zero(word)));
            }
            None => {}
        }
    }

    /// One character in every scan in which the transmitter is free. `left` counts the characters that are to come, so it is
    /// also the place in a table that holds them from the last to the first.
    pub(super) fn string(&mut self, var: Option<&str>, text: &str, quoted: bool) {
        // The checks have refused what has no pieces.
        let pieces = pieces(text, quoted).unwrap_or_default();
        let count = pieces.len() as i32;
        if pieces.is_empty() {
            return self.push(Op::Acc(false));
        }
        let memory = self.memory();
        let left = self.cell(self.named("left"), WordRole::Memory, bytes_of(count), 0);
        let byte = self.temporary("byte", 1);
        let plain: Vec<i32> =
            pieces.iter().rev().map(|piece| if let Piece::Byte(b) = piece { (*b).into() } else { 32 }).collect();
        let name = self.named("text");
        let table = self.table(name, plain);
        let mut start = vec![Op::Move { dst: left, src: Value::Const(count) }];
        let mut next = vec![add(left, Math::Sub), Op::Lookup { dst: byte, index: left, table }];
        if let Some(var) = var {
            next.extend(self.number(&pieces, (left, byte), var, &mut start));
        }
        next.push(Op::Send { value: Value::Cell(byte) });
        let mut sending = self.transmit(next);
        let more = Op::AndCompare(not_zero(left));
        if let Some(Op::If { then, otherwise, .. }) = sending.first_mut() {
            if otherwise.is_empty() { then } else { otherwise }.push(more.clone());
        }
        self.push(Op::Rising(memory));
        self.push(when(start));
        self.push(Op::Acc(true));
        self.push(more);
        self.push(when(sending));
    }

    /// The places of a number in the text: `byte` becomes their character where it is not the space of the table. Adds to
    /// `start` what a new transmission needs.
    fn number(&mut self, pieces: &[Piece], (left, byte): (Word, Word), var: &str, start: &mut Vec<Op>) -> Vec<Op> {
        let places: Vec<i32> =
            (0..).zip(pieces.iter().rev()).filter(|(_, p)| matches!(p, Piece::Digit { .. })).map(|(n, _)| n).collect();
        let (Some(&last), Some(&first)) = (places.first(), places.last()) else { return Vec::new() };
        let signed = pieces.contains(&Piece::Sign);
        let var = self.word(var);
        let bytes = self.ir.bytes(var);
        let rest =
            if first == last && !signed { var } else { self.cell(self.named("rest"), WordRole::Memory, bytes, 0) };
        let at = |op, place: i32| {
            move |lower: &Self, then, otherwise| {
                lower.where_(op, Value::Cell(left), Value::Const(place), then, otherwise)
            }
        };
        let character = |from: Word| Op::Math { op: Math::Add, dst: byte, a: Value::Cell(from), b: Value::Const(48) };
        let ones = vec![character(rest)];
        let mut digits = ones;
        if first != last {
            let leading = self.new_bit(self.named("leading"), BitRole::Memory);
            start.push(Op::Put { bit: leading, value: true });
            let powers = self.table("powers of ten".to_owned(), vec![10, 100, 1000, 10_000]);
            let (place, power) = (self.temporary("place", bytes_of(first)), self.temporary("power", 2));
            let quotient = self.temporary("quotient", bytes);
            let product = self.temporary("product", bytes);
            let math = |op, dst, a, b| Op::Math { op, dst, a: Value::Cell(a), b };
            let tens = vec![
                math(Math::Sub, place, left, Value::Const(last + 1)),
                Op::Lookup { dst: power, index: place, table: powers },
                math(Math::Div, quotient, rest, Value::Cell(power)),
                math(Math::Mul, product, quotient, Value::Cell(power)),
                math(Math::Sub, rest, rest, Value::Cell(product)),
                Op::If {
                    cond: is_zero(quotient),
                    then: Vec::new(),
                    otherwise: vec![Op::Put { bit: leading, value: false }],
                },
                Op::If { cond: Cond::Bit(leading), then: Vec::new(), otherwise: vec![character(quotient)] },
            ];
            digits = at(CompareOp::Equ, last)(self, digits, tens);
            if !signed {
                let take = Op::Move { dst: rest, src: Value::Cell(var) };
                digits.splice(0..0, at(CompareOp::Equ, first)(self, vec![take], Vec::new()));
            }
        }
        let mut out = digits;
        if last > 0 {
            out = at(CompareOp::Geq, last)(self, out, Vec::new());
        }
        let top = if signed { first + 1 } else { first };
        if signed {
            let minus = Op::Math { op: Math::Sub, dst: rest, a: Value::Const(0), b: Value::Cell(rest) };
            let sign = vec![
                Op::Move { dst: rest, src: Value::Cell(var) },
                Op::If {
                    cond: Cond::Compare(Compare { a: rest, rel: Rel::Lt, b: Value::Const(0) }),
                    then: vec![minus, Op::Move { dst: byte, src: Value::Const(b'-'.into()) }],
                    otherwise: Vec::new(),
                },
            ];
            out = at(CompareOp::Equ, top)(self, sign, out);
        }
        // Characters before the number need none of this.
        if top + 1 < pieces.len() as i32 { at(CompareOp::Leq, top)(self, out, Vec::new()) } else { out }
    }

    pub(super) fn persist(&mut self, name: &str) {
        let src = self.word(name);
        let (Some((addr, _)), Some((busy, scans))) = (self.cells.next(), self.writing) else { return };
        let loaded = self.new_bit(self.named("loaded"), BitRole::Memory);
        let either = Op::If {
            cond: Cond::Bit(loaded),
            then: vec![Op::Persist { src, addr, busy, scans }],
            otherwise: vec![Op::Recall { dst: src, addr }, Op::Put { bit: loaded, value: true }],
        };
        self.push(when(vec![Op::If { cond: is_zero(busy), then: vec![either], otherwise: Vec::new() }]));
    }
}

fn compare_zero(word: Word, rel: Rel) -> Compare {
    Compare { a: word, rel, b: Value::Const(0) }
}

fn is_zero(word: Word) -> Cond {
    Cond::Compare(compare_zero(word, Rel::Eq))
}

fn not_zero(word: Word) -> Compare {
    compare_zero(word, Rel::Ne)
}

/// One less, down to 0.
fn count_down(word: Word) -> Op {
    Op::If { cond: Cond::Compare(not_zero(word)), then: vec![add(word, Math::Sub)], otherwise: Vec::new() }
}
