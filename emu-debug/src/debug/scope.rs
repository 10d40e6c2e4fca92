//! Names in expressions and commands: registers, pins, memory, symbols of the program, symbols of a ladder program.

use emu_core::chip::{Chip, Family};
use emu_core::image::{CONSTANT, Lines, SymbolAt};

use super::expr::{self, Expr};
use super::eyes::byte_of;
use super::place::Place;
use super::target::Target;
use crate::bits;
use crate::place::{Names, Range, split_memory};
use crate::source::Source;
use crate::stimulus;

/// Everything that has a name.
#[derive(Debug, Clone)]
pub struct Scope {
    chip: &'static Chip,
    /// Symbols of the image.
    pub symbols: Vec<SymbolAt>,
    /// Source lines of the image.
    pub lines: Lines,
    /// Symbols of a ladder program, and where the chip keeps them.
    pub ladder: Vec<(String, Place)>,
}

impl Scope {
    /// What a chip has names for, and nothing else.
    #[must_use]
    pub fn new(chip: &'static Chip) -> Scope {
        Scope { chip, symbols: Vec::new(), lines: Lines::default(), ladder: Vec::new() }
    }

    /// The chip.
    #[must_use]
    pub fn chip(&self) -> &'static Chip {
        self.chip
    }

    /// What is known of program addresses.
    #[must_use]
    pub fn source(&self) -> Source<'_> {
        Source { names: Names { chip: self.chip, symbols: &self.symbols }, lines: &self.lines }
    }

    /// Reads an expression.
    ///
    /// # Errors
    /// What is wrong with it, in a sentence.
    pub fn expr(&self, text: &str) -> Result<Expr, String> {
        expr::parse(self, text)
    }

    /// Bytes of a memory as [`Names::range`] reads them; a symbol of the ladder program or a bit of a byte stands for its bytes.
    ///
    /// # Errors
    /// No such memory or place.
    pub fn range(&self, text: &str) -> Result<Range, String> {
        match self.ladder.iter().find(|(name, _)| name == text.trim()).map(|found| found.1) {
            Some(Place::Bit { space, addr, .. }) => Ok(Range { space, start: addr, end: addr + 1 }),
            Some(Place::Memory { space, addr, bytes, .. }) => {
                let width = self.chip.width(space).max(1);
                Ok(Range { space, start: addr / width, end: (addr + u32::from(bytes)).div_ceil(width) })
            }
            _ => self.source().names.range(text),
        }
    }

    /// Memory of whose accesses the machine tells, as [`Scope::range`] reads it, and what that is called. Of a bit that has no address of
    /// its own it is its byte.
    ///
    /// # Errors
    /// No such memory or place, or one of which it does not.
    pub fn accessed(&self, text: &str, target: &dyn Target) -> Result<(Range, String), String> {
        let text = text.trim();
        let bit = self.expr(text).ok().and_then(|expr| expr.place(target));
        let (range, name) = match bit {
            Some(Place::Bit { space, addr, bit }) => match bits::of_byte(self.chip, space, addr) {
                Some(Range { space, start, .. }) => {
                    let own = start + u32::from(bit);
                    (Range { space, start: own, end: own + 1 }, text.to_owned())
                }
                // A cell of AP101 is a bit.
                None if self.chip.family == Family::Ap101 => {
                    (Range { space, start: addr, end: addr + 1 }, text.to_owned())
                }
                None => (Range { space, start: addr, end: addr + 1 }, format!("the byte of {text}")),
            },
            _ => (self.range(text)?, text.to_owned()),
        };
        self.source().names.told(&range).map_err(|why| match self.ladder.iter().any(|(name, _)| name == text) {
            true => format!("`{text}` is kept in {}:0x{:x}; {why}", range.space, range.start),
            false => why,
        })?;
        Ok((range, name))
    }

    /// What a name in an expression stands for. Names with `$` are the debugger's own, as in gdb: `$pc`, `$cycle`, `$r16`. Of the
    /// others those of the ladder program come first, then those of the image, then the chip's.
    ///
    /// # Errors
    /// Nothing has that name.
    pub(super) fn named(&self, name: &str) -> Result<Expr, String> {
        if let Some(own) = name.strip_prefix('$') {
            let place = match own.to_ascii_lowercase().as_str() {
                "pc" => Some(Place::Pc),
                "cycle" => Some(Place::Cycle),
                "instructions" => Some(Place::Instructions),
                _ => self.register(own),
            };
            return match place {
                Some(place) => Ok(Expr::Place(place)),
                None => self
                    .memory(own)
                    .map_err(|_| format!("nothing is called `{name}`; `info registers` lists registers")),
            };
        }
        if let Some((_, place)) = self.ladder.iter().find(|(known, _)| known == name) {
            return Ok(Expr::Place(*place));
        }
        let own = self.symbols.iter().any(|symbol| symbol.is_named(name));
        if !own && let Some(place) = self.register(name).or_else(|| self.pin(name)) {
            return Ok(Expr::Place(place));
        }
        self.memory(name).or_else(|why| self.bit(name).unwrap_or(Err(why)))
    }

    /// Length of the longest name of a C++ or Rust symbol with which a text begins: those have brackets and spaces in them.
    pub(super) fn mangled_name(&self, text: &str) -> Option<usize> {
        let names = self.symbols.iter().filter_map(|s| Some([s.name.as_str(), &s.mangled.as_ref()?.path]));
        names.flatten().filter(|name| text.starts_with(*name)).map(str::len).max()
    }

    fn register(&self, name: &str) -> Option<Place> {
        match name.to_ascii_lowercase().as_str() {
            "pc" => Some(Place::Pc),
            _ => self.chip.cpu_regs.iter().find(|reg| reg.eq_ignore_ascii_case(name)).map(|reg| Place::Reg(reg)),
        }
    }

    fn pin(&self, name: &str) -> Option<Place> {
        stimulus::pin(self.chip, name).ok().filter(|_| self.chip.reg(name).is_none()).map(Place::Pin)
    }

    /// `data:0x100`, `buf`, `TCNT1`, `P1`, `main` (its address), a constant (its value).
    fn memory(&self, name: &str) -> Result<Expr, String> {
        let names = self.source().names;
        let known = |space: &str| self.symbols.iter().find(|s| s.space == space && s.is_named(name));
        if let Some(label) = known(self.chip.code) {
            return Ok(Expr::Number(i64::from(label.addr / self.chip.width(self.chip.code))));
        }
        if let Some(constant) = known(CONSTANT) {
            return Ok(Expr::Number(constant.addr.into()));
        }
        let range = names.range(name)?;
        if range.space == self.chip.code && split_memory(name).is_none() {
            return Ok(Expr::Number(range.start.into()));
        }
        Ok(Expr::Place(self.place_of(&range)))
    }

    /// The value that stands in a range: up to four bytes without a sign, a bit where the memory holds bits.
    #[must_use]
    pub fn place_of(&self, range: &Range) -> Place {
        let width = self.chip.width(range.space);
        let (space, addr, bit) = byte_of(self.chip, range.space, range.start.saturating_mul(width));
        match bit {
            Some(bit) => Place::Bit { space, addr, bit },
            None => {
                let bytes = range.end.saturating_sub(range.start).saturating_mul(width).clamp(1, 4) as u8;
                Place::Memory { space, addr, bytes, signed: false }
            }
        }
    }

    /// `PORTB.5`, `data:0x20.3`, `buf.0`: a bit of a byte by its place. Nothing where the text has no such shape.
    fn bit(&self, name: &str) -> Option<Result<Expr, String>> {
        let (byte, bit) = name.rsplit_once('.')?;
        let bit: u8 = bit.parse().ok()?;
        let of = match self.named(byte) {
            Ok(of) => of,
            Err(why) => return Some(Err(why)),
        };
        let most = match &of {
            Expr::Place(Place::Memory { bytes, .. }) => 8 * bytes,
            Expr::Place(Place::Bit { .. } | Place::Pin(_)) => 1,
            _ => 64,
        };
        if bit >= most {
            return Some(Err(format!("`{byte}` has no bit {bit}: its bits are 0 to {}", most - 1)));
        }
        Some(Ok(Expr::Bit(Box::new(of), bit)))
    }
}
