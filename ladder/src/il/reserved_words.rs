//! Keywords that cannot be names.

/// Words that name no variable, instance, function or parameter.
const RESERVED: [&str; 22] = [
    "TRUE",
    "FALSE",
    "NOT",
    "VAR",
    "VAR_INPUT",
    "VAR_OUTPUT",
    "VAR_IN_OUT",
    "VAR_GLOBAL",
    "VAR_TEMP",
    "VAR_EXTERNAL",
    "VAR_ACCESS",
    "VAR_CONFIG",
    "END_VAR",
    "PROGRAM",
    "END_PROGRAM",
    "FUNCTION",
    "END_FUNCTION",
    "FUNCTION_BLOCK",
    "END_FUNCTION_BLOCK",
    "RETAIN",
    "CONSTANT",
    "AT",
];

/// Whether the word is a keyword, in any case.
pub(super) fn is_reserved(word: &str) -> bool {
    RESERVED.iter().any(|reserved| reserved.eq_ignore_ascii_case(word))
}

/// Whether a text is a name of Instruction List: letters, digits and `_`, and no keyword.
pub(crate) fn is_name(text: &str) -> bool {
    crate::lexer::is_name(text) && !is_reserved(text)
}
