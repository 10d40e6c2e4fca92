//! Reads and formats literals and direct addresses (IEC 61131-3, 2.2 and 2.4.1.1).

use super::codes;
use super::types::{AddressArea, AddressSize, DirectAddress, IecType, IlLiteral, IlValue};

/// Why a literal, an address or a type is refused.
pub(super) struct LiteralRefusal {
    /// Code of the diagnostic.
    pub code: &'static str,
    /// What is wrong.
    pub cause: String,
    /// What to write instead.
    pub hint: &'static str,
}

fn refusal(code: &'static str, cause: impl Into<String>, hint: &'static str) -> LiteralRefusal {
    LiteralRefusal { code, cause: cause.into(), hint }
}

const TYPES_HINT: &str = "the types are BOOL, SINT, INT, DINT, USINT, UINT, UDINT, BYTE, WORD, DWORD and TIME";

/// Types of the standard that small chips do not support, with the prefixes of their literals.
const REFUSED_TYPES: [&str; 22] = [
    "REAL",
    "LREAL",
    "STRING",
    "WSTRING",
    "CHAR",
    "WCHAR",
    "DATE",
    "D",
    "TIME_OF_DAY",
    "TOD",
    "DATE_AND_TIME",
    "DT",
    "LINT",
    "ULINT",
    "LWORD",
    "LTIME",
    "LT",
    "LDATE",
    "LTOD",
    "LTIME_OF_DAY",
    "LDT",
    "LDATE_AND_TIME",
];

/// Returns the refusal of a type that the standard has and this reader has not.
pub(super) fn refused_type(word: &str) -> Option<LiteralRefusal> {
    let name = REFUSED_TYPES.into_iter().find(|name| name.eq_ignore_ascii_case(word))?;
    let long = match name {
        "D" => "DATE",
        "TOD" => "TIME_OF_DAY",
        "DT" => "DATE_AND_TIME",
        "LT" => "LTIME",
        other => other,
    };
    Some(refusal(codes::IL_REFUSED_TYPE, format!("the type {long} is not supported"), TYPES_HINT))
}

/// Returns the refusal of a string.
pub(super) fn refused_text() -> LiteralRefusal {
    refusal(codes::IL_REFUSED_TYPE, "the type STRING is not supported", TYPES_HINT)
}

/// Reads a number without prefix.
pub(super) fn read_number(text: &str) -> Result<IlLiteral, LiteralRefusal> {
    Ok(IlLiteral { prefix: None, value: read_integer(text)? })
}

/// Reads a literal with a prefix, such as `UINT#16#A5` or `T#1h_15m`.
pub(super) fn read_typed(text: &str) -> Result<IlLiteral, LiteralRefusal> {
    let (prefix, value) = text.split_once('#').unwrap_or((text, ""));
    if prefix.eq_ignore_ascii_case("T") || prefix.eq_ignore_ascii_case("TIME") {
        return Ok(IlLiteral { prefix: None, value: IlValue::Time(read_duration(value)?) });
    }
    if let Some(refused) = refused_type(prefix) {
        return Err(refused);
    }
    let Some(iec_type) = IecType::from_keyword(prefix) else {
        return Err(refusal(codes::IL_LITERAL, format!("`{prefix}#` is no prefix of a literal"), TYPES_HINT));
    };
    let value = match (&iec_type, value.to_ascii_uppercase().as_str()) {
        (IecType::Bool, "TRUE" | "1") => IlValue::Bool(true),
        (IecType::Bool, "FALSE" | "0") => IlValue::Bool(false),
        (IecType::Bool, _) => {
            return Err(refusal(
                codes::IL_LITERAL,
                format!("`{text}` is no BOOL"),
                "write TRUE, FALSE, BOOL#1 or BOOL#0",
            ));
        }
        _ => read_integer(value)?,
    };
    Ok(IlLiteral { prefix: Some(iec_type), value })
}

const NUMBER_HINT: &str = "write a number such as 450, -3, 1_000, 2#1010, 8#17 or 16#A5";

