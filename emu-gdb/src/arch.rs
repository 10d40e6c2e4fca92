//! What gdbstub wants to know of a processor. Ours are data ([`Layout`](crate::layout::Layout)), so one type stands for all.

use std::num::NonZeroUsize;

use gdbstub::arch::{Arch, RegId, Registers};

/// Any of our processors.
pub(crate) enum Any {}

/// A register by its number in target.xml.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Number(pub usize);

/// All registers as the packets `g` and `G` have them, one behind the other, the lowest byte first.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Bytes {
    /// The registers.
    pub bytes: Vec<u8>,
    /// The program counter among them, in bytes.
    pub pc: u32,
}

impl Registers for Bytes {
    type ProgramCounter = u32;

    fn pc(&self) -> u32 {
        self.pc
    }

    fn gdb_serialize(&self, mut write_byte: impl FnMut(Option<u8>)) {
        self.bytes.iter().for_each(|byte| write_byte(Some(*byte)));
    }

    fn gdb_deserialize(&mut self, bytes: &[u8]) -> Result<(), ()> {
        self.bytes = bytes.to_vec();
        Ok(())
    }
}

impl RegId for Number {
    fn from_raw_id(id: usize) -> Option<(Number, Option<NonZeroUsize>)> {
        Some((Number(id), None))
    }
}

impl Arch for Any {
    type Usize = u32;
    type Registers = Bytes;
    type BreakpointKind = usize;
    type RegId = Number;
}
