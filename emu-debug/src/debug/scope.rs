//! Names in expressions and commands: registers, pins, memory, symbols of the program, symbols of a ladder program.

use std::sync::{Arc, OnceLock};

use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::{BlockInfo, CONSTANT_SPACE, FrameView as _, SourceLines, SymbolAt, VariableInfo};

use super::breakpoint_probe::byte_of;
use super::c_objects::ObjectExpr;
use super::call_stack::{CallFrame, CallStack, MachineFrame};
use super::dyn_machine::DynMachine;
use super::error::DebugError;
use super::expression::DebugExpression;
use super::expression_place::ExpressionPlace;
use super::parse_expression;
use super::values::Values;
use crate::InputError;
use crate::address_names::{AddressNames, AddressRange, split_memory};
use crate::bit_space;
use crate::program_source::ProgramSource;
use crate::stimulus;

/// Everything that has a name.
#[derive(Debug, Clone)]
pub struct NameScope {
    chip: &'static Chip,
    /// Symbols of the image.
    pub symbols: Vec<SymbolAt>,
    /// Source lines of the image.
    pub lines: SourceLines,
    /// Symbols of a ladder program, and where the chip keeps them.
    pub ladder: Vec<(String, ExpressionPlace)>,
    /// Values that were printed, and variables of the user: `$1`, `$i`.
    pub values: Values,
    /// How values are written.
    pub print: super::c_values::PrintSettings,
    calls: OnceLock<CallStack>,
}

/// Where the machine is, for names of variables of C.
#[derive(Debug)]
pub(super) struct FrameContext {
    pub calls: CallStack,
    /// Byte address of the frame that is looked at.
    byte: u32,
    /// Its level, 0 the innermost.
    level: usize,
    /// Functions put in place of their calls that are left out of it.
    inlined_skipped: usize,
    /// That frame, where it is a caller.
    frame: Option<CallFrame>,
}

impl NameScope {
    /// What a chip has names for, and nothing else.
    #[must_use]
    pub fn new(chip: &'static Chip) -> NameScope {
        NameScope {
            chip,
            symbols: Vec::new(),
            lines: SourceLines::default(),
            ladder: Vec::new(),
            values: Values::default(),
            print: Default::default(),
            calls: OnceLock::new(),
        }
    }

