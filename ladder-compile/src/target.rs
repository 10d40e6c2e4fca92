//! What a back end is asked for and what it gives: the same for every family.

use emu_core::chip::{Chip, ChipFamily};
use ladder::ElementId;

use crate::CodegenError;
use crate::ir::Ir;
use crate::map::{CellLocation, Ratio, SpecialPin};
use crate::pins::AssignedPin;

/// A chip that there is a compiler for.
#[derive(Debug)]
pub struct CompileTarget {
    /// Its row.
    pub chip: &'static Chip,
    /// The pins that a program may use, in the order in which they are given out; those with a second job come last.
    pub pins: &'static [&'static str],
    /// Transmitter and receiver of the serial line that programs use.
    pub uart: Option<(&'static str, &'static str)>,
    /// Pin of the PWM output.
    pub pwm: Option<&'static str>,
    /// Pins that the converter reads, with their channel.
    pub adc: &'static [(&'static str, u8)],
    /// Bytes of EEPROM, 0 where there is none.
    pub eeprom: u16,
    /// Makes an image.
    pub build: fn(&CompileJob<'_>) -> Result<BuiltImage, BuildRefusal>,
}

impl CompileTarget {
    /// The chip has timers and counters as modules: what is lowered for it keeps them whole.
    #[must_use]
    pub fn has_modules(&self) -> bool {
        self.chip.family == ChipFamily::Ap101
    }

    /// A pin can be an output, or else an input. Only a controller with channels has pins that cannot be both.
    #[must_use]
    pub fn can_use_pin(&self, pin: &str, output: bool) -> bool {
        self.chip.family != ChipFamily::Ap101 || pin.starts_with('E') == output
    }
}

/// One compilation.
#[derive(Debug, Clone, Copy)]
pub struct CompileJob<'a> {
    /// The scan.
    pub ir: &'a Ir,
    /// The chip.
    pub target: &'static CompileTarget,
    /// Pins of inputs, outputs and analog inputs.
    pub pins: &'a [AssignedPin],
    /// Clock in Hz, above 0.
    pub clock_hz: u64,
    /// Time of a scan in microseconds, above 0.
    pub cycle_us: u64,
    /// Speed of the serial line in bits per second, above 0; there whenever the program uses the line.
    pub baud: Option<u64>,
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BuildRefusal {
    /// The code does not fit: bytes that it needs, bytes that there are.
    CodeTooLarge {
        /// Bytes of code.
        needed: u64,
        /// Bytes of program memory.
        available: u64,
        /// Bytes of each rung, by its number from 0.
        rungs: Vec<u64>,
    },
    /// The data do not fit.
    RamTooSmall {
        /// Bytes of data and stack.
        needed: u64,
        /// Bytes of RAM.
        available: u64,
    },
    /// The period cannot be paced: the shortest and longest that can be, in microseconds.
    PeriodOutOfRange {
        /// Shortest.
        shortest: u64,
        /// Longest.
        longest: u64,
    },
    /// The serial line cannot be that fast or slow: the nearest speed in bits per second.
    BaudOutOfRange {
        /// Nearest that there is.
        nearest: u64,
    },
    /// The PWM output cannot have that frequency.
    PwmOutOfRange {
        /// Nearest that there is, in Hz.
        nearest: u64,
    },
    /// Anything else that the chip does not have: cause and hint.
    Unsupported {
        /// What and where.
        cause: String,
        /// What to do.
        hint: String,
        /// The element that asks for it, where there is one.
        element: Option<ElementId>,
    },
    /// Several reasons at once, each of the kinds above.
    Several(Vec<BuildRefusal>),
    /// A fault of the compiler.
    Internal(CodegenError),
}

/// A place that the map or the listing wants to know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CodeMark {
    /// A part of the image that belongs to no rung.
    Section(&'static str),
    /// The next instruction starts the timer when it ends.
    TimerStart,
    /// The loop that waits for the match.
    PollLoop,
    /// The first instruction of a scan.
    ScanStart,
    /// A rung, from 0.
    Rung(u32),
    /// An element.
    Element(ElementId),
    /// An operation of a rung, both by number from 0: for listings of code that is not optimised. A back end that sets none gets
    /// the operations listed element by element.
    Step {
        /// The rung.
        rung: u32,
        /// The operation, an index into its steps.
        step: u32,
    },
    /// The end of the last rung.
    RungsEnd,
    /// The last instruction of a scan.
    ScanEnd,
    /// Behind the scan.
    AfterScan,
}

/// One instruction, or one line of data, of a finished image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageLine {
    /// Address in the chip's words.
    pub addr: u32,
    /// Its words.
    pub words: Vec<u16>,
    /// The instruction as the chip's disassembler prints it; empty for data.
    pub text: String,
    /// Where a branch, jump or call goes, in the chip's words.
    pub target: Option<u32>,
}

/// A finished image with all that is known of it. Code addresses are the chip's words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuiltImage {
    /// What the HEX file holds: byte address in the file, and bytes.
    pub segments: Vec<(u32, Vec<u8>)>,
    /// The code, by address.
    pub lines: Vec<ImageLine>,
    /// The marks, by address.
    pub marks: Vec<(CodeMark, u32)>,
    /// Places of the bit cells.
    pub bit_places: Vec<CellLocation>,
    /// Places of the word cells.
    pub word_places: Vec<CellLocation>,
    /// Time of a scan in machine cycles.
    pub period: Ratio,
    /// Machine cycles of the shortest period.
    pub shortest_period_cycles: u64,
    /// Machine cycles per tick of the pacing timer.
    pub tick_cycles: u32,
    /// The longest time in machine cycles from a match to the first instruction of its scan.
    pub poll_cycles: u64,
    /// The longest path of a scan in machine cycles, from its first instruction back to the loop that waits.
    pub worst_scan_cycles: u64,
    /// The longest path of each rung in machine cycles.
    pub rung_cycles: Vec<u64>,
    /// Bytes of RAM in use, the stack not counted.
    pub ram_bytes: u32,
    /// What the image needs of fuses or configuration words, one line each.
    pub fuses: Vec<String>,
    /// Pins with another job than input and output, with their figures.
    pub specials: Vec<SpecialPin>,
    /// What the user should know, cause and hint: an output that cannot go high by itself.
    pub warnings: Vec<(String, String)>,
}
