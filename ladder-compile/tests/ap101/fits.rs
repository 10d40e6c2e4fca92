//! Tests the limits of AP101: programs that do not fit are refused with numbers; programs that just fit work.

use ladder::LadderDialect::{Ldmicro5, Ldmicro23};
use ladder_compile::target::BuildRefusal;

use crate::machine_pair::{HEAD, MachinePair, program_in};

/// Formats every reason as `rung.element: cause`.
fn reasons(refusal: BuildRefusal) -> Vec<String> {
    match refusal {
        BuildRefusal::Several(all) => all.into_iter().flat_map(reasons).collect(),
        BuildRefusal::Unsupported { cause, hint, element } => {
            assert!(!hint.is_empty(), "{cause}");
            let place = element.map_or("-".to_owned(), |id| format!("{}.{}", id.rung + 1, id.index + 1));
            vec![format!("{place}: {cause}")]
        }
        other => vec![format!("{other:?}")],
    }
}

/// Rungs, and the beginning of each expected reason for refusal.
const REFUSED: &[(&str, &[&str])] = &[
    ("RUNG\nMOVE v 3\nEND", &["1.1: `v := 3` computes with integers"]),
    // All reasons are reported.
    (
        "RUNG\nCONTACTS Xa 0\nADD v v 1\nEND\nRUNG\nEQU v 3\nCOIL Ya 0 0 0\nEND\nRUNG\nMUL w v v\nEND",
        &["1.2: `v := v + 1`", "2.1: `and v == 3`", "3.1: `w := v * v`"],
    ),
    // A timer that is also used as a number.
    (
        "RUNG\nCONTACTS Xa 0\nTON Ta 50000\nCOIL Ya 0 0 0\nEND\nRUNG\nGRT Ta 2\nCOIL Yb 0 0 0\nEND",
        &["2.1: `and Ta >= 3`"],
    ),
    ("RUNG\nCONTACTS Xa 0\nCTU Ca 5\nCOIL Ya 0 0 0\nEND\nRUNG\nCONTACTS Xb 0\nMOVE Ca 2\nEND", &["2.2: `Ca := 2`"]),
    // Two elements with one name.
    (
        "RUNG\nCONTACTS Xa 0\nCTU Ca 5\nCOIL Ya 0 0 0\nEND\nRUNG\nCONTACTS Xb 0\nCTD Ca 5\nCOIL Yb 0 0 0\nEND",
        &["2.2: `Ca` has a timer or counter already"],
    ),
    // A RES of a symbol that is not a timer or counter.
    ("RUNG\nCONTACTS Xa 0\nRES Ca\nEND", &["1.2: `Ca := 0` computes with integers"]),
];

#[test]
fn what_the_machine_lacks_is_refused() {
    for (rungs, wanted) in REFUSED {
        let found = reasons(MachinePair::new(&program_in(rungs, Ldmicro23)).err().expect("a refusal"));
        assert_eq!(found.len(), wanted.len(), "{rungs}\n{found:#?}");
        for (found, wanted) in found.iter().zip(*wanted) {
            assert!(found.starts_with(wanted), "{rungs}\n{found}\n{wanted}");
        }
    }
}

/// A counter of dialect ldmicro-5, and the reason for its refusal.
const FIVE: &[(&str, &str)] = &[
    ("CTU Ca Cb 0 /", "1.2: the limit of `Ca` is the integer `Cb`"),
    ("CTU Ca 40000 0 /", "1.2: `Ca` has the limit 40000"),
    ("CTD Ca 32767 0 /", "1.2: `Ca` has the limit 32767"),
];

#[test]
fn limits_of_wide_counters_are_refused() {
    for (counter, wanted) in FIVE {
        let text = format!("RUNG\nCONTACTS Xa 0\n{counter}\nCOIL Ya 0 0 0\nEND");
        let found = reasons(MachinePair::new(&program_in(&text, Ldmicro5)).err().expect("a refusal"));
        assert!(found.len() == 1 && found[0].starts_with(wanted), "{counter}: {found:#?}");
    }
}

/// Clock in Hz, cycle in microseconds; the machine cycles per period, or the reason for refusal.
#[rustfmt::skip]
const PERIODS: &[(u64, u64, Result<u64, &str>)] = &[
    (1_000_000,      10_000, Ok(5_000)),
    (11_059_200,     10_000, Ok(55_296)),
    (3_579_545,      10_000, Err("-: the cycle of 10000 us at 3579545 Hz is 715909/40 machine cycles of two clocks")),
    (3_579_545,     400_000, Ok(715_909)),
    (32_768,         10_000, Err("-: the cycle of 10000 us at 32768 Hz is 4096/25 machine cycles")),
    (32_768,         15_625, Ok(256)),
    (20_000_000,      7_919, Ok(79_190)),
    (1_000_000,       7_919, Err("-: the cycle of 7919 us at 1000000 Hz is 7919/2 machine cycles")),
    (1_000_000, 8_589_934_590, Ok(4_294_967_295)),
    (1_000_000, 8_589_934_592, Err("-: the cycle of 8589934592 us at 1000000 Hz is 4294967296 machine cycles, the most is 4294967295")),
];

