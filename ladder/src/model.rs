//! The model of a ladder program: a tree of what the file contains, without its meaning.
//!
//! A program is a list of rungs. A rung is a series of nodes. A node is an element or a group of parallel
//! branches, and each branch is again a series. This is the nesting of LDmicro's `.ld` text. `ladder-eval`
//! and `ladder-compile` define the meaning independently of each other and share only this model.

pub use crate::peripheral_model::{PwmChoice, PwmOutput, SerialTransfer};
use diag::Pos;

use crate::bus_elements::BusTransfer;
use crate::element_facts::ChipPart;
use crate::il::{IecVariable, IlStep};
pub use crate::operations::{CounterKind, FlowOp, TimerKind};
pub use crate::operators::{CompareOp, MathOp, ShiftOp, UnaryOp};
pub use crate::program_parts::{
    ElementId, IoEntry, LadderDialect, LdFormat, ProgramElement, ProgramSettings, SourceStyle, VarEntry,
};
pub use crate::segments::SegmentDisplay;
pub use crate::symbol_kinds::{LadderSymbol, SymbolKind};

/// A whole ladder program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LadderProgram {
    /// Name of the file, for messages; `-` for standard input.
    pub file: String,
    /// Header of the file.
    pub format: LdFormat,
    /// Dialect, which gives the elements their meaning.
    pub dialect: LadderDialect,
    /// Spellings without meaning, for the writer.
    pub style: SourceStyle,
    /// Settings before the rungs.
    pub settings: ProgramSettings,
    /// `IO LIST`, in file order.
    pub io: Vec<IoEntry>,
    /// `VAR LIST`, in file order; `None` if the file has no such section (an empty section is `Some` of an
    /// empty list).
    pub vars: Option<Vec<VarEntry>>,
    /// Lines of `PULL-UP LIST` as written (trimmed); `None` if the file has no such section.
    pub pull_ups: Option<Vec<String>>,
    /// Variables of an IEC program; empty in the dialects of LDmicro.
    pub declarations: Vec<IecVariable>,
    /// Rungs from top to bottom. Messages number them from 1 and count every rung, also those with only
    /// comments.
    pub rungs: Vec<Rung>,
}

/// One rung: a series of nodes from the left rail to the right rail.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rung {
    /// Elements and groups from left to right.
    pub series: Vec<RungNode>,
    /// Position of the `RUNG` keyword.
    pub pos: Pos,
}

/// A node of a series: an element or a parallel group.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RungNode {
    /// One element and the position of its line.
    Leaf(Element, Pos),
    /// Parallel branches from top to bottom, at least one; each is a series of at least one node. The text
    /// form omits `SERIES` for a branch of one element.
    Parallel(Vec<Vec<RungNode>>, Pos),
}

/// An operand that is a variable or a constant.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum LadderOperand {
    /// An integer variable, or the accumulator of a timer or counter.
    Var(String),
    /// A constant: -32768 to 32767 in dialect 2.3, 32 bits in ldmicro-5.
    Const {
        /// Its value.
        value: i64,
        /// Its spelling in the file: `12`, `-3`, `'a'`, `0x1F`.
        text: String,
    },
}

