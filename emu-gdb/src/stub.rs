//! The machine as gdbstub wants it: registers and memories. Everything that is written is an action of the session.

use std::convert::Infallible;

use emu_debug::debug::{Action, Place, Session};
use gdbstub::target::ext::base::BaseOps;
use gdbstub::target::ext::base::single_register_access::{SingleRegisterAccess, SingleRegisterAccessOps};
use gdbstub::target::ext::base::singlethread::{SingleThreadBase, SingleThreadResumeOps};
use gdbstub::target::ext::breakpoints::BreakpointsOps;
use gdbstub::target::ext::flash::FlashOps;
use gdbstub::target::ext::memory_map::{MemoryMap, MemoryMapOps};
use gdbstub::target::ext::monitor_cmd::MonitorCmdOps;
use gdbstub::target::ext::target_description_xml_override::{
    TargetDescriptionXmlOverride, TargetDescriptionXmlOverrideOps,
};
use gdbstub::target::{Target, TargetError, TargetResult};

use crate::Monitor;
use crate::arch::{Any, Bytes, Number};
use crate::layout::{Kind, Layout};
use crate::points::Set;
use crate::resume::Go;
use crate::wire::Input;

/// `EFAULT`: there is no such place.
const NO_PLACE: u8 = 14;

/// `EINVAL`: it cannot have that value.
const NO_VALUE: u8 = 22;

/// A session that gdb looks at.
pub(crate) struct Stub<'a> {
    pub session: &'a mut Session,
    pub input: Input,
    pub layout: Layout,
    pub monitor: Option<&'a mut Monitor>,
    /// Breakpoints and watchpoints that gdb has set.
    pub set: Vec<Set>,
    /// What gdb wants of the program.
    pub go: Go,
    /// Why the program stands, for `monitor why`.
    pub why: String,
    /// Program memory as `load` wants it, until it is done.
    pub load: Option<Vec<u8>>,
}

impl<'a> Stub<'a> {
    pub(crate) fn new(session: &'a mut Session, input: Input, monitor: Option<&'a mut Monitor>) -> Stub<'a> {
        let layout = Layout::new(session.target());
        let why = "the client has just come".to_owned();
        Stub { session, input, layout, monitor, set: Vec::new(), go: Go::Step, why, load: None }
    }

    /// Value of a register, the program counter in bytes.
    pub(crate) fn register(&self, kind: Kind) -> u32 {
        let target = self.session.target();
        let bytes = |word: u32| word.saturating_mul(target.chip().word_bytes);
        match kind {
            Kind::Core(name) => target.reg(name).unwrap_or(0),
            Kind::Pc(name) => bytes(target.reg(name).unwrap_or(0)),
            Kind::Stack(place) => bytes(target.return_stack().get(place).copied().unwrap_or(0)),
        }
    }

    fn set_register(&mut self, kind: Kind, value: u32) -> TargetResult<(), Self> {
        if self.register(kind) == value {
            return Ok(());
        }
        let per_word = self.session.target().chip().word_bytes.max(1);
        let (name, value) = match kind {
            Kind::Core(name) => (name, value),
            Kind::Pc(name) if value.is_multiple_of(per_word) => (name, value / per_word),
            Kind::Pc(_) | Kind::Stack(_) => return Err(TargetError::Errno(NO_VALUE)),
        };
        let done = self.session.act(Action::Set(Place::Reg(name), value.into()));
        done.map_err(|_| TargetError::Errno(NO_VALUE))
    }

    /// Writes bytes. Of program memory only those that are different, four at a time: an action is kept for each.
    pub(crate) fn write(&mut self, addr: u32, data: &[u8]) -> TargetResult<(), Self> {
        let Some((memory, offset)) = self.layout.find(addr, data.len()).map(|(memory, offset)| (*memory, offset))
        else {
            return Err(TargetError::Errno(NO_PLACE));
        };
        let chip = self.session.target().chip();
        let program = memory.space == chip.code;
        let mut at = offset;
        for bytes in data.chunks(if program { 4 } else { 1 }) {
            let known = (at..).zip(bytes).all(|(at, byte)| self.session.target().peek(memory.space, at) == Some(*byte));
            if !(program && known) {
                let value = bytes.iter().rev().fold(0, |value, byte| value << 8 | i64::from(*byte));
                let place = Place::Memory { space: memory.space, addr: at, bytes: bytes.len() as u8, signed: false };
                let done = self.session.act(Action::Set(place, value));
                done.map_err(|_| TargetError::Errno(NO_VALUE))?;
            }
            at += bytes.len() as u32;
        }
        Ok(())
    }
}

