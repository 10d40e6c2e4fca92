//! Breakpoints of all kinds: the requests of the client, and the corresponding points of the session.

use std::collections::BTreeMap;

use emu_debug::debug::{
    AccessKind, DebugExpression, DebugSession, ExpressionPlace, PointHit, PointTrigger, WatchedRange,
};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{DapMachine, DebugAdapter};
use crate::error::DapError;
use crate::protocol::{DapRequest, DapSource, RequestError, RequestedBreakpoint, SetBreakpoints};

/// Breakpoints that a client sets together.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum BreakpointGroup {
    /// The breakpoints of one source.
    Source(String),
    Functions,
    Instructions,
    Data,
}

/// Which hits of a breakpoint count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum HitCondition {
    From(u64),
    Exactly(u64),
    Below(u64),
    Every(u64),
}

/// Makes a hit condition from its number.
type MakeHitCondition = fn(u64) -> HitCondition;

/// A part of a log message.
#[derive(Debug, Clone, PartialEq, Eq)]
enum LogMessagePart {
    Text(String),
    Value(String, DebugExpression),
}

/// A breakpoint.
#[derive(Debug, Clone)]
struct BreakpointEntry {
    /// Number for the client, never reused.
    id: i64,
    requested: RequestedBreakpoint,
    /// Number of the point in the session.
    point: Option<u32>,
    count: Option<HitCondition>,
    log: Option<Vec<LogMessagePart>>,
}

/// All breakpoints of the client.
#[derive(Debug, Clone, Default)]
pub(crate) struct BreakpointTable {
    groups: BTreeMap<BreakpointGroup, (DapSource, Vec<BreakpointEntry>)>,
    last_id: i64,
}

impl BreakpointTable {
    fn entry(&self, point: u32) -> Option<(&BreakpointGroup, &BreakpointEntry)> {
        let all = self.groups.iter().flat_map(|(group, (_, entries))| entries.iter().map(move |entry| (group, entry)));
        all.into_iter().find(|(_, entry)| entry.point == Some(point))
    }

    /// The client's number of a point.
    pub fn number(&self, point: u32) -> Option<i64> {
        self.entry(point).map(|(_, entry)| entry.id)
    }

    /// The protocol's stop reason for this point.
    pub fn reason(&self, point: u32) -> Option<&'static str> {
        self.entry(point).map(|(group, _)| match group {
            BreakpointGroup::Source(_) => "breakpoint",
            BreakpointGroup::Functions => "function breakpoint",
            BreakpointGroup::Instructions => "instruction breakpoint",
            BreakpointGroup::Data => "data breakpoint",
        })
    }

    /// Disables log points, which do not stop the machine; returns their numbers in the session.
    pub fn disable_log_points(&self, session: &mut DebugSession) -> Vec<u32> {
        let reported = self.groups.values().flat_map(|(_, entries)| entries).filter(|entry| entry.log.is_some());
        let points: Vec<u32> = reported.filter_map(|entry| entry.point).collect();
        points.iter().for_each(|id| enable(session, *id, false));
        points
    }

    /// Enables log points again.
    pub fn enable_log_points(&self, session: &mut DebugSession, points: &[u32]) {
        points.iter().for_each(|id| enable(session, *id, true));
    }
}

fn enable(session: &mut DebugSession, id: u32, on: bool) {
    if let Some(point) = session.points.get_mut(id) {
        point.enabled = on;
    }
}

