//! The USART compared with the data sheet: hand-made cases as text, and random programs compared with a slow
//! model that steps clock by clock.

mod cases;
mod link;
mod model;
mod random;
