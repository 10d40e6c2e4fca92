//! Bytes to packets and back. gdbstub gives up at a wrong check sum and at a packet that is too long; here a line may be bad.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use gdbstub::conn::Connection;

/// Bytes of the longest packet, its frame included; the client is told so.
pub(crate) const PACKET: usize = 4096;

/// Packets that may wait while the program runs. A client waits for the answer to one, so more are no debugger's.
const WAITING: usize = 256;

/// How long a client may leave an answer unread.
const PATIENCE: Duration = Duration::from_secs(30);

/// How often a run looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(1);

/// What comes from the client.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Item {
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
enum State {
    #[default]
    Between,
    Body,
    Sum(Option<u8>),
}

/// Makes items of bytes.
#[derive(Debug, Default)]
pub(crate) struct Decoder {
    state: State,
    body: Vec<u8>,
    long: bool,
}

impl Decoder {
    /// Takes a byte; an item may be complete with it. What lies between packets and is nothing is passed over.
    pub(crate) fn take(&mut self, byte: u8) -> Option<Item> {
        match (&mut self.state, byte) {
            (State::Between, 0x03) => return Some(Item::Interrupt),
            (State::Between, b'-') => return Some(Item::Nack),
            (State::Between | State::Body, b'$') => {
                // In the middle of a packet: the client has begun anew.
                self.state = State::Body;
                self.body.clear();
                self.long = false;
            }
            (State::Between, _) => {}
            (State::Body, b'#') => self.state = State::Sum(None),
            (State::Body, _) if self.body.len() + 4 >= PACKET => self.long = true,
            (State::Body, byte) => self.body.push(byte),
            (State::Sum(high @ None), byte) => *high = Some(byte),
            (State::Sum(Some(high)), low) => {
                let digit = |byte: u8| char::from(byte).to_digit(16).unwrap_or(0x100);
                let told = digit(*high) << 4 | digit(low);
                self.state = State::Between;
                if self.long {
                    return Some(Item::TooLong);
                }
                let right = told == u32::from(sum(&self.body));
                return Some(if right { Item::Packet(frame(&self.body)) } else { Item::Broken });
            }
        }
        None
    }
}

fn sum(body: &[u8]) -> u8 {
    body.iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

/// A packet around a body.
pub(crate) fn frame(body: &[u8]) -> Vec<u8> {
    let mut packet = vec![b'$'];
    packet.extend_from_slice(body);
    packet.extend_from_slice(format!("#{:02x}", sum(body)).as_bytes());
    packet
}

/// What the client sends.
pub(crate) struct Input {
    stream: TcpStream,
    decoder: Decoder,
    waiting: VecDeque<Item>,
    looked: Instant,
    /// Why nothing more comes.
    pub over: Option<&'static str>,
}

impl Input {
    /// From this stream.
    pub(crate) fn new(stream: TcpStream) -> Input {
        Input { stream, decoder: Decoder::default(), waiting: VecDeque::new(), looked: Instant::now(), over: None }
    }

    /// The next item; waits for it. Nothing where the client has gone.
    pub(crate) fn next(&mut self) -> Option<Item> {
        while self.waiting.is_empty() {
            if self.over.is_some() {
                return None;
            }
            self.read();
        }
        self.waiting.pop_front()
    }

    /// The run may go on: asked again and again while the program runs. False at Ctrl-C, and when the client has gone.
    pub(crate) fn go_on(&mut self) -> bool {
        if self.looked.elapsed() < LOOK {
            return true;
        }
        self.looked = Instant::now();
        if self.over.is_none() {
            if self.stream.set_nonblocking(true).is_err() {
                self.over = Some("its connection is broken");
            }
            self.read();
            if self.stream.set_nonblocking(false).is_err() {
                self.over = Some("its connection is broken");
            }
        }
        if self.waiting.len() > WAITING {
            self.over = Some("it sends without end while the program runs");
        }
        self.over.is_none() && !self.interrupted()
    }

    /// Takes Ctrl-C out of what waits.
    fn interrupted(&mut self) -> bool {
        let before = self.waiting.len();
        self.waiting.retain(|item| *item != Item::Interrupt);
        self.waiting.len() < before
    }

    fn read(&mut self) {
        let mut bytes = [0; 4096];
        match self.stream.read(&mut bytes) {
            Ok(0) => self.over = Some("it has closed the connection"),
            Ok(count) => {
                let read = bytes.get(..count).unwrap_or_default();
                let (decoder, waiting) = (&mut self.decoder, &mut self.waiting);
                waiting.extend(read.iter().filter_map(|byte| decoder.take(*byte)));
            }
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted) => {}
            Err(_) => self.over = Some("its connection is broken"),
        }
    }
}

/// What the client is sent.
pub(crate) struct Output {
    stream: TcpStream,
    ready: Vec<u8>,
    /// The last answer.
    last: Vec<u8>,
}

impl Output {
    /// To this stream.
    ///
    /// # Errors
    /// Of the system.
    pub(crate) fn new(stream: TcpStream) -> io::Result<Output> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        Ok(Output { stream, ready: Vec::new(), last: Vec::new() })
    }

    /// Sends a packet.
    ///
    /// # Errors
    /// Of the system.
    pub(crate) fn send(&mut self, body: &[u8]) -> io::Result<()> {
        self.write_all(&frame(body))?;
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
    pub(crate) fn again(&mut self) -> io::Result<()> {
        Write::write_all(&mut self.stream, &self.last)
    }
}

impl Connection for Output {
    type Error = io::Error;

    fn write(&mut self, byte: u8) -> io::Result<()> {
        self.ready.push(byte);
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        if let Some(start) = self.ready.iter().position(|byte| *byte == b'$') {
            self.last = self.ready.get(start..).unwrap_or_default().to_vec();
        }
        let sent = Write::write_all(&mut self.stream, &self.ready);
        self.ready.clear();
        sent
    }
}
