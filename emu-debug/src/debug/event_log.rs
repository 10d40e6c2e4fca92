//! What the chip has done that can be told.

use std::collections::VecDeque;

use emu_core::cpu::ResetCause;
use emu_core::pins::ChipEvent;

use super::session::DebugSession;

/// Edges that are kept, and as many of all else: the newest.
const MAX_EVENTS: usize = 1 << 16;

/// What left the chip, in order of time. Edges, of which there may be many, drive nothing else out.
#[derive(Debug, Clone, Default)]
pub(super) struct SessionEvents {
    edges: VecDeque<ChipEvent>,
    others: VecDeque<ChipEvent>,
}

impl SessionEvents {
    pub fn push(&mut self, event: ChipEvent) {
        let kept = if matches!(event, ChipEvent::Edge { .. }) { &mut self.edges } else { &mut self.others };
        if kept.len() == MAX_EVENTS {
            kept.pop_front();
        }
        kept.push_back(event);
    }

    /// Forgets what lies behind a cycle.
    pub fn forget_after(&mut self, now: u64) {
        for kept in [&mut self.edges, &mut self.others] {
            while kept.back().is_some_and(|event| event.time().cycle > now) {
                kept.pop_back();
            }
        }
    }
}

impl DebugSession {
    /// What left the chip up to now besides edges, in order of time: the newest of it.
    pub fn events(&self) -> impl DoubleEndedIterator<Item = &ChipEvent> {
        self.events.others.iter()
    }

    /// How its pins moved up to now, in order of time: the newest of it.
    pub fn edges(&self) -> impl DoubleEndedIterator<Item = &ChipEvent> {
        self.events.edges.iter()
    }

    /// Resets behind the machine cycle `cycle`: `reset by its watchdog (3 times)`. One that a user makes falls into the cycle in which the
    /// machine stands, and so is none of these when that is asked for.
    #[must_use]
    pub fn resets_since(&self, cycle: u64) -> Option<String> {
        const CAUSES: [(ResetCause, &str); 4] = [
            (ResetCause::PowerOn, "its supply"),
            (ResetCause::BrownOut, "its brown-out detector"),
            (ResetCause::External, "its reset pin"),
            (ResetCause::Watchdog, "its watchdog"),
        ];
        let count = |wanted: ResetCause| {
            let fresh = self.events().rev().take_while(|event| event.time().cycle > cycle);
            fresh.filter(|event| matches!(event, ChipEvent::Reset { cause, .. } if *cause == wanted)).count()
        };
        let told = CAUSES.iter().filter_map(|(why, name)| match count(*why) {
            0 => None,
            1 => Some((*name).to_owned()),
            n => Some(format!("{name} ({n} times)")),
        });
        let told: Vec<String> = told.collect();
        (!told.is_empty()).then(|| format!("reset by {}", told.join(" and ")))
    }
}
