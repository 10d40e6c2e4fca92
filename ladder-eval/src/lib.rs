#![forbid(unsafe_code)]
//! Reference implementation of the ladder language: it computes one scan of a program, element by element.
//!
//! It follows only the documents of the language and shares only the model with the compiler, so a difference
//! between the two means that one of them is wrong. `docs/semantics.md` describes the meaning in prose;
//! section numbers in this crate ("2.3") refer to its headings.
//!
//! `flatten` flattens the model once and resolves all names, with the help of `peripheral_ops` for the
//! elements that use a part of the chip. `flat_program` executes the flat form. `peripheral_state` holds the
//! state outside of the program's memory.
//!
//! ```
//! use ladder_eval::Evaluator;
//!
//! let head = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n";
//! let text = format!("{head}RUNG\n    CONTACTS Xstart 0\n    COIL Ylamp 0 0 0\nEND\n");
//! let program = ladder::parse("lamp.ld", &text).expect("a sound program").program;
//! let mut evaluator = Evaluator::new(&program).expect("elements with a meaning");
//! let start = evaluator.index("Xstart").expect("a symbol of the program");
//! let lamp = evaluator.index("Ylamp").expect("a symbol of the program");
//! evaluator.set(start, 1);
//! evaluator.scan();
//! assert_eq!(evaluator.get(lamp), 1);
//! ```

mod arithmetic;
mod bit_ops;
mod counting_steps;
mod element_op;
mod flat_program;
mod flatten;
mod flow_steps;
mod il_blocks;
mod il_flatten;
mod il_functions;
mod il_ops;
mod peripheral_ops;
mod peripheral_state;
mod ports;
mod power_up;
mod pulse_ops;
mod unsupported;

use std::collections::HashMap;
use std::sync::Arc;

pub use ladder::{ElementId, LadderProgram, LadderSymbol};
pub use peripheral_state::{BusEvent, PwmChannel};
pub use unsupported::UnsupportedReason;

/// Rung bit before and after an element in one scan.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ElementPower {
    /// True if power enters it.
    pub before: bool,
    /// True if power leaves it.
    pub after: bool,
}

/// Executes one program scan by scan. A `clone` is a snapshot: it copies the whole state and shares the
/// program.
#[derive(Debug, Clone)]
pub struct Evaluator {
    code: Arc<EvaluatorProgram>,
    state: flat_program::ScanState,
}

/// Error: an element that is not supported. The whole program is refused; no part of it runs.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{element}: `{text}`: {why}")]
pub struct UnsupportedElement {
    /// The element; printed as rung and element numbers from 1.
    pub element: ElementId,
    /// The element as `.ld` text.
    pub text: String,
    /// Why it is not supported.
    #[source]
    pub why: UnsupportedReason,
}

/// The immutable part of an evaluator, which clones share.
#[derive(Debug)]
struct EvaluatorProgram {
    symbols: Vec<LadderSymbol>,
    by_name: HashMap<String, usize>,
    flat: flat_program::FlatProgram,
}

impl Evaluator {
    /// Creates an evaluator in the power-up state (2.1).
    ///
    /// Every bit, integer and memory is 0 (in ldmicro-5 a counter has its start value), the EEPROM is erased,
    /// and nothing has been sent, received or converted.
    ///
    /// # Errors
    /// Reports the first unsupported element in text order; section 4 of `docs/semantics.md` lists the cases.
    pub fn new(program: &LadderProgram) -> Result<Evaluator, UnsupportedElement> {
        let symbols = program.symbols();
        let by_name = symbols.iter().enumerate().map(|(i, s)| (s.name.clone(), i)).collect();
        let flat = flatten::flatten(program, &symbols, &by_name)?;
        let state = flat_program::ScanState::new(&flat);
        Ok(Evaluator { code: Arc::new(EvaluatorProgram { symbols, by_name, flat }), state })
    }

    /// All symbols, in the order of [`LadderProgram::symbols`]; a position in it is the index for `get` and
    /// `set`.
    #[must_use]
    pub fn symbols(&self) -> &[LadderSymbol] {
        &self.code.symbols
    }

    /// Index of a symbol, by its full name (`Xbutton`).
    #[must_use]
    pub fn index(&self, name: &str) -> Option<usize> {
        self.code.by_name.get(name).copied().or_else(|| ladder::find_symbol(&self.code.symbols, name))
    }

    /// Current value of a symbol: 0 or 1 for a bit, a signed number of its width for an integer.
    ///
    /// Returns 0 for an index beyond the last symbol.
    #[must_use]
    pub fn get(&self, symbol: usize) -> i32 {
        self.state.values.get(symbol).copied().unwrap_or(0)
    }

    /// Sets the value of a symbol: of an input before a scan, or of any other symbol at any time.
    ///
    /// A bit becomes 1 for every value except 0; an integer keeps the low bytes of its width. An index beyond
    /// the last symbol has no effect.
    pub fn set(&mut self, symbol: usize, value: i32) {
        let (Some(slot), Some(LadderSymbol { kind, .. }), Some(&width)) =
            (self.state.values.get_mut(symbol), self.code.symbols.get(symbol), self.code.flat.cut_bits.get(symbol))
        else {
            return;
        };
        *slot = if kind.is_bit() { i32::from(value != 0) } else { arithmetic::truncate(value.into(), width) };
        self.state.share_outputs(&self.code.flat);
    }

