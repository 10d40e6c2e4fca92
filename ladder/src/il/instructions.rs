//! Reads the lines of the body: label, operator, operands, comment.

use diag::{Pos, nearest};

use super::codes;
use super::functions::{function, standard_functions};
use super::lexer::{IlToken, IlTokenKind};
use super::model::{IlBinaryOperand, IlBinaryOperator, IlInstruction, IlName, IlOperand, IlOperation, IlParameter};
use super::operators::{IlKeyword, all_keywords, keyword, modifier_hint, vendor_mnemonic, wrong_modifier};
use super::reader::{FaultReported, IlReader, MAX_IL_DEPTH, shown};
use super::types::StandardBlock;

/// Longest label (reference 001).
const MAX_LABEL: usize = 16;

impl<'a> IlReader<'a> {
    /// Reads a line of the body.
    pub(super) fn read_instruction(&mut self) {
        let mut line = IlInstruction::default();
        let first = self.peek();
        line.pos = first.pos;
        let is_word = matches!(first.kind, IlTokenKind::Word | IlTokenKind::Number);
        if is_word && self.look_ahead::<1>()[0].is(":") {
            self.check_label(&first);
            line.label = Some(IlName { text: first.text.to_owned(), pos: first.pos });
            self.advance();
            self.take_symbol(":");
        }
        let token = self.peek();
        if !matches!(token.kind, IlTokenKind::Newline | IlTokenKind::End) {
            line.pos = token.pos;
            match self.operation() {
                Ok(operation) => {
                    line.operation = Some(operation);
                    self.expect_line_end();
                }
                Err(FaultReported) => self.skip_line(),
            }
        }
        line.comment = self.take_comment();
        if line.label.is_some() || line.operation.is_some() || line.comment.is_some() {
            self.program.instructions.push(line);
        }
    }

    fn check_label(&mut self, label: &IlToken<'a>) {
        let cause = if !label.text.starts_with(|c: char| c.is_ascii_alphabetic()) {
            format!("the label `{}` does not begin with a letter", label.text)
        } else if label.text.len() > MAX_LABEL {
            format!("the label `{}` has {} characters", label.text, label.text.len())
        } else {
            return;
        };
        let hint = "begin with a letter; then letters, digits and `_`, at most 16 characters";
        self.error(codes::IL_LABEL, label.pos, cause, hint);
    }

    fn expect_line_end(&mut self) {
        let token = self.peek();
        // A `)` may follow on the same line; the writer gives it its own line.
        if is_operation_end(&token) {
            return;
        }
        let hint = if token.is(",") {
            "several operands without parentheses need an operator without modifiers: ADD a, b"
        } else {
            "write each instruction on its own line; a comment is between (* and *)"
        };
        self.error(codes::IL_EXTRA, token.pos, format!("{} after the instruction", shown(&token)), hint);
        self.skip_line();
    }

    fn operation(&mut self) -> Result<IlOperation, FaultReported> {
        let token = self.peek();
        self.advance();
        if token.is(")") {
            return self.close(token.pos);
        }
        let mut word = token.text.to_owned();
        if token.is("&") {
            word.push_str(self.take_modifier_of_ampersand(token.pos));
        } else if token.kind != IlTokenKind::Word && !token.is("=") {
            let hint = "begin the line with an operator such as LD, AND or ST";
            return self.skip(codes::IL_CHARACTER, token.pos, format!("{} is no operator", shown(&token)), hint);
        }
        let operator = OperatorWord { word: word.to_ascii_uppercase(), pos: token.pos };
        if let Some(keyword) = keyword(&operator.word) {
            self.refuse_not_after(&operator)?;
            return self.operands_of(keyword, &operator);
        }
        if let Some(wrong) = wrong_modifier(&operator.word) {
            let cause = format!("{} does not have the modifier {}", wrong.operator, wrong.modifier);
            return self.skip(codes::IL_MODIFIER, operator.pos, cause, modifier_hint(wrong.operator));
        }
        if let Some(row) = vendor_mnemonic(&operator.word) {
            let cause = format!("{} is a mnemonic of {}", operator.word, row.vendor);
            return self.skip(codes::IL_VENDOR, operator.pos, cause, format!("write {}", row.iec));
        }
        self.function(&token)
    }

