//! The grids of CSLadder (reference 003): a text of its matrices, its checks, and its paths as Instruction
//! List.
//!
//! ```
//! let text = "CSLADDER\nGRID\n  EN0 + /EN1 - OTE:S11\n  S11 +\nEND\n";
//! let grids = ladder::grid::read("relay.grid", text).expect("sound grids").program;
//! let paths = "grid 1\n  (EN0 AND /EN1)\n  OR (S11 AND /EN1)\n  OTE S11\n";
//! assert_eq!(ladder::grid::paths_text(&grids), paths);
//! assert_eq!(ladder::grid::write(&grids), text);
//! let program = ladder::grid::to_instruction_list(&grids);
//! assert!(ladder::il::write(&program).contains("ST S11"));
//! ```

mod checks;
mod codes;
mod instructions;
mod model;
mod paths;
mod reader;

pub use codes::GRID_CODES;
pub use instructions::to_instruction_list;
pub use model::{
    GridArea, GridCell, GridContact, GridOperand, GridOutput, GridOutputKind, GridProgram, LadderGrid, LinkShape,
};
pub use paths::{MAX_PATHS, paths_text, paths_to};
pub use reader::{ParsedGridProgram, read};

use model::CellText;

/// Writes the grids: cells in columns, without the empty cells at the end of a row. If the last column is
/// empty, the first row has all its cells, because the longest row is the width of the grid.
#[must_use]
pub fn write(program: &GridProgram) -> String {
    let mut text = "CSLADDER\n".to_owned();
    if program.is_active_low {
        text += "INPUTS ACTIVE-LOW\n";
    }
    for grid in &program.grids {
        grid.comments.iter().for_each(|comment| text += &format!("; {comment}\n"));
        text += "GRID\n";
        let cells: Vec<Vec<String>> =
            grid.rows.iter().map(|row| row.iter().map(|cell| CellText(cell).to_string()).collect()).collect();
        let width =
            |column: usize| cells.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
        let is_last_empty = cells.iter().all(|row| row.last().is_some_and(|cell| cell == "."));
        for (index, row) in cells.iter().enumerate() {
            let used = match row.iter().rposition(|cell| cell != ".") {
                _ if is_last_empty && index == 0 => row.len(),
                last => last.map_or(0, |last| last + 1),
            };
            let padded = row.iter().take(used).enumerate();
            let padded: Vec<String> =
                padded.map(|(column, cell)| format!("{cell:<w$}", w = width(column).unwrap_or(0))).collect();
            let line = padded.join(" ");
            text += &format!("  {}\n", if used == 0 { "." } else { line.trim_end() });
        }
        text += "END\n";
    }
    text
}
