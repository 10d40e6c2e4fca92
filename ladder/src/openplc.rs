//! Files of OpenPLC Editor 4: `PROGRAM`, variables, then the rungs as JSON (nodes and edges), which become
//! the elements of a ladder diagram of PLCopen.

use std::collections::BTreeMap;

use diag::{Diagnostic, Pos, Severity};
use serde_json::Value;

use crate::codes;
use crate::diagram::MAX_DRAWN;
use crate::il::{self, IlProgram};
use crate::plcopen::read_ladder;
use crate::xml::XmlElement;

/// Distance of two rungs; larger than any rung.
const RUNG_HEIGHT: i64 = 1_000_000;

/// Reads a program.
///
/// # Errors
/// Returns all faults: what is damaged, and by name what is not read.
pub(crate) fn read(file: &str, text: &str) -> Result<(IlProgram, Vec<Diagnostic>), Vec<Diagnostic>> {
    let fault = |code, pos, cause: String, hint: &str| Diagnostic::new(Severity::Error, code, file, pos, cause, hint);
    let size = text.len();
    if size > crate::parse::MAX_BYTES {
        let cause = format!("the file has {size} bytes; the limit is {}", crate::parse::MAX_BYTES);
        return Err(vec![fault(codes::XML, Pos::new(1, 1, 1), cause, "divide the program")]);
    }
    let Some((head, json, line)) = divided(text) else {
        let cause = "the rungs in JSON, or the program, have no end".to_owned();
        return Err(vec![fault(codes::XML, Pos::new(1, 1, 1), cause, "save the file again in its editor")]);
    };
    let read = il::read(file, &(with_addresses_first(head) + "\nEND_PROGRAM\n"))?;
    let value: Value = serde_json::from_str(json).map_err(|why| {
        let number = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let pos = Pos::new(line.saturating_add(number(why.line())).saturating_sub(1), number(why.column()).max(1), 1);
        vec![fault(codes::XML, pos, format!("the JSON is damaged: {why}"), "save the file again in its editor")]
    })?;
    let mut reader = RungReader { file, places: places(json, line), first: Pos::new(line, 1, 1), faults: Vec::new() };
    let body = reader.body(&value);
    if !reader.faults.is_empty() {
        return Err(reader.faults);
    }
    let mut program = read.program;
    program.instructions = read_ladder(file, &body, &mut program.variables)?;
    let faults = il::link_faults(&program);
    if faults.iter().any(Diagnostic::is_error) { Err(faults) } else { Ok((program, read.warnings)) }
}

/// Returns the text before the JSON, the JSON, and the number of its first line.
fn divided(text: &str) -> Option<(&str, &str, u32)> {
    let is_closed = text.get(text.rfind('}')? + 1..)?.trim().eq_ignore_ascii_case("END_PROGRAM");
    let begin = text.starts_with('{').then_some(0).or_else(|| text.find("\n{").map(|at| at + 1))?;
    let end = text.rfind('}')?;
    let json = text.get(begin..=end).filter(|_| is_closed)?;
    let head = text.get(..begin)?;
    Some((head, json, u32::try_from(head.matches('\n').count() + 1).unwrap_or(u32::MAX)))
}

/// Returns declarations with the address where IEC 61131-3 has it: before the type. The editor writes
/// `name : bool AT %IX0.0;`.
fn with_addresses_first(head: &str) -> String {
    let lines = head.lines().map(|line| {
        let moved = || {
            let (name, rest) = line.split_once(':')?;
            let (iec_type, rest) = rest.split_once(" AT ")?;
            let length = rest.find([';', ' ', ':']).unwrap_or(rest.len());
            let (address, rest) = rest.split_at(length);
            Some(format!("{} AT {address} : {}{rest}", name.trim_end(), iec_type.trim()))
        };
        moved().unwrap_or_else(|| line.to_owned())
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Returns the position of each `"id": ".."` of the JSON, by the id.
fn places(json: &str, first: u32) -> BTreeMap<&str, Pos> {
    let mut places = BTreeMap::new();
    for (number, line) in (first..).zip(json.lines()) {
        let id = line.split_once("\"id\":").and_then(|(before, rest)| {
            let id = rest.trim_start().strip_prefix('"')?.split('"').next()?;
            Some((id, u32::try_from(before.chars().count() + 1).unwrap_or(u32::MAX)))
        });
        if let Some((id, column)) = id {
            places.entry(id).or_insert(Pos::new(number, column, 1));
        }
    }
    places
}

struct RungReader<'a> {
    file: &'a str,
    places: BTreeMap<&'a str, Pos>,
    first: Pos,
    faults: Vec<Diagnostic>,
}

fn text_of<'a>(value: &'a Value, name: &str) -> &'a str {
    value.get(name).and_then(Value::as_str).unwrap_or_default()
}

fn list_of<'a>(value: &'a Value, name: &str) -> &'a [Value] {
    value.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn named(name: &str, pos: Pos) -> XmlElement {
    XmlElement { name: name.to_owned(), pos, text_pos: pos, ..XmlElement::default() }
}

fn with_text(name: &str, text: &str, pos: Pos) -> XmlElement {
    XmlElement { text: text.to_owned(), ..named(name, pos) }
}

fn set(element: &mut XmlElement, name: &str, value: &str) {
    element.attributes.push((name.to_owned(), value.to_owned()));
}

