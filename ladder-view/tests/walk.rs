//! Moves randomly forwards and backwards through a ladder program, with inputs, resets and a watchdog.
//!
//! Every position must show the same, however the session reached it.

mod common;

use std::collections::BTreeMap;

use common::{ChipSetup, drive_input, open};
use emu_core::cpu::ResetCause;
use emu_debug::debug::{DebugSession, ExpressionPlace, RunGoal, SessionStopReason, UserAction};
use ladder_view::LadderView;

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

/// A rung that calls a routine, for chips with arithmetic.
const QUOTIENT: &str = "RUNG
    DIV q Cn 2
END
";

/// A pseudorandom generator (xorshift).
struct Xorshift(u64);

impl Xorshift {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }
}

/// Everything that the view shows at a position.
fn position_text(session: &DebugSession, view: &LadderView) -> String {
    let (machine, follow) = (session.machine(), session.follower());
    let element = view.scan_position(follow, machine).current_element();
    let mut text = format!("pc {:#x}, scan {:?}, {element:?}\n", machine.pc(), session.scan());
    for (name, value) in view.values(machine) {
        let why = view
            .explain_value(follow.expect("one follows"), machine, &name)
            .unwrap_or_else(|why| vec![why.to_string()]);
        if let Some(first) = why.first().filter(|line| line.starts_with(&format!("{name} is "))) {
            let value = value.expect("a value").to_string();
            let said = first[name.len() + 4..].split([':', ' ']).next();
            assert_eq!(said, Some(value.as_str()), "`{first}` is not what the chip has");
        }
        text.push_str(&format!("{}\n", why.join("\n")));
    }
    (1..=view.program().rungs.len() as u32).for_each(|rung| {
        view.draw_rung(rung, follow, machine, false).iter().for_each(|line| text.push_str(&format!("{line}\n")));
    });
    text
}

/// Enables the watchdog of the chip, if writes to registers can do that.
fn enable_watchdog(session: &mut DebugSession, mcu: &str) {
    let (space, addr, values) = match mcu {
        "atmega328p" => ("data", 0x60, [0x18, 0x08]),
        "at89s52" => ("sfr", 0xA6, [0x1E, 0xE1]),
        _ => return,
    };
    for value in values {
        let place = ExpressionPlace::Memory { space, addr, bytes: 1, signed: false };
        session.apply_action(UserAction::Set(place, value)).expect("a register");
    }
}

/// Runs one random sequence of moves; returns how often the program restarted by itself.
fn walk_back_and_forth(setup: ChipSetup, seed: u64) -> u32 {
    let ChipSetup { mcu, .. } = setup;
    let quotient = if mcu == "ap101" { "" } else { QUOTIENT };
    let (mut session, view) = open(&format!("{PROGRAM}{quotient}"), setup);
    let mut draw = Xorshift(seed);
    let mut known: BTreeMap<u64, String> = BTreeMap::new();
    let mut keep_running = || true;
    let mut resets = 0;
    for n in 0..100 {
        let deed = draw.below(16);
        let context = format!("{mcu}, seed {seed}, move {n}, deed {deed}, cycle {}", session.machine().cycle());
        match deed {
            0 => drive_input(&mut session, &view, "Xa", draw.below(2) == 1),
            1 => drive_input(&mut session, &view, "Xc", draw.below(3) == 0),
            2 => {
                let all = [ResetCause::PowerOn, ResetCause::External, ResetCause::Watchdog, ResetCause::BrownOut];
                session.apply_action(UserAction::Reset(all[draw.below(4) as usize])).expect("a reset");
            }
            3 => enable_watchdog(&mut session, mcu),
            4..=8 => {
                // To where scans and rungs begin, where words of the follower and deeds meet.
                let mut words: Vec<u32> = view.rung_starts().into_iter().map(|start| start.word).collect();
                words.extend([view.scan_start(), 0]);
                let word = words[draw.below(words.len() as u64) as usize];
                let until = Some(session.machine().cycle() + 20_000);
                let halt =
                    session.run(&RunGoal { until, words: [word].into(), runs_while_halted: false }, &mut keep_running);
                resets += u32::from(word == 0 && halt == SessionStopReason::Done);
            }
            9 => {
                let cycle = session.machine().cycle().saturating_sub(draw.below(8000));
                session.goto_cycle(cycle, &mut keep_running);
            }
            10 => _ = session.step_instructions(1 + draw.below(300), u64::MAX, &mut keep_running),
            _ => {
                let steps = 1 + [draw.below(4), draw.below(60), draw.below(300)][draw.below(3) as usize];
                if !session.is_at_step_end() {
                    session.step_instructions(1, u64::MAX, &mut keep_running);
                }
                let before = position_text(&session, &view);
                if session.step_back(steps, &mut || true) == SessionStopReason::Done {
                    if let Some(known) = known.get(&session.machine().cycle()).filter(|_| session.is_at_step_end()) {
                        assert_eq!(*known, position_text(&session, &view), "{context}: {steps} back");
                    }
                    session.step_instructions(steps, u64::MAX, &mut keep_running);
                    assert_eq!(before, position_text(&session, &view), "{context}: {steps} back and forward");
                }
            }
        }
        let now = session.machine().cycle();
        if deed < 4 {
            // The history from here on is no longer valid.
            known.split_off(&now);
        }
        if session.is_at_step_end() {
            let text = position_text(&session, &view);
            let known = known.entry(now).or_insert_with(|| text.clone());
            assert_eq!(*known, text, "{context}: at cycle {now}");
        }
    }
    resets
}

#[test]
fn back_and_forward_give_the_same() {
    let setups = [
        ChipSetup { mcu: "atmega328p", clock_hz: Some(1_000_000), watchdog: false },
        ChipSetup { mcu: "at89s52", clock_hz: Some(12_000_000), watchdog: false },
        ChipSetup { mcu: "pic16f873", clock_hz: Some(4_000_000), watchdog: true },
        ChipSetup { mcu: "ap101", clock_hz: None, watchdog: false },
    ];
    for setup in setups {
        let resets: u32 = (1..=3).map(|seed| walk_back_and_forth(setup, seed * 0x9E37_79B9)).sum();
        // On chips with a watchdog, it must have reset the program.
        assert!(resets > 0 || setup.mcu == "ap101", "{}: no reset", setup.mcu);
    }
}
