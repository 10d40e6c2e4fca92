//! Timer 1, timer 2 and the CCP modules: against a model that ticks, and by hand-worked cases.

mod cases;
mod model;
mod random;
