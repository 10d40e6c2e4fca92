//! Names in expressions and commands: registers, pins, memory, symbols of programs and of ladder programs.

mod resolve;

use crate::debug::c_types::TypedEnumerator;
use crate::debug::{NamedFunction, NamedObject};
use std::sync::{Arc, OnceLock};

use emu_core::chip::Chip;
use emu_core::image::{BlockInfo, FrameView as _, SourceLines, SpaceAddress, SymbolAt, VariableInfo};

use super::c_objects::ObjectExpr;
use super::call_stack::{CallFrame, CallStack, MachineFrame};
use super::dyn_machine::DynMachine;
use super::error::DebugError;
use super::expression::DebugExpression;
use super::expression_place::ExpressionPlace;
use super::parse_expression;
use super::values::RememberedValues;
use crate::InputError;
use crate::address_names::{AddressNames, AddressRange};
use crate::bit_space;
use crate::program_source::ProgramSource;

/// All names of a program on a chip.
#[derive(Debug, Clone)]
pub struct NameScope {
    chip: &'static Chip,
    /// Symbols of the image.
    pub symbols: Vec<SymbolAt>,
    /// Source lines of the image.
    pub lines: SourceLines,
    /// Symbols of a ladder program, with their locations on the chip.
    pub ladder: Vec<(String, ExpressionPlace)>,
    /// Printed values, and user variables: `$1`, `$i`.
    pub values: RememberedValues,
    /// Format of values (`set print`).
    pub print: super::c_values::PrintSettings,
    calls: OnceLock<CallStack>,
}

/// The location of the machine, for the scopes of C variables.
#[derive(Debug)]
pub(super) struct FrameContext {
    pub calls: CallStack,
    /// Byte address in the selected frame.
    byte: u32,
    /// Its level; 0 is the innermost.
    level: usize,
    /// Number of inlined functions left out of it.
    inlined_skipped: usize,
    /// The frame, if it is a caller.
    frame: Option<CallFrame>,
}

/// A block around a frame.
#[derive(Debug, Clone)]
struct BlockInScope<'a> {
    /// The block.
    block: &'a BlockInfo,
    /// The code in which its variables are in scope.
    known: Vec<std::ops::Range<u32>>,
}

/// A range of addresses whose accesses are reported.
#[derive(Debug, Clone)]
pub struct WatchedRange {
    /// The range.
    pub range: AddressRange,
    /// The range as the user gave it.
    pub description: String,
}

impl NameScope {
    /// Returns a scope with only the names of a chip.
    #[must_use]
    pub fn new(chip: &'static Chip) -> NameScope {
        NameScope {
            chip,
            symbols: Vec::new(),
            lines: SourceLines::default(),
            ladder: Vec::new(),
            values: RememberedValues::default(),
            print: Default::default(),
            calls: OnceLock::new(),
        }
    }

