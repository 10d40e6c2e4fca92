//! Commands about values: print, set, x, display, assert.

use emu_core::pins::{PinId, Time};
use emu_debug::Range;
use emu_debug::debug::{Action, Amount, Cell, Expr, Operator, Place, Target};
use emu_debug::numbers::shown;
use emu_debug::stimulus::{Drive, put};

use super::numbers::{Format, hex};
use super::shell::{Done, Shell};
use super::types;
use crate::avr;

/// Why an expression has no value now, where it is not what it is called.
fn missing(expr: &Expr, target: &dyn Target) -> Option<&'static str> {
    if expr.value(target).is_some() {
        return None;
    }
    let is_real = |of: &Expr| matches!(of.amount(target), Some(Amount::Real(..)));
    Some(match expr {
        Expr::Bit(of, _) | Expr::Unary(_, of) if is_real(of) => "a number with a point has no bits to compute with",
        Expr::Object(object) if !object.is_scalar() => "a struct, or an array that is in no memory",
        Expr::Place(Place::Pin(_)) => "a pin that floats",
        Expr::Bit(of, _) | Expr::Unary(_, of) => return missing(of, target),
        Expr::Binary(operator, a, b) => {
            let of_these = missing(a, target).or_else(|| missing(b, target));
            return of_these.or(Some(match operator {
                _ if is_real(a) || is_real(b) => "that operator is not for numbers with a point",
                Operator::Shl | Operator::Shr => "a shift by other than 0 to 63 bits",
                _ if b.value(target) == Some(0) => "a division by 0",
                _ => "a quotient that is too large",
            }));
        }
        _ => "memory that is not there",
    })
}

/// What gdb's `set` has settings for that scripts begin with.
const GDBS: &[&str] = &["confirm", "height", "width", "pagination", "print", "listsize", "style", "logging", "verbose"];

/// An expression that every stop shows.
pub struct Display {
    id: u32,
    text: String,
    format: Format,
    /// Nothing for a place that is examined as `x` does it.
    expr: Option<Expr>,
}

/// Where `x` goes on.
#[derive(Debug, Clone, Copy)]
pub struct Examined {
    space: &'static str,
    /// Address as the memory counts.
    addr: u32,
    format: Format,
}

pub(super) fn print(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let (format, text) = Format::take(args)?;
    if text.is_empty() {
        return Err("what is to be printed? print r16, print buf, print $cycle / 2".to_owned());
    }
    if matches!(format.letter, Some('s' | 'i')) {
        return examine(shell, args, out);
    }
    // `print x = 5` sets it first.
    let text = match assignment(text) {
        Some((place, value)) => {
            set(shell, &format!("{place} = {value}"), out)?;
            place
        }
        None => text,
    };
    // `p *buffer@4`: so many of them side by side.
    if let Some((first, count)) = text.rsplit_once('@')
        && let Expr::Object(object) = shell.expr(first)?
    {
        let count = shell.count(count)?;
        let value = object.texts(count, &shell.session.scope, shell.session.target(), format.letter)?;
        out.push_str(&format!("{text} = {value}\n"));
        return Ok(());
    }
    let function = types::function_type(shell, text).filter(|_| format.letter.is_none());
    let value = match function {
        Some((kind, byte)) => format!("{{{kind}}} 0x{byte:x} <{text}>"),
        None => shell.shown(&shell.expr(text)?, format),
    };
    out.push_str(&format!("{text} = {value}\n"));
    Ok(())
}

/// `PLACE = VALUE`; nothing where a `=` is part of an operator.
fn assignment(text: &str) -> Option<(&str, &str)> {
    let (place, value) = text.split_once('=')?;
    let operator = value.starts_with('=') || place.ends_with(['=', '!', '<', '>']);
    (!operator && !place.trim().is_empty()).then(|| (place.trim(), value.trim()))
}

