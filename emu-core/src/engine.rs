//! The loop around every hot loop: what happens between two instructions. Due events, resets, interrupts, sleep, stops, traps,
//! and loops of the program that only wait, which are jumped over.
//!
//! A family gives its machine as an [`Engine`] and calls [`run`] and [`step_until`]; its own burst executes instructions up to the
//! deadline that is set here.

use crate::countdown::Countdown;
use crate::cpu::{Cpu, END_OF_TIME, NEVER, Probe, Reset, Stop};
use crate::pins::{Event, Time};

/// Cycles of peace from which on it is worth to look for turns to jump over.
const WORTH: u64 = 64;

/// Cycles in which loops are not looked at after a look that was not worth it, so that short waits cost no more than they do
/// without any looking.
const BLIND: u64 = 1024;

/// How a machine is run. Says nothing of the machine itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Looks {
    /// The trap that stopped the last run, to be stepped over by the next.
    pub passing: Option<u32>,
    /// Loops that only look are jumped over,
    pub skip: bool,
    /// but not before this cycle.
    pub blind_until: u64,
    /// Time passes up to the limit of a run, whatever can wake the chip.
    pub insists: bool,
    /// It was met sleeping, or in a loop that only looks, when nothing was due any more.
    pub endless: bool,
}

impl Looks {
    /// At first: loops are jumped over.
    pub const START: Looks = Looks { passing: None, skip: true, blind_until: 0, insists: false, endless: false };
}

/// What predecode has found an instruction to be, besides what it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Nothing else.
    Plain,
    /// A jump to itself, which changes nothing and looks at nothing.
    Spins,
    /// It closes a loop that only looks.
    ClosesLoop,
}

/// A machine as the loop sees it.
pub trait Engine: Cpu {
    /// What the core holds and a waiting loop may change: a turn that leaves it as it was is followed by one just like it.
    type Held: PartialEq;

    /// The clock of the hot state.
    fn clock(&mut self) -> &mut Countdown;
    /// The probe has asked for a stop.
    fn stop(&mut self) -> &mut bool;
    /// The burst has met an op without a body.
    fn escaped(&mut self) -> &mut bool;
    /// How the machine is run.
    fn looks(&mut self) -> &mut Looks;

    /// Runs what is due in the chip up to the machine cycle `now`; returns the next deadline.
    fn fire(&mut self, now: u64) -> u64;
    /// Logs events from now on, or does not.
    fn log(&mut self, on: bool);
    /// Takes the oldest logged event.
    fn drain(&mut self) -> Option<Event>;
    /// The chip asks to be reset.
    fn reset_requested(&mut self) -> Option<Reset>;
    /// Does what else the chip asks of the core between two instructions. True when that has taken time.
    fn obey(&mut self) -> bool {
        false
    }
    /// The boundary at the cycle `now` takes no interrupt, because of the instruction before it.
    fn holds(&self, now: u64) -> bool {
        let _ = now;
        false
    }
    /// An interrupt would be taken at the cycle `now`.
    fn interrupt_pending(&self, now: u64) -> bool;
    /// Enters the pending interrupt, if there is one.
    fn enter_interrupt<P: Probe>(&mut self, now: u64, probe: &mut P) -> bool;
    /// The core stands still until something wakes it.
    fn asleep(&self) -> bool;
    /// Nothing enabled can wake or reset the chip, and nothing is on its way.
    fn halted(&self) -> bool;

    /// A trap stands at `pc`.
    fn has_trap(&self, pc: u32) -> bool;
    /// What predecode has found the instruction at `pc` to be.
    fn mark(&self, pc: u32) -> Mark;
    /// The head of the loop that only looks and is closed by the instruction at `end`.
    fn head(&self, end: u32) -> Option<u32>;
    /// The cycle up to which everything that this loop looks at keeps its value from the cycle `at` on.
    fn steady(&self, end: u32, at: u64) -> u64;
    /// The loop that only looks and is closed by the instruction at `end` clears the watchdog: how long ago its last turn did counts,
    /// and no turn before it.
    fn renews(&self, end: u32) -> bool;
    /// What the counter holds of the loop that is closed by the instruction at `end` and does nothing but count down to zero, one a
    /// turn; none for other loops.
    fn counter(&self, end: u32) -> Option<u64>;
    /// Lets that counter hold another value.
    fn set_counter(&mut self, end: u32, value: u64);
    /// What the core holds.
    fn held(&self) -> Self::Held;

    /// Executes instructions up to the deadline; `looks`: stops at loops that only look, not just at jumps to themselves.
    fn burst<P: Probe>(&mut self, looks: bool, probe: &mut P);
    /// Executes the instruction at `pc`, the program counter, whatever marks it bears.
    ///
    /// # Errors
    /// Why it cannot be executed.
    fn single<P: Probe>(&mut self, pc: u32, probe: &mut P) -> Result<(), Stop>;
}

