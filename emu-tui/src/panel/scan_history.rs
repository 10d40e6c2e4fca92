//! Runs the program of the panel and keeps the state after every scan, so that the user can go back.

use std::collections::VecDeque;
use std::sync::Arc;

use ladder::{ChipPart, ElementId, LadderProgram, ProgramElement, SymbolKind};
use ladder_eval::{ElementPower, Evaluator, LadderSymbol};

use crate::rung_picture::PowerFlowSource;

/// Maximum memory for the history in bytes, and maximum number of scans in it.
const HISTORY_LIMITS: (usize, usize) = (64 << 20, 5_000);

/// Microseconds of a byte on the serial line (ten bits) at 1 bit per second.
const BYTE_US: u64 = 10_000_000;

/// Maximum number of sent bytes that are kept.
const MAX_SENT_BYTES: usize = 4_096;

/// The program with its inputs and its history.
#[derive(Debug, Clone)]
pub(super) struct PanelMachine {
    pub program: Arc<LadderProgram>,
    /// The evaluator at power-up, with an erased EEPROM.
    at_power_up: Arc<Evaluator>,
    /// Index of each rung's first element; the last entry is the number of elements.
    first_elements: Arc<[usize]>,
    current: PanelState,
    /// States after the scans, the latest at the end; the first entry is the state before scan 1 or the
    /// oldest one kept.
    past: VecDeque<Arc<PastScan>>,
    /// Maximum number of entries in `past`.
    max_kept: usize,
}

/// The state between two scans.
#[derive(Debug, Clone)]
struct PanelState {
    evaluator: Evaluator,
    /// Levels of the analog inputs, in symbol order.
    levels: Vec<u16>,
    /// Inputs that are inverted again after the next scan; in a past state, after the scan of that state.
    pulsed: Vec<usize>,
    /// Bytes that are still to arrive.
    incoming: VecDeque<u8>,
    /// The scan from which on the line is free for the next byte.
    free_at: u64,
    /// The last bytes that the program sent.
    sent: VecDeque<u8>,
    /// Number of scans since the first power-up.
    scans: u64,
}

impl PanelState {
    /// Inverts the pulsed inputs again after their scan.
    fn release_pulsed(&mut self) {
        for symbol in self.pulsed.drain(..) {
            let value = self.evaluator.get(symbol);
            self.evaluator.set(symbol, i32::from(value == 0));
        }
    }
}

/// The state after a scan, with the inputs of that scan.
#[derive(Debug)]
pub(super) struct PastScan {
    state: PanelState,
    /// Per element: bit 0 is set if it was executed, bit 1 is its power input, bit 2 its power output.
    flow: Vec<u8>,
}

impl PastScan {
    /// The value of a symbol after the scan; inputs are constant during a scan.
    pub(super) fn get(&self, symbol: usize) -> i32 {
        self.state.evaluator.get(symbol)
    }

    /// Number of the scan since the first power-up, from 1.
    pub(super) fn scan(&self) -> u64 {
        self.state.scans
    }

    /// False for the state before the first scan and for the state after a power cycle.
    pub(super) fn has_run(&self) -> bool {
        !self.flow.is_empty()
    }
}

impl PanelMachine {
    /// Makes the history of a program before its first scan.
    pub(super) fn new(program: LadderProgram, evaluator: Evaluator) -> PanelMachine {
        let mut firsts = vec![0];
        let mut rung = 0;
        let mut count = 0;
        for ProgramElement { id, .. } in program.elements() {
            while rung < id.rung {
                firsts.push(count);
                rung += 1;
            }
            count += 1;
        }
        firsts.resize(program.rungs.len() + 1, count);
        let symbols = evaluator.symbols().len();
        let size = 500 + 4 * symbols + count + evaluator.eeprom().len();
        let levels = vec![0; evaluator.adc_symbols().count()];
        let now = PanelState {
            evaluator: evaluator.clone(),
            levels,
            pulsed: Vec::new(),
            incoming: VecDeque::new(),
            free_at: 0,
            sent: VecDeque::new(),
            scans: 0,
        };
        let begin = PastScan { state: now.clone(), flow: Vec::new() };
        PanelMachine {
            program: Arc::new(program),
            at_power_up: Arc::new(evaluator),
            first_elements: firsts.into(),
            past: VecDeque::from([Arc::new(begin)]),
            current: now,
            max_kept: (HISTORY_LIMITS.0 / size).clamp(2, HISTORY_LIMITS.1 + 1),
        }
    }

