//! Reads sections of variables (IEC 61131-3, 2.4.3).

use diag::Pos;

use super::codes;
use super::lexer::IlTokenKind;
use super::literals::{self, read_address};
use super::model::{IlName, IlQualifier, IlSection, IlVariable};
use super::reader::{FaultReported, IlReader, comment_lines, shown};
use super::types::{DirectAddress, IecType, IlLiteral, StandardBlock};

const HINT: &str = "write `name : TYPE;`, `a, b : TYPE := value;` or `name AT %QX0.0 : TYPE;`";

impl IlReader<'_> {
    /// Reads the section whose keyword was at `pos`.
    pub(super) fn read_section(&mut self, section: IlSection, pos: Pos) {
        let mut qualifier = None;
        loop {
            let token = self.peek();
            let found = match token.text.to_ascii_uppercase().as_str() {
                "RETAIN" => Some(IlQualifier::Retain),
                "CONSTANT" => Some(IlQualifier::Constant),
                "NON_RETAIN" => None,
                _ => break,
            };
            if qualifier.is_some() {
                let hint = "write one of RETAIN and CONSTANT";
                self.error(codes::IL_DECLARATION, token.pos, "a section has one qualifier", hint);
            }
            qualifier = found.or(qualifier);
            self.advance();
        }
        loop {
            let token = self.peek_past_lines();
            if let Some(remark) = self.take_comment() {
                self.program.remarks.push(remark);
            }
            if token.is_word("END_VAR") {
                return self.advance();
            }
            if token.kind == IlTokenKind::End || token.is_word("END_PROGRAM") {
                return self.error(
                    codes::IL_DECLARATION,
                    pos,
                    "END_VAR is missing",
                    "add END_VAR after the declarations",
                );
            }
            if self.declaration(section, qualifier).is_err() {
                self.skip_declaration();
            }
        }
    }

    fn skip_declaration(&mut self) {
        while self.raw().kind != IlTokenKind::End && !self.raw().is_word("END_VAR") && !self.raw().is(";") {
            self.advance();
        }
        if self.raw().is(";") {
            self.advance();
        }
        let _ = self.take_comment();
    }

    fn declaration(&mut self, section: IlSection, qualifier: Option<IlQualifier>) -> Result<(), FaultReported> {
        let mut names = vec![self.name("a name", HINT)?];
        while self.take_symbol(",") {
            self.peek_past_lines();
            names.push(self.name("a name", HINT)?);
        }
        let address = self.location(&names)?;
        self.peek_past_lines();
        if !self.take_symbol(":") {
            let token = self.raw();
            let cause = format!("`:` is missing before {}", shown(&token));
            return self.skip(codes::IL_DECLARATION, token.pos, cause, HINT);
        }
        let iec_type = self.type_name()?;
        let initial = if self.take_symbol(":=") { Some(self.initial_value(&iec_type)?) } else { None };
        let end = self.peek_past_lines();
        if !self.take_symbol(";") {
            let cause = format!("`;` is missing before {}", shown(&end));
            return self.skip(codes::IL_DECLARATION, end.pos, cause, HINT);
        }
        let mut comment = self.take_comment();
        while self.raw().kind == IlTokenKind::Comment && self.raw().pos.line == end.pos.line {
            let more = comment_lines(self.raw().text).join(" ");
            self.advance();
            if !more.is_empty() {
                comment = Some(comment.map_or(more.clone(), |first| format!("{first} {more}")));
            }
        }
        for name in names {
            let (iec_type, initial, address) = (iec_type.clone(), initial.clone(), address.clone());
            let comment = comment.take();
            self.program.variables.push(IlVariable { name, section, qualifier, iec_type, address, initial, comment });
        }
        Ok(())
    }

    fn location(&mut self, names: &[IlName]) -> Result<Option<DirectAddress>, FaultReported> {
        if !self.peek_past_lines().is_word("AT") {
            return Ok(None);
        }
        self.advance();
        let token = self.peek_past_lines();
        if token.kind != IlTokenKind::Address {
            let cause = format!("an address is missing before {}", shown(&token));
            return self.skip(codes::IL_ADDRESS, token.pos, cause, HINT);
        }
        self.advance();
        if names.len() > 1 {
            return self.skip(
                codes::IL_DECLARATION,
                token.pos,
                "several names at one address",
                "declare each name alone",
            );
        }
        match read_address(token.text) {
            Ok(address) => Ok(Some(address)),
            Err(refusal) => {
                self.refuse(token.pos, refusal);
                Err(FaultReported)
            }
        }
    }

    fn type_name(&mut self) -> Result<IecType, FaultReported> {
        let token = self.peek_past_lines();
        if token.kind != IlTokenKind::Word {
            let cause = format!("a type is missing before {}", shown(&token));
            return self.skip(codes::IL_DECLARATION, token.pos, cause, HINT);
        }
        self.advance();
        if let Some(refusal) = literals::refused_type(token.text) {
            self.refuse(token.pos, refusal);
            return Err(FaultReported);
        }
        if ["ARRAY", "STRUCT"].iter().any(|word| token.is_word(word)) {
            let hint = "declare a variable for each element";
            return self.skip(codes::IL_NOT_READ, token.pos, format!("{} is not read", token.text), hint);
        }
        let known = IecType::from_keyword(token.text);
        let known = known.or_else(|| StandardBlock::from_keyword(token.text).map(IecType::Block));
        if let Some(known) = known {
            return Ok(known);
        }
        self.check_name(&token)?;
        Ok(IecType::Named(token.text.to_owned()))
    }

    fn initial_value(&mut self, iec_type: &IecType) -> Result<IlLiteral, FaultReported> {
        let token = self.peek_past_lines();
        if iec_type.is_block() {
            let hint = "set the inputs by CAL";
            return self.skip(codes::IL_DECLARATION, token.pos, "a block has no initial value", hint);
        }
        match self.literal()? {
            Some(literal) => Ok(literal),
            None => {
                let cause = format!("a literal is missing before {}", shown(&token));
                self.skip(codes::IL_LITERAL, token.pos, cause, HINT)
            }
        }
    }
}