/// Runs to the machine cycle `until`, or until something stops the run ([`Cpu::run`]).
pub fn run<E: Engine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> Stop {
    let until = until.min(END_OF_TIME);
    cpu.log(P::EVENTS);
    let jumps = jumps_over::<E, P>(cpu);
    if P::FLOW {
        probe.enters(cpu.pc());
    }
    loop {
        if let Some(stop) = boundary(cpu, until, probe) {
            if P::FLOW {
                probe.breaks(cpu.pc());
            }
            return stop;
        }
        let looks = jumps && cpu.cycle() >= cpu.looks().blind_until;
        cpu.burst(looks, probe);
    }
}

/// Executes one instruction or one interrupt entry, or sleeps on to what is due next, up to `until` ([`Cpu::step_until`]).
pub fn step_until<E: Engine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> Stop {
    let now = cpu.cycle();
    let next = cpu.fire(now);
    // Where an interrupt is there already, or nothing is ever due and nobody says how far, one cycle.
    let sleeps = cpu.asleep() && !cpu.interrupt_pending(now) && next.min(until) < END_OF_TIME;
    run(cpu, if sleeps { next.min(until).max(now + 1) } else { now + 1 }, probe)
}

/// Only something from outside can still change what the program does, though it does not count as halted: nothing is due, and it
/// sleeps, or goes round in a loop that only looks, or will within some [`BLIND`] cycles ([`Cpu::waits_for_ever`]).
pub fn waits_for_ever<E: Engine>(cpu: &mut E) -> bool {
    let now = cpu.cycle();
    if cpu.fire(now) != NEVER {
        return false;
    }
    *cpu.looks() = Looks::START;
    run(cpu, now.saturating_add(2 * BLIND), &mut ()) == Stop::Limit && cpu.looks().endless
}

/// Runs everything due at this instruction boundary and sets the next deadline. Returns why to stop, if so.
///
/// Every case either stops, or leaves at least one cycle to the deadline for the next burst, or goes round again.
fn boundary<E: Engine, P: Probe>(cpu: &mut E, until: u64, probe: &mut P) -> Option<Stop> {
    loop {
        let now = cpu.cycle();
        let next = cpu.fire(now);
        if P::EVENTS {
            while let Some(event) = cpu.drain() {
                *cpu.stop() |= probe.event(event);
            }
        }
        if let Some(why) = cpu.reset_requested() {
            let (stop, before) = (*cpu.stop(), cpu.pc());
            cpu.reset(why);
            *cpu.stop() = stop | (P::EVENTS && probe.event(Event::Reset { at: Time::at(now), why }));
            went(cpu, before, probe);
            continue;
        }
        if std::mem::take(cpu.stop()) {
            return Some(Stop::Probe);
        }
        if now >= until {
            return Some(Stop::Limit);
        }
        let before = cpu.pc();
        if cpu.obey() {
            went(cpu, before, probe);
            continue;
        }
        if !cpu.holds(now) && cpu.enter_interrupt(now, probe) {
            went(cpu, before, probe);
            cpu.looks().passing = None;
            *cpu.escaped() = false;
            cpu.clock().force();
            continue;
        }
        if cpu.asleep() {
            if !cpu.looks().insists && cpu.halted() {
                return Some(Stop::Halted);
            }
            cpu.looks().endless |= next == NEVER && !cpu.interrupt_pending(now);
            // The deadline of this cycle has been served; the interrupt, if any, was not enabled.
            let clock = cpu.clock();
            clock.pass(next.min(until).max(now + 1) - now);
            clock.force();
            continue;
        }
        // Hold-off lasts for one instruction: look again right after it.
        let deadline = if cpu.holds(now) { now + 1 } else { next.min(until).max(now + 1) };
        let blind = cpu.looks().blind_until;
        let sight = if blind > now { blind } else { NEVER };
        cpu.clock().set_deadline(deadline.min(sight));
        if std::mem::take(cpu.escaped()) {
            let idle = next == NEVER && !cpu.interrupt_pending(now);
            if let Some(stop) = escape(cpu, deadline, idle, probe) {
                return Some(stop);
            }
            continue;
        }
        return None;
    }
}

/// The program counter was `before`, and no instruction has moved it from there.
fn went<E: Engine, P: Probe>(cpu: &E, before: u32, probe: &mut P) {
    if P::FLOW {
        probe.breaks(before);
        probe.enters(cpu.pc());
    }
}

