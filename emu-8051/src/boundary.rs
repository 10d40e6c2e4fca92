//! Between two instructions: what is due, interrupts, sleep, stops, and loops that only wait.

use std::sync::Arc;

use emu_core::cpu::{Bus, Cpu, NEVER, Probe, Reset, Stop};

use crate::cpu::Mcs51;
use crate::isa::Kind;
use crate::soc::Transfer;
use crate::turn::space;

/// Cycles of peace from which on it is worth to look for turns to jump over.
const WORTH: u64 = 64;

/// Cycles in which loops are not looked at after a look that was not worth it, so that short waits cost no more than they do
/// without any looking.
const BLIND: u64 = 1024;

impl Mcs51 {
    /// Runs everything due at this instruction boundary and sets the next deadline. Returns why to stop, if so.
    ///
    /// Every case either stops, or leaves at least one cycle to the deadline for the next burst, or goes round again.
    pub(crate) fn boundary<P: Probe>(&mut self, until: u64, probe: &mut P) -> Option<Stop> {
        loop {
            let now = self.hot.time.now();
            let next = self.soc.fire(now);
            if P::EVENTS {
                while let Some(event) = self.soc.drain() {
                    self.hot.stop |= probe.event(event);
                }
            }
            if let Some(watchdog) = self.soc.reset_requested() {
                let stop = self.hot.stop;
                self.reset(if watchdog { Reset::Watchdog } else { Reset::External });
                self.hot.stop = stop;
                continue;
            }
            if std::mem::take(&mut self.hot.stop) {
                return Some(Stop::Probe);
            }
            if now >= until {
                return Some(Stop::Limit);
            }
            if self.hot.hold_at != now && self.enter_interrupt(now, probe) {
                continue;
            }
            if self.soc.asleep() {
                if self.halted() {
                    return Some(Stop::Halted);
                }
                // The deadline of this cycle has been served.
                self.hot.time.pass(next.min(until).max(now + 1) - now);
                self.hot.time.force();
                continue;
            }
            // Hold-off lasts for one instruction: look again right after it.
            let deadline = if self.hot.hold_at == now { now + 1 } else { next.min(until).max(now + 1) };
            let sight = if self.blind_until > now { self.blind_until } else { NEVER };
            self.hot.time.set_deadline(deadline.min(sight));
            if std::mem::take(&mut self.hot.escape) {
                if let Some(stop) = self.escape(deadline, probe) {
                    return Some(stop);
                }
                continue;
            }
            return None;
        }
    }

    /// Takes the pending interrupt, if there is one.
    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool {
        let Some(vector) = self.soc.pending(now) else { return false };
        self.soc.take(vector, now);
        probe.irq(now, vector);
        self.hot = self.turn(probe).0.interrupt(u32::from(vector) * 8 - 5);
        self.passing = None;
        self.hot.escape = false;
        self.hot.time.force();
        true
    }

    /// Nothing enabled can wake or reset the chip, and nothing is on its way.
    fn halted(&self) -> bool {
        !self.soc.busy() && !self.soc.can_wake(true)
    }

    /// The op at the program counter has no body of its own. `deadline` is the next cycle at which anything is due.
    fn escape<P: Probe>(&mut self, deadline: u64, probe: &mut P) -> Option<Stop> {
        let pc = self.hot.pc & 0xFFFF;
        let trap = self.code.has_trap(pc);
        if trap && self.passing != Some(pc) {
            self.passing = Some(pc);
            return Some(Stop::Trap { pc });
        }
        self.passing = None;
        if P::INSN && trap && probe.insn(self.hot.time.now(), pc) {
            self.passing = Some(pc);
            return Some(Stop::Probe);
        }
        let op = self.code.plain[pc as usize];
        match op.kind {
            Kind::Illegal => {
                return Some(Stop::Illegal { pc, word: u16::from(self.code.bytes[pc as usize]) });
            }
            Kind::Rewrite => {
                self.external(pc, probe);
                self.hot.time.force();
                return None;
            }
            _ => {}
        }
        let (start, counted) = (self.hot.time.now(), self.hot.time.instructions());
        self.hot = self.turn(probe).0.single(op);
        if self.hot.pc & 0xFFFF == pc && self.code.ops[0][pc as usize].kind == Kind::Poll {
            // A jump to itself has changed nothing and looked at nothing: every turn is like this one.
            if self.halted() {
                return Some(Stop::Halted);
            }
            if self.skip && !P::INSN {
                self.repeat(deadline, start, counted);
            }
        } else if !trap && self.jumps_over::<P>() {
            self.jump_over_turns(pc, deadline, probe);
        }
        self.hot.time.force();
        None
    }

