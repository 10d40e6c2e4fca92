//! Binds a scenario to one machine: resolves its names, converts its times to ticks, and makes the ops that
//! the player executes.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use diag::{Diagnostic, Pos, Severity, nearest};

use crate::bound_scenario::BoundScenario;
use crate::codes::{
    IMPOSSIBLE_VALUE, NOT_A_TIME, OTHER_PROGRAM_OR_CHIP, UNKNOWN_NAME, UNSUPPORTED_STEP, WRONG_STEP, WRONG_VALUE,
};
use crate::error::ScenarioError;
use crate::model::{
    Assignment, Comparison, ConditionList, LocatedText, RampTarget, Repetition, Scenario, ScenarioStep, ScenarioValue,
    StepAction, StepTime,
};
use crate::play_ops::{InputWrite, LogPiece, OutputCheck, OutputChecks, PlayAction, PlayLine, PlayOp, StepInfo};
use crate::time::{TimeSpan, message_text};
use crate::world::{NameResolver, ScenarioInput, ScenarioOutput};

/// Number of steps of a ramp without `grain`.
const RAMP_STEPS: u64 = 100;
/// Maximum number of steps of a ramp.
const MAX_RAMP_STEPS: u64 = 10_000;

/// The limit of a scenario that does not set one.
const DEFAULT_LIMIT: &str = "60s";

/// Resolves all names and times of a scenario on the machine `site`. `program` and `mcu` name the program and
/// chip that the scenario is played on, if they are known.
///
/// # Errors
/// Everything in the scenario that does not fit the machine.
pub fn bind(
    scenario: &Scenario,
    site: &mut dyn NameResolver,
    program: Option<&str>,
    mcu: Option<&str>,
) -> Result<BoundScenario, Vec<Diagnostic>> {
    let mut binder = ScenarioBinder {
        site,
        file: &scenario.file,
        faults: Vec::new(),
        lines: Vec::new(),
        steps: Vec::new(),
        bits: Vec::new(),
        names: HashMap::new(),
        sends: false,
    };
    binder.check_target("program", scenario.program.as_ref(), program);
    binder.check_target("mcu", scenario.mcu.as_ref(), mcu);
    if let Some((baud, pos)) = scenario.baud
        && let Err(error) = binder.site.check_baud_rate(baud)
    {
        binder.report(WRONG_VALUE, pos, error.to_string(), "as in baud = 9600");
    }
    // Collected before any step is bound, because a `set` anywhere also changes the level that a `toggle`
    // inverts.
    binder.collect_toggled(&scenario.steps);
    let usual = TimeSpan::parse(DEFAULT_LIMIT, Pos::default()).ok();
    let limit = scenario.limit.as_ref().or(usual.as_ref()).map_or(0, |span| binder.ticks_of(span));
    for step in &scenario.steps {
        binder.bind_step(step);
    }
    let ScenarioBinder { mut faults, lines, steps, bits, sends, .. } = binder;
    if faults.is_empty() {
        let baud = scenario.baud.map(|baud| baud.0);
        let shared = find_shared_bits(&lines, bits.len());
        return Ok(BoundScenario {
            file: scenario.file.clone(),
            lines,
            steps,
            toggled_inputs: bits,
            shared_bits: shared,
            limit,
            has_send_step: sends,
            baud,
        });
    }
    faults.sort_by_key(|fault| fault.pos);
    faults.dedup();
    Err(faults)
}

struct ScenarioBinder<'s> {
    site: &'s mut dyn NameResolver,
    file: &'s str,
    faults: Vec<Diagnostic>,
    lines: Vec<PlayLine>,
    steps: Vec<StepInfo>,
    bits: Vec<[ScenarioInput; 2]>,
    /// Indices of the toggled inputs, by canonical name.
    names: HashMap<String, usize>,
    sends: bool,
}