/// An element (leaf) of a rung.
///
/// Names keep their first letter: X input, Y output, R internal relay, T timer, C counter, A analog. Any
/// other name is a plain integer variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Element {
    /// `COMMENT text`, unescaped; may contain line breaks. It has no effect.
    Comment(String),
    /// `CONTACTS name negated [set1]`.
    Contacts {
        /// Symbol that begins with X, Y or R.
        name: String,
        /// True for a normally closed contact.
        negated: bool,
        /// LDmicro 5's third argument, when written: the input begins as 1 in its simulator, which means
        /// nothing on a chip.
        set1: Option<u32>,
    },
    /// `COIL name negated setOnly resetOnly [ttrigger]`; a valid coil has at most one of the three flags.
    Coil {
        /// Symbol that begins with Y or R.
        name: String,
        /// True if the coil stores the complement of its input.
        negated: bool,
        /// True for a set coil, which only sets the bit.
        set: bool,
        /// True for a reset coil, which only clears the bit.
        reset: bool,
        /// LDmicro 5's fourth flag, when written: 1 toggles the bit on a rising edge of the rung.
        ttrigger: Option<u32>,
    },
    /// `SHORT`: passes power.
    Short,
    /// `OPEN`: blocks power.
    Open,
    /// `PLACEHOLDER`: an empty place of the editor; a program that contains one is incomplete.
    Placeholder,
    /// `MASTER_RELAY`: enables or disables the rungs below it.
    MasterRelay,
    /// `OSR`: true for one scan on a rising edge.
    Osr,
    /// `OSF`: true for one scan on a falling edge.
    Osf,
    /// `ODR`: one scan false on a rising edge, else true (LDmicro 5).
    Odr,
    /// `ODF`: one scan false on a falling edge, else true (LDmicro 5).
    Odf,
    /// `OSL`: another spelling of ODF (LDmicro 5).
    Osl,
    /// `OSC`: true in every other scan of a true rung (LDmicro 5).
    Osc,
    /// `TON|TOF|RTO|RTL|TCY|THI|TLO name microseconds [adjust]`.
    Timer {
        /// Kind of timer.
        kind: TimerKind,
        /// Accumulator, in scans.
        name: String,
        /// Delay in microseconds; a variable, only in LDmicro 5, holds scans.
        delay: LadderOperand,
        /// LDmicro 5's adjust in scans, if written.
        adjust: Option<LadderOperand>,
    },
    /// `CTU|CTD|CTC|CTR name max [init kind]`.
    Counter {
        /// Kind of counter.
        kind: CounterKind,
        /// Accumulator.
        name: String,
        /// Limit; a variable only in LDmicro 5.
        max: LadderOperand,
        /// LDmicro 5's start value, if written.
        init: Option<LadderOperand>,
        /// LDmicro 5's input kind, if written: `/` rising edge, `\` falling edge, `-` level, `o` inverted
        /// level.
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
        /// Operation.
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
    /// `LABEL|GOTO|GOSUB|SUBPROG|ENDSUB label` (LDmicro 5).
    Flow {
        /// Which of them.
        op: FlowOp,
        /// Name of the label or subprogram; of a GOTO also the number of a rung, from 1.
        label: String,
    },
    /// `7SEGMENTS|9SEGMENTS|14SEGMENTS|16SEGMENTS dest src C|A` (LDmicro 5).
    Segments {
        /// Which display.
        display: SegmentDisplay,
        /// Destination.
        dest: String,
        /// Code of the character; a variable is corrected if there is no such character.
        src: LadderOperand,
        /// `C` for a common cathode; any other letter complements the segments.
        common: char,
    },
    /// `TIME2COUNT|TIME2DELAY dest microseconds` (LDmicro 5).
    TimeValue {
        /// True for a number of scans (TIME2COUNT), false for clocks of the crystal (TIME2DELAY).
        is_scans: bool,
        /// Destination.
        dest: String,
        /// Time in microseconds, a constant.
        time: LadderOperand,
    },
    /// `RANDOM dest` (LDmicro 5).
    Random {
        /// Destination, which also names the sequence.
        dest: String,
    },
    /// `SEED_RANDOM dest src` (LDmicro 5).
    SeedRandom {
        /// Destination of the RANDOM whose sequence begins anew.
        dest: String,
        /// Where it begins.
        src: LadderOperand,
    },
    /// `DELAY time`: no effect here (LDmicro 5).
    Delay {
        /// Time in clocks.
        time: LadderOperand,
    },
    /// `SLEEP`: no effect here (LDmicro 5).
    Sleep,
    /// `CLRWDT`: no effect here (LDmicro 5).
    ClearWatchdog,
    /// `LOCK`: stops the program (LDmicro 5).
    Lock,
    /// `RETURN`: returns from the subprogram; outside of one it ends the scan (LDmicro 5).
    Return,
    /// `EQU|NEQ|GRT|GEQ|LES|LEQ op1 op2`.
    Compare {
        /// Comparison.
        op: CompareOp,
        /// Left operand.
        op1: LadderOperand,
        /// Right operand.
        op2: LadderOperand,
    },
    /// `SHIFT_REGISTER name stages`: shifts the variables name0 to name(stages-1).
    ShiftRegister {
        /// Common prefix of the names of the variables.
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
        /// True if LDmicro's editor shows the values as a string; no effect on the program.
        as_string: bool,
        /// Values of the table.
        values: Vec<i64>,
        /// LDmicro 5's name of the table, if written; no effect on the program.
        name: Option<String>,
    },
    /// `PIECEWISE_LINEAR dest index count x0 y0 ..`.
    PiecewiseLinear {
        /// Destination.
        dest: String,
        /// Position on the x axis.
        index: LadderOperand,
        /// Points of the curve; x is strictly increasing.
        points: Vec<CurvePoint>,
        /// LDmicro 5's name of the curve, if written; no effect on the program.
        name: Option<String>,
    },
    /// `READ_ADC name [refs]`.
    ReadAdc {
        /// Symbol that begins with A.
        name: String,
        /// LDmicro 5's reference selection, if written.
        refs: Option<u32>,
    },
    /// `SET_PWM duty hertz [name resolution]`.
    SetPwm {
        /// Duty cycle in percent.
        duty: LadderOperand,
        /// Frequency in Hz.
        hertz: LadderOperand,
        /// LDmicro 5's output name and resolution, if written.
        output: Option<PwmChoice>,
    },
    /// `UART_RECV var [bytes wait]`.
    UartRecv {
        /// Destination.
        name: String,
        /// LDmicro 5's byte count and wait flag, if written.
        rest: Option<SerialTransfer>,
    },
    /// `UART_SEND var [bytes wait]`.
    UartSend {
        /// Source.
        name: String,
        /// LDmicro 5's byte count and wait flag, if written.
        rest: Option<SerialTransfer>,
    },
    /// `UART_RECV_AVAIL`: tests whether a received byte waits (LDmicro 5).
    UartRecvAvail,
    /// `UART_SEND_READY`: tests whether the transmitter is free (LDmicro 5).
    UartSendReady,
    /// `PULSER high low accel count coil` (LDmicro 5).
    Pulser {
        /// Scans for which the first pulse is 1, divided by the multiple.
        high: LadderOperand,
        /// Scans for which the first pulse is 0, divided by the multiple.
        low: LadderOperand,
        /// Multiple of both at the first pulse.
        accel: LadderOperand,
        /// Number of pulses.
        count: LadderOperand,
        /// Output or relay of the pulses.
        coil: String,
    },
    /// `NPULSE count hertz coil` (LDmicro 5).
    Npulse {
        /// Number of pulses.
        count: LadderOperand,
        /// Frequency in Hz, a constant.
        hertz: LadderOperand,
        /// Output or relay of the pulses.
        coil: String,
    },
    /// `NPULSE_OFF`: ends the pulses of every NPULSE (LDmicro 5).
    NpulseOff,
    /// `STEPPER name max period size graph coil` (LDmicro 5).
    Stepper {
        /// Stem of the counters `C<name>Dec` and `C<name>P`.
        name: String,
        /// Number of steps.
        max: LadderOperand,
        /// Scans of a step.
        period: LadderOperand,
        /// Size of the acceleration table.
        size: u32,
        /// Kind of acceleration; 0 is none.
        graph: u32,
        /// Output of the pulses.
        coil: String,
    },
    /// `QUAD_ENCOD counter interrupt A B Z dir kind turn` (LDmicro 5).
    QuadEncod {
        /// Position.
        counter: String,
        /// Number of an interrupt, which LDmicro 5 does not use.
        interrupt: u32,
        /// Inputs A and B.
        inputs: [String; 2],
        /// Input of the zero mark.
        zero: Option<String>,
        /// Output or relay that is 1 after a step upwards.
        dir: Option<String>,
        /// When the zero mark counts: `/`, `\\`, `-` or `o`, as of a counter.
        zero_kind: char,
        /// Steps of a turn; 0 clears the counter at the zero mark.
        turn: u32,
    },
    /// `SPI|SPI_WR|I2C_RD|I2C_WR name send recv mode device register first rate` (LDmicro 5).
    BusTransfer(Box<BusTransfer>),
    /// `PERSIST var`.
    Persist {
        /// Variable that is kept in the EEPROM.
        name: String,
    },
    /// `STRING dest|(none) var|(none) "text"`: no effect here (LDmicro 5).
    Text {
        /// Text variable to write; `None` for `(none)`.
        dest: Option<String>,
        /// Variable to print; `None` for `(none)`.
        var: Option<String>,
        /// The text, with LDmicro's backslash escapes as typed in its editor.
        text: String,
        /// True if written in quotes, false if written as decimal codes.
        quoted: bool,
    },
    /// `FORMATTED_STRING var|(none) length c0 c1 ..` or, in LDmicro 5, `FORMATTED_STRING var|(none) "text"`.
    FormattedString {
        /// Variable to print; `None` for `(none)`.
        var: Option<String>,
        /// The text, with LDmicro's backslash escapes as typed in its editor.
        text: String,
        /// True if written in quotes (LDmicro 5), false if written as decimal codes.
        quoted: bool,
    },
    /// A line of Instruction List (dialect IEC).
    Instruction(Box<IlStep>),
}

