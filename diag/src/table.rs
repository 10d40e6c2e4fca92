//! Aligns the columns of tables of text.

/// Returns rows of cells as lines with aligned columns, two spaces apart and without white space at the end.
/// Columns for which `is_number` is true are aligned to the right. Rows may have fewer cells than others.
pub fn align_columns(rows: &[Vec<String>], is_number: impl Fn(usize) -> bool) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..columns).map(|column| width(column).unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| match is_number(column) {
            true => format!("{cell:>width$}"),
            false => format!("{cell:<width$}"),
        });
        text.push_str(cells.collect::<Vec<_>>().join("  ").trim_end());
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::align_columns;

    #[test]
    fn numbers_are_to_the_right() {
        let rows = [vec!["name", "n", "note"], vec!["µ", "10"], vec!["long name", "5", "last"]];
        let rows = rows.map(|row| row.into_iter().map(str::to_owned).collect::<Vec<_>>());
        let wanted = "name        n  note\nµ          10\nlong name   5  last\n";
        assert_eq!(align_columns(&rows, |column| column == 1), wanted);
        assert_eq!(align_columns(&[], |_| true), "");
    }
}
