//! Paths of power as series and parallel groups.
//!
//! After [`Paths::new`] a node has one source, or is a join of several. A node *dominates* another one if all
//! power of the other passes it. Logic between a node and a dominator of it is a series of the nodes on the
//! way up the tree of dominators; at a join the branches meet that began at its dominator.

use std::collections::{BTreeMap, BTreeSet};

use diag::Pos;

use crate::il::{LadderLogic, MAX_IL_DEPTH};

use super::graph::{NodeElement, NodeId, PowerGraph, PowerNode};

/// Why the power of a point has no logic.
pub(super) enum PathFault {
    /// Wires lead around.
    Loop(Pos),
    /// Nothing is on the left of the element.
    Unconnected(Pos),
    /// Branches are nested too deep.
    Depth(Pos),
    /// Too many blocks feed one another.
    TooLong(Pos),
    /// The node is needed in two places: a variable must hold its power.
    Shared(NodeId),
}

/// The nodes of a drawing without wires: rail, contacts with one source, joins with several.
pub(super) struct Paths {
    nodes: Vec<PowerNode>,
    /// Number of nodes that the drawing has; those behind them are joins.
    drawn: usize,
    /// Sources without wires; one for a contact.
    sources: Vec<Vec<NodeId>>,
    /// Join of each set of several sources.
    joins: BTreeMap<Vec<NodeId>, NodeId>,
    /// Nodes behind all their sources.
    order: Vec<NodeId>,
    dominator: Vec<NodeId>,
    depth: Vec<usize>,
    /// Contact of the variable that holds the power of a node.
    held: BTreeMap<NodeId, LadderLogic>,
    /// Nodes that are part of the logic already.
    used: BTreeSet<NodeId>,
}

impl Paths {
    pub fn new(graph: &PowerGraph) -> Result<Paths, PathFault> {
        let order = sorted(&graph.nodes)?;
        let count = graph.nodes.len();
        let mut paths = Paths {
            nodes: graph.nodes.clone(),
            drawn: count,
            sources: vec![Vec::new(); count],
            joins: BTreeMap::new(),
            order: Vec::new(),
            dominator: Vec::new(),
            depth: Vec::new(),
            held: BTreeMap::new(),
            used: BTreeSet::new(),
        };
        // What a wire passes on.
        let mut behind: Vec<Vec<NodeId>> = vec![Vec::new(); count];
        for node in order {
            let mut sources: Vec<NodeId> = Vec::new();
            for source in &graph.nodes[node].sources {
                for source in &behind[*source] {
                    if !sources.contains(source) {
                        sources.push(*source);
                    }
                }
            }
            match graph.nodes[node].element {
                NodeElement::Rail => behind[node] = vec![node],
                NodeElement::Wire => behind[node] = sources,
                NodeElement::Logic(_) => {
                    let source = paths.join(&sources, graph.nodes[node].pos)?;
                    paths.sources[node] = vec![source];
                    behind[node] = vec![node];
                }
            }
            if !matches!(graph.nodes[node].element, NodeElement::Wire) {
                paths.order.push(node);
            }
        }
        for (wire, behind) in behind.into_iter().enumerate() {
            // Outputs may name a wire as their source.
            if matches!(graph.nodes[wire].element, NodeElement::Wire) {
                paths.sources[wire] = behind;
            }
        }
        paths.find_dominators();
        Ok(paths)
    }

    /// Returns the node that has the power of any of `sources`.
    pub fn join_of(&mut self, sources: &[NodeId], pos: Pos) -> Result<NodeId, PathFault> {
        let mut plain: Vec<NodeId> = Vec::new();
        for source in sources {
            let is_wire = matches!(self.nodes[*source].element, NodeElement::Wire) && *source < self.drawn;
            let behind = if is_wire { self.sources[*source].clone() } else { vec![*source] };
            behind.into_iter().for_each(|node| {
                if !plain.contains(&node) {
                    plain.push(node);
                }
            });
        }
        let count = self.nodes.len();
        let join = self.join(&plain, pos)?;
        if self.nodes.len() > count {
            let dominator = self.common(&plain);
            self.dominator.push(dominator);
            self.depth.push(self.depth[dominator] + 1);
        }
        Ok(join)
    }

    fn join(&mut self, sources: &[NodeId], pos: Pos) -> Result<NodeId, PathFault> {
        if let [one] = sources {
            return Ok(*one);
        }
        if sources.is_empty() {
            return Err(PathFault::Unconnected(pos));
        }
        let mut key = sources.to_vec();
        key.sort_unstable();
        if let Some(join) = self.joins.get(&key) {
            return Ok(*join);
        }
        let join = self.nodes.len();
        self.nodes.push(PowerNode { element: NodeElement::Wire, sources: Vec::new(), needs: Vec::new(), pos });
        self.sources.push(sources.to_vec());
        self.joins.insert(key, join);
        self.order.push(join);
        Ok(join)
    }

    fn find_dominators(&mut self) {
        self.dominator = vec![PowerGraph::RAIL; self.nodes.len()];
        self.depth = vec![0; self.nodes.len()];
        for index in 0..self.order.len() {
            let node = self.order[index];
            if node == PowerGraph::RAIL {
                continue;
            }
            let dominator = match self.held.contains_key(&node) {
                true => PowerGraph::RAIL,
                false => self.common(&self.sources[node]),
            };
            self.dominator[node] = dominator;
            self.depth[node] = self.depth[dominator] + 1;
        }
    }

