//! The inputs of a check: which pins, bytes and values the program gets in every scan.

pub(crate) mod boundary_goals;
pub(crate) mod generator;
pub(crate) mod shrink;
pub(crate) mod stimulus_symbols;
