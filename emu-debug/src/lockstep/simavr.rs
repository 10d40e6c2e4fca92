//! simavr (Debian's `simavr`), controlled by the remote protocol of gdb at port 1234 of this machine. It does
//! not report cycles. A step over SLEEP ends the sleep there, so it is continued to a breakpoint at the
//! instruction after the wake.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::pipe::PeerPipe;
use super::process::PeerProcess;
use super::{
    INTERRUPT_POLL, PassedSleep, PeerSimulator, PeerStart, RegisterView, check_interrupt, endless_sleep,
    invalid_answer, timed_out, unknown_chip,
};

/// The program and its package.
pub const PROGRAM: (&str, &str) = ("simavr", "simavr");

/// The port at which it listens.
const PORT: u16 = 1234;

/// Errors of a read that has not received anything yet.
const RETRY_ERRORS: [io::ErrorKind; 3] =
    [io::ErrorKind::WouldBlock, io::ErrorKind::TimedOut, io::ErrorKind::Interrupted];

/// Maximum size of a packet in bytes.
const MAX_PACKET_BYTES: usize = 4096;

/// The number of the stack pointer in gdb's register list.
const SP: u8 = 33;

/// The names of the registers.
#[rustfmt::skip]
const REGS: [&str; 32] = [
    "r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "r13", "r14", "r15",
    "r16", "r17", "r18", "r19", "r20", "r21", "r22", "r23", "r24", "r25", "r26", "r27", "r28", "r29", "r30", "r31",
];

/// simavr with a program. Dropping this ends it.
#[derive(Debug)]
pub struct SimavrPeer {
    child: PeerProcess,
    connection: TcpStream,
    /// Received bytes that were not read.
    inbox: Vec<u8>,
    timeout: Duration,
    interrupt: Arc<AtomicBool>,
}

/// Returns the chip of simavr that is equivalent to `chip`: the data sheet of the 48PA family (DS40002061)
/// gives the ATmega48A, 88A and 168A the registers and characteristics of the chips without a letter. simavr
/// has no ATmega164A, 644A and 644PA, which have the registers of the ATmega164 and 644P (Atmel 8272).
#[must_use]
pub fn equivalent_chip(chip: &str) -> Option<&'static str> {
    match chip {
        "atmega48a" => Some("atmega48"),
        "atmega88a" => Some("atmega88"),
        "atmega168a" => Some("atmega168"),
        "atmega164a" => Some("atmega164"),
        "atmega644a" | "atmega644pa" => Some("atmega644p"),
        _ => None,
    }
}

