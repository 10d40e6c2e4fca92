//! What the assemblers of the families do differently, as data.
//!
//! One engine reads all of them; a dialect is a row of tables: comment marks, forms of numbers, operators with their
//! precedence, and directives by name.

mod ap101;
pub(crate) mod avr;
mod common;
mod mcs51;
pub(crate) mod pic16;

use std::ops::Range;

use emu_core::chip::{Chip, ChipFamily};
use emu_core::table::InstructionRow;

use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::AsmLine;
use crate::reader::LineBlock;

/// A unary operator or a function of one value: token, how strongly what follows must bind, what it does.
pub(crate) type UnaryOperator = (&'static str, u8, fn(i64) -> i64);

/// What a dialect tells of an instruction with the values of its operands and where they stand.
pub(crate) type CheckInstruction = fn(&InstructionRow, &[(i32, Range<usize>)]) -> Option<LineFault>;

/// What a dialect makes of a value beyond the field of an operand of a kind: the value that fits, and code, cause and hint of a
/// warning. `None` where the value is taken as it is, or refused as any other.
pub(crate) type CutToField = fn(&Chip, kind: &str, value: i64) -> Option<(i64, Option<AsmRefusal>)>;

/// A dialect.
pub(crate) struct AsmDialect {
    /// Characters that begin a comment anywhere outside quotes.
    pub comments: &'static [&'static str],
    /// Characters that begin a comment at the beginning of a line.
    pub line_comments: &'static [&'static str],
    /// Characters that end a statement, so that another may follow on the line.
    pub separators: &'static [u8],
    /// `/* .. */` is a comment, over several lines.
    pub block_comments: bool,
    /// A word in column 1 that is no instruction, directive or macro is a label without a colon.
    pub labels_in_column_one: bool,
    /// An instruction or directive in column 1 is told.
    pub warns_in_column_one: bool,
    /// The forms of numbers, the first that fits wins.
    pub numbers: &'static [NumberForm],
    /// Radix of a plain number, until a directive changes it.
    pub radix: u32,
    /// `byte.bit` is a bit address, so that names have no dots inside.
    pub dot_is_bit: bool,
    /// Names of the location counter.
    pub location_counter_names: &'static [&'static str],
    /// Within an instruction the location counter stands behind it.
    pub counter_after_instruction: bool,
    /// Within a list of values the location counter stands where the line begins; but not `.`, which moves with each value.
    pub counter_at_line_start: bool,
    /// Binary operators: token, how strongly it binds, meaning.
    pub operators: &'static [(&'static str, u8, AsmOperator)],
    /// Unary operators and functions of one value: token, how strongly what follows must bind, what it does.
    pub unary: &'static [UnaryOperator],
    /// What a comparison that holds gives.
    pub true_value: i64,
    /// How values are divided, shifted and compared.
    pub arithmetic: AsmArithmetic,
    /// Lines that begin with `$` and a word are controls of the assembler.
    pub controls: bool,
    /// Labels are numbers, `1f` and `1b` mean the next and the last of them.
    pub numbered_labels: bool,
    /// Labels are numbers with a `$` behind, known between two labels with names.
    pub dollar_labels: bool,
    /// Names of symbols are the same in upper and lower case where no other is meant.
    pub ignores_case: bool,
    /// Macro arguments stand in the body by their names alone, without a backslash.
    pub plain_arguments: bool,
    /// Words of several bytes begin with the high byte.
    pub big_endian: bool,
    /// A value that `org` puts into what it leaps over within the program.
    pub org_fills: Option<u8>,
    /// Macro arguments may stand with spaces between them.
    pub spaced_arguments: bool,
    /// Memory that is reserved gets bytes of 0 (else none).
    pub space_fills: bool,
    /// A letter with a value in brackets is the name of a place: `M(256+n)`.
    pub zones: bool,
    /// Literals of the syntax that a value may stand for.
    pub literals: &'static [(&'static str, i64)],
    /// What few dialects have.
    pub hooks: DialectHooks,
    /// Directives of this dialect alone, looked up before the common ones.
    pub directives: &'static [AsmDirective],
    /// Includes that the chip's data stand for: the name without path and `<>`, in lower case.
    pub include_provided: fn(chip: &Chip, include: &str) -> ProvidedInclude,
    /// Names and texts that are defined before the first line.
    pub predefined: fn(chip: &Chip) -> Vec<(String, String)>,
    /// An instruction that the dialect does not take with these operands: code, cause and hint.
    pub refuse_instruction: fn(mnemonic: &str, operands: &str) -> Option<AsmRefusal>,
    /// What is done at the end of each pass.
    pub finish_pass: fn(&mut Assembler<'_>),
    /// The sections in the order in which they lie; the program begins in `text`, or else in the first.
    pub sections: &'static [SectionRow],
}

