//! Converts TOML values to numbers and comparisons, and names their types in messages.

use toml::de::DeValue;

use crate::model::{Comparison, ScenarioValue};
use crate::parse::LocatedItem;
use crate::time::message_text;

/// Parses a comparison: `5`, `> 5`, `>= 5`, `< 5`, `<= 5`, `!= 5`, `3..7`, `z`.
pub(crate) fn parse_comparison(value: &ScenarioValue) -> Option<Comparison> {
    let text = match value {
        ScenarioValue::Number(number) => return Some(Comparison::Equal(*number)),
        ScenarioValue::Text(text) => text.trim(),
    };
    let read = |text: &str| -> Option<i64> {
        let text = text.trim();
        text.strip_prefix("0x").map_or_else(|| text.parse().ok(), |hex| i64::from_str_radix(hex, 16).ok())
    };
    if text.eq_ignore_ascii_case("z") {
        return Some(Comparison::Floating);
    }
    if let Some((from, to)) = text.split_once("..") {
        return Some(Comparison::Within(read(from)?, read(to)?))
            .filter(|c| matches!(c, Comparison::Within(a, b) if a <= b));
    }
    // Longer operators first.
    let sign = ["!=", ">=", "<=", "==", ">", "<", "="].into_iter().find(|sign| text.starts_with(sign));
    let number = read(text.get(sign.map_or(0, str::len)..)?)?;
    Some(match sign {
        Some("!=") => Comparison::NotEqual(number),
        Some(">=") => Comparison::Within(number, i64::MAX),
        Some("<=") => Comparison::Within(i64::MIN, number),
        Some(">") => Comparison::Within(number.checked_add(1)?, i64::MAX),
        Some("<") => Comparison::Within(i64::MIN, number.checked_sub(1)?),
        _ => Comparison::Equal(number),
    })
}

/// A 64-bit integer.
pub(crate) fn parse_number(item: &LocatedItem<'_>) -> Option<i64> {
    let DeValue::Integer(number) = item.get_ref() else { return None };
    i64::from_str_radix(number.as_str(), number.radix()).ok()
}

/// A TOML value or its type, for messages.
pub(crate) fn kind_name(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) if text.is_empty() => "an empty text".to_owned(),
        DeValue::Array(items) if items.is_empty() => "an empty list".to_owned(),
        DeValue::Table(entries) if entries.is_empty() => "an empty table".to_owned(),
        DeValue::String(text) => format!("\"{}\"", message_text(text)),
        DeValue::Integer(number) => message_text(number.as_str()),
        DeValue::Float(number) => message_text(number.as_str()),
        DeValue::Boolean(bit) => bit.to_string(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    }
}
