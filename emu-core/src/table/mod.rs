//! The instruction table: one row per instruction, and what is derived from the rows.
//!
//! A chip family writes its table once, as a callback macro: `family_table! { callback }` passes every row to
//! `callback!`. [`define_isa!`](crate::define_isa) makes the rows into data ([`InstructionRow`], and one
//! `PredecodedOp` kind per row). [`dispatch!`](crate::dispatch) makes them into the arms of the interpreter's
//! `match`. Decoder, disassembler, assembler, encoder and the lists in the documentation all use the same
//! rows.
//!
//! ```text
//! /// Compare, skip if equal.
//! Cpse  "cpse" "d, r"  "0001 00rd dddd rrrr" (d: R, r: R, n: Skip)  "1/2/3" ""  => cpse(d, r, n);
//! name  mnemonic       bit pattern           operands in op order   cycles  flags  body
//!              syntax: lower-case letters are operands, the rest is literal text
//! ```
//!
//! A row can name a second op kind after its body, for operands that predecode finds to be plain RAM. It has
//! the same text and body, but other operand types ([`RamOperand`]).
//!
//! Operands that are not in the pattern (such as `Skip`, the length of the next instruction) are computed at
//! predecode. If two rows match, the first one wins; a test of each family lists the overlaps that are
//! intended.

mod docs;
mod pattern;
mod text;

pub use docs::instruction_list_markdown;
pub use pattern::{BitPattern, CycleCounts, OperandField};
pub use text::{AsmError, DisassembledInstruction, NamedOperand, SyntaxAlias, alias, disassemble};

use crate::CoreError;

/// A predecoded instruction of four bytes. `kind` names the row. The other bytes hold the operands in row
/// order; a wide operand takes two bytes (little endian).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C, align(4))]
pub struct PredecodedOp<K> {
    /// The row, or one of the extra kinds after the rows (illegal, breakpoint, ..).
    pub kind: K,
    /// Operand bytes.
    pub args: [u8; 3],
}

/// The place of an instruction: the values beyond its own bits that an operand can depend on.
#[derive(Debug, Clone, Copy, Default)]
pub struct InstructionLocation {
    /// Address of the instruction in program words.
    pub pc: u32,
    /// Length of the instruction in program words.
    pub len: u32,
    /// Length of the instruction that follows it, in program words.
    pub next_len: u32,
    /// Number of program words minus one, where the size is a power of two; targets wrap within it.
    pub pc_mask: u32,
}

/// An operand kind: how a field of the pattern is converted to a value and back, and how the value is written
/// as text.
pub trait Operand: Copy + Sized {
    /// The description of the kind, as data for the tools.
    const KIND: OperandKind;
    /// Makes an operand from the value that predecode put into the op.
    fn from_value(value: u16) -> Self;
    /// Takes this operand from an op whose next unread operand byte is `at`, and advances `at`.
    #[inline(always)]
    fn decode_next<K>(op: &PredecodedOp<K>, at: &mut usize) -> Self {
        if Self::KIND.wide {
            let value = u16::from_le_bytes([op.args[*at], op.args[*at + 1]]);
            *at += 2;
            Self::from_value(value)
        } else {
            let value = op.args[*at];
            *at += 1;
            Self::from_value(u16::from(value))
        }
    }
}

/// An operand kind that predecode can find to be in RAM, and its type in the second shape of a row.
pub trait RamOperand: Operand {
    /// The operand type in RAM; `Self` if nothing changes.
    type Ram;
    /// Takes the RAM operand from an op whose next unread operand byte is `at`, and advances `at`.
    fn decode_next_in_ram<K>(op: &PredecodedOp<K>, at: &mut usize) -> Self::Ram;
}

