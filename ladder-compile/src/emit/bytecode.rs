//! Emits byte code for the interpreter in `ladder-compile/interpreter`. `docs/emit.md` describes the format.

use std::collections::BTreeMap;
use std::fmt::Write;

use diag::Diagnostic;
use ladder::LadderProgram;

use super::names::comment_text;
use super::{EmitContext, EmittedSource, lower_and_optimise, refuse_further_pwm};
use crate::ir::{
    ArithmeticOp, BitId, BitRole, BranchCondition, BusAction, ConstantTable, Ir, IrOp, LabelId, LogicOp, RelationOp,
    WordComparison, WordId, WordOperand,
};

/// The source of the interpreter, `plc.c`, in C89. It includes `plc.h`, [`INTERPRETER_HEADER`].
pub const INTERPRETER: &str = include_str!("../../interpreter/plc.c");
/// The header of the interpreter, `plc.h`.
pub const INTERPRETER_HEADER: &str = include_str!("../../interpreter/plc.h");

/// First bytes of an image: a signature and the version of the format.
pub const MAGIC: [u8; 4] = [b'E', b'L', b'B', 1];

/// Operation codes. Those from 80h on contain the number of a bit, 0 to 31.
mod code {
    /// End of a list of operations.
    pub(super) const END: u8 = 0x00;
    /// Makes the accumulator false.
    pub(super) const FALSE: u8 = 0x01;
    /// Makes the accumulator true.
    pub(super) const TRUE: u8 = 0x02;
    /// No operation; never emitted for a valid program.
    pub(super) const NONE: u8 = 0x03;
    /// Loads a bit; plus 1, its complement.
    pub(super) const LOAD: u8 = 0x04;
    /// Combines the accumulator with a bit by AND; plus 1, with its complement.
    pub(super) const AND: u8 = 0x06;
    /// Combines the accumulator with a bit by OR; plus 1, with its complement.
    pub(super) const OR: u8 = 0x08;
    /// Stores the accumulator in a bit; plus 1, its complement.
    pub(super) const STORE: u8 = 0x0A;
    /// Clears a bit; plus 1, sets it.
    pub(super) const CLEAR: u8 = 0x0C;
    /// Makes the accumulator true for one scan when it becomes true.
    pub(super) const RISING: u8 = 0x0E;
    /// Makes the accumulator true for one scan when it becomes false.
    pub(super) const FALLING: u8 = 0x0F;
    /// Computes a word from two values; the operation is added.
    pub(super) const MATH: u8 = 0x10;
    /// Combines the accumulator with a comparison by AND; the comparison is added.
    pub(super) const AND_COMPARE: u8 = 0x20;
    /// Skips bytes unless a comparison is true.
    pub(super) const UNLESS_COMPARE: u8 = 0x28;
    /// Copies a value to a word.
    pub(super) const MOVE: u8 = 0x30;
    /// Skips bytes.
    pub(super) const SKIP: u8 = 0x32;
    /// Skips bytes unless the accumulator is true.
    pub(super) const UNLESS: u8 = 0x33;
    /// Skips bytes unless a bit is 1.
    pub(super) const UNLESS_BIT: u8 = 0x34;
    /// Reads an entry of a table.
    pub(super) const LOOKUP: u8 = 0x35;
    /// Converts an analog input.
    pub(super) const ADC: u8 = 0x36;
    /// Sets a PWM output.
    pub(super) const PWM: u8 = 0x37;
    /// Sends a byte on the serial line.
    pub(super) const SEND: u8 = 0x39;
    /// Receives a byte from the serial line.
    pub(super) const RECEIVE: u8 = 0x3B;
    /// Reads a cell of the EEPROM.
    pub(super) const RECALL: u8 = 0x3C;
    /// Writes a cell of the EEPROM.
    pub(super) const PERSIST: u8 = 0x3D;
    /// Increments a word.
    pub(super) const MORE: u8 = 0x3E;
    /// Decrements a word.
    pub(super) const LESS: u8 = 0x3F;
    /// Combines two values bit by bit; the operation is added.
    pub(super) const BITWISE: u8 = 0x40;
    /// Goes on at a distance from the first operation, in three bytes.
    pub(super) const JUMP: u8 = 0x50;
    /// A transfer on a bus; a number says which, and which operands follow.
    pub(super) const TRANSFER: u8 = 0x51;
    /// Waits until the last byte has gone; a zero follows.
    pub(super) const WAIT_SENT: u8 = 0x52;
    /// AND with one of the bits 0 to 31.
    pub(super) const SHORT_AND: u8 = 0x80;
    /// AND with the complement of one of the bits 0 to 31.
    pub(super) const SHORT_AND_NOT: u8 = 0xA0;
    /// Loads one of the bits 0 to 31.
    pub(super) const SHORT_LOAD: u8 = 0xC0;
    /// Stores the accumulator in one of the bits 0 to 31.
    pub(super) const SHORT_STORE: u8 = 0xE0;
}

