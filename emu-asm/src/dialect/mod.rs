//! The differences between the assemblers of the families, as data.
//!
//! One engine reads all of them. A dialect is a row of tables: comment marks, number forms, operators with
//! their precedence, and directives by name.

mod ap101;
pub(crate) mod avr;
mod common;
mod mcs51;
pub(crate) mod pic16;

use std::ops::Range;

use emu_core::chip::{Chip, ChipFamily};
use emu_core::table::InstructionRow;

pub(crate) use mcs51::chip_of_list;

use crate::NamedText;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::{AsmRefusal, CauseAndHint, LineFault};
use crate::lines::{AsmLine, behind_name};
use crate::reader::LineBlock;

/// A unary operator or a function of one value: token, binding strength for its operand, and implementation.
pub(crate) type UnaryOperator = (&'static str, u8, fn(i64) -> i64);

/// A check of a dialect on an instruction, with the values and positions of its operands.
pub(crate) type CheckInstruction = fn(&InstructionRow, &[(i32, Range<usize>)]) -> Option<LineFault>;

/// Truncates a value that is too large for an operand field of `width` bits: returns the value that fits, and
/// the warning. `None` if the value is taken as it is or refused as usual.
pub(crate) type CutToField = fn(&Chip, kind: &str, width: u32, value: i64) -> Option<(i64, Option<AsmRefusal>)>;

/// An assembler dialect.
pub(crate) struct AsmDialect {
    /// Characters that begin a comment anywhere outside quotes.
    pub comments: &'static [&'static str],
    /// Characters that begin a comment at the start of a line.
    pub line_comments: &'static [&'static str],
    /// Characters that end a statement, so that another may follow on the line.
    pub separators: &'static [u8],
    /// `/* .. */` is a comment; it may extend over several lines.
    pub block_comments: bool,
    /// A word in column 1 that is no instruction, directive or macro is a label without a colon.
    pub labels_in_column_one: bool,
    /// An instruction or directive in column 1 causes a warning.
    pub warns_in_column_one: bool,
    /// The forms of numbers; the first that fits is used.
    pub numbers: &'static [NumberForm],
    /// Radix of a plain number until a directive changes it.
    pub radix: u32,
    /// `byte.bit` is a bit address, so names have no dots inside.
    pub dot_is_bit: bool,
    /// Names of the location counter.
    pub location_counter_names: &'static [&'static str],
    /// Within an instruction, the location counter is the address after the instruction.
    pub counter_after_instruction: bool,
    /// Within a list of values, the location counter is the address of the line; but `.` advances with each
    /// value.
    pub counter_at_line_start: bool,
    /// Binary operators: token, binding strength, meaning.
    pub operators: &'static [(&'static str, u8, AsmOperator)],
    /// Unary operators and functions of one value.
    pub unary: &'static [UnaryOperator],
    /// The value of a comparison that holds.
    pub true_value: i64,
    /// How values are divided, shifted and compared.
    pub arithmetic: AsmArithmetic,
    /// Lines that begin with `$` and a word are controls of the assembler.
    pub controls: bool,
    /// Labels may be numbers; `1f` and `1b` mean the next and the previous one.
    pub numbered_labels: bool,
    /// Labels may be numbers followed by `$`, known between two labels with names.
    pub dollar_labels: bool,
    /// Symbol names ignore case unless two symbols differ in case only.
    pub ignores_case: bool,
    /// Macro parameters are replaced in the body by their bare names, without a backslash.
    pub plain_arguments: bool,
    /// Words of several bytes begin with the high byte.
    pub big_endian: bool,
    /// The fill value for the gap that `org` skips within the program.
    pub org_fills: Option<u8>,
    /// Macro arguments may be separated by spaces.
    pub spaced_arguments: bool,
    /// Reserved memory is filled with bytes of 0 (otherwise not filled).
    pub space_fills: bool,
    /// A letter with a value in parentheses is the name of an address: `M(256+n)`.
    pub zones: bool,
    /// Literals of the syntax, with the values that may be written instead.
    pub literals: &'static [(&'static str, i64)],
    /// Features that few dialects have.
    pub hooks: DialectHooks,
    /// Directives of this dialect, looked up before the common ones.
    pub directives: &'static [AsmDirective],
    /// Returns what an include provides; `include` is the name in lower case, without path and `<>`.
    pub include_provided: fn(chip: &Chip, include: &str) -> ProvidedInclude,
    /// Returns names and texts that are defined before the first line. A name may have a parameter in
    /// parentheses.
    pub predefined: fn(chip: &Chip) -> Vec<NamedText>,
    /// Refuses an instruction that the dialect does not take with these operands.
    pub refuse_instruction: fn(mnemonic: &str, operands: &str) -> Option<AsmRefusal>,
    /// Called at the end of each pass.
    pub finish_pass: fn(&mut Assembler<'_>),
    /// The sections in memory order. The program begins in `text`, or else in the first.
    pub sections: &'static [SectionRow],
}