impl Shell {
    /// The value of an expression: in hex and as a number, as far as those differ, or as a format has it.
    pub(super) fn shown(&self, expr: &Expr, format: Format) -> String {
        let target = self.session.target();
        if let Some(object) = expr.object() {
            return object.text(&self.session.scope, target, format.letter);
        }
        let place = expr.place(target);
        let Some(value) = expr.value(target) else {
            return match missing(expr, target) {
                Some(_) if matches!(place, Some(Place::Pin(_))) => "floats".to_owned(),
                Some(why) => format!("nothing: {why}"),
                None => "nothing".to_owned(),
            };
        };
        if let (None, Some(amount @ Amount::Real(..))) = (format.letter, expr.amount(target)) {
            return amount.text();
        }
        let bytes = match place {
            Some(Place::Memory { bytes, .. }) => bytes.into(),
            Some(Place::Bit { .. } | Place::RegBit { .. } | Place::Reg(_)) => 1,
            // What is computed, or counted, has a sign of its own.
            _ if format.letter != Some('d') && (0..0x1_0000).contains(&value) => 2,
            _ => 8,
        };
        let bytes = if value > 0xFF && bytes == 1 { 2 } else { bytes };
        match format.letter {
            Some('a') => match u32::try_from(value).ok().and_then(|address| self.word_of(address)) {
                Some(word) => self.session.scope.source().place(word),
                None => hex(value, 2),
            },
            Some(letter) => shown(value, letter, bytes).unwrap_or_else(|| value.to_string()),
            None if place == Some(Place::Pc) => {
                match u32::try_from(value).ok().and_then(|address| self.word_of(address)) {
                    Some(word) => self.session.scope.source().place(word),
                    None => hex(value, 4),
                }
            }
            None if (0..10).contains(&value) => value.to_string(),
            None if matches!(place, Some(Place::Cycle | Place::Instructions)) => value.to_string(),
            None => format!("{} ({value})", hex(value, 2)),
        }
    }

    /// The program word of an address as users write it.
    pub(super) fn word_of(&self, address: u32) -> Option<u32> {
        let chip = self.session.scope.chip();
        let word = address / chip.code_address(1).max(1);
        (word < chip.flash / chip.word_bytes.max(1)).then_some(word)
    }

    /// What is shown at every stop.
    pub(super) fn show_displays(&mut self, out: &mut String) {
        for display in &self.displays {
            match &display.expr {
                // A variable of a call that is over has no value to show.
                Some(expr) if expr.object().is_some_and(|object| !object.is_known(self.session.target())) => {}
                Some(expr) => {
                    let value = self.shown(expr, display.format);
                    out.push_str(&format!("{}: {} = {value}\n", display.id, display.text));
                }
                None => {
                    out.push_str(&format!("{}: {}\n", display.id, display.text));
                    let lines = self.start(&display.text, display.format).and_then(|at| self.lines(at));
                    out.push_str(&lines.map_or_else(|why| format!("{why}\n"), |(text, _)| text));
                }
            }
        }
    }

    /// Where an examination begins.
    fn start(&self, text: &str, format: Format) -> Result<Examined, String> {
        let chip = self.session.scope.chip();
        if format.letter == Some('i') {
            let words = self.location(text)?;
            let word = words.first().copied().unwrap_or_default();
            return Ok(Examined { space: chip.code, addr: chip.code_address(word), format });
        }
        let (scope, target) = (&self.session.scope, self.session.target());
        let text = text.trim();
        // Of an array it is its place, of anything else that has a type its value, as in gdb.
        let expr = self.expr(text).ok();
        if let Some(Expr::Object(object)) = &expr
            && object.is_array()
        {
            return match object.cells(target).first() {
                Some(Cell::Memory(space, addr)) => {
                    Ok(Examined { space, addr: addr / chip.width(space).max(1), format })
                }
                _ => Err(format!("`{text}` is in no memory")),
            };
        }
        let typed = expr.is_some_and(|expr| expr.object().is_some());
        let text = if typed { text } else { text.trim_start_matches('&') };
        if let Ok(Range { space, start, .. }) = scope.range(text)
            && !typed
        {
            return Ok(Examined { space, addr: start, format });
        }
        let value = self.value(text)?;
        let addr = u32::try_from(value).map_err(|_| format!("`{text}` is no address: {value}"))?;
        Ok(Examined { space: chip.ram, addr, format })
    }

    /// The lines of an examination, and where it goes on.
    fn lines(&self, at: Examined) -> Result<(String, Examined), String> {
        let Examined { space, addr, format } = at;
        let letter = format.letter.unwrap_or('x');
        let count = format.count.unwrap_or(1);
        match letter {
            'i' => {
                let word = self.word_of(addr).ok_or_else(|| format!("{space} ends before 0x{addr:x}"))?;
                let (mut text, word) = self.instructions(word, count);
                let next = Examined { addr: self.session.scope.chip().code_address(word), ..at };
                if self.word_of(next.addr).is_none() && (text.lines().count() as u64) < u64::from(count) {
                    text.push_str(&format!("{space} ends before 0x{:x}\n", next.addr));
                }
                Ok((text, next))
            }
            's' => self.texts(at, count),
            _ => self
                .cells((space, addr), (letter, count, format.unit))
                .map(|(text, addr)| (text, Examined { addr, ..at })),
        }
    }