/// Emits a program as byte code.
///
/// `EmittedSource::image` holds the bytes; the text has the same bytes as the content of a C initializer.
///
/// # Errors
/// The errors of [`lower_and_optimise`].
pub fn emit(program: &LadderProgram) -> Result<EmittedSource, Vec<Diagnostic>> {
    if let Some(refusal) = refuse_further_pwm(program, "byte code") {
        return Err(vec![refusal]);
    }
    let mut ir = lower_and_optimise(program)?;
    ir.set_bits_in_first_scan();
    Ok(emit_ir(program, &ir))
}

/// Emits intermediate code of `program` as byte code.
#[must_use]
pub fn emit_ir(program: &LadderProgram, ir: &Ir) -> EmittedSource {
    let plan = EmitContext { program, ir };
    let coder = BytecodeWriter::new(ir);
    let mut image = Vec::new();
    let mut text = format!("/* {}, as byte code. */\n", comment_text(&program.file));
    let mut part = |title: &str, bytes: &[u8]| {
        image.extend_from_slice(bytes);
        let _ = write!(text, "/* {title} */");
        for (n, byte) in bytes.iter().enumerate() {
            let _ = write!(text, "{}0x{byte:02X},", if n % 16 == 0 { "\n" } else { " " });
        }
        text.push('\n');
    };
    part("Head", &image_head(&plan));
    part("Widths of the integers", &word_widths(ir));
    let mut tables = Vec::new();
    push_number(&mut tables, coder.tables_len);
    ir.tables.iter().for_each(|data| push_table(&mut tables, data));
    part("Tables", &tables);
    if !ir.prologue.is_empty() {
        part("Begin", &coder.ops(&ir.prologue));
    }
    let texts = plan.texts();
    let mut texts = texts.iter().peekable();
    for (n, rung) in (0..).zip(&ir.rungs) {
        let mut steps = rung.steps.iter().peekable();
        while let Some((id, text)) = texts.next_if(|(id, _)| id.rung == n) {
            let mut bytes = Vec::new();
            while let Some(step) = steps.next_if(|step| step.element.index <= id.index) {
                coder.op(&mut bytes, &step.op);
            }
            part(&format!("{}.{}: {}", n + 1, id.index + 1, comment_text(text)), &bytes);
        }
        let rest: Vec<IrOp> = steps.map(|step| step.op.clone()).collect();
        if !rest.is_empty() {
            part(&format!("{}", n + 1), &coder.ops(&rest));
        }
    }
    let mut end = coder.ops(&ir.epilogue);
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

fn image_head(plan: &EmitContext<'_>) -> Vec<u8> {
    let (ir, settings) = (plan.ir, &plan.program.settings);
    let mut bytes = MAGIC.to_vec();
    let count = |role| plan.bits(role).count() as u64;
    let baud = if ir.uart == Default::default() { 0 } else { settings.baud.unwrap_or(0) };
    for value in [
        settings.cycle_us,
        baud,
        ir.pwms.first().map_or(0, |output| output.hertz).into(),
        ir.eeprom_bytes.into(),
        count(BitRole::Input),
        count(BitRole::Output),
        ir.adcs.len() as u64,
        ir.bits.len() as u64,
        ir.words.len() as u64,
    ] {
        push_number(&mut bytes, value);
    }
    bytes
}

/// Width of each word in one byte, followed by four bytes of the initial value if it is not 0.
fn word_widths(ir: &Ir) -> Vec<u8> {
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

/// Width of a value in bytes, and whether it is signed.
fn value_shape(table: &ConstantTable) -> (usize, bool) {
    let signed = table.bytes != 1 || table.values.iter().all(|&value| value <= 127);
    (usize::from(table.bytes.clamp(1, 4)), signed)
}

fn push_table(bytes: &mut Vec<u8>, table: &ConstantTable) {
    let (width, signed) = value_shape(table);
    bytes.push(width as u8 | if signed { 0x80 } else { 0 });
    table.values.iter().for_each(|value| bytes.extend(&value.to_le_bytes()[..width]));
}

/// Appends an unsigned number: seven bits per byte, lowest first; bit 7 is set if more bytes follow.
fn push_number(bytes: &mut Vec<u8>, mut value: u64) {
    while value > 0x7F {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

/// Encodes operations as byte code.
struct BytecodeWriter {
    /// Number of each bit in the byte code: inputs, then outputs, then the rest.
    bits: Vec<u32>,
    /// Offset of each table from the first one.
    tables: Vec<u64>,
    tables_len: u64,
    /// Distance of each label from the first operation.
    labels: BTreeMap<LabelId, u32>,
}

impl BytecodeWriter {
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
            tables_len += 1 + (value_shape(table).0 * table.values.len()) as u64;
        }
        let mut writer = BytecodeWriter { bits, tables, tables_len, labels: BTreeMap::new() };
        // The length of a jump does not depend on where it goes.
        let steps = ir.rungs.iter().flat_map(|rung| &rung.steps).map(|step| &step.op);
        let (mut labels, mut at) = (BTreeMap::new(), 0);
        for op in ir.prologue.iter().chain(steps) {
            if let IrOp::Label(label) = op {
                labels.insert(*label, at);
            }
            at += writer.ops(std::slice::from_ref(op)).len() as u32;
        }
        writer.labels = labels;
        writer
    }

    fn bit(&self, bit: BitId) -> u32 {
        self.bits.get(bit.0 as usize).copied().unwrap_or(0)
    }

    fn ops(&self, ops: &[IrOp]) -> Vec<u8> {
        let mut bytes = Vec::new();
        ops.iter().for_each(|op| self.op(&mut bytes, op));
        bytes
    }

    fn with_bit(&self, out: &mut Vec<u8>, op: u8, short: Option<u8>, bit: BitId) {
        match (self.bit(bit), short) {
            (n @ 0..32, Some(short)) => out.push(short | n as u8),
            (n, _) => {
                out.push(op);
                push_number(out, n.into());
            }
        }
    }

    fn word(&self, out: &mut Vec<u8>, word: WordId) {
        push_number(out, word.0.into());
    }

    /// Appends an operand: the number of a cell, or a constant c as 2c, and as 2 * !c + 1 if c is negative.
    fn value(&self, out: &mut Vec<u8>, value: WordOperand) {
        match value {
            WordOperand::Cell(word) => self.word(out, word),
            WordOperand::Const(constant) => push_number(out, u64::from(((constant << 1) ^ (constant >> 31)) as u32)),
        }
    }

    fn compare(&self, out: &mut Vec<u8>, op: u8, compare: &WordComparison) {
        let rel = match compare.rel {
            RelationOp::Eq => 0,
            RelationOp::Ne => 1,
            RelationOp::Lt => 2,
            RelationOp::Ge => 3,
        };
        out.push(op | rel << 1 | constant(compare.b));
        self.word(out, compare.a);
        self.value(out, compare.b);
    }

    fn op(&self, out: &mut Vec<u8>, op: &IrOp) {
        match op {
            IrOp::SetAccumulator(value) => out.push(if *value { code::TRUE } else { code::FALSE }),
            IrOp::Load { bit, negated: false } => self.with_bit(out, code::LOAD, Some(code::SHORT_LOAD), *bit),
            IrOp::Load { bit, negated: true } => self.with_bit(out, code::LOAD + 1, None, *bit),
            IrOp::And { bit, negated: false } => self.with_bit(out, code::AND, Some(code::SHORT_AND), *bit),
            IrOp::And { bit, negated: true } => self.with_bit(out, code::AND + 1, Some(code::SHORT_AND_NOT), *bit),
            IrOp::Or { bit, negated } => self.with_bit(out, code::OR + u8::from(*negated), None, *bit),
            IrOp::Store { bit, negated: false } => self.with_bit(out, code::STORE, Some(code::SHORT_STORE), *bit),
            IrOp::Store { bit, negated: true } => self.with_bit(out, code::STORE + 1, None, *bit),
            IrOp::SetBit { bit, value } => self.with_bit(out, code::CLEAR + u8::from(*value), None, *bit),
            IrOp::Rising(bit) => self.with_bit(out, code::RISING, None, *bit),
            IrOp::Falling(bit) => self.with_bit(out, code::FALLING, None, *bit),
            IrOp::AndCompare(compare) => self.compare(out, code::AND_COMPARE, compare),
            IrOp::Move { dst, src } => {
                out.push(code::MOVE | constant(*src));
                self.word(out, *dst);
                self.value(out, *src);
            }
            IrOp::Math { op, dst, a, b } => self.math(out, *op, *dst, *a, *b),
            IrOp::Logic { dst, function: is } => {
                let (first, second) = match *is {
                    LogicOp::Copy(bit) => (IrOp::Load { bit, negated: false }, None),
                    LogicOp::Not(bit) => (IrOp::Load { bit, negated: true }, None),
                    LogicOp::And(a, bit) => {
                        (IrOp::Load { bit: a, negated: false }, Some(IrOp::And { bit, negated: false }))
                    }
                    LogicOp::Or(a, bit) => {
                        (IrOp::Load { bit: a, negated: false }, Some(IrOp::Or { bit, negated: false }))
                    }
                };
                self.op(out, &first);
                second.iter().for_each(|op| self.op(out, op));
                self.op(out, &IrOp::Store { bit: *dst, negated: false });
            }
            IrOp::Lookup { dst, index, table } => {
                out.push(code::LOOKUP);
                self.word(out, *dst);
                self.word(out, *index);
                push_number(out, self.tables.get(*table as usize).copied().unwrap_or(0));
            }
            IrOp::ReadAdc { dst, input } => {
                out.push(code::ADC);
                self.word(out, *dst);
                push_number(out, (*input).into());
            }
            IrOp::SetPwm { duty, .. } => {
                out.push(code::PWM + constant(*duty));
                match *duty {
                    WordOperand::Const(percent) => push_number(out, percent.clamp(0, 100) as u64),
                    WordOperand::Cell(word) => self.word(out, word),
                }
            }
            IrOp::Send { value } => {
                out.push(code::SEND + constant(*value));
                match *value {
                    WordOperand::Const(byte) => push_number(out, (byte & 0xFF) as u64),
                    WordOperand::Cell(word) => self.word(out, word),
                }
            }
            IrOp::WaitSent => out.extend([code::WAIT_SENT, 0]),
            IrOp::Receive { dst } => {
                out.push(code::RECEIVE);
                self.word(out, *dst);
            }
            IrOp::Transfer { action, register, value, dst } => {
                let (kind, device) = match *action {
                    BusAction::I2cWrite(device) => (0, device),
                    BusAction::I2cRead(device) => (1, device),
                    BusAction::Spi => (2, 0),
                };
                let stores = if dst.is_some() { 16 } else { 0 };
                out.extend([code::TRANSFER, kind | constant(*register) << 2 | constant(*value) << 3 | stores, device]);
                self.value(out, *register);
                self.value(out, *value);
                dst.iter().for_each(|dst| self.word(out, *dst));
            }
            IrOp::ReadEeprom { dst, addr } => {
                out.push(code::RECALL);
                self.word(out, *dst);
                push_number(out, (*addr).into());
            }
            IrOp::WriteEeprom { src, addr, busy, scans } => {
                out.push(code::PERSIST);
                self.word(out, *src);
                push_number(out, (*addr).into());
                self.word(out, *busy);
                push_number(out, (*scans).max(0) as u64);
            }
            // Timers and counters stay modules only for chips that have such modules; NONE is not executable.
            IrOp::Module { .. } => out.push(code::NONE),
            IrOp::Label(_) => {}
            IrOp::Jump { to, .. } => {
                let to = self.labels.get(to).copied().unwrap_or(0);
                out.extend([code::JUMP, to as u8 | 0x80, (to >> 7) as u8 | 0x80, (to >> 14) as u8 & 0x7F]);
            }
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                let (mut then, otherwise) = (self.ops(then), self.ops(otherwise));
                if !otherwise.is_empty() {
                    then.push(code::SKIP);
                    push_number(&mut then, otherwise.len() as u64);
                }
                match cond {
                    BranchCondition::Acc => out.push(code::UNLESS),
                    BranchCondition::Bit(bit) => self.with_bit(out, code::UNLESS_BIT, None, *bit),
                    BranchCondition::Compare(compare) => self.compare(out, code::UNLESS_COMPARE, compare),
                }
                push_number(out, then.len() as u64);
                out.extend(then);
                out.extend(otherwise);
            }
        }
    }

    fn math(&self, out: &mut Vec<u8>, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand) {
        match (op, a == WordOperand::Cell(dst), b) {
            (ArithmeticOp::Add, true, WordOperand::Const(1)) => {
                out.push(code::MORE);
                self.word(out, dst);
            }
            (ArithmeticOp::Sub, true, WordOperand::Const(1)) => {
                out.push(code::LESS);
                self.word(out, dst);
            }
            _ => {
                let operation = match op {
                    ArithmeticOp::Add => code::MATH,
                    ArithmeticOp::Sub => code::MATH | 1 << 2,
                    ArithmeticOp::Mul => code::MATH | 2 << 2,
                    ArithmeticOp::Div => code::MATH | 3 << 2,
                    ArithmeticOp::And => code::BITWISE,
                    ArithmeticOp::Or => code::BITWISE | 1 << 2,
                    ArithmeticOp::Xor => code::BITWISE | 2 << 2,
                    ArithmeticOp::Shr => code::BITWISE | 3 << 2,
                };
                out.push(operation | constant(a) << 1 | constant(b));
                self.word(out, dst);
                self.value(out, a);
                self.value(out, b);
            }
        }
    }
}

/// 1 for a constant operand, 0 for a cell.
fn constant(value: WordOperand) -> u8 {
    u8::from(matches!(value, WordOperand::Const(_)))
}