/// An operand kind as data for the tools.
#[derive(Debug, Clone, Copy)]
pub struct OperandKind {
    /// Name for documentation and messages: `register`, `bit`, ..
    pub name: &'static str,
    /// The operand takes two bytes of the op.
    pub wide: bool,
    /// Converts a field of the pattern (`raw`, `bits` wide) to a value. Kinds that are not in a pattern
    /// ignore `raw`.
    pub decode: fn(raw: u32, bits: u32, site: &InstructionLocation) -> i32,
    /// Converts a value to a field of the pattern. The error says which values are allowed.
    pub encode: fn(value: i32, bits: u32, site: &InstructionLocation) -> Result<u32, CoreError>,
    /// Writes the value as assembly text.
    pub write_text: fn(value: i32, out: &mut String),
    /// Returns the value of a name that only this kind knows, such as `r16`.
    pub parse_name: fn(text: &str) -> Option<i32>,
    /// Converts a number in the text to a value. Most kinds return it unchanged; some convert a byte address
    /// to words. The error says what is expected.
    pub check_number: fn(value: i32, site: &InstructionLocation) -> Result<i32, CoreError>,
    /// Converts a register of the chip that is named in the text, given its address in
    /// [`Chip::reg_space`](crate::chip::Chip::reg_space). Most kinds return that address.
    pub check_register: fn(addr: i32) -> Result<i32, CoreError>,
}

impl OperandKind {
    /// Accepts no names: the [`OperandKind::parse_name`] of most kinds.
    #[must_use]
    pub fn never_a_name(_: &str) -> Option<i32> {
        None
    }

    /// Returns the number unchanged: the [`OperandKind::check_number`] of most kinds.
    ///
    /// # Errors
    /// Never fails.
    pub fn same_number(value: i32, _: &InstructionLocation) -> Result<i32, CoreError> {
        Ok(value)
    }

    /// Returns the address unchanged: the [`OperandKind::check_register`] of most kinds.
    ///
    /// # Errors
    /// Never fails.
    pub fn same_address(addr: i32) -> Result<i32, CoreError> {
        Ok(addr)
    }
}

/// One operand of a row.
#[derive(Debug, Clone, Copy)]
pub struct OperandSlot {
    /// Letter of the operand in pattern and syntax.
    pub letter: u8,
    /// Kind of the operand.
    pub kind: &'static OperandKind,
}

/// How an instruction can change the order of execution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlowKind {
    /// It continues at the next instruction, or always at another place.
    Straight,
    /// It has a condition: it continues at the next instruction or at another place.
    Conditional,
    /// It ends the service of an interrupt.
    EndsInterrupt,
}

/// One instruction: a row of the table.
#[derive(Debug, Clone, Copy)]
pub struct InstructionRow {
    /// Name of the op kind, such as `Add`.
    pub name: &'static str,
    /// Mnemonic, lower case.
    pub mnemonic: &'static str,
    /// Operand syntax: lower-case letters are operands, everything else literal text.
    pub syntax: &'static str,
    /// The bit pattern of the instruction.
    pub pattern: BitPattern,
    /// Operands in op order.
    pub operands: &'static [OperandSlot],
    /// The number of cycles of every outcome.
    pub cycles: CycleCounts,
    /// Letters of the flags that the instruction can write.
    pub flags: &'static str,
    /// The doc comment of the row.
    pub doc: &'static str,
}

impl InstructionRow {
    /// Length in program words, never 0.
    #[must_use]
    #[allow(clippy::len_without_is_empty)]
    pub const fn len(&self) -> u32 {
        self.pattern.words()
    }

    /// Returns true if the number of cycles depends on a condition.
    #[must_use]
    pub fn has_variable_cycles(&self) -> bool {
        self.cycles.possible_counts().len() > 1
    }

    /// Returns the values of the operands of the instruction `bits` at `site`, in row order.
    pub fn operand_values<'a>(&'a self, bits: u32, site: &'a InstructionLocation) -> impl Iterator<Item = i32> + 'a {
        self.operands.iter().map(move |slot| {
            let field = self.pattern.extract_field(slot.letter, bits);
            (slot.kind.decode)(field.raw, field.width, site)
        })
    }

    /// Makes the op of the instruction `bits` at `site`; `kind` is the row's kind.
    #[must_use]
    pub fn predecode<K>(&self, kind: K, bits: u32, site: &InstructionLocation) -> PredecodedOp<K> {
        let mut op = PredecodedOp { kind, args: [0; 3] };
        let mut at = 0;
        for (slot, value) in self.operands.iter().zip(self.operand_values(bits, site)) {
            op.args[at] = value as u8;
            at += 1;
            if slot.kind.wide {
                op.args[at] = (value >> 8) as u8;
                at += 1;
            }
        }
        op
    }