/// Where a value in quotes ends, and the value; none where nothing stands behind the quote.
pub(crate) type QuotedValueAt = fn(text: &str, at: usize) -> Option<(usize, u16)>;

/// What few dialects have.
#[derive(Clone, Copy)]
pub(crate) struct DialectHooks {
    /// Looks at an instruction that fits: its row, and the operands that stand in its pattern with their places.
    pub check: CheckInstruction,
    /// The warning about a name as an operand of a kind, with its value.
    pub mismatch: fn(&Assembler<'_>, name: &str, kind: &str, value: i32) -> Option<AsmRefusal>,
    /// The value that an operand has where the one that is written does not fit its field, and the warning that says so.
    pub cut: CutToField,
    /// Directives without effect that are known with a dot alone, here without it.
    pub ignored_dotted: &'static [&'static str],
    /// Directives behind those of the dialect, for dialects with many.
    pub more: &'static [AsmDirective],
    /// Directives that the family's usual assembler has not: alone in column 1 they are labels.
    pub foreign: &'static [&'static str],
    /// Operands of an instruction that takes none are left out, with a warning.
    pub drops_operands: bool,
    /// Puts sections in their places at the end of a pass; true where one has moved, so that another pass is wanted.
    pub place_sections: fn(&mut Assembler<'_>) -> bool,
    /// `#v(expression)` within a name stands for its value.
    pub value_names: bool,
    /// Names whose values hang on what the program has said before.
    pub own_name_value: fn(&FamilyState, &str) -> Option<i64>,
    /// A name that no line gives is one of another module.
    pub is_external: fn(&Assembler<'_>, &str) -> bool,
    /// The source is one for Atmel's assembler for the AVR.
    pub is_atmel: bool,
    /// The dialect of a source that has a directive with a dot in front.
    pub with_dots: fn() -> Option<&'static AsmDialect>,
    /// The source is one for sdas8051, where the low byte of an address stands for it in constants and bytes.
    pub is_sdas: bool,
    /// The value in quotes that begins at a byte of the text, and where it ends.
    pub quoted: Option<QuotedValueAt>,
    /// The line with what stands for backslashes that are plain characters; none where there are none.
    pub plain_backslashes: fn(&AsmLine) -> Option<AsmLine>,
    /// Where the comment of a line begins.
    pub code_end: Option<fn(&str) -> usize>,
    /// Why bytes have no place in the current section: cause and hint.
    pub no_bytes: fn(&Assembler<'_>) -> Option<(String, String)>,
    /// Digits of a number may stand in groups: `1010$1010b`.
    pub digit_groups: bool,
    /// Values have 32 bits with a sign, and what is above is cut off; those of others have 64.
    pub is_32: bool,
    /// Values may be complements of any value that fits: `not 0F0h` is a byte.
    pub complements: bool,
    /// Arguments of macros may stand in angles.
    pub angle_arguments: bool,
    /// Instructions with one operand that stand for the first of others that reaches it; the last of them where the operand is not known
    /// by then.
    pub general_instructions: &'static [(&'static str, &'static [&'static str])],
}

