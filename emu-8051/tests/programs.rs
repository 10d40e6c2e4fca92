//! Programs as text on the whole machine: their results, and the cycle of every edge, interrupt and byte.
//! Each program is also run in random slices, from clones taken during the run, with and without skipping of
//! loops, and with all probe hooks enabled and disabled. All runs must end with the same machine.
//!
//! Expectations of a case, with hexadecimal values and decimal cycles:
//!
//! - `halted`, `illegal a5`: why the run ends; without either it must reach its limit;
//! - `ACC=5`, `idata:30=5`, `sfr:P1=5`, `bit:TR0=1`, `xdata:..`: values at the end; `@12 TL0=5`: as read in
//!   cycle 12;
//! - `irq INT0@12 TIMER0@20`: all interrupts, with the first cycle of each call; `sent 41@960`: all bytes
//!   sent;
//! - `P1.0 12H 20.4L`: all edges of a pin by cycle and clock; `fight P1.0@3`: all contentions;
//! - `at label 12 30`: the cycles at which the label is reached; `cycle 70`, `instructions 70`, `pc label`:
//!   at the end.
//!
//! A list that ends with `...` can continue.

#[path = "programs/script.rs"]
mod script;
#[path = "programs/source.rs"]
mod source;

use emu_8051::{Mcs51, chips};
use emu_core::pins::{ChipEvent, CycleTime, PinLevel};
use emu_core::rng::Rng;
use emu_core::{Cpu, Probe, ProgramError, StopReason};
use script::Case;

const TEXTS: &[&str] = &[
    include_str!("programs/latency.txt"),
    include_str!("programs/interrupts.txt"),
    include_str!("programs/ports.txt"),
    include_str!("programs/timers.txt"),
    include_str!("programs/serial.txt"),
    include_str!("programs/power.txt"),
];

fn cases() -> Vec<Case> {
    TEXTS.iter().flat_map(|text| script::cases(text)).collect()
}

/// Interrupt sources by number.
const SOURCES: [&str; 7] = ["RESET", "INT0", "TIMER0", "INT1", "TIMER1", "SERIAL", "TIMER2"];

