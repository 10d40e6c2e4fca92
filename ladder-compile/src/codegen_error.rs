//! Faults of a back end: what it cannot write though the intermediate code asks for it.

use emu_core::table::EncodeError;
use ladder::ElementId;

/// A fault of a back end, found while it makes code. No program should cause one, except
/// [`ElementExceedsPage`](CodegenError::ElementExceedsPage).
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodegenError {
    /// An operand does not fit its instruction.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The kind is none of the rows of the instruction table.
    #[error("no such instruction")]
    NoSuchInstruction,
    /// No form of a jump reaches its label.
    #[error("a jump does not reach its target")]
    JumpOutOfReach,
    /// Code refers to a label that is nowhere.
    #[error("a label has no place")]
    UnplacedLabel,
    /// The code of one element does not fit a page of a PIC16.
    #[error("an element is longer than a page of program memory")]
    ElementExceedsPage,
    /// The code came out longer or shorter than its layout.
    #[error("the code has {words} words and was laid out as {planned}")]
    LayoutMismatch {
        /// Words of the code.
        words: usize,
        /// Words of the layout.
        planned: u32,
    },
    /// Neither layout of the code, with one page and with several, has a length.
    #[error("the code has no size")]
    NoCodeSize,
    /// The chip has no row of data.
    #[error("{chip} has no row")]
    NoChipRow {
        /// The chip.
        chip: &'static str,
    },
    /// The chip has no timer and counter modules, and the intermediate code uses one.
    #[error("{chip} has no modules, but {element} is one")]
    NoModules {
        /// The chip.
        chip: &'static str,
        /// The element that uses the module.
        element: ElementId,
    },
    /// The back end has no code for an operation.
    #[error("no code for `{op}`")]
    NoCodeFor {
        /// The operation as text.
        op: String,
    },
    /// An operation names a table that the program has not.
    #[error("there is no table {table}")]
    NoTable {
        /// The number of the table.
        table: u32,
    },
    /// The PWM output is used and has no frequency.
    #[error("the PWM output has no frequency")]
    NoPwmFrequency,
    /// An analog input has no pin that can measure.
    #[error("{name} has no analog pin")]
    NoAnalogPin {
        /// The symbol of the input.
        name: String,
    },
    /// An image is asked of a target that is a source.
    #[error("a sketch is no image")]
    SketchIsNoImage,
}
