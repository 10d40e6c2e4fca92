//! Faulty images must be found, reported as the right kind of difference, and replayed by the command in the
//! report.

use crate::common;
use emu_check::{CheckOptions, CheckReport, check_compiled};
use emu_core::image::HexSegment;
use emu_core::image::write_hex;
use ladder::LadderProgram;
use ladder_compile::{CompiledProgram, compile};

/// The program that `faults.txt` breaks. The second rung has a dozen words, which gives room for patches.
const RUNGS: &str = "
    RUNG\n CONTACTS Xa 0\n CONTACTS Ra 1\n COIL Ya 0 0 0\n END
    RUNG\n MUL a b c\n END
    RUNG\n CONTACTS Xa 0\n TON Ta 5000\n COIL Ra 0 0 0\n END";

fn compiled(program: &LadderProgram) -> CompiledProgram {
    let options = ladder_compile::CompileOptions { mcu: "atmega328p".to_owned(), ..Default::default() };
    compile(program, &options).unwrap_or_else(|faults| panic!("{faults:?}"))
}

fn checked(program: &LadderProgram, compiled: &CompiledProgram, options: &CheckOptions) -> CheckReport {
    check_compiled(program, compiled, options, &mut |_, _| {}).expect("a report")
}

/// Overwrites the code from byte address `at` on with hexadecimal words.
fn patch(compiled: &mut CompiledProgram, at: usize, words: &str) {
    for (n, word) in words.split_whitespace().enumerate() {
        let word = u16::from_str_radix(word, 16).expect("a word");
        compiled.code[at + 2 * n..][..2].copy_from_slice(&word.to_le_bytes());
    }
    compiled.hex = write_hex(&[HexSegment { addr: 0, bytes: &compiled.code }]);
}

/// The byte address for a location in the table: `find WORD` or `rung.element`.
fn place(compiled: &CompiledProgram, place: &str) -> usize {
    if let Some(word) = place.strip_prefix("find ") {
        let word = u16::from_str_radix(word, 16).expect("a word").to_le_bytes();
        let found = compiled.code.chunks_exact(2).position(|code| code == word);
        return 2 * found.unwrap_or_else(|| panic!("no word {place} in\n{}", compiled.listing));
    }
    let (rung, element) = place.split_once('.').expect("rung.element");
    let element = compiled.map.elements.iter().find(|e| e.rung.to_string() == rung && e.element.to_string() == element);
    element.expect("an element").start as usize
}

#[test]
fn faults_are_reported_with_their_kind() {
    let program = common::rungs("faults.ld", RUNGS);
    for row in include_str!("faults.txt").lines().filter(|row| !row.starts_with('#')) {
        let [name, at, words, what, symbol, element] =
            row.split('|').map(str::trim).collect::<Vec<_>>().try_into().expect("six columns");
        let mut image = compiled(&program);
        let at = place(&image, at);
        patch(&mut image, at, words);
        let report = checked(&program, &image, &CheckOptions::default());
        let json = serde_json::to_value(&report).expect("JSON");
        let of = |field: &str| match &json["difference"][field] {
            serde_json::Value::Null => "-".to_owned(),
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        let blamed = if of("rung") == "-" { "-".to_owned() } else { format!("{}.{}", of("rung"), of("element")) };
        let found = [of("what"), of("symbol"), blamed];
        assert_eq!(found.each_ref().map(String::as_str), [what, symbol, element], "{name}:\n{}", report.text());
        assert_eq!(report.agreed, what == "-", "{name}");
        // Most faults need one scan, a moved stack needs two, a drift needs a few.
        let smallest = report.difference.as_ref().map_or(0, |d| d.smallest.len());
        let most = match what {
            "-" => 0,
            "period" => 8,
            "stack" => 2,
            _ => 1,
        };
        assert!(smallest <= most, "{name}:\n{}", report.text());
        replays(name, &program, &image, &report);
    }
}

/// The replay command reproduces the same difference, and a check with one scan less agrees.
fn replays(name: &str, program: &LadderProgram, image: &CompiledProgram, report: &CheckReport) {
    let Some(difference) = &report.difference else { return };
    let scans = difference.scan;
    assert_eq!(difference.replay, format!("emu check faults.ld --mcu atmega328p --seed 1 --scans {scans}"), "{name}");
    let options = CheckOptions { scans, ..CheckOptions::default() };
    assert_eq!(checked(program, image, &options).difference.as_ref(), Some(difference), "{name}");
    if scans > 1 {
        let options = CheckOptions { scans: scans - 1, ..CheckOptions::default() };
        assert!(checked(program, image, &options).agreed, "{name}");
    }
}

#[test]
fn replay_repeats_the_options() {
    let mut program = common::rungs("my program's.ld", RUNGS);
    program.format = ladder::LdFormat::V02;
    let pins = vec![ladder_compile::PinAssignment::new("Xa", "PD2")];
    let options = CheckOptions { pins, clock_hz: Some(1_000_000), seed: 9, ..CheckOptions::default() };
    let mut image = compiled(&program);
    let at = place(&image, "2.1");
    patch(&mut image, at, "CFFF");
    let report = checked(&program, &image, &options);
    assert_eq!(
        report.difference.expect("a difference").replay,
        r"emu check 'my program'\''s.ld' --mcu atmega328p --seed 9 --scans 1 --pin Xa=PD2 --dialect ldmicro-2.3 --clock 1000000"
    );
}

/// Images with these cycle times in microseconds at 1 MHz are checked against a program with 1,000 us.
#[test]
fn periods_may_not_drift() {
    let program = common::rungs("faults.ld", RUNGS);
    let image = compiled(&program);
    for (cycle, differs) in [(1000, false), (1001, true), (999, true), (1100, true), (500, true)] {
        let mut other = program.clone();
        other.settings.cycle_us = cycle;
        let mut image = image.clone();
        // Apart from the timer's period, the code is the same; the preset of the timer would differ too and
        // is kept.
        let period = ((cycle - 1) as u16)
            .to_le_bytes()
            .map(|byte| format!("{:04X}", 0xE080 | u16::from(byte & 0xF0) << 4 | u16::from(byte & 0x0F)));
        let (low, high) = (place(&image, "find EE87"), place(&image, "find E083"));
        patch(&mut image, low, &period[0]);
        patch(&mut image, high, &period[1]);
        let report = checked(&program, &image, &CheckOptions::default());
        let found = report.difference.as_ref().map(|d| d.what);
        assert_eq!(found, differs.then_some(emu_check::DifferenceKind::Period), "{cycle} us:\n{}", report.text());
        // A drift of one cycle per scan exceeds the window of a few cycles within 12 scans.
        assert!(report.difference.is_none_or(|d| d.scan < 12), "{cycle} us");
    }
}

/// Swapping the two bytes of any word of the scan is found.
#[test]
fn swapped_bytes_are_found() {
    let program = common::rungs("faults.ld", RUNGS);
    let image = compiled(&program);
    let (from, to) = (image.map.scan_start as usize, image.map.scan_end as usize);
    let mut missed = Vec::new();
    for at in (from..to).step_by(2).filter(|&at| image.code[at] != image.code[at + 1]) {
        let mut broken = image.clone();
        broken.code.swap(at, at + 1);
        broken.hex = write_hex(&[HexSegment { addr: 0, bytes: &broken.code }]);
        if checked(&program, &broken, &CheckOptions::default()).agreed {
            missed.push(format!("{at:04X}"));
        }
    }
    assert!(missed.is_empty(), "not found: {missed:?}\n{}", image.listing);
}
