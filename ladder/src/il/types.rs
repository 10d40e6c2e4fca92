//! Types, direct addresses, literals and standard function blocks of IEC 61131-3.

use std::ops::RangeInclusive;

use serde::{Serialize, Serializer};

/// A type of a variable (IEC 61131-3, 2.3.1 and 2.5.2.3). REAL, STRING, dates and 64-bit types are refused by
/// name, because the chips have no support for them.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IecType {
    /// One bit.
    Bool,
    /// Signed, 8 bits.
    Sint,
    /// Signed, 16 bits.
    Int,
    /// Signed, 32 bits.
    Dint,
    /// Unsigned, 8 bits.
    Usint,
    /// Unsigned, 16 bits.
    Uint,
    /// Unsigned, 32 bits.
    Udint,
    /// Bit string of 8 bits.
    Byte,
    /// Bit string of 16 bits.
    Word,
    /// Bit string of 32 bits.
    Dword,
    /// Duration.
    Time,
    /// Instance of a standard function block.
    Block(StandardBlock),
    /// Instance of a block with another name, as the program writes it.
    Named(String),
}

/// The elementary types with their keywords.
const ELEMENTARY: [(IecType, &str); 11] = [
    (IecType::Bool, "BOOL"),
    (IecType::Sint, "SINT"),
    (IecType::Int, "INT"),
    (IecType::Dint, "DINT"),
    (IecType::Usint, "USINT"),
    (IecType::Uint, "UINT"),
    (IecType::Udint, "UDINT"),
    (IecType::Byte, "BYTE"),
    (IecType::Word, "WORD"),
    (IecType::Dword, "DWORD"),
    (IecType::Time, "TIME"),
];

impl Serialize for IecType {
    /// Writes the keyword.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.keyword())
    }
}

impl IecType {
    /// Returns the number of bits of an elementary type, 0 for a block.
    #[must_use]
    pub fn bits(&self) -> u32 {
        super::flow::size_of(self)
    }

    /// Whether numbers of the type have a sign: SINT, INT, DINT and TIME.
    #[must_use]
    pub fn is_signed(&self) -> bool {
        matches!(self, IecType::Sint | IecType::Int | IecType::Dint | IecType::Time)
    }

    /// Returns the number modulo 2^n of the type, in its range; the lowest bit for BOOL.
    #[must_use]
    pub fn wrap(&self, number: i64) -> i64 {
        let bits = self.bits().clamp(1, 32);
        let low = number & ((1_i64 << bits) - 1);
        if self.is_signed() && low >> (bits - 1) == 1 { low - (1_i64 << bits) } else { low }
    }

    /// Returns all elementary types in the order of their declaration.
    pub fn elementary() -> impl Iterator<Item = IecType> {
        ELEMENTARY.into_iter().map(|(iec_type, _)| iec_type)
    }

    /// Returns the elementary type with this keyword, in any case.
    #[must_use]
    pub fn from_keyword(word: &str) -> Option<IecType> {
        ELEMENTARY.into_iter().find(|(_, keyword)| keyword.eq_ignore_ascii_case(word)).map(|(iec_type, _)| iec_type)
    }

    /// Returns the keyword, or the name of the block.
    #[must_use]
    pub fn keyword(&self) -> &str {
        match self {
            IecType::Block(block) => block.keyword(),
            IecType::Named(name) => name,
            _ => ELEMENTARY.iter().find(|(iec_type, _)| iec_type == self).map_or("", |(_, keyword)| keyword),
        }
    }

    /// Returns the smallest and the largest number of an integer or bit string type, `0..=1` for BOOL.
    #[must_use]
    pub fn range(&self) -> Option<RangeInclusive<i64>> {
        Some(match self {
            IecType::Bool => 0..=1,
            IecType::Sint => -128..=127,
            IecType::Int => -32_768..=32_767,
            IecType::Dint => -2_147_483_648..=2_147_483_647,
            IecType::Usint | IecType::Byte => 0..=255,
            IecType::Uint | IecType::Word => 0..=65_535,
            IecType::Udint | IecType::Dword => 0..=4_294_967_295,
            IecType::Time | IecType::Block(_) | IecType::Named(_) => return None,
        })
    }

