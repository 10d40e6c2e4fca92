//! Breakpoints and watchpoints. gdb sets them before each run and takes them away after it.

use emu_debug::debug::{Access, What};
use emu_debug::place::Range;
use gdbstub::target::TargetResult;
use gdbstub::target::ext::breakpoints::{
    Breakpoints, HwBreakpoint, HwBreakpointOps, HwWatchpoint, HwWatchpointOps, SwBreakpoint, SwBreakpointOps, WatchKind,
};

use crate::stub::Stub;

/// What gdb has asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Asked {
    /// `Z0`: to us the same as `Z1`, but gdb wants to hear the same word again.
    Soft,
    /// `Z1`.
    Hard,
    /// `Z2` to `Z4` on so many bytes.
    Watch(WatchKind, u32),
}

/// A point of gdb's.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Set {
    /// Number of the session's point.
    pub id: u32,
    /// What gdb has asked for.
    pub asked: Asked,
    /// gdb's address.
    pub addr: u32,
}

impl Stub<'_> {
    /// Sets a point; false where there is nothing to be watched.
    fn add(&mut self, asked: Asked, addr: u32) -> bool {
        let Some(what) = self.what(asked, addr) else { return false };
        // The same asked for twice is one, as the protocol has it.
        if self.set.iter().all(|set| (set.asked, set.addr) != (asked, addr)) {
            let id = self.session.points.add(what, "gdb", false);
            self.set.push(Set { id, asked, addr });
        }
        true
    }

    fn remove(&mut self, asked: Asked, addr: u32) -> bool {
        let Some(at) = self.set.iter().position(|set| (set.asked, set.addr) == (asked, addr)) else { return false };
        self.session.points.remove(self.set.remove(at).id)
    }

    /// Takes all of gdb's points away, when it has gone.
    pub(crate) fn remove_all(&mut self) {
        for set in std::mem::take(&mut self.set) {
            self.session.points.remove(set.id);
        }
    }

    fn what(&self, asked: Asked, addr: u32) -> Option<What> {
        let Asked::Watch(kind, len) = asked else { return Some(What::Code(vec![self.layout.word(addr)?])) };
        let (memory, offset) = self.layout.find(addr, len.try_into().ok()?)?;
        if len == 0 {
            return None;
        }
        let end = (offset + len).div_ceil(memory.width);
        let range = Range { space: memory.space, start: offset / memory.width, end };
        self.session.scope.source().names.told(&range).ok()?;
        let access = match kind {
            WatchKind::Write => Access::Write,
            WatchKind::Read => Access::Read,
            WatchKind::ReadWrite => Access::Any,
        };
        Some(What::Access(range, access))
    }
}

impl Breakpoints for Stub<'_> {
    fn support_sw_breakpoint(&mut self) -> Option<SwBreakpointOps<'_, Self>> {
        Some(self)
    }
    fn support_hw_breakpoint(&mut self) -> Option<HwBreakpointOps<'_, Self>> {
        Some(self)
    }
    fn support_hw_watchpoint(&mut self) -> Option<HwWatchpointOps<'_, Self>> {
        Some(self)
    }
}

impl SwBreakpoint for Stub<'_> {
    fn add_sw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.add(Asked::Soft, addr))
    }
    fn remove_sw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.remove(Asked::Soft, addr))
    }
}

impl HwBreakpoint for Stub<'_> {
    fn add_hw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.add(Asked::Hard, addr))
    }
    fn remove_hw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.remove(Asked::Hard, addr))
    }
}

impl HwWatchpoint for Stub<'_> {
    fn add_hw_watchpoint(&mut self, addr: u32, len: u32, kind: WatchKind) -> TargetResult<bool, Self> {
        Ok(self.add(Asked::Watch(kind, len), addr))
    }
    fn remove_hw_watchpoint(&mut self, addr: u32, len: u32, kind: WatchKind) -> TargetResult<bool, Self> {
        Ok(self.remove(Asked::Watch(kind, len), addr))
    }
}
