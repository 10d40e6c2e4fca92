//! Intermediate code as text, for listings and messages.

use std::fmt;

use crate::ir::{
    BitId, BranchCondition, BusAction, Ir, IrOp, JumpKind, LogicOp, RelationOp, WordComparison, WordId, WordOperand,
};

impl Ir {
    fn bit(&self, bit: BitId, negated: bool) -> String {
        let name = self.bits.get(bit.0 as usize).map_or("?", |cell| &cell.name);
        format!("{}{name}", if negated { "!" } else { "" })
    }

    fn word(&self, word: WordId) -> &str {
        self.words.get(word.0 as usize).map_or("?", |cell| &cell.name)
    }

    fn value(&self, value: WordOperand) -> String {
        match value {
            WordOperand::Cell(word) => self.word(word).to_owned(),
            WordOperand::Const(constant) => constant.to_string(),
        }
    }

    fn compare(&self, c: &WordComparison) -> String {
        let rel = match c.rel {
            RelationOp::Eq => "==",
            RelationOp::Ne => "!=",
            RelationOp::Lt => "<",
            RelationOp::Ge => ">=",
        };
        format!("{} {rel} {}", self.word(c.a), self.value(c.b))
    }

    /// Formats an operation as text; an [`IrOp::If`] gives several lines, with the inner ones indented.
    #[must_use]
    pub fn op_text(&self, op: &IrOp) -> String {
        match op {
            IrOp::SetAccumulator(value) => format!("acc {}", u8::from(*value)),
            IrOp::Load { bit, negated } => format!("load {}", self.bit(*bit, *negated)),
            IrOp::And { bit, negated } => format!("and {}", self.bit(*bit, *negated)),
            IrOp::Or { bit, negated } => format!("or {}", self.bit(*bit, *negated)),
            IrOp::Store { bit, negated } => format!("store {}", self.bit(*bit, *negated)),
            IrOp::SetBit { bit, value } => format!("put {} {}", self.bit(*bit, false), u8::from(*value)),
            IrOp::Rising(bit) => format!("rising {}", self.bit(*bit, false)),
            IrOp::Falling(bit) => format!("falling {}", self.bit(*bit, false)),
            IrOp::AndCompare(compare) => format!("and {}", self.compare(compare)),
            IrOp::Move { dst, src } => format!("{} := {}", self.word(*dst), self.value(*src)),
            IrOp::Math { op, dst, a, b } => {
                format!("{} := {} {} {}", self.word(*dst), self.value(*a), op.sign(), self.value(*b))
            }
            IrOp::Logic { dst, function: is } => {
                let bit = |bit: &BitId| self.bit(*bit, false);
                let is = match is {
                    LogicOp::Copy(a) => bit(a),
                    LogicOp::Not(a) => format!("not {}", bit(a)),
                    LogicOp::And(a, b) => format!("{} and {}", bit(a), bit(b)),
                    LogicOp::Or(a, b) => format!("{} or {}", bit(a), bit(b)),
                };
                format!("{} := {is}", bit(dst))
            }
            IrOp::Lookup { dst, index, table } => {
                let name = self.tables.get(*table as usize).map_or("?", |table| &table.name);
                format!("{} := {name}[{}]", self.word(*dst), self.word(*index))
            }
            IrOp::ReadAdc { dst, input } => {
                let name = self.adcs.get(*input as usize).map_or("?", String::as_str);
                format!("{} := adc {name}", self.word(*dst))
            }
            IrOp::SetPwm { output: 0, duty } => format!("pwm {}", self.value(*duty)),
            IrOp::SetPwm { output, duty } => format!("pwm{output} {}", self.value(*duty)),
            IrOp::Send { value } => format!("send {}", self.value(*value)),
            IrOp::WaitSent => "wait until sent".to_owned(),
            IrOp::Receive { dst } => format!("receive {}", self.word(*dst)),
            IrOp::Transfer { action, register, value, dst } => {
                let to = dst.map_or_else(String::new, |dst| format!("{} := ", self.word(dst)));
                match action {
                    BusAction::I2cWrite(device) => {
                        format!("i2c {device} {} := {}", self.value(*register), self.value(*value))
                    }
                    BusAction::I2cRead(device) => format!("{to}i2c {device} {}", self.value(*register)),
                    BusAction::Spi => format!("{to}spi {}", self.value(*value)),
                }
            }
            IrOp::ReadEeprom { dst, addr } => format!("{} := eeprom {addr}", self.word(*dst)),
            IrOp::WriteEeprom { src, addr, busy, scans } => {
                format!("eeprom {addr} := {}, {} := {scans}", self.word(*src), self.word(*busy))
            }
            IrOp::Module { module: is, word, limit } => format!("{is} {}, {}", self.word(*word), self.value(*limit)),
            IrOp::Label(label) => format!("label {}", label.0),
            IrOp::Jump { to, kind } => {
                let verb = match kind {
                    JumpKind::Forward | JumpKind::Back => "jump",
                    JumpKind::Call { .. } => "call",
                    JumpKind::Return => "return",
                };
                format!("{verb} {}", to.0)
            }
            IrOp::If { cond, if_true: then, if_false: otherwise } => {
                let cond = match cond {
                    BranchCondition::Acc => "acc".to_owned(),
                    BranchCondition::Bit(bit) => self.bit(*bit, false),
                    BranchCondition::Compare(compare) => self.compare(compare),
                };
                let block = |ops: &[IrOp]| -> String {
                    ops.iter()
                        .flat_map(|op| self.op_text(op).lines().map(|l| format!("  {l}\n")).collect::<Vec<_>>())
                        .collect()
                };
                let other = if otherwise.is_empty() { String::new() } else { format!("else\n{}", block(otherwise)) };
                format!("if {cond}\n{}{other}end", block(then))
            }
        }
    }
}

/// Formats the whole scan: `rung 1`, then for each step the number of its element and the operation.
impl fmt::Display for Ir {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let block = |f: &mut fmt::Formatter<'_>, title: &str, ops: &[IrOp]| -> fmt::Result {
            if !ops.is_empty() {
                writeln!(f, "{title}")?;
            }
            ops.iter().try_for_each(|op| self.op_text(op).lines().try_for_each(|line| writeln!(f, "     {line}")))
        };
        block(f, "begin", &self.prologue)?;
        for (number, rung) in self.rungs.iter().enumerate() {
            writeln!(f, "rung {}", number + 1)?;
            for step in &rung.steps {
                for (i, line) in self.op_text(&step.op).lines().enumerate() {
                    let element = if i == 0 { (step.element.index + 1).to_string() } else { String::new() };
                    writeln!(f, "{element:>3}  {line}")?;
                }
            }
        }
        block(f, "end", &self.epilogue)
    }
}
