//! The chip around the core as snapshot state ([`emu_core::state`]).

use emu_core::cpu::NEVER;
use emu_core::external_io::EventLog;
use emu_core::state::{SnapshotDamaged, SnapshotState, StateTape};

use super::{CoreRequest, Pic16Soc};

emu_core::state! {
    enum CoreRequest {
        0 = EndStandby { by_watchdog }, 1 = ReadWord { addr }, 2 = WriteWords { addr, words, erased }, 3 = Stall { until }, 4 = Ignore { until },
    }
}

impl Default for CoreRequest {
    fn default() -> CoreRequest {
        CoreRequest::ReadWord { addr: 0 }
    }
}

/// Upper bound of the cycles in which instructions execute as NOP, with a margin.
const MOST_IGNORED: u64 = 16;

impl SnapshotState for Pic16Soc {
    fn pass_state(&mut self, tape: &mut StateTape<'_>) -> Result<(), SnapshotDamaged> {
        let cycle = tape.now();
        tape.set_now(4 * cycle);
        // Deadlines are derived from the other fields, and the core gets its deadline again.
        #[rustfmt::skip]
        let Pic16Soc {
            part: _, config: _, log: _, schedule: _, run_to_clock: _, core_deadline: _, out: _, ports, timer0, timers, usart, ssp, eeprom,
            adc, comparators, psp, irq, power, pcon, osc, pin_inputs: outside, requests: orders, stall, ignored_cycles: ignored,
        } = self;
        ports.pass_state(tape)?;
        timer0.pass_state(tape)?;
        timers.pass_state(tape)?;
        usart.pass_state(tape)?;
        ssp.pass_state(tape)?;
        eeprom.pass_state(tape)?;
        adc.pass_state(tape)?;
        comparators.pass_state(tape)?;
        psp.pass_state(tape)?;
        irq.pass_state(tape)?;
        power.pass_state(tape)?;
        pcon.pass_state(tape)?;
        osc.pass_state(tape)?;
        outside.pass_state(tape)?;
        orders.pass_state(tape)?;
        stall.pass_state(tape)?;
        ignored.pass_state(tape)?;
        let near = |until: u64| (cycle..=cycle + MOST_IGNORED).contains(&until);
        let sound = |order: &CoreRequest| match order {
            CoreRequest::Stall { until } => *until >= cycle && *until != NEVER,
            CoreRequest::Ignore { until } => near(*until),
            _ => true,
        };
        tape.require(orders.iter().all(sound) && *stall != NEVER && (ignored.1 <= cycle || near(ignored.1)))?;
        if tape.is_reading() {
            (self.log, self.core_deadline, self.run_to_clock) = (EventLog::OFF, 0, tape.now());
            self.schedule.touch_all();
            self.out.clear();
            self.update_deadlines();
            tape.require(self.schedule.due > tape.now())?;
        }
        Ok(())
    }
}
