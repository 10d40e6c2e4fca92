//! Campaigns of random programs: a small one with a fixed seed finds nothing, uses every element often
//! enough, and gives the same result in shards. EMU_FUZZ_PROGRAMS and EMU_FUZZ_SEED select another campaign,
//! without the lower bounds.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use emu_check::fuzz::{
    CampaignPlan, CampaignRecord, CampaignShard, FAMILIES, ProgramProfile, generate_program, run_trial,
};
use ladder::ProgramElement;
use ladder_compile::find_target;

/// Time limit per program, far above the normal time on a busy machine.
const LIMIT: Duration = Duration::from_secs(600);

/// A number from an environment variable.
fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

fn plan() -> CampaignPlan {
    let (seed, programs) = (number("EMU_FUZZ_SEED").unwrap_or(1), number("EMU_FUZZ_PROGRAMS").unwrap_or(150));
    CampaignPlan { seed, programs, scans: 40, mcus: FAMILIES.map(str::to_owned).to_vec() }
}

fn run(plan: &CampaignPlan, index: u64, of: u64) -> CampaignRecord {
    let shard = CampaignShard { index, of, done: 0 };
    let mut record = CampaignRecord::new(plan.clone(), shard);
    for k in 0..shard.program_count(plan.programs) {
        assert!(!record.complete);
        record.add_trial(&run_trial(plan, shard.program_number(k), LIMIT));
    }
    record
}

/// Rows are `chips (t: those with integers) | feature | minimum`: lower bounds for the campaign above.
#[rustfmt::skip]
const FLOORS: &str = "
all | CONTACTS          | 150
all | COIL              | 40
all | COIL negated      | 10
all | COIL set          | 10
all | COIL reset        | 10
all | OSR               | 5
all | OSF               | 5
all | TON               | 5
all | TOF               | 5
all | RTO               | 5
all | CTU               | 5
all | CTD               | 5
all | CTC               | 5
all | RES               | 8
all | MASTER_RELAY      | 2
all | SHORT             | 5
all | OPEN              | 2
all | COMMENT           | 2
all | depth 0           | 100
all | depth 1           | 50
all | depth 2           | 30
all | depth 3           | 15
all | depth 4           | 5
all | double coils      | 5
t   | MOVE              | 20
t   | ADD               | 10
t   | SUB               | 10
t   | MUL               | 10
t   | DIV               | 10
t   | EQU               | 8
t   | NEQ               | 8
t   | GRT               | 8
t   | GEQ               | 8
t   | LES               | 8
t   | LEQ               | 8
t   | SHIFT_REGISTER    | 10
t   | LOOK_UP_TABLE     | 15
t   | PIECEWISE_LINEAR  | 12
t   | UART_SEND         | 10
t   | UART_RECV         | 10
t   | FORMATTED_STRING  | 10
t   | aliased operands  | 10
t   | aliased tables    | 1
t   | IF_BIT_SET        | 8
t   | IF_BIT_CLEAR      | 8
t   | shared timers or counters    | 10
t   | integers of several widths   | 15
p   | READ_ADC          | 15
p   | SET_PWM           | 8
p   | PERSIST           | 10
";

#[test]
fn a_small_campaign_finds_nothing_and_has_everything() {
    let plan = plan();
    let shards: Vec<CampaignRecord> = [3, 1, 2].map(|index| run(&plan, index, 3)).into_iter().collect();
    assert!(!CampaignRecord::merge_shards(shards[..2].to_vec()).expect("two shards").complete);
    let record = CampaignRecord::merge_shards(shards).expect("three shards");
    println!("{}", record.text());
    assert!(record.complete);
    assert!(record.findings.is_empty(), "{}", record.text());
    if number("EMU_FUZZ_PROGRAMS").or(number("EMU_FUZZ_SEED")).is_some() {
        return;
    }
    for (tally, of) in record.tallies.iter().zip(["8051", "PIC", "AVR", "AP101"]) {
        let refused: u64 = tally.refused.values().map(|reason| reason.programs).sum();
        assert_eq!(tally.checked + tally.outside + refused, plan.programs, "{}", tally.mcu);
        assert!(refused * 20 <= plan.programs, "{}: {refused} refused: {:?}", tally.mcu, tally.refused);
        let mut seen: BTreeMap<String, u64> = tally.elements.clone();
        seen.extend(tally.depths.iter().map(|(depth, n)| (format!("depth {depth}"), *n)));
        seen.extend(tally.risky_features.clone());
        for floor in FLOORS.lines().filter(|line| !line.is_empty()) {
            let [chips, what, least] = floor.split('|').map(str::trim).collect::<Vec<_>>()[..] else {
                panic!("{floor}")
            };
            let counts = match chips {
                "p" => ["PIC", "AVR"].contains(&of),
                "t" => of != "AP101",
                _ => true,
            };
            let found = seen.get(what).copied().unwrap_or(0);
            let least: u64 = least.parse().expect("a number");
            assert!(!counts || found >= least, "{}: {found} of {what}, least {least}", tally.mcu);
        }
        // Forty scans per program are few, so at least a sixth of all outcomes must be seen.
        let (covered, total) =
            tally.outcomes.values().fold((0, 0), |(c, t), outcome| (c + outcome.covered, t + outcome.total));
        assert!(covered * 6 >= total, "{}: {covered} of {total} outcomes", tally.mcu);
    }
    // One piece gives the same result as the shards.
    let small = CampaignPlan { programs: 8, scans: 10, ..plan };
    let pieces = (1..=5).map(|index| run(&small, index, 5)).collect();
    let mut whole = CampaignRecord::merge_shards(pieces).expect("five shards");
    let one = run(&small, 1, 1);
    whole.shards.clone_from(&one.shards);
    assert_eq!(whole, one);
}

