//! Intermediate code (IR): one scan as operations on bits and integers of 1 to 4 bytes, for any target.
//!
//! The machine model is one that every target has in some form: *one bit accumulator* (the AVR's T flag, the
//! 8051's carry, the result bit of a 1-bit controller) that holds the state of the rung, bit cells and word
//! cells. Bit operations change or store the accumulator; word operations preserve it. Control flow is
//! structured ([`IrOp::If`]) except for the jumps of programs that have jumps or subprograms
//! ([`IrOp::Jump`]). Jumps back are counted, so the longest path of a scan is a matter of sums and maxima.

use ladder::{ElementId, SymbolKind};

pub use crate::arithmetic::{ArithmeticOp, min_bytes, shift_count};
pub use crate::timed_module::TimedModule;
pub use ladder::flow::MAX_JUMPS_BACK;

/// Index of a bit cell in [`Ir::bits`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BitId(pub u32);

/// Index of a word cell in [`Ir::words`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WordId(pub u32);

/// Number of a position that jumps reach ([`IrOp::Label`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LabelId(pub u32);

/// What a jump is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JumpKind {
    /// Goes forward.
    Forward,
    /// Goes back. All jumps back of a scan are counted, and at most [`MAX_JUMPS_BACK`] are executed.
    Back,
    /// Calls a subprogram: its code goes from the target of the jump to `end`, and it ends with a jump to
    /// `back`.
    Call {
        /// Position behind the subprogram.
        end: LabelId,
        /// Position behind the call.
        back: LabelId,
    },
    /// Returns from a subprogram.
    Return,
}

/// Purpose of a bit cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BitRole {
    /// Latched from a pin at the start of the scan.
    Input,
    /// Written to a pin at the end of the scan.
    Output,
    /// An internal relay.
    Relay,
    /// State that an element keeps between scans: the edge memory of one-shots and counters.
    Memory,
    /// A value used within one scan only; its content between scans does not matter.
    Temporary,
}

/// A bit cell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BitCell {
    /// Name of the symbol, or a description such as `edge of rung 2, element 1`.
    pub name: String,
    /// Purpose of the cell.
    pub role: BitRole,
    /// Value after reset: 0, except for a BOOL of an IEC program with an initial value.
    pub initial: bool,
}

/// Purpose of a word cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordRole {
    /// An integer of the program.
    Symbol(SymbolKind),
    /// State that an element or a peripheral keeps between scans.
    Memory,
    /// A value used within one scan only; its content between scans does not matter.
    Temporary,
}

/// A word cell: a signed integer; targets that store it in bytes use little-endian order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WordCell {
    /// Name of the symbol, or a description such as `position of rung 2, element 1`.
    pub name: String,
    /// Purpose of the cell.
    pub role: WordRole,
    /// Width in bytes, 1 to 4.
    pub bytes: u8,
    /// Value after reset: 0, except for counters with a start value.
    pub initial: i32,
}

/// A constant table in program memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ConstantTable {
    /// Description of its use, such as `table of rung 2, element 1`.
    pub name: String,
    /// Width of a value in bytes, 1 to 4.
    pub bytes: u8,
    /// Values, at least one; each fits the width as a signed number, or in one byte as an unsigned one.
    pub values: Vec<i32>,
}

/// Directions of the serial line that a program uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct UartUse {
    /// True if the program sends.
    pub send: bool,
    /// True if the program receives.
    pub receive: bool,
    /// True if the program waits for bytes to go.
    pub waits: bool,
}

/// What an [`IrOp::Transfer`] does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusAction {
    /// Writes a register of the I2C device with this address.
    I2cWrite(u8),
    /// Reads a register of the I2C device with this address.
    I2cRead(u8),
    /// Sends a byte on the SPI bus and receives one.
    Spi,
}

/// Rates of the buses that a program uses, in bits per second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct BusUse {
    /// Rate of the I2C bus, if the program uses it.
    pub i2c: Option<u32>,
    /// Rate of the SPI bus, if the program uses it.
    pub spi: Option<u32>,
}

/// Operand of a word operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordOperand {
    /// Content of a cell.
    Cell(WordId),
    /// A constant. In a comparison it fits the width of the left operand.
    Const(i32),
}

/// Signed relation. Lowering converts the other two by swapping operands or adding one to a constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RelationOp {
    /// Equal.
    Eq,
    /// Not equal.
    Ne,
    /// Less than.
    Lt,
    /// Greater or equal.
    Ge,
}

/// A signed comparison `a rel b`, at the larger width of the two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WordComparison {
    /// Left operand.
    pub a: WordId,
    /// Relation.
    pub rel: RelationOp,
    /// Right operand.
    pub b: WordOperand,
}

