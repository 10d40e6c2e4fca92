//! Reads a body in ladder diagram: elements, joined by the numbers (`localId`) of what is on their left.

use std::collections::{BTreeMap, BTreeSet};

use diag::{Diagnostic, Pos, Severity};

use crate::codes;
use crate::diagram::{DrawnCall, MAX_DRAWN, NameMaker, NodeId, OutputAction, PowerGraph, lower};
use crate::il::{
    CoilKind, IecType, IlCondition, IlInstruction, IlName, IlOperand, IlOperandKind, IlParameter, IlVariable,
    LadderBlock, LadderLogic, LadderOutput, StandardBlock, is_plain_name, operand_of_text,
};
use crate::xml::XmlElement;

/// Returns the instructions of a body; adds the variables that they need.
pub(crate) fn read_ladder(
    file: &str,
    body: &XmlElement,
    variables: &mut Vec<IlVariable>,
) -> Result<Vec<IlInstruction>, Vec<Diagnostic>> {
    if body.children.len() > MAX_DRAWN {
        let cause = format!("the diagram has more than {MAX_DRAWN} elements");
        return Err(vec![Diagnostic::new(Severity::Error, codes::DRAWING, file, body.pos, cause, "divide it")]);
    }
    let mut names = NameMaker::default();
    variables.iter().for_each(|variable| names.reserve(&variable.name.text));
    for label in body.children_named("label") {
        names.reserve(label.attribute("label").unwrap_or_default());
    }
    let mut reader = BodyReader {
        file,
        variables,
        names,
        elements: BTreeMap::new(),
        read_by_elements: BTreeSet::new(),
        nodes: BTreeMap::new(),
        calls: BTreeMap::new(),
        enabled: Vec::new(),
        types: BTreeMap::new(),
        graph: PowerGraph::new(),
        faults: Vec::new(),
    };
    reader.collect(body);
    reader.add_elements(body);
    reader.connect_elements(body);
    if !reader.faults.is_empty() {
        return Err(reader.faults);
    }
    let BodyReader { mut names, graph, .. } = reader;
    let lines = lower(file, &graph, &mut names).map_err(|fault| vec![fault])?;
    variables.append(&mut names.variables);
    Ok(lines)
}

/// A connection to the left: the number of an element, and the name of its output.
#[derive(Clone, Copy)]
pub(super) struct Connection<'a> {
    pub element: &'a XmlElement,
    pub output: Option<&'a str>,
    pub pos: Pos,
}

/// What comes over a connection.
pub(super) enum Signal {
    Power(NodeId),
    /// A value, and the output that is executed before it is read.
    Value(IlOperand, Option<usize>),
}

