//! C values as text in the notation of gdb.

use crate::debug::c_type_queries::ArrayShape;
use emu_core::image::{BaseEncoding, BitRange, CType, DebugInfo, Mcs51Memory, SpaceAddress};

use super::c_objects::{ObjectByteLocation, ObjectExpr, number_from_bytes};
use super::c_strings::{REPEAT_THRESHOLD, collapse_repeats, text};
use super::c_type_queries::{CTypeQueries as _, CTypeRef};
use super::c_types;
use super::dyn_machine::DynMachine;
use super::error::DebugError;
use super::scope::NameScope;
use crate::address_names::decimal_offset;
use crate::number_formats::{format_character, format_number};

/// Maximum number of array elements and characters that are shown.
const MAX_ELEMENTS: usize = 200;

/// Maximum nesting of values.
const MAX_DEPTH: u32 = 16;

/// The format of values, and the machine that they are read from.
struct CValueFormatter<'a> {
    scope: &'a NameScope,
    info: &'a DebugInfo,
    machine: &'a dyn DynMachine,
    letter: Option<char>,
}

/// The value of a parameter when its function was called.
#[derive(Debug, Clone)]
pub struct ValueAtCall {
    /// The value as text.
    pub text: String,
    /// Whether the parameter has the same value now.
    pub unchanged: bool,
}

/// An object with its name.
pub struct NamedObject {
    /// The name of the variable, member or element.
    pub name: String,
    /// The object.
    pub object: ObjectExpr,
}

impl ObjectExpr {
    /// Returns the value as gdb prints it; `letter` is a format: x d u o t c a.
    #[must_use]
    pub fn text(&self, scope: &NameScope, machine: &dyn DynMachine, letter: Option<char>) -> String {
        let shown = CValueFormatter { scope, info: self.info(), machine, letter };
        if let Some(byte) = self.code_address(machine) {
            let place = shown.code(byte).unwrap_or_else(|| format!("0x{byte:x}"));
            return match letter {
                None => format!("{{{}}} {place}", self.type_name()),
                Some(_) => place,
            };
        }
        let cells = self.byte_locations(machine);
        let value = shown.value(self.ctype, self.bit_field(), &cells, MAX_DEPTH);
        let is_pointer = self.ctype.pointer_depth > 0 || matches!(self.resolved_type(), Some(CType::Pointer { .. }));
        // For a `char *`, the address and the characters suffice, without the type.
        let is_char = || {
            let named = self.ctype.pointer_depth == 0
                && matches!(self.ctype.id.and_then(|id| self.info().type_info(id)), Some(CType::Named { .. }));
            let to = self.element_type().map(|to| c_types::declaration(self.info(), to, "")).unwrap_or_default();
            !named && to.trim_start_matches("const ").trim_start_matches("volatile ") == "char"
        };
        match is_pointer
            && letter.is_none()
            && !value.starts_with('<')
            && !(value.trim_end_matches('.').ends_with('"') && is_char())
        {
            true => format!("({}) {value}", self.type_name()),
            false => value,
        }
    }

    /// Returns the values of `count` adjacent objects of its type, beginning with this one.
    ///
    /// # Errors
    /// It is in no memory.
    pub fn array_text(
        &self,
        count: u64,
        scope: &NameScope,
        machine: &dyn DynMachine,
        letter: Option<char>,
    ) -> Result<String, DebugError> {
        let first = self.address()?;
        let count = i64::try_from(count).unwrap_or(i64::MAX).min(scope.print.elements as i64);
        let elements: Result<Vec<ObjectExpr>, DebugError> =
            (0..count).map(|n| first.element(super::DebugExpression::Number(n))).collect();
        let (elements, shown) = (elements?, CValueFormatter { scope, info: self.info(), machine, letter });
        let bytes = || {
            elements.iter().map(|own| own.byte_locations(machine).first()?.value(machine)).collect::<Option<Vec<u8>>>()
        };
        if shown.is_text(self.ctype)
            && let Some(bytes) = bytes()
        {
            return Ok(shown.text(&bytes, false));
        }
        let each: Vec<String> = elements
            .iter()
            .map(|own| shown.value(own.ctype, None, &own.byte_locations(machine), MAX_DEPTH - 1))
            .collect();
        let parts = shown.collapsed(&each);
        Ok(format!("{{{}}}", parts.join(", ")))
    }

