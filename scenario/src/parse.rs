//! Parses TOML text into a scenario. The parser reports all faults of a file, not only the first.

mod named_values;

use std::ops::Range;

use diag::{Diagnostic, Pos, Severity, nearest};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::codes::{NOT_A_TIME, NOT_TOML, UNKNOWN_KEY, WRONG_STEP, WRONG_VALUE};
use crate::model::{LocatedBytes, LocatedText, Repetition, Scenario, ScenarioStep, StepAction, StepTime};
use crate::step_keys::{KEYS, STEP_KEYS, StepKey};
use crate::time::{TimeSpan, message_text};
use crate::toml_values::{kind_name, parse_number};

/// Maximum number of rounds of a repetition.
const MAX_ROUNDS: i64 = 1_000_000;
/// Maximum nesting depth of repetitions.
const MAX_DEPTH: u32 = 8;

/// The hint for an invalid time.
const TIME_HINT: &str = "write a number and us, ms, s, cycles or scans, as in \"10ms\"";

/// A TOML value with its position.
pub(crate) type LocatedItem<'a> = Spanned<DeValue<'a>>;

/// Parses a scenario; the bytes must be UTF-8.
///
/// # Errors
/// All faults of the file.
pub fn parse_bytes(file: &str, bytes: &[u8]) -> Result<Scenario, Vec<Diagnostic>> {
    let error = match std::str::from_utf8(bytes) {
        Ok(text) => return parse(file, text),
        Err(error) => error,
    };
    let before = String::from_utf8_lossy(bytes.get(..error.valid_up_to()).unwrap_or_default());
    let line = before.matches('\n').count() as u32 + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() as u32 + 1;
    let (cause, hint) = ("this is not TOML: bytes that are not UTF-8", "save the file as UTF-8");
    Err(vec![Diagnostic::new(Severity::Error, NOT_TOML, file, Pos::new(line, column, 1), cause.to_owned(), hint)])
}

/// The hint for a name that TOML splits at a point.
const QUOTES: &str = "write names with a colon or a point in quotes: \"P1.0\" = 1, \"data:0x20\" = 1";

/// Parses a scenario.
///
/// # Errors
/// All faults of the file.
pub fn parse(file: &str, text: &str) -> Result<Scenario, Vec<Diagnostic>> {
    let starts = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
    let mut reader = ScenarioReader { file, text, starts, faults: Vec::new() };
    let table = match DeTable::parse(text) {
        Ok(table) => table,
        Err(error) => {
            let span = error.span().unwrap_or(0..0);
            let cause = message_text(error.message().lines().next().unwrap_or_default());
            let hint = match error.message().contains("unquoted key") {
                true => QUOTES,
                false => "docs/scenario.md has examples",
            };
            reader.report(NOT_TOML, span, format!("this is not TOML: {cause}"), hint);
            return Err(reader.faults);
        }
    };
    let scenario = reader.read_scenario(table.get_ref());
    if reader.faults.is_empty() {
        return Ok(scenario);
    }
    reader.faults.sort_by_key(|fault| fault.pos);
    Err(reader.faults)
}

struct ScenarioReader<'t> {
    file: &'t str,
    text: &'t str,
    /// Byte offset of each line.
    starts: Vec<usize>,
    faults: Vec<Diagnostic>,
}

