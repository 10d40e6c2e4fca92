//! The timer/counters: hand-made cases from the data sheet, and random programs compared with a model that
//! steps cycle by cycle.

mod asynchronous;
mod cases;
mod cells;
mod model;
mod pwm;
mod random;
mod script;
mod writes;
