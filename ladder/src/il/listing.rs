//! The text of a ladder program in Instruction List, and its listing in columns.

use std::fmt::Write as _;

use crate::draw::{Drawing, DrawnElement};
use crate::model::{Element, ElementId, LadderProgram, ProgramElement, RungNode};

use super::literals::address_text;
use super::model::IlQualifier;
use super::steps::{IecVariable, IlAction, IlStep};
use super::types::IecType;

/// Widest operand that widens the column of operands.
const MAX_OPERAND: usize = 40;
/// Columns of the number of the network and the space after it.
const NUMBER_WIDTH: usize = 7;
/// Width of the column of operators.
const OPERATOR_WIDTH: usize = 6;

/// Returns the canonical text of a program: sections of variables, then a line for each element. Reading it
/// gives an equal program, positions and empty lines apart.
#[must_use]
pub fn program_text(program: &LadderProgram) -> String {
    let mut text = String::new();
    let declared: Vec<&IecVariable> = program.declarations.iter().filter(|variable| variable.is_declared).collect();
    for section in declared.chunk_by(|a, b| (a.section, a.qualifier) == (b.section, b.qualifier)) {
        let Some(first) = section.first() else { continue };
        text += first.section.keyword();
        text += match first.qualifier {
            Some(IlQualifier::Retain) => " RETAIN\n",
            Some(IlQualifier::Constant) => " CONSTANT\n",
            None => "\n",
        };
        section.iter().for_each(|variable| text += &declaration_text(variable));
        text += "END_VAR\n";
    }
    for (index, rung) in program.rungs.iter().enumerate() {
        if index > 0 {
            text.push('\n');
        }
        let mut depth = 0_usize;
        for node in &rung.series {
            match node {
                RungNode::Leaf(Element::Comment(comment), _) => {
                    comment.lines().for_each(|line| _ = writeln!(text, "(* {line} *)"));
                }
                RungNode::Leaf(Element::Instruction(step), _) => text += &line_text(step, &mut depth),
                _ => {}
            }
        }
    }
    text
}

fn declaration_text(variable: &IecVariable) -> String {
    let mut text = format!("  {}", variable.name);
    if let Some(address) = &variable.address {
        _ = write!(text, " AT {}", address_text(address));
    }
    _ = write!(text, " : {}", variable.iec_type.keyword());
    match variable.iec_type {
        _ if variable.initial == 0 => {}
        IecType::Bool => text += " := TRUE",
        IecType::Time => _ = write!(text, " := T#{}ms", variable.initial),
        _ => _ = write!(text, " := {}", variable.initial),
    }
    text.push(';');
    if let Some(comment) = &variable.comment {
        _ = write!(text, " (* {comment} *)");
    }
    text.push('\n');
    text
}

fn line_text(step: &IlStep, depth: &mut usize) -> String {
    *depth = depth.saturating_sub(usize::from(matches!(step.action, IlAction::Close { .. })));
    let label = step.label.as_ref().map_or("    ".to_owned(), |label| format!("{label}: "));
    let comment = step.comment.as_ref().map_or(String::new(), |comment| format!("  (* {comment} *)"));
    let line = format!("{label}{}{}{comment}", "  ".repeat(*depth), step.text());
    *depth += usize::from(matches!(step.action, IlAction::Open { .. }));
    format!("{}\n", line.trim_end())
}

/// Columns of the listing of one program.
struct ListingColumns {
    label: usize,
    operand: usize,
}

impl ListingColumns {
    fn of(program: &LadderProgram) -> ListingColumns {
        let mut columns = ListingColumns { label: 2, operand: 8 };
        for ProgramElement { element, .. } in program.elements() {
            let Element::Instruction(step) = element else { continue };
            let label = step.label.as_ref().map_or(0, |label| label.chars().count() + 3);
            columns.label = columns.label.max(label);
            let operand = split_operation(step).1.chars().count() + 2;
            if operand <= MAX_OPERAND {
                columns.operand = columns.operand.max(operand);
            }
        }
        columns
    }
}

/// Splits the text of a line into operator and operand, in one line each.
fn split_operation(step: &IlStep) -> (String, String) {
    let text = IlStep { label: None, ..step.clone() }.to_string();
    match text.split_once(' ') {
        Some((operator, operand)) => (operator.to_owned(), operand.to_owned()),
        None => (text, String::new()),
    }
}

/// Returns the listing of a network (index from 0): number, label, operator, operand and comment in columns.
pub(crate) fn listing(program: &LadderProgram, index: usize) -> Drawing {
    list_network(program, index, &ListingColumns::of(program))
}

/// Returns the listings of all networks.
pub(crate) fn listings(program: &LadderProgram) -> impl Iterator<Item = Drawing> {
    let columns = ListingColumns::of(program);
    (0..program.rungs.len()).map(move |index| list_network(program, index, &columns))
}

fn list_network(program: &LadderProgram, index: usize, columns: &ListingColumns) -> Drawing {
    let mut drawing = Drawing { lines: Vec::new(), elements: Vec::new() };
    let Some(rung) = program.rungs.get(index) else { return drawing };
    let mut id = ElementId { rung: u32::try_from(index).unwrap_or(u32::MAX), index: 0 };
    let mut depth = 0_usize;
    for node in &rung.series {
        let (mut line, mut column) = (" ".repeat(NUMBER_WIDTH), NUMBER_WIDTH);
        let first = drawing.lines.len();
        let width = match node {
            RungNode::Leaf(Element::Comment(comment), _) => {
                let lines = comment.lines().map(|text| format!("{line}(* {} *)", printable(text)));
                drawing.lines.extend(lines);
                drawing.lines.get(first).map_or(0, |line| line.chars().count().saturating_sub(column))
            }
            RungNode::Leaf(Element::Instruction(step), _) => {
                depth = depth.saturating_sub(usize::from(matches!(step.action, IlAction::Close { .. })));
                let label = step.label.as_ref().map_or(String::new(), |label| format!("{label}:"));
                let (operator, operand) = split_operation(step);
                line += &format!("{label:<width$}{}", "  ".repeat(depth), width = columns.label);
                column = if step.operation.is_none() { column } else { line.chars().count() };
                let operation = format!("{operator:<OPERATOR_WIDTH$}{operand}");
                let shown = operation.trim_end().chars().count().max(label.chars().count());
                let wide = (columns.operand + OPERATOR_WIDTH).saturating_sub(2 * depth);
                line += &step
                    .comment
                    .as_ref()
                    .map_or(operation.clone(), |comment| format!("{operation:<wide$}  (* {} *)", printable(comment)));
                drawing.lines.push(line);
                depth += usize::from(matches!(step.action, IlAction::Open { .. }));
                if step.operation.is_none() { label.chars().count() } else { shown }
            }
            _ => continue,
        };
        drawing.elements.push(DrawnElement { id, line: first, column, width });
        id.index += 1;
    }
    if let Some(first) = drawing.lines.first_mut() {
        *first = first.replacen("     ", &format!("{:>5}", index + 1), 1);
    }
    let width = drawing.lines.iter().map(|line| line.trim_end().chars().count()).max().unwrap_or(0);
    drawing.lines.iter_mut().for_each(|line| *line = format!("{:<width$}", line.trim_end()));
    drawing
}

fn printable(text: &str) -> String {
    crate::element_symbol::printable(text)
}
