//! Small programs, one per line, with their expected results here and on gpsim: the faults for which cases
//! are left out (findings.txt), and the table of facts in docs/chips/pic16f873.md (facts.txt).
//!
//! The results of gpsim are checked too, so that a line is removed when gpsim is fixed.

use emu_core::image::{Image, Segment, write_hex};
use emu_core::{Cpu, StopReason};
use emu_pic16::chips;
use emu_test_support::test_folder;

use crate::drive::{VIEW, View, gpsim, machine, there, view};

const FILES: [&str; 2] = [include_str!("findings.txt"), include_str!("facts.txt")];

struct Line {
    what: &'static str,
    chip: &'static emu_core::Chip,
    code: Vec<Segment>,
    /// Number of instruction cycles after which the program is finished.
    cycles: u64,
    here: &'static str,
    gpsim: &'static str,
}

fn lines() -> Vec<Line> {
    let lines = FILES.iter().flat_map(|text| text.lines()).filter(|l| !l.starts_with('#') && !l.trim().is_empty());
    lines
        .map(|line| {
            let columns: Vec<&str> = line.split('|').map(str::trim).collect();
            let &[kind, chip, what, cycles, program, section, here, gpsim] = columns.as_slice() else {
                panic!("eight columns: {line}")
            };
            assert!(matches!(kind, "fault" | "open" | "same") && !section.is_empty(), "{line}");
            assert_eq!(kind == "same", here == gpsim, "{line}");
            let part = chips::part(chip).unwrap_or_else(|| panic!("{line}"));
            Line {
                what,
                chip: &part.chip,
                code: program.split(" / ").map(|text| segment(part, text.trim())).collect(),
                cycles: cycles.parse().unwrap_or_else(|e| panic!("{line}: {e}")),
                here,
                gpsim,
            }
        })
        .collect()
}

/// Parses `0030 nop; movwf FSR`; `nop*5` is five NOPs. Numbers are decimal.
fn segment(part: &'static chips::Pic16Part, text: &str) -> Segment {
    let (addr, lines) = text.split_once(' ').expect("an address and instructions");
    let addr = u32::from_str_radix(addr, 16).expect("an address in hexadecimal");
    let mut text = format!(" radix dec\n org {addr}\n");
    for line in lines.split(';') {
        match line.split_once('*') {
            Some((line, times)) => text.push_str(&format!(" rept {times}\n {line}\n endr\n")),
            None => text.push_str(&format!(" {line}\n")),
        }
    }
    emu_asm::assemble_text(&part.chip, &text).unwrap_or_else(|e| panic!("{text}: {e}")).segments.swap_remove(0)
}

/// Returns the values of a view that `wanted` names, in the same format: `W=07 PC=0012 20=01`, with
/// hexadecimal addresses of data memory.
fn values(wanted: &str, view: &View) -> String {
    let value = |name: &str| match name {
        "W" => format!("W={:02X}", view.w),
        "PC" => format!("PC={:04X}", view.pc),
        _ => {
            let addr = usize::from_str_radix(name, 16).unwrap_or_else(|e| panic!("{name}: {e}"));
            view.data[addr].map_or(format!("{name}=--"), |byte| format!("{name}={byte:02X}"))
        }
    };
    let names = wanted.split_whitespace().filter_map(|w| w.split_once('='));
    names.map(|(name, _)| value(name)).collect::<Vec<_>>().join(" ")
}

/// Watchdog off, HS, no brown-out reset, no LVP, no protection.
const CONFIG: [u8; 2] = 0x3F3A_u16.to_le_bytes();

#[test]
fn our_machine_does_what_the_sheets_say() {
    let mut wrong = Vec::new();
    for line in lines() {
        let mut segments = line.code;
        segments.push(Segment { space: "config", addr: 14, bytes: CONFIG.to_vec() });
        let mut machine = machine(line.chip, &Image { segments, ..Image::default() });
        let stop = machine.run(line.cycles, &mut ());
        let found = values(line.here, &view(&machine, &there(line.chip)));
        if found != line.here || !matches!(stop, StopReason::Limit | StopReason::Halted) {
            wrong.push(format!("{}: {found}, not {} ({stop:?})", line.what, line.here));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "needs gpsim"]
fn gpsim_does_what_is_written_of_it() {
    let mut wrong = Vec::new();
    let folder = test_folder!("gpsim-findings");
    for line in lines() {
        let mut parts: Vec<_> =
            line.code.iter().map(|s| emu_core::image::HexSegment { addr: s.addr, bytes: &s.bytes }).collect();
        parts.push(emu_core::image::HexSegment { addr: 0x400E, bytes: &CONFIG });
        let path = folder.join("program.hex");
        std::fs::write(&path, write_hex(&parts)).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let views = gpsim(line.chip, "program.hex", &format!("break c {}\nrun\n{VIEW}", line.cycles), &folder);
        let found = values(line.gpsim, &views[0]);
        if found != line.gpsim {
            wrong.push(format!("{}: {found}, not {}", line.what, line.gpsim));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
