//! A session: a machine, where it has been, and what stops it.

use std::collections::{BTreeSet, HashMap};
use std::time::{Duration, Instant};

use emu_core::chip::Family;
use emu_core::cpu::{END_OF_TIME, Fault, Stop};
use emu_core::state::Damaged;

use super::amount::Amount;
use super::events::Events;
use super::expr::Expr;
use super::eyes::{Eyes, Sight, candidates};
use super::flow::{Flow, flow};
use super::history::{Action, History, Left};
use super::line::{Follow, Line};
use super::points::{Points, code_points};
use super::scope::Scope;
use super::target::{Look, Target};
use crate::time::Clock;

/// How long a stretch of a run takes between two copies, on the host.
pub(super) const STRETCH: std::ops::Range<Duration> = Duration::from_micros(300)..Duration::from_millis(1);

/// Machine cycles of a stretch.
const CYCLES: std::ops::RangeInclusive<u64> = 1 << 10..=1 << 40;

/// Machine cycles of the first stretch, and of the last of a program that waits: by then it stands in its waiting loop.
pub(super) const SHORT: u64 = 1 << 12;

/// Steps in which a controller at rest comes round: two program cycles of all that its memory holds.
const ROUND: u32 = 2 << 12;

/// What a session begins with.
pub struct Options {
    /// How long a cycle is.
    pub clock: Clock,
    /// Bytes that copies of the machine may take.
    pub history: usize,
    /// Who follows the program, such as a ladder view.
    pub follow: Option<Box<dyn Follow>>,
}

/// Where a run is to stop, besides at points.
#[derive(Debug, Clone, Default)]
pub struct Goal {
    /// At this machine cycle at the latest.
    pub until: Option<u64>,
    /// Before one of these program words.
    pub words: BTreeSet<u32>,
    /// Time passes up to that cycle even where nothing can wake the chip, instead of [`Why::Halted`].
    pub passes: bool,
}

/// What a point has seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hit {
    /// Number of the point.
    pub id: u32,
    /// The value before, of a watched expression.
    pub old: Option<i64>,
    /// The value now; of an access the byte read or written.
    pub new: Option<i64>,
    /// Of an access: a write.
    pub write: Option<bool>,
    /// Program word of the instruction that did it; of a breakpoint the one that is next.
    pub pc: u32,
}

/// Why the machine stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Why {
    /// What was asked for is done.
    Done,
    /// Points have stopped it.
    Points(Vec<Hit>),
    /// The cycle asked for was reached.
    Limit,
    /// Nothing can wake the chip any more.
    Halted,
    /// Only something from outside can change what the program does: it waits for a pin, or sleeps with its receiver open.
    Waits,
    /// No instruction.
    Illegal {
        /// Program word address.
        pc: u32,
        /// The word there.
        word: u16,
    },
    /// The program did what cannot be carried out.
    Fault {
        /// Program word address.
        pc: u32,
        /// What it was.
        fault: Fault,
    },
    /// The user has interrupted it.
    Interrupted,
    /// Going back: the history begins here.
    Beginning,
}

/// How a command of the session has ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Halt {
    /// Why.
    pub why: Why,
}

/// A machine under the debugger.
pub struct Session {
    pub(super) line: Line,
    pub(super) history: History,
    pub(super) left: Option<Left>,
    /// Who follows a program of which nothing is known yet, and the bytes that copies may take: for another history.
    first: (Option<Box<dyn Follow>>, usize),
    /// Breakpoints and watchpoints.
    pub points: Points,
    /// Names.
    pub scope: Scope,
    clock: Clock,
    pub(super) events: Events,
    /// Cycles of the next stretch.
    stretch: u64,
    flows: HashMap<u32, (u16, Flow, u32)>,
}

/// Asked now and then whether to go on.
pub(super) type GoOn<'a> = &'a mut dyn FnMut() -> bool;

