//! A run cut anywhere is the same run. Machines of one plan are run at once, step by step, in slices, from clones, under probes, with
//! traps on the way, with and without jumping over loops that only wait; all must end as the same machine, and tell probes the same.
//! For the tests of the cores: what differs is told by a panic.

use std::collections::BTreeSet;

use crate::cpu::{Cpu, Probe, ProgramFault, ResetCause, StopReason};
use crate::pins::{ChipEvent, CycleTime, PinId, PinLevel};
use crate::rng::Rng;

/// What is done to a machine between two runs.
#[derive(Debug, Clone, Copy)]
pub enum RandomInput {
    /// [`Cpu::poke`].
    Poke(&'static str, u32, u8),
    /// [`Cpu::set_pc`].
    Pc(u32),
    /// [`Cpu::set_breakpoint`].
    Trap(u32, bool),
    /// [`Cpu::drive`], at once.
    Drive(PinId, PinLevel),
    /// [`Cpu::reset`].
    Reset(ResetCause),
    /// Nothing: the run is only looked at.
    Nothing,
}

impl RandomInput {
    /// Does it to a machine.
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

/// A machine and all that will happen to it.
pub struct SlicePlan<C> {
    /// How to make it again, for messages.
    pub description: String,
    /// The machine.
    pub start: C,
    /// Run to the cycle, in order, then do it.
    pub inputs: Vec<(u64, RandomInput)>,
    /// Where the program has instructions worth a trap, in program words; empty where nothing is known of it.
    pub breakpoint_candidates: Vec<u32>,
}

/// What a kind of machine has besides [`Cpu`].
pub struct SliceSubject<C> {
    /// What is looked at after every act, besides stop, counts, program counter and pins.
    pub visible_state: fn(&C) -> Vec<Option<u8>>,
    /// What is looked at in the end.
    pub memories: fn(&C) -> Vec<Option<u8>>,
    /// Program words from 0 on where a trap may be worth it when the plan has no places.
    pub code_words: u64,
    /// Turns jumping over loops that only wait on or off.
    pub set_skip_idle_loops: fn(&mut C, bool),
    /// The machine sleeps: a step may end behind the cycle that is asked for.
    pub asleep: fn(&C) -> bool,
    /// Changes code and memory of a clone, so that it runs astray.
    pub corrupt_state: fn(&mut C),
}

/// One of `from`, which is not empty.
pub fn pick_random<T: Copy>(rng: &mut Rng, from: &[T]) -> T {
    from[rng.below(from.len() as u64) as usize]
}

/// What a probe saw.
#[derive(Debug, Default)]
struct HookLog<const INSN: bool, const DATA: bool, const EVENTS: bool> {
    insns: u64,
    /// A sum over all accesses in their order.
    data: u64,
    events: Vec<ChipEvent>,
    irqs: Vec<(u64, u8)>,
    /// Stops the run here and there.
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
        // What is stopped before it is shown again.
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

/// Stop; cycle, instructions and PC; what the subject shows; pins.
type MachineView = (StopReason, [u64; 3], Vec<Option<u8>>, Vec<PinLevel>);

/// What one way of running has shown.
struct RunTrace {
    views: Vec<MachineView>,
    /// Cycle and place of the traps of the plan.
    breakpoints_hit: Vec<(u64, u32)>,
    /// [`Cpu::save`] at every look.
    snapshots: Vec<Vec<u8>>,
    memories: Vec<Option<u8>>,
}

impl<C: Cpu> SliceSubject<C> {
    fn view(&self, cpu: &C, stop: StopReason) -> MachineView {
        let levels = (0..cpu.chip().pins.len() as PinId).map(|pin| cpu.pin_level(pin)).collect();
        (stop, [cpu.cycle(), cpu.instructions(), cpu.pc().into()], (self.visible_state)(cpu), levels)
    }

    /// Runs the plan; `go` runs a piece that ends at the given cycle at the latest. `more`: traps that are none of the plan's.
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
                assert!(stood < 1000, "stands still at {before:?}\n{}", plan.description);
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

    /// Runs the plan in all ways; the cycles that it ran.
    ///
    /// # Panics
    /// Where one way differs from another, with the plan that shows it.
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
        // Within a cycle what happens at a boundary (a reset, a hand that stirs) comes when the cycle has been shown already.
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
        // Instructions of a reset machine are counted on.
        // What is no instruction, or a jump that cannot be carried out, is shown, and then stops the run.
        let refused = |stop: &StopReason| {
            matches!(
                stop,
                StopReason::Illegal { .. } | StopReason::Fault { fault: ProgramFault::JumpOutOfProgram { .. }, .. }
            )
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
            // A step out of sleep may end behind the cycle asked for.
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
            // The one that is left behind runs astray, which is nothing to its clone.
            let mut astray = std::mem::replace(cpu, copy);
            (self.corrupt_state)(&mut astray);
            astray.run(astray.cycle() + 20, &mut ());
            cpu.run((cpu.cycle() + 50 * random_slice(rng)).min(until), &mut ())
        };
        assert_same_trace("clones", plan, &wanted, &run(&[], true, &mut cloned));

        let mut told = None;
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
            // That a trap was told of is no part of what is saved.
            if matches!(stop, StopReason::Breakpoint { .. }) && told == Some((cpu.cycle(), cpu.instructions())) {
                stop = cpu.run(to, &mut ());
            }
            told = matches!(stop, StopReason::Breakpoint { .. }).then(|| (cpu.cycle(), cpu.instructions()));
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

/// A length of a slice: any order of magnitude.
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
