//! Compares the columns of the table with the machine: every cycle count of a row occurs and no other, and
//! exactly the named flags change. Also tests that time is exact for any slicing of a run.

#[path = "isa/interrupts.rs"]
mod interrupts;
#[path = "isa/slices.rs"]
mod slices;
#[path = "isa/states.rs"]
mod states;

use std::collections::BTreeSet;

use emu_avr::isa::{AvrOpKind, KINDS, ROWS};
use emu_core::rng::Rng;
use emu_core::{Cpu, StopReason};

const SEED: u64 = 0x5EED_0001;
const STATES: usize = 600;
/// Number of instructions of each row that are placed at the ends of flash.
const ENDS: usize = 10;

/// Reports whether a store may write SREG; then all of its bits can change.
fn writes_sreg(kind: AvrOpKind, d: &states::Draw) -> bool {
    let io = |word: u16| word & 15 | (word >> 5) & 0x30;
    let pointer = |low: usize| u16::from_le_bytes([d.regs[low], d.regs[low + 1]]);
    match kind {
        AvrOpKind::Out => io(d.words[0]) == 0x3F,
        AvrOpKind::Sts => d.words[1] == 0x5F,
        AvrOpKind::StX | AvrOpKind::StXi => pointer(26) == 0x5F,
        AvrOpKind::StXd => pointer(26) == 0x60,
        AvrOpKind::StY | AvrOpKind::StYi => pointer(28) == 0x5F,
        AvrOpKind::StYd => pointer(28) == 0x60,
        AvrOpKind::StZ | AvrOpKind::StZi => pointer(30) == 0x5F,
        AvrOpKind::StZd => pointer(30) == 0x60,
        _ => false,
    }
}

#[test]
fn cycles_and_flags_are_the_columns() {
    let mut rng = Rng::new(SEED);
    let mut failures = Vec::new();
    for (row, &kind) in ROWS.iter().zip(KINDS) {
        let mut cycles = BTreeSet::new();
        let mut changed = 0u8;
        let ends = (0..ENDS).map(|_| states::at_the_ends(row, kind, 10, &mut rng)).collect::<Vec<_>>();
        let all = std::iter::once(states::batch(row, kind, STATES, &mut rng)).chain(ends);
        let on = all.flat_map(|(flash, draws)| {
            let base = states::machine(kind, flash);
            draws.into_iter().map(move |d| (base.clone(), d))
        });
        for (base, d) in on {
            let mut avr = states::put(&base, &d);
            let before = avr.cycle();
            let stop = avr.step(&mut ());
            let ends = stop == StopReason::Halted && avr.pc() == d.pc.into();
            assert!((stop == StopReason::Limit || ends) && avr.instructions() == 1, "{}: {stop:?}, {d:x?}", row.name);
            cycles.insert((avr.cycle() - before) as u8);
            if !writes_sreg(kind, &d) {
                changed |= avr.reg("SREG").map_or(0, |s| s as u8) ^ d.sreg;
            }
        }
        let wanted: BTreeSet<u8> = row.cycles.possible_counts().iter().copied().collect();
        if cycles != wanted {
            failures.push(format!("{}: cycles {cycles:?}, the column says {wanted:?}", row.name));
        }
        let found: BTreeSet<char> =
            (0..).zip("CZNVSHTI".chars()).filter(|(b, _)| changed >> b & 1 != 0).map(|(_, c)| c).collect();
        if found != row.flags.chars().collect() {
            failures.push(format!("{}: flags {found:?} changed, the column says {:?}", row.name, row.flags));
        }
    }
    assert!(failures.is_empty(), "seed {SEED:#x}:\n{}", failures.join("\n"));
}
