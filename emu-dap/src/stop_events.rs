//! Stop reasons of the machine as events of the protocol.

use emu_core::cpu::ProgramError;
use emu_core::pins::ChipEvent;
use emu_debug::debug::{PointHit, PointTrigger, SessionStopReason};
use serde_json::{Value, json};

use crate::adapter::{DebugAdapter, THREAD};
use crate::protocol::RequestError;

/// The reason of a stop.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StopEvent {
    /// A reason defined by the protocol, or `halted`.
    pub reason: &'static str,
    /// A short description for the user.
    pub description: Option<String>,
    /// An additional sentence for the user.
    pub text: Option<String>,
    /// Numbers of the breakpoints that were hit, in the client's numbering.
    pub points: Vec<i64>,
    /// The exception id for `exceptionInfo`.
    pub exception: Option<&'static str>,
    /// A breakpoint of a line of an inlined function was hit.
    pub hits_inlined_code: bool,
}

impl StopEvent {
    /// A stop whose reason needs no further description.
    pub fn plain(reason: &'static str) -> StopEvent {
        StopEvent {
            reason,
            description: None,
            text: None,
            points: Vec::new(),
            exception: None,
            hits_inlined_code: false,
        }
    }

    /// The stop before the first instruction.
    pub fn entry() -> StopEvent {
        StopEvent::plain("entry")
    }

    /// The stop after the user has moved the machine.
    pub fn goto(how: &str) -> StopEvent {
        StopEvent { description: Some(how.to_owned()), ..StopEvent::plain("goto") }
    }
}

