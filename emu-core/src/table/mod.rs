//! The instruction table: one row per instruction, and what can be read off it.
//!
//! A chip family writes its table once, as a macro in callback form: `family_table! { callback }` hands every row to
//! `callback!`. [`define_isa!`](crate::define_isa) turns the rows into data ([`InstructionRow`], an `PredecodedOp` kind per row);
//! [`dispatch!`](crate::dispatch) turns them into the arms of the interpreter's `match`. Decoding, disassembly, assembly, encoding and
//! the lists in the documentation all read the same rows.
//!
//! ```text
//! /// Compare, skip if equal.
//! Cpse  "cpse" "d, r"  "0001 00rd dddd rrrr" (d: R, r: R, n: Skip)  "1/2/3" ""  => cpse(d, r, n);
//! name  mnemonic       bit pattern           operands in op order   cycles  flags  body
//!              syntax: lower-case letters are operands, the rest is literal text
//! ```
//!
//! A row may name a second kind behind its body, for operands whose place predecode finds to be plain RAM: same text, same
//! body, other operand types ([`RamOperand`]).
//!
//! Operands that do not stand in the pattern (such as `Skip`, the length of the next instruction) are computed at
//! predecode. Rows may overlap only in order: the first row that matches wins, and a test of each family lists the
//! overlaps it wants.

mod docs;
mod pattern;
mod text;

pub use docs::instruction_list_markdown;
pub use pattern::{BitPattern, CycleCounts, OperandField};
pub use text::{AsmError, DisassembledInstruction, SyntaxAlias, disassemble};

use crate::CoreError;

/// A predecoded instruction: four bytes. `kind` names the row; the other bytes hold the operands in row order, a wide
/// operand taking two (little endian).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C, align(4))]
pub struct PredecodedOp<K> {
    /// The row, or one of the extra kinds behind the rows (illegal, trap, ..).
    pub kind: K,
    /// Operand bytes.
    pub args: [u8; 3],
}

/// Where an instruction stands: what an operand may need beyond its own bits.
#[derive(Debug, Clone, Copy, Default)]
pub struct InstructionLocation {
    /// Address of the instruction in program words.
    pub pc: u32,
    /// Length of the instruction in program words.
    pub len: u32,
    /// Length of the instruction that follows it, in program words.
    pub next_len: u32,
    /// Program words minus one, where the size is a power of two: targets wrap within it.
    pub pc_mask: u32,
}

/// An operand kind: how a field of the pattern becomes a value and back, and how the value is written.
pub trait Operand: Copy + Sized {
    /// The kind's description, a row of data for the tools.
    const KIND: OperandKind;
    /// From the value that predecode put into the op.
    fn from_value(value: u16) -> Self;
    /// Takes this operand from an op whose next free operand byte is `at`, and moves `at` on.
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

/// An operand kind that predecode may have found to lie in RAM: what it becomes in a row's second shape.
pub trait RamOperand: Operand {
    /// The operand as it is there; itself where nothing changes.
    type Ram;
    /// Takes it from an op whose next free operand byte is `at`, and moves `at` on.
    fn decode_next_in_ram<K>(op: &PredecodedOp<K>, at: &mut usize) -> Self::Ram;
}

/// An operand kind as data.
#[derive(Debug, Clone, Copy)]
pub struct OperandKind {
    /// Name for documentation and messages: `register`, `bit`, ..
    pub name: &'static str,
    /// Takes two bytes of the op.
    pub wide: bool,
    /// Field of the pattern (`raw`, `bits` wide) -> value. Kinds that are not in a pattern ignore `raw`.
    pub decode: fn(raw: u32, bits: u32, site: &InstructionLocation) -> i32,
    /// Value -> field; the error says what is allowed.
    pub encode: fn(value: i32, bits: u32, site: &InstructionLocation) -> Result<u32, CoreError>,
    /// Writes the value as assembly text.
    pub write_text: fn(value: i32, out: &mut String),
    /// Value of a name that only this kind knows, such as `r16`.
    pub parse_name: fn(text: &str) -> Option<i32>,
    /// What a number in the text means here: itself for most, words where the text counts bytes. The error says what is
    /// wanted instead.
    pub check_number: fn(value: i32, site: &InstructionLocation) -> Result<i32, CoreError>,
    /// What a register of the chip means here that stands in the text by its name, given its address in
    /// [`Chip::reg_space`](crate::chip::Chip::reg_space): that address for most.
    pub check_register: fn(addr: i32) -> Result<i32, CoreError>,
}

impl OperandKind {
    /// No name is known: [`OperandKind::parse_name`] of most kinds.
    #[must_use]
    pub fn never_a_name(_: &str) -> Option<i32> {
        None
    }

    /// A number means itself: [`OperandKind::check_number`] of most kinds.
    ///
    /// # Errors
    /// None.
    pub fn same_number(value: i32, _: &InstructionLocation) -> Result<i32, CoreError> {
        Ok(value)
    }

    /// A register stands for its address: [`OperandKind::check_register`] of most kinds.
    ///
    /// # Errors
    /// None.
    pub fn same_address(addr: i32) -> Result<i32, CoreError> {
        Ok(addr)
    }
}

/// One operand of a row.
#[derive(Debug, Clone, Copy)]
pub struct OperandSlot {
    /// Its letter in pattern and syntax.
    pub letter: u8,
    /// Its kind.
    pub kind: &'static OperandKind,
}

/// What an instruction may do to the order in which a program runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlowKind {
    /// It goes on to the next instruction, or always elsewhere.
    Straight,
    /// It has a condition: it goes on to the next instruction, or elsewhere.
    Conditional,
    /// It ends the service of an interrupt.
    EndsInterrupt,
}

