//! The model of a ladder program: what was written, nothing of what it means.
//!
//! A program is a list of rungs; a rung is a series of nodes; a node is an element or a group of parallel branches; a
//! branch is a series again. This is the nesting of LDmicro's `.ld` text. Meaning lives in `ladder-eval` and, told
//! independently, in `ladder-compile`; both share this model and nothing else.

use diag::Pos;
use serde::Serialize;

use crate::element_facts::ChipPart;
pub use crate::operators::{CompareOp, MathOp, ShiftOp, UnaryOp};

/// Which set of meanings the elements have. Same text, different behaviour: a program always states its dialect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
pub enum LadderDialect {
    /// LDmicro release 2.3: 16-bit integers everywhere, unbounded CTU and CTD, RES to zero. Default for 0.1 files.
    #[serde(rename = "ldmicro-2.3")]
    Ldmicro23,
    /// LDmicro 5.x: widths by declaration, bounded counters, RES to a start value. Default for 0.2 files.
    #[serde(rename = "ldmicro-5")]
    Ldmicro5,
}

/// The header of a `.ld` file; both spellings of every line are accepted under either.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
pub enum LdFormat {
    /// `LDmicro0.1`.
    V01,
    /// `LDmicro0.2`.
    V02,
}

/// A whole ladder program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LadderProgram {
    /// Name of the file it was read from, for messages; `-` for standard input.
    pub file: String,
    /// Header of the file.
    pub format: LdFormat,
    /// Set of meanings.
    pub dialect: LadderDialect,
    /// Lines of the head.
    pub settings: ProgramSettings,
    /// `IO LIST`, in file order.
    pub io: Vec<IoEntry>,
    /// `VAR LIST`, in file order; `None` when the file has no such section (an empty section is `Some` of nothing).
    pub vars: Option<Vec<VarEntry>>,
    /// Lines of `PULL-UP LIST` as written (trimmed); `None` when the file has no such section.
    pub pull_ups: Option<Vec<String>>,
    /// Rungs, top to bottom. Rung numbers shown to people start at 1 and count every rung, comments included.
    pub rungs: Vec<Rung>,
}

/// The head of a program. Text fields keep what was written so that writing gives it back.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ProgramSettings {
    /// `MICRO=`: LDmicro's exact name of the chip; `None` when none is chosen.
    pub micro: Option<String>,
    /// `CYCLE=`: time of one scan in microseconds; 0 is LDmicro 5's free-running scan.
    pub cycle_us: u64,
    /// What followed the number of `CYCLE=` (` us at Timer1, YPlcCycleDuty:0`), trimmed; empty in 0.1 files.
    pub cycle_rest: String,
    /// `CRYSTAL=`: clock in Hz.
    pub crystal_hz: u64,
    /// Unit text after the number of `CRYSTAL=`, trimmed, usually empty or `Hz`.
    pub crystal_rest: String,
    /// `BAUD=`: serial rate in bits per second; `None` when the line is absent.
    pub baud: Option<u64>,
    /// What followed the number of `BAUD=`, trimmed.
    pub baud_rest: String,
    /// `COMPILER=`, LDmicro 5's back end, as written.
    pub compiler: Option<String>,
    /// `COMPILED=`, path of the last output; without meaning.
    pub compiled: Option<String>,
}

/// One line of `IO LIST`: `name at pin`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IoEntry {
    /// Symbol, such as `Xbutton`.
    pub name: String,
    /// Package pin of the chip named by `MICRO=`; 0 is not assigned.
    pub pin: u32,
    /// The two Modbus numbers (slave, address) of 0.2 files, when written.
    pub modbus: Option<(u32, u32)>,
    /// Where it stands.
    pub pos: Pos,
}

/// One line of `VAR LIST`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VarEntry {
    /// Symbol.
    pub name: String,
    /// Width in bytes, 1 to 4.
    pub bytes: u8,
    /// The line as written (trimmed): two spellings exist.
    pub text: String,
    /// Where it stands.
    pub pos: Pos,
}

