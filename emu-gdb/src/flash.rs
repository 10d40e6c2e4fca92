//! gdb's `load`: gdb erases blocks, writes bytes, and reports the end. Only then the changed bytes are
//! written to the machine.

use gdbstub::target::ext::flash::Flash;
use gdbstub::target::{TargetError, TargetResult};

use crate::gdb_target::GdbTarget;

/// `EFAULT`: the address is not in program memory.
const EFAULT: u8 = 14;

impl GdbTarget<'_> {
    /// The bytes of program memory from gdb's address `addr` on, in the image that `load` builds, with their
    /// offset.
    fn load_bytes(&mut self, addr: u32, len: u32) -> Option<(u32, &mut [u8])> {
        let (memory, offset) = self.layout.find_memory(addr, len.try_into().ok()?)?;
        let machine = self.session.machine();
        let (space, all) = (memory.space, memory.len);
        if space != machine.chip().code_space {
            return None;
        }
        let now = || (0..all).map(|at| machine.peek(space, at).unwrap_or(0)).collect();
        let picture = self.loading.get_or_insert_with(now);
        let start = offset as usize;
        picture.get_mut(start..start + len as usize).map(|bytes| (offset, bytes))
    }
}

impl Flash for GdbTarget<'_> {
    fn flash_erase(&mut self, addr: u32, length: u32) -> TargetResult<(), Self> {
        let erased = self.session.machine().chip().isa.erased_word.to_le_bytes();
        let word = self.session.machine().chip().word_bytes.clamp(1, 2) as usize;
        let (offset, bytes) = self.load_bytes(addr, length).ok_or(TargetError::Errno(EFAULT))?;
        for (at, byte) in (offset as usize..).zip(bytes) {
            *byte = erased.get(at % word).copied().unwrap_or(0xFF);
        }
        Ok(())
    }

    fn flash_write(&mut self, addr: u32, data: &[u8]) -> TargetResult<(), Self> {
        let len = u32::try_from(data.len()).map_err(|_| TargetError::Errno(EFAULT))?;
        let (_, bytes) = self.load_bytes(addr, len).ok_or(TargetError::Errno(EFAULT))?;
        bytes.copy_from_slice(data);
        Ok(())
    }

    fn flash_done(&mut self) -> TargetResult<(), Self> {
        let base = self.layout.memories.first().map_or(0, |memory| memory.base);
        match self.loading.take() {
            Some(picture) => self.write_bytes(base, &picture),
            None => Ok(()),
        }
    }
}
