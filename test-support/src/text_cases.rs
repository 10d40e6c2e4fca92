//! Tables of cases: one case per line, with blank lines and lines that start with `#` in between.

/// Returns the cases of a table: its lines without blank ones and comments.
pub fn case_lines(table: &str) -> impl Iterator<Item = &str> {
    table.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'))
}

#[cfg(test)]
mod tests {
    use super::case_lines;

    #[test]
    fn comments_and_blank_lines_are_no_cases() {
        assert_eq!(case_lines("# topic\n\na | b\n  \n # c\n").collect::<Vec<_>>(), ["a | b", " # c"]);
    }
}
