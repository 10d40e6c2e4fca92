//! The diagnostics of the core: no part of the machine that a program could see, and kept only while a probe asks for them.

use emu_core::cpu::Probe;
use emu_core::lint::Lint;

use crate::hot::{PD, TO};
use crate::turn::{PCLATH, REGISTERS, Turn};

/// The page of an address of program memory (DS33023, section 6.2.4).
const PAGE: u32 = 0x1800;

/// Places of the stack (DS33023, section 6.2.5).
const STACK: u8 = 8;

/// The upper bits of GOTO, below which its target stands.
const GOTO: u16 = 0b101;

/// The interrupt vector.
const VECTOR: u32 = 4;

/// Kept while a probe asks for diagnostics.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Lints {
    /// Return addresses on the stack, up to 8.
    depth: u8,
    chosen: Chosen,
    /// What the service routine found.
    found: Option<Found>,
}

/// Who has chosen the upper bits of targets, and what became of it.
#[derive(Debug, Clone, Copy, Default)]
struct Chosen {
    /// The page from which PCLATH was written last; [`NOBODY`] where the code that runs has had no say in it.
    page: u32,
    /// A call into another page has used it.
    called: bool,
}

/// No page.
const NOBODY: u32 = u32::MAX;

/// What a service routine is to leave as it finds it.
#[derive(Debug, Clone, Copy)]
struct Found {
    /// W, STATUS without TO and PD, and PCLATH.
    context: [u8; 3],
    chosen: Chosen,
}

/// Names of what [`Found::context`] holds.
const SAVED: [&str; 3] = ["W", "STATUS", "PCLATH"];

/// The bits that the instruction `word` means to change of a file register, when W holds `w`; all of them for one that is not
/// about single bits (DS33023, section 29).
const fn meant(word: u16, w: u8) -> u8 {
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
const fn wanted(word: u16) -> u8 {
    match word >> 8 {
        // BCF, BSF: what they do to the others is told of when they write.
        0x10..=0x17 => 0,
        // BTFSC, BTFSS.
        0x18..=0x1F => 1 << (word >> 7 & 7),
        _ => 0xFF,
    }
}

impl<P: Probe> Turn<'_, P> {
    /// Tells the probe what the running instruction does, in its first and only cycle so far.
    fn seldom(&mut self, lint: Lint) {
        let (at, pc) = (self.cycle(), self.running().0);
        self.probe.lint(at, pc, lint);
    }

    /// The same of what goes elsewhere, for which two cycles have been charged by now.
    fn seldom_of_two(&mut self, pc: u32, lint: Lint) {
        let at = self.cycle().saturating_sub(1);
        self.probe.lint(at, pc, lint);
    }

    /// A register of the chip is read.
    pub(crate) fn lint_read(&mut self, place: u16) {
        let bits = self.bus.analog_bits(place - REGISTERS) & wanted(self.running().1);
        if bits != 0 {
            let port = self.address();
            self.seldom(Lint::AnalogRead { port, bits });
        }
    }

    /// A register of the chip or of the core is about to be written.
    pub(crate) fn lint_write(&mut self, place: u16, value: u8) {
        if place == PCLATH {
            self.lints.chosen = Chosen { page: self.running().0 & PAGE, called: false };
        }
        let register = place.checked_sub(REGISTERS);
        if let Some(channel) = register.and_then(|reg| self.bus.converts_early(reg, value, self.cycle())) {
            self.seldom(Lint::EarlyConversion { channel });
        }
        let latch = register.and_then(|reg| self.bus.latch(reg));
        if let Some(latch) = latch {
            let bits = (latch ^ value) & !meant(self.running().1, self.hot.w as u8);
            if bits != 0 {
                let port = self.address();
                self.seldom(Lint::ForeignLatch { port, bits });
            }
        }
    }

    /// GOTO and CALL go to `target`. That page was not chosen here when code in another page has written PCLATH; nor, for GOTO,
    /// when it was chosen for a call that has returned. Several calls after one choice are usual.
    pub(crate) fn lint_go(&mut self, target: u32) {
        let (from, word) = self.running();
        if (target ^ from) & PAGE == 0 {
            return;
        }
        let (chosen, jumps) = (self.lints.chosen, word >> 11 == GOTO);
        if chosen.page != from & PAGE || jumps && chosen.called {
            self.seldom_of_two(from, Lint::Page { target: target as u16 });
        }
        self.lints.chosen.called |= !jumps;
    }

    /// A return address is about to be pushed, by what stands at `pc`.
    pub(crate) fn lint_push(&mut self, pc: u32) {
        if self.lints.depth == STACK {
            self.seldom_of_two(pc, Lint::StackOverflow);
        } else {
            self.lints.depth += 1;
        }
    }

    /// A return address is about to be popped.
    pub(crate) fn lint_pop(&mut self) {
        match self.lints.depth.checked_sub(1) {
            Some(depth) => self.lints.depth = depth,
            None => self.seldom_of_two(self.running().0, Lint::StackUnderflow),
        }
    }

    /// An interrupt is entered, its cycles charged, the program counter still that of the interrupted code.
    pub(crate) fn lint_interrupt(&mut self) {
        self.lint_push(VECTOR);
        self.lints.found = Some(Found { context: self.context(), chosen: self.lints.chosen });
        self.lints.chosen.page = NOBODY;
    }

    /// RETFIE, before it returns.
    pub(crate) fn lint_interrupt_ended(&mut self) {
        let Some(found) = self.lints.found.take() else { return };
        let (now, pc) = (self.context(), self.running().0);
        for ((register, was), is) in SAVED.into_iter().zip(found.context).zip(now) {
            if was != is {
                self.seldom_of_two(pc, Lint::NotSaved { register });
            }
        }
        // A routine that puts PCLATH back has not chosen a page for what it interrupted, and one that does not even less.
        let kept = found.context[2] == now[2];
        self.lints.chosen = if kept { found.chosen } else { Chosen { page: NOBODY, called: false } };
    }

    /// SLEEP has done nothing. With interrupts enabled the flag has come just now and is about to be served, as it is to be.
    pub(crate) fn lint_no_sleep(&mut self) {
        if !self.bus.interrupts_enabled() {
            self.seldom(Lint::NoSleep);
        }
    }

    fn context(&self) -> [u8; 3] {
        [self.hot.w as u8, self.hot.status() & !(TO | PD) as u8, self.hot.pclath as u8]
    }
}
