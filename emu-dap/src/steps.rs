//! The requests that make the machine run, or put it elsewhere.

use std::collections::BTreeSet;

use emu_core::pins::Time;
use emu_debug::debug::{Action, Place};
use emu_debug::stimulus;
use emu_debug::{Drive, stimulus::Put};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::Adapter;
use crate::ladder::Ladder;
use crate::running::{BackLine, Kind, Over, Run, Walk};
use crate::stops::Stop;
use crate::wire::{self, Request, Source, Wrong};

/// Most steps at once: nobody waits for more.
const MOST: u64 = 1 << 40;

#[derive(Default, Deserialize)]
#[serde(default)]
struct Granularity {
    granularity: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Target {
    source: Source,
    line: i64,
    #[serde(rename = "targetId")]
    target: u32,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct EmuStep {
    unit: String,
    back: bool,
    count: Option<u64>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Text {
    symbol: String,
    text: String,
    rung: Option<u32>,
    to: Value,
}

/// What a step goes by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Unit {
    Instruction,
    Line,
    Element,
}

impl Adapter<'_> {
    /// Begins a run.
    pub(crate) fn go(&mut self, run: Run, answer: Value) -> Result<Value, Wrong> {
        self.machine()?;
        self.run = Some(run);
        Ok(answer)
    }

    fn unit(&mut self, request: &Request) -> Result<Unit, Wrong> {
        let Granularity { granularity } = request.arguments()?;
        let machine = self.machine()?;
        match granularity.as_deref() {
            Some("instruction") => Ok(Unit::Instruction),
            None | Some("line" | "statement") if machine.ladder.is_some() => Ok(Unit::Element),
            None | Some("line" | "statement") if machine.session.scope.lines.all().is_empty() => Ok(Unit::Instruction),
            None | Some("line" | "statement") => Ok(Unit::Line),
            Some(other) => Err(Wrong::new(wire::ARGUMENTS, format!("`{other}` is no granularity of a step"))),
        }
    }

    pub(crate) fn next(&mut self, request: &Request, into: bool) -> Result<Value, Wrong> {
        let unit = self.unit(request)?;
        let machine = self.machine()?;
        let run = match unit {
            Unit::Element => Run::To(machine.ladder.as_ref().map(Ladder::elements).unwrap_or_default(), 1),
            Unit::Line => Run::Walk(Walk::new(if into { Kind::Into } else { Kind::Next }, &machine.session)),
            Unit::Instruction => match Over::here(&mut machine.session).filter(|_| !into) {
                Some(over) => Run::Over(over),
                None => Run::Steps(1),
            },
        };
        self.go(run, Value::Null)
    }

    pub(crate) fn step_out(&mut self, request: &Request) -> Result<Value, Wrong> {
        let unit = self.unit(request)?;
        let machine = self.machine()?;
        let pc = machine.session.target().pc();
        // Out of an element is out of its rung.
        let rungs = machine.ladder.as_ref().filter(|ladder| unit == Unit::Element && ladder.rung_at(pc).is_some());
        let run = match rungs {
            Some(ladder) => Run::To(ladder.rungs(), 1),
            None => Run::Walk(Walk::new(Kind::Out, &machine.session)),
        };
        self.go(run, Value::Null)
    }

    pub(crate) fn step_back(&mut self, request: &Request) -> Result<Value, Wrong> {
        let unit = self.unit(request)?;
        let machine = self.machine()?;
        let run = match unit {
            Unit::Element => Run::BackTo(machine.ladder.as_ref().map(Ladder::elements).unwrap_or_default(), 1),
            Unit::Line => Run::BackLine(BackLine::new(&machine.session)),
            Unit::Instruction => Run::BackSteps(1),
        };
        self.go(run, Value::Null)
    }

    pub(crate) fn pause(&mut self) -> Result<Value, Wrong> {
        if self.run.is_some() {
            self.stopped(Stop::plain("pause"));
        }
        Ok(Value::Null)
    }

    /// The run that takes some steps of a unit.
    ///
    /// # Errors
    /// No such unit, or the program has no rungs.
    pub(crate) fn steps(&mut self, unit: &str, back: bool, count: u64) -> Result<Run, Wrong> {
        let machine = self.machine()?;
        let count = count.clamp(1, MOST);
        if matches!(unit, "instruction" | "line") {
            return Ok(match (unit, back) {
                ("instruction", false) => Run::Steps(count),
                ("instruction", true) => Run::BackSteps(count),
                _ if count > 1 => return Err(Wrong::new(wire::ARGUMENTS, "lines are stepped one by one")),
                (_, false) => Run::Walk(Walk::new(Kind::Next, &machine.session)),
                (_, true) => Run::BackLine(BackLine::new(&machine.session)),
            });
        }
        let no_ladder = || Wrong::cannot("the program is no ladder program, or was launched without its map");
        let ladder = machine.ladder.as_ref();
        let words = match unit {
            "element" => ladder.map(Ladder::elements),
            "rung" => ladder.map(Ladder::rungs),
            "scan" => ladder.map(|ladder| BTreeSet::from([ladder.scan_start()])),
            other => {
                let text = format!("`{other}` is no unit; units are instruction, line, element, rung and scan");
                return Err(Wrong::new(wire::ARGUMENTS, text));
            }
        };
        let words = words.ok_or_else(no_ladder)?;
        Ok(if back { Run::BackTo(words, count) } else { Run::To(words, count) })
    }

    pub(crate) fn emu_step(&mut self, request: &Request) -> Result<Value, Wrong> {
        let EmuStep { unit, back, count } = request.arguments()?;
        let run = self.steps(&unit, back, count.unwrap_or(1))?;
        self.go(run, Value::Null)
    }

    pub(crate) fn emu_why(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Text { symbol, .. } = request.arguments()?;
        Ok(json!({ "lines": self.why(&symbol)? }))
    }

    /// What made a symbol of the ladder program what it is.
    pub(crate) fn why(&mut self, symbol: &str) -> Result<Vec<String>, Wrong> {
        let machine = self.machine()?;
        let ladder = machine.ladder.as_ref().ok_or_else(|| Wrong::cannot("`why` is for ladder programs"))?;
        let follow = machine.session.follow().ok_or_else(|| Wrong::cannot("nobody follows the program"))?;
        ladder.view().why(follow, machine.session.target(), symbol.trim()).map_err(Wrong::nothing)
    }

    pub(crate) fn emu_draw(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Text { rung, .. } = request.arguments()?;
        Ok(json!({ "lines": self.drawn(rung)? }))
    }

    /// A rung, or the one that is carried out, with the power in it.
    pub(crate) fn drawn(&mut self, rung: Option<u32>) -> Result<Vec<String>, Wrong> {
        let machine = self.machine()?;
        let ladder = machine.ladder.as_ref().ok_or_else(|| Wrong::cannot("rungs are of ladder programs"))?;
        let (follow, target) = (machine.session.follow(), machine.session.target());
        Ok(match rung {
            None => ladder.view().draw(follow, target, false),
            Some(rung) if ladder.has(rung) => ladder.view().draw_rung(rung, follow, target, false),
            Some(rung) => return Err(Wrong::nothing(format!("the program has no rung {rung}"))),
        })
    }

    pub(crate) fn emu_drive(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Text { text, .. } = request.arguments()?;
        self.drive(&text)?;
        Ok(Value::Null)
    }

    /// `PB0=1`, `RA0=1.25V`, `Xbutton=1`: from now on.
    pub(crate) fn drive(&mut self, text: &str) -> Result<(), Wrong> {
        let machine = self.machine()?;
        let (chip, cycle) = (machine.session.scope.chip(), machine.session.target().cycle());
        let text = machine.session.scope.source().names.with_channel(&machine.own_pin(text));
        let put = stimulus::put(chip, &text).map_err(Wrong::cannot)?;
        if let Put::Level(pin, _) | Put::Volts(pin, _) | Put::Counts(pin, _) = put
            && !machine.session.target().has_pin(pin)
        {
            return Err(Wrong::nothing(format!("the machine has no pin of `{text}`")));
        }
        machine.act(Action::Drive(Drive { at: Time::at(cycle), put }))
    }

    pub(crate) fn emu_goto_cycle(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Text { to, .. } = request.arguments()?;
        let text = to.as_str().map_or_else(|| to.to_string(), str::to_owned);
        let run = self.cycle_run(&text)?;
        self.go(run, Value::Null)
    }

    /// The way to a cycle, or to a time: `1200`, `10ms`.
    pub(crate) fn cycle_run(&mut self, text: &str) -> Result<Run, Wrong> {
        let clock = self.machine()?.session.clock();
        let text = text.trim();
        let cycle = match text.parse() {
            Ok(cycle) => cycle,
            Err(_) => clock.cycles(text).map_err(Wrong::nothing)?,
        };
        Ok(Run::Cycle(cycle))
    }

    pub(crate) fn goto_targets(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Target { source, line, .. } = request.arguments()?;
        let wanted = self.client.own_line(line);
        let found = self.machine()?.words_of(&source, wanted).map_err(Wrong::nothing)?;
        let line = self.client.line(found.line);
        let scope = &self.machine()?.session.scope;
        let targets = found.words.iter().map(|word| {
            json!({
                "id": word, "label": scope.source().place(*word), "line": line,
                "instructionPointerReference": format!("0x{:04x}", scope.chip().code_address(*word)),
            })
        });
        Ok(json!({ "targets": targets.collect::<Vec<_>>() }))
    }

    pub(crate) fn goto(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Target { target, .. } = request.arguments()?;
        let machine = self.machine()?;
        let address = machine.session.scope.chip().code_address(target);
        machine.act(Action::Set(Place::Pc, address.into()))?;
        self.stopped(Stop::plain("goto"));
        Ok(Value::Null)
    }
}
