//! The small main programs of examples/c and ladder-compile/interpreter compile, and those for a computer
//! give the right output.

use std::path::Path;
use std::process::{Command, Stdio};

use emu_test_support::{run_tool, test_folder};
use ladder_compile::emit::{bytecode, c};

use crate::tools::source;

/// Writes the welder source to a separate folder. The arc starts one second after the trigger, and the motor
/// stays on for one second.
fn welder(name: &str, file: &str, text: impl Fn(&ladder::LadderProgram) -> String) -> std::path::PathBuf {
    let ld = std::fs::read_to_string(source("examples/welder.ld")).unwrap_or_else(|e| panic!("{e}"));
    let program = ladder::parse("welder.ld", &ld).unwrap_or_else(|e| panic!("{e:?}")).program;
    let dir = test_folder!(name);
    std::fs::write(dir.join(file), text(&program)).unwrap_or_else(|e| panic!("{e}"));
    dir
}

fn example(name: &str) -> String {
    source("examples").join(name).display().to_string()
}

fn interpreter(name: &str) -> String {
    source("ladder-compile/interpreter").join(name).display().to_string()
}

const STRICT: [&str; 5] = ["-std=c89", "-pedantic", "-Wall", "-Wextra", "-Werror"];

/// Returns the output of the program at `path` for 101 scans with the trigger and 100 without: only the lines
/// of levels.
fn answers(path: &Path) -> Vec<String> {
    use std::io::Write;
    let mut child = Command::new(path).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("it runs");
    let lines = "1\n".repeat(101) + &"0\n".repeat(100);
    child.stdin.take().expect("a pipe").write_all(lines.as_bytes()).expect("it reads");
    let output = child.wait_with_output().expect("it ends");
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect()
}

/// `scans from scan 1 | Yarc Ymotor`: TON is true from the 100th scan with the trigger, TOF through the 99th
/// without.
const WANTED: &str = "
99 | 01
2  | 11
99 | 01
1  | 00
";

fn wanted() -> Vec<String> {
    let rows = WANTED.lines().filter_map(|line| line.split_once('|'));
    rows.flat_map(|(times, levels)| {
        vec![levels.trim().to_owned(); times.trim().parse().unwrap_or_else(|e| panic!("{times}: {e}"))]
    })
    .collect()
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn c_on_a_computer() {
    let dir = welder("sources/c", "welder.c", |program| c::emit(program).unwrap_or_else(|e| panic!("{e:?}")).text);
    let main = example("c/pc.c");
    let mut args = STRICT.to_vec();
    args.extend(["-DPROGRAM=\"welder.c\"", "-DINPUTS=1", "-DOUTPUTS=2", "-I.", &main, "-o", "welder"]);
    run_tool("gcc", &args, &dir);
    assert_eq!(answers(&dir.join("welder")), wanted());
}

#[test]
#[ignore = "needs gcc: .ci/peers installs it"]
fn byte_code_on_a_computer() {
    let emit = |program: &ladder::LadderProgram| bytecode::emit(program).unwrap_or_else(|e| panic!("{e:?}")).text;
    let dir = welder("sources/bytecode", "welder.inc", emit);
    let (main, plc) = (interpreter("pc.c"), interpreter("plc.c"));
    let mut args = STRICT.to_vec();
    args.extend(["-DPROGRAM=\"welder.inc\"", "-I.", &main, &plc, "-o", "welder"]);
    run_tool("gcc", &args, &dir);
    assert_eq!(answers(&dir.join("welder")), wanted());
}

#[test]
#[ignore = "needs avr-gcc and sdcc: .ci/peers installs them"]
fn c_for_chips_compiles() {
    let dir = welder("sources/chips", "welder.c", |program| c::emit(program).unwrap_or_else(|e| panic!("{e:?}")).text);
    let main = example("c/avr.c");
    let mut args = STRICT.to_vec();
    args.extend(["-mmcu=atmega328p", "-Os", "-DPROGRAM=\"welder.c\"", "-I.", &main, "-o", "welder.elf"]);
    run_tool("avr-gcc", &args, &dir);
    let main = example("c/mcs51.c");
    let args = ["-mmcs51", "--std-c89", "--Werror", "-DPROGRAM=\"welder.c\"", "-I.", &main, "-o", "welder.ihx"];
    run_tool("sdcc", &args, &dir);
}

#[test]
fn the_interpreter_is_short() {
    let text = std::fs::read_to_string(interpreter("plc.c")).unwrap_or_else(|e| panic!("{e}"));
    assert!(text.lines().count() < 350, "the promise of docs/emit.md is under 350 lines");
}
