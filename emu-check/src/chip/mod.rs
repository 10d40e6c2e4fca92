//! The chip under check: its facts, the places of the program in it, its pins and peripherals, and the run
//! from scan to scan.

pub(crate) mod bus_devices;
pub(crate) mod deviation;
pub(crate) mod families;
pub(crate) mod map_contract;
pub(crate) mod peripherals;
pub(crate) mod pin_behaviour;
pub(crate) mod pin_listener;
pub(crate) mod port_pins;
pub(crate) mod program_places;
pub(crate) mod pwm_meter;
pub(crate) mod runner;
pub(crate) mod serial_line;
