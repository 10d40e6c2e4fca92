//! What the chip has done that can be told in words.

use emu_core::cpu::Reset;
use emu_core::pins::Event;

use super::session::Session;

impl Session {
    /// What left the chip and moved at its pins up to now, in order of time: the newest of it.
    pub fn events(&self) -> impl DoubleEndedIterator<Item = &Event> {
        self.events.iter()
    }

    /// Resets behind the machine cycle `cycle`: `reset by its watchdog (3 times)`. One that a user makes falls into the cycle in which the
    /// machine stands, and so is none of these when that is asked for.
    #[must_use]
    pub fn resets_since(&self, cycle: u64) -> Option<String> {
        const CAUSES: [(Reset, &str); 4] = [
            (Reset::PowerOn, "its supply"),
            (Reset::BrownOut, "its brown-out detector"),
            (Reset::External, "its reset pin"),
            (Reset::Watchdog, "its watchdog"),
        ];
        let count = |wanted: Reset| {
            let fresh = self.events().rev().take_while(|event| event.at().cycle > cycle);
            fresh.filter(|event| matches!(event, Event::Reset { why, .. } if *why == wanted)).count()
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
