//! A program that takes commands on its standard input and answers in lines of text, each answer within a time.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use super::{late, odd};

/// Lines of an answer before it is taken for one without an end.
const MOST: usize = 100_000;

/// Bytes of a line before it is taken for one without an end.
const LONGEST: u64 = 1 << 16;

/// Lines that wait to be read; a program that writes more waits itself.
const QUEUE: usize = 4096;

/// The program. It is ended when this is dropped.
#[derive(Debug)]
pub struct Pipe {
    child: Child,
    to: Option<ChildStdin>,
    /// Lines of its output; the end of it closes the channel.
    from: Receiver<String>,
    patience: Duration,
}

impl Pipe {
    /// Starts a program in a folder; every answer has to come within `patience`.
    ///
    /// # Errors
    /// As [`Command::spawn`]; `NotFound` where it is not installed.
    pub fn start(program: &Path, args: &[&str], folder: &Path, patience: Duration) -> io::Result<Pipe> {
        let mut command = Command::new(program);
        command.args(args).current_dir(folder).stderr(Stdio::null());
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let to = child.stdin.take();
        let out = child.stdout.take().ok_or_else(|| odd("no standard output"))?;
        let (lines, from) = sync_channel(QUEUE);
        // It ends with the program, or as soon as nobody takes lines any more.
        thread::spawn(move || forward(BufReader::new(out), &lines));
        Ok(Pipe { child, to, from, patience })
    }

    /// Gives it commands, each with its line break; few enough to fit into a pipe.
    ///
    /// # Errors
    /// It has ended.
    pub fn tell(&mut self, commands: &str) -> io::Result<()> {
        let to = self.to.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        to.write_all(commands.as_bytes()).and_then(|()| to.flush()).map_err(|_| odd("it has ended"))
    }

    /// The lines that it answers, up to the first for which `ends` is true.
    ///
    /// # Errors
    /// It has ended before, answers without an end, or not within the time ([`io::ErrorKind::TimedOut`]).
    pub fn until(&mut self, ends: impl Fn(&str) -> bool) -> io::Result<Vec<String>> {
        let (mut lines, until) = (Vec::new(), Instant::now() + self.patience);
        while lines.len() < MOST {
            let line = match self.from.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(line) => line,
                Err(RecvTimeoutError::Timeout) => return Err(late(self.patience, said(&lines))),
                Err(RecvTimeoutError::Disconnected) => return Err(odd(format!("it has ended; {}", said(&lines)))),
            };
            let over = ends(&line);
            lines.push(line);
            if over {
                return Ok(lines);
            }
        }
        Err(odd(format!("its answer has no end; {}", said(&lines))))
    }

    /// All lines up to its end.
    ///
    /// # Errors
    /// It does not end within the time ([`io::ErrorKind::TimedOut`]).
    pub fn rest(&mut self) -> io::Result<Vec<String>> {
        drop(self.to.take());
        let (mut lines, until) = (Vec::new(), Instant::now() + self.patience);
        loop {
            match self.from.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok(line) => lines.push(line),
                Err(RecvTimeoutError::Disconnected) => return Ok(lines),
                Err(RecvTimeoutError::Timeout) => return Err(late(self.patience, said(&lines))),
            }
        }
    }
}

/// What it has said, as far as a message needs it.
fn said(lines: &[String]) -> String {
    let last = lines.iter().rev().find(|line| !line.trim().is_empty());
    last.map_or("it says nothing".to_owned(), |last| format!("its last line: {}", last.trim()))
}

/// Gives on line by line.
fn forward(mut from: impl BufRead, to: &SyncSender<String>) {
    loop {
        let mut line = Vec::new();
        match (&mut from).take(LONGEST).read_until(b'\n', &mut line) {
            Ok(1..) => {
                if to.send(String::from_utf8_lossy(&line).trim_end().to_owned()).is_err() {
                    return;
                }
            }
            Ok(0) | Err(_) => return,
        }
    }
}

impl Drop for Pipe {
    fn drop(&mut self) {
        drop(self.to.take());
        _ = self.child.kill();
        _ = self.child.wait();
    }
}

/// The number behind the first `key` in a text, with these digits.
pub(crate) fn after(text: &str, key: &str, radix: u32) -> Option<u64> {
    let rest = text.split_once(key)?.1.trim_start();
    let rest = rest.strip_prefix("0x").unwrap_or(rest);
    let end = rest.find(|c: char| !c.is_digit(radix)).unwrap_or(rest.len());
    u64::from_str_radix(rest.get(..end)?, radix).ok()
}
