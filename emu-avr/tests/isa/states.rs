//! Random states for one instruction of a given row, biased to edge values.
//!
//! Addresses are limited to those where only the core answers: registers, SP, SREG, RAM, the three GPIOR, and
//! a few registers that only store what is written. Program counters are far enough from the ends of flash
//! that no relative target wraps, except in [`at_the_ends`].

use emu_avr::Avr;
use emu_avr::chips::{ATMEGA328P, chip};
use emu_avr::isa::{AvrOpKind, find_row, is_missing};
use emu_core::image::{Image, Segment};
use emu_core::rng::Rng;
use emu_core::table::InstructionRow;
use emu_core::{Cpu, RamInit};

/// A state before one instruction. RAM and flash not listed here hold [`background`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Draw {
    /// The instruction, then the next one.
    pub words: [u16; 4],
    /// Word address of the instruction; 0 until it is placed.
    pub pc: u16,
    pub sp: u16,
    pub sreg: u8,
    pub regs: [u8; 32],
    /// Data memory from 0x20 up: address and value; the address 0xFFFF means no entry.
    pub cells: [(u16, u8); 4],
}

/// Returns the default content of a memory cell: the low 8 bits of a mix of the address.
pub const fn background(addr: u32) -> u8 {
    (addr * 167 + (addr >> 8) * 31 + 13) as u8
}

const NO_CELL: (u16, u8) = (0xFFFF, 0);
/// GPIOR0 to 2.
const GPIOR: [u16; 3] = [0x3E, 0x4A, 0x4B];
/// GPIOR0 to 2, EEDR, TWBR and TWAR, which store all bits.
const PLAIN: [u16; 6] = [0x3E, 0x4A, 0x4B, 0x40, 0xB8, 0xBA];
/// Words of flash.
const WORDS: u16 = 0x4000;

fn pick<T: Copy>(rng: &mut Rng, from: &[T]) -> T {
    from[rng.below(from.len() as u64) as usize]
}

/// Returns a byte: an edge value in half of the cases, otherwise any value.
pub fn byte(rng: &mut Rng) -> u8 {
    if rng.one_in(2) {
        pick(rng, &[0, 1, 2, 0x0F, 0x10, 0x7E, 0x7F, 0x80, 0x81, 0xF0, 0xFE, 0xFF])
    } else {
        rng.next_u64() as u8
    }
}

/// Returns a data address at which only the core answers.
fn address(rng: &mut Rng) -> u16 {
    match rng.below(8) {
        0 => rng.below(32) as u16,
        1 => pick(rng, &PLAIN),
        2 => pick(rng, &[0x5D, 0x5E, 0x5F]),
        3 => pick(rng, &[0x100, 0x101, 0x1FF, 0x200, 0x8FE, 0x8FF]),
        _ => 0x100 + rng.below(0x800) as u16,
    }
}

fn set_pair(regs: &mut [u8; 32], low: usize, value: u16) {
    [regs[low], regs[low + 1]] = value.to_le_bytes();
}

/// Limits the operand bits to keep an instruction away from peripherals and within flash; the other bits are
/// free.
fn operands(kind: AvrOpKind, bits: u32, rng: &mut Rng) -> u32 {
    match kind {
        // aa at bits 10..9, aaaa at bits 3..0.
        AvrOpKind::In | AvrOpKind::Out => {
            let a = pick(rng, &[0x1Eu32, 0x2A, 0x2B, 0x3D, 0x3E, 0x3F]);
            bits & !0x060F | a & 15 | (a >> 4) << 9
        }
        AvrOpKind::Sbi | AvrOpKind::Cbi | AvrOpKind::Sbic | AvrOpKind::Sbis => bits & !0x00F8 | 0x1E << 3,
        AvrOpKind::Lds | AvrOpKind::Sts => bits & 0xFFFF_0000 | u32::from(address(rng)),
        AvrOpKind::Jmp | AvrOpKind::Call => bits & !0x01F1_C000,
        _ => bits,
    }
}

/// Returns the displacement of LDD and STD: q at bits 13, 11..10 and 2..0.
const fn displacement(word: u32) -> u16 {
    ((word & 0x2000) >> 8 | (word & 0x0C00) >> 7 | (word & 7)) as u16
}