/// Reads a number of any base. `_` separates digits.
fn read_integer(text: &str) -> Result<IlValue, LiteralRefusal> {
    let malformed = || refusal(codes::IL_LITERAL, format!("`{text}` is no number"), NUMBER_HINT);
    let unsigned = text.trim_start_matches(['-', '+']);
    let is_real = |c: char| matches!(c, '.' | 'e' | 'E');
    if !unsigned.contains('#')
        && unsigned.contains(is_real)
        && unsigned.chars().all(|c| c.is_ascii_digit() || matches!(c, '_' | '-' | '+') || is_real(c))
    {
        let hint = "numbers have no fraction and no exponent: scale the value to an integer";
        return Err(refusal(codes::IL_REFUSED_TYPE, format!("the type REAL is not supported: `{text}`"), hint));
    }
    let (base, digits) = match unsigned.split_once('#') {
        Some((base @ ("2" | "8" | "16"), digits)) if unsigned.len() == text.len() => {
            (base.parse().unwrap_or(10), digits)
        }
        Some(_) => return Err(malformed()),
        None => (10, unsigned),
    };
    let is_separated = !digits.starts_with('_') && !digits.ends_with('_') && !digits.contains("__");
    let plain: String = digits.chars().filter(|c| *c != '_').collect();
    if !is_separated || plain.is_empty() || !plain.chars().all(|c| c.is_digit(base)) {
        return Err(malformed());
    }
    let too_large = || refusal(codes::IL_LITERAL, format!("`{text}` has more than 63 bits"), NUMBER_HINT);
    let value = i64::from_str_radix(&plain, base).map_err(|_| too_large())?;
    Ok(IlValue::Integer { value: if text.starts_with('-') { -value } else { value }, base })
}

/// Units of a duration in nanoseconds, the largest first.
const UNITS: [(&str, i64); 7] = [
    ("d", 86_400_000_000_000),
    ("h", 3_600_000_000_000),
    ("m", 60_000_000_000),
    ("s", 1_000_000_000),
    ("ms", 1_000_000),
    ("us", 1_000),
    ("ns", 1),
];

const TIME_HINT: &str = "write units from the largest to the smallest, each once, such as T#1d2h3m4s5ms6us7ns; the last may have a fraction";

/// Reads a duration after `T#` in nanoseconds. Only the first unit may exceed its range (`T#90m`, not
/// `T#1h90m`).
fn read_duration(text: &str) -> Result<i64, LiteralRefusal> {
    let malformed = |why: &str| refusal(codes::IL_DURATION, format!("`T#{text}` is no duration: {why}"), TIME_HINT);
    let lower = text.to_ascii_lowercase();
    let mut rest = lower.trim_start_matches(['-', '+']);
    let mut total: i128 = 0;
    let mut last_unit: Option<usize> = None;
    let mut has_fraction = false;
    while !rest.is_empty() {
        let number_length = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let (number, after) = rest.split_at(number_length);
        let unit_length = after.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(after.len());
        let (unit, after) = after.split_at(unit_length);
        rest = after.strip_prefix('_').unwrap_or(after);
        if rest.is_empty() && after.len() == 1 {
            return Err(malformed("it ends with `_`"));
        }
        if number.is_empty() {
            return Err(malformed("a number is missing"));
        }
        let Some(index) = UNITS.iter().position(|(name, _)| *name == unit) else {
            return Err(malformed(if unit.is_empty() { "a unit is missing" } else { "the unit is unknown" }));
        };
        if has_fraction {
            return Err(malformed("only the last unit may have a fraction"));
        }
        if last_unit.is_some_and(|last| last >= index) {
            return Err(malformed("the units are not in order"));
        }
        let nanoseconds = scaled(number, UNITS[index].1).ok_or_else(|| malformed("the number is malformed"))?;
        if last_unit.is_some_and(|last| nanoseconds >= i128::from(UNITS[index - 1].1) && last < index) {
            return Err(malformed(&format!("`{number}{unit}` exceeds the range of its unit")));
        }
        has_fraction = number.contains('.');
        total += nanoseconds;
        last_unit = Some(index);
    }
    if last_unit.is_none() {
        return Err(malformed("it is empty"));
    }
    let total = if lower.starts_with('-') { -total } else { total };
    i64::try_from(total).map_err(|_| malformed("it is longer than 292 years"))
}

