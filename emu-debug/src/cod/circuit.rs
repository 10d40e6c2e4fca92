//! The test bench: parts and nets around the chip, the names of the script, and the commands that change
//! them.

use std::collections::BTreeMap;

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{PinId, PinLevel};

use super::command::{CodCommand, CodStimulusLine};
use super::error::CodError;
use super::expr::{CodExpression, CodWorld};
use super::nets::{CodNet, NetMember};
use super::parts::wave::StimulusWave;
use super::parts::{CodPart, CodPartKind};
use super::value::CodValue;
use crate::devices::cells::SharedBytes;
use crate::names::address_names::AddressNames;

/// Register names of gpsim, and the names in data sheets.
#[rustfmt::skip]
const ALIASES: [(&str, &str); 5] = [
    ("option_reg", "OPTION"), ("option", "OPTION_REG"), ("adres", "ADRESH"), ("vrcon", "CVRCON"), ("cvrcon", "VRCON"),
];

/// Attributes for the drawing, or for the simulator itself.
const IGNORED: [&str; 4] = ["xpos", "ypos", "BreakOnReset", "WarnMode"];

/// A stimulus while it is being read.
#[derive(Debug, Clone, Default)]
struct StimulusDraft {
    wave: StimulusWave,
    name: String,
    analog: bool,
    initial: f64,
    data: Vec<f64>,
}

/// The test bench.
pub struct CodCircuit<'n> {
    /// Resolves names of the program and the chip.
    pub names: AddressNames<'n>,
    /// The nets.
    pub nets: Vec<CodNet>,
    /// The parts.
    pub parts: Vec<CodPart>,
    /// Clock of the chip in Hz.
    pub hz: u64,
    /// The cycle at which the run ends.
    pub limit: u64,
    /// The level that the outside drives on each chip pin, and its voltage in millivolts.
    pub external_levels: Vec<(PinLevel, Option<i64>)>,
    /// Two chip pins drive one net, so a change of one from output to input is not visible at a pin.
    pub shared: bool,
    /// Remarks about commands that are unusual but not wrong.
    pub warnings: Vec<String>,
    symbols: BTreeMap<String, CodValue>,
    saved_eeproms: BTreeMap<String, Vec<u8>>,
    draft: Option<StimulusDraft>,
}

impl<'n> CodCircuit<'n> {
    /// Returns an empty test bench.
    #[must_use]
    pub fn new(names: AddressNames<'n>, hz: u64, limit: u64) -> Self {
        CodCircuit {
            names,
            nets: Vec::new(),
            parts: Vec::new(),
            hz,
            limit,
            external_levels: vec![(PinLevel::Float, None); names.chip.pins.len()],
            shared: false,
            warnings: Vec::new(),
            symbols: BTreeMap::new(),
            saved_eeproms: BTreeMap::new(),
            draft: None,
        }
    }

    /// Executes a command.
    ///
    /// # Errors
    /// A name, a pin or an attribute that is unknown.
    pub fn command<C: Cpu>(&mut self, command: &CodCommand, cpu: &mut C, t: u64) -> Result<(), CodError> {
        match command {
            CodCommand::None => {}
            CodCommand::Module { kind, name } => {
                let part = CodPart::new(kind, name).ok_or_else(|| CodError::UnknownModule { kind: kind.clone() })?;
                self.add(part)?;
            }
            CodCommand::Nodes(names) => {
                for name in names {
                    self.nets.push(CodNet { name: name.clone(), members: Vec::new() });
                }
            }
            CodCommand::Attach { node, pins } => self.attach(node, pins)?,
            CodCommand::Limit(expr) => self.limit = self.limit.min(self.cycles(expr, cpu)?),
            CodCommand::Frequency(expr) => self.hz = self.cycles(expr, cpu)?.max(1),
            CodCommand::Symbol { name, value } => {
                let value = self.eval(value, cpu)?;
                self.symbols.insert(name.clone(), value);
            }
            CodCommand::Assign { name, value } => self.assign(name, value, cpu, t)?,
            CodCommand::Stimulus(line) => self.stimulus(line, cpu)?,
            CodCommand::SaveEeprom { module, file } => {
                let cells = self.eeprom(module)?.bytes();
                self.saved_eeproms.insert(file.clone(), cells);
            }
            CodCommand::LoadEeprom { module, file } => {
                let saved_cells = self
                    .saved_eeproms
                    .get(file)
                    .cloned()
                    .ok_or_else(|| CodError::NothingKept { file: file.clone() })?;
                self.eeprom(module)?.fill(&saved_cells);
            }
        }
        Ok(())
    }

    fn add(&mut self, part: CodPart) -> Result<(), CodError> {
        if self.part(&part.name).is_some() {
            return Err(CodError::DuplicatePart { name: part.name });
        }
        self.parts.push(part);
        Ok(())
    }

    fn part(&self, name: &str) -> Option<usize> {
        self.parts.iter().position(|part| part.name == name)
    }

