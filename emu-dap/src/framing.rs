//! The framing of messages: a header with `Content-Length`, an empty line, and that many bytes of JSON.

use std::io::{self, BufRead, Read, Write};

use serde_json::Value;

use crate::error::DapError;

/// Maximum message length in bytes, so that a wrong number does not use up all memory.
pub const MAX_MESSAGE_BYTES: u64 = 16 << 20;

/// Maximum length of a header line in bytes.
const MAX_HEADER_LINE: u64 = 4096;

/// Maximum number of header lines.
const MAX_HEADER_LINES: usize = 64;

/// The result of reading a message.
#[derive(Debug)]
pub enum IncomingMessage {
    /// A message.
    Message(Value),
    /// A frame whose content is not valid JSON, with the reason. The next frame may be valid.
    Garbled(String),
    /// The end of the input between two frames, or of the connection.
    End,
}

/// Reads the next message.
///
/// # Errors
/// The input cannot be read, or it has no frame, so that the start of the next message is unknown.
pub fn read_message(input: &mut impl BufRead) -> Result<IncomingMessage, DapError> {
    let Some(length) = read_header(input)? else { return Ok(IncomingMessage::End) };
    let mut body = Vec::new();
    let got = match input.take(length).read_to_end(&mut body) {
        Ok(got) => got,
        Err(why) if is_disconnect(&why) => return Ok(IncomingMessage::End),
        Err(why) => return Err(DapError::UnreadableInput(why)),
    };
    if (got as u64) < length {
        return Err(DapError::TruncatedMessage { got, length });
    }
    Ok(match serde_json::from_slice(&body) {
        Ok(message) => IncomingMessage::Message(message),
        Err(why) => IncomingMessage::Garbled(format!("the message is not JSON: {why}")),
    })
}

/// Reads a header; returns the length of the content, or `None` at the end of the input.
fn read_header(input: &mut impl BufRead) -> Result<Option<u64>, DapError> {
    let mut length = None;
    for number in 0.. {
        let mut line = Vec::new();
        match input.take(MAX_HEADER_LINE).read_until(b'\n', &mut line) {
            Ok(0) if number == 0 => return Ok(None),
            Err(why) if is_disconnect(&why) => return Ok(None),
            read => _ = read.map_err(DapError::UnreadableInput)?,
        }
        if !line.ends_with(b"\n") || number >= MAX_HEADER_LINES {
            return Err(DapError::NotFramed);
        }
        let line = String::from_utf8_lossy(&line);
        let line = line.trim();
        if line.is_empty() {
            break;
        }
        let (name, value) = line.split_once(':').ok_or_else(|| DapError::BadHeaderLine { line: shortened(line) })?;
        if name.trim().eq_ignore_ascii_case("content-length") {
            let wanted = || DapError::BadLength { text: shortened(value.trim()) };
            let digits = value.trim().bytes().all(|byte| byte.is_ascii_digit());
            let bytes: u64 = value.trim().parse().ok().filter(|_| digits).ok_or_else(wanted)?;
            if bytes > MAX_MESSAGE_BYTES {
                return Err(DapError::MessageTooLong { length: bytes });
            }
            length = Some(bytes);
        }
    }
    length.map(Some).ok_or(DapError::NoContentLength)
}

/// True if the error means that the other side has closed or lost the connection.
pub fn is_disconnect(why: &io::Error) -> bool {
    use io::ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset};
    matches!(why.kind(), BrokenPipe | ConnectionAborted | ConnectionReset)
}

/// The beginning of a text, for messages.
fn shortened(text: &str) -> String {
    let short: String = text.chars().take(40).collect();
    if short.len() < text.len() { format!("{short}..") } else { short }
}

/// Writes a message.
///
/// # Errors
/// The output cannot be written.
pub fn write_message(output: &mut dyn Write, message: &Value) -> io::Result<()> {
    let text = message.to_string();
    write!(output, "Content-Length: {}\r\n\r\n{text}", text.len())?;
    output.flush()
}
