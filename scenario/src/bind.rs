//! The names and times of a scenario, looked up at one machine.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use diag::{Diagnostic, Pos, Severity, nearest};

use crate::codes::{NO_LEVEL, NO_NAME, NO_STEP, NO_TIME, NO_VALUE, NOT_HERE, OTHER};
use crate::model::{Assign, Compare, Cond, Every, Named, Scenario, Step, Value, Verb, When};
use crate::ops::{Act, Check, Checks, Info, Line, Op, Piece, Put};
use crate::time::{Span, shown};
use crate::world::{Input, Output, Site};

/// Steps of a ramp, unless its `grain` says otherwise, and at most.
const RAMP_STEPS: u64 = 100;
const MAX_RAMP_STEPS: u64 = 10_000;

/// When a scenario ends that says nothing of it.
const LIMIT: &str = "60s";

/// A scenario on one machine, ready to be played.
#[derive(Debug)]
pub struct Bound {
    pub(crate) file: String,
    pub(crate) lines: Vec<Line>,
    pub(crate) steps: Vec<Info>,
    /// What is toggled somewhere: the inputs that make it 0 and 1.
    pub(crate) bits: Vec<[Input; 2]>,
    /// Of those the ones whose level more than one step goes by or gives.
    pub(crate) shared: Vec<bool>,
    pub(crate) limit: u64,
    /// Bytes are sent in it.
    pub sends: bool,
    /// Bits per second of what is sent, where it says so.
    pub baud: Option<u64>,
}

impl Bound {
    /// Steps, those of repetitions once.
    #[must_use]
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// There are no steps.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Machine cycles that a run needs to come to its limit, where a cycle is so many ticks.
    #[must_use]
    pub fn cycles(&self, ticks: u32) -> u64 {
        // The limit itself is the scenario's to see.
        (self.limit / u64::from(ticks.max(1))).saturating_add(1 << 16)
    }

    /// More than one step goes by, or gives, the level of a bit that this one changes, of those that toggle.
    pub(crate) fn shares(&self, act: &Act) -> bool {
        act.bits().any(|bit| self.shared.get(bit) == Some(&true))
    }

    /// The same of a single value.
    pub(crate) fn shares_bit(&self, put: &Put) -> bool {
        put.level.is_some_and(|(bit, _)| self.shared.get(bit) == Some(&true))
    }

    /// Ends at this tick at the latest, whatever the file says.
    #[must_use]
    pub fn limited(self, limit: Option<u64>) -> Bound {
        Bound { limit: limit.unwrap_or(self.limit), ..self }
    }
}

/// Looks all names and times up. `program` and `mcu`: what it is to be played on, where that is known.
///
/// # Errors
/// Everything that does not fit the machine.
pub fn bind(
    scenario: &Scenario,
    site: &mut dyn Site,
    program: Option<&str>,
    mcu: Option<&str>,
) -> Result<Bound, Vec<Diagnostic>> {
    let mut binder = Binder {
        site,
        file: &scenario.file,
        faults: Vec::new(),
        lines: Vec::new(),
        steps: Vec::new(),
        bits: Vec::new(),
        names: HashMap::new(),
        sends: false,
    };
    binder.meant("program", scenario.program.as_ref(), program);
    binder.meant("mcu", scenario.mcu.as_ref(), mcu);
    if let Some((baud, pos)) = scenario.baud
        && let Err(cause) = binder.site.rate(baud)
    {
        binder.fault(NO_VALUE, pos, cause, "as in baud = 9600");
    }
    // Before any step is read, so that what is set anywhere is known to what toggles.
    binder.toggled(&scenario.steps);
    let usual = Span::read(LIMIT, Pos::default()).ok();
    let limit = scenario.limit.as_ref().or(usual.as_ref()).map_or(0, |span| binder.ticks(span));
    for step in &scenario.steps {
        binder.step(step);
    }
    let Binder { mut faults, lines, steps, bits, sends, .. } = binder;
    if faults.is_empty() {
        let baud = scenario.baud.map(|baud| baud.0);
        let shared = shared(&lines, bits.len());
        return Ok(Bound { file: scenario.file.clone(), lines, steps, bits, shared, limit, sends, baud });
    }
    faults.sort_by_key(|fault| fault.pos);
    faults.dedup();
    Err(faults)
}

