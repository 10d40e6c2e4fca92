//! Targets of the debugger's front ends: command line, gdb, DAP.

use std::io::{BufReader, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::LazyLock;

use emu_core::chip::ChipFamily;
use emu_core::image::{Image, load_hex};
use emu_dap::framing::{self, IncomingMessage};
use emu_dap::{DebugAdapter, LaunchArguments, LaunchError, OpenedMachine};
use emu_debug::debug::{DebugSession, SessionOptions};
use ladder_view::LadderView;
use serde_json::Value;

use crate::machines::{self, assemble, family_chip, open_session};
use crate::workspace_root;

/// Number of slices that a run gets before the next request.
const SLICES: usize = 4;

/// Maximum number of lines, requests or packets per input.
const LINES: usize = 24;

/// Programs to debug, as (file, chip).
const SUBJECTS: [(&str, &str); 6] = [
    ("examples/welder.ld", "atmega328p"),
    ("examples/traffic.ld", "at89s52"),
    ("tests/cli/in/lines.elf", "atmega328p"),
    ("examples/8051/hello.hex", "8051"),
    ("examples/pic16/hello.hex", "pic16f877a"),
    ("examples/timer.asm", "ap101"),
];

/// Executes debugger commands; the first byte selects the program.
pub(crate) fn debug_commands(data: &[u8]) {
    let Some((first, rest)) = data.split_first() else { return };
    let (file, chip) = SUBJECTS[usize::from(*first) % SUBJECTS.len()];
    let file = workspace_root().join(file).display().to_string();
    let text = String::from_utf8_lossy(rest);
    let lines: Vec<&str> = text.lines().take(LINES).collect();
    let out = emu::fuzzing::run_debugger(&[&file, "--mcu", chip, "--history", "4M"], &lines.join("\n"));
    assert!(out.is_some(), "{file} can be debugged");
}

static PROGRAMS: LazyLock<[Image; 4]> =
    LazyLock::new(|| machines::FAMILIES.map(|family| assemble(family_chip(family), machines::family_program(family))));

/// Talks to the gdb server; the first byte selects the chip. Each line is the body of a packet, which gets a
/// frame and a checksum; a line that starts with `!` is sent unchanged.
pub(crate) fn gdb(data: &[u8]) {
    let Some((first, rest)) = data.split_first() else { return };
    let number = usize::from(*first) % PROGRAMS.len();
    let mut sent = Vec::new();
    for body in rest.split(|byte| *byte == b'\n').take(LINES) {
        match body.strip_prefix(b"!") {
            Some(raw) => sent.extend(raw),
            None => {
                let sum = body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
                sent.push(b'$');
                sent.extend(body);
                sent.extend(format!("#{sum:02x}").bytes());
            }
        }
    }
    let mut session = open_session(family_chip(machines::FAMILIES[number]), PROGRAMS[number].clone());
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port of this machine");
    let address = listener.local_addr().expect("its address");
    let client = std::thread::spawn(move || {
        let mut stream = TcpStream::connect(address).expect("a server");
        // A server that has disconnected this client does not accept more bytes.
        _ = stream.write_all(&sent);
        _ = stream.shutdown(Shutdown::Write);
        _ = std::io::copy(&mut stream, &mut std::io::sink());
    });
    let options = emu_gdb::GdbOptions { persist: false, monitor: None };
    let ended = emu_gdb::serve(&mut session, &listener, options, &mut |_| {});
    assert!(ended.is_ok(), "it listens");
    client.join().expect("the client ends");
}

/// Opens a program for `launch` by number: `0` to `3` for the families, `4` for a ladder program.
fn open_launch(arguments: &LaunchArguments) -> Result<OpenedMachine, LaunchError> {
    let number: usize = arguments.program.parse().unwrap_or(4);
    match machines::FAMILIES.get(number) {
        Some(family) => {
            Ok(OpenedMachine { session: open_session(family_chip(*family), PROGRAMS[number].clone()), view: None })
        }
        None => ladder(),
    }
}

/// The ladder program and its image.
static LADDER: LazyLock<(ladder::LadderProgram, ladder_compile::CompiledProgram)> = LazyLock::new(|| {
    let text = std::fs::read_to_string(workspace_root().join("examples/welder.ld")).expect("an example");
    let program = ladder::parse("welder.ld", &text).expect("a program").program;
    let options =
        ladder_compile::CompileOptions { mcu: "atmega328p".to_owned(), ..ladder_compile::CompileOptions::default() };
    let compiled = ladder_compile::compile(&program, &options).expect("an image");
    (program, compiled)
});

fn ladder() -> Result<OpenedMachine, LaunchError> {
    let chip = family_chip(ChipFamily::Avr);
    let (program, compiled) = &*LADDER;
    let image = load_hex("welder.hex", compiled.hex.as_bytes(), chip.hex_spaces).map_err(|_| "no image")?.image;
    let view = LadderView::new(program.clone(), compiled.map.clone(), chip).map_err(|_| "no view")?;
    let (target, clock) = machines::visit_machine(chip, &image, machines::ToDynMachine);
    let mut scope = emu_debug::debug::NameScope::new(chip);
    scope.ladder = view.symbols();
    let options = SessionOptions { clock, max_copy_bytes: 4 << 20, follower: Some(view.follower()) };
    Ok(OpenedMachine { session: DebugSession::new(target, scope, options), view: Some(view) })
}

/// Handles requests of the Debug Adapter Protocol, one per line, in the format of the transcripts of the
/// tests; lines that start with `<` or `#` are ignored. A running machine gets some slices before the next
/// request.
pub(crate) fn dap(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mut adapter = DebugAdapter::new(&open_launch);
    let requests = text.lines().filter(|line| !line.starts_with(['<', '#']));
    for (number, line) in requests.take(LINES).enumerate() {
        let answers = match serde_json::from_str::<Value>(line.trim_start_matches(['>', '&', ' '])) {
            Ok(mut request) => {
                if let Some(fields) = request.as_object_mut() {
                    fields.entry("seq").or_insert_with(|| number.into());
                    fields.entry("type").or_insert_with(|| "request".into());
                }
                adapter.handle(&request)
            }
            Err(why) => adapter.reject_garbled(&why.to_string()),
        };
        assert!(answers.first().is_some_and(|answer| answer["type"] == "response"), "every request has its answer");
        for _ in 0..SLICES {
            if adapter.is_running() {
                _ = adapter.run_slice(&mut || false);
            }
        }
        if adapter.is_finished() {
            break;
        }
    }
}

/// Reads messages in frames; what is written is read back unchanged.
pub(crate) fn dap_frames(data: &[u8]) {
    let mut input = BufReader::new(data);
    while let Ok(IncomingMessage::Message(message)) = framing::read_message(&mut input) {
        let mut written = Vec::new();
        framing::write_message(&mut written, &message).expect("memory takes all");
        let again = framing::read_message(&mut BufReader::new(written.as_slice()));
        assert!(
            matches!(again, Ok(IncomingMessage::Message(again)) if again == message),
            "it comes back as it was written"
        );
    }
}
