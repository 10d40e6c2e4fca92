//! Where the lines of a trace go.

use std::collections::VecDeque;
use std::io::{self, Write};

use emu_core::cpu::Cpu;

use super::lines::{Lines, Step};

/// Bytes that are collected before they are written.
const CHUNK: usize = 1 << 16;

/// Where lines go.
pub enum Sink {
    /// All of them are written as they come.
    All,
    /// The last of them, so many at most, are written at the end.
    Last(usize),
}

/// A trace that is written.
pub struct Trace<'a> {
    /// The writer of lines.
    pub lines: Lines<'a>,
    out: Box<dyn Write>,
    sink: Sink,
    /// Lines that are not written yet: one after the other, or each for itself.
    chunk: Vec<u8>,
    ring: VecDeque<Vec<u8>>,
    /// The first thing that could not be written.
    failed: Option<io::Error>,
}

impl<'a> Trace<'a> {
    /// An empty trace, which begins with a head line for a chip whose oscillator has so many Hz.
    #[must_use]
    pub fn new(lines: Lines<'a>, out: Box<dyn Write>, sink: Sink, hz: u64) -> Trace<'a> {
        let mut chunk = Vec::with_capacity(CHUNK);
        lines.head(&mut chunk, hz);
        Trace { lines, out, sink, chunk, ring: VecDeque::new(), failed: None }
    }

    /// Something could not be written.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.failed.is_some()
    }

    /// Adds the line of a step.
    pub fn step<C: Cpu>(&mut self, cpu: &C, step: &Step<'_>) {
        match self.sink {
            Sink::All => {
                self.lines.step(&mut self.chunk, cpu, step);
                if self.chunk.len() >= CHUNK {
                    self.write();
                }
            }
            Sink::Last(most) => {
                // The oldest line gives its room to the newest.
                let mut line = if self.ring.len() >= most { self.ring.pop_front() } else { None }.unwrap_or_default();
                line.clear();
                self.lines.step(&mut line, cpu, step);
                self.ring.push_back(line);
            }
        }
    }

    fn write(&mut self) {
        if self.failed.is_none() {
            self.failed = self.out.write_all(&self.chunk).err();
        }
        self.chunk.clear();
    }

    /// Ends the trace at machine cycle `cycle` with a line that says why the run has ended.
    ///
    /// # Errors
    /// The first thing that could not be written.
    pub fn finish(mut self, cycle: u64, why: &str) -> io::Result<()> {
        for line in std::mem::take(&mut self.ring) {
            self.chunk.extend_from_slice(&line);
            if self.chunk.len() >= CHUNK {
                self.write();
            }
        }
        self.lines.end(&mut self.chunk, cycle, why);
        self.write();
        self.failed.map_or_else(|| self.out.flush(), Err)
    }
}
