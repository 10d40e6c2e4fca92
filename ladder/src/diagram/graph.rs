//! Elements of a drawing and the wires between them.

use diag::Pos;

use crate::il::{IecType, IlName, IlOperand, IlOperandKind, IlParameter, LadderBlock, LadderLogic, LadderOutput};

/// Index of a node of a [`PowerGraph`].
pub(crate) type NodeId = usize;

/// What a node does with the power that reaches it.
#[derive(Debug, Clone)]
pub(super) enum NodeElement {
    /// The left rail.
    Rail,
    /// Passes the power.
    Wire,
    /// A contact or a comparison.
    Logic(LadderLogic),
}

/// A point of the drawing that has power or not.
#[derive(Debug, Clone)]
pub(super) struct PowerNode {
    pub element: NodeElement,
    /// Nodes on its left: it gets the power of any.
    pub sources: Vec<NodeId>,
    /// Outputs that are executed before the node has a value, such as the call of a block.
    pub needs: Vec<usize>,
    pub pos: Pos,
}

/// A call of a block, with inputs that get power.
#[derive(Debug, Clone)]
pub(crate) struct DrawnCall {
    /// The call without the inputs that get power.
    pub call: LadderBlock,
    /// Inputs that get power: name, nodes, whether the complement is written.
    pub powers: Vec<(String, Vec<NodeId>, bool)>,
    /// Power of EN.
    pub enable: Option<Vec<NodeId>>,
}

/// A call of a function.
#[derive(Debug, Clone)]
pub(crate) struct DrawnFunction {
    /// Name of a standard function, in capitals.
    pub name: IlName,
    /// Inputs.
    pub arguments: Vec<IlParameter>,
    /// Inputs that get power: name and nodes.
    pub powers: Vec<(String, Vec<NodeId>)>,
    /// Power of EN.
    pub enable: Option<Vec<NodeId>>,
    /// Where the value is written.
    pub targets: Vec<IlOperand>,
}

/// What is executed.
#[derive(Debug, Clone)]
pub(crate) enum OutputAction {
    /// A coil, a jump or a return.
    Output(LadderOutput, Vec<NodeId>),
    /// A call of a block.
    Call(DrawnCall),
    /// A call of a function.
    Function(DrawnFunction),
    /// A value is copied.
    Copy(IlOperand, IlOperand),
    /// A label.
    Label(IlName),
    /// Text.
    Comment(String),
}

/// Something that is executed, and when.
#[derive(Debug, Clone)]
pub(crate) struct PowerOutput {
    /// What is executed.
    pub action: OutputAction,
    /// Outputs are executed in this order, except that a block is called before its outputs are used.
    pub rank: (i64, i64, i64),
    /// Position in the file.
    pub pos: Pos,
    /// Outputs that are executed before.
    pub needs: Vec<usize>,
}

/// A drawing.
#[derive(Debug)]
pub(crate) struct PowerGraph {
    /// The places that power comes to, by number.
    pub(super) nodes: Vec<PowerNode>,
    /// What the power acts on.
    pub(super) outputs: Vec<PowerOutput>,
}

impl PowerGraph {
    /// The left rail.
    pub const RAIL: NodeId = 0;

    /// Returns a drawing that has only the left rail.
    pub fn new() -> PowerGraph {
        let rail =
            PowerNode { element: NodeElement::Rail, sources: Vec::new(), needs: Vec::new(), pos: Pos::default() };
        PowerGraph { nodes: vec![rail], outputs: Vec::new() }
    }

    /// Adds a node whose sources are not known yet.
    fn add(&mut self, element: NodeElement, pos: Pos) -> NodeId {
        self.nodes.push(PowerNode { element, sources: Vec::new(), needs: Vec::new(), pos });
        self.nodes.len() - 1
    }

    /// Adds a wire.
    pub fn add_wire(&mut self, pos: Pos) -> NodeId {
        self.add(NodeElement::Wire, pos)
    }

    /// Adds a contact or a comparison.
    pub fn add_logic(&mut self, logic: LadderLogic, pos: Pos) -> NodeId {
        self.add(NodeElement::Logic(logic), pos)
    }

    /// Adds the output `part` of a block that output number `call` calls.
    pub fn add_block_output(&mut self, call: usize, instance: &str, part: &str, negated: bool, pos: Pos) -> NodeId {
        let kind = IlOperandKind::Variable { name: instance.to_owned(), member: Some(part.to_owned()) };
        let node = self.add_logic(LadderLogic::Contact { negated, operand: IlOperand { kind, pos } }, pos);
        self.nodes[node].sources.push(PowerGraph::RAIL);
        self.nodes[node].needs.push(call);
        node
    }

    /// Joins nodes to the left side of a node.
    pub fn connect(&mut self, node: NodeId, sources: impl IntoIterator<Item = NodeId>) {
        self.nodes[node].sources.extend(sources);
    }

    /// Lets output number `output` be executed before the node has a value.
    pub fn add_need(&mut self, node: NodeId, output: usize) {
        self.nodes[node].needs.push(output);
    }

    /// Adds what is executed; returns its number.
    pub fn add_output(&mut self, action: OutputAction, rank: (i64, i64, i64), pos: Pos) -> usize {
        self.outputs.push(PowerOutput { action, rank, pos, needs: Vec::new() });
        self.outputs.len() - 1
    }

    /// Returns an output to complete it.
    pub fn output_mut(&mut self, output: usize) -> Option<&mut PowerOutput> {
        self.outputs.get_mut(output)
    }
}

/// Type of the variable that holds the power of a point.
pub(super) const POWER_TYPE: IecType = IecType::Bool;
