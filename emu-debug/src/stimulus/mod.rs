//! Stimuli: drives of pins and the supply, bytes on a serial line, and scenarios on a chip.

pub mod chip_scenario;
mod drives;
pub mod serial_sender;

pub use drives::{
    ExternalDrive, INITIAL_SUPPLY_MV, PinAndLevel, SupplyChange, TimedDrive, check_drive_supported, example_pin,
    find_pin, missing_pin_reason, parse_drive, parse_pin_level, parse_timed_drive, queue_drive, queue_drives,
    supply_changes, supply_name,
};
