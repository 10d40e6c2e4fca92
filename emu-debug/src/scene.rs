//! Scenarios on a chip with its image: their names are pins, the supply, places in memory. A tick is a clock of the oscillator.

use std::collections::HashMap;

use diag::{Diagnostic, Severity};
use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{Level, PinId, Time};
use scenario::{Input, Output, Reading, Scale, Scenario, Site, Timed, Value, bind};

use crate::sender::Sender;
use crate::stimulus::{Drive, Put, lacking, pin, put, supply_name};
use crate::{Clock, Names};

/// Bytes of the widest thing in memory that is one number.
const MAX_BYTES: u32 = 4;

/// Something that can be given a value, with the value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Given {
    /// What is done from outside.
    Put(Put),
    /// Bytes of a memory, from an address of it on.
    Poke(&'static str, u32, Vec<u8>),
}

/// Something that can be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// A pin.
    Pin(PinId),
    /// Bytes of a memory, the lowest first.
    Memory(&'static str, u32, u32),
}

/// What a chip with an image offers to scenarios.
pub struct ChipSite<'a> {
    /// The chip, and the symbols of the image.
    pub names: Names<'a>,
    /// Its oscillator.
    pub clock: Clock,
    /// The machine has a byte at an address of a memory.
    pub there: &'a dyn Fn(&str, u32) -> bool,
    /// The machine has a pin, as it is configured.
    pub has_pin: &'a dyn Fn(PinId) -> bool,
    /// The machine can do it; the error is a sentence.
    pub can: &'a dyn Fn(Put) -> Result<(), String>,
    /// Another name of a pin as that of the chip's row; other text as it is.
    pub own: &'a dyn Fn(&str) -> String,
    /// The chip has a serial port, and the pin at which that receives.
    pub serial: (bool, Option<PinId>),
    /// Why no snapshots can be written, where they cannot.
    pub stateless: Option<String>,
    /// Why bytes cannot be sent, where they cannot.
    pub deaf: Option<String>,
    /// What names have become so far.
    pub table: Table,
}

/// What names have become.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Each with its name and value as they were written.
    pub given: Vec<(Given, String, Value)>,
    /// Their positions, by name and value as they were written.
    known: HashMap<(String, String), usize>,
    /// What is looked at.
    pub seen: Vec<Seen>,
}

impl Table {
    /// What this identifier of an input stands for is done from outside: it is no memory that is written.
    #[must_use]
    pub fn is_outside(&self, input: usize) -> bool {
        !matches!(self.given.get(input), Some((Given::Poke(..), ..)))
    }
}

impl ChipSite<'_> {
    fn chip(&self) -> &'static Chip {
        self.names.chip
    }

    /// The name as the chip knows it.
    fn own(&self, name: &str) -> String {
        (self.own)(&self.names.with_channel(name))
    }

    /// A place in memory that is one number: the memory, its first byte address and its bytes.
    fn memory(&self, name: &str) -> Result<(&'static str, u32, u32), String> {
        let range = self.names.range(name)?;
        let width = self.chip().width(range.space);
        let bytes = (range.end - range.start).saturating_mul(width);
        if bytes > MAX_BYTES {
            return Err(format!("`{name}` has {bytes} bytes; a number has at most {MAX_BYTES}"));
        }
        let addr = range.start.saturating_mul(width);
        match (addr..addr + bytes).find(|&addr| !(self.there)(range.space, addr)) {
            Some(addr) => Err(format!("{} has nothing at {}:0x{addr:x}", self.chip().name, range.space)),
            None => Ok((range.space, addr, bytes)),
        }
    }

    fn is_supply(&self, name: &str) -> bool {
        ["VDD", "VCC"].iter().any(|supply| name.eq_ignore_ascii_case(supply)) && self.chip().pin(name).is_none()
    }

    /// Neither a pin nor a place in memory.
    fn unknown(&self, name: &str, memory: &str) -> String {
        match name.contains(':') {
            true => memory.to_owned(),
            false => format!("`{name}` is no pin of {}, no symbol and no register", self.chip().name),
        }
    }
}