/// Returns `number` (with an optional fraction) times `unit`, exactly; `None` if it is malformed, too large
/// or has a part below a nanosecond.
fn scaled(number: &str, unit: i64) -> Option<i128> {
    let (whole, fraction) = number.split_once('.').unwrap_or((number, "0"));
    if whole.is_empty() || fraction.is_empty() || whole.len() > 20 || fraction.len() > 15 || fraction.contains('.') {
        return None;
    }
    let scale = 10_i128.pow(u32::try_from(fraction.len()).ok()?);
    let part = fraction.parse::<i128>().ok()? * i128::from(unit);
    (part % scale == 0).then_some(whole.parse::<i128>().ok()? * i128::from(unit) + part / scale)
}

/// Formats a literal in its canonical form.
pub(super) fn literal_text(literal: &IlLiteral) -> String {
    let value = match literal.value {
        IlValue::Bool(value) => if value { "TRUE" } else { "FALSE" }.to_owned(),
        IlValue::Integer { value, base: 2 } => format!("2#{value:b}"),
        IlValue::Integer { value, base: 8 } => format!("8#{value:o}"),
        IlValue::Integer { value, base: 16 } => format!("16#{value:X}"),
        IlValue::Integer { value, .. } => value.to_string(),
        IlValue::Time(nanoseconds) => duration_text(nanoseconds),
    };
    match &literal.prefix {
        Some(prefix) => format!("{}#{value}", prefix.keyword()),
        None => value,
    }
}

fn duration_text(nanoseconds: i64) -> String {
    let mut text = if nanoseconds < 0 { "T#-" } else { "T#" }.to_owned();
    let mut rest = nanoseconds.unsigned_abs();
    for (unit, size) in UNITS {
        let number = rest / size.unsigned_abs();
        rest %= size.unsigned_abs();
        if number > 0 {
            text += &format!("{number}{unit}");
        }
    }
    if nanoseconds == 0 {
        text += "0s";
    }
    text
}

const ADDRESS_HINT: &str = "write %, an area (I, Q or M), a size (X, B, W, D or none) and numbers: %IX0.3, %QW5";

/// Reads a direct address: at most 8 numbers.
pub(super) fn read_address(text: &str) -> Result<DirectAddress, LiteralRefusal> {
    let malformed = || refusal(codes::IL_ADDRESS, format!("`{text}` is no direct address"), ADDRESS_HINT);
    let mut letters = text.strip_prefix('%').unwrap_or(text);
    let area = match letters.chars().next().map(|c| c.to_ascii_uppercase()) {
        Some('I') => AddressArea::Input,
        Some('Q') => AddressArea::Output,
        Some('M') => AddressArea::Memory,
        _ => return Err(malformed()),
    };
    letters = &letters[1..];
    let size = match letters.chars().next().map(|c| c.to_ascii_uppercase()) {
        Some('X') => Some(AddressSize::Bit),
        Some('B') => Some(AddressSize::Byte),
        Some('W') => Some(AddressSize::Word),
        Some('D') => Some(AddressSize::Double),
        Some('L') => return Err(refusal(codes::IL_ADDRESS, format!("`{text}` has 64 bits"), ADDRESS_HINT)),
        Some('*') => return Err(refusal(codes::IL_ADDRESS, format!("`{text}` has no place yet"), ADDRESS_HINT)),
        _ => None,
    };
    let numbers: Vec<&str> = letters[usize::from(size.is_some())..].split('.').collect();
    if numbers.len() > 8 || !numbers.iter().all(|n| !n.is_empty() && n.chars().all(|c| c.is_ascii_digit())) {
        return Err(malformed());
    }
    let path: Result<Vec<u32>, _> = numbers.iter().map(|n| n.parse()).collect();
    Ok(DirectAddress { area, size, path: path.map_err(|_| malformed())? })
}

/// Formats a direct address in capitals.
pub(super) fn address_text(address: &DirectAddress) -> String {
    let area = match address.area {
        AddressArea::Input => "I",
        AddressArea::Output => "Q",
        AddressArea::Memory => "M",
    };
    let size = match address.size {
        None => "",
        Some(AddressSize::Bit) => "X",
        Some(AddressSize::Byte) => "B",
        Some(AddressSize::Word) => "W",
        Some(AddressSize::Double) => "D",
    };
    let path: Vec<String> = address.path.iter().map(u32::to_string).collect();
    format!("%{area}{size}{}", path.join("."))
}
