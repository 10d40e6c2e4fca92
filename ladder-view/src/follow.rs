//! Scan by scan: the evaluator beside the chip, and what it told.

use std::any::Any;
use std::collections::VecDeque;
use std::sync::Arc;

use emu_debug::debug::{Follow, Target};
use ladder::ElementId;
use ladder_eval::Evaluator;

use crate::Facts;

/// Changes of each symbol that are remembered, the newest.
const CHANGES: usize = 4;

/// One scan as the evaluator ran it on the values of the chip.
#[derive(Debug)]
pub(crate) struct Scan {
    /// Its number, from 1.
    pub number: u64,
    /// Machine cycle at which its inputs were latched.
    pub cycle: u64,
    /// Values of all symbols before the first rung, in the evaluator's order.
    pub before: Vec<i32>,
    /// And behind the last.
    pub after: Vec<i32>,
    /// Rung bit before and behind each element, in text order; comments are not among them.
    pub power: Vec<(ElementId, bool, bool)>,
}

impl Scan {
    /// The rung bit before and behind an element.
    pub fn power(&self, id: ElementId) -> Option<(bool, bool)> {
        let at = self.power.binary_search_by_key(&id, |row| row.0).ok()?;
        self.power.get(at).map(|row| (row.1, row.2))
    }
}

/// Follows a program.
#[derive(Debug, Clone)]
pub(crate) struct Follower {
    facts: Arc<Facts>,
    eval: Evaluator,
    /// Scans begun.
    scans: u64,
    /// The scan whose inputs were latched last.
    pub now: Option<Arc<Scan>>,
    /// For each symbol the scans in which it got another value than it had in the scan before, the newest last: of an input at
    /// their start, of all else in their course.
    pub changes: Vec<VecDeque<Arc<Scan>>>,
}

impl Follower {
    pub fn new(facts: Arc<Facts>) -> Follower {
        let changes = vec![VecDeque::new(); facts.places.len()];
        Follower { eval: facts.start.clone(), facts, scans: 0, now: None, changes }
    }

    /// The follower behind the face that a session shows.
    pub fn of(follow: &dyn Follow) -> Option<&Follower> {
        follow.as_any().downcast_ref()
    }

    /// Inputs are latched: the scan is run beside the chip.
    fn latch(&mut self, target: &dyn Target) {
        let value = |place: &emu_debug::debug::Place| place.value(target).unwrap_or(0) as i32;
        let before: Vec<i32> = self.facts.places.iter().map(value).collect();
        for (symbol, value) in before.iter().enumerate() {
            self.eval.set(symbol, *value);
        }
        let mut power = Vec::with_capacity(self.now.as_ref().map_or(0, |scan| scan.power.len()));
        self.eval.scan_watched(&mut |id, before, behind| power.push((id, before, behind)));
        let after = (0..before.len()).map(|symbol| self.eval.get(symbol)).collect();
        let scan = Arc::new(Scan { number: self.scans, cycle: target.cycle(), before, after, power });
        let old = self.now.replace(scan.clone());
        for (symbol, changes) in self.changes.iter_mut().enumerate() {
            let was = old.as_ref().map_or(Some(&0), |old| old.after.get(symbol));
            if scan.after.get(symbol) != was {
                if changes.len() == CHANGES {
                    changes.pop_front();
                }
                changes.push_back(scan.clone());
            }
        }
    }
}

impl Follow for Follower {
    fn stops(&self) -> &[u32] {
        &self.facts.stops
    }

    fn at(&mut self, target: &dyn Target, pc: u32) {
        if pc == self.facts.scan_start {
            self.scans += 1;
        }
        if pc == self.facts.latched {
            self.latch(target);
        }
    }

    fn scan(&self) -> Option<u64> {
        Some(self.scans)
    }

    fn fork(&self) -> Box<dyn Follow> {
        Box::new(self.clone())
    }

    fn weight(&self) -> usize {
        // Scans are shared between copies; each symbol's changes are counted as if they were this copy's own.
        let symbols = self.changes.len();
        let scan = size_of::<Scan>() + 8 * symbols + 12 * self.now.as_ref().map_or(0, |scan| scan.power.len());
        size_of::<Follower>() + symbols * (size_of::<VecDeque<Arc<Scan>>>() + 8 * CHANGES + 8) + scan
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