    /// Returns the value without the type of a pointer.
    #[must_use]
    pub fn text_without_type(&self, scope: &NameScope, machine: &dyn DynMachine) -> String {
        if self.has_unknown_type() {
            return "<unknown type>".to_owned();
        }
        let shown = CValueFormatter { scope, info: self.info(), machine, letter: None };
        shown.value(self.ctype, self.bit_field(), &self.byte_locations(machine), MAX_DEPTH)
    }

    /// Returns how it would be written with another value.
    #[must_use]
    pub fn text_of_number(&self, scope: &NameScope, machine: &dyn DynMachine, value: i64) -> String {
        let shown = CValueFormatter { scope, info: self.info(), machine, letter: None };
        let bytes = value.to_le_bytes().into_iter().take(self.info().size_of(self.ctype).unwrap_or(0) as usize);
        let cells: Vec<ObjectByteLocation> = bytes.map(ObjectByteLocation::Value).collect();
        shown.value(self.ctype, None, &cells, MAX_DEPTH)
    }

    /// Returns the value of a parameter when its function was called, and whether it is the same now; `None`
    /// if the debugging information does not describe it.
    #[must_use]
    pub fn text_at_call(&self, scope: &NameScope, machine: &dyn DynMachine) -> Option<ValueAtCall> {
        let bytes = self.bytes_at_call(machine)?;
        let shown = CValueFormatter { scope, info: self.info(), machine, letter: None };
        let present: Option<Vec<u8>> = self.byte_locations(machine).iter().map(|cell| cell.value(machine)).collect();
        let cells: Vec<ObjectByteLocation> = bytes.iter().map(|byte| ObjectByteLocation::Value(*byte)).collect();
        Some(ValueAtCall {
            text: shown.value(self.ctype, None, &cells, MAX_DEPTH),
            unchanged: present.is_some_and(|present| present == bytes),
        })
    }

    /// Returns true if it has no parts.
    #[must_use]
    pub fn is_scalar(&self) -> bool {
        !matches!(self.resolved_type(), Some(CType::Record { .. } | CType::Array { .. }))
    }

    /// Returns the name of its type.
    #[must_use]
    pub fn type_name(&self) -> String {
        c_types::declaration(self.info(), self.ctype, "")
    }

    /// Returns the name of its type; for a `typedef` the type behind the name, as `whatis` prints it for the
    /// name of a type.
    #[must_use]
    pub fn aliased_kind(&self) -> String {
        match self.ctype.id.filter(|_| self.ctype.pointer_depth == 0).and_then(|id| self.info().type_info(id)) {
            Some(CType::Named { of, .. }) => c_types::declaration(self.info(), CTypeRef::new(*of), ""),
            _ => self.type_name(),
        }
    }

    /// Returns its type with all members.
    #[must_use]
    pub fn type_definition(&self) -> String {
        c_types::type_definition(self.info(), self.ctype)
    }

    /// Returns the named parts of a struct, union or array, or the target of a pointer; empty for other
    /// types.
    #[must_use]
    pub fn parts(&self) -> Vec<NamedObject> {
        let member = |name: &str| Some(NamedObject { name: name.to_owned(), object: self.member(name).ok()? });
        if let Some(ArrayShape { counts, .. }) = self.info().array(self.ctype) {
            let count = counts.first().copied().flatten().unwrap_or(0).min(MAX_ELEMENTS as u32);
            let element = |n: u32| {
                Some(NamedObject {
                    name: format!("[{n}]"),
                    object: self.element(super::DebugExpression::Number(n.into())).ok()?,
                })
            };
            return (0..count).filter_map(element).collect();
        }
        match self.resolved_type() {
            Some(CType::Record { members, .. }) => {
                let names = members.iter().flat_map(|own| match &own.name {
                    Some(name) => vec![name.as_str()],
                    None => self.info().member_names(own.member_type),
                });
                names.filter_map(member).collect()
            }
            _ => match self.element_type() {
                Some(kind) if self.info().size_of(kind).is_some_and(|size| size > 0) => self
                    .element(super::DebugExpression::Number(0))
                    .ok()
                    .map(|object| NamedObject { name: "*".to_owned(), object })
                    .into_iter()
                    .collect(),
                _ => Vec::new(),
            },
        }
    }
}

