//! The machine as a gdbstub target: registers and memories. Every write is an action of the session.

use std::convert::Infallible;

use emu_debug::debug::{DebugSession, ExpressionPlace, UserAction};
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

use crate::MonitorHandler;
use crate::gdb_arch::{AnyArch, RegisterBytes, RegisterNumber};
use crate::gdb_points::GdbPoint;
use crate::layout::{GdbLayout, GdbRegister};
use crate::packets::ClientInput;
use crate::resume::ResumeKind;

/// `EFAULT`: there is no such address or register.
const EFAULT: u8 = 14;

/// `EINVAL`: the register or address cannot have that value.
const EINVAL: u8 = 22;

/// A session that gdb debugs.
pub(crate) struct GdbTarget<'a> {
    pub session: &'a mut DebugSession,
    /// Receives the client's packets, and Ctrl-C during a run.
    pub input: ClientInput,
    pub layout: GdbLayout,
    /// A handler for further `monitor` commands.
    pub monitor: Option<&'a mut MonitorHandler>,
    /// Breakpoints and watchpoints that gdb has set.
    pub points: Vec<GdbPoint>,
    /// The next run or step that gdb has requested.
    pub resume: ResumeKind,
    /// The reason of the last stop, for `monitor why`.
    pub last_halt: String,
    /// Program memory as `load` builds it, until it is complete.
    pub loading: Option<Vec<u8>>,
}

impl<'a> GdbTarget<'a> {
    /// Makes the target of gdb for a session.
    pub(crate) fn new(
        session: &'a mut DebugSession,
        input: ClientInput,
        monitor: Option<&'a mut MonitorHandler>,
    ) -> GdbTarget<'a> {
        let layout = GdbLayout::new(session.machine());
        let why = "the client has just connected".to_owned();
        GdbTarget {
            session,
            input,
            layout,
            monitor,
            points: Vec::new(),
            resume: ResumeKind::Step,
            last_halt: why,
            loading: None,
        }
    }

    /// The value of a register; the program counter is a byte address.
    pub(crate) fn register(&self, kind: GdbRegister) -> u32 {
        let machine = self.session.machine();
        let bytes = |word: u32| word.saturating_mul(machine.chip().word_bytes);
        match kind {
            GdbRegister::Core(name) => machine.reg(name).unwrap_or(0),
            GdbRegister::Pc(name) => bytes(machine.reg(name).unwrap_or(0)),
            GdbRegister::Stack(place) => bytes(machine.return_stack().get(place).copied().unwrap_or(0)),
        }
    }

    fn set_register(&mut self, kind: GdbRegister, value: u32) -> TargetResult<(), Self> {
        if self.register(kind) == value {
            return Ok(());
        }
        let per_word = self.session.machine().chip().word_bytes.max(1);
        let (name, value) = match kind {
            GdbRegister::Core(name) => (name, value),
            GdbRegister::Pc(name) if value.is_multiple_of(per_word) => (name, value / per_word),
            GdbRegister::Pc(_) | GdbRegister::Stack(_) => return Err(TargetError::Errno(EINVAL)),
        };
        let done = self.session.apply_action(UserAction::Set(ExpressionPlace::Reg(name), value.into()));
        done.map_err(|_| TargetError::Errno(EINVAL))
    }

    /// Writes bytes. Of program memory, only changed bytes are written, in units of four, because each write
    /// is kept as an action.
    pub(crate) fn write_bytes(&mut self, addr: u32, data: &[u8]) -> TargetResult<(), Self> {
        let Some((memory, offset)) =
            self.layout.find_memory(addr, data.len()).map(|(memory, offset)| (*memory, offset))
        else {
            return Err(TargetError::Errno(EFAULT));
        };
        let chip = self.session.machine().chip();
        let program = memory.space == chip.code_space;
        let mut at = offset;
        for bytes in data.chunks(if program { 4 } else { 1 }) {
            let known =
                (at..).zip(bytes).all(|(at, byte)| self.session.machine().peek(memory.space, at) == Some(*byte));
            if !(program && known) {
                let value = bytes.iter().rev().fold(0, |value, byte| value << 8 | i64::from(*byte));
                let place =
                    ExpressionPlace::Memory { space: memory.space, addr: at, bytes: bytes.len() as u8, signed: false };
                let done = self.session.apply_action(UserAction::Set(place, value));
                done.map_err(|_| TargetError::Errno(EINVAL))?;
            }
            at += bytes.len() as u32;
        }
        Ok(())
    }
}