/// Everything that a probe reports; with `INSN` also instructions and data.
#[derive(Default, Clone, PartialEq, Debug)]
struct Log<const INSN: bool> {
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

fn show_edge((at, level): (CycleTime, PinLevel)) -> String {
    let letter = ["L", "H", "F"][level as usize];
    if at.phase == 0 { format!("{}{letter}", at.cycle) } else { format!("{}.{}{letter}", at.cycle, at.phase) }
}

/// The value of a named location: `sfr:P1`, `bit:P1.0`, `idata:30`, `ACC`, `TL0`.
fn place(mcs51: &Mcs51, text: &str) -> Option<u32> {
    let hex = |text: &str| u32::from_str_radix(text, 16).ok();
    match text.split_once(':') {
        Some(("bit", name)) => {
            let addr = match source::pin(name) {
                Some(pin) => Some(0x80 + u32::from(pin / 8) * 16 + u32::from(pin % 8)),
                None => chips::BITS.iter().find(|b| b.name == name).map(|b| u32::from(b.addr)).or_else(|| hex(name)),
            };
            mcs51.peek("bit", addr?).map(u32::from)
        }
        Some((space, addr)) => mcs51.peek(space, hex(addr)?).map(u32::from),
        None => mcs51.reg(text).or_else(|| {
            let sfr = chips::SFRS.iter().find(|r| r.name == text)?;
            mcs51.peek("sfr", sfr.addr.into()).map(u32::from)
        }),
    }
}

/// Runs a case and returns its differences from the expectations.
fn judge(case: &Case) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut mcs51 = case.machine();
    let mut log = Log::<true>::default();
    let mut stop = StopReason::Limit;
    let mut ends: Vec<&str> = case.wanted.iter().map(String::as_str).collect();
    let cycle_of = |w: &str| w.strip_prefix('@').and_then(|w| w.split_once(' ')?.0.parse::<u64>().ok());
    ends.sort_by_key(|w| cycle_of(w).unwrap_or(u64::MAX));
    let wanted_stop = case.wanted.iter().any(|w| w == "halted" || w.starts_with("illegal"));
    let mut over = false;
    for wanted in ends {
        let mut items: Vec<&str> = wanted.split_whitespace().collect();
        match cycle_of(wanted) {
            Some(cycle) => {
                stop = mcs51.run(cycle, &mut log);
                if mcs51.cycle() != cycle {
                    wrong.push(format!("cycle {cycle} is not a boundary, {} is; {stop:?}", mcs51.cycle()));
                }
                items.remove(0);
            }
            None if !over => {
                stop = mcs51.run(case.until, &mut log);
                over = true;
                if !wanted_stop && stop != StopReason::Limit {
                    wrong.push(format!("stopped at {}: {stop:?}", mcs51.cycle()));
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
                wrong.push(format!("{}: wanted {}, found {}", items[0], wanted.join(" "), found.join(" ")));
            }
        };
        match items[..] {
            ["halted"] => list(vec![format!("{stop:?}")], &["Halted"]),
            ["illegal", op] => {
                let found = if let StopReason::Error(ProgramError::Illegal { word, .. }) = stop {
                    format!("{word:02x}")
                } else {
                    format!("{stop:?}")
                };
                list(vec![found], &[op]);
            }
            ["cycle", n] => list(vec![mcs51.cycle().to_string()], &[n]),
            ["instructions", n] => list(vec![mcs51.instructions().to_string()], &[n]),
            ["pc", label] => {
                let at = case.labels.iter().find(|l| *l.1 == mcs51.pc() && l.0 == label);
                list(vec![at.map_or_else(|| format!("{:04x}", mcs51.pc()), |l| l.0.clone())], &[label]);
            }
            ["at", label, ref wanted @ ..] => {
                let pc = case.labels.get(label).unwrap_or_else(|| panic!("{}: no label {label}", case.name()));
                list(log.visits.iter().filter(|v| v.1 == *pc).map(|v| v.0.to_string()).collect(), wanted);
            }
            ["irq", ref wanted @ ..] => {
                list(log.irqs.iter().map(|&(at, v)| format!("{}@{at}", SOURCES[usize::from(v)])).collect(), wanted);
            }
            ["sent", ref wanted @ ..] => {
                let sent = log.events.iter().filter_map(|event| match event {
                    ChipEvent::Sent { at, byte, .. } => Some(format!("{byte:02x}@{}", at.cycle)),
                    _ => None,
                });
                list(sent.collect(), wanted);
            }
            ["fight", ref wanted @ ..] => {
                let fights = log.events.iter().filter_map(|event| match event {
                    ChipEvent::Contention { at, pin } => Some(format!("P{}.{}@{}", pin / 8, pin % 8, at.cycle)),
                    _ => None,
                });
                list(fights.collect(), wanted);
            }
            [wire, ref wanted @ ..] if source::pin(wire).is_some() => {
                let edges = log.events.iter().filter_map(|event| match *event {
                    ChipEvent::Edge { at, pin, level } if Some(pin) == source::pin(wire) => {
                        Some(show_edge((at, level)))
                    }
                    _ => None,
                });
                list(edges.collect(), wanted);
            }
            _ => {
                for item in &items {
                    let Some((name, value)) = item.split_once('=') else {
                        panic!("{}: what is {wanted}?", case.name())
                    };
                    let value = u32::from_str_radix(value, 16).unwrap_or_else(|_| panic!("{}: {wanted}", case.name()));
                    match place(&mcs51, name) {
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
fn programs_do_what_the_manual_says() {
    let cases = cases();
    assert!(cases.len() > 600, "{} cases", cases.len());
    let mut wrong = 0;
    for case in &cases {
        for what in judge(case) {
            wrong += 1;
            eprintln!("{}: {what}", case.name());
        }
    }
    assert_eq!(wrong, 0, "of {} cases", cases.len());
}

/// Everything that a program can see, and the counts of the run.
fn state(mcs51: &Mcs51) -> (Vec<Option<u8>>, [u64; 3]) {
    let spaces = [("idata", 0..256), ("sfr", 128..256), ("xdata", 0..512)];
    let bytes = spaces.iter().flat_map(|(space, range)| range.clone().map(|addr| mcs51.peek(space, addr)));
    (bytes.collect(), [mcs51.pc().into(), mcs51.cycle(), mcs51.instructions()])
}

#[test]
fn any_way_of_running_gives_the_same_machine() {
    let seed = 0x8051_5eed;
    let mut rng = Rng::new(seed);
    for case in &cases() {
        let mut whole = case.machine();
        let mut log = Log::<false>::default();
        let stop = whole.run(case.until, &mut log);
        let wanted = (state(&whole), stop);

        let mut plain = case.machine();
        plain.set_skip_idle_loops(false);
        let stop = plain.run(case.until, &mut ());
        assert_eq!((state(&plain), stop), wanted, "{}: without a probe or jumping over loops", case.name());

        let mut seen = case.machine();
        let mut all = Log::<true>::default();
        let stop = seen.run(case.until, &mut all);
        assert_eq!((state(&seen), stop), wanted, "{}: with every hook", case.name());
        assert_eq!((&all.irqs, &all.events), (&log.irqs, &log.events), "{}: with every hook", case.name());

        for _ in 0..4 {
            let mut mcs51 = case.machine();
            let mut parts = Log::<false>::default();
            let longest = [2, 9, 60, 700][rng.below(4) as usize];
            let stop = loop {
                let until = mcs51.cycle() + 1 + rng.below(longest);
                let mut copy = mcs51.clone();
                let mut copied = parts.clone();
                let stop = mcs51.run(until.min(case.until), &mut parts);
                if rng.one_in(8) {
                    assert_eq!(copy.run(until.min(case.until), &mut copied), stop, "{}: seed {seed:x}", case.name());
                    assert_eq!(state(&copy), state(&mcs51), "{}: a clone, seed {seed:x}", case.name());
                    (mcs51, parts) = (copy, copied);
                }
                if stop != StopReason::Limit || mcs51.cycle() >= case.until {
                    break stop;
                }
            };
            assert_eq!((state(&mcs51), stop), wanted, "{}: in slices, seed {seed:x}", case.name());
            assert_eq!(
                (&parts.irqs, &parts.events),
                (&log.irqs, &log.events),
                "{}: slices, seed {seed:x}",
                case.name()
            );
        }
    }
}
