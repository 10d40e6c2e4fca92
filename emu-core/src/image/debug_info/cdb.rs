//! Functions, variables and types out of SDCC's debugging records (CDB File Format, section 4) of MCS-51
//! programs.
//!
//! ```text
//!   S:G$items$0_0$0({14}DA2d,STitem:S),E,0,0    chain of types, outermost first; memory
//!   S:Lm.main$i$1_0$6({1}SC:U),R,0,0,[r5]       in registers, the lowest byte first
//!   T:Fm$item[({0}S:S$kind$0_0$0({1}SC:U),Z,0,0)..]
//!   L:G$add$0$0:68   L:XG$add$0$0:76            first address of a function, and of its last instruction
//! ```
//!
//! Each memory has its part of one address space; pointers without a tag of their own get that of their
//! memory ([`Mcs51Memory`]).

use crate::image::debug_info::BitsInByte;
use std::collections::{HashMap, HashSet};

use super::{
    BaseEncoding, BitRange, BlockInfo, CType, DebugInfo, FunctionInfo, StructMember, TypeId, UnitInfo, VariableInfo,
    VariableLocation,
};
use crate::image::symbols::names::{DebugRecord, SymbolScope, parse_debug_record};

/// The parts of the address space of MCS-51 debugging information. Generic pointers of SDCC have the same
/// tags in their third byte, below [`Mcs51Memory::POINTER`].
#[derive(Debug, Clone, Copy)]
pub struct Mcs51Memory;

/// An address in one of the memories of a chip.
#[derive(Debug, Clone, Copy)]
pub struct SpaceAddress {
    /// The name of the memory.
    pub space: &'static str,
    /// The address in the memory.
    pub addr: u32,
}

impl Mcs51Memory {
    /// A flag in what a pointer holds: without it a number below 0x10000 has no memory yet.
    pub const POINTER: u32 = 0x0100_0000;
    /// External RAM.
    pub const XDATA: u32 = 0x20_0000;
    /// Internal RAM.
    pub const IDATA: u32 = 0x40_0000;
    /// Program memory.
    pub const CODE: u32 = 0x80_0000;
    /// Registers of the chip.
    pub const SFR: u32 = 0x81_0000;
    /// Bits, one to a byte.
    pub const BIT: u32 = 0x83_0000;

    /// Returns what a generic pointer has above its 16 bits of address, for a memory.
    #[must_use]
    pub fn generic_tag(space: &str) -> u32 {
        match space {
            "idata" => Self::IDATA,
            "code" => Self::CODE,
            _ => 0,
        }
    }

    /// Returns the memory and the address there.
    #[must_use]
    pub fn split(address: u32) -> SpaceAddress {
        let addr = address & 0xFFFF;
        match address & 0xFF_0000 {
            Self::IDATA => SpaceAddress { space: "idata", addr },
            Self::CODE => SpaceAddress { space: "code", addr },
            Self::SFR => SpaceAddress { space: "sfr", addr },
            Self::BIT => SpaceAddress { space: "bit", addr },
            // A number alone is in the memory that is large enough.
            0 if address < 0x100 => SpaceAddress { space: "idata", addr },
            _ => SpaceAddress { space: "xdata", addr },
        }
    }
}

/// Deepest chain of types, and of structs in structs.
const MAX_DEPTH: usize = 32;

/// `DW_OP_addr`, `DW_OP_reg0` and `DW_OP_piece`.
const DW_OP_ADDR: u8 = 0x03;
const DW_OP_REG0: u8 = 0x50;
const DW_OP_PIECE: u8 = 0x93;

/// What the records describe.
#[derive(Default)]
pub(in crate::image) struct CdbTypes {
    pub info: DebugInfo,
    /// Bit variables outside of functions: SDCC gives their addresses only in the map of the linker.
    pub unplaced_bits: Vec<VariableInfo>,
}

