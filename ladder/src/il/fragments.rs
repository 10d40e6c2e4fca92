//! Parts of Instruction List as graphical notations have them: an operand, a literal, a type, the lines of a
//! body.

use diag::{Diagnostic, Pos, Severity};

use super::codes;
use super::functions::{FunctionKind, function};
use super::lexer::{IlTokenKind, tokens};
use super::links::check_links;
use super::literals::{read_address, refused_type};
use super::model::{IlInstruction, IlOperand, IlOperandKind, IlProgram};
use super::reader::IlReader;
use super::reserved_words::is_reserved;
use super::types::{DirectAddress, IecType, IlLiteral, StandardBlock};

/// Moves a position of a fragment to its place in the file.
fn moved(pos: Pos, base: Pos) -> Pos {
    let column = if pos.line <= 1 { base.column.saturating_add(pos.column.saturating_sub(1)) } else { pos.column };
    Pos { line: base.line.saturating_add(pos.line.saturating_sub(1)), column, width: pos.width }
}

/// Reads the operand at `pos`: a variable, an output of a block, an address or a literal.
pub(crate) fn operand_of_text(file: &str, text: &str, pos: Pos) -> Result<IlOperand, Diagnostic> {
    let mut reader = IlReader::of_fragment(file, text);
    let hint = "give a variable, an address or a literal";
    let operand = reader.operand(codes::IL_OPERAND_MISSING, "an operand", hint);
    let is_end = reader.peek_past_lines().kind == IlTokenKind::End;
    match (operand, reader.first_fault()) {
        (Ok(operand), None) if is_end => Ok(IlOperand { pos, ..operand }),
        (_, Some(fault)) => Err(Diagnostic { pos, ..fault }),
        _ => {
            let cause = format!("`{}` is no operand", text.trim());
            Err(Diagnostic::new(Severity::Error, codes::IL_OPERAND, file, pos, cause, hint))
        }
    }
}

/// Reads the literal at `pos`.
pub(crate) fn literal_of_text(file: &str, text: &str, pos: Pos) -> Result<IlLiteral, Diagnostic> {
    match operand_of_text(file, text, pos)?.kind {
        IlOperandKind::Literal(literal) => Ok(literal),
        IlOperandKind::Variable { .. } | IlOperandKind::Address(_) => {
            let cause = format!("`{}` is no literal", text.trim());
            Err(Diagnostic::new(Severity::Error, codes::IL_LITERAL, file, pos, cause, "give a number, TRUE or FALSE"))
        }
    }
}

/// Reads the address at `pos`.
pub(crate) fn address_of_text(file: &str, text: &str, pos: Pos) -> Result<DirectAddress, Diagnostic> {
    let address = read_address(text.trim());
    address.map_err(|why| Diagnostic::new(Severity::Error, why.code, file, pos, why.cause, why.hint))
}

/// Returns the type with this name, elementary or a block.
pub(crate) fn declared_type(file: &str, name: &str, pos: Pos) -> Result<IecType, Diagnostic> {
    if let Some(why) = refused_type(name) {
        return Err(Diagnostic::new(Severity::Error, why.code, file, pos, why.cause, why.hint));
    }
    let known = IecType::from_keyword(name);
    let known = known.or_else(|| StandardBlock::from_keyword(name).map(IecType::Block));
    known.ok_or_else(|| {
        let hint = "use the elementary types and the standard blocks";
        Diagnostic::new(Severity::Error, codes::IL_NOT_READ, file, pos, format!("the type `{name}` is not read"), hint)
    })
}

/// Reads the lines of a body whose first character is at `base`.
pub(crate) fn instructions_of_text(file: &str, text: &str, base: Pos) -> Result<Vec<IlInstruction>, Vec<Diagnostic>> {
    let mut reader = IlReader::of_fragment(file, text);
    reader.read_lines();
    let (mut program, mut faults) = reader.into_parts();
    for fault in &mut faults {
        fault.pos = moved(fault.pos, base);
    }
    if faults.iter().any(Diagnostic::is_error) {
        return Err(faults);
    }
    for line in &mut program.instructions {
        line.pos = moved(line.pos, base);
        if let Some(label) = &mut line.label {
            label.pos = moved(label.pos, base);
        }
        if let Some(operation) = &mut line.operation {
            operation.for_each_position(&mut |pos| *pos = moved(*pos, base));
        }
    }
    Ok(program.instructions)
}

/// Whether a text is a name and no keyword.
pub(crate) fn is_plain_name(text: &str) -> bool {
    let found = tokens(text);
    let is_word = found.first().is_some_and(|token| token.kind == IlTokenKind::Word && token.text == text);
    is_word && found.len() == 2 && text.len() <= 127 && !is_reserved(text)
}

/// Returns the errors of labels, jumps, declarations and calls.
pub(crate) fn link_faults(program: &IlProgram) -> Vec<Diagnostic> {
    check_links(program)
}

/// Whether a standard function has this name, in any case.
pub(crate) fn is_standard_function(name: &str) -> bool {
    function(name).is_some()
}

/// Returns the type of the value of a function, from the types of its arguments by their names; `None` if no
/// function has this name, or no argument decides.
pub(crate) fn function_type(name: &str, type_of: &dyn Fn(&str) -> Option<IecType>) -> Option<IecType> {
    let first = |names: &[&str]| names.iter().find_map(|name| type_of(name));
    match function(name)?.kind {
        FunctionKind::Convert(_, to) => Some(to),
        FunctionKind::Operator(operator) if operator.is_comparison() => Some(IecType::Bool),
        FunctionKind::Same | FunctionKind::Operator(_) => first(&["IN", "IN1", "IN2", "MN", "MX"]),
        FunctionKind::Select | FunctionKind::Multiplex => first(&["IN0", "IN1"]),
        FunctionKind::Shift => type_of("IN"),
    }
}
