//! One instruction: matches its operands with the forms of the table.

use std::ops::Range;

use emu_core::table::{InstructionLocation, OperandKind, instruction_words};

use crate::engine::Assembler;
use crate::expression::evaluate;
use crate::fault::LineFault;
use crate::form_table::{FormMeaning, InstructionForm, SyntaxPiece};
use crate::lines::{behind_name, byte, cut, skip_space, trim};
use crate::symbols::AsmSymbolKind;
use crate::value::AsmValue;

/// The operand kind of literals that may be written as a value, such as `W` and `F`.
pub(crate) const DESTINATION: &str = "destination";

/// The operand kind of a number in the syntax, such as the 5 of `tris 5`.
pub(crate) const LITERAL: &str = "literal";

/// The result of matching a form.
enum FormResult {
    /// It fits; its values may still be unknown.
    Fits(Vec<u16>),
    /// It is another form.
    OtherForm,
    /// It is this form, with a wrong value. The fault with the highest rank is reported.
    Wrong(u8, LineFault),
}

/// The result of matching an operand.
enum OperandResult {
    Value(i32, bool),
    OtherKind,
    Wrong(u8, LineFault),
}

impl Assembler<'_> {
    /// Encodes the instruction `mnemonic` (in lower case) with the operands `text[rest]`; `word` is the
    /// position of the mnemonic.
    pub(crate) fn assemble_instruction(
        &mut self,
        text: &str,
        mnemonic: &str,
        word: Range<usize>,
        rest: Range<usize>,
    ) -> Option<Vec<u16>> {
        let all = trim(text, rest.clone());
        let written = text.get(all.clone()).unwrap_or_default();
        let name = &written[..behind_name(written, 0, !self.dialect.dot_is_bit)];
        let operands = match self.symbols.get(name, self.dialect.ignores_case).map(|symbol| &symbol.kind) {
            Some(AsmSymbolKind::Alias { of: register, .. }) => register.to_string() + &written[name.len()..],
            _ => written.to_owned(),
        };
        if let Some(refusal) = (self.dialect.refuse_instruction)(mnemonic, &operands) {
            self.report(refusal.at(all));
            return None;
        }
        if self.dialect.hooks.is_sdas && matches!(mnemonic, "push" | "pop") && written.eq_ignore_ascii_case("a") {
            return self.assemble_instruction("acc", mnemonic, 0..0, 0..3);
        }
        let found = match self.resolve_general(text, mnemonic, &operands, rest.clone()) {
            Some(mnemonic) => self.encode(text, mnemonic, word, rest, 0),
            None => self.encode(text, mnemonic, word, rest, 0),
        };
        self.instruction_length = 0;
        match found {
            Ok(words) => {
                std::mem::take(&mut self.notes).into_iter().for_each(|note| self.report(note));
                Some(words)
            }
            Err(fault) => {
                self.report(fault);
                None
            }
        }
    }

    /// Returns the instruction that replaces a general one: the first that reaches the operand, or the last
    /// if a later line defines the operand.
    fn resolve_general(
        &mut self,
        text: &str,
        mnemonic: &str,
        operand: &str,
        rest: Range<usize>,
    ) -> Option<&'static str> {
        let (_, forms) = self
            .dialect
            .hooks
            .general_instructions
            .iter()
            .find(|(name, _)| *name == mnemonic && !operand.starts_with('@'))?;
        let (last, shorter) = forms.split_last()?;
        let (reported, before) = (self.undefined.len(), std::mem::take(&mut self.has_forward_reference));
        let found = evaluate(self.dialect, text, rest.clone(), self);
        self.undefined.truncate(reported);
        let early = std::mem::replace(&mut self.has_forward_reference, before);
        self.has_forward_reference |= early;
        if early || found.is_err() {
            return Some(last);
        }
        let fits = |name: &&&'static str| self.encode(text, name, rest.clone(), rest.clone(), 0).is_ok();
        Some(shorter.iter().find(fits).unwrap_or(last))
    }

    fn encode(
        &mut self,
        text: &str,
        mnemonic: &str,
        word: Range<usize>,
        rest: Range<usize>,
        depth: u32,
    ) -> Result<Vec<u16>, LineFault> {
        let table = self.table.clone();
        let forms = table.forms(mnemonic);
        let mut operands = cut(self.dialect, text, rest.clone());
        if self.dialect.hooks.drops_operands && forms.iter().all(|form| form.pieces.is_empty()) && !operands.is_empty()
        {
            let cause = format!("{mnemonic} takes no operands: those here are ignored");
            let all = trim(text, rest.clone());
            self.notes.push(LineFault::new("ASM051", all, cause, "put a `;` before a comment").warning());
            operands.clear();
        }
        let mut worst: Option<(u8, LineFault)> = None;
        let (reported, noted) = (self.undefined.len(), self.notes.len());
        for form in forms {
            if form.pieces.len() != operands.len() {
                continue;
            }
            self.undefined.truncate(reported);
            self.notes.truncate(noted);
            let tried = match form.meaning {
                FormMeaning::Row(row) => self.try_form(text, row, form, &operands, &word),
                FormMeaning::Alias(to, written) => match self.rewrite_operands(text, form, &operands, written) {
                    Some(other) if depth < 4 => {
                        // The operands are in a line of their own, so their faults are reported for all of
                        // them.
                        let all = trim(text, rest.clone());
                        let found = self.encode(&other, to, 0..0, 0..other.len(), depth + 1);
                        let at = if all.is_empty() { word } else { all };
                        self.notes.iter_mut().for_each(|note| note.range = at.clone());
                        return found.map_err(|fault| LineFault { range: at, ..fault });
                    }
                    _ => FormResult::OtherForm,
                },
            };
            match tried {
                FormResult::Fits(words) => {
                    let missing: Vec<LineFault> = self.undefined.drain(reported..).collect();
                    missing.into_iter().for_each(|fault| self.report(fault));
                    return Ok(words);
                }
                // Of several faults, the one of the form that matches furthest is reported.
                FormResult::Wrong(rank, fault)
                    if worst
                        .as_ref()
                        .is_none_or(|(best, reported)| (rank, fault.range.start) > (*best, reported.range.start)) =>
                {
                    worst = Some((rank, fault));
                }
                _ => {}
            }
        }
        self.undefined.truncate(reported);
        Err(match worst {
            Some((_, fault)) => fault,
            None => {
                let list: Vec<String> =
                    forms.iter().map(|f| format!("{mnemonic} {}", f.syntax).trim_end().to_owned()).collect();
                let all = trim(text, rest);
                let cause = match text.get(all.clone()) {
                    Some("") | None => format!("{mnemonic} has no operands"),
                    Some(operands) => format!("`{operands}` matches no form of {mnemonic}"),
                };
                let at = if all.is_empty() { word } else { all };
                LineFault::new("ASM002", at, cause, format!("forms: {}", list.join("; ")))
            }
        })
    }

    fn try_form(
        &mut self,
        text: &str,
        index: usize,
        form: &InstructionForm,
        operands: &[Range<usize>],
        word: &Range<usize>,
    ) -> FormResult {
        let isa = self.chip.isa;
        let Some(row) = isa.rows.get(index) else { return FormResult::OtherForm };
        let mut parts: Vec<(u8, Range<usize>)> = Vec::with_capacity(operands.len());
        for (piece, range) in form.pieces.iter().zip(operands) {
            match self.split_piece(text, piece, range.clone()) {
                Some(Some(part)) => parts.push(part),
                Some(None) => {}
                None => return FormResult::OtherForm,
            }
        }
        let site = (isa.locate)(self.pc(), row.len());
        let mut values = Vec::with_capacity(parts.len());
        let mut known = true;
        let mut wrong: Option<(u8, LineFault)> = None;
        if self.dialect.counter_after_instruction {
            self.instruction_length = i64::from(row.len() * self.chip.word_bytes / self.out.unit().max(1));
        }
        for slot in row.operands.iter().filter(|slot| row.pattern.has_letter(slot.letter)) {
            let Some((_, range)) = parts.iter().find(|(letter, _)| *letter == slot.letter) else {
                return FormResult::OtherForm;
            };
            let width = row.pattern.extract_field(slot.letter, 0).width;
            match self.try_operand(text, range.clone(), slot.kind, width, &site) {
                OperandResult::Value(value, sure) => {
                    known &= sure;
                    values.push((value, range.clone()));
                }
                OperandResult::OtherKind => return FormResult::OtherForm,
                // The other operands may still show that it is another form.
                OperandResult::Wrong(rank, fault) => wrong = wrong.or(Some((rank, fault))),
            }
        }
        if let Some((rank, fault)) = wrong {
            return FormResult::Wrong(rank, fault);
        }
        if (isa.is_missing)(index) {
            let cause = format!("the {} has no `{}` in this form", self.chip.name, row.mnemonic);
            let hint =
                "it is an instruction of larger chips of the family; on AVR rjmp and rcall reach all of a small one";
            return FormResult::Wrong(9, LineFault::new("ASM026", word.clone(), cause, hint));
        }
        let mut bits = row.pattern.canonical;
        let slots = row.operands.iter().filter(|slot| row.pattern.has_letter(slot.letter));
        for (slot, (value, range)) in slots.zip(&values).filter(|_| known) {
            let width = row.pattern.extract_field(slot.letter, 0).width;
            match (slot.kind.encode)(*value, width, &site) {
                Ok(raw) => bits |= row.pattern.insert_field(slot.letter, raw),
                Err(cause) => {
                    let hint = "use a value in range";
                    return FormResult::Wrong(
                        3,
                        LineFault::new("ASM003", range.clone(), format!("{}: {cause}", row.mnemonic), hint),
                    );
                }
            }
        }
        if known {
            self.notes.extend((self.dialect.hooks.check)(row, &values));
        }
        FormResult::Fits(instruction_words(row, isa.word_bits, bits))
    }

    /// Splits an operand by a piece of the syntax: its letter and range, or nothing for a literal; `None` if
    /// it does not fit.
    fn split_piece(
        &mut self,
        text: &str,
        piece: &SyntaxPiece,
        range: Range<usize>,
    ) -> Option<Option<(u8, Range<usize>)>> {
        let Some(letter) = piece.letter else {
            let literal = skip_prefix(text, range.clone(), &piece.front).is_some_and(|at| at == range.end);
            let alias = || match self.symbols.get(text.get(range.clone())?, self.dialect.ignores_case)?.kind {
                AsmSymbolKind::Alias { ref of, .. } => Some(of.eq_ignore_ascii_case(&piece.front)),
                _ => None,
            };
            let fits = literal || alias() == Some(true) || self.has_literal_value(text, range, &piece.front);
            return fits.then_some(None);
        };
        let start = skip_prefix(text, range.clone(), &piece.front)?;
        let end = skip_suffix(text, start..range.end, &piece.back)?;
        let inner = trim(text, start..end);
        (!inner.is_empty()).then_some(Some((letter, inner)))
    }

    /// Reports whether an expression has the value of the literal.
    fn has_literal_value(&mut self, text: &str, range: Range<usize>, literal: &str) -> bool {
        let number = literal.parse::<i64>().ok();
        let Some(wanted) = number.or_else(|| self.dialect.literals.iter().find(|l| l.0 == literal).map(|l| l.1)) else {
            return false;
        };
        let reported = self.undefined.len();
        let (d, at) = (self.dialect, range.clone());
        let found = evaluate(d, text, range, self);
        let sure = self.undefined.len() == reported;
        self.undefined.truncate(reported);
        let Ok(value) = found else { return false };
        if value.is_unknown || !sure {
            return value.is_unknown && self.pass == 1;
        }
        let kind = if number.is_some() { LITERAL } else { DESTINATION };
        self.fit_operand(kind, u32::BITS, value.number, &at) == wanted
    }

    fn try_operand(
        &mut self,
        text: &str,
        range: Range<usize>,
        kind: &OperandKind,
        width: u32,
        site: &InstructionLocation,
    ) -> OperandResult {
        let piece = text.get(range.clone()).unwrap_or_default();
        // Marks of other forms.
        if piece.starts_with(['#', '@']) {
            return OperandResult::OtherKind;
        }
        let name = behind_name(piece, 0, !self.dialect.dot_is_bit);
        let own = (name > 0).then(|| self.symbols.get(&piece[..name], self.dialect.ignores_case)).flatten();
        let alias = match own.map(|symbol| &symbol.kind) {
            Some(AsmSymbolKind::Alias { of: register, .. }) => Some(register.clone()),
            _ => None,
        };
        let written = alias.as_deref().filter(|_| name == piece.len()).unwrap_or(piece);
        if (own.is_none() || alias.is_some())
            && let Some(value) = (kind.parse_name)(written)
        {
            return OperandResult::Value(value, true);
        }
        if let Some(found) = self.try_register_pair(piece, kind, &range) {
            return found;
        }
        let d = self.dialect;
        if let Some(found) = self.try_zone(text, range.clone(), kind) {
            return found;
        }
        let value = match evaluate(d, text, range.clone(), self) {
            Ok(value) => value,
            // A core register where none is allowed: another form.
            Err(fault) if fault.code == "ASM008" => return OperandResult::OtherKind,
            Err(fault) => return OperandResult::Wrong(2, fault),
        };
        let fitted =
            if value.is_unknown { value.number } else { self.fit_operand(kind.name, width, value.number, &range) };
        let Ok(n) = i32::try_from(fitted).or_else(|_| u32::try_from(value.number).map(|n| n as i32)) else {
            let cause = format!("{} has more than 32 bits", value.number);
            return OperandResult::Wrong(3, LineFault::new("ASM003", range, cause, "use a value in range"));
        };
        let n = if d.hooks.is_sdas { self.cut_for_sdas(kind, &value, n, &range) } else { n };
        // R0 to R7 are words, so the address of a chip register belongs to another form, or to none.
        if d.dot_is_bit && value.is_register && kind.name.starts_with("register") {
            return OperandResult::OtherKind;
        }
        let meant = if value.is_register { (kind.check_register)(n) } else { (kind.check_number)(n, site) };
        let name_alone = piece.get(..name).filter(|_| name == piece.len() && !value.is_unknown);
        if let Some(mismatch) = name_alone.and_then(|name| (d.hooks.mismatch)(self, name, kind.name, n)) {
            self.notes.push(mismatch.at(range.clone()).warning());
        }
        match meant {
            Ok(value_here) => OperandResult::Value(value_here, !value.is_unknown),
            Err(cause) => OperandResult::Wrong(
                1,
                LineFault::new("ASM003", range, cause.to_string(), format!("wanted here: {}", kind.name)),
            ),
        }
    }

    /// `ZH:ZL` and `r25:r24` of Atmel's assembler: resolves the pair to its lower register.
    fn try_register_pair(&self, piece: &str, kind: &OperandKind, at: &Range<usize>) -> Option<OperandResult> {
        let is_pair = self.dialect.hooks.is_atmel && kind.name.starts_with("register pair");
        let (high, low) = piece.split_once(':').filter(|_| is_pair)?;
        let register = |word: &str| match self.symbols.get(word, self.dialect.ignores_case).map(|own| &own.kind) {
            Some(AsmSymbolKind::Alias { of, .. }) => (kind.parse_name)(of),
            _ => (kind.parse_name)(word),
        };
        Some(match (register(high.trim()), register(low.trim())) {
            (Some(high), Some(low)) if high == low + 1 => OperandResult::Value(low, true),
            _ => {
                let cause = format!("`{piece}` is no pair of registers");
                let hint = "write the higher register, a colon and the one before it: r25:r24";
                OperandResult::Wrong(3, LineFault::new("ASM003", at.clone(), cause, hint))
            }
        })
    }

    /// Returns the value of an operand in its field of `width` bits; notes truncation.
    fn fit_operand(&mut self, kind: &str, width: u32, n: i64, at: &Range<usize>) -> i64 {
        let Some((fitted, said)) = (self.dialect.hooks.cut)(self.chip, kind, width, n) else { return n };
        self.notes.extend(said.map(|refusal| refusal.at(at.clone()).warning()));
        fitted
    }

    /// Returns the value of an operand in a source for sdas8051: it truncates constants, and its linker
    /// truncates addresses of labels. Notes truncation, except of a constant that is an address.
    fn cut_for_sdas(&mut self, kind: &OperandKind, value: &AsmValue, n: i32, at: &Range<usize>) -> i32 {
        let bits = if kind.wide { 16 } else { 8 };
        let limit = 1i32 << bits;
        let (is_cut, hint) = match kind.name {
            "constant" => (!value.is_label, "select the bits with & or `#<`"),
            "direct address" | "bit address" if value.is_label => {
                (true, "put the variable into internal RAM, or use movx; `#<` selects the low byte")
            }
            _ => return n,
        };
        if is_cut && !value.is_unknown && !(-limit..limit).contains(&n) {
            let cause = format!("{n} does not fit into {bits} bits: its upper bits are dropped");
            self.notes.push(LineFault::new("ASM030", at.clone(), cause, hint).warning());
        }
        n & (limit - 1)
    }

    /// `M(256+n)`: resolves the name that the letter and the value in parentheses form.
    fn try_zone(&mut self, text: &str, range: Range<usize>, kind: &OperandKind) -> Option<OperandResult> {
        let piece = text.get(range.clone()).filter(|_| self.dialect.zones)?;
        let inner = piece.get(1..)?.trim_start().strip_prefix('(')?.strip_suffix(')')?;
        let letter = piece.get(..1).filter(|letter| letter.starts_with(|c: char| c.is_ascii_alphabetic()))?;
        (kind.parse_name)(&format!("{letter}0"))?;
        let start = range.end - 1 - inner.len();
        let d = self.dialect;
        let value = match evaluate(d, text, start..range.end - 1, self) {
            Ok(value) if value.is_unknown => return Some(OperandResult::Value(0, false)),
            Ok(value) => value.number,
            Err(fault) => return Some(OperandResult::Wrong(2, fault)),
        };
        Some(match (kind.parse_name)(&format!("{letter}{value}")) {
            Some(address) => OperandResult::Value(address, true),
            None => {
                let cause = format!("there is no {letter}{value}");
                OperandResult::Wrong(3, LineFault::new("ASM003", range, cause, "zones have addresses from 0 to 511"))
            }
        })
    }

    /// Returns the operands of the instruction that another spelling means.
    fn rewrite_operands(
        &mut self,
        text: &str,
        form: &InstructionForm,
        operands: &[Range<usize>],
        written: &str,
    ) -> Option<String> {
        let mut parts = Vec::new();
        for (piece, range) in form.pieces.iter().zip(operands) {
            parts.extend(self.split_piece(text, piece, range.clone())?);
        }
        let mut out = String::new();
        for c in written.chars() {
            match parts.iter().find(|(letter, _)| c == *letter as char) {
                Some((_, range)) => out.push_str(text.get(range.clone()).unwrap_or_default()),
                None => out.push(c),
            }
        }
        Some(out)
    }

    /// Returns the address of the instruction in program words.
    fn pc(&self) -> u32 {
        (self.image_address() / u64::from(self.chip.word_bytes.max(1))) as u32
    }
}

/// Returns the position after the literal text at the start of `text[range]`, ignoring case and spaces.
fn skip_prefix(text: &str, range: Range<usize>, literal: &str) -> Option<usize> {
    let mut at = range.start;
    for c in literal.bytes() {
        at = skip_space(text, at);
        if at >= range.end || !byte(text, at).eq_ignore_ascii_case(&c) {
            return None;
        }
        at += 1;
    }
    // A literal word must be a whole word: `A` is not the start of `ACC`.
    let word = literal.ends_with(|c: char| c.is_ascii_alphanumeric());
    if word
        && at < range.end
        && matches!(byte(text, at), c if c.is_ascii_alphanumeric() || matches!(c, b'_' | b'?' | b'$'))
    {
        return None;
    }
    Some(at)
}

/// Returns the position before the literal text at the end of `text[range]`.
fn skip_suffix(text: &str, range: Range<usize>, literal: &str) -> Option<usize> {
    let mut end = range.end;
    for c in literal.bytes().rev() {
        end = trim(text, range.start..end).end;
        if end <= range.start || !byte(text, end - 1).eq_ignore_ascii_case(&c) {
            return None;
        }
        end -= 1;
    }
    Some(end)
}
