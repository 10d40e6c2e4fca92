//! Ladder programs through each kind of source, compared with the evaluator: the examples, the programs of
//! the tests, random ones.

use std::path::{Path, PathBuf};

use emu_check::CheckOptions;
use emu_check::via::serve::ServedForm;
use emu_check::via::{SourceCheckReport, SourceRoute, check, check_many};
use emu_test_support::random_seed;
use ladder::LadderProgram;

use crate::random::Generator;
use crate::text::texts;

fn parse(file: &str, text: &str) -> LadderProgram {
    match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(faults) => panic!("{}\n{text}", faults.iter().map(|d| format!("{d}\n")).collect::<String>()),
    }
}

/// Returns the programs of a folder of the workspace, by name.
fn folder(name: &str) -> Vec<LadderProgram> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    let entries = std::fs::read_dir(&dir).unwrap_or_else(|e| panic!("{}: {e}", dir.display()));
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "ld"));
    paths.sort();
    let read = |path: &PathBuf| std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    paths.iter().map(|path| parse(&path.display().to_string(), &read(path))).collect()
}

fn written() -> Vec<LadderProgram> {
    let mut programs = folder("examples");
    programs.extend(folder("emu-check/tests/programs"));
    programs
}

fn tables() -> Vec<LadderProgram> {
    texts().iter().map(|(name, program, _)| parse(name, program)).collect()
}

fn random(count: u64) -> Vec<LadderProgram> {
    let first = random_seed() * 10_000;
    (first..first + count).map(|seed| parse(&format!("random {seed}"), &Generator::program(seed))).collect()
}

fn options(scans: u64) -> CheckOptions {
    CheckOptions { seed: random_seed(), scans, ..CheckOptions::default() }
}

fn agreed(program: &LadderProgram, report: &SourceCheckReport) {
    assert!(report.agreed, "{}\n{}", ladder::write(program), report.text());
}

/// Checks all `programs` in one executable. Programs that the language itself refuses are left out: those
/// with an element in the middle of a rung that must end it, which the traces of `tests/ladder` still show,
/// those with registers of ports, which no source has, and those with several PWM outputs, of which byte code
/// has one.
fn many(programs: &[LadderProgram], form: ServedForm, scans: u64) {
    let reports = check_many(programs, form, &options(scans)).unwrap_or_else(|e| panic!("{e}"));
    let mut compared = 0;
    for (program, report) in programs.iter().zip(&reports) {
        match report {
            Ok(report) => {
                agreed(program, report);
                compared += 1;
            }
            Err(faults) => {
                let lacks = ladder::write(program).contains('#') || program.pwm_outputs().len() > 1;
                let is_expected = |code: &str| code == "LD102" || code == "LC007" && lacks;
                assert!(faults.iter().all(|fault| is_expected(fault.code)), "{}: {faults:?}", program.file);
            }
        }
    }
    println!("{compared} of {} programs compared", programs.len());
    assert!(compared * 10 >= programs.len() * 8, "only {compared} of {} programs compared", programs.len());
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn programs_agree_in_c() {
    many(&written(), ServedForm::C, 1000);
    many(&tables(), ServedForm::C, 400);
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn programs_agree_as_byte_code() {
    many(&written(), ServedForm::Bytecode, 1000);
    many(&tables(), ServedForm::Bytecode, 400);
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn random_programs_agree_in_c() {
    many(&random(300), ServedForm::C, 300);
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn random_programs_agree_as_byte_code() {
    many(&random(300), ServedForm::Bytecode, 300);
}

fn each(programs: &[LadderProgram], via: SourceRoute, mcu: &str, scans: u64) {
    for program in programs {
        let options = CheckOptions { mcu: mcu.to_owned(), ..options(scans) };
        match check(program, via, &options) {
            Ok(report) => agreed(program, &report),
            Err(faults) => {
                panic!("{}\n{}", ladder::write(program), faults.iter().map(|d| format!("{d}\n")).collect::<String>())
            }
        }
    }
}

#[test]
#[ignore = "needs avr-gcc: .ci/peers installs it"]
fn programs_agree_in_c_on_an_avr() {
    each(&written(), SourceRoute::C, "atmega328p", 300);
    each(&random(10), SourceRoute::C, "atmega328p", 200);
}

#[test]
#[ignore = "needs avr-gcc: .ci/peers installs it"]
fn programs_agree_as_byte_code_on_an_avr() {
    each(&written(), SourceRoute::Bytecode, "atmega328p", 300);
    each(&random(10), SourceRoute::Bytecode, "atmega328p", 200);
}

#[test]
#[ignore = "needs sdcc: .ci/peers installs it"]
fn programs_agree_in_c_on_an_8051() {
    each(&written(), SourceRoute::C, "8051", 150);
    each(&random(4), SourceRoute::C, "8052", 100);
}

#[test]
#[ignore = "needs avr-g++ and the core of the Arduino: .ci/peers installs them"]
fn programs_agree_as_sketches() {
    each(&written(), SourceRoute::Arduino, "atmega328p", 100);
    each(&random(5), SourceRoute::Arduino, "atmega328p", 100);
}

/// Each peripheral behind a compare that never holds: its calls are gone from the sketch, and gcc has no
/// warning for the functions that are left.
#[test]
#[ignore = "needs avr-g++ and the core of the Arduino: .ci/peers installs them"]
fn peripherals_that_are_never_used_agree_as_sketches() {
    let elements =
        ["PERSIST a", "READ_ADC Aa", "SET_PWM a 1000", "UART_RECV a", "UART_SEND a", "FORMATTED_STRING a 3 92 51 100"];
    let rungs: String = elements.map(|element| format!("RUNG\n    EQU 1 2\n    {element}\nEND\n")).concat();
    let text = format!(
        "LDmicro0.1\nCYCLE=10000\nCRYSTAL=16000000\nBAUD=9600\n\nIO LIST\nEND\n\nPROGRAM\n{rungs}RUNG\n    CONTACTS Xa \
         0\n    COIL Yb 0 0 0\nEND\n"
    );
    each(&[parse("unused.ld", &text)], SourceRoute::Arduino, "atmega328p", 20);
}
