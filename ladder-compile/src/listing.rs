//! The listing: every word of the image, each element's text above its instructions. Where the code is not optimised, each
//! operation's three-address form stands above its template.

use std::fmt::Write;

use emu_core::chip::Chip;
use ladder::{ElementId, Node, Program};

use crate::ir::{Ir, Op};
use crate::map::{Map, Place};
use crate::target::{Built, Mark};

/// The listing of an image: a head with pins and places, then address, words and instruction per line. Addresses are bytes on
/// AVR and 8051, words on the others, as their assemblers have it.
#[must_use]
pub(crate) fn listing(program: &Program, ir: &Ir, chip: &Chip, built: &Built, map: &Map) -> String {
    let mut out = String::new();
    head(&mut out, program, map);
    let mut marks = built.marks.iter().peekable();
    let mut elements = map.elements.iter();
    let plain = has_logic(ir);
    let steps_marked = built.marks.iter().any(|(mark, _)| matches!(mark, Mark::Step { .. }));
    for line in &built.lines {
        while let Some((mark, _)) = marks.next_if(|(_, at)| *at <= line.addr) {
            match mark {
                Mark::Part(title) => _ = write!(out, "\n; {title}\n"),
                Mark::Rung(number) => {
                    _ = write!(out, "\n; rung {}\n", number + 1);
                    if let Some(rung) = program.rungs.get(*number as usize) {
                        series(&mut out, &rung.series, 1);
                    }
                }
                Mark::Element(id) => {
                    let element = elements.next();
                    if let Some(element) = element.filter(|e| e.start != e.end) {
                        _ = writeln!(out, ";{}.{} {}", element.rung, element.element, element.text);
                        if plain && !steps_marked {
                            operations(&mut out, ir, *id);
                        }
                    }
                }
                Mark::Step { rung, step } if plain => {
                    let step = ir.rungs.get(*rung as usize).and_then(|rung| rung.steps.get(*step as usize));
                    step.into_iter().for_each(|step| operation(&mut out, ir, &step.op));
                }
                Mark::TimerStart => out.push_str("; the timer starts at the end of the next instruction\n"),
                Mark::Poll | Mark::ScanStart | Mark::RungsEnd | Mark::ScanEnd | Mark::ScanOver | Mark::Step { .. } => {}
            }
        }
        let digits = if chip.word_bytes == 1 { 2 } else { 4 };
        let hex: Vec<String> = line.words.iter().map(|word| format!("{word:0digits$X}")).collect();
        let text = if line.text.is_empty() { "; data" } else { &line.text };
        _ = writeln!(out, "{:04X}  {:<9}  {text}", chip.code_address(line.addr), hex.join(" "));
    }
    out
}

fn has_logic(ir: &Ir) -> bool {
    let logic = |op: &Op| matches!(op, Op::Logic { .. });
    ir.rungs.iter().flat_map(|rung| &rung.steps).any(|step| logic(&step.op))
}

/// The operations of an element.
fn operations(out: &mut String, ir: &Ir, id: ElementId) {
    let rung = ir.rungs.get(id.rung as usize);
    let steps = rung.into_iter().flat_map(|rung| &rung.steps).filter(|step| step.at == id);
    steps.for_each(|step| operation(out, ir, &step.op));
}

fn operation(out: &mut String, ir: &Ir, op: &Op) {
    ir.text(op).lines().for_each(|line| _ = writeln!(out, ";     {line}"));
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
