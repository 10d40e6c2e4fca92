//! Tests of each instruction: hand-written cases, all operands compared with plain integers, and that any way
//! of running a program gives the same machine.

mod bits;
mod cuts;
mod encoding;
mod exhaustive;
mod flow;
mod joined;
mod memory;
mod rig;
mod slices;
mod states;
mod status;
mod table;
