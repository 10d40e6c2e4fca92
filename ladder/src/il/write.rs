//! Writes the canonical text of Instruction List. Reading it gives an equal program, positions apart.

use super::literals::{address_text, literal_text};
use super::model::{
    IlBinaryOperand, IlInstruction, IlOperand, IlOperandKind, IlOperation, IlParameter, IlProgram, IlQualifier,
    IlVariable,
};

/// Longest call on one line.
const MAX_CALL: usize = 90;

/// Returns the canonical text: remarks, PROGRAM, sections of variables, then a line for each instruction,
/// with keywords in capitals and comments between `(*` and `*)`.
#[must_use]
pub fn write(program: &IlProgram) -> String {
    let mut text = String::new();
    for remark in &program.remarks {
        text += &format!("(* {remark} *)\n");
    }
    if let Some(name) = &program.name {
        text += &format!("PROGRAM {}\n", name.text);
    }
    write_variables(program, &mut text);
    let mut depth = 0_usize;
    for line in &program.instructions {
        if matches!(line.operation, Some(IlOperation::Close)) {
            depth = depth.saturating_sub(1);
        }
        text += &line_text(line, depth);
        text.push('\n');
        depth += usize::from(line.operation.as_ref().is_some_and(IlOperation::is_opening));
    }
    if program.name.is_some() {
        text += "END_PROGRAM\n";
    }
    text
}

fn write_variables(program: &IlProgram, text: &mut String) {
    let key = |variable: &IlVariable| (variable.section, variable.qualifier);
    for section in program.variables.chunk_by(|a, b| key(a) == key(b)) {
        *text += section[0].section.keyword();
        match section[0].qualifier {
            Some(IlQualifier::Retain) => *text += " RETAIN",
            Some(IlQualifier::Constant) => *text += " CONSTANT",
            None => {}
        }
        text.push('\n');
        for variable in section {
            *text += &format!("  {}", variable.name.text);
            if let Some(address) = &variable.address {
                *text += &format!(" AT {}", address_text(address));
            }
            *text += &format!(" : {}", variable.iec_type.keyword());
            if let Some(initial) = &variable.initial {
                *text += &format!(" := {}", literal_text(initial));
            }
            *text += ";";
            if let Some(comment) = &variable.comment {
                *text += &format!(" (* {comment} *)");
            }
            text.push('\n');
        }
        *text += "END_VAR\n";
    }
}

/// Returns a line without its end: label, operation and comment.
fn line_text(line: &IlInstruction, depth: usize) -> String {
    let mut text = String::new();
    if let Some(label) = &line.label {
        text += &format!("{}:", label.text);
    }
    if let Some(operation) = &line.operation {
        text += if text.is_empty() { "    " } else { " " };
        text += &"  ".repeat(depth.min(super::MAX_IL_DEPTH));
        text += &instruction_text(operation);
    }
    if let Some(comment) = &line.comment {
        text += &format!("{}(* {comment} *)", if text.is_empty() { "" } else { "  " });
    }
    text
}

/// Returns the canonical text of an operation; a long call has several lines.
#[must_use]
pub fn instruction_text(operation: &IlOperation) -> String {
    let negation = |negated: bool| if negated { "N" } else { "" };
    match operation {
        IlOperation::Load { negated, operand } => format!("LD{} {}", negation(*negated), operand_text(operand)),
        IlOperation::Store { negated, target } => format!("ST{} {}", negation(*negated), operand_text(target)),
        IlOperation::Set(target) => format!("S {}", operand_text(target)),
        IlOperation::Reset(target) => format!("R {}", operand_text(target)),
        IlOperation::NoTarget { operator } => (*operator).to_owned(),
        IlOperation::Not => "NOT".to_owned(),
        IlOperation::Binary { operator, negated, operand } => {
            let operator = format!("{}{}", operator.keyword(), negation(*negated));
            match operand {
                IlBinaryOperand::Value(operand) => format!("{operator} {}", operand_text(operand)),
                IlBinaryOperand::Deferred(Some(operand)) => format!("{operator}( {}", operand_text(operand)),
                IlBinaryOperand::Deferred(None) => format!("{operator}("),
            }
        }
        IlOperation::Close => ")".to_owned(),
        IlOperation::Jump { condition, label } => format!("JMP{} {}", condition.modifier(), label.text),
        IlOperation::Call { condition, instance, parameters } => {
            let head = format!("CAL{} {}", condition.modifier(), instance.text);
            if parameters.is_empty() { head } else { head + &parameters_text(parameters) }
        }
        IlOperation::Return(condition) => format!("RET{}", condition.modifier()),
        IlOperation::BlockInput { input, instance } => format!("{} {}", input.keyword(), instance.text),
        IlOperation::ShortBlock { block, instance, preset } => {
            format!("{} {}, {}", block.keyword(), instance.text, operand_text(preset))
        }
        IlOperation::Function { name, parenthesized: true, arguments } => {
            format!("{}{}", name.text, parameters_text(arguments))
        }
        IlOperation::Function { name, parenthesized: false, arguments } => {
            let arguments: Vec<String> = arguments.iter().map(parameter_text).collect();
            format!("{} {}", name.text, arguments.join(", ")).trim_end().to_owned()
        }
    }
}

fn parameters_text(parameters: &[IlParameter]) -> String {
    let parameters: Vec<String> = parameters.iter().map(parameter_text).collect();
    let length: usize = parameters.iter().map(|parameter| parameter.len() + 2).sum();
    if length > MAX_CALL {
        return format!("(\n        {}\n    )", parameters.join(",\n        "));
    }
    format!("({})", parameters.join(", "))
}

fn parameter_text(parameter: &IlParameter) -> String {
    match parameter {
        IlParameter::Positional(operand) => operand_text(operand),
        IlParameter::Input { name, value } => format!("{} := {}", name.text, operand_text(value)),
        IlParameter::Output { negated, name, target } => {
            format!("{}{} => {}", if *negated { "NOT " } else { "" }, name.text, operand_text(target))
        }
    }
}

/// Returns the text of an operand.
pub(super) fn operand_text(operand: &IlOperand) -> String {
    match &operand.kind {
        IlOperandKind::Variable { name, member: Some(member) } => format!("{name}.{member}"),
        IlOperandKind::Variable { name, member: None } => name.clone(),
        IlOperandKind::Address(address) => address_text(address),
        IlOperandKind::Literal(literal) => literal_text(literal),
    }
}
