//! The output of trace lines.

use std::collections::VecDeque;
use std::io::{self, Write};

use emu_core::cpu::Cpu;

use super::line_writer::{TraceLine, TraceLineWriter};

/// Number of bytes that are collected before they are written.
const BUFFER_BYTES: usize = 1 << 16;

/// Which lines are written.
pub enum TraceSink {
    /// All lines, as they come.
    All,
    /// At most this many of the last lines, at the end.
    Last(usize),
}

/// A trace that is being written.
pub struct TraceOutput<'a> {
    /// The writer of lines.
    pub lines: TraceLineWriter<'a>,
    out: Box<dyn Write>,
    sink: TraceSink,
    /// Lines that are not written yet: as one buffer, or one by one.
    chunk: Vec<u8>,
    ring: VecDeque<Vec<u8>>,
    /// The first write error.
    first_error: Option<io::Error>,
}

impl<'a> TraceOutput<'a> {
    /// Returns an empty trace; it begins with a header line for a chip with an oscillator of `hz` Hz.
    #[must_use]
    pub fn new(lines: TraceLineWriter<'a>, out: Box<dyn Write>, sink: TraceSink, hz: u64) -> TraceOutput<'a> {
        let mut chunk = Vec::with_capacity(BUFFER_BYTES);
        lines.write_header(&mut chunk, hz);
        TraceOutput { lines, out, sink, chunk, ring: VecDeque::new(), first_error: None }
    }

    /// Returns true if a write failed.
    #[must_use]
    pub fn has_failed(&self) -> bool {
        self.first_error.is_some()
    }

    /// Adds the line of a step.
    pub fn add_step<C: Cpu>(&mut self, cpu: &C, step: &TraceLine<'_>) {
        match self.sink {
            TraceSink::All => {
                self.lines.write_step(&mut self.chunk, cpu, step);
                if self.chunk.len() >= BUFFER_BYTES {
                    self.write();
                }
            }
            TraceSink::Last(most) => {
                // The newest line reuses the buffer of the oldest.
                let mut line = if self.ring.len() >= most { self.ring.pop_front() } else { None }.unwrap_or_default();
                line.clear();
                self.lines.write_step(&mut line, cpu, step);
                self.ring.push_back(line);
            }
        }
    }

    fn write(&mut self) {
        if self.first_error.is_none() {
            self.first_error = self.out.write_all(&self.chunk).err();
        }
        self.chunk.clear();
    }

    /// Ends the trace at machine cycle `cycle` with a line that gives the reason why the run ended.
    ///
    /// # Errors
    /// The first write error.
    pub fn finish(mut self, cycle: u64, why: &str) -> io::Result<()> {
        for line in std::mem::take(&mut self.ring) {
            self.chunk.extend_from_slice(&line);
            if self.chunk.len() >= BUFFER_BYTES {
                self.write();
            }
        }
        self.lines.write_end(&mut self.chunk, cycle, why);
        self.write();
        self.first_error.map_or_else(|| self.out.flush(), Err)
    }
}
