//! Names and lines by module, function and block, as the tools around Intel's and Keil's object format have them.
//!
//! The linker's map and the absolute object file say the same things in the same order, one in text and one in records: modules open
//! and close, functions in them, blocks in those, and each name and line belongs to what is open. So both readers feed one
//! [`ScopeTracker`], which makes names and lines of it.
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

/// Registers R0 to R7 of bank 0: a local name for one holds within a few instructions only. LX51 also lists the parameters of functions
/// that it removed, outside any block.
const BANK_BYTES: u32 = 8;

/// What is open, and what waits for the name of its file.
#[derive(Default)]
pub(in crate::image) struct ScopeTracker {
    /// The module as it is shown: the stem of its object file, else its name.
    module: String,
    /// Its end has come.
    ended: bool,
    /// Its source file, where that is known.
    file: Option<String>,
    /// It was made by a compiler of C.
    compiled: bool,
    /// The function, in the spelling of its name.
    function: Option<String>,
    /// Blocks that are open in the function, by number from 1.
    blocks: Vec<u32>,
    /// Blocks of the function up to now.
    counted: u32,
    /// Names of code in the module, by what they are in capitals without the mark of parameters in registers: a function is
    /// announced so.
    spelled: HashMap<String, String>,
    /// Functions of the module by address.
    starts: HashMap<u32, String>,
    lines: Vec<(u32, u32, Pos)>,
}

impl ScopeTracker {
    /// A module begins; `stem` is the name of its object file without extension, if it is known.
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

    /// The source file of the module.
    pub(crate) fn source(&mut self, file: &str) {
        self.compiled |= file.to_ascii_lowercase().ends_with(".c");
        self.file = Some(file.to_owned());
    }

    /// The module ends. Lines that come behind it are still its own.
    pub(crate) fn end_module(&mut self) {
        self.end_function();
        self.ended = true;
    }

    /// The module that began last, if nothing has ended it.
    pub(crate) fn open_module(&self) -> Option<&str> {
        Some(self.module.as_str()).filter(|module| !self.ended && !module.is_empty())
    }

    /// A function begins.
    pub(crate) fn function(&mut self, name: &str) {
        self.compiled = true;
        let plain = plain_name(name);
        let name = self.spelled.get(&plain.to_uppercase()).map_or(plain, |spelled| spelled);
        (self.function, self.counted) = (Some(name.to_owned()), 0);
        self.blocks.clear();
    }

    /// The function that begins at an address.
    pub(crate) fn function_at(&mut self, addr: u32) {
        if let Some(name) = self.starts.get(&addr).cloned() {
            self.function(&name);
        }
    }

    /// A function ends.
    pub(crate) fn end_function(&mut self) {
        self.function = None;
        self.blocks.clear();
    }

    /// A block within a function begins.
    pub(crate) fn block(&mut self) {
        self.counted = self.counted.saturating_add(1);
        self.blocks.push(self.counted);
    }

    /// A block ends.
    pub(crate) fn end_block(&mut self) {
        self.blocks.pop();
    }

    /// All blocks end but so many.
    pub(crate) fn leave_blocks(&mut self, open: usize) {
        self.blocks.truncate(open);
    }

    /// A name that all modules know.
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
        // A register of the chip has a name of its own in every module, of which two may differ.
        let own = matches!(mem, MemorySpace::Sfr | MemorySpace::Bit) && addr >= 0x80;
        let names = if own {
            vec![(NameRank::Full, format!("{}.{name}", self.module)), (NameRank::Plain, name.to_owned())]
        } else {
            linker_names(name)
        };
        found.add_symbol(mem, addr, 0, names, pos, faults);
    }

    /// A name that the module, function or block alone knows.
    pub(crate) fn local(
        &mut self,
        mem: MemorySpace,
        addr: u32,
        name: &str,
        pos: Pos,
        found: &mut CollectedSymbols,
        faults: &mut FaultList,
    ) {
        // Compilers put it into every module for the debugger's use.
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
            Some(block) => vec![(NameRank::Full, format!("{path}${block}")), (NameRank::Near, path)],
            None => vec![(NameRank::Full, path)],
        };
        names.extend([(NameRank::Near, format!("{function}.{name}")), (NameRank::Bare, name.to_owned())]);
        found.add_symbol(mem, addr, 0, names, pos, faults);
    }

    /// A line whose code begins at an address.
    pub(crate) fn line(&mut self, addr: u32, line: u32, pos: Pos) {
        self.lines.push((addr, line, pos));
    }

    /// Hands over the lines of the module, whose file is known by now.
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

/// A function's name without the mark of one whose parameters lie in registers.
fn plain_name(name: &str) -> &str {
    name.strip_prefix('_').filter(|plain| !plain.is_empty()).unwrap_or(name)
}

/// The bit address of a bit of a byte: RAM from 0x20 to 0x2F, or a register at every eighth address; nothing where there is none.
pub(super) fn bit_address(byte: u32, bit: u32) -> Option<u32> {
    match byte {
        _ if bit > 7 => None,
        0x20..=0x2F => Some((byte - 0x20) * 8 + bit),
        0x80..=0xFF if byte.is_multiple_of(8) => Some(byte + bit),
        _ => None,
    }
}
