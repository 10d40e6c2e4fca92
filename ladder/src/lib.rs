//! The ladder language: model, `.ld` text, checks and drawing. Meaning is told elsewhere, twice: in `ladder-eval` and in
//! `ladder-compile`.
#![forbid(unsafe_code)]

mod cell;
mod check;
mod chips;
mod codes;
mod draw;
pub mod format;
mod head;
mod leaf;
mod lex;
pub mod model;
mod parse;
mod parts;
mod reader;
mod rows;
pub mod symbols;
mod table;
mod whole;
mod widths;
mod write;

pub use check::check;
pub use chips::{chip_of, knows_pins, package_pin};
pub use codes::{CODES, REWRITTEN};
pub use draw::{Cell, Drawing, draw, draw_rung};
pub use model::*;
pub use parse::{MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, MAX_RUNGS, Options, Parsed, parse, parse_bytes, parse_with};
pub use write::{element_text, write, write_bytes};
