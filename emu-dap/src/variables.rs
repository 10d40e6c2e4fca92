//! Scopes and variables: core registers, ladder symbols, symbols of the program, pins, chip registers,
//! memory.

use emu_core::chip::ChipSpace;
use std::borrow::Cow;

use emu_core::image::SymbolAt;
use emu_core::pins::{PinId, PinLevel};
use emu_debug::debug::{DebugExpression, ExpressionPlace, ObjectByteLocation, ObjectExpr};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{DapMachine, DebugAdapter};
use crate::locals;
use crate::protocol::{DapRequest, RequestError};

const REGISTERS_REFERENCE: i64 = 1;
const LADDER_REFERENCE: i64 = 2;
const SYMBOLS_REFERENCE: i64 = 3;
const PINS_REFERENCE: i64 = 4;
const CHIP_REFERENCE: i64 = 5;
const MEMORY_REFERENCE: i64 = 6;
/// The reference of the first memory.
const FIRST_SPACE_REFERENCE: i64 = 100;

/// Bytes per row of memory.
const BYTES_PER_ROW: u32 = 16;

/// Maximum number of variables per answer; a client requests more with start and count.
const MAX_VARIABLES: usize = 4096;

#[derive(Default, Deserialize)]
#[serde(default)]
struct ValueFormat {
    hex: bool,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct VariablesArguments {
    frame_id: Option<i64>,
    variables_reference: i64,
    start: Option<usize>,
    count: Option<usize>,
    filter: Option<String>,
    format: ValueFormat,
    name: String,
    value: String,
}

/// A variable of the protocol.
pub(crate) struct DapVariable {
    pub name: String,
    pub value: String,
    /// The expression for the variable.
    pub text: String,
    /// The type of the variable.
    pub kind: Cow<'static, str>,
    /// The memory reference, if the variable is in memory.
    pub memory: Option<String>,
    /// The reference of its parts; 0 if it has none.
    pub parts: i64,
}

impl DapVariable {
    fn to_json(&self) -> Value {
        let mut described =
            json!({ "name": self.name, "value": self.value, "type": self.kind, "variablesReference": self.parts });
        if !self.text.is_empty() {
            described["evaluateName"] = self.text.as_str().into();
        }
        if let Some(memory) = &self.memory {
            described["memoryReference"] = memory.as_str().into();
        }
        described
    }
}

impl DebugAdapter<'_> {
    /// Answers `scopes`: the groups of variables of a frame.
    pub(crate) fn scopes(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let VariablesArguments { frame_id, .. } = request.parse_arguments()?;
        let level = self.frame_level(frame_id)?;
        let machine = self.machine()?;
        let chip = machine.session.scope.chip();
        let scope = |name: &str, number: i64, costly: bool| json!({ "name": name, "variablesReference": number, "expensive": costly });
        let mut scopes = Vec::new();
        if machine.ladder.is_some() {
            scopes.push(scope("Ladder", LADDER_REFERENCE, false));
        }
        scopes.extend(locals::scopes(machine, level));
        let mut registers = scope("Registers", REGISTERS_REFERENCE, false);
        registers["presentationHint"] = "registers".into();
        scopes.push(registers);
        if !machine.ram_symbols().is_empty() {
            scopes.push(scope("Symbols", SYMBOLS_REFERENCE, true));
        }
        if !chip.pins.is_empty() {
            scopes.push(scope("Pins", PINS_REFERENCE, true));
        }
        if !chip.regs.is_empty() {
            scopes.push(scope("Chip registers", CHIP_REFERENCE, true));
        }
        scopes.push(scope("Memory", MEMORY_REFERENCE, true));
        Ok(json!({ "scopes": scopes }))
    }

