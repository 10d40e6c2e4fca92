//! The longest path through finished code, in machine cycles.

use std::collections::HashMap;

use crate::code::{Code, Flow, Insn};

/// The longest time from the instruction at word `from` until word `to` is reached for the first time, subroutines
/// included. All jumps between the two go forward, except jumps back that say how often they are taken.
#[must_use]
pub fn longest(code: &Code, from: u32, to: u32) -> u64 {
    path(code, from, to, &mut HashMap::new())
}

fn path(code: &Code, from: u32, to: u32, routines: &mut HashMap<u32, u64>) -> u64 {
    let first = code.insns.partition_point(|insn| insn.addr < from);
    let insns: &[Insn] = code.insns.get(first..).unwrap_or_default();
    let insns = &insns[..insns.partition_point(|insn| insn.addr < to)];
    // Longest time from each address to `to`, filled from the end.
    let mut rest: HashMap<u32, u64> = HashMap::from([(to, 0)]);
    for (n, insn) in insns.iter().enumerate().rev() {
        let get = |at: u32| rest.get(&at).copied().unwrap_or(0);
        let [on, taken, far] = insn.cycles.map(u64::from);
        let next = insn.addr + insn.len;
        let time = match (insn.flow, insn.target) {
            (Flow::Return, _) => on,
            (Flow::Call, Some(target)) => on + routine(code, target, routines) + get(next),
            // The end of the scan goes back to the wait, before everything here.
            (Flow::Jump, Some(target)) if target < from => taken,
            // A loop: every turn but the last ends with the jump back; a jump without condition is left by a skip over it.
            (Flow::Branch, Some(target)) if target <= insn.addr => {
                let turn = path(code, target, insn.addr, routines);
                u64::from(insn.times.saturating_sub(1)) * (turn + taken) + on + get(next)
            }
            (Flow::Jump, Some(target)) if target <= insn.addr => {
                let turn = path(code, target, insn.addr, routines);
                u64::from(insn.times) * (turn + taken) + 1 + get(next)
            }
            (Flow::Jump, Some(target)) => taken + get(target),
            (Flow::Branch, Some(target)) => (on + get(next)).max(taken + get(target)),
            (Flow::Skip, _) => {
                let skipped = insns.get(n + 1).map_or(1, |i| i.len);
                (on + get(next)).max(if skipped > 1 { far } else { taken } + get(next + skipped))
            }
            _ => on + get(next),
        };
        rest.insert(insn.addr, time);
    }
    rest.get(&from).copied().unwrap_or(0)
}

/// The longest time in a subroutine, its return included.
fn routine(code: &Code, start: u32, routines: &mut HashMap<u32, u64>) -> u64 {
    if let Some(&known) = routines.get(&start) {
        return known;
    }
    let end = code.insns.iter().find(|insn| insn.addr >= start && insn.flow == Flow::Return);
    let time = path(code, start, end.map_or(start, |insn| insn.addr + insn.len), routines);
    routines.insert(start, time);
    time
}