    /// The chip.
    #[must_use]
    pub fn chip(&self) -> &'static Chip {
        self.chip
    }

    /// What is known of program addresses.
    #[must_use]
    pub fn source(&self) -> ProgramSource<'_> {
        ProgramSource { names: AddressNames { chip: self.chip, symbols: &self.symbols }, lines: &self.lines }
    }

    /// Reads an expression without variables of C.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse_expression(&self, text: &str) -> Result<DebugExpression, DebugError> {
        parse_expression::parse(self, None, text)
    }

    /// Reads an expression in the frame at a level, 0 the innermost: variables of C that are known there have their names and types.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse_expression_in_frame(
        &self,
        text: &str,
        target: &dyn DynMachine,
        level: usize,
    ) -> Result<DebugExpression, DebugError> {
        parse_expression::parse(self, self.frame_context(target, level).as_ref(), text)
    }

    /// Reads an expression as the machine is when it comes to a program word: for conditions of breakpoints.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse_expression_at_word(&self, text: &str, word: u32) -> Result<DebugExpression, DebugError> {
        let here = FrameContext {
            calls: self.calls().clone(),
            byte: word.saturating_mul(self.chip.word_bytes),
            level: 0,
            inlined_skipped: 0,
            frame: None,
        };
        parse_expression::parse(self, Some(&here), text)
    }

    /// Functions, variables and calls of the program.
    pub fn calls(&self) -> &CallStack {
        self.calls.get_or_init(|| {
            let (info, word) = (self.lines.debug_info(), self.chip.word_bytes.max(1));
            let sized = self.symbols.iter().filter(|symbol| symbol.space == self.chip.code_space && symbol.size > 0);
            let sized = sized.map(|symbol| {
                let end = symbol.addr.saturating_add(symbol.size);
                (symbol.addr / word..end.div_ceil(word), symbol.name.clone())
            });
            let known = info.functions.iter().flat_map(|function| {
                let ranges = function.block.ranges.iter().take(1);
                ranges.map(|range| (range.start / word..range.end.div_ceil(word), function.name.clone()))
            });
            let functions = sized.chain(known).collect();
            CallStack::new(Arc::clone(info), functions)
        })
    }

    fn frame_context(&self, target: &dyn DynMachine, level: usize) -> Option<FrameContext> {
        let calls = self.calls();
        if !self.has_debug_info() {
            return None;
        }
        let frame = calls.frame(target, level)?;
        let byte = MachineFrame { target, frame: &frame }.pc_byte();
        let left_out = frame.inlined_skipped;
        Some(FrameContext {
            calls: calls.clone(),
            byte,
            level,
            inlined_skipped: left_out,
            frame: Some(frame).filter(|_| level > 0),
        })
    }

    /// The variable of C that a name stands for in a frame.
    pub(super) fn find_variable(&self, here: &FrameContext, name: &str) -> Option<ObjectExpr> {
        let locals = self.blocks(here);
        let own = locals
            .iter()
            .find_map(|(block, known)| Some((block.variables.iter().find(|variable| variable.name == name)?, known)));
        if let Some((variable, known)) = own {
            return Some(ObjectExpr::variable(here.calls.clone(), variable, known.clone(), here.level));
        }
        self.find_global(here, name)
    }

    /// The variable or function outside of functions that a name stands for.
    pub(super) fn find_global(&self, here: &FrameContext, name: &str) -> Option<ObjectExpr> {
        let info = &here.calls.info;
        // Registers of the chip are described, too, in start-up code; the chip's row knows them better.
        let is_chip = self.chip.reg(name).is_some() && !self.symbols.iter().any(|symbol| symbol.is_named(name));
        if is_chip || self.ladder.iter().any(|(known, _)| known == name) {
            return None;
        }
        if let Some(found) = info.global(name, here.byte) {
            return Some(ObjectExpr::variable(here.calls.clone(), found, Vec::new(), 0));
        }
        ObjectExpr::function(here.calls.clone(), info.function(name, here.byte)?)
    }

    /// `$pc`, `$sp` and `$r16` of a frame that has called another; a constant of an enumeration, which no symbol hides.
    pub(super) fn find_in_frame(&self, here: &FrameContext, name: &str) -> Option<DebugExpression> {
        if let Some(own) = name.strip_prefix('$') {
            let frame = here.frame.as_ref()?;
            return match own.to_ascii_lowercase().as_str() {
                "pc" => Some(DebugExpression::Number(self.chip.code_address(frame.word).into())),
                "sp" => Some(DebugExpression::Number(frame.sp.into())),
                own => {
                    let number: usize = own.strip_prefix('r')?.parse().ok()?;
                    let addr = (*frame.saved_registers.get(number)?)?;
                    Some(DebugExpression::Place(ExpressionPlace::Memory {
                        space: self.chip.ram_space,
                        addr,
                        bytes: 1,
                        signed: false,
                    }))
                }
            };
        }
        if self.symbols.iter().any(|symbol| symbol.is_named(name)) {
            return None;
        }
        let (value, kind) = super::c_types::find_enumerator(&here.calls.info, name)?;
        let value = ObjectExpr::value_of(here.calls.clone(), DebugExpression::Number(value), kind);
        Some(DebugExpression::Object(Box::new(value)))
    }

    /// `function::variable`, from wherever it is.
    pub(super) fn find_qualified(&self, here: &FrameContext, name: &str) -> Option<DebugExpression> {
        let (function, name) = name.split_once("::")?;
        let function = here.calls.info.functions.iter().find(|own| own.name == function)?;
        let mut blocks = vec![&function.block];
        while let Some(block) = blocks.pop() {
            if let Some(found) = block.variables.iter().find(|variable| variable.name == name) {
                let known = if found.is_everywhere() { Vec::new() } else { function.block.ranges.clone() };
                return Some(DebugExpression::Object(Box::new(ObjectExpr::variable(
                    here.calls.clone(),
                    found,
                    known,
                    0,
                ))));
            }
            blocks.extend(&block.blocks);
        }
        None
    }

    /// The blocks around a frame, the innermost first, and the code in which what they have is known.
    fn blocks<'a>(&self, here: &'a FrameContext) -> Vec<(&'a BlockInfo, Vec<std::ops::Range<u32>>)> {
        let Some(function) = here.calls.info.function_at(here.byte) else { return Vec::new() };
        let around = function.block.blocks_around(here.byte);
        let known = |block: &BlockInfo| match block.ranges.is_empty() {
            true => function.block.ranges.clone(),
            false => block.ranges.clone(),
        };
        // What was put in place of a call is a function of its own.
        let (mut left, mut own) = (here.inlined_skipped, Vec::new());
        for block in around {
            if left == 0 {
                own.push((block, known(block)));
            }
            match left.checked_sub(usize::from(block.inlined.is_some())) {
                Some(rest) => left = rest,
                None => break,
            }
        }
        own
    }

    /// Parameters, or other variables, of the function of a frame that are known there, by name: those of the innermost block first.
    #[must_use]
    pub fn locals(&self, target: &dyn DynMachine, level: usize, parameters: bool) -> Vec<(String, ObjectExpr)> {
        let Some(here) = self.frame_context(target, level) else { return Vec::new() };
        let wanted = |variable: &&VariableInfo| variable.parameter == parameters;
        let blocks = self.blocks(&here);
        let all =
            blocks.iter().flat_map(|(block, known)| block.variables.iter().filter(wanted).map(move |own| (own, known)));
        let object = |(variable, known): (&VariableInfo, &Vec<std::ops::Range<u32>>)| {
            let object = ObjectExpr::variable(here.calls.clone(), variable, known.clone(), level);
            (variable.name.clone(), object)
        };
        all.map(object).collect()
    }

    /// Parameters and variables of the function at a program word, those of the innermost block first.
    #[must_use]
    pub fn variables_at(&self, word: u32) -> Vec<(String, ObjectExpr)> {
        let byte = word.saturating_mul(self.chip.word_bytes);
        let here = FrameContext { calls: self.calls().clone(), byte, level: 0, inlined_skipped: 0, frame: None };
        let blocks = self.blocks(&here);
        let all = blocks.iter().flat_map(|(block, known)| block.variables.iter().map(move |own| (own, known)));
        let object = |(own, known): (&VariableInfo, &Vec<std::ops::Range<u32>>)| {
            (own.name.clone(), ObjectExpr::variable(here.calls.clone(), own, known.clone(), 0))
        };
        all.map(object).collect()
    }

    /// The type that a text names.
    #[must_use]
    pub fn type_named(&self, text: &str) -> Option<ObjectExpr> {
        let calls = self.calls();
        let kind = super::c_types::find_type(&calls.info, text)?;
        Some(ObjectExpr::at(calls.clone(), DebugExpression::Number(0), kind))
    }

    /// The memory of an address with which only ELF files name it: of data memory of the AVR 0x800100.
    #[must_use]
    pub fn linked_memory_at(&self, address: u32) -> Option<(&'static str, u32)> {
        super::call_stack::linked_memory_at(self.chip, address)
    }

    /// The program tells of its functions and variables.
    #[must_use]
    pub fn has_debug_info(&self) -> bool {
        let info = &self.calls().info;
        !(info.functions.is_empty() && info.globals.is_empty())
    }

    /// A number with the type that C gives it, where the program is one of C; anything else as it is.
    #[must_use]
    pub fn with_type(&self, expr: DebugExpression) -> DebugExpression {
        let DebugExpression::Number(value) = expr else { return expr };
        if !self.has_debug_info() {
            return expr;
        }
        let kind = super::arithmetic::ArithmeticType::of_number(value).ctype();
        DebugExpression::Object(Box::new(ObjectExpr::value_of(
            self.calls().clone(),
            DebugExpression::Number(value),
            kind,
        )))
    }

    /// The name of the type that C gives what is computed; nothing where it is none of C, such as a register.
    #[must_use]
    pub fn computed_type(&self, expr: &DebugExpression) -> Option<String> {
        if let DebugExpression::Text(text) = expr {
            return Some(format!("char [{}]", text.len() + 1));
        }
        let kind = super::arithmetic::ArithmeticType::of(expr)?.ctype();
        Some(super::c_types::declaration(&self.calls().info, kind, ""))
    }

    /// Bytes of a memory as [`AddressNames::parse_range`] reads them; a symbol of the ladder program or a bit of a byte stands for its bytes.
    ///
    /// # Errors
    /// No such memory or place.
    pub fn parse_range(&self, text: &str) -> Result<AddressRange, InputError> {
        match self.ladder.iter().find(|(name, _)| name == text.trim()).map(|found| found.1) {
            Some(ExpressionPlace::Bit { space, addr, .. }) => Ok(AddressRange { space, start: addr, end: addr + 1 }),
            Some(ExpressionPlace::Memory { space, addr, bytes, .. }) => {
                let width = self.chip.bytes_per_address(space).max(1);
                Ok(AddressRange { space, start: addr / width, end: (addr + u32::from(bytes)).div_ceil(width) })
            }
            _ => self.source().names.parse_range(text),
        }
    }

    /// Memory of whose accesses the machine tells, as [`NameScope::parse_range`] reads it, and what that is called. Of a bit that has no address of
    /// its own it is its byte.
    ///
    /// # Errors
    /// No such memory or place, or one of which it does not.
    pub fn parse_watched_range(
        &self,
        text: &str,
        target: &dyn DynMachine,
    ) -> Result<(AddressRange, String), DebugError> {
        let text = text.trim();
        let expr = self.parse_expression_in_frame(text, target, 0);
        let bit = expr.as_ref().ok().and_then(|expr| expr.place(target));
        let (range, name) = match bit {
            Some(ExpressionPlace::Bit { space, addr, bit }) => match bit_space::bits_of_byte(self.chip, space, addr) {
                Some(AddressRange { space, start, .. }) => {
                    let own = start + u32::from(bit);
                    (AddressRange { space, start: own, end: own + 1 }, text.to_owned())
                }
                // A cell of AP101 is a bit.
                None if self.chip.family == ChipFamily::Ap101 => {
                    (AddressRange { space, start: addr, end: addr + 1 }, text.to_owned())
                }
                None => (AddressRange { space, start: addr, end: addr + 1 }, format!("the byte of {text}")),
            },
            Some(ExpressionPlace::Memory { space, addr, .. })
                if expr.as_ref().is_ok_and(|expr| expr.object().is_some()) =>
            {
                let width = self.chip.bytes_per_address(space).max(1);
                let bytes = expr.as_ref().ok().and_then(|expr| expr.object()?.bytes()).unwrap_or(1);
                let end = addr.saturating_add(bytes).div_ceil(width);
                (AddressRange { space, start: addr / width, end }, text.to_owned())
            }
            _ => match (self.parse_range(text), expr) {
                (Ok(range), _) => (range, text.to_owned()),
                // Of what is only an expression of C the fault in that tells more.
                (Err(_), Err(why)) if text.contains("->") || text.contains(['[', '*']) => return Err(why),
                (Err(why), _) => return Err(why.into()),
            },
        };
        self.source().names.check_observable(&range).map_err(|source| {
            match self.ladder.iter().any(|(name, _)| name == text) {
                true => DebugError::SymbolNotWatched {
                    name: text.to_owned(),
                    space: range.space,
                    addr: range.start,
                    source: Box::new(source),
                },
                false => source.into(),
            }
        })?;
        Ok((range, name))
    }

    /// What a name in an expression stands for. Names with `$` are the debugger's own, as in gdb: `$pc`, `$cycle`, `$r16`. Of the
    /// others those of the ladder program come first, then those of the image, then the chip's.
    ///
    /// # Errors
    /// Nothing has that name.
    pub(super) fn find_name(&self, name: &str) -> Result<DebugExpression, DebugError> {
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
        // Headers name the registers of a chip by constants.
        let own = self.symbols.iter().any(|symbol| symbol.space != CONSTANT_SPACE && symbol.is_named(name));
        if !own && let Some(place) = self.register(name).or_else(|| self.pin(name)) {
            return Ok(DebugExpression::Place(place));
        }
        self.memory(name).or_else(|why| self.bit(name).unwrap_or(Err(why)))
    }

    /// Length of the longest name of a C++ or Rust symbol with which a text begins: those have brackets and spaces in them.
    pub(super) fn mangled_name_length(&self, text: &str) -> Option<usize> {
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

    /// `data:0x100`, `buf`, `TCNT1`, `P1`, `main` (its address), a constant (its value).
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

    /// The value that stands in a range: up to four bytes without a sign, a bit where the memory holds bits.
    #[must_use]
    pub fn place_of(&self, range: &AddressRange) -> ExpressionPlace {
        let width = self.chip.bytes_per_address(range.space);
        let (space, addr, bit) = byte_of(self.chip, range.space, range.start.saturating_mul(width));
        match bit {
            Some(bit) => ExpressionPlace::Bit { space, addr, bit },
            None => {
                let bytes = range.end.saturating_sub(range.start).saturating_mul(width).clamp(1, 4) as u8;
                ExpressionPlace::Memory { space, addr, bytes, signed: false }
            }
        }
    }

    /// `PORTB.5`, `data:0x20.3`, `buf.0`: a bit of a byte by its place. Nothing where the text has no such shape.
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
