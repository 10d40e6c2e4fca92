//! `emu run` and signals: the first signal ends a run cleanly, with complete output files. The same holds for
//! the debugger and for a run with a peer.
#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn folder(name: &str) -> PathBuf {
    emu_test_support::empty_test_folder!(format!("signals-{name}"))
}

/// Starts a run that does not end during the test: 60 s of a program that never halts take longer than the
/// time until the kill.
fn endless(folder: &Path, flags: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
    command.args(["run"]).arg(root().join("tests/cli/in/spin.hex")).args(["--mcu", "atmega328p", "--for", "1000000s"]);
    command.args(flags).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("emu starts")
}

fn kill(child: &Child, signal: &str) {
    let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status();
    assert!(sent.expect("kill runs").success());
}

/// Waits until two temporary output files exist. One may exist before the run handles signals.
fn begun(folder: &Path) {
    let there = || fs::read_dir(folder).expect("the folder").count() > 1;
    while !there() {
        std::thread::sleep(Duration::from_millis(5));
    }
    // The run starts after it created its files.
    std::thread::sleep(Duration::from_millis(200));
}

#[test]
fn a_signal_ends_a_run_with_all_its_files() {
    // A process that ignores hang-ups passes that on, as nohup does, and the run then continues.
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).map(str::trim);
    let hears = ignored.and_then(|mask| u64::from_str_radix(mask, 16).ok()).is_some_and(|mask| mask & 1 == 0);
    for signal in ["TERM", "INT"].into_iter().chain(Some("HUP").filter(|_| hears)) {
        let folder = folder(signal);
        let flags = "--vcd run.vcd --uart run.bin --eeprom run.eep --trace run.txt --trace-last 3";
        let child = endless(&folder, &flags.split(' ').collect::<Vec<_>>());
        begun(&folder);
        kill(&child, signal);
        let out = child.wait_with_output().expect("emu ends");
        assert_eq!(out.status.code(), Some(5), "{signal}: {}", String::from_utf8_lossy(&out.stderr));
        let reported = String::from_utf8_lossy(&out.stdout);
        assert!(reported.starts_with("stop       interrupted\n"), "{signal}: {reported}");
        let mut names: Vec<_> =
            fs::read_dir(&folder).expect("the folder").map(|e| e.expect("an entry").file_name()).collect();
        names.sort();
        assert_eq!(names, ["run.bin", "run.eep", "run.txt", "run.vcd"], "{signal}");
        // The waveform extends to the cycle of the end.
        let vcd = fs::read_to_string(folder.join("run.vcd")).expect("a text");
        assert!(vcd.contains("$enddefinitions $end\n") && vcd.ends_with('\n'), "{signal}: {vcd}");
        let last = vcd.lines().rev().find_map(|line| line.strip_prefix('#')?.parse::<u64>().ok());
        assert!(last.is_some_and(|tick| tick > 0), "{signal}: {vcd}");
        let trace = fs::read_to_string(folder.join("run.txt")).expect("a text");
        assert!(trace.lines().last().is_some_and(|line| line.contains("interrupted")), "{signal}: {trace}");
    }
}

/// A signal leaves a snapshot of its moment, from which a run can continue.
#[test]
fn a_signal_leaves_a_snapshot() {
    let folder = folder("snapshot");
    let child = endless(&folder, &["--snapshot-out", "run.snp", "--vcd", "run.vcd", "--json"]);
    begun(&folder);
    kill(&child, "TERM");
    let out = child.wait_with_output().expect("emu ends");
    assert_eq!(out.status.code(), Some(5), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(String::from_utf8_lossy(&out.stdout).contains("\"reason\": \"interrupted\""));
    let again =
        endless(&folder, &["--snapshot-in", "run.snp", "--until", "pc=2"]).wait_with_output().expect("emu ends");
    assert_eq!(again.status.code(), Some(0), "{}", String::from_utf8_lossy(&again.stderr));
}

/// A signal during a debugger script stops the script, whatever the source of its lines.
#[test]
fn a_signal_stops_a_script_of_the_debugger() {
    let folder = folder("script");
    fs::write(folder.join("inner"), "echo begun\ncontinue\necho later\n").expect("a script");
    fs::write(folder.join("outer"), "source inner\necho later\n").expect("a script");
    let scripts: [&[&str]; 4] = [
        &["--batch", "-x", "inner"],
        &["--batch", "-x", "outer"],
        &["--batch", "--ex", "echo begun", "--ex", "continue", "--ex", "echo later"],
        &["-x", "inner"],
    ];
    for (script, signal) in scripts.iter().flat_map(|script| [(script, "INT"), (script, "TERM")]) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
        command.args(["debug"]).arg(root().join("tests/cli/in/spin.hex")).args(["--mcu", "atmega328p"]).args(*script);
        let mut child = command
            .current_dir(&folder)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("emu starts");
        // The output of a nested script appears at its end.
        let mut first = [0; 5];
        if script.contains(&"outer") {
            std::thread::sleep(Duration::from_secs(1));
        } else {
            std::io::Read::read_exact(child.stdout.as_mut().expect("a pipe"), &mut first).expect("it begins");
        }
        std::thread::sleep(Duration::from_millis(100));
        kill(&child, signal);
        let out = child.wait_with_output().expect("emu ends");
        let (printed, reported) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
        assert_eq!(out.status.code(), Some(5), "{script:?} {signal}: {printed}{reported}");
        assert!(
            format!("{printed}{reported}").contains("interrupted: the remaining commands"),
            "{script:?}: {printed}{reported}"
        );
        assert!(!printed.contains("later\n"), "{script:?} {signal}: {printed}");
    }
}

