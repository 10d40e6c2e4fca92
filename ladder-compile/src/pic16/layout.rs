//! Assigns places in RAM to all cells.
//!
//! ```text
//! FSR<0>       the accumulator, where it must be kept: every bank reaches FSR
//! 70h..7Fh     (where the chip has RAM there that every bank reaches) images of the ports, then bits, then
//!              scratch, then words
//! bank 0       words; on a chip without common RAM first the images, bits and scratch
//! bank 1..3    more words
//! ```

use emu_pic16::chips::{FileSlot, NO_PIN};
use emu_pic16::periph::map::Sfr;

use super::chip_data::{ANY_BANK, Pic16ChipData};
use crate::ir::{BitId, BitRole, Ir, WordId};
use crate::pins::AssignedPin;

/// Use of one port by the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pic16PortUse {
    /// Letter of the port.
    pub letter: char,
    /// Address of PORTx.
    pub port: u16,
    /// Address of TRISx.
    pub tris: u16,
    /// Byte that holds the latched inputs.
    pub input: u16,
    /// Byte that is written to the port.
    pub output: u16,
    /// Mask of bits that are inputs.
    pub input_bits: u8,
    /// Mask of bits that are outputs.
    pub output_bits: u8,
    /// Mask of bits that exist on the chip.
    pub existing_bits: u8,
    /// Mask of bits with an open-drain output.
    pub open_drain_bits: u8,
}

/// RAM that a program needs besides its cells, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Pic16RamNeeds {
    /// Scratch space.
    pub scratch: u16,
    /// Remainder counter of the pacing timer.
    pub fraction: u8,
    /// Extension of the pacing timer.
    pub extension: u8,
    /// True if a flag bit for a received byte is needed.
    pub received: bool,
}

/// Places of all cells of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16Layout {
    /// Ports in use, by letter.
    pub ports: Vec<Pic16PortUse>,
    /// Address and bit number of each bit, by [`BitId`].
    pub bits: Vec<(u16, u8)>,
    /// Address of the low byte of each word, by [`WordId`].
    pub words: Vec<u16>,
    /// Address of the first byte of scratch.
    pub scratch: u16,
    /// Address of the remainder counter of the pacing timer.
    pub fraction: u16,
    /// Address of the extension of the pacing timer, accessible from bank 0.
    pub extension: u16,
    /// Address and bit number of the flag for a received byte.
    pub byte_received_flag: (u16, u8),
    /// Addresses of all bytes in use.
    pub used: Vec<u16>,
}

impl Pic16Layout {
    /// Address and bit number of a bit.
    #[must_use]
    pub fn bit(&self, bit: BitId) -> (u16, u8) {
        self.bits.get(bit.0 as usize).copied().unwrap_or((0x20, 0))
    }

    /// Address of the low byte of a word.
    #[must_use]
    pub fn word(&self, word: WordId) -> u16 {
        self.words.get(word.0 as usize).copied().unwrap_or(0x20)
    }
}

/// RAM that is still free.
struct Pic16FreeRam {
    /// Free ranges (address, length): first RAM common to all banks, if any, then bank by bank.
    ranges: Vec<(u16, u16)>,
    /// True if the first range is RAM common to all banks.
    common: bool,
    /// Addresses allocated so far.
    used: Vec<u16>,
    /// Number of bytes that did not fit.
    missing: u64,
}

impl Pic16FreeRam {
    fn new(chip: &Pic16ChipData) -> Pic16FreeRam {
        let is_canonical = |addr: u16| chip.part.file_slot(addr) == FileSlot::Ram(addr);
        let mut ranges: Vec<(u16, u16)> = Vec::new();
        let mut common = None;
        for addr in (0..0x200).filter(|&addr| is_canonical(addr)) {
            let every = chip.reachable_banks(addr) == ANY_BANK;
            let list = if every {
                common.get_or_insert((addr, 0))
            } else {
                match ranges.last_mut() {
                    Some(range) if range.0 + range.1 == addr && range.0 >> 7 == addr >> 7 => range,
                    _ => {
                        ranges.push((addr, 0));
                        let Some(range) = ranges.last_mut() else { continue };
                        range
                    }
                }
            };
            list.1 += 1;
        }
        let is_common = common.is_some();
        if let Some(range) = common {
            ranges.insert(0, range);
        }
        Pic16FreeRam { ranges, common: is_common, used: Vec::new(), missing: 0 }
    }

