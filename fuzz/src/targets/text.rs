//! Texts: scenarios, waveforms, traces, expressions, arguments.

use std::cell::RefCell;

use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_debug::debug::Session;
use emu_debug::scene::{ChipSite, Table};
use emu_debug::text::{escape, unescape};
use emu_debug::time::{duration, hertz};
use emu_debug::{Clock, Names, stimulus};
use scenario::{Done, Recorder, Scenario, Value, bind, parse, parse_bytes, read_vcd};

use crate::machine::{chips, session};

/// Its names and times are looked up on a chip of each family.
pub(crate) fn scenario(data: &[u8]) {
    if let Ok(scenario) = parse_bytes("fuzz.toml", data) {
        chips().for_each(|chip| bound(&scenario, chip));
    }
}

fn bound(scenario: &Scenario, chip: &'static Chip) {
    let size = |space: &str| chip.spaces.iter().find(|row| row.0 == space).map_or(0, |row| row.1 * row.2);
    let mut site = ChipSite {
        names: Names { chip, symbols: &[] },
        clock: Clock { hz: chip.default_hz, clocks_per_cycle: 4 },
        there: &|space, addr| addr < size(space),
        has_pin: &|_| true,
        can: &|_| Ok(()),
        own: &|name| name.to_owned(),
        serial: (true, Some(0)),
        stateless: None,
        deaf: None,
        table: Table::default(),
    };
    if let Err(faults) = bind(scenario, &mut site, None, Some(chip.name)) {
        assert!(!faults.is_empty(), "refused for a reason");
    }
}

/// What is written is read again, with as many steps.
pub(crate) fn record(data: &[u8]) {
    let (clocks, data) = data.split_first().map_or((0, data), |(first, rest)| (*first, rest));
    let mut recorder = Recorder::new((clocks % 16 > 0).then_some(u32::from(clocks % 16)));
    recorder.whole = clocks & 0x10 != 0;
    recorder.program =
        (clocks & 0x20 != 0).then(|| text(data.get(..9).unwrap_or(data))).filter(|name| !name.is_empty());
    let mut steps = 0;
    let mut pieces = data;
    while let Some(([kind, tick, len], rest)) = pieces.split_first_chunk::<3>() {
        let (piece, rest) = rest.split_at(usize::from(*len).min(rest.len()));
        pieces = rest;
        let done = match kind % 5 {
            0 if !piece.is_empty() => Done::Send(piece.to_vec()),
            1 => Done::PowerCycle,
            2 => Done::Other(text(piece)),
            // Nothing has an empty name or value.
            _ if piece.is_empty() => continue,
            3 => Done::Set(text(piece), Value::Text(text(piece))),
            _ => Done::Set(text(piece), Value::Number(i64::from(*kind) << (*tick % 64))),
        };
        steps += usize::from(!matches!(done, Done::Other(_)));
        recorder.push(u64::from(*tick), done);
    }
    let written = recorder.write(1 << 20);
    let read = parse("record.toml", &written);
    assert_eq!(read.map(|scenario| scenario.steps.len()), Ok(steps + 1), "{written}");
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// As a stimulus whose every wire is wanted, and as a drawing.
pub(crate) fn vcd(data: &[u8]) {
    if let Ok(waveform) = read_vcd("fuzz.vcd", data) {
        _ = waveform.scenario(&mut |_| true);
    }
    _ = emu::fuzzing::wave(data);
}

/// A trace has lines or is refused.
pub(crate) fn trace(data: &[u8]) {
    assert_ne!(emu::fuzzing::trace(data), Some(0), "an empty trace is refused");
}

/// One argument a line.
pub(crate) fn arguments(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    _ = emu::fuzzing::arguments(&text.lines().collect::<Vec<_>>());
}

thread_local! {
    /// Machines on which expressions have values; none of them is changed.
    static SESSIONS: RefCell<Vec<Session>> = RefCell::new(chips().map(|chip| session(chip, Image::default())).collect());
}

/// Every line is tried as everything that a flag or a command takes.
pub(crate) fn expression(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for line in text.lines() {
        _ = (hertz(line), duration(line));
        if let Ok(bytes) = unescape(line) {
            let escaped = escape(&bytes);
            let within = escaped.strip_prefix('"').and_then(|text| text.strip_suffix('"')).map(unescape);
            assert_eq!(within, Some(Ok(bytes)), "escapes come back");
        }
        SESSIONS.with_borrow(|sessions| sessions.iter().for_each(|session| tried(session, line)));
    }
}

fn tried(session: &Session, line: &str) {
    let (scope, target) = (&session.scope, session.target());
    let source = scope.source();
    if let Ok(expr) = scope.expr(line) {
        _ = (expr.value(target), expr.place(target));
    }
    if let Ok(until) = source.until(line) {
        _ = until.describe(&source.names);
    }
    if let Ok(range) = scope.range(line) {
        assert!(range.start < range.end, "a range has something in it: {line}");
        _ = source.names.told(&range);
    }
    _ = (scope.accessed(line, target), source.words(line), source.names.program_end(line));
    _ = (session.clock().cycles(line), session.clock().moment(line));
    _ = (stimulus::put(scope.chip(), line), stimulus::drive(scope.chip(), session.clock(), line));
}
