//! A run cut anywhere is the same run. Machines of one plan are run at once, step by step, in slices, from clones, under probes, with
//! traps on the way, with and without jumping over loops that only wait; all must end as the same machine, and tell probes the same.
//! For the tests of the cores: what differs is told by a panic.

use std::collections::BTreeSet;

use crate::cpu::{Cpu, Fault, Probe, Reset, Stop};
use crate::pins::{Event, Level, PinId, Time};
use crate::rng::Rng;

/// What is done to a machine between two runs.
#[derive(Debug, Clone, Copy)]
pub enum Act {
    /// [`Cpu::poke`].
    Poke(&'static str, u32, u8),
    /// [`Cpu::set_pc`].
    Pc(u32),
    /// [`Cpu::trap`].
    Trap(u32, bool),
    /// [`Cpu::drive`], at once.
    Drive(PinId, Level),
    /// [`Cpu::reset`].
    Reset(Reset),
    /// Nothing: the run is only looked at.
    Nothing,
}

impl Act {
    /// Does it to a machine.
    pub fn apply<C: Cpu>(self, cpu: &mut C) {
        match self {
            Act::Poke(space, addr, value) => _ = cpu.poke(space, addr, value),
            Act::Pc(pc) => cpu.set_pc(pc),
            Act::Trap(pc, on) => cpu.trap(pc, on),
            Act::Drive(pin, level) => cpu.drive(Time::at(0), pin, level),
            Act::Reset(why) => cpu.reset(why),
            Act::Nothing => {}
        }
    }
}

/// A machine and all that will happen to it.
pub struct Plan<C> {
    /// How to make it again, for messages.
    pub what: String,
    /// The machine.
    pub start: C,
    /// Run to the cycle, in order, then do it.
    pub acts: Vec<(u64, Act)>,
    /// Where the program has instructions worth a trap, in program words; empty where nothing is known of it.
    pub places: Vec<u32>,
}

/// What a kind of machine has besides [`Cpu`].
pub struct Subject<C> {
    /// What is looked at after every act, besides stop, counts, program counter and pins.
    pub seen: fn(&C) -> Vec<Option<u8>>,
    /// What is looked at in the end.
    pub memories: fn(&C) -> Vec<Option<u8>>,
    /// Program words from 0 on where a trap may be worth it when the plan has no places.
    pub code: u64,
    /// Turns jumping over loops that only wait on or off.
    pub set_skip: fn(&mut C, bool),
    /// The machine sleeps: a step may end behind the cycle that is asked for.
    pub asleep: fn(&C) -> bool,
    /// Changes code and memory of a clone, so that it runs astray.
    pub spoil: fn(&mut C),
}

/// One of `from`, which is not empty.
pub fn pick<T: Copy>(rng: &mut Rng, from: &[T]) -> T {
    from[rng.below(from.len() as u64) as usize]
}

/// What a probe saw.
#[derive(Debug, Default)]
struct Log<const INSN: bool, const DATA: bool, const EVENTS: bool> {
    insns: u64,
    /// A sum over all accesses in their order.
    data: u64,
    events: Vec<Event>,
    irqs: Vec<(u64, u8)>,
    /// Stops the run here and there.
    stops: Option<Rng>,
}

impl<const I: bool, const D: bool, const E: bool> Log<I, D, E> {
    fn stop(&mut self) -> bool {
        self.stops.as_mut().is_some_and(|rng| rng.one_in(40))
    }
}

impl<const I: bool, const D: bool, const E: bool> Probe for Log<I, D, E> {
    const INSN: bool = I;
    const DATA: bool = D;
    const EVENTS: bool = E;

    fn insn(&mut self, _: u64, _: u32) -> bool {
        let stop = self.stop();
        // What is stopped before it is shown again.
        self.insns += u64::from(!stop);
        stop
    }
    fn data(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        let access =
            at << 32 | u64::from(space) << 28 | u64::from(addr) << 9 | u64::from(value) << 1 | u64::from(write);
        self.data = (self.data ^ access).wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(23);
        self.stop()
    }
    fn irq(&mut self, at: u64, vector: u8) {
        self.irqs.push((at, vector));
    }
    fn event(&mut self, event: Event) -> bool {
        self.events.push(event);
        self.stop()
    }
}

/// Stop; cycle, instructions and PC; what the subject shows; pins.
type Look = (Stop, [u64; 3], Vec<Option<u8>>, Vec<Level>);

/// What one way of running has shown.
struct Shown {
    looks: Vec<Look>,
    /// Cycle and place of the traps of the plan.
    traps: Vec<(u64, u32)>,
    /// [`Cpu::save`] at every look.
    states: Vec<Vec<u8>>,
    memories: Vec<Option<u8>>,
}

impl<C: Cpu> Subject<C> {
    fn look(&self, cpu: &C, stop: Stop) -> Look {
        let levels = (0..cpu.chip().pins.len() as PinId).map(|pin| cpu.level(pin)).collect();
        (stop, [cpu.cycle(), cpu.instructions(), cpu.pc().into()], (self.seen)(cpu), levels)
    }