/// A function of bits, for the three-address form of unoptimised code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogicOp {
    /// a.
    Copy(BitId),
    /// not a.
    Not(BitId),
    /// a and b.
    And(BitId, BitId),
    /// a or b.
    Or(BitId, BitId),
}

/// Condition of an [`IrOp::If`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BranchCondition {
    /// The accumulator is 1.
    Acc,
    /// A bit cell is 1.
    Bit(BitId),
    /// A comparison is true.
    Compare(WordComparison),
}

/// An operation; "acc" in the comments is the bit accumulator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IrOp {
    /// acc := constant.
    SetAccumulator(bool),
    /// acc := bit, complemented if `negated`.
    Load {
        /// The bit.
        bit: BitId,
        /// True to use its complement.
        negated: bool,
    },
    /// acc := acc and bit.
    And {
        /// The bit.
        bit: BitId,
        /// True to use its complement.
        negated: bool,
    },
    /// acc := acc or bit.
    Or {
        /// The bit.
        bit: BitId,
        /// True to use its complement.
        negated: bool,
    },
    /// bit := acc, complemented if `negated`; acc is preserved.
    Store {
        /// The bit.
        bit: BitId,
        /// True to store the complement of acc.
        negated: bool,
    },
    /// bit := constant; acc is preserved.
    SetBit {
        /// The bit.
        bit: BitId,
        /// The constant.
        value: bool,
    },
    /// Rising edge: (acc, memory) := (acc and not memory, acc).
    Rising(BitId),
    /// Falling edge: (acc, memory) := (not acc and memory, acc).
    Falling(BitId),
    /// acc := acc and the comparison.
    AndCompare(WordComparison),
    /// dst := src; acc is preserved.
    Move {
        /// Destination.
        dst: WordId,
        /// Source.
        src: WordOperand,
    },
    /// dst := a op b; acc is preserved. The destination may be an operand.
    Math {
        /// Operation.
        op: ArithmeticOp,
        /// Destination.
        dst: WordId,
        /// Left operand.
        a: WordOperand,
        /// Right operand.
        b: WordOperand,
    },
    /// bit := logic; acc is preserved or lost. Only in unoptimised code, which never uses acc across it.
    Logic {
        /// Destination.
        dst: BitId,
        /// Function that gives its value.
        function: LogicOp,
    },
    /// dst := `table[index]`; acc is preserved. The index is in range; the destination may be the index.
    Lookup {
        /// Destination. Values are sign-extended, but zero-extended from byte tables with values above 127.
        dst: WordId,
        /// Index from 0.
        index: WordId,
        /// Index into [`Ir::tables`].
        table: u32,
    },
    /// dst := the result of converting an analog input now, 0 to 1023; acc is preserved.
    ReadAdc {
        /// Destination.
        dst: WordId,
        /// Index into [`Ir::adcs`].
        input: u32,
    },
    /// Sets the duty cycle of the PWM output, clamped to 0 to 100 percent; acc is preserved.
    SetPwm {
        /// Number of the output.
        output: u32,
        /// Duty cycle in percent.
        duty: WordOperand,
    },
    /// Sends the low byte of a value; acc is preserved. The previous byte is complete, up to a scan's jitter.
    Send {
        /// Value whose low byte is sent.
        value: WordOperand,
    },
    /// Waits until the byte of the last [`IrOp::Send`] has gone; acc is preserved. One has been sent before.
    WaitSent,
    /// acc := whether a received byte waits; if so, dst := the byte, 0 to 255, and the receiver is free.
    Receive {
        /// Destination.
        dst: WordId,
    },
    /// Transfers a byte on a bus of the chip and waits for its end; acc is preserved.
    Transfer {
        /// What is done on which bus.
        action: BusAction,
        /// Register of an I2C device: its low byte; unused on SPI.
        register: WordOperand,
        /// Value whose low byte is sent; unused by a read.
        value: WordOperand,
        /// Destination of the received byte, 0 to 255; FFh if no device answers.
        dst: Option<WordId>,
    },
    /// dst := EEPROM, least significant byte first; acc is preserved. No write is in progress.
    ReadEeprom {
        /// Destination.
        dst: WordId,
        /// Address of the first cell.
        addr: u16,
    },
    /// EEPROM := the lowest byte of src that differs from its cell, if any, and then busy := scans.
    ///
    /// acc is preserved. No write is in progress before.
    WriteEeprom {
        /// Source.
        src: WordId,
        /// Address of the first cell.
        addr: u16,
        /// Counter of scans until the EEPROM is free.
        busy: WordId,
        /// Duration of a write in scans.
        scans: i32,
    },
    /// acc := the output of a timer or counter with input acc; the word is its integer.
    ///
    /// All other state is its own. Only for chips with modules
    /// ([`CompileTarget::has_modules`](crate::target::CompileTarget::has_modules)).
    Module {
        /// Kind of timer or counter.
        module: TimedModule,
        /// Accumulator of the timer or counter.
        word: WordId,
        /// Limit: P of a timer, the maximum of a counter.
        limit: WordOperand,
    },
    /// A position that jumps reach. Only in the list of a rung, not in an [`IrOp::If`].
    ///
    /// The accumulator is undefined after it: what follows sets it.
    Label(LabelId),
    /// Goes on at a label.
    Jump {
        /// The label.
        to: LabelId,
        /// What the jump is for.
        kind: JumpKind,
    },
    /// Executes one of two lists.
    If {
        /// Condition.
        cond: BranchCondition,
        /// Operations if the condition is true.
        if_true: Vec<IrOp>,
        /// Operations if the condition is false.
        if_false: Vec<IrOp>,
    },
}

