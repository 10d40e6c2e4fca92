//! Any machine without its type.

use std::collections::BTreeSet;

use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, END_OF_TIME, Probe, Reset, Stop};
use emu_core::pins::{Level, PinId};
use emu_core::state::Damaged;

use crate::board::Board;
use crate::seer;
pub use crate::seer::{Look, Seer};
use crate::stimulus::{Drive, queue};

/// A chip and the devices at its pins, whatever the family.
pub trait Target {
    /// The chip's row of data.
    fn chip(&self) -> &'static Chip;
    /// Oscillator clocks per machine cycle.
    fn clocks_per_cycle(&self) -> u32;
    /// Machine cycles since power-up.
    fn cycle(&self) -> u64;
    /// Instructions executed since power-up.
    fn instructions(&self) -> u64;
    /// Program counter in program words.
    fn pc(&self) -> u32;
    /// [`Cpu::reg`].
    fn reg(&self, name: &str) -> Option<u32>;
    /// [`Cpu::set_reg`].
    fn set_reg(&mut self, name: &str, value: u32) -> bool;
    /// [`Cpu::peek`].
    fn peek(&self, space: &str, addr: u32) -> Option<u8>;
    /// [`Cpu::poke`].
    fn poke(&mut self, space: &str, addr: u32, value: u8) -> bool;
    /// [`Cpu::poke_bit`].
    fn poke_bit(&mut self, space: &str, addr: u32, bit: u8, value: bool) -> bool;
    /// [`Cpu::has_pin`].
    fn has_pin(&self, pin: PinId) -> bool;
    /// [`Cpu::level`].
    fn level(&self, pin: PinId) -> Level;
    /// [`Cpu::ram_at`].
    fn ram_at(&self, addr: u32) -> Option<u32>;
    /// Return addresses of a stack that lies in no memory ([`Cpu::return_stack`]).
    fn return_stack(&self) -> Vec<u32>;
    /// [`Cpu::depth`].
    fn depth(&self) -> u32;
    /// [`Cpu::interrupt_flags`].
    fn interrupt_flags(&self) -> Vec<&'static str>;
    /// Does something from outside.
    ///
    /// # Errors
    /// The machine cannot: one sentence.
    fn put(&mut self, drive: Drive) -> Result<(), String>;
    /// [`Cpu::reset`].
    fn reset(&mut self, why: Reset);
    /// Nothing stands at its pins that has a state of its own.
    fn is_bare(&self) -> bool;
    /// [`Cpu::save`]: the chip alone.
    fn save(&self) -> Vec<u8>;
    /// [`Cpu::restore`]: the chip alone; breakpoints stay.
    ///
    /// # Errors
    /// The bytes are no state of such a chip, which is as it was then.
    fn restore(&mut self, bytes: &[u8]) -> Result<(), Damaged>;
    /// Sets breakpoints at these program words and at no others.
    fn set_traps(&mut self, words: &BTreeSet<u32>);
    /// [`Cpu::run`], looked at by `seer` as closely as `look` says.
    fn run(&mut self, until: u64, look: Look, seer: &mut dyn Seer) -> Stop;
    /// [`Cpu::step`].
    fn step(&mut self, look: Look, seer: &mut dyn Seer) -> Stop {
        self.step_until(END_OF_TIME, look, seer)
    }
    /// [`Cpu::step_until`].
    fn step_until(&mut self, until: u64, look: Look, seer: &mut dyn Seer) -> Stop;
    /// [`Cpu::sleeps`].
    fn sleeps(&self) -> bool;
    /// [`Cpu::insist`].
    fn insist(&mut self, on: bool);
    /// [`Cpu::waits_for_ever`], breakpoints considered. Devices at its pins do nothing by themselves.
    fn waits_for_ever(&self) -> bool;
    /// A copy that goes its own way.
    fn fork(&self) -> Box<dyn Target>;
    /// Bytes that a copy takes at most.
    fn weight(&self) -> usize;
}

