//! Values of C as text, as gdb prints them.

use emu_core::image::{BaseEncoding, CType, DebugInfo};

use super::ctype;
use super::kinds::{Kind, Kinds as _};
use super::object::{Cell, ObjectExpr, number};
use super::scope::Scope;
use super::target::Target;

/// Most elements of arrays and characters that are shown.
const ELEMENTS: usize = 200;

/// Equal elements in a row of which only their count is shown, if there are more.
const REPEATS: usize = 10;

/// Deepest nesting of values.
const DEEPEST: u32 = 16;

/// How values are shown, and what they are taken from.
struct Shown<'a> {
    scope: &'a Scope,
    info: &'a DebugInfo,
    target: &'a dyn Target,
    letter: Option<char>,
}

impl ObjectExpr {
    /// The value as gdb prints it; `letter` is a format: x d u o t c a.
    #[must_use]
    pub fn text(&self, scope: &Scope, target: &dyn Target, letter: Option<char>) -> String {
        let shown = Shown { scope, info: self.info(), target, letter };
        let cells = self.cells(target);
        let value = shown.value(self.kind, self.bit_field(), &cells, DEEPEST);
        let is_pointer = self.kind.stars > 0 || matches!(self.shape(), Some(CType::Pointer { .. }));
        // Of a text its place and its characters say enough.
        match is_pointer && letter.is_none() && !value.starts_with('<') && !value.ends_with('"') {
            true => format!("({}) {value}", self.kind_text()),
            false => value,
        }
    }

    /// The values of so many objects of its kind side by side, of which it is the first.
    ///
    /// # Errors
    /// It is in no memory.
    pub fn texts(
        &self,
        count: u64,
        scope: &Scope,
        target: &dyn Target,
        letter: Option<char>,
    ) -> Result<String, String> {
        let first = self.address()?;
        let count = i64::try_from(count).unwrap_or(i64::MAX).min(ELEMENTS as i64);
        let each: Result<Vec<String>, String> =
            (0..count).map(|n| Ok(first.element(super::Expr::Number(n))?.text(scope, target, letter))).collect();
        let parts = repeated(&each?, |same, count| format!("{same} <repeats {count} times>"));
        Ok(format!("{{{}}}", parts.join(", ")))
    }

    /// The value without the type of a pointer.
    #[must_use]
    pub fn bare_text(&self, scope: &Scope, target: &dyn Target) -> String {
        let shown = Shown { scope, info: self.info(), target, letter: None };
        shown.value(self.kind, self.bit_field(), &self.cells(target), DEEPEST)
    }

    /// It has no parts of its own.
    #[must_use]
    pub fn is_scalar(&self) -> bool {
        !matches!(self.shape(), Some(CType::Record { .. } | CType::Array { .. }))
    }

    /// The name of its type.
    #[must_use]
    pub fn kind_text(&self) -> String {
        ctype::name(self.info(), self.kind, "")
    }

    /// Its type with all members.
    #[must_use]
    pub fn whole_kind(&self) -> String {
        ctype::whole(self.info(), self.kind)
    }

    /// The parts of a struct, union or array by name, or what a pointer points to; none where it has no parts.
    #[must_use]
    pub fn parts(&self) -> Vec<(String, ObjectExpr)> {
        let member = |name: &str| Some((name.to_owned(), self.member(name).ok()?));
        if let Some((_, counts)) = self.info().array(self.kind) {
            let count = counts.first().copied().flatten().unwrap_or(0).min(ELEMENTS as u32);
            let element = |n: u32| Some((format!("[{n}]"), self.element(super::Expr::Number(n.into())).ok()?));
            return (0..count).filter_map(element).collect();
        }
        match self.shape() {
            Some(CType::Record { members, .. }) => {
                let names = members.iter().flat_map(|own| match &own.name {
                    Some(name) => vec![name.as_str()],
                    None => self.info().member_names(own.of),
                });
                names.filter_map(member).collect()
            }
            _ => match self.target_kind() {
                Some(kind) if self.info().size_of(kind).is_some_and(|size| size > 0) => {
                    self.element(super::Expr::Number(0)).ok().map(|of| ("*".to_owned(), of)).into_iter().collect()
                }
                _ => Vec::new(),
            },
        }
    }
}