impl ScenarioBinder<'_> {
    fn report(&mut self, code: &'static str, pos: Pos, cause: String, hint: &str) {
        self.faults.push(Diagnostic::new(Severity::Error, code, self.file, pos, cause, hint));
    }

    /// Checks that the program or chip is the one that the scenario names.
    fn check_target(&mut self, key: &str, wanted: Option<&LocatedText>, found: Option<&str>) {
        let (Some(wanted), Some(found)) = (wanted, found) else { return };
        let last = |name: &str| name.rsplit(['/', '\\']).next().unwrap_or(name).to_ascii_lowercase();
        if last(&wanted.text) != last(found) {
            let cause = format!("this scenario is for {}, not for {}", message_text(&wanted.text), message_text(found));
            let hint =
                format!("give it to {}, or remove the line `{key} =` if it is for both", message_text(&wanted.text));
            self.report(OTHER_PROGRAM_OR_CHIP, wanted.pos, cause, &hint);
        }
    }

    fn collect_toggled(&mut self, steps: &[ScenarioStep]) {
        for step in steps {
            match &step.action {
                StepAction::Toggle(names) => {
                    for name in names {
                        let both = [0, 1].map(|bit| self.resolve_input(name, &ScenarioValue::Number(bit), name.pos));
                        let same = self.site.canonical_name(&name.text);
                        if let [Some(zero), Some(one)] = both
                            && !self.names.contains_key(&same)
                        {
                            self.names.insert(same, self.bits.len());
                            self.bits.push([zero, one]);
                        }
                    }
                }
                StepAction::Repeat(_, steps) => self.collect_toggled(steps),
                _ => {}
            }
        }
    }

    fn ticks_of(&mut self, span: &TimeSpan) -> u64 {
        self.site.time_scale().ticks(span).unwrap_or_else(|error| {
            self.report(NOT_A_TIME, span.pos, error.to_string(), error.time_hint());
            0
        })
    }

    fn resolve_input(&mut self, name: &LocatedText, value: &ScenarioValue, pos: Pos) -> Option<ScenarioInput> {
        match self.site.resolve_input(&name.text, value) {
            Ok(input) => Some(input),
            Err(error @ ScenarioError::UnknownName(_)) => {
                self.report_unknown_name(name, &error);
                None
            }
            Err(error) => {
                let hint = "docs/scenario.md lists what can be given";
                self.report(IMPOSSIBLE_VALUE, pos, error.to_string(), hint);
                None
            }
        }
    }

    fn report_unknown_name(&mut self, name: &LocatedText, error: &ScenarioError) {
        let names = self.site.known_names();
        let near = nearest(&name.text, names.iter().map(String::as_str)).filter(|near| *near != name.text);
        let hint = near.map_or_else(|| "correct the name".to_owned(), |near| format!("did you mean `{near}`?"));
        self.report(UNKNOWN_NAME, name.pos, error.to_string(), &hint);
    }

    /// The index of an input if it is toggled somewhere in the scenario.
    fn toggled_bit(&self, name: &LocatedText) -> Option<usize> {
        self.names.get(&self.site.canonical_name(&name.text)).copied()
    }

    fn bind_writes(&mut self, assigns: &[Assignment]) -> Vec<InputWrite> {
        let puts = assigns.iter().filter_map(|assign| self.bind_write(&assign.name, &assign.value, assign.pos));
        puts.collect()
    }

    fn bind_write(&mut self, name: &LocatedText, value: &ScenarioValue, pos: Pos) -> Option<InputWrite> {
        let input = self.resolve_input(name, value, pos)?;
        let bit = self.toggled_bit(name);
        let level = match value {
            ScenarioValue::Number(level @ (0 | 1)) => bit.map(|bit| (bit, *level == 1)),
            ScenarioValue::Text(text) => {
                let level = ["0", "1"].iter().position(|level| text.trim() == *level);
                bit.zip(level).map(|(bit, level)| (bit, level == 1))
            }
            _ => None,
        };
        Some(InputWrite { input, level })
    }

    fn bind_checks(&mut self, cond: &ConditionList) -> OutputChecks {
        let mut checks = Vec::new();
        for test in cond {
            match self.site.resolve_output(&test.name.text) {
                Ok(output) => {
                    if !is_possible(output, test.comparison) {
                        let (low, high) = output.range;
                        let or = if output.can_float { ", or z" } else { "" };
                        let what = condition_text(&message_text(&test.name.text), &message_text(&test.text));
                        let cause = format!("`{what}` never holds: its values are {low} to {high}{or}");
                        self.report(IMPOSSIBLE_VALUE, test.pos, cause, "correct the value");
                    }
                    checks.push(OutputCheck {
                        output: output.id,
                        compare: test.comparison,
                        name: test.name.text.clone(),
                        wanted: test.text.clone(),
                    });
                }
                Err(error) => self.report_unknown_name(&test.name, &error),
            }
        }
        checks.into()
    }

    /// Reports a step that the machine refuses, with the reason of the machine.
    fn require(&mut self, pos: Pos, can: Result<(), ScenarioError>, hint: &str) {
        if let Err(error) = can {
            self.report(UNSUPPORTED_STEP, pos, error.to_string(), hint);
        }
    }

    fn push_op(&mut self, op: PlayOp, step: usize) {
        self.lines.push(PlayLine { op, step });
    }

    fn bind_step(&mut self, step: &ScenarioStep) {
        let text = step.name.clone().unwrap_or_else(|| step_text(&step.action));
        let number = self.steps.len();
        self.steps.push(StepInfo { pos: step.pos, text });
        match &step.time {
            StepTime::Immediately => {}
            StepTime::At(span) => {
                let ticks = self.ticks_of(span);
                self.push_op(PlayOp::At(ticks), number);
            }
            StepTime::AfterPrevious(span) => {
                let ticks = self.ticks_of(span);
                self.push_op(PlayOp::After(ticks), number);
            }
        }
        let act = match &step.action {
            StepAction::Pause => return,
            StepAction::Set(assigns) => PlayAction::Write(self.bind_writes(assigns)),
            StepAction::Pulse(assigns, length) => {
                let after = self.ticks_of(length).max(1);
                let back = assigns.iter().map(|assign| Assignment {
                    value: ScenarioValue::Number(i64::from(assign.value == ScenarioValue::Number(0))),
                    ..assign.clone()
                });
                let (there, back) = (self.bind_writes(assigns), self.bind_writes(&back.collect::<Vec<_>>()));
                PlayAction::Ramp(Arc::new([(0, there), (after, back)]))
            }
            StepAction::Toggle(names) => {
                PlayAction::Toggle(names.iter().filter_map(|name| self.toggled_bit(name)).collect())
            }
            StepAction::Ramp { targets: what, over, grain } => {
                PlayAction::Ramp(self.bind_ramp(what, over, grain.as_ref()))
            }
            StepAction::Send(bytes) => {
                self.sends = true;
                let can = self.site.check_can_send();
                self.require(bytes.pos, can, "send bytes only where they can be received");
                PlayAction::Send(bytes.bytes.clone())
            }
            StepAction::Expect(cond, None) => PlayAction::Check(self.bind_checks(cond)),
            StepAction::Log(text) => PlayAction::Log(self.log_pieces(text)),
            StepAction::Snapshot(file) => {
                let can = self.site.check_can_snapshot();
                self.require(step.pos, can, "remove the step, or play it with `emu run`");
                PlayAction::Snapshot(file.text.clone())
            }
            StepAction::PowerCycle => {
                let can = self.site.check_can_power_cycle();
                self.require(step.pos, can, "remove the step");
                PlayAction::Power
            }
            StepAction::Expect(cond, Some(window)) => {
                return self.bind_guard(cond, true, Some(window), step.pos, number);
            }
            StepAction::Never(cond, window) => return self.bind_guard(cond, false, window.as_ref(), step.pos, number),
            StepAction::ExpectUart(bytes, within) => {
                let can = self.site.check_can_receive();
                self.require(bytes.pos, can, "expect bytes only where some are sent");
                let within = within.as_ref().map(|span| self.ticks_of(span));
                return self.push_op(PlayOp::ExpectBytes(bytes.bytes.clone(), within), number);
            }
            StepAction::Wait(cond, within) => {
                let checks = self.bind_checks(cond);
                let within = within.as_ref().map(|span| self.ticks_of(span));
                return self.push_op(PlayOp::Wait(checks, within), number);
            }
            StepAction::Repeat(rounds, steps) => {
                self.push_op(PlayOp::Repeat(*rounds), number);
                steps.iter().for_each(|step| self.bind_step(step));
                return self.push_op(PlayOp::RepeatEnd, number);
            }
        };
        let op = match &step.repetition {
            None => PlayOp::Do(act),
            Some(Repetition { period, times, until }) => {
                let (period, until) = (self.ticks_of(period).max(1), until.as_ref().map(|span| self.ticks_of(span)));
                PlayOp::Every { period, times: *times, until, act }
            }
        };
        self.push_op(op, number);
    }

    fn bind_guard(
        &mut self,
        cond: &ConditionList,
        wanted: bool,
        window: Option<&(TimeSpan, TimeSpan)>,
        pos: Pos,
        step: usize,
    ) {
        let checks = self.bind_checks(cond);
        let window = window.map(|(from, to)| (self.ticks_of(from), self.ticks_of(to)));
        if window.is_some_and(|(from, to)| from > to) {
            let hint = "give the earlier time first";
            self.report(WRONG_STEP, pos, "`between` ends before it begins".to_owned(), hint);
        }
        self.push_op(PlayOp::Guard { checks, wanted, window }, step);
    }

    fn bind_ramp(
        &mut self,
        what: &[RampTarget],
        over: &TimeSpan,
        grain: Option<&TimeSpan>,
    ) -> Arc<[(u64, Vec<InputWrite>)]> {
        let whole = self.ticks_of(over);
        let grain = match grain {
            None => whole.div_ceil(RAMP_STEPS).max(1),
            Some(span) => {
                let ticks = self.ticks_of(span).max(1);
                if whole.div_ceil(ticks) > MAX_RAMP_STEPS {
                    let cause = format!(
                        "a ramp has at most {MAX_RAMP_STEPS} steps, one by `{}` has more",
                        message_text(&span.text)
                    );
                    self.report(WRONG_STEP, span.pos, cause, "give a longer `grain`, or a shorter `over`");
                    return Arc::new([]);
                }
                ticks
            }
        };
        let mut at: Vec<u64> = (0..whole).step_by(usize::try_from(grain).unwrap_or(usize::MAX)).collect();
        at.push(whole);
        let mut series: Vec<(u64, Vec<InputWrite>)> = at.into_iter().map(|at| (at, Vec::new())).collect();
        for RampTarget { name, from, to, pos } in what {
            let (Some((from, unit)), Some((to, other))) = (parse_scaled(from), parse_scaled(to)) else {
                let hint = "as in [0, 1023] or [\"0V\", \"5V\"]";
                self.report(
                    IMPOSSIBLE_VALUE,
                    *pos,
                    format!("`{}` cannot go from {from} to {to}", message_text(&name.text)),
                    hint,
                );
                continue;
            };
            if unit != other {
                let hint = "give both with the same unit";
                self.report(IMPOSSIBLE_VALUE, *pos, "a ramp from one unit to another".to_owned(), hint);
                continue;
            }
            for (at, puts) in &mut series {
                let part = i128::from(to - from) * i128::from(*at) / i128::from(whole.max(1));
                let value = if whole == 0 { to } else { from + part as i64 };
                let value = match unit {
                    "" => ScenarioValue::Number(value),
                    unit => ScenarioValue::Text(format!("{value}{unit}")),
                };
                let Some(put) = self.bind_write(name, &value, *pos) else { break };
                puts.push(put);
            }
        }
        series.into()
    }

    /// Splits the text of a `log` step into text and the values of the names in braces.
    fn log_pieces(&mut self, text: &LocatedText) -> Vec<LogPiece> {
        let mut pieces = Vec::new();
        let mut rest = text.text.as_str();
        while let Some((before, (name, after))) =
            rest.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)))
        {
            pieces.push(LogPiece::Text(before.to_owned()));
            match self.site.resolve_output(name) {
                Ok(output) => pieces.push(LogPiece::Value(output.id)),
                Err(error) => self.report_unknown_name(&LocatedText { text: name.to_owned(), pos: text.pos }, &error),
            }
            rest = after;
        }
        pieces.push(LogPiece::Text(rest.to_owned()));
        pieces
    }
}

