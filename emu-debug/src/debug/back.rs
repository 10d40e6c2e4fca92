//! Backwards: from the nearest copy before the wanted position, forwards again.

use std::collections::BTreeSet;
use std::time::Instant;

use emu_core::cpu::{END_OF_TIME, Stop};

use super::eyes::{Eyes, candidates};
use super::flow::Flow;
use super::history::Left;
use super::line::Line;
use super::place::Place;
use super::points::{Points, What, code_points};
use super::session::{GoOn, Halt, Hit, STRETCH, Session, Why};
use super::target::{Look, Target};

/// Machine cycles that an instruction takes at most, in most cases.
const CYCLES: u64 = 8;

/// Steps that are made before somebody is asked whether to go on.
const UNASKED: u64 = 1 << 16;

/// Steps back of which each position is noted, and cycles that a search looks at first.
const NEAR: u64 = 1 << 12;

/// A position that a search backwards comes by. In the stretches between two copies it goes forwards.
pub struct Passed<'a> {
    /// The machine.
    pub target: &'a dyn Target,
    /// The first position of a stretch: what went before is unknown, and the answer does not count.
    pub first: bool,
    /// What the instruction that led here did to the stack of calls.
    pub flow: Flow,
    /// Program word of that instruction.
    pub from: u32,
}

impl Session {
    /// Goes `n` steps back, or to the beginning of the history. From within a step the first leads to where that begins; as many
    /// steps forward right afterwards end there again.
    /// Far back it goes a stretch between two copies at a time, and asks `go_on` in between; interrupted it stays.
    pub fn back_stepi(&mut self, n: u64, go_on: GoOn<'_>) -> Halt {
        let now = self.line.cycle();
        let left = self.left.filter(|left| left.stands == now).map(|left| left.at);
        let at = if self.line.settled { left } else { Some(now) };
        let halt = if n > NEAR { self.back_far(n, go_on) } else { self.back(n) };
        if halt.why == Why::Interrupted {
            return halt;
        }
        self.left = at.map(|at| Left { at, stands: self.line.cycle() });
        halt
    }

    /// Goes `n` steps back, and forgets from where.
    fn back(&mut self, n: u64) -> Halt {
        let now = self.line.cycle();
        let wanted = usize::try_from(n).unwrap_or(usize::MAX);
        let mut reach = n.saturating_mul(CYCLES).max(CYCLES);
        loop {
            let from = now.saturating_sub(reach).max(self.history.first_cycle());
            let Some(mut line) = self.replayed(from) else { return Halt { why: Why::Beginning } };
            let begins = line.cycle() <= self.history.first_cycle();
            let base = line.fork();
            // Where a run was stopped by its limit may be in the middle of a sleep; where a step ends is a position.
            let mut found: Vec<u64> = if begins { vec![line.cycle()] } else { Vec::new() };
            self.positions(&mut line, now, &mut |line| found.push(line.cycle()));
            found.retain(|cycle| *cycle < now);
            if found.len() >= wanted || begins {
                let enough = found.len() >= wanted;
                let to = found.get(found.len().saturating_sub(wanted)).copied();
                let Some(to) = to else { return Halt { why: Why::Beginning } };
                self.line = base;
                self.step_to(to);
                return Halt { why: if enough { Why::Done } else { Why::Beginning } };
            }
            reach = reach.saturating_mul(8);
        }
    }

    /// As [`Session::back`], for many: positions are counted, not noted.
    fn back_far(&mut self, n: u64, go_on: GoOn<'_>) -> Halt {
        let (now, first) = (self.line.cycle(), self.history.first_cycle());
        let starts: Vec<u64> = self.history.before(now).map(Line::cycle).collect();
        let (mut end, mut rest) = (now, n);
        for start in starts {
            let Some(base) = self.replayed(start) else { break };
            let begins = base.cycle() <= first;
            let mut positions = u64::from(begins && base.cycle() < now);
            self.positions(&mut base.fork(), end, &mut |line| positions += u64::from(line.cycle() < now));
            if positions >= rest {
                // So many positions of this stretch are passed over.
                let (mut before, mut found) = (positions - rest, None);
                let mut tell = |line: &Line| {
                    if before == 0 {
                        found.get_or_insert(line.cycle());
                    }
                    before = before.saturating_sub(1);
                };
                if begins {
                    tell(&base);
                }
                self.positions(&mut base.fork(), end, &mut tell);
                self.line = base;
                self.step_to(found.unwrap_or(start));
                return Halt { why: Why::Done };
            }
            rest -= positions;
            end = start;
            if !go_on() {
                return Halt { why: Why::Interrupted };
            }
        }
        if let Some(line) = self.replayed(first) {
            self.arrive(line);
        }
        Halt { why: Why::Beginning }
    }