/// Returns a random state for `row`.
pub fn draw(row: &InstructionRow, kind: AvrOpKind, rng: &mut Rng) -> Draw {
    let words = instruction(row, kind, rng);
    state(row, kind, words, rng)
}

/// Returns an instruction of `row`, and the next one.
fn instruction(row: &InstructionRow, kind: AvrOpKind, rng: &mut Rng) -> [u16; 4] {
    let bits = loop {
        let bits = operands(kind, row.pattern.value | rng.next_u64() as u32 & !row.pattern.mask & width(row), rng);
        let (first, second) = split(row, bits);
        if find_row(first, second).is_some_and(|found| found.row.name == row.name) {
            break bits;
        }
    };
    let (first, second) = split(row, bits);
    let next = pick(
        rng,
        &[
            [0x0000, 0],
            [0x2C01, 0],
            [0xCFFF, 0],
            [0x9000, 0x0300],
            [0x9200, 0x0300],
            [0x940C, 0x1234],
            [0x940E, 0x1234],
        ],
    );
    if row.len() == 2 { [first, second, next[0], next[1]] } else { [first, next[0], next[1], 0] }
}

/// Returns a state before the instruction `words`.
fn state(row: &InstructionRow, kind: AvrOpKind, words: [u16; 4], rng: &mut Rng) -> Draw {
    let bits = if row.len() == 2 { u32::from(words[0]) << 16 | u32::from(words[1]) } else { u32::from(words[0]) };
    let mut regs = [0; 32];
    regs.iter_mut().for_each(|r| *r = byte(rng));
    if rng.one_in(4) {
        let (a, b) = (rng.below(32) as usize, rng.below(32) as usize);
        regs[a] = regs[b];
    }
    let mut cells = [NO_CELL; 4];
    let sp = if rng.one_in(4) { pick(rng, &[0x103, 0x1FF, 0x200, 0x8FC]) } else { 0x104 + rng.below(0x7F0) as u16 };
    let target = pointer(kind, bits, &mut regs, rng);
    cells[0] = target.filter(|&a| a >= 0x100 || PLAIN.contains(&a)).map_or(NO_CELL, |a| (a, byte(rng)));
    match kind {
        AvrOpKind::In | AvrOpKind::Out | AvrOpKind::Sbi | AvrOpKind::Cbi | AvrOpKind::Sbic | AvrOpKind::Sbis => {
            for (cell, addr) in cells.iter_mut().zip(GPIOR) {
                *cell = (addr, byte(rng));
            }
        }
        // A return address within flash: the high byte is at the lower address.
        AvrOpKind::Ret | AvrOpKind::Reti => (cells[0], cells[1]) = ((sp + 1, byte(rng) & 0x3F), (sp + 2, byte(rng))),
        AvrOpKind::Pop => cells[0] = (sp + 1, byte(rng)),
        _ => {}
    }
    Draw { words, pc: 0, sp, sreg: rng.next_u64() as u8, regs, cells }
}

/// Points the pointer register that `kind` uses to a safe address; returns it if it is in data memory.
fn pointer(kind: AvrOpKind, bits: u32, regs: &mut [u8; 32], rng: &mut Rng) -> Option<u16> {
    let (low, before) = match kind {
        AvrOpKind::LdX | AvrOpKind::LdXi | AvrOpKind::StX | AvrOpKind::StXi => (26, 0),
        AvrOpKind::LdXd | AvrOpKind::StXd => (26, 1),
        AvrOpKind::LdY | AvrOpKind::LdYi | AvrOpKind::StY | AvrOpKind::StYi => (28, 0),
        AvrOpKind::LdYd | AvrOpKind::StYd => (28, 1),
        AvrOpKind::LdZ | AvrOpKind::LdZi | AvrOpKind::StZ | AvrOpKind::StZi => (30, 0),
        AvrOpKind::LdZd | AvrOpKind::StZd => (30, 1),
        AvrOpKind::LddY | AvrOpKind::StdY => {
            let addr = 0x100 + displacement(bits) + rng.below(0x7C0) as u16;
            set_pair(regs, 28, addr - displacement(bits));
            return Some(addr);
        }
        AvrOpKind::LddZ | AvrOpKind::StdZ => {
            let addr = 0x100 + displacement(bits) + rng.below(0x7C0) as u16;
            set_pair(regs, 30, addr - displacement(bits));
            return Some(addr);
        }
        AvrOpKind::Lds | AvrOpKind::Sts => return Some(bits as u16),
        AvrOpKind::Ijmp | AvrOpKind::Icall => {
            set_pair(regs, 30, rng.below(0x3FFF) as u16);
            return None;
        }
        AvrOpKind::Lpm | AvrOpKind::LpmZ | AvrOpKind::LpmZi => {
            set_pair(regs, 30, rng.below(0x7FFF) as u16);
            return None;
        }
        _ => return None,
    };
    let addr = address(rng);
    set_pair(regs, low, addr + before);
    Some(addr)
}

