//! The four checks of CSLadder, and paths.

use std::collections::BTreeSet;

use diag::{Diagnostic, Pos, Severity};

use super::codes;
use super::model::{GridArea, GridCell, GridOperand, GridOutput, GridOutputKind, GridProgram};
use super::paths::paths_to;

/// Returns the errors of a program; the last diagnostic is the number of errors of the four checks.
pub(super) fn check(program: &GridProgram) -> Vec<Diagnostic> {
    let mut found: Vec<Diagnostic> = Vec::new();
    let outputs: Vec<&GridOutput> = cells(program)
        .filter_map(|cell| match cell {
            GridCell::Output(output) => Some(output),
            _ => None,
        })
        .collect();
    let driven: BTreeSet<GridOperand> =
        outputs.iter().filter(|output| output.kind != GridOutputKind::Res).map(|output| output.operand).collect();
    let mut report = |severity, code, pos: Pos, cause: String, hint: &str| {
        found.push(Diagnostic::new(severity, code, &program.file, pos, cause, hint));
    };
    let mut used: BTreeSet<GridOperand> = BTreeSet::new();
    for output in &outputs {
        let operand = output.operand;
        match output.kind {
            GridOutputKind::Res if !driven.contains(&operand) => {
                let keyword = if operand.area == GridArea::Timer { "TON" } else { "CTU" };
                let cause = format!("RES of `{operand}`, and no grid has a {keyword} of it");
                report(Severity::Error, codes::GRID_RES, output.pos, cause, "add the element, or remove RES");
            }
            GridOutputKind::Ton(_) | GridOutputKind::Ctu(_) if !used.insert(operand) => {
                let is_timer = operand.area == GridArea::Timer;
                let code = if is_timer { codes::GRID_TON_TWICE } else { codes::GRID_CTU_TWICE };
                let cause = format!("`{operand}` has a second {}", output.kind.keyword());
                report(Severity::Error, code, output.pos, cause, "give each one a number of its own");
            }
            GridOutputKind::Ote
            | GridOutputKind::Otl
            | GridOutputKind::Otu
            | GridOutputKind::Ton(_)
            | GridOutputKind::Ctu(_)
            | GridOutputKind::Res => {}
        }
    }
    for cell in cells(program) {
        let GridCell::Contact(contact) = cell else { continue };
        if contact.operand.area != GridArea::Input && !driven.contains(&contact.operand) {
            let cause = format!("no grid has an output of `{}`", contact.operand);
            report(
                Severity::Error,
                codes::GRID_NEVER_DRIVEN,
                contact.pos,
                cause,
                "add the output, or correct the number",
            );
        }
    }
    let errors = found.len();
    found.extend(check_paths(program));
    found.sort_by_key(|fault| fault.pos);
    if errors > 0 {
        let cause =
            format!("the four checks of CSLadder find {errors} {}", if errors == 1 { "error" } else { "errors" });
        let pos = Pos::new(1, 1, 1);
        let hint = "correct them; CSLadder compiles only without errors";
        found.push(Diagnostic::new(Severity::Note, codes::GRID_ERRORS, &program.file, pos, cause, hint));
    }
    found
}

fn cells(program: &GridProgram) -> impl Iterator<Item = &GridCell> {
    program.grids.iter().flat_map(|grid| grid.rows.iter().flatten())
}

/// Checks that each output has a path, and not too many.
fn check_paths(program: &GridProgram) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    for grid in &program.grids {
        let mut outputs = 0_usize;
        for (row, cells) in grid.rows.iter().enumerate() {
            let Some(GridCell::Output(output)) = cells.last() else { continue };
            outputs += 1;
            let (code, cause, hint) = match paths_to(grid, row) {
                None => (codes::GRID_PATHS, "the output has more than 1000 paths", "split the grid with a flag"),
                Some(paths) if paths.is_empty() => {
                    (codes::GRID_NO_PATH, "no path leads to the output", "fill the gap with --- and -")
                }
                Some(_) => continue,
            };
            found.push(Diagnostic::new(Severity::Error, code, &program.file, output.pos, cause, hint));
        }
        if outputs == 0 {
            let (cause, hint) = ("the grid has no output and does nothing", "add an output in the last column");
            found.push(Diagnostic::new(Severity::Note, codes::GRID_NO_OUTPUT, &program.file, grid.pos, cause, hint));
        }
    }
    found
}
