//! The intermediate code executed straight from its documents: what a back end's image must do. Peripherals are plain
//! inputs and outputs of a scan.

use emu_core::rng::Rng;
use ladder_compile::ir::{Bit, Compare, Cond, Ir, Logic, Math, Op, Rel, Value, Word};

/// A machine of bits and integers, as after reset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Machine<'a> {
    ir: &'a Ir,
    pub bits: Vec<bool>,
    /// Each within its width, with sign.
    pub words: Vec<i32>,
    /// What the analog inputs give, 0 to 1023.
    pub adc: Vec<u16>,
    /// The duty of the PWM output in percent, once set.
    pub duty: Option<u8>,
    /// What was sent and not yet taken by the test.
    pub sent: Vec<u8>,
    /// The byte that waits.
    pub received: Option<u8>,
    pub eeprom: Vec<u8>,
    acc: bool,
}

impl<'a> Machine<'a> {
    pub fn new(ir: &'a Ir) -> Machine<'a> {
        Machine {
            ir,
            bits: vec![false; ir.bits.len()],
            words: ir.words.iter().map(|cell| keep(cell.initial.into(), cell.bytes)).collect(),
            adc: vec![0; ir.adcs.len()],
            duty: None,
            sent: Vec::new(),
            received: None,
            eeprom: vec![0xFF; ir.eeprom.into()],
            acc: false,
        }
    }

    /// One scan; the inputs are in their bits.
    pub fn scan(&mut self) {
        let ir = self.ir;
        self.ops(&ir.begin);
        for rung in &ir.rungs {
            rung.steps.iter().for_each(|step| self.op(&step.op));
        }
        self.ops(&ir.end);
    }

    pub fn bit(&self, bit: Bit) -> bool {
        self.bits[bit.0 as usize]
    }

    pub fn word(&self, word: Word) -> i32 {
        self.words[word.0 as usize]
    }

    fn put(&mut self, word: Word, value: i64) {
        self.words[word.0 as usize] = keep(value, self.ir.bytes(word));
    }

    fn value(&self, value: Value) -> i64 {
        match value {
            Value::Cell(word) => self.word(word).into(),
            Value::Const(constant) => constant.into(),
        }
    }

    fn compare(&self, compare: &Compare) -> bool {
        let (a, b) = (i64::from(self.word(compare.a)), self.value(compare.b));
        match compare.rel {
            Rel::Eq => a == b,
            Rel::Ne => a != b,
            Rel::Lt => a < b,
            Rel::Ge => a >= b,
        }
    }

    fn ops(&mut self, ops: &[Op]) {
        ops.iter().for_each(|op| self.op(op));
    }

    fn op(&mut self, op: &Op) {
        match op {
            Op::Acc(value) => self.acc = *value,
            Op::Load { bit, negated } => self.acc = self.bit(*bit) ^ negated,
            Op::And { bit, negated } => self.acc &= self.bit(*bit) ^ negated,
            Op::Or { bit, negated } => self.acc |= self.bit(*bit) ^ negated,
            Op::Store { bit, negated } => self.bits[bit.0 as usize] = self.acc ^ negated,
            Op::Put { bit, value } => self.bits[bit.0 as usize] = *value,
            Op::Rising(bit) | Op::Falling(bit) => {
                let (old, new) = (self.bit(*bit), self.acc);
                self.bits[bit.0 as usize] = new;
                self.acc = if matches!(op, Op::Rising(_)) { new && !old } else { !new && old };
            }
            Op::AndCompare(compare) => self.acc &= self.compare(compare),
            Op::Move { dst, src } => self.put(*dst, self.value(*src)),
            Op::Math { op, dst, a, b } => {
                let (x, y) = (self.value(*a), self.value(*b));
                let result = match op {
                    Math::Add => x + y,
                    Math::Sub => x - y,
                    Math::Mul => x.wrapping_mul(y),
                    Math::Div if y == 0 => {
                        if x < 0 {
                            1
                        } else {
                            -1
                        }
                    }
                    Math::Div => keep(x / y, self.ir.width(*op, *dst, *a, *b)).into(),
                };
                self.put(*dst, result);
            }
            Op::Logic { dst, is } => {
                self.bits[dst.0 as usize] = match *is {
                    Logic::Copy(a) => self.bit(a),
                    Logic::Not(a) => !self.bit(a),
                    Logic::And(a, b) => self.bit(a) && self.bit(b),
                    Logic::Or(a, b) => self.bit(a) || self.bit(b),
                };
            }
            Op::Lookup { dst, index, table } => {
                let index = usize::try_from(self.word(*index)).expect("an index in range");
                self.put(*dst, self.ir.tables[*table as usize].values[index].into());
            }
            Op::ReadAdc { dst, input } => self.put(*dst, self.adc[*input as usize].into()),
            Op::SetPwm { duty } => self.duty = Some(self.value(*duty).clamp(0, 100) as u8),
            Op::Send { value } => self.sent.push(self.value(*value) as u8),
            Op::Receive { dst } => {
                let byte = self.received.take();
                self.acc = byte.is_some();
                byte.into_iter().for_each(|byte| self.put(*dst, byte.into()));
            }
            Op::Recall { dst, addr } => {
                let bytes = usize::from(self.ir.bytes(*dst));
                let cells = &self.eeprom[usize::from(*addr)..usize::from(*addr) + bytes];
                let value = cells.iter().rev().fold(0, |value, byte| value << 8 | i64::from(*byte));
                self.put(*dst, value);
            }
            Op::Persist { src, addr, busy, scans } => {
                let bytes = self.word(*src).to_le_bytes();
                let cells = &mut self.eeprom[usize::from(*addr)..][..self.ir.bytes(*src).into()];
                if let Some((cell, byte)) = cells.iter_mut().zip(bytes).find(|(cell, byte)| **cell != *byte) {
                    *cell = byte;
                    self.put(*busy, (*scans).into());
                }
            }
            Op::Module { .. } => panic!("AP101 alone has modules, and its tests ask the evaluator"),
            Op::If { cond, then, otherwise } => {
                let holds = match cond {
                    Cond::Acc => self.acc,
                    Cond::Bit(bit) => self.bit(*bit),
                    Cond::Compare(compare) => self.compare(compare),
                };
                self.ops(if holds { then } else { otherwise });
            }
        }
    }
}

/// The low `bytes` bytes, as a number with sign.
pub fn keep(value: i64, bytes: u8) -> i32 {
    let shift = 64 - 8 * u32::from(bytes);
    (value << shift >> shift) as i32
}

/// A number of `bytes` bytes, most often at a boundary.
pub fn boundary(rng: &mut Rng, bytes: u8) -> i32 {
    let bits = 8 * u32::from(bytes) - 1;
    let (low, high) = (-1i64 << bits, (1i64 << bits) - 1);
    let drawn = match rng.below(8) {
        0 => low + rng.below(3) as i64,
        1 => high - rng.below(3) as i64,
        2 | 3 => rng.below(5) as i64 - 2,
        4 => [100, 255, 256, 127, 128, 1000, -100][rng.below(7) as usize],
        _ => rng.next_u64() as i64 >> rng.below(60),
    };
    keep(drawn, bytes)
}
