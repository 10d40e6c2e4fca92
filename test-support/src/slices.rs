//! Asserts that a run can be cut anywhere without a change of its result, for the tests of the cores.
//!
//! A plan is run at once, step by step, in slices, from clones, with probes, with breakpoints, and with and
//! without skipping of polling loops. All ways must end with the same machine and report the same to probes.
//! A difference is a panic.

use std::collections::BTreeSet;

use emu_core::cpu::{Cpu, Probe, ProgramError, ProgramFault, ResetCause, StopReason};
use emu_core::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;

/// An input to a machine between two runs.
#[derive(Debug, Clone, Copy)]
pub enum RandomInput {
    /// [`Cpu::poke`].
    Poke(&'static str, u32, u8),
    /// [`Cpu::set_pc`].
    Pc(u32),
    /// [`Cpu::set_breakpoint`].
    Trap(u32, bool),
    /// [`Cpu::drive`], immediately.
    Drive(PinId, PinLevel),
    /// [`Cpu::reset`].
    Reset(ResetCause),
    /// No input: the state is only compared.
    Nothing,
}

impl RandomInput {
    /// Applies the input to a machine.
    pub fn apply<C: Cpu>(self, cpu: &mut C) {
        match self {
            RandomInput::Poke(space, addr, value) => _ = cpu.poke(space, addr, value),
            RandomInput::Pc(pc) => cpu.set_pc(pc),
            RandomInput::Trap(pc, on) => cpu.set_breakpoint(pc, on),
            RandomInput::Drive(pin, level) => cpu.drive(CycleTime::at(0), pin, level),
            RandomInput::Reset(why) => cpu.reset(why),
            RandomInput::Nothing => {}
        }
    }
}

/// A machine and all its inputs.
pub struct SlicePlan<C> {
    /// How to make the plan again, for messages.
    pub description: String,
    /// The machine at the start.
    pub start: C,
    /// The inputs in order: run to the cycle, then apply the input.
    pub inputs: Vec<(u64, RandomInput)>,
    /// Addresses of instructions where a breakpoint is useful, in program words; empty if none are known.
    pub breakpoint_candidates: Vec<u32>,
}

/// What a type of machine provides for the comparison, in addition to [`Cpu`].
pub struct SliceSubject<C> {
    /// State that is compared after every input, in addition to stop reason, counts, program counter and
    /// pins.
    pub visible_state: fn(&C) -> Vec<Option<u8>>,
    /// State that is compared at the end.
    pub memories: fn(&C) -> Vec<Option<u8>>,
    /// If the plan has no breakpoint candidates, breakpoints are set below this program word address.
    pub code_words: u64,
    /// Enables or disables skipping of polling loops.
    pub set_skip_idle_loops: fn(&mut C, bool),
    /// Whether the machine sleeps, so that a step can end after the requested cycle.
    pub asleep: fn(&C) -> bool,
    /// Changes code and memory of a clone, so that it executes something else.
    pub corrupt_state: fn(&mut C),
}

/// Returns a random element of `from`, which must not be empty.
pub fn pick_random<T: Copy>(rng: &mut Rng, from: &[T]) -> T {
    from[rng.below(from.len() as u64) as usize]
}

/// What a probe has seen.
#[derive(Debug, Default)]
struct HookLog<const INSN: bool, const DATA: bool, const EVENTS: bool> {
    insns: u64,
    /// A hash over all accesses in order.
    data: u64,
    events: Vec<ChipEvent>,
    irqs: Vec<(u64, u8)>,
    /// If present, decides at random when the probe stops the run.
    stop_rng: Option<Rng>,
}

impl<const I: bool, const D: bool, const E: bool> HookLog<I, D, E> {
    fn asks_to_stop(&mut self) -> bool {
        self.stop_rng.as_mut().is_some_and(|rng| rng.one_in(40))
    }
}

impl<const I: bool, const D: bool, const E: bool> Probe for HookLog<I, D, E> {
    const INSN: bool = I;
    const DATA: bool = D;
    const EVENTS: bool = E;

