//! Backward search that distinguishes calls and service routines.
//!
//! The past is searched in stretches, the newest first, and each stretch is executed forwards. A stretch can
//! return from frames that were called in an older stretch. So the candidates of a stretch are kept per
//! frame, and the search decides when it knows what that frame was.

use std::cell::RefCell;

use emu_debug::debug::{CallFlow, DebugSession, NameScope, PassedPosition, SessionStopReason};

/// Which positions a search accepts, relative to the call where it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CallScope {
    /// Also positions in calls that have returned since, but none in service routines.
    Into,
    /// No positions in calls that have returned since.
    Over,
    /// Only the position before the call of the current subroutine.
    Out,
}

/// A call or service routine that began in the stretch.
#[derive(Debug, Clone, Copy)]
struct StretchFrame {
    service: bool,
    /// Cycle of the last candidate in it.
    last_candidate: Option<u64>,
}

/// The frames of a stretch, with the candidates in them.
#[derive(Debug, Default)]
pub(super) struct FrameSearch {
    /// Frames that began in the stretch, the innermost last.
    stack: Vec<StretchFrame>,
    /// Last candidates in frames that are older than the stretch. Each return from such a frame adds an
    /// entry.
    older_candidates: Vec<Option<u64>>,
    /// `older_candidates` of the stretches after this one, for frames that are older than those stretches.
    later_candidates: Vec<Option<u64>>,
    /// Cycle at which the stretch begins.
    start_cycle: u64,
    /// Instruction count at the previous position.
    instructions_before: u64,
    found: Option<u64>,
}

impl FrameSearch {
    /// Goes back to the last position before the current one that `wanted` and `calls` accept.
    pub fn search(
        session: &mut DebugSession,
        calls: CallScope,
        wanted: fn(&NameScope, &PassedPosition<'_>) -> bool,
        keep_running: &mut dyn FnMut() -> bool,
    ) -> SessionStopReason {
        let now = session.machine().cycle();
        let scope = session.scope.clone();
        let has_vectors = !scope.chip().vectors.is_empty();
        let frames = RefCell::new(FrameSearch { later_candidates: vec![None], ..FrameSearch::default() });
        let halt = session.run_back_until(
            keep_running,
            &mut || {
                let mut frames = frames.borrow_mut();
                frames.end_stretch(calls);
                frames.found.is_none()
            },
            &mut |passed| {
                frames.borrow_mut().visit_position(passed, (calls, has_vectors), |passed| {
                    passed.machine.cycle() < now && wanted(&scope, passed)
                });
                false
            },
        );
        match frames.into_inner().found {
            Some(cycle) => session.goto_cycle(cycle, keep_running),
            None => halt,
        }
    }

    /// Processes one position of a stretch.
    fn visit_position(
        &mut self,
        passed: &PassedPosition<'_>,
        (calls, has_vectors): (CallScope, bool),
        wanted: impl Fn(&PassedPosition<'_>) -> bool,
    ) {
        let counted = passed.machine.instructions();
        if passed.first {
            self.stack.clear();
            self.older_candidates = vec![None];
            self.start_cycle = passed.machine.cycle();
            self.instructions_before = counted;
            return;
        }
        // Only the entry of an interrupt is a step that executes no instruction.
        let entry = has_vectors && counted == self.instructions_before;
        self.instructions_before = counted;
        match passed.flow {
            _ if entry => self.stack.push(StretchFrame { service: true, last_candidate: None }),
            CallFlow::Call => self.stack.push(StretchFrame { service: false, last_candidate: None }),
            CallFlow::Return => self.leave_frame(None, calls),
            CallFlow::Plain => {}
        }
        if wanted(passed) {
            self.set_candidate(passed.machine.cycle());
        }
    }

    /// Stores a candidate of the current frame.
    fn set_candidate(&mut self, cycle: u64) {
        let best = match self.stack.last_mut() {
            Some(frame) => Some(&mut frame.last_candidate),
            None => self.older_candidates.last_mut(),
        };
        if let Some(best) = best {
            *best = Some(cycle);
        }
    }

    /// Leaves the innermost frame. `newer` is a candidate in it that is later than the known ones.
    fn leave_frame(&mut self, newer: Option<u64>, calls: CallScope) {
        match self.stack.pop() {
            Some(StretchFrame { service, last_candidate: best }) => {
                let kept = newer.or(best).filter(|_| !service && calls == CallScope::Into);
                if let Some(cycle) = kept {
                    self.set_candidate(cycle);
                }
            }
            None => {
                if let (Some(best), Some(cycle)) = (self.older_candidates.last_mut(), newer) {
                    *best = Some(cycle);
                }
                self.older_candidates.push(None);
            }
        }
    }

    /// Ends the stretch: later stretches leave some of its frames, and the remaining frames are active now.
    fn end_stretch(&mut self, calls: CallScope) {
        let later = std::mem::take(&mut self.later_candidates);
        let (last, left) = later.split_last().map_or((None, &[][..]), |(last, left)| (*last, left));
        for newer in left {
            self.leave_frame(*newer, calls);
        }
        let floor = self.older_candidates.last().copied().flatten();
        if calls == CallScope::Out {
            // The innermost active frame is the current subroutine; the frame around it is its caller.
            self.found = match self.stack.as_slice() {
                [] => None,
                [_] => floor.or(Some(self.start_cycle)),
                [.., caller, _] => caller.last_candidate.or(Some(self.start_cycle)),
            };
        } else {
            let open = self.stack.iter().rev().find_map(|frame| frame.last_candidate);
            self.found = last.or(open).or(floor);
        }
        self.later_candidates = std::mem::take(&mut self.older_candidates);
    }
}
