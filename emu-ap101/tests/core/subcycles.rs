//! Fetch and execution as separate subcycles.

use emu_ap101::Ap101;
use emu_core::cpu::{Cpu, Probe, StopReason, Subcycle};
use emu_core::pins::{CycleTime, PinLevel};

use crate::rig::{Block, image, words};

/// Notes subcycles, and stops after the fetch of one word.
#[derive(Default)]
struct Notes {
    seen: Vec<(u64, u8, Subcycle, u32, u16)>,
    stop: Option<u32>,
}

impl Probe for Notes {
    const SUBCYCLE: bool = true;
    fn on_subcycle(&mut self, at: CycleTime, phase: Subcycle, pc: u32, word: u16) -> bool {
        self.seen.push((at.cycle, at.phase, phase, pc, word));
        phase == Subcycle::Fetch && self.stop == Some(pc)
    }
}

fn machine() -> Ap101 {
    Ap101::new(&image(&words("ldc M1; sto M2; jmp 0"), Some(&Block { outputs: 2, ..Block::EMPTY })))
}

#[test]
fn subcycles_come_in_pairs() {
    let mut notes = Notes::default();
    assert_eq!(machine().run(6, &mut notes), StopReason::Limit);
    let (fetch, execute) = (Subcycle::Fetch, Subcycle::Execute);
    let program = words("ldc M1; sto M2; jmp 0");
    let wanted: Vec<_> = (0..3u32)
        .flat_map(|i| {
            let (at, word) = (u64::from(i) + 2, program[i as usize]);
            [(at, 1, fetch, i, word), (at + 1, 0, execute, i, word)]
        })
        .collect();
    assert_eq!(notes.seen, wanted);
}

#[test]
fn a_stop_between_them_shows_ric_and_goes_on_from_there() {
    let (mut whole, mut parted) = (machine(), machine());
    assert_eq!(parted.run(100, &mut Notes { stop: Some(1), ..Notes::default() }), StopReason::Probe);
    assert_eq!((parted.cycle(), parted.instructions(), parted.pc()), (3, 1, 2));
    assert_eq!(parted.reg("RIC"), Some(words("sto M2")[0].into()));
    assert!(parted.has_fetched());
    assert_eq!(parted.peek("m", 2), Some(0), "it is not executed");
    // A snapshot between two subcycles continues like its original.
    let mut copy = parted.clone();
    for machine in [&mut parted, &mut copy, &mut whole] {
        assert_eq!(machine.run(50, &mut ()), StopReason::Limit);
        assert_eq!((machine.cycle(), machine.peek("m", 2)), (50, Some(1)));
    }
    for name in ["A", "NA", "RIC"] {
        assert_eq!(parted.reg(name), whole.reg(name), "{name}");
        assert_eq!(copy.reg(name), whole.reg(name), "{name}");
    }
    assert_eq!(parted.instructions(), whole.instructions());
}

#[test]
fn subcycle_by_subcycle_is_the_same_as_in_one_go() {
    let (mut whole, mut parted) = (machine(), machine());
    for machine in [&mut whole, &mut parted] {
        machine.drive(CycleTime { cycle: 9, phase: 1 }, 512, PinLevel::High);
    }
    whole.run(40, &mut ());
    let mut steps = 0;
    while parted.cycle() < 40 {
        parted.step_subcycle(&mut ());
        steps += 1;
    }
    // Two steps for an instruction, one for each cycle of a reload.
    assert_eq!(steps, 2 * whole.instructions() + (40 - whole.instructions()));
    assert_eq!((parted.instructions(), parted.reg("NA")), (whole.instructions(), whole.reg("NA")));
    assert_eq!(parted.peek("m", 2), whole.peek("m", 2));
}

#[test]
fn a_step_is_one_instruction_or_one_wait() {
    let mut machine = machine();
    assert_eq!(machine.step(&mut ()), StopReason::Limit);
    assert_eq!((machine.cycle(), machine.instructions()), (2, 0), "the reload after power-up");
    for n in 1..=3 {
        machine.step(&mut ());
        assert_eq!((machine.cycle(), machine.instructions()), (2 + n, n));
    }
    machine.step(&mut ());
    assert_eq!((machine.cycle(), machine.instructions()), (7, 3), "the reload of a program cycle");
}

#[test]
fn what_is_in_ric_is_what_is_executed() {
    let mut machine = machine();
    assert_eq!(machine.run(100, &mut Notes { stop: Some(1), ..Notes::default() }), StopReason::Probe);
    // The word has already left program memory.
    machine.poke("code", 2, words("sto M3")[0] as u8);
    machine.step(&mut ());
    assert_eq!((machine.peek("m", 2), machine.peek("m", 3)), (Some(1), Some(0)));
}