/// Reads a body in ladder diagram as a power graph.
pub(super) struct BodyReader<'a> {
    pub file: &'a str,
    pub variables: &'a [IlVariable],
    pub names: NameMaker,
    elements: BTreeMap<&'a str, &'a XmlElement>,
    /// Numbers of the blocks whose value something else than an outVariable reads.
    pub read_by_elements: BTreeSet<&'a str>,
    /// Node of the power that leaves an element; for a block, of each of its outputs.
    pub nodes: BTreeMap<(&'a str, String), NodeId>,
    /// Output that calls a block or function.
    pub calls: BTreeMap<&'a str, usize>,
    /// Nodes that get the power of EN of a block.
    pub enabled: Vec<(NodeId, &'a XmlElement)>,
    /// Types of the values of blocks.
    pub types: BTreeMap<&'a str, Option<IecType>>,
    pub graph: PowerGraph,
    pub faults: Vec<Diagnostic>,
}

/// Returns the number of an element.
pub(super) fn local_id(element: &XmlElement) -> &str {
    element.attribute("localId").unwrap_or_default()
}

/// Returns the order in which an element is executed: by its number, if it has one, else from top to bottom.
pub(super) fn rank(element: &XmlElement) -> (i64, i64, i64) {
    let number = |text: Option<&str>| text.and_then(|text| text.trim().parse::<f64>().ok()).map(|n| n as i64);
    let order = number(element.attribute("executionOrderId")).filter(|order| *order > 0);
    let at = element.child("position");
    let place = |name| number(at.and_then(|at| at.attribute(name))).unwrap_or(0);
    (order.unwrap_or(i64::MAX), place("y"), place("x"))
}

impl<'a> BodyReader<'a> {
    pub fn refuse(&mut self, pos: Pos, cause: impl Into<String>, hint: &str) {
        self.faults.push(Diagnostic::new(Severity::Error, codes::PART_NOT_READ, self.file, pos, cause, hint));
    }

    fn collect(&mut self, body: &'a XmlElement) {
        for element in &body.children {
            let id = local_id(element);
            if !id.is_empty() && self.elements.insert(id, element).is_some() {
                self.refuse(element.pos, format!("two elements have the number {id}"), "export the file again");
            }
        }
        for element in body.children.iter().filter(|element| element.name != "outVariable") {
            let mut seen = Vec::new();
            element.visit(&mut |part| seen.extend(part.attribute("refLocalId").filter(|_| part.name == "connection")));
            self.read_by_elements.extend(seen);
        }
    }

    /// Returns the operand that a part of an element writes.
    pub fn operand(&mut self, element: &XmlElement, part: &str) -> Option<IlOperand> {
        let (text, pos) = match element.child(part) {
            Some(part) => (part.all_text(), part.pos),
            None => (String::new(), element.pos),
        };
        match operand_of_text(self.file, text.trim(), pos) {
            Ok(operand) => Some(operand),
            Err(fault) => {
                self.faults.push(fault);
                None
            }
        }
    }

    /// Creates the nodes of all elements.
    fn add_elements(&mut self, body: &'a XmlElement) {
        for element in &body.children {
            let (id, pos) = (local_id(element), element.pos);
            match element.name.as_str() {
                "leftPowerRail" => self.set_node(id, PowerGraph::RAIL),
                "contact" => self.add_contact(element),
                "coil" | "connector" => {
                    let node = self.graph.add_wire(pos);
                    self.set_node(id, node);
                }
                "block" => self.add_block(element),
                "rightPowerRail" | "inVariable" | "outVariable" | "continuation" | "label" | "jump" | "return"
                | "comment" => {}
                other => {
                    let hint = "use contacts, coils, blocks, variables, jumps and labels";
                    self.refuse(pos, format!("the element `{other}` is not read"), hint);
                }
            }
        }
        body.children_named("block").for_each(|element| self.add_comparison(element));
    }

    fn set_node(&mut self, id: &'a str, node: NodeId) {
        self.nodes.insert((id, String::new()), node);
    }

    /// Declares an edge detector and adds its call.
    fn add_edge(&mut self, edge: &str, element: &XmlElement, call: Option<IlOperand>) -> (IlName, usize) {
        let (block, stem) =
            if edge == "falling" { (StandardBlock::FTrig, "fall") } else { (StandardBlock::RTrig, "rise") };
        let pos = element.pos;
        let instance = self.names.declare(stem, IecType::Block(block), pos);
        let parameters = call.map(|value| IlParameter::Input { name: IlName { text: "CLK".to_owned(), pos }, value });
        let call = LadderBlock {
            block,
            instance: instance.clone(),
            condition: IlCondition::Always,
            powered: None,
            parameters: parameters.into_iter().collect(),
        };
        let action = OutputAction::Call(DrawnCall { call, powers: Vec::new(), enable: None });
        (instance, self.graph.add_output(action, rank(element), pos))
    }

    fn add_contact(&mut self, element: &'a XmlElement) {
        let Some(operand) = self.operand(element, "variable") else { return };
        let (negated, pos) = (element.is_true("negated"), element.pos);
        let node = match element.attribute("edge").unwrap_or("none") {
            "none" => self.graph.add_logic(LadderLogic::Contact { negated, operand }, pos),
            _ if negated => return self.refuse(pos, "a negated contact has an edge", "use one of both"),
            edge @ ("rising" | "falling") => {
                let (instance, call) = self.add_edge(edge, element, Some(operand));
                let kind = IlOperandKind::Variable { name: instance.text, member: Some("Q".to_owned()) };
                let operand = IlOperand { kind, pos };
                let node = self.graph.add_logic(LadderLogic::Contact { negated: false, operand }, pos);
                self.graph.add_need(node, call);
                node
            }
            other => return self.refuse(pos, format!("the edge `{other}` is not read"), "use rising or falling"),
        };
        self.set_node(local_id(element), node);
    }

    /// Returns the connections of a connectionPointIn inside of `element`.
    pub fn connections(&mut self, element: &'a XmlElement) -> Vec<Connection<'a>> {
        let mut found = Vec::new();
        let points: Vec<&'a XmlElement> = element.children_named("connectionPointIn").collect();
        for connection in points.into_iter().flat_map(|point| point.children_named("connection")) {
            let id = connection.attribute("refLocalId").unwrap_or_default();
            let output = connection.attribute("formalParameter").filter(|output| !output.is_empty());
            match self.elements.get(id) {
                Some(element) => found.push(Connection { element, output, pos: connection.pos }),
                None => {
                    let cause = format!("the connection leads to the element {id}, which does not exist");
                    self.refuse(connection.pos, cause, "export the file again");
                }
            }
        }
        found
    }

    /// Returns what comes over a connection; `None` if it was reported.
    pub fn signal(&mut self, connection: Connection<'a>) -> Option<Signal> {
        let element = connection.element;
        match element.name.as_str() {
            "block" => self.block_signal(connection),
            "inVariable" => {
                let operand = self.operand(element, "expression")?;
                if !element.is_true("negated") {
                    return Some(Signal::Value(operand, None));
                }
                let logic = LadderLogic::Contact { negated: true, operand };
                let node = self.graph.add_logic(logic, element.pos);
                self.graph.connect(node, [PowerGraph::RAIL]);
                Some(Signal::Power(node))
            }
            "continuation" => {
                let name = element.attribute("name").unwrap_or_default();
                let found = self.elements.values().find(|connector| {
                    connector.name == "connector" && connector.attribute("name").unwrap_or_default() == name
                });
                let node = found.and_then(|connector| self.nodes.get(&(local_id(connector), String::new())));
                match node {
                    Some(node) => Some(Signal::Power(*node)),
                    None => {
                        self.refuse(element.pos, format!("there is no connector `{name}`"), "draw the connector");
                        None
                    }
                }
            }
            _ => {
                let node = self.nodes.get(&(local_id(element), String::new())).copied();
                if node.is_none() && self.faults.is_empty() {
                    let cause = format!("nothing leaves the element `{}` on its right", element.name);
                    self.refuse(connection.pos, cause, "connect a contact or the left power rail");
                }
                node.map(Signal::Power)
            }
        }
    }

    /// Returns the nodes of the power that comes to an element.
    pub fn powers(&mut self, element: &'a XmlElement) -> Vec<NodeId> {
        let connections = self.connections(element);
        let mut nodes = Vec::new();
        for connection in connections {
            match self.signal(connection) {
                Some(Signal::Power(node)) => nodes.push(node),
                Some(Signal::Value(operand, need)) => {
                    let logic = LadderLogic::Contact { negated: false, operand };
                    let node = self.graph.add_logic(logic, connection.pos);
                    self.graph.connect(node, [PowerGraph::RAIL]);
                    need.into_iter().for_each(|need| self.graph.add_need(node, need));
                    nodes.push(node);
                }
                None => {}
            }
        }
        nodes
    }

    /// Connects all elements, and adds what they do.
    fn connect_elements(&mut self, body: &'a XmlElement) {
        for element in &body.children {
            let (id, pos) = (local_id(element), element.pos);
            match element.name.as_str() {
                "contact" | "connector" => {
                    let powers = self.powers(element);
                    if let Some(node) = self.nodes.get(&(id, String::new())) {
                        self.graph.connect(*node, powers);
                    }
                }
                "coil" => self.connect_coil(element),
                "block" => self.connect_block(element),
                "outVariable" => self.connect_out_variable(element),
                "label" => {
                    if let Some(label) = self.label(element) {
                        self.graph.add_output(OutputAction::Label(label), rank(element), pos);
                    }
                }
                "jump" => {
                    let powers = self.powers(element);
                    if let Some(label) = self.label(element) {
                        let jump = LadderOutput::Jump { condition: IlCondition::IfTrue, label };
                        self.graph.add_output(OutputAction::Output(jump, powers), rank(element), pos);
                    }
                }
                "return" => {
                    let powers = self.powers(element);
                    let output = LadderOutput::Return(IlCondition::IfTrue);
                    self.graph.add_output(OutputAction::Output(output, powers), rank(element), pos);
                }
                "comment" => {
                    let text = element.all_text().replace("*)", "* )");
                    self.graph.add_output(OutputAction::Comment(text), rank(element), pos);
                }
                // What is on their right fetches what they give.
                _ => {}
            }
        }
        while let Some((node, element)) = self.enabled.pop() {
            let powers = self.enable(element).unwrap_or_else(|| vec![PowerGraph::RAIL]);
            self.graph.connect(node, powers);
        }
    }

    fn label(&mut self, element: &XmlElement) -> Option<IlName> {
        let text = element.attribute("label").unwrap_or_default();
        if is_plain_name(text) {
            return Some(IlName { text: text.to_owned(), pos: element.pos });
        }
        self.refuse(element.pos, format!("`{text}` is no label"), "use letters, digits and `_`");
        None
    }

    fn connect_coil(&mut self, element: &'a XmlElement) {
        let powers = self.powers(element);
        let pos = element.pos;
        if let Some(node) = self.nodes.get(&(local_id(element), String::new())) {
            self.graph.connect(*node, powers.iter().copied());
        }
        let Some(target) = self.operand(element, "variable") else { return };
        let kind = match (element.attribute("storage").unwrap_or("none"), element.is_true("negated")) {
            ("none", false) => CoilKind::Store,
            ("none", true) => CoilKind::Negated,
            ("set", false) => CoilKind::Set,
            ("reset", false) => CoilKind::Reset,
            (storage, _) => {
                return self.refuse(pos, format!("a negated coil with `{storage}` is not read"), "use one of both");
            }
        };
        let sources = match element.attribute("edge").unwrap_or("none") {
            "none" => powers,
            edge @ ("rising" | "falling") => {
                let (instance, call) = self.add_edge(edge, element, None);
                if let Some(output) = self.graph.output_mut(call)
                    && let OutputAction::Call(drawn) = &mut output.action
                {
                    drawn.powers.push(("CLK".to_owned(), powers, false));
                }
                vec![self.graph.add_block_output(call, &instance.text, "Q", false, pos)]
            }
            other => return self.refuse(pos, format!("the edge `{other}` is not read"), "use rising or falling"),
        };
        let output = LadderOutput::Coil { kind, target };
        self.graph.add_output(OutputAction::Output(output, sources), rank(element), pos);
    }
}
