//! Writes the listing: every word of the image, with each element's text above its instructions.
//!
//! Unoptimised code also has each operation's three-address form above its instructions.

use std::fmt::Write;

use emu_core::chip::Chip;
use ladder::{ElementId, LadderProgram, RungNode};

use crate::ir::{Ir, IrOp};
use crate::map::{CellLocation, ImageMap};
use crate::target::{BuiltImage, CodeMark};

/// Returns the listing of an image: a head with pins and places, then address, words and instruction per
/// line.
///
/// Addresses count bytes on AVR and 8051 and words on the other families, as in their assemblers.
#[must_use]
pub(crate) fn listing(program: &LadderProgram, ir: &Ir, chip: &Chip, built: &BuiltImage, map: &ImageMap) -> String {
    let mut out = String::new();
    push_head(&mut out, program, map);
    let mut marks = built.marks.iter().peekable();
    let mut elements = map.elements.iter();
    let plain = has_logic(ir);
    let steps_marked = built.marks.iter().any(|(mark, _)| matches!(mark, CodeMark::Step { .. }));
    for line in &built.lines {
        while let Some((mark, _)) = marks.next_if(|(_, at)| *at <= line.addr) {
            match mark {
                CodeMark::Section(title) => _ = write!(out, "\n; {title}\n"),
                CodeMark::Rung(number) => {
                    _ = write!(out, "\n; rung {}\n", number + 1);
                    if let Some(rung) = program.rungs.get(*number as usize) {
                        push_series(&mut out, &rung.series, 1);
                    }
                }
                CodeMark::Element(id) => {
                    let element = elements.next();
                    if let Some(element) = element.filter(|e| e.start != e.end) {
                        _ = writeln!(out, ";{}.{} {}", element.rung, element.element, element.text);
                        if plain && !steps_marked {
                            push_operations(&mut out, ir, *id);
                        }
                    }
                }
                CodeMark::Step { rung, step } if plain => {
                    let step = ir.rungs.get(*rung as usize).and_then(|rung| rung.steps.get(*step as usize));
                    step.into_iter().for_each(|step| push_operation(&mut out, ir, &step.op));
                }
                CodeMark::TimerStart => out.push_str("; the timer starts at the end of the next instruction\n"),
                CodeMark::PollLoop
                | CodeMark::ScanStart
                | CodeMark::RungsEnd
                | CodeMark::ScanEnd
                | CodeMark::AfterScan
                | CodeMark::Step { .. } => {}
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
    let logic = |op: &IrOp| matches!(op, IrOp::Logic { .. });
    ir.rungs.iter().flat_map(|rung| &rung.steps).any(|step| logic(&step.op))
}

/// Writes the operations of an element.
fn push_operations(out: &mut String, ir: &Ir, id: ElementId) {
    let rung = ir.rungs.get(id.rung as usize);
    let steps = rung.into_iter().flat_map(|rung| &rung.steps).filter(|step| step.element == id);
    steps.for_each(|step| push_operation(out, ir, &step.op));
}

fn push_operation(out: &mut String, ir: &Ir, op: &IrOp) {
    ir.op_text(op).lines().for_each(|line| _ = writeln!(out, ";     {line}"));
}

fn push_head(out: &mut String, program: &LadderProgram, map: &ImageMap) {
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
            CellLocation::Bit { addr, bit, .. } => writeln!(out, "; {:<16} bit  0x{addr:04X}.{bit}{pin}", symbol.name),
            CellLocation::Word { addr, .. } => writeln!(out, "; {:<16} word 0x{addr:04X}", symbol.name),
        };
    }
}

/// Writes a rung in the form of a `.ld` file.
fn push_series(out: &mut String, nodes: &[RungNode], depth: usize) {
    let pad = "  ".repeat(depth);
    for node in nodes {
        match node {
            RungNode::Leaf(element, _) => _ = writeln!(out, ";{pad}{}", ladder::element_text(element)),
            RungNode::Parallel(branches, _) => {
                _ = writeln!(out, ";{pad}PARALLEL");
                for branch in branches {
                    if branch.len() == 1 {
                        push_series(out, branch, depth + 1);
                    } else {
                        _ = writeln!(out, ";{pad}  SERIES");
                        push_series(out, branch, depth + 2);
                        _ = writeln!(out, ";{pad}  END");
                    }
                }
                _ = writeln!(out, ";{pad}END");
            }
        }
    }
}
