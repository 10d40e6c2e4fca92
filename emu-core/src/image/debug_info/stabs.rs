//! Functions, blocks, variables and types out of stabs.
//!
//! Locations become the expressions of DWARF that mean the same, so that who asks for a place needs to know
//! of no stabs: the frame of a function of an AVR is what Y (r28, r29) points to.

mod types;

use crate::image::debug_info::stabs::types::FinishedTypes;
use gimli::{Encoding, Format};

use types::{StabTypes, TypeNaming, TypeText};

use super::read::finish_functions;
use super::{BlockInfo, DebugInfo, FunctionInfo, TypeId, UnitInfo, VariableInfo, VariableLocation};
use crate::image::demangle::demangle;
use crate::image::elf::{self, NamedSection, SymbolTable};
use crate::image::stabs::{
    NamesAtZero, Stab, StabPosition, StabRecords, StabText, UnitChange, function_name, record, split_name,
};

/// Register of the frame: Y.
const FRAME_REGISTER: u8 = 28;
/// Registers of an AVR.
const REGISTERS: u32 = 32;
/// Longest name.
const MAX_NAME: usize = 1024;
/// Deepest nesting of blocks.
const MAX_DEPTH: usize = 200;

/// Operations of expressions (DWARF 5, section 7.7.1).
const DW_OP_ADDR: u8 = 0x03;
const DW_OP_REG0: u8 = 0x50;
const DW_OP_BREG0: u8 = 0x70;
const DW_OP_DEREF_SIZE: u8 = 0x94;

/// Adds what the stabs of an ELF file tell; types get numbers from `first_type` on.
pub(super) fn add_stabs(info: &mut DebugInfo, sections: &[NamedSection<'_>], elf: &[u8], first_type: usize) {
    let Some(records) = StabRecords::new(sections) else { return };
    let (zero, first_unit) = (NamesAtZero::new(elf), info.units.len());
    let mut reader = StabReader {
        info: DebugInfo::default(),
        types: StabTypes::new(first_type),
        first_unit,
        symbols: elf::symbol_table(elf),
        position: StabPosition::default(),
        function: None,
        pending: Vec::new(),
        children: Vec::new(),
        open: Vec::new(),
    };
    for stab in records {
        reader.follow(&stab, &zero);
    }
    reader.close_function(None);
    let StabReader { info: own, types, .. } = reader;
    info.units.extend(own.units);
    info.globals.extend(own.globals);
    info.functions.extend(own.functions);
    let FinishedTypes { types, same } = types.finish();
    info.types.extend(types);
    info.same_types = same;
    finish_functions(info);
}

/// A block whose end is still coming.
struct OpenBlock {
    start: u32,
    /// The variables that came before it, which are its own, and the blocks before it.
    variables: Vec<VariableInfo>,
    before: Vec<BlockInfo>,
}

struct StabReader<'b> {
    info: DebugInfo,
    types: StabTypes,
    /// Units with debug information in other formats.
    first_unit: usize,
    /// Addresses of global variables, sizes of functions.
    symbols: SymbolTable<'b>,
    position: StabPosition,
    /// The function that is open; nothing in place of one that was dropped.
    function: Option<Option<FunctionInfo>>,
    /// Variables that no block has yet.
    pending: Vec<VariableInfo>,
    /// Blocks that are complete, within the innermost open one.
    children: Vec<BlockInfo>,
    open: Vec<OpenBlock>,
}