#[test]
fn shards_share_all_programs() {
    for (programs, of) in [(1, 1), (10, 3), (3, 10), (1_000, 7), (0, 4), (2, 9)] {
        let mut all: Vec<u64> = Vec::new();
        for index in 1..=of {
            let shard = CampaignShard { index, of, done: 0 };
            all.extend((0..shard.program_count(programs)).map(|k| shard.program_number(k)));
        }
        all.sort_unstable();
        assert_eq!(all, (0..programs).collect::<Vec<_>>(), "{programs} in {of}");
    }
}

#[test]
fn records_that_do_not_belong_together() {
    let plan = CampaignPlan { programs: 10, ..plan() };
    let other = CampaignPlan { seed: 99, ..plan.clone() };
    let record =
        |plan: &CampaignPlan, index, of, done| CampaignRecord::new(plan.clone(), CampaignShard { index, of, done });
    #[rustfmt::skip]
    let cases: [(&str, Vec<CampaignRecord>); 9] = [
        ("no record of a campaign", vec![]),
        ("different campaigns",  vec![record(&plan, 1, 2, 0), record(&other, 2, 2, 0)]),
        ("first is program 0",   vec![record(&plan, 1, 3, 0), record(&plan, 1, 1, 0)]),
        ("first is program 4",   vec![record(&plan, 1, 2, 0), record(&plan, 2, 3, 0)]),
        ("1/2 and 2/4 are of different splits", vec![record(&plan, 1, 2, 0), record(&plan, 2, 4, 0)]),
        ("no shard 0/2",         vec![record(&plan, 0, 2, 0)]),
        ("no shard 3/2",         vec![record(&plan, 3, 2, 0)]),
        ("no shard 1/2",         vec![record(&plan, 1, 2, 6)]),
        ("was given twice",      vec![record(&plan, 2, 3, 0), record(&plan, 1, 3, 0), record(&plan, 2, 3, 1)]),
    ];
    for (why, records) in cases {
        let reported = CampaignRecord::merge_shards(records).expect_err(why).to_string();
        assert!(reported.contains(why), "{reported}");
    }
}

/// A generated program is valid, and parsing its text gives the same program.
#[test]
fn programs_are_valid_and_written_as_they_are() {
    let (mut profiles, mut dialects) = (BTreeMap::new(), BTreeMap::new());
    for number in 0..600 {
        let (drawn, profile) = generate_program(5, number);
        let text = ladder::write(&drawn);
        let parsed = ladder::parse_with("fuzz.ld", &text, ladder::ParseOptions { dialect: Some(drawn.dialect) })
            .unwrap_or_else(|faults| panic!("{number}: {faults:?}\n{text}"));
        assert_eq!(ladder::write(&parsed.program), text, "{number}");
        let elements = |program: &ladder::LadderProgram| -> Vec<_> {
            program.elements().map(|at| (at.id, at.element.clone())).collect()
        };
        assert_eq!(elements(&parsed.program), elements(&drawn), "{number}");
        *dialects.entry(drawn.dialect.to_string()).or_insert(0) += 1;
        let wrong: Vec<_> = ladder::check(&parsed.program).into_iter().filter(|reported| reported.is_error()).collect();
        assert!(wrong.is_empty(), "{number}: {wrong:?}\n{text}");
        *profiles.entry(profile).or_insert(0) += 1;
    }
    assert!(dialects.len() == 2 && dialects.values().all(|count| *count >= 100), "{dialects:?}");
    // At least a part of the programs suits all families.
    assert!(profiles[&ProgramProfile::Bits] >= 60 && profiles.len() == 6, "{profiles:?}");
    assert!(FAMILIES.iter().all(|mcu| ProgramProfile::Bits.is_supported_by(find_target(mcu).expect("a chip"))));
}

/// Elements that random programs leave out, with the reason.
const LEFT_OUT: &[(&str, &str)] = &[
    ("PLACEHOLDER", "it is refused"),
    ("LOCK", "it ends the program: nothing more would be compared"),
    ("DELAY", "it has no effect"),
    ("SLEEP", "it has no effect"),
    ("STRING", "it has no effect"),
    ("CLRWDT", "it has no effect"),
];

/// Every element of the language occurs in random programs, from which campaigns and the kill table are
/// drawn, or is listed.
#[test]
fn every_element_is_drawn() {
    let rows = include_str!("../../../ladder/tests/language/tables/elements.txt").lines();
    let mut missing: BTreeSet<&str> = rows
        .filter(|row| row.contains(" => ") && !row.starts_with('#'))
        .filter_map(|row| row.split_whitespace().next())
        .collect();
    assert!(missing.len() > 90, "{}", missing.len());
    for number in 0..3_000 {
        let (program, _) = generate_program(26, number);
        program.elements().for_each(|ProgramElement { element, .. }| _ = missing.remove(element.facts().keyword));
    }
    let listed: BTreeSet<&str> = LEFT_OUT.iter().map(|(keyword, _)| *keyword).collect();
    assert_eq!(missing, listed);
}
