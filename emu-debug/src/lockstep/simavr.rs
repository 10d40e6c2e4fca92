//! simavr (Debian's `simavr`) by the remote protocol of gdb, which it serves at port 1234 of this machine. It tells no cycles.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::Duration;

use super::{Peer, View, odd};

/// The program and the package.
pub const PROGRAM: (&str, &str) = ("simavr", "simavr");

/// Where it listens.
const PORT: u16 = 1234;

/// How often, and how far apart, it is tried to reach it.
const TRIES: u32 = 100;
const PAUSE: Duration = Duration::from_millis(50);

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(10);

/// The names of the registers.
#[rustfmt::skip]
const REGS: [&str; 32] = [
    "r0", "r1", "r2", "r3", "r4", "r5", "r6", "r7", "r8", "r9", "r10", "r11", "r12", "r13", "r14", "r15",
    "r16", "r17", "r18", "r19", "r20", "r21", "r22", "r23", "r24", "r25", "r26", "r27", "r28", "r29", "r30", "r31",
];

/// simavr with a program. It is ended when this is dropped.
#[derive(Debug)]
pub struct Simavr {
    child: Child,
    line: TcpStream,
}

impl Simavr {
    /// Starts it as `chip` at `hz` with the HEX file `hex` of `folder`.
    ///
    /// # Errors
    /// As [`Command::spawn`]; its port is taken, or it cannot be reached.
    pub fn new(folder: &Path, hex: &str, chip: &str, hz: u64) -> io::Result<Simavr> {
        let place = SocketAddr::from((Ipv4Addr::LOCALHOST, PORT));
        // Whoever listens there already would be taken for it.
        TcpListener::bind(place)
            .map_err(|error| odd(format!("port {PORT}, at which it listens, is taken: {error}")))?;
        let mut command = Command::new(PROGRAM.0);
        command.args(["-g", "-m", chip, "-f", &hz.to_string(), hex]).current_dir(folder);
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
        for _ in 0..TRIES {
            if let Ok(line) = TcpStream::connect_timeout(&place, PATIENCE) {
                line.set_read_timeout(Some(PATIENCE))?;
                line.set_nodelay(true)?;
                return Ok(Simavr { child, line });
            }
            if child.try_wait()?.is_some() {
                return Err(odd(format!("it ends at once: does it know {chip}?")));
            }
            sleep(PAUSE);
        }
        _ = child.kill();
        _ = child.wait();
        Err(odd(format!("it cannot be reached at port {PORT}")))
    }

    /// Sends a packet and takes the answer, without what frames it.
    fn ask(&mut self, packet: &str) -> io::Result<String> {
        let sum = packet.bytes().fold(0u8, u8::wrapping_add);
        self.line.write_all(format!("${packet}#{sum:02x}").as_bytes())?;
        let mut byte = [0];
        let mut answer = Vec::new();
        let (mut within, mut behind) = (false, 0);
        while behind < 3 {
            self.line.read_exact(&mut byte)?;
            match byte[0] {
                b'$' => (within, answer) = (true, Vec::new()),
                b'#' if within => behind = 1,
                _ if behind > 0 => behind += 1,
                other if within => answer.push(other),
                _ => {}
            }
            if answer.len() > 4096 {
                return Err(odd("its answer has no end"));
            }
        }
        self.line.write_all(b"+")?;
        Ok(String::from_utf8_lossy(&answer).into_owned())
    }
}

impl Peer for Simavr {
    fn step(&mut self) -> io::Result<View> {
        let stopped = self.ask("s")?;
        if !stopped.starts_with('T') && !stopped.starts_with('S') {
            return Err(odd(format!("it answers `{stopped}` to a step")));
        }
        let answer = self.ask("g")?;
        view(&answer).ok_or_else(|| odd(format!("its registers are `{answer}`")))
    }
}

/// Reads the registers: 32 of a byte, SREG, SP in two bytes and PC in four, the lowest first.
fn view(answer: &str) -> Option<View> {
    let byte = |at: usize| u32::from_str_radix(answer.get(2 * at..2 * at + 2)?, 16).ok();
    let number = |at: usize, len: usize| (0..len).rev().try_fold(0, |high, i| Some(high << 8 | byte(at + i)?));
    let mut regs = Vec::new();
    for (at, name) in REGS.into_iter().enumerate() {
        regs.push((name, byte(at)?));
    }
    regs.extend([("SREG", byte(32)?), ("SP", number(33, 2)?), ("PC", number(35, 4)?)]);
    Some(View { cycle: None, regs })
}

impl Drop for Simavr {
    fn drop(&mut self) {
        _ = self.child.kill();
        _ = self.child.wait();
    }
}
