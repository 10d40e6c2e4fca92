//! Tests of the two-wire interface, section 22 of DS40002061.

mod bus;
mod cases;
mod link;
mod model;
mod random;
