//! avr-gdb over our own server and our own debugger, at the same stops of a C program of three files, with the same commands.
//!
//! The values of all variables, parameters and calls are to be the same. What differs on purpose is taken out: avr-gdb puts data at
//! 0x800000, and reads what is computed from `DW_OP_entry_value` as `name@entry`.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Where it stops, by level of optimisation.
const STOPS: [&str; 6] = ["main", "label", "price", "scale", "price.c:8", "main.c:25"];

/// What is asked at each stop.
#[rustfmt::skip]
const ASKED: [&str; 17] = [
    "bt", "info args", "info locals", "print last", "print/x last", "print sum", "print turns", "print rate", "ptype last",
    "whatis &last", "print sizeof(last)", "up", "info args", "info locals", "up", "info locals", "frame 0",
];

/// A program that ends with this test.
struct Ending(Child);

impl Drop for Ending {
    fn drop(&mut self) {
        _ = self.0.kill();
        _ = self.0.wait();
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/in")
}

/// Compiles the program; gives its file.
fn built(level: &str, dwarf: &str) -> PathBuf {
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("shop{level}{dwarf}.elf"));
    let gcc = Command::new("avr-gcc")
        .args(["-mmcu=atmega328p", level, dwarf, "-std=gnu99", "-o"])
        .arg(&elf)
        .args(["main.c", "price.c", "text.c"])
        .current_dir(folder())
        .status();
    assert!(gcc.expect("avr-gcc").success());
    elf
}

fn commands() -> Vec<String> {
    let stop = |stop: &str| {
        let go = [format!("tbreak {stop}"), "continue".to_owned()];
        go.into_iter().chain(ASKED.iter().map(|asked| (*asked).to_owned()))
    };
    STOPS.into_iter().flat_map(stop).collect()
}

/// What avr-gdb says to each command.
fn gdb(elf: &Path, commands: &[String]) -> Vec<Vec<String>> {
    let emu = Command::new(env!("CARGO_BIN_EXE_emu"))
        .arg("debug")
        .arg(elf)
        .args(["--mcu", "atmega328p", "--ram", "zero", "--gdb", "127.0.0.1:0"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn();
    let mut emu = Ending(emu.expect("emu runs"));
    let told = BufReader::new(emu.0.stderr.take().expect("its standard error"));
    let address =
        told.lines().map_while(Result::ok).find_map(|line| Some(line.strip_prefix("listening on ")?.to_owned()));
    let mut gdb = Command::new("timeout");
    gdb.args(["100", "avr-gdb", "-nx", "-batch", "-ex", "set width 0"]);
    gdb.args(["-ex", &format!("target remote {}", address.expect("an address"))]);
    commands.iter().for_each(|command| _ = gdb.args(["-ex", "echo (emu)\\n", "-ex", command]));
    let out = gdb.arg(elf).current_dir(folder()).output().expect("avr-gdb");
    answers(&String::from_utf8_lossy(&out.stdout))
}

/// What our debugger says to each.
fn own(elf: &Path, commands: &[String]) -> Vec<Vec<String>> {
    let emu = Command::new(env!("CARGO_BIN_EXE_emu"))
        .arg("debug")
        .arg(elf)
        .args(["--mcu", "atmega328p", "--ram", "zero"])
        .current_dir(folder())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let mut emu = emu.expect("emu runs");
    let text = commands.iter().map(|command| format!("{command}\n")).collect::<String>();
    emu.stdin.take().expect("standard input").write_all(text.as_bytes()).expect("it reads");
    answers(&String::from_utf8_lossy(&emu.wait_with_output().expect("emu ends").stdout))
}

/// The lines behind each command.
fn answers(text: &str) -> Vec<Vec<String>> {
    let mut found: Vec<Vec<String>> = Vec::new();
    for line in text.lines() {
        if line.starts_with("(emu)") {
            found.push(Vec::new());
        } else if let Some(last) = found.last_mut() {
            last.push(plain(line));
        }
    }
    found
}

/// A line without the offset of data memory, numbers of the history, and zeros at the front of addresses.
fn plain(line: &str) -> String {
    let line = line.split_once(" = ").filter(|(head, _)| head.starts_with('$')).map_or(line, |(_, value)| value);
    let mut parts = line.split("0x");
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let end = part.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(part.len());
        let number = u64::from_str_radix(&part[..end], 16).unwrap_or(0);
        let number = if (0x80_0000..0x81_0000).contains(&number) { number - 0x80_0000 } else { number };
        text.push_str(&format!("0x{number:x}{}", &part[end..]));
    }
    let text = text.replace(" <__vectors>", "");
    // `x=x@entry=3` is `x=3`.
    let parts: Vec<&str> = text.split("@entry=").collect();
    let last = parts.len() - 1;
    let name = |part: &str| part.rfind('=').map_or(0, |at| at);
    (0..)
        .zip(parts)
        .map(|(n, part)| if n < last { format!("{}=", &part[..name(part)]) } else { part.to_owned() })
        .collect()
}

fn same(elf: &Path) {
    let commands = commands();
    let (theirs, ours) = (gdb(elf, &commands), own(elf, &commands));
    let mut compared = 0;
    for (n, command) in commands.iter().enumerate() {
        let (Some(theirs), Some(ours)) = (theirs.get(n), ours.get(n)) else { panic!("no answer to {command} ({n})") };
        // A variable that is in no memory yet, and what the moves between frames print, have words of their own.
        let moves = ["tbreak", "continue", "up", "frame"].iter().any(|word| command.starts_with(word));
        let unknown = theirs.iter().any(|line| line.contains("Cannot access memory"));
        let ours: Vec<String> = ours
            .iter()
            .map(|line| match command.strip_prefix("print").and_then(|rest| rest.split_once(' ')) {
                Some((_, expr)) => line.strip_prefix(&format!("{expr} = ")).unwrap_or(line).to_owned(),
                None => line.clone(),
            })
            .collect();
        // Of a function put in place of its call gdb lists what is gone twice.
        let there = |lines: &[String]| -> Vec<String> {
            let gone = |line: &&String| command == "info locals" && line.ends_with("= <optimized out>");
            lines.iter().filter(|line| !gone(line)).cloned().collect()
        };
        let (theirs, ours) = (there(theirs), there(&ours));
        if !moves && !unknown {
            assert_eq!(theirs, ours, "{}: {command} ({n})", elf.display());
            compared += 1;
        }
    }
    assert!(compared > 70, "{compared} answers were compared");
}

#[test]
#[ignore = "needs gdb-avr, gcc-avr and avr-libc"]
fn variables_as_avr_gdb_has_them() {
    for (level, dwarf) in [("-O0", "-gdwarf-4"), ("-O0", "-gdwarf-2"), ("-Og", "-gdwarf-4"), ("-Os", "-gdwarf-4")] {
        same(&built(level, dwarf));
    }
}