/// The op at the program counter has no body of its own. `deadline` is the cycle up to which it may run; `idle`: nothing is due, and
/// no interrupt is there.
fn escape<E: Engine, P: Probe>(cpu: &mut E, deadline: u64, idle: bool, probe: &mut P) -> Option<Stop> {
    let pc = cpu.pc();
    let trap = cpu.has_trap(pc);
    if trap && cpu.looks().passing != Some(pc) {
        cpu.looks().passing = Some(pc);
        return Some(Stop::Trap { pc });
    }
    cpu.looks().passing = None;
    if P::INSN && trap && probe.insn(cpu.cycle(), pc) {
        cpu.looks().passing = Some(pc);
        return Some(Stop::Probe);
    }
    let (start, counted) = (cpu.cycle(), cpu.instructions());
    if let Err(stop) = cpu.single(pc, probe) {
        return Some(stop);
    }
    match cpu.mark(pc) {
        Mark::Spins if !trap && cpu.pc() == pc => {
            // Every turn is like this one.
            if !cpu.looks().insists && cpu.halted() {
                return Some(Stop::Halted);
            }
            cpu.looks().endless |= idle;
            if cpu.looks().skip && !P::EVERY {
                repeat(cpu, deadline, start, counted);
            }
        }
        Mark::ClosesLoop if !trap && jumps_over::<E, P>(cpu) => jump_over_turns(cpu, pc, deadline, idle, probe),
        _ => {}
    }
    cpu.clock().force();
    None
}

/// True when loops that only look may be jumped over: the probe wants to see every turn of none.
fn jumps_over<E: Engine, P: Probe>(cpu: &mut E) -> bool {
    cpu.looks().skip && !P::EVERY && !P::READS
}

/// Adds whole turns like the one that began at the cycle `start`, up to `limit`.
fn repeat<E: Engine>(cpu: &mut E, limit: u64, start: u64, counted: u64) {
    let now = cpu.cycle();
    cpu.clock().repeat(limit.saturating_sub(now) / (now - start), start, counted);
}

/// At the head of the loop that only looks and is closed by the jump at `end`, if the jump was taken: runs one turn, and if it
/// leaves the core as it was, jumps over as many whole turns as nothing can change in. Stops early at the deadline, at a
/// trap, or where the loop is left. Where the watchdog is cleared, the last turn is run: it leaves what all before it would have.
fn jump_over_turns<E: Engine, P: Probe>(cpu: &mut E, end: u32, deadline: u64, idle: bool, probe: &mut P) {
    let Some(head) = cpu.head(end).filter(|&head| head == cpu.pc()) else { return };
    if let Some(left) = cpu.counter(end) {
        count_turns(cpu, (head, end), left, deadline, probe);
        return;
    }
    let (start, counted, before) = (cpu.cycle(), cpu.instructions(), cpu.held());
    let promised = cpu.steady(end, start);
    if promised.min(deadline).saturating_sub(start) < WORTH {
        cpu.looks().blind_until = start + BLIND;
        return;
    }
    if !whole_turn(cpu, (head, end), deadline, probe) {
        return;
    }
    let now = cpu.cycle();
    // A promise that ends now was good for this turn and says nothing of the next.
    if cpu.pc() == head && cpu.held() == before && now < promised {
        let promised = cpu.steady(end, now);
        cpu.looks().endless |= idle && promised == NEVER;
        let limit = promised.min(deadline);
        if cpu.renews(end) {
            repeat(cpu, limit.saturating_sub(now - start), start, counted);
            whole_turn(cpu, (head, end), deadline, probe);
        } else {
            repeat(cpu, limit, start, counted);
        }
    }
}

/// At the head of a loop that counts down to zero, with so many turns left: runs one, jumps over all but the last two or as many as
/// the deadline leaves room for, and runs one more, which leaves the flags that all before it would have.
fn count_turns<E: Engine, P: Probe>(cpu: &mut E, (head, end): (u32, u32), left: u64, deadline: u64, probe: &mut P) {
    let (start, counted) = (cpu.cycle(), cpu.instructions());
    // A probe that is told of writes sees the counter's, which may lie in memory.
    if P::DATA || left.min(deadline.saturating_sub(start)) < WORTH {
        cpu.looks().blind_until = start + BLIND;
        return;
    }
    if !whole_turn(cpu, (head, end), deadline, probe) || cpu.pc() != head {
        return;
    }
    let turn = cpu.cycle() - start;
    let room = (deadline.saturating_sub(cpu.cycle()) / turn).saturating_sub(1);
    if let Some(now) = cpu.counter(end).filter(|&now| now + 1 == left) {
        let turns = room.min(now.saturating_sub(2));
        cpu.set_counter(end, now - turns);
        cpu.clock().repeat(turns, start, counted);
        whole_turn(cpu, (head, end), deadline, probe);
    }
}

/// Runs the turn of a loop that begins at its head, up to behind the jump at its end; false where it stops before.
fn whole_turn<E: Engine, P: Probe>(cpu: &mut E, (head, end): (u32, u32), deadline: u64, probe: &mut P) -> bool {
    loop {
        let pc = cpu.pc();
        // A loop within the loop is looked at for itself.
        let inner = pc != end && cpu.mark(pc) != Mark::Plain;
        if cpu.cycle() >= deadline || cpu.has_trap(pc) || inner || !(head..=end).contains(&pc) {
            return false;
        }
        if P::INSN && probe.insn(cpu.cycle(), pc) {
            *cpu.stop() = true;
            return false;
        }
        if cpu.single(pc, probe).is_err() {
            return false;
        }
        if pc == end {
            return true;
        }
    }
}
