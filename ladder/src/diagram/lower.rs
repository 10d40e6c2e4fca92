//! Networks of a drawing, in the order of their execution.

use std::collections::{BTreeMap, BTreeSet};

use diag::{Diagnostic, Pos, Severity};

use crate::codes;
use crate::il::{
    CoilKind, IlCondition, IlInstruction, IlName, IlOperand, IlOperandKind, IlOperation, IlParameter, LadderLogic,
    LadderNetwork, LadderOutput, LadderStage, instructions_of,
};

use super::graph::{DrawnCall, DrawnFunction, NodeId, OutputAction, POWER_TYPE, PowerGraph};
use super::names::NameMaker;
use super::paths::{PathFault, Paths};

/// Largest number of elements in a drawing.
pub(crate) const MAX_DRAWN: usize = 5_000;
/// Largest number of blocks of which each feeds the next one.
const MAX_CHAIN: usize = 200;

/// Returns the instructions of a drawing; `names` declares the variables that it needs. `is_label` tells
/// whether a name is a label of the program, so that new ones differ.
///
/// # Errors
/// Returns the faults of the drawing: an element without a connection, wires in a loop, branches nested too
/// deep, too many elements.
pub(crate) fn lower(file: &str, graph: &PowerGraph, names: &mut NameMaker) -> Result<Vec<IlInstruction>, Diagnostic> {
    let error =
        |pos, cause: &str, hint| Diagnostic::new(Severity::Error, codes::DRAWING, file, pos, cause.to_owned(), hint);
    let fault = |fault: &PathFault| match fault {
        PathFault::Loop(pos) => error(*pos, "the wires lead around to this element", "remove the loop"),
        PathFault::Unconnected(pos) => {
            error(*pos, "the element has no connection on its left side", "connect it, or remove it")
        }
        PathFault::Depth(pos) | PathFault::TooLong(pos) => {
            error(*pos, "the diagram is nested too deep here", "divide it, with relays between the parts")
        }
        PathFault::Shared(_) => error(Pos::default(), "the diagram has no order", "divide it"),
    };
    if graph.nodes.len() + graph.outputs.len() > MAX_DRAWN {
        let cause = format!("the diagram has more than {MAX_DRAWN} elements");
        return Err(error(Pos::new(1, 1, 1), &cause, "divide it"));
    }
    let mut paths = Paths::new(graph).map_err(|why| fault(&why))?;
    let mut order: Vec<usize> = (0..graph.outputs.len()).collect();
    order.sort_by_key(|output| graph.outputs[*output].rank);
    let mut held: BTreeMap<NodeId, IlName> = BTreeMap::new();
    loop {
        let mut trial = names.clone();
        let mut lowering = Lowering {
            graph,
            paths: &mut paths,
            names: &mut trial,
            held: &held,
            lines: Vec::new(),
            open: None,
            label: None,
            comments: Vec::new(),
            begun: BTreeSet::new(),
            stored: BTreeSet::new(),
        };
        let result = order.iter().try_for_each(|output| lowering.output(*output, 0));
        match result {
            Ok(()) => {
                lowering.close();
                let lines = lowering.lines;
                *names = trial;
                return Ok(lines);
            }
            Err(PathFault::Shared(node)) if !held.contains_key(&node) => {
                let pos = paths.pos(node);
                let name = names.declare("power", POWER_TYPE, pos);
                paths.hold(node, LadderLogic::Contact { negated: false, operand: variable(&name) });
                held.insert(node, name);
                paths.restart();
            }
            Err(why) => return Err(fault(&why)),
        }
    }
}

fn variable(name: &IlName) -> IlOperand {
    IlOperand { kind: IlOperandKind::Variable { name: name.text.clone(), member: None }, pos: name.pos }
}

/// A network that later outputs can extend.
struct OpenNetwork {
    network: LadderNetwork,
    /// Node whose power the network has; `None` behind a call, which leaves none.
    power: Option<NodeId>,
}

