//! Networks of IEC 61131-3 as rungs of LDmicro.

use diag::Pos;

use crate::il::{
    CoilKind, IecType, IlAction, IlBinaryOperator, IlCondition, IlOperand, IlOperandKind, IlParameter, IlValue,
    LadderBlock, LadderLogic, LadderNetwork, LadderOutput, LadderStage, StandardBlock,
};
use crate::model::{CompareOp, Element, FlowOp, LadderOperand, MathOp, Rung, RungNode};

use super::ldmicro::{LdBuilder, OperandFault, constant, label_text};

/// GOTO of the number of a rung beyond the last one ends the scan.
const END_OF_SCAN: &str = "99999";

impl LdBuilder<'_> {
    /// Converts the stages of a network.
    pub(super) fn stages(&mut self, network: &LadderNetwork) {
        for (index, stage) in network.stages.iter().enumerate() {
            if !matches!(stage.logic, LadderLogic::Wire) {
                match self.logic(&stage.logic) {
                    Ok(nodes) => nodes.into_iter().for_each(|node| self.push_node(node)),
                    Err((pos, cause)) => self.refuse(pos, cause, "keep the network in Instruction List"),
                }
            }
            let is_last = index + 1 == network.stages.len();
            self.outputs(stage, is_last);
        }
    }

    fn outputs(&mut self, stage: &LadderStage, is_last_stage: bool) {
        for (index, output) in stage.outputs.iter().enumerate() {
            let is_needed = !is_last_stage || index + 1 < stage.outputs.len();
            match output {
                LadderOutput::Coil { kind, target } => self.coil(*kind, target),
                LadderOutput::Jump { condition, label } => {
                    self.pos = if label.pos == Pos::default() { self.pos } else { label.pos };
                    self.jump(*condition, &label_text(&label.text), is_needed);
                }
                LadderOutput::Return(condition) => self.jump(*condition, END_OF_SCAN, is_needed),
                LadderOutput::Block(call) => {
                    if call.condition != IlCondition::Always {
                        let cause = format!("`{}` is called on a condition", call.instance.text);
                        self.refuse(self.pos, cause, "call the block in every scan");
                        continue;
                    }
                    let saved = is_needed.then(|| self.save());
                    self.power_input(call);
                    self.block(call);
                    if let Some(saved) = saved {
                        self.push(contact(saved, false));
                    }
                }
            }
        }
    }

    /// Stores the power in the input of a call. An element takes it from the rung if only the call reads it.
    fn power_input(&mut self, call: &LadderBlock) {
        let Some(part) = &call.powered else { return self.end_rung() };
        let symbol = format!("{}.{part}", call.instance.text);
        let is_counter = call.block == StandardBlock::Ctud;
        let has_bits = call.parameters.iter().any(|parameter| match parameter {
            IlParameter::Input { name, .. } => !call.block.preset().is_some_and(|part| name.matches(part.name)),
            IlParameter::Positional(_) | IlParameter::Output { .. } => false,
        });
        let is_direct = matches!(part.as_str(), "IN" | "CU" | "CD") || call.block == StandardBlock::RTrig;
        self.direct_input = (is_direct && !is_counter && !has_bits && !self.is_used(&symbol)).then(|| symbol.clone());
        if self.direct_input.is_none() {
            self.push(coil(self.name_of(&symbol)));
            self.end_rung();
        }
    }

    /// Begins a rung with an input of a call; if the rung in work is its power, continues it.
    pub(super) fn begin_with_input(&mut self, instance: &str, part: &str) {
        let symbol = format!("{instance}.{part}");
        if self.direct_input.take().is_some_and(|direct| direct == symbol) {
            return;
        }
        self.end_rung();
        self.push(contact(self.name_of(&symbol), false));
    }

    /// Stores the power in a relay and returns its name.
    fn save(&mut self) -> String {
        let name = self.free_name("RPower");
        self.push(coil(name.clone()));
        name
    }

    fn coil(&mut self, kind: CoilKind, target: &IlOperand) {
        let Some((name, _)) = self.symbol_of(target) else { return };
        self.pos = if target.pos == Pos::default() { self.pos } else { target.pos };
        let name = self.name_of(&name);
        let (negated, set, reset) = match kind {
            CoilKind::Store => (false, false, false),
            CoilKind::Negated => (true, false, false),
            CoilKind::Set => (false, true, false),
            CoilKind::Reset => (false, false, true),
        };
        self.push(Element::Coil { name, negated, set, reset, ttrigger: None });
    }

    /// Adds a jump. A jump that is not taken gives no power, so the power is kept in a relay.
    fn jump(&mut self, condition: IlCondition, label: &str, is_needed: bool) {
        let goto = Element::Flow { op: FlowOp::Goto, label: label.to_owned() };
        if condition == IlCondition::Always && !is_needed {
            // The power does not matter.
            self.end_rung();
            return self.rung([goto]);
        }
        if condition == IlCondition::IfTrue && !is_needed {
            return self.push(goto);
        }
        let saved = self.save();
        self.end_rung();
        match condition {
            IlCondition::Always => self.rung([goto]),
            IlCondition::IfTrue => self.rung([contact(saved.clone(), false), goto]),
            IlCondition::IfFalse => self.rung([contact(saved.clone(), true), goto]),
        }
        if is_needed {
            self.push(contact(saved, false));
        }
    }

    /// Returns logic as nodes of a series.
    fn logic(&self, logic: &LadderLogic) -> Result<Vec<RungNode>, (Pos, String)> {
        let pos_of = |operand: &IlOperand| if operand.pos == Pos::default() { self.pos } else { operand.pos };
        Ok(match logic {
            LadderLogic::Wire => vec![RungNode::Leaf(Element::Short, self.pos)],
            LadderLogic::Open => vec![RungNode::Leaf(Element::Open, self.pos)],
            LadderLogic::Contact { negated, operand } => {
                let Some((name, _)) = self.symbol_of(operand) else {
                    return Err((pos_of(operand), "the contact has no name".to_owned()));
                };
                let element = match self.constant_of(&name) {
                    Some(value) if (value != 0) != *negated => Element::Short,
                    Some(_) => Element::Open,
                    None => contact(self.name_of(&name), *negated),
                };
                vec![RungNode::Leaf(element, pos_of(operand))]
            }
            LadderLogic::Compare { operator, left, right } => {
                let pos = pos_of(left);
                let op = match operator {
                    IlBinaryOperator::Gt => CompareOp::Grt,
                    IlBinaryOperator::Ge => CompareOp::Geq,
                    IlBinaryOperator::Eq => CompareOp::Equ,
                    IlBinaryOperator::Ne => CompareOp::Neq,
                    IlBinaryOperator::Le => CompareOp::Leq,
                    IlBinaryOperator::Lt => CompareOp::Les,
                    IlBinaryOperator::And
                    | IlBinaryOperator::Or
                    | IlBinaryOperator::Xor
                    | IlBinaryOperator::Add
                    | IlBinaryOperator::Sub
                    | IlBinaryOperator::Mul
                    | IlBinaryOperator::Div
                    | IlBinaryOperator::Mod => return Err((pos, "it is no comparison".to_owned())),
                };
                let op1 = self.integer(left).map_err(|fault| (pos, fault.to_string()))?;
                let op2 = self.integer(right).map_err(|fault| (pos, fault.to_string()))?;
                vec![RungNode::Leaf(Element::Compare { op, op1, op2 }, pos)]
            }
            LadderLogic::Series(parts) => {
                let parts: Result<Vec<_>, _> = parts.iter().map(|part| self.logic(part)).collect();
                parts?.into_iter().flatten().collect()
            }
            LadderLogic::Parallel(branches) => {
                let branches: Result<Vec<_>, _> = branches.iter().map(|branch| self.logic(branch)).collect();
                vec![RungNode::Parallel(branches?, self.pos)]
            }
        })
    }

    /// Converts a network that loads a number, calculates and stores it.
    ///
    /// # Errors
    /// The place and the reason; `None` if the network is none of numbers.
    pub(super) fn integer_network(&mut self, rung: &Rung) -> Result<(), Option<(Pos, String)>> {
        let mut comments = Vec::new();
        let mut calculation = Calculation::default();
        for node in &rung.series {
            let RungNode::Leaf(element, pos) = node else { return Err(None) };
            match element {
                Element::Comment(text) => comments.extend(text.lines().map(str::to_owned)),
                Element::Instruction(step) => {
                    comments.extend(step.comment.clone());
                    calculation.label = calculation.label.take().or_else(|| step.label.clone());
                    self.add_action(&mut calculation, &step.action, *pos)?;
                }
                // The elements of LDmicro are no instructions.
                _ => return Err(None),
            }
        }
        let Calculation { label, operations, stores, end, iec_type, pos } = calculation;
        let (Some(iec_type), Some((first, more))) = (iec_type, stores.split_first()) else { return Err(None) };
        self.pos = pos;
        if !comments.is_empty() {
            self.rung([Element::Comment(comments.join("\n"))]);
        }
        if let Some(label) = label {
            self.push(Element::Flow { op: FlowOp::Label, label: label_text(&label) });
        }
        let is_read_later =
            operations.iter().skip(2).any(|(_, operand)| matches!(operand, LadderOperand::Var(name) if name == first));
        let result = if is_read_later { self.free_name("vResult") } else { first.clone() };
        self.set_width(&result, &iec_type);
        let mut left = None;
        for (op, operand) in operations {
            left = Some(match (left, op) {
                (Some(op1), Some(op)) => {
                    self.push(Element::Math { op, dest: result.clone(), op1, op2: operand });
                    LadderOperand::Var(result.clone())
                }
                _ => operand,
            });
        }
        let left = left.unwrap_or_else(|| constant(0));
        for target in std::iter::once(first).chain(more).filter(|target| left != LadderOperand::Var((*target).clone()))
        {
            self.push(Element::Move { dest: target.clone(), src: left.clone() });
        }
        match end {
            Some(label) => self.jump(IlCondition::Always, &label, false),
            None => self.end_rung(),
        }
        Ok(())
    }

    /// Adds a line to a calculation.
    fn add_action(
        &self,
        calculation: &mut Calculation,
        action: &IlAction,
        pos: Pos,
    ) -> Result<(), Option<(Pos, String)>> {
        let fault = |cause: &str| Err(Some((pos, cause.to_owned())));
        let at = |fault: OperandFault| Some((pos, fault.to_string()));
        let is_begun = !calculation.operations.is_empty();
        if calculation.end.is_some() || is_begun && matches!(action, IlAction::Load { .. }) {
            return Err(None);
        }
        match action {
            IlAction::Nothing => {}
            IlAction::Load { negated: false, source, iec_type } if *iec_type != IecType::Bool => {
                calculation.pos = pos;
                calculation.operations.push((None, self.source_integer(source).map_err(at)?));
            }
            IlAction::Binary { operator, negated: false, source, iec_type }
                if is_begun && calculation.stores.is_empty() =>
            {
                let operand = self.source_integer(source).map_err(at)?;
                let is_divisor = matches!(operand, LadderOperand::Const { value, .. } if value != 0);
                let op = match operator {
                    IlBinaryOperator::Add => MathOp::Add,
                    IlBinaryOperator::Sub => MathOp::Sub,
                    IlBinaryOperator::Mul => MathOp::Mul,
                    IlBinaryOperator::Div if is_divisor => MathOp::Div,
                    IlBinaryOperator::Mod if is_divisor => MathOp::Mod,
                    IlBinaryOperator::Div | IlBinaryOperator::Mod => {
                        return fault("LDmicro has another result of a division by 0");
                    }
                    IlBinaryOperator::And
                    | IlBinaryOperator::Or
                    | IlBinaryOperator::Xor
                    | IlBinaryOperator::Gt
                    | IlBinaryOperator::Ge
                    | IlBinaryOperator::Eq
                    | IlBinaryOperator::Ne
                    | IlBinaryOperator::Le
                    | IlBinaryOperator::Lt => return Err(None),
                };
                calculation.iec_type = Some(iec_type.clone());
                calculation.operations.push((Some(op), operand));
            }
            IlAction::Store { negated: false, target } if is_begun => {
                let LadderOperand::Var(name) =
                    self.source_integer(&crate::il::IlSource::Symbol(target.clone())).map_err(at)?
                else {
                    return fault("the target is a constant");
                };
                if target.name.contains('.') {
                    return fault("an input of a block is written apart from its call");
                }
                calculation.iec_type.get_or_insert_with(|| target.iec_type.clone());
                calculation.stores.push(name);
            }
            IlAction::Jump { condition: IlCondition::Always, label, .. } => calculation.end = Some(label_text(label)),
            IlAction::Return(IlCondition::Always) => calculation.end = Some(END_OF_SCAN.to_owned()),
            _ => return Err(None),
        }
        Ok(())
    }

    /// Returns the value of a preset that is a literal: a number, or milliseconds.
    pub(super) fn literal_value(&self, operand: &IlOperand) -> Option<i64> {
        match &operand.kind {
            IlOperandKind::Literal(literal) => match literal.value {
                IlValue::Integer { value, .. } => Some(value),
                IlValue::Time(nanoseconds) => Some(nanoseconds / 1_000_000),
                IlValue::Bool(_) => None,
            },
            IlOperandKind::Variable { .. } | IlOperandKind::Address(_) => self.constant_of(&self.symbol_of(operand)?.0),
        }
    }

    /// Returns the nodes of a BOOL operand, before a coil.
    pub(super) fn bit(&self, operand: &IlOperand) -> Option<Element> {
        if let IlOperandKind::Literal(literal) = &operand.kind {
            let value = match literal.value {
                IlValue::Bool(value) => value,
                IlValue::Integer { value, .. } => value & 1 == 1,
                IlValue::Time(_) => return None,
            };
            return Some(if value { Element::Short } else { Element::Open });
        }
        let (name, _) = self.symbol_of(operand)?;
        Some(contact(self.name_of(&name), false))
    }
}

/// A network that loads a number, calculates and stores it.
#[derive(Default)]
struct Calculation {
    label: Option<String>,
    /// The loaded operand, then each operation with its operand.
    operations: Vec<(Option<MathOp>, LadderOperand)>,
    stores: Vec<String>,
    /// Label of a jump at its end.
    end: Option<String>,
    iec_type: Option<IecType>,
    pos: Pos,
}

/// A contact.
pub(super) fn contact(name: String, negated: bool) -> Element {
    Element::Contacts { name, negated, set1: None }
}

/// A coil.
pub(super) fn coil(name: String) -> Element {
    Element::Coil { name, negated: false, set: false, reset: false, ttrigger: None }
}
