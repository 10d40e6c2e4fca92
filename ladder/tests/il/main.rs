//! Tests of Instruction List: tables of sources with what they give, and random programs.

mod random;
mod tables;
