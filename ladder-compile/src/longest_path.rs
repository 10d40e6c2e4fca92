//! Computes the longest path through finished code, in machine cycles.

use std::collections::HashMap;

use crate::code::{CodeInstruction, ControlFlow, FinishedCode};
use crate::ir::MAX_JUMPS_BACK;
use crate::jump_roles::JumpRole;

/// Maximum number of machine cycles from the instruction at word `from` until word `to` is reached for the
/// first time.
///
/// Subroutines are included. All jumps between the two addresses go forward, except jumps back with a stated
/// number of repeats, and those of the program, of which a scan takes [`MAX_JUMPS_BACK`].
#[must_use]
pub fn longest_path(code: &FinishedCode, from: u32, to: u32) -> u64 {
    let mut routines = HashMap::new();
    let forward = longest_path_cycles(code, from, to, &mut routines);
    forward + u64::from(MAX_JUMPS_BACK) * longest_iteration(code, from, to, &mut routines)
}

/// Maximum number of pairs of a loop's start and an end for which the path is computed exactly.
const MAX_LOOP_PAIRS: usize = 256;

/// Maximum number of cycles from the target of one of the program's jumps back to the next jump back.
fn longest_iteration(code: &FinishedCode, from: u32, to: u32, routines: &mut HashMap<u32, u64>) -> u64 {
    let within = |at: &u32| (from..to).contains(at);
    let backs: Vec<&CodeInstruction> = code
        .instructions
        .iter()
        .filter(|insn| insn.role == JumpRole::ProgramLoop && within(&insn.addr))
        .filter(|insn| insn.target.as_ref().is_some_and(within))
        .collect();
    let mut starts: Vec<u32> = backs.iter().filter_map(|insn| insn.target).collect();
    starts.sort_unstable();
    starts.dedup();
    let mut ends: Vec<u32> = backs.iter().map(|insn| insn.addr + insn.len).collect();
    if starts.len() * ends.len() > MAX_LOOP_PAIRS {
        // From the first start to the last end is more than any other pair.
        starts.truncate(1);
        ends.drain(..ends.len().saturating_sub(1));
    }
    let pairs = starts.iter().flat_map(|start| ends.iter().map(move |end| (*start, *end)));
    pairs
        .filter(|(start, end)| start < end)
        .map(|(start, end)| longest_path_cycles(code, start, end, routines))
        .max()
        .unwrap_or(0)
}

fn longest_path_cycles(code: &FinishedCode, from: u32, to: u32, routines: &mut HashMap<u32, u64>) -> u64 {
    let first = code.instructions.partition_point(|insn| insn.addr < from);
    let insns: &[CodeInstruction] = code.instructions.get(first..).unwrap_or_default();
    let insns = &insns[..insns.partition_point(|insn| insn.addr < to)];
    // Maximum number of cycles from each address to `to`, filled from the end.
    let mut remaining: HashMap<u32, u64> = HashMap::from([(to, 0)]);
    for (n, insn) in insns.iter().enumerate().rev() {
        let get = |at: u32| remaining.get(&at).copied().unwrap_or(0);
        let [on, taken, far] = insn.cycles.map(u64::from);
        let next = insn.addr + insn.len;
        let time = match (insn.flow, insn.target) {
            (ControlFlow::Jump, Some(target)) if insn.role != JumpRole::Repeats(insn.max_repeats()) => {
                match insn.role {
                    // The code that it goes back to is reckoned as an iteration.
                    JumpRole::ProgramLoop | JumpRole::Repeats(_) => taken + get(next),
                    JumpRole::ProgramCall { end, back } => {
                        let called = match routines.get(&target) {
                            Some(known) => *known,
                            None => longest_path_cycles(code, target, end, routines),
                        };
                        routines.insert(target, called);
                        taken + called + get(back)
                    }
                    JumpRole::ProgramReturn => taken,
                }
            }
            (ControlFlow::Return, _) => on,
            (ControlFlow::Call, Some(target)) => on + routine_cycles(code, target, routines) + get(next),
            // The end of the scan jumps back to the poll loop, before this range.
            (ControlFlow::Jump, Some(target)) if target < from => taken,
            // A loop: every iteration but the last ends with the jump back; a skip exits a loop with an
            // unconditional jump.
            (ControlFlow::Branch, Some(target)) if target <= insn.addr => {
                let iteration = longest_path_cycles(code, target, insn.addr, routines);
                u64::from(insn.max_repeats().saturating_sub(1)) * (iteration + taken) + on + get(next)
            }
            (ControlFlow::Jump, Some(target)) if target <= insn.addr => {
                let iteration = longest_path_cycles(code, target, insn.addr, routines);
                u64::from(insn.max_repeats()) * (iteration + taken) + 1 + get(next)
            }
            (ControlFlow::Jump, Some(target)) => taken + get(target),
            (ControlFlow::Branch, Some(target)) => (on + get(next)).max(taken + get(target)),
            (ControlFlow::Skip, _) => {
                let skipped = insns.get(n + 1).map_or(1, |i| i.len);
                (on + get(next)).max(if skipped > 1 { far } else { taken } + get(next + skipped))
            }
            _ => on + get(next),
        };
        remaining.insert(insn.addr, time);
    }
    remaining.get(&from).copied().unwrap_or(0)
}

/// Maximum number of cycles of a subroutine, including its return.
fn routine_cycles(code: &FinishedCode, start: u32, routines: &mut HashMap<u32, u64>) -> u64 {
    if let Some(&known) = routines.get(&start) {
        return known;
    }
    let end = code.instructions.iter().find(|insn| insn.addr >= start && insn.flow == ControlFlow::Return);
    let time = longest_path_cycles(code, start, end.map_or(start, |insn| insn.addr + insn.len), routines);
    routines.insert(start, time);
    time
}