    /// Answers `variables`: the parts of a scope or of a variable.
    pub(crate) fn variables(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let arguments: VariablesArguments = request.parse_arguments()?;
        let machine = self.machine()?;
        let from = arguments.start.unwrap_or(0);
        let count = arguments.count.filter(|count| *count > 0).unwrap_or(MAX_VARIABLES).min(MAX_VARIABLES);
        let described: Vec<Value> = match arguments.variables_reference {
            MEMORY_REFERENCE => machine.memories().into_iter().skip(from).take(count).collect(),
            number if arguments.filter.as_deref() == Some("named") && number >= FIRST_SPACE_REFERENCE => Vec::new(),
            number => {
                let found = machine.variables_in(number, arguments.format.hex, from, count);
                let found = found.ok_or_else(|| RequestError::not_found(format!("there are no variables {number}")))?;
                found.iter().map(DapVariable::to_json).collect()
            }
        };
        Ok(json!({ "variables": described }))
    }

    /// Answers `setVariable`: assigns a value to a variable or register, or drives a pin.
    pub(crate) fn set_variable(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let arguments: VariablesArguments = request.parse_arguments()?;
        let (number, name) = (arguments.variables_reference, &arguments.name);
        if number == PINS_REFERENCE {
            self.drive(&format!("{name}={}", arguments.value.trim()))?;
        } else if let Some(object) = locals::object(self.machine()?, number, name) {
            self.assign_to(&DebugExpression::Object(Box::new(object)), &arguments.value, 0)?;
        } else {
            let machine = self.machine()?;
            let text = machine.evaluate_name(number, name);
            let text =
                text.ok_or_else(|| RequestError::not_found(format!("there is no variable `{name}` that can be set")))?;
            self.assign(&text, &arguments.value, 0)?;
        }
        self.invalidate_client();
        let machine = self.machine()?;
        let found = machine.variables_in(number, arguments.format.hex, 0, MAX_VARIABLES).unwrap_or_default();
        let value = found.into_iter().find(|variable| variable.name == *name).map(|variable| variable.value);
        Ok(json!({ "value": value.unwrap_or_default() }))
    }

    /// Assigns a value to a place; both are expressions.
    pub(crate) fn assign(&mut self, text: &str, value: &str, level: usize) -> Result<(), RequestError> {
        let machine = self.machine()?;
        // An input of a ladder program is set at its pin, because every scan overwrites the memory in which
        // it is latched.
        let own = machine.chip_pin_text(text);
        if own != text {
            return self.drive(&format!("{own}={}", value.trim()));
        }
        let expr = machine.parse_expression(text, level)?;
        if let Some(ExpressionPlace::Pin(pin)) = expr.place(machine.session.machine()) {
            let name = machine.session.scope.chip().pins.get(usize::from(pin)).map_or("", |def| def.name);
            return self.drive(&format!("{name}={}", value.trim()));
        }
        self.assign_to(&expr, value, level)
    }

    fn assign_to(&mut self, expr: &DebugExpression, value: &str, level: usize) -> Result<(), RequestError> {
        let machine = self.machine()?;
        let given = machine.parse_expression(value, level)?.evaluate(machine.session.machine());
        let given = given.ok_or_else(|| RequestError::not_possible(format!("`{value}` has no value now")))?;
        machine.assign(expr, given)
    }

    /// Asks a client that supports it to refresh everything.
    pub(crate) fn invalidate_client(&mut self) {
        if self.client.supports_invalidated_event {
            self.event("invalidated", json!({ "areas": ["all"] }));
        }
    }
}

impl DapMachine {
    /// Replaces an input of a ladder program by its pin: `Xstart=1` becomes `PD2=1`.
    pub fn chip_pin_text(&self, text: &str) -> String {
        self.ladder.as_ref().map_or_else(|| text.to_owned(), |ladder| ladder.view().pin_assignment(text))
    }

    /// Parses an expression in the frame at a level.
    pub fn parse_expression(&self, text: &str, level: usize) -> Result<DebugExpression, RequestError> {
        self.session
            .scope
            .parse_expression_in_frame(text, self.session.machine(), level)
            .map_err(RequestError::not_found)
    }

    /// The memory reference of the first byte of an object, for `readMemory`.
    pub fn memory_reference_of(&self, object: &ObjectExpr) -> Option<String> {
        match object.byte_locations(self.session.machine()).first() {
            Some(ObjectByteLocation::Memory(space, addr)) => Some(self.memory_reference(space, *addr)),
            _ => None,
        }
    }

