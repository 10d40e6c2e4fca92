//! Timers 0, 1 and 2: hand-computed cases as text, and ticked models with random scripts.

mod cases;
mod cases2;
mod model;
mod model2;
mod random;
mod random2;
mod table;
