//! Resolves names of expressions: the debugger's own, symbols, registers, pins, memory and bits.

use emu_core::image::CONSTANT_SPACE;

use super::NameScope;
use crate::address_names::{AddressRange, split_memory};
use crate::debug::error::DebugError;
use crate::debug::expression::DebugExpression;
use crate::debug::expression_place::ExpressionPlace;
use crate::debug::watchpoint_probe::{ByteOrBit, byte_of};
use crate::stimulus;

impl NameScope {
    /// Resolves a name in an expression. Names with `$` belong to the debugger, as in gdb: `$pc`, `$cycle`,
    /// `$r16`. For other names, the ladder program overrides the image, and the image overrides the chip.
    ///
    /// # Errors
    /// The name is not defined.
    pub(in crate::debug) fn find_name(&self, name: &str) -> Result<DebugExpression, DebugError> {
        if let Some(own) = name.strip_prefix('$') {
            let place = match own.to_ascii_lowercase().as_str() {
                "pc" => Some(ExpressionPlace::Pc),
                "cycle" => Some(ExpressionPlace::Cycle),
                "instructions" => Some(ExpressionPlace::Instructions),
                _ => self.register(own),
            };
            return match place {
                Some(place) => Ok(DebugExpression::Place(place)),
                None => self.memory(own).map_err(|_| DebugError::UnknownDebuggerName { name: name.to_owned() }),
            };
        }
        if let Some((_, place)) = self.ladder.iter().find(|(known, _)| known == name) {
            return Ok(DebugExpression::Place(*place));
        }
        // Headers define chip registers as constants.
        let own = self.symbols.iter().any(|symbol| symbol.space != CONSTANT_SPACE && symbol.is_named(name));
        if !own && let Some(place) = self.register(name).or_else(|| self.pin(name)) {
            return Ok(DebugExpression::Place(place));
        }
        self.memory(name).or_else(|why| self.bit(name).unwrap_or(Err(why)))
    }

    /// Returns the length of the longest name of a C++ or Rust symbol at the start of a text; such names
    /// contain brackets and spaces.
    pub(in crate::debug) fn mangled_name_length(&self, text: &str) -> Option<usize> {
        let names = self.symbols.iter().filter_map(|s| Some([s.name.as_str(), &s.mangled.as_ref()?.path]));
        names.flatten().filter(|name| text.starts_with(*name)).map(str::len).max()
    }

    fn register(&self, name: &str) -> Option<ExpressionPlace> {
        match name.to_ascii_lowercase().as_str() {
            "pc" => Some(ExpressionPlace::Pc),
            _ => self
                .chip
                .cpu_regs
                .iter()
                .find(|reg| reg.eq_ignore_ascii_case(name))
                .map(|reg| ExpressionPlace::Reg(reg)),
        }
    }

    fn pin(&self, name: &str) -> Option<ExpressionPlace> {
        stimulus::find_pin(self.chip, name).ok().filter(|_| self.chip.reg(name).is_none()).map(ExpressionPlace::Pin)
    }

    /// Resolves `data:0x100`, `buf`, `TCNT1`, `P1`, `main` (its address), or a constant (its value).
    fn memory(&self, name: &str) -> Result<DebugExpression, DebugError> {
        let names = self.source().names;
        let known = |space: &str| self.symbols.iter().find(|s| s.space == space && s.is_named(name));
        if let Some(label) = known(self.chip.code_space) {
            return Ok(DebugExpression::Number(i64::from(
                label.addr / self.chip.bytes_per_address(self.chip.code_space),
            )));
        }
        if let Some(constant) = known(CONSTANT_SPACE).filter(|_| self.chip.reg(name).is_none()) {
            return Ok(DebugExpression::Number(constant.addr.into()));
        }
        let range = names.parse_range(name)?;
        if range.space == self.chip.code_space && split_memory(name).is_none() {
            return Ok(DebugExpression::Number(range.start.into()));
        }
        Ok(DebugExpression::Place(self.place_of(&range)))
    }

    /// Returns the value in a range as a location: up to four bytes, unsigned, or a bit if the memory holds
    /// bits.
    #[must_use]
    pub fn place_of(&self, range: &AddressRange) -> ExpressionPlace {
        let width = self.chip.bytes_per_address(range.space);
        let ByteOrBit { space, addr, bit } = byte_of(self.chip, range.space, range.start.saturating_mul(width));
        match bit {
            Some(bit) => ExpressionPlace::Bit { space, addr, bit },
            None => {
                let bytes = range.end.saturating_sub(range.start).saturating_mul(width).clamp(1, 4) as u8;
                ExpressionPlace::Memory { space, addr, bytes, signed: false }
            }
        }
    }

    /// Resolves `PORTB.5`, `data:0x20.3`, `buf.0`: a bit of a byte. `None` if the text has another form.
    fn bit(&self, name: &str) -> Option<Result<DebugExpression, DebugError>> {
        let (byte, bit) = name.rsplit_once('.')?;
        let bit: u8 = bit.parse().ok()?;
        let of = match self.find_name(byte) {
            Ok(of) => of,
            Err(why) => return Some(Err(why)),
        };
        let most = match &of {
            DebugExpression::Place(ExpressionPlace::Memory { bytes, .. }) => 8 * bytes,
            DebugExpression::Place(ExpressionPlace::Bit { .. } | ExpressionPlace::Pin(_)) => 1,
            _ => 64,
        };
        if bit >= most {
            return Some(Err(DebugError::NoSuchBit { name: byte.to_owned(), bit, most: most - 1 }));
        }
        Some(Ok(DebugExpression::Bit(Box::new(of), bit)))
    }
}
