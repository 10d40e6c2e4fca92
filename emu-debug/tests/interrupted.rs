//! A run that is interrupted all the time stops at the same breakpoints as one that is not, forwards and backwards.

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::cpu::RamInit;
use emu_debug::debug::{Goal, Options, Rig, Scope, Session, What, Why};
use emu_debug::{Board, Clock};

fn session() -> Session {
    let image = emu_asm::image(&ATMEGA328P, "nop\nnop\nnop\nnop\nloop: nop\nrjmp loop\n").expect("a program");
    let clock = Clock { hz: 16_000_000, clocks_per_cycle: 1 };
    let rig = Rig::new(Avr::new(&ATMEGA328P, &image, RamInit::Zero), Board::new(Vec::new(), clock));
    let options = Options { clock, history: 1 << 20, follow: None };
    Session::new(Box::new(rig), Scope::new(&ATMEGA328P), options)
}

#[test]
fn no_breakpoint_is_lost() {
    let mut session = session();
    session.points.add(What::Code(vec![1, 2, 3, 4]), "", false);
    let mut seen = Vec::new();
    let mut asked = 0;
    while seen.len() < 6 && asked < 100 {
        match session.run(&Goal::default(), &mut || false).why {
            Why::Points(hits) => seen.extend(hits.iter().map(|hit| hit.pc)),
            why => assert_eq!(why, Why::Interrupted),
        }
        asked += 1;
    }
    assert_eq!(seen, [1, 2, 3, 4, 4, 4]);
}

#[test]
fn nor_on_the_way_back() {
    let mut session = session();
    // Copies of the machine are kept wherever a run has ended.
    for cycle in 1..=12 {
        session.run(&Goal { until: Some(cycle), ..Goal::default() }, &mut || true);
    }
    session.points.add(What::Code(vec![1, 2, 3, 4]), "", false);
    let back = |session: &mut Session| match session.back_run(&mut || true).why {
        Why::Points(hits) => hits.first().map(|hit| (hit.pc, session.target().cycle())),
        _ => None,
    };
    let seen: Vec<(u32, u64)> = std::iter::from_fn(|| back(&mut session)).take(9).collect();
    assert_eq!(seen, [(4, 10), (4, 7), (4, 4), (3, 3), (2, 2), (1, 1)]);
}
