//! Rungs, groups, contacts, coils and edges as lines of Instruction List.

use crate::il::{IecType, IlBinaryOperand, IlBinaryOperator, IlBlockInput, IlName, IlOperation, StandardBlock};
use crate::model::{Element, FlowOp, RungNode};

use super::codes;
use super::emitter::{IlEmitter, RungBit};

/// Deepest parentheses of the result; deeper groups take relays in their place.
const MAX_PARENTHESES: usize = 40;

impl IlEmitter<'_> {
    /// Emits all rungs.
    pub(super) fn emit_program(&mut self) {
        self.prepare_scan();
        for (index, rung) in (0..).zip(&self.source.rungs) {
            self.pos = rung.pos;
            self.begin_rung();
            if let Some(label) = self.rung_labels.get(&index).cloned() {
                self.label(label);
            }
            let is_empty = rung.series.iter().all(|node| is_silent(node) || is_nothing(node));
            self.bit = RungBit::One;
            if let Some(master) = self.master.clone().filter(|_| !is_empty) {
                self.load_bit(&master);
            }
            self.series(&rung.series, false);
        }
    }

    /// Emits a series; `is_needed` says whether the rung bit behind it is needed.
    fn series(&mut self, series: &[RungNode], is_needed: bool) {
        let effects = match is_needed {
            true => series.len(),
            false => series.iter().rposition(|node| !is_silent(node) && !is_nothing(node)).map_or(0, |last| last + 1),
        };
        for (index, node) in series.iter().take(effects).enumerate() {
            let rest = series.get(index + 1..effects).unwrap_or_default();
            let is_needed = is_needed || !rest.iter().all(is_nothing);
            match node {
                RungNode::Leaf(element, pos) => {
                    self.pos = *pos;
                    self.element(element, is_needed);
                }
                RungNode::Parallel(branches, pos) => {
                    self.pos = *pos;
                    self.group(branches, is_needed);
                }
            }
        }
        let rest = series.get(effects..).unwrap_or_default();
        if let Some(node) = rest.iter().find(|node| !is_nothing(node)) {
            self.without_effect(node);
        }
        for node in rest {
            if let RungNode::Leaf(element, pos) = node
                && is_nothing(node)
            {
                self.pos = *pos;
                self.element(element, false);
            }
        }
    }

    /// Notes that nothing is behind a condition.
    fn without_effect(&mut self, node: &RungNode) {
        let (text, pos) = match node {
            RungNode::Leaf(element, pos) => (crate::element_text(element), *pos),
            RungNode::Parallel(_, pos) => ("PARALLEL".to_owned(), *pos),
        };
        let cause = format!("nothing is behind `{text}`, so it has no effect and is left out");
        self.note(codes::NO_EFFECT, pos, cause, "add a coil behind it");
    }

    fn group(&mut self, branches: &[Vec<RungNode>], is_needed: bool) {
        if branches.iter().flatten().all(is_coil) {
            // The rung bit passes through all of them, and none reads what another writes.
            self.ensure_loaded();
            branches.iter().for_each(|branch| self.series(branch, true));
        } else if branches.iter().flatten().all(|node| is_condition(node, 0)) {
            self.condition_group(branches);
        } else {
            self.acting_group(branches, is_needed);
        }
    }

    /// Emits a group whose branches have effects: each branch gets the rung bit of the group.
    fn acting_group(&mut self, branches: &[Vec<RungNode>], is_needed: bool) {
        let before = match self.bit {
            RungBit::One => None,
            RungBit::Loaded => Some(self.save()),
        };
        let mut sum: Option<String> = None;
        for (index, branch) in branches.iter().enumerate() {
            if !is_needed && branch.iter().all(|node| is_silent(node) || is_nothing(node)) {
                self.series(branch, false);
                continue;
            }
            match &before {
                Some(before) if index > 0 => self.load_bit(before),
                Some(_) => {}
                None => self.bit = RungBit::One,
            }
            self.series(branch, is_needed);
            if !is_needed {
                continue;
            }
            self.ensure_loaded();
            match &sum {
                Some(sum) => {
                    let target = self.variable(sum, None);
                    self.emit(IlOperation::Set(target));
                }
                None => sum = Some(self.save()),
            }
        }
        if let Some(sum) = sum {
            self.load_bit(&sum);
        }
    }

    /// Emits a group of conditions in series with the rung bit.
    fn condition_group(&mut self, branches: &[Vec<RungNode>]) {
        if self.bit == RungBit::One {
            return self.alternatives(branches);
        }
        self.open(IlBinaryOperator::And);
        self.bit = RungBit::One;
        self.alternatives(branches);
        self.emit(IlOperation::Close);
    }

    /// Emits the OR of branches of conditions, which begins with a load.
    fn alternatives(&mut self, branches: &[Vec<RungNode>]) {
        for (index, branch) in branches.iter().enumerate() {
            let contact = match branch.as_slice() {
                [RungNode::Leaf(Element::Contacts { name, negated, .. }, pos)] if index > 0 => {
                    Some((name, negated, pos))
                }
                _ => None,
            };
            if let Some((name, negated, pos)) = contact {
                self.pos = *pos;
                let operand = self.symbol(name);
                self.binary(IlBinaryOperator::Or, *negated, operand);
                continue;
            }
            if index > 0 {
                self.open(IlBinaryOperator::Or);
            }
            self.bit = RungBit::One;
            self.series(branch, true);
            self.ensure_loaded();
            if index > 0 {
                self.emit(IlOperation::Close);
            }
        }
    }

    /// Emits a condition: a load at the rail, else an AND.
    pub(super) fn condition(&mut self, operand: crate::il::IlOperand, negated: bool) {
        match self.bit {
            RungBit::One => self.load(operand, negated),
            RungBit::Loaded => self.binary(IlBinaryOperator::And, negated, operand),
        }
        self.bit = RungBit::Loaded;
    }

    fn element(&mut self, element: &Element, is_needed: bool) {
        match element {
            Element::Comment(text) => self.comment(text),
            Element::Contacts { name, negated, set1: _ } => {
                let operand = self.symbol(name);
                self.condition(operand, *negated);
            }
            Element::Short => {}
            Element::Open => {
                let zero = self.bool_literal(false);
                self.condition(zero, false);
            }
            Element::Coil { .. } => self.coil(element, is_needed),
            Element::MasterRelay => self.master_relay(is_needed),
            Element::Osr => self.rising_edge(false, is_needed),
            Element::Odr => self.rising_edge(true, is_needed),
            Element::Osf => self.falling_edge(is_needed),
            Element::Odf | Element::Osl => self.off_delay_edge(is_needed),
            Element::Osc => {
                let last = self.add_variable("Last", IecType::Bool);
                self.ensure_loaded();
                self.combine(IlBinaryOperator::And, true, &last);
                self.store(&last);
            }
            Element::Timer { .. } => self.timer(element, is_needed),
            Element::Counter { .. } => self.counter(element, is_needed),
            Element::Res { .. }
            | Element::Move { .. }
            | Element::Math { .. }
            | Element::Unary { .. }
            | Element::BitWrite { .. }
            | Element::LookUpTable { .. }
            | Element::TimeValue { .. } => self.if_powered(is_needed, |emitter| emitter.integer_element(element)),
            Element::ShiftRegister { name, stages } => self.shift_register(name, *stages, is_needed),
            Element::Compare { op, op1, op2 } => self.compare(*op, op1, op2),
            Element::BitTest { name, bit, value } => self.bit_test(name, bit, *value),
            Element::Flow { op: FlowOp::Label, .. } => {}
            Element::Flow { .. } | Element::Return | Element::Lock => self.flow(element, is_needed),
            Element::Delay { .. } | Element::Sleep | Element::ClearWatchdog | Element::Text { .. } => {
                let text = crate::element_text(element);
                let cause = format!("`{text}` has no effect and becomes a comment");
                self.note(codes::NO_EFFECT, self.pos, cause, "nothing to do");
                self.comment(&format!("without effect: {text}"));
            }
            Element::Placeholder
            | Element::Shift { .. }
            | Element::Bus { .. }
            | Element::Segments { .. }
            | Element::Random { .. }
            | Element::SeedRandom { .. }
            | Element::PiecewiseLinear { .. }
            | Element::ReadAdc { .. }
            | Element::SetPwm { .. }
            | Element::UartRecv { .. }
            | Element::UartSend { .. }
            | Element::UartRecvAvail
            | Element::UartSendReady
            | Element::Pulser { .. }
            | Element::Npulse { .. }
            | Element::NpulseOff
            | Element::Stepper { .. }
            | Element::QuadEncod { .. }
            | Element::BusTransfer(_)
            | Element::Persist { .. }
            | Element::FormattedString { .. }
            | Element::Instruction(_) => {
                let cause = format!("Instruction List has no element like `{}`", crate::element_text(element));
                self.refuse(cause, "remove the element, or keep the program in LDmicro's notation");
            }
        }
    }

    fn coil(&mut self, element: &Element, is_needed: bool) {
        let Element::Coil { name, negated, set, reset, ttrigger } = element else { return };
        self.ensure_loaded();
        let target = self.symbol(name);
        if *negated {
            self.emit(IlOperation::Store { negated: true, target });
        } else if *set {
            self.emit(IlOperation::Set(target));
        } else if *reset {
            self.emit(IlOperation::Reset(target));
        } else if ttrigger.is_some_and(|flag| flag != 0) {
            let saved = is_needed.then(|| self.save());
            let edge = self.edge();
            self.load_output(&edge, false);
            self.binary(IlBinaryOperator::Xor, false, target.clone());
            self.emit(IlOperation::Store { negated: false, target });
            if let Some(saved) = saved {
                self.load_bit(&saved);
            }
        } else {
            self.emit(IlOperation::Store { negated: false, target });
        }
    }

    /// Calls a new R_TRIG with the rung bit and returns its name.
    pub(super) fn edge(&mut self) -> String {
        self.ensure_loaded();
        let edge = self.add_variable("Edge", IecType::Block(StandardBlock::RTrig));
        let instance = IlName { text: edge.clone(), pos: self.pos };
        self.emit(IlOperation::BlockInput { input: IlBlockInput::Clk, instance });
        edge
    }

    /// OSR, and with `negated` ODR.
    fn rising_edge(&mut self, negated: bool, is_needed: bool) {
        let edge = self.edge();
        if is_needed {
            self.load_output(&edge, negated);
        }
    }

    /// OSF: unlike F_TRIG it does not pulse in the first scan.
    fn falling_edge(&mut self, is_needed: bool) {
        if !is_needed {
            return;
        }
        let last = self.add_variable("Last", IecType::Bool);
        let now = self.save();
        let pulse = self.scratch();
        self.load_not(&now);
        self.combine(IlBinaryOperator::And, false, &last);
        self.store(&pulse);
        self.load_bit(&now);
        self.store(&last);
        self.load_bit(&pulse);
    }

    /// ODF: 0 until the rung bit was 1 once, and in the first scan after a 1.
    fn off_delay_edge(&mut self, is_needed: bool) {
        if !is_needed {
            return;
        }
        let last = self.add_variable("Last", IecType::Bool);
        let once = self.add_variable("Once", IecType::Bool);
        let now = self.save();
        let out = self.scratch();
        self.load_bit(&once);
        self.combine(IlBinaryOperator::And, true, &last);
        self.combine(IlBinaryOperator::Or, false, &now);
        self.store(&out);
        self.load_bit(&now);
        self.store(&last);
        let target = self.variable(&once, None);
        self.emit(IlOperation::Set(target));
        self.load_bit(&out);
    }

    /// MASTER_RELAY: on if it is off, else the rung bit.
    fn master_relay(&mut self, is_needed: bool) {
        let Some(master) = self.master.clone() else { return };
        let saved = is_needed.then(|| self.save());
        self.ensure_loaded();
        self.combine(IlBinaryOperator::Or, true, &master);
        self.store(&master);
        if let Some(saved) = saved {
            self.load_bit(&saved);
        }
    }

    /// Opens `operator(` and loads.
    pub(super) fn open_load(&mut self, operator: IlBinaryOperator, operand: crate::il::IlOperand) {
        let operand = IlBinaryOperand::Deferred(Some(operand));
        self.emit(IlOperation::Binary { operator, negated: false, operand });
    }
}

