//! A program that takes commands on its standard input and answers in lines of text, each answer within a time.

use std::io::{self, BufRead, BufReader, Read, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use super::process::Process;
use super::{GLANCE, Start, go_on, late, odd};

/// Lines of an answer before it is taken for one without an end.
const MOST: usize = 100_000;

/// Bytes of a line before it is taken for one without an end.
const LONGEST: u64 = 1 << 16;

/// Lines that wait to be read; a program that writes more waits itself.
const QUEUE: usize = 4096;

/// The program. It is ended when this is dropped.
#[derive(Debug)]
pub struct Pipe {
    _child: Process,
    to: Option<ChildStdin>,
    /// Lines of its output; the end of it closes the channel.
    from: Receiver<String>,
    patience: Duration,
    interrupt: Arc<AtomicBool>,
}

impl Pipe {
    /// Starts the program of `start` in its folder.
    ///
    /// # Errors
    /// As [`Command::spawn`]; `NotFound` where it is not installed.
    pub fn start(start: &Start<'_>, args: &[&str]) -> io::Result<Pipe> {
        let mut command = Command::new(start.program);
        command.args(args).current_dir(start.folder).stderr(Stdio::null());
        let mut child = Process::spawn(command.stdin(Stdio::piped()).stdout(Stdio::piped()))?;
        let to = child.0.stdin.take();
        let out = child.0.stdout.take().ok_or_else(|| odd("no standard output"))?;
        let (lines, from) = sync_channel(QUEUE);
        // It ends with the program, or as soon as nobody takes lines any more.
        thread::spawn(move || forward(BufReader::new(out), &lines));
        let (patience, interrupt) = (start.patience, Arc::clone(start.interrupt));
        Ok(Pipe { _child: child, to, from, patience, interrupt })
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
    /// It has ended before, answers without an end, or not within the time ([`io::ErrorKind::TimedOut`]); the run is interrupted
    /// ([`io::ErrorKind::Interrupted`]).
    pub fn until(&mut self, ends: impl Fn(&str) -> bool) -> io::Result<Vec<String>> {
        let (mut lines, until) = (Vec::new(), Instant::now() + self.patience);
        while lines.len() < MOST {
            let Some(line) = self.line(until, &lines)? else {
                return Err(odd(format!("it has ended; {}", said(&lines))));
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
    /// It does not end within the time ([`io::ErrorKind::TimedOut`]), or the run is interrupted ([`io::ErrorKind::Interrupted`]).
    pub fn rest(&mut self) -> io::Result<Vec<String>> {
        drop(self.to.take());
        let (mut lines, until) = (Vec::new(), Instant::now() + self.patience);
        while let Some(line) = self.line(until, &lines)? {
            lines.push(line);
        }
        Ok(lines)
    }

    /// The line behind `lines`; nothing where it has ended.
    fn line(&self, until: Instant, lines: &[String]) -> io::Result<Option<String>> {
        loop {
            go_on(&self.interrupt)?;
            let left = until.saturating_duration_since(Instant::now());
            match self.from.recv_timeout(left.min(GLANCE)) {
                Ok(line) => return Ok(Some(line)),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) if left.is_zero() => return Err(late(self.patience, said(lines))),
                Err(RecvTimeoutError::Timeout) => {}
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

/// The number behind the first `key` in a text, with these digits.
pub(crate) fn after(text: &str, key: &str, radix: u32) -> Option<u64> {
    let rest = text.split_once(key)?.1.trim_start();
    let rest = rest.strip_prefix("0x").unwrap_or(rest);
    let end = rest.find(|c: char| !c.is_digit(radix)).unwrap_or(rest.len());
    u64::from_str_radix(rest.get(..end)?, radix).ok()
}
