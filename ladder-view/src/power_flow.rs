//! Finds the elements through which power reached a position in a rung, or which blocked it.

use ladder::il::{IlAction, IlBinaryOperator, IlStep};
use ladder::{Element, ElementId, LadderProgram, PowerEffect, Rung, RungNode};
use ladder_eval::ElementPower;

use crate::scan_follower::FollowedScan;

/// An element that determined the power after it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PowerDecider<'a> {
    pub id: ElementId,
    pub element: &'a Element,
    /// True if it passed power, false if it blocked it.
    pub passed_power: bool,
}

/// Returns the elements that determined the power at element `to`: those on the path from the left rail that
/// passed it, or those that blocked it.
pub(crate) fn deciders<'a>(program: &'a LadderProgram, scan: &FollowedScan, to: ElementId) -> Vec<PowerDecider<'a>> {
    let Some(rung) = program.rungs.get(to.rung as usize) else { return Vec::new() };
    let mut walk = RungWalk { scan, rung: to.rung, next: 0, to, saved: Vec::new(), path: Vec::new() };
    walk.path_to(rung);
    walk.path
}

/// Walk through a rung in text order, up to the element `to`.
struct RungWalk<'a, 's> {
    scan: &'s FollowedScan,
    rung: u32,
    /// Number of the next leaf in text order.
    next: u32,
    to: ElementId,
    /// Deciding lines of Instruction List before each open parenthesis.
    saved: Vec<Vec<PowerDecider<'a>>>,
    /// Deciding elements of the walk so far.
    path: Vec<PowerDecider<'a>>,
}

