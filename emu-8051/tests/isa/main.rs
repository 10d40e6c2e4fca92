//! What every instruction does: hand-written cases, all operands compared with plain integer arithmetic, and
//! a check that any way of running a program gives the same machine.

mod bits;
mod cuts;
mod exhaustive;
mod found;
mod opcodes;
mod rig;
mod slices;
mod states;
mod table;
