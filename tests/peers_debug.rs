//! avr-gdb with our server compared with our own debugger: the same commands at the same stops of C programs
//! with three files each, compiled with DWARF and with stabs.
//!
//! The values of all variables, parameters and calls must be the same. Intended differences are removed:
//! avr-gdb puts data at 0x800000, and prints values computed from `DW_OP_entry_value` as `name@entry`.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// The stops.
const STOPS: [&str; 6] = ["main", "label", "price", "scale", "price.c:8", "main.c:25"];

/// The commands at each stop.
#[rustfmt::skip]
const ASKED: [&str; 45] = [
    "bt", "info args", "info locals", "print last", "print/x last", "print sum", "print turns", "print rate", "ptype last",
    "whatis &last", "print sizeof(last)", "up", "info args", "info locals", "up", "info locals", "frame 0",
    "print 1 ? 2 : 3", "print (1, 2)", "print 'a'", "print \"abc\"", "print 1U", "print 1e3", "print '\\n'", "print 0x10",
    "print {char}&last", "print ::last", "print sizeof(\"abc\")", "print -last.count", "print ~last.count", "print/f rate",
    "print last.count - 20", "print last.count > -1", "print sum - 20", "print &last", "print/x -1", "print/x &last",
    "print -5 % 3", "whatis last.count + 1", "whatis 1UL", "whatis 'a'", "whatis sum + 1", "whatis 1 == 1", "ptype struct order",
    "info display",
];

/// A process that is killed when the value is dropped.
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

/// The programs, with three files each.
const SHOP: [&str; 3] = ["main.c", "price.c", "text.c"];
const PLANT: [&str; 3] = ["plant.c", "valve.c", "walk.c"];

/// Compiles a program, once for all tests of this file. Returns the path of the ELF file.
fn built(files: [&str; 3], level: &str, format: &str) -> PathBuf {
    static BUILT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let elf = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{}{level}{format}.elf", files[0]));
    let mut built = BUILT.lock().unwrap_or_else(PoisonError::into_inner);
    if !built.insert(elf.clone()) {
        return elf;
    }
    let gcc = Command::new("avr-gcc")
        .args(["-mmcu=atmega328p", level, format, "-std=gnu99", "-o"])
        .arg(&elf)
        .args(files)
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

/// Returns the output of avr-gdb for each command.
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
    let messages = BufReader::new(emu.0.stderr.take().expect("its standard error"));
    let address =
        messages.lines().map_while(Result::ok).find_map(|line| Some(line.strip_prefix("listening on ")?.to_owned()));
    // avr-gdb 13.1 may crash when it ends; do not leave a core file.
    let mut gdb = Command::new("sh");
    gdb.args(["-c", "ulimit -c 0; exec timeout 100 \"$@\"", "sh", "avr-gdb", "-nx", "-batch", "-ex", "set width 0"]);
    gdb.args(["-ex", &format!("target remote {}", address.expect("an address"))]);
    commands.iter().for_each(|command| _ = gdb.args(["-ex", "echo (emu)\\n", "-ex", command]));
    let out = gdb.arg(elf).current_dir(folder()).output().expect("avr-gdb");
    answers(&String::from_utf8_lossy(&out.stdout))
}

/// Returns the output of our debugger for each command.
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

/// Returns the lines after each command.
fn answers(text: &str) -> Vec<Vec<String>> {
    let mut found: Vec<Vec<String>> = Vec::new();
    for line in text.lines() {
        if line.starts_with("(emu)") {
            found.push(Vec::new());
        } else if let Some(last) = found.last_mut().filter(|_| !line.starts_with("[Inferior")) {
            // After the last answer gdb reports that it lets the program go.
            last.push(plain(line));
        }
    }
    found
}

/// Removes the offset of data memory, the numbers of the value history, and leading zeros of addresses from a
/// line.
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
    // `x=x@entry=3` becomes `x=3`.
    let parts: Vec<&str> = text.split("@entry=").collect();
    let last = parts.len() - 1;
    let name = |part: &str| part.rfind('=').map_or(0, |at| at);
    (0..)
        .zip(parts)
        .map(|(n, part)| if n < last { format!("{}=", &part[..name(part)]) } else { part.to_owned() })
        .collect()
}

