//! Keywords of operators with their modifiers, and mnemonics of vendors.

use super::model::{IlBinaryOperator, IlBlockInput, IlCondition};
use super::types::StandardBlock;

/// A word that begins an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum IlKeyword {
    /// LD, LDN.
    Load { negated: bool },
    /// ST, STN.
    Store { negated: bool },
    /// S.
    Set,
    /// R.
    Reset,
    /// NOT.
    Not,
    /// An operator of two numbers or bits, such as AND, ANDN or GT.
    Binary { operator: IlBinaryOperator, negated: bool },
    /// JMP.
    Jump(IlCondition),
    /// CAL.
    Call(IlCondition),
    /// RET.
    Return(IlCondition),
    /// An input operator, such as CU.
    Input(IlBlockInput),
    /// The short form of a block, such as `TON T1,100`.
    Block(StandardBlock),
}

/// Whether a word is an operator of Instruction List, with its modifier, in any case.
pub(crate) fn is_operator(word: &str) -> bool {
    keyword(word).is_some()
}

/// Operators with the modifiers that they can have, besides `(` (reference 001, table 1; IEC 61131-3, table
/// 52).
const MODIFIERS: [(&str, &[&str]); 24] = [
    ("LD", &["N"]),
    ("ST", &["N"]),
    ("S", &[]),
    ("R", &[]),
    ("NOT", &[]),
    ("AND", &["N"]),
    ("&", &["N"]),
    ("OR", &["N"]),
    ("XOR", &["N"]),
    ("ADD", &[]),
    ("SUB", &[]),
    ("MUL", &[]),
    ("DIV", &[]),
    ("MOD", &[]),
    ("GT", &[]),
    ("GE", &[]),
    ("EQ", &[]),
    ("NE", &[]),
    ("LE", &[]),
    ("LT", &[]),
    ("JMP", &["C", "CN", "NC"]),
    ("CAL", &["C", "CN", "NC"]),
    ("RET", &["C", "CN", "NC"]),
    (")", &[]),
];

/// Returns the operation that `word` begins, in any case.
pub(super) fn keyword(word: &str) -> Option<IlKeyword> {
    let upper = word.to_ascii_uppercase();
    let negated = upper.ends_with('N');
    if let Some((_, input)) = IlBlockInput::ALL.iter().map(|(i, k)| (k, i)).find(|(k, _)| **k == upper) {
        return Some(IlKeyword::Input(*input));
    }
    if let Some(block) = StandardBlock::from_keyword(&upper) {
        return Some(IlKeyword::Block(block));
    }
    let (base, modifier) = split(&upper).filter(|(base, modifier)| modifier.is_empty() || takes(base, modifier))?;
    let condition = match modifier {
        "C" => IlCondition::IfTrue,
        "CN" | "NC" => IlCondition::IfFalse,
        _ => IlCondition::Always,
    };
    let binary = |name: &str| IlBinaryOperator::ALL.iter().find(|(_, k)| *k == name).map(|(operator, _)| *operator);
    Some(match base {
        "LD" => IlKeyword::Load { negated },
        "ST" => IlKeyword::Store { negated },
        "S" => IlKeyword::Set,
        "R" => IlKeyword::Reset,
        "NOT" => IlKeyword::Not,
        "JMP" => IlKeyword::Jump(condition),
        "CAL" => IlKeyword::Call(condition),
        "RET" => IlKeyword::Return(condition),
        "&" => IlKeyword::Binary { operator: IlBinaryOperator::And, negated: modifier == "N" },
        name => IlKeyword::Binary { operator: binary(name)?, negated: modifier == "N" },
    })
}

fn takes(base: &str, modifier: &str) -> bool {
    MODIFIERS.iter().any(|(name, modifiers)| *name == base && modifiers.contains(&modifier))
}

/// Modifiers that are part of the word. Reference 001 lists C and N of JMP without an order, so NC is CN.
const SUFFIXES: [&str; 5] = ["", "N", "C", "CN", "NC"];

