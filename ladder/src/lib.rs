//! The ladder language: model, reader and writer of `.ld` text, checks and drawing.
//!
//! This crate does not define what a program computes. `ladder-eval` and `ladder-compile` do, independently.
//!
//! ```
//! let head = "LDmicro0.1\nCYCLE=10000\nCRYSTAL=4000000\nPROGRAM\n";
//! let text = format!("{head}RUNG\n    CONTACTS Xstart 0\n    COIL Ylamp 0 0 0\nEND\n");
//! let program = ladder::parse("lamp.ld", &text).expect("a sound program").program;
//! assert!(ladder::draw(&program).contains("Xstart"));
//! assert!(ladder::check(&program).is_empty()); // no suspicious rungs
//!
//! // A fault has a code, a position, a cause and a hint.
//! let faults = ladder::parse("lamp.ld", &text.replace("CONTACTS", "CONTACT")).unwrap_err();
//! assert_eq!(faults[0].pos.line, 6);
//! ```
#![forbid(unsafe_code)]

mod argument_count;
mod bit_checks;
mod bus_elements;
mod check;
mod codes;
mod comment_text;
pub mod convert;
mod counted_elements;
mod diagram;
mod dialect_marks;
mod draw;
mod element_facts;
mod element_keywords;
mod element_reader;
mod element_symbol;
pub mod flow;
mod flow_checks;
pub mod format;
pub mod grid;
pub mod il;
mod integer_widths;
mod lexer;
mod list_lines;
pub mod model;
mod notation;
mod openplc;
mod operations;
mod operators;
mod packages;
mod parse;
mod peripheral_checks;
mod peripheral_model;
mod plcopen;
mod program_checks;
mod program_head;
mod program_parts;
mod pulse_elements;
mod reader;
mod register_checks;
pub mod registers;
mod rockwell;
pub mod segments;
mod symbol_kinds;
pub mod symbols;
mod write;
mod xml;

pub use bus_elements::{BusOp, BusTransfer, bus_hertz};
pub use check::check;
pub use codes::{CODES, NO_PORT_PIN, REWRITTEN};
pub use draw::{Drawing, DrawnElement, draw, draw_rung};
pub use element_facts::{ChipPart, ElementFacts, PowerEffect, SymbolUse, WriteMoment};
pub use element_keywords::element_keywords;
pub use model::*;
pub use notation::{IL_CYCLE_US, Notation, ReadOptions, is_program_name, notation_of, read_program};
pub use packages::{UnmodelledTarget, chip_of, package_pin, package_pin_count, package_pin_name, unmodelled_target};
pub use parse::{
    MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, MAX_RUNGS, ParseOptions, ParsedProgram, parse, parse_bytes, parse_with,
};
pub use peripheral_checks::is_percent_resolution;
pub use pulse_elements::stepper_counters;
pub use symbol_kinds::find_symbol;
pub use write::{element_text, write, write_bytes};
