//! Compares views of ladder programs on chips with `view.txt`.
//!
//! A line that begins with `$` is a command, and the following lines with `|` are its output. EMU_BLESS=1
//! rewrites the file; review it before committing.
//!
//! ```text
//! $ open press.ld atmega328p     compile an example, power the chip up
//! $ set Xleft=1                  drive a pin
//! $ scan 3                       run to the start of the third scan from here
//! $ rung 2                       run to the first instruction of that rung
//! $ element                      run to the next element
//! $ where                        print scan, element and line
//! $ draw                         draw the rung where the chip is
//! $ show 3                       draw that rung
//! $ why Ypress                   explain the value of a symbol
//! $ back 5                       go that many steps back
//! ```

mod common;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use common::{ChipSetup, drive_input, open};
use emu_debug::debug::{DebugSession, RunGoal, SessionStopReason};
use ladder_view::LadderView;

fn example(program: &str, mcu: &'static str) -> (DebugSession, LadderView) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(program);
    open(&std::fs::read_to_string(&path).expect("an example"), ChipSetup { mcu, clock_hz: None, watchdog: false })
}

/// Runs to one of these program words.
fn run_to(session: &mut DebugSession, words: impl IntoIterator<Item = u32>) {
    let until = Some(session.machine().cycle() + 100_000_000);
    let goal = RunGoal { until, words: words.into_iter().collect::<BTreeSet<u32>>(), runs_while_halted: false };
    assert_eq!(session.run(&goal, &mut || true), SessionStopReason::Done);
}

fn run_command(command: &str, open_now: &mut Option<(DebugSession, LadderView)>, out: &mut String) {
    let words: Vec<&str> = command.split_whitespace().collect();
    if let ["open", program, mcu] = words[..] {
        *open_now = Some(example(program, ladder_compile::find_chip(mcu).expect("a chip").name));
        return;
    }
    let (session, view) = open_now.as_mut().expect("a program is open");
    let number = words.get(1).and_then(|word| word.parse::<u64>().ok()).unwrap_or(1);
    match words[..] {
        ["set", set] => {
            let (name, value) = set.split_once('=').expect("a value");
            drive_input(session, view, name, value == "1");
        }
        ["scan", ..] => (0..number).for_each(|_| run_to(session, [view.scan_start()])),
        ["rung", _] => run_to(
            session,
            view.rung_starts().into_iter().filter(|start| u64::from(start.rung) == number).map(|start| start.word),
        ),
        ["element", ..] => {
            (0..number).for_each(|_| run_to(session, view.element_starts().into_iter().map(|start| start.word)))
        }
        ["back", ..] => _ = session.step_back(number, &mut || true),
        ["where"] => {
            let pc = session.machine().pc();
            let element = view.element_at(pc).map_or("no element".to_owned(), |id| id.to_string());
            let line = view.rung_at(pc).and_then(|rung| view.rung_line(rung));
            _ = writeln!(out, "| scan {:?}, {element}, line {line:?}", session.scan());
        }
        ["draw"] => {
            let lines = view.draw(session.follower(), session.machine(), false);
            lines.iter().for_each(|line| _ = writeln!(out, "| {line}"));
        }
        ["show", _] => {
            let lines = view.draw_rung(number as u32, session.follower(), session.machine(), false);
            lines.iter().for_each(|line| _ = writeln!(out, "| {line}"));
        }
        ["why", name] => match view.explain_value(session.follower().expect("one follows"), session.machine(), name) {
            Ok(lines) => lines.iter().for_each(|line| _ = writeln!(out, "| {line}")),
            Err(why) => _ = writeln!(out, "| error: {why}"),
        },
        _ => panic!("`{command}` is not a command"),
    }
}

#[test]
fn shown() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/view.txt");
    let text = std::fs::read_to_string(&file).expect("view.txt");
    let (mut out, mut session, mut commands) = (String::new(), None, 0);
    for line in text.lines().filter(|line| !line.starts_with('|')) {
        out.push_str(line);
        out.push('\n');
        if let Some(command) = line.strip_prefix("$ ") {
            run_command(command, &mut session, &mut out);
            commands += 1;
        }
    }
    assert!(commands > 50, "only {commands} commands");
    if std::env::var_os("EMU_BLESS").is_some() {
        std::fs::write(&file, &out).expect("view.txt is written");
    }
    let first = out.lines().zip(text.lines()).position(|(a, b)| a != b);
    let (now, was) = (first.and_then(|n| out.lines().nth(n)), first.and_then(|n| text.lines().nth(n)));
    assert!(out == text || std::env::var_os("EMU_BLESS").is_some(), "line {first:?}: {now:?}, wanted {was:?}");
}