    /// Goes to a cycle, in the past or in the future, or where an instruction spans it to the position before that; points are passed
    /// over.
    pub fn goto_cycle(&mut self, cycle: u64, go_on: GoOn<'_>) -> Halt {
        let (cycle, first) = (cycle.min(END_OF_TIME), self.history.first_cycle());
        if cycle >= self.line.cycle() {
            let points = std::mem::take(&mut self.points);
            let goal = super::Goal { until: Some(cycle), passes: true, ..super::Goal::default() };
            let halt = self.run(&goal, go_on);
            self.points = points;
            if halt.why != Why::Limit {
                return halt;
            }
        } else if let Some(line) = self.replayed(cycle.max(first)) {
            self.arrive(line);
        }
        // It has overshot: then it goes to where the step before that ended. In sleep it stays at the cycle.
        if self.line.cycle() > first.max(cycle) {
            let now = self.line.cycle();
            self.back(1);
            self.step_to(cycle.min(now));
        }
        Halt { why: if cycle < first { Why::Beginning } else { Why::Done } }
    }

    /// Goes back to the last position at which a run forwards would have been stopped by a point. Counts to be ignored do not
    /// matter, conditions do.
    pub fn back_run(&mut self, go_on: GoOn<'_>) -> Halt {
        let points = self.points.clone();
        match self.last_hit(&points, false, go_on) {
            Err(why) => Halt { why },
            Ok(Some((line, hits))) => {
                self.arrive(line);
                Halt { why: Why::Points(hits) }
            }
            Ok(None) => {
                if let Some(line) = self.replayed(self.history.first_cycle()) {
                    self.arrive(line);
                }
                Halt { why: Why::Beginning }
            }
        }
    }

    /// The last time up to now that one of `wanted` was accessed or changed, the instruction that ended here counted: the cycle behind that instruction, and what was seen.
    /// The machine stays where it is.
    ///
    /// # Errors
    /// [`Why::Interrupted`] where `go_on` said so.
    pub fn last(&mut self, wanted: What, go_on: GoOn<'_>) -> Result<Option<(u64, Hit)>, Why> {
        let mut points = Points::default();
        points.add(wanted, "", false);
        let found = self.last_hit(&points, true, go_on)?;
        Ok(found.and_then(|(line, hits)| Some((line.cycle(), *hits.first()?))))
    }

    /// What a place was at a cycle, behind what was done from outside then. The machine stays where it is.
    #[must_use]
    pub fn value_at(&self, place: Place, cycle: u64) -> Option<i64> {
        place.value(&*self.replayed(cycle)?.target)
    }

    /// The program word of the step that ends at a cycle. The machine stays where it is.
    #[must_use]
    pub fn writer(&self, cycle: u64) -> Option<u32> {
        let mut reach = CYCLES;
        loop {
            let from = cycle.saturating_sub(reach).max(self.history.first_cycle());
            let mut line = self.replayed(from)?;
            let mut pc = None;
            while line.cycle() < cycle {
                pc = Some(line.target.pc());
                if line.step(&self.history.deeds, cycle, Look::Nothing, &mut ()) != Stop::Limit {
                    break;
                }
            }
            if pc.is_some() || from <= self.history.first_cycle() {
                return pc;
            }
            reach = reach.saturating_mul(8);
        }
    }

