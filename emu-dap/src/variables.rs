//! Scopes and variables: registers, the ladder program's symbols, the program's, pins, registers of the chip, memory.

use std::borrow::Cow;

use emu_core::image::SymbolAt;
use emu_core::pins::{Level, PinId};
use emu_debug::debug::{Cell, Expr, ObjectExpr, Place};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{Adapter, Machine};
use crate::locals;
use crate::wire::{Request, Wrong};

const REGISTERS: i64 = 1;
const LADDER: i64 = 2;
const SYMBOLS: i64 = 3;
const PINS: i64 = 4;
const CHIP: i64 = 5;
const MEMORY: i64 = 6;
/// The first of the memories.
const SPACES: i64 = 100;

/// Bytes in a row of memory.
const ROW: u32 = 16;

/// Most variables in one answer; a client that wants more asks by start and count.
const MOST: usize = 4096;

#[derive(Default, Deserialize)]
#[serde(default)]
struct Format {
    hex: bool,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Arguments {
    frame_id: Option<i64>,
    variables_reference: i64,
    start: Option<usize>,
    count: Option<usize>,
    filter: Option<String>,
    format: Format,
    name: String,
    value: String,
}

/// Something with a name and a value.
pub(crate) struct Variable {
    pub name: String,
    pub value: String,
    /// What an expression calls it.
    pub text: String,
    pub kind: Cow<'static, str>,
    /// Where it lies, if in memory.
    pub memory: Option<String>,
    /// The reference by which its parts are asked for; 0 where it has none.
    pub parts: i64,
}

impl Variable {
    fn told(&self) -> Value {
        let mut told =
            json!({ "name": self.name, "value": self.value, "type": self.kind, "variablesReference": self.parts });
        if !self.text.is_empty() {
            told["evaluateName"] = self.text.as_str().into();
        }
        if let Some(memory) = &self.memory {
            told["memoryReference"] = memory.as_str().into();
        }
        told
    }
}

impl Adapter<'_> {
    pub(crate) fn scopes(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Arguments { frame_id, .. } = request.arguments()?;
        let level = self.frame(frame_id)?;
        let machine = self.machine()?;
        let chip = machine.session.scope.chip();
        let scope = |name: &str, number: i64, costly: bool| json!({ "name": name, "variablesReference": number, "expensive": costly });
        let mut scopes = Vec::new();
        if machine.ladder.is_some() {
            scopes.push(scope("Ladder", LADDER, false));
        }
        scopes.extend(locals::scopes(machine, level));
        let mut registers = scope("Registers", REGISTERS, false);
        registers["presentationHint"] = "registers".into();
        scopes.push(registers);
        if !machine.objects().is_empty() {
            scopes.push(scope("Symbols", SYMBOLS, true));
        }
        if !chip.pins.is_empty() {
            scopes.push(scope("Pins", PINS, true));
        }
        if !chip.regs.is_empty() {
            scopes.push(scope("Chip registers", CHIP, true));
        }
        scopes.push(scope("Memory", MEMORY, true));
        Ok(json!({ "scopes": scopes }))
    }

    pub(crate) fn variables(&mut self, request: &Request) -> Result<Value, Wrong> {
        let arguments: Arguments = request.arguments()?;
        let machine = self.machine()?;
        let from = arguments.start.unwrap_or(0);
        let count = arguments.count.filter(|count| *count > 0).unwrap_or(MOST).min(MOST);
        let told: Vec<Value> = match arguments.variables_reference {
            MEMORY => machine.memories().into_iter().skip(from).take(count).collect(),
            number if arguments.filter.as_deref() == Some("named") && number >= SPACES => Vec::new(),
            number => {
                let found = machine.inside(number, arguments.format.hex, from, count);
                let found = found.ok_or_else(|| Wrong::nothing(format!("there are no variables {number}")))?;
                found.iter().map(Variable::told).collect()
            }
        };
        Ok(json!({ "variables": told }))
    }

    pub(crate) fn set_variable(&mut self, request: &Request) -> Result<Value, Wrong> {
        let arguments: Arguments = request.arguments()?;
        let (number, name) = (arguments.variables_reference, &arguments.name);
        if number == PINS {
            self.drive(&format!("{name}={}", arguments.value.trim()))?;
        } else if let Some(object) = locals::object(self.machine()?, number, name) {
            self.assign_to(&Expr::Object(Box::new(object)), &arguments.value, 0)?;
        } else {
            let machine = self.machine()?;
            let text = machine.evaluated_as(number, name);
            let text = text.ok_or_else(|| Wrong::nothing(format!("there is no variable `{name}` that can be set")))?;
            self.assign(&text, &arguments.value, 0)?;
        }
        self.changed();
        let machine = self.machine()?;
        let found = machine.inside(number, arguments.format.hex, 0, MOST).unwrap_or_default();
        let value = found.into_iter().find(|variable| variable.name == *name).map(|variable| variable.value);
        Ok(json!({ "value": value.unwrap_or_default() }))
    }

