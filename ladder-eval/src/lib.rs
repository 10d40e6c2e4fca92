#![forbid(unsafe_code)]
//! The reference meaning of a ladder program: what one scan does, element by element.
//!
//! Written from the language's documents alone and sharing only the model with the compiler, so that a difference between
//! the two means that one of them is wrong. The meaning itself is told in prose in `docs/semantics.md`; section numbers
//! in this crate ("2.3") are those of its headings.
//!
//! `flatten` flattens the model once (`devices` the elements that use a part of the chip), `flat_program` runs the flat form and
//! `parts` holds what lies outside of the program's memory; everything that names things is resolved in between.

mod bit_ops;
mod flat_program;
mod flatten;
mod peripheral_ops;
mod peripheral_state;
mod unsupported;

use std::collections::HashMap;
use std::sync::Arc;

pub use ladder::{ElementId, LadderProgram, LadderSymbol};
pub use unsupported::UnsupportedReason;

/// Runs one program, scan by scan. A value: `clone` is a snapshot of the whole state and copies nothing else.
#[derive(Debug, Clone)]
pub struct Evaluator {
    code: Arc<EvaluatorProgram>,
    state: flat_program::ScanState,
}

/// An element that has no meaning here (yet, or at all): the program is refused as a whole, never run in part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{element}: `{text}`: {why}")]
pub struct UnsupportedElement {
    /// Which element, printed as rung and element from 1.
    pub element: ElementId,
    /// The element as `.ld` text.
    pub text: String,
    /// Why it has no meaning.
    #[source]
    pub why: UnsupportedReason,
}

/// The part of an evaluator that no scan changes.
#[derive(Debug)]
struct EvaluatorProgram {
    symbols: Vec<LadderSymbol>,
    by_name: HashMap<String, usize>,
    flat: flat_program::FlatProgram,
}

impl Evaluator {
    /// The program in its power-up state: every bit, integer and memory 0 (in ldmicro-5 a counter its start value), the
    /// EEPROM erased, nothing sent, received or converted (2.1).
    ///
    /// # Errors
    /// The first element, in text order, that has no meaning here: section 4 of `docs/semantics.md` lists them.
    pub fn new(program: &LadderProgram) -> Result<Evaluator, UnsupportedElement> {
        let symbols = program.symbols();
        let by_name = symbols.iter().enumerate().map(|(i, s)| (s.name.clone(), i)).collect();
        let flat = flatten::flatten(program, &symbols, &by_name)?;
        let state = flat_program::ScanState::new(&flat);
        Ok(Evaluator { code: Arc::new(EvaluatorProgram { symbols, by_name, flat }), state })
    }

    /// All symbols, in the order of [`LadderProgram::symbols`]; the position is the index that `get` and `set` take.
    #[must_use]
    pub fn symbols(&self) -> &[LadderSymbol] {
        &self.code.symbols
    }

    /// The index of a symbol by its full name (`Xbutton`).
    #[must_use]
    pub fn index(&self, name: &str) -> Option<usize> {
        self.code.by_name.get(name).copied()
    }

    /// The value of a symbol now: 0 or 1 for a bit, a signed number of its width for an integer. An index past the last
    /// symbol reads 0.
    #[must_use]
    pub fn get(&self, symbol: usize) -> i32 {
        self.state.values.get(symbol).copied().unwrap_or(0)
    }

    /// Gives a symbol a value: inputs before a scan, anything else at will. A bit becomes 1 for every value but 0; an
    /// integer keeps the low bytes of its width. An index past the last symbol changes nothing.
    pub fn set(&mut self, symbol: usize, value: i32) {
        let (Some(slot), Some(LadderSymbol { kind, .. }), Some(&width)) =
            (self.state.values.get_mut(symbol), self.code.symbols.get(symbol), self.code.flat.cut_bits.get(symbol))
        else {
            return;
        };
        *slot = if kind.is_bit() { i32::from(value != 0) } else { flat_program::truncate(value.into(), width) };
    }

