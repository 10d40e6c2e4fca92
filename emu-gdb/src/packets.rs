//! Converts bytes to packets and back. gdbstub ends a session at a wrong checksum or a packet that is too
//! long; this layer tolerates them.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use gdbstub::conn::Connection;

/// Maximum packet size in bytes, including its frame; the client is informed of it.
pub(crate) const MAX_PACKET_BYTES: usize = 4096;

/// Maximum number of packets that wait while the program runs. A debugger waits for each answer, so more
/// packets mean a broken client.
const MAX_WAITING_PACKETS: usize = 256;

/// How long a client may leave an answer unread.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);

/// How often a run checks for Ctrl-C.
const INTERRUPT_POLL: Duration = Duration::from_millis(1);

/// An item that was received from the client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ClientItem {
    /// A packet with its frame.
    Packet(Vec<u8>),
    /// Ctrl-C.
    Interrupt,
    /// A request to send the last answer again.
    Nack,
    /// A packet with a wrong checksum.
    Broken,
    /// A packet that is too long.
    TooLong,
}

#[derive(Debug, Default)]
enum DecoderState {
    #[default]
    Between,
    Body,
    Sum(Option<u8>),
}

/// Decodes bytes to items.
#[derive(Debug, Default)]
pub(crate) struct PacketDecoder {
    state: DecoderState,
    body: Vec<u8>,
    is_too_long: bool,
}

impl PacketDecoder {
    /// Takes a byte; returns an item if the byte completes it. Unknown bytes between packets are ignored.
    pub(crate) fn take(&mut self, byte: u8) -> Option<ClientItem> {
        match (&mut self.state, byte) {
            (DecoderState::Between, 0x03) => return Some(ClientItem::Interrupt),
            (DecoderState::Between, b'-') => return Some(ClientItem::Nack),
            (DecoderState::Between | DecoderState::Body, b'$') => {
                // Within a packet, `$` means that the client has started a new one.
                self.state = DecoderState::Body;
                self.body.clear();
                self.is_too_long = false;
            }
            (DecoderState::Between, _) => {}
            (DecoderState::Body, b'#') => self.state = DecoderState::Sum(None),
            (DecoderState::Body, _) if self.body.len() + 4 >= MAX_PACKET_BYTES => self.is_too_long = true,
            (DecoderState::Body, byte) => self.body.push(byte),
            (DecoderState::Sum(high @ None), byte) => *high = Some(byte),
            (DecoderState::Sum(Some(high)), low) => {
                let digit = |byte: u8| char::from(byte).to_digit(16).unwrap_or(0x100);
                let wanted_sum = digit(*high) << 4 | digit(low);
                self.state = DecoderState::Between;
                if self.is_too_long {
                    return Some(ClientItem::TooLong);
                }
                let right = wanted_sum == u32::from(checksum(&self.body));
                return Some(if right { ClientItem::Packet(frame_packet(&self.body)) } else { ClientItem::Broken });
            }
        }
        None
    }
}

fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// Adds the frame of a packet to a body.
pub(crate) fn frame_packet(body: &[u8]) -> Vec<u8> {
    let mut packet = vec![b'$'];
    packet.extend_from_slice(body);
    packet.extend_from_slice(format!("#{:02x}", checksum(body)).as_bytes());
    packet
}

/// The receiving side of a connection.
pub(crate) struct ClientInput {
    stream: TcpStream,
    decoder: PacketDecoder,
    waiting: VecDeque<ClientItem>,
    last_poll: Instant,
    /// Why the connection cannot receive any more.
    pub closed_because: Option<&'static str>,
}

impl ClientInput {
    /// Receives from this stream.
    pub(crate) fn new(stream: TcpStream) -> ClientInput {
        ClientInput {
            stream,
            decoder: PacketDecoder::default(),
            waiting: VecDeque::new(),
            last_poll: Instant::now(),
            closed_because: None,
        }
    }

    /// Waits for the next item and returns it; `None` if the client has disconnected.
    pub(crate) fn next(&mut self) -> Option<ClientItem> {
        while self.waiting.is_empty() {
            if self.closed_because.is_some() {
                return None;
            }
            self.read();
        }
        self.waiting.pop_front()
    }

