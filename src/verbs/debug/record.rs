//! `record`: writes the external actions on the machine as a scenario that repeats them.

use emu_core::chip::Chip;
use emu_core::cpu::ResetCause;
use emu_core::pins::{CycleTime, PinLevel};
use emu_debug::TimedDrive;
use emu_debug::debug::{ExpressionPlace, TimedAction, UserAction};
use emu_debug::stimulus::{ExternalDrive, supply_name};
use scenario::{RecordedAction, Recorder, ScenarioValue};

use super::shell::{CommandResult, DebugShell};
use crate::shared::fail::VerbFailure;
use crate::shared::output;
use crate::shared::output::RequestedOutput;

/// Maximum size in bytes of a number in memory that a scenario can set.
const BYTES: u8 = 4;

/// `record`: writes the actions of the session to a file as a scenario.
pub(super) fn record(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("the name of a file is missing: record session.toml".into());
    }
    let sentence = |failure: VerbFailure| failure.sentence();
    for file in &shell.snapshot_writer.protected_files {
        output::check_input_not_overwritten(file, &[RequestedOutput::new("record", args)]).map_err(sentence)?;
    }
    let (text, lost) = shell.recording();
    if output::is_stdout(args) {
        out.push_str(&text);
    } else {
        output::write_files(&[(args, text.as_bytes())]).map_err(sentence)?;
    }
    if lost > 0 {
        output::print_to_stderr(&format!(
            "note: {lost} action(s) cannot be expressed in a scenario; they are comments in {args}\n"
        ));
    }
    Ok(())
}

impl DebugShell {
    /// Returns the actions up to now as a scenario, and the number of those that a scenario cannot express.
    fn recording(&self) -> (String, usize) {
        let chip = self.session.scope.chip();
        let clocks = self.session.clock().clocks_per_cycle.max(1);
        let now = self.session.machine().cycle();
        let tick = |at: CycleTime| at.cycle.saturating_mul(clocks.into()).saturating_add(at.phase.into());
        let mut recorder = Recorder::new(Some(clocks));
        recorder.mcu = Some(chip.name.to_owned());
        // The image of a ladder program has another name than the program.
        let name = self.file.rsplit(['/', '\\']).next().unwrap_or(&self.file);
        recorder.program = (self.view.is_none() && self.file != "-").then(|| name.to_owned());
        // In the order in which they were queued: the supply before the pins.
        let mut queued = self.queued_drives.clone();
        queued.sort_by_key(|drive| (drive.at, drive.pin().is_some()));
        for drive in queued.iter().filter(|drive| drive.at <= CycleTime::at(now)) {
            recorder.push(tick(drive.at), recorded_drive(chip, drive));
        }
        let mut lost = 0;
        if let Some((file, cycle)) = &self.loaded {
            recorder.push(tick(CycleTime::at(*cycle)), RecordedAction::Other(format!("load {file}")));
            lost = 1;
        }
        for TimedAction { cycle, action } in self.session.input_events().filter(|event| event.cycle <= now) {
            let (at, recorded) = match action {
                UserAction::Drive(drive) => (drive.at.max(CycleTime::at(cycle)), recorded_drive(chip, drive)),
                UserAction::Reset(ResetCause::PowerOn) => (CycleTime::at(cycle), RecordedAction::PowerCycle),
                UserAction::Reset(why) => (CycleTime::at(cycle), RecordedAction::Other(format!("reset: {why:?}"))),
                UserAction::Set(place, value) => (CycleTime::at(cycle), recorded_set(chip, *place, *value)),
            };
            lost += usize::from(matches!(recorded, RecordedAction::Other(_)));
            recorder.push(tick(at), recorded);
        }
        (recorder.write(tick(CycleTime::at(now))), lost)
    }
}

/// Converts a drive to a recorded action, with the values of `--set`.
fn recorded_drive(chip: &Chip, drive: &TimedDrive) -> RecordedAction {
    let (pin, value) = match drive.drive {
        ExternalDrive::Level(pin, level) => {
            let value = match level {
                PinLevel::Low => ScenarioValue::Number(0),
                PinLevel::High => ScenarioValue::Number(1),
                PinLevel::Float => ScenarioValue::Text("z".to_owned()),
                PinLevel::PullUp => ScenarioValue::Text("pullup".to_owned()),
                PinLevel::PullDown => ScenarioValue::Text("pulldown".to_owned()),
            };
            (Some(pin), value)
        }
        ExternalDrive::Volts(pin, millivolts) => (Some(pin), ScenarioValue::Text(format!("{millivolts}mV"))),
        ExternalDrive::Counts(pin, count) => (Some(pin), ScenarioValue::Text(format!("{count}counts"))),
        ExternalDrive::Supply(millivolts) => (None, ScenarioValue::Text(format!("{millivolts}mV"))),
    };
    let name = match pin {
        Some(pin) => chip.pins.get(usize::from(pin)).map_or("", |pin| pin.name),
        None => supply_name(chip),
    };
    RecordedAction::Set(name.to_owned(), value)
}

/// Converts a changed place to a recorded action. A scenario can set memory whose addresses count bytes, and
/// pins; other places become comments.
fn recorded_set(chip: &Chip, place: ExpressionPlace, value: i64) -> RecordedAction {
    match place {
        ExpressionPlace::Memory { space, addr, bytes, .. }
            if chip.bytes_per_address(space) == 1 && (1..=BYTES).contains(&bytes) =>
        {
            let end = addr.saturating_add(bytes.into());
            let name =
                if bytes == 1 { format!("{space}:0x{addr:x}") } else { format!("{space}:0x{addr:x}..0x{end:x}") };
            RecordedAction::Set(name, ScenarioValue::Number(value))
        }
        ExpressionPlace::Pin(pin) => {
            let level = ExternalDrive::Level(pin, PinLevel::from_bit(value != 0));
            recorded_drive(chip, &TimedDrive { at: CycleTime::default(), drive: level })
        }
        ExpressionPlace::Reg(name) => RecordedAction::Other(format!("set {name} = {value}")),
        ExpressionPlace::RegBit { name, bit } => RecordedAction::Other(format!("set {name}.{bit} = {value}")),
        ExpressionPlace::Bit { space, addr, bit } => {
            RecordedAction::Other(format!("set {space}:0x{addr:x}.{bit} = {value}"))
        }
        ExpressionPlace::Pc => RecordedAction::Other(format!("set $pc = 0x{value:x}")),
        ExpressionPlace::Memory { space, addr, .. } => {
            RecordedAction::Other(format!("set {space}:0x{addr:x} = {value}"))
        }
        ExpressionPlace::Cycle | ExpressionPlace::Instructions => RecordedAction::Other(format!("set time = {value}")),
    }
}
