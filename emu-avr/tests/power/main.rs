//! Resets and their causes, start-up, CLKPR, PRR, sleep and the brown-out detector beside a model that takes one cycle after the
//! other.

mod cases;
mod model;
mod random;
