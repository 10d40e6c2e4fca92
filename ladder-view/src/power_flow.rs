//! Through which elements power came to a place of a rung, or which kept it from coming.

use ladder::{Element, ElementId, LadderProgram, PowerEffect, Rung, RungNode};

use crate::scan_follower::FollowedScan;

/// An element that decided about the power behind it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PowerDecider<'a> {
    pub id: ElementId,
    pub element: &'a Element,
    /// It gave power on.
    pub passed_power: bool,
}

/// What decided about the power that came to the element `to`: the elements that gave it on, on the way from the left rail, or those
/// that blocked it.
pub(crate) fn deciders<'a>(program: &'a LadderProgram, scan: &FollowedScan, to: ElementId) -> Vec<PowerDecider<'a>> {
    let Some(rung) = program.rungs.get(to.rung as usize) else { return Vec::new() };
    let mut walk = RungWalk { scan, rung: to.rung, next: 0, to, path: Vec::new() };
    walk.path_to(rung);
    walk.path
}

struct RungWalk<'a, 's> {
    scan: &'s FollowedScan,
    rung: u32,
    /// Number of the next leaf in text order.
    next: u32,
    to: ElementId,
    path: Vec<PowerDecider<'a>>,
}

impl<'a> RungWalk<'a, '_> {
    fn path_to(&mut self, rung: &'a Rung) {
        self.series(&rung.series);
    }

    /// Comes by the nodes of a series; true when `to` was met in it, and then `way` is the way to it.
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
        let Some((before, behind)) = self.scan.power(id) else { return };
        let decides = matches!(element.facts().power, PowerEffect::Narrows | PowerEffect::Decides);
        if !behind && before {
            // Whatever let power through before has not mattered.
            self.path.clear();
            self.path.push(PowerDecider { id, element, passed_power: false });
        } else if behind && (decides || !before) {
            if !before {
                // It gives power by itself.
                self.path.clear();
            }
            self.path.push(PowerDecider { id, element, passed_power: true });
        }
    }

    fn parallel(&mut self, branches: &'a [Vec<RungNode>]) -> bool {
        let before = self.path.clone();
        let mut ways: Vec<(bool, Vec<PowerDecider<'a>>)> = Vec::new();
        for branch in branches {
            self.path.clear();
            let first = self.next;
            if self.series(branch) {
                // What stands in the branch comes behind what stands before the group.
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
            // It was cut before the group already.
            (false, true) => before,
            (false, false) => through,
        };
        false
    }

    /// Power comes out of a branch: behind its last element, or into it where it has none that counts.
    fn is_powered(&self, first: u32, end: u32, before: &[PowerDecider<'a>]) -> bool {
        let last = (first..end).rev().find_map(|index| self.scan.power(ElementId { rung: self.rung, index }));
        last.map_or_else(|| before.first().is_none_or(|decider| decider.passed_power), |(_, behind)| behind)
    }
}