/// Whether the rung bit passes and nothing is read: a coil without an edge, or nothing.
fn is_coil(node: &RungNode) -> bool {
    match node {
        RungNode::Leaf(Element::Coil { ttrigger, .. }, _) => ttrigger.is_none_or(|flag| flag == 0),
        RungNode::Leaf(Element::Short | Element::Comment(_), _) => true,
        RungNode::Leaf(..) | RungNode::Parallel(..) => false,
    }
}

/// Whether nothing is emitted for the node, or only a comment.
fn is_nothing(node: &RungNode) -> bool {
    match node {
        RungNode::Leaf(element, _) => matches!(
            element,
            Element::Comment(_)
                | Element::Short
                | Element::Delay { .. }
                | Element::Sleep
                | Element::ClearWatchdog
                | Element::Text { .. }
                | Element::Flow { op: FlowOp::Label, .. }
        ),
        RungNode::Parallel(branches, _) => branches.iter().flatten().all(is_nothing),
    }
}

/// Whether the node has no effect if nothing is behind it: a condition or an edge.
fn is_silent(node: &RungNode) -> bool {
    match node {
        RungNode::Leaf(element, _) => {
            let is_edge = matches!(
                element,
                Element::Osr | Element::Osf | Element::Odr | Element::Odf | Element::Osl | Element::Osc
            );
            is_edge || is_condition(node, 0)
        }
        RungNode::Parallel(branches, _) => branches.iter().flatten().all(is_silent),
    }
}

/// Whether the node has no effect besides the rung bit, so that it can be between parentheses.
fn is_condition(node: &RungNode, depth: usize) -> bool {
    match node {
        RungNode::Leaf(element, _) => matches!(
            element,
            Element::Contacts { .. }
                | Element::Compare { .. }
                | Element::BitTest { .. }
                | Element::Short
                | Element::Open
        ),
        RungNode::Parallel(branches, _) => {
            depth < MAX_PARENTHESES && branches.iter().flatten().all(|node| is_condition(node, depth + 2))
        }
    }
}
