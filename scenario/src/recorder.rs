//! Records what was done to a machine, and writes it as a scenario that repeats it.

use crate::model::ScenarioValue;

/// A recorded action.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RecordedAction {
    /// A name was set to a value.
    Set(String, ScenarioValue),
    /// Bytes were sent to the machine, or queued after other bytes.
    Send(Vec<u8>),
    /// The supply was switched off and on.
    PowerCycle,
    /// An action that scenarios do not support; it becomes a comment.
    Other(String),
}

/// Collects actions in any order; actions at the same tick keep their order.
#[derive(Debug, Clone, Default)]
pub struct Recorder {
    /// The program, for the line `program =`.
    pub program: Option<String>,
    /// The chip, for the line `mcu =`.
    pub mcu: Option<String>,
    /// Bits per second of the bytes sent.
    pub baud: Option<u64>,
    /// True if an action within a machine cycle takes effect at the start of the cycle, and is recorded
    /// there.
    pub align_to_cycles: bool,
    /// Ticks per machine cycle; `None` if ticks are scans.
    cycle: Option<u32>,
    done: Vec<(u64, RecordedAction)>,
}

impl Recorder {
    /// An empty recorder. `cycle` is the number of clocks per machine cycle, or `None` if ticks are scans.
    #[must_use]
    pub fn new(cycle: Option<u32>) -> Recorder {
        Recorder { cycle, ..Recorder::default() }
    }

    /// Records an action at a tick: a clock of a chip, or the number of scans before it.
    pub fn push(&mut self, tick: u64, done: RecordedAction) {
        let within = self.cycle.filter(|_| self.align_to_cycles).map_or(0, |clocks| tick % u64::from(clocks.max(1)));
        self.done.push((tick - within, done));
    }

    /// The scenario as TOML text. It ends at tick `end`; actions queued for later are left out.
    #[must_use]
    pub fn write(&self, end: u64) -> String {
        let mut out = String::from("# Recorded by emu.\n");
        let mut head = |key: &str, value: Option<String>| {
            out += &value.map_or_else(String::new, |value| format!("{key} = {value}\n"));
        };
        head("program", self.program.as_deref().map(quote_text));
        head("mcu", self.mcu.as_deref().map(quote_text));
        head("baud", self.baud.map(|baud| baud.to_string()));
        // An explicit limit, because a session may be longer than the default limit.
        head("limit", Some(quote_text(&self.time(end.saturating_add(self.cycle.unwrap_or(1).into())))));
        let mut done: Vec<&(u64, RecordedAction)> = self.done.iter().filter(|(tick, _)| *tick <= end).collect();
        done.sort_by_key(|(tick, _)| *tick);
        for (tick, done) in done {
            if let RecordedAction::Other(what) = done {
                let line: String = what.chars().map(|c| if c.is_control() { '?' } else { c }).collect();
                out += &format!("\n# {}: {line}\n", self.time(*tick));
                continue;
            }
            out += &format!("\n[[step]]\nat = {}\n", quote_text(&self.time(*tick)));
            out += &match done {
                RecordedAction::Set(name, value) => {
                    let value = match value {
                        ScenarioValue::Number(number) => number.to_string(),
                        ScenarioValue::Text(text) => quote_text(text),
                    };
                    format!("set = {{ {} = {value} }}\n", quote_key(name))
                }
                RecordedAction::Send(bytes) => match std::str::from_utf8(bytes) {
                    Ok(text) => format!("uart-send = {}\n", quote_text(text)),
                    Err(_) => format!("uart-send = {bytes:?}\n"),
                },
                RecordedAction::PowerCycle => "power-cycle = true\n".to_owned(),
                RecordedAction::Other(_) => String::new(),
            };
        }
        out += &format!("\n[[step]]\nat = {}\nname = \"the end\"\n", quote_text(&self.time(end)));
        out
    }

    fn time(&self, tick: u64) -> String {
        match self.cycle.map(u64::from) {
            None => format!("{tick} scans"),
            Some(clocks) if clocks > 0 && tick.is_multiple_of(clocks) => format!("{} cycles", tick / clocks),
            Some(_) => format!("{tick} clocks"),
        }
    }
}

/// A TOML key, in quotes unless it can be a bare key.
fn quote_key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) { name.to_owned() } else { quote_text(name) }
}

/// A TOML string in quotes.
fn quote_text(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let mut recorder = Recorder { cycle: Some(4), baud: Some(9600), ..Recorder::default() };
        recorder.push(401, RecordedAction::Set("data:0x20".to_owned(), ScenarioValue::Number(-3)));
        recorder.push(400, RecordedAction::Send(vec![0, b'"', b'\\', b'\n', 0x7F, 0xC3, 0xA4]));
        recorder.push(400, RecordedAction::Send(vec![0xFF, 1]));
        recorder.push(8, RecordedAction::Set("RA0".to_owned(), ScenarioValue::Text("1250mV".to_owned())));
        recorder.push(9, RecordedAction::PowerCycle);
        recorder.push(10, RecordedAction::Other("set W = 1\n[[step]]".to_owned()));
        recorder.push(4_001, RecordedAction::Set("RB0".to_owned(), ScenarioValue::Number(1)));
        let text = recorder.write(4_000);
        assert!(!text.contains("RB0"), "{text}");
        let scenario = crate::parse("recorded.toml", &text).expect(&text);
        assert_eq!(scenario.steps.len(), 6, "{text}");
        let sent = scenario.steps.iter().filter_map(|step| match &step.action {
            crate::StepAction::Send(bytes) => Some(bytes.bytes.clone()),
            _ => None,
        });
        let sent: Vec<_> = sent.collect();
        assert_eq!(sent, [vec![0, b'"', b'\\', b'\n', 0x7F, 0xC3, 0xA4], vec![0xFF, 1]]);
        recorder.align_to_cycles = true;
        recorder.push(4_003, RecordedAction::Set("RB1".to_owned(), ScenarioValue::Number(1)));
        assert!(recorder.write(4_000).contains("at = \"1000 cycles\"\nset = { RB1 = 1 }"), "as the cycle begins");
        assert!(text.contains("at = \"2 cycles\"") && text.contains("at = \"401 clocks\""), "{text}");
    }
}
