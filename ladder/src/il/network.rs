//! A network as ladder diagram: contacts and branches, then coils, blocks and jumps. [`instructions_of`]
//! gives its instructions, and [`super::ladder_of`] finds the ladder diagram in instructions.

use diag::Pos;

use super::model::{
    IlBinaryOperand, IlBinaryOperator, IlCondition, IlInstruction, IlName, IlOperand, IlOperandKind, IlOperation,
    IlParameter,
};
use super::types::{IlLiteral, IlValue, StandardBlock};

/// A network as ladder diagram.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LadderNetwork {
    /// Label, for jumps.
    pub label: Option<IlName>,
    /// Comments, a line each.
    pub comments: Vec<String>,
    /// Parts from left to right, at least one. The power of each is that of the part before, through its own
    /// logic.
    pub stages: Vec<LadderStage>,
}

/// Logic and the outputs behind it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LadderStage {
    /// What the power passes.
    pub logic: LadderLogic,
    /// What the power acts on, from top to bottom.
    pub outputs: Vec<LadderOutput>,
}

/// Contacts between the left rail and an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LadderLogic {
    /// A wire: TRUE.
    Wire,
    /// An open line: FALSE.
    Open,
    /// A contact: the power passes if the BOOL operand is TRUE.
    Contact {
        /// Whether it passes if the operand is FALSE.
        negated: bool,
        /// A variable, an address, or an output of a block.
        operand: IlOperand,
    },
    /// A comparison, GT to LT.
    Compare {
        /// A comparison.
        operator: IlBinaryOperator,
        /// Left operand.
        left: IlOperand,
        /// Right operand.
        right: IlOperand,
    },
    /// At least two parts in series, none of which is itself a series.
    Series(Vec<LadderLogic>),
    /// At least two branches, none of which is itself a parallel.
    Parallel(Vec<LadderLogic>),
}

/// What a coil does with the power.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CoilKind {
    /// Writes it.
    Store,
    /// Writes its complement.
    Negated,
    /// Sets the target if the power is TRUE.
    Set,
    /// Resets the target if the power is TRUE.
    Reset,
}

/// An output of a network.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LadderOutput {
    /// A coil.
    Coil {
        /// What it does.
        kind: CoilKind,
        /// The BOOL that it writes.
        target: IlOperand,
    },
    /// A call of a block.
    Block(LadderBlock),
    /// A jump.
    Jump {
        /// Whether it needs power, or no power.
        condition: IlCondition,
        /// Label of a network.
        label: IlName,
    },
    /// The end of the program for this scan.
    Return(IlCondition),
}

/// A call of an instance of a standard block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LadderBlock {
    /// Block.
    pub block: StandardBlock,
    /// Instance.
    pub instance: IlName,
    /// Whether the call needs power (EN), or no power.
    pub condition: IlCondition,
    /// Input that the power is written to; then the condition is [`IlCondition::Always`].
    pub powered: Option<String>,
    /// Other inputs and outputs; none is positional.
    pub parameters: Vec<IlParameter>,
}

impl LadderLogic {
    /// Returns two parts in series.
    #[must_use]
    pub fn and(self, next: LadderLogic) -> LadderLogic {
        let mut parts = match self {
            LadderLogic::Series(parts) => parts,
            other => vec![other],
        };
        match next {
            LadderLogic::Series(more) => parts.extend(more),
            other => parts.push(other),
        }
        LadderLogic::Series(parts)
    }

    /// Returns two parallel branches.
    #[must_use]
    pub fn or(self, next: LadderLogic) -> LadderLogic {
        let mut branches = match self {
            LadderLogic::Parallel(branches) => branches,
            other => vec![other],
        };
        match next {
            LadderLogic::Parallel(more) => branches.extend(more),
            other => branches.push(other),
        }
        LadderLogic::Parallel(branches)
    }

    /// Returns the logic that passes power where this one does not (De Morgan).
    #[must_use]
    pub fn complement(self) -> LadderLogic {
        let all = |parts: Vec<LadderLogic>| parts.into_iter().map(LadderLogic::complement);
        match self {
            LadderLogic::Wire => LadderLogic::Open,
            LadderLogic::Open => LadderLogic::Wire,
            LadderLogic::Contact { negated, operand } => LadderLogic::Contact { negated: !negated, operand },
            LadderLogic::Compare { operator, left, right } => {
                LadderLogic::Compare { operator: opposite(operator), left, right }
            }
            LadderLogic::Series(parts) => all(parts).reduce(LadderLogic::or).unwrap_or(LadderLogic::Open),
            LadderLogic::Parallel(parts) => all(parts).reduce(LadderLogic::and).unwrap_or(LadderLogic::Wire),
        }
    }

