//! Commands about values: print, set, display, assert.

use emu_core::pins::{CycleTime, PinId};
use emu_debug::address_names::decimal_offset;
use emu_debug::debug::{
    BinaryOperator, DebugExpression, DynMachine, ExpressionPlace, ExpressionValue, ObjectExpr, UserAction, c_text,
};
use emu_debug::number_formats::format_number;
use emu_debug::stimulus::{TimedDrive, parse_drive};

use super::command_error::CommandError;
use super::examine;
use super::numbers::{ExamineFormat, hex};
use super::settings::{print_options, set_setting};
use super::shell::{CommandResult, DebugShell};
use crate::shared::avr;

/// Reason why a quotient has no value.
const DIVISION_BY_ZERO: &str = "a division by 0";

/// Explains why an expression has no value now. Returns `None` if it has one.
fn missing_value_reason(expr: &DebugExpression, target: &dyn DynMachine) -> Option<&'static str> {
    if expr.value(target).is_some() {
        return None;
    }
    let is_real = |of: &DebugExpression| matches!(of.evaluate(target), Some(ExpressionValue::Real(..)));
    Some(match expr {
        DebugExpression::Bit(of, _) | DebugExpression::Unary(_, of) if is_real(of) => {
            "a floating-point number has no bits to compute with"
        }
        DebugExpression::Object(object) if !object.is_scalar() => "a struct, or an array that is not in memory",
        DebugExpression::Place(ExpressionPlace::Pin(_)) => "a pin that floats",
        DebugExpression::Bit(of, _) | DebugExpression::Unary(_, of) => return missing_value_reason(of, target),
        DebugExpression::Binary(operator, a, b) => {
            let of_these = missing_value_reason(a, target).or_else(|| missing_value_reason(b, target));
            return of_these.or(Some(match operator {
                _ if is_real(a) || is_real(b) => "that operator does not accept floating-point numbers",
                BinaryOperator::Shl | BinaryOperator::Shr => "a shift count outside 0 to 63",
                _ if b.value(target) == Some(0) => DIVISION_BY_ZERO,
                _ => "a quotient that is too large",
            }));
        }
        _ => "memory that does not exist",
    })
}

/// `print`: prints the value of an expression.
pub(super) fn print(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let settings = shell.session.scope.print;
    let done = print_options(&mut shell.session.scope.print, args).and_then(|args| print_value(shell, args, out));
    shell.session.scope.print = settings;
    done
}

fn print_value(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (mut format, text) = ExamineFormat::parse_front(args)?;
    let empty = shell.session.scope.values.is_empty();
    let text = if text.is_empty() && !empty { "$" } else { text };
    if text.is_empty() {
        return Err("the expression is missing: print r16, print buf, print $cycle / 2".into());
    }
    let typed = format.letter == Some('s') && shell.parse_expression(text).is_ok_and(|expr| expr.object().is_some());
    if typed {
        format.letter = None;
    } else if matches!(format.letter, Some('s' | 'i')) {
        return examine::examine(shell, args, out);
    }
    let (value, kept) = shell.printed(text, format, out)?;
    let number = shell.session.scope.values.push(kept);
    out.push_str(&format!("${number} = {value}\n"));
    Ok(())
}

/// `call`: evaluates and prints like `print`; functions of the program are not called.
pub(super) fn call(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("the expression is missing: call x = 5; functions of the program are not called".into());
    }
    print(shell, args, out)
}

/// Splits `PLACE = VALUE` or `PLACE += VALUE` into the place and the new value as an expression. Returns
/// `None` if the `=` is part of another operator.
fn split_assignment(text: &str) -> Option<(&str, String)> {
    let (place, value) = split_top(text, "=")?;
    if value.starts_with('=')
        || place.ends_with(['=', '!', '<', '>']) && !place.ends_with("<<") && !place.ends_with(">>")
    {
        return None;
    }
    let operators = ["<<", ">>", "+", "-", "*", "/", "%", "&", "|", "^"];
    let found = operators.iter().find_map(|sign| Some((place.strip_suffix(sign)?, sign)));
    let (place, value) = match found {
        Some((place, sign)) => (place.trim(), format!("{} {sign} ({})", place.trim(), value.trim())),
        None => (place.trim(), value.trim().to_owned()),
    };
    (!place.is_empty()).then_some((place, value))
}

