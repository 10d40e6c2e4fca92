//! Lowers labels, jumps and subprograms to jumps of the intermediate code.
//!
//! A call sets a bit of its own and jumps to the subprogram, whose end jumps back to the call whose bit is
//! set. So a call needs no stack, and works on every target. Subprograms do not call themselves, so each bit
//! is needed once.

use std::collections::HashMap;

use ladder::flow::{ProgramFlow, Subprogram};
use ladder::il::IlAction;
use ladder::{Element, ElementId, FlowOp, ProgramElement};

use super::{Lowering, if_accumulator};
use crate::ir::{
    ArithmeticOp, BitId, BitRole, BranchCondition, IrOp, JumpKind, LabelId, MAX_JUMPS_BACK, RelationOp, WordComparison,
    WordId, WordOperand, WordRole,
};

/// A GOSUB: the bit that it sets, and the position behind it.
type CallSite = (BitId, LabelId);

/// Labels and cells of the jumps of a program.
pub(super) struct JumpPlan<'a> {
    flow: ProgramFlow<'a>,
    /// By the index of a rung, where jumps go to its start; the number of rungs is the end.
    rungs: HashMap<u32, LabelId>,
    /// By the first rung of a subprogram: all its calls, in order of the text.
    calls: HashMap<u32, Vec<CallSite>>,
    /// By the rung of a GOSUB and its place among those of the rung.
    sites: HashMap<(u32, u32), CallSite>,
    /// By the first rung of a subprogram, where it ends: before and behind the jumps back.
    ends: HashMap<u32, (LabelId, LabelId)>,
    /// Number of jumps back that the scan may still take.
    left: Option<WordId>,
    /// Set once LOCK has stopped the program.
    lock: Option<BitId>,
    /// For each UART_RECV that holds the scan: the element, its bit that is 1 while it does, and the label at
    /// which the scan goes on.
    holds: Vec<HeldScan>,
    labels: u32,
}

/// An UART_RECV that holds the scan until its bytes have come.
#[derive(Debug, Clone, Copy)]
pub(super) struct HeldScan {
    element: ElementId,
    /// 1 while it holds the scan.
    pub bit: BitId,
    /// Where the scan goes on.
    pub resume: LabelId,
    /// Behind the element.
    pub behind: LabelId,
    /// The end of the scan.
    pub end: LabelId,
}

impl JumpPlan<'_> {
    fn label(&mut self) -> LabelId {
        self.labels += 1;
        LabelId(self.labels - 1)
    }

    /// The bits that are 1 while an element holds the scan.
    pub(super) fn held_bits(&self) -> Vec<BitId> {
        self.holds.iter().map(|held| held.bit).collect()
    }

    /// The subprogram that contains a rung, by its first rung.
    pub(super) fn subprogram(&self, rung: u32) -> Option<u32> {
        self.flow.subprogram_around(rung).map(|sub| sub.first)
    }
}