/// Removes variables that are optimised out from an answer; gdb lists those of an inlined function twice.
fn without_gone(command: &str, lines: &[String]) -> Vec<String> {
    let gone = |line: &&String| command == "info locals" && line.ends_with("= <optimized out>");
    lines.iter().filter(|line| !gone(line)).cloned().collect()
}

fn same(elf: &Path) {
    let commands = commands();
    let (theirs, ours) = (gdb(elf, &commands), own(elf, &commands));
    let mut compared = 0;
    for (n, command) in commands.iter().enumerate() {
        let (Some(theirs), Some(ours)) = (theirs.get(n), ours.get(n)) else { panic!("no answer to {command} ({n})") };
        // Not compared: variables that are not in memory yet, and the output of commands that move between
        // frames, whose wording differs.
        let moves = ["tbreak", "continue", "up", "frame"].iter().any(|word| command.starts_with(word));
        let unknown = theirs.iter().any(|line| line.contains("Cannot access memory"));
        let (theirs, ours) = (without_gone(command, theirs), without_gone(command, ours));
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
    let dwarf = [("-O0", "-gdwarf-4"), ("-O0", "-gdwarf-2"), ("-Og", "-gdwarf-4"), ("-Os", "-gdwarf-4")];
    let stabs = [("-O0", "-g"), ("-O0", "-gstabs"), ("-Og", "-gstabs+"), ("-Os", "-g")];
    for (level, format) in dwarf.into_iter().chain(stabs) {
        same(&built(SHOP, level, format));
    }
}

/// Returns function and line of the call in the output of `frame`: `turn valve.c:20`.
fn stop_place(answer: &[String]) -> String {
    let found = answer.iter().find_map(|line| {
        let (head, place) = line.strip_prefix("#0  ")?.rsplit_once(" at ")?;
        let head = head.split_once(" in ").map_or(head, |(_, head)| head);
        Some(format!("{} {place}", head.split(' ').next()?))
    });
    found.unwrap_or_else(|| format!("no call: {answer:?}"))
}

/// 200 steps into and over calls, including inlined functions, lead both debuggers to the same functions and
/// lines.
#[test]
#[ignore = "needs gdb-avr, gcc-avr and avr-libc"]
fn steps_as_avr_gdb_makes_them() {
    let walks: [(&str, [&str; 3]); 9] = [
        ("-O0", ["step", "step", "step"]),
        ("-O0", ["next", "next", "next"]),
        ("-Og", ["step", "step", "step"]),
        ("-Og", ["next", "next", "next"]),
        ("-Og", ["step", "next", "step"]),
        ("-Os", ["step", "step", "step"]),
        ("-Os", ["next", "next", "next"]),
        ("-Os", ["step", "next", "step"]),
        ("-O0", ["step", "next", "step"]),
    ];
    let programs = [(SHOP, "-gdwarf-4"), (PLANT, "-gdwarf-4"), (SHOP, "-g"), (PLANT, "-gstabs+")];
    for (files, format) in programs {
        for (level, verbs) in walks {
            let elf = built(files, level, format);
            let steps = verbs.into_iter().cycle().take(200).flat_map(|verb| [verb.to_owned(), "frame".to_owned()]);
            let commands: Vec<String> =
                ["tbreak main".to_owned(), "continue".to_owned()].into_iter().chain(steps).collect();
            let (theirs, ours) = (gdb(&elf, &commands), own(&elf, &commands));
            for n in (0..commands.len()).filter(|n| commands[*n] == "frame") {
                let (theirs, ours) = (theirs.get(n).expect("an answer"), ours.get(n).expect("an answer"));
                assert_eq!(stop_place(theirs), stop_place(ours), "{} {verbs:?}, step {}", elf.display(), (n - 1) / 2);
            }
        }
    }
}

/// Commands about functions, function pointers, named types, the value history, and calls of inlined
/// functions.
#[rustfmt::skip]
const QUERIES: [&str; 61] = [
    "print turn", "print *turn", "print &turn", "print step", "print *step", "print valve->step", "print *valve", "print table",
    "print table[1]", "print *table@2", "print chosen", "print *chosen", "print **chosen", "print sink == step", "print step == climb",
    "print valve->step == &climb", "print/a step", "print (int)step", "ptype turn", "ptype &turn", "ptype step", "ptype *step", "ptype chosen",
    "ptype table", "ptype step_fn", "ptype uint8_t", "ptype point_t", "ptype peak", "ptype title", "ptype struct valve", "ptype valves",
    "whatis step", "whatis &turn", "whatis uint8_t", "whatis point_t", "whatis step_fn", "whatis valves", "print valves[1].tag",
    "print $", "print valve", "print *$", "print $.next", "print $$.mode", "print $1", "print *$4", "set $i = 1", "print $i++",
    "print valves[$i].tag", "set var valve->step = sink", "print valve->step", "set var valve->step = climb",
    "print valve->level.all += 2", "print valve->level.all++", "print --valve->level.all", "print &rounds", "print (char *)line",
    "info line climb", "up", "info locals", "print valves[1].tag[0]@3", "print $sp",
];

/// Converts the offsets in a line to decimal, as avr-gdb writes them: `<valves+18>`.
fn decimal(line: &str) -> String {
    let mut parts = line.split("+0x");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| {
        let end = part.find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(part.len());
        format!("{text}+{}{}", u32::from_str_radix(&part[..end], 16).unwrap_or(0), &part[end..])
    })
}

