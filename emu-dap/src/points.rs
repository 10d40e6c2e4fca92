//! Breakpoints of all kinds: what the client wants, and the points of the session that they are.

use std::collections::BTreeMap;

use emu_debug::debug::{Access, Expr, Hit, Place, Session, What};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{Adapter, Machine};
use crate::wire::{Request, SetBreakpoints, Source, Wanted, Wrong};

/// Breakpoints that are set together.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Group {
    /// Those of a source.
    Source(String),
    Functions,
    Instructions,
    Data,
}

/// Which hits count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Count {
    From(u64),
    Exactly(u64),
    Below(u64),
    Every(u64),
}

/// Makes a count of its number.
type Kind = fn(u64) -> Count;

/// A piece of a message that is told.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Piece {
    Text(String),
    Value(String, Expr),
}

/// A breakpoint.
#[derive(Debug, Clone)]
struct Entry {
    /// Its number for the client, never used twice.
    id: i64,
    wanted: Wanted,
    /// Its number in the session.
    point: Option<u32>,
    count: Option<Count>,
    log: Option<Vec<Piece>>,
}

/// All breakpoints.
#[derive(Debug, Clone, Default)]
pub(crate) struct Table {
    groups: BTreeMap<Group, (Source, Vec<Entry>)>,
    last: i64,
}

impl Table {
    fn entry(&self, point: u32) -> Option<(&Group, &Entry)> {
        let all = self.groups.iter().flat_map(|(group, (_, entries))| entries.iter().map(move |entry| (group, entry)));
        all.into_iter().find(|(_, entry)| entry.point == Some(point))
    }

    /// The client's number of a point.
    pub fn number(&self, point: u32) -> Option<i64> {
        self.entry(point).map(|(_, entry)| entry.id)
    }

    /// What the protocol calls a stop at this point.
    pub fn reason(&self, point: u32) -> Option<&'static str> {
        self.entry(point).map(|(group, _)| match group {
            Group::Source(_) => "breakpoint",
            Group::Functions => "function breakpoint",
            Group::Instructions => "instruction breakpoint",
            Group::Data => "data breakpoint",
        })
    }

    /// Switches off what does not stop the machine but tells something; gives the numbers.
    pub fn silenced(&self, session: &mut Session) -> Vec<u32> {
        let told = self.groups.values().flat_map(|(_, entries)| entries).filter(|entry| entry.log.is_some());
        let points: Vec<u32> = told.filter_map(|entry| entry.point).collect();
        points.iter().for_each(|id| enable(session, *id, false));
        points
    }

    /// Switches it on again.
    pub fn sound(&self, session: &mut Session, points: &[u32]) {
        points.iter().for_each(|id| enable(session, *id, true));
    }
}

fn enable(session: &mut Session, id: u32, on: bool) {
    if let Some(point) = session.points.get_mut(id) {
        point.enabled = on;
    }
}

