//! What going back and looking at writes costs, counted.

use std::cell::Cell;
use std::rc::Rc;

use emu_core::Chip;
use emu_core::cpu::RamInit;
use emu_core::image::{self, ElfMachine};
use emu_debug::debug::{Flow, Follow, Goal, Look, Options, Rig, Scope, Session, Target, What, Why, flow};
use emu_debug::{Board, Clock};

fn chip() -> &'static Chip {
    emu_avr::chips::CHIPS.iter().copied().find(|chip| chip.name == "atmega328p").expect("a chip")
}

/// The machine with an example.
fn target(file: &str) -> Box<dyn Target> {
    let path = format!("{}/../examples/avr/{file}", env!("CARGO_MANIFEST_DIR"));
    let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let loaded = image::load(file, &bytes, chip().hex, chip().elf, ElfMachine(chip().elf_machine));
    let Ok(loaded) = loaded else { panic!("{path}") };
    let cpu = emu_avr::Avr::new(chip(), &loaded.image, RamInit::Zero);
    Box::new(Rig::new(cpu, Board::new(Vec::new(), Clock { hz: 16_000_000, clocks_per_cycle: 1 })))
}

/// Counts the copies that are made of it.
struct Copies(Rc<Cell<usize>>);

impl Follow for Copies {
    fn stops(&self) -> &[u32] {
        &[]
    }
    fn at(&mut self, _: &dyn Target, _: u32) {}
    fn scan(&self) -> Option<u64> {
        None
    }
    fn fork(&self) -> Box<dyn Follow> {
        self.0.set(self.0.get() + 1);
        Box::new(Copies(Rc::clone(&self.0)))
    }
    fn weight(&self) -> usize {
        0
    }
    fn as_any(&self) -> &dyn std::any::Any {
        self
    }
}

#[test]
fn a_point_that_is_long_past_is_found_with_few_copies() {
    let copies = Rc::new(Cell::new(0));
    let follow: Option<Box<dyn Follow>> = Some(Box::new(Copies(Rc::clone(&copies))));
    let clock = Clock { hz: 16_000_000, clocks_per_cycle: 1 };
    let mut session =
        Session::new(target("millis.elf"), Scope::new(chip()), Options { clock, history: 64 << 20, follow });
    // The start of main, to which the program comes once.
    let main = 0x102 / 2;
    let id = session.points.add(What::Code(vec![main]), "main", false);
    let goal = Goal { until: Some(8_000_000), ..Goal::default() };
    assert!(matches!(session.run(&goal, &mut || true).why, Why::Points(_)));
    let at = session.target().cycle();
    while session.history_size().0 < 64 {
        // Long enough for a copy on a fast host too.
        session.stepi(200_000, u64::MAX, &mut || true);
    }
    let kept = session.history_size().0;
    copies.set(0);
    match session.back_run(&mut || true).why {
        Why::Points(hits) => assert_eq!((hits[0].id, session.target().cycle()), (id, at)),
        why => panic!("{why:?}"),
    }
    // One for each group of stretches, each twice as long as the one before, and those that stop at the hit.
    assert!(copies.get() <= kept.ilog2() as usize + 4, "{} copies of {kept} that are kept", copies.get());
}

#[test]
fn writes_are_waited_for_without_the_turns_of_waiting_loops() {
    struct Count(u64, u64);
    impl emu_core::Probe for Count {
        fn insn(&mut self, _: u64, _: u32) -> bool {
            self.0 += 1;
            false
        }
        fn data(&mut self, _: u64, _: u8, _: u16, _: u8, write: bool) -> bool {
            self.1 += u64::from(write);
            false
        }
    }
    let (mut one, mut other) = (target("printf.elf"), target("printf.elf"));
    let (mut all, mut writes) = (Count(0, 0), Count(0, 0));
    one.run(2_000_000, Look::All, &mut all);
    other.run(2_000_000, Look::Writes, &mut writes);
    assert_eq!(one.save(), other.save());
    assert_eq!(all.1, writes.1, "writes");
    assert!(writes.0 < all.0 / 3, "{} of {} instructions", writes.0, all.0);
}

#[test]
fn room_on_the_stack_is_no_call() {
    let of = |word: u16| flow(chip(), |_| word, 0x100);
    assert_eq!(of(0xD000), (Flow::Plain, 1), "rcall .+0");
    assert_eq!(of(0xD001), (Flow::Call, 1), "rcall .+2");
    assert_eq!(of(0xDFFF), (Flow::Call, 1), "rcall .-2");
}
