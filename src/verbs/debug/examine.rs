//! The command `x`: prints memory from an address on as numbers, strings or instructions.

use crate::debug::code::ListedCode;
use emu_core::image::SpaceAddress;
use emu_debug::AddressRange;
use emu_debug::address_names::decimal_offset;
use emu_debug::debug::{DebugExpression, ObjectByteLocation, real_text};
use emu_debug::number_formats::format_number;

use super::command_error::CommandError;
use super::numbers::{ExamineFormat, hex};
use super::shell::{CommandResult, DebugShell};

/// Bytes of a floating-point number if no unit is given.
const REAL_BYTES: u32 = 4;

/// Bytes of a pointer of the AVR; `WORD_BYTES` is the unit of the first `x`.
const POINTER_BYTES: u32 = 2;
const WORD_BYTES: u32 = 4;

/// Where the next `x` without an address continues.
#[derive(Debug, Clone, Copy)]
pub struct ExamineState {
    space: &'static str,
    /// Address in the units of the space.
    addr: u32,
    format: ExamineFormat,
}

impl DebugShell {
    /// Parses the address argument of `x`.
    pub(super) fn examine_start(&self, text: &str, format: ExamineFormat) -> Result<ExamineState, CommandError> {
        let chip = self.session.scope.chip();
        if format.letter == Some('i') {
            let word = match self.parse_location(text) {
                Ok(words) => words.first().copied().unwrap_or_default(),
                // The value of a pointer to a function.
                Err(why) => {
                    let value = self.integer_value(text).ok().and_then(|value| u32::try_from(value).ok());
                    value.and_then(|address| self.program_word(address)).ok_or(why)?
                }
            };
            return Ok(ExamineState { space: chip.code_space, addr: chip.code_address(word), format });
        }
        let (scope, target) = (&self.session.scope, self.session.machine());
        let text = text.trim();
        // As in gdb, an array means its address, and any other typed expression its value.
        let expr = self.parse_expression(text).ok();
        if let Some(DebugExpression::Object(object)) = &expr
            && object.is_array()
        {
            return match object.byte_locations(target).first() {
                Some(ObjectByteLocation::Memory(space, addr)) => {
                    Ok(ExamineState { space, addr: addr / chip.bytes_per_address(space).max(1), format })
                }
                _ => Err(format!("`{text}` is in no memory").into()),
            };
        }
        // A pointer of SDCC names its memory space.
        if let Some(DebugExpression::Object(object)) = &expr
            && chip.has_sdcc_pointers()
            && let Some(ObjectByteLocation::Memory(space, addr)) =
                object.pointed_object().and_then(|of| of.byte_locations(target).first().copied())
        {
            return Ok(ExamineState { space, addr, format });
        }
        let typed = expr.as_ref().and_then(DebugExpression::object).is_some_and(|object| !object.is_function());
        let text = if typed { text } else { text.trim_start_matches('&') };
        if let Ok(AddressRange { space, start, .. }) = scope.parse_range(text)
            && !typed
        {
            let linked = scope.linked_memory_at(start).filter(|_| space == chip.ram_space);
            let SpaceAddress { space, addr } = linked.unwrap_or(SpaceAddress { space, addr: start });
            return Ok(ExamineState { space, addr, format });
        }
        let value = self.integer_value(text)?;
        let addr = u32::try_from(value).map_err(|_| format!("`{text}` is not an address: {value}"))?;
        let SpaceAddress { space, addr } =
            scope.linked_memory_at(addr).unwrap_or(SpaceAddress { space: chip.ram_space, addr });
        Ok(ExamineState { space, addr, format })
    }

    /// Makes a program word the default of the next `x`, and the value of `$_`, as `info line` of gdb does.
    pub(super) fn set_examined_code(&mut self, word: u32) {
        let chip = self.session.scope.chip();
        let (space, addr) = (chip.code_space, chip.code_address(word));
        let format = ExamineFormat { letter: Some('i'), ..ExamineFormat::default() };
        self.examined = Some(ExamineState { space, addr, format });
        self.session.scope.values.set("_", DebugExpression::Number(addr.into()));
    }