/// The resolved location of a breakpoint.
struct PlacedBreakpoint {
    what: PointTrigger,
    text: String,
    /// The line, if the breakpoint is in a source.
    line: Option<u32>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct DataInfoArguments {
    variables_reference: Option<i64>,
    name: String,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct LocationArguments {
    source: DapSource,
    line: i64,
    end_line: Option<i64>,
}

impl DebugAdapter<'_> {
    /// Answers `setBreakpoints`: replaces the breakpoints of one source file.
    pub(crate) fn set_breakpoints(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let SetBreakpoints { source, breakpoints } = request.parse_arguments()?;
        let key = match (source.source_reference.filter(|number| *number > 0), &source.path, &source.name) {
            (Some(number), ..) => format!("#{number}"),
            (None, Some(path), _) => path.clone(),
            (None, None, Some(name)) => name.clone(),
            (None, None, None) => return Err(RequestError::not_found("the source has neither path nor number")),
        };
        self.replace_group(BreakpointGroup::Source(key), source, breakpoints)
    }

    /// Answers `setFunctionBreakpoints`: replaces all breakpoints at functions.
    pub(crate) fn set_function_breakpoints(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let SetBreakpoints { breakpoints, .. } = request.parse_arguments()?;
        self.replace_group(BreakpointGroup::Functions, DapSource::default(), breakpoints)
    }

    /// Answers `setInstructionBreakpoints`: replaces all breakpoints at addresses.
    pub(crate) fn set_instruction_breakpoints(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let SetBreakpoints { breakpoints, .. } = request.parse_arguments()?;
        self.replace_group(BreakpointGroup::Instructions, DapSource::default(), breakpoints)
    }

    /// Answers `setDataBreakpoints`: replaces all watchpoints.
    pub(crate) fn set_data_breakpoints(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let SetBreakpoints { breakpoints, .. } = request.parse_arguments()?;
        self.replace_group(BreakpointGroup::Data, DapSource::default(), breakpoints)
    }

    /// Replaces all breakpoints of a group.
    fn replace_group(
        &mut self,
        group: BreakpointGroup,
        source: DapSource,
        wanted: Vec<RequestedBreakpoint>,
    ) -> Result<Value, RequestError> {
        self.machine()?;
        let mut points = std::mem::take(&mut self.points);
        if let (Some((_, old)), Some(machine)) = (points.groups.remove(&group), &mut self.machine) {
            old.iter().filter_map(|entry| entry.point).for_each(|id| _ = machine.session.points.remove(id));
        }
        let mut entries = Vec::new();
        let mut reported = Vec::new();
        for wanted in wanted {
            points.last_id += 1;
            let mut entry =
                BreakpointEntry { id: points.last_id, requested: wanted, point: None, count: None, log: None };
            reported.push(self.install_breakpoint(&group, &source, &mut entry));
            entries.push(entry);
        }
        points.groups.insert(group, (source, entries));
        self.points = points;
        Ok(json!({ "breakpoints": reported }))
    }

    /// Sets all breakpoints again in a new machine.
    pub(crate) fn reinstall_breakpoints(&mut self) {
        let mut points = std::mem::take(&mut self.points);
        for (group, (source, entries)) in &mut points.groups {
            for entry in entries {
                let reported = self.install_breakpoint(group, source, entry);
                self.event("breakpoint", json!({ "reason": "changed", "breakpoint": reported }));
            }
        }
        self.points = points;
    }

    /// Sets a breakpoint in the session; returns its description for the client.
    fn install_breakpoint(
        &mut self,
        group: &BreakpointGroup,
        source: &DapSource,
        entry: &mut BreakpointEntry,
    ) -> Value {
        entry.point = None;
        let mut reported = json!({ "id": entry.id, "verified": false });
        let client = self.client.clone();
        let no_debug = self.is_without_breakpoints();
        let Some(machine) = self.machine.as_mut().filter(|_| !no_debug) else {
            reported["message"] = "the program runs without breakpoints (noDebug)".into();
            return reported;
        };
        let own_line = client.line_from_client(entry.requested.line);
        let found = machine.locate_breakpoint(group, source, &entry.requested, own_line).and_then(|placed| {
            let condition = entry.requested.condition.as_deref().filter(|text| !text.trim().is_empty());
            let session = &machine.session;
            let condition = match &placed.what {
                // A name in the condition is resolved in the scope of the breakpoint's location.
                PointTrigger::Code(words) => {
                    let at = words.first().copied().unwrap_or_default();
                    condition.map(|text| session.scope.parse_expression_at_word(text, at)).transpose()?
                }
                _ => condition
                    .map(|text| session.scope.parse_expression_in_frame(text, session.machine(), 0))
                    .transpose()?,
            };
            let count = entry.requested.hit_condition.as_deref().filter(|text| !text.trim().is_empty());
            entry.count = count.map(HitCondition::parse).transpose()?;
            let log = entry.requested.log_message.as_deref().filter(|text| !text.is_empty());
            let at = if let PointTrigger::Code(words) = &placed.what { words.first().copied() } else { None };
            entry.log = log.map(|text| parse_log_message(&machine.session, at, text)).transpose()?;
            Ok::<_, DapError>((placed, condition))
        });
        match found {
            Err(error) => reported["message"] = error.to_string().into(),
            Ok((PlacedBreakpoint { what, text, line }, condition)) => {
                reported["verified"] = true.into();
                if let PointTrigger::Code(words) = &what
                    && let Some(word) = words.first()
                {
                    let address = machine.session.scope.chip().code_address(*word);
                    reported["instructionReference"] = format!("0x{address:04x}").into();
                }
                if let Some(line) = line {
                    reported["line"] = client.line(line).into();
                }
                let id = machine.session.points.add(what, &text, false);
                if let Some(point) = machine.session.points.get_mut(id) {
                    point.condition = condition;
                }
                entry.point = Some(id);
            }
        }
        reported
    }

    /// The hits that count; log messages are sent.
    pub(crate) fn filter_hits(&mut self, mut hits: Vec<PointHit>) -> Vec<PointHit> {
        let mut reported = Vec::new();
        let Some(machine) = &self.machine else { return hits };
        hits.retain(|hit| {
            let Some((_, entry)) = self.points.entry(hit.id) else { return true };
            let number = machine.session.points.get(hit.id).map_or(0, |point| point.hits);
            let counts = entry.count.is_none_or(|count| count.is_met(number));
            if let Some(pieces) = entry.log.as_ref().filter(|_| counts) {
                reported.push(pieces.iter().map(|piece| piece.text(&machine.session)).collect::<String>());
            }
            counts && entry.log.is_none()
        });
        reported.iter().for_each(|text| self.output("console", &format!("{text}\n")));
        hits
    }

    /// Answers `dataBreakpointInfo`: whether a variable or expression can be watched.
    pub(crate) fn data_breakpoint_info(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let DataInfoArguments { variables_reference, name } = request.parse_arguments()?;
        let machine = self.machine()?;
        let container = variables_reference.filter(|number| *number > 0);
        let text = match container {
            Some(container) => machine.evaluate_name(container, &name).unwrap_or_else(|| name.clone()),
            None => name.clone(),
        };
        let target = machine.session.machine();
        let found =
            machine.session.scope.parse_expression_in_frame(&text, target, 0).map(|expr| expr.bind_to_place(target));
        Ok(match found {
            Err(why) => json!({ "dataId": null, "description": why.to_string() }),
            Ok(expr) => {
                let memory = matches!(
                    expr,
                    DebugExpression::Place(ExpressionPlace::Memory { .. } | ExpressionPlace::Bit { .. })
                );
                let reported =
                    memory && machine.session.scope.parse_watched_range(&text, machine.session.machine()).is_ok();
                let types: &[&str] = if reported { &["read", "write", "readWrite"] } else { &["write"] };
                json!({ "dataId": text, "description": text, "accessTypes": types, "canPersist": true })
            }
        })
    }

    /// Answers `breakpointLocations`: the lines of a range that have code.
    pub(crate) fn breakpoint_locations(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        const MOST: u32 = 10_000;
        let LocationArguments { source, line, end_line } = request.parse_arguments()?;
        let client = self.client.clone();
        let (first, last) = (client.line_from_client(line), client.line_from_client(end_line.unwrap_or(line)));
        let machine = self.machine()?;
        let lines = first..=last.min(first.saturating_add(MOST));
        let found = lines.filter(|line| machine.words_of(&source, *line).is_ok_and(|found| found.line == *line));
        let found: Vec<Value> = found.map(|line| json!({ "line": client.line(line) })).collect();
        Ok(json!({ "breakpoints": found }))
    }
}

impl DapMachine {
    fn locate_breakpoint(
        &mut self,
        group: &BreakpointGroup,
        source: &DapSource,
        wanted: &RequestedBreakpoint,
        line: u32,
    ) -> Result<PlacedBreakpoint, DapError> {
        match group {
            BreakpointGroup::Source(_) => {
                let found = self.words_of(source, line)?;
                let lines = self.session.scope.source();
                let first = found.words.first().and_then(|word| lines.line_at(*word));
                let text = first.map_or(String::new(), |line| format!("{}:{}", line.file, found.line));
                Ok(PlacedBreakpoint { what: PointTrigger::Code(found.words), text, line: Some(found.line) })
            }
            BreakpointGroup::Functions => {
                let words = match self.ladder.as_ref().and_then(|ladder| ladder.parse_name(&wanted.name)) {
                    Some(word) => vec![word?],
                    None => match self.session.scope.function_words(wanted.name.trim()) {
                        words if words.is_empty() => self.session.scope.source().parse_words(&wanted.name)?,
                        words => words,
                    },
                };
                Ok(PlacedBreakpoint { what: PointTrigger::Code(words), text: wanted.name.clone(), line: None })
            }
            BreakpointGroup::Instructions => {
                let word = self.code_word(&wanted.instruction_reference, wanted.offset.unwrap_or(0))?;
                Ok(PlacedBreakpoint { what: PointTrigger::Code(vec![word]), text: String::new(), line: None })
            }
            BreakpointGroup::Data => {
                let scope = &self.session.scope;
                let expr = scope
                    .parse_expression_in_frame(&wanted.data_id, self.session.machine(), 0)?
                    .bind_to_place(self.session.machine());
                let reported = || {
                    let found = scope.parse_watched_range(&wanted.data_id, self.session.machine());
                    found.map_err(|error| DapError::NotAccessible(Box::new(error.into())))
                };
                let access = |access| {
                    reported()
                        .map(|WatchedRange { range, description: text }| (PointTrigger::Access(range, access), text))
                };
                let (what, text) = match (wanted.access_type.as_deref(), expr.place(self.session.machine())) {
                    (Some("read"), _) => access(AccessKind::Read)?,
                    (Some("readWrite"), _) => access(AccessKind::Any)?,
                    (None | Some("write"), Some(ExpressionPlace::Pin(pin))) => {
                        (PointTrigger::Pin(pin, None), wanted.data_id.clone())
                    }
                    (None | Some("write"), _) => (PointTrigger::Change(expr), wanted.data_id.clone()),
                    (Some(other), _) => return Err(DapError::UnknownAccess { access: other.to_owned() }),
                };
                Ok(PlacedBreakpoint { what, text, line: None })
            }
        }
    }
}

impl HitCondition {
    /// Parses a hit condition. `5` or `>=5`: the fifth hit and all later ones; `>5`, `<5`, `<=5`, `==5`;
    /// `%5`: every fifth hit.
    fn parse(text: &str) -> Result<HitCondition, DapError> {
        let text = text.trim();
        let kinds: [(&str, MakeHitCondition); 7] = [
            (">=", HitCondition::From),
            ("<=", |n| HitCondition::Below(n.saturating_add(1))),
            ("==", HitCondition::Exactly),
            (">", |n| HitCondition::From(n.saturating_add(1))),
            ("<", HitCondition::Below),
            ("=", HitCondition::Exactly),
            ("%", HitCondition::Every),
        ];
        let found = kinds.iter().find_map(|(sign, kind)| Some((text.strip_prefix(sign)?, *kind)));
        let (number, kind) = found.unwrap_or((text, HitCondition::From));
        let number = number.trim().parse().ok().filter(|number| *number > 0);
        number.map(kind).ok_or_else(|| DapError::BadHitCondition { text: text.to_owned() })
    }

