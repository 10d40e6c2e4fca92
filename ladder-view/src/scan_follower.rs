//! Follows a program scan by scan: runs the evaluator in parallel to the chip and records its results.

use std::any::Any;
use std::collections::VecDeque;
use std::sync::Arc;

use emu_debug::debug::{DynMachine, ProgramFollower};
use ladder::ElementId;
use ladder_eval::{ElementPower, Evaluator};

use crate::{ProgramFacts, RESET_WORD};

/// Number of the most recent changes kept for each symbol.
const KEPT_CHANGES: usize = 4;

/// A value that an element wrote to a symbol.
#[derive(Debug, Clone, Copy)]
struct SymbolWrite {
    element: ElementId,
    symbol: u32,
    value: i32,
}

/// What the elements of a scan did, in text order.
#[derive(Debug)]
struct ScanTrace {
    /// Rung bit before and after each element, without comments.
    power: Vec<(ElementId, ElementPower)>,
    /// Values that elements wrote to symbols.
    writes: Vec<SymbolWrite>,
}

/// One scan, as the evaluator ran it with the values of the chip.
#[derive(Debug)]
pub(crate) struct FollowedScan {
    /// Number of the scan, from 1.
    pub number: u64,
    /// Machine cycle at which its inputs were latched.
    pub cycle: u64,
    /// Values of all symbols after the previous scan, in the evaluator's order.
    pub previous_values: Vec<i32>,
    /// Values of all symbols before the first rung.
    pub values_before: Vec<i32>,
    /// Values of all symbols after the last rung.
    pub values_after: Vec<i32>,
    trace: ScanTrace,
}

impl FollowedScan {
    /// Rung bit before and after an element; `None` for a comment.
    pub(crate) fn power(&self, id: ElementId) -> Option<ElementPower> {
        let at = self.trace.power.binary_search_by_key(&id, |row| row.0).ok()?;
        self.trace.power.get(at).map(|row| row.1)
    }

    /// Value of a symbol when the scan reaches element `to`, or after the last rung if `to` is `None`.
    pub(crate) fn value(&self, symbol: usize, to: Option<ElementId>) -> i32 {
        let Some(to) = to else { return self.values_after.get(symbol).copied().unwrap_or(0) };
        let writes = &self.trace.writes;
        let earlier = writes.partition_point(|write| write.element < to);
        let last = writes.iter().take(earlier).rev().find(|write| write.symbol as usize == symbol);
        last.map_or_else(|| self.values_before.get(symbol).copied().unwrap_or(0), |write| write.value)
    }

    /// True if a symbol's value at element `to` of this scan differs from the value after the previous scan.
    pub(crate) fn has_changed(&self, symbol: usize, to: Option<ElementId>) -> bool {
        self.previous_values.get(symbol) != Some(&self.value(symbol, to))
    }
}

#[cfg(test)]
impl FollowedScan {
    /// A scan of which only the rung bits are known.
    pub(crate) fn with_power(power: Vec<(ElementId, ElementPower)>) -> FollowedScan {
        let trace = ScanTrace { power, writes: Vec::new() };
        let (previous_values, values_before, values_after) = (Vec::new(), Vec::new(), Vec::new());
        FollowedScan { number: 1, cycle: 0, previous_values, values_before, values_after, trace }
    }
}

/// Follower of one program.
#[derive(Debug, Clone)]
pub(crate) struct ScanFollower {
    facts: Arc<ProgramFacts>,
    /// Evaluator in the state before the current scan, or after the last one.
    eval: Evaluator,
    /// Number of scans begun.
    scans_begun: u64,
    /// Number of scans begun before the last reset of the chip.
    pub scans_before: u64,
    /// Machine cycle at which the inputs of the current scan were latched, if one is in progress.
    latch_cycle: Option<u64>,
    /// Machine cycle at which that scan began.
    start_cycle: u64,
    /// True if a byte had been received on the serial line when the inputs were latched.
    byte_received: bool,
    /// Last complete scan.
    pub last_scan: Option<Arc<FollowedScan>>,
    /// For each symbol, the most recent complete scans that changed its value, newest last. Inputs change at
    /// the start of a scan, other symbols during it.
    pub changes: Vec<VecDeque<Arc<FollowedScan>>>,
}