impl Shown<'_> {
    fn value(&self, kind: Kind, bits: Option<(u32, u32)>, cells: &[Cell], depth: u32) -> String {
        if depth == 0 {
            return "{...}".to_owned();
        }
        if cells.contains(&Cell::Missing) {
            return "<not in memory>".to_owned();
        }
        if !cells.is_empty() && cells.iter().all(|cell| *cell == Cell::Gone) {
            return "<optimized out>".to_owned();
        }
        if let Some((_, counts)) = self.info.array(kind) {
            return self.array(kind, counts.first().copied().flatten(), cells, depth);
        }
        if let Some(CType::Record { members, .. }) = self.info.shape(kind) {
            let each = members.iter().map(|member| {
                let size = match member.bits {
                    Some((first, size)) => Some((first + size).div_ceil(8)),
                    None => self.info.size(member.of),
                };
                let (start, size) = (member.offset as usize, size.unwrap_or(0) as usize);
                let own = cells.get(start..start.saturating_add(size)).unwrap_or(&[]);
                let text = self.value(Kind::new(member.of), member.bits, own, depth - 1);
                member.name.as_ref().map_or(text.clone(), |name| format!("{name} = {text}"))
            });
            return format!("{{{}}}", each.collect::<Vec<_>>().join(", "));
        }
        self.single(kind, bits, cells)
    }

    fn array(&self, kind: Kind, count: Option<u32>, cells: &[Cell], depth: u32) -> String {
        let Some(element) = self.info.element(kind) else { return "{...}".to_owned() };
        let size = self.info.size_of(element).unwrap_or(0) as usize;
        if size == 0 {
            return "{...}".to_owned();
        }
        let is_char = size == 1
            && self.letter.is_none()
            && matches!(
                self.info.shape(element),
                Some(CType::Base { encoding: BaseEncoding::SignedChar | BaseEncoding::UnsignedChar, .. })
            );
        if is_char && let Some(bytes) = cells.iter().map(|cell| cell.value(self.target)).collect::<Option<Vec<u8>>>() {
            // The 0 at its end goes without saying.
            let shown = match bytes.split_last() {
                Some((0, before)) if !before.is_empty() => before,
                _ => &bytes,
            };
            return text(shown.get(..shown.len().min(ELEMENTS)).unwrap_or_default(), shown.len() > ELEMENTS);
        }
        let all = cells.chunks(size).take(count.unwrap_or(u32::MAX) as usize);
        let each: Vec<String> = all.take(ELEMENTS).map(|own| self.value(element, None, own, depth - 1)).collect();
        let mut parts = repeated(&each, |same, count| format!("{same} <repeats {count} times>"));
        if cells.len() / size > ELEMENTS
            && let Some(last) = parts.last_mut()
        {
            last.push_str("...");
        }
        format!("{{{}}}", parts.join(", "))
    }

    /// Anything that has no parts.
    fn single(&self, kind: Kind, bits: Option<(u32, u32)>, cells: &[Cell]) -> String {
        if cells.contains(&Cell::Gone) {
            return "<optimized out>".to_owned();
        }
        let bytes: Option<Vec<u8>> = cells.iter().map(|cell| cell.value(self.target)).collect();
        let Some(bytes) = bytes.filter(|bytes| !bytes.is_empty()) else {
            return if self.info.size_of(kind) == Some(0) || self.info.shape(kind).is_none() && kind.stars == 0 {
                "void"
            } else {
                "<not in memory>"
            }
            .to_owned();
        };
        let shape = self.info.shape(kind);
        let signed = match shape {
            Some(CType::Base { encoding, .. }) => matches!(encoding, BaseEncoding::Signed | BaseEncoding::SignedChar),
            Some(CType::Enum { values, .. }) => values.iter().any(|(_, value)| *value < 0),
            _ => false,
        };
        let Some(value) = number(&bytes, bits, signed) else { return "<not in memory>".to_owned() };
        let size = bits.map_or(bytes.len() as u32, |(_, size)| size.div_ceil(8));
        if let Some(letter) = self.letter {
            return match letter {
                'a' => self.code(value).unwrap_or_else(|| format!("0x{value:x}")),
                _ => crate::numbers::shown(value, letter, size).unwrap_or_else(|| value.to_string()),
            };
        }
        match shape {
            Some(CType::Base { encoding, .. }) => match encoding {
                BaseEncoding::Signed => value.to_string(),
                BaseEncoding::Unsigned => (value as u64).to_string(),
                BaseEncoding::SignedChar | BaseEncoding::UnsignedChar if size > 1 => value.to_string(),
                BaseEncoding::SignedChar | BaseEncoding::UnsignedChar => {
                    format!("{value} '{}'", letter(value as u8, '\''))
                }
                BaseEncoding::Boolean => match value {
                    0 => "false".to_owned(),
                    1 => "true".to_owned(),
                    other => other.to_string(),
                },
                BaseEncoding::Float => float(&bytes),
            },
            Some(CType::Enum { values, .. }) => enumerator(values, value),
            Some(CType::Pointer { to, .. }) => self.pointer(value, Kind::new(*to)),
            _ if kind.stars > 0 => self.pointer(value, Kind { stars: kind.stars - 1, ..kind }),
            _ => value.to_string(),
        }
    }

    /// An address, with what is there where that has a name or is a text.
    fn pointer(&self, value: i64, to: Kind) -> String {
        match self.info.shape(to) {
            Some(CType::Function { .. }) => {
                let chip = self.scope.chip();
                // A pointer to a function counts words.
                let byte = value.saturating_mul(chip.word_bytes.into());
                return self.code(byte).unwrap_or_else(|| format!("0x{byte:x}"));
            }
            Some(CType::Base { bytes: 1, encoding: BaseEncoding::SignedChar | BaseEncoding::UnsignedChar, .. })
                if value != 0 =>
            {
                let ram = self.scope.chip().ram;
                let mut found = Vec::new();
                while let Some(byte) =
                    u32::try_from(value).ok().and_then(|start| self.target.peek(ram, start + found.len() as u32))
                {
                    if byte == 0 || found.len() >= ELEMENTS {
                        break;
                    }
                    found.push(byte);
                }
                let more = found.len() >= ELEMENTS;
                return format!("0x{value:x}{} {}", self.object(value), text(&found, more));
            }
            _ => {}
        }
        format!("0x{value:x}{}", self.object(value))
    }

    fn object(&self, value: i64) -> String {
        let names = self.scope.source().names;
        let name =
            u32::try_from(value).ok().filter(|addr| *addr > 0).and_then(|addr| names.object(names.chip.ram, addr));
        name.map_or(String::new(), |name| format!(" <{name}>"))
    }

    /// A byte address of program memory.
    fn code(&self, value: i64) -> Option<String> {
        let byte = u32::try_from(value).ok()?;
        let name = self.scope.source().names.near(byte)?;
        Some(format!("0x{byte:x} <{name}>"))
    }
}