    /// Returns the logic without wires in series and open branches, which change nothing.
    #[must_use]
    pub fn simplified(self) -> LadderLogic {
        match self {
            LadderLogic::Series(parts) => {
                let parts = parts.into_iter().map(LadderLogic::simplified).filter(|part| *part != LadderLogic::Wire);
                parts.reduce(LadderLogic::and).unwrap_or(LadderLogic::Wire)
            }
            LadderLogic::Parallel(parts) => {
                let parts: Vec<_> = parts.into_iter().map(LadderLogic::simplified).collect();
                if parts.contains(&LadderLogic::Wire) {
                    return LadderLogic::Wire;
                }
                let parts = parts.into_iter().filter(|part| *part != LadderLogic::Open);
                parts.reduce(LadderLogic::or).unwrap_or(LadderLogic::Open)
            }
            other => other,
        }
    }
}

/// Returns the comparison that holds where `operator` does not.
fn opposite(operator: IlBinaryOperator) -> IlBinaryOperator {
    match operator {
        IlBinaryOperator::Gt => IlBinaryOperator::Le,
        IlBinaryOperator::Le => IlBinaryOperator::Gt,
        IlBinaryOperator::Ge => IlBinaryOperator::Lt,
        IlBinaryOperator::Lt => IlBinaryOperator::Ge,
        IlBinaryOperator::Eq => IlBinaryOperator::Ne,
        IlBinaryOperator::Ne => IlBinaryOperator::Eq,
        other => other,
    }
}

impl LadderOutput {
    /// Whether the power changes what the output does.
    #[must_use]
    pub fn needs_power(&self) -> bool {
        match self {
            LadderOutput::Coil { .. } => true,
            LadderOutput::Block(call) => call.powered.is_some() || call.condition != IlCondition::Always,
            LadderOutput::Jump { condition, .. } | LadderOutput::Return(condition) => *condition != IlCondition::Always,
        }
    }
}

/// Returns a BOOL literal as an operand.
pub(crate) fn bool_operand(value: bool, pos: Pos) -> IlOperand {
    IlOperand { kind: IlOperandKind::Literal(IlLiteral { prefix: None, value: IlValue::Bool(value) }), pos }
}

/// Returns the instructions of a network. [`super::ladder_of`] gives the network back.
#[must_use]
pub fn instructions_of(network: &LadderNetwork) -> Vec<IlInstruction> {
    let comment = |text: &String| IlInstruction { comment: Some(text.clone()), ..IlInstruction::default() };
    let mut writer = NetworkWriter { lines: Vec::new(), pos: Pos::default() };
    for (index, stage) in network.stages.iter().enumerate() {
        let is_needed = index + 1 < network.stages.len() || stage.outputs.iter().any(LadderOutput::needs_power);
        match (&stage.logic, index) {
            (LadderLogic::Wire, 0) if !is_needed => {}
            (logic, 0) => writer.load(logic),
            (LadderLogic::Series(parts), _) => {
                parts.iter().for_each(|part| writer.combine(IlBinaryOperator::And, part));
            }
            (logic, _) => writer.combine(IlBinaryOperator::And, logic),
        }
        stage.outputs.iter().for_each(|output| writer.output(output));
    }
    if let Some(label) = &network.label {
        match writer.lines.first_mut() {
            Some(first) => first.label = Some(label.clone()),
            None => {
                let (label, pos) = (Some(label.clone()), label.pos);
                writer.lines.push(IlInstruction { label, pos, ..IlInstruction::default() });
            }
        }
    }
    network.comments.iter().map(comment).chain(writer.lines).collect()
}

struct NetworkWriter {
    lines: Vec<IlInstruction>,
    /// Position of the operand written last.
    pos: Pos,
}

impl NetworkWriter {
    fn push(&mut self, operation: IlOperation, pos: Pos) {
        self.pos = pos;
        self.lines.push(IlInstruction { operation: Some(operation), pos, ..IlInstruction::default() });
    }

