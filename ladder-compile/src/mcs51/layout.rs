//! Assigns places in RAM to all cells.
//!
//! ```text
//! 00h ..       R0 where RAM above 7Fh is in use, then the bytes for multiplication and division, then the
//!              most used words: the addresses 0 to 7 are the registers R0 to R7
//! 08h, 09h     the stack, where subroutines are called: SP is 07h after reset
//! 20h .. 2Fh   bits: an image of each port with inputs and of each port with outputs, a bit at its pin's
//!              place, then relays, edge memories and temporaries; the rest holds words
//! .. 7Fh       words, low byte first; bits without a bit address, accessed through A
//! 80h .. FFh   words, on chips that have this RAM, accessed through R0
//! ```

use super::registers::ByteBit;
use crate::ir::{ArithmeticOp, BitId, BitRole, BranchCondition, Ir, IrOp, WordId, WordOperand};
use crate::map::CellLocation;
use crate::pins::AssignedPin;
use crate::target::BuildRefusal;

use super::registers::Mcs51Registers;

/// Bytes with bit addresses.
const BIT_ADDRESSABLE: std::ops::Range<usize> = 0x20..0x30;

/// Range of the stack: one return address, where SP points after reset.
const STACK_RANGE: std::ops::Range<usize> = 0x08..0x0A;

/// Use of one port by the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mcs51PortUse {
    /// Address of the port's register.
    pub sfr: u8,
    /// Byte that holds the latched inputs, if the port has inputs.
    pub input: Option<u8>,
    /// Byte that is written to the port, if it has outputs.
    pub output: Option<u8>,
    /// Mask of bits that are outputs.
    pub outputs: u8,
}

/// RAM needed by the code around the rungs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mcs51RamNeeds {
    /// Maximum width in bytes of a multiplication by subroutine; 0 if there is none.
    pub multiply: u8,
    /// Maximum width in bytes of a division by subroutine; 0 if there is none.
    pub divide: u8,
    /// Number of bytes for the pacing timer.
    pub pace: usize,
}

/// The memory of all cells.
const SPACE: &str = "idata";

/// Places of all cells of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mcs51Layout {
    /// Ports in use, by address.
    pub ports: Vec<Mcs51PortUse>,
    /// Byte address and bit number of each bit, by [`BitId`].
    bits: Vec<ByteBit>,
    /// Address of the low byte and width of each word, by [`WordId`].
    words: Vec<(u8, u8)>,
    /// Bytes used by the arithmetic subroutines.
    pub scratch: Vec<u8>,
    /// Bytes used by the pacing timer.
    pub pacing_ram: Vec<u8>,
    /// Bit address of the flag for a received byte, if the program receives.
    pub byte_received_flag: Option<u8>,
    /// Highest address in use.
    pub highest_address: u8,
    /// Number of bytes of RAM in use, without the stack.
    pub ram_bytes: u32,
}

impl Mcs51Layout {
    /// Byte address and bit number of a bit.
    #[must_use]
    pub fn bit(&self, bit: BitId) -> ByteBit {
        self.bits.get(bit.0 as usize).copied().unwrap_or(ByteBit { byte: 0x20, bit: 0 })
    }

    /// Address of the low byte of a word.
    #[must_use]
    pub fn word(&self, word: WordId) -> u8 {
        self.words.get(word.0 as usize).map_or(0, |&(at, _)| at)
    }

    /// Locations of the bits for the map.
    #[must_use]
    pub fn bit_locations(&self) -> Vec<CellLocation> {
        let location = |at: &ByteBit| CellLocation::Bit { space: SPACE.to_owned(), addr: at.byte.into(), bit: at.bit };
        self.bits.iter().map(location).collect()
    }

    /// Locations of the words for the map.
    #[must_use]
    pub fn word_locations(&self) -> Vec<CellLocation> {
        let location = |&(at, bytes): &(u8, u8)| CellLocation::Word { space: SPACE.to_owned(), addr: at.into(), bytes };
        self.words.iter().map(location).collect()
    }
}

/// Free bytes of RAM.
struct Mcs51FreeRam {
    taken: Vec<bool>,
    /// Number of bytes requested, whether available or not.
    requested_bytes: usize,
}

impl Mcs51FreeRam {
    /// Allocates the lowest free run of `bytes` bytes; returns address 0 if there is none, which [`layout`]
    /// detects.
    fn take(&mut self, bytes: usize) -> u8 {
        self.requested_bytes += bytes;
        let fits = |at: &usize| self.taken.get(*at..at + bytes).is_some_and(|run| !run.contains(&true));
        let Some(at) = (0..self.taken.len()).find(fits) else { return 0 };
        self.taken.iter_mut().skip(at).take(bytes).for_each(|taken| *taken = true);
        at as u8
    }
}

/// Number of uses of each cell.
struct Mcs51Usage {
    bits: Vec<u32>,
    words: Vec<u32>,
}