impl Session {
    /// A session with a machine as it is now, which is where its history begins.
    #[must_use]
    pub fn new(target: Box<dyn Target>, scope: Scope, options: Options) -> Session {
        let first = (options.follow.as_ref().map(|follow| follow.fork()), options.history);
        let line = Line::new(target, options.follow);
        Session {
            first,
            history: History::new(&line, options.history),
            line,
            left: None,
            points: Points::default(),
            scope,
            clock: options.clock,
            events: Events::default(),
            stretch: 1 << 14,
            flows: HashMap::new(),
        }
    }

    /// The machine now.
    #[must_use]
    pub fn target(&self) -> &dyn Target {
        &*self.line.target
    }

    /// Who follows the program.
    #[must_use]
    pub fn follow(&self) -> Option<&dyn Follow> {
        self.line.follow.as_deref()
    }

    /// A step has ended here; else a limit, or the user, has stopped a run in the middle of one, such as in sleep.
    #[must_use]
    pub fn settled(&self) -> bool {
        self.line.settled
    }

    /// How long a cycle is.
    #[must_use]
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Scans begun since power-up, or since the state that was loaded last, where the program has scans.
    #[must_use]
    pub fn scan(&self) -> Option<u64> {
        self.line.follow.as_ref().and_then(|follow| follow.scan())
    }

    /// Copies of the machine that are kept, and the bytes that they take.
    #[must_use]
    pub fn history_size(&self) -> (usize, usize) {
        self.history.size()
    }

    /// The cycle at which the history begins: there is no way back behind it.
    #[must_use]
    pub fn first_cycle(&self) -> u64 {
        self.history.first_cycle()
    }

    /// What was done from outside, in order, each with the cycle at which the machine stood.
    pub fn deeds(&self) -> impl Iterator<Item = (u64, &Action)> {
        self.history.deeds.iter().map(|deed| (deed.cycle, &deed.action))
    }

    /// Does something from outside, now. What was to come in this history is forgotten.
    ///
    /// # Errors
    /// The machine cannot: one sentence; nothing has changed.
    pub fn act(&mut self, action: Action) -> Result<(), String> {
        // A part of it may have been done when it fails.
        let before = self.line.target.fork();
        let mut eyes = Eyes::new(&Points::default(), &*before);
        eyes.events = Some(std::mem::take(&mut self.events));
        let done = self.line.apply(&action, Look::Events, &mut eyes);
        self.events = eyes.events.take().unwrap_or_default();
        if let Err(why) = done {
            self.line.target = before;
            return Err(why);
        }
        self.history.branch(&self.line, action);
        self.left = None;
        self.line.done = self.history.deeds.len();
        Ok(())
    }

    /// Gives what an expression stands for another value: a place, or an object of C that lies in several.
    ///
    /// # Errors
    /// It has no place, or not this value.
    pub fn assign(&mut self, expr: &Expr, value: Amount) -> Result<(), String> {
        let object = expr.object().filter(|object| object.needs_parts(self.target()));
        let writes = match (object, expr.place(self.target())) {
            (Some(object), _) => object.writes(self.target(), value)?,
            (None, Some(place)) => vec![(place, value.whole())],
            (None, None) => return Err("it is no place that can be set".to_owned()),
        };
        writes.into_iter().try_for_each(|(place, value)| self.act(Action::Set(place, value)))
    }

    /// Whether the machine can be saved and loaded.
    ///
    /// # Errors
    /// It cannot, since what stands at its pins has a state of its own: one sentence.
    pub fn bare(&self) -> Result<(), String> {
        const DEVICES: &str = "the devices at its pins have a state of their own, which no snapshot holds";
        if self.line.target.is_bare() { Ok(()) } else { Err(DEVICES.to_owned()) }
    }

    /// The state of the machine now, for [`Session::load`]: of the chip alone ([`Session::bare`]).
    #[must_use]
    pub fn save(&self) -> Vec<u8> {
        self.line.target.save()
    }

    /// Makes the chip the one whose state this is, at the machine cycle `cycle`. A history begins there; points stay, and who follows
    /// the program begins anew.
    ///
    /// # Errors
    /// It is no state of this chip at that cycle; nothing has changed.
    pub fn load(&mut self, state: &[u8], cycle: u64) -> Result<(), Damaged> {
        let mut target = self.line.target.fork();
        target.restore(state)?;
        if target.cycle() != cycle {
            return Err(Damaged);
        }
        self.line = Line::new(target, self.first.0.as_ref().map(|follow| follow.fork()));
        self.history = History::new(&self.line, self.first.1);
        self.left = None;
        self.events = Events::default();
        self.flows.clear();
        Ok(())
    }

