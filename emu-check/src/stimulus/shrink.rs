//! Shrinks a stimulus: fewer scans and simpler inputs that still cause the same difference.

use crate::chip::families::CheckedChip;
use crate::comparison::lockstep::{Mismatch, TestBench, replay};
use crate::stimulus::generator::ScanStimulus;

/// Maximum number of scans that are executed for shrinking.
const MAX_SHRINK_SCANS: usize = 60_000;

/// Shrinks `steps`, whose last scan causes `mismatch`, in one run from reset with the given RAM seed.
pub(crate) fn shrink_stimulus<C: CheckedChip, F: Fn(u64) -> C>(
    bench: &TestBench<'_, C, F>,
    ram_seed: u64,
    steps: Vec<ScanStimulus>,
    mismatch: &Mismatch,
) -> Vec<ScanStimulus> {
    let mut search = ShrinkSearch { steps, remaining_scans: MAX_SHRINK_SCANS };
    let mut differs = |steps: &[ScanStimulus]| {
        let (scan, found) = replay(bench, ram_seed, steps)?;
        found.is_same_kind(mismatch).then_some(scan)
    };
    search.drop_scans(&mut differs);
    search.simplify(&mut differs);
    // After simplification, more scans can often be dropped.
    search.drop_scans(&mut differs);
    search.steps
}

struct ShrinkSearch {
    steps: Vec<ScanStimulus>,
    remaining_scans: usize,
}

impl ShrinkSearch {
    /// Accepts `candidate` if it still differs, cut after the scan that does. Returns whether it was
    /// accepted.
    fn attempt(
        &mut self,
        mut candidate: Vec<ScanStimulus>,
        differs: &mut dyn FnMut(&[ScanStimulus]) -> Option<usize>,
    ) -> bool {
        if self.remaining_scans < candidate.len() {
            return false;
        }
        self.remaining_scans -= candidate.len();
        let Some(scan) = differs(&candidate) else { return false };
        candidate.truncate(scan);
        self.steps = candidate;
        true
    }

    /// Drops sequences of scans, long ones first.
    fn drop_scans(&mut self, differs: &mut dyn FnMut(&[ScanStimulus]) -> Option<usize>) {
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

    /// Simplifies each scan: unnamed pins low, no inverted inputs, no bytes, fewer writes, inputs equal to
    /// the previous scan.
    fn simplify(&mut self, differs: &mut dyn FnMut(&[ScanStimulus]) -> Option<usize>) {
        for change in [
            clear_spare_pins,
            clear_flips,
            clear_byte,
            clear_writes,
            drop_write,
            repeat_inputs,
            repeat_input,
            repeat_analog,
        ] {
            let mut at = 0;
            while at < self.steps.len() {
                let mut part = 0;
                loop {
                    let mut candidate = self.steps.clone();
                    match change(&mut candidate, at, part) {
                        ChangeResult::Yes if self.attempt(candidate, differs) => {}
                        ChangeResult::Yes | ChangeResult::Unchanged => part += 1,
                        ChangeResult::NoSuchPart => break,
                    }
                }
                at += 1;
            }
        }
    }
}

/// The result of changing the `part`-th item of a scan.
enum ChangeResult {
    Yes,
    /// The item is already in its simplest form.
    Unchanged,
    /// The scan has fewer items.
    NoSuchPart,
}

type StimulusSteps = [ScanStimulus];

fn clear_spare_pins(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    match steps.get_mut(at) {
        Some(step) if part == 0 && step.spare != 0 => {
            step.spare = 0;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn clear_flips(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    match steps.get_mut(at) {
        Some(step) if part == 0 && !step.flips.is_empty() => {
            step.flips.clear();
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn clear_byte(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    match steps.get_mut(at) {
        Some(step) if part == 0 && step.byte.is_some() => {
            step.byte = None;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn repeat_analog(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    let before = at.checked_sub(1).and_then(|at| steps.get(at)).map(|step| step.analog.clone());
    match steps.get_mut(at) {
        Some(step) if part == 0 && !step.analog.is_empty() => {
            let before = before.unwrap_or_else(|| vec![0; step.analog.len()]);
            if step.analog == before {
                return ChangeResult::NoSuchPart;
            }
            step.analog = before;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn clear_writes(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    match steps.get_mut(at) {
        Some(step) if part == 0 && !step.writes.is_empty() => {
            step.writes.clear();
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn drop_write(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    match steps.get_mut(at) {
        Some(step) if part < step.writes.len() => {
            step.writes.remove(part);
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn repeat_inputs(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    let Some(step) = steps.get(at).filter(|_| part == 0) else { return ChangeResult::NoSuchPart };
    let before = previous_inputs(steps, at, step.inputs.len());
    match steps.get_mut(at) {
        Some(step) if step.inputs != before => {
            step.inputs = before;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn repeat_input(steps: &mut StimulusSteps, at: usize, part: usize) -> ChangeResult {
    let inputs = steps.get(at).map_or(0, |step| step.inputs.len());
    let before = previous_inputs(steps, at, inputs);
    let both = steps.get_mut(at).and_then(|step| step.inputs.get_mut(part)).zip(before.get(part));
    match both {
        Some((level, before)) if level != before => {
            *level = *before;
            ChangeResult::Yes
        }
        Some(_) => ChangeResult::Unchanged,
        None => ChangeResult::NoSuchPart,
    }
}

/// The inputs of the previous scan; all off before the first.
fn previous_inputs(steps: &StimulusSteps, at: usize, inputs: usize) -> Vec<bool> {
    let before = at.checked_sub(1).and_then(|at| steps.get(at));
    before.map_or_else(|| vec![false; inputs], |step| step.inputs.clone())
}
