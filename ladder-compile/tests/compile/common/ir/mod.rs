//! Intermediate code: programs of it, drawn at random, and what they must do.

pub mod interp;
pub mod programs;
