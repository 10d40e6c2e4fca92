//! Steps by source lines, into or over calls, as in gdb.

use emu_core::cpu::LAST_CYCLE;
use emu_debug::debug::{CallFlow, DebugSession, FileLine, LinePosition, NamedFunction, SessionStopReason, StepVerdict};

/// Takes `count` steps, or fewer if a step stops for another reason or the user interrupts. Returns the last
/// stop.
pub(super) fn repeat_steps(
    count: u64,
    keep_running: &mut dyn FnMut() -> bool,
    mut step: impl FnMut(&mut dyn FnMut() -> bool) -> SessionStopReason,
) -> SessionStopReason {
    let mut halt = step(keep_running);
    for _ in 1..count {
        if halt != SessionStopReason::Done {
            break;
        }
        // A short step does not check for an interrupt itself.
        if !keep_running() {
            return SessionStopReason::Interrupted;
        }
        halt = step(keep_running);
    }
    halt
}

/// Call depth relative to the start of a step, and whether the machine is in a service routine that began
/// since.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct CallDepth {
    pub calls: i64,
    /// Depth of calls within a service routine, including the routine itself; 0 outside of one.
    service: u64,
}

impl CallDepth {
    /// Updates the depth after an instruction or the entry of an interrupt.
    pub fn update(&mut self, flow: CallFlow, entry: bool) {
        match (self.service, flow) {
            (service, _) if entry => self.service = service + 1,
            (0, CallFlow::Call) => self.calls += 1,
            (0, CallFlow::Return) => self.calls -= 1,
            (_, CallFlow::Call) => self.service += 1,
            (_, CallFlow::Return) => self.service -= 1,
            _ => {}
        }
    }

    /// Returns true if the machine is at the call depth of the start, or further out.
    pub fn is_back_at_start(self) -> bool {
        self.calls <= 0 && self.service == 0
    }
}

/// Returns the source line of the current instruction.
pub(super) fn current_line(session: &DebugSession) -> Option<FileLine> {
    LinePosition::line_of(session)
}

/// How a step treats calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LineStep {
    /// Enters calls.
    Into,
    /// Passes over calls.
    Over,
    /// Passes over calls, and never goes back in the function.
    Forward,
}

/// Takes one step of a source line, or of one instruction without source lines. `not_entered` is the number
/// of inlined functions that begin at the current instruction and are not entered yet.
pub(super) fn line_step(
    session: &mut DebugSession,
    kind: LineStep,
    not_entered: &mut usize,
    keep_running: &mut dyn FnMut() -> bool,
) -> SessionStopReason {
    let over = kind != LineStep::Into;
    if *not_entered > 0 && !over {
        *not_entered -= 1;
        return SessionStopReason::Done;
    }
    let from = session.machine().pc();
    let mut origin = LinePosition::of(session).origin(*not_entered);
    let (mut depth, mut last, mut left) = (CallDepth::default(), from, false);
    // A function without lines is left as a whole.
    let mut unlined_function = match &origin.line {
        None => session.scope.calls().function(from).map(|NamedFunction { words, .. }| words.clone()),
        Some(_) => None,
    };
    // The word after the prologue of a function that the step has entered, and its call depth.
    let mut entered: Option<(u32, i64)> = None;
    session.step_until(LAST_CYCLE, true, keep_running, &mut |session, flow, entry| {
        depth.update(flow, entry);
        if depth.service > 0 {
            return false;
        }
        let pc = session.machine().pc();
        let mut stop = |session: &DebugSession, sites: Option<usize>| {
            let byte = pc.saturating_mul(session.scope.chip().word_bytes);
            *not_entered = sites.unwrap_or_else(|| session.scope.calls().call_sites(byte));
            true
        };
        if let Some((word, calls)) = entered.filter(|(_, calls)| depth.calls >= *calls) {
            return depth.calls == calls && pc == word && stop(session, None);
        }
        if depth.calls > 0 && over {
            return false;
        }
        // A jump to itself: only service routines lead out of it, and those return.
        let before = std::mem::replace(&mut last, pc);
        if !entry && flow == CallFlow::Plain && before == last {
            return stop(session, None);
        }
        let here = current_line(session);
        if let Some(words) = &unlined_function {
            if words.contains(&pc) || depth.calls > 0 && here.is_none() {
                return false;
            }
            if depth.calls <= 0 {
                unlined_function = None;
                let now = LinePosition::of(session);
                if here.is_none() || now.begins {
                    return stop(session, None);
                }
                // The step has returned into the middle of a line.
                (origin, depth.calls) = (now.origin(now.not_entered), 0);
                return false;
            }
        }
        // A call of code without lines is passed over.
        if depth.calls > 0 && origin.line.is_some() && here.is_none() {
            return false;
        }
        if depth.calls > 0 && flow == CallFlow::Call && here.is_some() {
            entered = session.scope.word_after_prologue(pc).filter(|word| *word != pc).map(|word| (word, depth.calls));
            return entered.is_none() && stop(session, None);
        }
        if origin.line.is_none() || depth.calls > 0 {
            return (origin.line.is_none() || here != origin.line) && stop(session, None);
        }
        let now = LinePosition::of(session);
        left |= depth.calls < 0;
        if depth.calls == 0 && now.row.is_some() && now.row == origin.row {
            return false;
        }
        match origin.verdict(&now, over, depth.calls == 0) {
            StepVerdict::GoOn => false,
            StepVerdict::LeaveFrom(next) => {
                (origin, depth.calls) = (next, 0);
                false
            }
            StepVerdict::Stop(sites) => (kind != LineStep::Forward || left || pc > from) && stop(session, Some(sites)),
        }
    })
}