impl DebugAdapter<'_> {
    /// Reports a stop to the client.
    pub(crate) fn report_stop(&mut self, stop: StopEvent) {
        let mut body = json!({ "reason": stop.reason, "threadId": THREAD, "allThreadsStopped": true });
        for (name, text) in [("description", &stop.description), ("text", &stop.text)] {
            if let Some(text) = text {
                body[name] = text.as_str().into();
            }
        }
        if !stop.points.is_empty() {
            body["hitBreakpointIds"] = stop.points.clone().into();
        }
        self.run = None;
        if let Some(machine) = &mut self.machine {
            machine.not_entered = machine.calls_to_come(stop.hits_inlined_code);
            machine.stop = stop;
        }
        self.event("stopped", body);
    }

    /// The stop event for the end of a run.
    pub(crate) fn stop_of(&self, why: &SessionStopReason) -> StopEvent {
        let Some(machine) = &self.machine else { return StopEvent::entry() };
        let place = |pc: u32| machine.session.scope.source().describe_word(pc);
        let exception = |id: &'static str, description: &str, text: String| StopEvent {
            description: Some(description.to_owned()),
            text: Some(text),
            exception: Some(id),
            ..StopEvent::plain("exception")
        };
        match why {
            SessionStopReason::Done | SessionStopReason::Limit => StopEvent::plain("step"),
            SessionStopReason::Interrupted => StopEvent::plain("pause"),
            SessionStopReason::Beginning => {
                StopEvent { description: Some("The history begins here".to_owned()), ..StopEvent::plain("entry") }
            }
            SessionStopReason::Halted => StopEvent {
                description: Some("Halted".to_owned()),
                text: Some("Nothing can wake the chip any more.".to_owned()),
                ..StopEvent::plain("halted")
            },
            SessionStopReason::BlockedOnInput => StopEvent {
                description: Some("Waits".to_owned()),
                text: Some("Only an external stimulus can change what the program does.".to_owned()),
                ..StopEvent::plain("halted")
            },
            SessionStopReason::Error(ProgramError::Illegal { pc, word }) => {
                let text = format!("0x{word:04x} at {} is not an instruction of this chip", place(*pc));
                exception("illegal", "Illegal instruction", text)
            }
            SessionStopReason::Error(ProgramError::Fault { pc, fault }) => {
                exception("fault", "Fault", format!("{}: {fault}", place(*pc)))
            }
            SessionStopReason::Points(hits) => self.stop_of_hits(hits),
        }
    }

    fn stop_of_hits(&self, hits: &[PointHit]) -> StopEvent {
        let reason = hits.iter().find_map(|hit| self.points.reason(hit.id)).unwrap_or("step");
        let texts: Vec<String> = hits.iter().filter_map(|hit| self.describe_watch_hit(hit)).collect();
        let text = (!texts.is_empty()).then(|| texts.join("; "));
        let points = hits.iter().filter_map(|hit| self.points.number(hit.id)).collect();
        let hits_inlined_code = self.machine.as_ref().is_some_and(|machine| {
            let (scope, pc) = (&machine.session.scope, machine.session.machine().pc());
            let line = scope.source().line_text(pc).unwrap_or_default();
            let blocks = scope.calls().inlined(pc.saturating_mul(scope.chip().word_bytes));
            let is_own = |text: &str| text == line || blocks.iter().any(|block| block.inlined.as_deref() == Some(text));
            hits.iter().filter_map(|hit| machine.session.points.get(hit.id)).any(|point| is_own(&point.text))
        });
        StopEvent { text, points, hits_inlined_code, ..StopEvent::plain(reason) }
    }

    /// Describes the hit of a watchpoint.
    fn describe_watch_hit(&self, hit: &PointHit) -> Option<String> {
        let session = &self.machine.as_ref()?.session;
        let point = session.points.get(hit.id).filter(|point| !matches!(point.trigger, PointTrigger::Code(_)))?;
        let shown = |value: Option<i64>| value.map_or("nothing".to_owned(), |value| value.to_string());
        let what = match (hit.write, hit.new) {
            (Some(write), new) => format!("{} {}", if write { "written:" } else { "read:" }, shown(new)),
            // The location of a pin edge is only known within a slice of the run.
            (None, None) if hit.old.is_none() => return Some(format!("{} has changed", point.text)),
            (None, new) => format!("{} -> {}", shown(hit.old), shown(new)),
        };
        Some(format!("{} {what} at {}", point.text, session.scope.source().describe_word(hit.pc)))
    }

    /// Answers `exceptionInfo`: the fault that stopped the machine.
    pub(crate) fn exception_info(&mut self) -> Result<Value, RequestError> {
        let stop = &self.machine()?.stop;
        let id =
            stop.exception.ok_or_else(|| RequestError::not_found("the machine did not stop because of a fault"))?;
        Ok(json!({
            "exceptionId": id, "description": stop.text, "breakMode": "always",
        }))
    }

    /// Reports bytes that the program has sent, and resets of the chip, since the last report.
    pub(crate) fn report_events(&mut self) {
        let Some(machine) = &mut self.machine else { return };
        let resets = machine.session.resets_since(machine.events_reported_to);
        let fresh = machine.session.events().rev().take_while(|event| event.time().cycle > machine.events_reported_to);
        let mut sent: Vec<(u8, u8)> = fresh
            .filter_map(|event| match event {
                ChipEvent::Sent { uart, byte, .. } => Some((*uart, *byte)),
                _ => None,
            })
            .collect();
        sent.reverse();
        machine.events_reported_to = machine.events_reported_to.max(machine.session.machine().cycle());
        for port in sent.chunk_by(|a, b| a.0 == b.0) {
            let prefix = port.first().filter(|first| first.0 > 0).map(|first| format!("serial port {}: ", first.0));
            let text: String = port.iter().map(|(_, byte)| printable(*byte)).collect();
            self.output("stdout", &format!("{}{text}", prefix.unwrap_or_default()));
        }
        if let Some(resets) = resets {
            self.output("console", &format!("{resets}\n"));
        }
    }
}

/// A byte as text; a byte that is not printable ASCII is shown as `\xe4`.
fn printable(byte: u8) -> String {
    match byte {
        b'\n' | b'\r' | b'\t' | b' '..=b'~' => char::from(byte).to_string(),
        _ => format!("\\x{byte:02x}"),
    }
}