    fn on_instruction(&mut self, _: u64, _: u32) -> bool {
        let stop = self.asks_to_stop();
        // An instruction before which the run stops is reported again.
        self.insns += u64::from(!stop);
        stop
    }
    fn on_data_access(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let access =
            at << 32 | u64::from(space) << 28 | u64::from(addr) << 9 | u64::from(value) << 1 | u64::from(write);
        self.data = (self.data ^ access).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(23);
        self.asks_to_stop()
    }
    fn on_interrupt(&mut self, at: u64, vector: u8) {
        self.irqs.push((at, vector));
    }
    fn on_event(&mut self, event: ChipEvent) -> bool {
        self.events.push(event);
        self.asks_to_stop()
    }
}

/// Stop reason; cycle, instructions and PC; visible state of the subject; pins.
type MachineView = (StopReason, [u64; 3], Vec<Option<u8>>, Vec<PinLevel>);

/// What one way of running has shown.
struct RunTrace {
    views: Vec<MachineView>,
    /// Cycle and address of each breakpoint of the plan that was reached.
    breakpoints_hit: Vec<(u64, u32)>,
    /// [`Cpu::save`] at every comparison.
    snapshots: Vec<Vec<u8>>,
    memories: Vec<Option<u8>>,
}

impl<C: Cpu> SliceSubject<C> {
    fn view(&self, cpu: &C, stop: StopReason) -> MachineView {
        let levels = (0..cpu.chip().pins.len() as PinId).map(|pin| cpu.pin_level(pin)).collect();
        (stop, [cpu.cycle(), cpu.instructions(), cpu.pc().into()], (self.visible_state)(cpu), levels)
    }

    /// Runs the plan; `go` runs a piece that ends at the given cycle at the latest. `more` are additional
    /// breakpoints that are not in the plan.
    fn run_plan(
        &self,
        plan: &SlicePlan<C>,
        more: &[u32],
        skip: bool,
        mut go: impl FnMut(&mut C, u64) -> StopReason,
    ) -> RunTrace {
        let mut cpu = plan.start.clone();
        (self.set_skip_idle_loops)(&mut cpu, skip);
        let mut shown =
            RunTrace { views: Vec::new(), breakpoints_hit: Vec::new(), snapshots: Vec::new(), memories: Vec::new() };
        let mut set = BTreeSet::new();
        for &pc in more {
            cpu.set_breakpoint(pc, true);
        }
        for &(until, act) in &plan.inputs {
            let mut stood = 0;
            let stop = loop {
                let before = (cpu.cycle(), cpu.instructions());
                assert!(stood < 1000, "no progress at {before:?}\n{}", plan.description);
                match go(&mut cpu, until) {
                    StopReason::Breakpoint { pc } if set.contains(&pc) => shown.breakpoints_hit.push((cpu.cycle(), pc)),
                    StopReason::Breakpoint { pc } => assert!(more.contains(&pc), "{pc:04x} has no trap"),
                    StopReason::Probe => {}
                    StopReason::Limit if cpu.cycle() >= until => break StopReason::Limit,
                    StopReason::Limit => {}
                    stop => break stop,
                }
                stood = if (cpu.cycle(), cpu.instructions()) == before { stood + 1 } else { 0 };
            };
            shown.views.push(self.view(&cpu, stop));
            shown.snapshots.push(cpu.save());
            match act {
                RandomInput::Trap(pc, on) => {
                    cpu.set_breakpoint(pc, on || more.contains(&pc));
                    if on {
                        set.insert(pc)
                    } else {
                        set.remove(&pc)
                    };
                }
                act => act.apply(&mut cpu),
            }
        }
        shown.memories = (self.memories)(&cpu);
        shown
    }