/// Splits a text at the first `sign` outside of brackets and quotes.
fn split_top<'a>(text: &'a str, sign: &str) -> Option<(&'a str, &'a str)> {
    let (mut depth, mut quote, mut escaped) = (0i32, None, false);
    for (at, c) in text.char_indices() {
        match quote {
            Some(open) => {
                if c == open && !escaped {
                    quote = None;
                }
                escaped = c == '\\' && !escaped;
            }
            None if depth == 0 && text[at..].starts_with(sign) => return Some((&text[..at], &text[at + sign.len()..])),
            None => match c {
                '"' | '\'' => quote = Some(c),
                '(' | '[' | '{' => depth += 1,
                ')' | ']' | '}' => depth -= 1,
                _ => {}
            },
        }
    }
    None
}

/// An expression that also increments or decrements a place: `x++`, `*p++`, `--x`, `*--p`.
struct CountedExpression<'a> {
    /// Operators in front of the place, such as `*`; they apply to its value.
    operators: &'a str,
    place: &'a str,
    sign: char,
    /// The place is changed before its value is read.
    first: bool,
}

impl CountedExpression<'_> {
    fn value_text(&self) -> String {
        format!("{}{}", self.operators, self.place)
    }
}

/// Parses an expression that increments or decrements a place, with the precedence of C: `*p++` changes `p`.
fn counted(text: &str) -> Option<CountedExpression<'_>> {
    let text = text.trim();
    let split_operators = |text: &str| text.len() - text.trim_start_matches(['*', '&', '!', '~', ' ']).len();
    ['+', '-'].into_iter().find_map(|sign| {
        let twice = format!("{sign}{sign}");
        let (operators, rest) = text.split_at(split_operators(text));
        if let Some(place) = rest.strip_prefix(&twice) {
            return Some(CountedExpression { operators, place: place.trim(), sign, first: true });
        }
        // A leading minus is an operator, too.
        let at = text.len() - text.trim_start_matches(['*', '&', '!', '~', '-', ' ']).len();
        let (operators, rest) = text.split_at(at);
        let place = rest.strip_suffix(&twice)?.trim();
        // After a cast, the place does not begin at the start of the text.
        (!place.starts_with('(')).then_some(CountedExpression { operators, place, sign, first: false })
    })
}

impl DebugShell {
    /// Returns the value of an expression as text and for the value history; `x = 5` and `x++` assign first.
    fn printed(
        &mut self,
        text: &str,
        format: ExamineFormat,
        out: &mut String,
    ) -> Result<(String, Option<DebugExpression>), CommandError> {
        if split_top(text, ",").is_none()
            && let Some((place, value)) = split_assignment(text)
        {
            set(self, &format!("{place} = {value}"), out)?;
            return self.single(place, format);
        }
        if let Some(counted) = counted(text).filter(|counted| self.parse_expression(counted.place).is_ok()) {
            let (place, sign) = (counted.place, counted.sign);
            let old = self.single(&counted.value_text(), format)?;
            set(self, &format!("{place} = {place} {sign} 1"), out)?;
            return if counted.first { self.single(&counted.value_text(), format) } else { Ok(old) };
        }
        // The value of `p a = 1, b = 2` is that of the last part.
        if let Some((first, last)) = split_top(text, ",") {
            self.printed(first, format, out)?;
            return self.printed(last, format, out);
        }
        // `p *buffer@4` prints that many elements as an array.
        if let Some((first, count)) = text.rsplit_once('@')
            && let DebugExpression::Object(object) = self.parse_expression(first)?
        {
            let count = self.parse_count(count)?;
            return Ok((object.array_text(count, &self.session.scope, self.session.machine(), format.letter)?, None));
        }
        self.single(text, format)
    }

    fn single(&self, text: &str, format: ExamineFormat) -> Result<(String, Option<DebugExpression>), CommandError> {
        if self.is_void(text) {
            return Ok(("void".to_owned(), Some(self.session.scope.void_value())));
        }
        let expr = self.parse_expression(text)?;
        if let Some(shown) = self.frame_register_text(text, &expr).filter(|_| format.letter.is_none()) {
            return Ok((shown, expr.kept(self.session.machine())));
        }
        let expr = self.session.scope.with_type(expr);
        self.check_type_is_known(text, &expr)?;
        if missing_value_reason(&expr, self.session.machine()) == Some(DIVISION_BY_ZERO) {
            return Err("Division by zero".into());
        }
        Ok((self.value_text(&expr, format), expr.kept(self.session.machine())))
    }

