//! Serves a client from connection to disconnection. A client that misbehaves is only disconnected.

use std::convert::Infallible;
use std::fmt;
use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};

use emu_debug::debug::DebugSession;
use gdbstub::conn::Connection;
use gdbstub::stub::state_machine::GdbStubStateMachine as Machine;
use gdbstub::stub::{DisconnectReason, GdbStubBuilder, GdbStubError, SingleThreadStopReason};

use crate::MonitorHandler;
use crate::error::GdbError;
use crate::gdb_target::GdbTarget;
use crate::packets::{ClientInput, ClientItem, ClientOutput, MAX_PACKET_BYTES, frame_packet};

/// Options of the gdb server.
#[derive(Default)]
pub struct GdbOptions {
    /// Whether the server waits for another client after one has disconnected; the machine keeps its state
    /// meanwhile.
    pub persist: bool,
    /// A handler for further `monitor` commands.
    pub monitor: Option<Box<MonitorHandler>>,
}

/// How the connection to a client ended. All of these are normal ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ClientEnd {
    /// `detach`.
    Detached,
    /// `kill`.
    Killed,
    /// The connection was lost, for this reason.
    ConnectionLost(String),
    /// The client violated the protocol.
    ProtocolError(String),
}

impl fmt::Display for ClientEnd {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ClientEnd::Detached => f.write_str("the client has detached"),
            ClientEnd::Killed => f.write_str("the client has killed the program"),
            ClientEnd::ConnectionLost(why) => write!(f, "the client has disconnected: {why}"),
            ClientEnd::ProtocolError(why) => write!(f, "the client was disconnected: {why}"),
        }
    }
}

/// Parses an address: `:1234` is a port on this machine only, `HOST:PORT` is used as written; port 0 selects
/// any free port.
///
/// # Errors
/// The text is not an address.
pub fn parse_address(text: &str) -> Result<SocketAddr, GdbError> {
    let wanted = if text.starts_with(':') { format!("127.0.0.1{text}") } else { text.to_owned() };
    let mut found =
        wanted.to_socket_addrs().map_err(|source| GdbError::BadAddress { text: text.to_owned(), source })?;
    found.next().ok_or_else(|| GdbError::HostWithoutAddress { text: text.to_owned() })
}

/// Serves the session to one client or, with `persist`, to one client after another. `log` gets a line per
/// event; the first one is where the server listens: `listening on 127.0.0.1:1234`.
///
/// # Errors
/// The operating system cannot listen or accept connections.
pub fn serve(
    session: &mut DebugSession,
    listener: &TcpListener,
    mut options: GdbOptions,
    log: &mut dyn FnMut(&str),
) -> io::Result<ClientEnd> {
    log(&format!("listening on {}", listener.local_addr()?));
    loop {
        let (stream, peer) = listener.accept()?;
        log(&format!("a client has connected from {peer}"));
        let monitor = options.monitor.as_deref_mut();
        let ended =
            serve_client(session, stream, monitor).unwrap_or_else(|error| ClientEnd::ConnectionLost(error.to_string()));
        log(&ended.to_string());
        if !options.persist {
            return Ok(ended);
        }
    }
}

/// Serves one client.
fn serve_client(
    session: &mut DebugSession,
    stream: TcpStream,
    monitor: Option<&mut MonitorHandler>,
) -> io::Result<ClientEnd> {
    let mut output = ClientOutput::new(stream.try_clone()?)?;
    let mut stub = GdbTarget::new(session, ClientInput::new(stream), monitor);
    // No program runs before the first packet, so there is no stop to report.
    output.flush()?;
    let gdb = GdbStubBuilder::new(output).packet_buffer_size(MAX_PACKET_BYTES).build();
    let gdb = gdb.map_err(|error| io::Error::other(error.to_string()))?;
    let ended = match gdb.run_state_machine(&mut stub) {
        Ok(machine) => run_protocol(machine, &mut stub),
        Err(error) => Err(error),
    };
    stub.remove_all();
    Ok(ended.unwrap_or_else(|error| {
        if error.is_connection_error() {
            ClientEnd::ConnectionLost("it does not read its answers".to_owned())
        } else {
            ClientEnd::ProtocolError("a packet that no gdb sends".to_owned())
        }
    }))
}

type GdbStateMachine<'a, 's> = Machine<'a, GdbTarget<'s>, ClientOutput>;
type GdbFailure = GdbStubError<Infallible, io::Error>;

