//! Breakpoints and watchpoints of gdb, which sets them before each run and removes them after it.

use emu_debug::address_names::AddressRange;
use emu_debug::debug::{AccessKind, PointTrigger};
use gdbstub::target::TargetResult;
use gdbstub::target::ext::breakpoints::{
    Breakpoints, HwBreakpoint, HwBreakpointOps, HwWatchpoint, HwWatchpointOps, SwBreakpoint, SwBreakpointOps, WatchKind,
};

use crate::gdb_target::GdbTarget;

/// The kind of a point in a gdb packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum GdbPointKind {
    /// `Z0`; equivalent to `Z1` here, but gdb expects the same kind in the stop reply.
    Soft,
    /// `Z1`.
    Hard,
    /// `Z2` to `Z4`, with the number of bytes watched.
    Watch(WatchKind, u32),
}

/// A breakpoint or watchpoint that gdb has set.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GdbPoint {
    /// Number of the point in the session.
    pub id: u32,
    /// The kind that gdb requested.
    pub kind: GdbPointKind,
    /// The address that gdb requested.
    pub addr: u32,
}

impl GdbTarget<'_> {
    /// Sets a point; returns false if the address cannot be watched.
    fn add(&mut self, asked: GdbPointKind, addr: u32) -> bool {
        let Some(what) = self.trigger(asked, addr) else { return false };
        // The protocol requires that a point set twice counts once.
        if self.points.iter().all(|set| (set.kind, set.addr) != (asked, addr)) {
            let id = self.session.points.add(what, "gdb", false);
            self.points.push(GdbPoint { id, kind: asked, addr });
        }
        true
    }

    fn remove(&mut self, asked: GdbPointKind, addr: u32) -> bool {
        let Some(at) = self.points.iter().position(|set| (set.kind, set.addr) == (asked, addr)) else { return false };
        self.session.points.remove(self.points.remove(at).id)
    }

    /// Removes all points of gdb, after it has disconnected.
    pub(crate) fn remove_all(&mut self) {
        for set in std::mem::take(&mut self.points) {
            self.session.points.remove(set.id);
        }
    }

    fn trigger(&self, asked: GdbPointKind, addr: u32) -> Option<PointTrigger> {
        let GdbPointKind::Watch(kind, len) = asked else {
            return Some(PointTrigger::Code(vec![self.layout.program_word(addr)?]));
        };
        let (memory, offset) = self.layout.find_memory(addr, len.try_into().ok()?)?;
        if len == 0 {
            return None;
        }
        let end = (offset + len).div_ceil(memory.width);
        let range = AddressRange { space: memory.space, start: offset / memory.width, end };
        self.session.scope.source().names.check_observable(&range).ok()?;
        let access = match kind {
            WatchKind::Write => AccessKind::Write,
            WatchKind::Read => AccessKind::Read,
            WatchKind::ReadWrite => AccessKind::Any,
        };
        Some(PointTrigger::Access(range, access))
    }
}

impl Breakpoints for GdbTarget<'_> {
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

impl SwBreakpoint for GdbTarget<'_> {
    fn add_sw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.add(GdbPointKind::Soft, addr))
    }
    fn remove_sw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.remove(GdbPointKind::Soft, addr))
    }
}

impl HwBreakpoint for GdbTarget<'_> {
    fn add_hw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.add(GdbPointKind::Hard, addr))
    }
    fn remove_hw_breakpoint(&mut self, addr: u32, _kind: usize) -> TargetResult<bool, Self> {
        Ok(self.remove(GdbPointKind::Hard, addr))
    }
}

impl HwWatchpoint for GdbTarget<'_> {
    fn add_hw_watchpoint(&mut self, addr: u32, len: u32, kind: WatchKind) -> TargetResult<bool, Self> {
        Ok(self.add(GdbPointKind::Watch(kind, len), addr))
    }
    fn remove_hw_watchpoint(&mut self, addr: u32, len: u32, kind: WatchKind) -> TargetResult<bool, Self> {
        Ok(self.remove(GdbPointKind::Watch(kind, len), addr))
    }
}