impl LadderProgram {
    /// Returns all symbols that the rungs use, and the inputs, outputs, relays and analog inputs of `IO
    /// LIST`, each once, sorted by kind and then by name.
    ///
    /// Contacts and coils name bits, with the kind given by the first letter X, Y or R. A name is a timer or
    /// a counter if a timer or counter element uses it as its accumulator (the first such element in text
    /// order decides), an analog input if READ_ADC uses it, and otherwise a variable. The symbols of an IEC
    /// program are those of its declarations.
    #[must_use]
    pub fn symbols(&self) -> Vec<LadderSymbol> {
        crate::symbols::collect_symbols(self)
    }

    /// True if an element of the program uses this part of the chip.
    #[must_use]
    pub fn uses_part(&self, part: ChipPart) -> bool {
        self.elements().any(|at| at.element.facts().part == Some(part))
    }

    /// Iterates over all elements in text order, comments included.
    pub fn elements(&self) -> impl Iterator<Item = ProgramElement<'_>> {
        self.rungs.iter().enumerate().flat_map(|(r, rung)| {
            let mut leaves = Vec::new();
            collect_elements(&rung.series, r as u32, &mut leaves);
            leaves
        })
    }

    /// Returns the element with an identity.
    #[must_use]
    pub fn find_element(&self, id: ElementId) -> Option<ProgramElement<'_>> {
        self.elements().find(|at| at.id == id)
    }
}

/// A point of a piecewise linear curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CurvePoint {
    /// Value of the index.
    pub x: i64,
    /// Value of the destination.
    pub y: i64,
}

fn collect_elements<'a>(series: &'a [RungNode], rung: u32, out: &mut Vec<ProgramElement<'a>>) {
    for node in series {
        match node {
            RungNode::Leaf(element, pos) => {
                out.push(ProgramElement { id: ElementId { rung, index: out.len() as u32 }, element, pos: *pos });
            }
            RungNode::Parallel(branches, _) => branches.iter().for_each(|branch| collect_elements(branch, rung, out)),
        }
    }
}
