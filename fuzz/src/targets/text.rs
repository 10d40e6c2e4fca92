//! Targets of texts: scenarios, waveforms, traces, expressions, arguments.

use std::cell::RefCell;

use emu_core::chip::Chip;
use emu_core::image::Image;
use emu_debug::chip_scenario::{ChipBindings, ChipResolver};
use emu_debug::debug::DebugSession;
use emu_debug::text_escapes::{escape, unescape};
use emu_debug::time::{parse_duration, parse_hertz};
use emu_debug::{AddressNames, CycleClock, stimulus};
use scenario::{RecordedAction, Recorder, Scenario, ScenarioValue, bind, parse, parse_bytes, read_vcd};

use crate::machines::{family_chips, open_session};

/// Parses a scenario, and binds it to a chip of each family.
pub(crate) fn scenario(data: &[u8]) {
    if let Ok(scenario) = parse_bytes("fuzz.toml", data) {
        family_chips().for_each(|chip| bind_scenario(&scenario, chip));
    }
}

fn bind_scenario(scenario: &Scenario, chip: &'static Chip) {
    let size = |space: &str| chip.space(space).map_or(0, |row| row.size * row.width);
    let mut site = ChipResolver {
        names: AddressNames { chip, symbols: &[] },
        clock: CycleClock { hz: chip.default_hz, clocks_per_cycle: 4 },
        has_byte: &|space, addr| addr < size(space),
        has_pin: &|_| true,
        check_drive: &|_| Ok(()),
        canonical_pin_name: &|name| name.to_owned(),
        serial: (true, Some(0)),
        no_snapshots: None,
        no_serial_input: None,
        bindings: ChipBindings::default(),
    };
    if let Err(faults) = bind(scenario, &mut site, None, Some(chip.name)) {
        assert!(!faults.is_empty(), "refused for a reason");
    }
}

/// Records actions; the written scenario must be parsed again with the same number of steps.
pub(crate) fn record(data: &[u8]) {
    let (clocks, data) = data.split_first().map_or((0, data), |(first, rest)| (*first, rest));
    let mut recorder = Recorder::new((clocks % 16 > 0).then_some(u32::from(clocks % 16)));
    recorder.align_to_cycles = clocks & 0x10 != 0;
    recorder.program =
        (clocks & 0x20 != 0).then(|| text(data.get(..9).unwrap_or(data))).filter(|name| !name.is_empty());
    let mut steps = 0;
    let mut pieces = data;
    while let Some(([kind, tick, len], rest)) = pieces.split_first_chunk::<3>() {
        let (piece, rest) = rest.split_at(usize::from(*len).min(rest.len()));
        pieces = rest;
        let done = match kind % 5 {
            0 if !piece.is_empty() => RecordedAction::Send(piece.to_vec()),
            1 => RecordedAction::PowerCycle,
            2 => RecordedAction::Other(text(piece)),
            // Names and values are never empty.
            _ if piece.is_empty() => continue,
            3 => RecordedAction::Set(text(piece), ScenarioValue::Text(text(piece))),
            _ => RecordedAction::Set(text(piece), ScenarioValue::Number(i64::from(*kind) << (*tick % 64))),
        };
        steps += usize::from(!matches!(done, RecordedAction::Other(_)));
        recorder.push(u64::from(*tick), done);
    }
    let written = recorder.write(1 << 20);
    let read = parse("record.toml", &written);
    assert_eq!(read.map(|scenario| scenario.steps.len()), Ok(steps + 1), "{written}");
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Reads a waveform as a stimulus with all wires, and draws it.
pub(crate) fn vcd(data: &[u8]) {
    if let Ok(waveform) = read_vcd("fuzz.vcd", data) {
        _ = waveform.to_scenario(&mut |_| true);
    }
    _ = emu::fuzzing::draw_wave(data);
}

/// Reads a trace; it has lines or is refused.
pub(crate) fn trace(data: &[u8]) {
    assert_ne!(emu::fuzzing::read_trace(data), Some(0), "an empty trace is refused");
}

/// Parses command line arguments, one per line.
pub(crate) fn arguments(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    _ = emu::fuzzing::parse_arguments(&text.lines().collect::<Vec<_>>());
}

thread_local! {
    /// Machines on which expressions are evaluated; none of them is changed.
    static SESSIONS: RefCell<Vec<DebugSession>> = RefCell::new(family_chips().map(|chip| open_session(chip, Image::default())).collect());
}

/// Tries every line as everything that a flag or a command accepts.
pub(crate) fn expression(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for line in text.lines() {
        _ = (parse_hertz(line), parse_duration(line));
        if let Ok(bytes) = unescape(line) {
            let escaped = escape(&bytes);
            let within = escaped.strip_prefix('"').and_then(|text| text.strip_suffix('"')).map(unescape);
            assert_eq!(within, Some(Ok(bytes)), "escapes come back");
        }
        SESSIONS.with_borrow(|sessions| sessions.iter().for_each(|session| try_expressions(session, line)));
    }
}

fn try_expressions(session: &DebugSession, line: &str) {
    let (scope, target) = (&session.scope, session.machine());
    let source = scope.source();
    if let Ok(expr) = scope.parse_expression(line) {
        _ = (expr.value(target), expr.place(target));
    }
    if let Ok(until) = source.parse_condition(line) {
        _ = until.describe(&source.names);
    }
    if let Ok(range) = scope.parse_range(line) {
        assert!(range.start < range.end, "a range has something in it: {line}");
        _ = source.names.check_observable(&range);
    }
    _ = (scope.parse_watched_range(line, target), source.parse_words(line), source.names.parse_program_end(line));
    _ = (session.clock().parse_cycles(line), session.clock().parse_moment(line));
    _ = (stimulus::parse_drive(scope.chip(), line), stimulus::parse_timed_drive(scope.chip(), session.clock(), line));
}
