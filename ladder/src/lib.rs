//! The ladder language: model, `.ld` text, checks and drawing. Meaning is told elsewhere, twice: in `ladder-eval` and in
//! `ladder-compile`.

pub mod model;
pub mod symbols;

pub use model::*;
