//! Differences between s51 and our machine, one per line in findings.txt: the result that our machine must
//! give, and the result of s51.
//!
//! The results of s51 are checked too, so that a line is removed when s51 is fixed.

use emu_8051::{Mcs51, chips};
use emu_core::image::{Image, Segment};
use emu_core::{Cpu, RamInit};
use emu_test_support::case_lines;
use emu_test_support::test_folder;

use crate::drive::s51_script;

const LINES: &str = include_str!("findings.txt");
/// Every program reaches its final jump to itself before this number of instructions or cycles.
const LONG: u32 = 200;

struct Finding {
    chip: &'static str,
    what: &'static str,
    code: Vec<Segment>,
    here: &'static str,
    s51: &'static str,
}

fn findings() -> Vec<Finding> {
    let lines = case_lines(LINES);
    lines
        .map(|line| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let &[kind, chip, what, program, section, here, s51] = columns.as_slice() else {
                panic!("seven columns: {line}")
            };
            assert!(matches!(kind, "fault" | "open") && !section.is_empty(), "{line}");
            Finding { chip, what, code: program.split('/').map(|part| segment(part.trim())).collect(), here, s51 }
        })
        .collect()
}

/// Parses a program such as `0030 nop; sjmp $`.
fn segment(text: &str) -> Segment {
    let (addr, lines) = text.split_once(' ').expect("an address and instructions");
    let addr = u32::from_str_radix(addr, 16).expect("an address in hexadecimal");
    let text = format!(".org {addr}\n{}", lines.replace(';', "\n"));
    let chip = chips::chip("8052").expect("a chip");
    emu_asm::assemble_text(chip, &text).unwrap_or_else(|e| panic!("{text}: {e}")).segments.swap_remove(0)
}

/// Returns the values of the registers that `wanted` names, in the same format: `R7=01 PSW=00`.
fn values(wanted: &str, peek: impl Fn(&str, u8) -> u8) -> String {
    let value = |name: &str| match name.strip_prefix('R').and_then(|n| n.parse().ok()) {
        Some(register) => peek("idata", register),
        None => {
            let register = chips::SFRS.iter().find(|r| r.name == name);
            peek("sfr", register.unwrap_or_else(|| panic!("{name}")).addr as u8)
        }
    };
    let names = wanted.split_whitespace().filter_map(|w| w.split_once('='));
    names.map(|(name, _)| format!("{name}={:02X}", value(name))).collect::<Vec<_>>().join(" ")
}

#[test]
fn our_machine_does_what_the_manual_says() {
    let mut wrong = Vec::new();
    for finding in findings() {
        let chip = chips::chip(finding.chip).expect("a chip of the family");
        let mut machine = Mcs51::new(chip, &Image { segments: finding.code, ..Image::default() }, RamInit::Zero);
        machine.run(LONG.into(), &mut ());
        let found = values(finding.here, |space, addr| machine.peek(space, addr.into()).expect("memory"));
        if found != finding.here {
            wrong.push(format!("{}: {found}", finding.what));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "needs s51"]
fn s51_still_differs() {
    let mut wrong = Vec::new();
    for finding in findings() {
        let parts: Vec<(u32, &[u8])> = finding.code.iter().map(|s| (s.addr, s.bytes.as_slice())).collect();
        let dumps = [("iram", 0, 128), ("sfr", 128, 128)];
        let said =
            s51_script(finding.chip, &parts, &format!("pc 0\nstep {LONG}\n"), &dumps, &test_folder!("s51-findings"));
        let found = values(finding.s51, |space, addr| match space {
            "idata" => said.dumps[0][usize::from(addr)],
            _ => said.dumps[1][usize::from(addr) - 128],
        });
        if found != finding.s51 {
            wrong.push(format!("{}: {found}", finding.what));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