    /// Returns the nearest node that dominates all of `nodes`, or is the one node.
    fn common(&self, nodes: &[NodeId]) -> NodeId {
        let mut nodes = nodes.iter().copied();
        let first = nodes.next().unwrap_or(PowerGraph::RAIL);
        nodes.fold(first, |a, b| {
            let (mut a, mut b) = (a, b);
            while a != b {
                if self.depth[a] >= self.depth[b] {
                    a = self.dominator[a];
                } else {
                    b = self.dominator[b];
                }
            }
            a
        })
    }

    /// Whether all power of `node` passes `other`.
    pub fn dominates(&self, other: NodeId, node: NodeId) -> bool {
        self.common(&[other, node]) == other
    }

    /// Holds the power of a node in a variable from now on.
    pub fn hold(&mut self, node: NodeId, contact: LadderLogic) {
        self.held.insert(node, contact);
        self.find_dominators();
    }

    /// Forgets which nodes are part of the logic.
    pub fn restart(&mut self) {
        self.used.clear();
    }

    pub fn is_held(&self, node: NodeId) -> bool {
        self.held.contains_key(&node)
    }

    pub fn pos(&self, node: NodeId) -> Pos {
        self.nodes[node].pos
    }

    /// Returns the nodes on the left of a node that must have a value first: those that need a call, and
    /// those whose power is held, sources before what they feed.
    pub fn needed(&self, node: NodeId) -> Vec<(NodeId, Vec<usize>)> {
        let mut seen: BTreeSet<NodeId> = BTreeSet::new();
        let mut work = vec![node];
        while let Some(next) = work.pop() {
            if seen.insert(next) {
                work.extend(self.sources[next].iter().filter(|source| !seen.contains(source)));
            }
        }
        let is_needed = |node: &NodeId| !self.nodes[*node].needs.is_empty() || self.is_held(*node);
        let nodes = self.order.iter().filter(|node| seen.contains(node) && is_needed(node));
        nodes.map(|node| (*node, self.nodes[*node].needs.clone())).collect()
    }

    /// Returns the logic between a dominator of a node and the node. With `is_own` the node is the one whose
    /// power is to be held.
    pub fn logic(&mut self, from: NodeId, node: NodeId, is_own: bool) -> Result<LadderLogic, PathFault> {
        self.series(from, node, is_own, 0)
    }

    fn series(&mut self, from: NodeId, node: NodeId, is_own: bool, level: usize) -> Result<LadderLogic, PathFault> {
        if level > MAX_IL_DEPTH {
            return Err(PathFault::Depth(self.nodes[node].pos));
        }
        let mut way = Vec::new();
        let mut at = node;
        if is_own && self.is_held(node) {
            way.push(node);
            at = self.common(&self.sources[node]);
        }
        while at != from && at != PowerGraph::RAIL {
            way.push(at);
            at = self.dominator[at];
        }
        let mut logic: Option<LadderLogic> = None;
        for at in way.into_iter().rev() {
            let part = match self.held.get(&at) {
                Some(contact) if !(is_own && at == node) => contact.clone(),
                _ if !self.used.insert(at) => return Err(PathFault::Shared(at)),
                _ => match self.nodes[at].element.clone() {
                    NodeElement::Logic(logic) => logic,
                    NodeElement::Rail | NodeElement::Wire => {
                        let branches = self.sources[at].clone();
                        let begin = self.common(&branches);
                        self.parallel(begin, &branches, level + 1)?
                    }
                },
            };
            logic = Some(match logic {
                Some(before) => before.and(part),
                None => part,
            });
        }
        Ok(logic.unwrap_or(LadderLogic::Wire))
    }

    /// Returns the branches that begin at `begin` and end at `ends`. Those with a common first part are one
    /// branch.
    fn parallel(&mut self, begin: NodeId, ends: &[NodeId], level: usize) -> Result<LadderLogic, PathFault> {
        if level > MAX_IL_DEPTH {
            return Err(PathFault::Depth(self.nodes[begin].pos));
        }
        let mut groups: Vec<(NodeId, Vec<NodeId>)> = Vec::new();
        for end in ends {
            let mut child = *end;
            while child != begin && self.dominator[child] != begin {
                child = self.dominator[child];
            }
            match groups.iter_mut().find(|(first, _)| *first == child) {
                Some((_, group)) => group.push(*end),
                None => groups.push((child, vec![*end])),
            }
        }
        let mut branches = Vec::new();
        for (_, group) in groups {
            let meet = self.common(&group);
            let first = self.series(begin, meet, false, level)?;
            let rest = match group.as_slice() {
                [_] => None,
                several => Some(self.parallel(meet, several, level + 1)?),
            };
            branches.push(match (first, rest) {
                (first, None) => first,
                (LadderLogic::Wire, Some(rest)) => rest,
                (first, Some(rest)) => first.and(rest),
            });
        }
        Ok(branches.into_iter().reduce(LadderLogic::or).unwrap_or(LadderLogic::Wire))
    }
}

/// Returns the nodes behind their sources.
fn sorted(nodes: &[PowerNode]) -> Result<Vec<NodeId>, PathFault> {
    let mut missing: Vec<usize> = nodes.iter().map(|node| node.sources.len()).collect();
    let mut fed: Vec<Vec<NodeId>> = vec![Vec::new(); nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        node.sources.iter().for_each(|source| fed[*source].push(index));
    }
    let mut order: Vec<NodeId> = (0..nodes.len()).filter(|node| missing[*node] == 0).collect();
    let mut at = 0;
    while let Some(node) = order.get(at).copied() {
        at += 1;
        for next in &fed[node] {
            missing[*next] -= 1;
            if missing[*next] == 0 {
                order.push(*next);
            }
        }
    }
    match (0..nodes.len()).find(|node| missing[*node] > 0) {
        Some(looped) => Err(PathFault::Loop(nodes[looped].pos)),
        None => Ok(order),
    }
}
