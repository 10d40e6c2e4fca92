//! The peripherals, one file each: plain data that knows nothing of the core.

pub mod map;
pub mod plain;
pub mod ports;
pub mod timer;
pub mod usart;
pub mod watchdog;
