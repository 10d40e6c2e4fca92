//! The peripherals: cases from the data sheet as text, and random programs compared with slow models that
//! step cycle by cycle.

mod cases;
mod model_timers;
mod model_usart;
mod models;
mod script;