/// Splits a word into an operator and a modifier, whether or not they fit.
fn split(upper: &str) -> Option<(&'static str, &'static str)> {
    SUFFIXES.into_iter().find_map(|modifier| {
        let base = upper.strip_suffix(modifier)?;
        MODIFIERS.iter().find(|(name, _)| *name == base).map(|(name, _)| (*name, modifier))
    })
}

/// An operator with a modifier, as in `LDC`.
pub(super) struct ModifiedOperator {
    /// The operator without its modifier.
    pub operator: &'static str,
    /// The modifier: N, C, CN or NC.
    pub modifier: &'static str,
}

/// Splits a word into an input operator or a block and a modifier. None of them has one.
fn split_block(upper: &str) -> Option<ModifiedOperator> {
    let inputs = IlBlockInput::ALL.iter().map(|(_, keyword)| *keyword);
    let names: Vec<&'static str> = inputs.chain(StandardBlock::ALL.iter().map(|block| block.keyword())).collect();
    let mut suffixes = SUFFIXES.into_iter().filter(|modifier| !modifier.is_empty());
    // INC is the increment of many vendors.
    suffixes.find_map(|modifier| {
        let base = upper.strip_suffix(modifier).filter(|_| upper != "INC")?;
        names.iter().find(|name| **name == base).map(|operator| ModifiedOperator { operator, modifier })
    })
}

/// Returns the operator and the modifier of a word such as `LDC`, whose operator does not take that modifier.
pub(super) fn wrong_modifier(word: &str) -> Option<ModifiedOperator> {
    let upper = word.to_ascii_uppercase();
    let core = split(&upper).filter(|(base, modifier)| !modifier.is_empty() && !takes(base, modifier));
    core.map(|(operator, modifier)| ModifiedOperator { operator, modifier }).or_else(|| split_block(&upper))
}

/// Returns the modifiers that the operator takes, for a hint.
pub(super) fn modifier_hint(base: &str) -> String {
    let taken = MODIFIERS.iter().find(|(name, _)| *name == base).map_or(&[][..], |(_, modifiers)| modifiers);
    let is_deferrable = base == "&" || IlBinaryOperator::ALL.iter().any(|(_, keyword)| *keyword == base);
    let all: Vec<&str> = taken.iter().copied().chain(is_deferrable.then_some("(")).collect();
    match all.as_slice() {
        [] => format!("{base} has no modifier"),
        [one] => format!("{base} has the modifier {one}"),
        [first, second, ..] => format!("{base} has the modifiers {first} and {second}"),
    }
}

/// Returns all operators with each modifier that they can have, without `(` and `)`.
pub(super) fn all_keywords() -> impl Iterator<Item = String> {
    let core = MODIFIERS.iter().filter(|(name, _)| *name != ")");
    let with_modifiers = core.flat_map(|(name, modifiers)| {
        std::iter::once("").chain(modifiers.iter().copied()).map(move |modifier| format!("{name}{modifier}"))
    });
    let inputs = IlBlockInput::ALL.iter().map(|(_, keyword)| (*keyword).to_owned());
    with_modifiers.chain(inputs).chain(StandardBlock::ALL.iter().map(|block| block.keyword().to_owned()))
}

