//! An instruction table prepared for parsing: forms by mnemonic, with their syntax split at the commas.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use emu_core::chip::InstructionSet;
use emu_core::table::OperandKind;

/// A piece of a form's syntax: `Y+q` is `Y+`, the letter q, and nothing after it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SyntaxPiece {
    /// Literal text before the letter, without spaces.
    pub front: String,
    /// The operand's letter; `None` if the piece is literal text only.
    pub letter: Option<u8>,
    /// Literal text after the letter.
    pub back: String,
}

/// What a form means.
#[derive(Debug, Clone, Copy)]
pub(crate) enum FormMeaning {
    /// The row at this position.
    Row(usize),
    /// Another spelling: the mnemonic, and operands with the letters of this form.
    Alias(&'static str, &'static str),
}

/// A form of an instruction.
#[derive(Debug, Clone)]
pub(crate) struct InstructionForm {
    /// Its syntax as written in the table.
    pub syntax: &'static str,
    /// The syntax in pieces.
    pub pieces: Vec<SyntaxPiece>,
    /// Its meaning.
    pub meaning: FormMeaning,
}

/// The forms of a family's instructions.
#[derive(Debug)]
pub(crate) struct FormTable {
    forms: HashMap<&'static str, Vec<InstructionForm>>,
    /// The kinds of operands, each once.
    pub kinds: Vec<&'static OperandKind>,
    /// Reserved words of the syntax, in lower case: they are not names.
    pub words: Vec<String>,
}

impl FormTable {
    /// Returns the table of an instruction set; it is built once per set.
    pub fn of(isa: &'static InstructionSet) -> Arc<FormTable> {
        static MADE: OnceLock<Mutex<HashMap<usize, Arc<FormTable>>>> = OnceLock::new();
        let key = isa.rows.as_ptr() as usize ^ isa.rows.len();
        let Ok(mut made) = MADE.get_or_init(Mutex::default).lock() else { return Arc::new(FormTable::new(isa)) };
        made.entry(key).or_insert_with(|| Arc::new(FormTable::new(isa))).clone()
    }

    fn new(isa: &InstructionSet) -> FormTable {
        let mut forms: HashMap<&'static str, Vec<InstructionForm>> = HashMap::new();
        let mut words: Vec<String> = Vec::new();
        let aliases =
            isa.aliases.iter().map(|a| (a.mnemonic, a.syntax, FormMeaning::Alias(a.row_mnemonic, a.row_operands)));
        let rows = isa.rows.iter().enumerate().map(|(i, row)| (row.mnemonic, row.syntax, FormMeaning::Row(i)));
        for (name, syntax, means) in aliases.chain(rows) {
            let pieces = split_syntax(syntax);
            for piece in &pieces {
                for text in [&piece.front, &piece.back] {
                    let found = text
                        .split(|c: char| !c.is_ascii_alphanumeric())
                        .filter(|w| w.starts_with(|c: char| c.is_ascii_alphabetic()));
                    words.extend(found.map(str::to_ascii_lowercase));
                }
            }
            forms.entry(name).or_default().push(InstructionForm { syntax, pieces, meaning: means });
        }
        words.sort();
        words.dedup();
        let mut kinds: Vec<&'static OperandKind> = Vec::new();
        for slot in isa.rows.iter().flat_map(|row| row.operands) {
            if kinds.iter().all(|kind| kind.name != slot.kind.name) {
                kinds.push(slot.kind);
            }
        }
        FormTable { forms, kinds, words }
    }

    /// Returns the forms of a mnemonic in lower case; empty if it is no instruction.
    pub fn forms(&self, mnemonic: &str) -> &[InstructionForm] {
        self.forms.get(mnemonic).map_or(&[], Vec::as_slice)
    }

    /// Returns all mnemonics.
    pub fn mnemonics(&self) -> impl Iterator<Item = &'static str> {
        self.forms.keys().copied()
    }
}

fn split_syntax(syntax: &str) -> Vec<SyntaxPiece> {
    let bare: String = syntax.chars().filter(|c| !c.is_whitespace()).collect();
    if bare.is_empty() {
        return Vec::new();
    }
    let piece = |text: &str| match text.find(|c: char| c.is_ascii_lowercase()) {
        Some(at) => SyntaxPiece {
            front: text.get(..at).unwrap_or_default().to_owned(),
            letter: text.as_bytes().get(at).copied(),
            back: text.get(at + 1..).unwrap_or_default().to_owned(),
        },
        None => SyntaxPiece { front: text.to_owned(), letter: None, back: String::new() },
    };
    bare.split(',').map(piece).collect()
}
