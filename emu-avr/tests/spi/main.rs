//! Tests of the SPI, section 19 of DS40002061.

mod cases;
mod link;
mod model;
mod random;
