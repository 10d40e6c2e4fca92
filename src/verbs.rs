//! The verbs of the command line: one file or folder for each, with its flags and what it does.

pub mod asm;
pub mod check;
pub mod chips;
pub mod compile;
pub mod convert;
pub mod dap;
pub mod debug;
pub mod diff;
pub mod disasm;
pub mod draw;
pub mod explain;
pub mod fuzz;
pub mod lockstep;
pub mod migrate;
pub mod run;
pub mod shell;
pub mod sim;
pub mod test;
pub mod wave;