/// One rung: a series from the left rail to the right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rung {
    /// Elements and groups from left to right.
    pub series: Vec<RungNode>,
    /// Line of the `RUNG` keyword.
    pub pos: Pos,
}

/// Something in a series.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RungNode {
    /// One element and the place of its line.
    Leaf(Element, Pos),
    /// Parallel branches, top to bottom, at least one; each is a series of at least one node. In the text a branch of
    /// one leaf is written without `SERIES`.
    Parallel(Vec<Vec<RungNode>>, Pos),
}

/// Names one element of a program: the `index`-th leaf (from 0, in text order) of rung `rung` (from 0).
///
/// Shown to people from 1: rung 3, element 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct ElementId {
    /// Rung, from 0.
    pub rung: u32,
    /// Leaf within the rung in text order, from 0.
    pub index: u32,
}

impl std::fmt::Display for ElementId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "rung {}, element {}", self.rung + 1, self.index + 1)
    }
}

/// An operand that is a variable or a constant.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum LadderOperand {
    /// An integer variable (also a timer's or counter's accumulator).
    Var(String),
    /// A constant, -32768 to 32767 in dialect 2.3, of 32 bits in ldmicro-5.
    Const {
        /// Its value.
        value: i64,
        /// How it was written: `12`, `-3`, `'a'`, `0x1F`.
        text: String,
    },
}

/// Timers, by LDmicro's keyword.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TimerKind {
    /// Turn-on delay.
    Ton,
    /// Turn-off delay.
    Tof,
    /// Retentive turn-on delay.
    Rto,
}

/// Counters, by LDmicro's keyword.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CounterKind {
    /// Up.
    Ctu,
    /// Down.
    Ctd,
    /// Circular.
    Ctc,
}

