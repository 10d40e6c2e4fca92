//! A run that is interrupted all the time stops at the same breakpoints as one that is not, forwards and backwards.

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::cpu::RamInit;
use emu_debug::debug::{Goal, Options, Rig, Scope, Session, What, Why};
use emu_debug::{Board, Clock};

fn session() -> Session {
    session_of("nop\nnop\nnop\nnop\nloop: nop\nrjmp loop\n")
}

fn session_of(program: &str) -> Session {
    let image = emu_asm::image(&ATMEGA328P, program).expect("a program");
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

/// Runs that breakpoints have cut short say nothing of how long the next may go on unasked.
#[test]
fn breakpoints_make_no_run_deaf() {
    let mut session = session_of("loop: inc r16\nrjmp loop\n");
    session.points.add(What::Code(vec![1]), "", false);
    for _ in 0..100 {
        assert!(matches!(session.run(&Goal::default(), &mut || true).why, Why::Points(_)));
    }
    session.points.clear();
    let (start, mut asked) = (session.target().cycle(), 0);
    let halt = session.run(&Goal::default(), &mut || {
        asked += 1;
        asked < 4
    });
    assert_eq!(halt.why, Why::Interrupted);
    // A stretch takes a millisecond or two of any host; without the mend they are 2^40 cycles long.
    assert!(session.target().cycle() - start < 1 << 32, "{}", session.target().cycle() - start);
}

/// A program that only something from outside can bring on is stopped where it stands, and not at the end of time.
#[test]
fn what_waits_for_ever_is_stopped() {
    let rows = [
        ("loop: sbis 0x09, 2\nrjmp loop\n", Why::Waits),
        ("loop: sbis 0x09, 2\nrjmp loop\nend: rjmp end\n", Why::Waits),
        ("ldi r16, 0x98\nsts 0xC1, r16\nldi r16, 1\nout 0x33, r16\nsei\nloop: sleep\nrjmp loop\n", Why::Waits),
        ("ldi r16, 1\nout 0x33, r16\nloop: sleep\nrjmp loop\n", Why::Halted),
        ("loop: rjmp loop\n", Why::Halted),
    ];
    for (program, why) in rows {
        let mut session = session_of(program);
        for turn in 1..4 {
            assert_eq!(session.run(&Goal::default(), &mut || true).why, why, "{program}");
            assert!(session.target().cycle() < turn << 16, "{program}: {}", session.target().cycle());
        }
        // Time passes where somebody says how much, and leads back again.
        let goal = Goal { until: Some(1 << 40), passes: true, ..Goal::default() };
        assert_eq!(session.run(&goal, &mut || true).why, Why::Limit, "{program}");
        let (cycle, state) = (session.target().cycle(), session.target().save());
        assert!((1 << 40..(1 << 40) + 4).contains(&cycle), "{program}: {cycle}");
        assert_eq!(session.back_stepi(1, &mut || true).why, Why::Done, "{program}");
        assert!(session.target().cycle() < cycle, "{program}");
        session.stepi(1, 1 << 41, &mut || true);
        assert!(session.target().save() == state, "{program}");
    }
    // Timers that are left are not waited for in vain: their time is looked at.
    let mut session =
        session_of("ldi r16, 1\nout 0x25, r16\nloop: in r17, 0x26\ncpi r17, 200\nbrne loop\nend: rjmp end\n");
    assert_eq!(session.run(&Goal::default(), &mut || true).why, Why::Halted);
    assert_eq!(session.target().pc(), 5);
}

/// A stretch of the past in which the program waited took no time when it ran first, and takes hours when every instruction of it is
/// looked at: it is left in the middle.
#[test]
fn a_search_back_through_a_long_wait_is_interrupted() {
    let mut session = session_of("ldi r16, 5\nout 0x25, r16\nloop: sbis 0x15, 0\nrjmp loop\nsbi 0x15, 0\nrjmp loop\n");
    let goal = Goal { until: Some(1 << 36), ..Goal::default() };
    assert_eq!(session.run(&goal, &mut || true).why, Why::Limit);
    let wanted = session.scope.expr("r20").expect("a register");
    let mut asked = 0;
    let found = session.last(What::Change(wanted), &mut || {
        asked += 1;
        asked < 8
    });
    assert_eq!(found, Err(Why::Interrupted));
}
