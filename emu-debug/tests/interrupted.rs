//! A run that is interrupted all the time stops at the same breakpoints as one that is not, forwards and
//! backwards.

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::cpu::RamInit;
use emu_debug::debug::{
    DebugSession, MachineWithDevices, NameScope, PointTrigger, RunGoal, SessionOptions, SessionStopReason,
};
use emu_debug::{AttachedDevices, CycleClock};

fn session() -> DebugSession {
    session_of("nop\nnop\nnop\nnop\nloop: nop\nrjmp loop\n")
}

fn session_of(program: &str) -> DebugSession {
    let image = emu_asm::assemble_text(&ATMEGA328P, program).expect("a program");
    let clock = CycleClock { hz: 16_000_000, clocks_per_cycle: 1 };
    let rig =
        MachineWithDevices::new(Avr::new(&ATMEGA328P, &image, RamInit::Zero), AttachedDevices::new(Vec::new(), clock));
    let options = SessionOptions { clock, max_copy_bytes: 1 << 20, follower: None };
    DebugSession::new(Box::new(rig), NameScope::new(&ATMEGA328P), options)
}

#[test]
fn no_breakpoint_is_lost() {
    let mut session = session();
    session.points.add(PointTrigger::Code(vec![1, 2, 3, 4]), "", false);
    let mut seen = Vec::new();
    let mut asked = 0;
    while seen.len() < 6 && asked < 100 {
        match session.run(&RunGoal::default(), &mut || false) {
            SessionStopReason::Points(hits) => seen.extend(hits.iter().map(|hit| hit.pc)),
            why => assert_eq!(why, SessionStopReason::Interrupted),
        }
        asked += 1;
    }
    assert_eq!(seen, [1, 2, 3, 4, 4, 4]);
}

#[test]
fn nor_on_the_way_back() {
    let mut session = session();
    // Copies of the machine are kept at the end of each run.
    for cycle in 1..=12 {
        session.run(&RunGoal { until: Some(cycle), ..RunGoal::default() }, &mut || true);
    }
    session.points.add(PointTrigger::Code(vec![1, 2, 3, 4]), "", false);
    let back = |session: &mut DebugSession| match session.run_back(&mut || true) {
        SessionStopReason::Points(hits) => hits.first().map(|hit| (hit.pc, session.machine().cycle())),
        _ => None,
    };
    let seen: Vec<(u32, u64)> = std::iter::from_fn(|| back(&mut session)).take(9).collect();
    assert_eq!(seen, [(4, 10), (4, 7), (4, 4), (3, 3), (2, 2), (1, 1)]);
}

/// Runs that breakpoints have cut short do not lengthen the time for which the next run is not interruptible.
#[test]
fn breakpoints_make_no_run_deaf() {
    let mut session = session_of("loop: inc r16\nrjmp loop\n");
    session.points.add(PointTrigger::Code(vec![1]), "", false);
    for _ in 0..100 {
        assert!(matches!(session.run(&RunGoal::default(), &mut || true), SessionStopReason::Points(_)));
    }
    session.points.clear();
    let (start, mut asked) = (session.machine().cycle(), 0);
    let halt = session.run(&RunGoal::default(), &mut || {
        asked += 1;
        asked < 4
    });
    assert_eq!(halt, SessionStopReason::Interrupted);
    // A stretch takes a millisecond or two on any host; with the fault, stretches are 2^40 cycles long.
    assert!(session.machine().cycle() - start < 1 << 32, "{}", session.machine().cycle() - start);
}

/// A program that only a stimulus can continue is stopped where it is, and not at the end of time.
#[test]
fn endless_waits_are_stopped() {
    let rows = [
        ("loop: sbis 0x09, 2\nrjmp loop\n", SessionStopReason::BlockedOnInput),
        ("loop: sbis 0x09, 2\nrjmp loop\nend: rjmp end\n", SessionStopReason::BlockedOnInput),
        (
            "ldi r16, 0x98\nsts 0xC1, r16\nldi r16, 1\nout 0x33, r16\nsei\nloop: sleep\nrjmp loop\n",
            SessionStopReason::BlockedOnInput,
        ),
        ("ldi r16, 1\nout 0x33, r16\nloop: sleep\nrjmp loop\n", SessionStopReason::Halted),
        ("loop: rjmp loop\n", SessionStopReason::Halted),
    ];
    for (program, why) in rows {
        let mut session = session_of(program);
        for turn in 1..4 {
            assert_eq!(session.run(&RunGoal::default(), &mut || true), why, "{program}");
            assert!(session.machine().cycle() < turn << 16, "{program}: {}", session.machine().cycle());
        }
        // Time passes if the run has an end, and can be reverted.
        let goal = RunGoal { until: Some(1 << 40), runs_while_halted: true, ..RunGoal::default() };
        assert_eq!(session.run(&goal, &mut || true), SessionStopReason::Limit, "{program}");
        let (cycle, state) = (session.machine().cycle(), session.machine().save());
        assert!((1 << 40..(1 << 40) + 4).contains(&cycle), "{program}: {cycle}");
        assert_eq!(session.step_back(1, &mut || true), SessionStopReason::Done, "{program}");
        assert!(session.machine().cycle() < cycle, "{program}");
        session.step_instructions(1, 1 << 41, &mut || true);
        assert!(session.machine().save() == state, "{program}");
    }
    // A timer that still runs ends the wait, so its time is taken into account.
    let mut session =
        session_of("ldi r16, 1\nout 0x25, r16\nloop: in r17, 0x26\ncpi r17, 200\nbrne loop\nend: rjmp end\n");
    assert_eq!(session.run(&RunGoal::default(), &mut || true), SessionStopReason::Halted);
    assert_eq!(session.machine().pc(), 5);
}

/// A stretch of the past in which the program waited took no time when it first ran, and takes hours when
/// every instruction of it is observed: the search can be interrupted in the middle.
#[test]
fn a_search_back_through_a_long_wait_is_interrupted() {
    let mut session = session_of("ldi r16, 5\nout 0x25, r16\nloop: sbis 0x15, 0\nrjmp loop\nsbi 0x15, 0\nrjmp loop\n");
    let goal = RunGoal { until: Some(1 << 36), ..RunGoal::default() };
    assert_eq!(session.run(&goal, &mut || true), SessionStopReason::Limit);
    let wanted = session.scope.parse_expression("r20").expect("a register");
    let mut asked = 0;
    let found = session.last_access(PointTrigger::Change(wanted), &mut || {
        asked += 1;
        asked < 8
    });
    assert_eq!(found.err(), Some(SessionStopReason::Interrupted));
}