    /// Encodes this instruction. `values` are the operands that are in the pattern, in row order.
    ///
    /// # Errors
    /// The number of operands is wrong, or an operand does not fit; the error says what is allowed.
    pub fn encode(&self, values: &[i32], site: &InstructionLocation) -> Result<u32, EncodeError> {
        let wanted = self.operands.iter().filter(|s| self.pattern.has_letter(s.letter)).count();
        if values.len() != wanted {
            return Err(EncodeError {
                mnemonic: self.mnemonic,
                cause: CoreError::OperandCount { wanted, given: values.len() },
            });
        }
        let mut bits = self.pattern.canonical;
        let in_pattern = self.operands.iter().filter(|s| self.pattern.has_letter(s.letter));
        for (slot, &value) in in_pattern.zip(values) {
            let width = self.pattern.extract_field(slot.letter, 0).width;
            let raw = (slot.kind.encode)(value, width, site)
                .map_err(|cause| EncodeError { mnemonic: self.mnemonic, cause })?;
            bits |= self.pattern.insert_field(slot.letter, raw);
        }
        Ok(bits)
    }
}

/// Error: an operand does not fit into an instruction.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{mnemonic}: {cause}")]
pub struct EncodeError {
    /// Mnemonic of the instruction.
    pub mnemonic: &'static str,
    /// What is wrong with which operand.
    #[source]
    pub cause: CoreError,
}

/// Encodes a value from `low` to `high` as its distance from `low`.
///
/// # Errors
/// [`CoreError::OutOfRange`] names `what` and the range.
pub fn check_range(value: i32, low: i32, high: i32, what: &'static str) -> Result<u32, CoreError> {
    if (low..=high).contains(&value) {
        Ok((value - low) as u32)
    } else {
        Err(CoreError::OutOfRange { what, value, low, high })
    }
}

/// Encodes a value that fits `bits` bits.
///
/// # Errors
/// [`CoreError::OutOfRange`] names `what` and the range.
pub fn check_field(value: i32, bits: u32, what: &'static str) -> Result<u32, CoreError> {
    check_range(value, 0, (1 << bits) - 1, what)
}

/// A row of the instruction table that matches.
#[derive(Debug, Clone, Copy)]
pub struct FoundRow {
    /// The position of the row in the table.
    pub index: usize,
    /// The bits of the instruction.
    pub bits: u32,
}

/// Finds the first row that matches the instruction at the start of `words`, which have `word_bits` bits
/// each. Returns the position of the row and the bits of the instruction. Words after the end read as 0.
#[must_use]
pub fn find_row(rows: &[InstructionRow], word_bits: u32, words: &[u16]) -> Option<FoundRow> {
    rows.iter().enumerate().find_map(|(i, row)| {
        let bits = instruction_bits(row, word_bits, words);
        row.pattern.matches(bits).then_some(FoundRow { index: i, bits })
    })
}

/// The row of an instruction, its kind among those of its table, and its bits.
#[derive(Debug, Clone, Copy)]
pub struct MatchedRow<K> {
    /// The row.
    pub row: &'static InstructionRow,
    /// The row as a kind of op.
    pub kind: K,
    /// The bits of the instruction.
    pub bits: u32,
}

/// The bits of an instruction of `row`'s length at the front of `words`.
#[must_use]
pub fn instruction_bits(row: &InstructionRow, word_bits: u32, words: &[u16]) -> u32 {
    (0..row.len() as usize).fold(0, |bits, i| bits << word_bits | words.get(i).copied().map_or(0, u32::from))
}

/// Returns the program words of an instruction of `row`, first word first.
#[must_use]
pub fn instruction_words(row: &InstructionRow, word_bits: u32, bits: u32) -> Vec<u16> {
    (0..row.len()).rev().map(|i| (bits >> (i * word_bits) & ((1 << word_bits) - 1)) as u16).collect()
}