    /// Whether NOT, AND, OR and XOR take the type: BOOL, BYTE, WORD and DWORD (ANY_BIT of the standard).
    #[must_use]
    pub fn is_bit_string(&self) -> bool {
        matches!(self, IecType::Bool | IecType::Byte | IecType::Word | IecType::Dword)
    }

    /// Whether ADD, SUB, MUL, DIV and MOD take the type (ANY_INT of the standard).
    #[must_use]
    pub fn is_integer(&self) -> bool {
        self.range().is_some() && !self.is_bit_string()
    }

    /// Whether a variable of the type is an instance of a function block.
    #[must_use]
    pub fn is_block(&self) -> bool {
        matches!(self, IecType::Block(_) | IecType::Named(_))
    }
}

/// A standard function block (IEC 61131-3, 2.5.2.3), or one of the retentive timers that reference 001 names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum StandardBlock {
    /// On-delay timer.
    Ton,
    /// Off-delay timer.
    Tof,
    /// Pulse.
    Tp,
    /// On-delay timer that keeps its elapsed time (reference 001).
    Tona,
    /// Off-delay timer that keeps its elapsed time (reference 001).
    Tofa,
    /// Up counter.
    Ctu,
    /// Down counter.
    Ctd,
    /// Up and down counter.
    Ctud,
    /// Rising edge detector.
    RTrig,
    /// Falling edge detector.
    FTrig,
    /// Set-dominant bistable.
    Sr,
    /// Reset-dominant bistable.
    Rs,
}

/// An input or output of a standard function block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlockPart {
    /// Name, in capitals.
    pub name: &'static str,
    /// Whether the program writes it. Outputs can only be read.
    pub is_input: bool,
    /// Keyword of its type.
    type_keyword: &'static str,
}

impl BlockPart {
    /// Returns the type of the part: BOOL, INT or TIME.
    #[must_use]
    pub fn iec_type(&self) -> IecType {
        IecType::from_keyword(self.type_keyword).unwrap_or(IecType::Bool)
    }
}

const fn input(name: &'static str, type_keyword: &'static str) -> BlockPart {
    BlockPart { name, is_input: true, type_keyword }
}

const fn output(name: &'static str, type_keyword: &'static str) -> BlockPart {
    BlockPart { name, is_input: false, type_keyword }
}

const TIMER: &[BlockPart] = &[input("IN", "BOOL"), input("PT", "TIME"), output("Q", "BOOL"), output("ET", "TIME")];
const RETENTIVE_TIMER: &[BlockPart] =
    &[input("IN", "BOOL"), input("PT", "TIME"), input("R", "BOOL"), output("Q", "BOOL"), output("ET", "TIME")];
const UP: &[BlockPart] =
    &[input("CU", "BOOL"), input("R", "BOOL"), input("PV", "INT"), output("Q", "BOOL"), output("CV", "INT")];
const DOWN: &[BlockPart] =
    &[input("CD", "BOOL"), input("LD", "BOOL"), input("PV", "INT"), output("Q", "BOOL"), output("CV", "INT")];
const UP_DOWN: &[BlockPart] = &[
    input("CU", "BOOL"),
    input("CD", "BOOL"),
    input("R", "BOOL"),
    input("LD", "BOOL"),
    input("PV", "INT"),
    output("QU", "BOOL"),
    output("QD", "BOOL"),
    output("CV", "INT"),
];
const EDGE: &[BlockPart] = &[input("CLK", "BOOL"), output("Q", "BOOL")];
const SET_DOMINANT: &[BlockPart] = &[input("S1", "BOOL"), input("R", "BOOL"), output("Q1", "BOOL")];
const RESET_DOMINANT: &[BlockPart] = &[input("S", "BOOL"), input("R1", "BOOL"), output("Q1", "BOOL")];

impl StandardBlock {
    /// All blocks, in the order of their declaration.
    pub const ALL: [StandardBlock; 12] = [
        StandardBlock::Ton,
        StandardBlock::Tof,
        StandardBlock::Tp,
        StandardBlock::Tona,
        StandardBlock::Tofa,
        StandardBlock::Ctu,
        StandardBlock::Ctd,
        StandardBlock::Ctud,
        StandardBlock::RTrig,
        StandardBlock::FTrig,
        StandardBlock::Sr,
        StandardBlock::Rs,
    ];

