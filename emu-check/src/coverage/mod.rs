//! Coverage: which outcomes of the ladder elements a check should see, and which it has seen.

pub(crate) mod classes;
pub(crate) mod goals;
mod instruction_rules;
pub(crate) mod possible_outcomes;
pub(crate) mod rules;
