//! Calls of standard blocks as rungs of LDmicro.

use crate::il::{IlParameter, LadderBlock, StandardBlock};
use crate::model::{CompareOp, Element, LadderOperand, MathOp, RungNode, TimerKind};

use super::ldmicro::{LdBuilder, constant};
use super::ldmicro_networks::{coil, contact};

/// Longest delay of LDmicro in microseconds.
const MAX_DELAY_US: i64 = i32::MAX as i64;

impl LdBuilder<'_> {
    /// Converts a call whose condition is always.
    pub(super) fn block(&mut self, call: &LadderBlock) {
        let instance = call.instance.text.clone();
        if !self.is_called_once(&instance) {
            let cause = format!("`{instance}` is called in several lines");
            return self.refuse(self.pos, cause, "call each instance once");
        }
        let preset = call.block.preset().map(|part| part.name);
        let mut value = None;
        for parameter in &call.parameters {
            let IlParameter::Input { name, value: operand } = parameter else { continue };
            if Some(name.text.to_ascii_uppercase().as_str()) == preset {
                value = self.literal_value(operand);
                if value.is_none() {
                    let cause = format!("the preset of `{instance}` is a variable");
                    return self.refuse(self.pos, cause, "give a constant");
                }
                continue;
            }
            let Some(condition) = self.bit(operand) else {
                let cause = format!("the input `{}` of `{instance}` has no BOOL", name.text);
                return self.refuse(self.pos, cause, "give a BOOL variable or a literal");
            };
            let target = coil(self.part(&instance, &name.text));
            self.rung([condition, target]);
        }
        if let Some(part) = preset.filter(|part| self.is_used(&format!("{instance}.{part}"))) {
            let cause = format!("`{instance}.{part}` is used apart from the call");
            return self.refuse(self.pos, cause, "use a variable of your own");
        }
        self.execute(call.block, &instance, value.unwrap_or(0));
        for parameter in &call.parameters {
            let IlParameter::Output { negated, name, target } = parameter else { continue };
            self.copy_output(&instance, &name.text, *negated, target);
        }
    }

    /// Returns the name of a part of an instance.
    fn part(&self, instance: &str, part: &str) -> String {
        self.name_of(&format!("{instance}.{part}"))
    }

    fn copy_output(&mut self, instance: &str, part: &str, negated: bool, target: &crate::il::IlOperand) {
        let Some((target, _)) = self.symbol_of(target) else { return };
        let (from, to) = (self.part(instance, part), self.name_of(&target));
        if part.eq_ignore_ascii_case("CV") {
            self.rung([Element::Move { dest: to, src: LadderOperand::Var(from) }]);
        } else if part.eq_ignore_ascii_case("ET") {
            let cause = format!("`{instance}.ET` is a time, and LDmicro's timers count scans");
            self.refuse(self.pos, cause, "compare with the output Q");
        } else {
            self.rung([contact(from, negated), coil(to)]);
        }
    }

    fn execute(&mut self, block: StandardBlock, instance: &str, preset: i64) {
        let part = |builder: &Self, name: &str| builder.part(instance, name);
        match block {
            StandardBlock::Ton => self.timer(TimerKind::Ton, instance, preset),
            StandardBlock::Tof => self.timer(TimerKind::Tof, instance, preset),
            StandardBlock::Tp => self.timer(TimerKind::Thi, instance, preset),
            StandardBlock::Tona | StandardBlock::Tofa => {
                let cause = format!("LDmicro has no timer like {}", block.keyword());
                self.refuse(self.pos, cause, "use TON, TOF or TP");
            }
            StandardBlock::Ctu | StandardBlock::Ctd | StandardBlock::Ctud => self.counter(block, instance, preset),
            StandardBlock::RTrig => {
                self.begin_with_input(instance, "CLK");
                self.push(Element::Osr);
                self.push(coil(part(self, "Q")));
                self.end_rung();
            }
            StandardBlock::FTrig => {
                let (clock, output) = (part(self, "CLK"), part(self, "Q"));
                self.rung([contact(clock, true), Element::Osr, coil(output)]);
            }
            StandardBlock::Sr => {
                let (set, reset, output) = (part(self, "S1"), part(self, "R"), part(self, "Q1"));
                let keep = vec![contact(output.clone(), false), contact(reset, true)];
                let group = self.parallel([vec![contact(set, false)], keep]);
                self.end_rung();
                self.push_node(group);
                self.push(coil(output));
                self.end_rung();
            }
            StandardBlock::Rs => {
                let (set, reset, output) = (part(self, "S"), part(self, "R1"), part(self, "Q1"));
                let group = self.parallel([vec![contact(set, false)], vec![contact(output.clone(), false)]]);
                self.end_rung();
                self.push(contact(reset, true));
                self.push_node(group);
                self.push(coil(output));
                self.end_rung();
            }
        }
    }

    fn parallel(&self, branches: [Vec<Element>; 2]) -> RungNode {
        let leaves =
            |branch: Vec<Element>| branch.into_iter().map(|element| RungNode::Leaf(element, self.pos)).collect();
        RungNode::Parallel(branches.into_iter().map(leaves).collect(), self.pos)
    }

    /// A timer counts as many scans as its delay takes, rounded up.
    fn timer(&mut self, kind: TimerKind, instance: &str, milliseconds: i64) {
        if !self.is_steady() {
            let cause =
                format!("`{instance}` counts time also while a jump passes its call over; LDmicro's timers do not");
            return self.refuse(self.pos, cause, "call the timer where no jump passes over it");
        }
        if self.is_used(&format!("{instance}.ET")) {
            let cause = format!("`{instance}.ET` is a time, and LDmicro's timers count scans");
            return self.refuse(self.pos, cause, "compare with the output Q");
        }
        let Some(cycle) = i64::try_from(self.cycle_us()).ok().filter(|cycle| *cycle > 0) else { return };
        let microseconds = milliseconds.max(0).saturating_mul(1000);
        let delay = microseconds.saturating_add(cycle - 1) / cycle * cycle;
        if delay > MAX_DELAY_US {
            let cause = format!("the delay of `{instance}` is longer than 2147 s");
            return self.refuse(self.pos, cause, "count minutes with a counter");
        }
        let stem = if instance.starts_with('T') { instance.to_owned() } else { format!("T{instance}") };
        let name = self.free_name(&stem);
        self.begin_with_input(instance, "IN");
        self.push(Element::Timer { kind, name, delay: constant(delay), adjust: None });
        self.push(coil(self.part(instance, "Q")));
        self.end_rung();
    }

    /// Counters stop at the bounds of INT, and R acts before LD and LD before counting.
    fn counter(&mut self, block: StandardBlock, instance: &str, preset: i64) {
        let has = |name: &str| block.part(name).is_some();
        let count = self.part(instance, "CV");
        let variable = || LadderOperand::Var(count.clone());
        let math = |op| Element::Math { op, dest: count.clone(), op1: variable(), op2: constant(1) };
        let compare = |op, value| Element::Compare { op, op1: variable(), op2: constant(value) };
        let mut edges = Vec::new();
        for (input, op, bound) in
            [("CU", MathOp::Add, compare(CompareOp::Les, 32767)), ("CD", MathOp::Sub, compare(CompareOp::Grt, -32768))]
        {
            if has(input) {
                let edge = self.free_name(&format!("R{instance}_{input}_edge"));
                self.begin_with_input(instance, input);
                self.push(Element::Osr);
                self.push(coil(edge.clone()));
                self.end_rung();
                edges.push((edge, op, bound));
            }
        }
        for (index, (edge, op, bound)) in edges.iter().enumerate() {
            let other = edges.get(1 - index).map(|(other, ..)| contact(other.clone(), true));
            let elements = [Some(contact(edge.clone(), false)), other, Some(bound.clone()), Some(math(*op))];
            self.rung(elements.into_iter().flatten());
        }
        let store = |value| Element::Move { dest: count.clone(), src: constant(value) };
        if has("LD") {
            self.rung([contact(self.part(instance, "LD"), false), store(preset)]);
        }
        if has("R") {
            self.rung([contact(self.part(instance, "R"), false), store(0)]);
        }
        let outputs = match block {
            StandardBlock::Ctd => vec![("Q", compare(CompareOp::Leq, 0))],
            StandardBlock::Ctud => {
                vec![("QU", compare(CompareOp::Geq, preset)), ("QD", compare(CompareOp::Leq, 0))]
            }
            _ => vec![("Q", compare(CompareOp::Geq, preset))],
        };
        for (output, condition) in outputs {
            self.rung([condition, coil(self.part(instance, output))]);
        }
    }
}