    /// One scan: all rungs, top to bottom. Inputs are those last set and hold for the whole scan.
    pub fn scan(&mut self) {
        self.state.scan(&self.code.flat, |_, _, _, _| {});
    }

    /// One scan that calls `watch` after each element with the rung's bit before and after it. Comments are not elements
    /// of the scan and are never reported; each other element is reported exactly once, in order of execution, which is
    /// text order.
    pub fn scan_watched(&mut self, watch: &mut dyn FnMut(ElementId, bool, bool)) {
        self.state.scan(&self.code.flat, |id, before, after, _| watch(id, before, after));
    }

    /// As [`Evaluator::scan_watched`], with the values of all symbols after the element, in the order of [`Evaluator::symbols`].
    pub fn scan_traced(&mut self, watch: impl FnMut(ElementId, bool, bool, &[i32])) {
        self.state.scan(&self.code.flat, watch);
    }

    /// Scans run since power-up.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.state.scans
    }

    /// What a conversion of the analog input of a READ_ADC symbol gives from now on, 0 to 1023 (a greater value counts as
    /// 1023). Nothing changes where READ_ADC does not name the symbol; the symbol itself changes when READ_ADC runs.
    pub fn set_adc(&mut self, symbol: usize, value: u16) {
        let input = self.code.flat.adc_symbols.iter().position(|&adc| adc as usize == symbol);
        if let Some(level) = input.and_then(|input| self.state.parts.adc.get_mut(input)) {
            *level = value.min(1023);
        }
    }

    /// The symbols that READ_ADC names, ascending.
    pub fn adc_symbols(&self) -> impl Iterator<Item = usize> {
        self.code.flat.adc_symbols.iter().map(|&symbol| symbol as usize)
    }

    /// A byte has arrived completely on the serial line before the next scan. False, and nothing changes, while another
    /// waits to be taken: what the chip does then has no meaning here.
    pub fn receive(&mut self, byte: u8) -> bool {
        let free = self.state.parts.received_byte.is_none();
        if free {
            self.state.parts.received_byte = Some(byte);
        }
        free
    }

    /// Whether a byte has arrived that no UART_RECV has taken.
    #[must_use]
    pub fn has_received_byte(&self) -> bool {
        self.state.parts.received_byte.is_some()
    }

    /// The byte that the last scan sent; a scan sends one at most.
    #[must_use]
    pub fn sent(&self) -> Option<u8> {
        self.state.parts.sent
    }

    /// How many scans the transmitter is busy: a scan can send when this many have started, 0 and 1 mean the next.
    #[must_use]
    pub fn uart_busy_scans(&self) -> u32 {
        self.state.parts.transmitter_busy_scans
    }

    /// The duty of the pulse width output in percent, 0 to 100; `None` until a SET_PWM has run, while the pin is low.
    #[must_use]
    pub fn pwm_percent(&self) -> Option<u8> {
        self.state.parts.duty
    }

    /// The frequency in Hz that the program's SET_PWM name; `None` for a program without one.
    #[must_use]
    pub fn pwm_hz(&self) -> Option<u32> {
        self.code.flat.pwm_hz
    }

    /// The cells of the EEPROM that PERSIST uses, from address 0; FFh each at power-up.
    #[must_use]
    pub fn eeprom(&self) -> &[u8] {
        &self.state.parts.eeprom
    }

    /// Gives a cell of the EEPROM a value, as it may hold one from before power-up. An address past the last cell changes
    /// nothing.
    pub fn set_eeprom(&mut self, addr: usize, byte: u8) {
        if let Some(cell) = self.state.parts.eeprom.get_mut(addr) {
            *cell = byte;
        }
    }

    /// How many scans the EEPROM is busy, as [`Evaluator::uart_busy_scans`] counts them.
    #[must_use]
    pub fn eeprom_busy_scans(&self) -> u32 {
        self.state.parts.eeprom_busy_scans
    }
}
