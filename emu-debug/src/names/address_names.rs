//! Addresses as users write them: numbers, and names of the program's symbols and of the chip's registers.

use emu_core::chip::{Chip, ChipSpace};
use emu_core::image::{CONSTANT_SPACE, SpaceAddress, SymbolAt};

use crate::names::bit_space::{self, BIT_SPACE};
use crate::text::input_error::{InputError, malformed};

/// Resolves names to addresses.
#[derive(Debug, Clone, Copy)]
pub struct AddressNames<'a> {
    /// The chip, for memories and registers.
    pub chip: &'static Chip,
    /// Symbols of the program; a HEX file has none.
    pub symbols: &'a [SymbolAt],
}

/// A range of addresses in one memory: bytes, words if its addresses count words, or single bits of the
/// memory `bit`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddressRange {
    /// The memory, as [`Chip::spaces`] names it.
    pub space: &'static str,
    /// First address.
    pub start: u32,
    /// Address after the last; above `start`.
    pub end: u32,
}

/// The place of a chip register.
#[derive(Debug, Clone, Copy)]
struct RegisterCells {
    /// The address.
    addr: u32,
    /// The number of bytes, 1 or 2.
    size: u32,
}

impl AddressNames<'_> {
    /// Parses a range of a memory: `data:0x100` is one byte, `data:0x100..0x120` ends before 0x120,
    /// `data:buf` is all bytes of a symbol with a known size.
    ///
    /// The memory may be omitted before a name that only one memory has. An address is one of these:
    ///
    /// - a number, decimal or 0x (of words where [`Chip::spaces`] says so)
    /// - a symbol of the program, or an address after it (`buf+2`)
    /// - in the memory of the chip's registers, the name of a register (both halves of TCNT1, the lower
    ///   first)
    /// - in `bit`, a named bit or a bit of a byte (`0x20.3`, `P1.0`)
    /// - otherwise a constant of the program; in RAM only one that is an address of RAM
    ///
    /// # Errors
    /// No such memory, no address, an empty range, or one beyond the memory.
    pub fn parse_range(&self, text: &str) -> Result<AddressRange, InputError> {
        let spaces = || self.chip.spaces.iter().map(|space| space.name).collect::<Vec<_>>().join(", ");
        let (space, addresses) = match split_memory(text) {
            Some(MemoryAddress { memory, address }) => (memory, address),
            None => match self.spaces_of_name(text).as_slice() {
                [space] => (*space, text),
                [] if self.chip.cpu_regs.iter().any(|reg| reg.eq_ignore_ascii_case(text.trim())) => {
                    return Err(InputError::CoreRegister { text: text.to_owned(), memories: spaces() });
                }
                [] => {
                    return Err(InputError::NoMemory {
                        text: text.to_owned(),
                        example: self.example_address(),
                        memories: spaces(),
                    });
                }
                several => {
                    return Err(InputError::SeveralMemories { text: text.to_owned(), memories: several.join(", ") });
                }
            },
        };
        let Some(&ChipSpace { name: space, size, width }) = self.chip.space(space.trim()) else {
            return Err(InputError::UnknownMemory {
                chip: self.chip.name,
                space: space.to_owned(),
                memories: spaces(),
            });
        };
        let beyond = |start: u32| {
            let hint = self.word_to_space_address(space, start).map_or_else(String::new, |addr| {
                format!(
                    "; {space} is counted from 0: write {space}:0x{addr:x} for the word 0x{start:x} of the image file"
                )
            });
            InputError::BeyondMemory { place: format!("`{text}`"), space, last: size - 1, hint }
        };
        let name = addresses.trim();
        let is_object = |s: &&SymbolAt| s.space == space && s.is_named(name);
        // The parameters of a function may end with three dots.
        let limits = addresses.split_once("..").filter(|_| !self.symbols.iter().any(|s| is_object(&s)));
        let (start, end) = match limits {
            Some((start, end)) => (self.parse_address(space, start)?, self.parse_address(space, end)?),
            None => {
                let start = self.parse_address(space, addresses)?;
                // A constant of the program is not an object, even if it has a size.
                let object = self.symbols.iter().find(is_object);
                let pair = self.register(name).filter(|_| space == self.chip.reg_space).map(|found| found.size);
                let shortened_size = || self.shortened_matches(space, name).first().map(|symbol| symbol.size);
                let size = match (object, pair) {
                    (Some(object), _) => object.size.div_ceil(width),
                    (None, Some(pair)) => pair,
                    (None, None) => shortened_size().unwrap_or(0).div_ceil(width),
                };
                let size = size.max(1);
                (start, start.checked_add(size).ok_or_else(|| beyond(start))?)
            }
        };
        if start >= end {
            let unit = if width == 1 { "bytes" } else { "words" };
            return Err(InputError::EmptyRange { text: text.to_owned(), unit });
        }
        if end > size {
            return Err(beyond(start));
        }
        Ok(AddressRange { space, start, end })
    }

    /// Checks that the machine reports accesses to all of a range of addresses.
    ///
    /// # Errors
    /// It does not, and why.
    pub fn check_observable(&self, range: &AddressRange) -> Result<(), InputError> {
        let space = range.space;
        match self.chip.observable_from(space) {
            Some(first) if range.start < first => Err(InputError::WatchedFrom { space, first, addr: range.start }),
            Some(_) if (range.start..range.end).all(|at| self.is_accessed_implicitly(space, at)) => {
                Err(InputError::AccessedImplicitly { space, addr: range.start })
            }
            Some(_) => Ok(()),
            None => {
                let all = self.chip.spaces.iter().map(|space| space.name);
                let list: Vec<&str> = all.filter(|name| self.chip.observable_from(name).is_some()).collect();
                Err(InputError::MemoryNotWatched { watched: list.join(", "), space })
            }
        }
    }

    /// Returns true if the address is a core register, or a bit of one.
    fn is_accessed_implicitly(&self, space: &str, addr: u32) -> bool {
        let byte = if space == BIT_SPACE {
            bit_space::byte_of_bit(self.chip, addr).map(|at| (at.space, at.byte))
        } else {
            None
        };
        let (space, addr) = byte.unwrap_or((space, addr));
        self.chip.implicit_accesses.contains(&(space, addr))
    }

    /// Replaces the program's name of an AP101 channel: `motor=1` becomes `E1=1`. Any other text is
    /// unchanged.
    #[must_use]
    pub fn replace_channel_name(&self, text: &str) -> String {
        let (name, rest) = text.split_at(text.find('=').unwrap_or(text.len()));
        let named = self.symbols.iter().find(|s| s.name == name.trim() && matches!(s.space, "i" | "e"));
        let channel = |s: &SymbolAt| format!("{}{}{rest}", s.space.to_ascii_uppercase(), s.addr);
        named.filter(|_| self.chip.is_bit_controller()).map_or_else(|| text.to_owned(), channel)
    }

    /// Returns the memories that have the name at the start of a text without a memory. The program's names
    /// override the chip's.
    fn spaces_of_name(&self, text: &str) -> Vec<&'static str> {
        let whole = text.trim();
        let first = text.split("..").next().unwrap_or_default().trim();
        let name = first.split_once('+').map_or(first, |(name, _)| name).trim_end();
        let has_name = |s: &SymbolAt| s.is_named(whole) || s.is_named(name);
        let has_symbol = |space: &str| self.symbols.iter().any(|s| s.space == space && has_name(s));
        let has_shortened =
            |space: &str| [whole, name].iter().any(|name| !self.shortened_matches(space, name).is_empty());
        let spaces = self.chip.spaces.iter().map(|space| space.name);
        let found: Vec<&str> = spaces.clone().filter(|space| has_symbol(space)).collect();
        let register = || self.register(name).map(|_| self.chip.reg_space);
        let bit = || self.chip.bit(name).map(|_| BIT_SPACE).filter(|bit| spaces.clone().any(|space| space == *bit));
        let channel = || self.ap101_channel(name).map(|found| found.space);
        if !found.is_empty() {
            return found;
        }
        let found: Vec<&str> = register().into_iter().chain(bit()).chain(channel()).collect();
        if found.is_empty() { spaces.clone().filter(|space| has_shortened(space)).collect() } else { found }
    }

    /// Returns the symbols of a memory that best fit a shortened name of C++ or Rust
    /// ([`SymbolAt::is_shortened_to`]).
    #[must_use]
    pub fn shortened_matches(&self, space: &str, text: &str) -> Vec<&SymbolAt> {
        let found = self.symbols.iter().filter(|s| s.space == space);
        let found: Vec<(u8, &SymbolAt)> = found.filter_map(|s| Some((s.is_shortened_to(text)?, s))).collect();
        let best = found.iter().map(|(rank, _)| *rank).min();
        found.into_iter().filter(|(rank, _)| Some(*rank) == best).map(|(_, symbol)| symbol).collect()
    }

    /// Number of addresses at the start of data memory that are registers of the core.
    fn registers_in_ram(&self) -> u32 {
        self.chip.family_traits().registers_in_ram
    }

    /// Returns address and size in bytes of a chip register. A register with two adjacent halves, such as
    /// TCNT1 with TCNT1L and TCNT1H, has two bytes. On AVR this includes r0 to r31, with which data memory
    /// begins.
    fn register(&self, name: &str) -> Option<RegisterCells> {
        if let Some(addr) = self.chip.reg(name) {
            return Some(RegisterCells { addr: addr.into(), size: 1 });
        }
        if let Some(number) = name.strip_prefix(['r', 'R']).filter(|_| self.registers_in_ram() > 0) {
            let digits = number.len() <= 2 && number.bytes().all(|byte| byte.is_ascii_digit());
            return number
                .parse()
                .ok()
                .filter(|&at: &u32| digits && at < self.registers_in_ram())
                .map(|at| RegisterCells { addr: at, size: 1 });
        }
        let low = self.chip.reg(&format!("{name}L"))?;
        let high = self.chip.reg(&format!("{name}H"))?;
        (low.checked_add(1) == Some(high)).then_some(RegisterCells { addr: low.into(), size: 2 })
    }

    /// Returns the bit that a controller's program names `I1`, `E2`, `R3` or `M4`.
    fn ap101_channel(&self, name: &str) -> Option<SpaceAddress> {
        let (letter, digits) = name.split_at_checked(1).filter(|_| self.chip.is_bit_controller())?;
        let &ChipSpace { name: space, size, .. } =
            self.chip.spaces.iter().find(|space| space.name.eq_ignore_ascii_case(letter))?;
        let plain = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        let addr = digits.parse().ok().filter(|&addr: &u32| plain && addr < size)?;
        Some(SpaceAddress { space, addr })
    }

    /// Converts the word address of data sheets and image files to an address of a memory, if the memory
    /// counts words.
    fn word_to_space_address(&self, space: &str, word: u32) -> Option<u32> {
        let window =
            self.chip.hex_spaces.iter().find(|window| window.name == space && window.word > 1 && window.start > 0)?;
        let first = window.start / window.word;
        word.checked_sub(first).filter(|addr| *addr < window.len / window.word)
    }

    /// Parses a program address: a number or a symbol, in the unit of the chip's users (bytes on AVR, words
    /// on PIC16). Returns program words, as [`Cpu::pc`](emu_core::Cpu::pc) does.
    ///
    /// # Errors
    /// No address, not the start of a word, or beyond program memory.
    pub fn parse_program_word(&self, text: &str) -> Result<u32, InputError> {
        self.parse_word_up_to(text, self.chip.flash_bytes - 1)
    }

    /// Parses the exclusive end of a range of program memory, which may be the address after the last word;
    /// otherwise as [`AddressNames::parse_program_word`].
    ///
    /// # Errors
    /// No address, not the start of a word, or beyond the end of program memory.
    pub fn parse_program_end(&self, text: &str) -> Result<u32, InputError> {
        self.parse_word_up_to(text, self.chip.flash_bytes)
    }

    fn parse_word_up_to(&self, text: &str, most: u32) -> Result<u32, InputError> {
        let (addr, width) =
            (self.parse_address(self.chip.code_space, text)?, self.chip.bytes_per_address(self.chip.code_space));
        let byte = addr.saturating_mul(width);
        if addr % (self.chip.word_bytes / width).max(1) != 0 {
            return Err(InputError::WithinWord { addr });
        }
        if byte > most {
            let last = (self.chip.flash_bytes - 1) / width;
            return Err(InputError::BeyondMemory {
                place: format!("0x{addr:x}"),
                space: self.chip.code_space,
                last,
                hint: String::new(),
            });
        }
        Ok(byte / self.chip.word_bytes)
    }

    /// Returns the symbol at or before a byte address of program memory, as `main` or `main+0x12` (in the
    /// address unit of the chip's users); `None` before the first symbol.
    #[must_use]
    pub fn nearest_symbol(&self, byte: u32) -> Option<String> {
        let code = self.symbols.iter().filter(|s| s.space == self.chip.code_space && s.addr <= byte);
        let symbol = preferred_symbol(code)?;
        // A function of SDCC has an end: code of a library behind it is not part of it.
        let is_behind = self.chip.has_sdcc_pointers() && symbol.size > 0 && byte - symbol.addr >= symbol.size;
        (!is_behind).then(|| self.format_symbol_offset(symbol, byte))
    }

    /// Returns the symbol that contains a byte address of a memory, as `buf` or `buf+0x2`; `None` if no
    /// symbol does.
    #[must_use]
    pub fn containing_symbol(&self, space: &str, byte: u32) -> Option<String> {
        let covers = |s: &&SymbolAt| s.space == space && s.addr <= byte && byte - s.addr < s.size.max(1);
        Some(self.format_symbol_offset(preferred_symbol(self.symbols.iter().filter(covers))?, byte))
    }

    /// Returns the symbol that covers exactly this range.
    #[must_use]
    pub fn symbol_of_range(&self, range: &AddressRange) -> Option<&str> {
        let width = self.chip.bytes_per_address(range.space);
        let place = (range.start.checked_mul(width)?, range.end.checked_sub(range.start)?.checked_mul(width)?);
        let same = |s: &&SymbolAt| s.space == range.space && (s.addr, s.size) == place;
        preferred_symbol(self.symbols.iter().filter(same)).map(|symbol| symbol.name.as_str())
    }

    /// Formats a byte address as a symbol with an offset.
    fn format_symbol_offset(&self, symbol: &SymbolAt, byte: u32) -> String {
        let offset = (byte - symbol.addr) / self.chip.bytes_per_address(symbol.space);
        if offset == 0 { symbol.name.clone() } else { format!("{}+0x{offset:x}", symbol.name) }
    }

    /// Returns an address in RAM in the notation for users, for messages: `data:0x100`, `idata:0x30`.
    #[must_use]
    pub fn example_address(&self) -> String {
        // The core registers are below, if RAM begins with them.
        format!("{}:0x{:x}", self.chip.ram_space, self.chip.ram_start.max(0x30))
    }

    fn parse_address(&self, space: &str, text: &str) -> Result<u32, InputError> {
        let text = text.trim();
        let mut places: Vec<u32> =
            self.symbols.iter().filter(|s| s.space == space && s.is_named(text)).map(|s| s.addr).collect();
        places.dedup();
        match places.as_slice() {
            [] => {}
            [addr] => return Ok(addr / self.chip.bytes_per_address(space)),
            several => {
                let several: Vec<String> =
                    several.iter().map(|addr| format!("0x{:x}", addr / self.chip.bytes_per_address(space))).collect();
                return Err(InputError::SeveralPlaces {
                    text: text.to_owned(),
                    space: space.to_owned(),
                    addresses: several.join(", "),
                });
            }
        }
        let behind = text.rsplit_once('+').filter(|(name, _)| !name.trim().is_empty());
        if let Some((name, offset)) = behind.filter(|_| self.shortened_matches(space, text).is_empty()) {
            let offset =
                parse_number(offset.trim()).ok_or_else(|| InputError::BadOffset { text: offset.to_owned() })?;
            let addr = self.parse_address(space, name)?.checked_add(offset);
            return addr.ok_or_else(|| InputError::AddressOverflow { text: text.to_owned() });
        }
        if let Some((byte, position)) =
            text.rsplit_once('.').filter(|_| space == BIT_SPACE && self.chip.bit(text).is_none())
        {
            return self.parse_bit_of_byte(byte, position);
        }
        if text.starts_with(|c: char| c.is_ascii_digit()) {
            return parse_number(text).ok_or_else(|| malformed(text, "address", "0x1a2 or 418"));
        }
        let named = match space {
            BIT_SPACE => self.chip.bit(text).map(u32::from),
            _ if self.chip.is_bit_controller() => {
                self.ap101_channel(text).filter(|found| found.space == space).map(|found| found.addr)
            }
            _ => self.register(text).filter(|_| space == self.chip.reg_space).map(|found| found.addr),
        };
        // A constant serves as an address where one is expected; most constants below RAM are bit numbers (`C
        // equ 0`).
        let first = if space == self.chip.ram_space { self.chip.ram_start.into() } else { 0 };
        let constants = self.symbols.iter().filter(|s| s.space == CONSTANT_SPACE && s.name == text);
        let constant = constants.map(|s| s.addr).max();
        if let Some(found) = named.or(constant.filter(|&value| value >= first)) {
            return Ok(found);
        }
        let matches = self.shortened_matches(space, text);
        if let Some(one) = matches.first() {
            if matches.iter().all(|symbol| symbol.addr == one.addr) {
                return Ok(one.addr / self.chip.bytes_per_address(space));
            }
            return Err(self.ambiguous_name_error(space, text, &matches));
        }
        Err(match text {
            "" => InputError::MissingAddress,
            _ if constant.is_some() => InputError::ConstantBelowRam { name: text.to_owned(), first },
            _ if space == self.chip.reg_space && space != self.chip.ram_space => {
                InputError::UnknownRegister { chip: self.chip.name, name: text.to_owned() }
            }
            _ if self.symbols.is_empty() => InputError::NoSymbols { name: text.to_owned() },
            _ => InputError::UnknownSymbol { name: text.to_owned(), space: space.to_owned() },
        })
    }

    /// Returns the error for an ambiguous name, with the candidates and their addresses.
    fn ambiguous_name_error(&self, space: &str, text: &str, symbols: &[&SymbolAt]) -> InputError {
        const MOST: usize = 8;
        let each = symbols.iter().take(MOST);
        let each: Vec<String> =
            each.map(|s| format!("{} (0x{:x})", s.name, s.addr / self.chip.bytes_per_address(space))).collect();
        let more = if symbols.len() > MOST { ", .." } else { "" };
        InputError::SeveralNames { text: text.to_owned(), candidates: format!("{}{more}", each.join(", ")) }
    }

    /// Returns the address of the bit `position` of a byte, which is a number or a name in RAM or among the
    /// chip registers.
    fn parse_bit_of_byte(&self, byte: &str, position: &str) -> Result<u32, InputError> {
        let (ram, registers) = (self.chip.ram_space, self.chip.reg_space);
        let place = |space| Some((space, self.parse_address(space, byte).ok()?));
        let found = [ram, registers].into_iter().filter_map(place).collect::<Vec<_>>();
        let Some(&(_, addr)) = found.first() else {
            return Err(InputError::UnknownByte { text: byte.to_owned(), ram, registers });
        };
        let bits = found.into_iter().find_map(|(space, addr)| bit_space::bits_of_byte(self.chip, space, addr));
        let Some(bits) = bits else {
            return Err(InputError::BitsWithoutAddresses { addr, ram, registers });
        };
        match parse_number(position) {
            Some(position @ 0..=7) => Ok(bits.start + position),
            _ => Err(InputError::BadBitOfByte { text: position.to_owned() }),
        }
    }
}

