//! Programs on the whole machine: results, and the cycle of every edge and interrupt. Each also runs in
//! random slices, from clones in the middle, with and without skipped polling loops, with every hook of a
//! probe and with none: all runs must end in the same machine.
//!
//! Expectations of a case, with hexadecimal values and decimal cycles:
//!
//! - `halted`, `illegal 3b00`: why the run ends; without either it reaches its limit;
//! - `W=5`, `PORTB=5`, `data:20=5`: values at the end; `@12 TMR0=5`: as read in cycle 12;
//! - `@50 reset brown-out`: the test resets the chip in that cycle (power-on, external, watchdog, brown-out);
//! - `RB0 12H 20.3L`: all edges of a pin by cycle and clock; `fight RB0@3.3`: all contentions;
//! - `sent 55@97`: bytes that the USART has sent, each with the end of its stop bit;
//! - `at label 12 30`: the cycles at which the label is reached; `cycle 70`, `instructions 70`, `pc label`:
//!   at the end.
//!
//! A list that ends in `...` may continue; `none` is the empty list.

use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;
use emu_core::{Cpu, Probe, ProgramError, ResetCause, StopReason};
use emu_pic16::Pic16;

use crate::script::{self, Case};

const TEXTS: &[&str] = &[
    include_str!("latency.txt"),
    include_str!("interrupts.txt"),
    include_str!("ports.txt"),
    include_str!("sleep.txt"),
    include_str!("reset.txt"),
    include_str!("links.txt"),
];

fn cases() -> Vec<Case> {
    TEXTS.iter().flat_map(|text| script::cases(text)).collect()
}

/// Log of everything that a probe is notified of; with `ALL` also instructions and data.
#[derive(Default, Clone, PartialEq, Debug)]
struct Log<const ALL: bool> {
    irqs: Vec<(u64, u8)>,
    events: Vec<ChipEvent>,
    visits: Vec<(u64, u32)>,
}

impl<const ALL: bool> Probe for Log<ALL> {
    const INSN: bool = ALL;
    const DATA: bool = ALL;
    const EVENTS: bool = true;
    fn on_instruction(&mut self, at: u64, pc: u32) -> bool {
        self.visits.push((at, pc));
        false
    }
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.irqs.push((at, vector));
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        self.events.push(event);
        false
    }
}

fn show_time(at: CycleTime) -> String {
    if at.phase == 0 { at.cycle.to_string() } else { format!("{}.{}", at.cycle, at.phase) }
}

fn show_edge(at: CycleTime, level: PinLevel) -> String {
    show_time(at) + ["L", "H", "F"][level as usize]
}

/// Returns the value of a named location: `data:20`, `PORTB`, `W`.
fn place(case: &Case, pic: &Pic16, text: &str) -> Option<u32> {
    if let Some((space, addr)) = text.split_once(':') {
        return pic.peek(space, u32::from_str_radix(addr, 16).ok()?).map(u32::from);
    }
    let of_chip = || pic.peek("data", script::register(case.program.part, text)?.into()).map(u32::from);
    pic.reg(text).or_else(of_chip)
}

fn cause(name: &str) -> Option<ResetCause> {
    let causes = [
        ("power-on", ResetCause::PowerOn),
        ("external", ResetCause::External),
        ("watchdog", ResetCause::Watchdog),
        ("brown-out", ResetCause::BrownOut),
    ];
    causes.iter().find(|cause| cause.0 == name).map(|cause| cause.1)
}

/// Returns the cycle of `@12 ..`.
fn cycle_of(wanted: &str) -> Option<u64> {
    wanted.strip_prefix('@')?.split_once(' ')?.0.parse().ok()
}

