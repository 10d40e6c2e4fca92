//! Names and lines of an absolute object file: scopes, debug items, public definitions, and Keil's additions.
//!
//! ```text
//!   scope (10):       kind (0 module, 1 block, 2 function begins; 3, 4, 5 end), name
//!   debug items (12): 0 locals, 1 publics, 2 segments: {segment, info, offset (2), 0, name};
//!                     3 lines: {segment, offset (2), line (2)}
//!   public (16):      {segment, info, offset (2), 0, name}
//!   info:             bits 0 to 2: 0 code, 1 external RAM, 2 RAM, 3 indirect RAM, 4 bit, 5 number
//!   Keil (22):        as debug items; there can be one or two more bytes before a name. Not published.
//!   Keil (24):        4 bytes, the name of the module's source file, 0
//! ```

use diag::Pos;

use crate::image::SourceLine;
use crate::image::SymbolAt;
use crate::image::faults::FaultList;
use crate::image::symbols::keil::ScopeTracker;
use crate::image::symbols::names::{NameRank, RankedName, resolve_names};
use crate::image::symbols::{CollectedSymbols, MemorySpace, too_long};

/// Maximum number of names and lines together; a program of 64 KB has a few thousand.
const MAX_ITEMS: usize = 1 << 18;

/// A name, which is preceded by its length, and the bytes after it.
pub(super) struct SizedName<'b> {
    pub name: &'b [u8],
    pub rest: &'b [u8],
}

impl SizedName<'_> {
    /// Splits off the name that `bytes` begin with.
    pub(super) fn split(bytes: &[u8]) -> Option<SizedName<'_>> {
        let (&length, rest) = bytes.split_first()?;
        rest.split_at_checked(length.into()).map(|(name, rest)| SizedName { name, rest })
    }
}

fn lossy_name(name: &[u8]) -> String {
    String::from_utf8_lossy(name).into_owned()
}

/// Collects names and lines as they are read.
#[derive(Default)]
pub(super) struct OmfItems {
    scopes: ScopeTracker,
    found: CollectedSymbols,
    /// A source file that comes before its module.
    source: Option<String>,
    /// Whether the scope of a module is open.
    open: bool,
    /// Number of names and lines so far.
    count: usize,
    /// Number of records that could not be read to their end.
    damaged: u64,
}

/// A symbol in a record.
struct OmfItem<'b> {
    info: u8,
    offset: u16,
    name: &'b [u8],
}

/// The debugging information of an OMF-51 file.
#[derive(Debug, Clone)]
pub(super) struct OmfSymbolsAndLines {
    /// The symbols with their addresses.
    pub(super) symbols: Vec<SymbolAt>,
    /// The source lines with their addresses.
    pub(super) lines: Vec<SourceLine>,
}

impl OmfItems {
    /// Reads the module header.
    pub(super) fn header(&mut self, module: &[u8]) {
        self.module(module);
    }

    fn module(&mut self, module: &[u8]) {
        let mut quiet = FaultList::new("", "");
        let module = lossy_name(module);
        let stem = module.rsplit(['\\', '/']).next().unwrap_or_default();
        self.scopes.module(stem, None, &mut self.found, &mut quiet);
        if let Some(source) = self.source.take() {
            self.scopes.source(&source);
        }
    }

    /// Reads the begin or end of a scope.
    pub(super) fn scope(&mut self, contents: &[u8]) {
        let Some((kind, rest)) = contents.split_first() else { return self.damaged += 1 };
        let Some(SizedName { name, .. }) = SizedName::split(rest) else { return self.damaged += 1 };
        match kind {
            0 => {
                self.module(name);
                self.open = true;
            }
            1 => self.scopes.block(),
            2 => self.scopes.function(&lossy_name(name)),
            3 => {
                self.scopes.end_module();
                self.open = false;
            }
            4 => self.scopes.end_block(),
            5 => self.scopes.end_function(),
            _ => self.damaged += 1,
        }
    }

    /// Reads debug items in Intel's format; `width` is the number of bytes of a segment number.
    pub(super) fn items(&mut self, contents: &[u8], width: usize) {
        let Some((kind, rest)) = contents.split_first() else { return self.damaged += 1 };
        match kind {
            0 | 1 => match split_items(rest, width, 1) {
                Some(items) => items.iter().for_each(|item| self.symbol(item, *kind == 1)),
                None => self.damaged += 1,
            },
            // Names of segments are not names of addresses.
            2 => {}
            3 => self.lines(rest, width),
            _ => self.damaged += 1,
        }
    }

    /// Reads debug items of Keil's linkers.
    pub(super) fn keil(&mut self, contents: &[u8]) {
        let Some((kind, rest)) = contents.split_first() else { return self.damaged += 1 };
        match kind {
            0 | 1 => match (1..=3).find_map(|between| split_items(rest, 1, between)) {
                Some(items) => items.iter().for_each(|item| self.symbol(item, *kind == 1)),
                None => self.damaged += 1,
            },
            3 => self.lines(rest, 1),
            _ => {}
        }
    }

