//! Scan by scan: the evaluator beside the chip, and what it told.

use std::any::Any;
use std::collections::VecDeque;
use std::sync::Arc;

use emu_debug::debug::{DynMachine, ProgramFollower};
use ladder::ElementId;
use ladder_eval::Evaluator;

use crate::{ProgramFacts, RESET_WORD};

/// Changes of each symbol that are remembered, the newest.
const KEPT_CHANGES: usize = 4;

/// Rung bits before and behind elements, and what elements left in symbols.
type ScanTrace = (Vec<(ElementId, bool, bool)>, Vec<(ElementId, u32, i32)>);

/// One scan as the evaluator ran it on the values of the chip.
#[derive(Debug)]
pub(crate) struct FollowedScan {
    /// Its number, from 1.
    pub number: u64,
    /// Machine cycle at which its inputs were latched.
    pub cycle: u64,
    /// Values of all symbols behind the scan before, in the evaluator's order.
    pub previous_values: Vec<i32>,
    /// Before the first rung.
    pub values_before: Vec<i32>,
    /// And behind the last.
    pub values_after: Vec<i32>,
    /// Rung bit before and behind each element, in text order; comments are not among them.
    power: Vec<(ElementId, bool, bool)>,
    /// What elements that write symbols left there, in text order.
    writes: Vec<(ElementId, u32, i32)>,
}

impl FollowedScan {
    /// The rung bit before and behind an element.
    pub(crate) fn power(&self, id: ElementId) -> Option<(bool, bool)> {
        let at = self.power.binary_search_by_key(&id, |row| row.0).ok()?;
        self.power.get(at).map(|row| (row.1, row.2))
    }

    /// The value of a symbol when the scan comes to the element `to`; behind the last rung without one.
    pub(crate) fn value(&self, symbol: usize, to: Option<ElementId>) -> i32 {
        let Some(to) = to else { return self.values_after.get(symbol).copied().unwrap_or(0) };
        let earlier = self.writes.partition_point(|write| write.0 < to);
        let last = self.writes.iter().take(earlier).rev().find(|write| write.1 as usize == symbol);
        last.map_or_else(|| self.values_before.get(symbol).copied().unwrap_or(0), |write| write.2)
    }

    /// When this scan comes to the element `to`, a symbol has another value than the scan before left it.
    pub(crate) fn has_changed(&self, symbol: usize, to: Option<ElementId>) -> bool {
        self.previous_values.get(symbol) != Some(&self.value(symbol, to))
    }
}

/// Follows a program.
#[derive(Debug, Clone)]
pub(crate) struct ScanFollower {
    facts: Arc<ProgramFacts>,
    /// As it stands before the scan that is under way, or behind the last one.
    eval: Evaluator,
    /// Scans begun.
    scans_begun: u64,
    /// Scans begun before the chip was reset.
    pub scans_before: u64,
    /// Machine cycle at which the inputs of the scan that is under way were latched.
    latch_cycle: Option<u64>,
    /// Machine cycle at which that scan began.
    start_cycle: u64,
    /// A byte had come on the serial line when they were latched.
    byte_received: bool,
    /// The last scan that is over.
    pub last_scan: Option<Arc<FollowedScan>>,
    /// For each symbol the scans that are over in which it got another value than it had in the scan before, the newest last: of an
    /// input at their start, of all else in their course.
    pub changes: Vec<VecDeque<Arc<FollowedScan>>>,
}

impl ScanFollower {
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

    /// The follower behind the face that a session shows.
    pub(crate) fn from_dyn(follow: &dyn ProgramFollower) -> Option<&ScanFollower> {
        follow.as_any().downcast_ref()
    }

    /// The scan whose inputs were latched last, if it is under way: what its rungs make of them.
    pub(crate) fn current_scan(&self, target: &dyn DynMachine) -> Option<Arc<FollowedScan>> {
        let cycle = self.latch_cycle?;
        Some(Arc::new(self.run_scan(&mut self.eval.clone(), cycle, target)))
    }

