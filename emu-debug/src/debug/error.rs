//! Errors of expressions and assignments in the debugger.

use crate::InputError;

/// Why an expression cannot be read or a value cannot be set. `Display` is the cause, one sentence without a
/// full stop.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DebugError {
    /// A name, an address or a text cannot be read, or the machine does not accept a drive.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Text follows the end of an expression.
    #[error("`{text}`: unexpected `{rest}` after the expression")]
    TrailingText {
        /// The text after the expression.
        rest: String,
        /// The whole text.
        text: String,
    },
    /// An expression is nested too deeply.
    #[error("the expression is nested too deeply")]
    NestedTooDeeply,
    /// An expression has too many operators.
    #[error("the expression has more than {most} operators")]
    TooManyOperators {
        /// The maximum number.
        most: u32,
    },
    /// A closing bracket or quote is missing.
    #[error("a {sign} is missing in `{text}`")]
    MissingSign {
        /// The missing sign.
        sign: &'static str,
        /// The expression.
        text: String,
    },
    /// An operand is missing.
    #[error("`{text}`: expected a number or a name, found {found}")]
    MissingOperand {
        /// The expression.
        text: String,
        /// The character that was found.
        found: String,
    },
    /// A text in single quotes is not one byte.
    #[error("'{text}' is not one byte")]
    NotOneByte {
        /// The text.
        text: String,
    },
    /// A function of the program is called.
    #[error(
        "the debugger calls no functions of the program: that would change the machine; set a breakpoint in it, or \
         `jump` there"
    )]
    Call,
    /// Something other than a function is called.
    #[error("`{text}` is not a function")]
    NotAFunction {
        /// The expression.
        text: String,
    },
    /// A dot is not followed by a bit number.
    #[error("a bit number is missing after the . in `{text}`")]
    MissingBitNumber {
        /// The expression.
        text: String,
    },
    /// The value has fewer bits.
    #[error("`{name}` has no bit {bit}: its bits are 0 to {most}")]
    NoSuchBit {
        /// The value.
        name: String,
        /// The number of the bit.
        bit: u8,
        /// The number of the highest bit.
        most: u8,
    },
    /// The operand of `&` has no address.
    #[error("{}has no address", .text.as_ref().map_or("it ".to_owned(), |text| format!("`{text}` ")))]
    NoAddress {
        /// The operand, if its text is known.
        text: Option<String>,
    },
    /// No type has this name.
    #[error("there is no type `{text}`")]
    UnknownType {
        /// The name.
        text: String,
    },
    /// No struct, union or enumeration has this tag.
    #[error("No {keyword} type named {name}.")]
    UnknownTag {
        /// `struct`, `union` or `enum`.
        keyword: String,
        /// The tag.
        name: String,
    },
    /// The size of a type is not in the debugging information.
    #[error("the size of {what} is unknown")]
    UnknownSize {
        /// What has the type.
        what: &'static str,
    },
    /// The operand of `sizeof` has no size.
    #[error("it has no size")]
    NoSize,
    /// A file has no such variable.
    #[error("there is no variable `{name}` in {file}")]
    UnknownFileVariable {
        /// The variable.
        name: String,
        /// The file.
        file: String,
    },
    /// No symbol has this name at the program's location.
    #[error("No symbol \"{name}\" in current context.")]
    UnknownSymbolHere {
        /// The name.
        name: String,
    },
    /// A name with `$` is not known to the debugger.
    #[error("there is no `{name}`; `info registers` lists registers")]
    UnknownDebuggerName {
        /// The name, with its `$`.
        name: String,
    },
    /// `*` or an index is applied to something without elements.
    #[error("`{type_name}` is neither a pointer nor an array")]
    NotAPointer {
        /// The type of the operand.
        type_name: String,
    },
    /// An index is applied to a number.
    #[error("only memory has elements")]
    NoElements,
    /// An element is beyond the last address.
    #[error("that index is too large")]
    IndexTooLarge,
    /// A member of something without members.
    #[error("there is no member `{name}`: its type is {type_name}")]
    NoMembers {
        /// The member.
        name: String,
        /// The type.
        type_name: String,
    },
    /// A struct or union has no such member.
    #[error("{type_name} has no member `{name}`; it has {}", .known.join(", "))]
    UnknownMember {
        /// The type.
        type_name: String,
        /// The member.
        name: String,
        /// The members that it has.
        known: Vec<String>,
    },
    /// A member is beyond the last address.
    #[error("that member is too far away")]
    MemberTooFar,
    /// An entry of the value history is a sequence of objects.
    #[error(
        "`{name}` is a sequence of objects, which the history does not keep; print the first object and the count again"
    )]
    RowInHistory {
        /// The name of the entry.
        name: String,
    },
    /// The value history has no entries.
    #[error("`{name}`: the value history is empty; print fills it")]
    EmptyHistory {
        /// The name of the entry.
        name: String,
    },
    /// The value history has no such entry.
    #[error("the value history has no `{name}`; it has $1 to ${count}")]
    NotInHistory {
        /// The name of the entry.
        name: String,
        /// Number of entries.
        count: usize,
    },
    /// Accesses to a symbol of the ladder program are not reported.
    #[error("`{name}` is kept in {space}:0x{addr:x}; {source}")]
    SymbolNotWatched {
        /// The symbol.
        name: String,
        /// Its memory.
        space: &'static str,
        /// Its address.
        addr: u32,
        /// The reason.
        source: Box<InputError>,
    },
    /// A single value is assigned to a struct, union or array.
    #[error("{what} cannot be set as a whole; set its {parts}")]
    NoSingleValue {
        /// What it is assigned to, such as `an array`.
        what: String,
        /// What can be set: `members` or `elements`.
        parts: &'static str,
    },
    /// A value is assigned to a function.
    #[error("a function cannot be set")]
    FunctionNotSettable,
    /// A value does not fit its location.
    #[error("{value} does not fit: the range is {least} to {most}")]
    ValueOutOfRange {
        /// The value.
        value: i64,
        /// The lowest allowed value.
        least: i64,
        /// The highest allowed value.
        most: i64,
    },
    /// The compiler has kept no location for a variable here.
    #[error("the compiler has optimized it away, so it cannot be set")]
    OptimizedAway,
    /// A value is in no memory.
    #[error("it is not in memory")]
    InNoMemory,
    /// A value is assigned to the cycle or the number of instructions.
    #[error("time cannot be set; run-to-cycle and goto-cycle go there")]
    TimeNotSettable,
    /// The machine has no such register, byte or bit.
    #[error("the machine has no such place")]
    NoSuchPlace,
    /// An address within a word is assigned to the program counter.
    #[error("0x{addr:x} is not the start of a word; program addresses are even")]
    WithinWord {
        /// The address.
        addr: u32,
    },
    /// A value is assigned to an expression that is not a location.
    #[error("it cannot be set")]
    NotAPlace,
    /// A snapshot of a machine with devices is requested.
    #[error("a snapshot does not contain the state of the devices at its pins")]
    DevicesHaveState,
}

/// The command line reports errors as texts.
impl From<DebugError> for String {
    fn from(error: DebugError) -> String {
        error.to_string()
    }
}
