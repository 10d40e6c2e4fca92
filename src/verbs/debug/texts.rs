//! Commands that print texts, for scripts: echo, output, printf.

use emu_debug::debug::{DebugExpression, ExpressionValue};
use emu_debug::text_escapes::unescape;

use super::command_error::CommandError;
use super::numbers::ExamineFormat;
use super::shell::{CommandResult, DebugShell};

/// Maximum width of a field.
const MAX_FIELD_WIDTH: usize = 200;

/// Prints a text with its escapes resolved, always as a line of its own.
fn print_line(text: &str, out: &mut String) -> CommandResult {
    // A text with invalid escapes, such as a path, is printed unchanged.
    let bytes = unescape(text).unwrap_or_else(|_| text.as_bytes().to_vec());
    for part in String::from_utf8_lossy(&bytes).split_inclusive('\n') {
        let own = part.trim_end_matches('\n');
        out.push_str(&diag::text::printable(own));
        out.push_str(if own.len() < part.len() { "\n" } else { "" });
    }
    if bytes.is_empty() || !out.ends_with('\n') {
        out.push('\n');
    }
    Ok(())
}

/// `echo`: prints a text.
pub(super) fn echo(_: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    print_line(args, out)
}

/// `output`: prints a value without its name.
pub(super) fn output(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (format, text) = ExamineFormat::parse_front(args)?;
    if text.is_empty() {
        return Err("the expression is missing: output buf, output/x r16".into());
    }
    let value = shell.value_text(&shell.parse_expression(text)?, format);
    out.push_str(&format!("{value}\n"));
    Ok(())
}

/// `printf "text %d %s", EXPR, EXPR`: prints a text with values.
pub(super) fn printf(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let wanted = || "write printf \"%d of %d\\n\", i, count".to_owned();
    let inner = args.strip_prefix('"').ok_or_else(wanted)?;
    let mut escaped = false;
    let end = inner.find(|c: char| {
        let ends = c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        ends
    });
    let (text, rest) = inner.split_at(end.ok_or_else(wanted)?);
    let mut values = split_values(rest.get(1..).unwrap_or_default().trim_start().trim_start_matches(',')).into_iter();
    let (mut found, mut left) = (String::new(), text);
    while let Some((before, behind)) = left.split_once('%') {
        found.push_str(before);
        if let Some(behind) = behind.strip_prefix('%') {
            found.push('%');
            left = behind;
            continue;
        }
        let at = behind.find(|c: char| c.is_ascii_alphabetic() && !matches!(c, 'l' | 'h' | 'z'));
        let at = at.ok_or("a letter is missing after a %")?;
        let (flags, behind) = behind.split_at(at);
        let letter = behind.chars().next().unwrap_or('d');
        let value = values.next().ok_or("there are fewer values than %")?;
        found.push_str(&format_field(shell, flags.trim_end_matches(['l', 'h', 'z']), letter, &value)?);
        left = &behind[1..];
    }
    found.push_str(left);
    if values.next().is_some() {
        return Err("there are more values than %".into());
    }
    print_line(&found, out)
}

/// Splits values at commas; a comma in brackets or quotes is part of a value.
fn split_values(text: &str) -> Vec<String> {
    let (mut parts, mut depth, mut quoted) = (vec![String::new()], 0i32, false);
    for c in text.chars() {
        quoted ^= matches!(c, '\'' | '"');
        depth += i32::from(matches!(c, '(' | '[')) - i32::from(matches!(c, ')' | ']'));
        match parts.last_mut() {
            Some(_) if c == ',' && depth == 0 && !quoted => parts.push(String::new()),
            Some(last) => last.push(c),
            None => {}
        }
    }
    parts.retain(|part| !part.trim().is_empty());
    parts
}

/// Formats a value in a field.
fn format_field(shell: &DebugShell, flags: &str, letter: char, value: &str) -> Result<String, CommandError> {
    let amount = || shell.expression_value(value);
    let (width, digits) = flags.split_once('.').unwrap_or((flags, ""));
    let digits = digits.parse::<usize>().ok().map(|digits| digits.min(MAX_FIELD_WIDTH));
    let text = match letter {
        'd' | 'i' | 'u' => amount()?.to_integer().to_string(),
        'x' => format!("{:x}", amount()?.to_integer()),
        'X' => format!("{:X}", amount()?.to_integer()),
        'o' => format!("{:o}", amount()?.to_integer()),
        'p' => format!("0x{:x}", amount()?.to_integer()),
        'c' => char::from(amount()?.to_integer() as u8).to_string(),
        'f' => match amount()? {
            ExpressionValue::Whole(value) => format!("{:.*}", digits.unwrap_or(6), value as f64),
            ExpressionValue::Real(value, _) => format!("{value:.*}", digits.unwrap_or(6)),
        },
        'g' => amount()?.text(),
        's' => string_in_ram(shell, value)?,
        _ => return Err(format!("`%{letter}` is not a format; the formats are d i u x X o p c f g s").into()),
    };
    let left = width.contains('-');
    let zeros = width.trim_start_matches(['-', '+', ' ', '#']).starts_with('0') && !left;
    let wide = width.trim_start_matches(['-', '+', ' ', '#', '0']).parse::<usize>().unwrap_or(0).min(MAX_FIELD_WIDTH);
    Ok(match (left, zeros) {
        (true, _) => format!("{text:<wide$}"),
        // Zeros are inserted after the sign.
        (_, true) => {
            let (sign, number) = text.strip_prefix('-').map_or(("", &*text), |number| ("-", number));
            format!("{sign}{number:0>fill$}", fill = wide.saturating_sub(sign.len()))
        }
        _ => format!("{text:>wide$}"),
    })
}

/// Returns the string in RAM at the address that a value gives, up to its 0.
fn string_in_ram(shell: &DebugShell, value: &str) -> Result<String, CommandError> {
    let (chip, target) = (shell.session.scope.chip(), shell.session.machine());
    if let DebugExpression::Text(text) = shell.parse_expression(value)? {
        return Ok(String::from_utf8_lossy(&text).replace('\\', "\\\\"));
    }
    let start = u32::try_from(shell.integer_value(value)?).map_err(|_| format!("`{value}` is not an address"))?;
    let bytes = (0..MAX_FIELD_WIDTH as u32).map_while(|n| target.peek(chip.ram_space, start.checked_add(n)?));
    let bytes: Vec<u8> = bytes.take_while(|byte| *byte != 0).collect();
    // Backslashes of the string are characters, not escapes.
    Ok(String::from_utf8_lossy(&bytes).replace('\\', "\\\\"))
}