/// Returns the end and the value of a quoted value; `None` if nothing follows the quote.
pub(crate) type QuotedValueAt = fn(text: &str, at: usize) -> Option<(usize, u16)>;

/// Features that few dialects have.
#[derive(Clone, Copy)]
pub(crate) struct DialectHooks {
    /// Checks an instruction that fits: its row, and the operands in its pattern with their positions.
    pub check: CheckInstruction,
    /// Returns the warning about a name used as an operand of a kind, with its value.
    pub mismatch: fn(&Assembler<'_>, name: &str, kind: &str, value: i32) -> Option<AsmRefusal>,
    /// Truncates a value that does not fit its operand field, with a warning.
    pub cut: CutToField,
    /// Ignored directives that are known only with a dot; listed without it.
    pub ignored_dotted: &'static [&'static str],
    /// More directives of the dialect, looked up after `directives`.
    pub more: &'static [AsmDirective],
    /// Directives that the family's usual assembler does not have: alone in column 1 they are labels.
    pub foreign: &'static [&'static str],
    /// Directives that may have no label before them.
    pub without_label: &'static [&'static str],
    /// Operands of an instruction that takes none are dropped, with a warning.
    pub drops_operands: bool,
    /// Places sections at the end of a pass; returns true if one has moved, which requires another pass.
    pub place_sections: fn(&mut Assembler<'_>) -> bool,
    /// `#v(expression)` within a name is replaced by its value.
    pub value_names: bool,
    /// Returns the value of a name that depends on earlier directives.
    pub own_name_value: fn(&Assembler<'_>, &str) -> Option<i64>,
    /// Operators of the family's assemblers that are refused: each with a hint.
    pub refused_operators: &'static [(&'static str, &'static str)],
    /// Reports whether an undefined name belongs to another module.
    pub is_external: fn(&Assembler<'_>, &str) -> bool,
    /// The source is for Atmel's AVR assembler.
    pub is_atmel: bool,
    /// Reports whether the name of a register in the range of `in` and `out` is its I/O address, and not its
    /// address in data memory.
    pub names_io_addresses: fn(&Assembler<'_>) -> bool,
    /// Returns the dialect of a source whose directives begin with a dot.
    pub with_dots: fn() -> Option<&'static AsmDialect>,
    /// The source is for sdas8051, which uses the low byte of an address in constants and bytes.
    pub is_sdas: bool,
    /// Returns the end and the value of the quoted value at a position.
    pub quoted: Option<QuotedValueAt>,
    /// Returns the line with plain backslashes marked; `None` if it has none.
    pub plain_backslashes: fn(&AsmLine) -> Option<AsmLine>,
    /// Returns where the comment of a line begins.
    pub code_end: Option<fn(&str) -> usize>,
    /// Returns cause and hint if the current section cannot hold bytes.
    pub no_bytes: fn(&Assembler<'_>) -> Option<CauseAndHint>,
    /// A text in single quotes may have a comma behind its first character: `'T,C'`.
    pub commas_in_quotes: bool,
    /// Digits of a number may be in groups with this between them: `1010$1010b`, `0b1010_1010`.
    pub digit_groups: Option<char>,
    /// Values are signed with 32 bits, and higher bits are dropped; otherwise values have 64 bits.
    pub is_32: bool,
    /// Values may be complements of any value that fits: `not 0F0h` is a byte.
    pub complements: bool,
    /// Macro arguments may be in angle brackets.
    pub angle_arguments: bool,
    /// General instructions with one operand: each is replaced by the first instruction in its list that
    /// reaches the operand, or by the last if the operand is not yet known.
    pub general_instructions: &'static [(&'static str, &'static [&'static str])],
}

impl DialectHooks {
    /// No features.
    pub const NONE: DialectHooks = DialectHooks {
        check: |_, _| None,
        mismatch: |_, _, _, _| None,
        cut: |_, _, _, _| None,
        ignored_dotted: &[],
        more: &[],
        foreign: &[],
        without_label: &[],
        drops_operands: false,
        place_sections: |_| false,
        value_names: false,
        own_name_value: |_, _| None,
        refused_operators: &[],
        is_external: |_, _| false,
        is_atmel: false,
        names_io_addresses: |_| false,
        with_dots: || None,
        is_sdas: false,
        quoted: None,
        plain_backslashes: |_| None,
        code_end: None,
        no_bytes: |_| None,
        commas_in_quotes: false,
        digit_groups: None,
        is_32: false,
        complements: false,
        angle_arguments: false,
        general_instructions: &[],
    };
}

/// The operators of C, with its precedence.
#[rustfmt::skip]
const C_OPERATORS: &[(&str, u8, AsmOperator)] = &[
    ("*", 10, AsmOperator::Mul), ("/", 10, AsmOperator::Div), ("%", 10, AsmOperator::Mod), ("+", 9, AsmOperator::Add), ("-", 9, AsmOperator::Sub),
    ("<<", 8, AsmOperator::Shl), (">>", 8, AsmOperator::Shr),
    ("<", 7, AsmOperator::Less), ("<=", 7, AsmOperator::LessEqual), (">", 7, AsmOperator::Greater), (">=", 7, AsmOperator::GreaterEqual),
    ("==", 6, AsmOperator::Equal), ("!=", 6, AsmOperator::Unequal),
    ("&", 5, AsmOperator::And), ("^", 4, AsmOperator::Xor), ("|", 3, AsmOperator::Or), ("&&", 2, AsmOperator::BothTrue), ("||", 1, AsmOperator::EitherTrue),
];

/// The unary operators of C, and functions that return a byte of a number.
#[rustfmt::skip]
const C_UNARY: &[UnaryOperator] = &[
    ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| if n == 0 { 1 } else { 0 }),
    ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF),
];

