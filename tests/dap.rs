//! `emu dap` as an editor starts it: over standard input and output, and over TCP.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};

fn emu(args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emu"));
    command.arg("dap").args(args).current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples"));
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("emu starts")
}

fn send(to: &mut impl Write, seq: u32, command: &str, arguments: Value) {
    let text = json!({ "seq": seq, "type": "request", "command": command, "arguments": arguments }).to_string();
    write!(to, "Content-Length: {}\r\n\r\n{text}", text.len()).expect("the request is taken");
    to.flush().expect("the request is taken");
}

fn message(from: &mut impl BufRead) -> Option<Value> {
    let mut length = 0;
    loop {
        let mut line = String::new();
        from.read_line(&mut line).expect("a line");
        match line.trim_end().strip_prefix("Content-Length: ") {
            Some(bytes) => length = bytes.parse().expect("a length"),
            None if line.is_empty() => return None,
            None => break,
        }
    }
    let mut body = vec![0; length];
    from.read_exact(&mut body).expect("a body");
    Some(serde_json::from_slice(&body).expect("JSON"))
}

/// Reads messages up to an event, and returns its body.
fn event(from: &mut impl BufRead, name: &str) -> Value {
    while let Some(message) = message(from) {
        assert_ne!(message["success"], false, "{message}");
        if message["event"] == name {
            return message["body"].clone();
        }
    }
    panic!("no {name} came");
}

/// Reads messages up to the response to a request, and returns it.
fn answer(from: &mut impl BufRead, command: &str) -> Value {
    while let Some(message) = message(from) {
        if message["command"] == command {
            return message;
        }
    }
    panic!("no answer to {command} came");
}

/// Runs a complete session: a breakpoint on a rung, a pause of an endless program, a disconnect.
fn session(to: &mut impl Write, from: &mut impl BufRead) {
    send(to, 1, "initialize", json!({ "adapterID": "emu" }));
    send(to, 2, "launch", json!({ "program": "garage.ld", "mcu": "atmega328p", "history": "1M" }));
    event(from, "initialized");
    let lines = json!({ "source": { "path": "garage.ld" }, "breakpoints": [{ "line": 19, "hitCondition": "==2" }] });
    send(to, 3, "setBreakpoints", lines);
    send(to, 4, "configurationDone", json!({}));
    assert_eq!(event(from, "stopped")["reason"], "breakpoint");
    send(to, 5, "stackTrace", json!({ "threadId": 1 }));
    let frames = answer(from, "stackTrace")["body"]["stackFrames"].clone();
    assert_eq!(frames[0]["name"], "rung 2, element 1: CONTACTS Xbutton 0");
    assert_eq!(frames[0]["line"], 20);
    send(to, 6, "continue", json!({ "threadId": 1 }));
    assert_eq!(answer(from, "continue")["success"], true);
    send(to, 7, "threads", json!({}));
    assert_eq!(answer(from, "threads")["body"]["threads"][0]["name"], "atmega328p");
    send(to, 8, "pause", json!({ "threadId": 1 }));
    assert_eq!(event(from, "stopped")["reason"], "pause");
    send(to, 9, "reverseContinue", json!({ "threadId": 1 }));
    assert_eq!(event(from, "stopped")["reason"], "breakpoint");
    send(to, 10, "continue", json!({ "threadId": 1 }));
    send(to, 11, "disconnect", json!({}));
    assert_eq!(answer(from, "disconnect")["success"], true);
}

#[test]
fn over_standard_input() {
    let mut child = emu(&[]);
    let mut to = child.stdin.take().expect("standard input");
    let mut from = BufReader::new(child.stdout.take().expect("standard output"));
    session(&mut to, &mut from);
    assert!(child.wait().expect("an end").success());
    assert_eq!(message(&mut from), None);
}

#[test]
fn over_tcp() {
    let mut child = emu(&["--listen", ":0"]);
    let mut messages = String::new();
    BufReader::new(child.stderr.take().expect("standard error")).read_line(&mut messages).expect("a line");
    let address = messages.trim().strip_prefix("listening on ").unwrap_or_else(|| panic!("{messages}"));
    assert!(address.starts_with("127.0.0.1:"), "{address}");
    let mut to = TcpStream::connect(address).expect("a connection");
    let mut from = BufReader::new(to.try_clone().expect("another end"));
    session(&mut to, &mut from);
    assert!(child.wait().expect("an end").success());
}

#[test]
fn the_input_ends() {
    let mut child = emu(&[]);
    let mut to = child.stdin.take().expect("standard input");
    send(&mut to, 1, "initialize", json!({}));
    drop(to);
    assert_eq!(child.wait().expect("an end").code(), Some(0));
}

/// Unread data in a closed connection reaches the other side as a reset.
#[test]
fn the_connection_is_reset() {
    let mut child = emu(&["--listen", ":0"]);
    let mut messages = String::new();
    let mut errors = BufReader::new(child.stderr.take().expect("standard error"));
    errors.read_line(&mut messages).expect("a line");
    let mut to =
        TcpStream::connect(messages.trim().strip_prefix("listening on ").expect("an address")).expect("a connection");
    send(&mut to, 1, "initialize", json!({}));
    to.peek(&mut [0]).expect("an answer");
    drop(to);
    assert_eq!(child.wait().expect("an end").code(), Some(0));
    let mut messages = String::new();
    errors.read_to_string(&mut messages).expect("a text");
    assert_eq!(messages, "");
}

#[test]
fn no_protocol() {
    for (input, why) in
        [("hello\n\n", "is not a header line"), ("Content-Length: 9\r\n\r\n{}", "ends after 2 of the 9 bytes")]
    {
        let mut child = emu(&[]);
        child.stdin.take().expect("standard input").write_all(input.as_bytes()).expect("the input is taken");
        let mut messages = String::new();
        child.stderr.take().expect("standard error").read_to_string(&mut messages).expect("a text");
        assert_eq!(child.wait().expect("an end").code(), Some(3), "{messages}");
        assert!(messages.contains(why) && messages.contains("CLI040"), "{messages}");
    }
}

#[test]
fn a_launch_that_cannot_be() {
    let mut child = emu(&[]);
    let mut to = child.stdin.take().expect("standard input");
    let mut from = BufReader::new(child.stdout.take().expect("standard output"));
    send(&mut to, 1, "initialize", json!({}));
    let wrong = [
        (json!({ "program": "nowhere.hex", "mcu": "atmega328p" }), "nowhere.hex"),
        (json!({ "program": "garage.ld", "mcu": "z80" }), "z80"),
        (json!({ "program": "garage.ld", "mcu": "atmega328p", "args": ["--no-such-flag"] }), "--no-such-flag"),
        (json!({ "program": "garage.ld", "mcu": "atmega328p", "clock": "fast" }), "fast"),
    ];
    for (arguments, why) in wrong {
        send(&mut to, 2, "launch", arguments);
        let answer = answer(&mut from, "launch");
        assert_eq!(answer["success"], false);
        assert!(answer["message"].as_str().is_some_and(|text| text.contains(why)), "{answer}");
        assert_eq!(answer["body"]["error"]["showUser"], true);
    }
    send(&mut to, 3, "disconnect", json!({}));
    assert!(child.wait().expect("an end").success());
}
