//! The listing: every word of the image, each element's text above its instructions.

use std::fmt::Write;

use emu_avr::isa;
use ladder::{Node, Program};

use crate::avr::Image;
use crate::avr::emit::Mark;
use crate::map::{Map, Place};

/// The listing of an image: a head with pins and places, then address (bytes), words and instruction per line.
#[must_use]
pub fn listing(program: &Program, image: &Image, map: &Map) -> String {
    let mut out = String::new();
    head(&mut out, program, map);
    let mut marks = image.code.marks.iter().peekable();
    let mut elements = map.elements.iter();
    for insn in &image.code.insns {
        while let Some((mark, _)) = marks.next_if(|(_, at)| *at <= insn.addr) {
            match mark {
                Mark::Part(title) => _ = write!(out, "\n; {title}\n"),
                Mark::Rung(number) => {
                    _ = write!(out, "\n; rung {}\n", number + 1);
                    if let Some(rung) = program.rungs.get(*number as usize) {
                        series(&mut out, &rung.series, 1);
                    }
                }
                Mark::Element(_) => {
                    if let Some(element) = elements.next().filter(|e| e.start != e.end) {
                        _ = writeln!(out, ";{}.{} {}", element.rung, element.element, element.text);
                    }
                }
                Mark::TimerStart => out.push_str("; the timer starts at the end of the next instruction\n"),
                Mark::Poll | Mark::ScanStart | Mark::RungsEnd | Mark::ScanEnd | Mark::ScanOver => {}
            }
        }
        let at = insn.addr as usize;
        let words = image.code.words.get(at..at + insn.len as usize).unwrap_or_default();
        let hex: Vec<String> = words.iter().map(|word| format!("{word:04X}")).collect();
        let text = isa::disassemble(words, insn.addr).text;
        _ = writeln!(out, "{:04X}  {:<9}  {text}", insn.addr * 2, hex.join(" "));
    }
    out
}

fn head(out: &mut String, program: &Program, map: &Map) {
    _ = writeln!(out, "; {} for {} at {} Hz", program.file, map.mcu, map.clock_hz);
    _ = writeln!(
        out,
        "; cycle {}/{} clocks, longest scan {} clocks, {} bytes of code, {} bytes of RAM",
        map.cycle.num, map.cycle.den, map.worst_scan_cycles, map.code_bytes, map.ram_bytes
    );
    for line in &map.fuses {
        _ = writeln!(out, "; fuse {line}");
    }
    for symbol in &map.symbols {
        let pin = map.pins.iter().find(|p| p.name == symbol.name).map_or(String::new(), |p| format!("  {}", p.pin));
        _ = match &symbol.place {
            Place::Bit { addr, bit, .. } => writeln!(out, "; {:<16} bit  0x{addr:04X}.{bit}{pin}", symbol.name),
            Place::Word { addr, .. } => writeln!(out, "; {:<16} word 0x{addr:04X}", symbol.name),
        };
    }
}

/// A rung as in a `.ld` file.
fn series(out: &mut String, nodes: &[Node], depth: usize) {
    let pad = "  ".repeat(depth);
    for node in nodes {
        match node {
            Node::Leaf(element, _) => _ = writeln!(out, ";{pad}{}", ladder::element_text(element)),
            Node::Parallel(branches, _) => {
                _ = writeln!(out, ";{pad}PARALLEL");
                for branch in branches {
                    if branch.len() == 1 {
                        series(out, branch, depth + 1);
                    } else {
                        _ = writeln!(out, ";{pad}  SERIES");
                        series(out, branch, depth + 2);
                        _ = writeln!(out, ";{pad}  END");
                    }
                }
                _ = writeln!(out, ";{pad}END");
            }
        }
    }
}
