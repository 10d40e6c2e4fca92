//! The name that was probably meant.

/// The candidate with the least edit distance to `name`, case aside, if it is near enough to be meant.
pub(crate) fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<String> {
    let name: Vec<char> = name.chars().map(|c| c.to_ascii_lowercase()).take(64).collect();
    let limit = name.len().max(3) / 3;
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates.filter(|c| c.len().abs_diff(name.len()) <= limit && !c.contains('\u{1}')) {
        let d = distance(&name, candidate);
        if d <= limit && best.is_none_or(|(least, text)| (d, candidate) < (least, text)) {
            best = Some((d, candidate));
        }
    }
    best.map(|(_, text)| text.to_owned())
}

/// Insertions, deletions, changes and swaps of neighbours from `a` to `b` (optimal string alignment).
fn distance(a: &[char], b: &str) -> usize {
    let b: Vec<char> = b.chars().map(|c| c.to_ascii_lowercase()).collect();
    let mut above: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.iter().enumerate() {
        let mut next = vec![i + 1];
        for (j, y) in b.iter().enumerate() {
            let get = |row: &[usize], j: usize| row.get(j).copied().unwrap_or(usize::MAX / 2);
            let mut least = (get(&row, j) + usize::from(x != y)).min(get(&row, j + 1) + 1).min(get(&next, j) + 1);
            let swapped = i > 0 && j > 0 && a.get(i - 1) == Some(y) && b.get(j - 1) == Some(x);
            if swapped {
                least = least.min(get(&above, j - 1) + 1);
            }
            next.push(least);
        }
        above = std::mem::replace(&mut row, next);
    }
    row.last().copied().unwrap_or(0)
}