    /// Runs one scan: all rungs from top to bottom. Inputs keep the values last set for the whole scan.
    pub fn scan(&mut self) {
        self.state.scan(&self.code.flat, |_, _, _, _| {});
    }

    /// Runs one scan and calls `watch` after each element with the rung bit before and after it.
    ///
    /// Each element is reported when it is executed: exactly once, in text order, unless the program has
    /// jumps or subprograms. Comments are not reported.
    pub fn scan_watched(&mut self, watch: &mut dyn FnMut(ElementId, bool, bool)) {
        self.state.scan(&self.code.flat, |id, before, after, _| watch(id, before, after));
    }

    /// Runs one scan as [`Evaluator::scan_watched`] does, and also passes the values of all symbols after
    /// each element.
    ///
    /// The values are in the order of [`Evaluator::symbols`].
    pub fn scan_traced(&mut self, watch: impl FnMut(ElementId, bool, bool, &[i32])) {
        self.state.scan(&self.code.flat, watch);
    }

    /// True if the program has jumps or subprograms, so that a scan may leave elements out, or execute them
    /// several times.
    #[must_use]
    pub fn has_jumps(&self) -> bool {
        self.code.flat.has_jumps
    }

    /// All elements except comments, in text order.
    pub fn elements(&self) -> impl Iterator<Item = ElementId> {
        self.code.flat.steps.iter().filter_map(|step| match step {
            flat_program::FlatStep::Do(id, _) => Some(*id),
            _ => None,
        })
    }

    /// Number of scans since power-up.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.state.scans
    }

    /// Sets the result of future conversions of an analog input, 0 to 1023; greater values count as 1023.
    ///
    /// `symbol` is the index of a symbol that READ_ADC uses; for any other symbol the call has no effect. The
    /// symbol itself changes only when READ_ADC runs.
    pub fn set_adc(&mut self, symbol: usize, value: u16) {
        let input = self.code.flat.adc_symbols.iter().position(|&adc| adc as usize == symbol);
        if let Some(level) = input.and_then(|input| self.state.parts.adc.get_mut(input)) {
            *level = value.min(1023);
        }
    }

    /// Indices of the symbols that READ_ADC uses, in ascending order.
    pub fn adc_symbols(&self) -> impl Iterator<Item = usize> {
        self.code.flat.adc_symbols.iter().map(|&symbol| symbol as usize)
    }

    /// Delivers a byte that has arrived completely on the serial line before the next scan.
    ///
    /// Returns false and changes nothing while an earlier byte waits to be taken; the language does not
    /// define what the chip does then.
    pub fn receive(&mut self, byte: u8) -> bool {
        let free = self.state.parts.received_byte.is_none();
        if free {
            self.state.parts.received_byte = Some(byte);
        }
        free
    }

    /// True if a byte has arrived that no UART_RECV has taken.
    #[must_use]
    pub fn has_received_byte(&self) -> bool {
        self.state.parts.received_byte.is_some()
    }

    /// The last byte that the last scan sent. Only UART_SEND that waits sends several in a scan.
    #[must_use]
    pub fn sent(&self) -> Option<u8> {
        self.state.parts.sent.last().copied()
    }

    /// All bytes that the last scan sent, in order.
    #[must_use]
    pub fn sent_bytes(&self) -> &[u8] {
        &self.state.parts.sent
    }

    /// What the last scan did on the buses of the chip, in order.
    #[must_use]
    pub fn bus_events(&self) -> &[BusEvent] {
        &self.state.parts.transfers_of_scan
    }

    /// Sets the byte that devices on the buses answer from the next scan on; FFh, a bus without devices, at
    /// power-up.
    pub fn set_bus_answer(&mut self, byte: u8) {
        self.state.parts.bus_answer = byte;
    }

    /// Number of scans for which the transmitter is busy.
    ///
    /// A scan can send once this many scans have started; with 0 and 1 the next scan can send.
    #[must_use]
    pub fn uart_busy_scans(&self) -> u32 {
        self.state.parts.transmitter_busy_scans
    }

    /// Duty cycle of each PWM output in percent, 0 to 100; `None` before the first SET_PWM of the output has
    /// run, while the pin is low.
    #[must_use]
    pub fn pwm_duties(&self) -> &[Option<u8>] {
        &self.state.parts.duties
    }

    /// Duty cycle of the first PWM output, see [`Evaluator::pwm_duties`].
    #[must_use]
    pub fn pwm_percent(&self) -> Option<u8> {
        self.state.parts.duties.first().copied().flatten()
    }

    /// The program's PWM outputs, in the order in which SET_PWM names them first.
    #[must_use]
    pub fn pwm_outputs(&self) -> &[PwmChannel] {
        &self.code.flat.pwm_outputs
    }

    /// EEPROM cells that PERSIST uses, from address 0; each is FFh at power-up.
    #[must_use]
    pub fn eeprom(&self) -> &[u8] {
        &self.state.parts.eeprom
    }

    /// Sets an EEPROM cell, for example to a value from before power-up.
    ///
    /// An address beyond the last cell has no effect.
    pub fn set_eeprom(&mut self, addr: usize, byte: u8) {
        if let Some(cell) = self.state.parts.eeprom.get_mut(addr) {
            *cell = byte;
        }
    }

    /// Number of scans for which the EEPROM is busy, counted as in [`Evaluator::uart_busy_scans`].
    #[must_use]
    pub fn eeprom_busy_scans(&self) -> u32 {
        self.state.parts.eeprom_busy_scans
    }
}
