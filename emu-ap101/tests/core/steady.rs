//! Machines that have settled: which of them halt, and that skipping their repetitions equals running them.

use emu_ap101::Ap101;
use emu_core::cpu::{Cpu, StopReason};
use emu_core::pins::{CycleTime, PinLevel};

use crate::rig::{Block, image, words};

/// Far away: no machine reaches this cycle in a test without skipping.
const FAR: u64 = 1 << 50;

fn machine(text: &str, block: &Block) -> Ap101 {
    Ap101::new(&image(&words(text), Some(block)))
}

/// Program, period, first module, and the cycle in which a run of three million cycles halts, if it does.
type Ends = (&'static str, u32, (u8, u8, u16), Option<u64>);

const ENDS: &[Ends] = &[
    // Program cycles of 7 cycles from 4 on: the first check is at 1026, and the next program cycle is equal
    // to that one.
    ("ldc M0; nop; sto E1", 0, (0, 0, 0), Some(1033)),
    // A reload of 4, and program cycles that begin every 100 cycles.
    ("ldc M0; nop; sto E1", 100, (0, 0, 0), Some(1204)),
    // A bit of M that toggles without effect: two program cycles are a period.
    ("ldc M0; sto M0; nop", 0, (0, 0, 0), Some(1040)),
    // A toggling output never settles, even if it toggles back within the program cycle.
    ("ldc M0; sto M0; sto E1", 0, (0, 0, 0), None),
    ("clr; stoc E1; sto E1", 0, (0, 0, 0), None),
    // A counter of a toggling bit, and of a constant bit.
    ("ldc M0; sto M0; sto R0", 0, (5, 0, 9), None),
    ("clr; stoc M0; sto R0", 0, (5, 0, 9), Some(1033)),
    // 3 times 100 ms are 150,000 cycles; the check after that comes a while later. Then a time that does not
    // elapse, one that restarts in each program cycle, and one that elapses immediately.
    ("clr; not; sto R0; nop", 0, (1, 3, 3), Some(197_644)),
    ("clr; not; sto R0; nop", 0, (1, 3, 65_535), None),
    ("clr; sto R0; not; sto R0", 0, (1, 3, 3), Some(1036)),
    ("clr; not; sto R0; nop", 0, (1, 3, 0), Some(1036)),
    // A preset that alternates, and one that does not.
    ("sto R256; .word 0xF003; sto R256; .word 0xF004", 0, (1, 3, 0), None),
    ("sto R256; .word 0xF003; sto R256; .word 0xF003", 0, (1, 3, 0), Some(1036)),
    // Each program cycle is too long by two cycles, which OVR counts up to 65,535: 4 + 7 * 65,535 is the
    // program cycle after the last count.
    ("ldc M0; nop; sto M1", 5, (0, 0, 0), Some(4 + 7 * 65_535)),
];

#[test]
fn what_has_settled_halts() {
    for &(text, period, module, end) in ENDS {
        let mut block = Block { period, ..Block::EMPTY };
        block.modules[0] = module;
        for skip in [true, false] {
            let mut machine = machine(text, &block);
            machine.set_skip_idle_loops(skip);
            let stop = machine.run(3_000_000, &mut ());
            assert_eq!((stop == StopReason::Halted).then(|| machine.cycle()), end, "{text}, skip {skip}");
            if end.is_some() {
                let seen = (machine.cycle(), machine.instructions());
                assert_eq!(machine.run(FAR, &mut ()), StopReason::Halted, "{text}: again");
                assert_eq!((machine.cycle(), machine.instructions()), seen, "{text}: again");
            }
        }
    }
}

#[test]
fn a_drive_to_come_keeps_it_running_up_to_there() {
    let mut machine = machine("ld I1; nop; sto E1", &Block::EMPTY);
    // The present level again, and then another one.
    machine.drive(CycleTime::at(FAR), 1, PinLevel::Low);
    machine.drive(CycleTime::at(2 * FAR), 1, PinLevel::High);
    assert_eq!(machine.run(FAR, &mut ()), StopReason::Limit);
    // Program cycles of 7 cycles from 4 on, with 3 instructions each.
    let rounds = (FAR - 4) / 7;
    let rest = (FAR - 4) % 7;
    assert!(rest <= 3, "not in a reload");
    assert_eq!((machine.cycle(), machine.instructions()), (FAR, 3 * rounds + rest));
    assert_eq!(machine.run(4 * FAR, &mut ()), StopReason::Halted);
    assert_eq!(machine.peek("e", 1), Some(1));
    assert!((2 * FAR..2 * FAR + 2000).contains(&machine.cycle()), "{}", machine.cycle());
    // A later drive still has its effect.
    machine.drive(CycleTime::at(0), 1, PinLevel::Low);
    assert_eq!(machine.run(4 * FAR, &mut ()), StopReason::Halted);
    assert_eq!(machine.peek("e", 1), Some(0));
}

#[test]
fn a_step_goes_on_where_a_run_halts() {
    let mut machine = machine("ldc M0; nop; sto E1", &Block::EMPTY);
    assert_eq!(machine.run(3000, &mut ()), StopReason::Halted);
    let before = machine.instructions();
    assert_eq!(machine.step(&mut ()), StopReason::Limit);
    assert_eq!(machine.instructions(), before + 1);
    assert_eq!(machine.run(3000, &mut ()), StopReason::Halted);
    assert_eq!(machine.instructions(), before + 3);
}

#[test]
fn a_breakpoint_is_met_in_every_round() {
    let mut machine = machine("ldc M0; nop; sto E1", &Block::EMPTY);
    machine.drive(CycleTime::at(10_004), 1, PinLevel::Low);
    assert_eq!(machine.run(3000, &mut ()), StopReason::Limit);
    machine.set_breakpoint(1, true);
    let mut met = 0;
    while machine.run(10_000, &mut ()) == (StopReason::Breakpoint { pc: 1 }) {
        met += 1;
    }
    assert_eq!(met, 1000);
}
