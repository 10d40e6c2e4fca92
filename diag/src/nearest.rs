//! Finds the name that the user probably meant by a misspelt one.

/// Number of characters of a name that are compared. A longer name is no misspelt name of this project.
const MAX_COMPARED_CHARS: usize = 64;

/// Returns the candidate with the smallest edit distance to `name`, or `None` if no candidate is near enough.
/// The limit is a third of the characters of `name`, at least 1. Case is ignored. Of candidates at equal
/// distance, the alphabetically first one is returned.
pub fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let name: String = name.chars().take(MAX_COMPARED_CHARS).flat_map(char::to_lowercase).collect();
    let limit = name.chars().count().max(3) / 3;
    let possible = candidates.filter(|candidate| candidate.len().abs_diff(name.len()) <= 4 * limit);
    let ranked = possible.map(|candidate| (distance(&name, &candidate.to_lowercase()), candidate));
    ranked.filter(|(distance, _)| *distance <= limit).min().map(|(_, candidate)| candidate)
}

/// Returns the edit distance from `a` to `b`: the number of insertions, deletions, substitutions and swaps of
/// neighbours (optimal string alignment).
#[must_use]
pub fn distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(a, b)
}
