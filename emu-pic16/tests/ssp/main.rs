//! The synchronous serial port compared with the data sheets: hand-made cases as text, two ports on one bus,
//! and random programs compared with slow models that step clock by clock.

mod bus;
mod cases;
mod master;
mod model;
mod pairs;
mod random;
mod rig;
mod slave;
mod spi;
