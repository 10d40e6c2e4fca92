//! Random programs of intermediate code, and an interpreter that defines their results.

pub mod interp;
pub mod programs;