fn run_protocol<'s>(mut machine: GdbStateMachine<'_, 's>, stub: &mut GdbTarget<'s>) -> Result<ClientEnd, GdbFailure> {
    // Set once the client has disabled acknowledgements, and with them checksums.
    let mut quiet = false;
    loop {
        machine = match machine {
            Machine::Idle(mut idle) => match stub.input.next() {
                None => return Ok(connection_end(stub)),
                Some(ClientItem::Packet(packet)) if is_read_too_long(&packet) => {
                    _ = idle.borrow_conn().refuse(quiet, "E5a");
                    idle.into()
                }
                Some(ClientItem::Packet(packet)) if is_write_length_wrong(&packet) => {
                    _ = idle.borrow_conn().refuse(quiet, "E16");
                    idle.into()
                }
                Some(ClientItem::Packet(packet)) if is_beyond_32_bits(&packet) => {
                    _ = idle.borrow_conn().refuse(quiet, "E0e");
                    idle.into()
                }
                Some(ClientItem::Packet(packet)) if packet.starts_with(b"$qSupported#") => {
                    // gdbstub requires a feature in the query; this one has no effect.
                    feed_packet(idle.into(), stub, &frame_packet(b"qSupported:swbreak+"))?
                }
                Some(ClientItem::Packet(packet)) => {
                    quiet |= packet.starts_with(b"$QStartNoAckMode#");
                    feed_packet(idle.into(), stub, &packet)?
                }
                // The program is stopped already.
                Some(ClientItem::Interrupt) => idle.into(),
                Some(ClientItem::Broken) if quiet => {
                    return Ok(ClientEnd::ProtocolError("a packet with a wrong checksum".to_owned()));
                }
                Some(item) => {
                    let output = idle.borrow_conn();
                    let done = match item {
                        ClientItem::Nack => output.resend_last(),
                        ClientItem::TooLong => output.refuse(quiet, "E5a"),
                        _ => output.send_raw(b"-"),
                    };
                    if done.is_err() {
                        return Ok(connection_end(stub));
                    }
                    idle.into()
                }
            },
            Machine::Running(mut running) => {
                // Sends the acknowledgement of the packet that started the run.
                _ = running.borrow_conn().flush();
                let (reason, text) = stub.run();
                if stub.input.closed_because.is_some() {
                    return Ok(connection_end(stub));
                }
                let shown = text.map_or(Ok(()), |text| running.borrow_conn().show(&format!("{text}\n")));
                if shown.is_err() {
                    return Ok(connection_end(stub));
                }
                running.report_stop(stub, reason)?
            }
            // Never reached: Ctrl-C is handled before it gets to gdbstub.
            Machine::CtrlCInterrupt(break_in) => {
                break_in.interrupt_handled(stub, None::<SingleThreadStopReason<u32>>)?
            }
            Machine::Disconnected(gone) => {
                return Ok(match gone.get_reason() {
                    DisconnectReason::Kill => ClientEnd::Killed,
                    _ => ClientEnd::Detached,
                });
            }
        };
    }
}

/// True for a read of more memory than an answer can hold; gdbstub would send a longer answer.
fn is_read_too_long(packet: &[u8]) -> bool {
    let body = packet.strip_prefix(b"$m").and_then(|body| body.split(|byte| *byte == b'#').next());
    let text = body.and_then(|body| std::str::from_utf8(body).ok());
    let len = text.and_then(|text| text.split_once(',')).map(|(_, len)| usize::from_str_radix(len, 16));
    len.is_some_and(|len| len.unwrap_or(usize::MAX) > MAX_PACKET_BYTES / 2)
}

/// True for a write of memory with no bytes or a wrong number of bytes; gdbstub would write the bytes that
/// are present.
fn is_write_length_wrong(packet: &[u8]) -> bool {
    let body = packet.get(1..packet.len().saturating_sub(3)).unwrap_or_default();
    let (Some(kind @ (b'M' | b'X')), Some(colon)) = (body.first(), body.iter().position(|byte| *byte == b':')) else {
        return matches!(body.first(), Some(b'M' | b'X'));
    };
    let (head, data) = (body.get(1..colon).unwrap_or_default(), body.get(colon + 1..).unwrap_or_default());
    let len = std::str::from_utf8(head).ok().and_then(|head| usize::from_str_radix(head.split_once(',')?.1, 16).ok());
    let there = match kind {
        b'M' => (data.len() % 2 == 0 && data.iter().all(u8::is_ascii_hexdigit)).then_some(data.len() / 2),
        // `}` escapes the next byte, so both count as one.
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

/// True for an address or length of more than 32 bits, at which gdbstub would end the session.
fn is_beyond_32_bits(packet: &[u8]) -> bool {
    let body = packet.get(1..packet.len().saturating_sub(3)).unwrap_or_default();
    let heads = ["m", "M", "X", "Z", "z", "vFlashErase:", "vFlashWrite:", "vCont;r"];
    let Some(rest) = heads.iter().find_map(|head| body.strip_prefix(head.as_bytes())) else { return false };
    let numbers = rest.split(|byte| matches!(byte, b':' | b';')).next().unwrap_or_default();
    let is_wide = |number: &[u8]| {
        number.iter().all(u8::is_ascii_hexdigit) && number.iter().skip_while(|digit| **digit == b'0').count() > 8
    };
    numbers.split(|byte| *byte == b',').any(is_wide)
}

fn connection_end(stub: &GdbTarget<'_>) -> ClientEnd {
    ClientEnd::ConnectionLost(stub.input.closed_because.unwrap_or("its connection is broken").to_owned())
}

/// Passes a packet to gdbstub byte by byte.
fn feed_packet<'a, 's>(
    mut machine: GdbStateMachine<'a, 's>,
    stub: &mut GdbTarget<'s>,
    packet: &[u8],
) -> Result<GdbStateMachine<'a, 's>, GdbFailure> {
    for byte in packet {
        machine = match machine {
            Machine::Idle(idle) => idle.incoming_data(stub, *byte)?,
            other => other,
        };
    }
    Ok(machine)
}
