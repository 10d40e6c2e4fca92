//! Byte code for the interpreter in `examples/bytecode`. `docs/emit.md` has the format.

use std::fmt::Write;

use diag::Diagnostic;
use ladder::Program;

use super::names::comment;
use super::{Plan, Source, lowered};
use crate::ir::{Bit, BitRole, Compare, Cond, Ir, Logic, Math, Op, Rel, Table, Value, Word};

/// The first bytes of an image: a mark, and the version of the format.
pub const MAGIC: [u8; 4] = [b'E', b'L', b'B', 1];

/// Operation codes. Those from 80h carry the number of a bit, 0 to 31.
mod code {
    pub(super) const END: u8 = 0x00;
    pub(super) const FALSE: u8 = 0x01;
    pub(super) const TRUE: u8 = 0x02;
    pub(super) const NONE: u8 = 0x03;
    pub(super) const LOAD: u8 = 0x04;
    pub(super) const AND: u8 = 0x06;
    pub(super) const OR: u8 = 0x08;
    pub(super) const STORE: u8 = 0x0A;
    pub(super) const CLEAR: u8 = 0x0C;
    pub(super) const RISING: u8 = 0x0E;
    pub(super) const FALLING: u8 = 0x0F;
    pub(super) const MATH: u8 = 0x10;
    pub(super) const AND_COMPARE: u8 = 0x20;
    pub(super) const UNLESS_COMPARE: u8 = 0x28;
    pub(super) const MOVE: u8 = 0x30;
    pub(super) const SKIP: u8 = 0x32;
    pub(super) const UNLESS: u8 = 0x33;
    pub(super) const UNLESS_BIT: u8 = 0x34;
    pub(super) const LOOKUP: u8 = 0x35;
    pub(super) const ADC: u8 = 0x36;
    pub(super) const PWM: u8 = 0x37;
    pub(super) const SEND: u8 = 0x39;
    pub(super) const RECEIVE: u8 = 0x3B;
    pub(super) const RECALL: u8 = 0x3C;
    pub(super) const PERSIST: u8 = 0x3D;
    pub(super) const MORE: u8 = 0x3E;
    pub(super) const LESS: u8 = 0x3F;
    pub(super) const SHORT_AND: u8 = 0x80;
    pub(super) const SHORT_AND_NOT: u8 = 0xA0;
    pub(super) const SHORT_LOAD: u8 = 0xC0;
    pub(super) const SHORT_STORE: u8 = 0xE0;
}

/// A program as byte code: `Source::image` holds the bytes, the text is the same bytes as the inside of a C initialiser.
///
/// # Errors
/// As [`lowered`].
pub fn emit(program: &Program) -> Result<Source, Vec<Diagnostic>> {
    Ok(from_ir(program, &lowered(program)?))
}

/// The same of intermediate code that was made of `program`.
#[must_use]
pub fn from_ir(program: &Program, ir: &Ir) -> Source {
    let plan = Plan { program, ir };
    let coder = Coder::new(ir);
    let mut image = Vec::new();
    let mut text = format!("/* {}, as byte code. */\n", comment(&program.file));
    let mut part = |title: &str, bytes: &[u8]| {
        image.extend_from_slice(bytes);
        let _ = write!(text, "/* {title} */");
        for (n, byte) in bytes.iter().enumerate() {
            let _ = write!(text, "{}0x{byte:02X},", if n % 16 == 0 { "\n" } else { " " });
        }
        text.push('\n');
    };
    part("Head", &head(&plan));
    part("Widths of the integers", &widths(ir));
    let mut tables = Vec::new();
    number(&mut tables, coder.tables_len);
    ir.tables.iter().for_each(|data| table(&mut tables, data));
    part("Tables", &tables);
    if !ir.begin.is_empty() {
        part("Begin", &coder.ops(&ir.begin));
    }
    let texts = plan.texts();
    let mut texts = texts.iter().peekable();
    for (n, rung) in (0..).zip(&ir.rungs) {
        let mut steps = rung.steps.iter().peekable();
        while let Some((id, text)) = texts.next_if(|(id, _)| id.rung == n) {
            let mut bytes = Vec::new();
            while let Some(step) = steps.next_if(|step| step.at.index <= id.index) {
                coder.op(&mut bytes, &step.op);
            }
            part(&format!("{}.{}: {}", n + 1, id.index + 1, comment(text)), &bytes);
        }
        let rest: Vec<Op> = steps.map(|step| step.op.clone()).collect();
        if !rest.is_empty() {
            part(&format!("{}", n + 1), &coder.ops(&rest));
        }
    }
    let mut end = coder.ops(&ir.end);
    end.push(code::END);
    part("End", &end);

    let mut source = plan.source(
        text,
        |bit| (coder.bit(bit), format!("bit {}", coder.bit(bit))),
        |word| (word.0, format!("word {}", word.0)),
    );
    source.image = image;
    source
}

