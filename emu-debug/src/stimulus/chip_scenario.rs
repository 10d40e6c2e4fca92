//! Scenarios on a chip with its image: names are pins, the supply, or memory locations. A tick is a clock of
//! the oscillator.

use crate::serial_sender::TimedText;
use emu_core::ChipPin;
use std::collections::HashMap;

use diag::{Diagnostic, Severity};
use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{CycleTime, PinId, PinLevel};
use scenario::{
    NameResolver, OutputReading, Scenario, ScenarioError, ScenarioInput, ScenarioOutput, ScenarioValue, TimeScale,
    TimedStimulus, bind,
};

use crate::stimulus::serial_sender::SerialLineSender;
use crate::stimulus::{ExternalDrive, TimedDrive, find_pin, missing_pin_reason, parse_drive, supply_name};
use crate::{AddressNames, CycleClock, InputError};

/// Maximum size in bytes of a memory location that is one number.
const MAX_NUMBER_BYTES: u32 = 4;

/// A stimulus with its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChipStimulus {
    /// A drive from outside.
    Drive(ExternalDrive),
    /// Bytes written to a memory, from an address on.
    Poke(&'static str, u32, Vec<u8>),
}

/// Something that a scenario can observe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChipObservable {
    /// A pin.
    Pin(PinId),
    /// Bytes of a memory, the lowest first: memory, first address, number of bytes.
    Memory(&'static str, u32, u32),
}

/// Resolves the names of scenarios for a chip with an image.
pub struct ChipResolver<'a> {
    /// The chip, and the symbols of the image.
    pub names: AddressNames<'a>,
    /// The oscillator clock.
    pub clock: CycleClock,
    /// Returns true if the machine has a byte at an address of a memory.
    pub has_byte: &'a dyn Fn(&str, u32) -> bool,
    /// Returns true if the machine, as configured, has a pin.
    pub has_pin: &'a dyn Fn(PinId) -> bool,
    /// Checks that the machine accepts a drive.
    pub check_drive: &'a dyn Fn(ExternalDrive) -> Result<(), InputError>,
    /// Converts another name of a pin to the name in the chip row; other text is unchanged.
    pub canonical_pin_name: &'a dyn Fn(&str) -> String,
    /// Whether the chip has a serial port, and the pin at which it receives.
    pub serial: (bool, Option<PinId>),
    /// Why snapshots cannot be written, if they cannot.
    pub no_snapshots: Option<String>,
    /// Why bytes cannot be sent, if they cannot.
    pub no_serial_input: Option<String>,
    /// The names resolved so far.
    pub bindings: ChipBindings,
}

/// Resolved names.
#[derive(Debug, Clone, Default)]
pub struct ChipBindings {
    /// Each stimulus with its name and value as written.
    pub stimuli: Vec<(ChipStimulus, String, ScenarioValue)>,
    /// Positions of stimuli, by name and value as written.
    known: HashMap<(String, String), usize>,
    /// Observables.
    pub observables: Vec<ChipObservable>,
}

impl ChipBindings {
    /// Returns true if this input is a drive from outside and not a write to memory.
    #[must_use]
    pub fn is_external_drive(&self, input: usize) -> bool {
        !matches!(self.stimuli.get(input), Some((ChipStimulus::Poke(..), ..)))
    }
}

/// A memory location that is one number.
#[derive(Debug, Clone, Copy)]
struct MemoryNumber {
    /// The memory.
    space: &'static str,
    /// The first byte address.
    addr: u32,
    /// The number of bytes.
    bytes: u32,
}

impl ChipResolver<'_> {
    fn chip(&self) -> &'static Chip {
        self.names.chip
    }

    /// Returns the name as the chip knows it.
    fn canonical_name(&self, name: &str) -> String {
        (self.canonical_pin_name)(&self.names.replace_channel_name(name))
    }

    /// Resolves a memory location that is one number: the memory, its first byte address and its bytes.
    fn resolve_memory(&self, name: &str) -> Result<MemoryNumber, InputError> {
        let range = self.names.parse_range(name)?;
        let width = self.chip().bytes_per_address(range.space);
        let bytes = (range.end - range.start).saturating_mul(width);
        if bytes > MAX_NUMBER_BYTES {
            return Err(InputError::NumberTooWide { name: name.to_owned(), bytes, most: MAX_NUMBER_BYTES });
        }
        let addr = range.start.saturating_mul(width);
        match (addr..addr + bytes).find(|&addr| !(self.has_byte)(range.space, addr)) {
            Some(addr) => Err(InputError::NothingAt { chip: self.chip().name, space: range.space, addr }),
            None => Ok(MemoryNumber { space: range.space, addr, bytes }),
        }
    }

    fn is_supply(&self, name: &str) -> bool {
        ["VDD", "VCC"].iter().any(|supply| name.eq_ignore_ascii_case(supply)) && self.chip().pin(name).is_none()
    }

    fn no_serial_port(&self) -> ScenarioError {
        ScenarioError::Refused(InputError::NoSerialPort { chip: self.chip().name }.into())
    }

    /// Returns the error for a name that is neither a pin nor a memory location.
    fn unknown_name_error(&self, name: &str, memory: InputError) -> ScenarioError {
        let why = match name.contains(':') {
            true => memory,
            false => InputError::UnknownName { name: name.to_owned(), chip: self.chip().name },
        };
        ScenarioError::UnknownName(why.into())
    }
}