impl CValueFormatter<'_> {
    fn value(&self, kind: CTypeRef, bits: Option<BitRange>, cells: &[ObjectByteLocation], depth: u32) -> String {
        if depth == 0 {
            return "{...}".to_owned();
        }
        if cells.contains(&ObjectByteLocation::Missing) {
            return "<not in memory>".to_owned();
        }
        if !cells.is_empty() && cells.iter().all(|cell| *cell == ObjectByteLocation::OptimizedAway) {
            return "<optimized out>".to_owned();
        }
        if let Some(ArrayShape { counts, .. }) = self.info.array(kind) {
            return self.array(kind, counts.first().copied().flatten(), cells, depth);
        }
        if let Some(CType::Record { members, .. }) = self.info.resolve_type(kind) {
            let each = members.iter().map(|member| {
                let size = match member.bit_range {
                    Some(BitRange { first, size }) => Some((first + size).div_ceil(8)),
                    None => self.info.size(member.member_type),
                };
                let (start, size) = (member.offset as usize, size.unwrap_or(0) as usize);
                let own = cells.get(start..start.saturating_add(size)).unwrap_or(&[]);
                let text = self.value(CTypeRef::new(member.member_type), member.bit_range, own, depth - 1);
                member.name.as_ref().map_or(text.clone(), |name| format!("{name} = {text}"))
            });
            let each: Vec<String> = each.collect();
            if self.scope.print.pretty && !each.is_empty() {
                let blanks = "  ".repeat((MAX_DEPTH - depth) as usize);
                let lines: Vec<String> = each.iter().map(|text| format!("{blanks}  {text}")).collect();
                return format!("{{\n{}\n{blanks}}}", lines.join(",\n"));
            }
            return format!("{{{}}}", each.join(", "));
        }
        self.single(kind, bits, cells)
    }

    /// Returns true if a sequence of elements of this type is a text.
    fn is_text(&self, element: CTypeRef) -> bool {
        let is_char = matches!(
            self.info.resolve_type(element),
            Some(CType::Base { bytes: 1, encoding: BaseEncoding::SignedChar | BaseEncoding::UnsignedChar, .. })
        );
        is_char && self.letter.is_none()
    }

    fn array(&self, kind: CTypeRef, count: Option<u32>, cells: &[ObjectByteLocation], depth: u32) -> String {
        let Some(element) = self.info.element_type(kind) else { return "{...}".to_owned() };
        let size = self.info.size_of(element).unwrap_or(0) as usize;
        if size == 0 {
            return "{...}".to_owned();
        }
        if self.is_text(element)
            && let Some(bytes) = cells.iter().map(|cell| cell.value(self.machine)).collect::<Option<Vec<u8>>>()
        {
            // The 0 at the end is not shown.
            let shown = match bytes.split_last() {
                Some((0, before)) if !before.is_empty() => before,
                _ => &bytes,
            };
            let most = self.most();
            return self.text(shown.get(..shown.len().min(most)).unwrap_or_default(), shown.len() > most);
        }
        let all = cells.chunks(size).take(count.unwrap_or(u32::MAX) as usize);
        let each: Vec<String> = all.take(self.most()).map(|own| self.value(element, None, own, depth - 1)).collect();
        let mut parts = self.collapsed(&each);
        if cells.len() / size > self.most()
            && let Some(last) = parts.last_mut()
        {
            last.push_str("...");
        }
        format!("{{{}}}", parts.join(", "))
    }

    /// Formats a value without parts.
    fn single(&self, kind: CTypeRef, bits: Option<BitRange>, cells: &[ObjectByteLocation]) -> String {
        if cells.contains(&ObjectByteLocation::OptimizedAway) {
            return "<optimized out>".to_owned();
        }
        let bytes: Option<Vec<u8>> = cells.iter().map(|cell| cell.value(self.machine)).collect();
        let Some(bytes) = bytes.filter(|bytes| !bytes.is_empty()) else {
            return if self.info.size_of(kind) == Some(0)
                || self.info.resolve_type(kind).is_none() && kind.pointer_depth == 0
            {
                "void"
            } else {
                "<not in memory>"
            }
            .to_owned();
        };
        let shape = self.info.resolve_type(kind);
        let signed = match shape {
            Some(CType::Base { encoding, .. }) => matches!(encoding, BaseEncoding::Signed | BaseEncoding::SignedChar),
            Some(CType::Enum { values, .. }) => values.iter().any(|(_, value)| *value < 0),
            _ => false,
        };
        let Some(value) = number_from_bytes(&bytes, bits, signed) else { return "<not in memory>".to_owned() };
        // In a format a bit field has the width of its type, as in gdb.
        let of_type = self.info.size_of(kind).filter(|_| self.letter.is_some());
        let size = bits.map_or(bytes.len() as u32, |bits| of_type.unwrap_or(bits.size.div_ceil(8)));
        if let Some(letter) = self.letter {
            return match letter {
                'a' if self.points_to_code(kind) => self.code_word(value),
                'f' => real_text(&bytes).unwrap_or_else(|| value.to_string()),
                'a' => self.code(value).unwrap_or_else(|| format!("0x{value:x}")),
                _ => format_number(value, letter, size, false).unwrap_or_else(|| value.to_string()),
            };
        }
        match shape {
            Some(CType::Base { encoding, .. }) => match encoding {
                BaseEncoding::Signed => value.to_string(),
                BaseEncoding::Unsigned => (value as u64).to_string(),
                BaseEncoding::SignedChar | BaseEncoding::UnsignedChar if size > 1 => value.to_string(),
                BaseEncoding::SignedChar | BaseEncoding::UnsignedChar => {
                    format!("{value} '{}'", format_character(value as u8, '\''))
                }
                BaseEncoding::Boolean => match value {
                    0 => "false".to_owned(),
                    1 => "true".to_owned(),
                    other => other.to_string(),
                },
                BaseEncoding::Float => float(&bytes),
            },
            Some(CType::Enum { values, .. }) => enumerator(values, value),
            Some(CType::Pointer { to, .. }) => {
                self.pointer(value, CTypeRef::new(*to), self.info.memory_of_target(kind))
            }
            _ if kind.pointer_depth > 0 => {
                let to = CTypeRef { pointer_depth: kind.pointer_depth - 1, memory: None, ..kind };
                self.pointer(value, to, self.info.memory_of_target(kind))
            }
            _ => value.to_string(),
        }
    }

    /// Formats an address, with its symbol or text if there is one.
    fn pointer(&self, value: i64, to: CTypeRef, base: Option<u32>) -> String {
        match self.info.resolve_type(to) {
            Some(CType::Function { .. }) => return self.code_word(value),
            Some(CType::Base { bytes: 1, encoding: BaseEncoding::SignedChar | BaseEncoding::UnsignedChar, .. })
                if value != 0 =>
            {
                let SpaceAddress { space, addr: start } = self.pointed_memory(value, base);
                let mut found = Vec::new();
                while let Some(byte) = self.machine.peek(space, start.saturating_add(found.len() as u32)) {
                    if byte == 0 || found.len() >= self.most() {
                        break;
                    }
                    found.push(byte);
                }
                let more = found.len() >= self.most();
                return format!("0x{:x}{} {}", self.linked(value), self.object(value, base), self.text(&found, more));
            }
            _ => {}
        }
        format!("0x{:x}{}", self.linked(value), self.object(value, base))
    }

    /// Returns an address of data as in ELF files: 0x800100 on the AVR. A null pointer stays 0.
    fn linked(&self, value: i64) -> i64 {
        let base = self.scope.chip().family_traits().linked_data.filter(|_| (1..0x1_0000).contains(&value));
        value + i64::from(base.unwrap_or(0))
    }

    fn points_to_code(&self, kind: CTypeRef) -> bool {
        let to = match kind.pointer_depth.checked_sub(1) {
            Some(pointer_depth) => CTypeRef { pointer_depth, ..kind },
            None => match self.info.resolve_type(kind) {
                Some(CType::Pointer { to, .. }) => CTypeRef::new(*to),
                _ => return false,
            },
        };
        matches!(self.info.resolve_type(to), Some(CType::Function { .. }))
    }

    /// Formats the target of a pointer to a function, which holds a word address.
    fn code_word(&self, value: i64) -> String {
        let byte = value.saturating_mul(self.scope.chip().word_bytes.into());
        self.code(byte).unwrap_or_else(|| format!("0x{byte:x}"))
    }

    /// Returns the memory that a pointer points to, and the address there.
    fn pointed_memory(&self, value: i64, base: Option<u32>) -> SpaceAddress {
        let addr = u32::try_from(value).unwrap_or(u32::MAX);
        match base {
            Some(base) => Mcs51Memory::split(addr.saturating_add(base)),
            None => SpaceAddress { space: self.scope.chip().ram_space, addr },
        }
    }

    fn object(&self, value: i64, base: Option<u32>) -> String {
        let names = self.scope.source().names;
        let SpaceAddress { space, addr } = self.pointed_memory(value, base);
        let name = if value == 0 { None } else { names.containing_symbol(space, addr) };
        name.map_or(String::new(), |name| format!(" <{}>", decimal_offset(&name)))
    }

    /// Formats a byte address of program memory.
    fn code(&self, value: i64) -> Option<String> {
        let byte = u32::try_from(value).ok()?;
        let name = self.scope.source().names.nearest_symbol(byte)?;
        Some(format!("0x{byte:x} <{}>", decimal_offset(&name)))
    }
}

