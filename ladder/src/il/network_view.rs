//! Finds the ladder diagram in the instructions of a network.

use std::fmt;

use diag::Pos;

use crate::model::{Element, Rung, RungNode};

use super::model::{
    IlBinaryOperand, IlBinaryOperator, IlCondition, IlName, IlOperand, IlOperandKind, IlOperation, IlParameter,
};
use super::network::{CoilKind, LadderBlock, LadderLogic, LadderNetwork, LadderOutput, LadderStage};
use super::steps::{BlockCall, IlAction, IlStep};
use super::types::{IecType, IlLiteral, IlValue};

/// Why a network has no form as ladder diagram.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoLadderForm {
    /// Position of the line.
    pub pos: Pos,
    /// The line, in canonical text.
    pub line: String,
    /// What the diagram does not have.
    pub why: &'static str,
}

impl fmt::Display for NoLadderForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "`{}` has no ladder diagram: {}", self.line, self.why)
    }
}

impl std::error::Error for NoLadderForm {}

/// What a diagram does not have; [`NoLadderForm`] has the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
struct NoForm(&'static str);

/// Returns the ladder diagram of a rung of Instruction List.
///
/// # Errors
/// Names the first line that a ladder diagram does not have, such as arithmetic or XOR.
pub fn ladder_of(rung: &Rung) -> Result<LadderNetwork, NoLadderForm> {
    let mut reader = NetworkReader::default();
    for node in &rung.series {
        let RungNode::Leaf(element, pos) = node else {
            return Err(NoLadderForm { pos: rung.pos, line: String::new(), why: "it is no line of instructions" });
        };
        match element {
            Element::Comment(text) => reader.network.comments.extend(text.lines().map(str::to_owned)),
            Element::Instruction(step) => {
                reader.add_step(step).map_err(|NoForm(why)| NoLadderForm { pos: *pos, line: step.to_string(), why })?;
            }
            // The elements of LDmicro are no instructions.
            _ => return Err(NoLadderForm { pos: *pos, line: String::new(), why: "it is an element of LDmicro" }),
        }
    }
    reader.end_stage();
    let mut network = reader.network;
    if network.stages.is_empty() {
        network.stages.push(LadderStage { logic: LadderLogic::Wire, outputs: Vec::new() });
    }
    Ok(network)
}

/// The current result as a part of a diagram.
#[derive(Default)]
enum ResultForm {
    /// Nothing is loaded since the beginning of the network, or since the last output.
    #[default]
    Nothing,
    /// A value that a comparison takes.
    Value(IlOperand),
    /// Power.
    Power(LadderLogic),
}

/// An operator that waits for its `)`.
struct WaitingOperator {
    result: ResultForm,
    operator: IlBinaryOperator,
    is_negated: bool,
}

#[derive(Default)]
struct NetworkReader {
    network: LadderNetwork,
    result: ResultForm,
    waiting: Vec<WaitingOperator>,
    outputs: Vec<LadderOutput>,
}

const NO_RESULT: &str = "it uses the result of an earlier network";
const AFTER_OUTPUT: &str = "behind an output the power can only go on through AND";

impl NetworkReader {
    /// Ends the stage in work: later logic is behind its outputs.
    fn end_stage(&mut self) {
        let logic = match std::mem::replace(&mut self.result, ResultForm::Nothing) {
            ResultForm::Power(logic) => logic,
            ResultForm::Nothing | ResultForm::Value(_) => LadderLogic::Wire,
        };
        let outputs = std::mem::take(&mut self.outputs);
        if logic != LadderLogic::Wire || !outputs.is_empty() {
            self.network.stages.push(LadderStage { logic, outputs });
        }
    }

    fn add_step(&mut self, step: &IlStep) -> Result<(), NoForm> {
        if let Some(label) = &step.label {
            self.network.label = Some(IlName { text: label.clone(), pos: Pos::default() });
        }
        self.network.comments.extend(step.comment.clone());
        let Some(operation) = &step.operation else { return Ok(()) };
        if let IlAction::Call { call, .. } = &step.action {
            return self.call(operation, call);
        }
        match operation {
            IlOperation::Load { negated, operand } => self.load(*negated, operand, step.after.as_ref()),
            IlOperation::Not => {
                self.check_logic()?;
                let power = self.power()?;
                self.result = ResultForm::Power(power.complement());
                Ok(())
            }
            IlOperation::Binary { operator, negated, operand } => self.binary(step, *operator, *negated, operand),
            IlOperation::Close => self.close(),
            IlOperation::Store { negated, target } => {
                self.bool_output(step)?;
                let kind = if *negated { CoilKind::Negated } else { CoilKind::Store };
                self.output(LadderOutput::Coil { kind, target: target.clone() })
            }
            IlOperation::Set(target) => self.output(LadderOutput::Coil { kind: CoilKind::Set, target: target.clone() }),
            IlOperation::Reset(target) => {
                self.output(LadderOutput::Coil { kind: CoilKind::Reset, target: target.clone() })
            }
            IlOperation::Jump { condition, label } => {
                self.output(LadderOutput::Jump { condition: *condition, label: label.clone() })
            }
            IlOperation::Return(condition) => self.output(LadderOutput::Return(*condition)),
            IlOperation::NoTarget { .. } => Err(NoForm("it writes nothing")),
            IlOperation::Function { .. } => Err(NoForm("functions are no contacts")),
            IlOperation::Call { .. } | IlOperation::BlockInput { .. } | IlOperation::ShortBlock { .. } => {
                Err(NoForm("it is no call"))
            }
        }
    }

    /// Checks that the result may change: it does not behind an output.
    fn check_logic(&self) -> Result<(), NoForm> {
        let is_behind = self.waiting.is_empty() && !(self.outputs.is_empty() && self.network.stages.is_empty());
        if is_behind { Err(NoForm(AFTER_OUTPUT)) } else { Ok(()) }
    }

    fn power(&mut self) -> Result<LadderLogic, NoForm> {
        match std::mem::replace(&mut self.result, ResultForm::Nothing) {
            ResultForm::Power(logic) => Ok(logic),
            ResultForm::Value(_) => Err(NoForm("the value is no BOOL")),
            ResultForm::Nothing => Err(NoForm(NO_RESULT)),
        }
    }

    fn load(&mut self, negated: bool, operand: &IlOperand, after: Option<&IecType>) -> Result<(), NoForm> {
        self.check_logic()?;
        if !matches!(self.result, ResultForm::Nothing) {
            return Err(NoForm("it replaces a result that nothing uses"));
        }
        self.result = loaded(negated, operand, after)?;
        Ok(())
    }

    fn binary(
        &mut self,
        step: &IlStep,
        operator: IlBinaryOperator,
        negated: bool,
        operand: &IlBinaryOperand,
    ) -> Result<(), NoForm> {
        if operator.is_comparison() {
            let IlBinaryOperand::Value(right) = operand else { return Err(NoForm("a comparison takes two operands")) };
            self.check_logic()?;
            let left = match std::mem::replace(&mut self.result, ResultForm::Nothing) {
                ResultForm::Value(left) => left,
                ResultForm::Power(LadderLogic::Contact { negated: false, operand }) => operand,
                ResultForm::Power(_) => return Err(NoForm("a comparison takes two operands")),
                ResultForm::Nothing => return Err(NoForm(NO_RESULT)),
            };
            self.result = ResultForm::Power(LadderLogic::Compare { operator, left, right: right.clone() });
            return Ok(());
        }
        let is_and = match operator {
            IlBinaryOperator::And => true,
            IlBinaryOperator::Or => false,
            _ => return Err(NoForm("contacts have only AND and OR")),
        };
        if step.before != Some(IecType::Bool) {
            return Err(NoForm("contacts are BOOL"));
        }
        if is_and && self.waiting.is_empty() && !self.outputs.is_empty() {
            self.begin_stage()?;
        } else if !is_and {
            self.check_logic()?;
        }
        match operand {
            IlBinaryOperand::Value(operand) => {
                let ResultForm::Power(part) = loaded(negated, operand, Some(&IecType::Bool))? else { return Ok(()) };
                self.join(operator, part)
            }
            IlBinaryOperand::Deferred(operand) => {
                let after = step.after.as_ref();
                let inner =
                    operand.as_ref().map_or(Ok(ResultForm::Nothing), |operand| loaded(false, operand, after))?;
                let result = std::mem::replace(&mut self.result, inner);
                self.waiting.push(WaitingOperator { result, operator, is_negated: negated });
                Ok(())
            }
        }
    }

    /// Begins the logic behind the outputs of the stage in work.
    fn begin_stage(&mut self) -> Result<(), NoForm> {
        if matches!(self.result, ResultForm::Nothing) {
            return Err(NoForm(NO_RESULT));
        }
        self.end_stage();
        Ok(())
    }

    /// Combines the result with a part.
    fn join(&mut self, operator: IlBinaryOperator, part: LadderLogic) -> Result<(), NoForm> {
        let is_stage_begin = self.waiting.is_empty() && !self.network.stages.is_empty();
        let joined = match std::mem::replace(&mut self.result, ResultForm::Nothing) {
            ResultForm::Nothing if is_stage_begin && operator == IlBinaryOperator::And => part,
            ResultForm::Power(result) if operator == IlBinaryOperator::And => result.and(part),
            ResultForm::Power(result) => result.or(part),
            ResultForm::Nothing => return Err(NoForm(NO_RESULT)),
            ResultForm::Value(_) => return Err(NoForm("contacts are BOOL")),
        };
        self.result = ResultForm::Power(joined);
        Ok(())
    }

    fn close(&mut self) -> Result<(), NoForm> {
        let inner = self.power()?;
        let Some(waiting) = self.waiting.pop() else { return Err(NoForm("no operator waits for it")) };
        self.result = waiting.result;
        let inner = if waiting.is_negated { inner.complement() } else { inner };
        self.join(waiting.operator, inner)
    }

    fn bool_output(&self, step: &IlStep) -> Result<(), NoForm> {
        let target = match &step.action {
            IlAction::Store { target, .. } => &target.iec_type,
            _ => return Ok(()),
        };
        if *target == IecType::Bool { Ok(()) } else { Err(NoForm("a coil is a BOOL")) }
    }

    fn output(&mut self, output: LadderOutput) -> Result<(), NoForm> {
        if !self.waiting.is_empty() {
            return Err(NoForm("an output inside parentheses"));
        }
        if output.needs_power() && !matches!(self.result, ResultForm::Power(_)) {
            return Err(NoForm(match self.result {
                ResultForm::Value(_) => "the value is no BOOL",
                _ => NO_RESULT,
            }));
        }
        self.outputs.push(output);
        Ok(())
    }

    fn call(&mut self, operation: &IlOperation, call: &BlockCall) -> Result<(), NoForm> {
        let named = |text: &str| IlName { text: text.to_owned(), pos: Pos::default() };
        let first_input = call.inputs.first().and_then(|(part, _)| Some(part.name.rsplit_once('.')?.1.to_owned()));
        let block = |condition, powered, parameters| LadderBlock {
            block: call.block,
            instance: named(&call.instance),
            condition,
            powered,
            parameters,
        };
        let new = match operation {
            IlOperation::Call { condition, parameters, .. } => {
                let parameters = named_parameters(call, parameters);
                let powered =
                    if *condition == IlCondition::Always { self.take_powered_input(call, &parameters) } else { None };
                block(*condition, powered, parameters)
            }
            IlOperation::ShortBlock { preset, .. } => {
                let name = named(call.block.preset().map_or("PT", |part| part.name));
                let value = if call.block.is_timer() { as_duration(preset) } else { preset.clone() };
                block(IlCondition::Always, first_input, vec![IlParameter::Input { name, value }])
            }
            // An input operator.
            _ => block(IlCondition::Always, first_input, Vec::new()),
        };
        self.output(LadderOutput::Block(new))
    }

    /// Takes the coil before a call that writes an input of the instance.
    fn take_powered_input(&mut self, call: &BlockCall, parameters: &[IlParameter]) -> Option<String> {
        let Some(LadderOutput::Coil { kind: CoilKind::Store, target }) = self.outputs.last() else { return None };
        let IlOperandKind::Variable { name, member: Some(member) } = &target.kind else { return None };
        let part = call.block.part(member).filter(|part| part.is_input)?;
        let is_given = parameters.iter().any(
            |parameter| matches!(parameter, IlParameter::Input { name, .. } if name.text.eq_ignore_ascii_case(member)),
        );
        if is_given || !name.eq_ignore_ascii_case(&call.instance) {
            return None;
        }
        self.outputs.pop();
        Some(part.name.to_owned())
    }
}

/// Returns an operand as the current result.
fn loaded(negated: bool, operand: &IlOperand, after: Option<&IecType>) -> Result<ResultForm, NoForm> {
    let is_bool = after == Some(&IecType::Bool);
    Ok(match &operand.kind {
        IlOperandKind::Literal(IlLiteral { value: IlValue::Bool(value), .. }) => {
            ResultForm::Power(if *value == negated { LadderLogic::Open } else { LadderLogic::Wire })
        }
        IlOperandKind::Literal(IlLiteral { value: IlValue::Integer { value, .. }, .. }) if is_bool => {
            ResultForm::Power(if (value & 1 == 1) == negated { LadderLogic::Open } else { LadderLogic::Wire })
        }
        _ if is_bool => ResultForm::Power(LadderLogic::Contact { negated, operand: operand.clone() }),
        _ if negated => return Err(NoForm("a number has no complement in a diagram")),
        _ => ResultForm::Value(operand.clone()),
    })
}

/// Returns parameters of a call with the names of those that are positional.
fn named_parameters(call: &BlockCall, parameters: &[IlParameter]) -> Vec<IlParameter> {
    let mut inputs = call.block.parts().iter().filter(|part| part.is_input);
    let name_of = |part: Option<&super::types::BlockPart>| IlName {
        text: part.map_or(String::new(), |part| part.name.to_owned()),
        pos: Pos::default(),
    };
    let named = parameters.iter().map(|parameter| match parameter {
        IlParameter::Positional(value) => IlParameter::Input { name: name_of(inputs.next()), value: value.clone() },
        other => other.clone(),
    });
    named.collect()
}

/// Returns the preset of the short form: a number is in milliseconds.
fn as_duration(preset: &IlOperand) -> IlOperand {
    let mut preset = preset.clone();
    if let IlOperandKind::Literal(literal) = &mut preset.kind
        && let IlValue::Integer { value, .. } = literal.value
    {
        *literal = IlLiteral { prefix: None, value: IlValue::Time(value.saturating_mul(1_000_000)) };
    }
    preset
}
