//! Tests of the crate alone: its table, its configuration block, its lints, and that any way of running gives
//! the same machine.

mod block;
mod counts;
mod cuts;
mod flow;
mod lints;
mod rig;
mod slices;
mod steady;
mod subcycles;
mod table;
