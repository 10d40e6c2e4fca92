//! Counts the cost of running backwards and of watching writes.

use emu_debug::debug::InstructionFlow;
use std::cell::Cell;
use std::rc::Rc;

use emu_core::Chip;
use emu_core::cpu::RamInit;
use emu_core::image::{self, ElfMachine};
use emu_debug::debug::{
    CallFlow, DebugSession, DynMachine, MachineWithDevices, NameScope, ObserveLevel, PointTrigger, ProgramFollower,
    RunGoal, SessionOptions, SessionStopReason, call_flow,
};
use emu_debug::{AttachedDevices, CycleClock};

fn chip() -> &'static Chip {
    emu_avr::chips::AVR_CHIPS.iter().copied().find(|chip| chip.name == "atmega328p").expect("a chip")
}

/// Returns the machine with an example.
fn target(file: &str) -> Box<dyn DynMachine> {
    let path = format!("{}/../examples/avr/{file}", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let loaded = image::load(file, &bytes, chip().hex_spaces, chip().elf_spaces, ElfMachine(chip().elf_machine));
    let Ok(loaded) = loaded else { panic!("{path}") };
    let cpu = emu_avr::Avr::new(chip(), &loaded.image, RamInit::Zero);
    Box::new(MachineWithDevices::new(
        cpu,
        AttachedDevices::new(Vec::new(), CycleClock { hz: 16_000_000, clocks_per_cycle: 1 }),
    ))
}

/// Counts its copies.
struct Copies(Rc<Cell<usize>>);

impl ProgramFollower for Copies {
    fn followed_words(&self) -> &[u32] {
        &[]
    }
    fn on_reached(&mut self, _: &dyn DynMachine, _: u32) {}
    fn scan(&self) -> Option<u64> {
        None
    }
    fn fork(&self) -> Box<dyn ProgramFollower> {
        self.0.set(self.0.get() + 1);
        Box::new(Copies(Rc::clone(&self.0)))
    }
    fn size_in_bytes(&self) -> usize {
        0
    }
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }
}

#[test]
fn a_point_that_is_long_past_is_found_with_few_copies() {
    let copies = Rc::new(Cell::new(0));
    let follow: Option<Box<dyn ProgramFollower>> = Some(Box::new(Copies(Rc::clone(&copies))));
    let clock = CycleClock { hz: 16_000_000, clocks_per_cycle: 1 };
    let mut session = DebugSession::new(
        target("millis.elf"),
        NameScope::new(chip()),
        SessionOptions { clock, max_copy_bytes: 64 << 20, follower: follow },
    );
    // The start of main, which the program reaches once.
    let main = 0x102 / 2;
    let id = session.points.add(PointTrigger::Code(vec![main]), "main", false);
    let goal = RunGoal { until: Some(8_000_000), ..RunGoal::default() };
    assert!(matches!(session.run(&goal, &mut || true), SessionStopReason::Points(_)));
    let at = session.machine().cycle();
    while session.history_size().copies < 64 {
        // Long enough for a copy on a fast host too.
        session.step_instructions(200_000, u64::MAX, &mut || true);
    }
    let kept = session.history_size().copies;
    copies.set(0);
    match session.run_back(&mut || true) {
        SessionStopReason::Points(hits) => assert_eq!((hits[0].id, session.machine().cycle()), (id, at)),
        why => panic!("{why:?}"),
    }
    // One for each group of stretches, each twice as long as the previous one, and those that stop at the
    // hit.
    assert!(copies.get() <= kept.ilog2() as usize + 4, "{} copies of {kept} that are kept", copies.get());
}

#[test]
fn writes_are_waited_for_without_the_iterations_of_waiting_loops() {
    struct Count(u64, u64);
    impl emu_core::Probe for Count {
        fn on_instruction(&mut self, _: u64, _: u32) -> bool {
            self.0 += 1;
            false
        }
        fn on_data_access(&mut self, _: u64, _: u8, _: u16, _: u8, write: bool) -> bool {
            self.1 += u64::from(write);
            false
        }
    }
    let (mut one, mut other) = (target("printf.elf"), target("printf.elf"));
    let (mut all, mut writes) = (Count(0, 0), Count(0, 0));
    one.run(2_000_000, ObserveLevel::All, &mut all);
    other.run(2_000_000, ObserveLevel::Writes, &mut writes);
    assert_eq!(one.save(), other.save());
    assert_eq!(all.1, writes.1, "writes");
    assert!(writes.0 < all.0 / 3, "{} of {} instructions", writes.0, all.0);
}

#[test]
fn room_on_the_stack_is_no_call() {
    let of = |word: u16| call_flow(chip(), |_| word, 0x100);
    assert_eq!(of(0xD000), InstructionFlow { flow: CallFlow::Plain, words: 1 }, "rcall .+0");
    assert_eq!(of(0xD001), InstructionFlow { flow: CallFlow::Call, words: 1 }, "rcall .+2");
    assert_eq!(of(0xDFFF), InstructionFlow { flow: CallFlow::Call, words: 1 }, "rcall .-2");
}
