//! The shortest and plainest stimulus that still shows the same difference.

use crate::family::Target;
use crate::lockstep::{Bench, Mismatch, replay};
use crate::stimulus::Step;

/// Scans that may be spent on shrinking.
const BUDGET: usize = 60_000;

/// Shrinks `steps`, whose last scan differs as `mismatch` tells, all in one run from reset with the given RAM.
pub(crate) fn shrink<C: Target, F: Fn(u64) -> C>(
    bench: &Bench<'_, C, F>,
    ram_seed: u64,
    steps: Vec<Step>,
    mismatch: &Mismatch,
) -> Vec<Step> {
    let mut search = Search { steps, left: BUDGET };
    let mut differs = |steps: &[Step]| {
        let (scan, found) = replay(bench, ram_seed, steps)?;
        found.like(mismatch).then_some(scan)
    };
    search.drop_scans(&mut differs);
    search.simplify(&mut differs);
    // Plainer scans are often fewer, too.
    search.drop_scans(&mut differs);
    search.steps
}

struct Search {
    steps: Vec<Step>,
    left: usize,
}

impl Search {
    /// Takes `candidate` if it still differs, cut at the scan that does.
    fn attempt(&mut self, mut candidate: Vec<Step>, differs: &mut dyn FnMut(&[Step]) -> Option<usize>) -> bool {
        if self.left < candidate.len() {
            return false;
        }
        self.left -= candidate.len();
        let Some(scan) = differs(&candidate) else { return false };
        candidate.truncate(scan);
        self.steps = candidate;
        true
    }

    /// Leaves out runs of scans, long ones first.
    fn drop_scans(&mut self, differs: &mut dyn FnMut(&[Step]) -> Option<usize>) {
        let mut size = self.steps.len() / 2;
        while size > 0 {
            let mut at = 0;
            while at + size <= self.steps.len() && self.steps.len() > 1 {
                let mut candidate = self.steps.clone();
                candidate.drain(at..at + size);
                if candidate.is_empty() || !self.attempt(candidate, differs) {
                    at += size;
                }
            }
            size /= 2;
        }
    }

    /// In each scan: pins without a name low, fewer writes, no flips, inputs as in the scan before.
    fn simplify(&mut self, differs: &mut dyn FnMut(&[Step]) -> Option<usize>) {
        for change in [no_spare, no_flips, no_byte, no_writes, drop_write, keep_inputs, keep_input, keep_analog] {
            let mut at = 0;
            while at < self.steps.len() {
                let mut part = 0;
                loop {
                    let mut candidate = self.steps.clone();
                    match change(&mut candidate, at, part) {
                        Changed::Yes if self.attempt(candidate, differs) => {}
                        Changed::Yes | Changed::Same => part += 1,
                        Changed::Over => break,
                    }
                }
                at += 1;
            }
        }
    }
}

/// What trying to change the `part`-th thing of a scan came to.
enum Changed {
    Yes,
    /// It is plain already.
    Same,
    /// There are not so many.
    Over,
}

type Steps = [Step];

fn no_spare(steps: &mut Steps, at: usize, part: usize) -> Changed {
    match steps.get_mut(at) {
        Some(step) if part == 0 && step.spare != 0 => {
            step.spare = 0;
            Changed::Yes
        }
        _ => Changed::Over,
    }
}

fn no_flips(steps: &mut Steps, at: usize, part: usize) -> Changed {
    match steps.get_mut(at) {
        Some(step) if part == 0 && !step.flips.is_empty() => {
            step.flips.clear();
            Changed::Yes
        }
        _ => Changed::Over,
    }
}

fn no_byte(steps: &mut Steps, at: usize, part: usize) -> Changed {
    match steps.get_mut(at) {
        Some(step) if part == 0 && step.byte.is_some() => {
            step.byte = None;
            Changed::Yes
        }
        _ => Changed::Over,
    }
}

fn keep_analog(steps: &mut Steps, at: usize, part: usize) -> Changed {
    let before = at.checked_sub(1).and_then(|at| steps.get(at)).map(|step| step.analog.clone());
    match steps.get_mut(at) {
        Some(step) if part == 0 && !step.analog.is_empty() => {
            let before = before.unwrap_or_else(|| vec![0; step.analog.len()]);
            if step.analog == before {
                return Changed::Over;
            }
            step.analog = before;
            Changed::Yes
        }
        _ => Changed::Over,
    }
}

fn no_writes(steps: &mut Steps, at: usize, part: usize) -> Changed {
    match steps.get_mut(at) {
        Some(step) if part == 0 && !step.writes.is_empty() => {
            step.writes.clear();
            Changed::Yes
        }
        _ => Changed::Over,
    }
}

fn drop_write(steps: &mut Steps, at: usize, part: usize) -> Changed {
    match steps.get_mut(at) {
        Some(step) if part < step.writes.len() => {
            step.writes.remove(part);
            Changed::Yes
        }
        _ => Changed::Over,
    }
}

fn keep_inputs(steps: &mut Steps, at: usize, part: usize) -> Changed {
    let Some(step) = steps.get(at).filter(|_| part == 0) else { return Changed::Over };
    let before = before(steps, at, step.inputs.len());
    match steps.get_mut(at) {
        Some(step) if step.inputs != before => {
            step.inputs = before;
            Changed::Yes
        }
        _ => Changed::Over,
    }
}

fn keep_input(steps: &mut Steps, at: usize, part: usize) -> Changed {
    let inputs = steps.get(at).map_or(0, |step| step.inputs.len());
    let before = before(steps, at, inputs);
    let both = steps.get_mut(at).and_then(|step| step.inputs.get_mut(part)).zip(before.get(part));
    match both {
        Some((level, before)) if level != before => {
            *level = *before;
            Changed::Yes
        }
        Some(_) => Changed::Same,
        None => Changed::Over,
    }
}

/// The inputs of the scan before; off before the first.
fn before(steps: &Steps, at: usize, inputs: usize) -> Vec<bool> {
    let before = at.checked_sub(1).and_then(|at| steps.get(at));
    before.map_or_else(|| vec![false; inputs], |step| step.inputs.clone())
}
