//! The programs of examples/avr, rebuilt at four levels of optimisation, print the expected output here, and
//! under simavr where simavr is right.
//!
//! `peers/avr_programs/table.rs` computes the expected output without either machine. `examples_avr.rs`
//! checks the committed images against the same output, so all images are equivalent, whatever compiler
//! version built them.
//!
//! A plain `cargo test` ignores these tests; `.ci/peers` installs avr-gcc and simavr and runs them.

#[path = "peers/avr_programs/mod.rs"]
mod avr_programs;
#[path = "peers/tools.rs"]
mod tools;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock};

use avr_programs::edges::{edges, pulses};
use avr_programs::table::{programs, text};
use avr_programs::{MCU, example, sent};
use emu_avr::{Avr, chips};
use emu_core::image::{ElfMachine, load};
use emu_core::{Cpu, Probe, RamInit, StopReason};
use emu_test_support::{run_tool, test_folder};
use tools::source;

const LEVELS: [&str; 4] = ["-O0", "-Os", "-O2", "-O3"];

/// Limit of a program in cycles.
const CYCLES: u64 = 400_000_000;

/// GPIOR0 (DS40002061, 8.6.6).
const GPIOR0: u16 = 0x3E;

/// `name | additional arguments of simavr_program | deviation of simavr from the data sheet (DS40002061), by
/// section`.
///
/// If the last field is empty, simavr must print the expected output. A name may have a level as suffix; the
/// line then applies to that level only.
const SIMAVR: &str = "
printf   | |
muldiv   | |
sort     | |
millis   | |
tone     | |
watchdog | |
count    | |
echo     | HELLO |
echo-O2  | HELLO | CLI follows SLEEP, and runs before the interrupt that ended the sleep (10.1)
echo-O3  | HELLO | as at -O2
boot     | pc=0x7000 |
logger   | eeprom | TWSR is 28h behind an address that was acknowledged, where table 22-2 has 18h
filter   | 0:adc0=1250 648000:adc0=3100 | a match of timer 1 starts no conversion (24.3, table 24-6)
nap      | 1600000:D2=0 1680000:D2=1 6400000:D2=0 8000000:D2=1 10240000:D2=0 | INT0 by level comes once, not again (13.2.1)
";

/// Cycle limit for programs that never end under simavr: more than they take here.
const PATIENCE: u64 = 20_000_000;

/// Returns the arguments for `HELLO`: the bytes that the echo program receives, 4,200 cycles apart, slightly
/// slower than 38400 baud.
fn hello() -> Vec<String> {
    let texts = [(16_000, "Hello, world\n"), (320_000, "again\x04")];
    let byte = |(from, text): (usize, &'static str)| {
        text.bytes().enumerate().map(move |(n, byte)| format!("{}:uart={byte}", from + 4_200 * n))
    };
    texts.into_iter().flat_map(byte).collect()
}

/// Builds a program with the command in its header, at a level, with additional flags, in a separate folder.
/// Each build runs once for all tests.
fn build(name: &str, level: &str, more: &[&str]) -> PathBuf {
    static BUILT: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let folder_name = format!("avr_programs/{name}{level}{}", more.concat());
    let dir = test_folder!(&folder_name);
    let elf = dir.join(format!("{name}.elf"));
    let mut built = BUILT.lock().unwrap_or_else(|e| panic!("another build failed: {e}"));
    if built.contains(&folder_name) {
        return elf;
    }
    let c = example(&format!("{name}.c"));
    let head = fs::read_to_string(&c).unwrap_or_else(|e| panic!("{}: {e}", c.display()));
    let line = head.lines().find_map(|line| line.trim().strip_prefix("* Build: ")).unwrap_or_else(|| panic!("{name}"));
    let mut words = line.split(' ').map(|word| match word {
        "-Os" => level.to_owned(),
        word if word == format!("{name}.c") => c.to_string_lossy().into_owned(),
        word => word.to_owned(),
    });
    let compiler = words.next().expect("a compiler");
    let words: Vec<String> = words.collect();
    let mut args: Vec<&str> = words.iter().map(String::as_str).collect();
    args.extend(["-Wall", "-Wextra", "-Werror"].into_iter().filter(|_| level != "-O0"));
    args.extend(more);
    run_tool(&compiler, &args, &dir);
    built.insert(folder_name);
    elf
}

/// Returns the output of `simavr_program`: kind of line, value, cycle.
fn under_simavr(elf: &Path, cycles: u64, what: &str) -> Vec<(char, u8, u64)> {
    static BUILT: OnceLock<PathBuf> = OnceLock::new();
    let built = BUILT.get_or_init(|| {
        let out = test_folder!("peers-programs");
        run_tool(source("tests/peers/build.sh"), &[&out.to_string_lossy()], &out);
        out
    });
    let words = what.split_whitespace().flat_map(|word| if word == "HELLO" { hello() } else { vec![word.to_owned()] });
    let args: Vec<String> = [elf.to_string_lossy().into_owned(), cycles.to_string()].into_iter().chain(words).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let output = run_tool(built.join("simavr_program"), &args, elf.parent().expect("a folder"));
    let said = String::from_utf8_lossy(&output.stdout);
    let line = |line: &str| -> Option<(char, u8, u64)> {
        let mut words = line.split(' ');
        let kind = words.next()?.parse().ok()?;
        Some((kind, words.next()?.parse().ok()?, words.next()?.parse().ok()?))
    };
    assert!(said.lines().last().is_some_and(|last| last.starts_with("end ")), "{said}");
    said.lines().filter_map(line).collect()
}

