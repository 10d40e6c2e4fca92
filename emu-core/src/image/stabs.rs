//! Stabs in ELF files (`.stab`, `.stabstr`), as GCC up to 12 writes them for AVR with a mere `-g`.
//!
//! ```text
//!   .stab     records of 12 bytes: offset of a text, type, unused, desc, value
//!   .stabstr  the texts, by unit; a record of type 0 begins a unit and gives the length of its texts
//! ```
//!
//! The format is that of the manual "STABS" of binutils; where it leaves open what a debugger makes of it,
//! the rules are those of gdb (dbxread.c, stabsread.c, buildsym.c). `stabs/lines.rs` reads the lines,
//! `debug_info/stabs.rs` functions, variables and types.

mod lines;

use crate::image::elf::NamedSection;
use std::borrow::Cow;
use std::collections::HashSet;

pub(super) use lines::{StabLines, read_stab_lines};

use super::elf;

/// Types of records (binutils, include/aout/stab.def).
pub(super) mod record {
    /// Head of the records of a unit.
    pub const UNDF: u8 = 0x00;
    pub const GSYM: u8 = 0x20;
    pub const FUN: u8 = 0x24;
    pub const STSYM: u8 = 0x26;
    pub const LCSYM: u8 = 0x28;
    pub const ROSYM: u8 = 0x2C;
    pub const OPT: u8 = 0x3C;
    pub const RSYM: u8 = 0x40;
    pub const SLINE: u8 = 0x44;
    pub const SO: u8 = 0x64;
    pub const LSYM: u8 = 0x80;
    pub const BINCL: u8 = 0x82;
    pub const SOL: u8 = 0x84;
    pub const PSYM: u8 = 0xA0;
    pub const LBRAC: u8 = 0xC0;
    pub const EXCL: u8 = 0xC2;
    pub const RBRAC: u8 = 0xE0;
}

/// Bytes of a record.
const RECORD_BYTES: usize = 12;
/// Longest path.
const MAX_PATH: usize = 4096;

/// A record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Stab<'b> {
    pub kind: u8,
    pub desc: u16,
    pub value: u32,
    pub text: Cow<'b, [u8]>,
}

/// The records of a file in their order.
pub(super) struct StabRecords<'b> {
    records: std::slice::Chunks<'b, u8>,
    texts: &'b [u8],
    /// Where the texts of the present unit and of the next one begin.
    base: usize,
    next_base: usize,
    /// Bytes of texts that may still be handed out: damaged records may all name one long text.
    budget: usize,
    /// The first thing that was wrong.
    pub fault: Option<&'static str>,
}

impl<'b> StabRecords<'b> {
    /// Those of the sections of an ELF file; nothing where it has none.
    pub fn new(sections: &[NamedSection<'b>]) -> Option<StabRecords<'b>> {
        let named = |wanted: &str| {
            sections
                .iter()
                .find(|NamedSection { name, .. }| *name == wanted)
                .map(|NamedSection { section: own, .. }| own.bytes())
        };
        let records = named(".stab").filter(|records| !records.is_empty())?;
        let texts = named(".stabstr").unwrap_or_default();
        let budget = 4 * (records.len() + texts.len()) + (1 << 20);
        Some(StabRecords { records: records.chunks(RECORD_BYTES), texts, base: 0, next_base: 0, budget, fault: None })
    }

    fn text(&mut self, offset: u32) -> &'b [u8] {
        let at = self.base.saturating_add(offset as usize);
        let Some(rest) = self.texts.get(at..) else {
            self.fault.get_or_insert("a text is outside of its section");
            return &[];
        };
        let text = rest.split(|byte| *byte == 0).next().unwrap_or_default();
        self.budget = self.budget.saturating_sub(text.len());
        text
    }

    fn record(&mut self) -> Option<Stab<'b>> {
        let &[t0, t1, t2, t3, kind, _, d0, d1, v0, v1, v2, v3] = self.records.next()? else {
            self.fault.get_or_insert("its last record is cut off");
            return None;
        };
        let value = u32::from_le_bytes([v0, v1, v2, v3]);
        if kind == record::UNDF {
            self.base = self.next_base;
            self.next_base = self.base.saturating_add(value as usize);
        }
        let text = self.text(u32::from_le_bytes([t0, t1, t2, t3]));
        Some(Stab { kind, desc: u16::from_le_bytes([d0, d1]), value, text: Cow::Borrowed(text) })
    }
}