    /// Returns the lines that `x` prints, and where the next `x` continues.
    pub(super) fn examine_lines(&self, at: ExamineState) -> Result<(String, ExamineState), CommandError> {
        let ExamineState { space, addr, format } = at;
        let letter = format.letter.unwrap_or('x');
        let count = format.count.unwrap_or(1);
        match letter {
            'i' => {
                let word = self.program_word(addr).ok_or_else(|| format!("{space} ends before 0x{addr:x}"))?;
                let ListedCode { mut text, next: word } = self.instructions(word, count);
                let next = ExamineState { addr: self.session.scope.chip().code_address(word), ..at };
                if self.program_word(next.addr).is_none() && (text.lines().count() as u64) < u64::from(count) {
                    text.push_str(&format!("{space} ends before 0x{:x}\n", next.addr));
                }
                Ok((text, next))
            }
            's' => self.text_lines(at, count),
            _ => self
                .number_lines((space, addr), (letter, count, format.unit))
                .map(|(text, addr)| (text, ExamineState { addr, ..at })),
        }
    }

    /// Returns memory as numbers, and the address after them.
    fn number_lines(
        &self,
        (space, first): (&'static str, u32),
        (letter, count, unit): (char, u32, Option<u32>),
    ) -> Result<(String, u32), CommandError> {
        let chip = self.session.scope.chip();
        let width = chip.bytes_per_address(space);
        let unit = unit.unwrap_or(if letter == 'f' { REAL_BYTES } else { width }).max(width);
        let (mut text, mut addr) = (String::new(), first);
        let columns = (16 / unit).clamp(1, 8);
        for n in 0..count {
            let start = addr.checked_mul(width).ok_or("the address is too large")?;
            let bytes: Option<Vec<u8>> =
                (0..unit).map(|i| self.session.machine().peek(space, start.checked_add(i)?)).collect();
            let Some(bytes) = bytes else {
                let there = self.session.machine().peek(space, start).is_some();
                let end = match there {
                    true => format!("there are no {unit} bytes at {space}:0x{addr:x}"),
                    false => format!("there is no memory at {space}:0x{addr:x}"),
                };
                return match n {
                    0 => Err(end.into()),
                    _ => Ok((format!("{}\n{end}\n", text.trim_end()), addr)),
                };
            };
            if n % columns == 0 {
                let end = if n == 0 { "" } else { "\n" };
                let name = self.session.scope.source().names.containing_symbol(space, start);
                text.push_str(&format!("{end}{}:", self.examined_place(space, addr, name)));
            }
            let value = bytes.iter().rev().fold(0i64, |high, low| high << 8 | i64::from(*low));
            let shown = match letter {
                'a' => self.code_address_text(value),
                'f' => real_text(&bytes).or_else(|| format_number(value, 'd', unit, true)),
                _ => format_number(value, letter, unit, true),
            };
            text.push_str(&format!("\t{}", shown.unwrap_or_else(|| hex(value, 2))));
            addr += unit / width;
        }
        Ok((format!("{text}\n"), addr))
    }

    /// Fills in the format and unit of the last `x` if none is given. Only for C programs on an AVR, as in
    /// gdb.
    fn with_last_format(&self, format: ExamineFormat) -> ExamineFormat {
        if !self.session.scope.has_debug_info() || !self.session.scope.chip().is_known_to_gdb() {
            return format;
        }
        let last = self.examined.map(|last| last.format).unwrap_or_default();
        let letter = format.letter.or(last.letter).unwrap_or('x');
        let unit = format.unit.or(match letter {
            'c' | 's' => Some(1),
            'a' => Some(POINTER_BYTES),
            'f' => Some(last.unit.filter(|unit| *unit >= REAL_BYTES).unwrap_or(REAL_BYTES)),
            _ => last.unit.or(Some(WORD_BYTES)),
        });
        ExamineFormat { letter: Some(letter), unit, ..format }
    }

    /// Moves the start back by the units of a negative count.
    fn start_before(&self, at: ExamineState) -> Result<ExamineState, CommandError> {
        let ExamineState { space, addr, format } = at;
        if !format.before {
            return Ok(at);
        }
        if matches!(format.letter, Some('s' | 'i')) {
            return Err("texts and instructions are not counted backwards; name the address".into());
        }
        let width = self.session.scope.chip().bytes_per_address(space).max(1);
        let bytes = format.count.unwrap_or(1).saturating_mul(format.unit.unwrap_or(width));
        let addr = addr.checked_sub(bytes / width).ok_or_else(|| format!("{space} begins at 0"))?;
        Ok(ExamineState { addr, ..at })
    }

    /// Returns an address of program memory with its symbol.
    fn code_address_text(&self, value: i64) -> Option<String> {
        let source = self.session.scope.source();
        let address = u32::try_from(value).ok()?;
        let word = self.program_word(address)?;
        match source.names.nearest_symbol(word.saturating_mul(source.names.chip.word_bytes)) {
            Some(name) if self.session.scope.has_debug_info() => {
                Some(format!("0x{address:x} <{}>", decimal_offset(&name)))
            }
            _ => Some(source.describe_word(word)),
        }
    }

    /// Returns the address at the start of an output line; data of a C program on the AVR has the addresses
    /// of gdb and the ELF file.
    fn examined_place(&self, space: &str, addr: u32, known: Option<String>) -> String {
        let (scope, chip) = (&self.session.scope, self.session.scope.chip());
        let name = |name: String| format!(" <{name}>");
        match chip.linked_address(space, addr).filter(|_| scope.has_debug_info()) {
            Some(linked) => format!("0x{linked:x}{}", known.map_or(String::new(), |own| name(decimal_offset(&own)))),
            None => format!("{space}:0x{addr:04x}{}", known.map_or(String::new(), name)),
        }
    }

    /// Returns strings that end with a 0, one per line.
    fn text_lines(&self, at: ExamineState, count: u32) -> Result<(String, ExamineState), CommandError> {
        const LONGEST: usize = 200;
        let (mut text, mut addr) = (String::new(), at.addr);
        for n in 0..count {
            if self.session.machine().peek(at.space, addr).is_none() {
                let end = format!("there is no memory at {}:0x{addr:x}", at.space);
                if n == 0 {
                    return Err(end.into());
                }
                text.push_str(&format!("{end}\n"));
                break;
            }
            let (start, mut bytes) = (addr, Vec::new());
            loop {
                let byte = self.session.machine().peek(at.space, addr);
                addr = addr.saturating_add(1);
                match byte {
                    None | Some(0) => break,
                    Some(byte) => bytes.push(byte),
                }
                if bytes.len() >= LONGEST {
                    break;
                }
            }
            let names = self.session.scope.source().names;
            let name = names.containing_symbol(at.space, start).filter(|_| self.session.scope.has_debug_info());
            let place = self.examined_place(at.space, start, name);
            text.push_str(&format!("{place}:\t{}\n", emu_debug::text_escapes::escape(&bytes)));
        }
        Ok((text, ExamineState { addr, ..at }))
    }
}

/// `x`: prints memory.
pub(super) fn examine(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (format, text) = ExamineFormat::parse_front(args)?;
    let at = match (text, shell.examined) {
        ("", Some(last)) => {
            let unit = format.unit.or(last.format.unit);
            let (letter, count) = (format.letter.or(last.format.letter), format.count.or(last.format.count));
            ExamineState { format: ExamineFormat { count, letter, unit, ..format }, ..last }
        }
        ("", None) => return Err("the address is missing: x/8xb data:0x100, x/4i $pc".into()),
        _ => {
            let format = shell.with_last_format(format);
            shell.start_before(shell.examine_start(text, format)?)?
        }
    };
    let (text, next) = shell.examine_lines(at)?;
    out.push_str(&text);
    shell.examined = Some(next);
    Ok(())
}
