//! The peripherals: cases from the data sheet as text, and slow ticked models that random programs must agree with.

mod cases;
mod model_timers;
mod model_usart;
mod models;
mod script;
