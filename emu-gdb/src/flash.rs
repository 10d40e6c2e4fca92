//! `load`: gdb erases blocks, writes bytes and says when it is done. Only then the machine is changed, and only where it must be.

use gdbstub::target::ext::flash::Flash;
use gdbstub::target::{TargetError, TargetResult};

use crate::stub::Stub;

/// `EFAULT`: not in program memory.
const NO_PLACE: u8 = 14;

impl Stub<'_> {
    /// The bytes of program memory from gdb's address on, in the picture of it that `load` makes.
    fn picture(&mut self, addr: u32, len: u32) -> Option<(u32, &mut [u8])> {
        let (memory, offset) = self.layout.find(addr, len.try_into().ok()?)?;
        let target = self.session.target();
        let (space, all) = (memory.space, memory.len);
        if space != target.chip().code {
            return None;
        }
        let now = || (0..all).map(|at| target.peek(space, at).unwrap_or(0)).collect();
        let picture = self.load.get_or_insert_with(now);
        let start = offset as usize;
        picture.get_mut(start..start + len as usize).map(|bytes| (offset, bytes))
    }
}

impl Flash for Stub<'_> {
    fn flash_erase(&mut self, addr: u32, length: u32) -> TargetResult<(), Self> {
        let erased = self.session.target().chip().isa.erased.to_le_bytes();
        let word = self.session.target().chip().word_bytes.clamp(1, 2) as usize;
        let (offset, bytes) = self.picture(addr, length).ok_or(TargetError::Errno(NO_PLACE))?;
        for (at, byte) in (offset as usize..).zip(bytes) {
            *byte = erased.get(at % word).copied().unwrap_or(0xFF);
        }
        Ok(())
    }

    fn flash_write(&mut self, addr: u32, data: &[u8]) -> TargetResult<(), Self> {
        let len = u32::try_from(data.len()).map_err(|_| TargetError::Errno(NO_PLACE))?;
        let (_, bytes) = self.picture(addr, len).ok_or(TargetError::Errno(NO_PLACE))?;
        bytes.copy_from_slice(data);
        Ok(())
    }

    fn flash_done(&mut self) -> TargetResult<(), Self> {
        let base = self.layout.memories.first().map_or(0, |memory| memory.base);
        match self.load.take() {
            Some(picture) => self.write(base, &picture),
            None => Ok(()),
        }
    }
}
