//! Collects names and lines by module, function and block, as tools for Intel's and Keil's object format
//! describe them.
//!
//! The linker's map and the absolute object file contain the same items in the same order, one as text and
//! one as records: modules open and close, with functions in them and blocks in those. Each name and line
//! belongs to the innermost open item. Both readers therefore use one [`ScopeTracker`], which makes names and
//! lines of the items.
//!
//! ```text
//!   m51.rs    the map, of BL51 and of LX51
//!   ../../omf51/   the object file
//! ```

pub(super) mod m51;

use std::collections::HashMap;

use diag::Pos;

use super::names::{NameRank, RankedName, linker_names, local_names};
use super::{CollectedSymbols, FaultList, MemorySpace, SourceKind};

/// Size of register bank 0 (R0 to R7) in bytes. A local name of one of these is valid for a few instructions
/// only. LX51 also lists parameters of functions that it removed, outside of any block.
const BANK_BYTES: u32 = 8;

/// The open module, function and blocks, and lines that wait for the name of their file.
#[derive(Default)]
pub(in crate::image) struct ScopeTracker {
    /// Name of the module in symbol names: the stem of its object file, or else its own name.
    module: String,
    /// Whether the end of the module has been read.
    ended: bool,
    /// Source file of the module, if known.
    file: Option<String>,
    /// Whether a C compiler made the module.
    compiled: bool,
    /// The open function, in the spelling of its public name.
    function: Option<String>,
    /// The open blocks of the function, numbered from 1.
    blocks: Vec<u32>,
    /// Number of blocks of the function so far.
    counted: u32,
    /// Names of code in the module. The key is the name in capitals without the underscore that marks
    /// parameters in registers, because functions are announced in that form.
    spelled: HashMap<String, String>,
    /// Functions of the module by address.
    starts: HashMap<u32, String>,
    lines: Vec<(u32, u32, Pos)>,
}

impl ScopeTracker {
    /// Starts a module; `stem` is the name of its object file without extension, if known.
    pub(crate) fn module(
        &mut self,
        name: &str,
        stem: Option<&str>,
        found: &mut CollectedSymbols,
        faults: &mut FaultList,
    ) {
        self.finish(found, faults);
        *self = ScopeTracker { module: stem.unwrap_or(name).to_owned(), ..ScopeTracker::default() };
    }

    /// Sets the source file of the module.
    pub(crate) fn source(&mut self, file: &str) {
        self.compiled |= file.to_ascii_lowercase().ends_with(".c");
        self.file = Some(file.to_owned());
    }

    /// Ends the module. Lines that follow still belong to it.
    pub(crate) fn end_module(&mut self) {
        self.end_function();
        self.ended = true;
    }

    /// The last module, if its end has not been read.
    pub(crate) fn open_module(&self) -> Option<&str> {
        Some(self.module.as_str()).filter(|module| !self.ended && !module.is_empty())
    }

    /// Starts a function.
    pub(crate) fn function(&mut self, name: &str) {
        self.compiled = true;
        let plain = plain_name(name);
        let name = self.spelled.get(&plain.to_uppercase()).map_or(plain, |spelled| spelled);
        (self.function, self.counted) = (Some(name.to_owned()), 0);
        self.blocks.clear();
    }

    /// Starts the function whose code begins at an address.
    pub(crate) fn function_at(&mut self, addr: u32) {
        if let Some(name) = self.starts.get(&addr).cloned() {
            self.function(&name);
        }
    }

    /// Ends the function.
    pub(crate) fn end_function(&mut self) {
        self.function = None;
        self.blocks.clear();
    }

    /// Starts a block in the function.
    pub(crate) fn block(&mut self) {
        self.counted = self.counted.saturating_add(1);
        self.blocks.push(self.counted);
    }

    /// Ends the innermost block.
    pub(crate) fn end_block(&mut self) {
        self.blocks.pop();
    }

    /// Ends all blocks but the outermost `open` ones.
    pub(crate) fn leave_blocks(&mut self, open: usize) {
        self.blocks.truncate(open);
    }

