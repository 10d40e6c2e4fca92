//! Building blocks that peripherals of several chips share, as plain values. They are not ticked: each
//! computes its state at a given cycle and the time of its next event.

pub mod counter;
pub mod prescaler;
pub mod uart;