/// A machine with its board as a [`Target`].
#[derive(Debug, Clone)]
pub struct Rig<C> {
    cpu: C,
    board: Board,
    traps: BTreeSet<u32>,
}

impl<C: Cpu> Rig<C> {
    /// The machine after power-up, and the board to whose devices it is connected already.
    pub fn new(cpu: C, board: Board) -> Rig<C> {
        Rig { cpu, board, traps: BTreeSet::new() }
    }

    fn run_with<P: Probe>(&mut self, until: u64, probe: &mut P) -> Stop {
        self.board.run(&mut self.cpu, until, probe)
    }

    fn step_with<P: Probe>(&mut self, until: u64, probe: &mut P) -> Stop {
        if self.board.devices().next().is_none() {
            return self.cpu.step_until(until, probe);
        }
        // The board runs to a cycle; a copy knows how far a step goes.
        let mut copy = self.cpu.clone();
        match copy.step_until(until, &mut ()) {
            Stop::Limit => self.board.run(&mut self.cpu, copy.cycle(), probe),
            _ => self.cpu.step_until(until, probe),
        }
    }
}

impl<C: Cpu + 'static> Target for Rig<C> {
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
    fn level(&self, pin: PinId) -> Level {
        self.cpu.level(pin)
    }
    fn ram_at(&self, addr: u32) -> Option<u32> {
        self.cpu.ram_at(addr)
    }
    fn return_stack(&self) -> Vec<u32> {
        self.cpu.return_stack()
    }
    fn interrupt_flags(&self) -> Vec<&'static str> {
        self.cpu.interrupt_flags()
    }
    fn depth(&self) -> u32 {
        self.cpu.depth()
    }
    fn put(&mut self, drive: Drive) -> Result<(), String> {
        queue(&mut self.cpu, &[drive])
    }
    fn reset(&mut self, why: Reset) {
        self.cpu.reset(why);
    }
    fn is_bare(&self) -> bool {
        self.board.devices().next().is_none()
    }
    fn save(&self) -> Vec<u8> {
        self.cpu.save()
    }
    fn restore(&mut self, bytes: &[u8]) -> Result<(), Damaged> {
        self.cpu.restore(bytes)
    }

    fn set_traps(&mut self, words: &BTreeSet<u32>) {
        for &word in self.traps.difference(words) {
            self.cpu.trap(word, false);
        }
        for &word in words.difference(&self.traps) {
            self.cpu.trap(word, true);
        }
        self.traps.clone_from(words);
    }

    fn run(&mut self, until: u64, look: Look, seer: &mut dyn Seer) -> Stop {
        match look {
            Look::Nothing => self.run_with(until, &mut ()),
            Look::Events => self.run_with(until, &mut seer::events(seer)),
            Look::Writes => self.run_with(until, &mut seer::writes(seer)),
            Look::Insns => self.run_with(until, &mut seer::insns(seer)),
            Look::All => self.run_with(until, &mut seer::all(seer)),
        }
    }

    fn step_until(&mut self, until: u64, look: Look, seer: &mut dyn Seer) -> Stop {
        match look {
            Look::Nothing => self.step_with(until, &mut ()),
            Look::Events => self.step_with(until, &mut seer::events(seer)),
            Look::Writes => self.step_with(until, &mut seer::writes(seer)),
            Look::Insns => self.step_with(until, &mut seer::insns(seer)),
            Look::All => self.step_with(until, &mut seer::all(seer)),
        }
    }

    fn sleeps(&self) -> bool {
        self.cpu.sleeps()
    }

    fn insist(&mut self, on: bool) {
        self.cpu.insist(on);
    }

    fn waits_for_ever(&self) -> bool {
        self.cpu.clone().waits_for_ever()
    }

    fn fork(&self) -> Box<dyn Target> {
        Box::new(self.clone())
    }

    fn weight(&self) -> usize {
        let chip = self.cpu.chip();
        let data = chip.spaces.iter().filter(|(name, ..)| *name != chip.code);
        let bytes: usize = data.map(|(_, size, width)| *size as usize * *width as usize).sum();
        std::mem::size_of::<C>() + bytes
    }
}
