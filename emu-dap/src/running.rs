//! Steps and runs, forwards and back. A run is plain data, so that it can be interrupted for a request and go on behind it.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

use emu_core::cpu::END_OF_TIME;
use emu_debug::debug::{Flow, Goal, Halt, Session, What, Why, flow};

use crate::adapter::Adapter;

/// How long a run goes on before what it has sent is told.
const SLICE: Duration = Duration::from_millis(20);

/// Machine cycles in which it shows whether a jump to itself is the end.
const WAIT: u64 = 16;

/// Asked now and then whether to go on.
type GoOn<'a> = &'a mut dyn FnMut() -> bool;

/// A run that was asked for, and what is left of it.
#[derive(Debug, Clone)]
pub(crate) enum Run {
    /// Until something stops it.
    On,
    /// Some instructions.
    Steps(u64),
    /// Until a call has returned.
    Over(Over),
    /// To another source line, or out of a function.
    Walk(Walk),
    /// To one of these program words, some times.
    To(BTreeSet<u32>, u64),
    /// To a cycle, forwards or back.
    Cycle(u64),
    /// Back to the last point.
    BackOn,
    /// Some instructions back.
    BackSteps(u64),
    /// Back to one of these program words, some times.
    BackTo(BTreeSet<u32>, u64),
    /// Back to the beginning of a source line.
    BackLine(BackLine),
}

/// A call, or an interrupt, that is to return.
#[derive(Debug, Clone)]
pub(crate) struct Over {
    /// To this program word.
    ret: u32,
    /// With the stack as deep as this, or less.
    depth: u32,
}

impl Over {
    /// The call that stands at the program counter, if one does.
    pub fn here(session: &mut Session) -> Option<Over> {
        let (pc, depth) = (session.target().pc(), session.target().depth());
        let (flow, len) = session.flow(pc);
        (flow == Flow::Call).then_some(Over { ret: pc.wrapping_add(len), depth })
    }

    fn slice(&self, session: &mut Session, go_on: GoOn<'_>) -> Halt {
        let goal = Goal { words: BTreeSet::from([self.ret]), ..Goal::default() };
        loop {
            let halt = session.run(&goal, go_on);
            if halt.why != Why::Done || self.is_done(session) {
                return halt;
            }
        }
    }

    fn is_done(&self, session: &Session) -> bool {
        session.target().pc() == self.ret && session.target().depth() <= self.depth
    }
}

/// Where a walk through a function goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// To the next line, also into functions that have lines.
    Into,
    /// To the next line of this function or of its caller.
    Next,
    /// Behind the return of this function.
    Out,
}

/// Steps through one function; what it calls, and interrupts, are passed as a whole.
#[derive(Debug, Clone)]
pub(crate) struct Walk {
    kind: Kind,
    /// The line and the program word at which it began.
    line: Option<(Arc<str>, u32)>,
    start: u32,
    /// Program counter and depth before the step that comes.
    here: (u32, u32),
    /// What is being passed.
    over: Option<Over>,
    /// It stands at a jump to itself, which only an interrupt ends.
    stuck: bool,
    done: bool,
}

impl Walk {
    pub fn new(kind: Kind, session: &Session) -> Walk {
        let here = (session.target().pc(), session.target().depth());
        let line = session.scope.source().line_at(here.0).map(|line| (Arc::clone(&line.file), line.line));
        Walk { kind, line, start: here.0, here, over: None, stuck: false, done: false }
    }