impl Site for ChipSite<'_> {
    fn scale(&self) -> Scale {
        Scale::clocks(self.clock.hz, self.clock.clocks_per_cycle)
    }

    fn same(&self, name: &str) -> String {
        let pin = pin(self.chip(), &self.own(name)).ok().and_then(|pin| self.chip().pins.get(usize::from(pin)));
        match (pin, self.memory(name)) {
            (Some(pin), _) => pin.name.to_owned(),
            (None, Ok((space, addr, bytes))) => format!("{space}:{addr}..{bytes}"),
            (None, Err(_)) => name.to_owned(),
        }
    }

    fn input(&mut self, name: &str, value: &Value) -> Result<Input, (String, bool)> {
        let key = (name.to_owned(), format!("{value:?}"));
        if let Some(&id) = self.table.known.get(&key) {
            return Ok(Input { id, ahead: self.table.is_outside(id) });
        }
        let own = self.own(name);
        let outside = || {
            let put = put(self.chip(), &format!("{own}={value}"))?;
            (self.can)(put).map(|()| Given::Put(put))
        };
        let given = if self.is_supply(&own) {
            outside().map_err(|why| (why, false))?
        } else if let Ok(pin) = pin(self.chip(), &own) {
            if !(self.has_pin)(pin) {
                return Err((lacking(self.chip(), pin), true));
            }
            outside().map_err(|why| (why, false))?
        } else {
            let (space, addr, bytes) = self.memory(name).map_err(|why| (self.unknown(name, &why), true))?;
            let (low, high) = (-(1i64 << (8 * bytes - 1)), (1i64 << (8 * bytes)) - 1);
            let Value::Number(number) = value else {
                return Err((format!("`{name}` takes a number, not `{value}`"), false));
            };
            if !(low..=high).contains(number) {
                return Err((format!("`{name}` takes {low} to {high}, not {number}"), false));
            }
            let bytes = number.to_le_bytes().into_iter().take(bytes as usize).collect();
            Given::Poke(space, addr, bytes)
        };
        let id = self.table.given.len();
        self.table.given.push((given, name.to_owned(), value.clone()));
        self.table.known.insert(key, id);
        Ok(Input { id, ahead: self.table.is_outside(id) })
    }

    fn output(&mut self, name: &str) -> Result<Output, String> {
        let own = self.own(name);
        let (seen, range) = match pin(self.chip(), &own) {
            Ok(pin) if (self.has_pin)(pin) => (Seen::Pin(pin), (0, 1)),
            Ok(pin) => return Err(lacking(self.chip(), pin)),
            Err(_) if self.is_supply(&own) => return Err(format!("{own} can be set, not looked at")),
            Err(_) => {
                let (space, addr, bytes) = self.memory(name).map_err(|why| self.unknown(name, &why))?;
                (Seen::Memory(space, addr, bytes), (0, (1 << (8 * bytes)) - 1))
            }
        };
        self.table.seen.push(seen);
        Ok(Output { id: self.table.seen.len() - 1, range, floats: matches!(seen, Seen::Pin(_)) })
    }

    fn names(&self) -> Vec<String> {
        let pins = self.chip().present_pins().map(|(_, pin)| pin.name.to_owned());
        let symbols = self.names.symbols.iter().map(|symbol| symbol.name.clone());
        pins.chain(symbols).chain([supply_name(self.chip()).to_owned()]).collect()
    }

    fn sends(&mut self) -> Result<(), String> {
        match (&self.deaf, self.serial.1) {
            (Some(why), _) => Err(why.clone()),
            (None, Some(_)) => Ok(()),
            (None, None) => Err(format!("{} has no serial port", self.chip().name)),
        }
    }

    fn rate(&self, baud: u64) -> Result<(), String> {
        Sender::possible(baud)
    }

    fn receives(&mut self) -> Result<(), String> {
        if self.serial.0 { Ok(()) } else { Err(format!("{} has no serial port", self.chip().name)) }
    }

    fn snapshots(&mut self) -> Result<(), String> {
        self.stateless.clone().map_or(Ok(()), Err)
    }

    fn power_cycles(&mut self) -> Result<(), String> {
        Ok(())
    }
}

impl Seen {
    /// What it is at.
    #[must_use]
    pub fn read<C: Cpu>(self, cpu: &C) -> Reading {
        match self {
            Seen::Pin(pin) => match cpu.level(pin) {
                Level::Low => Reading::Value(0),
                Level::High => Reading::Value(1),
                Level::Float | Level::PullUp | Level::PullDown => Reading::Floating,
            },
            Seen::Memory(space, addr, bytes) => {
                let byte = |n: u32| i64::from(cpu.peek(space, addr + n).unwrap_or(0)) << (8 * n);
                Reading::Value((0..bytes).map(byte).fold(0, |all, byte| all | byte))
            }
        }
    }
}

/// The stimuli of a scenario as drives at fixed times, in order of time, for a debugger, which runs the machine itself. `program`: the
/// image, where it has a name; `baud`: the rate of what is sent, unless the scenario says another.
///
/// # Errors
/// The scenario does not fit the machine, or has steps that are no stimuli at fixed times (wait, expect, power-cycle, ..).
pub fn drives(
    scenario: &Scenario,
    site: &mut ChipSite<'_>,
    program: Option<&str>,
    baud: u64,
) -> Result<Vec<Drive>, Vec<Diagnostic>> {
    let mcu = site.names.chip.name;
    let bound = bind(scenario, site, program, Some(mcu))?;
    bound.outside(&|id| site.table.is_outside(id))?;
    let baud = bound.baud.unwrap_or(baud);
    let refuse = |cause: String| {
        let pos = scenario.steps.first().map_or(Default::default(), |step| step.pos);
        let hint = "use `emu run --scenario`";
        vec![Diagnostic::new(Severity::Error, scenario::NOT_TIMED, &scenario.file, pos, cause, hint)]
    };
    let clocks = u64::from(site.clock.clocks_per_cycle.max(1));
    let (mut out, mut texts) = (Vec::new(), Vec::new());
    for (tick, what) in bound.timed()? {
        let at = Time { cycle: tick / clocks, phase: (tick % clocks) as u8 };
        match what {
            Timed::Put(id) => {
                // There are no others, as was seen above.
                if let Some((Given::Put(put), ..)) = site.table.given.get(id) {
                    out.push(Drive { at, put: *put });
                }
            }
            Timed::Send(bytes) => texts.push((at, bytes)),
        }
    }
    if let Some(pin) = site.serial.1.filter(|_| !texts.is_empty()) {
        let edges = Sender::new(pin, baud).and_then(|sender| sender.edges(site.clock, &texts));
        out.extend(edges.map_err(refuse)?);
    }
    out.sort_by_key(|drive| drive.at);
    Ok(out)
}