/// Returns the differences from the expectations.
fn judge(case: &Case) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut pic = case.program.machine();
    let mut log = Log::<true>::default();
    let mut stop = StopReason::Limit;
    let mut ends: Vec<&str> = case.wanted.iter().map(String::as_str).collect();
    ends.sort_by_key(|w| cycle_of(w).unwrap_or(u64::MAX));
    let wanted_stop = case.wanted.iter().any(|w| w == "halted" || w.starts_with("illegal"));
    let mut over = false;
    for wanted in ends {
        let mut items: Vec<&str> = wanted.split_whitespace().collect();
        match cycle_of(wanted) {
            Some(cycle) => {
                stop = pic.run(cycle, &mut log);
                if pic.cycle() != cycle {
                    wrong.push(format!("cycle {cycle} is not a boundary, {} is; {stop:?}", pic.cycle()));
                }
                items.remove(0);
            }
            None if !over => {
                stop = pic.run(case.program.until, &mut log);
                over = true;
                if !wanted_stop && stop != StopReason::Limit {
                    wrong.push(format!("stopped at {}: {stop:?}", pic.cycle()));
                }
            }
            None => {}
        }
        let mut list = |found: Vec<String>, wanted: &[&str]| {
            let wanted: Vec<&str> = wanted.iter().copied().filter(|w| *w != "none").collect();
            let same = match wanted.split_last() {
                Some((&"...", first)) => found.len() >= first.len() && found.iter().zip(first).all(|(f, w)| f == w),
                _ => found == wanted,
            };
            if !same {
                wrong.push(format!("{}: wanted {}, found {}", items.join(" "), wanted.join(" "), found.join(" ")));
            }
        };
        match items[..] {
            ["halted"] => list(vec![format!("{stop:?}")], &["Halted"]),
            ["illegal", op] => {
                let found = if let StopReason::Error(ProgramError::Illegal { word, .. }) = stop {
                    format!("{word:04x}")
                } else {
                    format!("{stop:?}")
                };
                list(vec![found], &[op]);
            }
            ["reset", why] => pic.reset(cause(why).unwrap_or_else(|| panic!("{}: no reset {why}", case.name))),
            ["cycle", n] => list(vec![pic.cycle().to_string()], &[n]),
            ["instructions", n] => list(vec![pic.instructions().to_string()], &[n]),
            ["pc", label] => {
                let at = case.program.labels.iter().find(|l| *l.1 == pic.pc() && l.0 == label);
                list(vec![at.map_or_else(|| format!("{:04x}", pic.pc()), |l| l.0.clone())], &[label]);
            }
            ["at", label, ref wanted @ ..] => {
                let pc = case.program.labels.get(label).unwrap_or_else(|| panic!("{}: no label {label}", case.name));
                list(log.visits.iter().filter(|v| v.1 == *pc).map(|v| v.0.to_string()).collect(), wanted);
            }
            ["fight", ref wanted @ ..] => {
                let name = |pin: PinId| case.program.part.chip.pins[usize::from(pin)].name;
                let fights = log.events.iter().filter_map(|event| match event {
                    ChipEvent::Contention { at, pin } => Some(format!("{}@{}", name(*pin), show_time(*at))),
                    _ => None,
                });
                list(fights.collect(), wanted);
            }
            ["sent", ref wanted @ ..] => {
                let sent = log.events.iter().filter_map(|event| match event {
                    ChipEvent::Sent { at, byte, .. } => Some(format!("{byte:02X}@{}", show_time(*at))),
                    _ => None,
                });
                list(sent.collect(), wanted);
            }
            [wire, ref wanted @ ..] if script::pin(case.program.part, wire).is_some() => {
                let on = script::pin(case.program.part, wire);
                let edges = log.events.iter().filter_map(|event| match *event {
                    ChipEvent::Edge { at, pin, level } if Some(pin) == on => Some(show_edge(at, level)),
                    _ => None,
                });
                list(edges.collect(), wanted);
            }
            _ => {
                for item in &items {
                    let Some((name, value)) = item.split_once('=') else { panic!("{}: what is {wanted}?", case.name) };
                    let value = u32::from_str_radix(value, 16).unwrap_or_else(|_| panic!("{}: {wanted}", case.name));
                    match place(case, &pic, name) {
                        Some(found) if found == value => {}
                        found => wrong.push(format!("{wanted}: {name} is {found:02x?}")),
                    }
                }
            }
        }
    }
    wrong
}

