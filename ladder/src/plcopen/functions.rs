//! Reads blocks of a body: instances of standard blocks, and standard functions.

use diag::Pos;

use crate::diagram::{DrawnCall, DrawnFunction, NodeId, OutputAction, PowerGraph};
use crate::il::{
    CoilKind, IecType, IlBinaryOperator, IlCondition, IlName, IlOperand, IlOperandKind, IlParameter, IlValue,
    LadderBlock, LadderLogic, LadderOutput, StandardBlock, function_type, is_plain_name, is_standard_function,
};
use crate::xml::XmlElement;

use super::body::{BodyReader, Connection, Signal, local_id, rank};

/// Deepest chain of functions whose types depend on one another.
const MAX_CHAIN: usize = 32;

/// Returns the inputs or outputs of a block with their names in capitals.
fn pins<'a>(element: &'a XmlElement, list: &str) -> impl Iterator<Item = (String, &'a XmlElement)> {
    let lists = element.child(list).into_iter().flat_map(|list| list.children.iter());
    let pins = lists.filter(|pin| pin.name == "variable");
    pins.map(|pin| (pin.attribute("formalParameter").unwrap_or_default().to_ascii_uppercase(), pin))
}

fn type_name(element: &XmlElement) -> String {
    element.attribute("typeName").unwrap_or_default().to_ascii_uppercase()
}

fn comparison(name: &str) -> Option<IlBinaryOperator> {
    let known = IlBinaryOperator::ALL.iter().find(|(operator, word)| operator.is_comparison() && *word == name);
    known.map(|(operator, _)| *operator)
}

impl<'a> BodyReader<'a> {
    /// Adds the call of a block, without its inputs.
    pub(super) fn add_block(&mut self, element: &'a XmlElement) {
        let (name, pos) = (type_name(element), element.pos);
        let has_in_out = element.child("inOutVariables").is_some_and(|list| !list.children.is_empty());
        if has_in_out {
            return self.refuse(pos, format!("the block {name} has VAR_IN_OUT"), "use inputs and outputs");
        }
        if let Some(block) = StandardBlock::from_keyword(&name) {
            let instance = element.attribute("instanceName").unwrap_or_default();
            if !is_plain_name(instance) {
                let cause = format!("the block {name} has no instance");
                return self.refuse(pos, cause, "give it the name of a variable of its type");
            }
            let call = LadderBlock {
                block,
                instance: IlName { text: instance.to_owned(), pos },
                condition: IlCondition::Always,
                powered: None,
                parameters: Vec::new(),
            };
            let action = OutputAction::Call(DrawnCall { call, powers: Vec::new(), enable: None });
            let call = self.graph.add_output(action, rank(element), pos);
            self.calls.insert(local_id(element), call);
        } else if name == "NOT" {
            let held = self.names.declare("power", IecType::Bool, pos);
            let target = variable(&held.text, pos);
            let coil = LadderOutput::Coil { kind: CoilKind::Negated, target };
            let call = self.graph.add_output(OutputAction::Output(coil, Vec::new()), rank(element), pos);
            self.calls.insert(local_id(element), call);
        } else if comparison(&name).is_some() && self.is_plain_comparison(element) {
            // A part of the logic; no call.
        } else if is_standard_function(&name) {
            let function = DrawnFunction {
                name: IlName { text: name, pos },
                arguments: Vec::new(),
                powers: Vec::new(),
                enable: None,
                targets: Vec::new(),
            };
            let call = self.graph.add_output(OutputAction::Function(function), rank(element), pos);
            self.calls.insert(local_id(element), call);
        } else {
            let hint = "use the standard functions and blocks";
            self.refuse(pos, format!("the function or block `{name}` is not read"), hint);
        }
    }

