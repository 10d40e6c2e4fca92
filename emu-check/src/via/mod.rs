//! Checks by way of an emitted source: C, byte code or a sketch is made of the program, compiled by a compiler from outside,
//! run on this computer or on an emulated chip, and compared with the evaluator scan by scan.

mod codes;
pub mod script;
pub mod serve;
mod tools;
mod unit;

pub use codes::CODES;
