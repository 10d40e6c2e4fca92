//! Scenarios on a ladder program: on the evaluator alone, or on evaluator and chip.

pub(crate) mod on_chip;
pub(crate) mod play;
