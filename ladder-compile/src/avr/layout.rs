//! Assigns places to all cells: registers for bits and integers as far as they last, RAM for the rest.
//!
//! ```text
//! r1:r0          zero, except while they hold a product
//! r2 .. r15      the image of each input port and of each output port, a bit at its pin's place; then
//!                relays, edge memories and temporaries, eight to a register; then integers
//! r17:r16        an integer, and so are r21:r20, X, Y and Z where nothing else needs them
//! r18, r19       scratch
//! r23:r22        right operand
//! r25:r24        left operand and result
//! r21:r20, X     upper bytes of wide operands; Z: pointer of tables
//! Y              start of RAM, where RAM is used: one word reaches the first 64 bytes
//! RAM            integers (low byte first), bits, the fraction of the timer; the stack at the end
//! ```

use emu_avr::isa::AvrOpKind;

use super::arch::AvrCodeWriter;
use super::usage::AvrUsage;
use crate::ir::{BitId, BitRole, WordId};
use crate::pins::AssignedPin;
use crate::target::CompileJob;

/// Registers for bits: instructions with a constant operand cannot use them, bit instructions can.
const BIT_REGISTERS: std::ops::RangeInclusive<u8> = 2..=15;

/// Bytes reserved for the stack: one return address.
const STACK_BYTES: u32 = 2;

/// Place of a byte of bits, or of the low byte of an integer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum AvrCellPlace {
    /// A register; its number is also its data address.
    Reg(u8),
    /// A byte of RAM, by its data address.
    Ram(u16),
}

impl AvrCellPlace {
    /// Data address of this place.
    #[must_use]
    pub fn addr(self) -> u16 {
        match self {
            AvrCellPlace::Reg(reg) => reg.into(),
            AvrCellPlace::Ram(addr) => addr,
        }
    }
}

/// Use of one port by the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrPortUse {
    /// Letter of the port.
    pub letter: char,
    /// Register that holds the latched inputs, if the port has inputs.
    pub input: Option<u8>,
    /// Register that is written to the port: outputs, and the pull-ups of the inputs, which stay 1.
    pub output: Option<u8>,
    /// Mask of bits that are inputs of the program.
    pub inputs: u8,
    /// Mask of bits that are outputs of the program.
    pub outputs: u8,
    /// Mask of bits whose latch is 1: the pull-ups of the inputs and of the receiver's pin, and the pin that
    /// selects an SPI device.
    pub pull_ups: u8,
    /// Mask of bits that are driven: the outputs, and the pins of the PWM output and of the SPI bus.
    pub driven: u8,
}

/// Places of all cells of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrLayout {
    /// Ports in use, by letter.
    pub ports: Vec<AvrPortUse>,
    /// Place and bit number of each bit, by [`BitId`].
    pub bits: Vec<(AvrCellPlace, u8)>,
    /// Place of each word, by [`WordId`].
    pub words: Vec<AvrCellPlace>,
    /// Width of each word in bytes, by [`WordId`].
    pub sizes: Vec<u8>,
    /// Place of the first byte of the timer's fraction.
    pub fraction: AvrCellPlace,
    /// Registers that hold bits, integers, or the images of ports.
    pub registers: Vec<u8>,
    /// First data address of RAM.
    pub ram_start: u16,
    /// Number of bytes of RAM in use.
    pub ram_bytes: u16,
}

impl AvrLayout {
    /// Place and bit number of a bit.
    #[must_use]
    pub fn bit(&self, bit: BitId) -> (AvrCellPlace, u8) {
        self.bits.get(bit.0 as usize).copied().unwrap_or((AvrCellPlace::Reg(*BIT_REGISTERS.end()), 0))
    }

    /// Place of the low byte of a word.
    #[must_use]
    pub fn word(&self, word: WordId) -> AvrCellPlace {
        self.words.get(word.0 as usize).copied().unwrap_or(AvrCellPlace::Ram(self.ram_start))
    }

    /// Width of a word in bytes.
    #[must_use]
    pub fn bytes(&self, word: WordId) -> u8 {
        self.sizes.get(word.0 as usize).copied().unwrap_or(2)
    }

    /// Emits `reg` := the byte of RAM at a data address.
    pub fn load(&self, asm: &mut AvrCodeWriter, reg: i32, addr: u16) {
        match addr.wrapping_sub(self.ram_start) {
            near @ 0..64 => asm.op(AvrOpKind::LddY, &[reg, near.into()]),
            _ => asm.op(AvrOpKind::Lds, &[reg, addr.into()]),
        }
    }

