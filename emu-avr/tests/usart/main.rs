//! Tests of the USART, sections 20 and 21 of DS40002061.

mod cases;
mod link;
mod model;
mod random;
