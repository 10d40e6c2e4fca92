//! The parts of a program besides its rungs: dialect, header, settings, the entries of the lists, and what an
//! element is with its place.

use std::fmt;

use diag::Pos;
use serde::Serialize;

use crate::model::Element;

/// Dialect: the set of rules that gives the elements their meaning. The same text may behave differently
/// under each, so a program always states its dialect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
pub enum LadderDialect {
    /// LDmicro release 2.3: 16-bit integers, unbounded CTU and CTD, RES stores zero. Default for files with
    /// the 0.1 header.
    #[serde(rename = "ldmicro-2.3")]
    Ldmicro23,
    /// LDmicro 5.x: declared widths, bounded counters, RES stores the start value. Default for files with the
    /// 0.2 header.
    #[serde(rename = "ldmicro-5")]
    Ldmicro5,
    /// IEC 61131-3: typed variables and Instruction List.
    #[serde(rename = "iec")]
    Iec,
}

impl fmt::Display for LadderDialect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            LadderDialect::Ldmicro23 => "ldmicro-2.3",
            LadderDialect::Ldmicro5 => "ldmicro-5",
            LadderDialect::Iec => "iec",
        })
    }
}

/// Header of a `.ld` file. The reader accepts both spellings of every line under either header.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
pub enum LdFormat {
    /// `LDmicro0.1`.
    V01,
    /// `LDmicro0.2`.
    V02,
}

/// Spellings of a file that have no meaning. The writer reproduces them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct SourceStyle {
    /// Text after `LDmicro` in a header that is neither `LDmicro0.1` nor `LDmicro0.2`; empty for the bare
    /// header of LDmicro 5.4. `None` for the header of `LadderProgram::format`.
    pub header: Option<String>,
    /// True if each rung has its number, from 1, after `RUNG`.
    pub rung_numbers: bool,
    /// True if the lines of the file end with CR LF, as LDmicro writes them; [`crate::write_bytes`] does so
    /// too.
    pub crlf: bool,
}

/// Settings of a program. Text fields keep the spelling of the file so that the writer reproduces it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramSettings {
    /// `MICRO=`: LDmicro's exact name of the chip; `None` if no chip is chosen.
    pub micro: Option<String>,
    /// `CYCLE=`: time of one scan in microseconds; 0 selects LDmicro 5's free-running scan.
    pub cycle_us: u64,
    /// Text after the number of `CYCLE=` (` us at Timer1, YPlcCycleDuty:0`), trimmed; empty in 0.1 files.
    pub cycle_rest: String,
    /// `CRYSTAL=`: clock frequency in Hz.
    pub crystal_hz: u64,
    /// Text after the number of `CRYSTAL=`, trimmed; usually empty or `Hz`.
    pub crystal_rest: String,
    /// `BAUD=`: serial rate in bits per second; `None` if the line is absent.
    pub baud: Option<u64>,
    /// Text after the number of `BAUD=`, trimmed.
    pub baud_rest: String,
    /// `COMPILER=`, LDmicro 5's back end, as written.
    pub compiler: Option<String>,
    /// `COMPILED=`: path of the last output; it has no effect.
    pub compiled: Option<String>,
}

/// One line of `IO LIST`: `name at pin`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IoEntry {
    /// Name of the symbol, such as `Xbutton`.
    pub name: String,
    /// Package pin of the chip named by `MICRO=`; 0 means not assigned.
    pub pin: u32,
    /// The two Modbus numbers (slave, address) of 0.2 files, if written.
    pub modbus: Option<(u32, u32)>,
    /// Position of the line.
    pub pos: Pos,
}

/// One line of `VAR LIST`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VarEntry {
    /// Name as written; a name that no element can have (`#PORTB`, `148`, `name[0]`) has no effect.
    pub name: String,
    /// Width in bytes, 1 to 4. Of several lines with one name the last counts.
    pub bytes: u8,
    /// The line as written (trimmed), because two spellings exist.
    pub text: String,
    /// Position of the line.
    pub pos: Pos,
}

/// An element of a program, with its identity and its position in the file.
#[derive(Debug, Clone, Copy)]
pub struct ProgramElement<'a> {
    /// Rung and number in the rung.
    pub id: ElementId,
    /// What it is.
    pub element: &'a Element,
    /// Line and column.
    pub pos: Pos,
}

/// Identifies one element of a program: the `index`-th leaf (from 0, in text order) of rung `rung` (from 0).
///
/// `Display` counts from 1: rung 3, element 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct ElementId {
    /// Index of the rung, from 0.
    pub rung: u32,
    /// Index of the leaf within its rung in text order, from 0.
    pub index: u32,
}

impl std::fmt::Display for ElementId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "rung {}, element {}", self.rung + 1, self.index + 1)
    }
}