struct Binder<'s> {
    site: &'s mut dyn Site,
    file: &'s str,
    faults: Vec<Diagnostic>,
    lines: Vec<Line>,
    steps: Vec<Info>,
    bits: Vec<[Input; 2]>,
    /// Numbers of what is toggled, by name.
    names: HashMap<String, usize>,
    sends: bool,
}

impl Binder<'_> {
    fn fault(&mut self, code: &'static str, pos: Pos, cause: String, hint: &str) {
        self.faults.push(Diagnostic::new(Severity::Error, code, self.file, pos, cause, hint));
    }

    /// What a scenario says that it is for, and what it is given to.
    fn meant(&mut self, key: &str, wanted: Option<&Named>, found: Option<&str>) {
        let (Some(wanted), Some(found)) = (wanted, found) else { return };
        let last = |name: &str| name.rsplit(['/', '\\']).next().unwrap_or(name).to_ascii_lowercase();
        if last(&wanted.text) != last(found) {
            let cause = format!("this scenario is for {}, not for {}", shown(&wanted.text), shown(found));
            let hint =
                format!("give it to {}, or remove the line `{key} =` if it is meant for both", shown(&wanted.text));
            self.fault(OTHER, wanted.pos, cause, &hint);
        }
    }

    fn toggled(&mut self, steps: &[Step]) {
        for step in steps {
            match &step.verb {
                Verb::Toggle(names) => {
                    for name in names {
                        let both = [0, 1].map(|bit| self.input(name, &Value::Number(bit), name.pos));
                        let same = self.site.same(&name.text);
                        if let [Some(zero), Some(one)] = both
                            && !self.names.contains_key(&same)
                        {
                            self.names.insert(same, self.bits.len());
                            self.bits.push([zero, one]);
                        }
                    }
                }
                Verb::Repeat(_, steps) => self.toggled(steps),
                _ => {}
            }
        }
    }

    fn ticks(&mut self, span: &Span) -> u64 {
        self.site.scale().ticks(span).unwrap_or_else(|(cause, hint)| {
            self.fault(NO_TIME, span.pos, cause, hint);
            0
        })
    }

    fn input(&mut self, name: &Named, value: &Value, pos: Pos) -> Option<Input> {
        match self.site.input(&name.text, value) {
            Ok(input) => Some(input),
            Err((cause, true)) => {
                self.no_name(name, cause);
                None
            }
            Err((cause, false)) => {
                self.fault(NO_LEVEL, pos, cause, "docs/scenario.md lists what can be given");
                None
            }
        }
    }

    fn no_name(&mut self, name: &Named, cause: String) {
        let names = self.site.names();
        let near = nearest(&name.text, names.iter().map(String::as_str)).filter(|near| *near != name.text);
        let hint = near.map_or_else(|| "mend the name".to_owned(), |near| format!("did you mean `{near}`?"));
        self.fault(NO_NAME, name.pos, cause, &hint);
    }

    /// The number of what is toggled somewhere.
    fn bit(&self, name: &Named) -> Option<usize> {
        self.names.get(&self.site.same(&name.text)).copied()
    }

    fn puts(&mut self, assigns: &[Assign]) -> Vec<Put> {
        let puts = assigns.iter().filter_map(|assign| self.put(&assign.name, &assign.value, assign.pos));
        puts.collect()
    }

    fn put(&mut self, name: &Named, value: &Value, pos: Pos) -> Option<Put> {
        let input = self.input(name, value, pos)?;
        let bit = self.bit(name);
        let level = match value {
            Value::Number(level @ (0 | 1)) => bit.map(|bit| (bit, *level == 1)),
            Value::Text(text) => {
                let level = ["0", "1"].iter().position(|level| text.trim() == *level);
                bit.zip(level).map(|(bit, level)| (bit, level == 1))
            }
            _ => None,
        };
        Some(Put { input, level })
    }

    fn checks(&mut self, cond: &Cond) -> Checks {
        let mut checks = Vec::new();
        for test in cond {
            match self.site.output(&test.name.text) {
                Ok(output) => {
                    if !can_be(output, test.compare) {
                        let (low, high) = output.range;
                        let or = if output.floats { ", or z" } else { "" };
                        let what = condition(&shown(&test.name.text), &shown(&test.text));
                        let cause = format!("`{what}` never holds: its values are {low} to {high}{or}");
                        self.fault(NO_LEVEL, test.pos, cause, "mend the value");
                    }
                    checks.push(Check {
                        output: output.id,
                        compare: test.compare,
                        name: test.name.text.clone(),
                        wanted: test.text.clone(),
                    });
                }
                Err(cause) => self.no_name(&test.name, cause),
            }
        }
        checks.into()
    }

    /// Refuses a step for the reason that the machine gives.
    fn needs(&mut self, pos: Pos, can: Result<(), String>, hint: &str) {
        if let Err(cause) = can {
            self.fault(NOT_HERE, pos, cause, hint);
        }
    }

    fn line(&mut self, op: Op, step: usize) {
        self.lines.push(Line { op, step });
    }

    fn step(&mut self, step: &Step) {
        let text = step.name.clone().unwrap_or_else(|| words(&step.verb));
        let number = self.steps.len();
        self.steps.push(Info { pos: step.pos, text });
        match &step.when {
            When::Next => {}
            When::At(span) => {
                let ticks = self.ticks(span);
                self.line(Op::At(ticks), number);
            }
            When::After(span) => {
                let ticks = self.ticks(span);
                self.line(Op::After(ticks), number);
            }
        }
        let act = match &step.verb {
            Verb::Pause => return,
            Verb::Set(assigns) => Act::Put(self.puts(assigns)),
            Verb::Pulse(assigns, length) => {
                let after = self.ticks(length).max(1);
                let back = assigns.iter().map(|assign| Assign {
                    value: Value::Number(i64::from(assign.value == Value::Number(0))),
                    ..assign.clone()
                });
                let (there, back) = (self.puts(assigns), self.puts(&back.collect::<Vec<_>>()));
                Act::Series(Arc::new([(0, there), (after, back)]))
            }
            Verb::Toggle(names) => Act::Toggle(names.iter().filter_map(|name| self.bit(name)).collect()),
            Verb::Ramp { what, over, grain } => Act::Series(self.ramp(what, over, grain.as_ref())),
            Verb::Send(bytes) => {
                self.sends = true;
                let can = self.site.sends();
                self.needs(bytes.pos, can, "send bytes only where they can be received");
                Act::Send(bytes.bytes.clone())
            }
            Verb::Expect(cond, None) => Act::Check(self.checks(cond)),
            Verb::Log(text) => Act::Log(self.pieces(text)),
            Verb::Snapshot(file) => {
                let can = self.site.snapshots();
                self.needs(step.pos, can, "remove the step, or play it with `emu run`");
                Act::Snapshot(file.text.clone())
            }
            Verb::PowerCycle => {
                let can = self.site.power_cycles();
                self.needs(step.pos, can, "remove the step");
                Act::Power
            }
            Verb::Expect(cond, Some(window)) => return self.guard(cond, true, Some(window), step.pos, number),
            Verb::Never(cond, window) => return self.guard(cond, false, window.as_ref(), step.pos, number),
            Verb::ExpectUart(bytes, within) => {
                let can = self.site.receives();
                self.needs(bytes.pos, can, "expect bytes only where some are sent");
                let within = within.as_ref().map(|span| self.ticks(span));
                return self.line(Op::Hear(bytes.bytes.clone(), within), number);
            }
            Verb::Wait(cond, within) => {
                let checks = self.checks(cond);
                let within = within.as_ref().map(|span| self.ticks(span));
                return self.line(Op::Wait(checks, within), number);
            }
            Verb::Repeat(rounds, steps) => {
                self.line(Op::Repeat(*rounds), number);
                steps.iter().for_each(|step| self.step(step));
                return self.line(Op::Again, number);
            }
        };
        let op = match &step.every {
            None => Op::Do(act),
            Some(Every { period, times, until }) => {
                let (period, until) = (self.ticks(period).max(1), until.as_ref().map(|span| self.ticks(span)));
                Op::Every { period, times: *times, until, act }
            }
        };
        self.line(op, number);
    }

    fn guard(&mut self, cond: &Cond, wanted: bool, window: Option<&(Span, Span)>, pos: Pos, step: usize) {
        let checks = self.checks(cond);
        let window = window.map(|(from, to)| (self.ticks(from), self.ticks(to)));
        if window.is_some_and(|(from, to)| from > to) {
            let hint = "give the earlier time first";
            self.fault(NO_STEP, pos, "`between` ends before it begins".to_owned(), hint);
        }
        self.line(Op::Guard { checks, wanted, window }, step);
    }

    fn ramp(
        &mut self,
        what: &[(Named, Value, Value, Pos)],
        over: &Span,
        grain: Option<&Span>,
    ) -> Arc<[(u64, Vec<Put>)]> {
        let whole = self.ticks(over);
        let grain = match grain {
            None => whole.div_ceil(RAMP_STEPS).max(1),
            Some(span) => {
                let ticks = self.ticks(span).max(1);
                if whole.div_ceil(ticks) > MAX_RAMP_STEPS {
                    let cause =
                        format!("a ramp has at most {MAX_RAMP_STEPS} steps, one by `{}` has more", shown(&span.text));
                    self.fault(NO_STEP, span.pos, cause, "give a longer `grain`, or a shorter `over`");
                    return Arc::new([]);
                }
                ticks
            }
        };
        let mut at: Vec<u64> = (0..whole).step_by(usize::try_from(grain).unwrap_or(usize::MAX)).collect();
        at.push(whole);
        let mut series: Vec<(u64, Vec<Put>)> = at.into_iter().map(|at| (at, Vec::new())).collect();
        for (name, from, to, pos) in what {
            let (Some((from, unit)), Some((to, other))) = (scaled(from), scaled(to)) else {
                let hint = "as in [0, 1023] or [\"0V\", \"5V\"]";
                self.fault(NO_LEVEL, *pos, format!("`{}` cannot go from {from} to {to}", shown(&name.text)), hint);
                continue;
            };
            if unit != other {
                let hint = "give both with the same unit";
                self.fault(NO_LEVEL, *pos, "a ramp from one unit to another".to_owned(), hint);
                continue;
            }
            for (at, puts) in &mut series {
                let part = i128::from(to - from) * i128::from(*at) / i128::from(whole.max(1));
                let value = if whole == 0 { to } else { from + part as i64 };
                let value = match unit {
                    "" => Value::Number(value),
                    unit => Value::Text(format!("{value}{unit}")),
                };
                let Some(put) = self.put(name, &value, *pos) else { break };
                puts.push(put);
            }
        }
        series.into()
    }

    /// The pieces of a line: text, and values of what stands in braces.
    fn pieces(&mut self, text: &Named) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut rest = text.text.as_str();
        while let Some((before, (name, after))) =
            rest.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)))
        {
            pieces.push(Piece::Text(before.to_owned()));
            match self.site.output(name) {
                Ok(output) => pieces.push(Piece::Value(output.id)),
                Err(cause) => self.no_name(&Named { text: name.to_owned(), pos: text.pos }, cause),
            }
            rest = after;
        }
        pieces.push(Piece::Text(rest.to_owned()));
        pieces
    }
}

