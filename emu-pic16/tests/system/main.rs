//! The whole machine beside a model that goes cycle by cycle.

mod irq;
mod model;
#[allow(dead_code)]
#[path = "../programs/script.rs"]
mod script;
