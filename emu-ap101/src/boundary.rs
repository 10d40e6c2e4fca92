//! Between two instructions: supply, program cycles, the reload of outputs, pacing; and the loop around the hot loop.
//!
//! ```text
//!   no supply --> reload --> ready --> program cycle --> reload --> ready --> ..
//!                 of all     until the period is over    of what the program
//!                 outputs    and a program is enabled    did not write
//! ```
//! Of these only a program cycle has instructions. What has none is passed in one step, up to what is next due.

use emu_core::cpu::{END_OF_TIME, Fault, NEVER, Probe, Stop, Subcycle};
use emu_core::lint::Lint;
use emu_core::pins::Time;

use crate::cpu::Ap101;
use crate::isa::{Kind, SPAN, row_of};
use crate::predecode::Flow;
use crate::soc::CLOCKS;
use crate::turn::{Turn, tell};

/// Machine cycles after which a program cycle is taken for one without an end.
pub(crate) const WATCHDOG: u64 = 65_536;

/// What the machine is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// It has no supply.
    Off,
    /// Output channels are looked at one by one, from the machine cycle `from` on. The period of the program cycle before is over at
    /// the cycle `due`, if it has one.
    Reload { from: u64, due: Option<u64> },
    /// The next program cycle begins at this machine cycle, or when a program is enabled.
    Ready { at: u64 },
    /// A program runs, in the program cycle that began at this machine cycle.
    Run { begun: u64 },
}

emu_core::state! { enum Phase { 0 = Off, 1 = Reload { from, due }, 2 = Ready { at }, 3 = Run { begun } } }

/// The probe looks closer than the hot loop shows.
const fn careful<P: Probe>() -> bool {
    P::EVERY || P::DATA || P::LINT || P::SUBCYCLE
}

impl Ap101 {
    /// Runs to a machine cycle, or until something stops the run. `HALTS`: what has settled does.
    pub(crate) fn run_to<P: Probe, const HALTS: bool>(&mut self, until: u64, probe: &mut P) -> Stop {
        let until = until.min(END_OF_TIME);
        let now = self.hot.time.now();
        self.soc.log.switch(P::EVENTS, now, std::iter::empty());
        loop {
            let mut asked = false;
            if let Some(stop) = self.boundary::<P, HALTS>(until, &mut asked, probe) {
                return stop;
            }
            if !careful::<P>() && self.fetched.is_none() {
                self.burst(probe);
                if !self.hot.time.goes_on() || self.at_end() {
                    continue;
                }
            }
            if let Some(stop) = self.one(asked, probe) {
                // What was driven before it came to that is told.
                self.tell(probe);
                return stop;
            }
        }
    }

    /// Does what is due between two instructions, and lets time pass in which there are none. Returns why to stop, if so; else an
    /// instruction is next, and the deadline is set; `asked`: nothing stops before that instruction.
    fn boundary<P: Probe, const HALTS: bool>(&mut self, until: u64, asked: &mut bool, probe: &mut P) -> Option<Stop> {
        loop {
            self.hot.time.force();
            let now = self.hot.time.now();
            let between = self.fetched.is_none();
            let mut next = None;
            if between {
                if self.soc.fire(CLOCKS * now, self.phase != Phase::Off) {
                    self.stir();
                }
                self.supply(now);
                self.end(now);
                self.reloaded(now);
                if let Some(which) = self.next_program(now) {
                    self.hot.na = self.code.programs.get(which).map_or(0, |ops| ops.program.start.into());
                    // However the machine comes to stop here, it has been looked at.
                    next = Some((which, self.settled(now)));
                }
            }
            self.tell(probe);
            if std::mem::take(&mut self.hot.stop) {
                return Some(Stop::Probe);
            }
            if now >= until {
                return Some(Stop::Limit);
            }
            if between {
                if let Some((which, round)) = next {
                    if let Some(round) = round.filter(|_| HALTS) {
                        let due = self.soc.next();
                        if !self.looks.insists && due == NEVER && self.rests(round) {
                            return Some(Stop::Halted);
                        }
                        let jumps = self.looks.skip && !careful::<P>() && !self.code.has_traps();
                        if jumps && self.jump_over(round, until.min(due / CLOCKS)) {
                            continue;
                        }
                    }
                    // Inputs are latched behind this, so that who stops here and drives them is heard, at this cycle as before it.
                    if careful::<P>() || self.code.has_trap(self.hot.na) {
                        if let Some(stop) = self.stands(now, probe) {
                            return Some(stop);
                        }
                        *asked = true;
                    }
                    self.begin(now, which);
                }
                if matches!(self.phase, Phase::Run { begun } if now >= begun + WATCHDOG) {
                    return Some(Stop::Fault { pc: self.hot.na, fault: Fault::NoEnd });
                }
            }
            // Inputs were latched at the first clock of the cycle; what is driven in the second is there for a live look.
            let fired = self.soc.fire(CLOCKS * now + CLOCKS - 1, self.phase != Phase::Off);
            if fired {
                self.stir();
            }
            let next = if fired { now + 1 } else { self.soc.next() / CLOCKS };
            let idle = !fired && self.soc.next() == NEVER;
            let end = match self.phase {
                Phase::Run { begun } => {
                    self.hot.time.set_deadline(until.min(next).min(begun + WATCHDOG).max(now + 1));
                    return None;
                }
                Phase::Reload { from, .. } => from + self.soc.channels(),
                Phase::Ready { at } if now < at => at,
                Phase::Off | Phase::Ready { .. } if idle && !self.looks.insists => return Some(Stop::Halted),
                Phase::Off | Phase::Ready { .. } => NEVER,
            };
            let to = until.min(next).min(end);
            if let Phase::Reload { from, .. } = self.phase {
                self.soc.reload(from, now, to);
            }
            self.hot.time.pass(to - now);
        }
    }

