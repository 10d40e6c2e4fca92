//! The faces of the debugger: its command line, gdb, DAP.

use std::io::{BufReader, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::LazyLock;

use emu_core::chip::Family;
use emu_core::image::{Image, load_hex};
use emu_dap::frame::{self, Incoming};
use emu_dap::{Adapter, LaunchArguments, Opened};
use emu_debug::debug::{Options, Session};
use ladder_view::View;
use serde_json::Value;

use crate::machine::{self, assembled, chip, session};
use crate::root;

/// Slices of a run for which a client waits before it goes on.
const SLICES: usize = 4;

/// Lines, requests or packets of one input.
const LINES: usize = 24;

/// Programs under the debugger: the arguments of `emu debug`.
const SUBJECTS: [(&str, &str); 6] = [
    ("examples/welder.ld", "atmega328p"),
    ("examples/traffic.ld", "at89s52"),
    ("tests/cli/in/lines.elf", "atmega328p"),
    ("examples/8051/hello.hex", "8051"),
    ("examples/pic16/hello.hex", "pic16f877a"),
    ("examples/timer.asm", "ap101"),
];

/// The first byte chooses the program.
pub(crate) fn repl(data: &[u8]) {
    let Some((first, rest)) = data.split_first() else { return };
    let (file, chip) = SUBJECTS[usize::from(*first) % SUBJECTS.len()];
    let file = root().join(file).display().to_string();
    let text = String::from_utf8_lossy(rest);
    let lines: Vec<&str> = text.lines().take(LINES).collect();
    let out = emu::fuzzing::debugger(&[&file, "--mcu", chip, "--history", "4M"], &lines.join("\n"));
    assert!(out.is_some(), "{file} can be debugged");
}

static PROGRAMS: LazyLock<[Image; 4]> =
    LazyLock::new(|| machine::FAMILIES.map(|family| assembled(chip(family), machine::program(family))));

/// The first byte chooses the chip. Lines are bodies of packets, which get their frames and check sums; one that begins with `!` goes
/// out as it is.
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
    let mut session = session(chip(machine::FAMILIES[number]), PROGRAMS[number].clone());
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port of this machine");
    let address = listener.local_addr().expect("its address");
    let client = std::thread::spawn(move || {
        let mut stream = TcpStream::connect(address).expect("a server");
        // A server that has let this client go takes no more.
        _ = stream.write_all(&sent);
        _ = stream.shutdown(Shutdown::Write);
        _ = std::io::copy(&mut stream, &mut std::io::sink());
    });
    let options = emu_gdb::Options { persist: false, monitor: None };
    let ended = emu_gdb::serve(&mut session, &listener, options, &mut |_| {});
    assert!(ended.is_ok(), "it listens");
    client.join().expect("the client ends");
}

/// Programs for `launch`, by number: `0` to `3` for the families, `4` for a ladder program.
fn open(arguments: &LaunchArguments) -> Result<Opened, String> {
    let number: usize = arguments.program.parse().unwrap_or(4);
    match machine::FAMILIES.get(number) {
        Some(family) => Ok(Opened { session: session(chip(*family), PROGRAMS[number].clone()), view: None }),
        None => ladder(),
    }
}

/// The ladder program and its image.
static LADDER: LazyLock<(ladder::Program, ladder_compile::Compiled)> = LazyLock::new(|| {
    let text = std::fs::read_to_string(root().join("examples/welder.ld")).expect("an example");
    let program = ladder::parse("welder.ld", &text).expect("a program").program;
    let options = ladder_compile::Options { mcu: "atmega328p".to_owned(), ..ladder_compile::Options::default() };
    let compiled = ladder_compile::compile(&program, &options).expect("an image");
    (program, compiled)
});

fn ladder() -> Result<Opened, String> {
    let chip = chip(Family::Avr);
    let (program, compiled) = &*LADDER;
    let image = load_hex("welder.hex", compiled.hex.as_bytes(), chip.hex).map_err(|_| "no image")?.image;
    let view = View::new(program.clone(), compiled.map.clone(), chip).map_err(|_| "no view")?;
    let (target, clock) = machine::on_machine(chip, &image, machine::Fit);
    let mut scope = emu_debug::debug::Scope::new(chip);
    scope.ladder = view.symbols();
    let options = Options { clock, history: 4 << 20, follow: Some(view.follower()) };
    Ok(Opened { session: Session::new(target, scope, options), view: Some(view) })
}

/// Requests, one a line, as in the transcripts of the tests: what begins with `<` or `#` is none. A machine that runs gets some slices
/// of time, and then the next request.
pub(crate) fn dap(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mut adapter = Adapter::new(&open);
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
            Err(why) => adapter.garbled(&why.to_string()),
        };
        assert!(answers.first().is_some_and(|answer| answer["type"] == "response"), "every request has its answer");
        for _ in 0..SLICES {
            if adapter.is_running() {
                _ = adapter.proceed(&mut || false);
            }
        }
        if adapter.is_over() {
            break;
        }
    }
}

/// What is read is written, and read again.
pub(crate) fn dap_frames(data: &[u8]) {
    let mut input = BufReader::new(data);
    while let Ok(Incoming::Message(message)) = frame::read(&mut input) {
        let mut written = Vec::new();
        frame::write(&mut written, &message).expect("memory takes all");
        let again = frame::read(&mut BufReader::new(written.as_slice()));
        assert!(matches!(again, Ok(Incoming::Message(again)) if again == message), "it comes back as it was written");
    }
}
