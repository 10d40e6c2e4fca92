//! The paths from the left bar to an output, from left to right as in reference 003.

use std::collections::BTreeMap;

use super::model::{GridCell, GridContact, GridProgram, LadderGrid};

/// Most paths of an output.
pub const MAX_PATHS: usize = 1000;

/// Returns the node of each link cell: cells of a column that lead to each other are one node. The key is
/// column and row; the value is the row of the topmost cell.
fn nodes(grid: &LadderGrid) -> BTreeMap<(usize, usize), usize> {
    let mut nodes = BTreeMap::new();
    for column in (1..grid.rows.first().map_or(0, Vec::len)).step_by(2) {
        let mut above: Option<(usize, bool)> = None;
        for (row, cells) in grid.rows.iter().enumerate() {
            let Some(GridCell::Link(link)) = cells.get(column) else {
                above = None;
                continue;
            };
            let top = match above {
                Some((top, true)) if link.up => top,
                _ => row,
            };
            nodes.insert((column, row), top);
            above = Some((top, link.down));
        }
    }
    nodes
}

/// Returns the paths to the output at a row: the contacts of each, from left to right. Paths are ordered from
/// the top. `None` if there are more than [`MAX_PATHS`].
#[must_use]
pub fn paths_to(grid: &LadderGrid, row: usize) -> Option<Vec<Vec<GridContact>>> {
    let width = grid.rows.first().map_or(0, Vec::len);
    let nodes = nodes(grid);
    let leads = |column: usize, row: usize, to_left: bool| {
        matches!(grid.rows.get(row).and_then(|cells| cells.get(column)),
            Some(GridCell::Link(link)) if if to_left { link.left } else { link.right })
    };
    // Paths to each node, from the left. The bar is the node of every row before column 1.
    let mut paths: BTreeMap<(usize, usize), Vec<Vec<GridContact>>> = BTreeMap::new();
    for column in (0..width.saturating_sub(1)).step_by(2) {
        for (from_row, cells) in grid.rows.iter().enumerate() {
            let contact = match cells.get(column) {
                Some(GridCell::Contact(contact)) => Some(contact.clone()),
                Some(GridCell::Wire) => None,
                _ => continue,
            };
            let before = match column.checked_sub(1) {
                None => vec![Vec::new()],
                Some(link) if leads(link, from_row, false) => {
                    let Some(top) = nodes.get(&(link, from_row)) else { continue };
                    paths.get(&(link, *top)).cloned().unwrap_or_default()
                }
                Some(_) => continue,
            };
            let Some(top) = nodes.get(&(column + 1, from_row)).filter(|_| leads(column + 1, from_row, true)) else {
                continue;
            };
            let here = paths.entry((column + 1, *top)).or_default();
            for mut path in before {
                path.extend(contact.clone());
                if !here.contains(&path) {
                    here.push(path);
                }
                if here.len() > MAX_PATHS {
                    return None;
                }
            }
        }
    }
    let Some(link) = width.checked_sub(2) else { return Some(vec![Vec::new()]) };
    let top = nodes.get(&(link, row)).filter(|_| leads(link, row, false));
    Some(top.and_then(|top| paths.get(&(link, *top)).cloned()).unwrap_or_default())
}

/// Returns the table of each output: its paths as an OR of ANDs, and its command.
#[must_use]
pub fn paths_text(program: &GridProgram) -> String {
    let mut text = String::new();
    for (number, grid) in (1..).zip(&program.grids) {
        text += &format!("grid {number}\n");
        for (row, cells) in grid.rows.iter().enumerate() {
            let Some(GridCell::Output(output)) = cells.last() else { continue };
            for (index, path) in paths_to(grid, row).unwrap_or_default().iter().enumerate() {
                let contacts: Vec<String> =
                    path.iter().map(|c| format!("{}{}", if c.negated { "/" } else { "" }, c.operand)).collect();
                let product =
                    if contacts.is_empty() { "TRUE".to_owned() } else { format!("({})", contacts.join(" AND ")) };
                text += &format!("  {}{product}\n", if index > 0 { "OR " } else { "" });
            }
            text += &format!("  {} {}\n", output.kind.keyword(), output.operand);
        }
    }
    text
}
