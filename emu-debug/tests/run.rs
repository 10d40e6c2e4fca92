//! The runner, case by case in `run.txt`: a program, its conditions, how and when it ended.

use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_debug::stimulus::{parse_timed_drive, queue_drives};
use emu_debug::stop_condition::parse_condition;
use emu_debug::{AddressNames, CycleClock, RunPlan};
use emu_test_support::case_lines;

const WORDS: &[&str] = &["until", "at", "limit", "expect", "fail", "trap", "host"];

fn image(program: &str) -> Image {
    emu_asm::assemble_text(&ATMEGA328P, &program.replace(';', "\n")).unwrap_or_else(|e| panic!("{program}: {e}"))
}

/// Splits `until a b at c`: every word of [`WORDS`] begins a part.
fn parts(text: &str) -> Vec<(&str, String)> {
    let mut parts: Vec<(&str, String)> = Vec::new();
    for word in text.split_whitespace() {
        match (WORDS.contains(&word), parts.last_mut()) {
            (true, _) => parts.push((word, String::new())),
            (false, Some((_, rest))) => *rest = format!("{rest} {word}").trim().to_owned(),
            (false, None) => panic!("`{word}` in `{text}`"),
        }
    }
    parts
}

fn run(program: &str, waits: &str) -> String {
    let image = image(program);
    let names = AddressNames { chip: &ATMEGA328P, symbols: &[] };
    let mut cpu = Avr::new(&ATMEGA328P, &image, RamInit::Zero);
    let mut plan = RunPlan { limit: 100_000, ..RunPlan::default() };
    let (mut drives, mut host) = (Vec::new(), true);
    let clock = CycleClock { hz: 16_000_000, clocks_per_cycle: 1 };
    for (word, text) in parts(waits) {
        match word {
            "until" => plan.until.push(parse_condition(&names, &text).expect("a condition")),
            "at" => drives.push(parse_timed_drive(&ATMEGA328P, clock, &text).expect("a drive")),
            "limit" => plan.limit = text.parse().expect("cycles"),
            "expect" => plan.expect = Some(text.into_bytes()),
            "fail" => plan.fail = Some(text.into_bytes()),
            "trap" => {
                plan.stop_on_unwritten_read = true;
                plan.initialized.extend((!text.is_empty()).then(|| names.parse_range(&text).expect("a range")));
            }
            _ => host = false,
        }
    }
    queue_drives(&mut cpu, &drives).expect("levels only");
    let ended = emu_debug::run(&mut cpu, &plan, None, &mut |_| host);
    format!("{:?} {}", ended.reason, cpu.cycle())
}

#[test]
fn runs() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    for line in case_lines(include_str!("run.txt")) {
        let columns: Vec<&str> = line.split(" | ").map(str::trim).collect();
        let [program, waits, wanted] = columns[..] else { panic!("three columns wanted: {line}") };
        let found = run(program, waits);
        count += 1;
        if found != wanted {
            wrong.push(format!("{line}\n    found {found}"));
        }
    }
    assert!(count > 30, "only {count} cases were read");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