    /// Gives a place another value; both are expressions.
    pub(crate) fn assign(&mut self, text: &str, value: &str, level: usize) -> Result<(), Wrong> {
        let machine = self.machine()?;
        // An input of a ladder program is its pin: the memory where it is latched is written anew by every scan.
        let own = machine.own_pin(text);
        if own != text {
            return self.drive(&format!("{own}={}", value.trim()));
        }
        let expr = machine.expr(text, level)?;
        if let Some(Place::Pin(pin)) = expr.place(machine.session.target()) {
            let name = machine.session.scope.chip().pins.get(usize::from(pin)).map_or("", |def| def.name);
            return self.drive(&format!("{name}={}", value.trim()));
        }
        self.assign_to(&expr, value, level)
    }

    fn assign_to(&mut self, expr: &Expr, value: &str, level: usize) -> Result<(), Wrong> {
        let machine = self.machine()?;
        let given = machine.expr(value, level)?.amount(machine.session.target());
        let given = given.ok_or_else(|| Wrong::cannot(format!("`{value}` has no value now")))?;
        machine.assign(expr, given)
    }

    /// Tells a client that understands it to look at everything anew.
    pub(crate) fn changed(&mut self) {
        if self.client.supports_invalidated_event {
            self.event("invalidated", json!({ "areas": ["all"] }));
        }
    }
}

impl Machine {
    /// `Xstart=1` as `PD2=1`, where a ladder program has such an input.
    pub fn own_pin(&self, text: &str) -> String {
        self.ladder.as_ref().map_or_else(|| text.to_owned(), |ladder| ladder.view().own_pin(text))
    }

    /// Reads an expression in the frame at a level.
    pub fn expr(&self, text: &str, level: usize) -> Result<Expr, Wrong> {
        self.session.scope.expr_in(text, self.session.target(), level).map_err(Wrong::nothing)
    }

    /// The place of the first byte of an object, as `readMemory` takes it.
    pub fn memory_of(&self, object: &ObjectExpr) -> Option<String> {
        match object.cells(self.session.target()).first() {
            Some(Cell::Memory(space, addr)) => Some(self.memory_reference(space, *addr)),
            _ => None,
        }
    }

    /// What an expression calls a variable.
    pub fn evaluated_as(&self, container: i64, name: &str) -> Option<String> {
        let found = self.inside(container, false, 0, usize::MAX)?;
        found.into_iter().find(|variable| variable.name == name && !variable.text.is_empty()).map(|found| found.text)
    }

    /// The value of a place as text; by default as what it is looked at most.
    pub fn shown(&self, place: Place, hex: bool) -> String {
        let target = self.session.target();
        let Some(value) = place.value(target) else { return "none".to_owned() };
        let digits = match place {
            Place::Memory { bytes, .. } => 2 * usize::from(bytes),
            Place::Reg(_) | Place::Pc => 2,
            _ => 1,
        };
        match place {
            Place::Pc => format!("0x{value:04x}"),
            Place::Reg(_) => format!("0x{value:02x}"),
            Place::Memory { bytes, .. } if hex => {
                let unused = 64 - 8 * u32::from(bytes.clamp(1, 4));
                format!("0x{:0digits$x}", (value as u64) << unused >> unused)
            }
            _ if hex => format!("0x{value:x}"),
            _ => value.to_string(),
        }
    }

    /// Symbols of the program in RAM.
    fn objects(&self) -> Vec<&SymbolAt> {
        let scope = &self.session.scope;
        let mut found: Vec<&SymbolAt> =
            scope.symbols.iter().filter(|s| s.space == scope.chip().ram && s.size > 0).collect();
        found.sort_by(|a, b| a.name.cmp(&b.name));
        found.dedup_by(|a, b| a.name == b.name);
        found
    }

    /// The variables of a container; nothing where there is no such.
    fn inside(&self, container: i64, hex: bool, from: usize, count: usize) -> Option<Vec<Variable>> {
        let all = match container {
            REGISTERS => self.registers(),
            LADDER => self.symbols_of_ladder(hex),
            SYMBOLS => self.objects().into_iter().map(|symbol| self.object(symbol, hex)).collect(),
            PINS => self.pins(),
            CHIP => self.chip_registers(),
            _ if container >= locals::SCOPES => locals::inside(self, container, hex)?,
            _ => {
                let space = usize::try_from(container.checked_sub(SPACES)?).ok()?;
                return self.rows(space, from, count);
            }
        };
        Some(all.into_iter().skip(from).take(count).collect())
    }

