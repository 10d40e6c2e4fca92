//! All tests of the evaluator in one binary; `common` holds the shared helpers.

mod api;
mod common;
mod corpus;
mod devices;
mod diagrams;
mod il;
mod il_random;
mod naive;
mod nesting;
mod random;
mod random_adapt;
mod random_flow;
mod random_parts;
mod speed;
#[path = "../../../tests/ladder/mod.rs"]
mod table;
mod traces;