impl DialectHooks {
    /// None of it.
    pub const NONE: DialectHooks = DialectHooks {
        check: |_, _| None,
        mismatch: |_, _, _, _| None,
        cut: |_, _, _| None,
        ignored_dotted: &[],
        more: &[],
        foreign: &[],
        drops_operands: false,
        place_sections: |_| false,
        value_names: false,
        own_name_value: |_, _| None,
        is_external: |_, _| false,
        is_atmel: false,
        with_dots: || None,
        is_sdas: false,
        quoted: None,
        plain_backslashes: |_| None,
        code_end: None,
        no_bytes: |_| None,
        digit_groups: false,
        is_32: false,
        complements: false,
        angle_arguments: false,
        general_instructions: &[],
    };
}

/// Code, cause and hint.
pub(crate) type AsmRefusal = (&'static str, String, String);

/// The operators of C, with its precedence.
#[rustfmt::skip]
const C_OPERATORS: &[(&str, u8, AsmOperator)] = &[
    ("*", 10, AsmOperator::Mul), ("/", 10, AsmOperator::Div), ("%", 10, AsmOperator::Mod), ("+", 9, AsmOperator::Add), ("-", 9, AsmOperator::Sub),
    ("<<", 8, AsmOperator::Shl), (">>", 8, AsmOperator::Shr),
    ("<", 7, AsmOperator::Less), ("<=", 7, AsmOperator::LessEqual), (">", 7, AsmOperator::Greater), (">=", 7, AsmOperator::GreaterEqual),
    ("==", 6, AsmOperator::Equal), ("!=", 6, AsmOperator::Unequal),
    ("&", 5, AsmOperator::And), ("^", 4, AsmOperator::Xor), ("|", 3, AsmOperator::Or), ("&&", 2, AsmOperator::BothTrue), ("||", 1, AsmOperator::EitherTrue),
];

/// The signs of C, and the bytes of a number.
#[rustfmt::skip]
const C_UNARY: &[UnaryOperator] = &[
    ("-", 11, |n| n.wrapping_neg()), ("+", 11, |n| n), ("~", 11, |n| !n), ("!", 11, |n| if n == 0 { 1 } else { 0 }),
    ("low", 11, |n| n & 0xFF), ("high", 11, |n| n >> 8 & 0xFF),
];

/// What becomes of an include.
pub(crate) enum ProvidedInclude {
    /// The chip's own names stand for it.
    Chip,
    /// It is one for another chip: its cause and hint.
    OtherChip(String, String),
    /// It is one for the chip of this name, whose names it gives: cause, and hint where that chip is not known.
    NamedChip(String, String, String),
    /// It is a file.
    NotProvided,
}

/// A section as a row.
pub(crate) struct SectionRow {
    /// Its name; with a `*` at its end it stands for all sections that begin so, in the order in which they are named.
    pub name: &'static str,
    /// Name of the memory that its labels are in; empty where the windows of the image file say it.
    pub space: &'static str,
    /// What it holds.
    pub content: SectionContent,
    /// It lies behind the sections before it in the same memory, from a multiple of this on.
    pub align_after_previous: Option<i64>,
}

/// What a section holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SectionContent {
    /// The image, at addresses of the image file.
    Image,
    /// Bytes of one memory of the image.
    Memory,
    /// Nothing: labels get addresses.
    Addresses,
    /// Bytes that lie behind the program, while labels have addresses of RAM.
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
    /// Digits in the radix that holds.
    Plain,
}

/// How values are divided, shifted to the right and compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AsmArithmetic {
    /// With their signs, in 64 bits.
    Signed,
    /// Negative ones as their complements of so many bits.
    Unsigned(u32),
}

impl AsmArithmetic {
    /// The value as it is divided, shifted or compared.
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

/// A directive: its name without a dot, and what it does.
pub(crate) struct AsmDirective {
    /// Name in lower case.
    pub name: &'static str,
    /// What it does with a word in front of it.
    pub label: LabelUse,
    /// What it does.
    pub action: DirectiveAction,
}

/// What a word in front of a directive is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LabelUse {
    /// A label for the address.
    Address,
    /// What the directive is about.
    Name,
}

/// What a directive does.
#[derive(Clone, Copy)]
pub(crate) enum DirectiveAction {
    /// Something with the line.
    Run(fn(&mut Assembler<'_>, &DirectiveCall<'_>)),
    /// Decides which lines are read.
    Flow(ReadFlow),
}