    /// Steps `n` instructions (entries of interrupts count as one each), or fewer where a watchpoint stops it. Sleep is passed, up to
    /// the cycle `limit`. A place within a step from which steps have led back ends one: so as many lead there again.
    pub fn stepi(&mut self, n: u64, limit: u64, go_on: GoOn<'_>) -> Halt {
        self.steps(&mut { n }, limit, false, go_on)
    }

    /// The same; `rest` is what is left of the steps, and with `breaks` breakpoints stop it too.
    pub fn steps(&mut self, rest: &mut u64, limit: u64, breaks: bool, go_on: GoOn<'_>) -> Halt {
        let stands = self.line.cycle();
        let mut left = self.left.take().filter(|left| left.stands == stands && left.at < limit);
        loop {
            let end = left.map_or(limit, |left| left.at);
            let halt = self.walk((end, breaks, false), &mut *go_on, &mut |_, _, _| {
                *rest = rest.saturating_sub(1);
                *rest == 0
            });
            let Some(passed) = left.take() else { return halt };
            let stands = self.line.cycle();
            self.left = (stands < passed.at).then_some(Left { stands, ..passed });
            if halt.why != Why::Limit {
                return halt;
            }
            *rest = rest.saturating_sub(u64::from(!self.line.settled));
            if *rest == 0 {
                return Halt { why: Why::Done };
            }
        }
    }

    /// Runs until a point, the goal, or the end of the program.
    pub fn run(&mut self, goal: &Goal, go_on: GoOn<'_>) -> Halt {
        let until = goal.until.unwrap_or(END_OF_TIME).min(END_OF_TIME);
        let words = code_points(&self.points).chain(goal.words.iter().copied()).collect::<BTreeSet<u32>>();
        let mut left_start = !words.contains(&self.line.target.pc()) || self.line.target.sleeps();
        let mut eyes = Eyes::new(&self.points, &*self.line.target);
        self.line.insists = goal.passes && goal.until.is_some();
        let (mut stretch, mut waits) = (SHORT.min(self.stretch), false);
        loop {
            if self.line.cycle() >= until {
                return Halt { why: Why::Limit };
            }
            let start = (Instant::now(), self.line.cycle());
            eyes.events = Some(std::mem::take(&mut self.events));
            let deeds = &self.history.deeds;
            // A step passes them.
            self.line.set_traps(&words);
            let stop = if left_start {
                let end = until.min(start.1.saturating_add(stretch)).min(self.line.due(deeds));
                self.line.run(deeds, end, &words, eyes.look(), &mut eyes)
            } else {
                left_start = true;
                let end = until.min(start.1.saturating_add(stretch));
                self.line.step(deeds, end, eyes.look(), &mut eyes)
            };
            let stop = if stop == Stop::Halted { self.rest(&words, until, &mut eyes) } else { stop };
            self.events = eyes.events.take().unwrap_or_default();
            let sights = std::mem::take(&mut eyes.seen);
            let changes = eyes.changed(&*self.line.target);
            if start.1 < self.line.cycle() {
                self.keep(start.0.elapsed(), self.line.cycle() - start.1);
            }
            let hits = self.hits(&sights, &changes, stop);
            if !hits.is_empty() {
                return Halt { why: Why::Points(hits) };
            }
            match stop {
                Stop::Trap { pc } if goal.words.contains(&pc) => return Halt { why: Why::Done },
                // With no end in sight the time of a program that waits would pass for ever, and in no time.
                Stop::Limit if goal.until.is_none() && self.waits() => match waits {
                    true => return Halt { why: Why::Waits },
                    false => (waits, stretch) = (true, SHORT),
                },
                Stop::Limit | Stop::Trap { .. } | Stop::Probe => (waits, stretch) = (false, self.stretch),
                stop => return Halt { why: ended(stop) },
            }
            // Whoever runs on from a word where it is to stop passes it: so it is not interrupted there before it was seen to stand there.
            let unseen = stop == Stop::Limit && words.contains(&self.line.target.pc());
            if !unseen && !go_on() {
                return Halt { why: Why::Interrupted };
            }
        }
    }

