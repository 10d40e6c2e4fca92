//! The machines of all families as the debugger runs them, for the tests of several crates.
//!
//! A machine's loops are compiled where its type is first used with the debugger. Here that is done once; a
//! test that makes its own [`DynMachine`] compiles them again, which takes half a minute.

#![forbid(unsafe_code)]

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_avr::Avr;
use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_debug::debug::{DynMachine, MachineWithDevices};
use emu_debug::{AttachedDevices, CycleClock};
use emu_pic16::Pic16;

/// Finds a chip of any family by its name, such as `atmega328p`.
#[must_use]
pub fn find_chip(name: &str) -> Option<&'static Chip> {
    let avr = emu_avr::chips::AVR_CHIPS.iter().copied();
    let mut all = avr.chain(emu_8051::chips::chips()).chain(emu_pic16::chips::chips()).chain(emu_ap101::chips::chips());
    all.find(|chip| chip.name == name)
}

/// A machine that a debugging session can run. Its methods are not generic, so that this crate has their
/// code.
pub trait DebugMachine: Cpu + Sized {
    /// Returns the machine without devices, at a clock of `hz` Hz.
    fn boxed(self, hz: u64) -> Box<dyn DynMachine>;
}

/// Implements [`DebugMachine`] for the machines of the families.
macro_rules! debug_machines {
    ($($machine:ty),*) => {$(
        impl DebugMachine for $machine {
            #[inline(never)]
            fn boxed(mut self, hz: u64) -> Box<dyn DynMachine> {
                let clock = CycleClock { hz, clocks_per_cycle: self.clocks_per_cycle() };
                let mut devices = AttachedDevices::new(Vec::new(), clock);
                devices.connect(&mut self);
                Box::new(MachineWithDevices::new(self, devices))
            }
        }
    )*};
}

debug_machines!(Avr, Mcs51, Pic16, Ap101);