impl StabReader<'_> {
    fn follow(&mut self, stab: &Stab<'_>, zero: &NamesAtZero<'_>) {
        match stab.kind {
            record::SO => match self.position.change_unit(stab) {
                UnitChange::Folder => {}
                UnitChange::Begins(addr) => {
                    self.close_function(Some(addr));
                    self.begin_unit(addr);
                }
                UnitChange::Ends(addr) => {
                    self.close_function(Some(addr));
                    if let Some(unit) = self.info.units.last_mut() {
                        unit.ranges.iter_mut().for_each(|range| range.end = addr.max(range.start));
                    }
                }
            },
            _ if self.info.units.is_empty() => {}
            record::BINCL => self.types.begin_header(&stab.text, stab.value),
            record::EXCL => self.types.excluded_header(&stab.text, stab.value),
            record::FUN if stab.text.is_empty() => {
                self.close_function(self.position.function.checked_add(stab.value));
                self.position.function = 0;
            }
            record::LBRAC if self.open.len() < MAX_DEPTH => {
                let variables = std::mem::take(&mut self.pending);
                let before = std::mem::take(&mut self.children);
                self.open.push(OpenBlock { start: stab.value, variables, before });
            }
            record::RBRAC => self.close_block(stab.value),
            record::FUN if function_name(&stab.text).is_some() => self.begin_function(stab, zero),
            record::GSYM
            | record::FUN
            | record::STSYM
            | record::LCSYM
            | record::ROSYM
            | record::RSYM
            | record::LSYM
            | record::PSYM => _ = self.symbol(stab),
            _ => {}
        }
    }

    fn begin_unit(&mut self, addr: u32) {
        self.types.begin_unit();
        self.info.units.push(UnitInfo {
            encoding: Encoding { format: Format::Dwarf32, version: 4, address_size: 4 },
            start: 0,
            name: self.position.unit.clone(),
            folder: self.position.folder.clone(),
            addresses: 0,
            ranges: std::iter::once(addr..addr).collect(),
            exact: false,
        });
    }

    fn unit(&self) -> usize {
        (self.first_unit + self.info.units.len()).saturating_sub(1)
    }

    fn begin_function(&mut self, stab: &Stab<'_>, zero: &NamesAtZero<'_>) {
        self.close_function(Some(stab.value));
        self.position.function = stab.value;
        let Some(StabText { name, description }) = function_name(&stab.text) else { return };
        let result = self.types.read(&mut TypeText::new(description), TypeNaming::None).unwrap_or(None);
        let function = FunctionInfo {
            name: symbol_name(name),
            result,
            of: self.types.fresh(),
            line: stab.desc.into(),
            external: stab.text.windows(2).any(|pair| pair == b":F"),
            block: BlockInfo { ranges: std::iter::once(stab.value..stab.value).collect(), ..BlockInfo::default() },
            frame_base: VariableLocation::OptimizedOut,
            unit: self.unit(),
        };
        self.function = Some(Some(function).filter(|_| !zero.is_dropped(stab.value, name)));
    }

    /// The function that is open goes up to an address, if that is known.
    fn close_function(&mut self, end: Option<u32>) {
        while !self.open.is_empty() {
            self.close_block(u32::MAX);
        }
        let (variables, blocks) = (std::mem::take(&mut self.pending), std::mem::take(&mut self.children));
        let Some(Some(mut function)) = self.function.take() else { return };
        (function.block.variables, function.block.blocks) = (variables, blocks);
        let Some(range) = function.block.ranges.first_mut() else { return };
        let size = self.symbols.sizes.get(&range.start).copied();
        // A unit may end before a function of it that has a section of its own.
        let end = end.filter(|end| *end > range.start).or(size.and_then(|size| range.start.checked_add(size)));
        if let Some(end) = end {
            range.end = end;
            self.info.functions.push(function);
        }
    }

    /// The innermost open block ends. The variables of the outermost are those of the function, as in gdb.
    fn close_block(&mut self, end: u32) {
        let Some(OpenBlock { start, variables, mut before }) = self.open.pop() else { return };
        let function = self.position.function;
        let blocks = std::mem::take(&mut self.children);
        self.pending.clear();
        if self.open.is_empty() || variables.is_empty() {
            self.pending = variables;
            before.extend(blocks);
        } else {
            let (start, end) = (function.saturating_add(start), function.saturating_add(end));
            let ranges = std::iter::once(start..end.max(start)).collect();
            before.push(BlockInfo { ranges, variables, blocks, ..BlockInfo::default() });
        }
        self.children = before;
    }

    /// A variable, a type or a constant; nothing where its text is damaged.
    fn symbol(&mut self, stab: &Stab<'_>) -> Option<()> {
        let StabText { name, description } = split_name(&stab.text)?;
        let mut text = TypeText::new(description);
        let letter = text.letter();
        let named = symbol_name(name);
        match letter {
            Some(b't') => {
                let naming = if text.skip(b't') { TypeNaming::Tag(&named) } else { TypeNaming::Typedef(&named) };
                self.types.read(&mut text, naming)?;
            }
            Some(b'T') => {
                _ = text.skip(b't');
                self.types.read(&mut text, TypeNaming::Tag(&named))?;
            }
            Some(b'c') => {
                let constant = self.types.constant(&mut text)?;
                self.add(named, constant.type_id, VariableLocation::Constant(constant.bytes), stab, false);
            }
            letter => {
                let of = self.types.read(&mut text, TypeNaming::None)?;
                let location = match letter {
                    None | Some(b'p' | b's') => frame_place(stab.value, &[]),
                    Some(b'v') => frame_place(stab.value, &[DW_OP_DEREF_SIZE, 2]),
                    Some(b'r' | b'P') => register_place(stab.value, DW_OP_REG0, &[]),
                    Some(b'a') => register_place(stab.value, DW_OP_BREG0, &[0]),
                    Some(b'S' | b'V') => address_place(stab.value),
                    Some(b'G') => {
                        self.symbols.addresses.get(name).map_or(VariableLocation::OptimizedOut, |at| address_place(*at))
                    }
                    _ => return None,
                };
                if letter == Some(b'r') && self.moved_to_register(&named, of, &location) {
                    return Some(());
                }
                let role = match letter {
                    Some(b'p' | b'P' | b'v' | b'a') => VariableRole::Parameter,
                    Some(b'G' | b'S') => VariableRole::Global,
                    _ => VariableRole::Local,
                };
                self.add_variable(named, of, location, stab, role);
            }
        }
        Some(())
    }

    /// A parameter with two entries: one where it was passed, and one in its register.
    fn moved_to_register(&mut self, name: &str, of: Option<TypeId>, location: &VariableLocation) -> bool {
        let Some(last) = self.pending.last_mut().filter(|last| last.parameter && last.name == name) else {
            return false;
        };
        (last.variable_type, last.location) = (of, location.clone());
        true
    }

    fn add(&mut self, name: String, of: Option<TypeId>, location: VariableLocation, stab: &Stab<'_>, parameter: bool) {
        let role = if parameter { VariableRole::Parameter } else { VariableRole::Local };
        self.add_variable(name, of, location, stab, role);
    }

    fn add_variable(
        &mut self,
        name: String,
        of: Option<TypeId>,
        location: VariableLocation,
        stab: &Stab<'_>,
        role: VariableRole,
    ) {
        let (line, unit) = (stab.desc.into(), self.unit());
        let external = stab.text.windows(2).any(|pair| pair == b":G");
        let parameter = role == VariableRole::Parameter;
        let variable = VariableInfo { name, variable_type: of, parameter, line, external, location, unit };
        if role == VariableRole::Global || self.function.is_none() {
            if variable.location != VariableLocation::OptimizedOut {
                self.info.globals.push(variable);
            }
        } else {
            self.pending.push(variable);
        }
    }
}