impl<'a> Lowering<'a> {
    /// Gives labels to all targets of jumps; nothing if the program has none.
    pub(super) fn plan_jumps(&mut self) {
        let flow = ProgramFlow::new(self.program);
        let holds_scan = |element: &Element| match element {
            Element::UartRecv { rest, .. } => rest.is_some_and(|rest| rest.holds_scan()),
            _ => false,
        };
        if !flow.is_used && !self.program.elements().any(|found| holds_scan(found.element)) {
            return;
        }
        let mut plan = JumpPlan {
            flow,
            rungs: HashMap::new(),
            calls: HashMap::new(),
            sites: HashMap::new(),
            ends: HashMap::new(),
            left: None,
            lock: None,
            holds: Vec::new(),
            labels: 0,
        };
        let end = self.program.rungs.len() as u32;
        for ProgramElement { id, element, .. } in self.program.elements() {
            let target = match element {
                Element::Return => Some(end),
                Element::Lock => {
                    if plan.lock.is_none() {
                        plan.lock = Some(self.new_bit("locked".to_owned(), BitRole::Memory));
                    }
                    Some(end)
                }
                Element::Flow { op: FlowOp::Goto, label } => plan.flow.target(label),
                Element::Flow { op: FlowOp::Subprogram, label } => {
                    let ends = (plan.label(), plan.label());
                    plan.ends.insert(id.rung, ends);
                    // The body of a subprogram begins with the next rung.
                    plan.flow.subprogram(label).map(|sub| sub.first + 1)
                }
                Element::Flow { op: FlowOp::Gosub, label } => {
                    let Some(sub) = plan.flow.subprogram(label) else { continue };
                    let name = format!("call({}.{})", id.rung + 1, id.index + 1);
                    let site = (self.new_bit(name, BitRole::Memory), plan.label());
                    plan.calls.entry(sub.first).or_default().push(site);
                    plan.sites.insert((id.rung, id.index), site);
                    None
                }
                Element::Instruction(step) => match step.action {
                    IlAction::Jump { target, .. } => Some(target),
                    IlAction::Return(_) => Some(end),
                    _ => None,
                },
                element if holds_scan(element) => {
                    let bit = self.new_bit(format!("holds({}.{})", id.rung + 1, id.index + 1), BitRole::Memory);
                    let (resume, behind) = (plan.label(), plan.label());
                    plan.holds.push(HeldScan { element: id, bit, resume, behind, end: behind });
                    Some(end)
                }
                // No other element jumps.
                _ => None,
            };
            let Some(target) = target else { continue };
            if is_jump(element) && target <= id.rung && plan.left.is_none() {
                plan.left = Some(self.new_word_cell("jumps left".to_owned(), WordRole::Memory, 1, 0));
            }
            if !plan.rungs.contains_key(&target) {
                let label = plan.label();
                plan.rungs.insert(target, label);
            }
        }
        if let Some(&to) = plan.rungs.get(&end) {
            plan.holds.iter_mut().for_each(|held| held.end = to);
        }
        self.jumps = Some(plan);
    }

    /// The label at the start of a rung, if a jump goes there.
    ///
    /// What is done once in a scan comes before the label of the first rung, so that no jump leads to the
    /// first instruction of the rungs, which tells tools that a scan begins.
    pub(super) fn place_rung_label(&mut self, rung: u32) {
        if let Some(plan) = self.jumps.as_ref().filter(|_| rung == 0) {
            let end = plan.rungs.get(&(self.program.rungs.len() as u32)).copied();
            let left = plan.left.map(|dst| IrOp::Move { dst, src: WordOperand::Const(MAX_JUMPS_BACK.into()) });
            let lock = plan.lock.zip(end).map(|(bit, to)| IrOp::If {
                cond: BranchCondition::Bit(bit),
                if_true: vec![IrOp::Jump { to, kind: JumpKind::Forward }],
                if_false: Vec::new(),
            });
            let held = plan.holds.iter().map(|held| IrOp::If {
                cond: BranchCondition::Bit(held.bit),
                if_true: vec![IrOp::Jump { to: held.resume, kind: JumpKind::Forward }],
                if_false: Vec::new(),
            });
            let ops: Vec<IrOp> = left.into_iter().chain(lock).chain(held).collect();
            self.push_all(ops);
        }
        if let Some(label) = self.jumps.as_ref().and_then(|plan| plan.rungs.get(&rung)) {
            self.push(IrOp::Label(*label));
        }
    }

    /// LABEL, GOTO, GOSUB, SUBPROG and ENDSUB. Every jump leaves the accumulator undefined.
    pub(super) fn flow(&mut self, op: FlowOp, label: &str) {
        let rung = self.element.rung;
        let Some(plan) = &self.jumps else { return };
        match op {
            FlowOp::Label => {}
            FlowOp::Goto => {
                let target = plan.flow.target(label).unwrap_or(rung + 1);
                let (Some(&to), left) = (plan.rungs.get(&target), plan.left) else { return };
                let jump = match left.filter(|_| target <= rung) {
                    Some(left) => counted_jump(left, to),
                    None => IrOp::Jump { to, kind: JumpKind::Forward },
                };
                self.push(if_accumulator(vec![jump]));
                self.push(IrOp::SetAccumulator(false));
            }
            FlowOp::Gosub => {
                let Some(sub) = plan.flow.subprogram(label) else { return };
                let site = plan.sites.get(&(rung, self.element.index));
                let (Some(&(bit, back)), Some(&to), Some(&(_, end))) =
                    (site, plan.rungs.get(&(sub.first + 1)), plan.ends.get(&sub.first))
                else {
                    return;
                };
                self.push(IrOp::Store { bit, negated: false });
                self.push(if_accumulator(vec![IrOp::Jump { to, kind: JumpKind::Call { end, back } }]));
                self.push(IrOp::Label(back));
                self.push(IrOp::Load { bit, negated: false });
                self.push(IrOp::SetBit { bit, value: false });
            }
            FlowOp::Subprogram => {
                let Some(&(_, to)) = plan.ends.get(&rung) else { return };
                self.push(IrOp::Jump { to, kind: JumpKind::Forward });
            }
            FlowOp::EndSubprogram => {
                let Some(Subprogram { first, .. }) = plan.flow.subprogram_around(rung) else { return };
                let Some(&(before, behind)) = plan.ends.get(&first) else { return };
                let calls = plan.calls.get(&first).cloned().unwrap_or_default();
                self.push(IrOp::Label(before));
                // The last call needs no test.
                if let Some((&(_, last), others)) = calls.split_last() {
                    for &(bit, back) in others {
                        let back = IrOp::Jump { to: back, kind: JumpKind::Return };
                        self.push(IrOp::If {
                            cond: BranchCondition::Bit(bit),
                            if_true: vec![back],
                            if_false: Vec::new(),
                        });
                    }
                    self.push(IrOp::Jump { to: last, kind: JumpKind::Return });
                }
                self.push(IrOp::Label(behind));
                self.push(IrOp::SetAccumulator(false));
            }
        }
    }