/// Mnemonics of vendors: mnemonic, vendors, operator of IEC 61131-3 (reference 001, table 2).
const VENDOR_MNEMONICS: [VendorMnemonic; 61] = [
    vendor_row("NA", "Siemens (a misprint of AN in some tables)", "ANDN"),
    vendor_row("A", "Siemens", "AND"),
    vendor_row("AN", "Siemens", "ANDN"),
    vendor_row("O", "Siemens", "OR"),
    vendor_row("ON", "Siemens", "ORN"),
    vendor_row("X", "Siemens", "XOR"),
    vendor_row("XN", "Siemens", "XORN"),
    vendor_row("=", "Siemens", "ST"),
    vendor_row("FP", "Siemens", "R_TRIG"),
    vendor_row("FN", "Siemens", "F_TRIG"),
    vendor_row("EU", "Siemens", "R_TRIG"),
    vendor_row("ED", "Siemens", "F_TRIG"),
    vendor_row("ALD", "Siemens", "AND("),
    vendor_row("OLD", "Siemens", "OR("),
    vendor_row("LDI", "Mitsubishi", "LDN"),
    vendor_row("ANI", "Mitsubishi", "ANDN"),
    vendor_row("ORI", "Mitsubishi", "ORN"),
    vendor_row("OUT", "Mitsubishi and Omron", "ST"),
    vendor_row("SET", "Mitsubishi and Omron", "S"),
    vendor_row("RST", "Mitsubishi", "R"),
    vendor_row("RSET", "Omron", "R"),
    vendor_row("ANB", "Mitsubishi", "AND("),
    vendor_row("ORB", "Mitsubishi", "OR("),
    vendor_row("PLS", "Mitsubishi", "R_TRIG"),
    vendor_row("PLF", "Mitsubishi", "F_TRIG"),
    vendor_row("DIFU", "Omron", "R_TRIG"),
    vendor_row("DIFD", "Omron", "F_TRIG"),
    vendor_row("XIC", "Allen-Bradley", "LD or AND"),
    vendor_row("XIO", "Allen-Bradley", "LDN or ANDN"),
    vendor_row("OTE", "Allen-Bradley", "ST"),
    vendor_row("OTL", "Allen-Bradley", "S"),
    vendor_row("OTU", "Allen-Bradley", "R"),
    vendor_row("ONS", "Allen-Bradley", "R_TRIG"),
    vendor_row("RTO", "Allen-Bradley", "TONA"),
    vendor_row("L", "Siemens", "LD"),
    vendor_row("T", "Siemens", "ST"),
    vendor_row("SD", "Siemens", "TON"),
    vendor_row("SE", "Siemens", "TON"),
    vendor_row("SF", "Siemens", "TOF"),
    vendor_row("LPS", "Siemens", "ST x, then LD x"),
    vendor_row("LRD", "Siemens", "ST x, then LD x"),
    vendor_row("LPP", "Siemens", "ST x, then LD x"),
    vendor_row("MPS", "Mitsubishi", "ST x, then LD x"),
    vendor_row("MRD", "Mitsubishi", "ST x, then LD x"),
    vendor_row("MPP", "Mitsubishi", "ST x, then LD x"),
    vendor_row("LDP", "Mitsubishi", "R_TRIG"),
    vendor_row("LDF", "Mitsubishi", "F_TRIG"),
    vendor_row("MOV", "Mitsubishi, Omron and Allen-Bradley", "LD and ST"),
    vendor_row("TIM", "Omron", "TON"),
    vendor_row("CNT", "Omron", "CTD"),
    vendor_row("CNTR", "Omron", "CTUD"),
    vendor_row("BST", "Allen-Bradley", "OR("),
    vendor_row("NXB", "Allen-Bradley", "OR("),
    vendor_row("BND", "Allen-Bradley", "`)`"),
    vendor_row("EQU", "Allen-Bradley", "EQ"),
    vendor_row("NEQ", "Allen-Bradley", "NE"),
    vendor_row("GRT", "Allen-Bradley", "GT"),
    vendor_row("GEQ", "Allen-Bradley", "GE"),
    vendor_row("LES", "Allen-Bradley", "LT"),
    vendor_row("LEQ", "Allen-Bradley", "LE"),
    vendor_row("RES", "Allen-Bradley", "R"),
];

/// A mnemonic that a vendor has instead of an operator of IEC 61131-3.
pub(super) struct VendorMnemonic {
    mnemonic: &'static str,
    /// Names of the vendors, for a message.
    pub vendor: &'static str,
    /// What to write instead.
    pub iec: &'static str,
}

const fn vendor_row(mnemonic: &'static str, vendor: &'static str, iec: &'static str) -> VendorMnemonic {
    VendorMnemonic { mnemonic, vendor, iec }
}

/// Returns the row of a vendor's mnemonic.
pub(super) fn vendor_mnemonic(word: &str) -> Option<&'static VendorMnemonic> {
    VENDOR_MNEMONICS.iter().find(|row| row.mnemonic.eq_ignore_ascii_case(word))
}
