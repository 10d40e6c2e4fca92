//! Evaluates expressions and executes the commands of the debug console.

use emu_debug::debug::ExpressionPlace;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{DapMachine, DebugAdapter};
use crate::protocol::{DapRequest, RequestError};

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct EvaluateArguments {
    expression: String,
    frame_id: Option<i64>,
    context: Option<String>,
    value: String,
    format: EvaluateFormat,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct EvaluateFormat {
    hex: bool,
}

const HELP: &str = "\
EXPRESSION             its value, as in watches: PORTB.5, $pc, *0x100, a symbol
PLACE = EXPRESSION     assigns a value
instruction [N]        N steps; also line, element, rung, scan; back-instruction and so on go back
goto-cycle N           to a cycle or a time (10ms), forwards or back
why SYMBOL             why a symbol of the ladder program has its value
draw [RUNG]            a rung with its power flow
drive PIN=LEVEL        PB0=1, PB0=z, RA0=1.25V, from now on
where                  cycle, time, scan and location";

impl DebugAdapter<'_> {
    /// Answers `evaluate`: an expression, or a command of the debug console.
    pub(crate) fn evaluate(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let EvaluateArguments { expression, frame_id, context, format, .. } = request.parse_arguments()?;
        let level = self.frame_level(frame_id)?;
        let text = expression.trim();
        if context.as_deref() == Some("repl")
            && let Some(answer) = self.run_console_command(text, level)?
        {
            return Ok(json!({ "result": answer, "variablesReference": 0 }));
        }
        let machine = self.machine()?;
        let (expr, target) = (machine.parse_expression(text, level)?, machine.session.machine());
        if let Some(object) = expr.object() {
            let value = object.text(&machine.session.scope, target, format.hex.then_some('x'));
            let parts = crate::locals::object_reference(machine, text, object);
            let mut answer = json!({ "result": value, "type": object.type_name(), "variablesReference": parts });
            if let Some(memory) = machine.memory_reference_of(object) {
                answer["memoryReference"] = memory.into();
            }
            return Ok(answer);
        }
        let (result, memory) = match expr.place(target) {
            Some(place) => {
                let memory = match place {
                    ExpressionPlace::Memory { space, addr, .. } => Some(machine.memory_reference(space, addr)),
                    _ => None,
                };
                (machine.value_text(place, format.hex), memory)
            }
            None => {
                let amount = expr.evaluate(target);
                let amount = amount.ok_or_else(|| RequestError::not_possible(format!("`{text}` has no value now")))?;
                let value = amount.to_integer();
                (if format.hex { format!("0x{value:x}") } else { amount.text() }, None)
            }
        };
        let mut answer = json!({ "result": result, "variablesReference": 0 });
        if let Some(memory) = memory {
            answer["memoryReference"] = memory.into();
        }
        Ok(answer)
    }

    /// Answers `setExpression`: assigns a value to an expression.
    pub(crate) fn set_expression(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let EvaluateArguments { expression, frame_id, value, format, .. } = request.parse_arguments()?;
        let level = self.frame_level(frame_id)?;
        let value = self.assign_expression(&expression, (&value, level), format.hex)?;
        Ok(json!({ "value": value }))
    }

    fn assign_expression(
        &mut self,
        text: &str,
        (value, level): (&str, usize),
        hex: bool,
    ) -> Result<String, RequestError> {
        self.assign(text, value, level)?;
        self.invalidate_client();
        let machine = self.machine()?;
        let expr = machine.parse_expression(text, level)?;
        if let Some(object) = expr.object() {
            return Ok(object.text(&machine.session.scope, machine.session.machine(), hex.then_some('x')));
        }
        Ok(expr.place(machine.session.machine()).map(|place| machine.value_text(place, hex)).unwrap_or_default())
    }

    /// Executes a console command; returns `None` if the text is an expression.
    fn run_console_command(&mut self, text: &str, level: usize) -> Result<Option<String>, RequestError> {
        let (word, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let rest = rest.trim();
        if let Some((place, value)) = split_assignment(text) {
            return self.assign_expression(place, (value, level), false).map(Some);
        }
        let lines = |lines: Vec<String>| Ok(Some(lines.join("\n")));
        match word {
            "help" if rest.is_empty() => return Ok(Some(HELP.to_owned())),
            "why" if !rest.is_empty() => return lines(self.explain_symbol(rest)?),
            "draw" => {
                let rung = (!rest.is_empty()).then(|| rest.parse());
                let rung =
                    rung.transpose().map_err(|_| RequestError::not_found(format!("`{rest}` is not a rung number")))?;
                return lines(self.draw_rung(rung)?);
            }
            "drive" if !rest.is_empty() => {
                self.drive(rest)?;
                self.invalidate_client();
                return Ok(Some(String::new()));
            }
            "where" if rest.is_empty() => return Ok(Some(self.machine()?.position())),
            "goto-cycle" if !rest.is_empty() => {
                let run = self.cycle_run(rest)?;
                return self.console_run(run);
            }
            _ => {}
        }
        let (unit, back) = word.strip_prefix("back-").map_or((word, false), |unit| (unit, true));
        let is_unit = matches!(unit, "instruction" | "line" | "element" | "rung" | "scan");
        let count = if rest.is_empty() { Some(1) } else { rest.parse().ok() };
        match count.filter(|_| is_unit) {
            // A symbol of the program may have the same name; `$` or a memory prefix makes it unambiguous.
            Some(count) => {
                let run = self.run_of_steps(unit, back, count)?;
                self.console_run(run)
            }
            None => Ok(None),
        }
    }

    /// Starts a run for the console and sends a `continued` event, because the client has not requested the
    /// run.
    fn console_run(&mut self, run: crate::runs::PendingRun) -> Result<Option<String>, RequestError> {
        self.begin_run(run, Value::Null)?;
        self.event("continued", json!({ "threadId": crate::adapter::THREAD, "allThreadsContinued": true }));
        Ok(Some(String::new()))
    }
}

impl DapMachine {
    /// The current cycle, time, scan and location.
    fn position(&self) -> String {
        let session = &self.session;
        let (cycle, pc) = (session.machine().cycle(), session.machine().pc());
        let scan = session.scan().map_or(String::new(), |scan| format!(", scan {scan}"));
        let seconds = session.clock().seconds(cycle);
        format!("cycle {cycle}, {seconds:.9} s{scan}, at {}", session.scope.source().describe_word(pc))
    }
}

/// Splits `PLACE = VALUE`; `None` if the `=` is part of an operator.
fn split_assignment(text: &str) -> Option<(&str, &str)> {
    let (place, value) = text.split_once('=')?;
    let operator = value.starts_with('=') || place.ends_with(['=', '!', '<', '>']);
    // `drive PB0=1` has two words before the `=`.
    let one = !place.trim().is_empty() && !place.trim().contains(char::is_whitespace);
    (one && !operator).then(|| (place.trim(), value.trim()))
}