#[test]
fn programs_do_what_the_data_sheet_says() {
    let cases = cases();
    assert!(cases.len() > 240, "{} cases", cases.len());
    let mut wrong = 0;
    for case in &cases {
        for what in judge(case) {
            wrong += 1;
            eprintln!("{}: {what}", case.name);
        }
    }
    assert_eq!(wrong, 0, "of {} cases", cases.len());
}

/// Returns everything that a program can see, and the counters of the run.
fn state(pic: &Pic16) -> (Vec<Option<u8>>, [u16; 8], [u64; 4]) {
    let bytes = (0..0x200).map(|addr| pic.peek("data", addr)).collect();
    let counts = [pic.pc().into(), pic.cycle(), pic.instructions(), pic.reg("W").map_or(0, u64::from)];
    (bytes, *pic.stack().entries, counts)
}

/// Runs a case to its end, with the resets that it requests; `go` runs a slice.
fn run(case: &Case, pic: &mut Pic16, mut go: impl FnMut(&mut Pic16, u64) -> StopReason) -> StopReason {
    let mut pauses: Vec<(u64, Option<ResetCause>)> = case
        .wanted
        .iter()
        .filter_map(|w| Some((cycle_of(w)?, w.split_once("reset ").and_then(|w| cause(w.1)))))
        .filter(|pause| pause.1.is_some())
        .collect();
    pauses.sort_by_key(|pause| pause.0);
    pauses.push((case.program.until, None));
    let mut stop = StopReason::Limit;
    for (until, reset) in pauses {
        while pic.cycle() < until || stop == StopReason::Limit && reset.is_none() {
            stop = go(pic, until);
            if stop != StopReason::Limit || pic.cycle() >= until {
                break;
            }
        }
        if let Some(why) = reset {
            pic.reset(why);
        }
    }
    stop
}

#[test]
fn any_way_of_running_gives_the_same_machine() {
    let seed = 0x1618_5eed;
    let mut rng = Rng::new(seed);
    for case in &cases() {
        let start = case.program.machine();
        let mut whole = start.clone();
        let mut log = Log::<false>::default();
        let stop = run(case, &mut whole, |pic, until| pic.run(until, &mut log));
        let wanted = (state(&whole), stop);

        let mut plain = start.clone();
        plain.set_skip_idle_loops(false);
        let stop = run(case, &mut plain, |pic, until| pic.run(until, &mut ()));
        assert_eq!((state(&plain), stop), wanted, "{}: without a probe or jumping over loops", case.name);

        let mut seen = start.clone();
        let mut all = Log::<true>::default();
        let stop = run(case, &mut seen, |pic, until| pic.run(until, &mut all));
        assert_eq!((state(&seen), stop), wanted, "{}: with every hook", case.name);
        assert_eq!((&all.irqs, &all.events), (&log.irqs, &log.events), "{}: with every hook", case.name);

        for _ in 0..4 {
            let mut pic = start.clone();
            let mut parts = Log::<false>::default();
            let longest = [2, 9, 60, 700][rng.below(4) as usize];
            let stop = run(case, &mut pic, |pic, until| {
                let to = (pic.cycle() + 1 + rng.below(longest) * (1 + case.program.until / 5000)).min(until);
                let mut copy = pic.clone();
                let mut copied = parts.clone();
                let stop = pic.run(to, &mut parts);
                if rng.one_in(8) {
                    assert_eq!(copy.run(to, &mut copied), stop, "{}: seed {seed:x}", case.name);
                    assert_eq!(state(&copy), state(pic), "{}: a clone, seed {seed:x}", case.name);
                    (*pic, parts) = (copy, copied);
                }
                stop
            });
            assert_eq!((state(&pic), stop), wanted, "{}: in slices, seed {seed:x}", case.name);
            assert_eq!((&parts.irqs, &parts.events), (&log.irqs, &log.events), "{}: slices, seed {seed:x}", case.name);
        }
    }
}