impl RungReader<'_> {
    fn refuse(&mut self, pos: Pos, cause: impl Into<String>, hint: &str) {
        self.faults.push(Diagnostic::new(Severity::Error, codes::PART_NOT_READ, self.file, pos, cause, hint));
    }

    fn pos(&self, node: &Value) -> Pos {
        self.places.get(text_of(node, "id")).copied().unwrap_or(self.first)
    }

    /// Returns the rungs as a body of PLCopen.
    fn body(&mut self, value: &Value) -> XmlElement {
        let mut body = named("LD", self.first);
        let count: usize = list_of(value, "rungs").iter().map(|rung| list_of(rung, "nodes").len()).sum();
        if count > MAX_DRAWN {
            self.refuse(self.first, format!("the program has more than {MAX_DRAWN} nodes"), "divide the program");
            return body;
        }
        for (index, rung) in (0_i64..).zip(list_of(value, "rungs")) {
            let top = index.saturating_mul(RUNG_HEIGHT);
            let comment = text_of(rung, "comment").trim();
            if !comment.is_empty() {
                let mut element = with_text("comment", comment, self.pos(rung));
                element.children.push(position(top - 1, 0));
                body.children.push(element);
            }
            let mut connections = connections(rung);
            for node in list_of(rung, "nodes") {
                if let Some(element) = self.element(node, top, &mut connections) {
                    body.children.push(element);
                }
            }
        }
        body
    }

    /// Returns a node as an element with its connections.
    fn element(
        &mut self,
        node: &Value,
        top: i64,
        connections: &mut BTreeMap<(String, String), Vec<(String, String)>>,
    ) -> Option<XmlElement> {
        let (id, pos) = (text_of(node, "id"), self.pos(node));
        let data = node.get("data").unwrap_or(&Value::Null);
        let (variant, kind) = (text_of(data, "variant"), text_of(node, "type"));
        let variable = data.get("variable").map_or("", |variable| text_of(variable, "name"));
        let name = match (kind, variant) {
            ("powerRail", "left") => "leftPowerRail",
            ("powerRail", "right") => return None,
            ("contact", _) => "contact",
            ("coil", _) => "coil",
            // A wire.
            ("parallel", _) => "connector",
            ("variable", "input") => "inVariable",
            ("variable", "output") => "outVariable",
            ("block", _) => "block",
            _ => {
                self.refuse(pos, format!("the node `{kind}` is not read"), "use contacts, coils, branches and blocks");
                return None;
            }
        };
        let mut element = named(name, pos);
        set(&mut element, "localId", id);
        let at = node.get("position");
        let number = |name| at.and_then(|at| at.get(name)).and_then(Value::as_f64).map_or(0, |number| number as i64);
        element.children.push(position(top.saturating_add(number("y").clamp(0, RUNG_HEIGHT - 2)), number("x")));
        match name {
            "contact" | "coil" => {
                self.set_variant(&mut element, variant, kind);
                element.children.push(with_text("variable", variable, pos));
            }
            "inVariable" | "outVariable" => element.children.push(with_text("expression", variable, pos)),
            "block" => {
                let block = data.get("variant").unwrap_or(&Value::Null);
                set(&mut element, "typeName", text_of(block, "name"));
                set(&mut element, "instanceName", variable);
                let mut inputs = named("inputVariables", pos);
                let pins: Vec<String> =
                    connections.keys().filter(|(at, _)| at == id).map(|(_, pin)| pin.clone()).collect();
                for pin in pins {
                    let mut input = named("variable", pos);
                    set(&mut input, "formalParameter", &pin);
                    let sources = connections.remove(&(id.to_owned(), pin)).unwrap_or_default();
                    input.children.push(connection_point(&sources, pos));
                    inputs.children.push(input);
                }
                element.children.push(inputs);
                return Some(element);
            }
            _ => {}
        }
        let sources: Vec<(String, String)> =
            connections.iter().filter(|((at, _), _)| at == id).flat_map(|(_, sources)| sources.clone()).collect();
        element.children.push(connection_point(&sources, pos));
        Some(element)
    }

    fn set_variant(&mut self, element: &mut XmlElement, variant: &str, kind: &str) {
        match variant {
            "default" | "" => {}
            "negated" => set(element, "negated", "true"),
            "risingEdge" => set(element, "edge", "rising"),
            "fallingEdge" => set(element, "edge", "falling"),
            "set" | "reset" => set(element, "storage", variant),
            other => {
                let pos = element.pos;
                self.refuse(pos, format!("the {kind} `{other}` is not read"), "use another variant");
            }
        }
    }
}

fn position(y: i64, x: i64) -> XmlElement {
    let mut position = named("position", Pos::default());
    set(&mut position, "x", &x.to_string());
    set(&mut position, "y", &y.to_string());
    position
}

/// Returns the sources of each input: by node and input, nodes and outputs.
fn connections(rung: &Value) -> BTreeMap<(String, String), Vec<(String, String)>> {
    let blocks: Vec<&str> = list_of(rung, "nodes")
        .iter()
        .filter(|node| text_of(node, "type") == "block")
        .map(|node| text_of(node, "id"))
        .collect();
    let mut connections: BTreeMap<(String, String), Vec<(String, String)>> = BTreeMap::new();
    for edge in list_of(rung, "edges") {
        let (source, target) = (text_of(edge, "source"), text_of(edge, "target"));
        let output = if blocks.contains(&source) { text_of(edge, "sourceHandle") } else { "" };
        let input = text_of(edge, "targetHandle");
        let sources = connections.entry((target.to_owned(), input.to_owned())).or_default();
        sources.push((source.to_owned(), output.to_owned()));
    }
    connections
}

fn connection_point(sources: &[(String, String)], pos: Pos) -> XmlElement {
    let mut point = named("connectionPointIn", pos);
    for (source, output) in sources {
        let mut connection = named("connection", pos);
        set(&mut connection, "refLocalId", source);
        set(&mut connection, "formalParameter", output);
        point.children.push(connection);
    }
    point
}
