//! Draws bits over scans as lines of text.

/// Maximum number of columns in a line.
const COLUMNS: usize = 80;

/// Draws one line per bit: high, low, or hatched if it changes within a column. A column covers as many scans
/// as needed to fit the width. `bits` gives the name of each bit and its position in a row.
pub fn draw_scan_bits(bits: &[(&str, usize)], rows: &[Vec<Option<i64>>]) -> String {
    let per_column = rows.len().div_ceil(COLUMNS).max(1);
    let width = bits.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).max(4);
    let mut out = format!("{:>width$}  ", "scan");
    // A number at every tenth column: the first scan of that column.
    for column in (0..rows.len().div_ceil(per_column)).step_by(10) {
        out.push_str(&format!("{:<10}", column * per_column + 1));
    }
    out.truncate(out.trim_end().len());
    out.push('\n');
    for &(name, position) in bits {
        out.push_str(&format!("{name:>width$}  "));
        for column in rows.chunks(per_column) {
            let level = |row: &Vec<Option<i64>>| row.get(position).is_some_and(|v| v.is_some_and(|v| v != 0));
            out.push(glyph(column.iter().all(level), column.iter().any(level)));
        }
        out.push('\n');
    }
    out
}

/// Returns the character for a column of a bit: `all` or only `any` of its scans are high.
pub fn glyph(all: bool, any: bool) -> char {
    match (all, any) {
        (true, _) => '▔',
        (false, false) => '▁',
        (false, true) => '▒',
    }
}

#[cfg(test)]
mod tests {
    use super::draw_scan_bits;

    #[test]
    fn lines_and_columns() {
        let rows: Vec<Vec<Option<i64>>> =
            (0..12).map(|i| vec![Some(i64::from(i >= 3)), Some(7), Some(i64::from(i == 11))]).collect();
        let wanted = "\
scan  1         11
  Xa  ▁▁▁▔▔▔▔▔▔▔▔▔
  Yb  ▁▁▁▁▁▁▁▁▁▁▁▔
";
        assert_eq!(draw_scan_bits(&[("Xa", 0), ("Yb", 2)], &rows), wanted);
        // 160 scans take two per column; a change within a column is hatched.
        let rows: Vec<Vec<Option<i64>>> = (0..160).map(|i| vec![Some(i % 2)]).collect();
        assert_eq!(
            draw_scan_bits(&[("Ra", 0)], &rows).lines().nth(1),
            Some(format!("  Ra  {}", "▒".repeat(80)).as_str())
        );
        assert_eq!(draw_scan_bits(&[], &[]), "scan\n");
    }
}