    /// Returns the value of an expression as text: in hex and in decimal if they differ, or in a given
    /// format.
    pub(super) fn value_text(&self, expr: &DebugExpression, format: ExamineFormat) -> String {
        let target = self.session.machine();
        if let DebugExpression::Text(text) = expr {
            return c_text(text);
        }
        if let DebugExpression::Choice(parts) = expr {
            let [condition, then, otherwise] = &**parts;
            return match condition.evaluate(target) {
                Some(value) => self.value_text(if value.is_true() { then } else { otherwise }, format),
                None => "nothing".to_owned(),
            };
        }
        if let Some(object) = expr.object() {
            return object.text(&self.session.scope, target, format.letter);
        }
        let place = expr.place(target);
        let Some(value) = expr.value(target) else {
            return match missing_value_reason(expr, target) {
                Some(_) if matches!(place, Some(ExpressionPlace::Pin(_))) => "floats".to_owned(),
                Some(why) => format!("nothing: {why}"),
                None => "nothing".to_owned(),
            };
        };
        if let (None, Some(amount @ ExpressionValue::Real(..))) = (format.letter, expr.evaluate(target)) {
            return amount.text();
        }
        if format.letter.is_none()
            && let Some(text) = self.core_register_text(place, value)
        {
            return text;
        }
        let bytes = match place {
            Some(ExpressionPlace::Memory { bytes, .. }) => bytes.into(),
            Some(ExpressionPlace::Bit { .. } | ExpressionPlace::RegBit { .. } | ExpressionPlace::Reg(_)) => 1,
            // Computed values and counters have their own sign.
            _ if format.letter != Some('d') && (0..0x1_0000).contains(&value) => 2,
            _ => 8,
        };
        let bytes = if value > 0xFF && bytes == 1 { 2 } else { bytes };
        match format.letter {
            Some('a') => match u32::try_from(value).ok().and_then(|address| self.program_word(address)) {
                Some(word) => self.session.scope.source().describe_word(word),
                None => hex(value, 2),
            },
            Some('f') => value.to_string(),
            Some(letter) => format_number(value, letter, bytes, false).unwrap_or_else(|| value.to_string()),
            None if place == Some(ExpressionPlace::Pc) => {
                match u32::try_from(value).ok().and_then(|address| self.program_word(address)) {
                    Some(word) => self.session.scope.source().describe_word(word),
                    None => hex(value, 4),
                }
            }
            None if (0..10).contains(&value) => value.to_string(),
            None if matches!(place, Some(ExpressionPlace::Cycle | ExpressionPlace::Instructions)) => value.to_string(),
            None => format!("{} ({value})", hex(value, 2)),
        }
    }

    /// Returns the value of a core register as gdb prints it, for a C program on an AVR.
    fn core_register_text(&self, place: Option<ExpressionPlace>, value: i64) -> Option<String> {
        let (scope, chip) = (&self.session.scope, self.session.scope.chip());
        if !chip.is_known_to_gdb() || !scope.has_debug_info() {
            return None;
        }
        match place? {
            ExpressionPlace::Pc => Some(format!("(void (*)()) {}", self.natural_register_text("pc", value))),
            ExpressionPlace::Reg("SP") => Some(format!("(void *) {}", self.natural_register_text("sp", value))),
            ExpressionPlace::Reg(_) => Some(value.to_string()),
            _ => None,
        }
    }

    /// Returns the value of `$pc`, `$sp` or `$r28` of a calling frame as that of the machine's register.
    fn frame_register_text(&self, text: &str, expr: &DebugExpression) -> Option<String> {
        let name = text.trim().strip_prefix('$').filter(|_| self.level > 0)?.to_ascii_lowercase();
        let place = match name.as_str() {
            "pc" => ExpressionPlace::Pc,
            "sp" => ExpressionPlace::Reg("SP"),
            _ if name.strip_prefix('r').is_some_and(|number| number.parse::<u8>().is_ok()) => ExpressionPlace::Reg("R"),
            _ => return None,
        };
        self.core_register_text(Some(place), expr.value(self.session.machine())?)
    }

