//! Instructions that act: coils, one-shots, timers, counters, numbers.

use diag::Pos;

use crate::il::{
    CoilKind, IecType, IlBinaryOperand, IlBinaryOperator, IlCondition, IlLiteral, IlName, IlOperand, IlOperandKind,
    IlOperation, IlParameter, IlValue, LadderBlock, LadderLogic, LadderOutput, StandardBlock,
};

use super::lower::{IsUsed, RungLowering};
use super::tags::{TagKind, member, number};
use super::text::NeutralOperand;

fn contact(negated: bool, operand: &IlOperand) -> LadderLogic {
    LadderLogic::Contact { negated, operand: operand.clone() }
}

fn store(target: &IlOperand) -> LadderOutput {
    LadderOutput::Coil { kind: CoilKind::Store, target: target.clone() }
}

impl RungLowering<'_> {
    /// Executes an instruction.
    pub(super) fn instruction(&mut self, name: &str, operands: &[NeutralOperand], pos: Pos, is_used: IsUsed) {
        match (name, operands) {
            ("XIC" | "XIO" | "EQU" | "NEQ" | "GRT" | "GEQ" | "LES" | "LEQ", _) => {
                let logic = self.contact(name, operands, pos);
                self.and(logic);
            }
            ("OTE" | "OTL" | "OTU", [target]) => {
                let kind = match name {
                    "OTE" => CoilKind::Store,
                    "OTL" => CoilKind::Set,
                    _ => CoilKind::Reset,
                };
                if let Some(target) = self.bool_tag(target, true) {
                    self.output(LadderOutput::Coil { kind, target });
                }
            }
            ("ONS", [storage]) => self.one_shot(storage, None, false, pos),
            ("OSR", [storage, output]) => self.one_shot(storage, Some(output), false, pos),
            ("OSF", [storage, output]) => self.one_shot(storage, Some(output), true, pos),
            ("TON", [timer, rest @ ..]) => self.timer(StandardBlock::Ton, timer, rest, pos, is_used),
            ("TOF", [timer, rest @ ..]) => self.timer(StandardBlock::Tof, timer, rest, pos, is_used),
            ("RTO", [timer, rest @ ..]) => self.timer(StandardBlock::Tona, timer, rest, pos, is_used),
            ("CTU", [counter, rest @ ..]) => self.counter(counter, rest, true, pos),
            ("CTD", [counter, rest @ ..]) => self.counter(counter, rest, false, pos),
            ("RES", [target]) => self.reset(target, pos),
            ("MOV", [from, to]) => self.calculate(None, from, None, to, pos),
            ("ADD", [a, b, to]) => self.calculate(Some(IlBinaryOperator::Add), a, Some(b), to, pos),
            ("SUB", [a, b, to]) => self.calculate(Some(IlBinaryOperator::Sub), a, Some(b), to, pos),
            ("MUL", [a, b, to]) => self.calculate(Some(IlBinaryOperator::Mul), a, Some(b), to, pos),
            ("DIV", [a, b, to]) => self.calculate(Some(IlBinaryOperator::Div), a, Some(b), to, pos),
            _ => self.refuse(pos, format!("the instruction {name} is not read"), "see docs/languages/rockwell.md"),
        }
    }

    /// ONS: the power passes for one scan at its rising edge. OSR and OSF write the pulse to a tag, and the
    /// power passes. The storage bit holds the power of the last scan; at power-up that of ONS and OSR is
    /// set.
    fn one_shot(&mut self, storage: &NeutralOperand, output: Option<&NeutralOperand>, is_falling: bool, pos: Pos) {
        let Some(memory) = self.bool_tag(storage, true) else { return };
        if let Some(tag) = self.tags.get(&storage.text) {
            tag.initial = i64::from(!is_falling);
            // The bit is a memory, no output with a pin.
            tag.section = Some(crate::il::IlSection::Local);
        }
        let power = self.hold(pos);
        let target = match output {
            Some(output) => self.bool_tag(output, true),
            None => {
                let name = self.tags.names.declare("pulse", IecType::Bool, pos);
                Some(super::tags::variable(&name.text, pos))
            }
        };
        let Some(target) = target else { return };
        let pulse = match is_falling {
            false => power.clone().and(contact(true, &memory)),
            true => power.clone().complement().and(contact(false, &memory)),
        };
        self.resume(pulse.simplified());
        self.output(store(&target));
        self.flush();
        self.resume(power.clone());
        self.output(store(&memory));
        self.flush();
        self.resume(if output.is_some() { power } else { contact(false, &target) });
    }

    /// Returns the number of a preset; `None` if it is left to the data of the tag.
    fn preset(&mut self, operands: &[NeutralOperand]) -> Option<i64> {
        let operand = operands.first().filter(|operand| operand.text != "?")?;
        match self.value(operand)?.kind {
            IlOperandKind::Literal(IlLiteral { value: IlValue::Integer { value, .. }, .. }) => Some(value),
            _ => {
                self.refuse(operand.pos, format!("the preset `{}` is no number", operand.text), "give a number");
                None
            }
        }
    }

    fn timer(
        &mut self,
        block: StandardBlock,
        timer: &NeutralOperand,
        rest: &[NeutralOperand],
        pos: Pos,
        is_used: IsUsed,
    ) {
        let given = self.preset(rest);
        let Some(TagKind::Timer(_, declared)) = self.timer_tag(block, timer) else { return };
        let Some(preset) = given.or(declared).filter(|preset| (0..=i64::from(i32::MAX)).contains(preset)) else {
            return self.refuse(
                pos,
                format!("the timer `{}` has no preset", timer.text),
                "give milliseconds, 0 or more",
            );
        };
        if let Some(tag) = self.tags.get(&timer.text) {
            tag.kind = TagKind::Timer(Some(block), Some(preset));
        }
        let power = if is_used { Some(self.hold(pos)) } else { None };
        let named = |text: &str| IlName { text: text.to_owned(), pos };
        let delay = IlLiteral { prefix: None, value: IlValue::Time(preset.saturating_mul(1_000_000)) };
        let value = IlOperand { kind: IlOperandKind::Literal(delay), pos };
        self.output(LadderOutput::Block(LadderBlock {
            block,
            instance: IlName { text: timer.text.clone(), pos: timer.pos },
            condition: IlCondition::Always,
            powered: Some("IN".to_owned()),
            parameters: vec![IlParameter::Input { name: named("PT"), value }],
        }));
        self.flush();
        self.resume(power.unwrap_or(LadderLogic::Wire));
    }

    /// Returns the kind of a timer tag; reports a tag that is none, or that two kinds of timers use.
    fn timer_tag(&mut self, block: StandardBlock, timer: &NeutralOperand) -> Option<TagKind> {
        let kind = self.known_tag(&timer.text, Some(TagKind::Timer(Some(block), None)), timer.pos)?;
        match kind {
            TagKind::Timer(Some(other), _) if other != block => {
                let cause = format!("`{}` is used by two kinds of timers", timer.text);
                self.refuse(timer.pos, cause, "give each timer a tag of its own");
                None
            }
            TagKind::Timer(..) => Some(kind),
            TagKind::Elementary(_) | TagKind::Counter(_) => {
                self.refuse(timer.pos, format!("`{}` is no TIMER", timer.text), "give a tag of type TIMER");
                None
            }
        }
    }

    /// CTU, CTD: ACC changes at the rising edge of the power, which CU or CD remembers. DN is ACC >= PRE.
    fn counter(&mut self, counter: &NeutralOperand, rest: &[NeutralOperand], is_up: bool, pos: Pos) {
        let (given, name) = (self.preset(rest), counter.text.clone());
        let kind = self.known_tag(&name, Some(TagKind::Counter(None)), counter.pos);
        let declared = match kind {
            Some(TagKind::Counter(declared)) => declared,
            Some(_) => {
                return self.refuse(counter.pos, format!("`{name}` is no COUNTER"), "give a tag of type COUNTER");
            }
            None => return,
        };
        let Some(preset) = given.or(declared) else {
            return self.refuse(pos, format!("the counter `{name}` has no preset"), "give a number");
        };
        if let Some(tag) = self.tags.get(&name) {
            tag.kind = TagKind::Counter(Some(preset));
        }
        let (edge, operator) = if is_up { ("CU", IlBinaryOperator::Add) } else { ("CD", IlBinaryOperator::Sub) };
        let sum = self.tags.part(&name, "ACC", IecType::Dint, pos);
        let edge = self.tags.part(&name, edge, IecType::Bool, pos);
        let done = self.tags.part(&name, "DN", IecType::Bool, pos);
        let power = self.hold(pos);
        self.resume(power.clone().and(contact(true, &edge)).simplified());
        self.begin_skip(pos, |lowering| lowering.operate(operator, &sum, Some(&number(1, pos)), &sum, pos));
        self.resume(power.clone());
        self.output(store(&edge));
        self.flush();
        let reached = LadderLogic::Compare { operator: IlBinaryOperator::Ge, left: sum, right: number(preset, pos) };
        self.resume(reached);
        self.output(store(&done));
        self.flush();
        self.resume(power);
    }

    /// Executes `body` if the network in work has power.
    fn begin_skip(&mut self, pos: Pos, body: impl FnOnce(&mut Self)) {
        let is_wire = self.stages.iter().all(|stage| stage.logic == LadderLogic::Wire);
        let label = (!is_wire).then(|| IlName { text: self.tags.names.unused("skip"), pos });
        if let Some(label) = &label {
            self.output(LadderOutput::Jump { condition: IlCondition::IfFalse, label: label.clone() });
        }
        self.flush();
        body(self);
        self.label = label;
    }

    fn operate(&mut self, operator: IlBinaryOperator, a: &IlOperand, b: Option<&IlOperand>, to: &IlOperand, pos: Pos) {
        self.push(IlOperation::Load { negated: false, operand: a.clone() }, pos);
        if let Some(b) = b {
            let operand = IlBinaryOperand::Value(b.clone());
            self.push(IlOperation::Binary { operator, negated: false, operand }, pos);
        }
        self.push(IlOperation::Store { negated: false, target: to.clone() }, pos);
    }

    /// MOV, ADD, SUB, MUL, DIV: computed while the rung has power.
    fn calculate(
        &mut self,
        operator: Option<IlBinaryOperator>,
        a: &NeutralOperand,
        b: Option<&NeutralOperand>,
        to: &NeutralOperand,
        pos: Pos,
    ) {
        let power = self.hold(pos);
        let first = self.value(a);
        let second = b.map(|b| self.value(b));
        let target = match to.text.split_once('.') {
            Some((name, part)) if part.eq_ignore_ascii_case("ACC") => match self.known_tag(name, None, to.pos) {
                Some(TagKind::Counter(_)) => Some(self.tags.part(name, "ACC", IecType::Dint, to.pos)),
                Some(_) => {
                    let cause = format!("`{}` is not written here", to.text);
                    self.refuse(to.pos, cause, "write tags and ACC of counters; RES resets a timer");
                    None
                }
                None => None,
            },
            Some(_) => {
                self.refuse(to.pos, format!("`{}` is not written here", to.text), "write tags and ACC of counters");
                None
            }
            None => self.number_tag(to, true),
        };
        let (Some(first), Some(target)) = (first, target) else { return };
        let second = match second {
            Some(None) => return,
            Some(Some(second)) => Some(second),
            None => None,
        };
        self.begin_skip(pos, |lowering| {
            let operator = operator.unwrap_or(IlBinaryOperator::Add);
            lowering.operate(operator, &first, second.as_ref(), &target, pos);
        });
        self.resume(power);
    }

    /// RES: clears the sum and the bits while the rung has power.
    fn reset(&mut self, target: &NeutralOperand, pos: Pos) {
        let (name, at) = (target.text.as_str(), target.pos);
        let power = self.hold(pos);
        let coil = |kind, target| LadderOutput::Coil { kind, target };
        match self.known_tag(name, None, at) {
            Some(TagKind::Counter(_)) => {
                for part in ["CU", "CD", "DN"] {
                    let bit = self.tags.part(name, part, IecType::Bool, at);
                    let needs_power = power != LadderLogic::Wire;
                    if needs_power {
                        self.output(coil(CoilKind::Reset, bit));
                    } else {
                        self.output(coil(CoilKind::Negated, bit));
                    }
                }
                self.flush();
                self.resume(power.clone());
                let sum = self.tags.part(name, "ACC", IecType::Dint, at);
                self.begin_skip(pos, |lowering| {
                    lowering.operate(IlBinaryOperator::Add, &number(0, at), None, &sum, pos);
                });
            }
            Some(TagKind::Timer(Some(StandardBlock::Tof), _)) => {
                self.refuse(at, format!("RES of the TOF `{name}` is not read"), "use RES with TON, RTO and counters");
            }
            Some(TagKind::Timer(Some(block), _)) => {
                let call = LadderOutput::Block(LadderBlock {
                    block,
                    instance: IlName { text: name.to_owned(), pos: at },
                    condition: IlCondition::IfTrue,
                    powered: None,
                    parameters: Vec::new(),
                });
                let is_retentive = block == StandardBlock::Tona;
                self.output(coil(CoilKind::Reset, member(name, "IN", at)));
                if is_retentive {
                    self.output(coil(CoilKind::Set, member(name, "R", at)));
                }
                self.output(call);
                self.flush();
                if is_retentive {
                    // R is TRUE for this call alone.
                    self.resume(LadderLogic::Wire);
                    self.output(coil(CoilKind::Negated, member(name, "R", at)));
                    self.flush();
                }
            }
            Some(TagKind::Timer(None, _) | TagKind::Elementary(_)) => {
                self.refuse(at, format!("`{name}` is no timer or counter of a rung above"), "put RES below its timer");
            }
            None => {}
        }
        self.resume(power);
    }
}
