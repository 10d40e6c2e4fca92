//! A client from its first byte to its last. Whatever it does, the worst is that it is let go.

use std::convert::Infallible;
use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};

use emu_debug::debug::Session;
use gdbstub::conn::Connection;
use gdbstub::stub::state_machine::GdbStubStateMachine as Machine;
use gdbstub::stub::{DisconnectReason, GdbStubBuilder, GdbStubError, SingleThreadStopReason};

use crate::Monitor;
use crate::stub::Stub;
use crate::wire::{Input, Item, Output, PACKET, frame};

/// What the server does besides serving.
#[derive(Default)]
pub struct Options {
    /// When a client has gone, the next one may come; the machine stands where it stood.
    pub persist: bool,
    /// More commands behind `monitor`.
    pub monitor: Option<Box<Monitor>>,
}

/// How a client has gone. All of these are normal ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ended {
    /// `detach`.
    Detached,
    /// `kill`.
    Killed,
    /// It was gone without a word: why.
    Left(String),
    /// What it sent is no gdb's.
    Broken(String),
}

impl fmt::Display for Ended {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Ended::Detached => f.write_str("the client has detached"),
            Ended::Killed => f.write_str("the client has killed the program"),
            Ended::Left(why) => write!(f, "the client has left: {why}"),
            Ended::Broken(why) => write!(f, "the client is let go: {why}"),
        }
    }
}

/// The address that a text stands for: `:1234` on this machine only, `HOST:PORT` as written; port 0 is any free one.
///
/// # Errors
/// It is no address: one sentence.
pub fn address(text: &str) -> Result<SocketAddr, String> {
    let wanted = if text.starts_with(':') { format!("127.0.0.1{text}") } else { text.to_owned() };
    let wrong = |why: &dyn fmt::Display| format!("`{text}` is no address ({why}); write :1234 or 127.0.0.1:1234");
    let mut found = wanted.to_socket_addrs().map_err(|error| wrong(&error))?;
    found.next().ok_or_else(|| wrong(&"it has none"))
}

/// Serves the session to one client, or to one after the other. `log` is told line by line what happens: first where the server
/// listens, `listening on 127.0.0.1:1234`.
///
/// # Errors
/// Of the system, where it cannot listen.
pub fn serve(
    session: &mut Session,
    listener: &TcpListener,
    mut options: Options,
    log: &mut dyn FnMut(&str),
) -> io::Result<Ended> {
    log(&format!("listening on {}", listener.local_addr()?));
    loop {
        let (stream, peer) = listener.accept()?;
        log(&format!("a client has come from {peer}"));
        let monitor = options.monitor.as_deref_mut();
        let ended = client(session, stream, monitor).unwrap_or_else(|error| Ended::Left(error.to_string()));
        log(&ended.to_string());
        if !options.persist {
            return Ok(ended);
        }
    }
}

/// Serves one client.
fn client(session: &mut Session, stream: TcpStream, monitor: Option<&mut Monitor>) -> io::Result<Ended> {
    let mut output = Output::new(stream.try_clone()?)?;
    let mut stub = Stub::new(session, Input::new(stream), monitor);
    // No program is running that could be told to stop before the first packet.
    output.flush()?;
    let gdb = GdbStubBuilder::new(output).packet_buffer_size(PACKET).build();
    let gdb = gdb.map_err(|error| io::Error::other(error.to_string()))?;
    let ended = match gdb.run_state_machine(&mut stub) {
        Ok(machine) => talk(machine, &mut stub),
        Err(error) => Err(error),
    };
    stub.remove_all();
    Ok(ended.unwrap_or_else(|error| {
        if error.is_connection_error() {
            Ended::Left("it does not read its answers".to_owned())
        } else {
            Ended::Broken("a packet that no gdb sends".to_owned())
        }
    }))
}

type Talk<'a, 's> = Machine<'a, Stub<'s>, Output>;
type Failed = GdbStubError<Infallible, io::Error>;