impl Mcs51Usage {
    fn bit(&mut self, bit: BitId) {
        self.bits.get_mut(bit.0 as usize).into_iter().for_each(|n| *n += 1);
    }

    fn word(&mut self, word: WordId) {
        self.words.get_mut(word.0 as usize).into_iter().for_each(|n| *n += 1);
    }

    fn value(&mut self, value: WordOperand) {
        if let WordOperand::Cell(word) = value {
            self.word(word);
        }
    }

    fn ops(&mut self, ops: &[IrOp]) {
        ops.iter().for_each(|op| self.op(op));
    }

    fn op(&mut self, op: &IrOp) {
        match op {
            IrOp::Load { bit, .. } | IrOp::And { bit, .. } | IrOp::Or { bit, .. } | IrOp::Store { bit, .. } => {
                self.bit(*bit)
            }
            IrOp::SetBit { bit, .. } | IrOp::Rising(bit) | IrOp::Falling(bit) => self.bit(*bit),
            IrOp::AndCompare(c) | IrOp::If { cond: BranchCondition::Compare(c), .. } => {
                self.word(c.a);
                self.value(c.b);
            }
            IrOp::If { cond: BranchCondition::Bit(bit), .. } => self.bit(*bit),
            IrOp::Move { dst, src } => {
                self.word(*dst);
                self.value(*src);
            }
            IrOp::Math { dst, a, b, .. } => {
                self.word(*dst);
                self.value(*a);
                self.value(*b);
            }
            IrOp::Lookup { dst, index, .. } => {
                self.word(*dst);
                self.word(*index);
            }
            IrOp::Send { value } => self.value(*value),
            IrOp::Receive { dst } => self.word(*dst),
            _ => {}
        }
        if let IrOp::If { if_true: then, if_false: otherwise, .. } = op {
            self.ops(then);
            self.ops(otherwise);
        }
    }
}

/// Assigns a place to every cell.
///
/// # Errors
/// The chip has too little RAM; the error has the bytes needed and available.
pub fn layout(
    ir: &Ir,
    pins: &[AssignedPin],
    regs: Mcs51Registers,
    ram: u16,
    needs: Mcs51RamNeeds,
) -> Result<Mcs51Layout, BuildRefusal> {
    let stack = if needs.multiply.max(needs.divide) > 0 { STACK_RANGE.len() } else { 0 };
    // Only RAM above 7Fh needs R0, so first try to place everything below.
    let low = try_layout(ir, pins, regs, usize::from(ram).min(0x80), needs, false);
    let placed = match low {
        Err(_) if ram > 0x80 => try_layout(ir, pins, regs, ram.into(), needs, true),
        low => low,
    };
    placed.map_err(|bytes| BuildRefusal::RamTooSmall { needed: (bytes + stack) as u64, available: ram.into() })
}