impl SimavrPeer {
    /// Starts simavr with a program.
    ///
    /// # Errors
    /// As [`Command::spawn`]; or its port is taken, it does not know the chip, or cannot be reached.
    pub fn new(start: &PeerStart<'_>) -> io::Result<SimavrPeer> {
        let place = SocketAddr::from((Ipv4Addr::LOCALHOST, PORT));
        // Another program that listens there would be mistaken for it.
        TcpListener::bind(place)
            .map_err(|error| invalid_answer(format!("port {PORT}, at which it listens, is in use: {error}")))?;
        let chip = equivalent_chip(start.chip).unwrap_or(start.chip);
        let mut command = Command::new(start.program);
        command.args(["-g", "-m", chip, "-f", &start.hz.to_string(), start.hex]).current_dir(start.folder);
        let mut child = PeerProcess::spawn(command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()))?;
        let until = Instant::now() + start.timeout;
        while Instant::now() < until {
            check_interrupt(start.interrupt)?;
            if let Ok(line) = TcpStream::connect_timeout(&place, INTERRUPT_POLL) {
                line.set_write_timeout(Some(start.timeout))?;
                line.set_nodelay(true)?;
                let (timeout, interrupt) = (start.timeout, Arc::clone(start.interrupt));
                let mut peer = SimavrPeer { child, connection: line, inbox: Vec::new(), timeout, interrupt };
                let [low, high, ..] = start.sp.to_le_bytes();
                peer.exchange_packet(&format!("P{SP:x}={low:02x}{high:02x}"))?;
                return Ok(peer);
            }
            if child.0.try_wait()?.is_some() {
                let known = is_chip_known(start, chip)?;
                return Err(if known { invalid_answer("it ends at once") } else { unknown_chip(start.chip) });
            }
            sleep(INTERRUPT_POLL);
        }
        Err(timed_out(start.timeout, format!("it cannot be reached at port {PORT}")))
    }

    /// Sends a packet and returns the answer without its frame.
    fn exchange_packet(&mut self, packet: &str) -> io::Result<String> {
        let sum = packet.bytes().fold(0u8, u8::wrapping_add);
        self.connection.write_all(format!("${packet}#{sum:02x}").as_bytes())?;
        let until = Instant::now() + self.timeout;
        let answer = loop {
            if let Some(ReceivedPacket { text: answer, rest }) = split_packet(&self.inbox) {
                self.inbox = rest;
                break answer;
            }
            if self.inbox.len() > MAX_PACKET_BYTES {
                return Err(invalid_answer("its answer has no end"));
            }
            check_interrupt(&self.interrupt)?;
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(timed_out(self.timeout, format!("no answer to `{packet}`")));
            }
            self.connection.set_read_timeout(Some(left.min(INTERRUPT_POLL)))?;
            let mut piece = [0; 1024];
            match self.connection.read(&mut piece) {
                Ok(0) => return Err(invalid_answer(format!("it has ended{}", self.exit_status()))),
                Ok(n) => self.inbox.extend(piece.get(..n).unwrap_or_default()),
                Err(error) if RETRY_ERRORS.contains(&error.kind()) => {}
                Err(error) => return Err(invalid_answer(format!("{error}{}", self.exit_status()))),
            }
        };
        self.connection.write_all(b"+")?;
        Ok(answer)
    }

    /// Describes how the process ended.
    fn exit_status(&mut self) -> String {
        self.child.0.try_wait().ok().flatten().map_or(String::new(), |status| format!(", {status}"))
    }

    /// Resumes with `s` or `c` until the next stop; returns the registers there.
    fn resume(&mut self, how: &str) -> io::Result<RegisterView> {
        let stopped = self.exchange_packet(how)?;
        if !stopped.starts_with('T') && !stopped.starts_with('S') {
            return Err(invalid_answer(format!("it answers `{stopped}` to `{how}`")));
        }
        let answer = self.exchange_packet("g")?;
        parse_view(&answer).ok_or_else(|| invalid_answer(format!("its registers are `{answer}`")))
    }
}

/// The first complete packet of received bytes.
#[derive(Debug, Clone)]
struct ReceivedPacket {
    /// The content of the packet.
    text: String,
    /// The bytes after it.
    rest: Vec<u8>,
}

/// Returns the first complete packet, and what follows it.
fn split_packet(bytes: &[u8]) -> Option<ReceivedPacket> {
    let from = bytes.iter().position(|&byte| byte == b'$')? + 1;
    let len = bytes.get(from..)?.iter().position(|&byte| byte == b'#')?;
    let rest = bytes.get(from + len + 3..)?;
    Some(ReceivedPacket {
        text: String::from_utf8_lossy(bytes.get(from..from + len)?).into_owned(),
        rest: rest.to_vec(),
    })
}

/// Returns true if simavr lists the chip as known.
fn is_chip_known(start: &PeerStart<'_>, chip: &str) -> io::Result<bool> {
    let mut pipe = PeerPipe::start(start, &["--list-cores"])?;
    let lines = pipe.read_to_end()?;
    Ok(lines.iter().any(|line| line.split_whitespace().any(|name| name == chip)))
}

impl PeerSimulator for SimavrPeer {
    fn step(&mut self) -> io::Result<RegisterView> {
        self.resume("s")
    }

    fn pass_sleep(&mut self, nap: PassedSleep) -> io::Result<RegisterView> {
        self.exchange_packet(&format!("Z0,{:x},2", nap.pc))?;
        let view = self.resume("c").map_err(|error| endless_sleep(error, nap))?;
        self.exchange_packet(&format!("z0,{:x},2", nap.pc))?;
        Ok(view)
    }
}

/// Parses the registers: 32 of one byte, SREG, SP in two bytes and PC in four, the lowest byte first.
fn parse_view(answer: &str) -> Option<RegisterView> {
    let byte = |at: usize| u32::from_str_radix(answer.get(2 * at..2 * at + 2)?, 16).ok();
    let number = |at: usize, len: usize| (0..len).rev().try_fold(0, |high, i| Some(high << 8 | byte(at + i)?));
    let mut regs = Vec::new();
    for (at, name) in REGS.into_iter().enumerate() {
        regs.push((name, byte(at)?));
    }
    regs.extend([("SREG", byte(32)?), ("SP", number(33, 2)?), ("PC", number(35, 4)?)]);
    Some(RegisterView { cycle: None, regs })
}