    /// Runs the plan; `go` runs a piece that ends at the given cycle at the latest. `more`: traps that are none of the plan's.
    fn run(&self, plan: &Plan<C>, more: &[u32], skip: bool, mut go: impl FnMut(&mut C, u64) -> Stop) -> Shown {
        let mut cpu = plan.start.clone();
        (self.set_skip)(&mut cpu, skip);
        let mut shown = Shown { looks: Vec::new(), traps: Vec::new(), states: Vec::new(), memories: Vec::new() };
        let mut set = BTreeSet::new();
        for &pc in more {
            cpu.trap(pc, true);
        }
        for &(until, act) in &plan.acts {
            let mut stood = 0;
            let stop = loop {
                let before = (cpu.cycle(), cpu.instructions());
                assert!(stood < 1000, "stands still at {before:?}\n{}", plan.what);
                match go(&mut cpu, until) {
                    Stop::Trap { pc } if set.contains(&pc) => shown.traps.push((cpu.cycle(), pc)),
                    Stop::Trap { pc } => assert!(more.contains(&pc), "{pc:04x} has no trap"),
                    Stop::Probe => {}
                    Stop::Limit if cpu.cycle() >= until => break Stop::Limit,
                    Stop::Limit => {}
                    stop => break stop,
                }
                stood = if (cpu.cycle(), cpu.instructions()) == before { stood + 1 } else { 0 };
            };
            shown.looks.push(self.look(&cpu, stop));
            shown.states.push(cpu.save());
            match act {
                Act::Trap(pc, on) => {
                    cpu.trap(pc, on || more.contains(&pc));
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
    pub fn same_however_run(&self, plan: &Plan<C>, rng: &mut Rng) -> u64 {
        let run = |more: &[u32], skip: bool, go: &mut dyn FnMut(&mut C, u64) -> Stop| self.run(plan, more, skip, go);
        let mut bare = Log::<false, false, false>::default();
        let wanted = run(&[], true, &mut |cpu, until| cpu.run(until, &mut bare));
        let irqs = bare.irqs;

        let mut events = Log::<false, false, true>::default();
        check("events", plan, &wanted, &run(&[], true, &mut |cpu, until| cpu.run(until, &mut events)));
        assert_eq!(events.irqs, irqs, "events: interrupts\n{}", plan.what);
        // Within a cycle what happens at a boundary (a reset, a hand that stirs) comes when the cycle has been shown already.
        let stirred = |at: u64| wanted.looks.iter().any(|look| at >= look.1[0] && at < look.1[0] + 6);
        let mut pairs = events.events.windows(2).map(|pair| (pair[0].at().cycle, pair[1].at().cycle));
        let in_order = pairs.find(|&(first, second)| first > second && !stirred(first));
        assert_eq!(in_order, None, "events out of order\n{}", plan.what);

        let mut all = Log::<true, true, true>::default();
        let shown = run(&[], true, &mut |cpu, until| cpu.run(until, &mut all));
        check("all hooks", plan, &wanted, &shown);
        assert!(all.irqs == irqs && all.events == events.events, "all hooks: interrupts or events\n{}", plan.what);
        // Instructions of a reset machine are counted on.
        // What is no instruction, or a jump that cannot be carried out, is shown, and then stops the run.
        let refused =
            |stop: &Stop| matches!(stop, Stop::Illegal { .. } | Stop::Fault { fault: Fault::LeavesProgram { .. }, .. });
        let illegal = shown.looks.iter().filter(|look| refused(&look.0)).count() as u64;
        let counted = shown.looks.last().map(|look| look.1[1] + illegal);
        assert_eq!(counted, Some(all.insns), "instructions shown\n{}", plan.what);

        let mut data = Log::<false, true, false>::default();
        check("data", plan, &wanted, &run(&[], true, &mut |cpu, until| cpu.run(until, &mut data)));
        assert_eq!((data.data, &data.irqs), (all.data, &irqs), "data alone\n{}", plan.what);

        let mut plain = Log::<false, false, true>::default();
        check("no skip", plan, &wanted, &run(&[], false, &mut |cpu, until| cpu.run(until, &mut plain)));
        assert!(plain.irqs == irqs && plain.events == events.events, "no skip: interrupts or events\n{}", plan.what);

        let mut sliced = Log::<false, false, true>::default();
        let mut piece = |cpu: &mut C, until: u64| cpu.run((cpu.cycle() + slice(rng)).min(until), &mut sliced);
        check("slices", plan, &wanted, &run(&[], true, &mut piece));
        assert!(sliced.irqs == irqs && sliced.events == events.events, "slices: interrupts or events\n{}", plan.what);

        let mut stepped = Log::<false, false, false>::default();
        let mut step = |cpu: &mut C, until: u64| {
            // A step out of sleep may end behind the cycle asked for.
            if cpu.cycle() >= until || (self.asleep)(cpu) {
                cpu.run(until, &mut stepped)
            } else {
                cpu.step(&mut stepped)
            }
        };
        check("steps", plan, &wanted, &run(&[], true, &mut step));
        assert_eq!(stepped.irqs, irqs, "steps: interrupts\n{}", plan.what);

        let mut cloned = |cpu: &mut C, until: u64| {
            let copy = cpu.clone();
            // The one that is left behind runs astray, which is nothing to its clone.
            let mut astray = std::mem::replace(cpu, copy);
            (self.spoil)(&mut astray);
            astray.run(astray.cycle() + 20, &mut ());
            cpu.run((cpu.cycle() + 50 * slice(rng)).min(until), &mut ())
        };
        check("clones", plan, &wanted, &run(&[], true, &mut cloned));

        let mut told = None;
        let mut saved = |cpu: &mut C, until: u64| {
            let bytes = cpu.save();
            (self.spoil)(cpu);
            cpu.run(cpu.cycle() + 20, &mut ());
            for machine in [&mut *cpu, &mut plan.start.clone()] {
                assert_eq!(machine.restore(&bytes), Ok(()), "at {}\n{}", machine.cycle(), plan.what);
                assert!(machine.save() == bytes, "what was saved at {} is another\n{}", machine.cycle(), plan.what);
            }
            let to = (cpu.cycle() + 50 * slice(rng)).min(until);
            let mut stop = cpu.run(to, &mut ());
            // That a trap was told of is no part of what is saved.
            if matches!(stop, Stop::Trap { .. }) && told == Some((cpu.cycle(), cpu.instructions())) {
                stop = cpu.run(to, &mut ());
            }
            told = matches!(stop, Stop::Trap { .. }).then(|| (cpu.cycle(), cpu.instructions()));
            stop
        };
        check("saved", plan, &wanted, &run(&[], true, &mut saved));

        let mut picky = Log::<true, true, true> { stops: Some(Rng::new(rng.next_u64())), ..Log::default() };
        check("stops", plan, &wanted, &run(&[], true, &mut |cpu, until| cpu.run(until, &mut picky)));
        assert!(picky.irqs == irqs && picky.events == events.events, "stops: interrupts or events\n{}", plan.what);
        assert_eq!((picky.data, picky.insns), (all.data, all.insns), "stops: accesses\n{}", plan.what);

        let traps: Vec<u32> = match plan.places.len() {
            0 => (0..30).map(|_| rng.below(self.code) as u32).collect(),
            _ => (0..5).map(|_| pick(rng, &plan.places)).collect(),
        };
        let mut trapped = Log::<false, false, true>::default();
        check("traps", plan, &wanted, &run(&traps, true, &mut |cpu, until| cpu.run(until, &mut trapped)));
        assert!(trapped.irqs == irqs && trapped.events == events.events, "traps: interrupts or events\n{}", plan.what);

        wanted.looks.last().map_or(0, |look| look.1[0])
    }
}

/// A length of a slice: any order of magnitude.
fn slice(rng: &mut Rng) -> u64 {
    let most = 1 << rng.below(13);
    1 + rng.below(most)
}

fn check<C>(way: &str, plan: &Plan<C>, wanted: &Shown, found: &Shown) {
    for (n, (w, f)) in wanted.looks.iter().zip(&found.looks).enumerate() {
        assert_eq!((&f.0, f.1), (&w.0, w.1), "{way}, look {n}: stop, (cycle, instructions, PC)\n{}", plan.what);
        for (addr, (w, f)) in w.2.iter().zip(&f.2).enumerate() {
            assert_eq!(f, w, "{way}, look {n}: byte {addr:03x} of what is seen\n{}", plan.what);
        }
        assert_eq!(f.3, w.3, "{way}, look {n}: pins\n{}", plan.what);
    }
    for (n, (w, f)) in wanted.states.iter().zip(&found.states).enumerate() {
        let differs = (0..w.len().max(f.len())).find(|&at| w.get(at) != f.get(at));
        assert_eq!(differs, None, "{way}, look {n}: byte of what is saved\n{}", plan.what);
    }
    assert_eq!(found.traps, wanted.traps, "{way}: traps\n{}", plan.what);
    let differs = (0..wanted.memories.len()).find(|&at| wanted.memories[at] != found.memories[at]);
    assert_eq!(differs, None, "{way}: byte of the memories\n{}", plan.what);
}