    /// Reads public definitions.
    pub(super) fn publics(&mut self, contents: &[u8], width: usize) {
        match split_items(contents, width, 1) {
            Some(items) => items.iter().for_each(|item| self.symbol(item, true)),
            None => self.damaged += 1,
        }
    }

    /// Reads the name of the source file of the module that is open or comes next.
    pub(super) fn source(&mut self, contents: &[u8]) {
        let name = contents.get(4..).unwrap_or_default();
        let name = name.split(|byte| *byte == 0).next().unwrap_or_default();
        // If the first byte is the length of the rest, as for other names, it is not part of the name.
        let name = match name.split_first() {
            Some((&first, rest)) if usize::from(first) == rest.len() => rest,
            _ => name,
        };
        let name = lossy_name(name);
        let file = name.rsplit(['\\', '/']).next().unwrap_or_default();
        if too_long(file) {
            self.damaged += 1;
        } else if !file.is_empty() && !file.contains(char::is_control) {
            match self.open {
                true => self.scopes.source(file),
                false => self.source = Some(file.to_owned()),
            }
        }
    }

    fn lines(&mut self, bytes: &[u8], width: usize) {
        let each = bytes.chunks_exact(width + 4);
        if !each.remainder().is_empty() {
            self.damaged += 1;
        }
        for item in each {
            let Some((segment, [a, b, c, d])) = item.split_at_checked(width) else { continue };
            let (addr, line) = (u16::from_le_bytes([*a, *b]), u16::from_le_bytes([*c, *d]));
            self.count += 1;
            if segment.iter().all(|byte| *byte == 0) && line > 0 && self.count <= MAX_ITEMS {
                self.scopes.line(addr.into(), line.into(), Pos::default());
            }
        }
    }

    fn symbol(&mut self, item: &OmfItem<'_>, public: bool) {
        self.count += 1;
        if item.name.is_empty() || self.count > MAX_ITEMS {
            return;
        }
        let (addr, name) = (u32::from(item.offset), lossy_name(item.name));
        let mem = match item.info & 7 {
            0 => MemorySpace::Code,
            1 => MemorySpace::Xdata,
            2 if addr <= 0xFF => MemorySpace::Sfr,
            3 if addr <= 0xFF => MemorySpace::Idata,
            4 if addr <= 0xFF => MemorySpace::Bit,
            5 => return self.found.unplaced.push((name, addr)),
            _ => return self.damaged += 1,
        };
        let (pos, mut quiet) = (Pos::default(), FaultList::new("", ""));
        match public {
            true => self.scopes.public(mem, addr, &name, pos, &mut self.found, &mut quiet),
            false => self.scopes.local(mem, addr, &name, pos, &mut self.found, &mut quiet),
        }
    }

    /// Returns the symbols and lines. Unreadable records are reported once for the whole file.
    pub(super) fn finish(mut self, faults: &mut FaultList) -> OmfSymbolsAndLines {
        self.scopes.finish(&mut self.found, &mut FaultList::new("", ""));
        if self.damaged > 0 || self.count > MAX_ITEMS {
            let damaged = self.damaged;
            let cause = || match damaged {
                0 => format!("there are more names and lines than {MAX_ITEMS}, the rest is ignored"),
                _ => format!(
                    "{damaged} records or names of debugging information cannot be read, so names and lines may be missing"
                ),
            };
            faults.warning("OMF011", Pos::default(), cause, "give the map of the linker as --symbols");
        }
        // A name with two addresses is dropped: names never cause a program to be rejected.
        for entry in &mut self.found.entries {
            entry
                .names
                .iter_mut()
                .filter(|RankedName { rank, .. }| *rank == NameRank::Exact)
                .for_each(|RankedName { rank, .. }| *rank = NameRank::Full);
        }
        let mut symbols = resolve_names(&self.found.entries, &[], &mut Vec::new());
        symbols.extend(
            self.found
                .unplaced
                .into_iter()
                .map(|(name, value)| SymbolAt::new(name, crate::image::CONSTANT_SPACE, value, 0)),
        );
        OmfSymbolsAndLines { symbols, lines: self.found.lines }
    }
}

/// Splits a record into its named items, with `between` bytes between offset and name. Returns `None` if they
/// do not fill the record exactly.
fn split_items(mut bytes: &[u8], width: usize, between: usize) -> Option<Vec<OmfItem<'_>>> {
    let mut items = Vec::new();
    while !bytes.is_empty() {
        let (segment, rest) = bytes.split_at_checked(width)?;
        let (&[info, low, high], rest) = rest.split_first_chunk()?;
        let SizedName { name, rest } = SizedName::split(rest.get(between..)?)?;
        if name.iter().any(|byte| *byte < b' ') {
            return None;
        }
        // A symbol in a segment without an address has no address.
        if segment.iter().all(|byte| *byte == 0) {
            items.push(OmfItem { info, offset: u16::from_le_bytes([low, high]), name });
        }
        bytes = rest;
    }
    Some(items)
}