/// For each toggled bit: true if more than one step reads or sets its level.
fn find_shared_bits(lines: &[PlayLine], bits: usize) -> Vec<bool> {
    let mut steps: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); bits];
    for line in lines {
        if let PlayOp::Do(act) | PlayOp::Every { act, .. } = &line.op {
            act.toggled_bits()
                .for_each(|bit| steps.get_mut(bit).into_iter().for_each(|steps| _ = steps.insert(line.step)));
        }
    }
    steps.iter().map(|steps| steps.len() > 1).collect()
}

/// True if an output can fulfil a condition.
fn is_possible(output: ScenarioOutput, compare: Comparison) -> bool {
    let (low, high) = output.range;
    match compare {
        Comparison::Floating => output.can_float,
        Comparison::Equal(wanted) => (low..=high).contains(&wanted),
        Comparison::NotEqual(_) => true,
        Comparison::Within(from, to) => from <= high && to >= low,
    }
}

/// A number and its unit; voltages are converted to millivolts.
fn parse_scaled(value: &ScenarioValue) -> Option<(i64, &'static str)> {
    let text = match value {
        ScenarioValue::Number(number) if number.unsigned_abs() < 1 << 40 => return Some((*number, "")),
        ScenarioValue::Number(_) => return None,
        ScenarioValue::Text(text) => text.trim(),
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

/// A description of a step, for messages.
fn step_text(verb: &StepAction) -> String {
    let assigns = |assigns: &[Assignment]| {
        let each: Vec<_> = assigns.iter().map(|a| format!("{} = {}", a.name.text, a.value)).collect();
        each.join(", ")
    };
    let cond = |cond: &ConditionList| {
        let each: Vec<_> = cond.iter().map(|test| condition_text(&test.name.text, &test.text)).collect();
        each.join(", ")
    };
    match verb {
        StepAction::Pause => "a pause".to_owned(),
        StepAction::Set(what) => format!("set {}", assigns(what)),
        StepAction::Pulse(what, length) => format!("pulse {} for {}", assigns(what), length.text),
        StepAction::Toggle(names) => {
            format!("toggle {}", names.iter().map(|n| n.text.as_str()).collect::<Vec<_>>().join(", "))
        }
        StepAction::Ramp { targets: what, .. } => {
            format!("ramp {}", what.iter().map(|w| w.name.text.as_str()).collect::<Vec<_>>().join(", "))
        }
        StepAction::Send(bytes) => format!("uart-send {}", quote_bytes(&bytes.bytes)),
        StepAction::Expect(what, _) => format!("expect {}", cond(what)),
        StepAction::ExpectUart(bytes, _) => format!("expect-uart {}", quote_bytes(&bytes.bytes)),
        StepAction::Wait(what, _) => format!("wait {}", cond(what)),
        StepAction::Never(what, _) => format!("never {}", cond(what)),
        StepAction::Repeat(rounds, _) => format!("repeat {rounds}"),
        StepAction::Snapshot(file) => format!("snapshot {}", file.text),
        StepAction::Log(_) => "log".to_owned(),
        StepAction::PowerCycle => "power-cycle".to_owned(),
    }
}

/// A condition as text: `Yarc = 1`, `Cparts > 5`.
pub(crate) fn condition_text(name: &str, wanted: &str) -> String {
    let sign = wanted.starts_with(['<', '>', '!', '=']);
    if sign { format!("{name} {wanted}") } else { format!("{name} = {wanted}") }
}

/// Bytes as text in quotes, with escapes.
pub(crate) fn quote_bytes(bytes: &[u8]) -> String {
    format!("\"{}\"", bytes.escape_ascii())
}
