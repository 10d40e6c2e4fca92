//! Between two instructions: what is due, interrupts, sleep, stops, and loops that only wait.

use emu_core::cpu::{Bus, Cpu, Fault, NEVER, Probe, Reset, Stop};

use crate::cpu::Avr;
use crate::flags::Flag;
use crate::isa::{Kind, PC_MASK, row_of};
use crate::turn::RAM_START;

impl Avr {
    /// Runs everything due at this instruction boundary and sets the next deadline. Returns why to stop, if so.
    ///
    /// Every case either stops, or leaves at least one cycle to the deadline for the next burst, or goes round again.
    pub(crate) fn boundary<P: Probe>(&mut self, until: u64, probe: &mut P) -> Option<Stop> {
        loop {
            let now = self.hot.now();
            let next = self.soc.fire(now);
            if P::EVENTS {
                while let Some(event) = self.soc.drain() {
                    self.hot.stop |= probe.event(event);
                }
            }
            if self.soc.reset_requested(now) {
                self.reset(Reset::Watchdog);
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
                self.hot.pass(next.min(until) - now);
                continue;
            }
            // Hold-off lasts for one instruction: look again right after it.
            let deadline = if self.hot.hold_at == now { now + 1 } else { next.min(until) };
            self.hot.set_deadline(deadline);
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
            self.hot.charge(4);
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
        self.hot.force();
        true
    }

    /// Nothing enabled can wake or reset the chip, and nothing is on its way.
    fn halted(&self) -> bool {
        !self.soc.busy() && !self.soc.can_wake(self.hot.flags.get(Flag::I))
    }

    /// The op at the program counter has no body of its own. `deadline` is the next cycle at which anything is due.
    fn escape<P: Probe>(&mut self, deadline: u64, probe: &mut P) -> Option<Stop> {
        let pc = self.hot.pc & PC_MASK;
        let op = self.code.ops[pc as usize];
        if op.kind == Kind::Trap && self.passing != Some(pc) {
            self.passing = Some(pc);
            return Some(Stop::Trap { pc });
        }
        let passed = self.passing.take().is_some();
        if P::INSN && passed && probe.insn(self.hot.now(), pc) {
            self.passing = Some(pc);
            return Some(Stop::Probe);
        }
        let op = self.code.decode(pc);
        if op.kind == Kind::Illegal {
            let word = self.code.word(pc);
            let fault = row_of(word, 0).is_some_and(|(_, kind, _)| kind == Kind::Spm);
            return Some(if fault {
                Stop::Fault { pc, fault: Fault::SelfProgramming }
            } else {
                Stop::Illegal { pc, word }
            });
        }
        let closes_loop = self.code.ops[pc as usize].kind == Kind::Poll;
        self.hot = self.turn(probe).0.single(op);
        let head = self.hot.pc & PC_MASK;
        if closes_loop && head <= pc {
            if head == pc && self.halted() {
                return Some(Stop::Halted);
            }
            if self.skip && !P::INSN && !P::DATA {
                self.jump_over_turns(head, pc, deadline, probe);
            }
        }
        self.hot.force();
        None
    }

    /// At the head of a loop that only looks: runs one turn, and if it leaves the machine as it was, jumps over as many
    /// whole turns as nothing can change in. Stops early at the deadline, at a trap, or where the loop is left.
    fn jump_over_turns<P: Probe>(&mut self, head: u32, end: u32, deadline: u64, probe: &mut P) {
        let Some(looks) = self.code.only_looks(head, end) else { return };
        let steady = |avr: &Avr, at: u64| {
            let io = looks.iter().filter(|&&r| (0x20..RAM_START).contains(&r) && !matches!(r, 0x5D..=0x5F));
            io.map(|&r| avr.soc.steady_until(r, at)).min().unwrap_or(NEVER)
        };
        let registers = |avr: &Avr| -> Vec<u8> { avr.data[..32].to_vec() };
        let (start, counted, before) = (self.hot.now(), self.hot.instructions(), (registers(self), self.hot.flags));
        let promised = steady(self, start);
        loop {
            let pc = self.hot.pc & PC_MASK;
            if self.hot.now() >= deadline
                || self.code.ops[pc as usize].kind == Kind::Trap
                || !(head..=end).contains(&pc)
            {
                return;
            }
            let op = self.code.decode(pc);
            self.hot = self.turn(probe).0.single(op);
            if pc == end {
                break;
            }
        }
        let now = self.hot.now();
        let same = self.hot.pc & PC_MASK == head && (registers(self), self.hot.flags) == before;
        // A promise that ends now was good for this turn and says nothing of the next.
        if same && now < promised {
            let limit = steady(self, now).min(deadline);
            let turns = limit.saturating_sub(now) / (now - start);
            self.hot.counted += turns * (self.hot.instructions() - counted);
            self.hot.pass(turns * (now - start));
        }
    }
}
