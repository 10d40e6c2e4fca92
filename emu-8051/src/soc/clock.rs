//! The clock output of timer 2 on its pin (AT89S52 data sheet, "Programmable clock out").
//!
//! The output can toggle in each of the six states of a cycle. All toggles of a cycle are applied to the pin
//! at once, including that of S6, which the timer itself counts only after the reads of the program in that
//! cycle.

use emu_core::NEVER;

use super::Mcs51Soc;
use crate::periph::map::pin;

impl Mcs51Soc {
    /// Applies the toggles up to the end of cycle `t` to the pin.
    pub(super) fn clock_out(&mut self, t: u64) {
        while let Some((state, high)) = self.next_toggle().filter(|(state, _)| state / 6 <= t) {
            self.toggles_shown += 1;
            self.drive_clock_pin(high, state / 6, (state % 6 * 2) as u8);
        }
    }

    /// Updates the clock output after a write at the end of cycle `t`.
    pub(super) fn on_clock_control_written(&mut self, t: u64) {
        let Some(timer2) = &self.timer2 else { return };
        self.toggles_shown = timer2.overflows();
        let high = timer2.clock_out() != Some(false);
        self.drive_clock_pin(high, t + 1, 0);
    }

    /// The state of the next toggle that is not on the pin yet, and the level after it.
    pub(super) fn next_toggle(&self) -> Option<(u64, bool)> {
        let timer2 = self.timer2.as_ref()?;
        let high = timer2.clock_out()?;
        let next = self.toggles_shown + 1;
        let ahead = next.saturating_sub(timer2.overflows());
        Some((timer2.state_of_overflow(next), high ^ (ahead & 1 != 0))).filter(|&(state, _)| state != NEVER)
    }

    fn drive_clock_pin(&mut self, high: bool, t: u64, phase: u8) {
        if self.ports.t2_low == high {
            self.ports.t2_low = !high;
            self.update_pin(pin::T2, t, phase);
        }
    }
}
