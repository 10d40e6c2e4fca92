//! The processor description for gdbstub. Processors are data ([`GdbLayout`](crate::layout::GdbLayout)), so
//! one type represents all.

use std::num::NonZeroUsize;

use gdbstub::arch::{Arch, RegId, Registers};

/// Any processor of this project.
pub(crate) enum AnyArch {}

/// A register, by its number in target.xml.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RegisterNumber(pub usize);

/// All registers in the format of the packets `g` and `G`: in order, each with the lowest byte first.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct RegisterBytes {
    /// The bytes of all registers.
    pub bytes: Vec<u8>,
    /// The program counter, as a byte address.
    pub pc: u32,
}

impl Registers for RegisterBytes {
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

impl RegId for RegisterNumber {
    fn from_raw_id(id: usize) -> Option<(RegisterNumber, Option<NonZeroUsize>)> {
        Some((RegisterNumber(id), None))
    }
}

impl Arch for AnyArch {
    type Usize = u32;
    type Registers = RegisterBytes;
    type BreakpointKind = usize;
    type RegId = RegisterNumber;
}
