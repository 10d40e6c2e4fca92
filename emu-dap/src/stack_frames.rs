//! The stack trace: the element of the ladder program, the machine's location, and the callers.

use emu_core::image::SourceLine;
use emu_debug::debug::{CallFrame, FrameName};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{DapMachine, DebugAdapter};
use crate::protocol::{self, DapRequest, RequestError};

/// Maximum number of frames.
const MAX_FRAMES: usize = 100;

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct StackTraceArguments {
    thread_id: i64,
    start_frame: Option<usize>,
    levels: Option<usize>,
}

impl DebugAdapter<'_> {
    /// Answers `stackTrace`: the frames of the call stack, the innermost first.
    pub(crate) fn stack_trace(&mut self, request: &DapRequest) -> Result<Value, RequestError> {
        let StackTraceArguments { thread_id, start_frame, levels } = request.parse_arguments()?;
        if thread_id != crate::adapter::THREAD {
            return Err(RequestError::not_found(format!("there is no thread {thread_id}")));
        }
        let client = self.client.clone();
        let machine = self.machine()?;
        let pc = machine.session.machine().pc();
        let address =
            |machine: &DapMachine, word: u32| format!("0x{:04x}", machine.session.scope.chip().code_address(word));
        let mut frames: Vec<Value> = Vec::new();
        if let Some(ladder) = &machine.ladder
            && let Some((name, line)) = ladder.place(pc)
        {
            frames.push(json!({
                "name": name, "source": ladder.source(), "line": client.line(line), "column": client.column(),
                "instructionPointerReference": address(machine, pc),
            }));
        }
        for (word, name, line) in machine.callers() {
            let mut frame = json!({ "name": name });
            // The machine's location in a ladder program is shown in the disassembly, below the frame of the
            // rung.
            let (source, line) = match line {
                Some(line) => (machine.source_of(&line), line.line),
                None => {
                    let line = machine.listing().line_of(word).unwrap_or(0);
                    (machine.listing_source(), line)
                }
            };
            frame["source"] = source;
            frame["line"] = client.line(line).into();
            frame["column"] = client.column().into();
            frame["instructionPointerReference"] = address(machine, word).into();
            frames.push(frame);
        }
        for (frame, id) in frames.iter_mut().zip(1..) {
            frame["id"] = json!(id);
        }
        let total = frames.len();
        let levels = levels.filter(|levels| *levels > 0).unwrap_or(usize::MAX);
        let frames: Vec<Value> = frames.into_iter().skip(start_frame.unwrap_or(0)).take(levels).collect();
        Ok(json!({ "stackFrames": frames, "totalFrames": total }))
    }

    /// The level of a frame; 0 is the innermost. All frames show the same machine, but the C variables of
    /// their own level.
    ///
    /// # Errors
    /// The frame does not exist.
    pub(crate) fn frame_level(&self, id: Option<i64>) -> Result<usize, RequestError> {
        let not_entered = self.machine.as_ref().map_or(0, |machine| machine.not_entered);
        match id {
            Some(id) if !(0..=MAX_FRAMES as i64 + 1).contains(&id) => {
                Err(RequestError::new(protocol::NOT_FOUND, format!("there is no frame {id}")))
            }
            // If there is a frame of the ladder program, it is above the machine's frame.
            Some(id) => {
                let above = self.machine.as_ref().map_or(0, |machine| i64::from(machine.has_ladder_frame()));
                Ok(usize::try_from(id - 1 - above).unwrap_or(0) + not_entered)
            }
            None => Ok(not_entered),
        }
    }
}

impl DapMachine {
    /// Returns the number of inlined functions that begin at the location: a stop there is before their
    /// calls, but a stop at a breakpoint of a line in them is in them.
    pub(crate) fn calls_to_come(&self, in_inlined_code: bool) -> usize {
        let byte = self.session.machine().pc().saturating_mul(self.session.scope.chip().word_bytes);
        if in_inlined_code { 0 } else { self.session.scope.calls().call_sites(byte) }
    }

    /// True if the stack trace starts with a frame of the ladder program.
    fn has_ladder_frame(&self) -> bool {
        let pc = self.session.machine().pc();
        self.ladder.as_ref().is_some_and(|ladder| ladder.place(pc).is_some())
    }

    /// The machine's location and its callers, innermost first: program word, name, source line.
    fn callers(&self) -> Vec<(u32, String, Option<SourceLine>)> {
        let (scope, target) = (&self.session.scope, self.session.machine());
        let describe = |frame: &CallFrame| {
            let line = scope.source().line_at(frame.call_word).cloned();
            let Some(FrameName { function: name, call }) = scope.calls().frame_name(target, frame) else {
                return (frame.call_word, scope.source().describe_word(frame.call_word), line);
            };
            // An inlined function is shown at the line of its call, which may be in another file.
            let line = match (line, call) {
                (Some(line), Some((file, number))) => {
                    let is = |known: &&SourceLine| known.file.rsplit('/').next() == Some(file.as_str());
                    let file = scope.lines.all_lines().iter().find(is).map_or(&line.file, |known| &known.file).clone();
                    Some(SourceLine { line: *number, file, ..line })
                }
                (line, _) => line,
            };
            (frame.call_word, name.to_owned(), line)
        };
        scope.calls().frames(target).iter().skip(self.not_entered).take(MAX_FRAMES).map(describe).collect()
    }
}
