//! Bytes to packets and back. gdbstub gives up at a wrong check sum and at a packet that is too long; here a line may be bad.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use gdbstub::conn::Connection;

/// Bytes of the longest packet, its frame included; the client is told so.
pub(crate) const MAX_PACKET_BYTES: usize = 4096;

/// Packets that may wait while the program runs. A client waits for the answer to one, so more are no debugger's.
const MAX_WAITING_PACKETS: usize = 256;

/// How long a client may leave an answer unread.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);

/// How often a run looks for Ctrl-C.
const INTERRUPT_POLL: Duration = Duration::from_millis(1);

/// What comes from the client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ClientItem {
    /// A packet, frame and all.
    Packet(Vec<u8>),
    /// Ctrl-C.
    Interrupt,
    /// Send the last answer again.
    Nack,
    /// The check sum was wrong.
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

/// Makes items of bytes.
#[derive(Debug, Default)]
pub(crate) struct PacketDecoder {
    state: DecoderState,
    body: Vec<u8>,
    is_too_long: bool,
}

impl PacketDecoder {
    /// Takes a byte; an item may be complete with it. What lies between packets and is nothing is passed over.
    pub(crate) fn take(&mut self, byte: u8) -> Option<ClientItem> {
        match (&mut self.state, byte) {
            (DecoderState::Between, 0x03) => return Some(ClientItem::Interrupt),
            (DecoderState::Between, b'-') => return Some(ClientItem::Nack),
            (DecoderState::Between | DecoderState::Body, b'$') => {
                // In the middle of a packet: the client has begun anew.
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
                let told = digit(*high) << 4 | digit(low);
                self.state = DecoderState::Between;
                if self.is_too_long {
                    return Some(ClientItem::TooLong);
                }
                let right = told == u32::from(checksum(&self.body));
                return Some(if right { ClientItem::Packet(frame_packet(&self.body)) } else { ClientItem::Broken });
            }
        }
        None
    }
}

fn checksum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// A packet around a body.
pub(crate) fn frame_packet(body: &[u8]) -> Vec<u8> {
    let mut packet = vec![b'$'];
    packet.extend_from_slice(body);
    packet.extend_from_slice(format!("#{:02x}", checksum(body)).as_bytes());
    packet
}

/// What the client sends.
pub(crate) struct ClientInput {
    stream: TcpStream,
    decoder: PacketDecoder,
    waiting: VecDeque<ClientItem>,
    last_poll: Instant,
    /// Why nothing more comes.
    pub closed_because: Option<&'static str>,
}

impl ClientInput {
    /// From this stream.
    pub(crate) fn new(stream: TcpStream) -> ClientInput {
        ClientInput {
            stream,
            decoder: PacketDecoder::default(),
            waiting: VecDeque::new(),
            last_poll: Instant::now(),
            closed_because: None,
        }
    }

    /// The next item; waits for it. Nothing where the client has gone.
    pub(crate) fn next(&mut self) -> Option<ClientItem> {
        while self.waiting.is_empty() {
            if self.closed_because.is_some() {
                return None;
            }
            self.read();
        }
        self.waiting.pop_front()
    }

    /// The run may go on: asked again and again while the program runs. False at Ctrl-C, and when the client has gone.
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
            self.closed_because = Some("it sends without end while the program runs");
        }
        self.closed_because.is_none() && !self.take_interrupt()
    }

    /// Takes Ctrl-C out of what waits.
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

/// What the client is sent.
pub(crate) struct ClientOutput {
    stream: TcpStream,
    buffered: Vec<u8>,
    /// The last answer.
    last_answer: Vec<u8>,
}

impl ClientOutput {
    /// To this stream.
    ///
    /// # Errors
    /// Of the system.
    pub(crate) fn new(stream: TcpStream) -> io::Result<ClientOutput> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
        Ok(ClientOutput { stream, buffered: Vec::new(), last_answer: Vec::new() })
    }

    /// Sends a packet.
    ///
    /// # Errors
    /// Of the system.
    pub(crate) fn send(&mut self, body: &[u8]) -> io::Result<()> {
        self.write_all(&frame_packet(body))?;
        self.flush()
    }

    /// Answers a packet that gdbstub is not shown: one that is too long or asks for too much (`E5a`, EMSGSIZE), that makes no sense
    /// (`E16`, EINVAL), or whose address no memory has (`E0e`, EFAULT); `quiet`: nothing is acknowledged.
    ///
    /// # Errors
    /// Of the system.
    pub(crate) fn refuse(&mut self, quiet: bool, why: &str) -> io::Result<()> {
        if !quiet {
            self.send_raw(b"+")?;
        }
        self.send(why.as_bytes())
    }

    /// Sends bytes that are no packet.
    ///
    /// # Errors
    /// Of the system.
    pub(crate) fn send_raw(&mut self, bytes: &[u8]) -> io::Result<()> {
        Write::write_all(&mut self.stream, bytes)
    }

    /// Shows a text to the user; only while the program runs.
    ///
    /// # Errors
    /// Of the system.
    pub(crate) fn show(&mut self, text: &str) -> io::Result<()> {
        let hex: String = text.bytes().map(|byte| format!("{byte:02x}")).collect();
        self.send(format!("O{hex}").as_bytes())
    }

    /// Sends the last answer again.
    ///
    /// # Errors
    /// Of the system.
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