fn head(plan: &Plan<'_>) -> Vec<u8> {
    let (ir, settings) = (plan.ir, &plan.program.settings);
    let mut bytes = MAGIC.to_vec();
    let count = |role| plan.bits(role).count() as u64;
    let baud = if ir.uart == Default::default() { 0 } else { settings.baud.unwrap_or(0) };
    for value in [
        settings.cycle_us,
        baud,
        ir.pwm_hz.unwrap_or(0).into(),
        ir.eeprom.into(),
        count(BitRole::Input),
        count(BitRole::Output),
        ir.adcs.len() as u64,
        ir.bits.len() as u64,
        ir.words.len() as u64,
    ] {
        number(&mut bytes, value);
    }
    bytes
}

/// One byte each, and four more where the value after reset is not 0.
fn widths(ir: &Ir) -> Vec<u8> {
    let mut bytes = Vec::new();
    for cell in &ir.words {
        if cell.initial == 0 {
            bytes.push(cell.bytes);
        } else {
            bytes.push(cell.bytes | 0x80);
            bytes.extend(cell.initial.to_le_bytes());
        }
    }
    bytes
}

/// Bytes of one value, and whether they have a sign.
fn shape(table: &Table) -> (usize, bool) {
    let signed = table.bytes != 1 || table.values.iter().all(|&value| value <= 127);
    (usize::from(table.bytes.clamp(1, 4)), signed)
}

fn table(bytes: &mut Vec<u8>, table: &Table) {
    let (width, signed) = shape(table);
    bytes.push(width as u8 | if signed { 0x80 } else { 0 });
    table.values.iter().for_each(|value| bytes.extend(&value.to_le_bytes()[..width]));
}