/// Of so many toggled bits those of which more than one step goes by the level, or gives it.
fn shared(lines: &[Line], bits: usize) -> Vec<bool> {
    let mut steps: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); bits];
    for line in lines {
        if let Op::Do(act) | Op::Every { act, .. } = &line.op {
            act.bits().for_each(|bit| steps.get_mut(bit).into_iter().for_each(|steps| _ = steps.insert(line.step)));
        }
    }
    steps.iter().map(|steps| steps.len() > 1).collect()
}

/// Something may be as a condition wants it.
fn can_be(output: Output, compare: Compare) -> bool {
    let (low, high) = output.range;
    match compare {
        Compare::Floating => output.floats,
        Compare::Is(wanted) => (low..=high).contains(&wanted),
        Compare::Not(_) => true,
        Compare::Within(from, to) => from <= high && to >= low,
    }
}

/// A number and its unit; voltages in millivolts.
fn scaled(value: &Value) -> Option<(i64, &'static str)> {
    let text = match value {
        Value::Number(number) if number.unsigned_abs() < 1 << 40 => return Some((*number, "")),
        Value::Number(_) => return None,
        Value::Text(text) => text.trim(),
    };
    if let Some(count) = text.strip_suffix("counts") {
        return Some((count.trim().parse::<u16>().ok()?.into(), "counts"));
    }
    if let Some(milli) = text.strip_suffix("mV") {
        return Some((milli.trim().parse::<u32>().ok()?.into(), "mV"));
    }
    let volts = text.strip_suffix(['V', 'v'])?.trim();
    let (whole, rest) = volts.split_once('.').unwrap_or((volts, ""));
    let digits = (rest.len() <= 3 && rest.bytes().all(|b| b.is_ascii_digit())).then(|| format!("{rest:0<3}"))?;
    let milli = i64::from(whole.parse::<u16>().ok()?) * 1000 + digits.parse::<i64>().ok()?;
    Some((milli, "mV"))
}