impl CdbTypes {
    /// Returns the debugging information, with the bit variables whose addresses `address_of` knows.
    pub fn with_bit_addresses(mut self, address_of: impl Fn(&str) -> Option<u32>) -> DebugInfo {
        for bit in self.unplaced_bits {
            if let Some(addr) = address_of(&bit.name) {
                let location = address_location(Mcs51Memory::BIT, addr);
                self.info.globals.push(VariableInfo { location, ..bit });
            }
        }
        self.info
    }
}

/// Reads the records; damaged ones are left out.
pub(in crate::image) fn read_cdb_types(text: &str) -> CdbTypes {
    let records = || text.lines().map(str::trim_end).filter_map(|line| line.split_once(':'));
    let mut reader = CdbReader::default();
    let links = records().filter(|(kind, _)| *kind == "L").filter_map(|(_, rest)| rest.rsplit_once(':'));
    reader.links = links.filter_map(|(name, addr)| Some((key(name)?, u32::from_str_radix(addr, 16).ok()?))).collect();
    for (kind, rest) in records() {
        match kind {
            "M" => reader.units.push(rest),
            "T" => reader.declare(rest),
            _ => {}
        }
    }
    let bodies: Vec<(&str, TypeId)> = reader.bodies.clone();
    bodies.into_iter().for_each(|(body, id)| reader.members(body, id));
    records().filter(|(kind, _)| *kind == "F").for_each(|(_, rest)| reader.function(rest));
    records().filter(|(kind, _)| *kind == "S").for_each(|(_, rest)| reader.variable(rest));
    records().filter(|(kind, _)| *kind == "L").for_each(|(_, rest)| reader.untyped_variable(rest));
    reader.finish()
}

/// A name without what differs between records of one symbol.
fn key(name: &str) -> Option<String> {
    let (end, own) = name.strip_prefix('X').map_or(("", name), |own| ("X", own));
    match parse_debug_record(own)? {
        DebugRecord::Symbol { scope, name, level, block } => Some(format!("{end}{scope:?}{name}${level}${block}")),
        _ => None,
    }
}

