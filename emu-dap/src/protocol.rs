//! What goes over the wire: requests in, errors out, and the arguments of requests.

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

/// A request that was not carried out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RequestError {
    /// A number by which programs tell reasons apart, as `docs/dap.md` lists them.
    pub id: u32,
    /// The sentence for people.
    pub text: String,
    /// It is worth a window of its own: the user did something that cannot work, not the editor.
    pub show_user: bool,
}

/// The message is no request, or one without sense.
pub const MALFORMED: u32 = 1000;
/// There is no such request.
pub const UNKNOWN: u32 = 1001;
/// The request came before `initialize` or `launch`, or twice, or behind the end.
pub const TOO_EARLY: u32 = 1002;
/// The machine runs, and the request wants it to stand.
pub const RUNNING: u32 = 1003;
/// The arguments do not have the shape that the protocol wants.
pub const ARGUMENTS: u32 = 1004;
/// The program cannot be debugged.
pub const LAUNCH: u32 = 2000;
/// There is no such thing: a place, a symbol, a frame.
pub const NOT_FOUND: u32 = 2001;
/// The machine cannot do that.
pub const NOT_POSSIBLE: u32 = 2002;

impl RequestError {
    /// With its number and its sentence.
    pub fn new(id: u32, text: impl ToString) -> RequestError {
        RequestError { id, text: text.to_string(), show_user: false }
    }

    /// There is no such thing.
    pub fn not_found(text: impl ToString) -> RequestError {
        RequestError::new(NOT_FOUND, text)
    }

    /// The machine cannot do that.
    pub fn not_possible(text: impl ToString) -> RequestError {
        RequestError::new(NOT_POSSIBLE, text)
    }

    /// As one that the user is shown.
    #[must_use]
    pub fn shown_to_user(self) -> RequestError {
        RequestError { show_user: true, ..self }
    }

    /// The short form that programs look for, else the sentence.
    pub fn message(&self) -> &str {
        if self.id == RUNNING { "notStopped" } else { &self.text }
    }

    /// The body of the response. Braces in a format are names of variables, so a sentence that has some is one.
    pub fn body(&self) -> Value {
        let mut error = json!({ "id": self.id, "format": self.text, "showUser": self.show_user });
        if self.text.contains(['{', '}']) {
            error["format"] = "{text}".into();
            error["variables"] = json!({ "text": self.text });
        }
        json!({ "error": error })
    }
}

/// A request, as far as it can be told apart.
#[derive(Debug, Clone, PartialEq)]
pub struct DapRequest {
    /// Its number, for the response.
    pub seq: i64,
    /// What is wanted.
    pub command: String,
    /// With what.
    pub arguments: Value,
}

/// A message that is no request.
#[derive(Debug)]
pub struct RejectedMessage {
    /// Its number for the response, 0 without one.
    pub seq: i64,
    /// Its command for the response, empty without one.
    pub command: String,
    /// What is wrong with it.
    pub error: RequestError,
}

impl DapRequest {
    /// Reads one.
    ///
    /// # Errors
    /// It is none.
    pub fn parse(message: &Value) -> Result<DapRequest, RejectedMessage> {
        let seq = message.get("seq").and_then(Value::as_i64);
        let command = message.get("command").and_then(Value::as_str);
        let told = |text: String| RejectedMessage {
            seq: seq.unwrap_or(0),
            command: command.unwrap_or("").to_owned(),
            error: RequestError::new(MALFORMED, text),
        };
        let Some(fields) = message.as_object() else { return Err(told("a message is an object".to_owned())) };
        match fields.get("type").and_then(Value::as_str) {
            Some("request") => {}
            Some(other) => return Err(told(format!("this side takes requests, not messages of type `{other}`"))),
            None => return Err(told("the message has no type".to_owned())),
        }
        let Some(number) = seq else { return Err(told("seq of a request is a whole number".to_owned())) };
        let Some(name) = command else { return Err(told("command of a request is a text".to_owned())) };
        let arguments = fields.get("arguments").cloned().unwrap_or(Value::Null);
        Ok(DapRequest { seq: number, command: name.to_owned(), arguments })
    }

    /// Its arguments, in their shape.
    ///
    /// # Errors
    /// They do not have it.
    pub fn parse_arguments<T: DeserializeOwned>(&self) -> Result<T, RequestError> {
        let given = match &self.arguments {
            Value::Null => Value::Object(Map::new()),
            given => given.clone(),
        };
        serde_json::from_value(given)
            .map_err(|why| RequestError::new(ARGUMENTS, format!("arguments of {}: {why}", self.command)))
    }
}

/// What a program is debugged with: the arguments of `launch`.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct LaunchArguments {
    /// The image (HEX, ELF), or a ladder program or assembly source, which is made into one.
    pub program: String,
    /// The chip; may be missing where `program` tells it.
    pub mcu: Option<String>,
    /// Stands before the first instruction, instead of running at once.
    pub stop_on_entry: bool,
    /// The map of a compiled ladder program.
    pub map: Option<String>,
    /// The ladder program that the image was compiled from.
    pub ladder: Option<String>,
    /// Files of symbols.
    pub symbols: Vec<String>,
    /// The oscillator, as `16MHz`.
    pub clock: Option<String>,
    /// Bytes that copies for going back may take, as `64MB`.
    pub history: Option<String>,
    /// More flags of `emu debug`, as they are typed.
    pub args: Vec<String>,
    /// The program runs without the debugger's stops.
    pub no_debug: bool,
}

/// Where a breakpoint is to be in a source.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct DapSource {
    /// Name without folders.
    pub name: Option<String>,
    /// Path.
    pub path: Option<String>,
    /// Number of a source that this side has made; 0 is none.
    pub source_reference: Option<i64>,
}

/// A breakpoint as the client wants it. Which field counts hangs on the request.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct RequestedBreakpoint {
    /// `setBreakpoints`: the line.
    pub line: i64,
    /// `setFunctionBreakpoints`: the name.
    pub name: String,
    /// `setInstructionBreakpoints`: the address.
    pub instruction_reference: String,
    /// Added to it.
    pub offset: Option<i64>,
    /// `setDataBreakpoints`: what `dataBreakpointInfo` has called it.
    pub data_id: String,
    /// `read`, `write` or `readWrite`.
    pub access_type: Option<String>,
    /// Stops only where this is not 0.
    pub condition: Option<String>,
    /// Stops only at these hits.
    pub hit_condition: Option<String>,
    /// Tells this instead of stopping.
    pub log_message: Option<String>,
}

/// `setBreakpoints` and its kin.
#[derive(Debug, Clone, Default, PartialEq, Eq, Deserialize)]
#[serde(default)]
pub struct SetBreakpoints {
    /// Of `setBreakpoints`.
    pub source: DapSource,
    /// All that are to be there from now on.
    pub breakpoints: Vec<RequestedBreakpoint>,
}