    fn is_met(self, hits: u64) -> bool {
        match self {
            HitCondition::From(least) => hits >= least,
            HitCondition::Exactly(number) => hits == number,
            HitCondition::Below(end) => hits < end,
            HitCondition::Every(number) => hits.is_multiple_of(number),
        }
    }
}

/// Parses a log message with expressions in braces.
fn parse_log_message(session: &DebugSession, at: Option<u32>, text: &str) -> Result<Vec<LogMessagePart>, DapError> {
    let (mut found, mut rest) = (Vec::new(), text);
    while let Some((before, behind)) = rest.split_once('{') {
        let (inner, after) = behind.split_once('}').ok_or_else(|| DapError::UnclosedBrace { text: text.to_owned() })?;
        found.push(LogMessagePart::Text(before.to_owned()));
        let expr = match at {
            Some(word) => session.scope.parse_expression_at_word(inner, word)?,
            None => session.scope.parse_expression(inner)?,
        };
        found.push(LogMessagePart::Value(inner.to_owned(), expr));
        rest = after;
    }
    found.push(LogMessagePart::Text(rest.to_owned()));
    Ok(found)
}

impl LogMessagePart {
    fn text(&self, session: &DebugSession) -> String {
        match self {
            LogMessagePart::Text(text) => text.clone(),
            LogMessagePart::Value(text, expr) => match expr.evaluate(session.machine()) {
                Some(value) => value.text(),
                None => format!("{{{text}: no value}}"),
            },
        }
    }
}