    /// The operations of a jump to the start of a rung, and whether it goes back.
    pub(super) fn jump_to_rung(&self, target: u32) -> Option<(Vec<IrOp>, bool)> {
        let plan = self.jumps.as_ref()?;
        let (to, is_back) = (*plan.rungs.get(&target)?, target <= self.element.rung);
        Some(match plan.left.filter(|_| is_back) {
            Some(left) => (vec![counted_jump(left, to)], true),
            None => (vec![IrOp::Jump { to, kind: JumpKind::Forward }], false),
        })
    }

    /// The current element, if it is an UART_RECV that holds the scan.
    pub(super) fn held_scan(&self) -> Option<HeldScan> {
        self.jumps.as_ref()?.holds.iter().find(|held| held.element == self.element).copied()
    }

    /// True if an element holds the scan, so that a later one needs what it has computed.
    pub(super) fn has_held_scans(&self) -> bool {
        self.jumps.as_ref().is_some_and(|plan| !plan.holds.is_empty())
    }

    /// LOCK: to the end of the scan, and no further scan executes anything.
    pub(super) fn lock(&mut self) {
        let Some(plan) = &self.jumps else { return };
        let end = plan.rungs.get(&(self.program.rungs.len() as u32)).copied();
        if let (Some(bit), Some(to)) = (plan.lock, end) {
            let stop = vec![IrOp::SetBit { bit, value: true }, IrOp::Jump { to, kind: JumpKind::Forward }];
            self.push(if_accumulator(stop));
            self.push(IrOp::SetAccumulator(false));
        }
    }

    /// RETURN: to the end of the subprogram, or of the scan.
    pub(super) fn return_from_subprogram(&mut self) {
        let rung = self.element.rung;
        let Some(plan) = &self.jumps else { return };
        let end = plan.subprogram(rung).and_then(|first| plan.ends.get(&first)).map(|(before, _)| *before);
        if let Some(to) = end.or_else(|| plan.rungs.get(&(self.program.rungs.len() as u32)).copied()) {
            self.push(if_accumulator(vec![IrOp::Jump { to, kind: JumpKind::Forward }]));
            self.push(IrOp::SetAccumulator(false));
        }
    }
}

/// Whether an element jumps to the start of a rung that it names.
fn is_jump(element: &Element) -> bool {
    match element {
        Element::Flow { op: FlowOp::Goto, .. } => true,
        Element::Instruction(step) => matches!(step.action, IlAction::Jump { .. }),
        // Nothing else names where it goes.
        _ => false,
    }
}

/// A jump back, as long as the scan may take one.
fn counted_jump(left: WordId, to: LabelId) -> IrOp {
    let one = WordOperand::Const(1);
    let count = IrOp::Math { op: ArithmeticOp::Sub, dst: left, a: WordOperand::Cell(left), b: one };
    IrOp::If {
        cond: BranchCondition::Compare(WordComparison { a: left, rel: RelationOp::Ge, b: one }),
        if_true: vec![count, IrOp::Jump { to, kind: JumpKind::Back }],
        if_false: Vec::new(),
    }
}
