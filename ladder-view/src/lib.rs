//! Debugger view of a ladder program on a chip: current scan, rung and element, power flow, and causes of
//! values.
//!
//! ```text
//!   lib.rs            LadderView: program and map together, with positions in both directions
//!   scan_follower.rs  the follower: runs the reference evaluator scan by scan, in parallel to the chip
//!   scan_position.rs  where in a scan the chip is, and which record shows what it has done so far
//!   power_flow.rs     which elements passed power or blocked it
//!   draw.rs           a rung as text with power in its wires
//!   explain.rs        the causes of a symbol's value, back through scans
//! ```
//!
//! A chip does not store power flow: most of it is in the program counter. So when the inputs of a scan are
//! latched, the evaluator gets the values of all symbols from the chip, runs that scan, and reports the rung
//! bit before and after each element. Values are always those of the chip; only edges and other memories
//! without a name are those of the evaluator. Elements that the chip has not reached yet show the previous
//! scan.

#![forbid(unsafe_code)]

mod draw;
mod error;
mod explain;
mod power_flow;
mod scan_follower;
mod scan_position;

use std::sync::Arc;

use diag::{Diagnostic, DiagnosticCode, Pos, Severity};
use emu_core::Chip;
use emu_debug::debug::{DynMachine, ExpressionPlace, ProgramFollower};
use ladder::il::IecType;
use ladder::{ChipPart, ElementId, LadderProgram, RungNode};
use ladder_compile::{CellLocation as Kept, ElementMap, ImageMap, SpecialPin};
use ladder_eval::Evaluator;

pub use error::ViewError;
use scan_follower::ScanFollower;
pub use scan_position::ScanPosition;

/// Code of the error for a map that does not belong to the program or chip.
pub const BAD_MAP: &str = "DBG001";

/// Diagnostic codes of this crate.
pub const CODES: &[DiagnosticCode] = &[DiagnosticCode {
    code: BAD_MAP,
    title: "the map does not belong to this program",
    explain: "A debugger finds rungs, elements and symbols on the chip with the map that was written with the image. This map names another \
              chip, or does not have all rungs or symbols of the ladder program. Fix: compile the program again and give its image, map \
              and source together, or give only the program: emu then compiles it automatically.",
}];

/// Status registers of the serial line, with the bit that signals a received byte. A chip has one of them.
const BYTE_FLAGS: [(&str, u8); 4] = [("UCSR0A", 0x80), ("UCSRA", 0x80), ("SCON", 0x01), ("PIR1", 0x20)];

/// Program word at which a chip starts after a reset; compiled programs reach it only then. On AP101 a scan
/// begins there.
const RESET_WORD: u32 = 0;

/// A ladder program with its positions on the chip. A clone shares all data.
#[derive(Debug, Clone)]
pub struct LadderView {
    facts: Arc<ProgramFacts>,
}

/// Data that do not change while the program runs.
#[derive(Debug)]
struct ProgramFacts {
    program: LadderProgram,
    map: ImageMap,
    chip: &'static Chip,
    /// Evaluator in its power-up state, which also gives the order of the symbols.
    power_up: Evaluator,
    /// Places of the symbols on the chip, in the evaluator's order.
    places: Vec<ExpressionPlace>,
    /// Values of the symbols before the first scan.
    initial_values: Vec<i32>,
    /// Elements that write symbols, with the symbols, in text order.
    writes: Vec<(ElementId, u32)>,
    /// True if the program has jumps or subprograms.
    has_jumps: bool,
    /// Symbols that only the serial line writes.
    received_symbols: Vec<usize>,
    /// Symbols that only reads of a bus write.
    bus_symbols: Vec<usize>,
    /// Address and bit mask of the flag that signals a received byte.
    byte_flag: Option<(u16, u8)>,
    /// Program words where the follower acts: reset, start of a scan, and inputs latched.
    follow_words: Vec<u32>,
    /// Program word at which a scan begins.
    scan_start: u32,
    /// Program word at which the inputs have been latched.
    latched: u32,
    /// True if the chip latches inputs itself, with the first instruction of a scan.
    latches_itself: bool,
}

/// Where the code of a rung begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RungStart {
    /// The rung, from 1.
    pub rung: u32,
    /// The program word.
    pub word: u32,
}

/// Where the code of an element begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ElementStart {
    /// The rung, from 1.
    pub rung: u32,
    /// The element in it, from 1.
    pub element: u32,
    /// The program word.
    pub word: u32,
}

impl ProgramFacts {
    /// Reads a symbol on the chip as the evaluator holds it, with a sign; 0 without a place.
    fn chip_value(&self, symbol: usize, machine: &dyn DynMachine) -> i32 {
        let place = self.places.get(symbol);
        let value = place.and_then(|place| place.value(machine)).unwrap_or(0) as i32;
        let unused = match place {
            Some(ExpressionPlace::Memory { bytes, .. }) => 32 - 8 * u32::from((*bytes).clamp(1, 4)),
            _ => 0,
        };
        value << unused >> unused
    }

