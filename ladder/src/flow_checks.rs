//! Checks of labels, jumps and subprograms.

use std::collections::HashMap;

use diag::Severity;

use crate::check::Checker;
use crate::codes;
use crate::element_facts::PowerEffect;
use crate::flow::{MAX_CALL_DEPTH, MAX_EXECUTED, MAX_JUMPS_BACK, ProgramFlow};
use crate::model::{Element, ElementId, FlowOp, LadderProgram, ProgramElement, RungNode};

/// Reports names that lead nowhere, subprograms that are not well formed, and loops without an end.
pub(crate) fn check_flow(checker: &mut Checker<'_>) {
    let program = checker.program;
    let flow = ProgramFlow::new(program);
    if !flow.is_used {
        return;
    }
    check_names(checker);
    check_subprogram_ends(checker);
    for at in program.elements() {
        match at.element {
            Element::Flow { op: FlowOp::Goto, label } => check_goto(checker, at, &flow, label),
            Element::Flow { op: FlowOp::Gosub, label } if flow.subprogram(label).is_none() => {
                let cause = format!("there is no SUBPROG {label} with an ENDSUB {label}");
                checker.error(codes::NO_TARGET, at, cause, "add it, or correct the name");
            }
            Element::Return if flow.subprogram_around(at.id.rung).is_none() => {
                let cause =
                    "not in a subprogram: it ends the scan here and in the C of LDmicro 5, whose chips run away";
                checker.warning(codes::RETURN_OUTSIDE, at, cause, "write GOTO with a number beyond the last rung");
            }
            // Other elements do not change the order of execution.
            _ => {}
        }
    }
    check_calls(checker, &flow);
}

/// Reports names that several labels, or several subprograms, share.
fn check_names(checker: &mut Checker<'_>) {
    let program = checker.program;
    let mut first: HashMap<(bool, &str), ElementId> = HashMap::new();
    for at in program.elements() {
        let Element::Flow { op: op @ (FlowOp::Label | FlowOp::Subprogram), label } = at.element else { continue };
        if let Some(other) = first.get(&(*op == FlowOp::Label, label)) {
            let cause = format!("{label} has this name already ({other})");
            checker.error(codes::LABEL_TWICE, at, cause, "choose another name");
        } else {
            first.insert((*op == FlowOp::Label, label), at.id);
        }
    }
}