    /// Runs the plan in all ways. Returns the cycles of the run.
    ///
    /// # Panics
    /// Two ways differ. The message describes the plan.
    pub fn assert_slicing_invariant(&self, plan: &SlicePlan<C>, rng: &mut Rng) -> u64 {
        let run = |more: &[u32], skip: bool, go: &mut dyn FnMut(&mut C, u64) -> StopReason| {
            self.run_plan(plan, more, skip, go)
        };
        let mut bare = HookLog::<false, false, false>::default();
        let wanted = run(&[], true, &mut |cpu, until| cpu.run(until, &mut bare));
        let irqs = bare.irqs;

        let mut events = HookLog::<false, false, true>::default();
        assert_same_trace("events", plan, &wanted, &run(&[], true, &mut |cpu, until| cpu.run(until, &mut events)));
        assert_eq!(events.irqs, irqs, "events: interrupts\n{}", plan.description);
        // What happens at a boundary (a reset or an input of the plan) is reported after later events of the
        // same cycle.
        let stirred = |at: u64| wanted.views.iter().any(|look| at >= look.1[0] && at < look.1[0] + 6);
        let mut pairs = events.events.windows(2).map(|pair| (pair[0].time().cycle, pair[1].time().cycle));
        let in_order = pairs.find(|&(first, second)| first > second && !stirred(first));
        assert_eq!(in_order, None, "events out of order\n{}", plan.description);

        let mut all = HookLog::<true, true, true>::default();
        let shown = run(&[], true, &mut |cpu, until| cpu.run(until, &mut all));
        assert_same_trace("all hooks", plan, &wanted, &shown);
        assert!(
            all.irqs == irqs && all.events == events.events,
            "all hooks: interrupts or events\n{}",
            plan.description
        );
        // The instruction count continues after a reset. An illegal instruction, or a jump that cannot be
        // executed, is reported and then stops the run without being counted.
        let refused = |stop: &StopReason| {
            use ProgramError::{Fault, Illegal};
            let jump = |fault: &ProgramFault| matches!(fault, ProgramFault::JumpOutOfProgram { .. });
            matches!(stop, StopReason::Error(Illegal { .. }))
                || matches!(stop, StopReason::Error(Fault { fault, .. }) if jump(fault))
        };
        let illegal = shown.views.iter().filter(|look| refused(&look.0)).count() as u64;
        let counted = shown.views.last().map(|look| look.1[1] + illegal);
        assert_eq!(counted, Some(all.insns), "instructions shown\n{}", plan.description);

        let mut data = HookLog::<false, true, false>::default();
        assert_same_trace("data", plan, &wanted, &run(&[], true, &mut |cpu, until| cpu.run(until, &mut data)));
        assert_eq!((data.data, &data.irqs), (all.data, &irqs), "data alone\n{}", plan.description);

        let mut plain = HookLog::<false, false, true>::default();
        assert_same_trace("no skip", plan, &wanted, &run(&[], false, &mut |cpu, until| cpu.run(until, &mut plain)));
        assert!(
            plain.irqs == irqs && plain.events == events.events,
            "no skip: interrupts or events\n{}",
            plan.description
        );

        let mut sliced = HookLog::<false, false, true>::default();
        let mut piece = |cpu: &mut C, until: u64| cpu.run((cpu.cycle() + random_slice(rng)).min(until), &mut sliced);
        assert_same_trace("slices", plan, &wanted, &run(&[], true, &mut piece));
        assert!(
            sliced.irqs == irqs && sliced.events == events.events,
            "slices: interrupts or events\n{}",
            plan.description
        );

        let mut stepped = HookLog::<false, false, false>::default();
        let mut step = |cpu: &mut C, until: u64| {
            // A step out of sleep can end after the requested cycle.
            if cpu.cycle() >= until || (self.asleep)(cpu) {
                cpu.run(until, &mut stepped)
            } else {
                cpu.step(&mut stepped)
            }
        };
        assert_same_trace("steps", plan, &wanted, &run(&[], true, &mut step));
        assert_eq!(stepped.irqs, irqs, "steps: interrupts\n{}", plan.description);

        let mut cloned = |cpu: &mut C, until: u64| {
            let copy = cpu.clone();
            // The abandoned original executes something else; that must not affect its clone.
            let mut astray = std::mem::replace(cpu, copy);
            (self.corrupt_state)(&mut astray);
            astray.run(astray.cycle() + 20, &mut ());
            cpu.run((cpu.cycle() + 50 * random_slice(rng)).min(until), &mut ())
        };
        assert_same_trace("clones", plan, &wanted, &run(&[], true, &mut cloned));

        let mut stopped_at = None;
        let mut saved = |cpu: &mut C, until: u64| {
            let bytes = cpu.save();
            (self.corrupt_state)(cpu);
            cpu.run(cpu.cycle() + 20, &mut ());
            for machine in [&mut *cpu, &mut plan.start.clone()] {
                assert_eq!(machine.restore(&bytes), Ok(()), "at {}\n{}", machine.cycle(), plan.description);
                assert!(
                    machine.save() == bytes,
                    "what was saved at {} is another\n{}",
                    machine.cycle(),
                    plan.description
                );
            }
            let to = (cpu.cycle() + 50 * random_slice(rng)).min(until);
            let mut stop = cpu.run(to, &mut ());
            // That a breakpoint was already reported is not part of what is saved.
            if matches!(stop, StopReason::Breakpoint { .. }) && stopped_at == Some((cpu.cycle(), cpu.instructions())) {
                stop = cpu.run(to, &mut ());
            }
            stopped_at = matches!(stop, StopReason::Breakpoint { .. }).then(|| (cpu.cycle(), cpu.instructions()));
            stop
        };
        assert_same_trace("saved", plan, &wanted, &run(&[], true, &mut saved));

        let mut picky = HookLog::<true, true, true> { stop_rng: Some(Rng::new(rng.next_u64())), ..HookLog::default() };
        assert_same_trace("stops", plan, &wanted, &run(&[], true, &mut |cpu, until| cpu.run(until, &mut picky)));
        assert!(
            picky.irqs == irqs && picky.events == events.events,
            "stops: interrupts or events\n{}",
            plan.description
        );
        assert_eq!((picky.data, picky.insns), (all.data, all.insns), "stops: accesses\n{}", plan.description);

        let traps: Vec<u32> = match plan.breakpoint_candidates.len() {
            0 => (0..30).map(|_| rng.below(self.code_words) as u32).collect(),
            _ => (0..5).map(|_| pick_random(rng, &plan.breakpoint_candidates)).collect(),
        };
        let mut trapped = HookLog::<false, false, true>::default();
        assert_same_trace("traps", plan, &wanted, &run(&traps, true, &mut |cpu, until| cpu.run(until, &mut trapped)));
        assert!(
            trapped.irqs == irqs && trapped.events == events.events,
            "traps: interrupts or events\n{}",
            plan.description
        );

        wanted.views.last().map_or(0, |look| look.1[0])
    }
}

/// Returns a random slice length of any order of magnitude from 1 to 4,096 cycles.
fn random_slice(rng: &mut Rng) -> u64 {
    let most = 1 << rng.below(13);
    1 + rng.below(most)
}

fn assert_same_trace<C>(way: &str, plan: &SlicePlan<C>, wanted: &RunTrace, found: &RunTrace) {
    for (n, (w, f)) in wanted.views.iter().zip(&found.views).enumerate() {
        assert_eq!((&f.0, f.1), (&w.0, w.1), "{way}, look {n}: stop, (cycle, instructions, PC)\n{}", plan.description);
        for (addr, (w, f)) in w.2.iter().zip(&f.2).enumerate() {
            assert_eq!(f, w, "{way}, look {n}: byte {addr:03x} of what is seen\n{}", plan.description);
        }
        assert_eq!(f.3, w.3, "{way}, look {n}: pins\n{}", plan.description);
    }
    for (n, (w, f)) in wanted.snapshots.iter().zip(&found.snapshots).enumerate() {
        let differs = (0..w.len().max(f.len())).find(|&at| w.get(at) != f.get(at));
        assert_eq!(differs, None, "{way}, look {n}: byte of what is saved\n{}", plan.description);
    }
    assert_eq!(found.breakpoints_hit, wanted.breakpoints_hit, "{way}: traps\n{}", plan.description);
    let differs = (0..wanted.memories.len()).find(|&at| wanted.memories[at] != found.memories[at]);
    assert_eq!(differs, None, "{way}: byte of the memories\n{}", plan.description);
}
