//! Tests of Instruction List: tables of sources with what they give, and random programs.

mod network;
mod random;
mod tables;