    fn eeprom(&mut self, name: &str) -> Result<&mut SharedBytes, CodError> {
        self.parts
            .iter_mut()
            .find_map(|part| match &mut part.kind {
                CodPartKind::Eeprom(eeprom) if part.name == name => Some(&mut eeprom.cells),
                _ => None,
            })
            .ok_or_else(|| CodError::NoSuch { kind: "EEPROM", name: name.to_owned() })
    }

    fn attach(&mut self, node: &str, pins: &[String]) -> Result<(), CodError> {
        let mut members = Vec::new();
        for name in pins {
            match self.member(name) {
                Some(member) => members.push(member),
                // gpsim also continues without it.
                None if self.part(name).is_some() => {
                    self.warnings.push(format!("`{name}` is a part and no pin of one"))
                }
                None => return Err(CodError::NoSuch { kind: "pin", name: name.clone() }),
            }
        }
        let net = self.nets.iter_mut().find(|net| net.name == node);
        net.ok_or_else(|| CodError::NoSuch { kind: "node", name: node.to_owned() })?.members.extend(members);
        Ok(())
    }

    /// Finds a pin by its name: of a part (`SW1.A`), a stimulus (its name), or the chip (`portb0`, `RB0`).
    fn member(&self, name: &str) -> Option<NetMember> {
        let of_part = name.split_once('.').and_then(|(part, pin)| Some((self.part(part)?, pin)));
        if let Some((at, pin)) = of_part {
            let pins = self.parts.get(at)?.pins();
            return Some(NetMember::Part(at, pins.iter().position(|known| known.eq_ignore_ascii_case(pin))?));
        }
        if let Some(at) = self.part(name) {
            // A stimulus is a pin itself.
            let stimulus = self.parts.get(at).is_some_and(|part| matches!(part.kind, CodPartKind::Wave(_)));
            return stimulus.then_some(NetMember::Part(at, 0));
        }
        chip_pin(self.names.chip, name).map(NetMember::Pin)
    }

    /// Returns true if a stimulus was begun but not ended.
    pub fn has_unfinished_stimulus(&self) -> bool {
        self.draft.is_some()
    }

    fn stimulus<C: Cpu>(&mut self, line: &CodStimulusLine, cpu: &C) -> Result<(), CodError> {
        if *line == CodStimulusLine::Begin {
            self.draft = Some(StimulusDraft::default());
            return Ok(());
        }
        let mut draft = self.draft.take().ok_or(CodError::OutsideStimulus)?;
        match line {
            CodStimulusLine::Begin => {}
            CodStimulusLine::Initial(expr) => {
                draft.initial = self.eval(expr, cpu)?.to_real().ok_or(CodError::TextIsNo { wanted: "level" })?
            }
            CodStimulusLine::Start(expr) => draft.wave.start = self.cycles(expr, cpu)?,
            CodStimulusLine::Period(expr) => draft.wave.period = self.cycles(expr, cpu)?,
            CodStimulusLine::Name(name) => draft.name.clone_from(name),
            CodStimulusLine::Analog(analog) => draft.analog = *analog,
            CodStimulusLine::Data(values) => {
                for value in values {
                    draft.data.push(self.eval(value, cpu)?.to_real().ok_or(CodError::TextIsNo { wanted: "level" })?);
                }
            }
            CodStimulusLine::End => return self.finish(draft),
        }
        self.draft = Some(draft);
        Ok(())
    }

    /// Adds a stimulus to the bench.
    fn finish(&mut self, mut draft: StimulusDraft) -> Result<(), CodError> {
        let millivolts = |value: f64| match draft.analog {
            true => (value * 1000.0) as i64,
            false => i64::from(value > 0.0) * super::parts::SUPPLY_MILLIVOLTS,
        };
        draft.wave.initial = millivolts(draft.initial);
        draft.wave.holds_last = true;
        for pair in draft.data.chunks(2) {
            let &[cycle, value] = pair else { return Err(CodError::CycleWithoutValue) };
            // The conversion saturates.
            draft.wave.set(cycle as u64, millivolts(value));
        }
        self.add(CodPart::of(&draft.name, CodPartKind::Wave(draft.wave)))
    }

    fn assign<C: Cpu>(&mut self, name: &str, value: &CodExpression, cpu: &mut C, t: u64) -> Result<(), CodError> {
        if let Some((object, attribute)) = name.rsplit_once('.') {
            if let Some(part) = self.part(object).filter(|_| !IGNORED.contains(&attribute)) {
                let value = self.eval(value, cpu)?;
                let part = self.parts.get_mut(part);
                let assigned = part.is_some_and(|part| part.assign(attribute, &value, t, self.hz));
                return if assigned { Ok(()) } else { Err(CodError::BadAttributeValue { name: name.to_owned() }) };
            }
            if attribute == "frequency" {
                self.hz = self.cycles(value, cpu)?.max(1);
                return Ok(());
            }
            if IGNORED.contains(&attribute) || object == "scope" {
                return Ok(());
            }
            return Err(CodError::UnknownName { name: object.to_owned() });
        }
        let value = self.eval(value, cpu)?;
        if let Some(symbol) = self.symbols.get_mut(name) {
            *symbol = value;
            return Ok(());
        }
        let byte = value.to_integer().ok_or(CodError::TextIsNo { wanted: "byte" })? as u8;
        let Some(CodPlace::Byte(space, addr)) = self.place(name) else {
            let set = cpu.set_reg(&name.to_ascii_uppercase(), byte.into());
            return if set { Ok(()) } else { Err(CodError::UnknownName { name: name.to_owned() }) };
        };
        if cpu.poke(space, addr, byte) { Ok(()) } else { Err(CodError::Unwritable { name: name.to_owned() }) }
    }