/// An element (leaf) of a rung. Names keep their first letter: X input, Y output, R internal relay, T timer, C counter,
/// A analog; anything else is a plain integer variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Element {
    /// `COMMENT text`, unescaped; may hold line breaks. Without meaning.
    Comment(String),
    /// `CONTACTS name negated [set1]`.
    Contacts {
        /// X, Y or R symbol.
        name: String,
        /// Normally closed.
        negated: bool,
        /// LDmicro 5's third argument, when written (kept for writing; must be 0 to have a meaning here).
        set1: Option<u32>,
    },
    /// `COIL name negated setOnly resetOnly [ttrigger]`; at most one of the three is set in a meaningful coil.
    Coil {
        /// Y or R symbol.
        name: String,
        /// Stores the complement.
        negated: bool,
        /// Only ever sets.
        set: bool,
        /// Only ever resets.
        reset: bool,
        /// LDmicro 5's fourth flag, when written (must be 0 to have a meaning here).
        ttrigger: Option<u32>,
    },
    /// `SHORT`: passes.
    Short,
    /// `OPEN`: blocks.
    Open,
    /// `PLACEHOLDER`: an empty place of the editor; a program that holds one is not complete.
    Placeholder,
    /// `MASTER_RELAY`.
    MasterRelay,
    /// `OSR`: one scan true on a rising edge.
    Osr,
    /// `OSF`: one scan true on a falling edge.
    Osf,
    /// `TON|TOF|RTO name microseconds [adjust]`.
    Timer {
        /// Which timer.
        kind: TimerKind,
        /// Accumulator, counted in scans.
        name: String,
        /// Delay in microseconds (a variable only in LDmicro 5).
        delay: LadderOperand,
        /// LDmicro 5's adjust, in scans, when written.
        adjust: Option<LadderOperand>,
    },
    /// `CTU|CTD|CTC name max [init kind]`.
    Counter {
        /// Which counter.
        kind: CounterKind,
        /// Accumulator.
        name: String,
        /// Limit (a variable only in LDmicro 5).
        max: LadderOperand,
        /// LDmicro 5's start value, when written.
        init: Option<LadderOperand>,
        /// LDmicro 5's input kind when written: `/` rising, `\` falling, `-` level, `o` inverted level.
        input: Option<char>,
    },
    /// `RES name`.
    Res {
        /// Timer or counter to reset.
        name: String,
    },
    /// `MOVE dest src`.
    Move {
        /// Destination.
        dest: String,
        /// Source.
        src: LadderOperand,
    },
    /// `ADD|SUB|MUL|DIV|MOD|AND|OR|XOR dest op1 op2`.
    Math {
        /// Which operation.
        op: MathOp,
        /// Destination.
        dest: String,
        /// Left operand.
        op1: LadderOperand,
        /// Right operand.
        op2: LadderOperand,
    },
    /// `NOT|NEG|SWAP|OPPOSITE|BIN2BCD|BCD2BIN dest src`.
    Unary {
        /// Which operation.
        op: UnaryOp,
        /// Destination.
        dest: String,
        /// Operand.
        src: LadderOperand,
    },
    /// `SHL|SHR|SR0|ROL|ROR dest src count`.
    Shift {
        /// Which operation.
        op: ShiftOp,
        /// Destination.
        dest: String,
        /// What is shifted.
        src: LadderOperand,
        /// By how many bits.
        count: LadderOperand,
    },
    /// `SET_BIT|CLEAR_BIT name bit`.
    BitWrite {
        /// The integer.
        name: String,
        /// Number of the bit, from 0.
        bit: LadderOperand,
        /// True: SET_BIT.
        value: bool,
    },
    /// `IF_BIT_SET|IF_BIT_CLEAR name bit`.
    BitTest {
        /// The integer.
        name: String,
        /// Number of the bit, from 0.
        bit: LadderOperand,
        /// True: IF_BIT_SET.
        value: bool,
    },
    /// `BUS dest src p7 .. p0`.
    Bus {
        /// Destination.
        dest: String,
        /// Source.
        src: LadderOperand,
        /// Per bit of the source's low byte, from bit 0: the bit of the destination that it goes to, 0 to 7.
        targets: [u8; 8],
    },
    /// `EQU|NEQ|GRT|GEQ|LES|LEQ op1 op2`.
    Compare {
        /// Which comparison.
        op: CompareOp,
        /// Left operand.
        op1: LadderOperand,
        /// Right operand.
        op2: LadderOperand,
    },
    /// `SHIFT_REGISTER name stages`: variables name0 to name(stages-1).
    ShiftRegister {
        /// Stem of the variables.
        name: String,
        /// Number of stages.
        stages: u32,
    },
    /// `LOOK_UP_TABLE dest index count editAsString v0 ..`.
    LookUpTable {
        /// Destination.
        dest: String,
        /// Index, from 0.
        index: LadderOperand,
        /// Shown as a string in LDmicro's editor; without meaning.
        as_string: bool,
        /// The table.
        values: Vec<i64>,
    },
    /// `PIECEWISE_LINEAR dest index count x0 y0 ..`.
    PiecewiseLinear {
        /// Destination.
        dest: String,
        /// Where on the x axis.
        index: LadderOperand,
        /// The points, x strictly rising.
        points: Vec<(i64, i64)>,
    },
    /// `READ_ADC name [refs]`.
    ReadAdc {
        /// A symbol.
        name: String,
        /// LDmicro 5's reference selection, when written.
        refs: Option<u32>,
    },
    /// `SET_PWM duty hertz [name resolution]`.
    SetPwm {
        /// Duty in percent.
        duty: LadderOperand,
        /// Frequency in Hz.
        hertz: LadderOperand,
        /// LDmicro 5's output name and resolution, when written.
        output: Option<(String, String)>,
    },
    /// `UART_RECV var [bytes wait]`.
    UartRecv {
        /// Destination.
        name: String,
        /// LDmicro 5's byte count and wait flag, when written.
        rest: Option<(u32, u32)>,
    },
    /// `UART_SEND var [bytes wait]`.
    UartSend {
        /// Source.
        name: String,
        /// LDmicro 5's byte count and wait flag, when written.
        rest: Option<(u32, u32)>,
    },
    /// `PERSIST var`.
    Persist {
        /// Variable kept in EEPROM.
        name: String,
    },
    /// `FORMATTED_STRING var|(none) length c0 c1 ..` or, in LDmicro 5, `FORMATTED_STRING var|(none) "text"`.
    FormattedString {
        /// Variable to print; `None` for `(none)`.
        var: Option<String>,
        /// The characters with LDmicro's backslash escapes as typed in its editor.
        text: String,
        /// Written in quotes (LDmicro 5) rather than as decimal codes.
        quoted: bool,
    },
}

