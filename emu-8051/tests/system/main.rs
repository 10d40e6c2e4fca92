//! Compares the whole machine with models, and machines with each other.

mod irq;
mod model;
#[path = "../programs/source.rs"]
mod source;
mod wires;
