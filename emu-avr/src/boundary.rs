//! Between two instructions: what is due, interrupts, sleep, stops, and loops that only wait.

use std::sync::Arc;

use emu_core::cpu::{Bus, Cpu, Fault, NEVER, Probe, Reset, Stop};

use crate::cpu::Avr;
use crate::flags::Flag;
use crate::isa::{Kind, PC_MASK, row_of};
use crate::periph::map::at;
use crate::turn::RAM_START;

/// Cycles of peace from which on it is worth to look for turns to jump over.
const WORTH: u64 = 64;

/// Cycles in which loops are not looked at after a look that was not worth it, so that short waits cost no more than they do
/// without any looking.
const BLIND: u64 = 1024;

impl Avr {
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
            if self.soc.reset_requested(now) {
                let stop = self.hot.stop;
                self.reset(Reset::Watchdog);
                self.hot.stop = stop;
                continue;
            }
            if std::mem::take(&mut self.hot.stop) {
                return Some(Stop::Probe);
            }
            if now >= until {
                return Some(Stop::Limit);
            }
            if self.hot.flags.get(Flag::I) && self.hot.hold_at != now && self.enter_interrupt(now, probe) {
                continue;
            }
            if self.hot.sleeping {
                if self.halted() {
                    return Some(Stop::Halted);
                }
                // The deadline of this cycle has been served; the interrupt, if any, was not enabled.
                self.hot.time.pass(next.min(until) - now);
                continue;
            }
            // Hold-off lasts for one instruction: look again right after it.
            let deadline = if self.hot.hold_at == now { now + 1 } else { next.min(until) };
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

    /// Takes the pending interrupt, if there is one: +4 cycles out of sleep, then 4 for the entry (data sheet 7.7.1, 10).
    fn enter_interrupt<P: Probe>(&mut self, mut now: u64, probe: &mut P) -> bool {
        if self.soc.pending(now).is_none() {
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
            self.hot = self.turn(probe).0.interrupt(vector);
        }
        self.passing = None;
        self.hot.escape = false;
        self.hot.time.force();
        true
    }

    /// Nothing enabled can wake or reset the chip, and nothing is on its way.
    fn halted(&self) -> bool {
        !self.soc.busy() && !self.soc.can_wake(self.hot.flags.get(Flag::I))
    }

    /// The op at the program counter has no body of its own. `deadline` is the next cycle at which anything is due.
    fn escape<P: Probe>(&mut self, deadline: u64, probe: &mut P) -> Option<Stop> {
        let pc = self.hot.pc & PC_MASK;
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
        if op.kind == Kind::Illegal {
            let word = self.code.word(pc);
            let fault = row_of(word, 0).is_some_and(|(_, kind, _)| kind == Kind::Spm);
            return Some(if fault {
                Stop::Fault { pc, fault: Fault::SelfProgramming }
            } else {
                Stop::Illegal { pc, word }
            });
        }
        let (start, counted) = (self.hot.time.now(), self.hot.time.instructions());
        self.hot = self.turn(probe).0.single(op);
        if self.hot.pc & PC_MASK == pc && self.code.ops[0][pc as usize].kind == Kind::Poll {
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

    /// True when loops that only look may be jumped over: the probe wants to see every turn of none.
    pub(crate) const fn jumps_over<P: Probe>(&self) -> bool {
        self.skip && !P::INSN && !P::DATA
    }

    /// Adds whole turns like the one that began at the cycle `start`, up to `limit`.
    fn repeat(&mut self, limit: u64, start: u64, counted: u64) {
        let now = self.hot.time.now();
        self.hot.time.repeat(limit.saturating_sub(now) / (now - start), start, counted);
    }

    /// At the head of the loop that only looks and is closed by the branch at `end`, if the branch was taken: runs one turn,
    /// and if it leaves the machine as it was, jumps over as many whole turns as nothing can change in. Stops early at the
    /// deadline, at a trap, or where the loop is left.
    fn jump_over_turns<P: Probe>(&mut self, end: u32, deadline: u64, probe: &mut P) {
        let code = Arc::clone(&self.code);
        let Some((head, looks)) = code.look(end).filter(|found| found.0 == self.hot.pc & PC_MASK) else { return };
        let steady = |avr: &Avr, at: u64| {
            let io = looks.iter().filter(|&&r| (0x20..RAM_START).contains(&r) && !matches!(r, at::SPL..=at::SREG));
            io.map(|&r| avr.soc.steady_until(r, at)).min().unwrap_or(NEVER)
        };
        let registers = |avr: &Avr| -> [u8; 32] { std::array::from_fn(|r| avr.data[r]) };
        let (start, counted, before) =
            (self.hot.time.now(), self.hot.time.instructions(), (registers(self), self.hot.flags));
        let promised = steady(self, start);
        if promised.min(deadline).saturating_sub(start) < WORTH {
            self.blind_until = start + BLIND;
            return;
        }
        loop {
            let pc = self.hot.pc & PC_MASK;
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
        let same = self.hot.pc & PC_MASK == *head && (registers(self), self.hot.flags) == before;
        // A promise that ends now was good for this turn and says nothing of the next.
        if same && now < promised {
            self.repeat(steady(self, now).min(deadline), start, counted);
        }
    }
}