/// Where a breakpoint has come to lie.
struct Placed {
    what: What,
    text: String,
    /// The line, of one in a source.
    line: Option<u32>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct DataInfo {
    variables_reference: Option<i64>,
    name: String,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Locations {
    source: Source,
    line: i64,
    end_line: Option<i64>,
}

impl Adapter<'_> {
    pub(crate) fn set_breakpoints(&mut self, request: &Request) -> Result<Value, Wrong> {
        let SetBreakpoints { source, breakpoints } = request.arguments()?;
        let key = match (source.source_reference.filter(|number| *number > 0), &source.path, &source.name) {
            (Some(number), ..) => format!("#{number}"),
            (None, Some(path), _) => path.clone(),
            (None, None, Some(name)) => name.clone(),
            (None, None, None) => return Err(Wrong::nothing("the source has neither path nor number")),
        };
        self.set(Group::Source(key), source, breakpoints)
    }

    pub(crate) fn set_function_breakpoints(&mut self, request: &Request) -> Result<Value, Wrong> {
        let SetBreakpoints { breakpoints, .. } = request.arguments()?;
        self.set(Group::Functions, Source::default(), breakpoints)
    }

    pub(crate) fn set_instruction_breakpoints(&mut self, request: &Request) -> Result<Value, Wrong> {
        let SetBreakpoints { breakpoints, .. } = request.arguments()?;
        self.set(Group::Instructions, Source::default(), breakpoints)
    }

    pub(crate) fn set_data_breakpoints(&mut self, request: &Request) -> Result<Value, Wrong> {
        let SetBreakpoints { breakpoints, .. } = request.arguments()?;
        self.set(Group::Data, Source::default(), breakpoints)
    }

    /// Sets all breakpoints of a group, in place of those that were there.
    fn set(&mut self, group: Group, source: Source, wanted: Vec<Wanted>) -> Result<Value, Wrong> {
        self.machine()?;
        let mut points = std::mem::take(&mut self.points);
        if let (Some((_, old)), Some(machine)) = (points.groups.remove(&group), &mut self.machine) {
            old.iter().filter_map(|entry| entry.point).for_each(|id| _ = machine.session.points.remove(id));
        }
        let mut entries = Vec::new();
        let mut told = Vec::new();
        for wanted in wanted {
            points.last += 1;
            let mut entry = Entry { id: points.last, wanted, point: None, count: None, log: None };
            told.push(self.placed(&group, &source, &mut entry));
            entries.push(entry);
        }
        points.groups.insert(group, (source, entries));
        self.points = points;
        Ok(json!({ "breakpoints": told }))
    }

    /// All breakpoints in a machine that was made anew.
    pub(crate) fn place_points_anew(&mut self) {
        let mut points = std::mem::take(&mut self.points);
        for (group, (source, entries)) in &mut points.groups {
            for entry in entries {
                let told = self.placed(group, source, entry);
                self.event("breakpoint", json!({ "reason": "changed", "breakpoint": told }));
            }
        }
        self.points = points;
    }

    /// Puts a breakpoint into the session; gives what the client is told of it.
    fn placed(&mut self, group: &Group, source: &Source, entry: &mut Entry) -> Value {
        entry.point = None;
        let mut told = json!({ "id": entry.id, "verified": false });
        let client = self.client.clone();
        let no_debug = self.no_debug();
        let Some(machine) = self.machine.as_mut().filter(|_| !no_debug) else {
            told["message"] = "the program runs without breakpoints (noDebug)".into();
            return told;
        };
        let own_line = client.own_line(entry.wanted.line);
        let found = machine.place(group, source, &entry.wanted, own_line).and_then(|placed| {
            let condition = entry.wanted.condition.as_deref().filter(|text| !text.trim().is_empty());
            let session = &machine.session;
            let condition = match &placed.what {
                // What has a name where a breakpoint is, is meant there.
                What::Code(words) => {
                    let at = words.first().copied().unwrap_or_default();
                    condition.map(|text| session.scope.expr_at(text, at)).transpose()?
                }
                _ => condition.map(|text| session.scope.expr_in(text, session.target(), 0)).transpose()?,
            };
            let count = entry.wanted.hit_condition.as_deref().filter(|text| !text.trim().is_empty());
            entry.count = count.map(Count::read).transpose()?;
            let log = entry.wanted.log_message.as_deref().filter(|text| !text.is_empty());
            let at = if let What::Code(words) = &placed.what { words.first().copied() } else { None };
            entry.log = log.map(|text| pieces(&machine.session, at, text)).transpose()?;
            Ok((placed, condition))
        });
        match found {
            Err(why) => told["message"] = why.into(),
            Ok((Placed { what, text, line }, condition)) => {
                told["verified"] = true.into();
                if let What::Code(words) = &what
                    && let Some(word) = words.first()
                {
                    let address = machine.session.scope.chip().code_address(*word);
                    told["instructionReference"] = format!("0x{address:04x}").into();
                }
                if let Some(line) = line {
                    told["line"] = client.line(line).into();
                }
                let id = machine.session.points.add(what, &text, false);
                if let Some(point) = machine.session.points.get_mut(id) {
                    point.condition = condition;
                }
                entry.point = Some(id);
            }
        }
        told
    }

    /// Those of the hits that count; messages are told.
    pub(crate) fn counting(&mut self, mut hits: Vec<Hit>) -> Vec<Hit> {
        let mut told = Vec::new();
        let Some(machine) = &self.machine else { return hits };
        hits.retain(|hit| {
            let Some((_, entry)) = self.points.entry(hit.id) else { return true };
            let number = machine.session.points.get(hit.id).map_or(0, |point| point.hits);
            let counts = entry.count.is_none_or(|count| count.holds(number));
            if let Some(pieces) = entry.log.as_ref().filter(|_| counts) {
                told.push(pieces.iter().map(|piece| piece.text(&machine.session)).collect::<String>());
            }
            counts && entry.log.is_none()
        });
        told.iter().for_each(|text| self.output("console", &format!("{text}\n")));
        hits
    }

    pub(crate) fn data_breakpoint_info(&mut self, request: &Request) -> Result<Value, Wrong> {
        let DataInfo { variables_reference, name } = request.arguments()?;
        let machine = self.machine()?;
        let container = variables_reference.filter(|number| *number > 0);
        let text = match container {
            Some(container) => machine.evaluated_as(container, &name).unwrap_or_else(|| name.clone()),
            None => name.clone(),
        };
        let target = machine.session.target();
        let found = machine.session.scope.expr_in(&text, target, 0).map(|expr| expr.in_its_place(target));
        Ok(match found {
            Err(why) => json!({ "dataId": null, "description": why }),
            Ok(expr) => {
                let memory = matches!(expr, Expr::Place(Place::Memory { .. } | Place::Bit { .. }));
                let told = memory && machine.session.scope.accessed(&text, machine.session.target()).is_ok();
                let types: &[&str] = if told { &["read", "write", "readWrite"] } else { &["write"] };
                json!({ "dataId": text, "description": text, "accessTypes": types, "canPersist": true })
            }
        })
    }

    pub(crate) fn breakpoint_locations(&mut self, request: &Request) -> Result<Value, Wrong> {
        const MOST: u32 = 10_000;
        let Locations { source, line, end_line } = request.arguments()?;
        let client = self.client.clone();
        let (first, last) = (client.own_line(line), client.own_line(end_line.unwrap_or(line)));
        let machine = self.machine()?;
        let lines = first..=last.min(first.saturating_add(MOST));
        let found = lines.filter(|line| machine.words_of(&source, *line).is_ok_and(|found| found.line == *line));
        let found: Vec<Value> = found.map(|line| json!({ "line": client.line(line) })).collect();
        Ok(json!({ "breakpoints": found }))
    }
}

impl Machine {
    fn place(&mut self, group: &Group, source: &Source, wanted: &Wanted, line: u32) -> Result<Placed, String> {
        match group {
            Group::Source(_) => {
                let found = self.words_of(source, line)?;
                Ok(Placed { what: What::Code(found.words), text: String::new(), line: Some(found.line) })
            }
            Group::Functions => {
                let words = match self.ladder.as_ref().and_then(|ladder| ladder.named(&wanted.name)) {
                    Some(word) => vec![word?],
                    None => match self.session.scope.function_words(wanted.name.trim()) {
                        words if words.is_empty() => self.session.scope.source().words(&wanted.name)?,
                        words => words,
                    },
                };
                Ok(Placed { what: What::Code(words), text: wanted.name.clone(), line: None })
            }
            Group::Instructions => {
                let word = self.code_word(&wanted.instruction_reference, wanted.offset.unwrap_or(0))?;
                Ok(Placed { what: What::Code(vec![word]), text: String::new(), line: None })
            }
            Group::Data => {
                let scope = &self.session.scope;
                let expr =
                    scope.expr_in(&wanted.data_id, self.session.target(), 0)?.in_its_place(self.session.target());
                let told = || {
                    let found = scope.accessed(&wanted.data_id, self.session.target());
                    found.map_err(|why| format!("{why}; `write` sees its changes"))
                };
                let access = |access| told().map(|(range, text)| (What::Access(range, access), text));
                let (what, text) = match (wanted.access_type.as_deref(), expr.place(self.session.target())) {
                    (Some("read"), _) => access(Access::Read)?,
                    (Some("readWrite"), _) => access(Access::Any)?,
                    (None | Some("write"), Some(Place::Pin(pin))) => (What::Pin(pin, None), wanted.data_id.clone()),
                    (None | Some("write"), _) => (What::Change(expr), wanted.data_id.clone()),
                    (Some(other), _) => return Err(format!("`{other}` is no kind of access")),
                };
                Ok(Placed { what, text, line: None })
            }
        }
    }
}

impl Count {
    /// `5` or `>=5`: the fifth hit and all behind it; `>5`, `<5`, `<=5`, `==5`; `%5`: every fifth.
    fn read(text: &str) -> Result<Count, String> {
        let text = text.trim();
        let kinds: [(&str, Kind); 7] = [
            (">=", Count::From),
            ("<=", |n| Count::Below(n.saturating_add(1))),
            ("==", Count::Exactly),
            (">", |n| Count::From(n.saturating_add(1))),
            ("<", Count::Below),
            ("=", Count::Exactly),
            ("%", Count::Every),
        ];
        let found = kinds.iter().find_map(|(sign, kind)| Some((text.strip_prefix(sign)?, *kind)));
        let (number, kind) = found.unwrap_or((text, Count::From));
        let number = number.trim().parse().ok().filter(|number| *number > 0);
        number.map(kind).ok_or_else(|| format!("`{text}` counts no hits; write 5, >5, ==5 or %5"))
    }

