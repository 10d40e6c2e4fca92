//! The chip around the core as a state ([`emu_core::state`]).

use emu_core::cpu::NEVER;
use emu_core::outside::Log;
use emu_core::state::{Damaged, State, Tape};

use super::{Order, Soc, at, every_part};
use crate::periph::Device;

emu_core::state! {
    enum Order {
        0 = Woken { by_watchdog }, 1 = ReadWord { addr }, 2 = WriteWords { addr, words, erased }, 3 = Stand { until }, 4 = Ignore { until },
    }
}

impl Default for Order {
    fn default() -> Order {
        Order::ReadWord { addr: 0 }
    }
}

/// Cycles for which instructions run as NOPs at most, with a margin.
const MOST_IGNORED: u64 = 16;

impl State for Soc {
    fn state(&mut self, tape: &mut Tape<'_>) -> Result<(), Damaged> {
        let cycle = tape.now();
        tape.set_now(4 * cycle);
        // When what is due follows from the rest; what the core was told last it is told again.
        #[rustfmt::skip]
        let Soc {
            part: _, config: _, log: _, nexts: _, touched: _, due: _, ran: _, told: _, out: _, ports, timer0, timers, usart, ssp, eeprom,
            adc, comparators, psp, irq, power, pcon, osc, outside, orders, stall, ignored,
        } = self;
        ports.state(tape)?;
        timer0.state(tape)?;
        timers.state(tape)?;
        usart.state(tape)?;
        ssp.state(tape)?;
        eeprom.state(tape)?;
        adc.state(tape)?;
        comparators.state(tape)?;
        psp.state(tape)?;
        irq.state(tape)?;
        power.state(tape)?;
        pcon.state(tape)?;
        osc.state(tape)?;
        outside.state(tape)?;
        orders.state(tape)?;
        stall.state(tape)?;
        ignored.state(tape)?;
        let near = |until: u64| (cycle..=cycle + MOST_IGNORED).contains(&until);
        let sound = |order: &Order| match order {
            Order::Stand { until } => *until >= cycle && *until != NEVER,
            Order::Ignore { until } => near(*until),
            _ => true,
        };
        tape.demand(orders.iter().all(sound) && *stall != NEVER && (ignored.1 <= cycle || near(ignored.1)))?;
        if tape.reads() {
            (self.log, self.told, self.ran, self.touched) = (Log::OFF, 0, tape.now(), u8::MAX);
            self.out.clear();
            self.plan();
            tape.demand(self.due > tape.now())?;
        }
        Ok(())
    }
}

impl Soc {
    /// Does everything up to the cycle `now`, also what nobody waits for, so that machines that are equal look so.
    pub(crate) fn settle_down(&mut self, now: u64) {
        self.log = Log::OFF;
        let t = 4 * now;
        self.run(t);
        every_part!(self, part, number => {
            self.touched |= 1 << number;
            part.run(t, &mut self.out);
        });
        self.carry_out();
        self.plan();
        self.run(t);
        if self.ignored.1 <= now {
            self.ignored = (0, 0);
        }
    }
}
