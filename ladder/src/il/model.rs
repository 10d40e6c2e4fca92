//! The model of a program in Instruction List.

use diag::Pos;

use super::types::{DirectAddress, IecType, IlLiteral, StandardBlock};

/// A program in Instruction List: one PROGRAM, or a list of instructions without a head.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct IlProgram {
    /// Name of the file, as the user gave it.
    pub file: String,
    /// Name after PROGRAM, if the text has that line.
    pub name: Option<IlName>,
    /// Comments before PROGRAM and between variables, a line each.
    pub remarks: Vec<String>,
    /// Variables in the order of their declaration.
    pub variables: Vec<IlVariable>,
    /// Lines of the body in their order.
    pub instructions: Vec<IlInstruction>,
}

/// A name and its position. Names of IEC 61131-3 are equal if they differ only in case.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct IlName {
    /// The name as the program writes it.
    pub text: String,
    /// Position in the file.
    pub pos: Pos,
}

impl IlName {
    /// Whether the names are equal: case is ignored (IEC 61131-3, 2.1.2).
    #[must_use]
    pub fn matches(&self, other: &str) -> bool {
        self.text.eq_ignore_ascii_case(other)
    }
}

/// Section in which a variable is declared (IEC 61131-3, 2.4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IlSection {
    /// VAR.
    Local,
    /// VAR_INPUT: the program may only read it.
    Input,
    /// VAR_OUTPUT.
    Output,
    /// VAR_IN_OUT.
    InOut,
    /// VAR_GLOBAL.
    Global,
    /// VAR_TEMP.
    Temporary,
}

impl IlSection {
    /// All sections with their keywords.
    pub const ALL: [(IlSection, &'static str); 6] = [
        (IlSection::Local, "VAR"),
        (IlSection::Input, "VAR_INPUT"),
        (IlSection::Output, "VAR_OUTPUT"),
        (IlSection::InOut, "VAR_IN_OUT"),
        (IlSection::Global, "VAR_GLOBAL"),
        (IlSection::Temporary, "VAR_TEMP"),
    ];

    /// Returns the keyword that begins the section.
    #[must_use]
    pub fn keyword(self) -> &'static str {
        Self::ALL.iter().find(|(section, _)| *section == self).map_or("VAR", |(_, keyword)| keyword)
    }
}

/// Qualifier of a section (IEC 61131-3, 2.4.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IlQualifier {
    /// RETAIN: the value survives a loss of power.
    Retain,
    /// CONSTANT: the program must not write it.
    Constant,
}

/// A declared variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IlVariable {
    /// Name.
    pub name: IlName,
    /// Section.
    pub section: IlSection,
    /// RETAIN or CONSTANT, if the section has it. NON_RETAIN is the default.
    pub qualifier: Option<IlQualifier>,
    /// Type.
    pub iec_type: IecType,
    /// Address after AT.
    pub address: Option<DirectAddress>,
    /// Initial value. Without one a variable begins with 0, FALSE or T#0s.
    pub initial: Option<IlLiteral>,
    /// Comment on the line of the declaration.
    pub comment: Option<String>,
}

/// A line of the body: a label, an operation and a comment, each optional, at least one of them present.
/// Blank lines are not kept.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct IlInstruction {
    /// Label before the operation or alone on the line (reference 001: a letter first, at most 16
    /// characters).
    pub label: Option<IlName>,
    /// Operation; `None` for a line that has only a label or a comment.
    pub operation: Option<IlOperation>,
    /// Comment, in one line.
    pub comment: Option<String>,
    /// Position of the operator, or of the label if there is no operation.
    pub pos: Pos,
}

/// When JMP, CAL and RET act (modifiers C and N of reference 001; IEC 61131-3, table 51).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IlCondition {
    /// No modifier: always.
    Always,
    /// `C`: if the current result is TRUE.
    IfTrue,
    /// `CN`: if the current result is FALSE.
    IfFalse,
}

impl IlCondition {
    /// Returns the modifier: nothing, `C` or `CN`.
    #[must_use]
    pub const fn modifier(self) -> &'static str {
        match self {
            IlCondition::Always => "",
            IlCondition::IfTrue => "C",
            IlCondition::IfFalse => "CN",
        }
    }
}

/// An operator that combines the current result with an operand (IEC 61131-3, table 52).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IlBinaryOperator {
    /// AND, also written `&`: conjunction, bit by bit.
    And,
    /// OR: disjunction, bit by bit.
    Or,
    /// XOR: exclusive disjunction, bit by bit.
    Xor,
    /// ADD: sum.
    Add,
    /// SUB: current result minus operand.
    Sub,
    /// MUL: product.
    Mul,
    /// DIV: current result divided by operand.
    Div,
    /// MOD: remainder of the division.
    Mod,
    /// GT: whether the current result is greater.
    Gt,
    /// GE: whether it is greater or equal.
    Ge,
    /// EQ: whether both are equal.
    Eq,
    /// NE: whether they differ.
    Ne,
    /// LE: whether the current result is less or equal.
    Le,
    /// LT: whether it is less.
    Lt,
}