/// Lines from a pipe that are not text are executed like others, and read errors are reported.
#[test]
fn lines_that_are_no_text() {
    let folder = folder("bytes");
    fs::write(folder.join("lines"), b"print 1\necho \xFF\r\nprint 2").expect("a script");
    for (file, code, wanted) in [("lines", 0, "$1 = 1\n\u{FFFD}\n$2 = 2\n"), (".", 3, "")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
        command.args(["debug", "--batch", "--mcu", "atmega328p"]).arg(root().join("tests/cli/in/spin.hex"));
        let input = fs::File::open(folder.join(file)).expect("a file");
        let out = command.stdin(input).output().expect("emu runs");
        let reported = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{file}: {reported}");
        assert_eq!(String::from_utf8_lossy(&out.stdout), wanted, "{reported}");
    }
}

/// Creates a peer that prints nothing and has a child process; the file `child` contains its process ID.
fn silent_peer(folder: &Path) -> PathBuf {
    use std::os::unix::fs::PermissionsExt;
    let file = folder.join("peer");
    let script = "#!/bin/sh\nhere=$(dirname \"$0\")\nsleep 1000 &\necho $! > \"$here/begun\"\nmv \"$here/begun\" \"$here/child\"\nwait\n";
    fs::write(&file, script).expect("a script");
    fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).expect("a program");
    fs::create_dir(folder.join("tmp")).expect("a folder");
    file
}

fn beside(folder: &Path, peer: &Path, flags: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
    command.args(["lockstep"]).arg(root().join("tests/cli/in/hello51.hex")).args(["--mcu", "at89s52"]);
    command.args(["--against", "s51"]).arg("--peer").arg(peer).args(flags).env("TMPDIR", folder.join("tmp"));
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("emu starts")
}

/// Waits until the peer's child process has ended; it may be a zombie until its parent reads its status.
fn ends(folder: &Path) {
    let number = fs::read_to_string(folder.join("child")).expect("the peer has begun");
    let stat = PathBuf::from(format!("/proc/{}/stat", number.trim()));
    while fs::read_to_string(&stat).is_ok_and(|stat| !stat.contains(") Z ")) {
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A signal ends the peer with all its child processes, and leaves no folder.
#[test]
fn a_signal_ends_a_run_beside_a_peer() {
    for (signal, flag) in [("TERM", "--cycles-free"), ("INT", "--json")] {
        let folder = folder(&format!("peer-{signal}"));
        let child = beside(&folder, &silent_peer(&folder), &["--timeout", "80000", flag]);
        while !folder.join("child").exists() {
            std::thread::sleep(Duration::from_millis(5));
        }
        kill(&child, signal);
        let out = child.wait_with_output().expect("emu ends");
        assert_eq!(out.status.code(), Some(5), "{signal}: {}", String::from_utf8_lossy(&out.stderr));
        let reported = String::from_utf8_lossy(&out.stdout);
        let wanted = ["; interrupted\n", "\"interrupted\": true"];
        assert!(wanted.iter().any(|wanted| reported.contains(wanted)), "{signal}: {reported}");
        assert_eq!(fs::read_dir(folder.join("tmp")).expect("the folder").count(), 0, "{signal}");
        ends(&folder);
    }
}

/// A timeout ends the peer with all its child processes.
#[test]
fn a_peer_that_is_late_ends_with_what_it_has_started() {
    let folder = folder("peer-late");
    let out = beside(&folder, &silent_peer(&folder), &["--timeout", "3"]).wait_with_output().expect("emu ends");
    let reported = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(3) && reported.contains("LCK003"), "{reported}");
    assert_eq!(fs::read_dir(folder.join("tmp")).expect("the folder").count(), 0);
    ends(&folder);
}
