//! The log of chip events that can be reported.

use std::collections::VecDeque;

use emu_core::cpu::ResetCause;
use emu_core::pins::ChipEvent;

use super::session::DebugSession;

/// Maximum number of edges that are kept, and of all other events: the newest.
const MAX_EVENTS: usize = 1 << 16;

/// Events of the chip, in order of time. Edges are stored apart, because many of them must not displace other
/// events.
#[derive(Debug, Clone, Default)]
pub(super) struct SessionEvents {
    edges: VecDeque<ChipEvent>,
    others: VecDeque<ChipEvent>,
}

impl SessionEvents {
    /// Adds an event, and drops the oldest one of its kind (edge or other) if the log is full.
    pub fn push(&mut self, event: ChipEvent) {
        let kept = if matches!(event, ChipEvent::Edge { .. }) { &mut self.edges } else { &mut self.others };
        if kept.len() == MAX_EVENTS {
            kept.pop_front();
        }
        kept.push_back(event);
    }

    /// Forgets the events after the machine cycle `now`.
    pub fn forget_after(&mut self, now: u64) {
        for kept in [&mut self.edges, &mut self.others] {
            while kept.back().is_some_and(|event| event.time().cycle > now) {
                kept.pop_back();
            }
        }
    }
}

impl DebugSession {
    /// Returns the newest events up to now except edges, in order of time.
    pub fn events(&self) -> impl DoubleEndedIterator<Item = &ChipEvent> {
        self.chip_events.others.iter()
    }

    /// Returns the newest pin edges up to now, in order of time.
    pub fn edges(&self) -> impl DoubleEndedIterator<Item = &ChipEvent> {
        self.chip_events.edges.iter()
    }

    /// Describes resets after the machine cycle `cycle`: `reset by its watchdog (3 times)`. A reset by the
    /// user occurs in the cycle at which the machine is stopped, so a query from that cycle on does not
    /// include it.
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
        let causes = CAUSES.iter().filter_map(|(why, name)| match count(*why) {
            0 => None,
            1 => Some((*name).to_owned()),
            n => Some(format!("{name} ({n} times)")),
        });
        let causes: Vec<String> = causes.collect();
        (!causes.is_empty()).then(|| format!("reset by {}", causes.join(" and ")))
    }
}
