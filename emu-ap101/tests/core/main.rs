//! The crate by itself: its table, its block of the configuration, its diagnostics, and that any way of running gives the same machine.

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
