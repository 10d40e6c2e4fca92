//! A program that takes commands on its standard input and answers in lines of text.

use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use super::odd;

/// Lines of an answer before it is taken for one without an end.
const MOST: usize = 10_000;

/// The program. It is ended when this is dropped.
#[derive(Debug)]
pub struct Pipe {
    child: Child,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
}

impl Pipe {
    /// Starts a program in a folder.
    ///
    /// # Errors
    /// As [`Command::spawn`]; `NotFound` where it is not installed.
    pub fn start(program: &str, args: &[&str], folder: &Path) -> io::Result<Pipe> {
        let mut command = Command::new(program);
        command.args(args).current_dir(folder).stderr(Stdio::null());
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let to = child.stdin.take();
        let from = child.stdout.take().ok_or_else(|| odd("no standard output"))?;
        Ok(Pipe { child, to, from: BufReader::new(from) })
    }

    /// Gives it commands, each with its line break.
    ///
    /// # Errors
    /// It has ended.
    pub fn tell(&mut self, commands: &str) -> io::Result<()> {
        let to = self.to.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        to.write_all(commands.as_bytes())?;
        to.flush()
    }

    /// The lines that it answers, up to the first for which `ends` is true.
    ///
    /// # Errors
    /// It has ended before, or answers without an end.
    pub fn until(&mut self, ends: impl Fn(&str) -> bool) -> io::Result<Vec<String>> {
        let mut lines = Vec::new();
        while lines.len() < MOST {
            let mut line = Vec::new();
            if self.from.read_until(b'\n', &mut line)? == 0 {
                return Err(odd(lines
                    .last()
                    .map_or("it says nothing".to_owned(), |last| format!("its last line: {last}"))));
            }
            let line = String::from_utf8_lossy(&line).trim_end().to_owned();
            let over = ends(&line);
            lines.push(line);
            if over {
                return Ok(lines);
            }
        }
        Err(odd("its answer has no end"))
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
