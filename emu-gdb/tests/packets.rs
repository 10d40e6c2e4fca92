//! Talks to the server packet by packet, as described by the text files next to this file.
//!
//! ```text
//! == a name                     starts a case with a server and a client of its own
//! chip atmega328p
//! | ldi r16, 5                  a line of its program
//! -> g                          a packet, followed by its answer
//! <- 05000000
//! -> monitor cycle              a command of `monitor`; its output is shown as text
//! -- vCont;c                    a packet whose answer is not awaited
//! => \x03                       raw bytes, followed by the answer; >> does not await one
//! waits 100                     waits this many milliseconds, while a program runs
//! ends the client was disconnected   the last message of the server; a client that is connected disconnects
//! ```
//! With a line `persists`, a case may end more than once: the lines that follow belong to the next client.
//! `EMU_BLESS=1` updates the answers.

mod machine;

use std::fmt::Write as _;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use emu_core::image::Image;

/// Time limit for an answer of the server.
const WAIT: Duration = Duration::from_secs(60);

struct Client {
    stream: TcpStream,
}

impl Client {
    fn come(address: SocketAddr) -> Client {
        let stream = TcpStream::connect(address).expect("a server");
        // A server that hangs must not block the test.
        stream.set_read_timeout(Some(WAIT)).expect("a socket");
        Client { stream }
    }

    fn byte(&mut self) -> Option<u8> {
        let mut byte = [0];
        matches!(self.stream.read(&mut byte), Ok(1)).then_some(byte[0])
    }

    /// The next packet or `-`; acknowledgements are ignored.
    fn answer(&mut self) -> String {
        loop {
            match self.byte() {
                None => return "(gone)".to_owned(),
                Some(b'+') => {}
                Some(b'$') => break,
                Some(byte) => return char::from(byte).to_string(),
            }
        }
        let mut body = Vec::new();
        while let Some(byte) = self.byte() {
            if byte == b'#' {
                let sum = [self.byte().unwrap_or(0), self.byte().unwrap_or(0)];
                let right = body.iter().fold(0u8, |sum, byte: &u8| sum.wrapping_add(*byte));
                assert_eq!(format!("{right:02x}").as_bytes(), sum);
                return body.iter().map(|byte| char::from(*byte)).collect();
            }
            body.push(byte);
        }
        "(gone)".to_owned()
    }

    /// The answers up to the first one that is not text for the user; text is shown as text.
    fn answers(&mut self) -> Vec<String> {
        let mut all = Vec::new();
        loop {
            let answer = self.answer();
            match answer.strip_prefix('O').filter(|hex| !hex.is_empty() && *hex != "K").and_then(text) {
                Some(text) => all.extend(text.lines().map(|line| format!("O {line}"))),
                None => {
                    all.push(answer);
                    return all;
                }
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        // The server may have closed the connection; the next answer shows it.
        _ = self.stream.write_all(bytes);
    }

    fn packet(&mut self, body: &[u8]) {
        let sum = body.iter().fold(0u8, |sum, byte| sum.wrapping_add(*byte));
        let bytes = [b"$", body, format!("#{sum:02x}").as_bytes()].concat();
        self.send(&bytes);
    }
}

fn text(hex: &str) -> Option<String> {
    let bytes: Option<Vec<u8>> =
        (0..hex.len() / 2).map(|at| u8::from_str_radix(&hex[2 * at..2 * at + 2], 16).ok()).collect();
    String::from_utf8(bytes?).ok()
}

/// Parses bytes: `\xNN` is a byte, and `*N` after a byte repeats it N times.
fn bytes(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let escape = rest.strip_prefix("\\x").and_then(|hex| u8::from_str_radix(hex.get(..2)?, 16).ok());
        match escape {
            Some(byte) => {
                bytes.push(byte);
                rest = &rest[4..];
            }
            None if c == '*' => {
                let digits: String = rest[1..].chars().take_while(char::is_ascii_digit).collect();
                let last = *bytes.last().expect("a byte before *");
                bytes.resize(bytes.len() + digits.parse::<usize>().expect("a number behind *"), last);
                rest = &rest[1 + digits.len()..];
            }
            None => {
                bytes.push(c as u8);
                rest = &rest[c.len_utf8()..];
            }
        }
    }
    bytes
}

/// Plays a case; returns its text with the actual answers.
fn play(case: &str) -> String {
    let chip_name = case.lines().find_map(|line| line.strip_prefix("chip ")).expect("a chip");
    let chip = machine::chip(chip_name);
    let program: String =
        case.lines().filter_map(|line| line.strip_prefix("| ")).fold(String::new(), |all, line| all + line + "\n");
    let image =
        if program.is_empty() { Image::default() } else { emu_asm::assemble_text(chip, &program).expect("a program") };
    let persist = case.lines().any(|line| line == "persists");
    let (ends, ended) = mpsc::channel();
    let (address, _) = machine::serving(chip, image, persist, move |line| {
        if line.starts_with("the client") {
            _ = ends.send(line.to_owned());
        }
    });
    let mut client = Some(Client::come(address));
    let mut out = String::new();
    for line in case.lines().filter(|line| !line.starts_with("<-")) {
        let (how, rest) = line.split_once(' ').unwrap_or((line, ""));
        if how == "ends" {
            _ = client.take().map(|client| client.stream.shutdown(std::net::Shutdown::Both));
            _ = writeln!(out, "ends {}", ended.recv_timeout(WAIT).expect("an end without a panic"));
            continue;
        }
        _ = writeln!(out, "{line}");
        if how == "waits" {
            std::thread::sleep(Duration::from_millis(rest.parse().expect("milliseconds")));
        }
        if !matches!(how, "->" | "--" | "=>" | ">>") {
            continue;
        }
        let client = client.get_or_insert_with(|| Client::come(address));
        let body = match rest.strip_prefix("monitor ") {
            Some(command) => {
                format!("qRcmd,{}", command.bytes().fold(String::new(), |hex, byte| format!("{hex}{byte:02x}")))
            }
            None => rest.to_owned(),
        };
        match how {
            "->" | "--" => client.packet(&bytes(&body)),
            "=>" | ">>" => client.send(&bytes(rest)),
            _ => continue,
        }
        if matches!(how, "->" | "=>") {
            client
                .answers()
                .iter()
                .for_each(|answer| _ = writeln!(out, "<- {}", answer.trim_end().replace('\n', "\n<- ")));
        }
    }
    assert!(client.is_none(), "a case without `ends`:\n{case}");
    out
}

fn texts() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let files = std::fs::read_dir(folder).expect("tests").flatten().map(|entry| entry.path());
    let mut texts: Vec<PathBuf> = files.filter(|path| path.extension().is_some_and(|end| end == "txt")).collect();
    texts.sort();
    texts
}

#[test]
fn packets() {
    let texts = texts();
    assert!(!texts.is_empty());
    for file in texts {
        let text = std::fs::read_to_string(&file).expect("a text");
        let mut cases = text.split("== ");
        let mut out = cases.next().unwrap_or_default().to_owned();
        for case in cases {
            out += &format!("== {}", play(case));
        }
        if std::env::var_os("EMU_BLESS").is_some() {
            std::fs::write(&file, &out).expect("written");
            continue;
        }
        for (n, (came, wanted)) in out.lines().zip(text.lines()).enumerate() {
            assert_eq!(came, wanted, "{}:{}", file.display(), n + 1);
        }
        assert_eq!(out.lines().count(), text.lines().count(), "{}", file.display());
    }
}