    /// Numbers of a memory.
    fn cells(
        &self,
        (space, first): (&'static str, u32),
        (letter, count, unit): (char, u32, Option<u32>),
    ) -> Result<(String, u32), String> {
        let chip = self.session.scope.chip();
        let width = chip.width(space);
        let unit = unit.unwrap_or(width).max(width);
        let (mut text, mut addr) = (String::new(), first);
        let columns = (16 / unit).clamp(1, 8);
        for n in 0..count {
            let start = addr.checked_mul(width).ok_or("that is no address")?;
            let bytes: Option<Vec<u8>> =
                (0..unit).map(|i| self.session.target().peek(space, start.checked_add(i)?)).collect();
            let Some(bytes) = bytes else {
                let there = self.session.target().peek(space, start).is_some();
                let end = match there {
                    true => format!("there are no {unit} bytes at {space}:0x{addr:x}"),
                    false => format!("there is nothing at {space}:0x{addr:x}"),
                };
                return match n {
                    0 => Err(end),
                    _ => Ok((format!("{}\n{end}\n", text.trim_end()), addr)),
                };
            };
            if n % columns == 0 {
                let end = if n == 0 { "" } else { "\n" };
                let name = self.session.scope.source().names.object(space, start);
                let name = name.map_or(String::new(), |name| format!(" <{name}>"));
                text.push_str(&format!("{end}{space}:0x{addr:04x}{name}:"));
            }
            let value = bytes.iter().rev().fold(0i64, |high, low| high << 8 | i64::from(*low));
            let shown = match letter {
                'a' => self.word_of(value as u32).map(|word| self.session.scope.source().place(word)),
                _ => shown(value, letter, unit),
            };
            text.push_str(&format!(" {}", shown.unwrap_or_else(|| hex(value, 2))));
            addr += unit / width;
        }
        Ok((format!("{text}\n"), addr))
    }

    /// Texts that end with a 0.
    fn texts(&self, at: Examined, count: u32) -> Result<(String, Examined), String> {
        const LONGEST: usize = 200;
        let (mut text, mut addr) = (String::new(), at.addr);
        for n in 0..count {
            if self.session.target().peek(at.space, addr).is_none() {
                let end = format!("there is nothing at {}:0x{addr:x}", at.space);
                if n == 0 {
                    return Err(end);
                }
                text.push_str(&format!("{end}\n"));
                break;
            }
            let (start, mut bytes) = (addr, Vec::new());
            loop {
                let byte = self.session.target().peek(at.space, addr);
                addr = addr.saturating_add(1);
                match byte {
                    None | Some(0) => break,
                    Some(byte) => bytes.push(byte),
                }
                if bytes.len() >= LONGEST {
                    break;
                }
            }
            text.push_str(&format!("{}:0x{start:04x}: {}\n", at.space, emu_debug::text::escape(&bytes)));
        }
        Ok((text, Examined { addr, ..at }))
    }
}

pub(super) fn examine(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let (format, text) = Format::take(args)?;
    let at = match (text, shell.examined) {
        ("", Some(last)) => {
            let or = |new: Option<u32>, old: Option<u32>| new.or(old);
            let unit = or(format.unit, last.format.unit);
            let format = Format { count: format.count, letter: format.letter.or(last.format.letter), unit };
            Examined { format, ..last }
        }
        ("", None) => return Err("where? x/8xb data:0x100, x/4i $pc".to_owned()),
        _ => shell.start(text, format)?,
    };
    let (text, next) = shell.lines(at)?;
    out.push_str(&text);
    shell.examined = Some(next);
    Ok(())
}

pub(super) fn set(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let wanted = || "write what gets which value: set r16 = 5, set PB0 = 1, set VCC=4.5V".to_owned();
    // `set var x = 1`, as gdb has it.
    let args = ["var ", "variable "].iter().find_map(|word| args.strip_prefix(word)).unwrap_or(args);
    if !args.contains('=') && GDBS.contains(&args.split_whitespace().next().unwrap_or_default()) {
        shell.note("note: that setting of gdb makes no difference here", out);
        return Ok(());
    }
    let (name, value) = args.split_once('=').ok_or_else(wanted)?;
    let (name, value) = (name.trim(), value.trim());
    // An input of a ladder program is its pin: the memory where it is latched is written anew by every scan.
    let own = shell.view.as_ref().map_or_else(|| name.to_owned(), |view| view.own_pin(name));
    let name = own.as_str();
    if name.is_empty() || value.is_empty() || value.starts_with('=') {
        return Err(wanted());
    }
    let scope = &shell.session.scope;
    let chip = scope.chip();
    let text = avr::own_name(chip, &scope.source().names.with_channel(&format!("{name}={value}")));
    let pin = pin_of(shell, name);
    // Levels, resistors and voltages come to pins and to the supply as with --set.
    let expr = shell.expr(name);
    if pin.is_some() || expr.is_err() {
        let value = if pin.is_some() {
            shell.value(value).map_or(value.to_owned(), |value| value.to_string())
        } else {
            String::new()
        };
        let text = match pin {
            Some(pin) => format!("{}={value}", chip.pins.get(usize::from(pin)).map_or("", |pin| pin.name)),
            None => text,
        };
        return match put(chip, &text) {
            Ok(what) => {
                let at = Time::at(shell.session.target().cycle());
                shell.session.act(Action::Drive(Drive { at, put: what }))
            }
            Err(why) if pin.is_some() || is_supply(name) => Err(why),
            Err(_) => Err(expr.err().unwrap_or_default()),
        };
    }
    let expr = expr?;
    let place = expr.place(shell.session.target());
    if place.is_none() && expr.object().is_none() {
        return Err(format!("`{name}` is no place that can be set"));
    }
    let value = shell.amount(value)?;
    shell.session.assign(&expr, value)?;
    shell.registers = shell.core_registers();
    if place == Some(Place::Pc) {
        shell.here(out);
    }
    Ok(())
}

/// The supply is meant, under one of its names.
fn is_supply(name: &str) -> bool {
    ["VDD", "VCC"].iter().any(|supply| name.eq_ignore_ascii_case(supply))
}

/// The pin that a name stands for.
fn pin_of(shell: &Shell, name: &str) -> Option<PinId> {
    match shell.expr(name) {
        Ok(Expr::Place(Place::Pin(pin))) => Some(pin),
        _ => None,
    }
}

pub(super) fn display(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let (format, text) = Format::take(args)?;
    if text.is_empty() {
        shell.show_displays(out);
        return Ok(());
    }
    let examined = format.letter == Some('i') || format.letter == Some('s') || format.count.is_some();
    let expr = if examined {
        shell.start(text, format)?;
        None
    } else {
        Some(shell.expr(text)?)
    };
    shell.displayed += 1;
    let id = shell.displayed;
    shell.displays.push(Display { id, text: text.to_owned(), format, expr });
    let shown = shell.displays.split_off(shell.displays.len() - 1);
    let others = std::mem::replace(&mut shell.displays, shown);
    shell.show_displays(out);
    let shown = std::mem::replace(&mut shell.displays, others);
    shell.displays.extend(shown);
    Ok(())
}

pub(super) fn undisplay(shell: &mut Shell, args: &str, _: &mut String) -> Done {
    if args.is_empty() {
        shell.displays.clear();
    }
    for number in args.split_whitespace() {
        let before = shell.displays.len();
        shell.displays.retain(|display| display.id.to_string() != number);
        if shell.displays.len() == before {
            return Err(format!("there is no display {number}; `display` shows them"));
        }
    }
    Ok(())
}

pub(super) fn assert(shell: &mut Shell, args: &str, _: &mut String) -> Done {
    if args.is_empty() {
        return Err("what is to hold? assert PB5 == 1".to_owned());
    }
    let (expr, target) = (shell.expr(args)?, shell.session.target());
    match expr.amount(target) {
        Some(value) if !value.is_true() => {
            Err(format!("the assertion does not hold at cycle {}: {args}", target.cycle()))
        }
        Some(_) => Ok(()),
        None => {
            let why = missing(&expr, target).map_or(String::new(), |why| format!(" ({why})"));
            Err(format!("the assertion has no value at cycle {}: {args}{why}", target.cycle()))
        }
    }
}

impl Shell {
    /// The value of an expression as a whole number.
    pub(super) fn value(&self, text: &str) -> Result<i64, String> {
        self.amount(text).map(Amount::whole)
    }

    /// The value of an expression.
    pub(super) fn amount(&self, text: &str) -> Result<Amount, String> {
        let (expr, target) = (self.expr(text)?, self.session.target());
        expr.amount(target).ok_or_else(|| {
            let why = missing(&expr, target).map_or(String::new(), |why| format!(": {why}"));
            format!("`{}` has no value now{why}", text.trim())
        })
    }
}
