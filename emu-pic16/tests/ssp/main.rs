//! The synchronous serial port against the data sheets: cases worked by hand as text, two ports on one bus, and slow models
//! that tick.

mod bus;
mod cases;
mod master;
mod model;
mod pairs;
mod random;
mod rig;
mod slave;
mod spi;
