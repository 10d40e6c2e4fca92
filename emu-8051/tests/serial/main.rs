//! The serial port against the user's manual: hand-computed cases as text, and a slow model that ticks.

mod cases;
mod model;
mod random;
