//! All tests of the evaluator, in one program: what they share stands in `common`.

mod api;
mod common;
mod corpus;
mod devices;
mod naive;
mod nesting;
mod random;
mod speed;
#[path = "../../../tests/ladder/mod.rs"]
mod table;
mod traces;