    fn holds(self, hits: u64) -> bool {
        match self {
            Count::From(least) => hits >= least,
            Count::Exactly(number) => hits == number,
            Count::Below(end) => hits < end,
            Count::Every(number) => hits.is_multiple_of(number),
        }
    }
}

/// A message with expressions in braces.
fn pieces(session: &Session, at: Option<u32>, text: &str) -> Result<Vec<Piece>, String> {
    let (mut found, mut rest) = (Vec::new(), text);
    while let Some((before, behind)) = rest.split_once('{') {
        let (inner, after) = behind.split_once('}').ok_or_else(|| format!("a }} is missing in `{text}`"))?;
        found.push(Piece::Text(before.to_owned()));
        let expr = match at {
            Some(word) => session.scope.expr_at(inner, word)?,
            None => session.scope.expr(inner)?,
        };
        found.push(Piece::Value(inner.to_owned(), expr));
        rest = after;
    }
    found.push(Piece::Text(rest.to_owned()));
    Ok(found)
}

impl Piece {
    fn text(&self, session: &Session) -> String {
        match self {
            Piece::Text(text) => text.clone(),
            Piece::Value(text, expr) => match expr.amount(session.target()) {
                Some(value) => value.text(),
                None => format!("{{{text}: no value}}"),
            },
        }
    }
}