struct Lowering<'a> {
    graph: &'a PowerGraph,
    paths: &'a mut Paths,
    names: &'a mut NameMaker,
    /// Variables that hold the power of nodes.
    held: &'a BTreeMap<NodeId, IlName>,
    lines: Vec<IlInstruction>,
    open: Option<OpenNetwork>,
    /// Label of the next network.
    label: Option<IlName>,
    /// Comments of the next network.
    comments: Vec<String>,
    /// Outputs that are executed already, or in work.
    begun: BTreeSet<usize>,
    /// Nodes whose power is held already.
    stored: BTreeSet<NodeId>,
}

impl Lowering<'_> {
    /// Writes the network in work.
    fn close(&mut self) {
        if let Some(open) = self.open.take() {
            self.lines.extend(instructions_of(&open.network));
        }
        if self.label.is_some() || !self.comments.is_empty() {
            let (label, comments) = (self.label.take(), std::mem::take(&mut self.comments));
            self.lines.extend(instructions_of(&LadderNetwork { label, comments, stages: Vec::new() }));
        }
    }

    /// Begins a network.
    fn begin(&mut self, logic: LadderLogic, outputs: Vec<LadderOutput>, power: NodeId) {
        let (label, comments) = (self.label.take(), std::mem::take(&mut self.comments));
        self.close();
        let power = Some(power).filter(|_| !matches!(outputs.last(), Some(LadderOutput::Block(_))));
        let stages = vec![LadderStage { logic, outputs }];
        self.open = Some(OpenNetwork { network: LadderNetwork { label, comments, stages }, power });
    }

    /// Makes sure that all that a node uses is executed.
    fn prepare(&mut self, node: NodeId, level: usize) -> Result<(), PathFault> {
        for (needed, outputs) in self.paths.needed(node) {
            outputs.into_iter().try_for_each(|output| self.output(output, level + 1))?;
            self.store(needed)?;
        }
        Ok(())
    }

    /// Stores the power of a node that is held, once.
    fn store(&mut self, node: NodeId) -> Result<(), PathFault> {
        let Some(name) = self.held.get(&node) else { return Ok(()) };
        if !self.stored.insert(node) {
            return Ok(());
        }
        let logic = self.paths.logic(PowerGraph::RAIL, node, true)?;
        let coil = LadderOutput::Coil { kind: CoilKind::Store, target: variable(name) };
        self.begin(logic, vec![coil], node);
        Ok(())
    }

    /// Adds an output with the power of any of `sources`.
    fn powered(&mut self, output: LadderOutput, sources: &[NodeId], pos: Pos, level: usize) -> Result<(), PathFault> {
        let node = self.paths.join_of(sources, pos)?;
        self.prepare(node, level)?;
        let has_head = self.label.is_some() || !self.comments.is_empty();
        if let Some(open) = self.open.as_mut().filter(|_| !has_head) {
            let after = Some(node).filter(|_| !matches!(output, LadderOutput::Block(_)));
            if open.power == Some(node) {
                if let Some(stage) = open.network.stages.last_mut() {
                    stage.outputs.push(output);
                }
                open.power = after;
                return Ok(());
            }
            let before = open.power.filter(|before| *before != PowerGraph::RAIL);
            let before = before.filter(|before| self.paths.dominates(*before, node) && !self.paths.is_held(node));
            if let Some(before) = before {
                let logic = self.paths.logic(before, node, false)?;
                open.network.stages.push(LadderStage { logic, outputs: vec![output] });
                open.power = after;
                return Ok(());
            }
        }
        let logic = self.paths.logic(PowerGraph::RAIL, node, false)?;
        self.begin(logic, vec![output], node);
        Ok(())
    }

    /// Executes an output, after what it needs.
    fn output(&mut self, index: usize, level: usize) -> Result<(), PathFault> {
        let graph = self.graph;
        let Some(output) = graph.outputs.get(index) else { return Ok(()) };
        if level > MAX_CHAIN {
            return Err(PathFault::TooLong(output.pos));
        }
        if !self.begun.insert(index) {
            return Ok(());
        }
        output.needs.iter().try_for_each(|needed| self.output(*needed, level + 1))?;
        match &output.action {
            OutputAction::Output(ladder, sources) => {
                let mut ladder = ladder.clone();
                if let LadderOutput::Jump { condition, .. } | LadderOutput::Return(condition) = &mut ladder
                    && *sources == [PowerGraph::RAIL]
                {
                    *condition = IlCondition::Always;
                }
                self.powered(ladder, sources, output.pos, level)
            }
            OutputAction::Call(call) => self.call(call, output.pos, level),
            OutputAction::Function(function) => self.function(function, output.pos, level),
            OutputAction::Copy(from, to) => {
                self.close();
                let load = IlOperation::Load { negated: false, operand: from.clone() };
                let store = IlOperation::Store { negated: false, target: to.clone() };
                self.push(load, from.pos);
                self.push(store, to.pos);
                Ok(())
            }
            OutputAction::Label(name) => {
                self.close();
                self.label = Some(name.clone());
                Ok(())
            }
            OutputAction::Comment(text) => {
                self.comments.extend(text.lines().map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned));
                Ok(())
            }
        }
    }

    fn push(&mut self, operation: IlOperation, pos: Pos) {
        self.lines.push(IlInstruction { operation: Some(operation), pos, ..IlInstruction::default() });
    }

    fn call(&mut self, drawn: &DrawnCall, pos: Pos, level: usize) -> Result<(), PathFault> {
        let mut call = drawn.call.clone();
        let is_last_own = drawn.enable.is_none();
        for (index, (part, sources, negated)) in drawn.powers.iter().enumerate() {
            if is_last_own && index + 1 == drawn.powers.len() && !negated {
                call.powered = Some(part.clone());
                return self.powered(LadderOutput::Block(call), sources, pos, level);
            }
            let (name, member) = (call.instance.text.clone(), Some(part.clone()));
            let target = IlOperand { kind: IlOperandKind::Variable { name, member }, pos };
            let kind = if *negated { CoilKind::Negated } else { CoilKind::Store };
            self.powered(LadderOutput::Coil { kind, target }, sources, pos, level)?;
        }
        match drawn.enable.as_deref().filter(|sources| *sources != [PowerGraph::RAIL]) {
            Some(sources) => {
                call.condition = IlCondition::IfTrue;
                self.powered(LadderOutput::Block(call), sources, pos, level)
            }
            None => {
                self.begin(LadderLogic::Wire, vec![LadderOutput::Block(call)], PowerGraph::RAIL);
                self.close();
                Ok(())
            }
        }
    }

    /// A function with EN is jumped over.
    fn function(&mut self, drawn: &DrawnFunction, pos: Pos, level: usize) -> Result<(), PathFault> {
        let mut arguments = drawn.arguments.clone();
        for (name, sources) in &drawn.powers {
            let value = self.names.declare("power", POWER_TYPE, pos);
            let coil = LadderOutput::Coil { kind: CoilKind::Store, target: variable(&value) };
            self.powered(coil, sources, pos, level)?;
            let name = IlName { text: name.clone(), pos };
            arguments.push(IlParameter::Input { name, value: variable(&value) });
        }
        let mut skip = None;
        if let Some(sources) = drawn.enable.as_deref().filter(|sources| *sources != [PowerGraph::RAIL]) {
            let label = IlName { text: self.names.unused("skip"), pos };
            let jump = LadderOutput::Jump { condition: IlCondition::IfFalse, label: label.clone() };
            self.powered(jump, sources, pos, level)?;
            skip = Some(label);
        }
        self.close();
        let name = drawn.name.clone();
        self.push(IlOperation::Function { name, parenthesized: true, arguments }, pos);
        for target in &drawn.targets {
            self.push(IlOperation::Store { negated: false, target: target.clone() }, target.pos);
        }
        self.label = skip;
        Ok(())
    }
}