    /// Adds a name that all modules know.
    pub(crate) fn public(
        &mut self,
        mem: MemorySpace,
        addr: u32,
        name: &str,
        pos: Pos,
        found: &mut CollectedSymbols,
        faults: &mut FaultList,
    ) {
        self.full_name(mem, addr, name);
        // Every module has its own name for a register of the chip, and the names in two modules may differ.
        let own = matches!(mem, MemorySpace::Sfr | MemorySpace::Bit) && addr >= 0x80;
        let names = if own {
            vec![
                RankedName { rank: NameRank::Full, name: format!("{}.{name}", self.module) },
                RankedName { rank: NameRank::Plain, name: name.to_owned() },
            ]
        } else {
            linker_names(name)
        };
        found.add_symbol(mem, addr, 0, names, pos, faults);
    }

    /// Adds a name that is local to the module, function or block.
    pub(crate) fn local(
        &mut self,
        mem: MemorySpace,
        addr: u32,
        name: &str,
        pos: Pos,
        found: &mut CollectedSymbols,
        faults: &mut FaultList,
    ) {
        // Compilers put this name into every module for the debugger.
        if name == "_ICE_DUMMY_" {
            self.compiled = true;
            return;
        }
        if mem == MemorySpace::Sfr && addr < BANK_BYTES {
            return;
        }
        let Some(function) = &self.function else {
            self.full_name(mem, addr, name);
            return found.add_symbol(mem, addr, 0, local_names(&self.module, name), pos, faults);
        };
        let path = format!("{}.{function}.{name}", self.module);
        let mut names: Vec<RankedName> = match self.blocks.last() {
            Some(block) => vec![
                RankedName { rank: NameRank::Full, name: format!("{path}${block}") },
                RankedName { rank: NameRank::Near, name: path },
            ],
            None => vec![RankedName { rank: NameRank::Full, name: path }],
        };
        names.extend([
            RankedName { rank: NameRank::Near, name: format!("{function}.{name}") },
            RankedName { rank: NameRank::Bare, name: name.to_owned() },
        ]);
        found.add_symbol(mem, addr, 0, names, pos, faults);
    }

    /// Adds a line whose code begins at an address.
    pub(crate) fn line(&mut self, addr: u32, line: u32, pos: Pos) {
        self.lines.push((addr, line, pos));
    }

    /// Hands over the lines of the module; its source file is known by now.
    pub(crate) fn finish(&mut self, found: &mut CollectedSymbols, faults: &mut FaultList) {
        if self.lines.is_empty() {
            return;
        }
        let file = self.file.take().unwrap_or_else(|| {
            let extension = if self.compiled { "c" } else { "a51" };
            format!("{}.{extension}", self.module)
        });
        let kind = if self.compiled { SourceKind::C } else { SourceKind::Asm };
        for (addr, line, pos) in std::mem::take(&mut self.lines) {
            found.add_line(addr, kind, &file, line, pos, faults);
        }
    }

    fn full_name(&mut self, mem: MemorySpace, addr: u32, name: &str) {
        if mem == MemorySpace::Code {
            let plain = plain_name(name).to_owned();
            self.spelled.insert(plain.to_uppercase(), plain.clone());
            self.starts.insert(addr, plain);
        }
    }
}

/// The name of a function without the underscore that marks parameters in registers.
fn plain_name(name: &str) -> &str {
    name.strip_prefix('_').filter(|plain| !plain.is_empty()).unwrap_or(name)
}

/// The bit address of a bit of a byte in RAM from 0x20 to 0x2F, or of a register at an address divisible by
/// 8; `None` for other bytes.
pub(super) fn bit_address(byte: u32, bit: u32) -> Option<u32> {
    match byte {
        _ if bit > 7 => None,
        0x20..=0x2F => Some((byte - 0x20) * 8 + bit),
        0x80..=0xFF if byte.is_multiple_of(8) => Some(byte + bit),
        _ => None,
    }
}
