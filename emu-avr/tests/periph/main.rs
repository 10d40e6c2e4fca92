//! The peripherals: cases from the data sheet as text, and slow ticked models that random programs must agree with.

mod cases;
mod models;
mod script;
