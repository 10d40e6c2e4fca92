//! The AVR examples print what their headers state, switch their pins at the right times, and keep the data
//! that they store.

#[path = "peers/avr_programs/mod.rs"]
mod avr_programs;

use std::path::PathBuf;

use avr_programs::edges::{edges, pulses};
use avr_programs::table::{log, programs, text};
use avr_programs::{emu, example, sent};

#[test]
fn they_print_what_is_known() {
    for program in programs() {
        let image = example(&format!("{}.elf", program.name));
        assert_eq!(sent(&image, &program.flags), text(program.name), "{} {:?}", program.name, program.flags);
    }
}

/// Probes, conditions and the initial contents of RAM change neither the results of a program nor their
/// times.
#[test]
fn they_end_in_the_same_cycle_whoever_looks() {
    let wave = file("avr-wave.vcd").to_string_lossy().into_owned();
    let lookers: [&[&str]; 4] = [
        &["--vcd", &wave],
        &["--lint", "--ram", "random:5"],
        &["--ram", "trap"],
        &["--until", "pc=0x7ffe", "--until", "read data:0x8ff", "--until", "uart \"never\""],
    ];
    for program in programs() {
        let image = example(&format!("{}.elf", program.name));
        let outcome = |more: &[&str]| {
            let document = emu(&image, &[&program.flags, more].concat());
            ["cycles", "instructions", "uart", "pins"].map(|key| document[key].clone())
        };
        let plain = outcome(&[]);
        for more in lookers {
            assert_eq!(outcome(more), plain, "{} {more:?}", program.name);
        }
    }
}

#[test]
fn all_of_them_are_run() {
    let entries = std::fs::read_dir(example("")).expect("the folder").flatten();
    let files = entries.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|end| end == "c"));
    let mut names: Vec<String> = files.map(|path| path.file_stem().expect("a name").to_string_lossy().into()).collect();
    names.sort_unstable();
    let mut run: Vec<&str> = programs().iter().map(|program| program.name).collect();
    run.sort_unstable();
    assert_eq!(names, run);
}

/// The lamp switches within the right millisecond, always at the same offset: a timer count decides, and the
/// code after it always takes the same path.
#[test]
fn the_lamp_of_the_clock_turns_every_100_ms() {
    let edges = edges(&example("millis.elf"), "PB5");
    let turns: Vec<u64> = edges.iter().map(|edge| edge.0).skip_while(|&cycle| cycle < 1_000).collect();
    assert_eq!(turns.len(), 10, "{edges:?}");
    for (n, turn) in (1u64..).zip(&turns) {
        assert!((1_600_000 * n..1_600_000 * n + 1_000).contains(turn), "turn {n}: {edges:?}");
    }
    assert!(turns.windows(2).all(|pair| pair[1] - pair[0] == 1_600_000), "{edges:?}");
}

/// The width of each pulse is the table entry of the sine from two overflows before: the service routine
/// computes the next one, and the timer loads it at the end of its period.
#[test]
fn the_tone_is_a_sine_of_1_khz() {
    let rises = pulses(&edges(&example("tone.elf"), "PD3"));
    assert!(rises.windows(2).all(|pair| pair[1].0 - pair[0].0 == 256), "a pulse every 256 cycles");
    assert!((1_249..=1_252).contains(&rises.len()), "{} pulses", rises.len());
    let sine = |n: usize| {
        let phase = ((n * 1_049) >> 11) % 32;
        (128.0 + 120.0 * (phase as f64 / 32.0 * std::f64::consts::TAU).sin()).round() as u64
    };
    // A pulse is high from BOTTOM through the clock of the match: OCR + 1 clocks.
    let wanted: Vec<u64> = (0..1_200).map(|n| sine(n) + 1).collect();
    let found: Vec<u64> = rises.iter().map(|rise| rise.1).collect();
    let start = found.windows(20).position(|widths| widths == &wanted[..20]).expect("the beginning of the sine");
    assert!(start <= 3, "{start}");
    assert_eq!(found[start..start + 1_200], wanted[..]);
}

fn file(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&path);
    path
}

#[test]
fn what_they_store_is_there_when_they_start_again() {
    let held = file("avr-logger.bin");
    let attach = format!("i2c:24c64@0x50,file={}", held.display());
    let run = || sent(&example("logger.elf"), &["--attach", &attach]);
    assert_eq!(run(), format!("a new log\n{}", log(3)));
    assert_eq!(run(), log(6));
    assert_eq!(run(), log(9));
    let bytes = std::fs::read(&held).expect("what the 24C64 holds");
    assert_eq!((bytes.len(), &bytes[..2], &bytes[32..40]), (8192, &[9, 0][..], &b"\0\0\xE8\x03log\0"[..]));

    let held = file("avr-count.bin");
    let run = || sent(&example("count.elf"), &["--eeprom", &held.to_string_lossy()]);
    assert_eq!([run(), run(), run()], [1, 2, 3].map(|n| format!("counter: start {n}\n")));
}

#[test]
fn the_boot_loader_needs_its_fuses() {
    let image = example("boot.elf");
    let fused = emu(&image, &["--until", "pc=0x7000", "--peek", "fuse:0..3", "--no-start-up"]);
    assert_eq!((&fused["cycles"], &fused["peek"]["fuse:0..3"]), (&0.into(), &"ffd8ff".into()));
    // Without BOOTRST the chip starts at 0, where flash is still erased.
    let plain = emu(&image, &["--until", "pc=0x7000", "--fuse", "high=0xD9"]);
    assert_eq!((&plain["stop"]["reason"], &plain["stop"]["pc"]), (&"illegal".into(), &0.into()));
}
