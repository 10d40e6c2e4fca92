//! What programs do that is allowed, but seldom meant: diagnostics that a [`Probe`](crate::cpu::Probe) can ask for.

use std::fmt;

use diag::Code;

/// Something that a program is rarely meant to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Lint {
    /// A port was read some of whose pins are analog inputs: those read 0 whatever their level.
    AnalogRead {
        /// Address of the port.
        port: u16,
        /// The pins, one bit each.
        bits: u8,
    },
    /// An instruction that reads a port, changes it and writes it back has changed bits of its latch that it does not name,
    /// because their pins were not at the level of the latch.
    ForeignLatch {
        /// Address of the port.
        port: u16,
        /// The bits.
        bits: u8,
    },
    /// A call or an interrupt was pushed over the oldest return address.
    StackOverflow,
    /// A return took an address that no call had left.
    StackUnderflow,
    /// A jump or call left its page by upper address bits that code in another page had set.
    Page {
        /// Where it went, in program words.
        target: u16,
    },
    /// A service routine has returned with another value in a register than it found.
    NotSaved {
        /// The register.
        register: &'static str,
    },
    /// RAM was read that nothing has written since power-up.
    UnknownRead {
        /// The memory, as the chip's row names it.
        space: &'static str,
        /// Address in it.
        addr: u16,
    },
    /// An instruction that puts the chip to sleep has done nothing, because a flag that would wake it was set already, and no
    /// interrupt was to come of it.
    NoSleep,
}

/// The codes of lints: row by row in the order of the variants of [`Lint`].
#[rustfmt::skip]
pub const CODES: &[Code] = &[
    Code { code: "LINT001", title: "a port is read whose pins are analog inputs",
        explain: "A pin that is an analog input reads 0 whatever its level. After power-up most pins that can be analog are. \
                  BTFSC and BTFSS are held to the pin that they test, other instructions that read the port to all of its \
                  pins. Mend: make the pins digital first: ADCON1, ANSEL or CMCON, by chip." },
    Code { code: "LINT002", title: "bits of a port's latch are changed along with others",
        explain: "BSF, BCF, IORWF, ANDWF and XORWF read all pins of a port and write all of its latch. A pin that is not at the \
                  level of its latch (an input, a pin with a load, one that was written just before, an analog one) changes its \
                  latch so, which shows when it becomes an output. Mend: keep a copy of the port in RAM, change that and write \
                  it whole." },
    Code { code: "LINT003", title: "the stack is full",
        explain: "The stack of a PIC16 has eight places, and a call or an interrupt takes one. The ninth overwrites the oldest \
                  return address, and nothing tells the program. Mend: nest fewer calls, and leave a place for the interrupt." },
    Code { code: "LINT004", title: "a return without a call",
        explain: "RETURN, RETLW or RETFIE with an empty stack goes to whatever address its place holds: often an old one. Mend: \
                  leave by GOTO what was reached by GOTO." },
    Code { code: "LINT005", title: "a jump or call into a page that was not chosen here",
        explain: "GOTO and CALL take the upper bits of their target from PCLATH. This one left its page, but PCLATH was last \
                  written by code in another page: by a routine that was called, or by the caller. Mend: set PCLATH before the \
                  jump or call (pagesel), and again after a call into another page." },
    Code { code: "LINT006", title: "a service routine changes what it interrupts",
        explain: "After RETFIE a register holds something else than when the interrupt came, so the interrupted code goes on \
                  with a wrong W, wrong flags or bank, or a wrong page. Mend: save W, STATUS and PCLATH first in the service \
                  routine and restore them last, with SWAPF, which leaves the flags alone." },
    Code { code: "LINT007", title: "RAM is read that was never written",
        explain: "After power-up RAM holds anything, and something else on the next chip. The emulator fills it with zeros unless \
                  --ram says otherwise, so such a program may run well here and fail on the desk. Bytes that the image fills \
                  count as written; every byte is told of once. Mend: write it first." },
    Code { code: "LINT008", title: "SLEEP does nothing",
        explain: "SLEEP is a NOP while an interrupt flag and its enable bit are set, and with GIE clear nothing else tells of it. \
                  A flag that nothing clears makes every SLEEP a NOP. Mend: clear the flag before SLEEP." },
];

impl Lint {
    /// Its row of [`CODES`].
    #[must_use]
    pub const fn row(&self) -> &'static Code {
        let row = match self {
            Lint::AnalogRead { .. } => 0,
            Lint::ForeignLatch { .. } => 1,
            Lint::StackOverflow => 2,
            Lint::StackUnderflow => 3,
            Lint::Page { .. } => 4,
            Lint::NotSaved { .. } => 5,
            Lint::UnknownRead { .. } => 6,
            Lint::NoSleep => 7,
        };
        &CODES[row]
    }

    /// Stable code.
    #[must_use]
    pub const fn code(&self) -> &'static str {
        self.row().code
    }

    /// What to do about it, one sentence.
    #[must_use]
    pub const fn hint(&self) -> &'static str {
        match self {
            Lint::AnalogRead { .. } => "make the pins digital first (ADCON1, ANSEL, CMCON)",
            Lint::ForeignLatch { .. } => "keep a copy of the port in RAM, change that and write it whole",
            Lint::StackOverflow => "the stack has eight places, interrupts included; nest fewer calls",
            Lint::StackUnderflow => "return only from what was called",
            Lint::Page { .. } => "set PCLATH before the jump or call, and again after a call into another page",
            Lint::NotSaved { .. } => "save W, STATUS and PCLATH first in the service routine and restore them last",
            Lint::UnknownRead { .. } => "write the cell first; after power-up RAM holds anything",
            Lint::NoSleep => "clear the flag before SLEEP",
        }
    }
}

impl fmt::Display for Lint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Lint::AnalogRead { port, bits } => {
                write!(
                    f,
                    "the port at 0x{port:02x} is read, of which the bits 0x{bits:02x} are analog inputs and read 0"
                )
            }
            Lint::ForeignLatch { port, bits } => {
                write!(
                    f,
                    "the bits 0x{bits:02x} of the latch of the port at 0x{port:02x} are changed along with others"
                )
            }
            Lint::StackOverflow => f.write_str("the stack is full: the oldest return address is overwritten"),
            Lint::StackUnderflow => f.write_str("a return without a call"),
            Lint::Page { target } => {
                write!(f, "goes to 0x{target:04x}, in a page that PCLATH was not set for in this one")
            }
            Lint::NotSaved { register } => write!(f, "the service routine returns with another value in {register}"),
            Lint::UnknownRead { space, addr } => write!(f, "{space}:0x{addr:02x} is read before it was written"),
            Lint::NoSleep => f.write_str("SLEEP does nothing: a flag that would end it is set already"),
        }
    }
}
