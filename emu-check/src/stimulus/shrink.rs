//! Shrinks a stimulus: fewer scans and simpler inputs that still cause the same difference.

use crate::chip::families::CheckedChip;
use crate::comparison::lockstep::{Mismatch, TestBench, replay};
use crate::stimulus::generator::ScanStimulus;

/// Maximum number of scans that are executed for shrinking.
const MAX_SHRINK_SCANS: usize = 60_000;

/// Shrinks `stimuli`, whose last scan causes `mismatch`, in one run from reset with the given RAM seed.
pub(crate) fn shrink_stimulus<C: CheckedChip, F: Fn(u64) -> C>(
    bench: &TestBench<'_, C, F>,
    ram_seed: u64,
    stimuli: Vec<ScanStimulus>,
    mismatch: &Mismatch,
) -> Vec<ScanStimulus> {
    let mut search = ShrinkSearch { stimuli, remaining_scans: MAX_SHRINK_SCANS };
    let mut differs = |stimuli: &[ScanStimulus]| {
        let (scan, found) = replay(bench, ram_seed, stimuli)?;
        found.is_same_kind(mismatch).then_some(scan)
    };
    search.drop_scans(&mut differs);
    search.simplify(&mut differs);
    // After simplification, more scans can often be dropped.
    search.drop_scans(&mut differs);
    search.stimuli
}

struct ShrinkSearch {
    stimuli: Vec<ScanStimulus>,
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
        self.stimuli = candidate;
        true
    }

    /// Drops sequences of scans, long ones first.
    fn drop_scans(&mut self, differs: &mut dyn FnMut(&[ScanStimulus]) -> Option<usize>) {
        let mut size = self.stimuli.len() / 2;
        while size > 0 {
            let mut at = 0;
            while at + size <= self.stimuli.len() && self.stimuli.len() > 1 {
                let mut candidate = self.stimuli.clone();
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
            lower_drivable_pins,
            clear_flips,
            clear_byte,
            clear_writes,
            drop_write,
            repeat_inputs,
            repeat_input,
            repeat_analog,
        ] {
            let mut at = 0;
            while at < self.stimuli.len() {
                let mut part = 0;
                loop {
                    let mut candidate = self.stimuli.clone();
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

fn lower_drivable_pins(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    match stimuli.get_mut(at) {
        Some(stimulus) if part == 0 && stimulus.drivable_levels != 0 => {
            stimulus.drivable_levels = 0;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn clear_flips(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    match stimuli.get_mut(at) {
        Some(stimulus) if part == 0 && !stimulus.flips.is_empty() => {
            stimulus.flips.clear();
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn clear_byte(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    match stimuli.get_mut(at) {
        Some(stimulus) if part == 0 && stimulus.byte.is_some() => {
            stimulus.byte = None;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn repeat_analog(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    let before = at.checked_sub(1).and_then(|at| stimuli.get(at)).map(|stimulus| stimulus.analog.clone());
    match stimuli.get_mut(at) {
        Some(stimulus) if part == 0 && !stimulus.analog.is_empty() => {
            let before = before.unwrap_or_else(|| vec![0; stimulus.analog.len()]);
            if stimulus.analog == before {
                return ChangeResult::NoSuchPart;
            }
            stimulus.analog = before;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn clear_writes(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    match stimuli.get_mut(at) {
        Some(stimulus) if part == 0 && !stimulus.writes.is_empty() => {
            stimulus.writes.clear();
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn drop_write(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    match stimuli.get_mut(at) {
        Some(stimulus) if part < stimulus.writes.len() => {
            stimulus.writes.remove(part);
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn repeat_inputs(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    let Some(stimulus) = stimuli.get(at).filter(|_| part == 0) else { return ChangeResult::NoSuchPart };
    let before = previous_inputs(stimuli, at, stimulus.inputs.len());
    match stimuli.get_mut(at) {
        Some(stimulus) if stimulus.inputs != before => {
            stimulus.inputs = before;
            ChangeResult::Yes
        }
        _ => ChangeResult::NoSuchPart,
    }
}

fn repeat_input(stimuli: &mut [ScanStimulus], at: usize, part: usize) -> ChangeResult {
    let inputs = stimuli.get(at).map_or(0, |stimulus| stimulus.inputs.len());
    let before = previous_inputs(stimuli, at, inputs);
    let both = stimuli.get_mut(at).and_then(|stimulus| stimulus.inputs.get_mut(part)).zip(before.get(part));
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
fn previous_inputs(stimuli: &[ScanStimulus], at: usize, inputs: usize) -> Vec<bool> {
    let before = at.checked_sub(1).and_then(|at| stimuli.get(at));
    before.map_or_else(|| vec![false; inputs], |stimulus| stimulus.inputs.clone())
}