impl<'a> RungWalk<'a, '_> {
    fn path_to(&mut self, rung: &'a Rung) {
        self.series(&rung.series);
    }

    /// Walks the nodes of a series; returns true if it contains `to`, and then `path` leads to it.
    fn series(&mut self, nodes: &'a [RungNode]) -> bool {
        for node in nodes {
            match node {
                RungNode::Leaf(element, _) => {
                    let id = ElementId { rung: self.rung, index: self.next };
                    if id == self.to {
                        return true;
                    }
                    self.next += 1;
                    self.leaf(id, element);
                }
                RungNode::Parallel(branches, _) => {
                    if self.parallel(branches) {
                        return true;
                    }
                }
            }
        }
        false
    }

    fn leaf(&mut self, id: ElementId, element: &'a Element) {
        let Some(ElementPower { before, after }) = self.scan.power(id) else { return };
        if let Element::Instruction(step) = element {
            return self.line(id, element, step, (before, after));
        }
        let decides = matches!(element.facts().power, PowerEffect::Narrows | PowerEffect::Decides);
        if !after && before {
            // Elements that passed power before this one have no effect.
            self.path.clear();
            self.path.push(PowerDecider { id, element, passed_power: false });
        } else if after && (decides || !before) {
            if !before {
                // The element supplies power by itself.
                self.path.clear();
            }
            self.path.push(PowerDecider { id, element, passed_power: true });
        }
    }

    /// A line of Instruction List: those since the last load decide the current result.
    fn line(&mut self, id: ElementId, element: &'a Element, step: &IlStep, (before, behind): (bool, bool)) {
        match step.action {
            IlAction::Open { .. } => self.saved.push(std::mem::take(&mut self.path)),
            IlAction::Close { operator, negated, .. } => {
                let outer = self.saved.pop().unwrap_or_default();
                let inner = std::mem::take(&mut self.path);
                // With AND one FALSE is enough, with OR one TRUE.
                let (is_and, is_or) = (operator == IlBinaryOperator::And, operator == IlBinaryOperator::Or);
                self.path = match (before != negated, behind) {
                    (false, false) if is_and => inner,
                    (true, false) if is_and => outer,
                    (true, true) if is_or => inner,
                    (false, true) if is_or => outer,
                    _ => outer.into_iter().chain(inner).collect(),
                };
                return;
            }
            IlAction::Binary { operator: IlBinaryOperator::And, .. } if !before => return,
            IlAction::Binary { operator: IlBinaryOperator::Or, .. } if before => return,
            IlAction::Binary { operator: IlBinaryOperator::And | IlBinaryOperator::Or, .. } if before != behind => {
                self.path.clear();
            }
            _ if step.is_load() => self.path.clear(),
            _ => {}
        }
        if element.facts().power == PowerEffect::Decides {
            self.path.push(PowerDecider { id, element, passed_power: behind });
        }
    }

    fn parallel(&mut self, branches: &'a [Vec<RungNode>]) -> bool {
        let before = self.path.clone();
        let mut ways: Vec<(bool, Vec<PowerDecider<'a>>)> = Vec::new();
        for branch in branches {
            self.path.clear();
            let first = self.next;
            if self.series(branch) {
                // The elements in the branch follow those before the group.
                let own = std::mem::take(&mut self.path);
                let cut = own.first().is_some_and(|decider| !decider.passed_power);
                self.path = if cut { own } else { before.into_iter().chain(own).collect() };
                return true;
            }
            let powered = self.is_powered(first, self.next, &before);
            ways.push((powered, std::mem::take(&mut self.path)));
        }
        let any = ways.iter().any(|(powered, _)| *powered);
        let through: Vec<PowerDecider<'a>> =
            ways.into_iter().filter(|(powered, _)| *powered == any).flat_map(|(_, way)| way).collect();
        let blocked = before.first().is_some_and(|decider| !decider.passed_power);
        self.path = match (any, blocked) {
            // Power came through some branches.
            (true, false) => before.into_iter().chain(through).collect(),
            (true, true) => through,
            // Power was blocked before the group.
            (false, true) => before,
            (false, false) => through,
        };
        false
    }

    /// True if power leaves a branch: after its last element, or at its start if it has no element with
    /// power.
    fn is_powered(&self, first: u32, end: u32, before: &[PowerDecider<'a>]) -> bool {
        let last = (first..end).rev().find_map(|index| self.scan.power(ElementId { rung: self.rung, index }));
        last.map_or_else(|| before.first().is_none_or(|decider| decider.passed_power), |power| power.after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines that decide the current result of the last line, with `+` or `-` for TRUE or FALSE.
    fn causes(text: &str, set: &[&str]) -> Vec<String> {
        let read = ladder::read_program("t.il", text.as_bytes(), ladder::ReadOptions::default());
        let program = read.expect("a program").program;
        let mut eval = ladder_eval::Evaluator::new(&program).expect("an evaluator");
        for name in set {
            let symbol = eval.index(name).expect("a symbol");
            eval.set(symbol, 1);
        }
        let mut power = Vec::new();
        eval.scan_watched(&mut |id, before, after| power.push((id, ElementPower { before, after })));
        let (last, ..) = power.last().copied().expect("an element");
        let found = deciders(&program, &FollowedScan::with_power(power), last);
        let text = |d: &PowerDecider<'_>| {
            format!("{}{}", if d.passed_power { '+' } else { '-' }, ladder::element_text(d.element))
        };
        found.iter().map(text).collect()
    }

    #[test]
    fn lines_that_decide_the_current_result() {
        let and = "LD a\nAND b\nST q\n";
        assert_eq!(causes(and, &["a", "b"]), ["+LD a", "+AND b"]);
        assert_eq!(causes(and, &["a"]), ["-AND b"]);
        assert_eq!(causes(and, &["b"]), ["-LD a"]);
        let or = "LD a\nOR b\nST q\n";
        assert_eq!(causes(or, &["a"]), ["+LD a"]);
        assert_eq!(causes(or, &["b"]), ["+OR b"]);
        assert_eq!(causes(or, &[]), ["-LD a", "-OR b"]);
        assert_eq!(causes("LD a\nST p\nNOT\nST q\n", &[]), ["-LD a", "+NOT"]);
    }

    #[test]
    fn parentheses_decide_with_their_operator() {
        let and = "LD a\nAND( b\nOR c\n)\nST q\n";
        assert_eq!(causes(and, &["a", "c"]), ["+LD a", "+OR c"]);
        assert_eq!(causes(and, &["a"]), ["-AND( b", "-OR c"]);
        assert_eq!(causes(and, &["b"]), ["-LD a"]);
        let or = "LD a\nOR(\nLD b\nAND c\n)\nST q\n";
        assert_eq!(causes(or, &["b", "c"]), ["+LD b", "+AND c"]);
        assert_eq!(causes(or, &["a", "b"]), ["+LD a"]);
    }
}