    /// Returns the chip.
    #[must_use]
    pub fn chip(&self) -> &'static Chip {
        self.chip
    }

    /// Returns the information on program addresses.
    #[must_use]
    pub fn source(&self) -> ProgramSource<'_> {
        ProgramSource { names: AddressNames { chip: self.chip, symbols: &self.symbols }, lines: &self.lines }
    }

    /// Parses an expression without C variables.
    ///
    /// # Errors
    /// The first fault in it.
    pub fn parse_expression(&self, text: &str) -> Result<DebugExpression, DebugError> {
        parse_expression::parse(self, None, text)
    }

    /// Parses an expression in the frame at a level (0 is the innermost): C variables that are in scope there
    /// have their names and types.
    ///
    /// # Errors
    /// The first fault in it.
    pub fn parse_expression_in_frame(
        &self,
        text: &str,
        machine: &dyn DynMachine,
        level: usize,
    ) -> Result<DebugExpression, DebugError> {
        parse_expression::parse(self, self.frame_context(machine, level).as_ref(), text)
    }

    /// Parses an expression for the machine at a program word: for conditions of breakpoints.
    ///
    /// # Errors
    /// The first fault in it.
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

    /// Returns functions, variables and calls of the program.
    pub fn calls(&self) -> &CallStack {
        self.calls.get_or_init(|| {
            let (info, word) = (self.lines.debug_info(), self.chip.word_bytes.max(1));
            let sized = self.symbols.iter().filter(|symbol| symbol.space == self.chip.code_space && symbol.size > 0);
            let sized = sized.map(|symbol| {
                let end = symbol.addr.saturating_add(symbol.size);
                NamedFunction { words: symbol.addr / word..end.div_ceil(word), name: symbol.name.clone() }
            });
            let known = info.functions.iter().flat_map(|function| {
                let ranges = function.block.ranges.iter().take(1);
                let words = ranges.map(|range| range.start / word..range.end.div_ceil(word));
                words.map(|words| NamedFunction { words, name: function.name.clone() })
            });
            let functions = sized.chain(known).collect();
            CallStack::new(Arc::clone(info), functions)
        })
    }

    fn frame_context(&self, machine: &dyn DynMachine, level: usize) -> Option<FrameContext> {
        let calls = self.calls();
        if !self.has_debug_info() {
            return None;
        }
        let frame = calls.frame(machine, level)?;
        let byte = MachineFrame { machine, frame: &frame }.pc_byte();
        let left_out = frame.inlined_skipped;
        Some(FrameContext {
            calls: calls.clone(),
            byte,
            level,
            inlined_skipped: left_out,
            frame: Some(frame).filter(|_| level > 0),
        })
    }

    /// Returns the C variable with this name in a frame.
    pub(super) fn find_variable(&self, here: &FrameContext, name: &str) -> Option<ObjectExpr> {
        let locals = self.blocks(here);
        let own = locals.iter().find_map(|BlockInScope { block, known }| {
            Some((block.variables.iter().find(|variable| variable.name == name)?, known))
        });
        if let Some((variable, known)) = own {
            return Some(ObjectExpr::variable(here.calls.clone(), variable, known.clone(), here.level));
        }
        self.find_global(here, name)
    }

    /// Finds the variable or function outside of functions with this name.
    pub(super) fn find_global(&self, here: &FrameContext, name: &str) -> Option<ObjectExpr> {
        let info = &here.calls.info;
        // Start-up code also describes registers of the chip, but the chip row is more exact.
        let is_chip = self.chip.reg(name).is_some() && !self.symbols.iter().any(|symbol| symbol.is_named(name));
        if is_chip || self.ladder.iter().any(|(known, _)| known == name) {
            return None;
        }
        if let Some(found) = info.global(name, here.byte) {
            return Some(ObjectExpr::variable(here.calls.clone(), found, Vec::new(), 0));
        }
        ObjectExpr::function(here.calls.clone(), info.function(name, here.byte)?)
    }

    /// Finds `$pc`, `$sp` and `$r16` of a calling frame; or an enumeration constant that no symbol hides.
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
        let TypedEnumerator { value, kind } = super::c_types::find_enumerator(&here.calls.info, name)?;
        let value = ObjectExpr::value_of(here.calls.clone(), DebugExpression::Number(value), kind);
        Some(DebugExpression::Object(Box::new(value)))
    }

    /// Finds `function::variable`, from any location.
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

    /// Returns the blocks around a frame, the innermost first, with the code where their variables are in
    /// scope.
    fn blocks<'a>(&self, here: &'a FrameContext) -> Vec<BlockInScope<'a>> {
        let Some(function) = here.calls.info.function_at(here.byte) else { return Vec::new() };
        let around = function.block.blocks_around(here.byte);
        let known = |block: &BlockInfo| match block.ranges.is_empty() {
            true => function.block.ranges.clone(),
            false => block.ranges.clone(),
        };
        // An inlined function is a function of its own.
        let (mut left, mut own) = (here.inlined_skipped, Vec::new());
        for block in around {
            if left == 0 {
                own.push(BlockInScope { block, known: known(block) });
            }
            match left.checked_sub(usize::from(block.inlined.is_some())) {
                Some(rest) => left = rest,
                None => break,
            }
        }
        own
    }

    /// Returns parameters, or other variables, of a frame's function that are in scope, by name; those of the
    /// innermost block first.
    #[must_use]
    pub fn locals(&self, machine: &dyn DynMachine, level: usize, parameters: bool) -> Vec<NamedObject> {
        let Some(here) = self.frame_context(machine, level) else { return Vec::new() };
        let wanted = |variable: &&VariableInfo| variable.parameter == parameters;
        let blocks = self.blocks(&here);
        let all =
            blocks.iter().flat_map(|one| one.block.variables.iter().filter(wanted).map(move |own| (own, &one.known)));
        let object = |(variable, known): (&VariableInfo, &Vec<std::ops::Range<u32>>)| {
            let object = ObjectExpr::variable(here.calls.clone(), variable, known.clone(), level);
            NamedObject { name: variable.name.clone(), object }
        };
        all.map(object).collect()
    }

    /// Returns parameters and variables of the function at a program word, those of the innermost block
    /// first.
    #[must_use]
    pub fn variables_at(&self, word: u32) -> Vec<NamedObject> {
        let byte = word.saturating_mul(self.chip.word_bytes);
        let here = FrameContext { calls: self.calls().clone(), byte, level: 0, inlined_skipped: 0, frame: None };
        let blocks = self.blocks(&here);
        let all = blocks.iter().flat_map(|one| one.block.variables.iter().map(move |own| (own, &one.known)));
        let object = |(own, known): (&VariableInfo, &Vec<std::ops::Range<u32>>)| {
            let object = ObjectExpr::variable(here.calls.clone(), own, known.clone(), 0);
            NamedObject { name: own.name.clone(), object }
        };
        all.map(object).collect()
    }

    /// Returns the type with this name.
    #[must_use]
    pub fn type_named(&self, text: &str) -> Option<ObjectExpr> {
        let calls = self.calls();
        let kind = super::c_types::find_type(&calls.info, text)?;
        Some(ObjectExpr::at(calls.clone(), DebugExpression::Number(0), kind))
    }

    /// Returns the memory of an address that only ELF files use: 0x800100 is in the data memory of the AVR.
    #[must_use]
    pub fn linked_memory_at(&self, address: u32) -> Option<SpaceAddress> {
        super::call_stack::linked_memory_at(self.chip, address)
    }

    /// Returns true if the program describes its functions or variables.
    #[must_use]
    pub fn has_debug_info(&self) -> bool {
        let info = &self.calls().info;
        !(info.functions.is_empty() && info.globals.is_empty())
    }

    /// Gives a number the type that it has in C, if the program is a C program; other expressions are
    /// unchanged.
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

    /// Returns the value of an undefined name with `$`, for the value history.
    #[must_use]
    pub fn void_value(&self) -> DebugExpression {
        let (zero, void) = (DebugExpression::Number(0), Default::default());
        DebugExpression::Object(Box::new(ObjectExpr::value_of(self.calls().clone(), zero, void)))
    }

    /// Returns the name of the C type of a computed value; `None` if it has none, such as a register.
    #[must_use]
    pub fn computed_type(&self, expr: &DebugExpression) -> Option<String> {
        if let DebugExpression::Text(text) = expr {
            return Some(format!("char [{}]", text.len() + 1));
        }
        let kind = super::arithmetic::ArithmeticType::of(expr)?.ctype();
        Some(super::c_types::declaration(&self.calls().info, kind, ""))
    }

    /// Parses bytes of a memory like [`AddressNames::parse_range`]; a symbol of the ladder program, or a bit
    /// of a byte, means its bytes.
    ///
    /// # Errors
    /// There is no such memory or location.
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

    /// Parses a range whose accesses the machine reports, as [`NameScope::parse_range`], and returns its
    /// description. For a bit without an address of its own, the range is its byte.
    ///
    /// # Errors
    /// There is no such memory or location, or its accesses are not reported.
    pub fn parse_watched_range(&self, text: &str, machine: &dyn DynMachine) -> Result<WatchedRange, DebugError> {
        let text = text.trim();
        let expr = self.parse_expression_in_frame(text, machine, 0);
        let bit = expr.as_ref().ok().and_then(|expr| expr.place(machine));
        let (range, name) = match bit {
            Some(ExpressionPlace::Bit { space, addr, bit }) => match bit_space::bits_of_byte(self.chip, space, addr) {
                Some(AddressRange { space, start, .. }) => {
                    let own = start + u32::from(bit);
                    (AddressRange { space, start: own, end: own + 1 }, text.to_owned())
                }
                // A cell of AP101 is a bit.
                None if self.chip.is_bit_controller() => {
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
                // For an expression of C, the error of its parser says more.
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
        Ok(WatchedRange { range, description: name })
    }
}
