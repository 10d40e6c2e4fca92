//! Readers of the elements with a counted list of arguments: the two tables, STRING and FORMATTED_STRING.

use std::ops::RangeInclusive;

use diag::Severity;

use crate::codes;
use crate::element_keywords::ElementKeyword;
use crate::element_reader::{join_positions, read_destination, read_operand};
use crate::lexer::{self, LdLine, LdToken};
use crate::model::{CurvePoint, Element, LadderDialect};
use crate::reader::{LdReader, message_text};

/// Maximum number of values of a look-up table, of points of a curve, and of characters of a string.
const MAX_VALUES: u32 = 1024;

/// Reads LOOK_UP_TABLE: destination, index, count and flag, then the values.
pub(crate) fn read_look_up_table(
    r: &mut LdReader<'_>,
    row: &ElementKeyword,
    head: [LdToken<'_>; 4],
    values: &[LdToken<'_>],
) -> Option<Element> {
    let [dest, index, count, flag] = head;
    let (dest, at) = (read_destination(r, row.0, dest), read_operand(r, row.0, index));
    let as_string = r.read_flag(flag, "the flag `as_string`");
    let wanted = r.read_u32(count, "the number of values", 0, MAX_VALUES);
    let range = r.constant_range();
    let (values, name) = split_name(wanted, values);
    let values = read_counted_values(r, row, count, wanted, values, "a value of the table", range);
    Some(Element::LookUpTable { dest: dest?, index: at?, as_string: as_string? == 1, values: values?, name })
}

/// Reads PIECEWISE_LINEAR: destination, index and count, then the coordinates of the points.
pub(crate) fn read_piecewise_linear(
    r: &mut LdReader<'_>,
    row: &ElementKeyword,
    head: [LdToken<'_>; 3],
    values: &[LdToken<'_>],
) -> Option<Element> {
    let [dest, index, count] = head;
    let (dest, at) = (read_destination(r, row.0, dest), read_operand(r, row.0, index));
    let wanted = r.read_u32(count, "the number of points", 0, MAX_VALUES).map(|n| 2 * n);
    let range = r.constant_range();
    let (values, name) = split_name(wanted, values);
    let values = read_counted_values(r, row, count, wanted, values, "a coordinate", range);
    let points = values?.chunks_exact(2).filter_map(|p| Some(CurvePoint { x: *p.first()?, y: *p.get(1)? })).collect();
    Some(Element::PiecewiseLinear { dest: dest?, index: at?, points, name })
}

/// Splits off the name that LDmicro 5 writes after the last value of a table.
fn split_name<'t, 'a>(wanted: Option<u32>, values: &'t [LdToken<'a>]) -> (&'t [LdToken<'a>], Option<String>) {
    match values.split_last() {
        Some((last, front)) if wanted == Some(front.len() as u32) && lexer::is_name(last.text) => {
            (front, Some(last.text.to_owned()))
        }
        _ => (values, None),
    }
}

/// Reads STRING: a text variable or `(none)`, then the arguments of FORMATTED_STRING.
pub(crate) fn read_text(
    r: &mut LdReader<'_>,
    line: &LdLine<'_>,
    row: &ElementKeyword,
    dest: LdToken<'_>,
    rest: &[LdToken<'_>],
) -> Option<Element> {
    let dest = Some(dest.text).filter(|name| *name != "(none)").map(str::to_owned);
    let (var, rest) = rest.split_first()?;
    match read_formatted_string(r, line, row, *var, rest)? {
        Element::FormattedString { var, text, quoted } => Some(Element::Text { dest, var, text, quoted }),
        _ => None,
    }
}

/// Reads the code of a character, which may be negative: where a character is a signed byte, LDmicro writes
/// letters beyond ASCII as -128 to -1. Release 2.3 reads them as control characters, LDmicro 5 as letters.
fn read_character_code(r: &mut LdReader<'_>, token: LdToken<'_>) -> Option<u8> {
    let code = r.read_number(token, "a character code", -128, 255)?;
    if code < 0 {
        let is_ldmicro5 = r.dialect == LadderDialect::Ldmicro5;
        let severity = if is_ldmicro5 { Severity::Note } else { Severity::Warning };
        let meant = if is_ldmicro5 { code + 256 } else { i64::from(b'X') };
        let cause = format!("the character code {code} is read as {meant}");
        let hint = format!("write {}", code + 256);
        r.report(severity, codes::OUT_OF_RANGE, token.pos, cause, hint);
        return u8::try_from(meant).ok();
    }
    u8::try_from(code).ok()
}

/// Reads FORMATTED_STRING: a variable or `(none)`, then character codes or a quoted text.
pub(crate) fn read_formatted_string(
    r: &mut LdReader<'_>,
    line: &LdLine<'_>,
    row: &ElementKeyword,
    var: LdToken<'_>,
    rest: &[LdToken<'_>],
) -> Option<Element> {
    let name = match var.text {
        "(none)" => Some(None),
        _ => r.read_integer_name(row.0, var).map(Some),
    };
    let (first, codes_read) = rest.split_first()?;
    if !first.text.starts_with(['"', '-']) && !first.text.starts_with(|c: char| c.is_ascii_digit()) {
        let cause =
            format!("`{}` is neither a text between quotes nor the number of its characters", message_text(first.text));
        r.error(codes::BAD_STRING, first.pos, cause, format!("write {}", row.3));
        return None;
    }
    if !first.text.starts_with('"') {
        let wanted = r.read_u32(*first, "the length", 0, MAX_VALUES);
        let read: Vec<Option<u8>> = codes_read.iter().map(|t| read_character_code(r, *t)).collect();
        check_value_count(r, row, *first, wanted, codes_read)?;
        let text = read.into_iter().map(|code| code.map(char::from)).collect::<Option<_>>()?;
        return Some(Element::FormattedString { var: name?, text, quoted: false });
    }
    let raw = line.text.get(first.byte_offset + 1..).unwrap_or("");
    let whole = join_positions(first.pos, rest.last().unwrap_or(first).pos);
    let Some(end) = raw.rfind('"') else {
        r.error(codes::BAD_STRING, whole, "the text has no closing double quote", format!("write {}", row.3));
        return None;
    };
    let (text, after) = raw.split_at_checked(end)?;
    if after.len() > 1 {
        let cause = format!("`{}` follows the text", message_text(after.get(1..).unwrap_or("").trim()));
        r.error(codes::TOO_MANY, whole, cause, format!("write {}", row.3));
        return None;
    }
    Some(Element::FormattedString { var: name?, text: text.to_owned(), quoted: true })
}

/// Reads exactly the announced number of values.
///
/// `wanted` is `None` when the count itself was invalid; then the values are read only to report their
/// errors.
fn read_counted_values(
    r: &mut LdReader<'_>,
    row: &ElementKeyword,
    count: LdToken<'_>,
    wanted: Option<u32>,
    values: &[LdToken<'_>],
    what: &str,
    range: RangeInclusive<i64>,
) -> Option<Vec<i64>> {
    let (low, high) = range.into_inner();
    let read: Vec<Option<i64>> = values.iter().map(|t| r.read_constant(*t, what, low, high)).collect();
    check_value_count(r, row, count, wanted, values)?;
    read.into_iter().collect()
}

/// Checks that there are as many values as announced.
fn check_value_count(
    r: &mut LdReader<'_>,
    row: &ElementKeyword,
    count: LdToken<'_>,
    wanted: Option<u32>,
    values: &[LdToken<'_>],
) -> Option<()> {
    let wanted = wanted? as usize;
    let cause = format!("{} announces {wanted} number(s), found {}", row.0, values.len());
    if values.len() < wanted {
        r.error(codes::TOO_FEW, count.pos, cause, format!("write {}", row.3));
        return None;
    }
    if let Some(extra) = values.get(wanted) {
        r.error(codes::TOO_MANY, extra.pos, cause, format!("write {}", row.3));
        return None;
    }
    Some(())
}