    /// Returns the name of the block in capitals.
    #[must_use]
    pub const fn keyword(self) -> &'static str {
        match self {
            StandardBlock::Ton => "TON",
            StandardBlock::Tof => "TOF",
            StandardBlock::Tp => "TP",
            StandardBlock::Tona => "TONA",
            StandardBlock::Tofa => "TOFA",
            StandardBlock::Ctu => "CTU",
            StandardBlock::Ctd => "CTD",
            StandardBlock::Ctud => "CTUD",
            StandardBlock::RTrig => "R_TRIG",
            StandardBlock::FTrig => "F_TRIG",
            StandardBlock::Sr => "SR",
            StandardBlock::Rs => "RS",
        }
    }

    /// Returns the block with this name, in any case.
    #[must_use]
    pub fn from_keyword(word: &str) -> Option<StandardBlock> {
        Self::ALL.into_iter().find(|block| block.keyword().eq_ignore_ascii_case(word))
    }

    /// Whether the block counts time: TON, TOF, TP, TONA and TOFA.
    #[must_use]
    pub const fn is_timer(self) -> bool {
        matches!(
            self,
            StandardBlock::Ton | StandardBlock::Tof | StandardBlock::Tp | StandardBlock::Tona | StandardBlock::Tofa
        )
    }

    /// Returns the inputs, in the order of positional parameters, then the outputs.
    #[must_use]
    pub const fn parts(self) -> &'static [BlockPart] {
        match self {
            StandardBlock::Ton | StandardBlock::Tof | StandardBlock::Tp => TIMER,
            StandardBlock::Tona | StandardBlock::Tofa => RETENTIVE_TIMER,
            StandardBlock::Ctu => UP,
            StandardBlock::Ctd => DOWN,
            StandardBlock::Ctud => UP_DOWN,
            StandardBlock::RTrig | StandardBlock::FTrig => EDGE,
            StandardBlock::Sr => SET_DOMINANT,
            StandardBlock::Rs => RESET_DOMINANT,
        }
    }

    /// Returns the input or output with this name, in any case.
    #[must_use]
    pub fn part(self, name: &str) -> Option<BlockPart> {
        self.parts().iter().find(|part| part.name.eq_ignore_ascii_case(name)).copied()
    }

    /// Returns the input that the short form of reference 001 (`TON T1,100`) sets: PT of timers, PV of
    /// counters.
    #[must_use]
    pub fn preset(self) -> Option<BlockPart> {
        self.part("PT").or_else(|| self.part("PV"))
    }
}

/// Memory area of a direct address (IEC 61131-3, 2.4.1.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AddressArea {
    /// `%I`: inputs.
    Input,
    /// `%Q`: outputs.
    Output,
    /// `%M`: memory.
    Memory,
}

/// Size of a direct address (IEC 61131-3, 2.4.1.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum AddressSize {
    /// `X`: one bit.
    Bit,
    /// `B`: 8 bits.
    Byte,
    /// `W`: 16 bits.
    Word,
    /// `D`: 32 bits.
    Double,
}

impl AddressSize {
    /// Returns the number of bits.
    #[must_use]
    pub const fn bits(self) -> u32 {
        match self {
            AddressSize::Bit => 1,
            AddressSize::Byte => 8,
            AddressSize::Word => 16,
            AddressSize::Double => 32,
        }
    }
}

/// A direct address such as `%IX0.3`, `%Q0.0`, `%QW5` or `%MD4.23` (IEC 61131-3, 2.4.1.1).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DirectAddress {
    /// Memory area.
    pub area: AddressArea,
    /// Size letter; `None` if the address has none, which means one bit if the address is an operand.
    pub size: Option<AddressSize>,
    /// The numbers between the full stops, at least one.
    pub path: Vec<u32>,
}

/// A literal with its type prefix (IEC 61131-3, 2.2).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IlLiteral {
    /// Type of the prefix, such as UINT in `UINT#16#A5`; `None` if there is no prefix or if the value is a
    /// duration.
    pub prefix: Option<IecType>,
    /// Value.
    pub value: IlValue,
}

/// Value of a literal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IlValue {
    /// TRUE or FALSE.
    Bool(bool),
    /// A number and the base in which the program writes it: 2, 8, 10 or 16. A number of another base than 10
    /// is not negative.
    Integer {
        /// The number.
        value: i64,
        /// The base.
        base: u32,
    },
    /// A duration in nanoseconds.
    Time(i64),
}
