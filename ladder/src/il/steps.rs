//! Instructions as elements of a ladder program: resolved and typed, so that what executes or compiles them
//! needs no names and no rules of types.

use std::fmt;

use diag::Pos;

use crate::symbol_kinds::SymbolKind;

use super::model::{IlBinaryOperator, IlCondition, IlOperation, IlQualifier, IlSection};
use super::types::{AddressArea, DirectAddress, IecType, StandardBlock};
use super::write::instruction_text;

/// A line of Instruction List that has a label or an operation: an element of a rung.
///
/// `docs/semantics.md`, section 6, defines what it does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IlStep {
    /// Label of the line. It is the first element of its rung.
    pub label: Option<String>,
    /// What the line does.
    pub action: IlAction,
    /// Type of the current result before the line; `None` if nothing is loaded or no path leads here.
    pub before: Option<IecType>,
    /// Type of the current result after the line; `None` as for `before`.
    pub after: Option<IecType>,
    /// The operation as the program writes it, without positions; `None` for a line that has only a label.
    pub operation: Option<IlOperation>,
    /// Comment of the line.
    pub comment: Option<String>,
}

/// A symbol with its type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TypedSymbol {
    /// Name as in [`crate::LadderProgram::symbols`].
    pub name: String,
    /// Kind of the symbol.
    pub kind: SymbolKind,
    /// Elementary type.
    pub iec_type: IecType,
}

/// Where an operand has its value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IlSource {
    /// The current result.
    Result,
    /// A symbol.
    Symbol(TypedSymbol),
    /// A constant: 0 or 1 for BOOL, milliseconds for TIME.
    Constant(i64),
}

/// What a line does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IlAction {
    /// Nothing: the line has only a label, or S or R without an operand.
    Nothing,
    /// LD, LDN.
    Load {
        /// Modifier N.
        negated: bool,
        /// What is loaded.
        source: IlSource,
        /// Type of the current result after it.
        iec_type: IecType,
    },
    /// ST, STN.
    Store {
        /// Modifier N.
        negated: bool,
        /// What is written.
        target: TypedSymbol,
    },
    /// S: the target, a BOOL, becomes TRUE if the current result is.
    Set(TypedSymbol),
    /// R: the target, a BOOL, becomes FALSE if the current result is TRUE.
    Reset(TypedSymbol),
    /// NOT.
    Not {
        /// Type of the current result.
        iec_type: IecType,
    },
    /// AND to LT with an operand.
    Binary {
        /// Operator.
        operator: IlBinaryOperator,
        /// Modifier N.
        negated: bool,
        /// Operand.
        source: IlSource,
        /// Type in which the operation works. The result of a comparison is BOOL.
        iec_type: IecType,
    },
    /// An operator with `(`: saves the current result. Its [`IlAction::Close`] has the operator.
    Open {
        /// What is loaded afterwards, if the line has an operand.
        source: Option<IlSource>,
        /// Type of what is loaded; `None` without operand.
        iec_type: Option<IecType>,
    },
    /// `)`: the saved result, operator, current result.
    Close {
        /// Operator of the line with the matching `(`.
        operator: IlBinaryOperator,
        /// Its modifier N, which complements the current result first.
        negated: bool,
        /// Type in which the operation works.
        iec_type: IecType,
    },
    /// JMP, JMPC, JMPCN.
    Jump {
        /// Modifier.
        condition: IlCondition,
        /// Label.
        label: String,
        /// Index of the rung that begins with the label, from 0.
        target: u32,
    },
    /// RET, RETC, RETCN: ends the program for this scan.
    Return(IlCondition),
    /// CAL, CALC, CALCN, an input operator or the short form.
    Call {
        /// Modifier.
        condition: IlCondition,
        /// Instance and parameters.
        call: BlockCall,
    },
    /// A function; its value becomes the current result.
    Function(FunctionCall),
}

/// A call of an instance of a standard block.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockCall {
    /// Block.
    pub block: StandardBlock,
    /// Instance. Its inputs and outputs are the symbols that [`BlockCall::part`] returns.
    pub instance: String,
    /// Inputs that are written before the call, in this order.
    pub inputs: Vec<(TypedSymbol, IlSource)>,
    /// Outputs that are copied after the call, in this order.
    pub outputs: Vec<BlockOutput>,
}

/// An output of a block that a call copies to a symbol.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BlockOutput {
    /// Output.
    pub part: TypedSymbol,
    /// Whether the complement is copied.
    pub negated: bool,
    /// What is written.
    pub target: TypedSymbol,
}