    /// The expression for a variable.
    pub fn evaluate_name(&self, container: i64, name: &str) -> Option<String> {
        let found = self.variables_in(container, false, 0, usize::MAX)?;
        found.into_iter().find(|variable| variable.name == name && !variable.text.is_empty()).map(|found| found.text)
    }

    /// The value of a place as text, in the usual format of the place or in hexadecimal.
    pub fn value_text(&self, place: ExpressionPlace, hex: bool) -> String {
        let target = self.session.machine();
        let Some(value) = place.value(target) else { return "none".to_owned() };
        let digits = match place {
            ExpressionPlace::Memory { bytes, .. } => 2 * usize::from(bytes),
            ExpressionPlace::Reg(_) | ExpressionPlace::Pc => 2,
            _ => 1,
        };
        match place {
            ExpressionPlace::Pc => format!("0x{value:04x}"),
            ExpressionPlace::Reg(_) => format!("0x{value:02x}"),
            ExpressionPlace::Memory { bytes, .. } if hex => {
                let unused = 64 - 8 * u32::from(bytes.clamp(1, 4));
                format!("0x{:0digits$x}", (value as u64) << unused >> unused)
            }
            _ if hex => format!("0x{value:x}"),
            _ => value.to_string(),
        }
    }

    /// Symbols of the program in RAM.
    fn ram_symbols(&self) -> Vec<&SymbolAt> {
        let scope = &self.session.scope;
        let mut found: Vec<&SymbolAt> =
            scope.symbols.iter().filter(|s| s.space == scope.chip().ram_space && s.size > 0).collect();
        found.sort_by(|a, b| a.name.cmp(&b.name));
        found.dedup_by(|a, b| a.name == b.name);
        found
    }

    /// The variables of a container; `None` if it does not exist.
    fn variables_in(&self, container: i64, hex: bool, from: usize, count: usize) -> Option<Vec<DapVariable>> {
        let all = match container {
            REGISTERS_REFERENCE => self.registers(),
            LADDER_REFERENCE => self.symbols_of_ladder(hex),
            SYMBOLS_REFERENCE => self.ram_symbols().into_iter().map(|symbol| self.object(symbol, hex)).collect(),
            PINS_REFERENCE => self.pins(),
            CHIP_REFERENCE => self.chip_registers(),
            _ if container >= locals::FIRST_SCOPE_REFERENCE => locals::variables_in(self, container, hex)?,
            _ => {
                let space = usize::try_from(container.checked_sub(FIRST_SPACE_REFERENCE)?).ok()?;
                return self.rows(space, from, count);
            }
        };
        Some(all.into_iter().skip(from).take(count).collect())
    }

    fn registers(&self) -> Vec<DapVariable> {
        let (session, chip) = (&self.session, self.session.scope.chip());
        let own = |name: &str, place: ExpressionPlace| DapVariable {
            name: name.to_owned(),
            value: self.value_text(place, false),
            text: format!("${name}"),
            kind: "register".into(),
            memory: None,
            parts: 0,
        };
        let mut found = Vec::new();
        if !chip.cpu_regs.contains(&"PC") {
            found.push(own("PC", ExpressionPlace::Pc));
        }
        found.extend(chip.cpu_regs.iter().map(|name| match *name {
            "PC" => own(name, ExpressionPlace::Pc),
            _ => own(name, ExpressionPlace::Reg(name)),
        }));
        found.push(own("cycle", ExpressionPlace::Cycle));
        found.push(own("instructions", ExpressionPlace::Instructions));
        let described = |name: &str, value: String| DapVariable {
            name: name.to_owned(),
            value,
            text: String::new(),
            kind: "time".into(),
            memory: None,
            parts: 0,
        };
        found.push(described("time", format!("{:.9} s", session.clock().seconds(session.machine().cycle()))));
        if let Some(scan) = session.scan() {
            found.push(described("scan", scan.to_string()));
        }
        found
    }

