//! The machine as the loop around the hot loop sees it: what happens between two instructions.

use emu_core::countdown::Countdown;
use emu_core::cpu::{Bus, Cpu, Fault, NEVER, Probe, Reset, Stop};
use emu_core::engine::{Engine, Looks, Mark};
use emu_core::pins::Event;

use crate::cpu::Avr;
use crate::flags::{Flag, Flags};
use crate::isa::{Kind, row_of};
use crate::periph::map::at;

impl Engine for Avr {
    type Held = ([u8; 32], Flags);

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
    #[inline]
    fn reset_requested(&mut self) -> Option<Reset> {
        let now = self.cycle();
        self.soc.reset_requested(now).then_some(Reset::Watchdog)
    }
    fn holds(&self, now: u64) -> bool {
        self.hot.hold_at == now
    }
    fn interrupt_pending(&self, now: u64) -> bool {
        self.hot.flags.get(Flag::I) && self.soc.pending(now).is_some()
    }

    /// +4 cycles out of sleep, then 4 for the entry (data sheet 7.7.1, 10).
    fn enter_interrupt<P: Probe>(&mut self, mut now: u64, probe: &mut P) -> bool {
        if !self.interrupt_pending(now) {
            return false;
        }
        if std::mem::take(&mut self.hot.sleeping) {
            self.hot.time.charge(4);
            now += 4;
            self.soc.fire(now);
        }
        if let Some(vector) = self.soc.pending(now) {
            self.soc.take(vector, now);
            probe.irq(now, vector);
            let at = u32::from(vector) * self.chip.vector_words;
            self.hot = self.turn(probe).0.interrupt(at);
        }
        true
    }

    fn asleep(&self) -> bool {
        self.hot.sleeping
    }
    fn halted(&self) -> bool {
        !self.soc.busy() && !self.soc.can_wake(self.hot.flags.get(Flag::I))
    }
    fn has_trap(&self, pc: u32) -> bool {
        self.code.has_trap(pc)
    }
    fn mark(&self, pc: u32) -> Mark {
        self.code.mark(pc)
    }
    fn head(&self, end: u32) -> Option<u32> {
        self.code.look(end).map(|found| found.0)
    }
    fn steady(&self, end: u32, at: u64) -> u64 {
        let looks = self.code.look(end).map_or(&[][..], |found| &found.1);
        let io = looks.iter().filter(|&&r| (0x20..self.chip.ram_start).contains(&r) && !matches!(r, at::SPL..=at::SREG));
        io.map(|&r| self.soc.steady_until(r, at)).min().unwrap_or(NEVER)
    }
    fn held(&self) -> Self::Held {
        (std::array::from_fn(|r| self.data.bytes[r]), self.hot.flags)
    }

    fn burst<P: Probe>(&mut self, looks: bool, probe: &mut P) {
        let (turn, code) = self.turn(probe);
        self.hot = turn.burst(&code.ops[usize::from(looks)]);
    }

    fn single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), Stop> {
        // It may stand behind the end of memory, which is the beginning.
        self.hot.pc = pc;
        let op = self.code.plain[pc as usize];
        if op.kind == Kind::Illegal {
            let word = self.code.word(pc);
            let fault = row_of(word, 0).is_some_and(|(_, kind, _)| kind == Kind::Spm);
            return Err(if fault {
                Stop::Fault { pc, fault: Fault::SelfProgramming }
            } else {
                Stop::Illegal { pc, word }
            });
        }
        self.hot = self.turn(probe).0.single(op);
        Ok(())
    }
}