    fn registers(&self) -> Vec<Variable> {
        let (session, chip) = (&self.session, self.session.scope.chip());
        let own = |name: &str, place: Place| Variable {
            name: name.to_owned(),
            value: self.shown(place, false),
            text: format!("${name}"),
            kind: "register".into(),
            memory: None,
            parts: 0,
        };
        let mut found = Vec::new();
        if !chip.cpu_regs.contains(&"PC") {
            found.push(own("PC", Place::Pc));
        }
        found.extend(chip.cpu_regs.iter().map(|name| match *name {
            "PC" => own(name, Place::Pc),
            _ => own(name, Place::Reg(name)),
        }));
        found.push(own("cycle", Place::Cycle));
        found.push(own("instructions", Place::Instructions));
        let told = |name: &str, value: String| Variable {
            name: name.to_owned(),
            value,
            text: String::new(),
            kind: "time".into(),
            memory: None,
            parts: 0,
        };
        found.push(told("time", format!("{:.9} s", session.clock().seconds(session.target().cycle()))));
        if let Some(scan) = session.scan() {
            found.push(told("scan", scan.to_string()));
        }
        found
    }

    fn symbols_of_ladder(&self, hex: bool) -> Vec<Variable> {
        let symbols = self.session.scope.ladder.iter();
        let variable = |(name, place): &(String, Place)| {
            let (kind, memory) = match *place {
                Place::Memory { space, addr, .. } => ("integer", Some(self.memory_reference(space, addr))),
                _ => ("bit", None),
            };
            Variable {
                name: name.clone(),
                value: self.shown(*place, hex),
                text: name.clone(),
                kind: kind.into(),
                memory,
                parts: 0,
            }
        };
        symbols.map(variable).collect()
    }

    fn object(&self, symbol: &SymbolAt, hex: bool) -> Variable {
        const SHOWN: u32 = 8;
        let (space, addr, size) = (symbol.space, symbol.addr, symbol.size);
        let value = match u8::try_from(size) {
            Ok(bytes @ 1..=4) => self.shown(Place::Memory { space, addr, bytes, signed: false }, hex),
            _ => {
                let bytes = (0..size.min(SHOWN)).filter_map(|n| self.session.target().peek(space, addr + n));
                let bytes: Vec<String> = bytes.map(|byte| format!("{byte:02x}")).collect();
                format!("{}{}", bytes.join(" "), if size > SHOWN { " .." } else { "" })
            }
        };
        let text = if size <= 4 { symbol.name.clone() } else { String::new() };
        let memory = Some(self.memory_reference(space, addr));
        Variable { name: symbol.name.clone(), value, text, kind: "object".into(), memory, parts: 0 }
    }

    fn pins(&self) -> Vec<Variable> {
        let (target, chip) = (self.session.target(), self.session.scope.chip());
        let pins = (0..).zip(chip.pins).filter(|(id, _)| target.has_pin(*id as PinId));
        let level = |id| match target.level(id) {
            Level::High | Level::PullUp => "1",
            Level::Low | Level::PullDown => "0",
            Level::Float => "z",
        };
        pins.map(|(id, def)| Variable {
            name: def.name.to_owned(),
            value: level(id).to_owned(),
            text: def.name.to_owned(),
            kind: "pin".into(),
            memory: None,
            parts: 0,
        })
        .collect()
    }

    fn chip_registers(&self) -> Vec<Variable> {
        let (target, chip) = (self.session.target(), self.session.scope.chip());
        let found = chip.regs.iter().filter_map(|reg| {
            let value = target.peek(chip.reg_space, reg.addr.into())?;
            Some(Variable {
                name: reg.name.to_owned(),
                value: format!("0x{value:02x}"),
                text: format!("${}", reg.name),
                kind: "register".into(),
                memory: Some(self.memory_reference(chip.reg_space, reg.addr.into())),
                parts: 0,
            })
        });
        found.collect()
    }

    fn memories(&self) -> Vec<Value> {
        let spaces = self.session.scope.chip().spaces.iter().zip(SPACES..);
        let told = |((space, size, width), number): (&(&str, u32, u32), i64)| {
            let unit = if *width == 1 { "addresses" } else { "words" };
            json!({
                "name": space, "value": format!("{size} {unit}"), "variablesReference": number, "namedVariables": 0,
                "indexedVariables": size.saturating_mul(*width).div_ceil(ROW),
                "memoryReference": self.memory_reference(space, 0),
            })
        };
        spaces.map(told).collect()
    }

    /// Rows of a memory.
    fn rows(&self, space: usize, from: usize, count: usize) -> Option<Vec<Variable>> {
        let &(space, size, width) = self.session.scope.chip().spaces.get(space)?;
        let (rows, target) = (size.saturating_mul(width).div_ceil(ROW), self.session.target());
        let from = u32::try_from(from).unwrap_or(u32::MAX).min(rows);
        let end = from.saturating_add(u32::try_from(count).unwrap_or(u32::MAX)).min(rows);
        let row = |row: u32| {
            let bytes = (row * ROW..row * ROW + ROW).map(|at| target.peek(space, at));
            let bytes: Vec<String> = bytes.flatten().map(|byte| format!("{byte:02x}")).collect();
            Variable {
                name: format!("0x{:04x}", row * ROW / width.max(1)),
                value: bytes.join(" "),
                text: String::new(),
                kind: "bytes".into(),
                memory: Some(self.memory_reference(space, row * ROW)),
                parts: 0,
            }
        };
        Some((from..end).map(row).collect())
    }
}