    /// Loads the value of a part.
    fn load(&mut self, logic: &LadderLogic) {
        match logic {
            LadderLogic::Wire | LadderLogic::Open => {
                let operand = bool_operand(*logic == LadderLogic::Wire, self.pos);
                self.push(IlOperation::Load { negated: false, operand }, self.pos);
            }
            LadderLogic::Contact { negated, operand } => {
                let pos = operand.pos;
                self.push(IlOperation::Load { negated: *negated, operand: operand.clone() }, pos);
            }
            LadderLogic::Compare { operator, left, right } => {
                self.push(IlOperation::Load { negated: false, operand: left.clone() }, left.pos);
                self.compare(*operator, right);
            }
            LadderLogic::Series(parts) | LadderLogic::Parallel(parts) => {
                if let Some(first) = parts.first() {
                    self.load(first);
                }
                self.rest(logic);
            }
        }
    }

    fn compare(&mut self, operator: IlBinaryOperator, right: &IlOperand) {
        let operand = IlBinaryOperand::Value(right.clone());
        self.push(IlOperation::Binary { operator, negated: false, operand }, right.pos);
    }

    /// Combines all parts of a group but the first one.
    fn rest(&mut self, group: &LadderLogic) {
        let (operator, parts) = match group {
            LadderLogic::Series(parts) => (IlBinaryOperator::And, parts),
            LadderLogic::Parallel(parts) => (IlBinaryOperator::Or, parts),
            LadderLogic::Wire | LadderLogic::Open | LadderLogic::Contact { .. } | LadderLogic::Compare { .. } => return,
        };
        parts.iter().skip(1).for_each(|part| self.combine(operator, part));
    }

    /// Combines the current result with a part.
    fn combine(&mut self, operator: IlBinaryOperator, part: &LadderLogic) {
        let binary = |negated, operand| IlOperation::Binary { operator, negated, operand };
        match part {
            LadderLogic::Wire | LadderLogic::Open => {
                let operand = bool_operand(*part == LadderLogic::Wire, self.pos);
                self.push(binary(false, IlBinaryOperand::Value(operand)), self.pos);
            }
            LadderLogic::Contact { negated, operand } => {
                self.push(binary(*negated, IlBinaryOperand::Value(operand.clone())), operand.pos);
            }
            LadderLogic::Compare { operator: compare, left, right } => {
                self.push(binary(false, IlBinaryOperand::Deferred(Some(left.clone()))), left.pos);
                self.compare(*compare, right);
                self.push(IlOperation::Close, right.pos);
            }
            LadderLogic::Series(parts) | LadderLogic::Parallel(parts) => {
                match parts.first() {
                    Some(LadderLogic::Contact { negated: false, operand }) => {
                        self.push(binary(false, IlBinaryOperand::Deferred(Some(operand.clone()))), operand.pos);
                    }
                    Some(first) => {
                        self.push(binary(false, IlBinaryOperand::Deferred(None)), self.pos);
                        self.load(first);
                    }
                    None => return,
                }
                self.rest(part);
                self.push(IlOperation::Close, self.pos);
            }
        }
    }

    fn output(&mut self, output: &LadderOutput) {
        match output {
            LadderOutput::Coil { kind, target } => {
                let (target, pos) = (target.clone(), target.pos);
                let operation = match kind {
                    CoilKind::Store => IlOperation::Store { negated: false, target },
                    CoilKind::Negated => IlOperation::Store { negated: true, target },
                    CoilKind::Set => IlOperation::Set(target),
                    CoilKind::Reset => IlOperation::Reset(target),
                };
                self.push(operation, pos);
            }
            LadderOutput::Block(call) => {
                let pos = call.instance.pos;
                if let Some(part) = &call.powered {
                    let (name, member) = (call.instance.text.clone(), Some(part.clone()));
                    let target = IlOperand { kind: IlOperandKind::Variable { name, member }, pos };
                    self.push(IlOperation::Store { negated: false, target }, pos);
                }
                let (instance, parameters) = (call.instance.clone(), call.parameters.clone());
                self.push(IlOperation::Call { condition: call.condition, instance, parameters }, pos);
            }
            LadderOutput::Jump { condition, label } => {
                self.push(IlOperation::Jump { condition: *condition, label: label.clone() }, label.pos);
            }
            LadderOutput::Return(condition) => self.push(IlOperation::Return(*condition), self.pos),
        }
    }
}
