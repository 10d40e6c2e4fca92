//! Interpreter of the intermediate code, written from its documentation: what an image must do.
//!
//! Peripherals are simple inputs and outputs of a scan.

use std::collections::BTreeMap;

use emu_core::rng::Rng;
use ladder_compile::ir::{
    ArithmeticOp, BitId, BranchCondition, Ir, IrOp, LabelId, LogicOp, RelationOp, WordComparison, WordId, WordOperand,
};

/// State of bits, integers and peripherals; new ones are as after reset.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IrInterpreter<'a> {
    ir: &'a Ir,
    pub bits: Vec<bool>,
    /// Values as signed numbers within their widths.
    pub words: Vec<i32>,
    /// Values of the analog inputs, 0 to 1023.
    pub adc: Vec<u16>,
    /// Duty cycle of the PWM output in percent; `None` before it is set.
    pub duties: BTreeMap<u32, u8>,
    /// Bytes sent and not yet taken by the test.
    pub sent: Vec<u8>,
    /// Byte that waits in the receiver.
    pub received: Option<u8>,
    pub eeprom: Vec<u8>,
    acc: bool,
    /// Where the last operation went.
    jump: Option<LabelId>,
}

impl<'a> IrInterpreter<'a> {
    pub fn new(ir: &'a Ir) -> IrInterpreter<'a> {
        IrInterpreter {
            ir,
            bits: vec![false; ir.bits.len()],
            words: ir.words.iter().map(|cell| truncate_to_bytes(cell.initial.into(), cell.bytes)).collect(),
            adc: vec![0; ir.adcs.len()],
            duties: BTreeMap::new(),
            sent: Vec::new(),
            received: None,
            eeprom: vec![0xFF; ir.eeprom_bytes.into()],
            acc: false,
            jump: None,
        }
    }

    /// Runs one scan; the inputs are already in their bits.
    pub fn scan(&mut self) {
        let ir = self.ir;
        let steps = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
        let all: Vec<&IrOp> = ir.prologue.iter().chain(steps).chain(&ir.epilogue).collect();
        let mut at = 0;
        while let Some(op) = all.get(at) {
            self.op(op);
            at = match self.jump.take() {
                Some(to) => all.iter().position(|op| **op == IrOp::Label(to)).expect("the label of a jump"),
                None => at + 1,
            };
        }
    }

    pub fn bit(&self, bit: BitId) -> bool {
        self.bits[bit.0 as usize]
    }

    pub fn word(&self, word: WordId) -> i32 {
        self.words[word.0 as usize]
    }

    fn put(&mut self, word: WordId, value: i64) {
        self.words[word.0 as usize] = truncate_to_bytes(value, self.ir.bytes(word));
    }

    fn value(&self, value: WordOperand) -> i64 {
        match value {
            WordOperand::Cell(word) => self.word(word).into(),
            WordOperand::Const(constant) => constant.into(),
        }
    }

    fn compare(&self, compare: &WordComparison) -> bool {
        let (a, b) = (i64::from(self.word(compare.a)), self.value(compare.b));
        match compare.rel {
            RelationOp::Eq => a == b,
            RelationOp::Ne => a != b,
            RelationOp::Lt => a < b,
            RelationOp::Ge => a >= b,
        }
    }

    fn ops(&mut self, ops: &[IrOp]) {
        for op in ops {
            self.op(op);
            if self.jump.is_some() {
                return;
            }
        }
    }

    fn op(&mut self, op: &IrOp) {
        match op {
            IrOp::SetAccumulator(value) => self.acc = *value,
            IrOp::Load { bit, negated } => self.acc = self.bit(*bit) ^ negated,
            IrOp::And { bit, negated } => self.acc &= self.bit(*bit) ^ negated,
            IrOp::Or { bit, negated } => self.acc |= self.bit(*bit) ^ negated,
            IrOp::Store { bit, negated } => self.bits[bit.0 as usize] = self.acc ^ negated,
            IrOp::SetBit { bit, value } => self.bits[bit.0 as usize] = *value,
            IrOp::Rising(bit) | IrOp::Falling(bit) => {
                let (old, new) = (self.bit(*bit), self.acc);
                self.bits[bit.0 as usize] = new;
                self.acc = if matches!(op, IrOp::Rising(_)) { new && !old } else { !new && old };
            }
            IrOp::AndCompare(compare) => self.acc &= self.compare(compare),
            IrOp::Move { dst, src } => self.put(*dst, self.value(*src)),
            IrOp::Math { op, dst, a, b } => {
                let (x, y) = (self.value(*a), self.value(*b));
                let result = match op {
                    ArithmeticOp::Add => x + y,
                    ArithmeticOp::Sub => x - y,
                    ArithmeticOp::Mul => x.wrapping_mul(y),
                    ArithmeticOp::Div if y == 0 => {
                        if x < 0 {
                            1
                        } else {
                            -1
                        }
                    }
                    ArithmeticOp::Div => truncate_to_bytes(x / y, self.ir.width(*op, *dst, *a, *b)).into(),
                    ArithmeticOp::And => x & y,
                    ArithmeticOp::Or => x | y,
                    ArithmeticOp::Xor => x ^ y,
                    ArithmeticOp::Shr => (x & ((1 << (8 * self.ir.bytes(*dst))) - 1)) >> y.clamp(0, 63),
                };
                self.put(*dst, result);
            }
            IrOp::Logic { dst, function: is } => {
                self.bits[dst.0 as usize] = match *is {
                    LogicOp::Copy(a) => self.bit(a),
                    LogicOp::Not(a) => !self.bit(a),
                    LogicOp::And(a, b) => self.bit(a) && self.bit(b),
                    LogicOp::Or(a, b) => self.bit(a) || self.bit(b),
                };
            }
            IrOp::Lookup { dst, index, table } => {
                let index = usize::try_from(self.word(*index)).expect("an index in range");
                self.put(*dst, self.ir.tables[*table as usize].values[index].into());
            }
            IrOp::ReadAdc { dst, input } => self.put(*dst, self.adc[*input as usize].into()),
            IrOp::SetPwm { output, duty } => {
                let duty = self.value(*duty).clamp(0, 100) as u8;
                self.duties.insert(*output, duty);
            }
            IrOp::Send { value } => self.sent.push(self.value(*value) as u8),
            IrOp::WaitSent => {}
            IrOp::Receive { dst } => {
                let byte = self.received.take();
                self.acc = byte.is_some();
                byte.into_iter().for_each(|byte| self.put(*dst, byte.into()));
            }
            IrOp::Transfer { dst, .. } => {
                // No device is on the buses, so a read gives all ones.
                if let Some(dst) = dst {
                    self.put(*dst, 0xFF);
                }
            }
            IrOp::ReadEeprom { dst, addr } => {
                let bytes = usize::from(self.ir.bytes(*dst));
                let cells = &self.eeprom[usize::from(*addr)..usize::from(*addr) + bytes];
                let value = cells.iter().rev().fold(0, |value, byte| value << 8 | i64::from(*byte));
                self.put(*dst, value);
            }
            IrOp::WriteEeprom { src, addr, busy, scans } => {
                let bytes = self.word(*src).to_le_bytes();
                let cells = &mut self.eeprom[usize::from(*addr)..][..self.ir.bytes(*src).into()];
                if let Some((cell, byte)) = cells.iter_mut().zip(bytes).find(|(cell, byte)| **cell != *byte) {
                    *cell = byte;
                    self.put(*busy, (*scans).into());
                }
            }
            IrOp::Module { .. } => panic!("AP101 alone has modules, and its tests ask the evaluator"),
            // What follows must set the accumulator.
            IrOp::Label(_) => self.acc = !self.acc,
            IrOp::Jump { to, .. } => self.jump = Some(*to),
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                let holds = match cond {
                    BranchCondition::Acc => self.acc,
                    BranchCondition::Bit(bit) => self.bit(*bit),
                    BranchCondition::Compare(compare) => self.compare(compare),
                };
                self.ops(if holds { then } else { otherwise });
            }
        }
    }
}

/// The low `bytes` bytes, as a signed number.
pub fn truncate_to_bytes(value: i64, bytes: u8) -> i32 {
    let shift = 64 - 8 * u32::from(bytes);
    (value << shift >> shift) as i32
}

/// A random number of `bytes` bytes, usually at a boundary.
pub fn boundary_value(rng: &mut Rng, bytes: u8) -> i32 {
    let bits = 8 * u32::from(bytes) - 1;
    let (low, high) = (-1i64 << bits, (1i64 << bits) - 1);
    let drawn = match rng.below(8) {
        0 => low + rng.below(3) as i64,
        1 => high - rng.below(3) as i64,
        2 | 3 => rng.below(5) as i64 - 2,
        4 => [100, 255, 256, 127, 128, 1000, -100][rng.below(7) as usize],
        _ => rng.next_u64() as i64 >> rng.below(60),
    };
    truncate_to_bytes(drawn, bytes)
}
