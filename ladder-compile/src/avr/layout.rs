//! Where everything lives: bits in registers while there are any, words in RAM.
//!
//! ```text
//! r0, r1       product of MUL; r1 is zero otherwise
//! r2 .. r15    bits: first the image of each input port and of each output port, a bit at its pin's place,
//!              then relays, edge memories and temporaries, eight to a register
//! r18, r19     scratch; also the remainder, and the product
//! r20, r21     scratch of the division
//! r23:r22      right operand
//! r25:r24      left operand and result
//! Y            start of RAM, for ever: the first 64 bytes are reached in one word
//! RAM          words (low byte first), then bits that found no register, then the fraction of the timer; stack at the end
//! ```

use emu_core::chip::Chip;

use crate::ir::{Bit, BitRole, Ir, Word};
use crate::pins::Pin;

/// First and last register that hold bits.
const BIT_REGS: std::ops::RangeInclusive<u8> = 2..=15;

/// Bytes kept free for the stack: one return address.
const STACK: u32 = 2;

/// Where a byte of bits is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Home {
    /// In a register, which is also the data address of that number.
    Reg(u8),
    /// In RAM, at a data address.
    Ram(u16),
}

/// A port of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Port {
    /// Its letter.
    pub letter: char,
    /// Register that holds the latched inputs, where there are inputs.
    pub input: Option<u8>,
    /// Register that is written to the port: outputs, and the pull-ups of the inputs, which stay 1.
    pub output: Option<u8>,
    /// Bits that are inputs.
    pub inputs: u8,
    /// Bits that are outputs.
    pub outputs: u8,
}

/// Places of all cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Ports in use, by letter.
    pub ports: Vec<Port>,
    /// Home and bit number, by [`Bit`].
    pub bits: Vec<(Home, u8)>,
    /// Data addresses of the low bytes, by [`Word`].
    pub words: Vec<u16>,
    /// Data address of the timer's fraction.
    pub fraction: u16,
    /// Registers that hold bits and are no port images.
    pub flags: Vec<u8>,
    /// First data address of RAM.
    pub ram_start: u16,
    /// Bytes of RAM in use.
    pub ram_bytes: u16,
}

impl Layout {
    /// Home of a bit.
    #[must_use]
    pub fn bit(&self, bit: Bit) -> (Home, u8) {
        self.bits.get(bit.0 as usize).copied().unwrap_or((Home::Reg(*BIT_REGS.end()), 0))
    }

    /// Data address of a word.
    #[must_use]
    pub fn word(&self, word: Word) -> u16 {
        self.words.get(word.0 as usize).copied().unwrap_or(self.ram_start)
    }
}

/// Gives every cell a place; `fraction` is the number of bytes that the timer's fraction needs.
///
/// # Errors
/// The bytes of RAM needed, when the chip has fewer.
pub fn layout(ir: &Ir, pins: &[Pin], chip: &Chip, fraction: u16) -> Result<Layout, u64> {
    let mut free = BIT_REGS;
    let mut ports: Vec<Port> = Vec::new();
    for pin in pins {
        let port = match ports.iter_mut().find(|p| p.letter == pin.port()) {
            Some(port) => port,
            None => {
                ports.push(Port { letter: pin.port(), input: None, output: None, inputs: 0, outputs: 0 });
                let Some(port) = ports.last_mut() else { continue };
                port
            }
        };
        *if pin.output { &mut port.outputs } else { &mut port.inputs } |= 1 << pin.bit();
    }
    ports.sort_by_key(|p| p.letter);
    for port in &mut ports {
        port.input = if port.inputs != 0 { free.next() } else { None };
        port.output = if port.outputs != 0 { free.next() } else { None };
    }

    let words = ir.words.len() as u64 * 2;
    let mut bits = Vec::with_capacity(ir.bits.len());
    let (mut flags, mut current, mut used, mut spilled) = (Vec::new(), None, 8, 0u64);
    for cell in &ir.bits {
        let image = pins.iter().find(|p| p.name == cell.name).and_then(|pin| {
            let port = ports.iter().find(|p| p.letter == pin.port())?;
            Some((if pin.output { port.output? } else { port.input? }, pin.bit()))
        });
        if let (BitRole::Input | BitRole::Output, Some((reg, bit))) = (cell.role, image) {
            bits.push((Home::Reg(reg), bit));
            continue;
        }
        if used == 8 {
            used = 0;
            current = Some(match free.next() {
                Some(reg) => {
                    flags.push(reg);
                    Home::Reg(reg)
                }
                None => {
                    spilled += 1;
                    Home::Ram((u64::from(chip.ram_start) + words + spilled - 1) as u16)
                }
            });
        }
        bits.push((current.unwrap_or(Home::Ram(chip.ram_start)), used));
        used += 1;
    }
    let needed = words + spilled + u64::from(fraction);
    if needed + u64::from(STACK) > u64::from(chip.ram_len) {
        return Err(needed + u64::from(STACK));
    }
    Ok(Layout {
        ports,
        bits,
        words: (0..ir.words.len() as u16).map(|n| chip.ram_start + 2 * n).collect(),
        fraction: chip.ram_start + (words + spilled) as u16,
        flags,
        ram_start: chip.ram_start,
        ram_bytes: needed as u16,
    })
}
