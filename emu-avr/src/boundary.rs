//! The machine as the loop around the hot loop sees it: what happens between two instructions.

use emu_core::countdown::Countdown;
use std::sync::Arc;

use emu_core::cpu::{Bus, Cpu, NEVER, Probe, Reset, Stop};
use emu_core::engine::{Engine, Looks, Mark};
use emu_core::pins::Event;

use crate::cpu::Avr;
use crate::flags::{Flag, Flags};
use crate::isa::Kind;
use crate::soc::Order;
use crate::turn::{SPL, SREG};

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
        self.soc.reset_requested(now)
    }
    fn obey(&mut self) -> bool {
        let Some(order) = self.soc.order() else { return false };
        match order {
            Order::Erase { addr, len } => {
                let code = Arc::make_mut(&mut self.code);
                (addr..addr.saturating_add(len)).for_each(|addr| code.poke(addr as usize, 0xFF));
            }
            Order::Program { addr, words } => {
                let code = Arc::make_mut(&mut self.code);
                let bytes = words.iter().flat_map(|word| word.to_le_bytes());
                for (addr, byte) in (addr as usize..).zip(bytes) {
                    let old = code.byte(addr);
                    code.poke(addr, old & byte);
                }
            }
        }
        true
    }
    fn holds(&self, now: u64) -> bool {
        self.hot.hold_at == now || self.barred(now)
    }
    fn interrupt_pending(&self, now: u64) -> bool {
        self.hot.flags.get(Flag::I) && self.soc.pending(now).is_some() && !self.soc.stands()
    }

    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        if !self.interrupt_pending(now) {
            return false;
        }
        if self.hot.sleeping {
            // What lock bits bar does not wake either.
            if self.soc.locks_interrupts(2 * self.pc()) {
                return false;
            }
            self.hot.sleeping = false;
            self.soc.wake_up(now);
            return true;
        }
        if let Some(vector) = self.soc.pending(now) {
            self.soc.take(vector, now);
            probe.irq(now, vector);
            let at = self.soc.vectors() + u32::from(vector) * self.part.chip.vector_words;
            self.hot = self.turn(probe).0.interrupt(at);
        }
        true
    }

    fn asleep(&self) -> bool {
        self.hot.sleeping || self.soc.stands()
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
        self.code.look(end).map(|found| found.head)
    }
    fn steady(&self, end: u32, at: u64) -> u64 {
        let looks = self.code.look(end).map_or(&[][..], |found| &found.looks);
        let io = looks.iter().filter(|&&r| (0x20..self.part.chip.ram_start).contains(&r) && !matches!(r, SPL..=SREG));
        io.map(|&r| self.soc.steady_until(r, at)).min().unwrap_or(NEVER)
    }
    fn renews(&self, end: u32) -> bool {
        self.code.look(end).is_some_and(|found| found.renews)
    }
    fn counter(&self, end: u32) -> Option<u64> {
        let regs = &self.code.look(end).filter(|found| !found.counter.is_empty())?.counter;
        Some(regs.iter().rev().fold(0, |high, &reg| high << 8 | u64::from(self.data.bytes[usize::from(reg)])))
    }
    fn set_counter(&mut self, end: u32, value: u64) {
        let Some(found) = self.code.look(end) else { return };
        for (&reg, byte) in found.counter.iter().zip(value.to_le_bytes()) {
            self.data.bytes[usize::from(reg)] = byte;
        }
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
            return Err(Stop::Illegal { pc, word: self.code.word(pc) });
        }
        self.hot = self.turn(probe).0.single(op);
        Ok(())
    }
}

impl Avr {
    /// An interrupt asks that may not be taken before the instruction at this boundary: it is looked for again behind it.
    fn barred(&self, now: u64) -> bool {
        self.hot.flags.get(Flag::I)
            && self.soc.pending(now).is_some()
            && (self.soc.ivce(now) || self.soc.locks_interrupts(2 * self.pc()))
            && !self.asleep()
    }
}