/// Reports SUBPROG and ENDSUB that are not alone in their rungs, or do not pair.
fn check_subprogram_ends(checker: &mut Checker<'_>) {
    let program = checker.program;
    let mut open: Option<(ProgramElement<'_>, &str)> = None;
    for at in program.elements() {
        let Element::Flow { op: op @ (FlowOp::Subprogram | FlowOp::EndSubprogram), label } = at.element else {
            continue;
        };
        let series = program.rungs.get(at.id.rung as usize).map_or(&[][..], |rung| &rung.series);
        if series.iter().filter(|node| !matches!(node, RungNode::Leaf(Element::Comment(_), _))).count() > 1 {
            checker.error(codes::SUBPROGRAM_ENDS, at, "it is not alone in its rung", "give it a rung of its own");
        }
        match (op, open.take()) {
            (FlowOp::Subprogram, outer) => {
                if let Some((_, outer)) = outer {
                    let cause = format!("the subprogram {outer} has not ended");
                    checker.error(codes::SUBPROGRAM_ENDS, at, cause, format!("write ENDSUB {outer} before it"));
                }
                open = Some((at, label));
            }
            (_, Some((_, name))) if name == label => {}
            (_, Some((_, name))) => {
                let cause = format!("the subprogram that ends here is {name}");
                checker.error(codes::SUBPROGRAM_ENDS, at, cause, format!("write ENDSUB {name}"));
            }
            (_, None) => {
                checker.error(codes::SUBPROGRAM_ENDS, at, "no subprogram begins before it", "write SUBPROG above it");
            }
        }
    }
    if let Some((at, name)) = open {
        checker.error(codes::SUBPROGRAM_ENDS, at, "the subprogram has no end", format!("write ENDSUB {name} below it"));
    }
}

fn check_goto(checker: &mut Checker<'_>, at: ProgramElement<'_>, flow: &ProgramFlow<'_>, label: &str) {
    let Some(target) = flow.target(label) else {
        let cause = format!("there is no LABEL {label}");
        return checker.error(codes::NO_TARGET, at, cause, "add it, or correct the name");
    };
    // At SUBPROG itself the subprogram has not begun.
    let (from, to) = (flow.subprogram_around(at.id.rung), flow.subprogram_around(target));
    if from != to {
        let cause = "it goes into a subprogram, or out of one";
        let hint = "call a subprogram with GOSUB, and leave it with RETURN";
        return checker.error(codes::JUMP_ACROSS, at, cause, hint);
    }
    if target > at.id.rung {
        return;
    }
    let program = checker.program;
    if !is_unconditional(program, at.id) {
        let cause =
            format!("it jumps back: a scan takes at most {MAX_JUMPS_BACK} jumps back, then the next is not taken");
        return checker.report(Severity::Note, codes::JUMP_BACK, at, &cause, "nothing to do if the loop ends before");
    }
    let leaves = |id: ElementId, element: &Element| match element {
        Element::Return => true,
        Element::Flow { op: FlowOp::Goto, label } => {
            id != at.id && flow.target(label).is_some_and(|to| to > at.id.rung || to < target)
        }
        // Execution goes on after every other element.
        _ => false,
    };
    let is_left = program.elements().any(|ProgramElement { id, element, .. }| {
        (target..=at.id.rung).contains(&id.rung) && id < at.id && leaves(id, element)
    });
    let cause = "the loop has no end: the jump back has no condition, and nothing leaves the loop before it";
    if !is_left {
        checker.error(codes::ENDLESS_LOOP, at, cause, "put a condition before it");
    }
}

/// True if nothing before the element in its rung can block it.
fn is_unconditional(program: &LadderProgram, id: ElementId) -> bool {
    let masters = program.elements().any(|ProgramElement { element, .. }| matches!(element, Element::MasterRelay));
    let series = program.rungs.get(id.rung as usize).map_or(&[][..], |rung| &rung.series);
    let before = series.iter().take(id.index as usize);
    let passes = |node: &RungNode| match node {
        RungNode::Leaf(element, _) => {
            matches!(element.facts().power, PowerEffect::NoWire | PowerEffect::Wire | PowerEffect::Acts)
        }
        RungNode::Parallel(..) => false,
    };
    !masters && matches!(series.get(id.index as usize), Some(RungNode::Leaf(..))) && before.into_iter().all(passes)
}

/// Reports subprograms that call themselves, and calls that nest too deep or multiply too much.
fn check_calls(checker: &mut Checker<'_>, flow: &ProgramFlow<'_>) {
    let program = checker.program;
    let (depths, mut is_sound) = (flow.call_depths(), true);
    let calls = || program.elements().filter(|at| matches!(at.element, Element::Flow { op: FlowOp::Gosub, .. }));
    for at in calls() {
        let Element::Flow { label, .. } = at.element else { continue };
        let depth = depths.get(label.as_str()).copied().unwrap_or(0);
        if depth > flow.subprograms.len() {
            let cause = format!("the subprogram {label} calls itself, or calls one that does");
            checker.error(codes::RECURSION, at, cause, "write a loop with GOTO");
        } else if depth > MAX_CALL_DEPTH {
            let cause = format!("{depth} subprograms are active at the same time, at most {MAX_CALL_DEPTH} may be");
            checker.error(codes::RECURSION, at, cause, "let a subprogram call fewer levels of others");
        }
        is_sound &= depth <= MAX_CALL_DEPTH.min(flow.subprograms.len());
    }
    if let Some(at) = calls().next().filter(|_| is_sound && flow.executed_elements() > MAX_EXECUTED) {
        let cause =
            format!("with all calls a scan executes {} elements, at most {MAX_EXECUTED}", flow.executed_elements());
        checker.error(codes::RECURSION, at, cause, "let subprograms that call others be called less often");
    }
}