const fn width(row: &InstructionRow) -> u32 {
    if row.len() == 2 { u32::MAX } else { 0xFFFF }
}

/// Splits the bits of an instruction into words.
pub fn split(row: &InstructionRow, bits: u32) -> (u16, u16) {
    if row.len() == 2 { ((bits >> 16) as u16, bits as u16) } else { (bits as u16, 0) }
}

/// Returns `count` states for `row`, and a flash image that contains all their instructions.
pub fn batch(row: &InstructionRow, kind: AvrOpKind, count: usize, rng: &mut Rng) -> (Vec<u8>, Vec<Draw>) {
    let mut flash: Vec<u8> = (0..0x8000).map(background).collect();
    let first = 0x0820 + rng.below(0x3000 - 4 * count as u64) as u16;
    let place = |i: usize| {
        let d = Draw { pc: first + 4 * i as u16, ..draw(row, kind, rng) };
        let bytes = d.words.iter().flat_map(|w| w.to_le_bytes());
        let at = usize::from(d.pc) * 2;
        flash[at..at + 8].iter_mut().zip(bytes).for_each(|(cell, byte)| *cell = byte);
        d
    };
    let draws = (0..count).map(place).collect();
    (flash, draws)
}

/// Returns `count` states for one instruction placed at the ends of flash: the instruction, the next one, or
/// the target of a skip crosses the end of flash, or the instruction is the first one.
pub fn at_the_ends(row: &InstructionRow, kind: AvrOpKind, count: usize, rng: &mut Rng) -> (Vec<u8>, Vec<Draw>) {
    let mut flash: Vec<u8> = (0..0x8000).map(background).collect();
    let words = instruction(row, kind, rng);
    let pc = pick(rng, &[WORDS - 4, WORDS - 3, WORDS - 2, WORDS - 1, 0]);
    for (n, word) in (0..).zip(words) {
        let at = usize::from((pc + n) % WORDS) * 2;
        [flash[at], flash[at + 1]] = word.to_le_bytes();
    }
    (flash, (0..count).map(|_| Draw { pc, ..state(row, kind, words, rng) }).collect())
}

/// Returns a chip that has the instruction, with this flash and the background in RAM.
pub fn machine(kind: AvrOpKind, flash: Vec<u8>) -> Avr {
    let larger = chip("atmega128").expect("a chip");
    let chip = if is_missing(ATMEGA328P.flash_bytes, kind) { larger } else { &ATMEGA328P };
    let image = Image { segments: vec![Segment { space: "flash", addr: 0, bytes: flash }], ..Image::default() };
    let mut avr = Avr::new(chip, &image, RamInit::Zero);
    for addr in 0x100..0x900 {
        assert!(avr.poke("data", addr, background(addr)));
    }
    avr
}

/// Returns a copy of `base`, which holds the instruction already, in the state `d`.
pub fn put(base: &Avr, d: &Draw) -> Avr {
    let mut avr = base.clone();
    for (r, &value) in d.regs.iter().enumerate() {
        assert!(avr.poke("data", r as u32, value));
    }
    for &(addr, value) in d.cells.iter().filter(|(a, _)| *a != NO_CELL.0) {
        assert!(avr.poke("data", u32::from(addr), value));
    }
    avr.set_reg("SREG", u32::from(d.sreg));
    avr.set_reg("SP", u32::from(d.sp));
    avr.set_pc(u32::from(d.pc));
    avr
}
