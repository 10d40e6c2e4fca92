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
    let mut cycles_by_routine = HashMap::new();
    let forward = longest_path_cycles(code, from, to, &mut cycles_by_routine);
    forward + u64::from(MAX_JUMPS_BACK) * longest_iteration(code, from, to, &mut cycles_by_routine)
}

/// Maximum number of pairs of a loop's start and an end for which the path is computed exactly.
const MAX_LOOP_PAIRS: usize = 256;

/// Maximum number of cycles from the target of one of the program's jumps back to the next jump back.
fn longest_iteration(code: &FinishedCode, from: u32, to: u32, cycles_by_routine: &mut HashMap<u32, u64>) -> u64 {
    let within = |at: &u32| (from..to).contains(at);
    let jumps_back: Vec<&CodeInstruction> = code
        .instructions
        .iter()
        .filter(|insn| insn.role == JumpRole::ProgramLoop && within(&insn.addr))
        .filter(|insn| insn.target.as_ref().is_some_and(within))
        .collect();
    let mut starts: Vec<u32> = jumps_back.iter().filter_map(|insn| insn.target).collect();
    starts.sort_unstable();
    starts.dedup();
    let mut ends: Vec<u32> = jumps_back.iter().map(|insn| insn.addr + insn.len).collect();
    if starts.len() * ends.len() > MAX_LOOP_PAIRS {
        // From the first start to the last end is more than any other pair.
        starts.truncate(1);
        ends.drain(..ends.len().saturating_sub(1));
    }
    let pairs = starts.iter().flat_map(|start| ends.iter().map(move |end| (*start, *end)));
    pairs
        .filter(|(start, end)| start < end)
        .map(|(start, end)| longest_path_cycles(code, start, end, cycles_by_routine))
        .max()
        .unwrap_or(0)
}

fn longest_path_cycles(code: &FinishedCode, from: u32, to: u32, cycles_by_routine: &mut HashMap<u32, u64>) -> u64 {
    let first = code.instructions.partition_point(|insn| insn.addr < from);
    let instructions: &[CodeInstruction] = code.instructions.get(first..).unwrap_or_default();
    let instructions = &instructions[..instructions.partition_point(|insn| insn.addr < to)];
    // Maximum number of cycles from each address to `to`, filled from the end.
    let mut remaining: HashMap<u32, u64> = HashMap::from([(to, 0)]);
    for (n, insn) in instructions.iter().enumerate().rev() {
        let get = |at: u32| remaining.get(&at).copied().unwrap_or(0);
        let [not_taken, taken, two_words_skipped] = insn.cycles.map(u64::from);
        let next = insn.addr + insn.len;
        let time = match (insn.flow, insn.target) {
            (ControlFlow::Jump, Some(target)) if insn.role != JumpRole::Repeats(insn.max_repeats()) => {
                match insn.role {
                    // Its iteration is added by `longest_path`.
                    JumpRole::ProgramLoop | JumpRole::Repeats(_) => taken + get(next),
                    JumpRole::ProgramCall { end, back } => {
                        let called = match cycles_by_routine.get(&target) {
                            Some(known) => *known,
                            None => longest_path_cycles(code, target, end, cycles_by_routine),
                        };
                        cycles_by_routine.insert(target, called);
                        taken + called + get(back)
                    }
                    JumpRole::ProgramReturn => taken,
                }
            }
            (ControlFlow::Return, _) => not_taken,
            (ControlFlow::Call, Some(target)) => {
                not_taken + routine_cycles(code, target, cycles_by_routine) + get(next)
            }
            // The end of the scan jumps back to the poll loop, before this range.
            (ControlFlow::Jump, Some(target)) if target < from => taken,
            // A loop: every iteration but the last ends with the jump back; a skip exits a loop with an
            // unconditional jump.
            (ControlFlow::Branch, Some(target)) if target <= insn.addr => {
                let iteration = longest_path_cycles(code, target, insn.addr, cycles_by_routine);
                u64::from(insn.max_repeats().saturating_sub(1)) * (iteration + taken) + not_taken + get(next)
            }
            (ControlFlow::Jump, Some(target)) if target <= insn.addr => {
                let iteration = longest_path_cycles(code, target, insn.addr, cycles_by_routine);
                u64::from(insn.max_repeats()) * (iteration + taken) + 1 + get(next)
            }
            (ControlFlow::Jump, Some(target)) => taken + get(target),
            (ControlFlow::Branch, Some(target)) => (not_taken + get(next)).max(taken + get(target)),
            (ControlFlow::Skip, _) => {
                let skipped = instructions.get(n + 1).map_or(1, |i| i.len);
                (not_taken + get(next)).max(if skipped > 1 { two_words_skipped } else { taken } + get(next + skipped))
            }
            _ => not_taken + get(next),
        };
        remaining.insert(insn.addr, time);
    }
    remaining.get(&from).copied().unwrap_or(0)
}

/// Maximum number of cycles of a subroutine, including its return.
fn routine_cycles(code: &FinishedCode, start: u32, cycles_by_routine: &mut HashMap<u32, u64>) -> u64 {
    if let Some(&known) = cycles_by_routine.get(&start) {
        return known;
    }
    let end = code.instructions.iter().find(|insn| insn.addr >= start && insn.flow == ControlFlow::Return);
    let time = longest_path_cycles(code, start, end.map_or(start, |insn| insn.addr + insn.len), cycles_by_routine);
    cycles_by_routine.insert(start, time);
    time
}
