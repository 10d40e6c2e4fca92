//! The USART against the data sheet: hand-worked cases as text, and a slow model that ticks.

mod cases;
mod link;
mod model;
mod random;