    /// Called periodically during a run: returns false after Ctrl-C, or if the client has disconnected.
    pub(crate) fn may_continue(&mut self) -> bool {
        if self.last_poll.elapsed() < INTERRUPT_POLL {
            return true;
        }
        self.last_poll = Instant::now();
        if self.closed_because.is_none() {
            if self.stream.set_nonblocking(true).is_err() {
                self.closed_because = Some("its connection is broken");
            }
            self.read();
            if self.stream.set_nonblocking(false).is_err() {
                self.closed_because = Some("its connection is broken");
            }
        }
        if self.waiting.len() > MAX_WAITING_PACKETS {
            self.closed_because = Some("it sends endlessly while the program runs");
        }
        self.closed_because.is_none() && !self.take_interrupt()
    }

    /// Removes Ctrl-C from the waiting items; returns whether there was one.
    fn take_interrupt(&mut self) -> bool {
        let before = self.waiting.len();
        self.waiting.retain(|item| *item != ClientItem::Interrupt);
        self.waiting.len() < before
    }

    fn read(&mut self) {
        let mut bytes = [0; 4096];
        match self.stream.read(&mut bytes) {
            Ok(0) => self.closed_because = Some("it has closed the connection"),
            Ok(count) => {
                let read = bytes.get(..count).unwrap_or_default();
                let (decoder, waiting) = (&mut self.decoder, &mut self.waiting);
                waiting.extend(read.iter().filter_map(|byte| decoder.take(*byte)));
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {}
            Err(_) => self.closed_because = Some("its connection is broken"),
        }
    }
}

/// The sending side of a connection.
pub(crate) struct ClientOutput {
    stream: TcpStream,
    buffered: Vec<u8>,
    /// The last answer, with its frame.
    last_answer: Vec<u8>,
}

impl ClientOutput {
    /// Sends to this stream.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub(crate) fn new(stream: TcpStream) -> io::Result<ClientOutput> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
        Ok(ClientOutput { stream, buffered: Vec::new(), last_answer: Vec::new() })
    }

    /// Sends a packet.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub(crate) fn send(&mut self, body: &[u8]) -> io::Result<()> {
        self.write_all(&frame_packet(body))?;
        self.flush()
    }

    /// Answers a packet that is not passed to gdbstub with an error code: `E5a` (EMSGSIZE) if it is too long
    /// or requests too much, `E16` (EINVAL) if it is malformed, `E0e` (EFAULT) if no memory has its address.
    /// With `quiet`, the packet is not acknowledged.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub(crate) fn refuse(&mut self, quiet: bool, why: &str) -> io::Result<()> {
        if !quiet {
            self.send_raw(b"+")?;
        }
        self.send(why.as_bytes())
    }

    /// Sends bytes without a frame.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub(crate) fn send_raw(&mut self, bytes: &[u8]) -> io::Result<()> {
        Write::write_all(&mut self.stream, bytes)
    }

    /// Shows a text to the user; the protocol allows this only while the program runs.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub(crate) fn show(&mut self, text: &str) -> io::Result<()> {
        let hex: String = text.bytes().map(|byte| format!("{byte:02x}")).collect();
        self.send(format!("O{hex}").as_bytes())
    }

    /// Sends the last answer again.
    ///
    /// # Errors
    /// Errors of the operating system.
    pub(crate) fn resend_last(&mut self) -> io::Result<()> {
        Write::write_all(&mut self.stream, &self.last_answer)
    }
}

impl Connection for ClientOutput {
    type Error = io::Error;

    fn write(&mut self, byte: u8) -> io::Result<()> {
        self.buffered.push(byte);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        if let Some(start) = self.buffered.iter().position(|byte| *byte == b'$') {
            self.last_answer = self.buffered.get(start..).unwrap_or_default().to_vec();
        }
        let sent = Write::write_all(&mut self.stream, &self.buffered);
        self.buffered.clear();
        sent
    }
}
