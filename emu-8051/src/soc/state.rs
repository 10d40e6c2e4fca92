//! Saves and restores the chip around the core ([`emu_core::state`]).

use emu_core::external_io::EventLog;
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

use super::Mcs51Soc;
use crate::chips;

impl SnapshotState for Mcs51Soc {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let machine = tape.now();
        // Deadlines follow from the other fields; the core asks for its deadline again.
        #[rustfmt::skip]
        let Mcs51Soc {
            part, readings: _, clocks_per_cycle: _, logs_bus: _, log: _, schedule: _, out: _, core_deadline: _, ports, timers, timer2, serial,
            interrupts, power, watchdog, pcon, auxr, stopped_cycles: frozen, sampled_levels: sampled, edges, drives, timers_synced_to: synced, next_interrupt_boundary: irq_at, sample_at,
        } = self;
        frozen.pass_state(tape)?;
        power.pass_state(tape)?;
        // A user who sets PD between two instructions stops the oscillator at the end of the next cycle.
        tape.require(*frozen <= machine && power.stopped_at(machine) <= machine + 1)?;
        tape.set_now(power.stopped_at(machine).saturating_sub(*frozen));
        ports.pass_state(tape)?;
        timers.pass_state(tape)?;
        if part.timer2 != chips::Timer2Kind::None {
            timer2.pass_state(tape)?;
        }
        serial.pass_state(tape)?;
        interrupts.pass_state(tape)?;
        watchdog.pass_state(tape)?;
        pcon.pass_state(tape)?;
        auxr.pass_state(tape)?;
        sampled.pass_state(tape)?;
        edges.pass_state(tape)?;
        drives.pass_state(tape)?;
        synced.pass_state(tape)?;
        irq_at.pass_state(tape)?;
        sample_at.pass_state(tape)?;
        tape.require(*synced <= tape.now())?;
        if tape.is_reading() {
            (self.log, self.core_deadline) = (EventLog::OFF, 0);
            tape.require(self.timers.is_sound() && self.timer2.is_sound())?;
            self.serial.restore_clocks(self.baud_clocks());
            self.schedule.touch_all();
            self.update_deadline();
            tape.require(self.next_due() > machine)?;
        }
        Ok(())
    }
}