    fn slice(&mut self, session: &mut Session, go_on: GoOn<'_>) -> Halt {
        loop {
            if let Some(over) = &self.over {
                let halt = over.slice(session, go_on);
                let returned = halt.why == Why::Done || over.is_done(session);
                if returned {
                    self.over = None;
                    self.here = (session.target().pc(), session.target().depth());
                    self.done = self.arrived(session);
                }
                if self.done || !returned || halt.why != Why::Done {
                    return halt;
                }
            }
            let halt =
                session.stroll(END_OF_TIME, true, go_on, &mut |session, flow, irq| self.step(session, flow, irq));
            if self.done || halt.why != Why::Done {
                return halt;
            }
            if std::mem::take(&mut self.stuck) {
                let (before, until) = (self.here, session.target().cycle().saturating_add(WAIT));
                let halt = session.run(&Goal { until: Some(until), ..Goal::default() }, go_on);
                self.here = (session.target().pc(), session.target().depth());
                // An interrupt may have come meanwhile.
                if self.here.1 > before.1 {
                    self.over = Some(Over { ret: before.0, depth: before.1 });
                }
                if halt.why != Why::Limit {
                    return halt;
                }
            }
        }
    }

    /// A step was made: true ends the stroll, with something to pass or because it is done.
    fn step(&mut self, session: &Session, flow_of: Flow, irq: bool) -> bool {
        let target = session.target();
        let before = std::mem::replace(&mut self.here, (target.pc(), target.depth()));
        let pc = self.here.0;
        let ret = if irq {
            before.0
        } else if flow_of == Flow::Call {
            before.0.wrapping_add(flow(session.scope.chip(), |word| session.word(word), before.0).1)
        } else {
            self.done = if flow_of == Flow::Return && self.kind == Kind::Out { true } else { self.arrived(session) };
            self.stuck = pc == before.0 && !self.done;
            return self.done || self.stuck;
        };
        // Compilers call the next instruction to make room on the stack.
        if pc == ret {
            self.done = self.arrived(session);
        } else if !irq && self.kind == Kind::Into && session.scope.source().line_at(pc).is_some() {
            self.done = true;
        } else {
            self.over = Some(Over { ret, depth: before.1 });
            return true;
        }
        self.done
    }

    /// It stands where the code of another line begins, or has come round to where it was.
    fn arrived(&self, session: &Session) -> bool {
        let pc = session.target().pc();
        let source = session.scope.source();
        let line = source.line_at(pc);
        let begins = |addr: u32| addr == pc.saturating_mul(session.scope.chip().word_bytes);
        let other = |file: &str, line: u32| self.line.as_ref().is_none_or(|here| (&*here.0, here.1) != (file, line));
        self.kind != Kind::Out
            && line.is_some_and(|line| begins(line.addr) && (other(&line.file, line.line) || pc == self.start))
    }
}

/// The way back to the beginning of a line of this function or of a caller.
#[derive(Debug, Clone)]
pub(crate) struct BackLine {
    line: Option<(Arc<str>, u32)>,
    /// The step began in the middle of its line, which then may be the one to come to.
    within: bool,
    depth: u32,
    /// Bytes of program memory of this function.
    function: std::ops::Range<u32>,
}

impl BackLine {
    pub fn new(session: &Session) -> BackLine {
        let (target, source) = (session.target(), session.scope.source());
        let chip = session.scope.chip();
        let byte = target.pc().saturating_mul(chip.word_bytes);
        let line = source.line_at(target.pc());
        let covers = |symbol: &&emu_core::image::SymbolAt| {
            symbol.space == chip.code && (symbol.addr..symbol.addr.saturating_add(symbol.size)).contains(&byte)
        };
        let function = session.scope.symbols.iter().find(covers);
        BackLine {
            within: line.is_some_and(|line| line.addr != byte),
            line: line.map(|line| (Arc::clone(&line.file), line.line)),
            depth: target.depth(),
            function: function.map_or(0..0, |symbol| symbol.addr..symbol.addr.saturating_add(symbol.size)),
        }
    }

    fn slice(&self, session: &mut Session, go_on: GoOn<'_>) -> Halt {
        let scope = session.scope.clone();
        let source = scope.source();
        session.back_until(go_on, &mut || true, &mut |passed| {
            let (pc, depth) = (passed.target.pc(), passed.target.depth());
            let byte = pc.saturating_mul(scope.chip().word_bytes);
            let here = self.line.as_ref().map(|line| (&*line.0, line.1));
            source.line_at(pc).is_some_and(|line| {
                !passed.first
                    && line.addr == byte
                    && (self.within || here != Some((&*line.file, line.line)))
                    && (depth <= self.depth || self.function.contains(&byte))
            })
        })
    }
}