/// A number without sign: seven bits a byte, the lowest first, bit 7 set where more follow.
fn number(bytes: &mut Vec<u8>, mut value: u64) {
    while value > 0x7F {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

struct Coder {
    /// Numbers of the bits: inputs, outputs, the rest.
    bits: Vec<u32>,
    /// Where each table begins, from the first one.
    tables: Vec<u64>,
    tables_len: u64,
}

impl Coder {
    fn new(ir: &Ir) -> Self {
        let rank = |role| match role {
            BitRole::Input => 0,
            BitRole::Output => 1,
            BitRole::Relay => 2,
            BitRole::Temporary => 3,
            BitRole::Memory => 4,
        };
        let mut order: Vec<usize> = (0..ir.bits.len()).collect();
        order.sort_by_key(|&n| rank(ir.bits[n].role));
        let mut bits = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(&n, number)| bits[n] = number);
        let mut tables_len = 0;
        let mut tables = Vec::new();
        for table in &ir.tables {
            tables.push(tables_len);
            tables_len += 1 + (shape(table).0 * table.values.len()) as u64;
        }
        Coder { bits, tables, tables_len }
    }

    fn bit(&self, bit: Bit) -> u32 {
        self.bits.get(bit.0 as usize).copied().unwrap_or(0)
    }

    fn ops(&self, ops: &[Op]) -> Vec<u8> {
        let mut bytes = Vec::new();
        ops.iter().for_each(|op| self.op(&mut bytes, op));
        bytes
    }

    fn with_bit(&self, out: &mut Vec<u8>, op: u8, short: Option<u8>, bit: Bit) {
        match (self.bit(bit), short) {
            (n @ 0..32, Some(short)) => out.push(short | n as u8),
            (n, _) => {
                out.push(op);
                number(out, n.into());
            }
        }
    }

    fn word(&self, out: &mut Vec<u8>, word: Word) {
        number(out, word.0.into());
    }

    /// A cell by its number; a constant as twice its value, or for a negative one twice its complement and one.
    fn value(&self, out: &mut Vec<u8>, value: Value) {
        match value {
            Value::Cell(word) => self.word(out, word),
            Value::Const(constant) => number(out, u64::from(((constant << 1) ^ (constant >> 31)) as u32)),
        }
    }

    fn compare(&self, out: &mut Vec<u8>, op: u8, compare: &Compare) {
        let rel = match compare.rel {
            Rel::Eq => 0,
            Rel::Ne => 1,
            Rel::Lt => 2,
            Rel::Ge => 3,
        };
        out.push(op | rel << 1 | constant(compare.b));
        self.word(out, compare.a);
        self.value(out, compare.b);
    }

    fn op(&self, out: &mut Vec<u8>, op: &Op) {
        match op {
            Op::Acc(value) => out.push(if *value { code::TRUE } else { code::FALSE }),
            Op::Load { bit, negated: false } => self.with_bit(out, code::LOAD, Some(code::SHORT_LOAD), *bit),
            Op::Load { bit, negated: true } => self.with_bit(out, code::LOAD + 1, None, *bit),
            Op::And { bit, negated: false } => self.with_bit(out, code::AND, Some(code::SHORT_AND), *bit),
            Op::And { bit, negated: true } => self.with_bit(out, code::AND + 1, Some(code::SHORT_AND_NOT), *bit),
            Op::Or { bit, negated } => self.with_bit(out, code::OR + u8::from(*negated), None, *bit),
            Op::Store { bit, negated: false } => self.with_bit(out, code::STORE, Some(code::SHORT_STORE), *bit),
            Op::Store { bit, negated: true } => self.with_bit(out, code::STORE + 1, None, *bit),
            Op::Put { bit, value } => self.with_bit(out, code::CLEAR + u8::from(*value), None, *bit),
            Op::Rising(bit) => self.with_bit(out, code::RISING, None, *bit),
            Op::Falling(bit) => self.with_bit(out, code::FALLING, None, *bit),
            Op::AndCompare(compare) => self.compare(out, code::AND_COMPARE, compare),
            Op::Move { dst, src } => {
                out.push(code::MOVE | constant(*src));
                self.word(out, *dst);
                self.value(out, *src);
            }
            Op::Math { op, dst, a, b } => self.math(out, *op, *dst, *a, *b),
            Op::Logic { dst, is } => {
                let (first, second) = match *is {
                    Logic::Copy(bit) => (Op::Load { bit, negated: false }, None),
                    Logic::Not(bit) => (Op::Load { bit, negated: true }, None),
                    Logic::And(a, bit) => (Op::Load { bit: a, negated: false }, Some(Op::And { bit, negated: false })),
                    Logic::Or(a, bit) => (Op::Load { bit: a, negated: false }, Some(Op::Or { bit, negated: false })),
                };
                self.op(out, &first);
                second.iter().for_each(|op| self.op(out, op));
                self.op(out, &Op::Store { bit: *dst, negated: false });
            }
            Op::Lookup { dst, index, table } => {
                out.push(code::LOOKUP);
                self.word(out, *dst);
                self.word(out, *index);
                number(out, self.tables.get(*table as usize).copied().unwrap_or(0));
            }
            Op::ReadAdc { dst, input } => {
                out.push(code::ADC);
                self.word(out, *dst);
                number(out, (*input).into());
            }
            Op::SetPwm { duty } => {
                out.push(code::PWM + constant(*duty));
                match *duty {
                    Value::Const(percent) => number(out, percent.clamp(0, 100) as u64),
                    Value::Cell(word) => self.word(out, word),
                }
            }
            Op::Send { value } => {
                out.push(code::SEND + constant(*value));
                match *value {
                    Value::Const(byte) => number(out, (byte & 0xFF) as u64),
                    Value::Cell(word) => self.word(out, word),
                }
            }
            Op::Receive { dst } => {
                out.push(code::RECEIVE);
                self.word(out, *dst);
            }
            Op::Recall { dst, addr } => {
                out.push(code::RECALL);
                self.word(out, *dst);
                number(out, (*addr).into());
            }
            Op::Persist { src, addr, busy, scans } => {
                out.push(code::PERSIST);
                self.word(out, *src);
                number(out, (*addr).into());
                self.word(out, *busy);
                number(out, (*scans).max(0) as u64);
            }
            // Timers and counters stay whole for chips that have them, never for a source; this code is none.
            Op::Module { .. } => out.push(code::NONE),
            Op::If { cond, then, otherwise } => {
                let (mut then, otherwise) = (self.ops(then), self.ops(otherwise));
                if !otherwise.is_empty() {
                    then.push(code::SKIP);
                    number(&mut then, otherwise.len() as u64);
                }
                match cond {
                    Cond::Acc => out.push(code::UNLESS),
                    Cond::Bit(bit) => self.with_bit(out, code::UNLESS_BIT, None, *bit),
                    Cond::Compare(compare) => self.compare(out, code::UNLESS_COMPARE, compare),
                }
                number(out, then.len() as u64);
                out.extend(then);
                out.extend(otherwise);
            }
        }
    }

    fn math(&self, out: &mut Vec<u8>, op: Math, dst: Word, a: Value, b: Value) {
        match (op, a == Value::Cell(dst), b) {
            (Math::Add, true, Value::Const(1)) => {
                out.push(code::MORE);
                self.word(out, dst);
            }
            (Math::Sub, true, Value::Const(1)) => {
                out.push(code::LESS);
                self.word(out, dst);
            }
            _ => {
                let number = match op {
                    Math::Add => 0,
                    Math::Sub => 1,
                    Math::Mul => 2,
                    Math::Div => 3,
                };
                out.push(code::MATH | number << 2 | constant(a) << 1 | constant(b));
                self.word(out, dst);
                self.value(out, a);
                self.value(out, b);
            }
        }
    }
}

/// 1 for a constant.
fn constant(value: Value) -> u8 {
    u8::from(matches!(value, Value::Const(_)))
}
