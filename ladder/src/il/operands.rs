//! Reads operands and parameters (IEC 61131-3, 3.2.2 and 3.2.3).

use super::codes;
use super::lexer::IlTokenKind;
use super::literals::{self, LiteralRefusal};
use super::model::{IlName, IlOperand, IlOperandKind, IlParameter};
use super::operators::keyword;
use super::reader::{FaultReported, IlReader, shown};
use super::types::{IlLiteral, IlValue};

const PARAMETER_HINT: &str = "write `x`, `PT := x`, `Q => x` or `NOT Q => x`, with commas between them";

impl IlReader<'_> {
    /// Takes a literal, or returns `None` if the next token is none. A refused one is reported and skipped.
    pub(super) fn literal(&mut self) -> Result<Option<IlLiteral>, FaultReported> {
        let token = self.peek();
        let read = match token.kind {
            IlTokenKind::Number => literals::read_number(token.text),
            IlTokenKind::Typed => literals::read_typed(token.text),
            IlTokenKind::Text => Err(literals::refused_text()),
            IlTokenKind::Word if token.is_word("TRUE") || token.is_word("FALSE") => {
                Ok(IlLiteral { prefix: None, value: IlValue::Bool(token.is_word("TRUE")) })
            }
            IlTokenKind::Open => Err(LiteralRefusal {
                code: codes::IL_OPEN,
                cause: "the comment or string has no end".to_owned(),
                hint: "add the end",
            }),
            _ => return Ok(None),
        };
        self.advance();
        match read {
            Ok(literal) => Ok(Some(literal)),
            Err(refusal) => {
                self.refuse(token.pos, refusal);
                Err(FaultReported)
            }
        }
    }

    /// Takes an operand. `hint` shows the whole instruction. After a refused literal, reading continues with
    /// `FALSE` in its place.
    pub(super) fn operand(&mut self, code: &'static str, what: &str, hint: &str) -> Result<IlOperand, FaultReported> {
        let token = self.peek();
        let operand = |kind| IlOperand { kind, pos: token.pos };
        let is_literal =
            matches!(token.kind, IlTokenKind::Number | IlTokenKind::Typed | IlTokenKind::Text | IlTokenKind::Open);
        if is_literal || token.is_word("TRUE") || token.is_word("FALSE") {
            let stand_in = IlLiteral { prefix: None, value: IlValue::Bool(false) };
            let literal = self.literal().ok().flatten().unwrap_or(stand_in);
            return Ok(operand(IlOperandKind::Literal(literal)));
        }
        match token.kind {
            IlTokenKind::Address => {
                self.advance();
                match literals::read_address(token.text) {
                    Ok(address) => Ok(operand(IlOperandKind::Address(address))),
                    Err(refusal) => {
                        self.refuse(token.pos, refusal);
                        Err(FaultReported)
                    }
                }
            }
            IlTokenKind::Word => {
                let mut name = self.name(what, hint)?;
                let member = self.member(&mut name)?;
                Ok(IlOperand { kind: IlOperandKind::Variable { name: name.text, member }, pos: name.pos })
            }
            _ => self.skip(code, token.pos, format!("{what} is missing before {}", shown(&token)), hint),
        }
    }

    /// Takes `.member` and extends the position of `name` over it.
    fn member(&mut self, name: &mut IlName) -> Result<Option<String>, FaultReported> {
        if !self.raw().is(".") {
            return Ok(None);
        }
        self.advance();
        let token = self.raw();
        if token.kind == IlTokenKind::Number {
            self.advance();
            let hint = "use AND with a mask, or an address such as %MX0.3";
            return self.skip(codes::IL_NOT_READ, token.pos, "a bit of a variable is not read", hint);
        }
        let member = self.name("the input or output", "write `timer.Q`")?;
        name.pos.width = member.pos.column.saturating_sub(name.pos.column) + member.pos.width;
        if self.raw().is(".") {
            let pos = self.raw().pos;
            return self.skip(
                codes::IL_NOT_READ,
                pos,
                "structures are not read",
                "declare a variable for each element",
            );
        }
        Ok(Some(member.text))
    }

    /// Takes parameters after `(` up to and including `)`.
    pub(super) fn parameters(&mut self) -> Result<Vec<IlParameter>, FaultReported> {
        let mut parameters: Vec<IlParameter> = Vec::new();
        if self.peek_past_lines().is(")") {
            self.advance();
            return Ok(parameters);
        }
        loop {
            let pos = self.peek_past_lines().pos;
            match self.parameter() {
                Ok(parameter) => {
                    if let Some(fault) = conflict(&parameters, &parameter) {
                        self.error(codes::IL_PARAMETER, pos, fault, PARAMETER_HINT);
                    }
                    parameters.push(parameter);
                }
                Err(FaultReported) => self.skip_parameter(),
            }
            let token = self.peek_past_lines();
            if token.is(")") {
                self.advance();
                return Ok(parameters);
            }
            if !token.is(",") {
                let cause = format!("`,` or `)` is missing before {}", shown(&token));
                self.error(codes::IL_PARAMETER, token.pos, cause, PARAMETER_HINT);
                if token.pos.line > pos.line && keyword(token.text).is_some() && !self.look_ahead::<1>()[0].is(":=") {
                    return Err(FaultReported); // the next instruction
                }
                self.skip_parameter();
            }
            if self.peek_past_lines().kind == IlTokenKind::End {
                return Err(FaultReported);
            }
            if self.raw().is(")") {
                self.advance();
                return Ok(parameters);
            }
            self.advance();
        }
    }

    /// Skips to the `,` or `)` after a faulty parameter.
    fn skip_parameter(&mut self) {
        let mut depth = 0_usize;
        loop {
            let token = self.peek_past_lines();
            if token.kind == IlTokenKind::End || depth == 0 && (token.is(",") || token.is(")")) {
                return;
            }
            if token.is("(") {
                depth += 1;
            } else if token.is(")") {
                depth -= 1;
            }
            self.advance();
        }
    }

    fn parameter(&mut self) -> Result<IlParameter, FaultReported> {
        let first = self.peek();
        let negated = first.is_word("NOT");
        if negated {
            self.advance();
            self.peek_past_lines();
        }
        let [next] = self.look_ahead();
        if first.kind == IlTokenKind::Word && (next.is(":=") || next.is("=>")) {
            let name = self.name("the name of a parameter", PARAMETER_HINT)?;
            let arrow = self.peek_past_lines();
            self.advance();
            let value = self.peek_past_lines();
            if value.is("(") {
                let hint = "store the value in a variable first";
                return self.skip(codes::IL_NOT_READ, value.pos, "instructions as a parameter are not read", hint);
            }
            let value = self.operand(codes::IL_PARAMETER, "a value", PARAMETER_HINT)?;
            if arrow.is(":=") && !negated {
                return Ok(IlParameter::Input { name, value });
            }
            if arrow.is("=>") {
                self.check_target(&value, "an output")?;
                return Ok(IlParameter::Output { negated, name, target: value });
            }
        }
        if negated {
            return self.skip(codes::IL_PARAMETER, first.pos, "NOT belongs to an output", PARAMETER_HINT);
        }
        Ok(IlParameter::Positional(self.operand(codes::IL_PARAMETER, "a parameter", PARAMETER_HINT)?))
    }

    /// Reports a literal as the target of a write.
    pub(super) fn check_target(&mut self, target: &IlOperand, what: &str) -> Result<(), FaultReported> {
        if !matches!(target.kind, IlOperandKind::Literal(_)) {
            return Ok(());
        }
        let cause = format!("{what} cannot write a literal");
        self.skip(codes::IL_STORE_LITERAL, target.pos, cause, "give a variable or an address such as %QX0.0")
    }
}

/// Returns why a parameter does not fit those before it.
fn conflict(before: &[IlParameter], parameter: &IlParameter) -> Option<String> {
    let is_positional = |p: &IlParameter| matches!(p, IlParameter::Positional(_));
    if before.iter().any(is_positional) && matches!(parameter, IlParameter::Input { .. })
        || is_positional(parameter) && before.iter().any(|p| !is_positional(p))
    {
        return Some("positional and named parameters are mixed".to_owned());
    }
    let name_of = |p: &IlParameter| match p {
        IlParameter::Positional(_) => None,
        IlParameter::Input { name, .. } | IlParameter::Output { name, .. } => Some(name.text.to_ascii_uppercase()),
    };
    let name = name_of(parameter)?;
    before.iter().any(|p| name_of(p).as_ref() == Some(&name)).then(|| format!("the parameter {name} occurs twice"))
}
