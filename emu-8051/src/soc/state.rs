//! The chip around the core as a state ([`emu_core::state`]).

use emu_core::NEVER;
use emu_core::outside::Log;
use emu_core::state::{Damaged, State, Tape};

use super::Soc;
use crate::chips;

impl State for Soc {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let machine = tape.now();
        // What is due follows from the rest; what the core was told last it is told again.
        #[rustfmt::skip]
        let Soc {
            part, readings: _, clocks_per_cycle: _, shows_bus: _, log: _, deadline: _, told: _, ports, timers, timer2, toggled, serial,
            baud, interrupts, power, watchdog, pcon, auxr, frozen, sampled, edges, drives, synced, irq_at, sample_at,
        } = self;
        frozen.state(tape)?;
        power.state(tape)?;
        // A hand that sets PD between two instructions stops the oscillator at the end of the cycle that is
        // to come.
        tape.demand(*frozen <= machine && power.stopped_at(machine) <= machine + 1)?;
        tape.set_now(power.stopped_at(machine).saturating_sub(*frozen));
        ports.state(tape)?;
        timers.state(tape)?;
        timer2.state(tape)?;
        tape.demand(timer2.is_some() == (part.timer2 != chips::Timer2::None))?;
        toggled.state(tape)?;
        serial.state(tape)?;
        baud.state(tape)?;
        interrupts.state(tape)?;
        watchdog.state(tape)?;
        pcon.state(tape)?;
        auxr.state(tape)?;
        sampled.state(tape)?;
        edges.state(tape)?;
        drives.state(tape)?;
        synced.state(tape)?;
        irq_at.state(tape)?;
        sample_at.state(tape)?;
        tape.demand(*toggled != NEVER && *synced <= tape.now())?;
        if tape.reads() {
            (self.log, self.told) = (Log::OFF, 0);
            self.schedule();
            tape.demand(self.due() > machine)?;
        }
        Ok(())
    }
}

impl Soc {
    /// Does everything up to the machine cycle `now`, also what nobody waits for, so that machines that are equal look so.
    pub(crate) fn settle_down(&mut self, now: u64) {
        self.log = Log::OFF;
        self.run(now);
        let t = self.inner(now);
        let before = t.saturating_sub(1);
        if self.synced < before {
            self.sync(before);
        }
        self.pass_ticks(before);
        self.timers.settle_down(t);
        if let Some(timer2) = &mut self.timer2 {
            timer2.settle_down(t);
        }
        self.schedule();
    }
}