impl IlBinaryOperator {
    /// All operators with their keywords. `&` is another spelling of AND.
    pub const ALL: [(IlBinaryOperator, &'static str); 14] = [
        (IlBinaryOperator::And, "AND"),
        (IlBinaryOperator::Or, "OR"),
        (IlBinaryOperator::Xor, "XOR"),
        (IlBinaryOperator::Add, "ADD"),
        (IlBinaryOperator::Sub, "SUB"),
        (IlBinaryOperator::Mul, "MUL"),
        (IlBinaryOperator::Div, "DIV"),
        (IlBinaryOperator::Mod, "MOD"),
        (IlBinaryOperator::Gt, "GT"),
        (IlBinaryOperator::Ge, "GE"),
        (IlBinaryOperator::Eq, "EQ"),
        (IlBinaryOperator::Ne, "NE"),
        (IlBinaryOperator::Le, "LE"),
        (IlBinaryOperator::Lt, "LT"),
    ];

    /// Returns the keyword.
    #[must_use]
    pub fn keyword(self) -> &'static str {
        Self::ALL.iter().find(|(operator, _)| *operator == self).map_or("AND", |(_, keyword)| keyword)
    }

    /// Whether the operator has the modifier N: AND, OR and XOR.
    #[must_use]
    pub const fn is_logic(self) -> bool {
        matches!(self, IlBinaryOperator::And | IlBinaryOperator::Or | IlBinaryOperator::Xor)
    }

    /// Whether the operator compares, so that its result is BOOL.
    #[must_use]
    pub const fn is_comparison(self) -> bool {
        matches!(
            self,
            IlBinaryOperator::Gt
                | IlBinaryOperator::Ge
                | IlBinaryOperator::Eq
                | IlBinaryOperator::Ne
                | IlBinaryOperator::Le
                | IlBinaryOperator::Lt
        )
    }
}

/// What follows a binary operator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IlBinaryOperand {
    /// `AND x`.
    Value(IlOperand),
    /// `AND(` or `AND( x`: the operator waits for the matching `)`. With an operand, x is loaded.
    Deferred(Option<IlOperand>),
}

/// An input operator of a standard block (IEC 61131-3, table 54): `CU C1` stores the current result in
/// `C1.CU` and calls C1. The inputs S, R and LD have the operators of the same names; the type of the operand
/// decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IlBlockInput {
    /// S1: the dominant set input of SR.
    S1,
    /// R1: the dominant reset input of RS.
    R1,
    /// CLK: the input of edge detectors.
    Clk,
    /// CU: counts up.
    Cu,
    /// CD: counts down.
    Cd,
    /// PV: the preset of counters.
    Pv,
    /// IN: the input of timers.
    In,
    /// PT: the delay of timers.
    Pt,
}

impl IlBlockInput {
    /// All input operators with their keywords.
    pub const ALL: [(IlBlockInput, &'static str); 8] = [
        (IlBlockInput::S1, "S1"),
        (IlBlockInput::R1, "R1"),
        (IlBlockInput::Clk, "CLK"),
        (IlBlockInput::Cu, "CU"),
        (IlBlockInput::Cd, "CD"),
        (IlBlockInput::Pv, "PV"),
        (IlBlockInput::In, "IN"),
        (IlBlockInput::Pt, "PT"),
    ];

    /// Returns the keyword, which is the name of the input.
    #[must_use]
    pub fn keyword(self) -> &'static str {
        Self::ALL.iter().find(|(input, _)| *input == self).map_or("IN", |(_, keyword)| keyword)
    }
}

/// An operation on the current result (IEC 61131-3, 3.2.2; reference 001, table 1).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IlOperation {
    /// LD, LDN: loads the operand or its complement.
    Load {
        /// Modifier N.
        negated: bool,
        /// What is loaded.
        operand: IlOperand,
    },
    /// ST, STN: stores the current result or its complement. The current result keeps its value.
    Store {
        /// Modifier N.
        negated: bool,
        /// A variable or an address.
        target: IlOperand,
    },
    /// S: sets the operand if the current result is TRUE.
    Set(IlOperand),
    /// R: resets the operand if the current result is TRUE.
    Reset(IlOperand),
    /// S or R without an operand. The grammar of the standard (annex B.2.1) allows it; it does nothing.
    NoTarget {
        /// Operator: `S` or `R`.
        operator: &'static str,
    },
    /// NOT: complements the current result.
    Not,
    /// AND to LT: current result := current result operator operand.
    Binary {
        /// Operator.
        operator: IlBinaryOperator,
        /// Modifier N: complements the operand, or the result of the parentheses.
        negated: bool,
        /// Operand, or the modifier `(`.
        operand: IlBinaryOperand,
    },
    /// `)`: executes the operation that waits.
    Close,
    /// JMP, JMPC, JMPCN.
    Jump {
        /// Modifier.
        condition: IlCondition,
        /// Label.
        label: IlName,
    },
    /// CAL, CALC, CALCN: calls an instance of a function block.
    Call {
        /// Modifier.
        condition: IlCondition,
        /// Instance.
        instance: IlName,
        /// Parameters between the parentheses.
        parameters: Vec<IlParameter>,
    },
    /// RET, RETC, RETCN: leaves the program, function or block.
    Return(IlCondition),
    /// `CU C1`: sets an input of an instance and calls it.
    BlockInput {
        /// Input.
        input: IlBlockInput,
        /// Instance.
        instance: IlName,
    },
    /// `TON T1,100` of reference 001: calls a timer or counter with the current result as its input. A number
    /// without type is in milliseconds for timers.
    ShortBlock {
        /// Block.
        block: StandardBlock,
        /// Instance.
        instance: IlName,
        /// Preset: PT of timers, PV of counters.
        preset: IlOperand,
    },
    /// `ADD a, b` or `LIMIT(MN := 0, IN := x, MX := 9)`: calls a function (IEC 61131-3, 3.2.3). Without
    /// parentheses the current result is the first argument.
    Function {
        /// Name; in capitals if the function is a standard one.
        name: IlName,
        /// Whether the arguments are between parentheses.
        parenthesized: bool,
        /// Arguments; only positional ones without parentheses.
        arguments: Vec<IlParameter>,
    },
}

