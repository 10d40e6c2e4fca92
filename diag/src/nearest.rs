//! Finds the name that the user probably meant by a misspelt one.

/// Number of characters of a name that are compared. A longer name is no misspelt name of this project.
const MAX_COMPARED_CHARS: usize = 64;

/// Returns the candidate with the smallest edit distance to `name`, or `None` if no candidate is near enough.
/// The limit is a third of the characters of `name`, at least 1. Case is ignored. Of candidates at equal
/// distance, those that begin with `name` come first, and of these the alphabetically first one is returned.
pub fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let name: String = name.chars().take(MAX_COMPARED_CHARS).flat_map(char::to_lowercase).collect();
    let limit = name.chars().count().max(3) / 3;
    let possible = candidates.filter(|candidate| candidate.len().abs_diff(name.len()) <= 4 * limit);
    // Of equally near ones that which the word is the beginning of: MOV is MOVE rather than MOD.
    let ranked = possible.map(|candidate| {
        let lower = candidate.to_lowercase();
        (distance(&name, &lower), !lower.starts_with(&name), candidate)
    });
    ranked.filter(|(distance, ..)| *distance <= limit).min().map(|(.., candidate)| candidate)
}

/// Returns the edit distance from `a` to `b`: the number of insertions, deletions, substitutions and swaps of
/// neighbours (optimal string alignment).
#[must_use]
pub fn distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(a, b)
}
