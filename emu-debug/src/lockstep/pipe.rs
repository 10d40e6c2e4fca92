//! A program that reads commands from its standard input and answers in lines of text, with a time limit per
//! answer.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use super::process::PeerProcess;
use super::{INTERRUPT_POLL, PeerStart, check_interrupt, invalid_answer, timed_out};

/// Maximum number of lines of an answer.
const MAX_LINES: usize = 100_000;

/// Maximum length of a line in bytes.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// Maximum number of unread lines; a program that writes more has to wait.
const MAX_QUEUED_LINES: usize = 4096;

/// The running program. Dropping this ends it.
#[derive(Debug)]
pub struct PeerPipe {
    _child: PeerProcess,
    stdin: Option<ChildStdin>,
    /// Lines of its output; the end of the output closes the channel.
    output_lines: Receiver<String>,
    timeout: Duration,
    interrupt: Arc<AtomicBool>,
}

impl PeerPipe {
    /// Starts the program of `start` in its folder.
    ///
    /// # Errors
    /// As [`Command::spawn`]; `NotFound` if it is not installed.
    pub fn start(start: &PeerStart<'_>, args: &[&str]) -> io::Result<PeerPipe> {
        let mut command = Command::new(start.program);
        command.args(args).current_dir(start.folder).stderr(Stdio::null());
        let mut child = PeerProcess::spawn(command.stdin(Stdio::piped()).stdout(Stdio::piped()))?;
        let to = child.0.stdin.take();
        let out = child.0.stdout.take().ok_or_else(|| invalid_answer("no standard output"))?;
        let (lines, from) = sync_channel(MAX_QUEUED_LINES);
        // The thread ends with the program, or when the receiver is dropped.
        thread::spawn(move || forward_lines(BufReader::new(out), &lines));
        let (timeout, interrupt) = (start.timeout, Arc::clone(start.interrupt));
        Ok(PeerPipe { _child: child, stdin: to, output_lines: from, timeout, interrupt })
    }

    /// Writes commands, each with its line break; they must be few enough to fit into a pipe.
    ///
    /// # Errors
    /// The program has ended.
    pub fn write_commands(&mut self, commands: &str) -> io::Result<()> {
        let to = self.stdin.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        to.write_all(commands.as_bytes()).and_then(|()| to.flush()).map_err(|_| invalid_answer("it has ended"))
    }

    /// Returns the lines of the answer, up to the first for which `ends` returns true.
    ///
    /// # Errors
    /// The program has ended, the answer is too long, or it does not come in time
    /// ([`io::ErrorKind::TimedOut`]); or the run is interrupted ([`io::ErrorKind::Interrupted`]).
    pub fn read_until(&mut self, ends: impl Fn(&str) -> bool) -> io::Result<Vec<String>> {
        let (mut lines, until) = (Vec::new(), Instant::now() + self.timeout);
        while lines.len() < MAX_LINES {
            let Some(line) = self.next_line(until, &lines)? else {
                return Err(invalid_answer(format!("it has ended; {}", quote_lines(&lines))));
            };
            let over = ends(&line);
            lines.push(line);
            if over {
                return Ok(lines);
            }
        }
        Err(invalid_answer(format!("its answer has no end; {}", quote_lines(&lines))))
    }

    /// Returns all lines up to the end of the program.
    ///
    /// # Errors
    /// It does not end in time ([`io::ErrorKind::TimedOut`]), or the run is interrupted
    /// ([`io::ErrorKind::Interrupted`]).
    pub fn read_to_end(&mut self) -> io::Result<Vec<String>> {
        drop(self.stdin.take());
        let (mut lines, until) = (Vec::new(), Instant::now() + self.timeout);
        while let Some(line) = self.next_line(until, &lines)? {
            lines.push(line);
        }
        Ok(lines)
    }

    /// Returns the next line after `lines`; `None` if the program has ended.
    fn next_line(&self, until: Instant, lines: &[String]) -> io::Result<Option<String>> {
        loop {
            check_interrupt(&self.interrupt)?;
            let left = until.saturating_duration_since(Instant::now());
            match self.output_lines.recv_timeout(left.min(INTERRUPT_POLL)) {
                Ok(line) => return Ok(Some(line)),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) if left.is_zero() => {
                    return Err(timed_out(self.timeout, quote_lines(lines)));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }
}

/// Quotes the last output for a message.
fn quote_lines(lines: &[String]) -> String {
    let last = lines.iter().rev().find(|line| !line.trim().is_empty());
    last.map_or("it says nothing".to_owned(), |last| format!("its last line: {}", last.trim()))
}

/// Forwards lines one by one.
fn forward_lines(mut from: impl BufRead, to: &SyncSender<String>) {
    loop {
        let mut line = Vec::new();
        match (&mut from).take(MAX_LINE_BYTES).read_until(b'\n', &mut line) {
            Ok(1..) => {
                if to.send(String::from_utf8_lossy(&line).trim_end().to_owned()).is_err() {
                    return;
                }
            }
            Ok(0) | Err(_) => return,
        }
    }
}

/// Returns the number after the first `key` in a text, in this radix.
pub(crate) fn number_after(text: &str, key: &str, radix: u32) -> Option<u64> {
    let rest = text.split_once(key)?.1.trim_start();
    let rest = rest.strip_prefix("0x").unwrap_or(rest);
    let end = rest.find(|c: char| !c.is_digit(radix)).unwrap_or(rest.len());
    u64::from_str_radix(rest.get(..end)?, radix).ok()
}