    /// Formats a value of the evaluator as the type of the symbol shows it.
    fn shown_value(&self, symbol: usize, value: i32) -> i64 {
        self.power_up.symbols().get(symbol).map_or(value.into(), |symbol| symbol.shown_value(value))
    }
}

impl LadderView {
    /// Creates a view from a program and the map of its image. Cheap to clone.
    ///
    /// # Errors
    /// [`BAD_MAP`] if they do not belong together; or an error for an unsupported element, which no image
    /// contains.
    pub fn new(program: LadderProgram, map: ImageMap, chip: &'static Chip) -> Result<LadderView, Vec<Diagnostic>> {
        let file = program.file.clone();
        let refuse = |cause: String| {
            let hint = "give the image, the map and the program that were made together, or the program alone";
            vec![Diagnostic::new(Severity::Error, BAD_MAP, &file, Pos::default(), cause, hint)]
        };
        if map.mcu != chip.name {
            return Err(refuse(format!("the map is of a program for {}, not for {}", map.mcu, chip.name)));
        }
        let elements = program.elements().count();
        if map.rungs.len() != program.rungs.len() || map.elements.len() != elements {
            return Err(refuse(format!(
                "the map has {} rungs with {} elements, the program {} with {elements}",
                map.rungs.len(),
                map.elements.len(),
                program.rungs.len()
            )));
        }
        let start = Evaluator::new(&program).map_err(|why| refuse(why.to_string()))?;
        let mut places = Vec::new();
        for symbol in start.symbols() {
            let kept = map.symbols.iter().find(|kept| kept.name == symbol.name);
            let signed = symbol.iec_type.as_ref().is_none_or(IecType::is_signed);
            let place = kept.and_then(|kept| debugger_place(chip, &kept.place, signed));
            places.push(
                place.ok_or_else(|| refuse(format!("the map has no place on {} for `{}`", chip.name, symbol.name)))?,
            );
        }
        let word = |byte: u32| byte / chip.word_bytes.max(1);
        let scan_start = word(map.scan_start);
        let first_rung =
            map.rungs.iter().find(|rung| rung.start < rung.end).map_or(scan_start, |rung| word(rung.start));
        let latches = chip.is_bit_controller();
        // If the chip latches inputs itself, they are visible after that instruction, a load that changes no
        // symbol.
        let latched = first_rung + u32::from(latches);
        let mut stops = vec![RESET_WORD, scan_start, latched];
        stops.dedup();
        let first = (0..places.len()).map(|symbol| start.get(symbol)).collect();
        let writes = explain::symbol_writes(&program, &start);
        let symbols_of = |parts: &[ChipPart]| explain::received_symbols(&program, &start, &writes, parts);
        let received = symbols_of(&[ChipPart::Receiver]);
        let bus_symbols = symbols_of(&[ChipPart::I2c, ChipPart::Spi]);
        let byte_flag = BYTE_FLAGS.iter().find_map(|(name, bit)| Some((chip.reg(name)?, *bit)));
        let facts = ProgramFacts {
            program,
            map,
            chip,
            has_jumps: start.has_jumps(),
            power_up: start,
            places,
            initial_values: first,
            writes,
            received_symbols: received,
            bus_symbols,
            byte_flag,
            follow_words: stops,
            scan_start,
            latched,
            latches_itself: latches,
        };
        Ok(LadderView { facts: Arc::new(facts) })
    }

    /// Creates a follower of the program for a session, from power-up on.
    #[must_use]
    pub fn follower(&self) -> Box<dyn ProgramFollower> {
        Box::new(ScanFollower::new(self.facts.clone()))
    }

    /// Symbols and their places on the chip.
    #[must_use]
    pub fn symbols(&self) -> Vec<(String, ExpressionPlace)> {
        let names = self.facts.power_up.symbols().iter().map(|symbol| symbol.name.clone());
        names.zip(self.facts.places.iter().copied()).collect()
    }

    /// Current values of all symbols on the chip; `None` for a symbol without one.
    #[must_use]
    pub fn values(&self, machine: &dyn DynMachine) -> Vec<(String, Option<i64>)> {
        self.symbols().into_iter().map(|(name, place)| (name, place.value(machine))).collect()
    }

    /// Whether a symbol is TRUE before the first scan, by its declaration.
    #[must_use]
    pub fn is_high_at_power_up(&self, name: &str) -> bool {
        self.facts.power_up.index(name).is_some_and(|symbol| self.facts.power_up.get(symbol) != 0)
    }

    /// The ladder program.
    #[must_use]
    pub fn program(&self) -> &LadderProgram {
        &self.facts.program
    }