    /// Runs `scans` scans.
    pub(super) fn run(&mut self, scans: u64) {
        for _ in 0..scans {
            self.scan();
        }
    }

    fn scan(&mut self) {
        let now = &mut self.current;
        let free = now.evaluator.scans() >= now.free_at && !now.evaluator.has_received_byte();
        if let Some(byte) = free.then(|| now.incoming.pop_front()).flatten() {
            now.evaluator.receive(byte);
            let baud = self.program.settings.baud.unwrap_or(0).max(1);
            let apart = BYTE_US.div_ceil(baud.saturating_mul(self.program.settings.cycle_us.max(1)));
            now.free_at = now.evaluator.scans().saturating_add(apart);
        }
        let mut flow = vec![0; self.first_elements.last().copied().unwrap_or(0)];
        let firsts = &self.first_elements;
        now.evaluator.scan_watched(&mut |id, came, went| {
            let at = firsts.get(id.rung as usize).map(|first| first + id.index as usize);
            if let Some(slot) = at.and_then(|at| flow.get_mut(at)) {
                *slot = 1 | u8::from(came) << 1 | u8::from(went) << 2;
            }
        });
        now.scans += 1;
        for &byte in now.evaluator.sent_bytes() {
            if now.sent.len() == MAX_SENT_BYTES {
                now.sent.pop_front();
            }
            now.sent.push_back(byte);
        }
        let state = now.clone();
        now.release_pulsed();
        self.keep(PastScan { state, flow });
    }

    fn keep(&mut self, moment: PastScan) {
        if self.past.len() >= self.max_kept {
            self.past.pop_front();
        }
        self.past.push_back(Arc::new(moment));
    }

    /// Goes back by up to `scans` scans, including the inputs, and returns by how many.
    pub(super) fn go_back(&mut self, scans: usize) -> usize {
        let scans = scans.min(self.past.len() - 1);
        self.past.truncate(self.past.len() - scans);
        if let (true, Some(last)) = (scans > 0, self.past.back()) {
            self.current = last.state.clone();
            if last.has_run() {
                self.current.release_pulsed();
            }
        }
        scans
    }

    /// Switches the supply off and on; switches, analog levels and the EEPROM are kept.
    pub(super) fn power_cycle(&mut self) {
        let old = std::mem::replace(&mut self.current.evaluator, (*self.at_power_up).clone());
        for (symbol, kind) in old.symbols().iter().map(|s| s.kind).enumerate() {
            // All symbols except the inputs get their power-up values, including values set before the first
            // scan.
            let value = if kind == SymbolKind::Input { old.get(symbol) } else { self.at_power_up.get(symbol) };
            self.current.evaluator.set(symbol, value);
        }
        for (cell, byte) in old.eeprom().iter().enumerate() {
            self.current.evaluator.set_eeprom(cell, *byte);
        }
        self.levels_in();
        (self.current.free_at, self.current.incoming) = (0, VecDeque::new());
        self.keep(PastScan { state: self.current.clone(), flow: Vec::new() });
    }

    fn levels_in(&mut self) {
        let symbols: Vec<usize> = self.current.evaluator.adc_symbols().collect();
        for (symbol, level) in symbols.into_iter().zip(&self.current.levels) {
            self.current.evaluator.set_adc(symbol, *level);
        }
    }

    /// Sets an input or another symbol.
    pub(super) fn set(&mut self, symbol: usize, value: i32) {
        self.current.evaluator.set(symbol, value);
        self.current.pulsed.retain(|pulsed| *pulsed != symbol);
    }