    /// MOVX where it does not just reach a memory: a write that may change the program, or a chip without a bus, which reads
    /// what floats.
    fn external<P: Probe>(&mut self, pc: u32, probe: &mut P) {
        // The four instructions: E0 and F0 by DPTR, E2, E3, F2, F3 by a register; bit 4 tells writes.
        let opcode = self.code.bytes[pc as usize];
        let addr = if opcode & 2 == 0 {
            self.hot.dptr as u16
        } else {
            let register = self.ram[(self.hot.bank | u32::from(opcode & 1)) as usize];
            u16::from_be_bytes([self.soc.port2(), register])
        };
        self.hot.pc = pc + 1;
        self.hot.time.count();
        self.hot.time.charge(2);
        let last = self.hot.time.now() - 1;
        if self.part.bus {
            let value = self.hot.acc as u8;
            self.write_external(addr, value);
            self.soc.external_access(Transfer { addr, value, write: true }, last);
            if P::DATA {
                self.hot.stop |= probe.data(last, space::XDATA, addr, value, true);
            }
        } else if opcode & 0x10 == 0 {
            self.hot.acc = 0xFF;
        }
    }

    /// True when loops that only look may be jumped over: the probe wants to see every turn of none.
    pub(crate) const fn jumps_over<P: Probe>(&self) -> bool {
        self.skip && !P::INSN && !P::DATA
    }

    /// Adds whole turns like the one that began at the cycle `start`, up to `limit`.
    fn repeat(&mut self, limit: u64, start: u64, counted: u64) {
        let now = self.hot.time.now();
        self.hot.time.repeat(limit.saturating_sub(now) / (now - start), start, counted);
    }

    /// At the head of the loop that only looks and is closed by the jump at `end`, if the jump was taken: runs one turn, and if
    /// it leaves the core as it was, jumps over as many whole turns as nothing can change in. Stops early at the deadline,
    /// at a trap, or where the loop is left.
    fn jump_over_turns<P: Probe>(&mut self, end: u32, deadline: u64, probe: &mut P) {
        let code = Arc::clone(&self.code);
        let Some((head, looks)) = code.look(end).filter(|found| found.0 == self.hot.pc & 0xFFFF) else { return };
        let steady = |mcs51: &Mcs51, at: u64| {
            looks.iter().map(|&addr| mcs51.soc.steady_until(addr.into(), at)).min().unwrap_or(NEVER)
        };
        let held = |mcs51: &Mcs51| {
            let hot = &mcs51.hot;
            (hot.acc, hot.b, hot.psw(), hot.dptr, hot.other_dptr)
        };
        let (start, counted, before) = (self.hot.time.now(), self.hot.time.instructions(), held(self));
        let promised = steady(self, start);
        if promised.min(deadline).saturating_sub(start) < WORTH {
            self.blind_until = start + BLIND;
            return;
        }
        loop {
            let pc = self.hot.pc & 0xFFFF;
            // A loop within the loop is looked at for itself.
            let inner = pc != end && code.ops[1][pc as usize].kind == Kind::Poll;
            if self.hot.time.now() >= deadline || code.has_trap(pc) || inner || !(*head..=end).contains(&pc) {
                return;
            }
            self.hot = self.turn(probe).0.single(code.plain[pc as usize]);
            if pc == end {
                break;
            }
        }
        let now = self.hot.time.now();
        let same = self.hot.pc & 0xFFFF == *head && held(self) == before;
        // A promise that ends now was good for this turn and says nothing of the next.
        if same && now < promised {
            self.repeat(steady(self, now).min(deadline), start, counted);
        }
    }
}