impl ScenarioReader<'_> {
    fn pos(&self, span: Range<usize>) -> Pos {
        let line = self.starts.partition_point(|start| *start <= span.start);
        let start = self.starts.get(line.saturating_sub(1)).copied().unwrap_or_default();
        let column = self.text.get(start..span.start).unwrap_or_default().chars().count() as u32 + 1;
        let line = line as u32;
        let marked = self.text.get(span).unwrap_or_default().lines().next().unwrap_or_default();
        Pos::new(line, column, marked.chars().count().clamp(1, 200) as u32)
    }

    fn report(&mut self, code: &'static str, span: Range<usize>, cause: String, hint: &str) {
        let pos = self.pos(span);
        self.faults.push(Diagnostic::new(Severity::Error, code, self.file, pos, cause, hint));
    }

    fn report_wrong_value(&mut self, item: &LocatedItem<'_>, key: &str, wanted: &str, hint: &str) {
        let cause = format!("`{}` takes {wanted}, not {}", message_text(key), kind_name(item.get_ref()));
        self.report(WRONG_VALUE, item.span(), cause, hint);
    }

    fn read_scenario(&mut self, table: &DeTable<'_>) -> Scenario {
        let mut out = Scenario { file: self.file.to_owned(), ..Scenario::default() };
        for (key, item) in table.iter() {
            match key.get_ref().as_ref() {
                "program" => out.program = self.read_text("program", item),
                "mcu" => out.mcu = self.read_text("mcu", item),
                "limit" => out.limit = self.read_time("limit", item),
                "baud" => {
                    let rate = parse_number(item).and_then(|rate| u64::try_from(rate).ok()).filter(|rate| *rate > 0);
                    match rate {
                        Some(rate) => out.baud = Some((rate, self.pos(item.span()))),
                        None => self.report_wrong_value(
                            item,
                            "baud",
                            "a whole number of bits per second",
                            "as in baud = 9600",
                        ),
                    }
                }
                "step" => out.steps = self.read_steps(item, 0),
                other => {
                    let other = other.to_owned();
                    let keys = || KEYS.iter().copied();
                    let near = nearest(&other, keys()).map(str::to_owned);
                    let hint = match near {
                        Some(near) => format!("did you mean `{near}`?"),
                        None if STEP_KEYS.iter().any(|key| key.name == other) => {
                            "this is a key of a step; put [[step]] on a line above it".to_owned()
                        }
                        None => format!("keys are {}", keys().collect::<Vec<_>>().join(", ")),
                    };
                    self.report(
                        UNKNOWN_KEY,
                        key.span(),
                        format!("a scenario has no key `{}`", message_text(&other)),
                        &hint,
                    );
                }
            }
        }
        out
    }

    fn read_steps(&mut self, item: &LocatedItem<'_>, depth: u32) -> Vec<ScenarioStep> {
        let DeValue::Array(items) = item.get_ref() else {
            self.report_wrong_value(item, "step", "tables", "begin each step with a line [[step]]");
            return Vec::new();
        };
        let mut steps = Vec::new();
        for item in items.iter() {
            match item.get_ref() {
                DeValue::Table(table) => steps.extend(self.read_step(table, item.span(), depth)),
                _ => self.report_wrong_value(item, "steps", "steps in braces", "as in steps = [{ set = { Xa = 1 } }]"),
            }
        }
        steps
    }

    /// Parses one step; `None` if it has a fault.
    fn read_step(&mut self, table: &DeTable<'_>, span: Range<usize>, depth: u32) -> Option<ScenarioStep> {
        let faults = self.faults.len();
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let mut verbs: Vec<(&StepKey, Range<usize>, &LocatedItem<'_>)> = Vec::new();
        for (key, item) in &entries {
            match STEP_KEYS.iter().find(|known| known.name == key.get_ref().as_ref()) {
                Some(known) if known.is_action => verbs.push((known, key.span(), item)),
                Some(_) => {}
                None => {
                    let name = key.get_ref().to_string();
                    let near = nearest(&name, STEP_KEYS.iter().map(|key| key.name));
                    let hint = near.map_or_else(
                        || {
                            let names: Vec<_> = STEP_KEYS.iter().map(|key| key.name).collect();
                            format!("keys are {}", names.join(", "))
                        },
                        |near| format!("did you mean `{near}`?"),
                    );
                    self.report(UNKNOWN_KEY, key.span(), format!("a step has no key `{}`", message_text(&name)), &hint);
                }
            }
        }
        if let [(first, ..), (second, at, _), ..] = verbs.as_slice() {
            let cause = format!("a step has one verb; this one has `{}` and `{}`", first.name, second.name);
            self.report(WRONG_STEP, at.clone(), cause, "put [[step]] on a line above the second");
        }
        let verb = verbs.first();
        for (key, _) in &entries {
            let name = key.get_ref().as_ref();
            let known = STEP_KEYS.iter().any(|known| known.name == name && !known.is_action);
            let always = matches!(name, "name" | "at" | "after");
            if known
                && !always
                && !verb.is_some_and(|(verb, ..)| verb.allowed_with.contains(&name))
                && self.faults.len() == faults
            {
                let with: Vec<_> =
                    STEP_KEYS.iter().filter(|k| k.allowed_with.contains(&name)).map(|k| k.name).collect();
                let cause = format!("`{name}` does not go with {}", verb.map_or("a pause", |(verb, ..)| verb.name));
                self.report(WRONG_STEP, key.span(), cause, &format!("use it with {}", with.join(", ")));
            }
        }
        let get = |name: &str| entries.iter().find(|(key, _)| key.get_ref() == name).map(|(_, item)| *item);
        let name = get("name").and_then(|item| self.read_text("name", item)).map(|name| name.text);
        let when = match (get("at"), get("after")) {
            (Some(_), Some(after)) => {
                let cause = "`at` and `after` exclude each other".to_owned();
                self.report(WRONG_STEP, after.span(), cause, "keep one of them");
                StepTime::Immediately
            }
            (Some(at), None) => self.read_time("at", at).map_or(StepTime::Immediately, StepTime::At),
            (None, Some(after)) => {
                self.read_time("after", after).map_or(StepTime::Immediately, StepTime::AfterPrevious)
            }
            (None, None) => StepTime::Immediately,
        };
        if let (Some(_), Some(every)) = (get("between"), get("every")) {
            let hint = "between looks all the time; remove `every`";
            self.report(WRONG_STEP, every.span(), "`every` and `between` exclude each other".to_owned(), hint);
        }
        let every = self.read_repetition(&get);
        let pos =
            self.pos(verb.map_or_else(
                || entries.first().map_or(span.clone(), |(key, _)| key.span()),
                |(_, span, _)| span.clone(),
            ));
        let verb = match verb {
            Some((key, at, item)) => self.read_action(key.name, at.clone(), item, &get, depth),
            None if when == StepTime::Immediately && self.faults.len() == faults => {
                let hint = "give it a verb, such as set or expect, or a time, such as after = \"1s\"";
                self.report(WRONG_STEP, span, "this step does nothing".to_owned(), hint);
                None
            }
            None => Some(StepAction::Pause),
        };
        verb.filter(|_| self.faults.len() == faults).map(|verb| ScenarioStep {
            pos,
            name,
            time: when,
            repetition: every,
            action: verb,
        })
    }

    fn read_repetition<'i, 'd: 'i>(&mut self, get: &dyn Fn(&str) -> Option<&'i LocatedItem<'d>>) -> Option<Repetition> {
        let Some(every) = get("every") else {
            for name in ["times", "until"] {
                if let Some(item) = get(name) {
                    let hint = format!("say how often, as in every = \"100ms\", or remove `{name}`");
                    self.report(WRONG_STEP, item.span(), format!("`{name}` needs `every`"), &hint);
                }
            }
            return None;
        };
        let period = self.read_time("every", every)?;
        if period.mantissa == 0 {
            self.report(NOT_A_TIME, every.span(), "a step cannot be done every 0".to_owned(), "give a time above 0");
        }
        let times = get("times").and_then(|item| self.read_count("times", item));
        let until = get("until").and_then(|item| self.read_time("until", item));
        Some(Repetition { period, times, until })
    }

    fn read_action<'i, 'd: 'i>(
        &mut self,
        verb: &str,
        at: Range<usize>,
        item: &LocatedItem<'_>,
        get: &dyn Fn(&str) -> Option<&'i LocatedItem<'d>>,
        depth: u32,
    ) -> Option<StepAction> {
        let within = |this: &mut Self| get("within").map(|item| this.read_time("within", item));
        Some(match verb {
            "set" => StepAction::Set(self.read_assignments(verb, item)?),
            "pulse" => {
                let length = self.required_time(verb, at, "for", "pulse = { Xstart = 1 }, for = \"50ms\"", get)?;
                StepAction::Pulse(self.read_bit_assignments(verb, item)?, length)
            }
            "toggle" => StepAction::Toggle(self.read_names(verb, item)?),
            "ramp" => {
                let over = self.required_time(verb, at, "over", "ramp = { Alevel = [0, 1023] }, over = \"1s\"", get)?;
                let grain = match get("grain") {
                    Some(item) => Some(self.read_time("grain", item)?),
                    None => None,
                };
                StepAction::Ramp { targets: self.read_ramp(item)?, over, grain }
            }
            "uart-send" => StepAction::Send(self.read_bytes(verb, item)?),
            "expect" => StepAction::Expect(self.read_conditions(verb, item)?, self.read_window(get)?),
            "expect-uart" => {
                let bytes = self.read_bytes(verb, item)?;
                StepAction::ExpectUart(bytes, within(self).map_or(Some(None), |span| span.map(Some))?)
            }
            "wait" => {
                let cond = self.read_conditions(verb, item)?;
                StepAction::Wait(cond, within(self).map_or(Some(None), |span| span.map(Some))?)
            }
            "never" => StepAction::Never(self.read_conditions(verb, item)?, self.read_window(get)?),
            "repeat" => {
                let rounds = self.read_count(verb, item)?;
                let Some(steps) = get("steps") else {
                    let hint = "as in repeat = 3, steps = [{ toggle = \"Xa\" }, { after = \"1s\" }]";
                    self.report(WRONG_STEP, at, "`repeat` needs `steps`".to_owned(), hint);
                    return None;
                };
                if depth >= MAX_DEPTH {
                    let cause = format!("repetitions nest at most {MAX_DEPTH} deep");
                    self.report(WRONG_STEP, at, cause, "write the inner steps out");
                    return None;
                }
                let inner = self.read_steps(steps, depth + 1);
                if matches!(steps.get_ref(), DeValue::Array(items) if items.is_empty()) {
                    self.report_wrong_value(steps, "steps", "steps in braces", "as in steps = [{ set = { Xa = 1 } }]");
                }
                StepAction::Repeat(rounds, inner)
            }
            "snapshot" => StepAction::Snapshot(self.read_text(verb, item)?),
            "log" => StepAction::Log(self.read_text(verb, item)?),
            "power-cycle" => match item.get_ref() {
                DeValue::Boolean(true) => StepAction::PowerCycle,
                _ => {
                    self.report_wrong_value(item, verb, "true", "write power-cycle = true");
                    return None;
                }
            },
            _ => StepAction::Pause,
        })
    }

    /// Parses the time that an action requires.
    fn required_time<'i, 'd: 'i>(
        &mut self,
        verb: &str,
        at: Range<usize>,
        key: &str,
        example: &str,
        get: &dyn Fn(&str) -> Option<&'i LocatedItem<'d>>,
    ) -> Option<TimeSpan> {
        match get(key) {
            Some(item) => self.read_time(key, item),
            None => {
                self.report(WRONG_STEP, at, format!("`{verb}` needs `{key}`"), &format!("as in {example}"));
                None
            }
        }
    }

    /// Parses the window of `between`: `Some(None)` if there is none, `None` if it has a fault.
    fn read_window<'i, 'd: 'i>(
        &mut self,
        get: &dyn Fn(&str) -> Option<&'i LocatedItem<'d>>,
    ) -> Option<Option<(TimeSpan, TimeSpan)>> {
        let Some(item) = get("between") else { return Some(None) };
        let pair = match item.get_ref() {
            DeValue::Array(items) if items.len() == 2 => Some((items.first()?, items.get(1)?)),
            _ => None,
        };
        let Some((from, to)) = pair else {
            self.report_wrong_value(item, "between", "two times", "as in between = [\"1s\", \"2s\"]");
            return None;
        };
        Some(Some((self.read_time("between", from)?, self.read_time("between", to)?)))
    }

    fn read_time(&mut self, key: &str, item: &LocatedItem<'_>) -> Option<TimeSpan> {
        let DeValue::String(text) = item.get_ref() else {
            let cause = format!("`{key}` takes a time, not {}", kind_name(item.get_ref()));
            self.report(NOT_A_TIME, item.span(), cause, TIME_HINT);
            return None;
        };
        let pos = self.pos(item.span());
        TimeSpan::parse(text, pos)
            .map_err(|error| self.report(NOT_A_TIME, item.span(), error.to_string(), TIME_HINT))
            .ok()
    }

    fn read_text(&mut self, key: &str, item: &LocatedItem<'_>) -> Option<LocatedText> {
        match item.get_ref() {
            DeValue::String(text) if !text.is_empty() => {
                Some(LocatedText { text: text.to_string(), pos: self.pos(item.span()) })
            }
            _ => {
                self.report_wrong_value(item, key, "a text", "write one in double quotes");
                None
            }
        }
    }

    fn read_count(&mut self, key: &str, item: &LocatedItem<'_>) -> Option<u64> {
        match parse_number(item) {
            Some(count @ 1..=MAX_ROUNDS) => Some(count as u64),
            _ => {
                self.report_wrong_value(item, key, &format!("a whole number from 1 to {MAX_ROUNDS}"), "as in 3");
                None
            }
        }
    }

    fn read_names(&mut self, verb: &str, item: &LocatedItem<'_>) -> Option<Vec<LocatedText>> {
        match item.get_ref() {
            DeValue::Array(items) if !items.is_empty() => items.iter().map(|item| self.read_text(verb, item)).collect(),
            _ => Some(vec![self.read_text(verb, item)?]),
        }
    }

    fn read_bytes(&mut self, verb: &str, item: &LocatedItem<'_>) -> Option<LocatedBytes> {
        let bytes = match item.get_ref() {
            DeValue::String(text) => Some(text.as_bytes().to_vec()),
            DeValue::Array(items) => items.iter().map(|item| parse_number(item)?.try_into().ok()).collect(),
            _ => None,
        };
        match bytes {
            Some(bytes) if !bytes.is_empty() => Some(LocatedBytes { bytes, pos: self.pos(item.span()) }),
            _ => {
                self.report_wrong_value(item, verb, "a text, or a list of bytes", "as in \"ok\\n\" or [0x41, 13]");
                None
            }
        }
    }
}
