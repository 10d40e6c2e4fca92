//! Tests AP101: programs on the emulated machine against the reference evaluator, and refusals.

mod fits;
mod machine_pair;
mod plain;
mod program_generator;
mod random;
#[path = "../../../tests/ladder/mod.rs"]
mod table;
