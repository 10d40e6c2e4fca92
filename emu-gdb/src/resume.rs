//! Running, stepping, going back, and what gdb is told of a stop.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::ops::Range;

use emu_core::cpu::{END_OF_TIME, Fault, Stop};
use emu_debug::debug::{Flow, Goal, Halt, Hit, Look, Session, What, Why};
use gdbstub::common::Signal;
use gdbstub::stub::SingleThreadStopReason;
use gdbstub::target::ext::base::reverse_exec::{
    ReplayLogPosition, ReverseCont, ReverseContOps, ReverseStep, ReverseStepOps,
};
use gdbstub::target::ext::base::singlethread::{
    SingleThreadRangeStepping, SingleThreadRangeSteppingOps, SingleThreadResume, SingleThreadSingleStep,
    SingleThreadSingleStepOps,
};

use crate::points::Asked;
use crate::stub::Stub;

/// What gdb wants of the program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Go {
    /// Run.
    On,
    /// One step.
    Step,
    /// Steps as long as the program counter is among these program words.
    Through(Range<u32>),
    /// Run backwards.
    Back,
    /// One step back.
    BackStep,
}

/// What gdb is told: the stop, and a line for the user where the stop alone does not say enough.
pub(crate) type Told = (SingleThreadStopReason<u32>, Option<String>);

impl Stub<'_> {
    /// Does what gdb wants, until something stops the program.
    pub(crate) fn run(&mut self) -> Told {
        let (session, input) = (&mut *self.session, &mut self.input);
        let since = session.target().cycle();
        let go_on = &mut || input.go_on();
        let halt = match self.go.clone() {
            Go::On => session.run(&Goal::default(), go_on),
            Go::Step => session.stepi(1, END_OF_TIME, go_on),
            Go::Through(words) => through(session, &words, go_on),
            Go::Back => back(session, go_on),
            Go::BackStep => session.back_stepi(1, &mut || true),
        };
        let (reason, text) = self.told(&halt.why);
        let resets = self.session.resets_since(since);
        let lines = |line: Option<String>| line.into_iter().chain(resets.clone()).collect::<Vec<_>>().join("; ");
        self.why = lines(Some(text.clone().unwrap_or_else(|| self.plain(&halt.why))));
        let text = lines(text);
        (reason, (!text.is_empty()).then_some(text))
    }

    fn told(&self, why: &Why) -> Told {
        use SingleThreadStopReason as Reason;
        let place = |pc: &u32| self.session.scope.source().place(*pc);
        let signal = |signal| Reason::SignalWithThread { tid: (), signal };
        match why {
            Why::Done | Why::Limit => (signal(Signal::SIGTRAP), None),
            Why::Interrupted => (signal(Signal::SIGINT), None),
            Why::Beginning => (Reason::ReplayLog { tid: None, pos: ReplayLogPosition::Begin }, None),
            Why::Points(hits) => (self.hit(hits), None),
            // Any signal but SIGTRAP ends a `step` of gdb's, which would go on for ever.
            Why::Halted => {
                (signal(Signal::SIGSTOP), Some("the program has ended: nothing can wake the chip any more".to_owned()))
            }
            Why::Waits => (
                signal(Signal::SIGSTOP),
                Some("only something from outside can change what the program does".to_owned()),
            ),
            Why::Illegal { pc, word } => {
                let text = format!("0x{word:04x} at {} is no instruction of this chip", place(pc));
                (signal(Signal::SIGILL), Some(text))
            }
            Why::Fault { pc, fault } => {
                let number = match fault {
                    Fault::UninitialisedRead { .. } => Signal::SIGSEGV,
                    Fault::LeavesProgram { .. } | Fault::NoEnd => Signal::SIGBUS,
                };
                (signal(number), Some(format!("{fault}, at {}", place(pc))))
            }
        }
    }

    /// The stop of points: a breakpoint goes before a watchpoint, whose access lies before it.
    fn hit(&self, hits: &[Hit]) -> SingleThreadStopReason<u32> {
        use SingleThreadStopReason as Reason;
        let mut set: Vec<_> = hits.iter().filter_map(|hit| self.set.iter().find(|set| set.id == hit.id)).collect();
        set.sort_by_key(|set| matches!(set.asked, Asked::Watch(..)));
        match set.first().map(|set| (set.asked, set.addr)) {
            Some((Asked::Soft, _)) => Reason::SwBreak(()),
            Some((Asked::Hard, _)) => Reason::HwBreak(()),
            Some((Asked::Watch(kind, _), addr)) => Reason::Watch { tid: (), kind, addr },
            // Not gdb's own.
            None => Reason::SignalWithThread { tid: (), signal: Signal::SIGTRAP },
        }
    }

    fn plain(&self, why: &Why) -> String {
        let place = self.session.scope.source().place(self.session.target().pc());
        match why {
            Why::Points(hits) if hits.iter().all(|hit| hit.write.is_none()) => format!("breakpoint at {place}"),
            Why::Points(hits) => {
                let by = hits.iter().find(|hit| hit.write.is_some());
                let value = by.and_then(|hit| hit.new).map_or_else(String::new, |new| format!(" of 0x{new:02x}"));
                let what = if by.and_then(|hit| hit.write) == Some(true) { "write" } else { "read" };
                let from = by.map_or_else(String::new, |hit| self.session.scope.source().place(hit.pc));
                format!("watchpoint: {what}{value} by {from}")
            }
            Why::Interrupted => format!("interrupted at {place}"),
            Why::Beginning => "the history begins here".to_owned(),
            _ => format!("a step has ended at {place}"),
        }
    }
}

