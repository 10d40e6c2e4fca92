//! The watchdog: hand-made cases from DS40002061 and the data sheets of older chips as text, and random
//! programs compared with a model that steps cycle by cycle.

mod cases;
mod random;