/// Returns the preferred symbol for an address: the nearest before it, then the largest, then the one with
/// the fewest leading underscores (`main`, not `_main`), then the last, because weak ones come first.
fn preferred_symbol<'a>(symbols: impl Iterator<Item = &'a SymbolAt>) -> Option<&'a SymbolAt> {
    let bare = |name: &str| std::cmp::Reverse(name.bytes().take_while(|byte| *byte == b'_').count());
    symbols.max_by_key(|s| (s.addr, s.size, bare(&s.name)))
}

/// An address with its memory as users write it: `data:0x100`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryAddress<'t> {
    /// Name of the memory.
    pub memory: &'t str,
    /// The address, or several.
    pub address: &'t str,
}

/// Splits `data:0x100` into memory and address. The colons of `app::result` belong to the name.
#[must_use]
pub fn split_memory(text: &str) -> Option<MemoryAddress<'_>> {
    let (memory, address) = text.split_once(':')?;
    (!address.starts_with(':')).then_some(MemoryAddress { memory, address })
}

/// Parses a number, decimal or with 0x.
#[must_use]
pub fn parse_number(text: &str) -> Option<u32> {
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) if !digits.starts_with('+') => u32::from_str_radix(digits, 16).ok(),
        None if text.bytes().all(|b| b.is_ascii_digit()) => text.parse().ok(),
        _ => None,
    }
}

/// A place at or behind a symbol as gdb writes it: `buf+0xa` as `buf+10`.
#[must_use]
pub fn decimal_offset(name: &str) -> String {
    let parts = name.rsplit_once("+0x").and_then(|(name, by)| Some((name, u32::from_str_radix(by, 16).ok()?)));
    parts.map_or_else(|| name.to_owned(), |(name, by)| format!("{name}+{by}"))
}
