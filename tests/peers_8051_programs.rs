//! C programs compiled by SDCC in three memory models print the same here as on s51, and end at the same
//! time.
//!
//! A plain `cargo test` ignores them; `.ci/peers` installs sdcc and s51 and runs them.
//! `peers/s51_programs/print.h` contains the code that the programs share, with the four output methods that
//! the tests name.

#[path = "peers/s51_programs/driver.rs"]
mod driver;
#[path = "peers/tools.rs"]
mod tools;

use driver::{build, ours, theirs};

/// Programs without interrupts.
const PLAIN: &str = "sort sieve crc format longs floats recurse structs tables bits pointers matrix queue digits words";

const MODELS: [&str; 3] = ["small", "medium", "large"];

/// Builds and runs a program in every memory model, and requires the same output. Returns the model, the
/// length of the output, the machine cycles of s51, and the additional cycles here.
fn compare(name: &str, way: &str) -> Vec<(&'static str, i64, u64, i64)> {
    let pairs = MODELS.into_iter().map(|model| {
        let hex = build(name, model, way);
        let (theirs, ours) = (theirs(&hex), ours(&hex));
        assert_eq!(ours.text, theirs.text, "{name} {model} {way}");
        assert!(ours.text.ends_with('\n'), "{name} {model} {way}: {:?}", ours.text);
        for line in known(name) {
            assert!(
                ours.text.lines().any(|l| l.trim_end() == line),
                "{name} {model} {way}: no line `{line}` in\n{}",
                ours.text
            );
        }
        let difference = ours.cycles as i64 - theirs.cycles as i64;
        println!("{name} {model} {way}: {} bytes, {} cycles, {difference:+}", ours.text.len(), theirs.cycles);
        (model, ours.text.len() as i64, theirs.cycles, difference)
    });
    pairs.collect()
}

/// Lines that are known without an emulator: `program: line`.
const KNOWN: &str = "
sieve: primes=550
sieve: last=3989
crc: C1 8FDD 414FA339 5BDC0FDA
digits: 265252859812191058636308480000000
digits: 314159265358979323846264
digits: 012586269025
recurse: fibonacci=233
recurse: ackermann=9
recurse: queens=4
floats: 1.4142
floats: 0.8415
floats: 2.7183
words: XXI CCXCIV DLXVII DCCCXL MCXIII MCCCLXXXVI MDCLIX MCMXXXII
words: YWI=
pointers: 5AA502
irq_modes: pulses=37
irq_idle: awake after each=200
irq_pins: nested 5 3 10r 05
";

fn known(name: &str) -> impl Iterator<Item = &'static str> {
    KNOWN.lines().filter_map(|line| line.split_once(": ")).filter(move |(n, _)| *n == name).map(|(_, line)| line)
}

/// Requires the same end cycle for programs without interrupts and without dependence on the phase of the
/// serial port's dividers.
fn exact(way: &str) {
    let differing: Vec<_> = PLAIN
        .split(' ')
        .flat_map(|name| compare(name, way).into_iter().filter(|row| row.3 != 0).map(move |row| (name, row)))
        .collect();
    assert!(differing.is_empty(), "{way}: {differing:?}");
}

#[test]
#[ignore = "needs sdcc and s51: .ci/peers installs them"]
fn programs_that_do_not_ask_for_ti_end_at_the_same_cycle() {
    exact("PACED");
}

#[test]
#[ignore = "needs sdcc and s51: .ci/peers installs them"]
fn programs_that_ask_for_ti_end_at_the_same_cycle() {
    exact("LOCKED");
}

#[test]
#[ignore = "needs sdcc and s51: .ci/peers installs them"]
fn programs_in_the_style_of_compiler_tests_end_at_the_same_cycle() {
    exact("MODE0");
}

/// Bytes at full speed while timer 1 and the divider by 16 after it run continuously.
///
/// The transmission begins at the rollover after the write, and TI is set at the 10th one (manual, "More
/// about mode 1"). Consecutive bytes take ten bits each, 480 cycles. s51 begins with the write and counts 160
/// overflows from there: a byte takes longer by the program's time between TI and the next write, and a late
/// byte need not wait for a rollover, which saves at most one bit of 48 cycles.
#[test]
#[ignore = "needs sdcc and s51: .ci/peers installs them"]
fn programs_that_send_while_the_divider_runs_print_the_same() {
    for name in PLAIN.split(' ') {
        for (model, bytes, _, difference) in compare(name, "POLLED") {
            let allowed = -48 * bytes..=48 * bytes;
            assert!(allowed.contains(&difference), "{name} {model}: {difference} cycles in {bytes} bytes");
        }
    }
}

/// `program method: minimum maximum`: by how many machine cycles the program ends later here than on s51, and
/// why.
///
/// The manual ("How interrupts are handled") says: a flag set in S5P2 of cycle n is polled in n + 1; if that
/// cycle ends an instruction, the call takes n + 2 and n + 3. s51 checks the flags after every instruction
/// and calls at once, one to four cycles earlier.
const INTERRUPTS: &str = "
irq_tick   LOCKED:     0 1000  200 interrupts reload their timer, so that what each comes later adds up: up to five cycles each
irq_modes  LOCKED:     0   30  three waits for the last of many interrupts, at timers that reload themselves; a turn of the wait each
irq_idle   LOCKED:     0    4  200 wakes by a timer that runs on; only the last one counts
irq_pins   LOCKED:   -30    0  a level that the handler takes away calls it once, but on s51 once more; seven edges are not awaited
irq_serial POLLED: -1350    0  135 bytes; up to ten cycles for the write after each TI, which s51 adds to the time of a byte
";

#[test]
#[ignore = "needs sdcc and s51: .ci/peers installs them"]
fn programs_with_interrupts_print_the_same() {
    for line in INTERRUPTS.trim().lines() {
        let (what, how) = line.split_once(':').unwrap_or_else(|| panic!("{line}"));
        let (name, way) = what.split_once(' ').unwrap_or_else(|| panic!("{line}"));
        let numbers: Vec<i64> = how.split_whitespace().take(2).map(|n| n.parse().expect("a number")).collect();
        for (model, _, _, difference) in compare(name, way.trim()) {
            assert!(
                (numbers[0]..=numbers[1]).contains(&difference),
                "{model}: {difference} cycles, not as in `{line}`"
            );
        }
    }
}