impl ScanFollower {
    /// Makes a follower of a program before its first scan.
    pub(crate) fn new(facts: Arc<ProgramFacts>) -> ScanFollower {
        let changes = vec![VecDeque::new(); facts.places.len()];
        ScanFollower {
            eval: facts.power_up.clone(),
            facts,
            scans_begun: 0,
            scans_before: 0,
            latch_cycle: None,
            start_cycle: 0,
            byte_received: false,
            last_scan: None,
            changes,
        }
    }

    /// Returns the concrete follower behind a session's trait object.
    pub(crate) fn from_dyn(follow: &dyn ProgramFollower) -> Option<&ScanFollower> {
        follow.as_any().downcast_ref()
    }

    /// Result of the scan in progress, computed from its latched inputs.
    pub(crate) fn current_scan(&self, machine: &dyn DynMachine) -> Option<Arc<FollowedScan>> {
        let cycle = self.latch_cycle?;
        Some(Arc::new(self.run_scan(&mut self.eval.clone(), cycle, machine)))
    }

    /// Copies the values of the chip to the evaluator when the inputs are latched.
    fn latch_inputs(&mut self, machine: &dyn DynMachine) {
        for symbol in 0..self.facts.places.len() {
            self.eval.set(symbol, self.facts.chip_value(symbol, machine));
        }
        if self.last_scan.is_none() {
            // Content of the EEPROM at power-up.
            for cell in self.facts.map.eeprom.iter().flat_map(|kept| kept.addr..kept.addr + u16::from(kept.bytes)) {
                if let Some(byte) = machine.peek("eeprom", cell.into()) {
                    self.eval.set_eeprom(cell.into(), byte);
                }
            }
        }
        let flag = self.facts.byte_flag.filter(|_| !self.facts.received_symbols.is_empty());
        self.byte_received = flag.is_some_and(|(addr, bit)| {
            machine.peek(self.facts.chip.reg_space, addr.into()).is_some_and(|value| value & bit != 0)
        });
        self.latch_cycle = Some(if self.facts.latches_itself { self.start_cycle } else { machine.cycle() });
    }

    /// Runs the current scan, with external values taken from the chip.
    ///
    /// These are the results of the converter and received bytes. A byte is detected by its flag, or, if it
    /// arrived later, by the changed value of its symbol.
    fn run_scan(&self, eval: &mut Evaluator, cycle: u64, machine: &dyn DynMachine) -> FollowedScan {
        let value = |symbol: usize| self.facts.chip_value(symbol, machine);
        let start: Vec<i32> = (0..self.facts.places.len()).map(|symbol| eval.get(symbol)).collect();
        for symbol in eval.adc_symbols().collect::<Vec<usize>>() {
            eval.set_adc(symbol, value(symbol).clamp(0, 1023) as u16);
        }
        for &symbol in &self.facts.bus_symbols {
            eval.set_bus_answer(value(symbol) as u8);
        }
        let came =
            |symbol: &usize| self.byte_received || start.get(*symbol).is_some_and(|start| *start != value(*symbol));
        let mut with_byte = eval.clone();
        for &symbol in self.facts.received_symbols.iter().filter(|symbol| came(symbol)) {
            with_byte.receive(value(symbol) as u8);
        }
        let trace = self.trace_scan(&mut with_byte);
        // A byte that no element has taken waits on the chip, where its value is known.
        let trace = if with_byte.has_received_byte() {
            self.trace_scan(eval)
        } else {
            *eval = with_byte;
            trace
        };
        let after = (0..start.len()).map(|symbol| eval.get(symbol)).collect();
        let old =
            self.last_scan.as_ref().map_or_else(|| self.facts.initial_values.clone(), |past| past.values_after.clone());
        FollowedScan {
            number: self.scans_begun,
            cycle,
            previous_values: old,
            values_before: start,
            values_after: after,
            trace,
        }
    }