    /// Inverts an input for one scan.
    pub(super) fn pulse(&mut self, symbol: usize) {
        let value = i32::from(self.get(symbol) == 0);
        self.set(symbol, value);
        self.current.pulsed.push(symbol);
    }

    /// True while an input is inverted for one scan.
    pub(super) fn is_pulsed(&self, symbol: usize) -> bool {
        self.current.pulsed.contains(&symbol)
    }

    /// Sets the level of an analog input, 0 to 1023.
    pub(super) fn set_level(&mut self, symbol: usize, level: u16) {
        let at = self.current.evaluator.adc_symbols().position(|adc| adc == symbol);
        if let Some(slot) = at.and_then(|at| self.current.levels.get_mut(at)) {
            *slot = level.min(1023);
            self.current.evaluator.set_adc(symbol, level.min(1023));
        }
    }

    /// Symbol index and level of each analog input.
    pub(super) fn levels(&self) -> impl Iterator<Item = (usize, u16)> {
        self.current.evaluator.adc_symbols().zip(self.current.levels.iter().copied())
    }

    /// Queues bytes to the program; they arrive at the baud rate of the serial line.
    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.current.incoming.extend(bytes);
    }

    /// Number of bytes that are still to arrive.
    pub(super) fn incoming_bytes(&self) -> usize {
        self.current.incoming.len()
    }

    /// Returns the value of a symbol in the present scan.
    pub(super) fn get(&self, symbol: usize) -> i32 {
        self.current.evaluator.get(symbol)
    }

    /// Returns the number of the symbol with this name.
    pub(super) fn index(&self, name: &str) -> Option<usize> {
        self.current.evaluator.index(name)
    }

    /// The symbols of the program.
    pub(super) fn symbols(&self) -> &[LadderSymbol] {
        self.current.evaluator.symbols()
    }

    /// Symbol indices of the kinds for which `is` returns true.
    pub(super) fn symbols_of(&self, is: impl Fn(SymbolKind) -> bool) -> impl Iterator<Item = usize> {
        self.symbols().iter().enumerate().filter(move |(_, s)| is(s.kind)).map(|(at, _)| at)
    }

    /// The evaluator in its current state.
    pub(super) fn evaluator(&self) -> &Evaluator {
        &self.current.evaluator
    }

    /// The bytes that the program has sent, the oldest first.
    pub(super) fn sent(&self) -> &VecDeque<u8> {
        &self.current.sent
    }

    /// True if the program has an element that sends.
    pub(super) fn can_send(&self) -> bool {
        self.program.uses_part(ChipPart::Transmitter)
    }

    /// True if the program has an element that receives.
    pub(super) fn can_receive(&self) -> bool {
        self.program.uses_part(ChipPart::Receiver)
    }

    /// The cycle time of the program in microseconds.
    pub(super) fn cycle_us(&self) -> u64 {
        self.program.settings.cycle_us
    }

    /// Number of elements.
    pub(super) fn elements(&self) -> usize {
        self.first_elements.last().copied().unwrap_or(0)
    }

    /// The states that are kept, the latest at the end; the first one is the state before them.
    pub(super) fn past(&self) -> impl DoubleEndedIterator<Item = &PastScan> + ExactSizeIterator {
        self.past.iter().map(|moment| &**moment)
    }
}

impl PowerFlowSource for PanelMachine {
    fn power_flow(&self, id: ElementId) -> Option<ElementPower> {
        let at = self.first_elements.get(id.rung as usize)? + id.index as usize;
        let bits = *self.past.back()?.flow.get(at)?;
        (bits & 1 == 1).then_some(ElementPower { before: bits & 2 != 0, after: bits & 4 != 0 })
    }

    fn bit_value(&self, name: &str) -> Option<bool> {
        let index = self.index(name)?;
        self.symbols().get(index)?.kind.is_bit().then(|| self.get(index) != 0)
    }
}