/// A name of an enumeration, or several that make the value together, else the number.
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

/// A number with a point to as many digits as it holds.
fn float(bytes: &[u8]) -> String {
    match *bytes {
        [a, b, c, d] => general(f32::from_le_bytes([a, b, c, d]).into(), 9),
        [a, b, c, d, e, f, g, h] => general(f64::from_le_bytes([a, b, c, d, e, f, g, h]), 17),
        _ => "<a number of another size>".to_owned(),
    }
}

/// A number to so many digits, as `%g` of C has it.
pub(super) fn general(value: f64, digits: usize) -> String {
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

/// A byte as a character of C.
fn letter(byte: u8, quote: char) -> String {
    match byte {
        b'\n' => "\\n".to_owned(),
        b'\r' => "\\r".to_owned(),
        b'\t' => "\\t".to_owned(),
        7 => "\\a".to_owned(),
        8 => "\\b".to_owned(),
        11 => "\\v".to_owned(),
        12 => "\\f".to_owned(),
        27 => "\\033".to_owned(),
        b'\\' => "\\\\".to_owned(),
        b' '..=b'~' if char::from(byte) == quote => format!("\\{quote}"),
        b' '..=b'~' => char::from(byte).to_string(),
        _ => format!("\\{byte:03o}"),
    }
}

/// Bytes as a text of C; many equal ones in a row by their count.
fn text(bytes: &[u8], more: bool) -> String {
    let each: Vec<u8> = bytes.to_vec();
    let (mut parts, mut open): (Vec<String>, Option<String>) = (Vec::new(), None);
    let mut at = 0;
    while let Some(byte) = each.get(at) {
        let count = each.iter().skip(at).take_while(|other| *other == byte).count();
        if count > REPEATS {
            parts.extend(open.take().map(|text| format!("\"{text}\"")));
            parts.push(format!("'{}' <repeats {count} times>", letter(*byte, '\'')));
            at += count;
        } else {
            open.get_or_insert_default().push_str(&letter(*byte, '"'));
            at += 1;
        }
    }
    if parts.is_empty() || open.is_some() {
        parts.push(format!("\"{}\"", open.unwrap_or_default()));
    }
    format!("{}{}", parts.join(", "), if more { "..." } else { "" })
}

/// Values in their order, of which many equal ones in a row become one.
fn repeated(each: &[String], many: impl Fn(&str, usize) -> String) -> Vec<String> {
    let (mut parts, mut at) = (Vec::new(), 0);
    while let Some(value) = each.get(at) {
        let count = each.iter().skip(at).take_while(|other| *other == value).count();
        if count > REPEATS {
            parts.push(many(value, count));
            at += count;
        } else {
            parts.push(value.clone());
            at += 1;
        }
    }
    parts
}
