//! What every instruction does: cases written by hand, all operands against plain integers, and that any way of running a
//! program gives the same machine.

mod bits;
mod cuts;
mod exhaustive;
mod found;
mod opcodes;
mod rig;
mod slices;
mod states;
mod table;
