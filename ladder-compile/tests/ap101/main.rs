//! AP101: programs on the emulated machine against the reference evaluator, and what is refused.

mod draw;
mod fits;
mod plain;
mod random;
mod rig;
#[path = "../../../tests/ladder/mod.rs"]
mod table;