    /// Takes the modifier of `&N x`, or of `&C x`, which is an error. `&N` alone names a variable N.
    fn take_modifier_of_ampersand(&mut self, pos: Pos) -> &'a str {
        let word = self.raw();
        let is_modifier = ["N", "C", "CN", "NC"].iter().any(|modifier| word.is_word(modifier));
        let is_joined = word.pos.line == pos.line && word.pos.column == pos.column + 1;
        let [next] = self.look_ahead();
        let has_operand = next.pos.line == pos.line && !next.is(",") && !next.is(")") && next.kind != IlTokenKind::End;
        if !(is_modifier && is_joined && has_operand) {
            return "";
        }
        self.advance();
        word.text
    }

    /// Reports `LD NOT x`, `AND NOT x`, `OUT NOT x` and `AND LD` of Omron.
    fn refuse_not_after(&mut self, operator: &OperatorWord) -> Result<(), FaultReported> {
        let token = self.peek();
        let base = operator.word.as_str();
        let iec = match base {
            "LD" | "AND" | "OR" | "ST" if token.is_word("NOT") => format!("{base}N"),
            "AND" | "OR" if token.is_word("LD") && self.look_ahead_is_line_end() => format!("{base}( and `)`"),
            _ => return Ok(()),
        };
        let cause = format!("{base} {} is a mnemonic of Omron", token.text.to_ascii_uppercase());
        self.skip(codes::IL_VENDOR, token.pos, cause, format!("write {iec}"))
    }

    fn look_ahead_is_line_end(&self) -> bool {
        let line = self.raw().pos.line;
        let [next] = self.look_ahead();
        next.kind == IlTokenKind::End || next.pos.line != line
    }

    fn operands_of(&mut self, keyword: IlKeyword, operator: &OperatorWord) -> Result<IlOperation, FaultReported> {
        if let IlKeyword::Binary { operator: binary, negated } = keyword {
            return self.binary(binary, negated, operator);
        }
        let token = self.peek();
        let is_call = matches!(keyword, IlKeyword::Call(_));
        if token.is("(") && !is_call {
            if let IlKeyword::Block(block) = keyword {
                let hint = format!("declare an instance, `T1 : {};`, and write CAL T1(..)", block.keyword());
                let cause = format!("{} is the type of a block, not an instance", operator.word);
                return self.skip(codes::IL_NO_BLOCK, operator.pos, cause, hint);
            }
            let base = wrong_base(&operator.word);
            let cause = format!("{} does not have the modifier (", operator.word);
            return self.skip(codes::IL_MODIFIER, token.pos, cause, modifier_hint(base));
        }
        Ok(match keyword {
            IlKeyword::Load { negated } => IlOperation::Load { negated, operand: self.operand_of(operator)? },
            IlKeyword::Store { negated } => IlOperation::Store { negated, target: self.target_of(operator)? },
            IlKeyword::Set if is_operation_end(&token) => IlOperation::NoTarget { operator: "S" },
            IlKeyword::Reset if is_operation_end(&token) => IlOperation::NoTarget { operator: "R" },
            IlKeyword::Set => IlOperation::Set(self.target_of(operator)?),
            IlKeyword::Reset => IlOperation::Reset(self.target_of(operator)?),
            IlKeyword::Not => self.without_operand(operator, IlOperation::Not)?,
            IlKeyword::Return(condition) => self.without_operand(operator, IlOperation::Return(condition))?,
            IlKeyword::Jump(condition) => IlOperation::Jump { condition, label: self.jump_label(operator)? },
            IlKeyword::Call(condition) => {
                let instance = self.instance(operator)?;
                let parameters = if self.take_symbol("(") { self.parameters()? } else { Vec::new() };
                IlOperation::Call { condition, instance, parameters }
            }
            IlKeyword::Input(input) => IlOperation::BlockInput { input, instance: self.instance(operator)? },
            IlKeyword::Block(block) => self.short_block(block, operator)?,
            IlKeyword::Binary { .. } => return Err(FaultReported), // handled above
        })
    }

    fn operand_of(&mut self, operator: &OperatorWord) -> Result<IlOperand, FaultReported> {
        let hint = format!("write {} and a variable, an address or a literal", operator.word);
        let what = format!("the operand of {}", operator.word);
        self.operand(codes::IL_OPERAND_MISSING, &what, &hint)
    }

    fn target_of(&mut self, operator: &OperatorWord) -> Result<IlOperand, FaultReported> {
        let hint = format!("write {} and a variable or an address such as %QX0.0", operator.word);
        let what = format!("the operand of {}", operator.word);
        let target = self.operand(codes::IL_OPERAND_MISSING, &what, &hint)?;
        self.check_target(&target, &operator.word)?;
        Ok(target)
    }

    fn without_operand(
        &mut self,
        operator: &OperatorWord,
        operation: IlOperation,
    ) -> Result<IlOperation, FaultReported> {
        let token = self.peek();
        if is_operation_end(&token) {
            return Ok(operation);
        }
        let cause = format!("{} takes no operand, but {} follows", operator.word, shown(&token));
        self.skip(codes::IL_OPERAND, token.pos, cause, format!("write {} alone", operator.word))
    }

    fn jump_label(&mut self, operator: &OperatorWord) -> Result<IlName, FaultReported> {
        let token = self.peek();
        let hint = format!("write {} and a label", operator.word);
        if matches!(token.kind, IlTokenKind::Word | IlTokenKind::Newline | IlTokenKind::End) {
            return self.name("the label", &hint);
        }
        self.skip(codes::IL_OPERAND, token.pos, format!("{} is no label", shown(&token)), hint)
    }

    fn instance(&mut self, operator: &OperatorWord) -> Result<IlName, FaultReported> {
        let token = self.peek();
        let hint = format!("write {} and the name of an instance, declared as in `T1 : TON;`", operator.word);
        if matches!(token.kind, IlTokenKind::Word | IlTokenKind::Newline | IlTokenKind::End) {
            let name = self.name("the instance", &hint)?;
            if !self.raw().is(".") {
                return Ok(name);
            }
            return self.skip(codes::IL_NO_BLOCK, name.pos, "a part of an instance is no instance", hint);
        }
        self.skip(codes::IL_NO_BLOCK, token.pos, format!("{} is no function block", shown(&token)), hint)
    }

    fn short_block(&mut self, block: StandardBlock, operator: &OperatorWord) -> Result<IlOperation, FaultReported> {
        let Some(preset) = block.preset() else {
            let cause = format!("{} has no short form, because it has no preset", operator.word);
            let hint = format!("declare an instance, `B1 : {};`, and call it with CAL", operator.word);
            return self.skip(codes::IL_NO_BLOCK, operator.pos, cause, hint);
        };
        let instance = self.instance(operator)?;
        let hint = format!("write {} name, preset: {} T1,100", operator.word, operator.word);
        if !self.take_symbol(",") {
            let token = self.peek();
            let cause = format!("the preset {} of {} is missing", preset.name, instance.text);
            return self.skip(codes::IL_OPERAND_MISSING, token.pos, cause, hint);
        }
        let preset = self.operand(codes::IL_OPERAND_MISSING, "the preset", &hint)?;
        Ok(IlOperation::ShortBlock { block, instance, preset })
    }

    fn binary(
        &mut self,
        binary: IlBinaryOperator,
        negated: bool,
        operator: &OperatorWord,
    ) -> Result<IlOperation, FaultReported> {
        if self.peek().is("(") {
            if !negated && self.is_formal_call() {
                self.advance();
                let name = IlName { text: binary.keyword().to_owned(), pos: operator.pos };
                let arguments = self.parameters()?;
                return Ok(IlOperation::Function { name, parenthesized: true, arguments });
            }
            self.advance();
            self.open(operator.pos);
            let token = self.peek();
            let operand = if is_operation_end(&token) { None } else { Some(self.operand_of(operator)?) };
            let operand = IlBinaryOperand::Deferred(operand);
            return Ok(IlOperation::Binary { operator: binary, negated, operand });
        }
        let first = self.operand_of(operator)?;
        if negated || !self.peek().is(",") {
            return Ok(IlOperation::Binary { operator: binary, negated, operand: IlBinaryOperand::Value(first) });
        }
        let arguments = self.more_operands(first, operator)?;
        let name = IlName { text: binary.keyword().to_owned(), pos: operator.pos };
        Ok(IlOperation::Function { name, parenthesized: false, arguments })
    }

    /// Whether named parameters follow after `(`: then it begins the parameters of a function.
    fn is_formal_call(&self) -> bool {
        let [first, second, third] = self.look_ahead();
        let is_named = |name: &IlToken<'_>, arrow: &IlToken<'_>| {
            name.kind == IlTokenKind::Word && (arrow.is(":=") || arrow.is("=>"))
        };
        is_named(&first, &second) || first.is_word("NOT") && is_named(&second, &third)
    }

    fn more_operands(&mut self, first: IlOperand, operator: &OperatorWord) -> Result<Vec<IlParameter>, FaultReported> {
        let mut arguments = vec![IlParameter::Positional(first)];
        while self.take_symbol(",") {
            arguments.push(IlParameter::Positional(self.operand_of(operator)?));
        }
        Ok(arguments)
    }

    fn function(&mut self, token: &IlToken<'a>) -> Result<IlOperation, FaultReported> {
        let upper = token.text.to_ascii_uppercase();
        let next = self.peek();
        let is_alone = matches!(next.kind, IlTokenKind::Newline | IlTokenKind::End) || next.is(")");
        let is_standard = function(&upper).is_some();
        if !is_standard {
            let is_conversion = |name: &str| name.contains("_TO_");
            let functions = standard_functions().filter(|name| upper.contains("TO") || !is_conversion(name));
            let known: Vec<String> = all_keywords().chain(functions).collect();
            let meant = nearest(&upper, known.iter().map(String::as_str));
            if is_alone || meant.is_some() {
                let cause = format!("unknown operator `{}`", token.text);
                let other = "begin the line with an operator such as LD, AND or ST".to_owned();
                let hint = meant.map_or(other, |meant| format!("did you mean {meant}?"));
                return self.skip(codes::IL_OPERATOR, token.pos, cause, hint);
            }
        }
        self.check_name(token)?;
        let name = IlName { text: if is_standard { upper } else { token.text.to_owned() }, pos: token.pos };
        if self.take_symbol("(") {
            let arguments = self.parameters()?;
            return Ok(IlOperation::Function { name, parenthesized: true, arguments });
        }
        if is_alone {
            return Ok(IlOperation::Function { name, parenthesized: false, arguments: Vec::new() });
        }
        let operator = OperatorWord { word: name.text.clone(), pos: token.pos };
        let first = self.operand_of(&operator)?;
        let arguments = self.more_operands(first, &operator)?;
        Ok(IlOperation::Function { name, parenthesized: false, arguments })
    }

    fn open(&mut self, pos: Pos) {
        self.opened.push(pos);
        if self.opened.len() == MAX_IL_DEPTH + 1 {
            let cause = format!("parentheses are nested deeper than {MAX_IL_DEPTH}");
            self.error(codes::IL_DEPTH, pos, cause, "store intermediate results in variables");
        }
    }

    fn close(&mut self, pos: Pos) -> Result<IlOperation, FaultReported> {
        if self.opened.pop().is_none() {
            let hint = "remove it, or add the operator with `(`";
            return self.skip(codes::IL_UNOPENED, pos, "no operator with `(` waits here", hint);
        }
        Ok(IlOperation::Close)
    }
}

/// The word of an operator in capitals and its position.
struct OperatorWord {
    word: String,
    pos: Pos,
}

/// Returns the operator without its modifier, for a hint.
fn wrong_base(word: &str) -> &str {
    match word {
        "LDN" => "LD",
        "STN" => "ST",
        "JMPC" | "JMPCN" | "JMPNC" => "JMP",
        "RETC" | "RETCN" | "RETNC" => "RET",
        other => other,
    }
}

/// Whether an operation is complete before this token: at the end of the line or before a `)`.
fn is_operation_end(token: &IlToken<'_>) -> bool {
    matches!(token.kind, IlTokenKind::Newline | IlTokenKind::End) || token.is(")")
}
