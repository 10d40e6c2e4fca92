//! Any slicing gives the same run: in one go, in slices, step by step, from a clone, with and without skipped
//! polling loops.

use emu_avr::chips::ATMEGA328P;
use emu_avr::isa::{AvrOpKind, KINDS, ROWS};
use emu_avr::{Avr, Options};
use emu_core::image::{Image, Segment};
use emu_core::rng::Rng;
use emu_core::{Cpu, RamInit, StopReason};

use super::states::{draw, split};

const SEED: u64 = 0x5EED_0002;

/// Returns everything that a program can see, the counters that tools use, and the snapshot.
fn look(avr: &Avr) -> (Vec<Option<u8>>, [u32; 3], u64, u64, Vec<u8>) {
    let reg = |name| avr.reg(name).unwrap_or(u32::MAX);
    let data = (0..0x900).map(|a| avr.peek("data", a)).collect();
    (data, [reg("SREG"), reg("SP"), reg("PC")], avr.cycle(), avr.instructions(), avr.save())
}

pub fn machine(words: &[u16], seed: u64) -> Avr {
    let bytes = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    let image = Image { segments: vec![Segment { space: "flash", addr: 0, bytes }], ..Image::default() };
    Avr::new(&ATMEGA328P, &image, RamInit::Random(seed))
}

/// Fills flash with random instructions, including jumps. Calls and indirect jumps go anywhere, so that all
/// of it is executed.
fn program(rng: &mut Rng) -> Vec<u16> {
    let mut words = Vec::with_capacity(0x4000);
    while words.len() < 0x4000 {
        let n = rng.below(ROWS.len() as u64) as usize;
        let (row, kind) = (&ROWS[n], KINDS[n]);
        // If one word in 150 stopped the run, little would be compared.
        if matches!(kind, AvrOpKind::Spm | AvrOpKind::Sleep) {
            continue;
        }
        let d = draw(row, kind, rng);
        words.extend(&d.words[..row.len() as usize]);
    }
    words.truncate(0x4000);
    words
}

/// Runs to `until` in slices given by `piece`; returns the last stop reason.
fn pieces(avr: &mut Avr, until: u64, mut piece: impl FnMut() -> u64) -> StopReason {
    loop {
        let before = (avr.cycle(), avr.instructions());
        let to = (avr.cycle() + piece()).min(until);
        let stop = avr.run(to, &mut ());
        assert!(
            stop != StopReason::Limit || (avr.cycle(), avr.instructions()) != before,
            "no progress at {before:?}, {:04x}",
            avr.pc()
        );
        if stop != StopReason::Limit || avr.cycle() >= until {
            return stop;
        }
    }
}

pub fn same_however_cut(what: &str, start: &Avr, until: u64, rng: &mut Rng) {
    let mut whole = start.clone();
    let stop = whole.run(until, &mut ());
    let wanted = (stop, look(&whole));

    let mut sliced = start.clone();
    let stop = pieces(&mut sliced, until, || 1 + rng.below(40));
    assert!((stop, look(&sliced)) == wanted, "{what}: in slices");

    let mut stepped = start.clone();
    let stop = loop {
        let before = stepped.cycle();
        let stop = stepped.step(&mut ());
        assert!(
            stop != StopReason::Limit || stepped.cycle() != before,
            "{what}: a step from {before} makes no progress"
        );
        if stop != StopReason::Limit || stepped.cycle() >= until {
            break stop;
        }
    };
    // A step out of sleep may end after `until`.
    let mut whole = start.clone();
    let wanted_there = (whole.run(stepped.cycle().max(until), &mut ()), look(&whole));
    assert!((stop, look(&stepped)) == wanted_there, "{what}: step by step");

    let mut cycles = start.clone();
    let stop = pieces(&mut cycles, until, || 1);
    assert!((stop, look(&cycles)) == wanted, "{what}: in slices of one cycle");

    let mut half = start.clone();
    // A run that has stopped for another reason is over.
    if half.run(until / 2, &mut ()) == StopReason::Limit {
        let mut copy = half.clone();
        let stop = half.run(until, &mut ());
        assert!((stop, look(&half)) == wanted, "{what}: two halves");
        let stop = copy.run(until, &mut ());
        assert!((stop, look(&copy)) == wanted, "{what}: from a clone");
    }

    let mut plain = start.clone();
    plain.set_skip_idle_loops(false);
    let stop = plain.run(until, &mut ());
    assert!((stop, look(&plain)) == wanted, "{what}: without jumping over polls");
}

#[test]
fn random_programs() {
    let mut rng = Rng::new(SEED);
    let mut far = 0;
    for n in 0..30 {
        let seed = rng.next_u64();
        let avr = machine(&program(&mut rng), seed);
        let until = 200 + rng.below(3000);
        same_however_cut(&format!("seed {SEED:#x}, program {n}"), &avr, until, &mut rng);
        let mut run = avr.clone();
        run.run(until, &mut ());
        far += run.cycle();
    }
    // If all runs stopped at once, nothing would be compared.
    assert!(far > 10_000, "only {far} cycles in all");
}

