//! A machine for testing one instruction at a time.

use emu_8051::Mcs51;
use emu_8051::chips::chip;
use emu_core::image::Image;
use emu_core::{Cpu, RamInit, StopReason};

pub const ACC: u32 = 0xE0;
pub const B: u32 = 0xF0;
pub const PSW: u32 = 0xD0;

/// An 8052 with one instruction at [`Rig::PC`].
pub struct TestBench {
    pub cpu: Mcs51,
    pub len: u32,
}

impl TestBench {
    pub const PC: u32 = 0x1234;

    pub fn new(line: &str) -> TestBench {
        let chip = chip("8052").expect("a chip of this crate");
        let mut bench = TestBench { cpu: Mcs51::new(chip, &Image::default(), RamInit::Random(0x51)), len: 0 };
        bench.put_line(line);
        bench
    }

    pub fn put_line(&mut self, line: &str) {
        let bytes = emu_asm::assemble_line(self.cpu.chip(), line, Self::PC).unwrap_or_else(|e| panic!("{line}: {e}"));
        for (addr, &byte) in (Self::PC..).zip(&bytes) {
            assert!(self.cpu.poke("code", addr, byte as u8));
        }
        self.len = bytes.len() as u32;
    }

    pub fn put(&mut self, space: &str, addr: u32, value: u8) {
        assert!(self.cpu.poke(space, addr, value), "{space}:{addr:02x}");
    }

    pub fn get(&self, space: &str, addr: u32) -> u8 {
        self.cpu.peek(space, addr).unwrap_or_else(|| panic!("{space}:{addr:02x}"))
    }

    /// Executes the instruction and returns the cycles that it took.
    pub fn go(&mut self) -> u64 {
        self.cpu.set_pc(Self::PC);
        let before = self.cpu.cycle();
        assert_eq!(self.cpu.step(&mut ()), StopReason::Limit);
        self.cpu.cycle() - before
    }

    /// Address of the next instruction.
    pub fn next(&self) -> u32 {
        Self::PC + self.len
    }
}

/// The parity of a byte: 1 for an odd number of ones.
pub fn parity(byte: i32) -> i32 {
    (0..8).map(|bit| byte >> bit & 1).sum::<i32>() % 2
}