/// How an include is resolved.
pub(crate) enum ProvidedInclude {
    /// The chip's own names replace it.
    Chip,
    /// It is for another chip: cause and hint.
    OtherChip(String, String),
    /// It is for the chip of this name and provides that chip's names: then cause and hint for when that chip
    /// is unknown.
    NamedChip(String, String, String),
    /// It is a file.
    NotProvided,
}

/// A section as a table row.
pub(crate) struct SectionRow {
    /// Its name. A name that ends with `*` covers all sections with that prefix, in the order in which the
    /// source names them.
    pub name: &'static str,
    /// Name of the memory of its labels; empty if the windows of the image file determine it.
    pub space: &'static str,
    /// What it holds.
    pub content: SectionContent,
    /// It follows the previous sections of its memory, at a multiple of this.
    pub align_after_previous: Option<i64>,
}

/// What a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SectionContent {
    /// The image, at addresses of the image file.
    Image,
    /// Bytes of one memory of the image.
    Memory,
    /// Nothing: only labels get addresses.
    Addresses,
    /// Bytes stored after the program, whose labels have addresses of RAM.
    Copied,
}

/// A form of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NumberForm {
    /// `0x1F`
    Hex0x,
    /// `0b101`
    Binary0b,
    /// `$1F`
    HexDollar,
    /// `$$1F`
    HexDollars,
    /// `0h1F`, `0o17`, `0q17`, `0d31`
    ZeroLetter,
    /// `%101`
    BinaryPercent,
    /// `0FFH`
    HexH,
    /// `101B`
    BinaryB,
    /// `$%101`, `$&17`, `$#31`
    DollarMark,
    /// `17O`, `17Q`
    OctalOQ,
    /// `31D`
    DecimalD,
    /// `017`
    OctalZero,
    /// `.31`
    DecimalDot,
    /// `H'1F'`, `D'31'`, `O'17'`, `B'101'`, `A'c'`
    Quoted,
    /// Digits in the current radix.
    Plain,
}

/// How values are divided, shifted to the right and compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AsmArithmetic {
    /// Signed, in 64 bits.
    Signed,
    /// Unsigned: negative values become their two's complement of this many bits.
    Unsigned(u32),
}

impl AsmArithmetic {
    /// Returns the value as an operand of a division, shift or comparison.
    pub fn operand(self, n: i64) -> i64 {
        match self {
            AsmArithmetic::Unsigned(bits) if n < 0 => n & ((1 << bits.min(62)) - 1),
            _ => n,
        }
    }
}

/// A binary operator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub(crate) enum AsmOperator {
    Mul,
    Div,
    Mod,
    Add,
    Sub,
    Shl,
    Shr,
    And,
    Or,
    Xor,
    OrNot,
    Equal,
    Unequal,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    BothTrue,
    EitherTrue,
    BitOf,
}

/// A directive: its name without a dot, and its action.
pub(crate) struct AsmDirective {
    /// Name in lower case.
    pub name: &'static str,
    /// The role of a word before it.
    pub label: LabelUse,
    /// Its action.
    pub action: DirectiveAction,
}

/// The role of a word before a directive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LabelUse {
    /// A label for the address.
    Address,
    /// The name that the directive defines.
    Name,
}

/// What a directive does.
#[derive(Clone, Copy)]
pub(crate) enum DirectiveAction {
    /// Acts on the line.
    Run(fn(&mut Assembler<'_>, &DirectiveCall<'_>)),
    /// Decides which lines are read.
    Flow(ReadFlow),
}

