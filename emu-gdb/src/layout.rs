//! Registers and memories of each chip family as gdb sees them.
//!
//! gdb has one address space. Program memory is at 0, in bytes; the RAM of the chip is at 0x800000, and the
//! other memories follow at distances of 0x10000, as in ELF files for AVR.

use std::fmt::Write;

use emu_core::chip::{Chip, ChipSpace};
use emu_debug::debug::DynMachine;
use emu_debug::trace::register_bits;

/// Number of stack levels of a PIC16; the stack is not part of a memory.
const PIC16_STACK_LEVELS: usize = 8;

/// A register in gdb's register list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GdbRegister {
    /// A register of [`Chip::cpu_regs`].
    Core(&'static str),
    /// The program counter, under its name in [`Chip::cpu_regs`]; gdb gets it as a byte address.
    Pc(&'static str),
    /// A return address as a byte address; 0 is the newest.
    Stack(usize),
}

/// A memory in gdb's address space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct GdbMemory {
    /// Name of the memory in [`Chip::spaces`].
    pub space: &'static str,
    /// gdb's address of the first byte.
    pub base: u32,
    /// Length in bytes.
    pub len: u32,
    /// Bytes per address of the memory in [`Chip::spaces`].
    pub width: u32,
}

/// The layout of a chip in gdb's view.
#[derive(Debug, Clone)]
pub(crate) struct GdbLayout {
    chip: &'static Chip,
    /// Registers in gdb's order, with their sizes in bytes.
    pub registers: Vec<(GdbRegister, usize)>,
    /// The memories; program memory is the first.
    pub memories: Vec<GdbMemory>,
}

impl GdbLayout {
    /// The layout of a machine's chip.
    pub(crate) fn new(machine: &dyn DynMachine) -> GdbLayout {
        let chip = machine.chip();
        let core = chip.cpu_regs.iter().map(|name| match *name {
            "PC" | "NA" => (GdbRegister::Pc(name), 4),
            name => (GdbRegister::Core(name), register_bits(chip, name).div_ceil(8) as usize),
        });
        let places = if machine.return_stack().is_empty() { 0 } else { PIC16_STACK_LEVELS };
        let registers = core.chain((0..places).map(|place| (GdbRegister::Stack(place), 4))).collect();
        let memories = chip.family_traits().gdb_memories.iter().filter_map(|&(name, base)| {
            let &ChipSpace { name: space, size, width } = chip.space(name)?;
            Some(GdbMemory { space, base, len: size.saturating_mul(width), width })
        });
        GdbLayout { chip, registers, memories: memories.collect() }
    }

    /// The memory that contains `len` bytes from gdb's address `addr` on, and the offset of the first byte in
    /// it.
    pub(crate) fn find_memory(&self, addr: u32, len: usize) -> Option<(&GdbMemory, u32)> {
        let memory = self.memories.iter().rev().find(|memory| memory.base <= addr)?;
        let offset = addr - memory.base;
        let left = memory.len.checked_sub(offset)?;
        (left > 0 && len <= left as usize).then_some((memory, offset))
    }

    /// The program word at gdb's byte address.
    pub(crate) fn program_word(&self, addr: u32) -> Option<u32> {
        let (memory, offset) = self.find_memory(addr, 1)?;
        let per_word = self.chip.word_bytes.max(1);
        (memory.space == self.chip.code_space && offset.is_multiple_of(per_word)).then_some(offset / per_word)
    }

    /// The file target.xml. gdb knows the registers of AVR and does not accept others; for other families the
    /// file lists them.
    pub(crate) fn target_xml(&self) -> String {
        let mut xml =
            "<?xml version=\"1.0\"?>\n<!DOCTYPE target SYSTEM \"gdb-target.dtd\">\n<target version=\"1.0\">\n"
                .to_owned();
        let family = self.chip.family_traits();
        if let Some([small, large]) = family.gdb_architectures {
            // Small AVR chips have neither CALL nor JMP.
            let core = if self.chip.flash_bytes > 0x2000 { large } else { small };
            return format!("{xml}  <architecture>{core}</architecture>\n</target>\n");
        }
        _ = writeln!(xml, "  <feature name=\"org.emu.{}\">", family.id);
        for (kind, bytes) in &self.registers {
            let (name, kind) = match kind {
                GdbRegister::Core(name) => (name.to_ascii_lowercase(), format!("uint{}", 8 * bytes)),
                GdbRegister::Pc(_) => ("pc".to_owned(), "code_ptr".to_owned()),
                GdbRegister::Stack(place) => (format!("stk{place}"), "code_ptr".to_owned()),
            };
            _ = writeln!(xml, "    <reg name=\"{name}\" bitsize=\"{}\" type=\"{kind}\"/>", 8 * bytes);
        }
        xml + "  </feature>\n</target>\n"
    }

    /// The memory map, with which gdb's `load` writes program memory like a flash. A block is one word, so
    /// that `load` erases only what it writes.
    pub(crate) fn memory_xml(&self) -> String {
        let mut xml = "<?xml version=\"1.0\"?>\n<memory-map>\n".to_owned();
        for memory in &self.memories {
            let place = format!("start=\"0x{:x}\" length=\"0x{:x}\"", memory.base, memory.len);
            _ = if memory.space == self.chip.code_space {
                let block = self.chip.word_bytes;
                writeln!(
                    xml,
                    "  <memory type=\"flash\" {place}><property name=\"blocksize\">{block}</property></memory>"
                )
            } else {
                writeln!(xml, "  <memory type=\"ram\" {place}/>")
            };
        }
        xml + "</memory-map>\n"
    }
}