    /// Tells the probe what has happened at the pins.
    fn tell<P: Probe>(&mut self, probe: &mut P) {
        if P::EVENTS {
            while let Some(event) = self.soc.log.take() {
                self.hot.stop |= probe.event(event);
            }
        }
    }

    /// The supply has come or gone, or a cold start is asked for.
    fn supply(&mut self, now: u64) {
        let (dipped, rose) = self.soc.take_troubles();
        match (self.phase == Phase::Off, self.soc.supplied()) {
            (false, false) => {
                self.lose(now);
                self.phase = Phase::Off;
            }
            (false, true) if dipped => {
                let cold = self.soc.asks_to_clear();
                self.start(cold);
            }
            (false, true) if rose => self.start(true),
            (true, true) => {
                let cold = self.soc.asks_to_clear();
                self.start(cold);
            }
            _ => {}
        }
    }

    /// What is not protected is 0.
    fn lose(&mut self, now: u64) {
        self.soc.lose(&self.config, self.hz, now);
        (self.hot.a, self.ric, self.fetched) = (false, 0, None);
    }

    /// The supply comes: M is as it was, or cleared; all outputs become what their images are.
    pub(crate) fn start(&mut self, cold: bool) {
        let now = self.hot.time.now();
        self.lose(now);
        if cold {
            self.soc.clear(&self.config);
        }
        (self.overruns, self.current, self.passing) = (0, None, None);
        self.stir();
        self.which = self.choose().unwrap_or(0);
        self.hot.na = self.code.programs.get(self.which).map_or(0, |ops| ops.program.start.into());
        self.phase = Phase::Reload { from: now, due: None };
    }

    /// NA stands behind the last word of the running program.
    pub(crate) fn at_end(&self) -> bool {
        matches!(self.phase, Phase::Run { .. }) && self.code.ended(self.which, self.hot.na)
    }

    /// A program cycle that is over at `now` ends.
    fn end(&mut self, now: u64) {
        if self.at_end() {
            self.end_cycle(now);
        }
        self.hot.na %= SPAN as u32;
    }

    /// The program cycle is over; its outputs are looked at from `now` on.
    fn end_cycle(&mut self, now: u64) {
        if let Phase::Run { begun } = self.phase {
            let due = (self.config.period > 0).then_some(begun + self.config.period);
            self.phase = Phase::Reload { from: now, due };
        }
    }

    /// A reload that is over has shown whether the period is.
    fn reloaded(&mut self, now: u64) {
        if let Phase::Reload { from, due } = self.phase
            && now >= from + self.soc.channels()
        {
            if due.is_some_and(|due| now > due) {
                self.overruns = self.overruns.saturating_add(1);
            }
            self.phase = Phase::Ready { at: due.unwrap_or(now).max(now) };
        }
    }

