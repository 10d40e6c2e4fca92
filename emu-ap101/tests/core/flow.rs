//! What ends a run: breakpoints, faults, and a machine that halts.

use emu_ap101::Ap101;
use emu_core::cpu::{Cpu, ProgramError, ProgramFault, ResetCause, StopReason};
use emu_core::pins::{CycleTime, PinLevel};

use crate::rig::{Block, image, words};

const POWER: u16 = 768;
const CLEAR: u16 = 769;

fn machine(text: &str, block: &Block) -> Ap101 {
    Ap101::new(&image(&words(text), Some(block)))
}

#[test]
fn a_jump_out_of_the_program_is_not_carried_out() {
    let mut machine = machine("ldc M0; jmpc 9; nop", &Block::EMPTY);
    let fault = StopReason::Error(ProgramError::Fault { pc: 1, fault: ProgramFault::JumpOutOfProgram { target: 9 } });
    for _ in 0..2 {
        assert_eq!(machine.run(100, &mut ()), fault);
        assert_eq!((machine.cycle(), machine.pc(), machine.instructions()), (5, 1, 1));
        assert_eq!(machine.reg("RIC"), Some(words("ldc M0")[0].into()));
    }
    // It continues when A is changed from outside.
    machine.set_reg("A", 0);
    assert_eq!(machine.run(100, &mut ()), fault, "in the next program cycle");
    assert!(machine.cycle() > 5);
}

#[test]
fn a_program_cycle_without_an_end_is_ended() {
    let mut machine = machine("nop; jmp 1; nop", &Block::EMPTY);
    let stop = machine.run(1_000_000, &mut ());
    assert_eq!(stop, StopReason::Error(ProgramError::Fault { pc: 1, fault: ProgramFault::CycleTooLong }));
    assert_eq!((machine.cycle(), machine.instructions()), (4 + 65_536, 65_536));
    assert_eq!(machine.run(1_000_000, &mut ()), stop);
    machine.reset(ResetCause::External);
    assert_eq!(machine.run(machine.cycle() + 100, &mut ()), StopReason::Limit);
}

#[test]
fn the_longest_program_cycle_ends() {
    // After 65,536 cycles only another instruction would be too late.
    let mut machine = machine("jmpc 2; jmp 3; jmp 0; nop; jmp 4", &Block { outputs: 0, ..Block::EMPTY });
    machine.run(65_535, &mut ());
    machine.poke("code", 2 * 4, words("jmp 0")[0] as u8);
    assert_eq!(machine.run(65_536, &mut ()), StopReason::Limit);
    assert_eq!(machine.run(65_600, &mut ()), StopReason::Limit, "it has ended in time");
}

#[test]
fn traps_stop_before_their_instruction_once() {
    let mut machine = machine("ldc M0; sto M1; jmp 0", &Block::EMPTY);
    for pc in [0, 2] {
        machine.set_breakpoint(pc, true);
    }
    let mut stops = Vec::new();
    while let StopReason::Breakpoint { pc } = machine.run(40, &mut ()) {
        stops.push((machine.cycle(), pc));
    }
    assert_eq!(
        stops,
        [(4, 0), (6, 2), (11, 0), (13, 2), (18, 0), (20, 2), (25, 0), (27, 2), (32, 0), (34, 2), (39, 0)]
    );
    let mut copy = machine.clone();
    copy.set_breakpoint(2, false);
    copy.set_breakpoint(0, false);
    assert_eq!(copy.run(100, &mut ()), StopReason::Limit);
    assert_eq!(machine.run(100, &mut ()), StopReason::Breakpoint { pc: 2 }, "the clone has traps of its own");
}

#[test]
fn a_machine_that_nothing_can_wake_has_halted() {
    let mut none = Ap101::new(&image(&[], None));
    assert_eq!(none.run(1000, &mut ()), StopReason::Halted);
    assert_eq!(none.cycle(), 256, "after the reload");

    let mut block = Block { reconfigurable: true, ..Block::EMPTY };
    block.programs[3] = [0, 1, 0, 1];
    let mut idle = machine("ldc M0; sto M1", &block);
    assert_eq!((idle.run(1000, &mut ()), idle.cycle()), (StopReason::Halted, 4));
    idle.drive(CycleTime::at(50), 0, PinLevel::High);
    assert_eq!((idle.run(1000, &mut ()), idle.cycle()), (StopReason::Halted, 50));
    assert!(idle.poke("m", 251, 1));
    assert_eq!((idle.run(53, &mut ()), idle.peek("m", 1)), (StopReason::Limit, Some(1)));
    assert_eq!(idle.reg("PROG"), Some(3));

    let mut off = machine("ldc M0; sto M1; sto E1", &Block::EMPTY);
    off.drive(CycleTime::at(20), POWER, PinLevel::Low);
    assert_eq!((off.run(1000, &mut ()), off.cycle(), off.pin_level(513)), (StopReason::Halted, 20, PinLevel::Low));
    off.drive(CycleTime::at(30), POWER, PinLevel::Float);
    assert_eq!(off.run(40, &mut ()), StopReason::Limit);
    assert_eq!(off.pin_level(513), PinLevel::High, "reloaded from its image");
}

#[test]
fn resets_are_power_failures_with_and_without_a_cold_start() {
    for (why, kept) in
        [(ResetCause::PowerOn, 0), (ResetCause::External, 1), (ResetCause::Watchdog, 1), (ResetCause::BrownOut, 1)]
    {
        let mut machine = machine("ldc M0; sto M1; sto E1", &Block::EMPTY);
        machine.run(20, &mut ());
        machine.reset(why);
        assert_eq!(
            (machine.peek("m", 1), machine.peek("m", 257), machine.peek("e", 1)),
            (Some(kept), Some(kept), Some(0))
        );
        machine.run(24, &mut ());
        assert_eq!(machine.peek("e", 1), Some(kept), "{why:?}");
    }
    let mut machine = machine("ldc M0; sto M1; sto E1", &Block::EMPTY);
    machine.drive(CycleTime { cycle: 19, phase: 1 }, CLEAR, PinLevel::High);
    machine.run(20, &mut ());
    assert_eq!(machine.peek("m", 1), Some(0));
}

#[test]
fn na_wraps_at_the_end_of_memory() {
    let mut block = Block { outputs: 0, ..Block::EMPTY };
    block.programs[0] = [2046, 2047, 0, 1];
    block.programs[1] = [0, 1, 0, 1];
    let mut machine = Ap101::new(&image(&[0xFFFF; 2048], Some(&block)));
    machine.run(2, &mut ());
    assert_eq!((machine.pc(), machine.reg("PROG")), (0, Some(0)));
    machine.run(3, &mut ());
    assert_eq!((machine.pc(), machine.reg("PROG")), (1, Some(1)));
    // After NA was set outside of the program, it returns to the program.
    machine.set_pc(2047);
    machine.run(6, &mut ());
    assert_eq!((machine.reg("PROG"), machine.instructions()), (Some(1), 6));
}

#[test]
fn a_reset_without_supply_is_nothing() {
    let mut machine = machine("ldc M0; sto M1; nop", &Block::EMPTY);
    machine.drive(CycleTime::at(6), POWER, PinLevel::Low);
    assert_eq!(machine.run(100, &mut ()), StopReason::Halted);
    let before = (machine.cycle(), machine.pc(), machine.peek("m", 1));
    assert_eq!(before, (6, 2, Some(1)));
    machine.reset(ResetCause::PowerOn);
    assert_eq!(machine.run(100, &mut ()), StopReason::Halted);
    assert_eq!((machine.cycle(), machine.pc(), machine.peek("m", 1)), before);
}