    /// Allocates contiguous bytes from the ranges in order, but uses the first `skip` ranges last.
    fn take(&mut self, bytes: u16, skip: usize) -> u16 {
        let count = self.ranges.len();
        for n in (skip..count).chain(0..skip.min(count)) {
            if let Some(range) = self.ranges.get_mut(n)
                && range.1 >= bytes
            {
                let at = range.0;
                *range = (range.0 + bytes, range.1 - bytes);
                self.used.extend(at..at + bytes);
                return at;
            }
        }
        self.missing += u64::from(bytes);
        0x20
    }
}

/// Assigns a place to every cell.
///
/// # Errors
/// The number of bytes of RAM needed, if the chip has fewer.
pub fn layout(ir: &Ir, pins: &[AssignedPin], chip: &Pic16ChipData, needs: Pic16RamNeeds) -> Result<Pic16Layout, u64> {
    let mut free = Pic16FreeRam::new(chip);
    let mut ports = port_uses(ir, pins, chip);
    for port in &mut ports {
        if port.input_bits != 0 {
            port.input = free.take(1, 0);
        }
        if port.output_bits != 0 {
            port.output = free.take(1, 0);
        }
    }
    // Allocate this before anything large, so that bank 0 has room.
    let extension = if needs.extension > 0 { free.take(needs.extension.into(), 0) } else { 0 };
    let mut bits = Vec::with_capacity(ir.bits.len());
    let mut next = (0, 8);
    let mut one = |free: &mut Pic16FreeRam| {
        if next.1 == 8 {
            next = (free.take(1, 0), 0);
        }
        next.1 += 1;
        (next.0, next.1 - 1)
    };
    for cell in &ir.bits {
        let image = pins.iter().find(|p| p.name == cell.name && !p.analog).and_then(|pin| {
            let port = ports.iter().find(|p| p.letter == pin.port_letter())?;
            Some((if pin.output { port.output } else { port.input }, pin.bit_number()))
        });
        bits.push(match image {
            Some(at) if matches!(cell.role, BitRole::Input | BitRole::Output) => at,
            _ => one(&mut free),
        });
    }
    let received = if needs.received { one(&mut free) } else { (0, 0) };
    let scratch = if needs.scratch > 0 { free.take(needs.scratch, 0) } else { 0 };
    let fraction = if needs.fraction > 0 { free.take(needs.fraction.into(), 0) } else { 0 };
    let skip = usize::from(free.common);
    let words = ir.words.iter().map(|cell| free.take(cell.bytes.into(), skip)).collect();
    if free.missing > 0 {
        return Err(free.used.len() as u64 + free.missing);
    }
    Ok(Pic16Layout { ports, bits, words, scratch, fraction, extension, byte_received_flag: received, used: free.used })
}

fn port_uses(ir: &Ir, pins: &[AssignedPin], chip: &Pic16ChipData) -> Vec<Pic16PortUse> {
    const PORTS: [(char, Sfr); 5] =
        [('A', Sfr::PORTA), ('B', Sfr::PORTB), ('C', Sfr::PORTC), ('D', Sfr::PORTD), ('E', Sfr::PORTE)];
    let mut ports = Vec::new();
    for (letter, sfr) in PORTS {
        let Some(row) = chip.part.ports.iter().find(|row| row.port == sfr) else { continue };
        let of = |output: bool| {
            let here = pins.iter().filter(|p| p.port_letter() == letter && p.output == output && !p.analog);
            here.fold(0, |mask, pin| mask | 1 << pin.bit_number())
        };
        let (inputs, outputs) = (of(false), of(true));
        if inputs | outputs == 0 && ir.port_cells(letter).is_none() {
            continue;
        }
        let bits =
            (0..8).filter(|&n| row.pins.get(n).is_some_and(|&pin| pin != NO_PIN)).fold(0, |mask, n| mask | 1 << n);
        ports.push(Pic16PortUse {
            letter,
            port: chip.reg(sfr),
            tris: chip.reg(row.tris),
            input: 0,
            output: 0,
            input_bits: inputs,
            output_bits: outputs,
            existing_bits: bits,
            open_drain_bits: row.open,
        });
    }
    ports
}
