//! All that looks at instructions and accesses as one probe, so that a run with any of it is compiled once.

use emu_core::cpu::{Probe, Subcycle};
use emu_core::lint::Lint;
use emu_core::pins::Time;

use crate::close::Close;
use crate::lints::Lints;
use crate::run::{Along, Memory};
use crate::trace::Look;

/// A probe along whose type is not known.
pub(crate) trait Beside: crate::seer::Seer {
    /// [`Probe::goes`].
    fn goes(&mut self, next: u32, to: u32, taken: bool);
    /// [`Probe::enters`].
    fn enters(&mut self, pc: u32);
    /// [`Probe::breaks`].
    fn breaks(&mut self, pc: u32);
    /// [`Along::passes`].
    fn passes(&mut self, memory: Memory<'_>, pc: u32);
}

impl<A: Along> Beside for A {
    fn goes(&mut self, next: u32, to: u32, taken: bool) {
        Probe::goes(self, next, to, taken);
    }

    fn enters(&mut self, pc: u32) {
        Probe::enters(self, pc);
    }

    fn breaks(&mut self, pc: u32) {
        Probe::breaks(self, pc);
    }

    fn passes(&mut self, memory: Memory<'_>, pc: u32) {
        Along::passes(self, memory, pc);
    }
}

/// Conditions, lints, what shows each instruction, and a probe along.
pub(crate) struct Closer<'a, 'l> {
    pub close: Close,
    pub lints: Option<Lints>,
    pub look: Option<&'a mut Look<'l>>,
    pub along: &'a mut dyn Beside,
}

impl Probe for Closer<'_, '_> {
    const INSN: bool = true;
    const DATA: bool = true;
    const FLOW: bool = true;
    const LINT: bool = true;
    const SUBCYCLE: bool = true;

    fn insn(&mut self, at: u64, pc: u32) -> bool {
        // Where it stops before the instruction, that is told once more.
        if self.look.as_mut().is_some_and(|look| look.insn(at, pc)) {
            return true;
        }
        self.close.insn(at, pc);
        if let Some(lints) = &mut self.lints {
            lints.insn(at, pc);
        }
        self.along.insn(at, pc)
    }

    fn data(&mut self, at: u64, space: u8, addr: u16, value: u8, write: bool) -> bool {
        if let Some(lints) = &mut self.lints {
            lints.data(at, space, addr, value, write);
        }
        let stop = self.look.as_mut().is_some_and(|look| look.data(at, space, addr, value, write));
        self.close.data(at, space, addr, value, write) | stop
    }

    fn goes(&mut self, next: u32, to: u32, taken: bool) {
        self.along.goes(next, to, taken);
    }

    fn enters(&mut self, pc: u32) {
        self.along.enters(pc);
    }

    fn breaks(&mut self, pc: u32) {
        self.along.breaks(pc);
    }

    fn irq(&mut self, at: u64, vector: u8) {
        if let Some(look) = &mut self.look {
            look.irq(at, vector);
        }
        self.along.irq(at, vector);
    }

    fn lint(&mut self, at: u64, pc: u32, lint: Lint) {
        if let Some(lints) = &mut self.lints {
            lints.lint(at, pc, lint);
        }
    }

    fn subcycle(&mut self, at: Time, phase: Subcycle, pc: u32, word: u16) -> bool {
        self.close.subcycle(at, phase, pc, word)
    }
}
