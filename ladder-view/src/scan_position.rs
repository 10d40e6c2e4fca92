//! Finds where in a scan a chip is, and the record that shows what it has done so far.

use std::collections::BTreeSet;
use std::sync::Arc;

use emu_debug::debug::{DynMachine, ObserveLevel, ProgramFollower};
use ladder::ElementId;
use ladder_eval::ElementPower;

use crate::LadderView;
use crate::scan_follower::{FollowedScan, ScanFollower};

/// Maximum number of steps in a routine that an element calls.
const MAX_ROUTINE_STEPS: u32 = 4096;

/// Position of a chip in a scan. Rungs that it has not reached yet show the previous scan.
pub struct ScanPosition {
    /// Scan in progress.
    pub(crate) current_scan: Option<Arc<FollowedScan>>,
    /// Last complete scan.
    pub(crate) last_scan: Option<Arc<FollowedScan>>,
    /// Element that is being executed or is next; `None` between the rungs of two scans.
    pub(crate) current_element: Option<ElementId>,
}

impl ScanPosition {
    /// Element that is being executed or is next; `None` between the rungs of two scans.
    #[must_use]
    pub fn current_element(&self) -> Option<ElementId> {
        self.current_element
    }

    /// Whether power entered and left an element when it ran last.
    ///
    /// In the current rung, only elements that have run in this scan have a value. `None` before the first
    /// scan, and for comments.
    #[must_use]
    pub fn power(&self, id: ElementId) -> Option<ElementPower> {
        let scan = match (&self.current_scan, self.current_element) {
            (Some(_), Some(here)) if id.rung > here.rung => self.last_scan.as_ref(),
            (Some(_), Some(here)) if id.rung == here.rung && id >= here => None,
            (Some(begun), _) => Some(begun),
            (None, _) => self.last_scan.as_ref(),
        };
        scan?.power(id)
    }

    /// True if power has reached the element that is being executed or is next.
    #[must_use]
    pub fn is_powered_here(&self) -> bool {
        let power = self.current_element.and_then(|here| self.current_scan.as_ref()?.power(here));
        power.is_some_and(|power| power.before)
    }
}

impl LadderView {
    /// Finds where in a scan the chip is.
    #[must_use]
    pub fn scan_position(&self, follow: Option<&dyn ProgramFollower>, machine: &dyn DynMachine) -> ScanPosition {
        let follower = follow.and_then(ScanFollower::from_dyn);
        ScanPosition {
            current_scan: follower.and_then(|follower| follower.current_scan(machine)),
            last_scan: follower.and_then(|follower| follower.last_scan.clone()),
            current_element: self.element_at(self.current_word(machine)),
        }
    }

    /// Program word that identifies the position in the program: the next instruction, or inside a routine
    /// the end of the call that led there.
    #[must_use]
    pub fn current_word(&self, machine: &dyn DynMachine) -> u32 {
        let (word, end) = (machine.pc(), self.word(self.facts.map.scan_end));
        if word <= end || self.facts.chip.is_bit_controller() {
            return word;
        }
        let mut copy = machine.fork();
        copy.set_breakpoints(&BTreeSet::new());
        for _ in 0..MAX_ROUTINE_STEPS {
            copy.step(ObserveLevel::Nothing, &mut ());
            if copy.pc() <= end {
                // The word after a call may belong to the next element, because a call can be the last
                // instruction of an element.
                return copy.pc().saturating_sub(1);
            }
        }
        word
    }
}