impl BlockCall {
    /// Returns the symbol of an input or output; `None` if the block has no such part.
    #[must_use]
    pub fn part(&self, name: &str) -> Option<TypedSymbol> {
        self.block.part(name).map(|part| part_symbol(&self.instance, part.name, part.iec_type()))
    }
}

/// Returns the symbol of a part of an instance.
pub(super) fn part_symbol(instance: &str, part: &str, iec_type: IecType) -> TypedSymbol {
    let kind = if iec_type == IecType::Bool { SymbolKind::Relay } else { SymbolKind::Variable };
    TypedSymbol { name: format!("{instance}.{part}"), kind, iec_type }
}

/// A standard function.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IlFunction {
    /// AND to LT with two or more arguments.
    Operator(IlBinaryOperator),
    /// ABS.
    Absolute,
    /// MOVE.
    Move,
    /// MAX.
    Maximum,
    /// MIN.
    Minimum,
    /// LIMIT: MN, IN, MX.
    Limit,
    /// SEL: G, IN0, IN1.
    Select,
    /// MUX: K, IN0, IN1 ..
    Multiplex,
    /// SHL: IN, N.
    ShiftLeft,
    /// SHR: IN, N.
    ShiftRight,
    /// ROL: IN, N.
    RotateLeft,
    /// ROR: IN, N.
    RotateRight,
    /// A conversion such as INT_TO_DINT.
    Convert,
}

/// A call of a standard function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FunctionCall {
    /// Function.
    pub function: IlFunction,
    /// Arguments in the order of their names.
    pub arguments: Vec<IlSource>,
    /// Type of the arguments; those that choose or count (G, K, N) have a type of their own.
    pub iec_type: IecType,
    /// Type of the value.
    pub result: IecType,
}

/// A variable of an IEC program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IecVariable {
    /// Name as the program declares it, or the address of a place without a name.
    pub name: String,
    /// Kind of its symbol; `None` for an instance of a block, whose parts are the symbols.
    pub kind: Option<SymbolKind>,
    /// Type.
    pub iec_type: IecType,
    /// Value at power-up.
    pub initial: i64,
    /// Section.
    pub section: IlSection,
    /// RETAIN or CONSTANT.
    pub qualifier: Option<IlQualifier>,
    /// Address.
    pub address: Option<DirectAddress>,
    /// Whether the program declares it. A program without declarations uses its names without.
    pub is_declared: bool,
    /// Comment of the declaration.
    pub comment: Option<String>,
    /// Position of the declaration, or of the first use.
    pub pos: Pos,
}

impl IecVariable {
    /// Whether the value comes from outside: VAR_INPUT, or an address at %I.
    #[must_use]
    pub fn is_given(&self) -> bool {
        let is_at_input = self.address.as_ref().is_some_and(|address| address.area == AddressArea::Input);
        self.kind.is_some() && (self.section == IlSection::Input || is_at_input)
    }

    /// Returns the symbols of the variable: itself, or the inputs and outputs of an instance.
    #[must_use]
    pub fn symbols(&self) -> Vec<TypedSymbol> {
        match (&self.iec_type, self.kind) {
            (IecType::Block(block), _) => {
                block.parts().iter().map(|part| part_symbol(&self.name, part.name, part.iec_type())).collect()
            }
            (iec_type, Some(kind)) => {
                vec![TypedSymbol { name: self.name.clone(), kind, iec_type: iec_type.clone() }]
            }
            _ => Vec::new(),
        }
    }
}

impl IlStep {
    /// Returns the canonical text of the operation; empty for a line that has only a label.
    #[must_use]
    pub fn text(&self) -> String {
        self.operation.as_ref().map_or(String::new(), instruction_text)
    }

