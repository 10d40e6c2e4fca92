//! Searching backwards with an eye on calls and service routines.
//!
//! The past is walked in stretches, the newest first, and each stretch forwards. What a stretch returns from was called in an older
//! one: so the candidates of a stretch are kept by the frame that they lie in, and decided once it is known what that frame was.

use std::cell::RefCell;

use emu_debug::debug::{Flow, Halt, Passed, Scope, Session};

/// Where a position may lie, as seen from where the search begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Calls {
    /// Also in calls that have returned since, but not in service routines.
    Into,
    /// Not in calls that have returned since.
    Over,
    /// Before the call of the present subroutine.
    Out,
}

/// A call or service routine that began in the stretch.
#[derive(Debug, Clone, Copy)]
struct Frame {
    service: bool,
    /// The last candidate in it.
    best: Option<u64>,
}

/// The frames of a stretch.
#[derive(Debug, Default)]
pub(super) struct Frames {
    /// Those that began in it, the innermost last.
    stack: Vec<Frame>,
    /// The last candidates in frames that are older than the stretch: one more each time that such a frame was left.
    floor: Vec<Option<u64>>,
    /// The same of the stretches that follow, for frames older than those.
    later: Vec<Option<u64>>,
    /// The cycle at which the stretch begins.
    first: u64,
    /// Instructions at the position before.
    counted: u64,
    found: Option<u64>,
}

impl Frames {
    /// Goes back to the last position before this one that is wanted and that lies where `calls` says.
    pub fn search(
        session: &mut Session,
        calls: Calls,
        wanted: fn(&Scope, &Passed<'_>) -> bool,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Halt {
        let now = session.target().cycle();
        let scope = session.scope.clone();
        let has_vectors = !scope.chip().vectors.is_empty();
        let frames = RefCell::new(Frames { later: vec![None], ..Frames::default() });
        let halt = session.back_until(
            go_on,
            &mut || {
                let mut frames = frames.borrow_mut();
                frames.end(calls);
                frames.found.is_none()
            },
            &mut |passed| {
                frames
                    .borrow_mut()
                    .pass(passed, (calls, has_vectors), |passed| passed.target.cycle() < now && wanted(&scope, passed));
                false
            },
        );
        match frames.into_inner().found {
            Some(cycle) => session.goto_cycle(cycle, go_on),
            None => halt,
        }
    }

    /// Comes by a position.
    fn pass(&mut self, passed: &Passed<'_>, (calls, has_vectors): (Calls, bool), wanted: impl Fn(&Passed<'_>) -> bool) {
        let counted = passed.target.instructions();
        if passed.first {
            self.stack.clear();
            self.floor = vec![None];
            self.first = passed.target.cycle();
            self.counted = counted;
            return;
        }
        // Only the entry of an interrupt is a step without an instruction.
        let entry = has_vectors && counted == self.counted;
        self.counted = counted;
        match passed.flow {
            _ if entry => self.stack.push(Frame { service: true, best: None }),
            Flow::Call => self.stack.push(Frame { service: false, best: None }),
            Flow::Return => self.leave(None, calls),
            Flow::Plain => {}
        }
        if wanted(passed) {
            self.put(passed.target.cycle());
        }
    }

    /// A candidate in the present frame.
    fn put(&mut self, cycle: u64) {
        let best = match self.stack.last_mut() {
            Some(frame) => Some(&mut frame.best),
            None => self.floor.last_mut(),
        };
        if let Some(best) = best {
            *best = Some(cycle);
        }
    }

    /// Leaves the innermost frame, in which `newer` is a candidate behind those that are known.
    fn leave(&mut self, newer: Option<u64>, calls: Calls) {
        match self.stack.pop() {
            Some(Frame { service, best }) => {
                let kept = newer.or(best).filter(|_| !service && calls == Calls::Into);
                if let Some(cycle) = kept {
                    self.put(cycle);
                }
            }
            None => {
                if let (Some(best), Some(cycle)) = (self.floor.last_mut(), newer) {
                    *best = Some(cycle);
                }
                self.floor.push(None);
            }
        }
    }

    /// The stretch is complete: what follows it leaves frames of it, and what is left then is still open now.
    fn end(&mut self, calls: Calls) {
        let later = std::mem::take(&mut self.later);
        let (last, left) = later.split_last().map_or((None, &[][..]), |(last, left)| (*last, left));
        for newer in left {
            self.leave(*newer, calls);
        }
        let floor = self.floor.last().copied().flatten();
        if calls == Calls::Out {
            // The innermost open frame is the present subroutine; the one around it has called it.
            self.found = match self.stack.as_slice() {
                [] => None,
                [_] => floor.or(Some(self.first)),
                [.., caller, _] => caller.best.or(Some(self.first)),
            };
        } else {
            let open = self.stack.iter().rev().find_map(|frame| frame.best);
            self.found = last.or(open).or(floor);
        }
        self.later = std::mem::take(&mut self.floor);
    }
}
