//! A machine that executes one instruction at a time.

use emu_core::image::{Image, Segment};
use emu_core::{Cpu, RamInit, StopReason};
use emu_pic16::chips::chip;
use emu_pic16::{Options, Pic16};

/// Configuration word 2007h: RC oscillator; no watchdog, brown-out reset, power-up timer or low-voltage
/// programming (DS30292, register 12-1; the bits that are off have the same positions on the other chips).
pub const QUIET: u16 = 0x3F3B;

/// Addresses of data memory, equal in all banks (DS33023, section 6.3.2.1).
pub const INDF: u16 = 0x00;
pub const PCL: u16 = 0x02;
pub const STATUS: u16 = 0x03;
pub const FSR: u16 = 0x04;
pub const PCLATH: u16 = 0x0A;

/// Returns a chip whose program starts at cycle 0, with random bytes in RAM and erased program memory.
pub fn machine(name: &str, seed: u64) -> Pic16 {
    machine_with(name, seed, &[])
}

/// Returns a chip as [`machine`] does, with words from address 0 on.
pub fn machine_with(name: &str, seed: u64, words: &[u16]) -> Pic16 {
    let chip = chip(name).unwrap_or_else(|| panic!("no chip {name}"));
    let options = Options { config: Some(QUIET), start_up: false, ..Options::default() };
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let segments = if bytes.is_empty() { vec![] } else { vec![Segment { space: "flash", addr: 0, bytes }] };
    Pic16::with(chip, &Image { segments, ..Image::default() }, RamInit::Random(seed), options)
}

/// Writes a word to program memory.
pub fn put_word(cpu: &mut Pic16, addr: u32, word: u16) {
    for (n, byte) in (0..).zip(word.to_le_bytes()) {
        assert!(cpu.poke("flash", 2 * addr + n, byte), "flash {addr:04x}");
    }
}

/// Assembles a line; numbers are decimal unless marked otherwise.
pub fn word(line: &str) -> u16 {
    let chip = &emu_pic16::chips::PIC16F873.chip;
    let image = emu_asm::assemble_text(chip, &format!(" radix dec\n {line}")).unwrap_or_else(|e| panic!("{line}: {e}"));
    let bytes = &image.segments[0].bytes;
    u16::from_le_bytes([bytes[0], bytes[1]])
}

/// A 16F877 with one instruction at [`Rig::PC`].
pub struct TestBench {
    pub cpu: Pic16,
}

impl TestBench {
    pub const PC: u32 = 0x0234;

    pub fn new(line: &str) -> TestBench {
        TestBench::on("pic16f877", line)
    }

    pub fn on(chip: &str, line: &str) -> TestBench {
        let mut cpu = machine(chip, 0x16);
        put_word(&mut cpu, Self::PC, word(line));
        TestBench { cpu }
    }

    pub fn put(&mut self, addr: u16, value: u8) {
        assert!(self.cpu.poke("data", addr.into(), value), "{addr:03x}");
    }

    pub fn get(&self, addr: u16) -> u8 {
        self.cpu.peek("data", addr.into()).unwrap_or_else(|| panic!("{addr:03x}"))
    }

    pub fn set_w(&mut self, value: u8) {
        assert!(self.cpu.set_reg("W", value.into()));
    }

    pub fn w(&self) -> u8 {
        self.cpu.reg("W").expect("a register") as u8
    }

    /// Executes the instruction; returns the cycles it took.
    pub fn go(&mut self) -> u64 {
        self.go_from(Self::PC)
    }

    /// Executes the instruction at `pc`; returns the cycles it took.
    pub fn go_from(&mut self, pc: u32) -> u64 {
        self.cpu.set_pc(pc);
        let (before, counted) = (self.cpu.cycle(), self.cpu.instructions());
        assert_eq!(self.cpu.step(&mut ()), StopReason::Limit, "at {pc:04x}");
        assert_eq!(self.cpu.instructions(), counted + 1, "at {pc:04x}");
        self.cpu.cycle() - before
    }
}
