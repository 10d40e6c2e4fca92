//! What is shown of ladder programs on chips, as text in `view.txt`: a line that begins with `$` is done, those behind it with `|`
//! are what is shown. EMU_BLESS=1 writes the file anew, to be read.
//!
//! ```text
//! $ open press.ld atmega328p     compile an example, switch the chip on
//! $ set Xleft=1                  a pin
//! $ scan 3                       run to the start of the third scan from here
//! $ rung 2                       run to the first instruction of that rung
//! $ element                      run to the next element
//! $ draw                         the rung where the chip is
//! $ show 3                       that rung
//! $ why Ypress
//! $ back 5                       that many steps back
//! ```

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::load_hex;
use emu_core::pins::{Level, Time};
use emu_debug::debug::{Action, Goal, Options, Rig, Scope, Session, Target, Why};
use emu_debug::stimulus::{Drive, Put};
use emu_debug::{Board, Clock};
use ladder_view::View;

fn rig<C: Cpu + 'static>(cpu: C, clock: Clock) -> Box<dyn Target> {
    Box::new(Rig::new(cpu, Board::new(Vec::new(), clock)))
}

fn open(program: &str, mcu: &str) -> (Session, View) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(program);
    let text = std::fs::read(&path).expect("an example");
    let program = ladder::parse_bytes(program, &text, ladder::Options::default()).expect("a program").program;
    let options = ladder_compile::Options { mcu: mcu.to_owned(), ..Default::default() };
    let compiled = ladder_compile::compile(&program, &options).expect("an image");
    let chip = ladder_compile::chip(mcu).expect("a chip");
    let image = load_hex("program", compiled.hex.as_bytes(), chip.hex).expect("a HEX file").image;
    let clock = Clock { hz: compiled.map.clock_hz, clocks_per_cycle: 1 };
    let target = match chip.family {
        emu_core::chip::Family::Avr => rig(emu_avr::Avr::new(chip, &image, RamInit::Zero), clock),
        emu_core::chip::Family::Mcs51 => {
            rig(emu_8051::Mcs51::with(chip, &image, RamInit::Zero, emu_8051::Options::default()), clock)
        }
        emu_core::chip::Family::Pic16 => {
            rig(emu_pic16::Pic16::with(chip, &image, RamInit::Zero, emu_pic16::Options::default()), clock)
        }
        emu_core::chip::Family::Ap101 => rig(emu_ap101::Ap101::with(&image, emu_ap101::Options::default()), clock),
    };
    let view = View::new(program, compiled.map, chip).expect("they belong together");
    let mut scope = Scope::new(chip);
    scope.ladder = view.symbols();
    let options = Options { clock, history: 64 << 20, follow: Some(view.follower()) };
    let mut session = Session::new(target, scope, options);
    // Inputs have pull-ups; these programs are easier to follow when all are low.
    for pin in view.map().pins.clone().iter().filter(|pin| pin.direction == "in") {
        put(&mut session, &view, &pin.name, false);
    }
    (session, view)
}

fn put(session: &mut Session, view: &View, name: &str, high: bool) {
    let pin = view.map().pins.iter().find(|pin| pin.name == name).expect("a pin of the program");
    let pin = session.scope.chip().pin(&pin.pin).expect("a pin of the chip");
    let at = Time::at(session.target().cycle());
    session.act(Action::Drive(Drive { at, put: Put::Level(pin, Level::of(high)) })).expect("a level");
}

/// Runs to one of these words.
fn run_to(session: &mut Session, words: impl IntoIterator<Item = u32>) {
    let until = Some(session.target().cycle() + 100_000_000);
    let goal = Goal { until, words: words.into_iter().collect::<BTreeSet<u32>>() };
    assert_eq!(session.run(&goal, &mut || true).why, Why::Done);
}

fn done(command: &str, open_now: &mut Option<(Session, View)>, out: &mut String) {
    let words: Vec<&str> = command.split_whitespace().collect();
    if let ["open", program, mcu] = words[..] {
        *open_now = Some(open(program, mcu));
        return;
    }
    let (session, view) = open_now.as_mut().expect("a program is open");
    let number = words.get(1).and_then(|word| word.parse::<u64>().ok()).unwrap_or(1);
    match words[..] {
        ["set", set] => {
            let (name, value) = set.split_once('=').expect("a value");
            put(session, view, name, value == "1");
        }
        ["scan", ..] => (0..number).for_each(|_| run_to(session, [view.scan_start()])),
        ["rung", _] => {
            run_to(session, view.rung_words().into_iter().filter(|row| u64::from(row.0) == number).map(|row| row.1))
        }
        ["element", ..] => (0..number).for_each(|_| run_to(session, view.element_words().into_iter().map(|row| row.1))),
        ["back", ..] => _ = session.back_stepi(number),
        ["where"] => {
            let pc = session.target().pc();
            let element = view.element_at(pc).map_or("no element".to_owned(), |id| id.to_string());
            let line = view.rung_at(pc).and_then(|rung| view.rung_line(rung));
            _ = writeln!(out, "| scan {:?}, {element}, line {line:?}", session.scan());
        }
        ["draw"] => {
            let lines = view.draw(session.follow(), session.target().pc(), false);
            lines.iter().for_each(|line| _ = writeln!(out, "| {line}"));
        }
        ["show", _] => {
            let lines = view.draw_rung(number as u32, session.follow(), session.target().pc(), false);
            lines.iter().for_each(|line| _ = writeln!(out, "| {line}"));
        }
        ["why", name] => match view.why(session.follow().expect("one follows"), name) {
            Ok(lines) => lines.iter().for_each(|line| _ = writeln!(out, "| {line}")),
            Err(why) => _ = writeln!(out, "| error: {why}"),
        },
        _ => panic!("`{command}` is no command"),
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
            done(command, &mut session, &mut out);
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
