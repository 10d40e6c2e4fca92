//! Resets, start-up, clock and sleep of a chip.

mod cases;