/// What a step does, for messages.
fn words(verb: &Verb) -> String {
    let assigns = |assigns: &[Assign]| {
        let each: Vec<_> = assigns.iter().map(|a| format!("{} = {}", a.name.text, a.value)).collect();
        each.join(", ")
    };
    let cond = |cond: &Cond| {
        let each: Vec<_> = cond.iter().map(|test| condition(&test.name.text, &test.text)).collect();
        each.join(", ")
    };
    match verb {
        Verb::Pause => "a pause".to_owned(),
        Verb::Set(what) => format!("set {}", assigns(what)),
        Verb::Pulse(what, length) => format!("pulse {} for {}", assigns(what), length.text),
        Verb::Toggle(names) => {
            format!("toggle {}", names.iter().map(|n| n.text.as_str()).collect::<Vec<_>>().join(", "))
        }
        Verb::Ramp { what, .. } => {
            format!("ramp {}", what.iter().map(|w| w.0.text.as_str()).collect::<Vec<_>>().join(", "))
        }
        Verb::Send(bytes) => format!("uart-send {}", quoted(&bytes.bytes)),
        Verb::Expect(what, _) => format!("expect {}", cond(what)),
        Verb::ExpectUart(bytes, _) => format!("expect-uart {}", quoted(&bytes.bytes)),
        Verb::Wait(what, _) => format!("wait {}", cond(what)),
        Verb::Never(what, _) => format!("never {}", cond(what)),
        Verb::Repeat(rounds, _) => format!("repeat {rounds}"),
        Verb::Snapshot(file) => format!("snapshot {}", file.text),
        Verb::Log(_) => "log".to_owned(),
        Verb::PowerCycle => "power-cycle".to_owned(),
    }
}

/// `Yarc = 1`, `Cparts > 5`.
pub(crate) fn condition(name: &str, wanted: &str) -> String {
    let sign = wanted.starts_with(['<', '>', '!', '=']);
    if sign { format!("{name} {wanted}") } else { format!("{name} = {wanted}") }
}

/// Bytes as text in quotes.
pub(crate) fn quoted(bytes: &[u8]) -> String {
    format!("\"{}\"", bytes.escape_ascii())
}