    /// What the instruction at a program word does to the stack of calls, and its length in program words.
    pub fn flow(&mut self, pc: u32) -> (Flow, u32) {
        let (chip, target) = (self.scope.chip(), &*self.line.target);
        let read = |word| self::word(target, word);
        let first = read(pc);
        match self.flows.get(&pc) {
            Some((known, flow, len)) if *known == first => (*flow, *len),
            _ => {
                let (flow, len) = flow(chip, read, pc);
                self.flows.insert(pc, (first, flow, len));
                (flow, len)
            }
        }
    }

    /// A word of program memory; 0 beyond its end.
    #[must_use]
    pub fn word(&self, word: u32) -> u16 {
        self::word(&*self.line.target, word)
    }

    /// A controller that has settled is called halted, since nothing it does makes a difference any more; but its programs run on. So
    /// where a word of the program is waited for, it is stepped on, for as long as it takes it to come round.
    fn rest(&mut self, words: &BTreeSet<u32>, until: u64, eyes: &mut Eyes) -> Stop {
        if self.scope.chip().family != Family::Ap101 || words.is_empty() {
            return Stop::Halted;
        }
        self.line.set_traps(words);
        for _ in 0..ROUND {
            match self.line.step_to_trap(&self.history.deeds, words, until, eyes.look(), eyes) {
                Stop::Limit if self.line.cycle() < until => {}
                stop => return stop,
            }
        }
        Stop::Halted
    }

    /// Keeps a copy of the machine as it is now, and makes the next stretch longer or shorter; one that was cut short tells nothing of
    /// how long a whole one takes.
    pub(super) fn keep(&mut self, took: Duration, cycles: u64) {
        if took >= STRETCH.end {
            self.stretch = (self.stretch / 2).max(*CYCLES.start());
        } else if took < STRETCH.start && cycles >= self.stretch {
            self.stretch = (self.stretch * 2).min(*CYCLES.end());
        }
        // Runs that were stopped early leave no copy each.
        if took >= STRETCH.start / 4 {
            self.history.keep(&self.line, took);
        }
    }

    /// The points that stop the machine here: what they saw, their conditions and counts considered.
    pub(super) fn hits(
        &mut self,
        sights: &[Sight],
        changes: &[(u32, Option<i64>, Option<i64>)],
        stop: Stop,
    ) -> Vec<Hit> {
        let target = &*self.line.target;
        let mut hits = candidates(&self.points, target, sights, changes, stop);
        hits.retain(|hit| {
            let Some(point) = self.points.get_mut(hit.id).filter(|point| point.holds(target)) else { return false };
            point.hits += 1;
            let passes = point.ignore > 0;
            point.ignore = point.ignore.saturating_sub(1);
            !passes
        });
        for hit in &hits {
            if self.points.get(hit.id).is_some_and(|point| point.temporary) {
                self.points.remove(hit.id);
            }
        }
        hits
    }

    /// Forgets events behind the present.
    pub(super) fn forget_events(&mut self) {
        self.events.forget(self.line.cycle());
    }
}

pub(super) fn ended(stop: Stop) -> Why {
    match stop {
        Stop::Illegal { pc, word } => Why::Illegal { pc, word },
        Stop::Fault { pc, fault } => Why::Fault { pc, fault },
        Stop::Halted => Why::Halted,
        Stop::Limit | Stop::Trap { .. } | Stop::Probe => Why::Limit,
    }
}

pub(super) fn word(target: &dyn Target, word: u32) -> u16 {
    let chip = target.chip();
    let byte = |n: u32| target.peek(chip.code, word.saturating_mul(chip.word_bytes).saturating_add(n)).unwrap_or(0);
    match chip.word_bytes {
        1 => byte(0).into(),
        _ => u16::from_le_bytes([byte(0), byte(1)]),
    }
}
