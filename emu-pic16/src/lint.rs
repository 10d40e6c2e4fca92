//! The diagnostics of the core: no part of the machine that a program could see, and kept only while a probe asks for them.

use emu_core::cpu::Probe;
use emu_core::lint::Lint;

use crate::core_state::{PD, TO};
use crate::executor::{Executor, PCLATH, REGISTERS};

/// The page of an address of program memory (DS33023, section 6.2.4).
const PAGE_MASK: u32 = 0x1800;

/// Places of the stack (DS33023, section 6.2.5).
const STACK_DEPTH: u8 = 8;

/// The upper bits of GOTO, below which its target stands.
const GOTO_BITS: u16 = 0b101;

/// The interrupt vector.
const INTERRUPT_VECTOR: u32 = 4;

/// Kept while a probe asks for diagnostics.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LintState {
    /// Return addresses on the stack, up to 8.
    depth: u8,
    page_choice: PageChoice,
    /// What the service routine found.
    saved_context: Option<InterruptedContext>,
}

/// Who has chosen the upper bits of targets, and what became of it.
#[derive(Debug, Clone, Copy, Default)]
struct PageChoice {
    /// The page from which PCLATH was written last; [`NO_PAGE`] where the code that runs has had no say in it.
    page: u32,
    /// A call into another page has used it.
    used_by_call: bool,
}

/// No page.
const NO_PAGE: u32 = u32::MAX;

/// What a service routine is to leave as it finds it.
#[derive(Debug, Clone, Copy)]
struct InterruptedContext {
    /// W, STATUS without TO and PD, and PCLATH.
    context: [u8; 3],
    chosen: PageChoice,
}

/// Names of what [`InterruptedContext::context`] holds.
const CONTEXT_NAMES: [&str; 3] = ["W", "STATUS", "PCLATH"];

/// The bits that the instruction `word` means to change of a file register, when W holds `w`; all of them for one that is not
/// about single bits (DS33023, section 29).
const fn intended_bits(word: u16, w: u8) -> u8 {
    match word >> 8 {
        // BCF, BSF.
        0x10..=0x17 => 1 << (word >> 7 & 7),
        // IORWF, XORWF.
        0x04 | 0x06 => w,
        // ANDWF.
        0x05 => !w,
        _ => 0xFF,
    }
}

/// The bits that the instruction `word` wants to know of a file register that it reads: none where it only writes them back.
const fn port_bits_read(word: u16) -> u8 {
    match word >> 8 {
        // BCF, BSF: what they do to the others is told of when they write.
        0x10..=0x17 => 0,
        // BTFSC, BTFSS.
        0x18..=0x1F => 1 << (word >> 7 & 7),
        _ => 0xFF,
    }
}

impl<P: Probe> Executor<'_, P> {
    /// Tells the probe what the running instruction does, in its first and only cycle so far.
    fn report_lint(&mut self, lint: Lint) {
        let (at, pc) = (self.cycle(), self.running_instruction().0);
        self.probe.on_lint(at, pc, lint);
    }

    /// The same of what goes elsewhere, for which two cycles have been charged by now.
    fn report_lint_at(&mut self, pc: u32, lint: Lint) {
        let at = self.cycle().saturating_sub(1);
        self.probe.on_lint(at, pc, lint);
    }

    /// A register of the chip is read.
    pub(crate) fn lint_read(&mut self, place: u16) {
        let bits = self.bus.analog_bits(place - REGISTERS) & port_bits_read(self.running_instruction().1);
        if bits != 0 {
            let port = self.address();
            self.report_lint(Lint::AnalogRead { port, bits });
        }
    }

    /// A register of the chip or of the core is about to be written.
    pub(crate) fn lint_write(&mut self, place: u16, value: u8) {
        if place == PCLATH {
            self.lints.page_choice = PageChoice { page: self.running_instruction().0 & PAGE_MASK, used_by_call: false };
        }
        let register = place.checked_sub(REGISTERS);
        if let Some(channel) = register.and_then(|reg| self.bus.converts_early(reg, value, self.cycle())) {
            self.report_lint(Lint::EarlyConversion { channel });
        }
        let latch = register.and_then(|reg| self.bus.latch(reg));
        if let Some(latch) = latch {
            let bits = (latch ^ value) & !intended_bits(self.running_instruction().1, self.core.w as u8);
            if bits != 0 {
                let port = self.address();
                self.report_lint(Lint::ForeignLatch { port, bits });
            }
        }
    }

    /// GOTO and CALL go to `target`. That page was not chosen here when code in another page has written PCLATH; nor, for GOTO,
    /// when it was chosen for a call that has returned. Several calls after one choice are usual.
    pub(crate) fn lint_jump(&mut self, target: u32) {
        let (from, word) = self.running_instruction();
        if (target ^ from) & PAGE_MASK == 0 {
            return;
        }
        let (chosen, jumps) = (self.lints.page_choice, word >> 11 == GOTO_BITS);
        if chosen.page != from & PAGE_MASK || jumps && chosen.used_by_call {
            self.report_lint_at(from, Lint::Page { target: target as u16 });
        }
        self.lints.page_choice.used_by_call |= !jumps;
    }

    /// A return address is about to be pushed, by what stands at `pc`.
    pub(crate) fn lint_push(&mut self, pc: u32) {
        if self.lints.depth == STACK_DEPTH {
            self.report_lint_at(pc, Lint::StackOverflow);
        } else {
            self.lints.depth += 1;
        }
    }

    /// A return address is about to be popped.
    pub(crate) fn lint_pop(&mut self) {
        match self.lints.depth.checked_sub(1) {
            Some(depth) => self.lints.depth = depth,
            None => self.report_lint_at(self.running_instruction().0, Lint::StackUnderflow),
        }
    }

    /// An interrupt is entered, its cycles charged, the program counter still that of the interrupted code.
    pub(crate) fn lint_interrupt(&mut self) {
        self.lint_push(INTERRUPT_VECTOR);
        self.lints.saved_context = Some(InterruptedContext { context: self.context(), chosen: self.lints.page_choice });
        self.lints.page_choice.page = NO_PAGE;
    }

    /// RETFIE, before it returns.
    pub(crate) fn lint_interrupt_ended(&mut self) {
        let Some(found) = self.lints.saved_context.take() else { return };
        let (now, pc) = (self.context(), self.running_instruction().0);
        for ((register, was), is) in CONTEXT_NAMES.into_iter().zip(found.context).zip(now) {
            if was != is {
                self.report_lint_at(pc, Lint::NotSaved { register });
            }
        }
        // A routine that puts PCLATH back has not chosen a page for what it interrupted, and one that does not even less.
        let kept = found.context[2] == now[2];
        self.lints.page_choice = if kept { found.chosen } else { PageChoice { page: NO_PAGE, used_by_call: false } };
    }

    /// SLEEP has done nothing. With interrupts enabled the flag has come just now and is about to be served, as it is to be.
    pub(crate) fn lint_no_sleep(&mut self) {
        if !self.bus.interrupts_enabled() {
            self.report_lint(Lint::SleepIgnored);
        }
    }

    fn context(&self) -> [u8; 3] {
        [self.core.w as u8, self.core.status() & !(TO | PD) as u8, self.core.pclath as u8]
    }
}
