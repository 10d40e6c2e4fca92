//! The EEPROM: cases worked by hand from DS40002061 as text, and a model that ticks and that random programs must agree with.

mod cases;
mod random;
