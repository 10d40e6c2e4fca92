//! Any machine as a trait object of one type.

use std::collections::BTreeSet;

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, LAST_CYCLE, Probe, ResetCause, StopReason};
use emu_core::pins::{PinId, PinLevel};
use emu_core::state::SnapshotDamaged;

use crate::InputError;
use crate::attached_devices::AttachedDevices;
use crate::dyn_probe;
pub use crate::dyn_probe::{DynProbe, ObserveLevel};
use crate::stimulus::{TimedDrive, queue_drives};

/// A chip of any family, with the devices at its pins.
pub trait DynMachine {
    /// Returns the chip row.
    fn chip(&self) -> &'static Chip;
    /// Returns the oscillator clocks per machine cycle.
    fn clocks_per_cycle(&self) -> u32;
    /// Returns the machine cycles since power-up.
    fn cycle(&self) -> u64;
    /// Returns the instructions executed since power-up.
    fn instructions(&self) -> u64;
    /// Returns the program counter in program words.
    fn pc(&self) -> u32;
    /// Returns the value of a core register: [`Cpu::reg`].
    fn reg(&self, name: &str) -> Option<u32>;
    /// Sets a core register; returns false if there is none of that name: [`Cpu::set_reg`].
    fn set_reg(&mut self, name: &str, value: u32) -> bool;
    /// Returns a byte of a memory without side effects: [`Cpu::peek`].
    fn peek(&self, space: &str, addr: u32) -> Option<u8>;
    /// Sets a byte of a memory; returns false if there is none: [`Cpu::poke`].
    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool;
    /// Sets one bit of a byte of a memory; returns false if there is none: [`Cpu::poke_bit`].
    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool;
    /// Returns true if the machine, as configured, has a pin: [`Cpu::has_pin`].
    fn has_pin(&self, pin: PinId) -> bool;
    /// Returns the level of a pin: [`Cpu::pin_level`].
    fn pin_level(&self, pin: PinId) -> PinLevel;
    /// Returns the canonical address of a byte of RAM: [`Cpu::canonical_ram_address`].
    fn canonical_ram_address(&self, addr: u32) -> Option<u32>;
    /// Returns the return addresses of a stack that is in no memory ([`Cpu::return_stack`]).
    fn return_stack(&self) -> Vec<u32>;
    /// Returns the depth of the stack: [`Cpu::stack_depth`].
    fn stack_depth(&self) -> u32;
    /// Returns the interrupt flags that are set and enabled: [`Cpu::interrupt_flags`].
    fn interrupt_flags(&self) -> Vec<&'static str>;
    /// Queues a drive from outside.
    ///
    /// # Errors
    /// The machine does not accept it: one sentence.
    fn queue_drive(&mut self, drive: TimedDrive) -> Result<(), InputError>;
    /// Resets the machine: [`Cpu::reset`].
    fn reset(&mut self, why: ResetCause);
    /// Returns true if no device with a state of its own is attached.
    fn has_no_devices(&self) -> bool;
    /// Calls [`Cpu::save`]: saves the chip without devices.
    fn save(&self) -> Vec<u8>;
    /// Calls [`Cpu::restore`]: restores the chip without devices; breakpoints stay.
    ///
    /// # Errors
    /// The bytes are not a state of this chip, which then does not change.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotDamaged>;
    /// Sets breakpoints at these program words and removes all others.
    fn set_breakpoints(&mut self, words: &BTreeSet<u32>);
    /// Calls [`Cpu::run`]; `probe` observes as closely as `level` requires.
    fn run(&mut self, until: u64, level: ObserveLevel, probe: &mut dyn DynProbe) -> StopReason;
    /// Executes one step: [`Cpu::step`].
    fn step(&mut self, level: ObserveLevel, probe: &mut dyn DynProbe) -> StopReason {
        self.step_until(LAST_CYCLE, level, probe)
    }
    /// Executes one step, in which sleep ends at the cycle `until` at the latest: [`Cpu::step_until`].
    fn step_until(&mut self, until: u64, level: ObserveLevel, probe: &mut dyn DynProbe) -> StopReason;
    /// Returns true if the core sleeps: [`Cpu::is_asleep`].
    fn is_asleep(&self) -> bool;
    /// Lets time pass even if nothing can wake the chip: [`Cpu::set_run_while_halted`].
    fn set_run_while_halted(&mut self, on: bool);
    /// Calls [`Cpu::is_blocked_on_input`], with the breakpoints taken into account. Devices at the pins do
    /// nothing by themselves.
    fn is_blocked_on_input(&self) -> bool;
    /// Returns an independent copy.
    fn fork(&self) -> Box<dyn DynMachine>;
    /// Returns the maximum size of a copy in bytes.
    fn size_in_bytes(&self) -> usize;
}

/// A machine with its attached devices as a [`DynMachine`].
#[derive(Debug, Clone)]
pub struct MachineWithDevices<C> {
    cpu: C,
    devices: AttachedDevices,
    breakpoints: BTreeSet<u32>,
}

impl<C: Cpu> MachineWithDevices<C> {
    /// Returns the machine after power-up; the devices of `board` are already connected to it.
    pub fn new(cpu: C, board: AttachedDevices) -> MachineWithDevices<C> {
        MachineWithDevices { cpu, devices: board, breakpoints: BTreeSet::new() }
    }

