//! The longest path through finished code, in machine cycles, from the instruction table's cycle column.

use std::collections::HashMap;

use emu_avr::isa::{Kind, ROWS};

use super::emit::{Code, Insn};

/// The longest time from the instruction at word `from` until word `to` is reached for the first time, subroutines
/// included. All jumps between the two go forward, except branches back that say how often they are taken.
#[must_use]
pub fn longest(code: &Code, from: u32, to: u32) -> u64 {
    let mut routines = HashMap::new();
    path(code, from, to, &mut routines)
}

fn path(code: &Code, from: u32, to: u32, routines: &mut HashMap<u32, u64>) -> u64 {
    let insns: Vec<&Insn> = code.insns.iter().filter(|i| (from..to).contains(&i.addr)).collect();
    // Longest time from each address to `to`, filled from the end.
    let mut rest: HashMap<u32, u64> = HashMap::from([(to, 0)]);
    for (n, insn) in insns.iter().enumerate().rev() {
        let get = |at: u32| rest.get(&at).copied().unwrap_or(0);
        let outcomes = ROWS.get(insn.kind as usize).map_or(&[][..], |row| row.cycles.outcomes());
        let cycles = |n: usize| u64::from(outcomes.get(n).or(outcomes.last()).copied().unwrap_or(1));
        let next = insn.addr + insn.len;
        let time = match (insn.kind, insn.target) {
            (Kind::Ret, _) => cycles(0),
            (Kind::Rjmp | Kind::Jmp, Some(target)) => cycles(0) + get(target),
            (Kind::Rcall | Kind::Call, Some(target)) => {
                let body = match routines.get(&target) {
                    Some(&known) => known,
                    None => {
                        let end = code.insns.iter().find(|i| i.addr >= target && i.kind == Kind::Ret);
                        let time = path(code, target, end.map_or(target, |i| i.addr + i.len), routines);
                        routines.insert(target, time);
                        time
                    }
                };
                cycles(0) + body + get(next)
            }
            (_, Some(target)) if target <= insn.addr => {
                // A counted loop: every turn but the last ends with the branch taken.
                let turn = path(code, target, insn.addr, routines);
                u64::from(insn.times.saturating_sub(1)) * (turn + cycles(1)) + cycles(0) + get(next)
            }
            (_, Some(target)) => (cycles(0) + get(next)).max(cycles(1) + get(target)),
            (Kind::Sbrc | Kind::Sbrs | Kind::Sbic | Kind::Sbis | Kind::Cpse, None) => {
                let skipped = insns.get(n + 1).map_or(1, |i| i.len);
                (cycles(0) + get(next)).max(cycles(skipped as usize) + get(next + skipped))
            }
            _ => cycles(0) + get(next),
        };
        rest.insert(insn.addr, time);
    }
    rest.get(&from).copied().unwrap_or(0)
}