#[derive(Default)]
struct CdbReader<'t> {
    info: DebugInfo,
    /// Addresses by the keys of names.
    links: HashMap<String, u32>,
    units: Vec<&'t str>,
    /// Structs and unions by their tags.
    tags: HashMap<&'t str, TypeId>,
    bodies: Vec<(&'t str, TypeId)>,
    known: HashMap<(&'t str, u32), TypeId>,
    next: usize,
    /// Keys of the symbol records.
    described: HashSet<String>,
    unplaced_bits: Vec<VariableInfo>,
    /// Number of variables of functions in internal RAM, and in external RAM.
    local_counts: (usize, usize),
}

impl<'t> CdbReader<'t> {
    fn add(&mut self, kind: CType) -> TypeId {
        self.next += 1;
        self.info.types.insert(self.next, kind);
        TypeId(self.next)
    }

    /// `Fm$item[({0}S:S$kind$..)..]`: the tag; members follow when all tags are known.
    fn declare(&mut self, rest: &'t str) {
        let Some((name, body)) = rest.split_once('[') else { return };
        let Some((_, tag)) = name.split_once('$').filter(|(_, tag)| !self.tags.contains_key(tag)) else { return };
        // SDCC names unnamed ones by itself.
        let name = (!tag.starts_with("__")).then(|| tag.to_owned());
        let id = self.add(CType::Record { keyword: "struct", name, bytes: 0, members: Vec::new() });
        self.tags.insert(tag, id);
        self.bodies.push((body, id));
    }

    fn members(&mut self, body: &'t str, id: TypeId) {
        let (mut found, mut size) = (Vec::new(), 0);
        for part in body.trim_end_matches(']').split("({").skip(1).collect::<Vec<_>>().chunks(2) {
            // `0}S:S$kind$0_0$0` and `1}SC:U),Z,0,0)`.
            let &[head, of] = part else { break };
            let Some((offset, symbol)) = head.split_once('}') else { continue };
            let Some(name) = symbol.strip_prefix("S:S$").and_then(|name| name.rsplitn(3, '$').last()) else { continue };
            let Some((bytes, chain)) = of.split_once('}') else { continue };
            let chain = chain.split(')').next().unwrap_or_default();
            let (Ok(offset), Ok(bytes)) = (offset.parse::<u32>(), bytes.parse::<u32>()) else { continue };
            let bits = chain.strip_prefix("SB").and_then(|bits| {
                let (first, rest) = bits.split_once('$')?;
                Some(BitRange {
                    first: first.parse().ok()?,
                    size: rest.split(':').next()?.parse::<u32>().ok()?.min(16),
                })
            });
            let of = if bits.is_some() { "SI:U" } else { chain };
            let member_type = self.chain(of, bytes, MAX_DEPTH);
            let whole = BitsInByte { offset, bits: None };
            let BitsInByte { offset, bits: bit_range } = bits.map_or(whole, |bits| bits.in_byte(offset));
            size = size.max(offset.saturating_add(bytes));
            found.push(StructMember { name: Some(name.to_owned()), offset, bit_range, member_type });
        }
        let overlaps = found.len() > 1 && found.iter().all(|member| member.offset == 0 && member.bit_range.is_none());
        if let Some(CType::Record { keyword, bytes, members, .. }) = self.info.types.get_mut(&id.0) {
            *keyword = if overlaps { "union" } else { "struct" };
            (*bytes, *members) = (size, found);
        }
    }

    /// A chain of types, `DA2d,STitem:S`; `size` is that of the outermost.
    fn chain(&mut self, text: &'t str, size: u32, depth: usize) -> Option<TypeId> {
        if let Some(id) = self.known.get(&(text, size)) {
            return Some(*id);
        }
        let depth = depth.checked_sub(1)?;
        let (head, rest) = text.split_once(',').unwrap_or((text, ""));
        if let Some(count) = head.strip_prefix("DA").and_then(|count| count.strip_suffix('d')) {
            let count: u32 = count.parse().ok()?;
            let of = self.chain(rest, size.checked_div(count).unwrap_or(0), depth);
            // Arrays of arrays are one type with several counts.
            let inner = of.and_then(|of| self.info.types.get(&of.0)).cloned();
            let kind = match inner {
                Some(CType::Array { of, counts }) => {
                    CType::Array { of, counts: std::iter::once(Some(count)).chain(counts).collect() }
                }
                _ => CType::Array { of, counts: vec![Some(count)] },
            };
            return Some(self.remember(text, size, kind));
        }
        let kind = match head.get(..2)? {
            "DF" => {
                let result = self.chain(rest, 0, depth);
                CType::Function { result, parameters: Vec::new(), prototyped: false }
            }
            pointer @ ("DG" | "DC" | "DX" | "DD" | "DI" | "DP") => {
                let to = self.chain(rest, 0, depth);
                let base = match pointer {
                    "DC" => Mcs51Memory::CODE,
                    "DD" | "DI" => Mcs51Memory::IDATA,
                    _ => Mcs51Memory::POINTER,
                };
                let bytes = match (pointer, size) {
                    (_, 1..) => size.min(3),
                    ("DG", _) => 3,
                    ("DC" | "DX", _) => 2,
                    _ => 1,
                };
                let id = self.remember(text, size, CType::Pointer { to, bytes });
                self.info.pointer_bases.insert(id.0, base);
                return Some(id);
            }
            "ST" => return self.tags.get(head.get(2..)?.split(':').next()?).copied(),
            "SV" => return None,
            _ => base_type(head)?,
        };
        Some(self.remember(text, size, kind))
    }

    fn remember(&mut self, text: &'t str, size: u32, kind: CType) -> TypeId {
        let id = self.add(kind);
        self.known.insert((text, size), id);
        id
    }

    /// `G$add$0_0$0({2}DF,SI:S),C,..`.
    fn function(&mut self, rest: &'t str) {
        let Some((name, _)) = rest.split_once('(') else { return };
        let Some(DebugRecord::Symbol { scope, name: own, .. }) = parse_debug_record(name) else { return };
        let Some(key) = key(name) else { return };
        let ends = |start: &u32| self.links.get(&format!("X{key}")).map(|last| *start..last.saturating_add(1));
        let Some(range) = self.links.get(&key).and_then(ends).filter(|range| !range.is_empty()) else { return };
        if self.info.functions.iter().any(|known| known.block.ranges.first() == Some(&range)) {
            return;
        }
        let chain = rest.split_once('}').and_then(|(_, chain)| chain.split(')').next()).unwrap_or_default();
        let Some(of) = self.chain(chain, 0, MAX_DEPTH) else { return };
        let result = match self.info.types.get(&of.0) {
            Some(CType::Function { result, .. }) => *result,
            _ => None,
        };
        let unit = self.unit(scope);
        let block = BlockInfo { ranges: vec![range], ..BlockInfo::default() };
        self.info.functions.push(FunctionInfo {
            name: own.to_owned(),
            result,
            of,
            line: 0,
            external: scope == SymbolScope::Global,
            block,
            frame_base: VariableLocation::OptimizedOut,
            unit,
        });
    }

    fn unit(&self, scope: SymbolScope<'_>) -> usize {
        let module = match scope {
            SymbolScope::Global => return 0,
            SymbolScope::Module(module) => module,
            SymbolScope::Function(path) => path.split('.').next().unwrap_or_default(),
        };
        self.units.iter().position(|unit| *unit == module).unwrap_or(0)
    }

    /// `G$count$0_0$0({1}SC:U),E,0,0`, `Lm.main$i$1_0$6({1}SC:U),R,0,0,[r5]`.
    fn variable(&mut self, rest: &'t str) {
        let Some((name, _)) = rest.split_once('(') else { return };
        let Some(DebugRecord::Symbol { scope, name: own, .. }) = parse_debug_record(name) else { return };
        let Some((of, place)) = rest.rsplit_once(')') else { return };
        let Some((size, chain)) = of.split_once("({").and_then(|(_, of)| of.split_once('}')) else { return };
        let mut fields = place.trim_start_matches(',').splitn(4, ',');
        let space = fields.next().unwrap_or_default();
        // Registers of the chip have names already.
        if matches!(space, "I" | "J") || chain.starts_with("DF") {
            return;
        }
        let key = key(name);
        let linked = key.as_ref().and_then(|key| self.links.get(key)).copied();
        self.described.extend(key);
        let registers = fields.nth(2).unwrap_or_default();
        let location = match (space, linked) {
            ("R", _) => registers_location(registers),
            (_, None) => VariableLocation::OptimizedOut,
            ("E" | "G", Some(addr)) => address_location(Mcs51Memory::IDATA, addr),
            ("F" | "P" | "A", Some(addr)) => address_location(Mcs51Memory::XDATA, addr),
            ("C" | "D", Some(addr)) => address_location(Mcs51Memory::CODE, addr),
            ("H", Some(addr)) => address_location(Mcs51Memory::BIT, addr),
            _ => VariableLocation::OptimizedOut,
        };
        let variable_type = self.chain(chain, size.parse().unwrap_or(0), MAX_DEPTH);
        let (unit, external) = (self.unit(scope), scope == SymbolScope::Global);
        let name = own.to_owned();
        let variable = VariableInfo { name, variable_type, parameter: false, line: 0, external, location, unit };
        match scope {
            SymbolScope::Function(path) => {
                self.local_counts.0 += usize::from(space == "E");
                self.local_counts.1 += usize::from(space == "F");
                self.add_local(path, variable);
            }
            _ if space == "H" && linked.is_none() => self.unplaced_bits.push(variable),
            _ if variable.location != VariableLocation::OptimizedOut => self.info.globals.push(variable),
            _ => {}
        }
    }

    fn add_local(&mut self, path: &str, variable: VariableInfo) {
        let function = path.rsplit('.').next().unwrap_or_default();
        let is = |known: &&mut FunctionInfo| known.name == function && (known.external || known.unit == variable.unit);
        if let Some(function) = self.info.functions.iter_mut().find(is) {
            function.block.variables.push(variable);
        }
    }

    /// `Lring.crc_step$d$1_0$13:1B`, a parameter without a symbol record: SDCC leaves the record out if the
    /// parameter stays in its overlaid memory. Its type is unknown, and its memory is that of most other
    /// variables of functions.
    fn untyped_variable(&mut self, rest: &'t str) {
        let Some((name, addr)) = rest.rsplit_once(':') else { return };
        let Some(DebugRecord::Symbol { scope, name: own, .. }) = parse_debug_record(name) else { return };
        let SymbolScope::Function(path) = scope else { return };
        let Ok(addr) = u32::from_str_radix(addr, 16) else { return };
        if key(name).is_none_or(|key| !self.described.insert(key)) {
            return;
        }
        let is_external_ram = addr > 0xFF || self.local_counts.1 > self.local_counts.0;
        let memory = if is_external_ram { Mcs51Memory::XDATA } else { Mcs51Memory::IDATA };
        let variable = VariableInfo {
            name: own.to_owned(),
            variable_type: None,
            parameter: true,
            line: 0,
            external: false,
            location: address_location(memory, addr),
            unit: self.unit(scope),
        };
        self.add_local(path, variable);
    }

    fn finish(mut self) -> CdbTypes {
        let encoding = gimli::Encoding { format: gimli::Format::Dwarf32, version: 4, address_size: 4 };
        let names = if self.units.is_empty() { vec![""] } else { self.units };
        self.info.has_memories = true;
        self.info.units = names
            .into_iter()
            .map(|name| UnitInfo {
                encoding,
                start: 0,
                name: format!("{name}.c"),
                folder: String::new(),
                addresses: 0,
                ranges: Vec::new(),
                exact: true,
            })
            .collect();
        self.info.functions.sort_by_key(|function| function.block.ranges.iter().map(|range| range.start).min());
        CdbTypes { info: self.info, unplaced_bits: self.unplaced_bits }
    }
}

/// `SI:U` and the like.
fn base_type(head: &str) -> Option<CType> {
    let (letters, sign) = head.split_once(':').unwrap_or((head, "U"));
    let signed = sign == "S";
    let number = if signed { BaseEncoding::Signed } else { BaseEncoding::Unsigned };
    let (name, bytes, encoding) = match letters.get(..2)? {
        "SC" if signed => ("signed char", 1, BaseEncoding::SignedChar),
        "SC" => ("unsigned char", 1, BaseEncoding::UnsignedChar),
        "SS" => (if signed { "short" } else { "unsigned short" }, 2, number),
        "SI" => (if signed { "int" } else { "unsigned int" }, 2, number),
        "SL" => (if signed { "long" } else { "unsigned long" }, 4, number),
        "SF" => ("float", 4, BaseEncoding::Float),
        // Of a bit field its number of bits counts; alone it is one bit.
        "SB" | "SX" if letters.ends_with("$1") || letters == "SX" => ("__bit", 1, number),
        "SB" => ("unsigned int", 2, number),
        _ => return None,
    };
    Some(CType::Base { name: name.to_owned(), bytes, encoding })
}

fn address_location(memory: u32, addr: u32) -> VariableLocation {
    let address = (memory | addr & 0xFFFF).to_le_bytes();
    VariableLocation::Expression(std::iter::once(DW_OP_ADDR).chain(address).collect())
}

/// `[r6,r7]`; other registers hold nothing for long.
fn registers_location(list: &str) -> VariableLocation {
    let names = list.trim_matches(['[', ']']).split(',');
    let numbers: Option<Vec<u8>> =
        names.map(|name| name.trim().strip_prefix('r')?.parse().ok().filter(|number| *number < 8)).collect();
    match numbers {
        Some(numbers) if !numbers.is_empty() => VariableLocation::Expression(
            numbers.into_iter().flat_map(|number| [DW_OP_REG0 + number, DW_OP_PIECE, 1]).collect(),
        ),
        _ => VariableLocation::OptimizedOut,
    }
}
