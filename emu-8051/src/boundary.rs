//! The machine as the loop around the hot loop sees it: what happens between two instructions.

use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, Cpu, NEVER, Probe, Reset, Stop};
use emu_core::engine::{Engine, Looks, Mark};
use emu_core::pins::Event;

use crate::chips::{VECTOR_BACK, VECTOR_WORDS};
use crate::cpu::Mcs51;
use crate::isa::Kind;
use crate::predecode::Counter;

impl Engine for Mcs51 {
    /// A, B, PSW and the data pointers.
    type Held = (u32, u32, u8, u32, u32);

    fn clock(&mut self) -> &mut Countdown {
        &mut self.hot.time
    }
    fn stop(&mut self) -> &mut bool {
        &mut self.hot.stop
    }
    fn escaped(&mut self) -> &mut bool {
        &mut self.hot.escape
    }
    fn looks(&mut self) -> &mut Looks {
        &mut self.looks
    }
    fn fire(&mut self, now: u64) -> u64 {
        self.soc.fire(now)
    }
    fn log(&mut self, on: bool) {
        let now = self.cycle();
        self.soc.log(on, now);
    }
    fn drain(&mut self) -> Option<Event> {
        self.soc.drain()
    }
    fn reset_requested(&mut self) -> Option<Reset> {
        self.soc.reset_requested()
    }
    fn holds(&self, now: u64) -> bool {
        self.hot.hold_at == now
    }
    fn interrupt_pending(&self, now: u64) -> bool {
        self.soc.pending(now).is_some()
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        let Some(vector) = self.soc.pending(now) else { return false };
        self.soc.take(vector, now);
        probe.irq(now, vector);
        self.hot = self.turn(probe).0.interrupt(u32::from(vector) * VECTOR_WORDS - VECTOR_BACK);
        true
    }

    fn asleep(&self) -> bool {
        self.soc.asleep()
    }
    fn halted(&self) -> bool {
        !self.soc.busy() && !self.soc.can_wake(true)
    }
    fn has_trap(&self, pc: u32) -> bool {
        self.code.has_trap(pc)
    }
    fn mark(&self, pc: u32) -> Mark {
        self.code.mark(pc)
    }
    fn head(&self, end: u32) -> Option<u32> {
        self.code.look(end).map(|found| found.head)
    }
    fn steady(&self, end: u32, at: u64) -> u64 {
        let looks = self.code.look(end).map_or(&[][..], |found| &found.looks);
        looks.iter().map(|&addr| self.soc.steady_until(addr.into(), at)).min().unwrap_or(NEVER)
    }
    fn renews(&self, end: u32) -> bool {
        self.code.look(end).is_some_and(|found| found.renews)
    }
    fn counter(&self, end: u32) -> Option<u64> {
        let place = self.counter_place(self.code.look(end)?.counter?);
        Some(self.ram[place].into())
    }
    fn set_counter(&mut self, end: u32, value: u64) {
        if let Some(counter) = self.code.look(end).and_then(|found| found.counter) {
            self.ram[self.counter_place(counter)] = value as u8;
        }
    }
    fn held(&self) -> Self::Held {
        let hot = &self.hot;
        (hot.acc, hot.b, hot.psw(), hot.dptr, hot.other_dptr)
    }

    fn burst<P: Probe>(&mut self, looks: bool, probe: &mut P) {
        let (turn, code) = self.turn(probe);
        self.hot = turn.burst(&code.ops[usize::from(looks)]);
    }

    fn single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), Stop> {
        let op = self.code.plain[pc as usize];
        match op.kind {
            Kind::Illegal => {
                return Err(Stop::Illegal { pc, word: u16::from(self.code.bytes[pc as usize]) });
            }
            Kind::Rewrite => self.external(pc, probe),
            _ => self.hot = self.turn(probe).0.single(op),
        }
        Ok(())
    }
}

impl Mcs51 {
    /// Where in RAM a counter is.
    fn counter_place(&self, counter: Counter) -> usize {
        match counter {
            Counter::Reg(n) => (self.hot.bank | u32::from(n)) as usize % self.ram.len(),
            Counter::Ram(addr) => addr.into(),
        }
    }

    /// MOVX where it does not just reach a memory: a write that may change the program, or a chip without a bus. There what is
    /// outside reads FFh for ever, since nothing drives it, and no probe is told of it.
    fn external<P: Probe>(&mut self, pc: u32, probe: &mut P) {
        let op = self.code.movx(pc);
        let page = [self.ram[(self.hot.bank | u32::from(op.arg[0] & 1)) as usize], self.soc.port2()];
        let by_register = matches!(op.kind, Kind::MovxAInd | Kind::MovxIndA);
        let addr = if by_register { u16::from_le_bytes(page) } else { self.hot.dptr as u16 };
        if self.part.bus {
            self.hot = self.turn(probe).0.single(op);
            let value = self.xdata[usize::from(addr)];
            self.write_external(addr, value);
        } else {
            self.hot = self.turn(&mut ()).0.single(op);
            self.write_external(addr, 0xFF);
        }
    }
}