fn try_layout(
    ir: &Ir,
    pins: &[AssignedPin],
    regs: Mcs51Registers,
    ram: usize,
    needs: Mcs51RamNeeds,
    points: bool,
) -> Result<Mcs51Layout, usize> {
    let calls = needs.multiply.max(needs.divide) > 0;
    let mut free = Mcs51FreeRam { taken: vec![false; ram], requested_bytes: 0 };
    free.taken.iter_mut().take(usize::from(points)).for_each(|taken| *taken = true);
    free.requested_bytes += usize::from(points);
    if calls {
        free.taken.iter_mut().skip(STACK_RANGE.start).take(STACK_RANGE.len()).for_each(|taken| *taken = true);
    }
    // Scratch space for two operands, and for the remainder and a counter, or the rest of a wide product.
    let wide = |n: u8| usize::from(n);
    let product = if needs.multiply > 2 { 3 * wide(needs.multiply) } else { 2 * wide(needs.multiply) };
    let quotient = if needs.divide > 0 { 3 * wide(needs.divide) + 1 } else { 0 };
    let scratch = (0..product.max(quotient)).map(|_| free.take(1)).collect();

    let mut uses = Mcs51Usage { bits: vec![0; ir.bits.len()], words: vec![0; ir.words.len()] };
    uses.ops(&ir.prologue);
    ir.rungs.iter().flat_map(|rung| &rung.steps).for_each(|step| uses.op(&step.op));
    uses.ops(&ir.epilogue);

    let mut ports: Vec<Mcs51PortUse> = Vec::new();
    let mut next = BIT_ADDRESSABLE.start;
    let mut image = |free: &mut Mcs51FreeRam| {
        free.taken.iter_mut().skip(next).take(1).for_each(|taken| *taken = true);
        free.requested_bytes += 1;
        next += 1;
        Some(next as u8 - 1)
    };
    let digital = || pins.iter().filter(|pin| !pin.analog);
    let mut sfrs: Vec<u8> = digital().map(|pin| regs.pin(pin.pin).byte).collect();
    sfrs.sort_unstable();
    sfrs.dedup();
    for sfr in sfrs {
        let on = |output| digital().filter(move |pin| pin.output == output && regs.pin(pin.pin).byte == sfr);
        ports.push(Mcs51PortUse {
            sfr,
            input: if on(false).next().is_some() { image(&mut free) } else { None },
            output: if on(true).next().is_some() { image(&mut free) } else { None },
            outputs: on(true).fold(0, |mask, pin| mask | 1 << regs.pin(pin.pin).bit),
        });
    }

    // The most used bits get bit addresses, as long as there are any.
    let mut bits = vec![ByteBit::default(); ir.bits.len()];
    let mut others: Vec<usize> = Vec::new();
    for (n, cell) in ir.bits.iter().enumerate() {
        let at = digital().find(|pin| pin.name == cell.name).and_then(|pin| {
            let ByteBit { byte: sfr, bit } = regs.pin(pin.pin);
            let port = ports.iter().find(|port| port.sfr == sfr)?;
            let byte = if pin.output { port.output? } else { port.input? };
            Some(ByteBit { byte, bit })
        });
        match at {
            Some(at) if matches!(cell.role, BitRole::Input | BitRole::Output) => {
                bits.get_mut(n).into_iter().for_each(|place| *place = at);
            }
            _ => others.push(n),
        }
    }
    others.sort_by_key(|&n| std::cmp::Reverse(uses.bits.get(n).copied().unwrap_or(0)));
    let (mut byte, mut used) = (0, 8);
    let mut one = |free: &mut Mcs51FreeRam| {
        if used == 8 {
            used = 0;
            byte = match free.taken.get(BIT_ADDRESSABLE).and_then(|bytes| bytes.iter().position(|taken| !taken)) {
                Some(n) => {
                    free.taken.iter_mut().skip(BIT_ADDRESSABLE.start + n).take(1).for_each(|taken| *taken = true);
                    free.requested_bytes += 1;
                    (BIT_ADDRESSABLE.start + n) as u8
                }
                None => free.take(1),
            };
        }
        used += 1;
        ByteBit { byte, bit: used - 1 }
    };
    let arrived =
        ir.uart.receive.then(|| one(&mut free)).map(|at| (at.byte - BIT_ADDRESSABLE.start as u8) * 8 + at.bit);
    for n in others {
        let place = one(&mut free);
        bits.get_mut(n).into_iter().for_each(|at| *at = place);
    }

    let pace = (0..needs.pace).map(|_| free.take(1)).collect();
    let mut words: Vec<(u8, u8)> = ir.words.iter().map(|cell| (0, cell.bytes)).collect();
    let mut order: Vec<usize> = (0..words.len()).collect();
    order.sort_by_key(|&n| std::cmp::Reverse(uses.words.get(n).copied().unwrap_or(0)));
    for n in order {
        if let Some((at, bytes)) = words.get_mut(n) {
            *at = free.take((*bytes).into());
        }
    }
    // Fail if an allocation found no free run, or if the cells exceed the RAM.
    let placed = free.taken.iter().filter(|taken| **taken).count() - if calls { STACK_RANGE.len() } else { 0 };
    if placed < free.requested_bytes {
        return Err(free.requested_bytes);
    }
    let top = free.taken.iter().rposition(|taken| *taken).unwrap_or(0) as u8;
    Ok(Mcs51Layout {
        ports,
        bits,
        words,
        scratch,
        pacing_ram: pace,
        byte_received_flag: arrived,
        highest_address: top,
        ram_bytes: placed as u32,
    })
}

/// Returns the maximum widths of multiplications and divisions that need a subroutine, in bytes.
#[must_use]
pub fn ram_needs(ir: &Ir) -> Mcs51RamNeeds {
    fn look(ir: &Ir, ops: &[IrOp], needs: &mut Mcs51RamNeeds) {
        for op in ops {
            match op {
                IrOp::Math { op: math @ (ArithmeticOp::Mul | ArithmeticOp::Div), dst, a, b } => {
                    let width = ir.width(*math, *dst, *a, *b);
                    match math {
                        ArithmeticOp::Mul if width > 1 => needs.multiply = needs.multiply.max(width),
                        ArithmeticOp::Div => needs.divide = needs.divide.max(width),
                        _ => {}
                    }
                }
                IrOp::If { if_true: then, if_false: otherwise, .. } => {
                    look(ir, then, needs);
                    look(ir, otherwise, needs);
                }
                _ => {}
            }
        }
    }
    let mut needs = Mcs51RamNeeds::default();
    look(ir, &ir.prologue, &mut needs);
    ir.rungs.iter().for_each(|rung| rung.steps.iter().for_each(|s| look(ir, std::slice::from_ref(&s.op), &mut needs)));
    look(ir, &ir.epilogue, &mut needs);
    needs
}
