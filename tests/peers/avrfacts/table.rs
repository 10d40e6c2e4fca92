//! Cycle facts of the ATmega328P: a program measures them here and under simavr. Here all must match the data
//! sheet. The page docs/chips/atmega328p.md shows them; `EMU_BLESS=1` rewrites its table.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;

use emu_test_support::{assert_file, run_tool, test_folder};

use crate::harness;
use crate::tools::source;
use crate::uart::sent_by_wire;

/// Enough cycles for the complete program, which ends with a sleep with interrupts disabled.
const CYCLES: u64 = 80_000_000;
/// Start of the boot section with the fuses of a new chip.
const BOOT: &str = "-Wl,--section-start=.boot=0x7000";
/// The table on the page is between these lines.
const BEGIN: &str = "<!-- facts: written by tests/peers/avrfacts -->\n";
const END: &str = "<!-- end of facts -->\n";
/// Number of columns for peers that do not run in this test.
const OTHERS: usize = 4;
/// The peers among them that ran this program.
const RAN: [&str; 3] = ["simavr 66eca78", "avr8js", "yasimavr"];

struct Fact {
    name: String,
    what: String,
    section: String,
    wanted: String,
    others: Vec<String>,
}

/// Returns headings and facts, in order.
fn facts(text: &str) -> Vec<(String, Vec<Fact>)> {
    let mut parts: Vec<(String, Vec<Fact>)> = Vec::new();
    for line in text.lines() {
        if let Some(heading) = line.strip_prefix("## ") {
            parts.push((heading.to_owned(), Vec::new()));
        } else if !line.starts_with('#') && !line.is_empty() {
            let fields: Vec<&str> = line.split('|').map(str::trim).collect();
            let [name, what, section, wanted, others] = fields[..] else { panic!("five fields: {line}") };
            let others: Vec<String> = match others {
                "=" => vec![wanted.to_owned(); OTHERS],
                "-" => vec!["-".to_owned(); OTHERS],
                list => list.split_whitespace().map(str::to_owned).collect(),
            };
            assert_eq!(others.len(), OTHERS, "{line}");
            let fact =
                Fact { name: name.into(), what: what.into(), section: section.into(), wanted: wanted.into(), others };
            parts.last_mut().expect("a heading").1.push(fact);
        }
    }
    parts
}

/// Returns name and value of every sent line.
fn figures(sent: &[u8]) -> BTreeMap<String, String> {
    let text = String::from_utf8_lossy(sent);
    let mut figures = BTreeMap::new();
    for line in text.lines() {
        let Some((name, figure)) = line.trim().split_once(' ') else { panic!("{line:?} in\n{text}") };
        assert!(figures.insert(name.to_owned(), figure.to_owned()).is_none(), "{name} twice in\n{text}");
    }
    figures
}

/// Returns a table cell, in bold if it differs from the data sheet.
fn cell(value: &str, wanted: &str) -> String {
    if value == wanted || value == "-" { value.to_owned() } else { format!("**{value}**") }
}

#[test]
#[ignore = "needs avr-gcc and simavr: .ci/peers installs them"]
fn every_cycle_fact_is_as_the_data_sheet_says() {
    let dir = test_folder!("avrfacts");
    let sources = ["facts.c", "serial.c", "timers.c", "core.S", "parts.S", "boot.S"];
    let sources = sources.map(|name| source(&format!("tests/peers/avrfacts/{name}")));
    let mut args = vec!["-mmcu=atmega328p", "-DF_CPU=16000000", "-Os", "-Wall", "-Wextra", BOOT, "-o", "facts.elf"];
    args.extend(sources.iter().map(|path| path.to_str().expect("a path")));
    run_tool("avr-gcc", &args, &dir);
    // simavr does not load sections of an ELF file other than .text and .data.
    run_tool("avr-objcopy", &["-O", "binary", "facts.elf", "facts.bin"], &dir);

    let ours = figures(&sent_by_wire(&dir.join("facts.elf"), CYCLES));
    let theirs = figures(&run_tool(harness("simavr_uart"), &["facts.bin", &CYCLES.to_string(), "wire"], &dir).stdout);

    let parts = facts(include_str!("facts.txt"));
    let names: Vec<&String> = parts.iter().flat_map(|part| &part.1).map(|fact| &fact.name).collect();
    assert!(ours.keys().all(|name| names.contains(&name)), "a fact that is not in facts.txt: {ours:?}");

    let mut wrong = Vec::new();
    let (mut table, mut right, mut total, mut others_right) = (String::new(), 0, 0, [0; OTHERS]);
    for (heading, facts) in &parts {
        let _ = write!(
            table,
            "\n### {heading}\n\n| Fact | Section | Data sheet | emu | simavr 1.6 | {} | simulavr ¹ |\n|---|---|---|---|---|---|---|---|---|\n",
            RAN.join(" | ")
        );
        for fact in facts {
            let figure = |all: &BTreeMap<String, String>| all.get(&fact.name).map_or("none", String::as_str).to_owned();
            let (here, there) = (figure(&ours), figure(&theirs));
            if here != fact.wanted {
                wrong.push(format!("{}: {here}, the data sheet ({}) says {}", fact.name, fact.section, fact.wanted));
            }
            total += 1;
            right += usize::from(there == fact.wanted);
            for (right, other) in others_right.iter_mut().zip(&fact.others) {
                *right += usize::from(*other == fact.wanted);
            }
            let wanted = &fact.wanted;
            let others: Vec<String> = fact.others.iter().map(|value| cell(value, wanted)).collect();
            let _ = writeln!(
                table,
                "| {} | {} | {wanted} | {} | {} | {} |",
                fact.what,
                fact.section,
                cell(&here, wanted),
                cell(&there, wanted),
                others.join(" | ")
            );
        }
    }
    assert!(wrong.is_empty(), "{} of {total} facts:\n{}", wrong.len(), wrong.join("\n"));
    let others: String = RAN.iter().zip(others_right).map(|(name, right)| format!(", {name} {right}")).collect();
    let counts = format!("Right of {total}: emu {total}, simavr 1.6 {right}{others}.\n");
    println!("{counts}");

    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/chips/atmega328p.md");
    let page = fs::read_to_string(path).expect("the page");
    let (before, rest) = page.split_once(BEGIN).expect("the beginning of the facts");
    let (_, after) = rest.split_once(END).expect("the end of the facts");
    let wanted = format!("{before}{BEGIN}\n{counts}{table}\n{END}{after}");
    assert_file(path, &wanted);
}