    /// Emits the byte of RAM at a data address := `reg`.
    pub fn store(&self, asm: &mut AvrCodeWriter, addr: u16, reg: i32) {
        match addr.wrapping_sub(self.ram_start) {
            near @ 0..64 => asm.op(AvrOpKind::StdY, &[near.into(), reg]),
            _ => asm.op(AvrOpKind::Sts, &[reg, addr.into()]),
        }
    }
}

/// Assigns a place to every cell; `fraction` is the number of bytes of the timer's fraction.
///
/// # Errors
/// The number of bytes of RAM needed, stack included, if the chip has fewer.
pub fn layout(job: &CompileJob<'_>, uses: &AvrUsage, fraction: u16) -> Result<AvrLayout, u64> {
    // Y is free only if no cell needs RAM, which is known only after trying.
    match try_layout(job, uses, fraction, true) {
        Ok(layout) if layout.ram_bytes == 0 => Ok(layout),
        _ => try_layout(job, uses, fraction, false),
    }
}

/// The registers that are still free, by number.
struct FreeRegisters([bool; 32]);

impl FreeRegisters {
    fn take(&mut self, from: impl IntoIterator<Item = u8>, size: u8) -> Option<u8> {
        let all = |at: u8| (at..at + size).all(|reg| self.0.get(usize::from(reg)).copied().unwrap_or(false));
        let found = from.into_iter().find(|&at| all(at))?;
        (found..found + size)
            .for_each(|reg| self.0.get_mut(usize::from(reg)).into_iter().for_each(|free| *free = false));
        Some(found)
    }
}

fn try_layout(job: &CompileJob<'_>, uses: &AvrUsage, fraction: u16, use_y: bool) -> Result<AvrLayout, u64> {
    let CompileJob { ir, pins, target, .. } = *job;
    let chip = target.chip;
    // Upper register pairs, which take constants; those with ADIW and SBIW first.
    let upper = [
        (26, !uses.wide),
        (30, !uses.wide && !uses.tables),
        (28, use_y),
        (16, !uses.wide),
        // The fraction of the timer is computed in r18 to r21.
        (20, !uses.wide && !uses.divides && fraction <= 2),
    ];
    let upper: Vec<u8> = upper.into_iter().filter(|&(_, free)| free).map(|(pair, _)| pair).collect();
    let mut free = FreeRegisters([false; 32]);
    for reg in BIT_REGISTERS.chain(upper.iter().flat_map(|&pair| [pair, pair + 1])) {
        free.0.get_mut(usize::from(reg)).into_iter().for_each(|it| *it = true);
    }
    let before = free.0;

    let receive = target.uart.filter(|_| ir.uart.receive).map(|(_, receive)| receive);
    let named: Vec<char> = ir.ports.iter().map(|cells| cells.letter).collect();
    let mut others: Vec<PinUse<'_>> = receive.iter().map(|&pin| PinUse { pin, high: true, driven: false }).collect();
    others.extend(job.pwm_outputs().map(|(_, at)| PinUse { pin: at.pin, high: false, driven: true }));
    if let Some([select, clock, out, _]) = target.spi.filter(|_| ir.buses.spi.is_some()) {
        // The device is selected only during a byte.
        others.push(PinUse { pin: select, high: true, driven: true });
        others.extend([clock, out].map(|pin| PinUse { pin, high: false, driven: true }));
    }
    let mut ports = port_uses(pins, &others, &named);
    for port in &mut ports {
        port.input = if port.inputs != 0 { free.take(BIT_REGISTERS, 1) } else { None };
        port.output = if port.outputs != 0 { free.take(BIT_REGISTERS, 1) } else { None };
    }

    let mut ram = u64::from(chip.ram_start);
    let mut in_ram = |bytes: u64| {
        ram += bytes;
        AvrCellPlace::Ram((ram - bytes) as u16)
    };
    let mut bits = vec![(AvrCellPlace::Ram(chip.ram_start), 0); ir.bits.len()];
    let mut unplaced = Vec::new();
    for (n, cell) in ir.bits.iter().enumerate() {
        let image = pins.iter().filter(|pin| !pin.analog).find(|p| p.name == cell.name).and_then(|pin| {
            let port = ports.iter().find(|p| p.letter == pin.port_letter())?;
            Some((AvrCellPlace::Reg(if pin.output { port.output? } else { port.input? }), pin.bit_number()))
        });
        match (cell.role, image) {
            (BitRole::Input | BitRole::Output, Some(image)) => bits[n] = image,
            _ => unplaced.push(n),
        }
    }
    unplaced.sort_by_key(|&n| std::cmp::Reverse(uses.bits.get(n).copied()));
    let mut bytes_of_bits = Vec::new();
    for group in unplaced.chunks(8) {
        match free.take(BIT_REGISTERS, 1) {
            Some(reg) => group.iter().zip(0..).for_each(|(&n, bit)| bits[n] = (AvrCellPlace::Reg(reg), bit)),
            None => bytes_of_bits.push(group),
        }
    }

    let mut order: Vec<usize> = (0..ir.words.len()).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(uses.words.get(n).copied()));
    let mut words = vec![AvrCellPlace::Ram(chip.ram_start); ir.words.len()];
    for n in order {
        let bytes = ir.words.get(n).map_or(2, |word| word.bytes);
        let singles = || BIT_REGISTERS.chain(upper.iter().rev().flat_map(|&pair| [pair, pair + 1]));
        let reg = match bytes {
            1 => free.take(singles(), 1),
            2 => free.take(upper.iter().copied().chain(BIT_REGISTERS.rev().filter(|reg| reg % 2 == 0)), 2),
            _ => None,
        };
        words[n] = reg.map_or_else(|| in_ram(bytes.into()), AvrCellPlace::Reg);
    }
    for group in bytes_of_bits {
        let home = in_ram(1);
        group.iter().zip(0..).for_each(|(&n, bit)| bits[n] = (home, bit));
    }
    // The fraction needs registers that can subtract constants.
    let high = || upper.iter().copied().filter(|_| fraction != 0);
    let reg = match fraction {
        1 => free.take(high().flat_map(|pair| [pair, pair + 1]), 1),
        2 => free.take(high(), 2),
        _ => None,
    };
    let fraction = reg.map_or_else(|| in_ram(fraction.into()), AvrCellPlace::Reg);
    let needed = ram - u64::from(chip.ram_start);
    if needed + u64::from(STACK_BYTES) > u64::from(chip.ram_len) {
        return Err(needed + u64::from(STACK_BYTES));
    }
    let registers = (0..32u8).filter(|&reg| {
        let at = |of: &[bool; 32]| of.get(usize::from(reg)).copied().unwrap_or(false);
        at(&before) && !at(&free.0)
    });
    Ok(AvrLayout {
        registers: registers.collect(),
        ports,
        bits,
        words,
        sizes: ir.words.iter().map(|word| word.bytes).collect(),
        fraction,
        ram_start: chip.ram_start,
        ram_bytes: needed as u16,
    })
}

