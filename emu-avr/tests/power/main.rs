//! Resets and their causes, start-up, CLKPR, PRR, sleep and the brown-out detector, compared with a model
//! that steps cycle by cycle.

mod cases;
mod model;
mod random;
