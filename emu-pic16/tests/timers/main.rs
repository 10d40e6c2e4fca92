//! Timer 1, timer 2 and the CCP modules, compared with a model that steps clock by clock, and with hand-made
//! cases.

mod cases;
mod model;
mod random;
