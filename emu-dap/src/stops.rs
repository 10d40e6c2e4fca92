//! Why the machine stands, as events.

use emu_core::pins::Event;
use emu_debug::debug::{Hit, What, Why};
use serde_json::{Value, json};

use crate::adapter::{Adapter, THREAD};
use crate::wire::Wrong;

/// Why the machine stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Stop {
    /// One word of the protocol's, or `halted`.
    pub reason: &'static str,
    /// A few words for people.
    pub description: Option<String>,
    /// A sentence more.
    pub text: Option<String>,
    /// Numbers of breakpoints, as the client knows them.
    pub points: Vec<i64>,
    /// What `exceptionInfo` calls it.
    pub exception: Option<&'static str>,
}

impl Stop {
    /// For a reason that says all.
    pub fn plain(reason: &'static str) -> Stop {
        Stop { reason, description: None, text: None, points: Vec::new(), exception: None }
    }

    /// Before the first instruction.
    pub fn entry() -> Stop {
        Stop::plain("entry")
    }

    /// The user has put it elsewhere.
    pub fn moved(how: &str) -> Stop {
        Stop { description: Some(how.to_owned()), ..Stop::plain("goto") }
    }
}

impl Adapter<'_> {
    /// The machine stands, and the client is told.
    pub(crate) fn stopped(&mut self, stop: Stop) {
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
            machine.stop = stop;
        }
        self.event("stopped", body);
    }

    /// What an end of a run is.
    pub(crate) fn stop_of(&self, why: &Why) -> Stop {
        let Some(machine) = &self.machine else { return Stop::entry() };
        let place = |pc: u32| machine.session.scope.source().place(pc);
        let exception = |id: &'static str, description: &str, text: String| Stop {
            description: Some(description.to_owned()),
            text: Some(text),
            exception: Some(id),
            ..Stop::plain("exception")
        };
        match why {
            Why::Done | Why::Limit => Stop::plain("step"),
            Why::Interrupted => Stop::plain("pause"),
            Why::Beginning => Stop { description: Some("The history begins here".to_owned()), ..Stop::plain("entry") },
            Why::Halted => Stop {
                description: Some("Halted".to_owned()),
                text: Some("Nothing can wake the chip any more.".to_owned()),
                ..Stop::plain("halted")
            },
            Why::Waits => Stop {
                description: Some("Waits".to_owned()),
                text: Some("Only something from outside can change what the program does.".to_owned()),
                ..Stop::plain("halted")
            },
            Why::Illegal { pc, word } => {
                let text = format!("0x{word:04x} at {} is no instruction of this chip", place(*pc));
                exception("illegal", "Illegal instruction", text)
            }
            Why::Fault { pc, fault } => exception("fault", "Fault", format!("{}: {fault}", place(*pc))),
            Why::Points(hits) => self.stop_at(hits),
        }
    }

    fn stop_at(&self, hits: &[Hit]) -> Stop {
        let reason = hits.iter().find_map(|hit| self.points.reason(hit.id)).unwrap_or("step");
        let texts: Vec<String> = hits.iter().filter_map(|hit| self.seen(hit)).collect();
        let text = (!texts.is_empty()).then(|| texts.join("; "));
        let points = hits.iter().filter_map(|hit| self.points.number(hit.id)).collect();
        Stop { text, points, ..Stop::plain(reason) }
    }

    /// What a watchpoint has seen.
    fn seen(&self, hit: &Hit) -> Option<String> {
        let session = &self.machine.as_ref()?.session;
        let point = session.points.get(hit.id).filter(|point| !matches!(point.what, What::Code(_)))?;
        let shown = |value: Option<i64>| value.map_or("nothing".to_owned(), |value| value.to_string());
        let what = match (hit.write, hit.new) {
            (Some(write), new) => format!("{} {}", if write { "written:" } else { "read:" }, shown(new)),
            // The place of a pin's edge is known to the slice of the run only.
            (None, None) if hit.old.is_none() => return Some(format!("{} has moved", point.text)),
            (None, new) => format!("{} -> {}", shown(hit.old), shown(new)),
        };
        Some(format!("{} {what} at {}", point.text, session.scope.source().place(hit.pc)))
    }

    pub(crate) fn exception_info(&mut self) -> Result<Value, Wrong> {
        let stop = &self.machine()?.stop;
        let id = stop.exception.ok_or_else(|| Wrong::nothing("the machine does not stand because of a fault"))?;
        Ok(json!({
            "exceptionId": id, "description": stop.text, "breakMode": "always",
        }))
    }

    /// Tells bytes that the program has sent and resets of the chip since they were told last.
    pub(crate) fn tell_events(&mut self) {
        let Some(machine) = &mut self.machine else { return };
        let resets = machine.session.resets_since(machine.told);
        let fresh = machine.session.events().rev().take_while(|event| event.at().cycle > machine.told);
        let mut sent: Vec<(u8, u8)> = fresh
            .filter_map(|event| match event {
                Event::Sent { uart, byte, .. } => Some((*uart, *byte)),
                _ => None,
            })
            .collect();
        sent.reverse();
        machine.told = machine.told.max(machine.session.target().cycle());
        for port in sent.chunk_by(|a, b| a.0 == b.0) {
            let prefix = port.first().filter(|first| first.0 > 0).map(|first| format!("serial port {}: ", first.0));
            let text: String = port.iter().map(|(_, byte)| printed(*byte)).collect();
            self.output("stdout", &format!("{}{text}", prefix.unwrap_or_default()));
        }
        if let Some(resets) = resets {
            self.output("console", &format!("{resets}\n"));
        }
    }
}

/// A byte as text: what is no character of ASCII as `\xe4`.
fn printed(byte: u8) -> String {
    match byte {
        b'\n' | b'\r' | b'\t' | b' '..=b'~' => char::from(byte).to_string(),
        _ => format!("\\x{byte:02x}"),
    }
}