    /// Whether a comparison has two values and no power at its inputs, so that it is a contact.
    fn is_plain_comparison(&mut self, element: &'a XmlElement) -> bool {
        let inputs: Vec<_> = pins(element, "inputVariables").filter(|(name, _)| name != "EN").collect();
        let is_value = |connection: &Connection<'a>| {
            let element = connection.element;
            match element.name.as_str() {
                "inVariable" => !element.is_true("negated"),
                "block" => comparison(&type_name(element)).is_none(),
                _ => false,
            }
        };
        inputs.len() == 2
            && inputs.iter().all(|(name, pin)| {
                matches!(name.as_str(), "IN1" | "IN2") && {
                    let connections = self.connections(pin);
                    connections.len() == 1 && connections.iter().all(is_value)
                }
            })
    }

    /// Returns the value at the one connection of a pin.
    fn value_at(&mut self, element: &'a XmlElement, name: &str) -> Option<(IlOperand, Option<usize>)> {
        let pin = pins(element, "inputVariables").find(|(found, _)| found == name)?.1;
        let connection = *self.connections(pin).first()?;
        match self.signal(connection)? {
            Signal::Value(operand, need) => Some((operand, need)),
            Signal::Power(_) => {
                let cause = format!("the input {name} of {} gets power", type_name(element));
                self.refuse(pin.pos, cause, "connect a variable");
                None
            }
        }
    }

    /// Adds the node of a comparison that is a contact.
    pub(super) fn add_comparison(&mut self, element: &'a XmlElement) {
        let Some(operator) = comparison(&type_name(element)) else { return };
        if self.calls.contains_key(local_id(element)) {
            return;
        }
        let (Some((left, first)), Some((right, second))) =
            (self.value_at(element, "IN1"), self.value_at(element, "IN2"))
        else {
            return;
        };
        let is_negated = pins(element, "outputVariables").any(|(name, pin)| name != "ENO" && pin.is_true("negated"));
        let compare = LadderLogic::Compare { operator, left, right };
        let logic = if is_negated { compare.complement() } else { compare };
        let node = self.graph.add_logic(logic, element.pos);
        first.into_iter().chain(second).for_each(|need| self.graph.add_need(node, need));
        self.nodes.insert((local_id(element), "OUT".to_owned()), node);
        self.enabled.push((node, element));
    }

    /// Returns the nodes at EN; `None` if nothing is connected there.
    pub(super) fn enable(&mut self, element: &'a XmlElement) -> Option<Vec<NodeId>> {
        let pin = pins(element, "inputVariables").find(|(name, _)| name == "EN")?.1;
        Some(self.powers(pin)).filter(|nodes| !nodes.is_empty())
    }

    /// Returns what leaves an output of a block.
    pub(super) fn block_signal(&mut self, connection: Connection<'a>) -> Option<Signal> {
        let element = connection.element;
        let (name, id, pos) = (type_name(element), local_id(element), element.pos);
        let first = || pins(element, "outputVariables").map(|(name, _)| name).find(|name| name != "ENO");
        let block = StandardBlock::from_keyword(&name);
        let standard = || Some(block?.parts().iter().find(|part| !part.is_input)?.name.to_owned());
        let output =
            connection.output.map(str::to_ascii_uppercase).or_else(first).or_else(standard).unwrap_or_default();
        let is_output = |(found, _): &(String, &XmlElement)| *found == output;
        let negated = pins(element, "outputVariables").find(is_output).is_some_and(|(_, pin)| pin.is_true("negated"));
        let key = (id, if block.is_some() || output == "ENO" { output.clone() } else { "OUT".to_owned() });
        if let Some(node) = self.nodes.get(&key) {
            return Some(Signal::Power(*node));
        }
        if output == "ENO" {
            let node = self.graph.add_wire(pos);
            self.nodes.insert(key, node);
            self.enabled.push((node, element));
            self.calls.get(id).copied().into_iter().for_each(|call| self.graph.add_need(node, call));
            return Some(Signal::Power(node));
        }
        if let Some(block) = block {
            return self.part_signal(connection, block, &output, negated);
        }
        let call = *self.calls.get(id)?;
        if name == "NOT" {
            let held = self.held_by_not(call)?;
            let node = self.bool_node(held, negated, call, pos);
            self.nodes.insert(key, node);
            return Some(Signal::Power(node));
        }
        let iec_type = self.type_of_block(element, 0);
        let Some(iec_type) = iec_type else {
            self.refuse(pos, format!("the type of the value of {name} is not clear"), "connect a variable to an input");
            return None;
        };
        let held = self.held_value(call, &iec_type, pos)?;
        if iec_type == IecType::Bool {
            let node = self.bool_node(held, negated, call, pos);
            self.nodes.insert(key, node);
            return Some(Signal::Power(node));
        }
        if negated {
            self.refuse(pos, format!("the output of {name} is a number and is negated"), "remove the negation");
        }
        Some(Signal::Value(held, Some(call)))
    }

    /// Adds the contact of a BOOL that an output writes.
    fn bool_node(&mut self, operand: IlOperand, negated: bool, call: usize, pos: Pos) -> NodeId {
        let node = self.graph.add_logic(LadderLogic::Contact { negated, operand }, pos);
        self.graph.connect(node, [PowerGraph::RAIL]);
        self.graph.add_need(node, call);
        node
    }

    fn held_by_not(&mut self, call: usize) -> Option<IlOperand> {
        match &self.graph.output_mut(call)?.action {
            OutputAction::Output(LadderOutput::Coil { target, .. }, _) => Some(target.clone()),
            _ => None,
        }
    }

    /// Returns the variable that holds the value of a function; declares it first.
    fn held_value(&mut self, call: usize, iec_type: &IecType, pos: Pos) -> Option<IlOperand> {
        let OutputAction::Function(function) = &self.graph.output_mut(call)?.action else { return None };
        if let Some(target) = function.targets.first() {
            return Some(target.clone());
        }
        let name = self.names.declare("value", iec_type.clone(), pos);
        let target = variable(&name.text, pos);
        if let Some(output) = self.graph.output_mut(call)
            && let OutputAction::Function(function) = &mut output.action
        {
            function.targets.push(target.clone());
        }
        Some(target)
    }

    /// Returns what leaves an output of a standard block.
    fn part_signal(
        &mut self,
        connection: Connection<'a>,
        block: StandardBlock,
        output: &str,
        negated: bool,
    ) -> Option<Signal> {
        let (element, id) = (connection.element, local_id(connection.element));
        let call = *self.calls.get(id)?;
        let instance = element.attribute("instanceName").unwrap_or_default();
        let Some(part) = block.part(output) else {
            let cause = format!("the block {} has no output `{output}`", block.keyword());
            self.refuse(connection.pos, cause, "connect an output of the block");
            return None;
        };
        if part.iec_type() == IecType::Bool {
            let node = self.graph.add_block_output(call, instance, part.name, negated, element.pos);
            self.nodes.insert((id, output.to_owned()), node);
            return Some(Signal::Power(node));
        }
        let kind = IlOperandKind::Variable { name: instance.to_owned(), member: Some(part.name.to_owned()) };
        Some(Signal::Value(IlOperand { kind, pos: element.pos }, Some(call)))
    }

    /// Returns the type of what a connection brings.
    fn type_of(&mut self, connection: Connection<'a>, level: usize) -> Option<IecType> {
        let element = connection.element;
        match element.name.as_str() {
            "block" => match StandardBlock::from_keyword(&type_name(element)) {
                Some(block) => Some(block.part(connection.output?)?.iec_type()),
                None => self.type_of_block(element, level + 1),
            },
            "inVariable" => {
                let operand = self.operand(element, "expression")?;
                match operand.kind {
                    IlOperandKind::Literal(literal) => match (literal.prefix, literal.value) {
                        (Some(prefix), _) => Some(prefix),
                        (None, IlValue::Bool(_)) => Some(IecType::Bool),
                        (None, IlValue::Time(_)) => Some(IecType::Time),
                        (None, IlValue::Integer { .. }) => None,
                    },
                    IlOperandKind::Variable { name, member } => {
                        let found = self.variables.iter().find(|variable| variable.name.matches(&name))?;
                        match (&found.iec_type, member) {
                            (IecType::Block(block), Some(member)) => Some(block.part(&member)?.iec_type()),
                            (iec_type, _) => Some(iec_type.clone()),
                        }
                    }
                    IlOperandKind::Address(address) => Some(match address.size.map_or(1, |size| size.bits()) {
                        8 => IecType::Byte,
                        16 => IecType::Word,
                        32 => IecType::Dword,
                        _ => IecType::Bool,
                    }),
                }
            }
            _ => Some(IecType::Bool),
        }
    }

    fn type_of_block(&mut self, element: &'a XmlElement, level: usize) -> Option<IecType> {
        if let Some(known) = self.types.get(local_id(element)) {
            return known.clone();
        }
        if level > MAX_CHAIN {
            return None;
        }
        self.types.insert(local_id(element), None);
        let mut types = Vec::new();
        for (name, pin) in pins(element, "inputVariables").filter(|(name, _)| name != "EN") {
            let connections = self.connections(pin);
            let found = connections.first().and_then(|connection| self.type_of(*connection, level));
            types.push((name, found));
        }
        let known = |name: &str| types.iter().find(|(found, _)| found == name).and_then(|(_, found)| found.clone());
        let found = function_type(&type_name(element), &known);
        self.types.insert(local_id(element), found.clone());
        found
    }

    /// Gives a block its inputs.
    pub(super) fn connect_block(&mut self, element: &'a XmlElement) {
        let Some(call) = self.calls.get(local_id(element)).copied() else { return };
        let block = StandardBlock::from_keyword(&type_name(element));
        let (mut parameters, mut powers, mut needs) = (Vec::new(), Vec::new(), Vec::new());
        for (name, pin) in pins(element, "inputVariables") {
            let connections = self.connections(pin);
            if name == "EN" || connections.is_empty() {
                continue;
            }
            let negated = pin.is_true("negated");
            if pin.attribute("edge").is_some_and(|edge| edge != "none") {
                self.refuse(pin.pos, format!("the input {name} has an edge"), "connect a contact with the edge");
                continue;
            }
            let is_value = connections.len() == 1
                && !negated
                && type_name(element) != "NOT"
                && matches!(connections[0].element.name.as_str(), "inVariable" | "block");
            let signal = if is_value { self.signal(connections[0]) } else { None };
            match signal {
                Some(Signal::Value(value, need)) => {
                    needs.extend(need);
                    parameters.push(IlParameter::Input { name: IlName { text: name, pos: pin.pos }, value });
                }
                _ => {
                    let nodes = self.powers(pin);
                    powers.push((name, nodes, negated));
                }
            }
        }
        let enable = self.enable(element);
        if block.is_none() && powers.iter().any(|(_, _, negated)| *negated) {
            self.refuse(element.pos, "an input of a function is negated", "negate the contact");
        }
        let Some(output) = self.graph.output_mut(call) else { return };
        output.needs.extend(needs);
        match &mut output.action {
            OutputAction::Call(drawn) => {
                parameters.append(&mut drawn.call.parameters);
                (drawn.call.parameters, drawn.powers, drawn.enable) = (parameters, powers, enable);
            }
            OutputAction::Function(drawn) => {
                drawn.powers = powers.into_iter().map(|(name, nodes, _)| (name, nodes)).collect();
                (drawn.arguments, drawn.enable) = (parameters, enable);
            }
            // NOT.
            OutputAction::Output(_, sources) => sources.extend(powers.into_iter().flat_map(|(_, nodes, _)| nodes)),
            OutputAction::Copy(..) | OutputAction::Label(_) | OutputAction::Comment(_) => {}
        }
    }

    /// Adds what an outVariable does: an output of a call, the value of a function, a coil, or a copy.
    pub(super) fn connect_out_variable(&mut self, element: &'a XmlElement) {
        let Some(target) = self.operand(element, "expression") else { return };
        let (negated, pos) = (element.is_true("negated"), element.pos);
        let connections = self.connections(element);
        if let [connection] = connections.as_slice()
            && connection.element.name == "block"
            && !negated
            && self.take_value(*connection, &target)
        {
            return;
        }
        let mut value = None;
        if let [connection] = connections.as_slice()
            && matches!(connection.element.name.as_str(), "inVariable" | "block")
        {
            value = self.signal(*connection);
        }
        if let Some(Signal::Value(from, need)) = value {
            if negated {
                self.refuse(pos, "a number is negated", "remove the negation");
            }
            let copy = self.graph.add_output(OutputAction::Copy(from, target), rank(element), pos);
            if let Some(output) = self.graph.output_mut(copy) {
                output.needs.extend(need);
            }
            return;
        }
        let powers = self.powers(element);
        let kind = if negated { CoilKind::Negated } else { CoilKind::Store };
        let coil = LadderOutput::Coil { kind, target };
        self.graph.add_output(OutputAction::Output(coil, powers), rank(element), pos);
    }

    /// Writes the output of a block to `target` as a part of its call. Returns false if it cannot.
    fn take_value(&mut self, connection: Connection<'a>, target: &IlOperand) -> bool {
        let element = connection.element;
        let (Some(call), Some(name)) = (self.calls.get(local_id(element)).copied(), connection.output) else {
            return false;
        };
        let is_negated = pins(element, "outputVariables")
            .any(|(found, pin)| found.eq_ignore_ascii_case(name) && pin.is_true("negated"));
        let is_read = self.read_by_elements.contains(local_id(element));
        let part = StandardBlock::from_keyword(&type_name(element)).and_then(|block| block.part(name));
        let Some(output) = self.graph.output_mut(call) else { return false };
        match &mut output.action {
            OutputAction::Call(drawn) => {
                let Some(part) = part.filter(|part| !part.is_input) else { return false };
                let has_it = drawn
                    .call
                    .parameters
                    .iter()
                    .any(|known| matches!(known, IlParameter::Output { name, .. } if name.text == part.name));
                if has_it {
                    return false;
                }
                let name = IlName { text: part.name.to_owned(), pos: target.pos };
                let target = target.clone();
                drawn.call.parameters.push(IlParameter::Output { negated: is_negated, name, target });
                true
            }
            OutputAction::Function(drawn) if !is_read && !is_negated && name != "ENO" => {
                drawn.targets.push(target.clone());
                true
            }
            _ => false,
        }
    }
}

fn variable(name: &str, pos: Pos) -> IlOperand {
    IlOperand { kind: IlOperandKind::Variable { name: name.to_owned(), member: None }, pos }
}
