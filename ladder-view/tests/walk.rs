//! A walk forwards and backwards through a ladder program, with inputs, resets and a watchdog on the way: at every position the same is
//! told, however one came there.

mod common;

use std::collections::BTreeMap;

use common::{Setup, open, put};
use emu_core::cpu::Reset;
use emu_debug::debug::{Action, Goal, Place, Session, Why};
use ladder_view::View;

/// A latch, edges, a counter and a routine, in scans of 1 ms.
const PROGRAM: &str = "LDmicro0.1
CYCLE=1000
CRYSTAL=1000000

IO LIST
END

PROGRAM
RUNG
    CONTACTS Xa 0
    OSR
    COIL Redge 0 0 0
END
RUNG
    PARALLEL
        CONTACTS Redge 0
        CONTACTS Yb 0
    END
    CONTACTS Xc 1
    COIL Yb 0 0 0
END
RUNG
    CONTACTS Redge 0
    CTU Cn 3
    COIL Yd 0 0 0
END
RUNG
    CONTACTS Xc 0
    RES Cn
END
";

/// A rung that calls a routine, where there is arithmetic.
const QUOTIENT: &str = "RUNG
    DIV q Cn 2
END
";

/// Numbers that look drawn (xorshift).
struct Draw(u64);

impl Draw {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }
}

/// Everything that is told at a position.
fn told(session: &Session, view: &View) -> String {
    let (target, follow) = (session.target(), session.follow());
    let element = view.moment(follow, target).here();
    let mut text = format!("pc {:#x}, scan {:?}, {element:?}\n", target.pc(), session.scan());
    for (name, value) in view.values(target) {
        let why = view.why(follow.expect("one follows"), target, &name).unwrap_or_else(|why| vec![why]);
        if let Some(first) = why.first().filter(|line| line.starts_with(&format!("{name} is "))) {
            let value = value.expect("a value").to_string();
            let said = first[name.len() + 4..].split([':', ' ']).next();
            assert_eq!(said, Some(value.as_str()), "`{first}` is not what the chip has");
        }
        text.push_str(&format!("{}\n", why.join("\n")));
    }
    (1..=view.program().rungs.len() as u32).for_each(|rung| {
        view.draw_rung(rung, follow, target, false).iter().for_each(|line| text.push_str(&format!("{line}\n")));
    });
    text
}

/// Switches the chip's watchdog on, where writes to registers do that.
fn watch_over(session: &mut Session, mcu: &str) {
    let (space, addr, values) = match mcu {
        "atmega328p" => ("data", 0x60, [0x18, 0x08]),
        "at89s52" => ("sfr", 0xA6, [0x1E, 0xE1]),
        _ => return,
    };
    for value in values {
        let place = Place::Memory { space, addr, bytes: 1, signed: false };
        session.act(Action::Set(place, value)).expect("a register");
    }
}

/// One walk; tells how often the program has begun anew by itself.
fn walk(setup: Setup, seed: u64) -> u32 {
    let Setup { mcu, .. } = setup;
    let quotient = if mcu == "ap101" { "" } else { QUOTIENT };
    let (mut session, view) = open(&format!("{PROGRAM}{quotient}"), setup);
    let mut draw = Draw(seed);
    let mut known: BTreeMap<u64, String> = BTreeMap::new();
    let mut go_on = || true;
    let mut resets = 0;
    for n in 0..100 {
        let deed = draw.below(16);
        let context = format!("{mcu}, seed {seed}, move {n}, deed {deed}, cycle {}", session.target().cycle());
        match deed {
            0 => put(&mut session, &view, "Xa", draw.below(2) == 1),
            1 => put(&mut session, &view, "Xc", draw.below(3) == 0),
            2 => {
                let all = [Reset::PowerOn, Reset::External, Reset::Watchdog, Reset::BrownOut];
                session.act(Action::Reset(all[draw.below(4) as usize])).expect("a reset");
            }
            3 => watch_over(&mut session, mcu),
            4..=8 => {
                // To where scans and rungs begin, where words of the follower and deeds meet.
                let mut words: Vec<u32> = view.rung_words().into_iter().map(|row| row.1).collect();
                words.extend([view.scan_start(), 0]);
                let word = words[draw.below(words.len() as u64) as usize];
                let until = Some(session.target().cycle() + 20_000);
                let halt = session.run(&Goal { until, words: [word].into(), passes: false }, &mut go_on);
                resets += u32::from(word == 0 && halt.why == Why::Done);
            }
            9 => {
                let cycle = session.target().cycle().saturating_sub(draw.below(8000));
                session.goto_cycle(cycle, &mut go_on);
            }
            10 => _ = session.stepi(1 + draw.below(300), u64::MAX, &mut go_on),
            _ => {
                let steps = 1 + [draw.below(4), draw.below(60), draw.below(300)][draw.below(3) as usize];
                if !session.settled() {
                    session.stepi(1, u64::MAX, &mut go_on);
                }
                let before = told(&session, &view);
                if session.back_stepi(steps, &mut || true).why == Why::Done {
                    if let Some(known) = known.get(&session.target().cycle()).filter(|_| session.settled()) {
                        assert_eq!(*known, told(&session, &view), "{context}: {steps} back");
                    }
                    session.stepi(steps, u64::MAX, &mut go_on);
                    assert_eq!(before, told(&session, &view), "{context}: {steps} back and forward");
                }
            }
        }
        let now = session.target().cycle();
        if deed < 4 {
            // Everything from here on is another story.
            known.split_off(&now);
        }
        if session.settled() {
            let text = told(&session, &view);
            let known = known.entry(now).or_insert_with(|| text.clone());
            assert_eq!(*known, text, "{context}: at cycle {now}");
        }
    }
    resets
}

#[test]
fn back_and_forward_tell_the_same() {
    let setups = [
        Setup { mcu: "atmega328p", clock_hz: Some(1_000_000), watchdog: false },
        Setup { mcu: "at89s52", clock_hz: Some(12_000_000), watchdog: false },
        Setup { mcu: "pic16f873", clock_hz: Some(4_000_000), watchdog: true },
        Setup { mcu: "ap101", clock_hz: None, watchdog: false },
    ];
    for setup in setups {
        let resets: u32 = (1..=3).map(|seed| walk(setup, seed * 0x9E37_79B9)).sum();
        // The watchdog has done its part, where there is one.
        assert!(resets > 0 || setup.mcu == "ap101", "{}: no reset", setup.mcu);
    }
}