impl Target for GdbTarget<'_> {
    type Arch = AnyArch;
    type Error = Infallible;

    fn base_ops(&mut self) -> BaseOps<'_, AnyArch, Infallible> {
        BaseOps::SingleThread(self)
    }
    fn guard_rail_implicit_sw_breakpoints(&self) -> bool {
        true
    }
    fn use_rle(&self) -> bool {
        // Run-length encoding does not pay off between two processes, and makes the protocol harder to read.
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

impl SingleThreadBase for GdbTarget<'_> {
    fn read_registers(&mut self, regs: &mut RegisterBytes) -> TargetResult<(), Self> {
        regs.bytes.clear();
        for &(kind, bytes) in &self.layout.registers {
            let value = self.register(kind);
            regs.bytes.extend(value.to_le_bytes().iter().take(bytes));
            if matches!(kind, GdbRegister::Pc(_)) {
                regs.pc = value;
            }
        }
        Ok(())
    }

    fn write_registers(&mut self, regs: &RegisterBytes) -> TargetResult<(), Self> {
        let len: usize = self.layout.registers.iter().map(|(_, bytes)| bytes).sum();
        if regs.bytes.len() != len {
            return Err(TargetError::Errno(EINVAL));
        }
        let mut rest = regs.bytes.as_slice();
        for (kind, bytes) in self.layout.registers.clone() {
            let (value, behind) = rest.split_at_checked(bytes).unwrap_or((rest, &[]));
            self.set_register(kind, little_endian(value))?;
            rest = behind;
        }
        Ok(())
    }

    fn support_single_register_access(&mut self) -> Option<SingleRegisterAccessOps<'_, (), Self>> {
        Some(self)
    }

    fn read_addrs(&mut self, addr: u32, data: &mut [u8]) -> TargetResult<usize, Self> {
        let Some((memory, offset)) = self.layout.find_memory(addr, data.len()) else {
            return Err(TargetError::Errno(EFAULT));
        };
        for (at, byte) in (offset..).zip(data.iter_mut()) {
            let read = self.session.machine().peek(memory.space, at);
            *byte = read.ok_or(TargetError::Errno(EFAULT))?;
        }
        Ok(data.len())
    }

    fn write_addrs(&mut self, addr: u32, data: &[u8]) -> TargetResult<(), Self> {
        self.write_bytes(addr, data)
    }

    fn support_resume(&mut self) -> Option<SingleThreadResumeOps<'_, Self>> {
        Some(self)
    }
}

/// Converts bytes in little-endian order to a number.
fn little_endian(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

impl SingleRegisterAccess<()> for GdbTarget<'_> {
    fn read_register(
        &mut self,
        (): (),
        RegisterNumber(at): RegisterNumber,
        buf: &mut [u8],
    ) -> TargetResult<usize, Self> {
        let &(kind, bytes) = self.layout.registers.get(at).ok_or(TargetError::Errno(EFAULT))?;
        for (to, from) in buf.iter_mut().zip(self.register(kind).to_le_bytes().iter().take(bytes)) {
            *to = *from;
        }
        Ok(bytes)
    }

    fn write_register(&mut self, (): (), RegisterNumber(at): RegisterNumber, value: &[u8]) -> TargetResult<(), Self> {
        match self.layout.registers.get(at) {
            Some(&(kind, bytes)) if value.len() == bytes => self.set_register(kind, little_endian(value)),
            Some(_) => Err(TargetError::Errno(EINVAL)),
            None => Err(TargetError::Errno(EFAULT)),
        }
    }
}

impl TargetDescriptionXmlOverride for GdbTarget<'_> {
    fn target_description_xml(
        &self,
        annex: &[u8],
        offset: u64,
        length: usize,
        buf: &mut [u8],
    ) -> TargetResult<usize, Self> {
        match annex {
            b"target.xml" => Ok(copy_part(self.layout.target_xml().as_bytes(), offset, length, buf)),
            _ => Err(TargetError::Errno(EFAULT)),
        }
    }
}

impl MemoryMap for GdbTarget<'_> {
    fn memory_map_xml(&self, offset: u64, length: usize, buf: &mut [u8]) -> TargetResult<usize, Self> {
        Ok(copy_part(self.layout.memory_xml().as_bytes(), offset, length, buf))
    }
}

/// Copies a part of a file into `buf`; returns the number of bytes copied.
fn copy_part(file: &[u8], offset: u64, length: usize, buf: &mut [u8]) -> usize {
    let from = usize::try_from(offset).ok().and_then(|offset| file.get(offset..)).unwrap_or_default();
    let len = length.min(from.len()).min(buf.len());
    buf.iter_mut().zip(from).take(len).for_each(|(to, from)| *to = *from);
    len
}
