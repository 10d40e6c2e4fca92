//! Keywords of operators with their modifiers, and mnemonics of vendors.

use super::model::{IlBinaryOperator, IlBlockInput, IlCondition};
use super::types::StandardBlock;

/// A word that begins an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Keyword {
    Load { negated: bool },
    Store { negated: bool },
    Set,
    Reset,
    Not,
    Binary { operator: IlBinaryOperator, negated: bool },
    Jump(IlCondition),
    Call(IlCondition),
    Return(IlCondition),
    Input(IlBlockInput),
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
pub(super) fn keyword(word: &str) -> Option<Keyword> {
    let upper = word.to_ascii_uppercase();
    let negated = upper.ends_with('N');
    if let Some((_, input)) = IlBlockInput::ALL.iter().map(|(i, k)| (k, i)).find(|(k, _)| **k == upper) {
        return Some(Keyword::Input(*input));
    }
    if let Some(block) = StandardBlock::from_keyword(&upper) {
        return Some(Keyword::Block(block));
    }
    let (base, modifier) = split(&upper).filter(|(base, modifier)| modifier.is_empty() || takes(base, modifier))?;
    let condition = match modifier {
        "C" => IlCondition::IfTrue,
        "CN" | "NC" => IlCondition::IfFalse,
        _ => IlCondition::Always,
    };
    let binary = |name: &str| IlBinaryOperator::ALL.iter().find(|(_, k)| *k == name).map(|(operator, _)| *operator);
    Some(match base {
        "LD" => Keyword::Load { negated },
        "ST" => Keyword::Store { negated },
        "S" => Keyword::Set,
        "R" => Keyword::Reset,
        "NOT" => Keyword::Not,
        "JMP" => Keyword::Jump(condition),
        "CAL" => Keyword::Call(condition),
        "RET" => Keyword::Return(condition),
        "&" => Keyword::Binary { operator: IlBinaryOperator::And, negated: modifier == "N" },
        name => Keyword::Binary { operator: binary(name)?, negated: modifier == "N" },
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

/// Splits a word into an input operator or a block and a modifier. None of them has one.
fn split_block(upper: &str) -> Option<(&'static str, &'static str)> {
    let inputs = IlBlockInput::ALL.iter().map(|(_, keyword)| *keyword);
    let names: Vec<&'static str> = inputs.chain(StandardBlock::ALL.iter().map(|block| block.keyword())).collect();
    let mut suffixes = SUFFIXES.into_iter().filter(|modifier| !modifier.is_empty());
    // INC is the increment of many vendors.
    suffixes.find_map(|modifier| {
        let base = upper.strip_suffix(modifier).filter(|_| upper != "INC")?;
        names.iter().find(|name| **name == base).map(|name| (*name, modifier))
    })
}

/// Returns the operator and the modifier of a word such as `LDC`, whose operator does not take that modifier.
pub(super) fn wrong_modifier(word: &str) -> Option<(&'static str, &'static str)> {
    let upper = word.to_ascii_uppercase();
    let core = split(&upper).filter(|(base, modifier)| !modifier.is_empty() && !takes(base, modifier));
    core.or_else(|| split_block(&upper))
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
const VENDOR_MNEMONICS: [(&str, &str, &str); 61] = [
    ("NA", "Siemens (a misprint of AN in some tables)", "ANDN"),
    ("A", "Siemens", "AND"),
    ("AN", "Siemens", "ANDN"),
    ("O", "Siemens", "OR"),
    ("ON", "Siemens", "ORN"),
    ("X", "Siemens", "XOR"),
    ("XN", "Siemens", "XORN"),
    ("=", "Siemens", "ST"),
    ("FP", "Siemens", "R_TRIG"),
    ("FN", "Siemens", "F_TRIG"),
    ("EU", "Siemens", "R_TRIG"),
    ("ED", "Siemens", "F_TRIG"),
    ("ALD", "Siemens", "AND("),
    ("OLD", "Siemens", "OR("),
    ("LDI", "Mitsubishi", "LDN"),
    ("ANI", "Mitsubishi", "ANDN"),
    ("ORI", "Mitsubishi", "ORN"),
    ("OUT", "Mitsubishi and Omron", "ST"),
    ("SET", "Mitsubishi and Omron", "S"),
    ("RST", "Mitsubishi", "R"),
    ("RSET", "Omron", "R"),
    ("ANB", "Mitsubishi", "AND("),
    ("ORB", "Mitsubishi", "OR("),
    ("PLS", "Mitsubishi", "R_TRIG"),
    ("PLF", "Mitsubishi", "F_TRIG"),
    ("DIFU", "Omron", "R_TRIG"),
    ("DIFD", "Omron", "F_TRIG"),
    ("XIC", "Allen-Bradley", "LD or AND"),
    ("XIO", "Allen-Bradley", "LDN or ANDN"),
    ("OTE", "Allen-Bradley", "ST"),
    ("OTL", "Allen-Bradley", "S"),
    ("OTU", "Allen-Bradley", "R"),
    ("ONS", "Allen-Bradley", "R_TRIG"),
    ("RTO", "Allen-Bradley", "TONA"),
    ("L", "Siemens", "LD"),
    ("T", "Siemens", "ST"),
    ("SD", "Siemens", "TON"),
    ("SE", "Siemens", "TON"),
    ("SF", "Siemens", "TOF"),
    ("LPS", "Siemens", "ST x, then LD x"),
    ("LRD", "Siemens", "ST x, then LD x"),
    ("LPP", "Siemens", "ST x, then LD x"),
    ("MPS", "Mitsubishi", "ST x, then LD x"),
    ("MRD", "Mitsubishi", "ST x, then LD x"),
    ("MPP", "Mitsubishi", "ST x, then LD x"),
    ("LDP", "Mitsubishi", "R_TRIG"),
    ("LDF", "Mitsubishi", "F_TRIG"),
    ("MOV", "Mitsubishi, Omron and Allen-Bradley", "LD and ST"),
    ("TIM", "Omron", "TON"),
    ("CNT", "Omron", "CTD"),
    ("CNTR", "Omron", "CTUD"),
    ("BST", "Allen-Bradley", "OR("),
    ("NXB", "Allen-Bradley", "OR("),
    ("BND", "Allen-Bradley", "`)`"),
    ("EQU", "Allen-Bradley", "EQ"),
    ("NEQ", "Allen-Bradley", "NE"),
    ("GRT", "Allen-Bradley", "GT"),
    ("GEQ", "Allen-Bradley", "GE"),
    ("LES", "Allen-Bradley", "LT"),
    ("LEQ", "Allen-Bradley", "LE"),
    ("RES", "Allen-Bradley", "R"),
];

/// Returns the vendor and the IEC operator of a vendor's mnemonic.
pub(super) fn vendor_mnemonic(word: &str) -> Option<(&'static str, &'static str)> {
    let row = VENDOR_MNEMONICS.iter().find(|(mnemonic, ..)| mnemonic.eq_ignore_ascii_case(word))?;
    Some((row.1, row.2))
}