    fn run_with<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason {
        self.devices.run(&mut self.cpu, until, probe)
    }

    fn step_with<P: Probe>(&mut self, until: u64, probe: &mut P) -> StopReason {
        if self.devices.devices().next().is_none() {
            return self.cpu.step_until(until, probe);
        }
        // The devices run to a given cycle; a copy determines where the step ends.
        let mut copy = self.cpu.clone();
        match copy.step_until(until, &mut ()) {
            StopReason::Limit => self.devices.run(&mut self.cpu, copy.cycle(), probe),
            _ => self.cpu.step_until(until, probe),
        }
    }
}

impl<C: Cpu + 'static> DynMachine for MachineWithDevices<C> {
    fn chip(&self) -> &'static Chip {
        self.cpu.chip()
    }
    fn clocks_per_cycle(&self) -> u32 {
        self.cpu.clocks_per_cycle()
    }
    fn cycle(&self) -> u64 {
        self.cpu.cycle()
    }
    fn instructions(&self) -> u64 {
        self.cpu.instructions()
    }
    fn pc(&self) -> u32 {
        self.cpu.pc()
    }
    fn reg(&self, name: &str) -> Option<u32> {
        self.cpu.reg(name)
    }
    fn set_reg(&mut self, name: &str, value: u32) -> bool {
        self.cpu.set_reg(name, value)
    }
    fn peek(&self, space: &str, addr: u32) -> Option<u8> {
        self.cpu.peek(space, addr)
    }
    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool {
        self.cpu.poke(space, addr, value)
    }
    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool {
        self.cpu.poke_bit(space, addr, bit, value)
    }
    fn has_pin(&self, pin: PinId) -> bool {
        self.cpu.has_pin(pin)
    }
    fn pin_level(&self, pin: PinId) -> PinLevel {
        self.cpu.pin_level(pin)
    }
    fn canonical_ram_address(&self, addr: u32) -> Option<u32> {
        self.cpu.canonical_ram_address(addr)
    }
    fn return_stack(&self) -> Vec<u32> {
        self.cpu.return_stack()
    }
    fn interrupt_flags(&self) -> Vec<&'static str> {
        self.cpu.interrupt_flags()
    }
    fn stack_depth(&self) -> u32 {
        self.cpu.stack_depth()
    }
    fn queue_drive(&mut self, drive: TimedDrive) -> Result<(), InputError> {
        queue_drives(&mut self.cpu, &[drive])
    }
    fn reset(&mut self, why: ResetCause) {
        self.cpu.reset(why);
    }
    fn has_no_devices(&self) -> bool {
        self.devices.devices().next().is_none()
    }
    fn save(&self) -> Vec<u8> {
        self.cpu.save()
    }
    fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotDamaged> {
        self.cpu.restore(bytes)
    }

    fn set_breakpoints(&mut self, words: &BTreeSet<u32>) {
        for &word in self.breakpoints.difference(words) {
            self.cpu.set_breakpoint(word, false);
        }
        for &word in words.difference(&self.breakpoints) {
            self.cpu.set_breakpoint(word, true);
        }
        self.breakpoints.clone_from(words);
    }

    fn run(&mut self, until: u64, level: ObserveLevel, probe: &mut dyn DynProbe) -> StopReason {
        match level {
            ObserveLevel::Nothing => self.run_with(until, &mut ()),
            ObserveLevel::Events => self.run_with(until, &mut dyn_probe::probe_events(probe)),
            ObserveLevel::Writes => self.run_with(until, &mut dyn_probe::probe_writes(probe)),
            ObserveLevel::Instructions => self.run_with(until, &mut dyn_probe::probe_instructions(probe)),
            ObserveLevel::All => self.run_with(until, &mut dyn_probe::probe_everything(probe)),
        }
    }

    fn step_until(&mut self, until: u64, level: ObserveLevel, probe: &mut dyn DynProbe) -> StopReason {
        match level {
            ObserveLevel::Nothing => self.step_with(until, &mut ()),
            ObserveLevel::Events => self.step_with(until, &mut dyn_probe::probe_events(probe)),
            ObserveLevel::Writes => self.step_with(until, &mut dyn_probe::probe_writes(probe)),
            ObserveLevel::Instructions => self.step_with(until, &mut dyn_probe::probe_instructions(probe)),
            ObserveLevel::All => self.step_with(until, &mut dyn_probe::probe_everything(probe)),
        }
    }

    fn is_asleep(&self) -> bool {
        self.cpu.is_asleep()
    }

    fn set_run_while_halted(&mut self, on: bool) {
        self.cpu.set_run_while_halted(on);
    }

    fn is_blocked_on_input(&self) -> bool {
        self.cpu.clone().is_blocked_on_input()
    }

    fn fork(&self) -> Box<dyn DynMachine> {
        Box::new(self.clone())
    }

    fn size_in_bytes(&self) -> usize {
        let chip = self.cpu.chip();
        let data = chip.spaces.iter().filter(|space| space.name != chip.code_space);
        let bytes: usize = data.map(|space| space.size as usize * space.width as usize).sum();
        std::mem::size_of::<C>() + bytes
    }
}