/// Directives that decide which lines are read.
#[derive(Clone, Copy)]
pub(crate) enum ReadFlow {
    /// Begins a condition.
    If(fn(&mut Assembler<'_>, &DirectiveCall<'_>) -> bool),
    /// Another condition where those before did not hold.
    Elif(fn(&mut Assembler<'_>, &DirectiveCall<'_>) -> bool),
    /// The lines where none held.
    Else,
    /// Lines of the same condition, read by whether it holds.
    Within(fn(bool) -> bool),
    /// A statement on the same line, read by whether the condition around it holds.
    WithinLine(fn(bool) -> bool),
    /// Ends a condition.
    Endif,
    /// Begins a macro.
    Macro,
    /// Begins a repetition: the texts that stand for a name in each turn (or how many turns).
    Repeat(fn(&mut Assembler<'_>, &DirectiveCall<'_>) -> RepeatIterations),
    /// Begins a repetition while a condition holds.
    While,
    /// Begins lines that the directive reads itself.
    Block(fn(&mut Assembler<'_>, &DirectiveCall<'_>, LineBlock)),
    /// Ends them.
    EndBlock,
    /// Ends a macro.
    Endm,
    /// Ends a repetition.
    Endr,
    /// Ends a `while`.
    Endw,
}

/// The turns of a repetition.
pub(crate) struct RepeatIterations {
    /// The name that stands for another text in each turn; none where all turns are alike.
    pub name: Option<String>,
    /// The texts that it stands for.
    pub texts: Vec<String>,
    /// The number of turns that are alike.
    pub count: u64,
}

/// What families keep during a pass.
#[derive(Debug, Default)]
pub(crate) struct FamilyState {
    /// The PIC16's.
    pub pic16: pic16::Pic16PassState,
    /// The 8051's.
    pub mcs51: mcs51::Mcs51PassState,
    /// AP101's.
    pub ap101: ap101::Ap101PassState,
}

impl FamilyState {
    /// What the next pass takes over from this one.
    pub fn state_for_next_pass(self) -> FamilyState {
        FamilyState { mcs51: self.mcs51.next(), ..FamilyState::default() }
    }
}

impl AsmDirective {
    /// A directive in front of which a label may stand.
    pub const fn run(name: &'static str, run: fn(&mut Assembler<'_>, &DirectiveCall<'_>)) -> AsmDirective {
        AsmDirective { name, label: LabelUse::Address, action: DirectiveAction::Run(run) }
    }

    /// A directive that is about the word in front of it.
    pub const fn named(name: &'static str, run: fn(&mut Assembler<'_>, &DirectiveCall<'_>)) -> AsmDirective {
        AsmDirective { name, label: LabelUse::Name, action: DirectiveAction::Run(run) }
    }

    /// A directive that decides which lines are read.
    pub const fn flow(name: &'static str, flow: ReadFlow) -> AsmDirective {
        let label = if matches!(flow, ReadFlow::Macro) { LabelUse::Name } else { LabelUse::Address };
        AsmDirective { name, label, action: DirectiveAction::Flow(flow) }
    }
}

impl AsmDialect {
    /// A value with the bits that values have.
    pub fn wrap_value(&self, n: i64) -> i64 {
        if self.hooks.is_32 { i64::from(n as i32) } else { n }
    }

    /// The dialect of a chip.
    pub fn of(chip: &Chip) -> &'static AsmDialect {
        match chip.family {
            ChipFamily::Avr => &avr::AVR,
            ChipFamily::Mcs51 => &mcs51::MCS51,
            ChipFamily::Pic16 => &pic16::PIC16,
            ChipFamily::Ap101 => &ap101::AP101,
        }
    }

    /// The directive `name`, in lower case and without a dot.
    pub fn find_directive(&self, name: &str) -> Option<&'static AsmDirective> {
        self.all_directives().find(|directive| directive.name == name)
    }

    /// Names of all directives.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.all_directives().map(|directive| directive.name)
    }

    fn all_directives(&self) -> impl Iterator<Item = &'static AsmDirective> {
        self.directives.iter().chain(self.hooks.more).chain(common::DIRECTIVES)
    }
}
