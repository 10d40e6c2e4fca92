//! Labels and subprograms of a program: which rungs their names stand for.

use std::collections::HashMap;

use crate::il::IlAction;
use crate::model::{Element, FlowOp, LadderProgram, ProgramElement};

/// Maximum number of jumps back that one scan takes; a further one is not taken.
///
/// LDmicro has no such limit: a loop that does not end stops its chip.
pub const MAX_JUMPS_BACK: u8 = 100;

/// Maximum number of subprograms that are active at the same time, as on the stack of a PIC16.
pub const MAX_CALL_DEPTH: usize = 8;

/// Maximum number of elements that a scan may execute without jumps back: calls in calls multiply.
pub const MAX_EXECUTED: u64 = 1_000_000;

/// A subprogram, by the indices of its rungs, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Subprogram<'a> {
    /// Its name.
    pub name: &'a str,
    /// The rung of its SUBPROG.
    pub first: u32,
    /// The rung of its ENDSUB.
    pub last: u32,
}

impl Subprogram<'_> {
    /// True if `rung` is in the body, which ends with the rung of ENDSUB.
    #[must_use]
    pub const fn contains(&self, rung: u32) -> bool {
        self.first < rung && rung <= self.last
    }
}

/// Where the names of a program lead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramFlow<'a> {
    /// Index of the rung of each label; of several labels of one name the first counts.
    labels: HashMap<&'a str, u32>,
    /// All subprograms, in order.
    pub subprograms: Vec<Subprogram<'a>>,
    /// Each GOSUB: the subprogram that contains it, and the one that it calls.
    calls: Vec<(Option<&'a str>, &'a str)>,
    /// Number of elements of the main program (without a name) and of each subprogram.
    sizes: HashMap<Option<&'a str>, u64>,
    /// Number of rungs of the program.
    rungs: u32,
    /// True if the program has an element of this kind.
    pub is_used: bool,
}

/// Whether an element can change the order in which a scan executes the elements.
#[must_use]
pub fn changes_order(element: &Element) -> bool {
    match element {
        Element::Flow { .. } | Element::Return | Element::Lock => true,
        Element::Instruction(step) => matches!(step.action, IlAction::Jump { .. } | IlAction::Return(_)),
        // The scan continues with the element behind all others.
        _ => false,
    }
}

impl<'a> ProgramFlow<'a> {
    /// Collects the labels and subprograms of a program.
    #[must_use]
    pub fn new(program: &'a LadderProgram) -> ProgramFlow<'a> {
        let mut flow = ProgramFlow {
            labels: HashMap::new(),
            subprograms: Vec::new(),
            calls: Vec::new(),
            sizes: HashMap::new(),
            rungs: program.rungs.len() as u32,
            is_used: false,
        };
        let mut open: Option<(&str, u32)> = None;
        for ProgramElement { id, element, .. } in program.elements() {
            flow.is_used |= changes_order(element);
            let Element::Flow { op, label } = element else { continue };
            match (op, open) {
                (FlowOp::Label, _) => _ = flow.labels.entry(label).or_insert(id.rung),
                (FlowOp::Subprogram, _) => open = Some((label, id.rung)),
                (FlowOp::EndSubprogram, Some((name, first))) if name == label => {
                    flow.subprograms.push(Subprogram { name, first, last: id.rung });
                    open = None;
                }
                _ => {}
            }
        }
        for ProgramElement { id, element, .. } in program.elements().take(if flow.is_used { usize::MAX } else { 0 }) {
            let around = flow.subprogram_around(id.rung).map(|sub| sub.name);
            *flow.sizes.entry(around).or_default() += 1;
            if let Element::Flow { op: FlowOp::Gosub, label } = element {
                flow.calls.push((around, label));
            }
        }
        flow
    }

    /// How many subprograms are active at the same time while each is: 1 if it calls none, and more than
    /// there are subprograms if it calls itself, directly or through others.
    #[must_use]
    pub fn call_depths(&self) -> HashMap<&'a str, usize> {
        let most = self.subprograms.len();
        let mut depths: HashMap<&str, usize> = self.subprograms.iter().map(|sub| (sub.name, 1)).collect();
        // In a circle of calls the depth rises with every round.
        let mut rises = true;
        while std::mem::take(&mut rises) {
            for (caller, callee) in &self.calls {
                let deep = depths.get(callee).map_or(0, |depth| depth + 1);
                if let Some(depth) = caller.and_then(|caller| depths.get_mut(caller))
                    && *depth < deep
                    && *depth <= most
                {
                    (*depth, rises) = (deep, true);
                }
            }
        }
        depths
    }

    /// Maximum number of elements that a scan executes if it takes no jump back. Calls must not nest deeper
    /// than [`MAX_CALL_DEPTH`].
    #[must_use]
    pub fn executed_elements(&self) -> u64 {
        // After as many rounds as calls may nest, the number of each is complete.
        let mut all = self.sizes.clone();
        for _ in 0..=MAX_CALL_DEPTH {
            let mut next = self.sizes.clone();
            for (caller, callee) in &self.calls {
                let called = all.get(&Some(*callee)).copied().unwrap_or(0);
                let sum = next.entry(*caller).or_default();
                *sum = sum.saturating_add(called);
            }
            all = next;
        }
        all.get(&None).copied().unwrap_or(0)
    }

    /// Index of the rung to which `GOTO label` goes; the number of rungs is the end of the scan.
    #[must_use]
    pub fn target(&self, label: &str) -> Option<u32> {
        let number = || label.parse::<u32>().ok().map(|number| (number.max(1) - 1).min(self.rungs));
        self.labels.get(label).copied().or_else(number)
    }

    /// The subprogram of this name; the first of several.
    #[must_use]
    pub fn subprogram(&self, name: &str) -> Option<Subprogram<'a>> {
        self.subprograms.iter().find(|sub| sub.name == name).copied()
    }

    /// The subprogram whose body contains the rung.
    #[must_use]
    pub fn subprogram_around(&self, rung: u32) -> Option<Subprogram<'a>> {
        self.subprograms.iter().find(|sub| sub.contains(rung)).copied()
    }
}