impl NameResolver for ChipResolver<'_> {
    fn time_scale(&self) -> TimeScale {
        TimeScale::for_clocks(self.clock.hz, self.clock.clocks_per_cycle)
    }

    fn canonical_name(&self, name: &str) -> String {
        let pin = find_pin(self.chip(), &self.canonical_name(name))
            .ok()
            .and_then(|pin| self.chip().pins.get(usize::from(pin)));
        match (pin, self.resolve_memory(name)) {
            (Some(pin), _) => pin.name.to_owned(),
            (None, Ok(MemoryNumber { space, addr, bytes })) => format!("{space}:{addr}..{bytes}"),
            (None, Err(_)) => name.to_owned(),
        }
    }

    fn resolve_input(&mut self, name: &str, value: &ScenarioValue) -> Result<ScenarioInput, ScenarioError> {
        let key = (name.to_owned(), format!("{value:?}"));
        if let Some(&id) = self.bindings.known.get(&key) {
            return Ok(ScenarioInput { id, can_be_queued: self.bindings.is_external_drive(id) });
        }
        let pin_name = self.canonical_name(name);
        let parse_stimulus = || {
            let drive = parse_drive(self.chip(), &format!("{pin_name}={value}"))?;
            (self.check_drive)(drive).map(|()| ChipStimulus::Drive(drive))
        };
        let stimulus = if self.is_supply(&pin_name) {
            parse_stimulus().map_err(|why| ScenarioError::ImpossibleValue(why.into()))?
        } else if let Ok(pin) = find_pin(self.chip(), &pin_name) {
            if !(self.has_pin)(pin) {
                return Err(ScenarioError::UnknownName(missing_pin_reason(self.chip(), pin).into()));
            }
            parse_stimulus().map_err(|why| ScenarioError::ImpossibleValue(why.into()))?
        } else {
            let MemoryNumber { space, addr, bytes } =
                self.resolve_memory(name).map_err(|why| self.unknown_name_error(name, why))?;
            let (low, high) = (-(1i64 << (8 * bytes - 1)), (1i64 << (8 * bytes)) - 1);
            let ScenarioValue::Number(number) = value else {
                return Err(ScenarioError::ImpossibleValue(
                    InputError::NumberWanted { name: name.to_owned(), value: value.to_string() }.into(),
                ));
            };
            if !(low..=high).contains(number) {
                let why = InputError::NumberOutOfRange { name: name.to_owned(), low, high, value: *number };
                return Err(ScenarioError::ImpossibleValue(why.into()));
            }
            let bytes = number.to_le_bytes().into_iter().take(bytes as usize).collect();
            ChipStimulus::Poke(space, addr, bytes)
        };
        let id = self.bindings.stimuli.len();
        self.bindings.stimuli.push((stimulus, name.to_owned(), value.clone()));
        self.bindings.known.insert(key, id);
        Ok(ScenarioInput { id, can_be_queued: self.bindings.is_external_drive(id) })
    }

    fn resolve_output(&mut self, name: &str) -> Result<ScenarioOutput, ScenarioError> {
        let pin_name = self.canonical_name(name);
        let (observable, range) = match find_pin(self.chip(), &pin_name) {
            Ok(pin) if (self.has_pin)(pin) => (ChipObservable::Pin(pin), (0, 1)),
            Ok(pin) => return Err(ScenarioError::UnknownName(missing_pin_reason(self.chip(), pin).into())),
            Err(_) if self.is_supply(&pin_name) => {
                return Err(ScenarioError::Refused(InputError::SupplyIsNotReadable { name: pin_name }.into()));
            }
            Err(_) => {
                let MemoryNumber { space, addr, bytes } =
                    self.resolve_memory(name).map_err(|why| self.unknown_name_error(name, why))?;
                (ChipObservable::Memory(space, addr, bytes), (0, (1 << (8 * bytes)) - 1))
            }
        };
        self.bindings.observables.push(observable);
        Ok(ScenarioOutput {
            id: self.bindings.observables.len() - 1,
            range,
            can_float: matches!(observable, ChipObservable::Pin(_)),
        })
    }

    fn known_names(&self) -> Vec<String> {
        let pins = self.chip().present_pins().map(|ChipPin { def: pin, .. }| pin.name.to_owned());
        let symbols = self.names.symbols.iter().map(|symbol| symbol.name.clone());
        pins.chain(symbols).chain([supply_name(self.chip()).to_owned()]).collect()
    }

    fn check_can_send(&mut self) -> Result<(), ScenarioError> {
        match (&self.no_serial_input, self.serial.1) {
            (Some(why), _) => Err(ScenarioError::Refused(why.clone().into())),
            (None, Some(_)) => Ok(()),
            (None, None) => Err(self.no_serial_port()),
        }
    }

    fn check_baud_rate(&self, baud: u64) -> Result<(), ScenarioError> {
        SerialLineSender::check_baud_rate(baud).map_err(|why| ScenarioError::Refused(why.into()))
    }

    fn check_can_receive(&mut self) -> Result<(), ScenarioError> {
        if self.serial.0 { Ok(()) } else { Err(self.no_serial_port()) }
    }

    fn check_can_snapshot(&mut self) -> Result<(), ScenarioError> {
        self.no_snapshots.clone().map_or(Ok(()), |why| Err(ScenarioError::Refused(why.into())))
    }

    fn check_can_power_cycle(&mut self) -> Result<(), ScenarioError> {
        Ok(())
    }
}

