//! `record`: what was done to the machine from outside, as a scenario that does it again.

use emu_core::chip::Chip;
use emu_core::cpu::Reset;
use emu_core::pins::{Level, Time};
use emu_debug::Drive;
use emu_debug::debug::{Action, Place};
use emu_debug::stimulus::{Put, supply_name};
use scenario::{Done as Deed, Recorder, Value};

use super::shell::{Done, Shell};
use crate::fail::Failure;
use crate::output;

/// Bytes of the widest number in memory that a scenario sets.
const BYTES: u8 = 4;

pub(super) fn record(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if args.is_empty() {
        return Err("the name of a file is missing: record session.toml".to_owned());
    }
    let words = |failure: Failure| failure.sentence();
    for file in &shell.shelf.taken {
        output::spares(file, &[("record", args)]).map_err(words)?;
    }
    let (text, lost) = shell.recording();
    if output::is_stdout(args) {
        out.push_str(&text);
    } else {
        output::files(&[(args, text.as_bytes())]).map_err(words)?;
    }
    if lost > 0 {
        output::tell(&format!("note: {lost} thing(s) were done that no scenario does; they are comments in {args}\n"));
    }
    Ok(())
}

impl Shell {
    /// What was done up to now, as a scenario, and how much of it has no such form.
    fn recording(&self) -> (String, usize) {
        let chip = self.session.scope.chip();
        let clocks = self.session.clock().clocks_per_cycle.max(1);
        let now = self.session.target().cycle();
        let tick = |at: Time| at.cycle.saturating_mul(clocks.into()).saturating_add(at.phase.into());
        let mut recorder = Recorder::new(Some(clocks));
        recorder.mcu = Some(chip.name.to_owned());
        // What a ladder program becomes has another name.
        let name = self.file.rsplit(['/', '\\']).next().unwrap_or(&self.file);
        recorder.program = (self.view.is_none() && self.file != "-").then(|| name.to_owned());
        // As they were queued: the supply before the pins.
        let mut queued = self.queued_drives.clone();
        queued.sort_by_key(|drive| (drive.at, drive.pin().is_some()));
        for drive in queued.iter().filter(|drive| drive.at <= Time::at(now)) {
            recorder.push(tick(drive.at), driven(chip, drive));
        }
        let mut lost = 0;
        if let Some((file, cycle)) = &self.loaded {
            recorder.push(tick(Time::at(*cycle)), Deed::Other(format!("load {file}")));
            lost = 1;
        }
        for (cycle, action) in self.session.deeds().filter(|(cycle, _)| *cycle <= now) {
            let (at, deed) = match action {
                Action::Drive(drive) => (drive.at.max(Time::at(cycle)), driven(chip, drive)),
                Action::Reset(Reset::PowerOn) => (Time::at(cycle), Deed::PowerCycle),
                Action::Reset(why) => (Time::at(cycle), Deed::Other(format!("reset: {why:?}"))),
                Action::Set(place, value) => (Time::at(cycle), set(chip, *place, *value)),
            };
            lost += usize::from(matches!(deed, Deed::Other(_)));
            recorder.push(tick(at), deed);
        }
        (recorder.write(tick(Time::at(now))), lost)
    }
}

/// What a drive does, in the words of `--set`.
fn driven(chip: &Chip, drive: &Drive) -> Deed {
    let (pin, value) = match drive.put {
        Put::Level(pin, level) => {
            let value = match level {
                Level::Low => Value::Number(0),
                Level::High => Value::Number(1),
                Level::Float => Value::Text("z".to_owned()),
                Level::PullUp => Value::Text("pullup".to_owned()),
                Level::PullDown => Value::Text("pulldown".to_owned()),
            };
            (Some(pin), value)
        }
        Put::Volts(pin, millivolts) => (Some(pin), Value::Text(format!("{millivolts}mV"))),
        Put::Counts(pin, count) => (Some(pin), Value::Text(format!("{count}counts"))),
        Put::Supply(millivolts) => (None, Value::Text(format!("{millivolts}mV"))),
    };
    let name = match pin {
        Some(pin) => chip.pins.get(usize::from(pin)).map_or("", |pin| pin.name),
        None => supply_name(chip),
    };
    Deed::Set(name.to_owned(), value)
}

/// Another value of a place: of memory, where its addresses count bytes, as a scenario sets it.
fn set(chip: &Chip, place: Place, value: i64) -> Deed {
    match place {
        Place::Memory { space, addr, bytes, .. } if chip.width(space) == 1 && (1..=BYTES).contains(&bytes) => {
            let end = addr.saturating_add(bytes.into());
            let name =
                if bytes == 1 { format!("{space}:0x{addr:x}") } else { format!("{space}:0x{addr:x}..0x{end:x}") };
            Deed::Set(name, Value::Number(value))
        }
        Place::Pin(pin) => {
            let level = Put::Level(pin, Level::of(value != 0));
            driven(chip, &Drive { at: Time::default(), put: level })
        }
        Place::Reg(name) => Deed::Other(format!("set {name} = {value}")),
        Place::RegBit { name, bit } => Deed::Other(format!("set {name}.{bit} = {value}")),
        Place::Bit { space, addr, bit } => Deed::Other(format!("set {space}:0x{addr:x}.{bit} = {value}")),
        Place::Pc => Deed::Other(format!("set $pc = 0x{value:x}")),
        Place::Memory { space, addr, .. } => Deed::Other(format!("set {space}:0x{addr:x} = {value}")),
        Place::Cycle | Place::Instructions => Deed::Other(format!("set time = {value}")),
    }
}