    /// Returns the operator of the line, such as `ANDN`; `LABEL` for a line that has only a label.
    #[must_use]
    pub fn keyword(&self) -> &'static str {
        let by_condition = |condition: IlCondition, names: [&'static str; 3]| match condition {
            IlCondition::Always => names[0],
            IlCondition::IfTrue => names[1],
            IlCondition::IfFalse => names[2],
        };
        match &self.action {
            IlAction::Nothing => "LABEL",
            IlAction::Load { negated, .. } => ["LD", "LDN"][usize::from(*negated)],
            IlAction::Store { negated, .. } => ["ST", "STN"][usize::from(*negated)],
            IlAction::Set(_) => "S",
            IlAction::Reset(_) => "R",
            IlAction::Not { .. } => "NOT",
            IlAction::Binary { operator, .. } => operator.keyword(),
            IlAction::Open { .. } => "(",
            IlAction::Close { .. } => ")",
            IlAction::Jump { condition, .. } => by_condition(*condition, ["JMP", "JMPC", "JMPCN"]),
            IlAction::Return(condition) => by_condition(*condition, ["RET", "RETC", "RETCN"]),
            IlAction::Call { condition, .. } => by_condition(*condition, ["CAL", "CALC", "CALCN"]),
            IlAction::Function(_) => "FUNCTION",
        }
    }

    /// Returns all sources that the line reads, in order.
    pub fn sources(&self) -> impl Iterator<Item = &IlSource> {
        let (one, call, arguments): (Option<&IlSource>, Option<&BlockCall>, &[IlSource]) = match &self.action {
            IlAction::Load { source, .. } | IlAction::Binary { source, .. } => (Some(source), None, &[]),
            IlAction::Open { source, .. } => (source.as_ref(), None, &[]),
            IlAction::Call { call, .. } => (None, Some(call), &[]),
            IlAction::Function(function) => (None, None, &function.arguments),
            IlAction::Nothing
            | IlAction::Store { .. }
            | IlAction::Set(_)
            | IlAction::Reset(_)
            | IlAction::Not { .. }
            | IlAction::Close { .. }
            | IlAction::Jump { .. }
            | IlAction::Return(_) => (None, None, &[]),
        };
        let inputs = call.into_iter().flat_map(|call| call.inputs.iter().map(|(_, source)| source));
        one.into_iter().chain(inputs).chain(arguments)
    }

    /// Whether the line leaves no result that the next network uses: a load after it begins a rung.
    #[must_use]
    pub const fn ends_network(&self) -> bool {
        matches!(
            self.action,
            IlAction::Store { .. }
                | IlAction::Set(_)
                | IlAction::Reset(_)
                | IlAction::Jump { .. }
                | IlAction::Return(_)
                | IlAction::Call { .. }
        )
    }

    /// Whether the line replaces the current result without using it.
    #[must_use]
    pub fn is_load(&self) -> bool {
        match &self.action {
            IlAction::Load { .. } => true,
            IlAction::Function(call) => !call.arguments.contains(&IlSource::Result),
            _ => false,
        }
    }
}

impl fmt::Display for IlStep {
    /// Writes the line without its comment, also a call of several lines in one.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let label = self.label.as_ref().map(|label| format!("{label}:"));
        let text = self.text();
        let words: Vec<&str> = label.as_deref().into_iter().chain(text.split_whitespace()).collect();
        f.write_str(&words.join(" "))
    }
}

impl IlFunction {
    /// Returns the function with this name, in capitals, if it is a standard one.
    pub(super) fn from_name(name: &str) -> Option<IlFunction> {
        Some(match name {
            "ABS" => IlFunction::Absolute,
            "MOVE" => IlFunction::Move,
            "MAX" => IlFunction::Maximum,
            "MIN" => IlFunction::Minimum,
            "LIMIT" => IlFunction::Limit,
            "SEL" => IlFunction::Select,
            "MUX" => IlFunction::Multiplex,
            "SHL" => IlFunction::ShiftLeft,
            "SHR" => IlFunction::ShiftRight,
            "ROL" => IlFunction::RotateLeft,
            "ROR" => IlFunction::RotateRight,
            _ if name.contains("_TO_") => IlFunction::Convert,
            _ => IlFunction::Operator(
                IlBinaryOperator::ALL.iter().find(|(_, keyword)| *keyword == name).map(|(operator, _)| *operator)?,
            ),
        })
    }
}

/// Error: a duration that no timer can count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum DurationError {
    /// It has a fraction of a millisecond.
    #[error("it is not a whole number of milliseconds")]
    Fraction,
    /// It needs more than 32 bits.
    #[error("it is longer than 2147483647 ms (24 days)")]
    TooLong,
}

/// Returns a duration as a program holds it: whole milliseconds in 32 bits with a sign.
///
/// # Errors
/// The duration has a fraction of a millisecond or is too long.
pub(super) fn milliseconds(nanoseconds: i64) -> Result<i64, DurationError> {
    const PER_MS: i64 = 1_000_000;
    if nanoseconds % PER_MS != 0 {
        return Err(DurationError::Fraction);
    }
    let ms = nanoseconds / PER_MS;
    i32::try_from(ms).map(i64::from).map_err(|_| DurationError::TooLong)
}
