//! Timers 0, 1 and 2: hand-computed cases as text, and ticked models under random scripts.

mod cases;
mod table;