    fn symbols_of_ladder(&self, hex: bool) -> Vec<DapVariable> {
        let symbols = self.session.scope.ladder.iter();
        let variable = |(name, place): &(String, ExpressionPlace)| {
            let (kind, memory) = match *place {
                ExpressionPlace::Memory { space, addr, .. } => ("integer", Some(self.memory_reference(space, addr))),
                _ => ("bit", None),
            };
            DapVariable {
                name: name.clone(),
                value: self.value_text(*place, hex),
                text: name.clone(),
                kind: kind.into(),
                memory,
                parts: 0,
            }
        };
        symbols.map(variable).collect()
    }

    fn object(&self, symbol: &SymbolAt, hex: bool) -> DapVariable {
        const SHOWN: u32 = 8;
        let (space, addr, size) = (symbol.space, symbol.addr, symbol.size);
        let value = match u8::try_from(size) {
            Ok(bytes @ 1..=4) => self.value_text(ExpressionPlace::Memory { space, addr, bytes, signed: false }, hex),
            _ => {
                let bytes = (0..size.min(SHOWN)).filter_map(|n| self.session.machine().peek(space, addr + n));
                let bytes: Vec<String> = bytes.map(|byte| format!("{byte:02x}")).collect();
                format!("{}{}", bytes.join(" "), if size > SHOWN { " .." } else { "" })
            }
        };
        let text = if size <= 4 { symbol.name.clone() } else { String::new() };
        let memory = Some(self.memory_reference(space, addr));
        DapVariable { name: symbol.name.clone(), value, text, kind: "object".into(), memory, parts: 0 }
    }

    fn pins(&self) -> Vec<DapVariable> {
        let (target, chip) = (self.session.machine(), self.session.scope.chip());
        let pins = (0..).zip(chip.pins).filter(|(id, _)| target.has_pin(*id as PinId));
        let level = |id| match target.pin_level(id) {
            PinLevel::High | PinLevel::PullUp => "1",
            PinLevel::Low | PinLevel::PullDown => "0",
            PinLevel::Float => "z",
        };
        pins.map(|(id, def)| DapVariable {
            name: def.name.to_owned(),
            value: level(id).to_owned(),
            text: def.name.to_owned(),
            kind: "pin".into(),
            memory: None,
            parts: 0,
        })
        .collect()
    }

    fn chip_registers(&self) -> Vec<DapVariable> {
        let (target, chip) = (self.session.machine(), self.session.scope.chip());
        let found = chip.regs.iter().filter_map(|reg| {
            let value = target.peek(chip.reg_space, reg.addr.into())?;
            Some(DapVariable {
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
        let spaces = self.session.scope.chip().spaces.iter().zip(FIRST_SPACE_REFERENCE..);
        let described = |(ChipSpace { name: space, size, width }, number): (&ChipSpace, i64)| {
            let unit = if *width == 1 { "addresses" } else { "words" };
            json!({
                "name": space, "value": format!("{size} {unit}"), "variablesReference": number, "namedVariables": 0,
                "indexedVariables": size.saturating_mul(*width).div_ceil(BYTES_PER_ROW),
                "memoryReference": self.memory_reference(space, 0),
            })
        };
        spaces.map(described).collect()
    }

    /// The rows of a memory.
    fn rows(&self, space: usize, from: usize, count: usize) -> Option<Vec<DapVariable>> {
        let &ChipSpace { name: space, size, width } = self.session.scope.chip().spaces.get(space)?;
        let (rows, target) = (size.saturating_mul(width).div_ceil(BYTES_PER_ROW), self.session.machine());
        let from = u32::try_from(from).unwrap_or(u32::MAX).min(rows);
        let end = from.saturating_add(u32::try_from(count).unwrap_or(u32::MAX)).min(rows);
        let row = |row: u32| {
            let bytes = (row * BYTES_PER_ROW..row * BYTES_PER_ROW + BYTES_PER_ROW).map(|at| target.peek(space, at));
            let bytes: Vec<String> = bytes.flatten().map(|byte| format!("{byte:02x}")).collect();
            DapVariable {
                name: format!("0x{:04x}", row * BYTES_PER_ROW / width.max(1)),
                value: bytes.join(" "),
                text: String::new(),
                kind: "bytes".into(),
                memory: Some(self.memory_reference(space, row * BYTES_PER_ROW)),
                parts: 0,
            }
        };
        Some((from..end).map(row).collect())
    }
}