/// An operation, with the element that it belongs to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IrStep {
    /// Element. Operations that join parallel branches belong to the last element of the branch.
    pub element: ElementId,
    /// The operation.
    pub op: IrOp,
}

/// Intermediate code of a rung.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RungCode {
    /// Number of elements of the rung in the program.
    pub element_count: u32,
    /// Operations, in order of the elements.
    pub steps: Vec<IrStep>,
}

/// Cells that a back end puts into the registers of a port at the end of the scan, after the outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PortCells {
    /// Letter of the port.
    pub letter: char,
    /// The latch, for the pins that nothing else of the program uses.
    pub latch: Option<WordId>,
    /// The directions of these pins, as the chip's register holds them; without one they are inputs.
    pub direction: Option<WordId>,
}

/// A PWM output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IrPwm {
    /// Its name, if the program gives one.
    pub name: Option<String>,
    /// Frequency in Hz.
    pub hertz: u32,
    /// The first element that sets it.
    pub element: ElementId,
}

impl IrPwm {
    /// The name for messages.
    #[must_use]
    pub fn label(&self) -> String {
        self.name.as_ref().map_or_else(|| "the PWM output".to_owned(), |name| format!("`{name}`"))
    }
}

/// Intermediate code of a scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Ir {
    /// Bit cells.
    pub bits: Vec<BitCell>,
    /// Word cells.
    pub words: Vec<WordCell>,
    /// Constant tables.
    pub tables: Vec<ConstantTable>,
    /// Symbols of the analog inputs.
    pub adcs: Vec<String>,
    /// Reference selection of each analog input, as its elements have it: 0 is the supply.
    pub adc_references: Vec<u8>,
    /// The PWM outputs that the program uses, in the order of their numbers.
    pub pwms: Vec<IrPwm>,
    /// Use of the serial line.
    pub uart: UartUse,
    /// Use of the buses.
    pub buses: BusUse,
    /// Number of EEPROM bytes in use, from address 0.
    pub eeprom_bytes: u16,
    /// Ports whose registers the program names, by letter.
    pub ports: Vec<PortCells>,
    /// Operations after the inputs are latched and before the first rung.
    pub prologue: Vec<IrOp>,
    /// All rungs of the program, in order.
    pub rungs: Vec<RungCode>,
    /// Operations after the last rung and before the outputs are written.
    pub epilogue: Vec<IrOp>,
}

impl Ir {
    /// True if the program has jumps.
    #[must_use]
    pub fn has_jumps(&self) -> bool {
        self.rungs.iter().flat_map(|rung| &rung.steps).any(|step| matches!(step.op, IrOp::Label(_)))
    }

    /// True for bits used within one scan only.
    #[must_use]
    pub fn is_temporary(&self, bit: BitId) -> bool {
        self.bits.get(bit.0 as usize).is_some_and(|cell| cell.role == BitRole::Temporary)
    }

    /// Width of a word cell in bytes.
    #[must_use]
    pub fn bytes(&self, word: WordId) -> u8 {
        self.words.get(word.0 as usize).map_or(2, |cell| cell.bytes)
    }

    /// Width in bytes at which an operation is computed: that of the destination, or in a division the
    /// largest of destination, operands and constants.
    #[must_use]
    pub fn width(&self, op: ArithmeticOp, dst: WordId, a: WordOperand, b: WordOperand) -> u8 {
        let of = |value: WordOperand| match value {
            WordOperand::Cell(word) => self.bytes(word),
            WordOperand::Const(constant) => min_bytes(constant),
        };
        match op {
            ArithmeticOp::Div => self.bytes(dst).max(of(a)).max(of(b)),
            ArithmeticOp::Add
            | ArithmeticOp::Sub
            | ArithmeticOp::Mul
            | ArithmeticOp::And
            | ArithmeticOp::Or
            | ArithmeticOp::Xor
            | ArithmeticOp::Shr => self.bytes(dst),
        }
    }

    /// The register cells of a port, if the program names its registers.
    #[must_use]
    pub fn port_cells(&self, letter: char) -> Option<&PortCells> {
        self.ports.iter().find(|cells| cells.letter == letter)
    }
}
