//! Between two instructions: what is due, interrupts, sleep, stops, and loops that only wait.

use emu_core::cpu::{Bus, Cpu, Fault, NEVER, Probe, Reset, Stop};

use crate::cpu::Avr;
use crate::flags::Flag;
use crate::isa::{Kind, PC_MASK, row_of};
use crate::turn::RAM_START;

/// The core at the head of a loop, to be compared with itself one turn later.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Seen {
    end: u32,
    head: u32,
    registers: [u8; 32],
    sreg: u8,
    sp: u16,
    cycle: u64,
    instructions: u64,
    /// What the loop reads stays as it is up to here.
    steady: u64,
}

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
                self.hot.set_deadline(next.min(until));
                self.hot.left = 0;
                continue;
            }
            // Hold-off lasts for one instruction: look again right after it.
            let deadline = if self.hot.hold_at == now { now + 1 } else { next.min(until) };
            self.hot.set_deadline(deadline);
            if std::mem::take(&mut self.hot.escape) {
                if let Some(stop) = self.escape(next, until, probe) {
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
            self.hot.left -= 4;
            now += 4;
            self.soc.fire(now);
        }
        if let Some(vector) = self.soc.pending(now) {
            self.soc.take(vector, now);
            probe.irq(now, vector);
            self.hot = self.turn(probe).0.interrupt(vector);
        }
        self.seen = None;
        self.passing = None;
        self.hot.escape = false;
        self.hot.force();
        true
    }

    /// Nothing enabled can wake or reset the chip, and nothing is on its way.
    fn halted(&self) -> bool {
        !self.soc.busy() && !self.soc.can_wake(self.hot.flags.get(Flag::I))
    }

    /// The op at the program counter has no body of its own.
    fn escape<P: Probe>(&mut self, next: u64, until: u64, probe: &mut P) -> Option<Stop> {
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
        self.hot = self.turn(probe).0.single(op);
        let halted = self.look_at_loop::<P>(pc, next, until);
        self.hot.force();
        halted
    }

    /// After the branch at `end` closed a loop that only looks: if the machine is as it was one turn ago, jumps over as many
    /// whole turns as nothing can change in.
    fn look_at_loop<P: Probe>(&mut self, end: u32, next: u64, until: u64) -> Option<Stop> {
        let head = self.hot.pc & PC_MASK;
        if self.code.ops[end as usize].kind != Kind::Poll || head > end {
            self.seen = None;
            return None;
        }
        let reads = self.code.only_looks(head, end)?;
        let now = self.hot.now();
        let steady = |at: u64| {
            let io = reads.iter().filter(|&&r| r < RAM_START && !matches!(r, 0x5D..=0x5F));
            io.map(|&r| self.soc.steady_until(r, at)).min().unwrap_or(NEVER)
        };
        let mut registers = [0; 32];
        registers.copy_from_slice(&self.data[..32]);
        let seen = Seen {
            end,
            head,
            registers,
            sreg: self.hot.flags.pack(),
            sp: self.hot.sp,
            cycle: now,
            instructions: self.hot.instructions,
            steady: steady(now),
        };
        let last = self.seen.replace(seen.clone());
        let same = last.filter(|l| {
            let same = Seen { cycle: now, instructions: seen.instructions, steady: seen.steady, ..l.clone() };
            same == seen && now <= l.steady
        })?;
        // A jump to itself with interrupts off is the end of a program; with them on, only while nothing can come.
        if head == end && self.halted() {
            return Some(Stop::Halted);
        }
        let period = now - same.cycle;
        if P::INSN || P::DATA || period == 0 || !self.skip {
            return None;
        }
        let limit = seen.steady.min(next).min(until);
        let turns = limit.saturating_sub(now) / period;
        self.hot.left -= (turns * period) as i64;
        self.hot.instructions += turns * (seen.instructions - same.instructions);
        self.seen = None;
        None
    }
}