/// Polling loops as compilers and people write them; the code before them sets up the timer that they wait
/// for.
const POLLS: &[&[&str]] = &[
    &["in r16, 0x15", "sbrs r16, 0", "rjmp .-6", "sbi 0x15, 0", "inc r20", "rjmp .-12"],
    &["sbis 0x15, 0", "rjmp .-4", "out 0x15, r17", "inc r20", "rjmp .-10"],
    &["lds r16, 0x0035", "andi r16, 1", "breq .-8", "out 0x15, r17", "inc r20", "rjmp .-14"],
    &["in r16, 0x15", "cpi r16, 0", "breq .-6", "out 0x15, r17", "inc r20", "rjmp .-12"],
    &["in r16, 0x26", "cpi r16, 9", "brne .-6", "inc r20", "rjmp .-10"],
    &["sbic 0x1E, 0", "rjmp .-4", "inc r20", "rjmp .-8"],
    &["sbis 0x1E, 7", "rjmp .-4"],
    &["rjmp .-2"],
    &["wdr", "sbis 0x15, 0", "rjmp .-6", "out 0x15, r17", "inc r20", "rjmp .-12"],
    &["in r16, 0x15", "wdr", "sbrs r16, 0", "rjmp .-8", "sbi 0x15, 0", "inc r20", "rjmp .-14"],
    &["wdr", "rjmp .-4"],
    // Through a pointer with a constant value, as compilers generate without optimization.
    &["ldi r30, 0x35", "ldi r31, 0", "ld r16, Z", "sbrs r16, 0", "rjmp .-10", "st Z, r17", "inc r20", "rjmp .-16"],
    &[
        "ldi r24, 0x30",
        "ldi r25, 0",
        "movw r28, r24",
        "ldd r24, Y+5",
        "wdr",
        "andi r24, 1",
        "breq .-14",
        "std Y+5, r17",
        "rjmp .-18",
    ],
    // Delay loops.
    &["ldi r24, 200", "dec r24", "brne .-4", "in r20, 0x26", "rjmp .-10"],
    &["ldi r24, 200", "ldi r25, 3", "sbiw r24, 1", "brne .-4", "in r20, 0x15", "rjmp .-12"],
    &["ldi r18, 99", "ldi r19, 7", "wdr", "subi r18, 1", "sbci r19, 0", "nop", "brne .-10", "inc r20", "rjmp .-18"],
    &["ldi r18, 99", "subi r18, 1", "sbci r18, 0", "brne .-6", "rjmp .-10"],
    &["subi r18, 1", "brne .-4", "sbci r19, 0", "sbiw r26, 1", "dec r21", "brne .-8", "rjmp .-14"],
    // A pointer whose load is sometimes skipped has no known value.
    &[
        "ldi r30, 0x35",
        "ldi r31, 0",
        "sbic 0x15, 0",
        "ldi r30, 0x20",
        "ld r16, Z",
        "sbrs r16, 0",
        "rjmp .-14",
        "out 0x15, r17",
        "rjmp .-18",
    ],
];

/// Code before the loops that sets up the watchdog: off; 16 ms until it resets the chip; its interrupt, which
/// leaves its flag set.
const WATCHDOGS: [&[&str]; 3] = [
    &[],
    &["ldi r18, 0x18", "sts 0x60, r18", "ldi r18, 0x08", "sts 0x60, r18"],
    &["ldi r18, 0x18", "sts 0x60, r18", "ldi r18, 0x40", "sts 0x60, r18"],
];

#[test]
fn polling_loops() {
    let mut rng = Rng::new(SEED ^ 1);
    for (n, lines) in POLLS.iter().enumerate() {
        for (prescaler, watchdog) in (1..=5).flat_map(|p| WATCHDOGS.map(|watchdog| (p, watchdog))) {
            // TCCR0B starts timer 0; r17 clears its overflow flag.
            let head = [format!("ldi r16, {prescaler}"), "out 0x25, r16".into(), "ldi r17, 1".into()];
            let head = head.iter().map(String::as_str).chain(watchdog.iter().copied());
            let text = head.chain(lines.iter().copied()).collect::<Vec<_>>().join("\n");
            let image = emu_asm::assemble_text(&ATMEGA328P, &text).unwrap_or_else(|e| panic!("{e}\n{text}"));
            // At this clock the watchdog's 16 ms are about 2,000 cycles.
            let options = Options::at_hz(128_000);
            let avr = Avr::with(&ATMEGA328P, &image, RamInit::Random(n as u64), options);
            let until = 500 + rng.below(20_000);
            let what = format!("loop {n}, prescaler {prescaler}, watchdog {watchdog:?}, until {until}");
            same_however_cut(&what, &avr, until, &mut rng);
        }
    }
}

#[test]
fn drawn_words_are_the_row_asked_for() {
    let mut rng = Rng::new(SEED ^ 2);
    for (row, &kind) in ROWS.iter().zip(KINDS) {
        for _ in 0..50 {
            let d = draw(row, kind, &mut rng);
            let bits =
                if row.len() == 2 { u32::from(d.words[0]) << 16 | u32::from(d.words[1]) } else { d.words[0].into() };
            assert!(row.pattern.matches(bits), "{}: {:04x?}", row.name, d.words);
            assert_eq!(split(row, bits).0, d.words[0]);
        }
    }
}