    /// The map of the image.
    #[must_use]
    pub fn map(&self) -> &ImageMap {
        &self.facts.map
    }

    /// Converts `Xstart=1` to `PD2=1` if the program has an input with that name; otherwise returns the text
    /// unchanged.
    #[must_use]
    pub fn pin_assignment(&self, text: &str) -> String {
        let (name, rest) = text.split_at(text.find('=').unwrap_or(text.len()));
        let map = &self.facts.map;
        let named = map.pins.iter().find(|pin| pin.name == name.trim() && pin.direction == "in").map(|pin| &pin.pin);
        let analog = map.specials.iter().find_map(|special| match special {
            SpecialPin::Analog { pin, name: of } if of == name.trim() => Some(pin),
            _ => None,
        });
        named.or(analog).map_or_else(|| text.to_owned(), |pin| format!("{pin}{rest}"))
    }

    /// Program word at which a scan begins.
    #[must_use]
    pub fn scan_start(&self) -> u32 {
        self.facts.scan_start
    }

    /// Where the code of rungs begins; those without code are left out.
    #[must_use]
    pub fn rung_starts(&self) -> Vec<RungStart> {
        let with_code = self.facts.map.rungs.iter().filter(|rung| rung.start < rung.end);
        with_code.map(|rung| RungStart { rung: rung.rung, word: self.word(rung.start) }).collect()
    }

    /// Where the code of elements begins; those without code are left out.
    #[must_use]
    pub fn element_starts(&self) -> Vec<ElementStart> {
        let with_code = self.facts.map.elements.iter().filter(|of| of.start < of.end);
        let start = |of: &ElementMap| ElementStart { rung: of.rung, element: of.element, word: self.word(of.start) };
        with_code.map(start).collect()
    }

    /// Rung (from 1) that a program word belongs to.
    #[must_use]
    pub fn rung_at(&self, word: u32) -> Option<u32> {
        let within = |start: u32, end: u32| (self.word(start)..self.word(end)).contains(&word);
        self.facts.map.rungs.iter().find(|rung| within(rung.start, rung.end)).map(|rung| rung.rung)
    }

    /// Element that a program word belongs to.
    #[must_use]
    pub fn element_at(&self, word: u32) -> Option<ElementId> {
        let within = |start: u32, end: u32| (self.word(start)..self.word(end)).contains(&word);
        let found = self.facts.map.elements.iter().find(|element| within(element.start, element.end))?;
        Some(ElementId { rung: found.rung.checked_sub(1)?, index: found.element.checked_sub(1)? })
    }

    /// Line (from 1) of the `.ld` file at which a rung (from 1) begins.
    #[must_use]
    pub fn rung_line(&self, rung: u32) -> Option<u32> {
        let rung = self.facts.program.rungs.get(rung.checked_sub(1)? as usize)?;
        Some(rung.pos.line)
    }

    /// Rung (from 1) that a line of the `.ld` file belongs to; lines after a rung belong to it, up to the
    /// next rung.
    #[must_use]
    pub fn rung_of_line(&self, line: u32) -> Option<u32> {
        let before = self.facts.program.rungs.iter().take_while(|rung| rung.pos.line <= line).count();
        let last = before == self.facts.program.rungs.len();
        if last && line > self.last_line() { None } else { u32::try_from(before).ok().filter(|rung| *rung > 0) }
    }

    /// Line of the `.ld` file at which the last rung ends; a line or two too large if branches of one element
    /// have no END of their own.
    #[must_use]
    pub fn last_line(&self) -> u32 {
        /// Last line of a series, including the lines that close its groups.
        fn end(series: &[RungNode], from: u32) -> u32 {
            match series.last() {
                None => from,
                Some(RungNode::Leaf(_, pos)) => pos.line,
                // The END of the branch and the END of the group.
                Some(RungNode::Parallel(branches, pos)) => {
                    branches.last().map_or(pos.line, |branch| end(branch, pos.line)) + 2
                }
            }
        }
        self.facts.program.rungs.last().map_or(0, |rung| end(&rung.series, rung.pos.line) + 1)
    }

    fn word(&self, byte: u32) -> u32 {
        byte / self.facts.chip.word_bytes.max(1)
    }
}

/// Converts a place of the map for the debugger; `None` if the chip has no such memory. `signed` says whether
/// a number there has a sign.
fn debugger_place(chip: &'static Chip, kept: &Kept, signed: bool) -> Option<ExpressionPlace> {
    let memory = |name: &str| chip.space(name).map(|space| space.name);
    Some(match kept {
        Kept::Bit { space, addr, bit } => ExpressionPlace::Bit { space: memory(space)?, addr: *addr, bit: *bit },
        Kept::Word { space, addr, bytes } => {
            ExpressionPlace::Memory { space: memory(space)?, addr: *addr, bytes: *bytes, signed }
        }
    })
}
