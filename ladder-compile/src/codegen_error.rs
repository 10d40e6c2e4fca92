//! Internal errors of a back end: it cannot generate code that the intermediate code requests.

use emu_core::table::EncodeError;
use ladder::ElementId;

/// An internal error of a back end during code generation.
///
/// No program should cause one, except [`ElementExceedsPage`](CodegenError::ElementExceedsPage).
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CodegenError {
    /// An operand does not fit its instruction.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The opcode is not in the instruction table.
    #[error("no such instruction")]
    NoSuchInstruction,
    /// No form of a jump reaches its label.
    #[error("a jump does not reach its target")]
    JumpOutOfReach,
    /// Code refers to a label that was never placed.
    #[error("a label has no place")]
    UnplacedLabel,
    /// The code of one element does not fit one page of a PIC16.
    #[error("an element is longer than a page of program memory")]
    ElementExceedsPage,
    /// The length of the code differs from its layout.
    #[error("the code has {words} words and was laid out as {planned}")]
    LayoutMismatch {
        /// Length of the code in words.
        words: usize,
        /// Length of the layout in words.
        planned: u32,
    },
    /// Neither layout of the code, with one page or with several, has a length.
    #[error("the code has no size")]
    NoCodeSize,
    /// The back end has no data for the chip.
    #[error("{chip} has no row")]
    NoChipRow {
        /// Name of the chip.
        chip: &'static str,
    },
    /// The intermediate code uses a timer or counter module, but the chip has none.
    #[error("{chip} has no modules, but {element} is one")]
    NoModules {
        /// Name of the chip.
        chip: &'static str,
        /// Element that uses the module.
        element: ElementId,
    },
    /// The back end has no code for an operation.
    #[error("no code for `{op}`")]
    NoCodeFor {
        /// The operation as text.
        op: String,
    },
    /// An operation refers to a table that does not exist.
    #[error("there is no table {table}")]
    NoTable {
        /// Number of the table.
        table: u32,
    },
    /// The program uses the PWM output but sets no frequency.
    #[error("the PWM output has no frequency")]
    NoPwmFrequency,
    /// The intermediate code uses a bus that the chip does not have.
    #[error("the bus has no settings")]
    NoBus,
    /// An analog input has no pin with a converter channel.
    #[error("{name} has no analog pin")]
    NoAnalogPin {
        /// Symbol of the input.
        name: String,
    },
    /// An image was requested for a target that produces a source.
    #[error("a sketch is not an image")]
    SketchIsNoImage,
}