    /// Runs a scan and returns what its elements did.
    fn trace_scan(&self, eval: &mut Evaluator) -> ScanTrace {
        let mut power = Vec::with_capacity(self.last_scan.as_ref().map_or(0, |scan| scan.trace.power.len()));
        let mut writes = Vec::with_capacity(self.facts.writes.len());
        let mut written = self.facts.writes.iter().peekable();
        let is_jumping = self.facts.has_jumps;
        let write = |values: &[i32], &(element, symbol): &(ElementId, u32)| SymbolWrite {
            element,
            symbol,
            value: values.get(symbol as usize).copied().unwrap_or(0),
        };
        eval.scan_traced(|id, before, after, values| {
            power.push((id, ElementPower { before, after }));
            if is_jumping {
                let own = self.facts.writes.iter().filter(|row| row.0 == id);
                writes.extend(own.map(|row| write(values, row)));
                return;
            }
            while let Some(row) = written.next_if(|row| row.0 <= id) {
                writes.push(write(values, row));
            }
        });
        if is_jumping {
            // What a scan executes several times is shown as it was last; what it left out is not shown.
            power.reverse();
            power.sort_by_key(|row| row.0);
            power.dedup_by_key(|row| row.0);
            writes.reverse();
            writes.sort_by_key(|write: &SymbolWrite| (write.element, write.symbol));
            writes.dedup_by_key(|write| (write.element, write.symbol));
        }
        ScanTrace { power, writes }
    }

    /// Ends the current scan and records it.
    fn end_scan(&mut self, machine: &dyn DynMachine) {
        let Some(cycle) = self.latch_cycle.take() else { return };
        let mut eval = self.eval.clone();
        let scan = Arc::new(self.run_scan(&mut eval, cycle, machine));
        self.eval = eval;
        self.last_scan = Some(scan.clone());
        for (_, changes) in self.changes.iter_mut().enumerate().filter(|(symbol, _)| scan.has_changed(*symbol, None)) {
            if changes.len() == KEPT_CHANGES {
                changes.pop_front();
            }
            changes.push_back(scan.clone());
        }
    }
}

impl ProgramFollower for ScanFollower {
    fn followed_words(&self) -> &[u32] {
        &self.facts.follow_words
    }

    fn on_reached(&mut self, machine: &dyn DynMachine, pc: u32) {
        if pc == self.facts.scan_start {
            self.end_scan(machine);
            self.scans_begun += 1;
            self.start_cycle = machine.cycle();
        } else if pc == RESET_WORD {
            self.on_power_cycle();
        }
        if pc == self.facts.latched {
            self.latch_inputs(machine);
        }
    }

    /// Restarts everything except the count of scans.
    fn on_power_cycle(&mut self) {
        *self = ScanFollower {
            scans_begun: self.scans_begun,
            scans_before: self.scans_begun,
            ..ScanFollower::new(self.facts.clone())
        };
    }

    fn scan(&self) -> Option<u64> {
        Some(self.scans_begun)
    }

    fn fork(&self) -> Box<dyn ProgramFollower> {
        Box::new(self.clone())
    }

    fn size_in_bytes(&self) -> usize {
        // Copies share scans; each symbol's changes are counted as if they belonged to this copy.
        let symbols = self.changes.len();
        let scan = size_of::<FollowedScan>() + 12 * (symbols + self.facts.writes.len() + self.facts.map.elements.len());
        size_of::<ScanFollower>() + symbols * (size_of::<VecDeque<Arc<FollowedScan>>>() + 8 * KEPT_CHANGES + 8) + scan
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