impl ChipObservable {
    /// Returns the current value.
    #[must_use]
    pub fn read<C: Cpu>(self, cpu: &C) -> OutputReading {
        match self {
            ChipObservable::Pin(pin) => match cpu.pin_level(pin) {
                PinLevel::Low => OutputReading::Value(0),
                PinLevel::High => OutputReading::Value(1),
                PinLevel::Float | PinLevel::PullUp | PinLevel::PullDown => OutputReading::Floating,
            },
            ChipObservable::Memory(space, addr, bytes) => {
                let byte = |n: u32| i64::from(cpu.peek(space, addr + n).unwrap_or(0)) << (8 * n);
                OutputReading::Value((0..bytes).map(byte).fold(0, |all, byte| all | byte))
            }
        }
    }
}

/// Returns the stimuli of a scenario as drives at fixed times, in order of time, for a debugger, which runs
/// the machine itself. `program` is the image, if it has a name; `baud` is the rate of sent bytes, unless the
/// scenario gives another.
///
/// # Errors
/// The scenario does not fit the machine, or has steps that are not stimuli at fixed times (wait, expect,
/// power-cycle, ..).
pub fn timed_drives(
    scenario: &Scenario,
    resolver: &mut ChipResolver<'_>,
    program: Option<&str>,
    baud: u64,
) -> Result<Vec<TimedDrive>, Vec<Diagnostic>> {
    let mcu = resolver.names.chip.name;
    let bound = bind(scenario, resolver, program, Some(mcu))?;
    bound.require_external_stimuli(&|id| resolver.bindings.is_external_drive(id))?;
    let baud = bound.baud.unwrap_or(baud);
    let refuse = |error: InputError| {
        let pos = scenario.steps.first().map_or(Default::default(), |step| step.pos);
        let hint = "use `emu run --scenario`";
        vec![Diagnostic::new(Severity::Error, scenario::NOT_TIMED, &scenario.file, pos, error.to_string(), hint)]
    };
    let clocks = u64::from(resolver.clock.clocks_per_cycle.max(1));
    let (mut out, mut texts) = (Vec::new(), Vec::new());
    for (tick, stimulus) in bound.into_timed_stimuli()? {
        let at = CycleTime { cycle: tick / clocks, phase: (tick % clocks) as u8 };
        match stimulus {
            TimedStimulus::SetInput(id) => {
                // Other stimuli were refused above.
                if let Some((ChipStimulus::Drive(drive), ..)) = resolver.bindings.stimuli.get(id) {
                    out.push(TimedDrive { at, drive: *drive });
                }
            }
            TimedStimulus::Send(bytes) => texts.push(TimedText { at, bytes }),
        }
    }
    if let Some(pin) = resolver.serial.1.filter(|_| !texts.is_empty()) {
        let edges = SerialLineSender::new(pin, baud).and_then(|sender| sender.edges_of_texts(resolver.clock, &texts));
        out.extend(edges.map_err(refuse)?);
    }
    out.sort_by_key(|drive| drive.at);
    Ok(out)
}
