//! The whole machine beside models, and machines beside each other.

mod irq;
mod model;
#[path = "../programs/source.rs"]
mod source;
mod wires;