impl<'b> Iterator for StabRecords<'b> {
    type Item = Stab<'b>;

    fn next(&mut self) -> Option<Stab<'b>> {
        let mut stab = self.record()?;
        // A text that ends with a backslash goes on in the next record.
        while stab.text.ends_with(b"\\") {
            let whole = stab.text.to_mut();
            whole.pop();
            let Some(next) = self.record() else { break };
            whole.extend_from_slice(&next.text);
            self.budget = self.budget.saturating_sub(whole.len());
            if self.budget == 0 {
                break;
            }
        }
        if self.budget == 0 {
            self.fault.get_or_insert("its records have more text than a file can have");
            return None;
        }
        Some(stab)
    }
}

/// Where the records of a file are in its units and functions.
#[derive(Debug, Default)]
pub(super) struct StabPosition {
    /// Folder of the compilation and main file of the unit.
    pub folder: String,
    pub unit: String,
    /// The first address of the function, from which lines and blocks count; 0 outside of functions.
    pub function: u32,
}

/// What a record of type SO does.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum UnitChange {
    /// It gives the folder of the unit that begins.
    Folder,
    /// A unit begins at an address.
    Begins(u32),
    /// The unit ends at an address.
    Ends(u32),
}

impl StabPosition {
    /// Follows a record of type SO.
    pub fn change_unit(&mut self, stab: &Stab<'_>) -> UnitChange {
        self.function = 0;
        let name = path_text(&stab.text);
        if name.ends_with('/') {
            self.folder = name.trim_end_matches('/').to_owned();
            return UnitChange::Folder;
        }
        if name.is_empty() {
            *self = StabPosition::default();
            return UnitChange::Ends(stab.value);
        }
        self.unit = name;
        UnitChange::Begins(stab.value)
    }
}

/// The text of a record: `name:description`.
pub(super) struct StabText<'b> {
    pub name: &'b [u8],
    pub description: &'b [u8],
}

/// Splits a text at the colon behind its name; `::` belongs to names of C++.
pub(super) fn split_name(text: &[u8]) -> Option<StabText<'_>> {
    let mut at = 0;
    loop {
        at += text.get(at..)?.iter().position(|byte| *byte == b':')?;
        if text.get(at + 1) != Some(&b':') {
            return Some(StabText { name: text.get(..at)?, description: text.get(at + 1..)? });
        }
        at += 2;
    }
}

/// The name of the function that a record of type FUN begins, and the text of its result type. Others with
/// that type describe variables in program memory.
pub(super) fn function_name(text: &[u8]) -> Option<StabText<'_>> {
    let StabText { name, description } = split_name(text)?;
    let result = description.strip_prefix(b"f").or_else(|| description.strip_prefix(b"F"))?;
    Some(StabText { name, description: result })
}

/// Names of what is at address 0. A linker that drops a function may leave its records there.
pub(super) struct NamesAtZero<'b>(HashSet<&'b [u8]>);

impl<'b> NamesAtZero<'b> {
    pub fn new(elf: &'b [u8]) -> NamesAtZero<'b> {
        NamesAtZero(elf::code_names_at(elf, 0).into_iter().filter(|name| name.len() <= MAX_PATH).collect())
    }

    /// The function that begins at an address was dropped by the linker.
    pub fn is_dropped(&self, address: u32, name: &[u8]) -> bool {
        address == 0 && !self.0.contains(name)
    }
}

/// Returns a path as text, cut at the maximum length.
pub(super) fn path_text(text: &[u8]) -> String {
    String::from_utf8_lossy(text.get(..text.len().min(MAX_PATH)).unwrap_or_default()).into_owned()
}
