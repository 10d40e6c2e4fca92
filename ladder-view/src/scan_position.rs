//! Where in a scan a chip stands, and which record tells of what it has done so far.

use std::collections::BTreeSet;
use std::sync::Arc;

use emu_core::chip::ChipFamily;
use emu_debug::debug::{DynMachine, ObserveLevel, ProgramFollower};
use ladder::ElementId;

use crate::LadderView;
use crate::scan_follower::{FollowedScan, ScanFollower};

/// Steps of a routine that an element calls, at most.
const MAX_ROUTINE_STEPS: u32 = 4096;

/// A chip somewhere in a scan. The rungs that it has not come to yet are as the scan before left them.
pub struct ScanPosition {
    /// The scan that is under way.
    pub(crate) current_scan: Option<Arc<FollowedScan>>,
    /// The last scan that is over.
    pub(crate) last_scan: Option<Arc<FollowedScan>>,
    /// The element that is carried out or next; nothing between the rungs of two scans.
    pub(crate) current_element: Option<ElementId>,
}

impl ScanPosition {
    /// The element that is carried out or next; nothing between the rungs of two scans.
    #[must_use]
    pub fn current_element(&self) -> Option<ElementId> {
        self.current_element
    }

    /// Whether power came into an element when it ran last, and went out of it. Of the rung that is carried out only what has run in
    /// this scan is told. Nothing before the first scan, and for comments.
    #[must_use]
    pub fn power(&self, id: ElementId) -> Option<(bool, bool)> {
        let scan = match (&self.current_scan, self.current_element) {
            (Some(_), Some(here)) if id.rung > here.rung => self.last_scan.as_ref(),
            (Some(_), Some(here)) if id.rung == here.rung && id >= here => None,
            (Some(begun), _) => Some(begun),
            (None, _) => self.last_scan.as_ref(),
        };
        scan?.power(id)
    }

    /// Whether power has come into the element that is carried out or next.
    #[must_use]
    pub fn is_powered_here(&self) -> bool {
        let power = self.current_element.and_then(|here| self.current_scan.as_ref()?.power(here));
        power.is_some_and(|power| power.0)
    }
}

impl LadderView {
    /// Where in a scan the chip stands.
    #[must_use]
    pub fn scan_position(&self, follow: Option<&dyn ProgramFollower>, target: &dyn DynMachine) -> ScanPosition {
        let follower = follow.and_then(ScanFollower::from_dyn);
        ScanPosition {
            current_scan: follower.and_then(|follower| follower.current_scan(target)),
            last_scan: follower.and_then(|follower| follower.last_scan.clone()),
            current_element: self.element_at(self.current_word(target)),
        }
    }

    /// The program word that tells where in the program the chip stands: the next instruction, and in a routine the end of the call that
    /// led there.
    #[must_use]
    pub fn current_word(&self, target: &dyn DynMachine) -> u32 {
        let (word, end) = (target.pc(), self.word(self.facts.map.scan_end));
        if word <= end || self.facts.chip.family == ChipFamily::Ap101 {
            return word;
        }
        let mut copy = target.fork();
        copy.set_breakpoints(&BTreeSet::new());
        for _ in 0..MAX_ROUTINE_STEPS {
            copy.step(ObserveLevel::Nothing, &mut ());
            if copy.pc() <= end {
                // Behind a call, which may be the last thing that an element does.
                return copy.pc().saturating_sub(1);
            }
        }
        word
    }
}