    /// Goes back to the last position before this one at which `test` holds. A stretch is what lies between two copies, or less: near
    /// ones are looked at before those behind them. `ended` is asked behind each; with false the search is over, and the machine stays.
    pub fn back_until(
        &mut self,
        go_on: GoOn<'_>,
        ended: &mut dyn FnMut() -> bool,
        test: &mut dyn FnMut(&Passed<'_>) -> bool,
    ) -> Halt {
        let now = self.line.cycle();
        let (mut end, mut reach) = (now, NEAR);
        loop {
            let copy = self.history.before(end).next().map(Line::cycle);
            let Some(copy) = copy else { break };
            let Some(base) = self.replayed(end.saturating_sub(reach).max(copy)) else { break };
            reach = reach.saturating_mul(8);
            if base.cycle() >= end {
                continue;
            }
            let mut line = base.fork();
            let mut found = None;
            let first = Passed { target: &*line.target, first: true, flow: Flow::Plain, from: line.target.pc() };
            test(&first);
            line.set_traps(&BTreeSet::new());
            let mut steps = 0u64;
            while line.cycle() < end {
                let from = line.target.pc();
                let flow = self.flow_on(&line, from);
                let stop = line.step(&self.history.deeds, end, Look::Nothing, &mut ());
                let passed = Passed { target: &*line.target, first: false, flow, from };
                if line.settled && test(&passed) && line.cycle() < now {
                    found = Some(line.cycle());
                }
                if stop != Stop::Limit {
                    break;
                }
                steps += 1;
                if steps.is_multiple_of(UNASKED) && !go_on() {
                    return Halt { why: Why::Interrupted };
                }
            }
            if let Some(cycle) = found {
                self.line = base;
                self.step_to(cycle);
                return Halt { why: Why::Done };
            }
            if !(ended() && go_on()) {
                return Halt { why: Why::Interrupted };
            }
            end = base.cycle();
        }
        if let Some(line) = self.replayed(self.history.first_cycle()) {
            self.arrive(line);
        }
        Halt { why: Why::Beginning }
    }

    fn flow_on(&self, line: &Line, pc: u32) -> Flow {
        let chip = self.scope.chip();
        super::flow(chip, |word| super::session::word(&*line.target, word), pc).0
    }

    /// The last position before this one at which points would have stopped a run. The past is run through once, its newest stretches
    /// first, and more of them at a time the further it goes back: setting breakpoints in a copy costs as much as a stretch.
    fn last_hit(&mut self, points: &Points, here_too: bool, go_on: GoOn<'_>) -> Result<Option<(Line, Vec<Hit>)>, Why> {
        let now = self.line.cycle();
        let mut end = now;
        let starts: Vec<u64> = self.history.before(now).map(Line::cycle).collect();
        let mut left = starts.as_slice();
        let mut count = 1;
        while !left.is_empty() {
            let (stretches, older) = left.split_at(count.min(left.len()));
            // A copy that stands at a breakpoint does not see it; the stretch before comes to it.
            let reach = if end < now { end + 1 } else { end };
            let mut bounds: Vec<u64> = stretches.iter().rev().copied().chain([reach]).collect();
            // Once to find the cycle of the last, once to stop there.
            let mut last: Option<(u64, u64)> = None;
            self.hits_on(&bounds, points, go_on, &mut |line, _| {
                let at = line.cycle();
                if at <= end && (at < now || here_too && at == now) {
                    last = Some((at, last.filter(|last| last.0 == at).map_or(1, |last| last.1 + 1)));
                }
                true
            })?;
            if let Some((at, nth)) = last {
                let behind = bounds.partition_point(|bound| *bound < at).saturating_sub(1);
                for from in [behind, 0] {
                    let (mut seen, mut hit) = (0, Vec::new());
                    let line = self.hits_on(&bounds[from..], points, go_on, &mut |line, hits| {
                        seen += u64::from(line.cycle() == at);
                        hit = hits;
                        seen < nth && line.cycle() <= at
                    })?;
                    if let Some(line) = line.filter(|_| seen == nth) {
                        return Ok(Some((line, hit)));
                    }
                }
            }
            end = bounds.swap_remove(0);
            left = older;
            count = count.saturating_mul(2);
        }
        Ok(None)
    }

    /// Runs from the first of these cycles to the last, and tells each time that points would have stopped the machine, until that is
    /// answered with false. All but the last are cycles of copies.
    fn hits_on(
        &self,
        bounds: &[u64],
        points: &Points,
        go_on: GoOn<'_>,
        tell: &mut dyn FnMut(&Line, Vec<Hit>) -> bool,
    ) -> Result<Option<Line>, Why> {
        let words: BTreeSet<u32> = code_points(points).collect();
        let Some(mut line) = bounds.first().and_then(|start| self.replayed(*start)) else { return Ok(None) };
        let mut eyes = Eyes::new(points, &*line.target);
        let mut left_start = !words.contains(&line.target.pc()) || line.target.sleeps();
        let mut slice = UNASKED;
        for &end in bounds.iter().skip(1) {
            while line.cycle() < end {
                let (deeds, start) = (&self.history.deeds, Instant::now());
                line.set_traps(&words);
                let stop = if left_start {
                    let until = end.min(line.cycle().saturating_add(slice));
                    line.run(deeds, until.min(line.due(deeds)), &words, eyes.look(), &mut eyes)
                } else {
                    left_start = true;
                    line.step(deeds, end, eyes.look(), &mut eyes)
                };
                let sights = std::mem::take(&mut eyes.seen);
                let changes = eyes.changed(&*line.target);
                let mut hits = candidates(points, &*line.target, &sights, &changes, stop);
                hits.retain(|hit| points.get(hit.id).is_some_and(|point| point.holds(&*line.target)));
                if !hits.is_empty() && !tell(&line, hits) {
                    return Ok(Some(line));
                }
                if !matches!(stop, Stop::Limit | Stop::Trap { .. } | Stop::Probe) {
                    break;
                }
                // What was jumped over when the machine ran first may be long when it is looked at.
                slice = match start.elapsed() < STRETCH.end {
                    true if stop == Stop::Limit => slice.saturating_mul(2),
                    true => slice,
                    false => UNASKED,
                };
                if !go_on() {
                    return Err(Why::Interrupted);
                }
            }
            if !go_on() {
                return Err(Why::Interrupted);
            }
            // What could not be carried out ended the run there, too, until something was done from outside.
            if line.cycle() < end && bounds.last() != Some(&end) {
                let Some(next) = self.replayed(end) else { return Ok(None) };
                line = next;
                eyes = Eyes::new(points, &*line.target);
                left_start = !words.contains(&line.target.pc()) || line.target.sleeps();
            }
        }
        Ok(Some(line))
    }

    /// A copy of the machine as it was at a cycle, or at the first boundary behind it.
    fn replayed(&self, cycle: u64) -> Option<Line> {
        let mut line = self.history.at(cycle)?.fork();
        let none = BTreeSet::new();
        line.set_traps(&none);
        line.insists = true;
        if line.cycle() < cycle {
            line.run(&self.history.deeds, cycle, &none, Look::Nothing, &mut ());
        }
        line.do_due(&self.history.deeds, Look::Nothing, &mut ());
        Some(line)
    }

    /// Steps a copy up to a cycle, and tells of each position behind its first.
    fn positions(&self, line: &mut Line, end: u64, tell: &mut dyn FnMut(&Line)) {
        line.set_traps(&BTreeSet::new());
        while line.cycle() < end {
            let stop = line.step(&self.history.deeds, end, Look::Nothing, &mut ());
            if line.settled {
                tell(line);
            }
            if stop != Stop::Limit {
                return;
            }
        }
    }

    /// Steps the machine itself on as long as it comes to no later cycle.
    fn step_to(&mut self, cycle: u64) {
        self.line.set_traps(&BTreeSet::new());
        let mut scout = self.line.fork();
        let mut steps = 0u64;
        while scout.cycle() < cycle {
            let stop = scout.step(&self.history.deeds, cycle, Look::Nothing, &mut ());
            if scout.cycle() > cycle || !scout.settled && scout.cycle() >= cycle || stop != Stop::Limit {
                break;
            }
            steps += 1;
        }
        for _ in 0..steps {
            self.line.step(&self.history.deeds, cycle, Look::Nothing, &mut ());
        }
        self.left = None;
        self.forget_events();
    }

    fn arrive(&mut self, line: Line) {
        self.line = line;
        self.left = None;
        self.forget_events();
    }
}