/// A parameter of CAL or of a function.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IlParameter {
    /// `x`.
    Positional(IlOperand),
    /// `PT := x`.
    Input {
        /// Name of the input.
        name: IlName,
        /// Value.
        value: IlOperand,
    },
    /// `Q => x`, `NOT Q => x`.
    Output {
        /// Whether NOT precedes the name.
        negated: bool,
        /// Name of the output.
        name: IlName,
        /// A variable or an address.
        target: IlOperand,
    },
}

/// An operand and its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IlOperand {
    /// The operand.
    pub kind: IlOperandKind,
    /// Position in the file.
    pub pos: Pos,
}

/// An operand without its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum IlOperandKind {
    /// `motor` or `timer.Q`.
    Variable {
        /// Variable or instance.
        name: String,
        /// Input or output of the instance.
        member: Option<String>,
    },
    /// `%IX0.3`.
    Address(DirectAddress),
    /// `TRUE`, `16#A5`, `T#500ms`.
    Literal(IlLiteral),
}

impl IlProgram {
    /// Returns the program with all positions and the name of the file cleared, to compare what two texts
    /// say.
    #[must_use]
    pub fn without_positions(mut self) -> Self {
        self.file.clear();
        self.name.iter_mut().for_each(|name| name.pos = Pos::default());
        self.variables.iter_mut().for_each(|variable| variable.name.pos = Pos::default());
        for instruction in &mut self.instructions {
            instruction.pos = Pos::default();
            instruction.label.iter_mut().for_each(|label| label.pos = Pos::default());
            if let Some(operation) = &mut instruction.operation {
                operation.clear_positions();
            }
        }
        self
    }

    /// Returns the variable with this name, in any case.
    #[must_use]
    pub fn variable(&self, name: &str) -> Option<&IlVariable> {
        self.variables.iter().find(|variable| variable.name.matches(name))
    }
}

impl IlOperation {
    /// Returns the operation with all positions cleared.
    #[must_use]
    pub fn without_positions(mut self) -> Self {
        self.clear_positions();
        self
    }

    fn clear_positions(&mut self) {
        self.for_each_position(&mut |pos| *pos = Pos::default());
    }

    /// Calls `each` for the position of every name and operand.
    pub(crate) fn for_each_position(&mut self, each: &mut dyn FnMut(&mut Pos)) {
        match self {
            IlOperation::Load { operand, .. }
            | IlOperation::Store { target: operand, .. }
            | IlOperation::Set(operand)
            | IlOperation::Reset(operand)
            | IlOperation::Binary {
                operand: IlBinaryOperand::Value(operand) | IlBinaryOperand::Deferred(Some(operand)),
                ..
            } => each(&mut operand.pos),
            IlOperation::Jump { label: name, .. } | IlOperation::BlockInput { instance: name, .. } => {
                each(&mut name.pos);
            }
            IlOperation::ShortBlock { instance, preset, .. } => {
                each(&mut instance.pos);
                each(&mut preset.pos);
            }
            IlOperation::Call { instance: name, parameters, .. }
            | IlOperation::Function { name, arguments: parameters, .. } => {
                each(&mut name.pos);
                parameters.iter_mut().for_each(|parameter| parameter.for_each_position(each));
            }
            IlOperation::NoTarget { .. }
            | IlOperation::Not
            | IlOperation::Close
            | IlOperation::Return(_)
            | IlOperation::Binary { .. } => {}
        }
    }
}

impl IlParameter {
    fn for_each_position(&mut self, each: &mut dyn FnMut(&mut Pos)) {
        match self {
            IlParameter::Positional(operand) => each(&mut operand.pos),
            IlParameter::Input { name, value: operand } | IlParameter::Output { name, target: operand, .. } => {
                each(&mut name.pos);
                each(&mut operand.pos);
            }
        }
    }
}

impl IlOperation {
    /// Whether the operation waits for a `)`.
    #[must_use]
    pub const fn is_opening(&self) -> bool {
        matches!(self, IlOperation::Binary { operand: IlBinaryOperand::Deferred(_), .. })
    }
}