/// Returns the name of an enumeration constant, or several whose bits form the value, or the number.
fn enumerator(values: &[(String, i64)], value: i64) -> String {
    if let Some((name, _)) = values.iter().find(|(_, own)| *own == value) {
        return name.clone();
    }
    let flags = values.iter().all(|(_, own)| *own == 0 || own.count_ones() == 1);
    let set: Vec<&str> =
        values.iter().filter(|(_, own)| *own != 0 && value & own != 0).map(|(name, _)| name.as_str()).collect();
    let known = values.iter().fold(0, |all, (_, own)| all | own);
    match value & !known {
        _ if !flags || value == 0 => value.to_string(),
        rest if set.is_empty() => format!("(unknown: 0x{rest:x})"),
        0 => format!("({})", set.join(" | ")),
        rest => format!("({} | unknown: 0x{rest:x})", set.join(" | ")),
    }
}

/// Formats a floating-point number with all its significant digits.
fn float(bytes: &[u8]) -> String {
    match *bytes {
        [a, b, c, d] => format_significant(f32::from_le_bytes([a, b, c, d]).into(), 9),
        [a, b, c, d, e, f, g, h] => format_significant(f64::from_le_bytes([a, b, c, d, e, f, g, h]), 17),
        _ => "<floating-point number of unknown size>".to_owned(),
    }
}