    /// Returns the value of a register in decimal, or as an address if it holds one.
    pub(super) fn natural_register_text(&self, name: &str, value: i64) -> String {
        let (scope, chip) = (&self.session.scope, self.session.scope.chip());
        match name.to_ascii_lowercase().as_str() {
            "pc" => {
                let byte = u32::try_from(value).ok().and_then(|address| self.program_word(address));
                let symbol = byte.and_then(|word| scope.source().names.nearest_symbol(word * chip.word_bytes));
                let symbol = symbol.map_or(String::new(), |name| format!(" <{}>", decimal_offset(&name)));
                format!("0x{value:x}{symbol}")
            }
            "sp" if let Some(base) = chip.family_traits().linked_data => format!("0x{:x}", value + i64::from(base)),
            _ => value.to_string(),
        }
    }

    /// Returns true if a text is an undefined name with `$`, which is `void` in a C program, as in gdb.
    pub(super) fn is_void(&self, text: &str) -> bool {
        let is_name = |name: &str| {
            name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
                && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        };
        self.session.scope.has_debug_info()
            && text.trim().strip_prefix('$').is_some_and(is_name)
            && self.parse_expression(text.trim()).is_err()
    }

    /// Converts an address as users write it to a program word. Returns `None` outside of program memory.
    pub(super) fn program_word(&self, address: u32) -> Option<u32> {
        let chip = self.session.scope.chip();
        let word = address / chip.code_address(1).max(1);
        (word < chip.flash_bytes / chip.word_bytes.max(1)).then_some(word)
    }
}

/// `set`: changes a place, a pin, the supply or a setting.
pub(super) fn set(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let wanted = || "write a place and a value: set r16 = 5, set PB0 = 1, set VCC=4.5V".to_owned();
    // `set var x = 1`, as in gdb.
    let args = ["var ", "variable "].iter().find_map(|word| args.strip_prefix(word)).unwrap_or(args);
    if !args.contains('=') && set_setting(shell, args, out)? {
        return Ok(());
    }
    if let Some(CountedExpression { place, sign, .. }) = counted(args) {
        return set(shell, &format!("{place} = {place} {sign} 1"), out);
    }
    let (name, value) = split_assignment(args).ok_or_else(wanted)?;
    let value = value.trim();
    // `a = b = 5`: the inner assignment is executed first, then its place has the value.
    let inner = split_assignment(value);
    let value = match &inner {
        Some((place, _)) => {
            set(shell, value, out)?;
            place
        }
        None => value,
    };
    if let Some(own) =
        name.strip_prefix('$').filter(|_| shell.parse_expression(name).map_or(true, |expr| expr.is_constant()))
    {
        return shell.remember(own, value);
    }
    // An input of a ladder program is set at its pin: every scan overwrites the memory where it is latched.
    let own = shell.view.as_ref().map_or_else(|| name.to_owned(), |view| view.pin_assignment(name));
    let name = own.as_str();
    if name.is_empty() || value.is_empty() || value.starts_with('=') {
        return Err(wanted().into());
    }
    let scope = &shell.session.scope;
    let chip = scope.chip();
    let text = avr::chip_pin_text(chip, &scope.source().names.replace_channel_name(&format!("{name}={value}")));
    let pin = find_pin(shell, name);
    // Levels, resistors and voltages are applied to pins and to the supply as by `--set`.
    let expr = shell.parse_expression(name);
    if pin.is_some() || expr.is_err() {
        let value = if pin.is_some() {
            shell.integer_value(value).map_or(value.to_owned(), |value| value.to_string())
        } else {
            String::new()
        };
        let text = match pin {
            Some(pin) => format!("{}={value}", chip.pins.get(usize::from(pin)).map_or("", |pin| pin.name)),
            None => text,
        };
        return match parse_drive(chip, &text) {
            Ok(what) => {
                let at = CycleTime::at(shell.session.machine().cycle());
                Ok(shell.session.apply_action(UserAction::Drive(TimedDrive { at, drive: what }))?)
            }
            Err(why) if pin.is_some() || is_supply(name) => Err(why.into()),
            Err(_) => Err(expr.err().unwrap_or_default()),
        };
    }
    let expr = expr?;
    let place = expr.place(shell.session.machine());
    if place.is_none() && expr.object().is_none_or(ObjectExpr::is_computed) {
        return Err(format!("`{name}` cannot be set").into());
    }
    let is_code = |expr: &DebugExpression| expr.object().is_some_and(|of| of.is_function() || of.is_function_pointer());
    let evaluate = match is_code(&expr) {
        // A pointer to a function counts words, but code addresses are written in bytes, as they are printed.
        true => ExpressionValue::Whole(shell.integer_value(value)? / i64::from(chip.word_bytes.max(1))),
        false => shell.expression_value(value)?,
    };
    shell.session.assign(&expr, evaluate)?;
    shell.registers = shell.core_registers();
    if place == Some(ExpressionPlace::Pc) {
        shell.report_position(out);
    }
    Ok(())
}