/// What a symbol is, from its first letter and its use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SymbolKind {
    /// `X..`, one bit, a pin.
    Input,
    /// `Y..`, one bit, a pin.
    Output,
    /// `R..`, one bit.
    Relay,
    /// Accumulator of a TON, TOF or RTO, in scans.
    Timer,
    /// Accumulator of a CTU, CTD or CTC.
    Counter,
    /// `A..`, read by the converter.
    Adc,
    /// Any other integer.
    Variable,
}

impl SymbolKind {
    /// True for the kinds that hold one bit.
    #[must_use]
    pub const fn is_bit(self) -> bool {
        matches!(self, SymbolKind::Input | SymbolKind::Output | SymbolKind::Relay)
    }
}

/// A symbol of a program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LadderSymbol {
    /// Full name with its first letter.
    pub name: String,
    /// What it is.
    pub kind: SymbolKind,
    /// Package pin from `IO LIST`, 0 when not assigned or not a pin.
    pub pin: u32,
    /// Width in bytes, 1 to 4; 0 for a bit. Always 2 in dialect 2.3. In ldmicro-5 what `VAR LIST` says; else for a
    /// counter the least that holds its limit and start value, for a timer the least that holds the scans that it
    /// counts (the largest where several elements share the name), else 2.
    pub bytes: u8,
}

impl LadderProgram {
    /// All symbols that the rungs use, and inputs, outputs, relays and analog inputs of `IO LIST`, each once, sorted by kind
    /// and then by name.
    ///
    /// Bits are what contacts and coils name (by their first letter X, Y, R); a name is a timer or a counter when a timer
    /// or counter element uses it as its accumulator (the first such element in text order decides), analog when
    /// READ_ADC names it, else a variable.
    #[must_use]
    pub fn symbols(&self) -> Vec<LadderSymbol> {
        crate::symbols::collect_symbols(self)
    }

    /// Whether an element of the program uses a part of the chip.
    #[must_use]
    pub fn uses_part(&self, part: ChipPart) -> bool {
        self.elements().any(|(_, element, _)| element.facts().part == Some(part))
    }

    /// All elements with their identity, in text order, comments included.
    pub fn elements(&self) -> impl Iterator<Item = (ElementId, &Element, Pos)> {
        self.rungs.iter().enumerate().flat_map(|(r, rung)| {
            let mut leaves = Vec::new();
            collect_elements(&rung.series, &mut leaves);
            leaves
                .into_iter()
                .enumerate()
                .map(move |(i, (element, pos))| (ElementId { rung: r as u32, index: i as u32 }, element, pos))
        })
    }
}

fn collect_elements<'a>(series: &'a [RungNode], out: &mut Vec<(&'a Element, Pos)>) {
    for node in series {
        match node {
            RungNode::Leaf(element, pos) => out.push((element, *pos)),
            RungNode::Parallel(branches, _) => branches.iter().for_each(|branch| collect_elements(branch, out)),
        }
    }
}