#[test]
fn periods_are_exact_or_refused() {
    for &(clock, cycle, ref wanted) in PERIODS {
        let text = format!(
            "LDmicro0.1\nCYCLE={cycle}\nCRYSTAL={clock}\nIO LIST\nEND\nPROGRAM\nRUNG\nCONTACTS Ya 1\nCOIL Ya 0 0 0\nEND\n"
        );
        match (MachinePair::new(&program_in(&text, Ldmicro23)), wanted) {
            (Ok(mut pair), Ok(wanted)) => {
                assert_eq!((pair.built.period.num, pair.built.period.den), (*wanted, 1));
                // Each scan must start at a multiple of the period.
                (0..3000).for_each(|_| pair.scan().unwrap_or_else(|how| panic!("{clock} Hz, {cycle} us: {how}")));
            }
            (Err(why), Err(wanted)) => {
                let found = reasons(why);
                assert!(found.len() == 1 && found[0].starts_with(wanted), "{found:#?}");
            }
            (found, _) => panic!("{clock} Hz, {cycle} us: {:?}", found.err()),
        }
    }
}

/// Generates `count` rungs.
fn rungs(count: u32, rung: impl Fn(u32) -> String) -> String {
    (0..count).map(|n| format!("RUNG\n{}\nEND\n", rung(n))).collect()
}

#[test]
fn program_memory_is_filled_to_its_last_word() {
    // Two words per rung, and the last instruction. A set coil keeps its bit, so the optimiser can remove no
    // rung.
    let from = |n: u32| if n == 0 { "X0".to_owned() } else { format!("R{}", (n - 1) % 90) };
    let text = |count| format!("{HEAD}{}", rungs(count, |n| format!("CONTACTS {} 1\nCOIL R{} 0 1 0", from(n), n % 90)));
    let mut pair = MachinePair::new(&program_in(&text(1023), Ldmicro23)).expect("it fits");
    assert_eq!((pair.built.lines.len(), pair.built.worst_scan_cycles), (2047, 2047));
    for scan in 0..5 {
        pair.drive("X0", scan % 2 == 0);
        pair.scan().expect("the same");
    }
    let refused = MachinePair::new(&program_in(&text(1024), Ldmicro23)).err().expect("a refusal");
    assert_eq!(refused, BuildRefusal::CodeTooLarge { needed: 4098, available: 4096, rungs: vec![4; 1024] });
}

#[test]
fn memory_is_filled_to_its_last_bit() {
    // 248 bits, and 256 output images less the one in use; one bit is scratch.
    let text = |count| {
        format!(
            "{HEAD}RUNG\nCOIL Y0 0 1 0\nEND\n{}",
            rungs(count, |n| format!("CONTACTS X0 0\nCOIL R{n} {} 0 0", n % 2))
        )
    };
    let mut pair = MachinePair::new(&program_in(&text(502), Ldmicro23)).expect("it fits");
    pair.drive("X0", true);
    (0..3).for_each(|_| pair.scan().expect("the same"));
    let refused = reasons(MachinePair::new(&program_in(&text(503), Ldmicro23)).err().expect("a refusal"));
    assert_eq!(refused, ["-: relays and memories need 504 bits of M, and 503 are free"]);
}

#[test]
fn modules_are_all_used() {
    let text =
        |count| format!("{HEAD}{}", rungs(count, |n| format!("CONTACTS X0 0\nCTU C{n} {n}\nCOIL R{} 0 0 0", n % 50)));
    let mut pair = MachinePair::new(&program_in(&text(128), Ldmicro23)).expect("it fits");
    for scan in 0..300 {
        pair.drive("X0", scan % 2 == 0);
        pair.scan().expect("the same");
    }
    let refused = reasons(MachinePair::new(&program_in(&text(129), Ldmicro23)).err().expect("a refusal"));
    assert_eq!(refused, ["-: the program has 129 timers and counters, the machine has 128"]);
}

/// Uses all inputs and outputs of the machine.
#[test]
fn every_channel_is_used() {
    let all = rungs(256, |n| format!("PARALLEL\nCONTACTS X{n} 0\nCONTACTS X{} 0\nEND\nCOIL Y{n} 0 0 0", n + 256));
    let mut pair = MachinePair::new(&program_in(&format!("{HEAD}{all}"), Ldmicro23)).expect("it fits");
    for n in (0..512).step_by(7) {
        pair.drive(&format!("X{n}"), true);
        pair.scan().expect("the same");
    }
}