impl DebugShell {
    /// Refuses a symbol alone whose type the debugging information of a C program does not contain, as gdb
    /// does.
    fn check_type_is_known(&self, text: &str, expr: &DebugExpression) -> CommandResult {
        let (scope, name) = (&self.session.scope, text.trim());
        if expr.object().is_some_and(ObjectExpr::has_unknown_type) {
            return Err(format!("'{name}' has unknown type; cast it to its declared type").into());
        }
        let DebugExpression::Place(ExpressionPlace::Memory { space, .. }) = expr else { return Ok(()) };
        let chip = scope.chip();
        let is_symbol = *space == chip.ram_space
            && chip.reg(name).is_none()
            && self.view.is_none()
            && !name.contains("::")
            && !(chip.has_sdcc_pointers() && name.starts_with('_'))
            && scope.symbols.iter().any(|symbol| symbol.name == name);
        match is_symbol && !scope.calls().info.globals.is_empty() {
            true => Err(format!("'{name}' has unknown type; cast it to its declared type").into()),
            false => Ok(()),
        }
    }

    /// `set $i = 5`: sets a convenience variable.
    fn remember(&mut self, name: &str, value: &str) -> CommandResult {
        let is_name = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !is_name {
            return Err(format!("`${name}` cannot be set; a convenience variable has a name: set $i = 0").into());
        }
        let kept = self.parse_expression(value)?.kept(self.session.machine());
        let kept = kept.ok_or_else(|| format!("`{value}` has no value now"))?;
        self.session.scope.values.set(name, kept);
        Ok(())
    }
}

/// Returns true if a name is one of the names of the supply.
fn is_supply(name: &str) -> bool {
    ["VDD", "VCC"].iter().any(|supply| name.eq_ignore_ascii_case(supply))
}

/// Returns the pin with a given name.
fn find_pin(shell: &DebugShell, name: &str) -> Option<PinId> {
    match shell.parse_expression(name) {
        Ok(DebugExpression::Place(ExpressionPlace::Pin(pin))) => Some(pin),
        _ => None,
    }
}

/// `assert`: ends a script with a failure unless an expression is true.
pub(super) fn assert(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    if args.is_empty() {
        return Err("the expression is missing: assert PB5 == 1".into());
    }
    let (expr, target) = (shell.parse_expression(args)?, shell.session.machine());
    match expr.evaluate(target) {
        Some(value) if !value.is_true() => {
            Err(format!("the assertion does not hold at cycle {}: {args}", target.cycle()).into())
        }
        Some(_) => Ok(()),
        None => {
            let why = missing_value_reason(&expr, target).map_or(String::new(), |why| format!(" ({why})"));
            Err(format!("the assertion has no value at cycle {}: {args}{why}", target.cycle()).into())
        }
    }
}

impl DebugShell {
    /// Evaluates an expression and converts it to an integer.
    pub(super) fn integer_value(&self, text: &str) -> Result<i64, CommandError> {
        self.expression_value(text).map(ExpressionValue::to_integer)
    }

    /// Evaluates an expression.
    pub(super) fn expression_value(&self, text: &str) -> Result<ExpressionValue, CommandError> {
        let (expr, target) = (self.parse_expression(text)?, self.session.machine());
        expr.evaluate(target).ok_or_else(|| {
            let why = missing_value_reason(&expr, target).map_or(String::new(), |why| format!(": {why}"));
            format!("`{}` has no value now{why}", text.trim()).into()
        })
    }
}