    /// Evaluates an expression now.
    ///
    /// # Errors
    /// As [`CodExpression::eval`].
    pub fn eval<C: Cpu>(&self, expr: &CodExpression, cpu: &C) -> Result<CodValue, CodError> {
        expr.eval(&CodMachineView { circuit: self, cpu })
    }

    fn cycles<C: Cpu>(&self, expr: &CodExpression, cpu: &C) -> Result<u64, CodError> {
        let value = self.eval(expr, cpu)?.to_integer();
        value.and_then(|value| u64::try_from(value).ok()).ok_or(CodError::NegativeNumber)
    }

    /// Resolves a name of the program or the chip.
    fn place(&self, name: &str) -> Option<CodPlace> {
        let chip = self.names.chip;
        if let Some(addr) = super::command::address(name) {
            return Some(CodPlace::Byte(chip.ram_space, addr));
        }
        let symbol = |space: &str| self.names.symbols.iter().find(|s| s.space == space && s.name == name);
        if let Some(symbol) = symbol(chip.ram_space) {
            return Some(CodPlace::Byte(chip.ram_space, symbol.addr));
        }
        if let Some(label) = symbol(chip.code_space) {
            return Some(CodPlace::Word(label.addr / chip.word_bytes.max(1)));
        }
        let alias = ALIASES.iter().filter(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, alias)| *alias);
        let reg = std::iter::once(name).chain(alias).find_map(|name| chip.reg(name))?;
        Some(CodPlace::Byte(chip.reg_space, reg.into()))
    }
}

/// The location that a name refers to.
enum CodPlace {
    /// A byte of a memory.
    Byte(&'static str, u32),
    /// A program word.
    Word(u32),
}

/// Returns a chip pin by its own name, or as `portb0`.
fn chip_pin(chip: &Chip, name: &str) -> Option<PinId> {
    let lower = name.to_ascii_lowercase();
    let by_port = || {
        let rest = lower.strip_prefix("port")?;
        ["R", "P"].iter().find_map(|prefix| chip.pin(&format!("{prefix}{rest}")))
    };
    chip.pin(name).or_else(by_port)
}

/// The values that expressions can read.
struct CodMachineView<'a, 'n, C> {
    circuit: &'a CodCircuit<'n>,
    cpu: &'a C,
}

impl<C: Cpu> CodWorld for CodMachineView<'_, '_, C> {
    fn value(&self, name: &str) -> Result<CodValue, CodError> {
        let circuit = self.circuit;
        if name == "cycles" {
            return Ok(CodValue::Int(i64::try_from(self.cpu.cycle()).unwrap_or(i64::MAX)));
        }
        if let Some(value) = circuit.symbols.get(name) {
            return Ok(value.clone());
        }
        if let Some((object, attribute)) = name.rsplit_once('.') {
            let part = circuit.part(object).and_then(|part| circuit.parts.get(part));
            return match part.and_then(|part| part.attribute(attribute)) {
                Some(value) => Ok(value),
                None if part.is_none() && attribute == "frequency" => Ok(CodValue::Real(circuit.hz as f64)),
                None => Err(CodError::UnknownName { name: name.to_owned() }),
            };
        }
        match circuit.place(name) {
            Some(CodPlace::Byte(space, addr)) => match self.cpu.peek(space, addr) {
                Some(byte) => Ok(CodValue::Int(byte.into())),
                None => Err(CodError::Unreadable { name: name.to_owned() }),
            },
            Some(CodPlace::Word(word)) => Ok(CodValue::Int(word.into())),
            None => match self.cpu.reg(&name.to_ascii_uppercase()) {
                Some(value) => Ok(CodValue::Int(value.into())),
                None => Err(CodError::UnknownName { name: name.to_owned() }),
            },
        }
    }

    fn address(&self, name: &str) -> Result<i64, CodError> {
        match self.circuit.place(name) {
            Some(CodPlace::Byte(_, addr) | CodPlace::Word(addr)) => Ok(addr.into()),
            None => Err(CodError::UnknownName { name: name.to_owned() }),
        }
    }

    fn at(&self, addr: i64) -> Result<CodValue, CodError> {
        let chip = self.circuit.names.chip;
        let byte = u32::try_from(addr)
            .ok()
            .and_then(|addr| self.cpu.peek(chip.reg_space, addr).or_else(|| self.cpu.peek(chip.ram_space, addr)));
        byte.map(|byte| CodValue::Int(byte.into())).ok_or(CodError::NoRegisterAt { addr })
    }
}
