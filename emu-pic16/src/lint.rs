//! Run-time diagnostics of the PIC16: suspicious behaviour of a program, tracked only while a probe asks for
//! it. The tracked state is not part of the machine; a program cannot see it.

use emu_core::cpu::Probe;
use emu_core::lint::Lint;

use crate::core_state::{PD, TO};
use crate::executor::{Executor, PCLATH, REGISTERS, RunningInstruction};

/// Mask of the page in an address of program memory (DS33023, section 6.2.4).
const PAGE_MASK: u32 = 0x1800;

/// Number of stack entries (DS33023, section 6.2.5).
const STACK_DEPTH: u8 = 8;

/// The upper three bits of GOTO; the target is in the lower eleven.
const GOTO_BITS: u16 = 0b101;

/// Word address of the interrupt vector.
const INTERRUPT_VECTOR: u32 = 4;

/// State of the diagnostics.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LintState {
    /// Number of return addresses on the stack, up to 8.
    depth: u8,
    page_choice: PageChoice,
    /// Context of the interrupted code; None outside a service routine.
    saved_context: Option<InterruptedContext>,
}

/// Tracks which code has selected the page of jump targets.
#[derive(Debug, Clone, Copy, Default)]
struct PageChoice {
    /// Page of the code that last wrote PCLATH; [`NO_PAGE`] if it was not the current code.
    page: u32,
    /// True if a call into another page has used the selection.
    used_by_call: bool,
}

/// Marks that the current code has selected no page.
const NO_PAGE: u32 = u32::MAX;

/// Context that a service routine must preserve.
#[derive(Debug, Clone, Copy)]
struct InterruptedContext {
    /// W, STATUS without TO and PD, and PCLATH.
    context: [u8; 3],
    chosen: PageChoice,
}

/// Names of the registers in [`InterruptedContext::context`].
const CONTEXT_NAMES: [&str; 3] = ["W", "STATUS", "PCLATH"];

/// Returns the bits of a file register that the instruction `word` intends to change, with `w` in W; all bits
/// for an instruction that is not about single bits (DS33023, section 29).
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

/// Returns the bits that the instruction `word` uses of a file register that it reads; none if it only writes
/// them back.
const fn port_bits_read(word: u16) -> u8 {
    match word >> 8 {
        // BCF, BSF: changes of the other bits are reported at the write.
        0x10..=0x17 => 0,
        // BTFSC, BTFSS.
        0x18..=0x1F => 1 << (word >> 7 & 7),
        _ => 0xFF,
    }
}

impl<P: Probe> Executor<'_, P> {
    /// Reports to the probe a lint of the current instruction, in its first and only cycle so far.
    fn report_lint(&mut self, lint: Lint) {
        let (at, pc) = (self.cycle(), self.running_instruction().pc);
        self.probe.on_lint(at, pc, lint);
    }

    /// Reports a lint of a jump, for which two cycles have already been charged.
    fn report_lint_at(&mut self, pc: u32, lint: Lint) {
        let at = self.cycle().saturating_sub(1);
        self.probe.on_lint(at, pc, lint);
    }

    /// Checks a read of a register of the chip.
    pub(crate) fn lint_read(&mut self, file_address: u16) {
        let bits = self.bus.analog_bits(file_address - REGISTERS) & port_bits_read(self.running_instruction().word);
        if bits != 0 {
            let port = self.address();
            self.report_lint(Lint::AnalogRead { port, bits });
        }
    }

    /// Checks a write of a register of the chip or of the core.
    pub(crate) fn lint_write(&mut self, file_address: u16, value: u8) {
        if file_address == PCLATH {
            self.lints.page_choice =
                PageChoice { page: self.running_instruction().pc & PAGE_MASK, used_by_call: false };
        }
        let register = file_address.checked_sub(REGISTERS);
        if let Some(channel) = register.and_then(|reg| self.bus.converts_early(reg, value, self.cycle())) {
            self.report_lint(Lint::EarlyConversion { channel });
        }
        let latch = register.and_then(|reg| self.bus.latch(reg));
        if let Some(latch) = latch {
            let bits = (latch ^ value) & !intended_bits(self.running_instruction().word, self.core.w as u8);
            if bits != 0 {
                let port = self.address();
                self.report_lint(Lint::UnintendedLatchChange { port, bits });
            }
        }
    }

    /// Checks a GOTO or CALL to `target` in another page. The page was not selected here if code in another
    /// page has written PCLATH, or, for GOTO, if it was selected for a call that has returned. Several calls
    /// after one selection are usual.
    pub(crate) fn lint_jump(&mut self, target: u32) {
        let RunningInstruction { pc: from, word } = self.running_instruction();
        if (target ^ from) & PAGE_MASK == 0 {
            return;
        }
        let (chosen, jumps) = (self.lints.page_choice, word >> 11 == GOTO_BITS);
        if chosen.page != from & PAGE_MASK || jumps && chosen.used_by_call {
            self.report_lint_at(from, Lint::PageNotSelected { target: target as u16 });
        }
        self.lints.page_choice.used_by_call |= !jumps;
    }

    /// Checks the push of a return address by the instruction at `pc`.
    pub(crate) fn lint_push(&mut self, pc: u32) {
        if self.lints.depth == STACK_DEPTH {
            self.report_lint_at(pc, Lint::StackOverflow);
        } else {
            self.lints.depth += 1;
        }
    }

    /// Checks the pop of a return address.
    pub(crate) fn lint_pop(&mut self) {
        match self.lints.depth.checked_sub(1) {
            Some(depth) => self.lints.depth = depth,
            None => self.report_lint_at(self.running_instruction().pc, Lint::StackUnderflow),
        }
    }

    /// Handles the entry of an interrupt. Its cycles are charged; the program counter is still that of the
    /// interrupted code.
    pub(crate) fn lint_interrupt(&mut self) {
        self.lint_push(INTERRUPT_VECTOR);
        self.lints.saved_context = Some(InterruptedContext { context: self.context(), chosen: self.lints.page_choice });
        self.lints.page_choice.page = NO_PAGE;
    }

    /// Checks that a service routine has preserved its context, before RETFIE returns.
    pub(crate) fn lint_interrupt_ended(&mut self) {
        let Some(found) = self.lints.saved_context.take() else { return };
        let (now, pc) = (self.context(), self.running_instruction().pc);
        for ((register, was), is) in CONTEXT_NAMES.into_iter().zip(found.context).zip(now) {
            if was != is {
                self.report_lint_at(pc, Lint::NotSaved { register });
            }
        }
        // Whether or not the routine has restored PCLATH, it has not selected a page for the interrupted
        // code.
        let kept = found.context[2] == now[2];
        self.lints.page_choice = if kept { found.chosen } else { PageChoice { page: NO_PAGE, used_by_call: false } };
    }

    /// Checks a SLEEP that had no effect. With interrupts enabled this is correct: a flag was set just now
    /// and will be served.
    pub(crate) fn lint_no_sleep(&mut self) {
        if !self.bus.interrupts_enabled() {
            self.report_lint(Lint::SleepIgnored);
        }
    }

    fn context(&self) -> [u8; 3] {
        [self.core.w as u8, self.core.status() & !(TO | PD) as u8, self.core.pclath as u8]
    }
}
