//! Where in a scan a chip stands, and which record tells of what it has done so far.

use std::collections::BTreeSet;
use std::sync::Arc;

use emu_core::chip::Family;
use emu_debug::debug::{Follow, Look, Target};
use ladder::ElementId;

use crate::View;
use crate::follow::{Follower, Scan};

/// Steps of a routine that an element calls, at most.
const ROUTINE: u32 = 4096;

/// A chip somewhere in a scan. The rungs that it has not come to yet are as the scan before left them.
pub struct Moment {
    /// The scan that is under way.
    pub(crate) begun: Option<Arc<Scan>>,
    /// The last scan that is over.
    pub(crate) past: Option<Arc<Scan>>,
    /// The element that is carried out or next; nothing between the rungs of two scans.
    pub(crate) here: Option<ElementId>,
}

impl Moment {
    /// The element that is carried out or next; nothing between the rungs of two scans.
    #[must_use]
    pub fn here(&self) -> Option<ElementId> {
        self.here
    }

    /// Whether power came into an element when it ran last, and went out of it. Of the rung that is carried out only what has run in
    /// this scan is told. Nothing before the first scan, and for comments.
    #[must_use]
    pub fn power(&self, id: ElementId) -> Option<(bool, bool)> {
        let scan = match (&self.begun, self.here) {
            (Some(_), Some(here)) if id.rung > here.rung => self.past.as_ref(),
            (Some(_), Some(here)) if id.rung == here.rung && id >= here => None,
            (Some(begun), _) => Some(begun),
            (None, _) => self.past.as_ref(),
        };
        scan?.power(id)
    }

    /// Whether power has come into the element that is carried out or next.
    #[must_use]
    pub fn came(&self) -> bool {
        let power = self.here.and_then(|here| self.begun.as_ref()?.power(here));
        power.is_some_and(|power| power.0)
    }
}

impl View {
    /// Where in a scan the chip stands.
    #[must_use]
    pub fn moment(&self, follow: Option<&dyn Follow>, target: &dyn Target) -> Moment {
        let follower = follow.and_then(Follower::of);
        Moment {
            begun: follower.and_then(|follower| follower.begun(target)),
            past: follower.and_then(|follower| follower.past.clone()),
            here: self.element_at(self.word_of(target)),
        }
    }

    /// The program word that tells where in the program the chip stands: the next instruction, and in a routine the end of the call that
    /// led there.
    #[must_use]
    pub fn word_of(&self, target: &dyn Target) -> u32 {
        let (word, end) = (target.pc(), self.word(self.facts.map.scan_end));
        if word <= end || self.facts.chip.family == Family::Ap101 {
            return word;
        }
        let mut copy = target.fork();
        copy.set_traps(&BTreeSet::new());
        for _ in 0..ROUTINE {
            copy.step(Look::Nothing, &mut ());
            if copy.pc() <= end {
                // Behind a call, which may be the last thing that an element does.
                return copy.pc().saturating_sub(1);
            }
        }
        word
    }
}
