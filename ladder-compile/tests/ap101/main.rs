//! AP101: programs on the emulated machine against the reference evaluator, and what is refused.

mod program_generator;
mod fits;
mod plain;
mod random;
mod machine_pair;
#[path = "../../../tests/ladder/mod.rs"]
mod table;
