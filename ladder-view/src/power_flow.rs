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
    let mut walk = RungWalk { scan, rung: to.rung, next: 0, to, path: Vec::new() };
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
            return self.line(id, element, step, ElementPower { before, after });
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
    fn line(
        &mut self,
        id: ElementId,
        element: &'a Element,
        step: &IlStep,
        ElementPower { before, after }: ElementPower,
    ) {
        if element.facts().power != PowerEffect::Decides {
            return;
        }
        let decides_alone = match step.action {
            IlAction::Binary { operator: IlBinaryOperator::And, .. } => before && !after,
            IlAction::Binary { operator: IlBinaryOperator::Or, .. } => !before && after,
            _ => step.is_load(),
        };
        if decides_alone {
            self.path.clear();
        }
        self.path.push(PowerDecider { id, element, passed_power: after });
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