/// Where a variable of a stab belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VariableRole {
    /// A parameter of the current function.
    Parameter,
    /// A variable of the current function.
    Local,
    /// A variable outside of all functions.
    Global,
}

/// A name as the program has it.
fn symbol_name(name: &[u8]) -> String {
    let name = String::from_utf8_lossy(name.get(..name.len().min(MAX_NAME)).unwrap_or_default());
    match demangle(&name) {
        Some(found) => found.path,
        None => diag::text::printable(&name).into(),
    }
}

/// So many bytes from what the frame register points to, and what is done with that address.
fn frame_place(offset: u32, then: &[u8]) -> VariableLocation {
    let mut bytes = vec![DW_OP_BREG0 + FRAME_REGISTER];
    // A number with its sign, seven bits a byte (DWARF 5, section 7.6).
    let mut left = offset.cast_signed();
    loop {
        let (byte, rest) = ((left & 0x7F) as u8, left >> 7);
        let is_last = rest == if byte & 0x40 == 0 { 0 } else { -1 };
        bytes.push(if is_last { byte } else { byte | 0x80 });
        if is_last {
            break;
        }
        left = rest;
    }
    bytes.extend_from_slice(then);
    VariableLocation::Expression(bytes)
}

fn register_place(number: u32, operation: u8, then: &[u8]) -> VariableLocation {
    match u8::try_from(number) {
        Ok(register) if number < REGISTERS => VariableLocation::Expression([&[operation + register], then].concat()),
        _ => VariableLocation::OptimizedOut,
    }
}

fn address_place(addr: u32) -> VariableLocation {
    VariableLocation::Expression([&[DW_OP_ADDR], &addr.to_le_bytes()[..]].concat())
}