/// One instruction.
#[derive(Debug, Clone, Copy)]
pub struct InstructionRow {
    /// Name of the op kind, such as `Add`.
    pub name: &'static str,
    /// Mnemonic, lower case.
    pub mnemonic: &'static str,
    /// Operand syntax: lower-case letters are operands, everything else literal text.
    pub syntax: &'static str,
    /// Bits.
    pub pattern: BitPattern,
    /// Operands in op order.
    pub operands: &'static [OperandSlot],
    /// Cycles of every outcome.
    pub cycles: CycleCounts,
    /// Flags that the instruction may write, by letter.
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

    /// True when the cycles depend on a condition.
    #[must_use]
    pub fn has_variable_cycles(&self) -> bool {
        self.cycles.possible_counts().len() > 1
    }

    /// Values of the operands of the instruction `bits` at `site`, in row order.
    pub fn operand_values<'a>(&'a self, bits: u32, site: &'a InstructionLocation) -> impl Iterator<Item = i32> + 'a {
        self.operands.iter().map(move |slot| {
            let field = self.pattern.extract_field(slot.letter, bits);
            (slot.kind.decode)(field.raw, field.width, site)
        })
    }

    /// The op of the instruction `bits` at `site`; `kind` is the row's kind.
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

    /// The bits of this instruction with the given operand values (those that stand in the pattern, in row order).
    ///
    /// # Errors
    /// Says which operand does not fit and what is allowed, or how many operands are wanted.
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

/// An operand that an instruction cannot hold.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{mnemonic}: {cause}")]
pub struct EncodeError {
    /// The instruction.
    pub mnemonic: &'static str,
    /// What is wrong with which operand.
    #[source]
    pub cause: CoreError,
}

/// Position of the first row that matches the instruction at the front of `words`, of `word_bits` bits each, and the
/// instruction's bits. Words behind the end read 0.
#[must_use]
pub fn find_row(rows: &[InstructionRow], word_bits: u32, words: &[u16]) -> Option<(usize, u32)> {
    rows.iter().enumerate().find_map(|(i, row)| {
        let bits = instruction_bits(row, word_bits, words);
        row.pattern.matches(bits).then_some((i, bits))
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

/// The program words of an instruction of `row`, first word first.
#[must_use]
pub fn instruction_words(row: &InstructionRow, word_bits: u32, bits: u32) -> Vec<u16> {
    (0..row.len()).rev().map(|i| (bits >> (i * word_bits) & ((1 << word_bits) - 1)) as u16).collect()
}

/// Defines `Kind` (one variant per row, then the extra kinds), `ROWS` and the names, from a table in callback form.
///
/// The table calls it with rows of the shape shown in [`crate::table`]; the word size in bits comes first.
#[macro_export]
macro_rules! define_isa {
    ($word_bits:literal; extra { $($(#[doc = $xdoc:literal])* $extra:ident),* $(,)? }
     $( $(#[doc = $doc:literal])+ $name:ident $mnemonic:literal $syntax:literal $pattern:literal
        ($($letter:ident : $kind:ident),*) $cycles:literal $flags:literal => $body:ident ( $($arg:expr),* ) $(, $shape:ident)? ; )*) => {
        /// The instructions, one per row of the table; behind them kinds that only predecode makes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Kind {
            $( $(#[doc = $doc])+ $name, )*
            $( $( #[doc = concat!("`", stringify!($name), "` on operands that predecode has found to lie in RAM.")] $shape, )? )*
            $( $(#[doc = $xdoc])* $extra, )*
        }

        /// Every instruction, in table order; `Kind as usize` is the position.
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

        /// The kind that a row has where its operands lie in RAM; none for most families and rows.
        pub const SHAPES: &[Option<Kind>] = &[ $( { let shape: Option<Kind> = None; $( let _ = shape; let shape = Some(Kind::$shape); )? shape } ),* ];

        /// The kind of every row, in table order.
        pub const KINDS: &[Kind] = &[ $( Kind::$name ),* ];
    };
}

/// Expands to the `match` that runs the body of `$op` on `$m`: `dispatch!{ (m, op, Kind, else_arm) rows.. }`.
///
/// Every arm first lets the machine [`begin`](crate::machines::BodyMachine::begin) the instruction with its length and its
/// cycles where they are constant, so a body that touches the bus does so in the last cycle charged so far. The arm of a
/// second shape takes the operands as their [`Operand`](crate::table::Operand)'s [`RamOperand`](crate::table::RamOperand).
#[macro_export]
macro_rules! dispatch {
    (($m:ident, $op:ident, $kind:expr, $other:expr) $word_bits:literal; extra { $($(#[doc = $xdoc:literal])* $extra:ident),* $(,)? }
     $( $(#[doc = $doc:literal])+ $name:ident $mnemonic:literal $syntax:literal $pattern:literal
        $operands:tt $cycles:literal $flags:literal => $body:ident $args:tt $(, $shape:ident)? ; )*) => {
        match $kind {
            $( Kind::$name => $crate::arm!($m, $op, $word_bits, $pattern, $cycles, plain $operands $body $args), )*
            $( $( Kind::$shape => $crate::arm!($m, $op, $word_bits, $pattern, $cycles, ram $operands $body $args), )? )*
            $( Kind::$extra )|* => $other,
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