fn talk<'s>(mut machine: Talk<'_, 's>, stub: &mut Stub<'s>) -> Result<Ended, Failed> {
    // Check sums do not count any more once the client has said so.
    let mut quiet = false;
    loop {
        machine = match machine {
            Machine::Idle(mut idle) => match stub.input.next() {
                None => return Ok(left(stub)),
                Some(Item::Packet(packet)) if asks_too_much(&packet) => {
                    _ = idle.borrow_conn().refuse(quiet, "E5a");
                    idle.into()
                }
                Some(Item::Packet(packet)) if lies(&packet) => {
                    _ = idle.borrow_conn().refuse(quiet, "E16");
                    idle.into()
                }
                Some(Item::Packet(packet)) if reaches_beyond(&packet) => {
                    _ = idle.borrow_conn().refuse(quiet, "E0e");
                    idle.into()
                }
                Some(Item::Packet(packet)) if packet.starts_with(b"$qSupported#") => {
                    // gdbstub wants a feature with the question; this one changes nothing.
                    feed(idle.into(), stub, &frame(b"qSupported:swbreak+"))?
                }
                Some(Item::Packet(packet)) => {
                    quiet |= packet.starts_with(b"$QStartNoAckMode#");
                    feed(idle.into(), stub, &packet)?
                }
                // It stands already.
                Some(Item::Interrupt) => idle.into(),
                Some(Item::Broken) if quiet => return Ok(Ended::Broken("a packet with a wrong check sum".to_owned())),
                Some(item) => {
                    let output = idle.borrow_conn();
                    let done = match item {
                        Item::Nack => output.again(),
                        Item::TooLong => output.refuse(quiet, "E5a"),
                        _ => output.send_raw(b"-"),
                    };
                    if done.is_err() {
                        return Ok(left(stub));
                    }
                    idle.into()
                }
            },
            Machine::Running(mut running) => {
                // The acknowledgement of what has set it running.
                _ = running.borrow_conn().flush();
                let (reason, text) = stub.run();
                if stub.input.over.is_some() {
                    return Ok(left(stub));
                }
                let shown = text.map_or(Ok(()), |text| running.borrow_conn().show(&format!("{text}\n")));
                if shown.is_err() {
                    return Ok(left(stub));
                }
                running.report_stop(stub, reason)?
            }
            // Ctrl-C never gets there: it is seen before.
            Machine::CtrlCInterrupt(break_in) => {
                break_in.interrupt_handled(stub, None::<SingleThreadStopReason<u32>>)?
            }
            Machine::Disconnected(gone) => {
                return Ok(match gone.get_reason() {
                    DisconnectReason::Kill => Ended::Killed,
                    _ => Ended::Detached,
                });
            }
        };
    }
}

/// A read of more memory than an answer holds; gdbstub would answer with a longer one.
fn asks_too_much(packet: &[u8]) -> bool {
    let body = packet.strip_prefix(b"$m").and_then(|body| body.split(|byte| *byte == b'#').next());
    let text = body.and_then(|body| std::str::from_utf8(body).ok());
    let len = text.and_then(|text| text.split_once(',')).map(|(_, len)| usize::from_str_radix(len, 16));
    len.is_some_and(|len| len.unwrap_or(usize::MAX) > PACKET / 2)
}

/// A write of memory whose bytes are not as many as it says, or are none; gdbstub would write those that are there.
fn lies(packet: &[u8]) -> bool {
    let body = packet.get(1..packet.len().saturating_sub(3)).unwrap_or_default();
    let (Some(kind @ (b'M' | b'X')), Some(colon)) = (body.first(), body.iter().position(|byte| *byte == b':')) else {
        return matches!(body.first(), Some(b'M' | b'X'));
    };
    let (head, data) = (body.get(1..colon).unwrap_or_default(), body.get(colon + 1..).unwrap_or_default());
    let len = std::str::from_utf8(head).ok().and_then(|head| usize::from_str_radix(head.split_once(',')?.1, 16).ok());
    let there = match kind {
        b'M' => (data.len() % 2 == 0 && data.iter().all(u8::is_ascii_hexdigit)).then_some(data.len() / 2),
        // A byte behind `}` is one with it.
        _ => {
            let mut bytes = data.iter();
            let mut count = 0;
            while let Some(byte) = bytes.next() {
                count += usize::from(*byte != b'}' || bytes.next().is_some());
            }
            Some(count)
        }
    };
    len.is_none() || len != there
}

/// An address or a length of more than 32 bits, for which gdbstub would give up.
fn reaches_beyond(packet: &[u8]) -> bool {
    let body = packet.get(1..packet.len().saturating_sub(3)).unwrap_or_default();
    let heads = ["m", "M", "X", "Z", "z", "vFlashErase:", "vFlashWrite:", "vCont;r"];
    let Some(rest) = heads.iter().find_map(|head| body.strip_prefix(head.as_bytes())) else { return false };
    let numbers = rest.split(|byte| matches!(byte, b':' | b';')).next().unwrap_or_default();
    let is_wide = |number: &[u8]| {
        number.iter().all(u8::is_ascii_hexdigit) && number.iter().skip_while(|digit| **digit == b'0').count() > 8
    };
    numbers.split(|byte| *byte == b',').any(is_wide)
}

fn left(stub: &Stub<'_>) -> Ended {
    Ended::Left(stub.input.over.unwrap_or("its connection is broken").to_owned())
}

/// Gives gdbstub a packet byte by byte.
fn feed<'a, 's>(mut machine: Talk<'a, 's>, stub: &mut Stub<'s>, packet: &[u8]) -> Result<Talk<'a, 's>, Failed> {
    for byte in packet {
        machine = match machine {
            Machine::Idle(idle) => idle.incoming_data(stub, *byte)?,
            other => other,
        };
    }
    Ok(machine)
}
