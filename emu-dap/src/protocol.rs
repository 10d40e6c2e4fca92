//! The messages of the protocol: requests, their arguments, and errors.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

/// The error of a request that failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequestError {
    /// Error number for programs; `docs/dap.md` lists them.
    pub id: u32,
    /// Error message for the user.
    pub text: String,
    /// True if the client shall show the error to the user, because the user, not the editor, has caused it.
    pub show_user: bool,
}

/// The message is not a valid request.
pub const MALFORMED: u32 = 1000;
/// The request does not exist.
pub const UNKNOWN: u32 = 1001;
/// The request came before `initialize` or `launch`, twice, or after the end.
pub const TOO_EARLY: u32 = 1002;
/// The request needs a stopped machine, but it runs.
pub const RUNNING: u32 = 1003;
/// The arguments do not have the required form.
pub const ARGUMENTS: u32 = 1004;
/// The program cannot be debugged.
pub const LAUNCH: u32 = 2000;
/// The place, symbol or frame does not exist.
pub const NOT_FOUND: u32 = 2001;
/// The machine does not support the request.
pub const NOT_POSSIBLE: u32 = 2002;

impl RequestError {
    /// An error with its number and message.
    pub fn new(id: u32, text: impl ToString) -> RequestError {
        RequestError { id, text: text.to_string(), show_user: false }
    }

    /// An error for something that does not exist.
    pub fn not_found(text: impl ToString) -> RequestError {
        RequestError::new(NOT_FOUND, text)
    }

    /// An error for something that the machine does not support.
    pub fn not_possible(text: impl ToString) -> RequestError {
        RequestError::new(NOT_POSSIBLE, text)
    }

    /// Marks the error to be shown to the user.
    #[must_use]
    pub fn shown_to_user(self) -> RequestError {
        RequestError { show_user: true, ..self }
    }

    /// The short message that clients look for (`notStopped`), or else the message for the user.
    pub fn message(&self) -> &str {
        if self.id == RUNNING { "notStopped" } else { &self.text }
    }

    /// The body of the response. Braces in a format are variables, so a message with braces is passed as a
    /// variable.
    pub fn body(&self) -> Value {
        let mut error = json!({ "id": self.id, "format": self.text, "showUser": self.show_user });
        if self.text.contains(['{', '}']) {
            error["format"] = "{text}".into();
            error["variables"] = json!({ "text": self.text });
        }
        json!({ "error": error })
    }
}

/// A request with undecoded arguments.
#[derive(Debug, Clone, PartialEq)]
pub struct DapRequest {
    /// Sequence number, for the response.
    pub seq: i64,
    /// Name of the request.
    pub command: String,
    /// Arguments of the request.
    pub arguments: Value,
}

/// A message that is not a valid request.
#[derive(Debug)]
pub struct RejectedMessage {
    /// Its number for the response; 0 if it has none.
    pub seq: i64,
    /// Its command for the response; empty if it has none.
    pub command: String,
    /// What is wrong with it.
    pub error: RequestError,
}

impl DapRequest {
    /// Parses a request.
    ///
    /// # Errors
    /// The message is not a request.
    pub fn parse(message: &Value) -> Result<DapRequest, RejectedMessage> {
        let seq = message.get("seq").and_then(Value::as_i64);
        let command = message.get("command").and_then(Value::as_str);
        let rejected = |text: String| RejectedMessage {
            seq: seq.unwrap_or(0),
            command: command.unwrap_or("").to_owned(),
            error: RequestError::new(MALFORMED, text),
        };
        let Some(fields) = message.as_object() else { return Err(rejected("a message must be an object".to_owned())) };
        match fields.get("type").and_then(Value::as_str) {
            Some("request") => {}
            Some(other) => return Err(rejected(format!("only requests are accepted, not messages of type `{other}`"))),
            None => return Err(rejected("the message has no type".to_owned())),
        }
        let Some(number) = seq else { return Err(rejected("seq of a request must be an integer".to_owned())) };
        let Some(name) = command else { return Err(rejected("command of a request must be a string".to_owned())) };
        let arguments = fields.get("arguments").cloned().unwrap_or(Value::Null);
        Ok(DapRequest { seq: number, command: name.to_owned(), arguments })
    }

    /// Decodes the arguments.
    ///
    /// # Errors
    /// The arguments do not have the required form.
    pub fn parse_arguments<T: DeserializeOwned>(&self) -> Result<T, RequestError> {
        let given = match &self.arguments {
            Value::Null => Value::Object(Map::new()),
            given => given.clone(),
        };
        serde_json::from_value(given)
            .map_err(|why| RequestError::new(ARGUMENTS, format!("arguments of {}: {why}", self.command)))
    }
}

/// The arguments of `launch`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct LaunchArguments {
    /// The image (HEX, ELF), or a ladder program or an assembly source from which an image is made.
    pub program: String,
    /// The chip; optional if `program` determines it.
    pub mcu: Option<String>,
    /// Whether the machine stops before the first instruction instead of running at once.
    pub stop_on_entry: bool,
    /// The map of a compiled ladder program.
    pub map: Option<String>,
    /// The ladder program that the image was compiled from.
    pub ladder: Option<String>,
    /// Symbol files.
    pub symbols: Vec<String>,
    /// Oscillator frequency, such as `16MHz`.
    pub clock: Option<String>,
    /// Maximum memory for the history, such as `64MB`.
    pub history: Option<String>,
    /// Further options of `emu debug`, as on the command line.
    pub args: Vec<String>,
    /// Whether the program runs without breakpoints.
    pub no_debug: bool,
}

/// A source in a request.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct DapSource {
    /// Name without folders.
    pub name: Option<String>,
    /// Path of the file.
    pub path: Option<String>,
    /// Reference of a source made by this adapter; 0 means none.
    pub source_reference: Option<i64>,
}

/// A breakpoint as requested by the client. The request determines which fields apply.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct RequestedBreakpoint {
    /// The line, in `setBreakpoints`.
    pub line: i64,
    /// The name, in `setFunctionBreakpoints`.
    pub name: String,
    /// The address, in `setInstructionBreakpoints`.
    pub instruction_reference: String,
    /// Offset of the address.
    pub offset: Option<i64>,
    /// The id from `dataBreakpointInfo`, in `setDataBreakpoints`.
    pub data_id: String,
    /// `read`, `write` or `readWrite`.
    pub access_type: Option<String>,
    /// The breakpoint only stops if this expression is not 0.
    pub condition: Option<String>,
    /// The breakpoint only stops at these hits.
    pub hit_condition: Option<String>,
    /// The message that is logged instead of stopping.
    pub log_message: Option<String>,
}

/// The arguments of `setBreakpoints` and similar requests.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(default)]
pub struct SetBreakpoints {
    /// The source, in `setBreakpoints`.
    pub source: DapSource,
    /// All breakpoints of the group, which replace the previous ones.
    pub breakpoints: Vec<RequestedBreakpoint>,
}
