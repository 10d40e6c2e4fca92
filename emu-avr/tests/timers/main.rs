//! The timer/counters: cases worked by hand from the data sheet, and random programs against a model that ticks.

mod asynchronous;
mod cases;
mod cells;
mod model;
mod pwm;
mod random;
mod script;
mod writes;
