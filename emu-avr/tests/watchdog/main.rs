//! The watchdog: cases worked by hand from DS40002061 and its older relatives as text, and a model that ticks and that random
//! programs must agree with.

mod cases;
mod random;