impl Run {
    /// Runs on for as long as `go_on` says so.
    fn slice(&mut self, session: &mut Session, go_on: GoOn<'_>) -> Halt {
        match self {
            Run::On => session.run(&Goal::default(), go_on),
            Run::Steps(left) => session.steps(left, END_OF_TIME, true, go_on),
            Run::Over(over) => over.slice(session, go_on),
            Run::Walk(walk) => walk.slice(session, go_on),
            Run::To(words, left) => {
                let goal = Goal { words: words.clone(), ..Goal::default() };
                loop {
                    let halt = session.run(&goal, go_on);
                    if halt.why != Why::Done {
                        return halt;
                    }
                    *left = left.saturating_sub(1);
                    if *left == 0 {
                        return halt;
                    }
                }
            }
            Run::Cycle(cycle) => session.goto_cycle(*cycle, go_on),
            Run::BackOn => session.back_run(go_on),
            Run::BackSteps(n) => session.back_stepi(*n, &mut || true),
            Run::BackLine(line) => line.slice(session, go_on),
            Run::BackTo(words, left) => {
                let own = session.points.add(What::Code(words.iter().copied().collect()), "", false);
                let halt = loop {
                    let halt = session.back_run(go_on);
                    let Why::Points(mut hits) = halt.why else { break halt };
                    let wanted = hits.iter().any(|hit| hit.id == own);
                    hits.retain(|hit| hit.id != own);
                    *left = left.saturating_sub(u64::from(wanted));
                    if !hits.is_empty() {
                        break Halt { why: Why::Points(hits) };
                    }
                    if *left == 0 {
                        break Halt { why: Why::Done };
                    }
                };
                session.points.remove(own);
                halt
            }
        }
    }

    /// It has come to where it was to come, though a point stood there that did not stop it.
    fn arrived(&mut self, session: &Session) -> bool {
        match self {
            Run::Steps(left) => *left == 0,
            Run::Over(over) => over.is_done(session),
            Run::Walk(walk) => walk.done,
            Run::To(words, left) => {
                *left = left.saturating_sub(u64::from(words.contains(&session.target().pc())));
                *left == 0
            }
            _ => false,
        }
    }

    fn is_backwards(&self) -> bool {
        matches!(self, Run::BackOn | Run::BackSteps(_) | Run::BackTo(..) | Run::BackLine(_) | Run::Cycle(_))
    }
}

impl Adapter<'_> {
    /// A slice of the run that was asked for.
    pub(crate) fn advance(&mut self, go_on: GoOn<'_>) {
        let (Some(mut run), Some(machine)) = (self.run.take(), self.machine.as_mut()) else { return };
        let (back, end) = (run.is_backwards(), Instant::now() + SLICE);
        let silent = if back { self.points.silenced(&mut machine.session) } else { Vec::new() };
        // A search backwards begins anew when it is interrupted, so it is left alone as long as nobody wants anything.
        let halt = run.slice(&mut machine.session, &mut || (back || Instant::now() < end) && go_on());
        self.points.sound(&mut machine.session, &silent);
        machine.listing = None;
        machine.parts.borrow_mut().clear();
        self.tell_events();
        match halt.why {
            Why::Interrupted => self.run = Some(run),
            Why::Points(hits) if !back => {
                let hits = self.counting(hits);
                let Some(machine) = &self.machine else { return };
                if !hits.is_empty() {
                    self.stopped(self.stop_of(&Why::Points(hits)));
                } else if run.arrived(&machine.session) {
                    self.stopped(self.stop_of(&Why::Done));
                } else {
                    self.run = Some(run);
                }
            }
            why => self.stopped(self.stop_of(&why)),
        }
    }
}
