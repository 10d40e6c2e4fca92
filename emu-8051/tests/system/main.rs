//! The whole machine beside models, and machines beside each other.

mod irq;
mod model;
#[allow(dead_code)]
#[path = "../programs/script.rs"]
mod script;
mod wires;