    /// Inputs are latched: the evaluator gets the values of the chip.
    fn latch_inputs(&mut self, target: &dyn DynMachine) {
        for (symbol, place) in self.facts.places.iter().enumerate() {
            self.eval.set(symbol, place.value(target).unwrap_or(0) as i32);
        }
        if self.last_scan.is_none() {
            // What it was switched on with.
            for cell in self.facts.map.eeprom.iter().flat_map(|kept| kept.addr..kept.addr + u16::from(kept.bytes)) {
                if let Some(byte) = target.peek("eeprom", cell.into()) {
                    self.eval.set_eeprom(cell.into(), byte);
                }
            }
        }
        let flag = self.facts.byte_flag.filter(|_| !self.facts.received_symbols.is_empty());
        self.byte_received = flag.is_some_and(|(addr, bit)| {
            target.peek(self.facts.chip.reg_space, addr.into()).is_some_and(|value| value & bit != 0)
        });
        self.latch_cycle = Some(if self.facts.latches_itself { self.start_cycle } else { target.cycle() });
    }

    /// Runs the scan that is under way. What came from outside in its course is taken from the chip: the values of its converter, and
    /// bytes, which are known by their flag, and one that came later by the value that it has changed.
    fn run_scan(&self, eval: &mut Evaluator, cycle: u64, target: &dyn DynMachine) -> FollowedScan {
        let value = |symbol: usize| self.facts.places.get(symbol).and_then(|place| place.value(target)).unwrap_or(0);
        let start: Vec<i32> = (0..self.facts.places.len()).map(|symbol| eval.get(symbol)).collect();
        for symbol in eval.adc_symbols().collect::<Vec<usize>>() {
            eval.set_adc(symbol, value(symbol).clamp(0, 1023) as u16);
        }
        let came = |symbol: &usize| {
            self.byte_received || start.get(*symbol).is_some_and(|start| i64::from(*start) != value(*symbol))
        };
        let mut with_byte = eval.clone();
        for &symbol in self.facts.received_symbols.iter().filter(|symbol| came(symbol)) {
            with_byte.receive(value(symbol) as u8);
        }
        let trace = self.trace_scan(&mut with_byte);
        // A byte that no element has taken waits on the chip, where its value is known.
        let (power, writes) = if with_byte.has_received_byte() {
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
            power,
            writes,
        }
    }

    /// Runs a scan, and gives [`FollowedScan::power`] and [`FollowedScan::writes`].
    fn trace_scan(&self, eval: &mut Evaluator) -> ScanTrace {
        let mut power = Vec::with_capacity(self.last_scan.as_ref().map_or(0, |scan| scan.power.len()));
        let mut writes = Vec::with_capacity(self.facts.writes.len());
        let mut written = self.facts.writes.iter().peekable();
        eval.scan_traced(|id, before, behind, values| {
            power.push((id, before, behind));
            while let Some((id, symbol)) = written.next_if(|row| row.0 <= id) {
                writes.push((*id, *symbol, values.get(*symbol as usize).copied().unwrap_or(0)));
            }
        });
        (power, writes)
    }

    /// The scan that was under way is over.
    fn end_scan(&mut self, target: &dyn DynMachine) {
        let Some(cycle) = self.latch_cycle.take() else { return };
        let mut eval = self.eval.clone();
        let scan = Arc::new(self.run_scan(&mut eval, cycle, target));
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

    fn on_reached(&mut self, target: &dyn DynMachine, pc: u32) {
        if pc == self.facts.scan_start {
            self.end_scan(target);
            self.scans_begun += 1;
            self.start_cycle = target.cycle();
        } else if pc == RESET_WORD {
            self.on_power_cycle();
        }
        if pc == self.facts.latched {
            self.latch_inputs(target);
        }
    }

    /// Everything begins anew but the count of scans.
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
        // Scans are shared between copies; each symbol's changes are counted as if they were this copy's own.
        let symbols = self.changes.len();
        let scan = size_of::<FollowedScan>() + 12 * (symbols + self.facts.writes.len() + self.facts.map.elements.len());
        size_of::<ScanFollower>() + symbols * (size_of::<VecDeque<Arc<FollowedScan>>>() + 8 * KEPT_CHANGES + 8) + scan
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