/// A pin of a peripheral.
#[derive(Debug, Clone, Copy)]
struct PinUse<'a> {
    pin: &'a str,
    /// Its latch is 1: a pull-up, or a driven pin that rests high.
    high: bool,
    /// It is an output.
    driven: bool,
}

/// Returns the ports of these pins, by letter, without registers.
///
/// `others` are the pins of peripherals, if the program uses them, `named` the ports whose registers it
/// names.
fn port_uses(pins: &[AssignedPin], others: &[PinUse<'_>], named: &[char]) -> Vec<AvrPortUse> {
    let mut ports: Vec<AvrPortUse> = Vec::new();
    let mut add = |letter, inputs, outputs, pull_ups, driven| {
        let port = match ports.iter_mut().find(|port: &&mut AvrPortUse| port.letter == letter) {
            Some(port) => port,
            None => {
                ports.push(AvrPortUse {
                    letter,
                    input: None,
                    output: None,
                    inputs: 0,
                    outputs: 0,
                    pull_ups: 0,
                    driven: 0,
                });
                let Some(port) = ports.last_mut() else { return };
                port
            }
        };
        port.inputs |= inputs;
        port.outputs |= outputs;
        port.pull_ups |= inputs | pull_ups;
        port.driven |= outputs | driven;
    };
    for pin in pins.iter().filter(|pin| !pin.analog) {
        let bit = 1 << pin.bit_number();
        if pin.output { add(pin.port_letter(), 0, bit, 0, 0) } else { add(pin.port_letter(), bit, 0, 0, 0) }
    }
    for &PinUse { pin, high, driven } in others {
        let (letter, bit) = port_and_mask(pin);
        add(letter, 0, 0, if high { bit } else { 0 }, if driven { bit } else { 0 });
    }
    named.iter().for_each(|&letter| add(letter, 0, 0, 0, 0));
    ports.sort_by_key(|port| port.letter);
    ports
}

/// Port letter and bit mask of a pin such as `PB3`.
#[must_use]
pub fn port_and_mask(pin: &str) -> (char, u8) {
    let mut chars = pin.chars().skip(1);
    let letter = chars.next().unwrap_or('?');
    (letter, 1 << chars.next().and_then(|c| c.to_digit(8)).unwrap_or(0))
}
