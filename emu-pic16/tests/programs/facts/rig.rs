//! Runs a program instruction by instruction and reports the results.

use std::collections::BTreeMap;

use emu_core::pins::{ChipEvent, CycleTime, PinLevel};
use emu_core::{Cpu, Probe, StopReason};
use emu_pic16::Pic16;

use super::read::Run;
use crate::script;

/// Everything recorded: moments by the text that asks for them, and why the run has ended.
struct Seen {
    pic: Pic16,
    stop: StopReason,
    moments: BTreeMap<String, Vec<CycleTime>>,
}

/// Probe that records instructions and edges.
#[derive(Default)]
struct Log {
    visits: Vec<(u64, u32)>,
    events: Vec<ChipEvent>,
}

impl Probe for Log {
    const INSN: bool = true;
    const EVENTS: bool = true;
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.visits.push((at, pc));
        false
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        self.events.push(event);
        false
    }
}

fn execute(run: &Run) -> Seen {
    let mut pic = run.program.machine();
    let (mut log, mut moments) = (Log::default(), BTreeMap::<String, Vec<CycleTime>>::new());
    let bit = |pic: &Pic16, addr: u16, bit: u8| pic.peek("data", addr.into()).is_some_and(|b| b >> bit & 1 == 1);
    let mut before: Vec<bool> = run.watched.iter().map(|w| bit(&pic, w.1, w.2)).collect();
    let stop = loop {
        // A watched bit is checked before every cycle in which an instruction may start; without one the run
        // is one piece.
        let until = if run.watched.is_empty() { run.program.until } else { pic.cycle() + 1 };
        let stop = pic.run(until, &mut log);
        for (seen, (name, addr, number)) in before.iter_mut().zip(&run.watched) {
            let now = bit(&pic, *addr, *number);
            if std::mem::replace(seen, now) != now {
                moments.entry(name.clone()).or_default().push(CycleTime::at(pic.cycle()));
            }
        }
        if stop != StopReason::Limit || pic.cycle() >= run.program.until {
            break stop;
        }
    };
    for (at, pc) in log.visits {
        for (label, _) in run.program.labels.iter().filter(|label| *label.1 == pc) {
            moments.entry(label.clone()).or_default().push(CycleTime::at(at));
        }
    }
    for event in log.events {
        if let ChipEvent::Edge { at, pin, .. } = event {
            let name = run.program.part.chip.pins[usize::from(pin)].name;
            moments.entry(name.to_owned()).or_default().push(at);
        }
    }
    Seen { pic, stop, moments }
}

/// Returns the text that `run` shows.
pub fn shown(run: &Run) -> String {
    let seen = execute(run);
    let mut text = String::new();
    let mut rest = run.show.as_str();
    while let Some((plain, (asked, behind))) = rest.split_once('{').and_then(|(p, r)| Some((p, r.split_once('}')?))) {
        text += plain;
        text += &answer(run, &seen, asked);
        rest = behind;
    }
    text + rest
}

fn answer(run: &Run, seen: &Seen, asked: &str) -> String {
    let clocks = |a: &str, b: &str| {
        let at = |text: &str| seen.at(text).map(|at| 4 * at.cycle + u64::from(at.phase));
        Some(at(b)?.saturating_sub(at(a)?))
    };
    let words: Vec<&str> = asked.split_whitespace().collect();
    let found = match words[..] {
        ["end"] => Some(match seen.stop {
            StopReason::Limit => "continues".to_owned(),
            other => format!("{other:?}").to_lowercase(),
        }),
        ["seen", name] => Some(seen.moments.get(name).map_or(0, Vec::len).to_string()),
        ["level", name] => script::pin(run.program.part, name).map(|pin| {
            match seen.pic.pin_level(pin) {
                PinLevel::Low => "0",
                PinLevel::High => "1",
                PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => "z",
            }
            .to_owned()
        }),
        ["clocks", a, b] => clocks(a, b).map(|clocks| clocks.to_string()),
        ["cycles", a, b] => clocks(a, b).map(|clocks| {
            assert!(clocks % 4 == 0, "{}: {clocks} clocks", run.name);
            (clocks / 4).to_string()
        }),
        // Whole microseconds: a result that is not exact fails here.
        ["ms", a, b] => clocks(a, b).map(|clocks| {
            assert!(clocks * 1_000_000 % run.program.options.hz == 0, "{}: {clocks} clocks", run.name);
            let micros = clocks * 1_000_000 / run.program.options.hz;
            format!("{}.{:03}", micros / 1000, micros % 1000)
        }),
        [place] => seen.byte(run, place),
        _ => None,
    };
    found.unwrap_or_else(|| format!("no {asked}"))
}

impl Seen {
    fn at(&self, text: &str) -> Option<CycleTime> {
        let (name, which) = text.split_once('#').unwrap_or((text, "1"));
        let noted = self.moments.get(name).and_then(|all| all.get(which.parse::<usize>().ok()?.checked_sub(1)?));
        noted.copied().or_else(|| script::moment(text))
    }

    /// Returns a byte at the end: decimal, or hexadecimal if the name ends in `h`.
    fn byte(&self, run: &Run, place: &str) -> Option<String> {
        let (name, hex) = place.strip_suffix('h').map_or((place, false), |name| (name, true));
        let of_chip = || self.pic.peek("data", script::register(run.program.part, name)?.into()).map(u32::from);
        let (space, addr) = name.split_once(':').unwrap_or(("data", name));
        let byte = || self.pic.peek(space, u32::from_str_radix(addr, 16).ok()?).map(u32::from);
        let value = self.pic.reg(name).or_else(of_chip).or_else(byte)?;
        Some(if hex { format!("{value:02X}h") } else { value.to_string() })
    }
}