/// Steps through a line. A service routine that comes in between runs to its end first. A jump to itself that nothing can end is
/// the end of the program, which single steps do not see.
fn through(session: &mut Session, words: &Range<u32>, go_on: &mut dyn FnMut() -> bool) -> Halt {
    let (mut depth, mut from) = (session.target().depth(), session.target().pc());
    let mut service: Option<u32> = None;
    let mut turns = 0u64;
    let mut halted = false;
    let halt = session.stroll(END_OF_TIME, true, go_on, &mut |session, flow, entered| {
        let target = session.target();
        match service {
            None if entered => service = Some(depth),
            Some(before) if flow == Flow::Return && target.depth() <= before => service = None,
            _ => {}
        }
        depth = target.depth();
        turns = if target.pc() == from { turns + 1 } else { 0 };
        from = target.pc();
        // Asked more and more seldom, as it may be long until an interrupt comes.
        halted = turns.is_power_of_two() && {
            let mut copy = target.fork();
            copy.set_traps(&BTreeSet::new());
            copy.run(target.cycle() + 1, Look::Nothing, &mut ()) == Stop::Halted
        };
        halted || service.is_none() && !words.contains(&target.pc())
    });
    if halted && halt.why == Why::Done { Halt { why: Why::Halted } } else { halt }
}

/// Runs backwards. The session stands behind the instruction that a watchpoint has seen; gdb wants to be before it, where the old
/// value is back.
fn back(session: &mut Session, go_on: &mut dyn FnMut() -> bool) -> Halt {
    if session.points.enabled().any(|point| !matches!(point.what, What::Code(_))) {
        // The instruction that has just been executed may be such a one.
        let now = session.target().cycle();
        if session.back_stepi(1, &mut || true).why == Why::Done
            && let Why::Points(hits) = session.stepi(1, now, &mut || true).why
        {
            return undo(session, hits);
        }
    }
    match session.back_run(go_on).why {
        Why::Points(hits) if !hits.iter().any(|hit| is_code(session, hit.id)) => undo(session, hits),
        why => Halt { why },
    }
}

/// Goes back before the instruction that a watchpoint has seen; a breakpoint may be on it.
fn undo(session: &mut Session, mut hits: Vec<Hit>) -> Halt {
    session.back_stepi(1, &mut || true);
    hits.extend(here(session));
    Halt { why: Why::Points(hits) }
}

fn is_code(session: &Session, id: u32) -> bool {
    session.points.get(id).is_some_and(|point| matches!(point.what, What::Code(_)))
}

/// Breakpoints on the instruction that is next.
fn here(session: &Session) -> Vec<Hit> {
    let pc = session.target().pc();
    let on = session.points.enabled().filter(|point| matches!(&point.what, What::Code(words) if words.contains(&pc)));
    on.map(|point| Hit { id: point.id, old: None, new: None, write: None, pc }).collect()
}

impl SingleThreadResume for Stub<'_> {
    fn resume(&mut self, _signal: Option<Signal>) -> Result<(), Infallible> {
        self.go = Go::On;
        Ok(())
    }
    fn support_single_step(&mut self) -> Option<SingleThreadSingleStepOps<'_, Self>> {
        Some(self)
    }
    fn support_range_step(&mut self) -> Option<SingleThreadRangeSteppingOps<'_, Self>> {
        Some(self)
    }
    fn support_reverse_step(&mut self) -> Option<ReverseStepOps<'_, (), Self>> {
        Some(self)
    }
    fn support_reverse_cont(&mut self) -> Option<ReverseContOps<'_, (), Self>> {
        Some(self)
    }
}

impl SingleThreadSingleStep for Stub<'_> {
    fn step(&mut self, _signal: Option<Signal>) -> Result<(), Infallible> {
        self.go = Go::Step;
        Ok(())
    }
}

impl SingleThreadRangeStepping for Stub<'_> {
    fn resume_range_step(&mut self, start: u32, end: u32) -> Result<(), Infallible> {
        let per_word = self.session.target().chip().word_bytes.max(1);
        self.go = Go::Through(start / per_word..end.div_ceil(per_word));
        Ok(())
    }
}

impl ReverseCont<()> for Stub<'_> {
    fn reverse_cont(&mut self) -> Result<(), Infallible> {
        self.go = Go::Back;
        Ok(())
    }
}

impl ReverseStep<()> for Stub<'_> {
    fn reverse_step(&mut self, (): ()) -> Result<(), Infallible> {
        self.go = Go::BackStep;
        Ok(())
    }
}
