//! Requests that start a run, or set the program counter.

use std::collections::BTreeSet;

use emu_core::pins::CycleTime;
use emu_debug::debug::{ExpressionPlace, UserAction};
use emu_debug::stimulus;
use emu_debug::{TimedDrive, stimulus::ExternalDrive};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::DebugAdapter;
use crate::ladder_source::LadderSource;
use crate::protocol::{self, DapRequest, DapSource, RequestError};
use crate::runs::{BackLineStep, LineStep, LineStepKind, PendingRun, StepOverCall};
use crate::stop_events::StopEvent;

/// Maximum number of steps per request.
const MAX_STEPS: u64 = 1 << 40;

#[derive(Default, Deserialize)]
#[serde(default)]
struct GranularityArguments {
    granularity: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct GotoArguments {
    source: DapSource,
    line: i64,
    #[serde(rename = "targetId")]
    target: u32,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct EmuStepArguments {
    unit: String,
    back: bool,
    count: Option<u64>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct EmuArguments {
    symbol: String,
    text: String,
    rung: Option<u32>,
    to: Value,
}

/// The unit of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StepUnit {
    Instruction,
    Line,
    Element,
}

impl DebugAdapter<'_> {
    /// Starts a run.
    pub(crate) fn begin_run(&mut self, run: PendingRun, answer: Value) -> Result<Value, RequestError> {
        self.machine()?;
        self.run = Some(run);
        Ok(answer)
    }

    fn unit(&mut self, request: &DapRequest) -> Result<StepUnit, RequestError> {
        let GranularityArguments { granularity } = request.parse_arguments()?;
        let machine = self.machine()?;
        match granularity.as_deref() {
            Some("instruction") => Ok(StepUnit::Instruction),
            None | Some("line" | "statement") if machine.ladder.is_some() => Ok(StepUnit::Element),
            None | Some("line" | "statement") if machine.session.scope.lines.all_lines().is_empty() => {
                Ok(StepUnit::Instruction)
            }
            None | Some("line" | "statement") => Ok(StepUnit::Line),
            Some(other) => {
                Err(RequestError::new(protocol::ARGUMENTS, format!("`{other}` is not a granularity of a step")))
            }
        }
    }

    /// The request `next` or, with `into`, `stepIn`.
    pub(crate) fn next(&mut self, request: &DapRequest, into: bool) -> Result<Value, RequestError> {
        let unit = self.unit(request)?;
        let machine = self.machine()?;
        let run = match unit {
            StepUnit::Element => {
                PendingRun::ToWords(machine.ladder.as_ref().map(LadderSource::element_starts).unwrap_or_default(), 1)
            }
            StepUnit::Line => PendingRun::StepLine(LineStep::new(
                if into { LineStepKind::Into } else { LineStepKind::Next },
                &machine.session,
                machine.not_entered,
            )),
            StepUnit::Instruction => match StepOverCall::here(&mut machine.session).filter(|_| !into) {
                Some(over) => PendingRun::StepOver(over),
                None => PendingRun::Steps(1),
            },
        };
        self.begin_run(run, Value::Null)
    }

    /// Answers `stepOut`: runs until the function returns, or to the next rung.
    pub(crate) fn step_out(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let unit = self.unit(request)?;
        let machine = self.machine()?;
        let pc = machine.session.machine().pc();
        // A step out of an element goes to the next rung.
        let rungs = machine.ladder.as_ref().filter(|ladder| unit == StepUnit::Element && ladder.rung_at(pc).is_some());
        let run = match rungs {
            Some(ladder) => PendingRun::ToWords(ladder.rung_starts(), 1),
            None => PendingRun::StepLine(LineStep::new(LineStepKind::Out, &machine.session, machine.not_entered)),
        };
        self.begin_run(run, Value::Null)
    }

    /// Answers `stepBack`: goes back by one line, instruction or element.
    pub(crate) fn step_back(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let unit = self.unit(request)?;
        let machine = self.machine()?;
        let run = match unit {
            StepUnit::Element => {
                PendingRun::BackTo(machine.ladder.as_ref().map(LadderSource::element_starts).unwrap_or_default(), 1)
            }
            StepUnit::Line => PendingRun::BackLine(BackLineStep::new(&machine.session)),
            StepUnit::Instruction => PendingRun::BackSteps(1),
        };
        self.begin_run(run, Value::Null)
    }

    /// Answers `pause`: ends the run.
    pub(crate) fn pause(&mut self) -> Result<Value, RequestError> {
        if self.run.is_some() {
            self.report_stop(StopEvent::plain("pause"));
        }
        Ok(Value::Null)
    }

    /// The run of `count` steps of a unit.
    ///
    /// # Errors
    /// The unit does not exist, or the program has no rungs.
    pub(crate) fn run_of_steps(&mut self, unit: &str, back: bool, count: u64) -> Result<PendingRun, RequestError> {
        let machine = self.machine()?;
        let count = count.clamp(1, MAX_STEPS);
        if matches!(unit, "instruction" | "line") {
            return Ok(match (unit, back) {
                ("instruction", false) => PendingRun::Steps(count),
                ("instruction", true) => PendingRun::BackSteps(count),
                _ if count > 1 => return Err(RequestError::new(protocol::ARGUMENTS, "lines are stepped one by one")),
                (_, false) => {
                    PendingRun::StepLine(LineStep::new(LineStepKind::Next, &machine.session, machine.not_entered))
                }
                (_, true) => PendingRun::BackLine(BackLineStep::new(&machine.session)),
            });
        }
        let no_ladder =
            || RequestError::not_possible("the program is not a ladder program, or was launched without its map");
        let ladder = machine.ladder.as_ref();
        let words = match unit {
            "element" => ladder.map(LadderSource::element_starts),
            "rung" => ladder.map(LadderSource::rung_starts),
            "scan" => ladder.map(|ladder| BTreeSet::from([ladder.scan_start()])),
            other => {
                let text = format!("`{other}` is not a unit; units are instruction, line, element, rung and scan");
                return Err(RequestError::new(protocol::ARGUMENTS, text));
            }
        };
        let words = words.ok_or_else(no_ladder)?;
        Ok(if back { PendingRun::BackTo(words, count) } else { PendingRun::ToWords(words, count) })
    }

    /// Answers `emu/step`: steps by the unit and number that the request gives.
    pub(crate) fn emu_step(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let EmuStepArguments { unit, back, count } = request.parse_arguments()?;
        let run = self.run_of_steps(&unit, back, count.unwrap_or(1))?;
        self.begin_run(run, Value::Null)
    }

    /// Answers `emu/why`: explains the value of a symbol of the ladder program.
    pub(crate) fn emu_why(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let EmuArguments { symbol, .. } = request.parse_arguments()?;
        Ok(json!({ "lines": self.explain_symbol(&symbol)? }))
    }

    /// Explains why a symbol of the ladder program has its value.
    pub(crate) fn explain_symbol(&mut self, symbol: &str) -> Result<Vec<String>, RequestError> {
        let machine = self.machine()?;
        let ladder =
            machine.ladder.as_ref().ok_or_else(|| RequestError::not_possible("`why` is for ladder programs"))?;
        let follow =
            machine.session.follower().ok_or_else(|| RequestError::not_possible("no map of the program is loaded"))?;
        ladder.view().explain_value(follow, machine.session.machine(), symbol.trim()).map_err(RequestError::not_found)
    }

    /// Answers `emu/draw`: draws a rung with its power flow.
    pub(crate) fn emu_draw(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let EmuArguments { rung, .. } = request.parse_arguments()?;
        Ok(json!({ "lines": self.draw_rung(rung)? }))
    }

    /// Draws a rung, or the rung that is being executed, with its power flow.
    pub(crate) fn draw_rung(&mut self, rung: Option<u32>) -> Result<Vec<String>, RequestError> {
        let machine = self.machine()?;
        let ladder =
            machine.ladder.as_ref().ok_or_else(|| RequestError::not_possible("only a ladder program has rungs"))?;
        let (follow, target) = (machine.session.follower(), machine.session.machine());
        Ok(match rung {
            None => ladder.view().draw(follow, target, false),
            Some(rung) if ladder.has(rung) => ladder.view().draw_rung(rung, follow, target, false),
            Some(rung) => return Err(RequestError::not_found(format!("the program has no rung {rung}"))),
        })
    }

    /// Answers `emu/drive`: drives a pin.
    pub(crate) fn emu_drive(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let EmuArguments { text, .. } = request.parse_arguments()?;
        self.drive(&text)?;
        Ok(Value::Null)
    }

    /// Drives a pin or an input from now on: `PB0=1`, `RA0=1.25V`, `Xbutton=1`.
    pub(crate) fn drive(&mut self, text: &str) -> Result<(), RequestError> {
        let machine = self.machine()?;
        let (chip, cycle) = (machine.session.scope.chip(), machine.session.machine().cycle());
        let text = machine.session.scope.source().names.replace_channel_name(&machine.chip_pin_text(text));
        let drive = stimulus::parse_drive(chip, &text).map_err(RequestError::not_possible)?;
        if let ExternalDrive::Level(pin, _) | ExternalDrive::Volts(pin, _) | ExternalDrive::Counts(pin, _) = drive
            && !machine.session.machine().has_pin(pin)
        {
            return Err(RequestError::not_found(format!("the machine has no pin of `{text}`")));
        }
        machine.act(UserAction::Drive(TimedDrive { at: CycleTime::at(cycle), drive }))
    }

    /// Answers `emu/gotoCycle`: goes to a cycle, forwards or backwards.
    pub(crate) fn emu_goto_cycle(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let EmuArguments { to, .. } = request.parse_arguments()?;
        let text = to.as_str().map_or_else(|| to.to_string(), str::to_owned);
        let run = self.cycle_run(&text)?;
        self.begin_run(run, Value::Null)
    }

    /// The run to a cycle or to a time: `1200`, `10ms`.
    pub(crate) fn cycle_run(&mut self, text: &str) -> Result<PendingRun, RequestError> {
        let clock = self.machine()?.session.clock();
        let text = text.trim();
        let cycle = match text.parse() {
            Ok(cycle) => cycle,
            Err(_) => clock.parse_cycles(text).map_err(RequestError::not_found)?,
        };
        Ok(PendingRun::Cycle(cycle))
    }

    /// Answers `gotoTargets`: the addresses to which a line can move execution.
    pub(crate) fn goto_targets(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let GotoArguments { source, line, .. } = request.parse_arguments()?;
        let wanted = self.client.line_from_client(line);
        let found = self.machine()?.words_of(&source, wanted).map_err(RequestError::not_found)?;
        let line = self.client.line(found.line);
        let scope = &self.machine()?.session.scope;
        let targets = found.words.iter().map(|word| {
            json!({
                "id": word, "label": scope.source().describe_word(*word), "line": line,
                "instructionPointerReference": format!("0x{:04x}", scope.chip().code_address(*word)),
            })
        });
        Ok(json!({ "targets": targets.collect::<Vec<_>>() }))
    }

    /// Answers `goto`: moves the program counter without executing anything.
    pub(crate) fn goto(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let GotoArguments { target, .. } = request.parse_arguments()?;
        let machine = self.machine()?;
        let address = machine.session.scope.chip().code_address(target);
        machine.act(UserAction::Set(ExpressionPlace::Pc, address.into()))?;
        self.report_stop(StopEvent::plain("goto"));
        Ok(Value::Null)
    }
}