impl Target for Stub<'_> {
    type Arch = Any;
    type Error = Infallible;

    fn base_ops(&mut self) -> BaseOps<'_, Any, Infallible> {
        BaseOps::SingleThread(self)
    }
    fn guard_rail_implicit_sw_breakpoints(&self) -> bool {
        true
    }
    fn use_rle(&self) -> bool {
        // Not worth it on the way from one process to another, and people can read what goes over the line.
        false
    }
    fn support_breakpoints(&mut self) -> Option<BreakpointsOps<'_, Self>> {
        Some(self)
    }
    fn support_flash_operations(&mut self) -> Option<FlashOps<'_, Self>> {
        Some(self)
    }
    fn support_memory_map(&mut self) -> Option<MemoryMapOps<'_, Self>> {
        Some(self)
    }
    fn support_monitor_cmd(&mut self) -> Option<MonitorCmdOps<'_, Self>> {
        Some(self)
    }
    fn support_target_description_xml_override(&mut self) -> Option<TargetDescriptionXmlOverrideOps<'_, Self>> {
        Some(self)
    }
}

impl SingleThreadBase for Stub<'_> {
    fn read_registers(&mut self, regs: &mut Bytes) -> TargetResult<(), Self> {
        regs.bytes.clear();
        for &(kind, bytes) in &self.layout.registers {
            let value = self.register(kind);
            regs.bytes.extend(value.to_le_bytes().iter().take(bytes));
            if matches!(kind, Kind::Pc(_)) {
                regs.pc = value;
            }
        }
        Ok(())
    }

    fn write_registers(&mut self, regs: &Bytes) -> TargetResult<(), Self> {
        let len: usize = self.layout.registers.iter().map(|(_, bytes)| bytes).sum();
        if regs.bytes.len() != len {
            return Err(TargetError::Errno(NO_VALUE));
        }
        let mut rest = regs.bytes.as_slice();
        for (kind, bytes) in self.layout.registers.clone() {
            let (value, behind) = rest.split_at_checked(bytes).unwrap_or((rest, &[]));
            self.set_register(kind, number(value))?;
            rest = behind;
        }
        Ok(())
    }

    fn support_single_register_access(&mut self) -> Option<SingleRegisterAccessOps<'_, (), Self>> {
        Some(self)
    }

    fn read_addrs(&mut self, addr: u32, data: &mut [u8]) -> TargetResult<usize, Self> {
        let Some((memory, offset)) = self.layout.find(addr, data.len()) else {
            return Err(TargetError::Errno(NO_PLACE));
        };
        for (at, byte) in (offset..).zip(data.iter_mut()) {
            let read = self.session.target().peek(memory.space, at);
            *byte = read.ok_or(TargetError::Errno(NO_PLACE))?;
        }
        Ok(data.len())
    }

    fn write_addrs(&mut self, addr: u32, data: &[u8]) -> TargetResult<(), Self> {
        self.write(addr, data)
    }

    fn support_resume(&mut self) -> Option<SingleThreadResumeOps<'_, Self>> {
        Some(self)
    }
}

/// A number whose lowest byte comes first.
fn number(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

impl SingleRegisterAccess<()> for Stub<'_> {
    fn read_register(&mut self, (): (), Number(at): Number, buf: &mut [u8]) -> TargetResult<usize, Self> {
        let &(kind, bytes) = self.layout.registers.get(at).ok_or(TargetError::Errno(NO_PLACE))?;
        for (to, from) in buf.iter_mut().zip(self.register(kind).to_le_bytes().iter().take(bytes)) {
            *to = *from;
        }
        Ok(bytes)
    }

    fn write_register(&mut self, (): (), Number(at): Number, value: &[u8]) -> TargetResult<(), Self> {
        match self.layout.registers.get(at) {
            Some(&(kind, bytes)) if value.len() == bytes => self.set_register(kind, number(value)),
            Some(_) => Err(TargetError::Errno(NO_VALUE)),
            None => Err(TargetError::Errno(NO_PLACE)),
        }
    }
}

impl TargetDescriptionXmlOverride for Stub<'_> {
    fn target_description_xml(
        &self,
        annex: &[u8],
        offset: u64,
        length: usize,
        buf: &mut [u8],
    ) -> TargetResult<usize, Self> {
        match annex {
            b"target.xml" => Ok(part(self.layout.target_xml().as_bytes(), offset, length, buf)),
            _ => Err(TargetError::Errno(NO_PLACE)),
        }
    }
}

impl MemoryMap for Stub<'_> {
    fn memory_map_xml(&self, offset: u64, length: usize, buf: &mut [u8]) -> TargetResult<usize, Self> {
        Ok(part(self.layout.memory_xml().as_bytes(), offset, length, buf))
    }
}

/// Copies a part of a file, as much of it as there is; gives its length.
fn part(file: &[u8], offset: u64, length: usize, buf: &mut [u8]) -> usize {
    let from = usize::try_from(offset).ok().and_then(|offset| file.get(offset..)).unwrap_or_default();
    let len = length.min(from.len()).min(buf.len());
    buf.iter_mut().zip(from).take(len).for_each(|(to, from)| *to = *from);
    len
}