/// Defines the enum `$kinds` (one variant per row, then the extra kinds), `ROWS` and the names, from a table
/// in callback form.
///
/// The table calls it with the word size in bits, then rows of the form shown in [`crate::table`].
#[macro_export]
macro_rules! define_isa {
    ($kinds:ident; $word_bits:literal; extra { $($(#[doc = $xdoc:literal])* $extra:ident),* $(,)? }
     $( $(#[doc = $doc:literal])+ $name:ident $mnemonic:literal $syntax:literal $pattern:literal
        ($($letter:ident : $kind:ident),*) $cycles:literal $flags:literal => $body:ident ( $($arg:expr),* ) $(, $shape:ident)? ; )*) => {
        /// The instructions, one per row of the table, followed by kinds that only predecode makes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum $kinds {
            $( $(#[doc = $doc])+ $name, )*
            $( $( #[doc = concat!("`", stringify!($name), "` on operands that predecode has found to lie in RAM.")] $shape, )? )*
            $( $(#[doc = $xdoc])* $extra, )*
        }

        /// Every instruction, in table order; the number of a kind is its position.
        pub const ROWS: &[$crate::table::InstructionRow] = &[ $( $crate::table::InstructionRow {
            name: stringify!($name),
            mnemonic: $mnemonic,
            syntax: $syntax,
            pattern: $crate::table::BitPattern::parse($pattern, $word_bits),
            operands: &[ $( $crate::table::OperandSlot {
                letter: stringify!($letter).as_bytes()[0],
                kind: &<$kind as $crate::table::Operand>::KIND,
            } ),* ],
            cycles: $crate::table::CycleCounts::parse($cycles),
            flags: $flags,
            doc: concat!($($doc),+),
        }, )* ];

        /// The kind of each row for operands in RAM; `None` for most families and rows.
        pub const SHAPES: &[Option<$kinds>] = &[ $( { let shape: Option<$kinds> = None; $( let _ = shape; let shape = Some($kinds::$shape); )? shape } ),* ];

        /// The kind of every row, in table order.
        pub const KINDS: &[$kinds] = &[ $( $kinds::$name ),* ];
    };
}

/// Expands to the `match` that runs the body of `$op` on `$m`:
/// `dispatch!{ (m, op, Kinds, op.kind, else_arm) rows.. }`, where `Kinds` is the enum of `define_isa!`.
///
/// Each arm first calls [`begin`](crate::machine::BodyMachine::begin) of the machine with the length of the
/// instruction, and its cycles if they are constant. An access of the body to the bus is therefore in the
/// last cycle charged so far. The arm of a second shape takes the operands as
/// [`RamOperand`](crate::table::RamOperand)s.
#[macro_export]
macro_rules! dispatch {
    (($m:ident, $op:ident, $kinds:ident, $kind:expr, $other:expr) $word_bits:literal; extra { $($(#[doc = $xdoc:literal])* $extra:ident),* $(,)? }
     $( $(#[doc = $doc:literal])+ $name:ident $mnemonic:literal $syntax:literal $pattern:literal
        $operands:tt $cycles:literal $flags:literal => $body:ident $args:tt $(, $shape:ident)? ; )*) => {
        match $kind {
            $( $kinds::$name => $crate::arm!($m, $op, $word_bits, $pattern, $cycles, plain $operands $body $args), )*
            $( $( $kinds::$shape => $crate::arm!($m, $op, $word_bits, $pattern, $cycles, ram $operands $body $args), )? )*
            $( $kinds::$extra )|* => $other,
        }
    };
}

/// One arm of [`dispatch!`].
#[doc(hidden)]
#[macro_export]
macro_rules! arm {
    ($m:ident, $op:ident, $word_bits:literal, $pattern:literal, $cycles:literal,
     $shape:ident ($($letter:ident : $operand:ident),*) $body:ident ( $($arg:expr),* )) => {{
        const WORDS: u32 = $crate::table::BitPattern::parse($pattern, $word_bits).words();
        const CYCLES: u32 = $crate::table::CycleCounts::parse($cycles).constant();
        let at = &mut 0usize;
        $( let $letter = $crate::operand!($shape $operand, $op, at); )*
        let _ = at;
        $m.begin(WORDS, CYCLES);
        $body($m $(, $arg)*);
    }};
}

/// One operand of an arm.
#[doc(hidden)]
#[macro_export]
macro_rules! operand {
    (plain $operand:ident, $op:ident, $at:ident) => {
        <$operand as $crate::table::Operand>::decode_next($op, $at)
    };
    (ram $operand:ident, $op:ident, $at:ident) => {
        <$operand as $crate::table::RamOperand>::decode_next_in_ram($op, $at)
    };
}
