//! Results of the command line in unusual places: other names of standard output, devices, long names.
#![cfg(target_os = "linux")]

use std::fs::{self, File};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

fn folder(name: &str) -> PathBuf {
    let folder = emu_test_support::empty_test_folder!(format!("cli-output-{name}"));
    let input = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/in/hello.hex");
    fs::copy(input, folder.join("hello.hex")).expect("a copy");
    folder
}

/// Runs `emu run hello.hex` with its streams in the files `so` (/dev/full for FULL) and `se`. Returns the
/// exit code and the contents of both.
fn run(folder: &Path, flags: &str) -> (Option<i32>, String, String) {
    let (so, se) = (folder.join("so"), folder.join("se"));
    let out = if flags.contains("FULL") { Path::new("/dev/full") } else { &so };
    fs::write(&so, "").expect("so");
    let mut emu = Command::new(env!("CARGO_BIN_EXE_emu"));
    emu.current_dir(folder)
        .args(["run", "hello.hex", "--mcu", "atmega328p"])
        .args(flags.replace("FULL", "").split_whitespace());
    emu.stdin(Stdio::null()).stdout(File::options().write(true).open(out).expect("standard output"));
    let status = emu.stderr(File::create(&se).expect("se")).status().expect("emu starts");
    let text = |path: &Path| String::from_utf8_lossy(&fs::read(path).expect("a stream")).into_owned();
    (status.code(), text(&so), text(&se))
}

/// Flags | exit code | start of standard output | text in standard error.
#[test]
fn streams_by_their_other_names() {
    let folder = folder("names");
    symlink("/dev/stdout", folder.join("link")).expect("a link");
    let table = "
        --json --uart /dev/stdout             | 2 |        | --json and --uart both write to standard output
        --json --uart /dev/fd/1               | 2 |        | both write to standard output
        --json --uart /proc/self/fd/1         | 2 |        | both write to standard output
        --json --uart link                    | 2 |        | both write to standard output
        --json --uart so                      | 2 |        | both write to standard output
        --uart /dev/stdout --vcd -            | 2 |        | both write to standard output
        --uart /dev/stdout                    | 0 | Hi     | stop       halted
        --uart so                             | 0 | Hi     | stop       halted
        --vcd /dev/stdout                     | 0 | $      | stop       halted
        --json --uart /dev/stderr             | 0 | {      | Hi
        --json --uart se                      | 0 | {      | Hi
        --uart - --vcd /dev/stderr            | 0 | Hi     | stop       halted
        --json --uart /dev/null               | 0 | {      |
        --json --uart /dev/full               | 3 | {      |
        --uart /dev/full                      | 3 |        | CLI002
        FULL --json                           | 3 |        | [CLI002] error: -: cannot be written
        FULL --json --uart /dev/full          | 3 |        | [CLI002] error: -: cannot be written";
    for line in table.lines().filter(|l| !l.is_empty()) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let (code, out, err) = run(&folder, cells[0]);
        assert_eq!(code.map(|c| c.to_string()).as_deref(), Some(cells[1]), "{line}: {out} {err}");
        assert!(out.starts_with(cells[2]) && out.is_empty() == cells[2].is_empty(), "{line}: {out}");
        assert!(err.contains(cells[3]) && err.is_empty() == cells[3].is_empty(), "{line}: {err}");
        if out.starts_with('{') {
            serde_json::from_str::<serde_json::Value>(&out).unwrap_or_else(|e| panic!("{line}: {e}: {out}"));
        }
    }
}

#[test]
fn a_name_as_long_as_they_get() {
    let folder = folder("long");
    let name = "n".repeat(250);
    let (code, _, err) = run(&folder, &format!("--uart {name}"));
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(folder.join(name).is_file());
}

#[test]
fn permissions_of_a_replaced_file_are_kept() {
    let folder = folder("permissions");
    let file = folder.join("out");
    for mode in [0o600, 0o755, 0o440] {
        fs::write(&file, "old").expect("an old file");
        fs::set_permissions(&file, fs::Permissions::from_mode(mode)).expect("its permissions");
        assert_eq!(run(&folder, "--uart out").0, Some(0));
        assert_eq!(fs::metadata(&file).expect("the file").permissions().mode() & 0o7777, mode);
        assert_ne!(fs::read(&file).expect("the file"), b"old");
        fs::remove_file(&file).expect("it goes");
    }
    let left = fs::read_dir(&folder)
        .expect("the folder")
        .filter(|e| e.as_ref().is_ok_and(|e| e.path().extension().is_some_and(|x| x == "tmp")));
    assert_eq!(left.count(), 0);
}

/// If one result cannot be written, the others are still written.
#[test]
fn the_other_results_are_kept() {
    let folder = folder("others");
    let (code, _, err) = run(&folder, "FULL --uart - --vcd wave.vcd --record session.toml --snapshot-out state");
    assert_eq!(code, Some(3), "{err}");
    let (code, _, err) = run(&folder, "--vcd /dev/full --record again.toml --coverage lines --uart sent");
    assert_eq!(code, Some(3), "{err}");
    for file in ["wave.vcd", "session.toml", "state", "again.toml", "lines", "sent"] {
        assert!(folder.join(file).is_file(), "{file}");
    }
}

/// A waveform that cannot be written ends the run, which would never end otherwise.
#[test]
fn a_full_disk_ends_the_run() {
    let folder = folder("full");
    let input = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/in/blink.hex");
    fs::copy(input, folder.join("hello.hex")).expect("a copy");
    let (code, _, err) = run(&folder, "--vcd /dev/full --vcd-add SREG");
    assert_eq!(code, Some(3), "{err}");
    assert!(err.contains("/dev/full: cannot be written"), "{err}");
}

/// A run that is refused before the machine starts leaves its files unchanged.
#[test]
fn a_run_that_has_not_begun_writes_nothing() {
    let folder = folder("unbegun");
    fs::write(folder.join("bad.toml"), "[[step]]\nat = \"1 parsec\"\n").expect("a scenario");
    let (code, _, err) = run(&folder, "--scenario bad.toml --snapshot-out state --eeprom cells");
    assert_eq!(code, Some(3), "{err}");
    assert!(!folder.join("state").exists() && !folder.join("cells").exists(), "{err}");
    fs::write(folder.join("lines.lst"), "mine").expect("a file");
    for flags in ["--coverage lines --vcd lines.lst", "--coverage lines --record lines.lst"] {
        let (code, _, err) = run(&folder, flags);
        assert_eq!(code, Some(2), "{flags}: {err}");
        assert!(err.contains("the listing lines.lst"), "{flags}: {err}");
        assert_eq!(fs::read_to_string(folder.join("lines.lst")).ok().as_deref(), Some("mine"), "{flags}");
    }
}

#[test]
fn help_that_cannot_be_written() {
    for flag in ["--help", "--version"] {
        let full = File::options().write(true).open("/dev/full").expect("a full device");
        let out = Command::new(env!("CARGO_BIN_EXE_emu")).arg(flag).stdout(full).output().expect("emu starts");
        assert_eq!(out.status.code(), Some(3), "{flag}: {}", String::from_utf8_lossy(&out.stderr));
    }
}
