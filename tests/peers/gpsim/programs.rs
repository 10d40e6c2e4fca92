//! Programs for every peripheral, run on gpsim and here. The named cells are compared, and
//! `programs/differences.txt` lists every difference with the section of the data sheet that decides it.
//!
//! The text of a program gives its number of cycles (`#define CYCLES`), the connected pins (`;; wire FROM
//! TO`), the pins with pull-ups (`;; pullup PIN`), and, in its `cblock`, the names of its cells.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::{Chip, Cpu};
use emu_pic16::{Pic16, chips};
use emu_test_support::case_lines;
use emu_test_support::test_folder;

use crate::drive::{VIEW, gpsim, image, machine};

const DIFFERENCES: &str = include_str!("programs/differences.txt");

struct Program {
    name: String,
    cycles: u64,
    wires: Vec<(String, String)>,
    pullups: Vec<String>,
    /// Address and name of every cell.
    cells: Vec<(u16, String)>,
}

fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/gpsim/programs")
}

fn number(text: &str) -> u64 {
    let decimal = text.strip_prefix('.').map(str::parse);
    let hex = text.strip_suffix('h').map(|t| u64::from_str_radix(t, 16));
    decimal.or(hex).unwrap_or_else(|| panic!("{text}")).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn program(path: &Path) -> Program {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
    let mut program = Program { name, cycles: 0, wires: vec![], pullups: vec![], cells: vec![] };
    let mut next = None;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["#define", "CYCLES", cycles] => program.cycles = number(cycles),
            [";;", "wire", from, to] => program.wires.push((from.to_owned(), to.to_owned())),
            [";;", "pullup", pin] => program.pullups.push(pin.to_owned()),
            ["cblock", first] => next = Some(number(first) as u16),
            ["endc"] => next = None,
            _ => {
                if let Some(addr) = &mut next {
                    for name in line.split(',').map(str::trim).filter(|n| !n.is_empty()) {
                        program.cells.push((*addr, name.to_owned()));
                        *addr += 1;
                    }
                }
            }
        }
    }
    assert!(program.cycles > 0 && program.cells.len() > 3, "{}", path.display());
    program
}

fn programs() -> Vec<Program> {
    let entries = std::fs::read_dir(sources()).expect("the folder of programs");
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    paths.retain(|p| p.extension().is_some_and(|e| e == "asm"));
    paths.sort();
    paths.iter().map(|p| program(p)).collect()
}

/// Assembles `NAME.asm` of `sources` to `NAME.hex` in `folder`, and returns the source text.
fn assemble(sources: &Path, name: &str, folder: &Path) -> String {
    let hex = folder.join(format!("{name}.hex"));
    let output = Command::new("gpasm")
        .args(["-q", "-w2", "-o"])
        .arg(&hex)
        .arg(format!("{name}.asm"))
        .current_dir(sources)
        .output()
        .unwrap_or_else(|e| panic!("gpasm: {e}"));
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stdout));
    std::fs::read_to_string(&hex).unwrap_or_else(|e| panic!("{}: {e}", hex.display()))
}

/// Returns the cells after a run of gpsim.
fn theirs(chip: &Chip, program: &Program, folder: &Path) -> Vec<u8> {
    let node = |pin: &str| format!("port{}", pin[1..].to_lowercase());
    let mut script = String::new();
    for (i, (from, to)) in program.wires.iter().enumerate() {
        script += &format!("node wire{i}\nattach wire{i} {} {}\n", node(from), node(to));
    }
    if !program.pullups.is_empty() {
        script += "module library libgpsim_modules.so.0\n";
    }
    for (i, pin) in program.pullups.iter().enumerate() {
        script += &format!("module load pullup up{i}\nnode pull{i}\nattach pull{i} {} up{i}.pin\n", node(pin));
    }
    script += &format!("break c {}\nrun\n{VIEW}", program.cycles);
    let views = gpsim(chip, &format!("{}.hex", program.name), &script, folder);
    program.cells.iter().map(|(addr, _)| views[0].data[usize::from(*addr)].expect("RAM")).collect()
}

/// Returns the cells after a run of our machine. Wires are updated after every instruction.
fn ours(chip: &'static Chip, program: &Program, hex: &str) -> Vec<u8> {
    let mut machine = machine(chip, &image(chip, &program.name, hex));
    let pin = |name: &String| chip.pin(name).unwrap_or_else(|| panic!("{name}"));
    let drive =
        |machine: &mut Pic16, to: PinId, level: PinLevel| machine.drive(CycleTime::at(machine.cycle()), to, level);
    let wires: Vec<(PinId, PinId)> = program.wires.iter().map(|(from, to)| (pin(from), pin(to))).collect();
    let mut levels: Vec<PinLevel> = vec![PinLevel::Float; wires.len()];
    for name in &program.pullups {
        drive(&mut machine, pin(name), PinLevel::High);
    }
    while machine.cycle() < program.cycles {
        if wires.is_empty() {
            machine.run(program.cycles, &mut ());
            break;
        }
        machine.step(&mut ());
        for ((from, to), last) in wires.iter().zip(&mut levels) {
            let level = machine.pin_level(*from);
            if level != *last {
                *last = level;
                drive(&mut machine, *to, level);
            }
        }
    }
    program.cells.iter().map(|(addr, _)| machine.peek("data", (*addr).into()).expect("RAM")).collect()
}

#[test]
#[ignore = "needs gpasm and gpsim"]
fn programs_beside_gpsim() {
    let chip = chips::chip("pic16f877a").expect("a chip of the family");
    let folder = test_folder!("gpsim-programs");
    let mut found = BTreeMap::new();
    let mut cells = 0;
    for program in programs() {
        let hex = assemble(&sources(), &program.name, &folder);
        let (theirs, ours) = (theirs(chip, &program, &folder), ours(chip, &program, &hex));
        for (((_, cell), ours), theirs) in program.cells.iter().zip(ours).zip(theirs) {
            cells += 1;
            if ours != theirs {
                found.insert(format!("{} {cell}", program.name), format!("{ours:02X} {theirs:02X}"));
            } else if std::env::var_os("EMU_SHOW").is_some() {
                println!("{} {cell}: {ours:02X}", program.name);
            }
        }
    }
    println!("{cells} cells compared, {} differ", found.len());
    let lines = case_lines(DIFFERENCES);
    let listed: BTreeMap<String, String> = lines
        .map(|line| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let &[cell, values, section, reason] = columns.as_slice() else { panic!("four columns: {line}") };
            assert!(section.starts_with("DS") && !reason.is_empty(), "{line}");
            (cell.to_owned(), values.to_owned())
        })
        .collect();
    assert_eq!(found, listed, "cell: here, gpsim; found and listed in differences.txt");
}

#[test]
#[ignore = "needs gpasm"]
fn hex_files_of_the_benches_are_their_sources() {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/programs_pic");
    let folder = test_folder!("gpsim-benches");
    for name in ["alu", "crc", "tmr0int", "ladder", "wdtsleep", "t1sleep"] {
        let hex = sources.join(format!("{name}.hex"));
        let kept = std::fs::read_to_string(&hex).unwrap_or_else(|e| panic!("{}: {e}", hex.display()));
        assert!(kept == assemble(&sources, name, &folder), "{name}.hex is not what gpasm makes of {name}.asm");
    }
}
