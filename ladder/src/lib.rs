//! The ladder language: model, `.ld` text, checks and drawing. Meaning is told elsewhere, twice: in `ladder-eval` and in
//! `ladder-compile`.
#![forbid(unsafe_code)]

mod element_symbol;
mod check;
mod packages;
mod codes;
mod draw;
pub mod format;
mod program_head;
mod element_reader;
mod lexer;
pub mod model;
mod parse;
mod peripheral_checks;
mod reader;
mod element_keywords;
pub mod symbols;
mod counted_elements;
mod program_checks;
mod integer_widths;
mod write;

pub use check::check;
pub use packages::{chip_of, has_pin_table, package_pin};
pub use codes::{CODES, REWRITTEN};
pub use draw::{DrawnElement, Drawing, draw, draw_rung};
pub use model::*;
pub use parse::{MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, MAX_RUNGS, ParseOptions, ParsedProgram, parse, parse_bytes, parse_with};
pub use write::{element_text, write, write_bytes};