#[test]
#[ignore = "needs gdb-avr, gcc-avr and avr-libc"]
fn values_of_functions_and_types_as_avr_gdb_has_them() {
    for (level, format) in
        [("-O0", "-gdwarf-4"), ("-Og", "-gdwarf-4"), ("-O0", "-g"), ("-Og", "-gstabs"), ("-O0", "-gstabs+")]
    {
        let elf = built(PLANT, level, format);
        let moves = ["tbreak valve.c:19", "continue"].into_iter();
        let commands: Vec<String> = moves.chain(QUERIES).map(str::to_owned).collect();
        let (theirs, ours) = (gdb(&elf, &commands), own(&elf, &commands));
        for (n, command) in commands
            .iter()
            .enumerate()
            .filter(|(_, command)| !["tbreak valve.c:19", "continue", "up", "print $sp"].contains(&command.as_str()))
        {
            let (theirs, ours) = (theirs.get(n).expect("an answer"), ours.get(n).expect("an answer"));
            let (theirs, ours): (Vec<String>, Vec<String>) =
                (theirs.clone(), ours.iter().map(|line| decimal(line)).collect());
            assert_eq!(theirs, ours, "{level} {format}: {command}");
        }
    }
}

/// Repeated `finish` commands: the resulting location, the returned value, and the variables of the caller.
#[test]
#[ignore = "needs gdb-avr, gcc-avr and avr-libc"]
fn finishes_as_avr_gdb_makes_them() {
    let (shop, plant) = (["price", "scale", "price"], ["turn", "depth", "top"]);
    for (files, stops, level, format) in [
        (SHOP, shop, "-O0", "-gdwarf-4"),
        (SHOP, shop, "-Os", "-gdwarf-4"),
        (SHOP, shop, "-O0", "-g"),
        (SHOP, shop, "-Os", "-gstabs+"),
        (PLANT, plant, "-O0", "-gdwarf-4"),
        (PLANT, plant, "-O0", "-g"),
        (PLANT, plant, "-Os", "-g"),
    ] {
        let elf = built(files, level, format);
        let asked = ["continue", "finish", "frame", "print $", "up", "info locals", "finish", "frame", "info args"];
        let stop = |stop: &str| -> Vec<String> {
            let all = std::iter::once(format!("tbreak {stop}")).chain(asked.iter().map(|asked| (*asked).to_owned()));
            all.collect()
        };
        // After its last answer avr-gdb prints a message about its end.
        let last = std::iter::once("print 1".to_owned());
        let commands: Vec<String> = stops.into_iter().cycle().take(12).flat_map(stop).chain(last).collect();
        let (theirs, ours) = (gdb(&elf, &commands), own(&elf, &commands));
        for (n, command) in commands.iter().enumerate() {
            let (theirs, ours) = (theirs.get(n).expect("an answer"), ours.get(n).expect("an answer"));
            match command.as_str() {
                "frame" => assert_eq!(theirs.first(), ours.first(), "{}: {command} ({n})", elf.display()),
                // The first call may return no value.
                "print $" if theirs.is_empty() => {}
                "print $" | "info locals" | "info args" => {
                    let (theirs, ours) = (without_gone(command, theirs), without_gone(command, ours));
                    assert_eq!(theirs, ours, "{}: {command} ({n})", elf.display());
                }
                _ => {}
            }
        }
    }
}
