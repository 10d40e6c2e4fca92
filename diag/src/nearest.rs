//! The name that was probably meant.

/// Characters of a name that are compared: a longer one is no misspelt name of ours.
const MAX_COMPARED_CHARS: usize = 64;

/// Returns the candidate with the least edit distance to `name`, if it is near enough to be meant. Case does not count; of equally
/// near ones those that begin with `name` come first, and then the alphabetically first is returned.
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

/// Returns the edit distance from `a` to `b`: insertions, deletions, changes and swaps of neighbours (optimal string alignment).
#[must_use]
pub fn distance(a: &str, b: &str) -> usize {
    strsim::osa_distance(a, b)
}