/// Returns the row of a name: arguments and deviation.
fn simavr(name: &str) -> Option<(&'static str, &'static str)> {
    SIMAVR.lines().find_map(|line| {
        let fields: Vec<&str> = line.split('|').map(str::trim).collect();
        (fields.len() == 3 && fields[0] == name).then(|| (fields[1], fields[2]))
    })
}

#[test]
#[ignore = "needs avr-gcc and simavr: .ci/peers installs them"]
fn they_print_what_is_known_here_and_under_simavr() {
    let (mut here, mut there) = (0, 0);
    for program in programs() {
        let known = text(program.name);
        for level in LEVELS {
            let row = simavr(&format!("{}{level}", program.name)).or_else(|| simavr(program.name));
            let (what, wrong) = row.unwrap_or_else(|| panic!("{}: no row", program.name));
            let elf = build(program.name, level, &[]);
            assert_eq!(sent(&elf, &program.flags), known, "{} {level}", program.name);
            here += 1;
            let said = under_simavr(&elf, if wrong.is_empty() { CYCLES } else { PATIENCE }, what);
            let bytes: Vec<u8> = said.iter().filter(|line| line.0 == 'u').map(|line| line.1).collect();
            let same = String::from_utf8_lossy(&bytes) == known;
            assert_eq!(
                same,
                wrong.is_empty(),
                "{} {level} under simavr:\n{}",
                program.name,
                String::from_utf8_lossy(&bytes)
            );
            there += usize::from(same);
        }
    }
    println!("{here} images print what is known, {there} of them under simavr too");
}

/// Records writes to GPIOR0, with cycles.
#[derive(Default)]
struct Sink(Vec<(u8, u64)>);

impl Probe for Sink {
    const DATA: bool = true;
    fn on_data_access(&mut self, cycle: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        if space == 0 && addr == GPIOR0 && write {
            self.0.push((value, cycle));
        }
        false
    }
}

/// Without interrupts and peripherals, simavr's cycles are those of the instruction manual. Every byte must
/// be written in the same cycle.
#[test]
#[ignore = "needs avr-gcc and simavr: .ci/peers installs them"]
fn programs_that_only_compute_write_each_byte_at_simavrs_cycle() {
    let chip = chips::chip(MCU).expect("the chip");
    for name in ["printf", "muldiv", "sort"] {
        for level in LEVELS {
            let elf = build(name, level, &["-DSINK"]);
            let bytes = fs::read(&elf).expect("the image");
            let loaded =
                load(name, &bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine)).expect("an image");
            let mut avr = Avr::new(chip, &loaded.image, RamInit::Random(1));
            let mut sink = Sink::default();
            assert_eq!(avr.run(CYCLES, &mut sink), StopReason::Halted, "{name} {level}");

            let theirs = under_simavr(&elf, CYCLES, "");
            let theirs: Vec<(u8, u64)> =
                theirs.iter().filter(|line| line.0 == 'g').map(|line| (line.1, line.2)).collect();
            let written: Vec<u8> = sink.0.iter().map(|write| write.0).collect();
            assert_eq!(String::from_utf8_lossy(&written), text(name), "{name} {level}");
            let differing = sink.0.iter().zip(&theirs).find(|(ours, theirs)| ours != theirs);
            assert_eq!((differing, sink.0.len()), (None, theirs.len()), "{name} {level}: first ours, then theirs");
            println!("{name} {level}: {} bytes, the last at cycle {}", theirs.len(), theirs[theirs.len() - 1].1);
        }
    }
}

/// The edges of a lamp, which have the same distances under simavr, and the duties of the PWM, which simavr
/// reports when they change.
#[test]
#[ignore = "needs avr-gcc and simavr: .ci/peers installs them"]
fn pins_do_what_they_do_under_simavr() {
    let of = |said: Vec<(char, u8, u64)>, kind| said.into_iter().filter(move |line| line.0 == kind);
    for level in LEVELS {
        let elf = build("millis", level, &[]);
        let theirs: Vec<u64> = of(under_simavr(&elf, CYCLES, ""), 'p').map(|line| line.2).collect();
        let ours: Vec<u64> = edges(&elf, "PB5").into_iter().map(|edge| edge.0).collect();
        // The first edge occurs when the pin becomes an output.
        let apart = |cycles: &[u64]| cycles[1..].windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<u64>>();
        assert_eq!(ours.len(), 11, "{level}: {ours:?}");
        assert_eq!(apart(&ours), apart(&theirs), "millis {level}");

        let elf = build("tone", level, &[]);
        let theirs: Vec<u64> = of(under_simavr(&elf, CYCLES, ""), 'w').map(|line| u64::from(line.1)).collect();
        let mut ours: Vec<u64> = pulses(&edges(&elf, "PD3")).into_iter().map(|pulse| pulse.1 - 1).collect();
        ours.dedup();
        assert!(ours.len() > 600, "{level}: {}", ours.len());
        assert_eq!(ours[..600], theirs[..600], "tone {level}");
    }
}