/// Formats a number with this many significant digits, as `%g` in C.
pub(super) fn format_significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return if value.is_nan() {
            "nan"
        } else if value < 0.0 {
            "-inf"
        } else {
            "inf"
        }
        .to_owned();
    }
    let scientific = format!("{value:.*e}", digits - 1);
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| {
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text.to_owned() }
    };
    if exponent < -4 || exponent >= digits as i32 {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", trimmed(mantissa), exponent.abs());
    }
    trimmed(&format!("{value:.*}", usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0)))
}

/// Formats bytes as a floating-point number (format `f`) of four or eight bytes; `None` for other sizes.
#[must_use]
pub fn real_text(bytes: &[u8]) -> Option<String> {
    matches!(bytes.len(), 4 | 8).then(|| float(bytes))
}

impl CValueFormatter<'_> {
    /// Returns the maximum number of elements and characters to print.
    fn most(&self) -> usize {
        self.scope.print.elements
    }

    fn text(&self, bytes: &[u8], more: bool) -> String {
        text(bytes, more, self.scope.print.repeats)
    }

    fn collapsed(&self, each: &[String]) -> Vec<String> {
        collapse_repeats(each, self.scope.print.repeats, |same, count| format!("{same} <repeats {count} times>"))
    }
}

/// The settings of `set print`, for the format of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrintSettings {
    /// Print each member of a struct on its own line.
    pub pretty: bool,
    /// Maximum number of array elements and characters to print.
    pub elements: usize,
    /// Maximum number of equal elements in a row; more are printed once with their count.
    pub repeats: usize,
}

impl Default for PrintSettings {
    fn default() -> PrintSettings {
        PrintSettings { pretty: false, elements: MAX_ELEMENTS, repeats: REPEAT_THRESHOLD }
    }
}
