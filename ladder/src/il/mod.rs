//! Instruction List (IL) of IEC 61131-3, edition 2: its text, and its lines as elements of a ladder program.
//!
//! IL is the textual language of reference 001 (Lista de Instruções). A program is a list of lines; each has
//! an operator that works on the current result (the accumulator of reference 001). [`to_ladder`] makes a
//! ladder program of it. This module does not define what a program computes, and it knows no chip.
//!
//! ```
//! let text = "LD I1\nOR I2\nANDN I3\nST L\n"; // example 4 of reference 001
//! let program = ladder::il::read("lamp.il", text).expect("a sound program").program;
//! assert_eq!(program.instructions.len(), 4);
//! assert!(ladder::il::check(&program).is_empty());
//! let written = ladder::il::write(&program);
//! assert_eq!(ladder::il::write(&ladder::il::read("lamp.il", &written).unwrap().program), written);
//!
//! // A fault has a code, a position, a cause and a hint.
//! let faults = ladder::il::read("lamp.il", "LD I1\nANDM I2\n").unwrap_err();
//! assert_eq!((faults[0].code, faults[0].pos.line), ("IL020", 2));
//! ```

mod calls;
mod check;
mod codes;
mod declarations;
mod facts;
mod flow;
mod fragments;
mod functions;
mod implied;
mod instructions;
mod lexer;
mod links;
mod listing;
mod literals;
mod model;
mod network;
mod network_view;
mod operands;
mod operators;
mod reader;
mod reserved_words;
mod resolve;
mod steps;
mod symbols;
mod types;
mod write;

pub use check::{check, result_types};
pub use codes::IL_CODES;
pub(crate) use facts::instruction_facts;
pub use flow::ResultType;
pub(crate) use fragments::{
    address_of_text, declared_type, function_type, instructions_of_text, is_plain_name, is_standard_function,
    link_faults, literal_of_text, operand_of_text,
};
pub use functions::standard_functions;
pub(crate) use lexer::is_pragma;
pub use listing::program_text;
pub(crate) use listing::{listing, listings};
pub use model::{
    IlBinaryOperand, IlBinaryOperator, IlBlockInput, IlCondition, IlInstruction, IlName, IlOperand, IlOperandKind,
    IlOperation, IlParameter, IlProgram, IlQualifier, IlSection, IlVariable,
};
pub(crate) use network::bool_operand;
pub use network::{CoilKind, LadderBlock, LadderLogic, LadderNetwork, LadderOutput, LadderStage, instructions_of};
pub use network_view::{NoLadderForm, ladder_of};
pub(crate) use operators::is_operator;
pub use reader::{MAX_IL_DEPTH, MAX_IL_LINES, ParsedIlProgram, read};
pub(crate) use reserved_words::is_name;
pub use resolve::{ResolvedIlProgram, il_settings, to_ladder};
pub use steps::{
    BlockCall, BlockOutput, FunctionCall, IecVariable, IlAction, IlFunction, IlSource, IlStep, TypedSymbol,
};
pub use types::{AddressArea, AddressSize, BlockPart, DirectAddress, IecType, IlLiteral, IlValue, StandardBlock};
pub use write::{instruction_text, write};