/// Directives that decide which lines are read.
#[derive(Clone, Copy)]
pub(crate) enum ReadFlow {
    /// Begins a condition.
    If(fn(&mut Assembler<'_>, &DirectiveCall<'_>) -> bool),
    /// Another condition, tested if the previous ones did not hold.
    Elif(fn(&mut Assembler<'_>, &DirectiveCall<'_>) -> bool),
    /// The lines for the case that no condition held.
    Else,
    /// Lines of the current condition, read depending on whether it holds.
    Within(fn(bool) -> bool),
    /// A statement on the same line, read depending on whether the enclosing condition holds.
    WithinLine(fn(bool) -> bool),
    /// Ends a condition.
    Endif,
    /// Begins a macro.
    Macro,
    /// Begins a repetition: the texts that replace a name in each iteration, or the number of iterations.
    Repeat(fn(&mut Assembler<'_>, &DirectiveCall<'_>) -> RepeatIterations),
    /// Begins a repetition while a condition holds.
    While,
    /// Begins lines that the directive reads itself.
    Block(fn(&mut Assembler<'_>, &DirectiveCall<'_>, LineBlock)),
    /// Ends such lines.
    EndBlock,
    /// Ends a macro.
    Endm,
    /// Ends a repetition.
    Endr,
    /// Ends a `while`.
    Endw,
}

/// The iterations of a repetition.
pub(crate) struct RepeatIterations {
    /// The name that is replaced in each iteration; `None` if all iterations are equal.
    pub name: Option<String>,
    /// The texts that replace it.
    pub texts: Vec<String>,
    /// The number of iterations if all are equal.
    pub count: u64,
}

/// The state of each family during a pass.
#[derive(Debug, Default)]
pub(crate) struct FamilyState {
    /// State of the AVR dialect.
    pub avr: avr::AvrPassState,
    /// State of the PIC16 dialect.
    pub pic16: pic16::Pic16PassState,
    /// State of the 8051 dialect.
    pub mcs51: mcs51::Mcs51PassState,
    /// State of the AP101 dialect.
    pub ap101: ap101::Ap101PassState,
}

impl FamilyState {
    /// Returns the state that the next pass takes over.
    pub fn state_for_next_pass(self) -> FamilyState {
        FamilyState { avr: self.avr.next(), mcs51: self.mcs51.next(), ..FamilyState::default() }
    }
}

impl AsmDirective {
    /// Returns a directive that may have a label before it.
    pub const fn run(name: &'static str, run: fn(&mut Assembler<'_>, &DirectiveCall<'_>)) -> AsmDirective {
        AsmDirective { name, label: LabelUse::Address, action: DirectiveAction::Run(run) }
    }

    /// Returns a directive that defines the name before it.
    pub const fn named(name: &'static str, run: fn(&mut Assembler<'_>, &DirectiveCall<'_>)) -> AsmDirective {
        AsmDirective { name, label: LabelUse::Name, action: DirectiveAction::Run(run) }
    }

    /// Returns a directive that decides which lines are read.
    pub const fn flow(name: &'static str, flow: ReadFlow) -> AsmDirective {
        let label = if matches!(flow, ReadFlow::Macro) { LabelUse::Name } else { LabelUse::Address };
        AsmDirective { name, label, action: DirectiveAction::Flow(flow) }
    }
}

impl AsmDialect {
    /// Wraps a value to the number of bits that values have.
    pub fn wrap_value(&self, n: i64) -> i64 {
        if self.hooks.is_32 { i64::from(n as i32) } else { n }
    }

    /// Returns the position after the name at `at`: for Atmel's assembler `?` is an operator.
    pub fn name_end(&self, text: &str, at: usize) -> usize {
        let end = behind_name(text, at, !self.dot_is_bit);
        let mark = text.get(at..end).and_then(|name| name.find('?')).filter(|_| self.hooks.is_atmel);
        mark.map_or(end, |mark| at + mark)
    }

    /// Returns the dialect of a chip.
    pub fn of(chip: &Chip) -> &'static AsmDialect {
        match chip.family {
            ChipFamily::Avr => &avr::AVR,
            ChipFamily::Mcs51 => &mcs51::MCS51,
            ChipFamily::Pic16 => &pic16::PIC16,
            ChipFamily::Ap101 => &ap101::AP101,
        }
    }

    /// Returns the directive `name`, which is in lower case and without a dot.
    pub fn find_directive(&self, name: &str) -> Option<&'static AsmDirective> {
        self.all_directives().find(|directive| directive.name == name)
    }

    /// Returns the names of all directives.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.all_directives().map(|directive| directive.name)
    }

    fn all_directives(&self) -> impl Iterator<Item = &'static AsmDirective> {
        self.directives.iter().chain(self.hooks.more).chain(common::DIRECTIVES)
    }
}