    /// The program of which a program cycle begins now, if it is time and one may run.
    fn next_program(&self, now: u64) -> Option<usize> {
        match self.phase {
            Phase::Ready { at } if now >= at => self.choose(),
            _ => None,
        }
    }

    /// A program cycle begins.
    fn begin(&mut self, now: u64, which: usize) {
        (self.which, self.current) = (which, Some(which));
        self.soc.begin(now);
        self.phase = Phase::Run { begun: now };
    }

    /// The program that runs next: the one behind the current one, in the order of the table, that may run.
    fn choose(&self) -> Option<usize> {
        let programs = &self.code.programs;
        let first = self.current.map_or(0, |which| which + 1);
        let may = |which: usize| {
            let ops = programs.get(which)?;
            (!self.config.reconfigurable || self.config.programs.is_empty() || self.soc.enabled(ops.program.entry))
                .then_some(which)
        };
        (0..programs.len()).find_map(|i| may((first + i) % programs.len()))
    }

    /// Runs instructions up to the deadline, or to one that needs a closer look.
    fn burst<P: Probe>(&mut self, probe: &mut P) {
        let Some(ops) = self.code.programs.get(self.which) else { return };
        let counted = self.hot.time.instructions();
        let turn = Turn { hot: self.hot, soc: &mut self.soc, code: &self.code, probe };
        self.hot = turn.burst(&ops.ops);
        if self.hot.time.instructions() != counted {
            self.ric = self.code.word(self.hot.last);
            self.passing = None;
        }
        if self.hot.na == SPAN as u32 && !self.at_end() {
            self.hot.na = 0;
        }
    }

    /// The instruction at NA is next, at `now`. Returns why to stop before it, if so.
    fn stands<P: Probe>(&mut self, now: u64, probe: &mut P) -> Option<Stop> {
        let pc = self.hot.na % SPAN as u32;
        if self.code.has_trap(pc) && self.passing != Some(pc) {
            self.passing = Some(pc);
            return Some(Stop::Trap { pc });
        }
        (P::INSN && probe.insn(now, pc)).then_some(Stop::Probe)
    }

    /// Runs the instruction at NA, or what is left of it, one subcycle after the other. `asked`: nothing stops before the first of a
    /// program cycle.
    fn one<P: Probe>(&mut self, asked: bool, probe: &mut P) -> Option<Stop> {
        let now = self.hot.time.now();
        if self.fetched.is_none() {
            let pc = self.hot.na % SPAN as u32;
            let asked = asked && matches!(self.phase, Phase::Run { begun } if begun == now);
            if !asked && let Some(stop) = self.stands(now, probe) {
                return Some(stop);
            }
            self.passing = None;
            let before = std::mem::replace(&mut self.ric, self.code.word(pc));
            self.fetched = Some(before);
            self.hot.na = pc + 1;
            if P::SUBCYCLE && probe.subcycle(Time { cycle: now, phase: 1 }, Subcycle::Fetch, pc, self.ric) {
                return Some(Stop::Probe);
            }
        }
        let (pc, word) = (self.hot.na.wrapping_sub(1) % SPAN as u32, self.ric);
        let before = self.fetched.take().unwrap_or(word);
        self.hot.na = pc;
        let kind = row_of(word).1;
        let taken = matches!(kind, Kind::Jmp | Kind::JmpX) || self.hot.a;
        let flow = if taken { self.code.flow(self.which, word) } else { Flow::On };
        if let Flow::Out(target) = flow {
            self.ric = before;
            return Some(Stop::Fault { pc, fault: Fault::LeavesProgram { target } });
        }
        if P::LINT && matches!(kind, Kind::Not | Kind::Clr) && word & 0xFFF != 0 {
            probe.lint(now, pc, Lint::OddField { word });
        }
        let op = self.code.op(self.which, word, false);
        self.hot = Turn { hot: self.hot, soc: &mut self.soc, code: &self.code, probe }.single(op);
        tell(probe, pc, if flow == Flow::On { self.hot.na } else { 0 });
        if flow == Flow::Start {
            self.end_cycle(now + 1);
        }
        if P::SUBCYCLE {
            self.hot.stop |= probe.subcycle(Time::at(now + 1), Subcycle::Execute, pc, word);
        }
        None
    }
}
