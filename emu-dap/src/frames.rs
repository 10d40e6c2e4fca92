//! The stack: the element of the ladder program, the machine below it, and who called.

use emu_core::chip::{Chip, Family};
use emu_core::image::SymbolAt;
use emu_debug::debug::Flow;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::adapter::{Adapter, Machine};
use crate::wire::{self, Request, Wrong};

/// Most frames.
const DEEPEST: usize = 100;

/// Bytes of the stack that are looked through.
const STACK: u32 = 4096;

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct Arguments {
    thread_id: i64,
    start_frame: Option<usize>,
    levels: Option<usize>,
}

impl Adapter<'_> {
    pub(crate) fn stack_trace(&mut self, request: &Request) -> Result<Value, Wrong> {
        let Arguments { thread_id, start_frame, levels } = request.arguments()?;
        if thread_id != crate::adapter::THREAD {
            return Err(Wrong::nothing(format!("there is no thread {thread_id}")));
        }
        let client = self.client.clone();
        let machine = self.machine()?;
        let pc = machine.session.target().pc();
        let address =
            |machine: &Machine, word: u32| format!("0x{:04x}", machine.session.scope.chip().code_address(word));
        let mut frames: Vec<Value> = Vec::new();
        if let Some(ladder) = &machine.ladder
            && let Some((name, line)) = ladder.place(pc)
        {
            frames.push(json!({
                "name": name, "source": ladder.source(), "line": client.line(line), "column": client.column(),
                "instructionPointerReference": address(machine, pc),
            }));
        }
        for word in machine.callers() {
            let mut frame = json!({ "name": machine.session.scope.source().place(word) });
            let found = machine.session.scope.source().line_at(word).cloned();
            // Of a ladder program the listing is below its rungs.
            let (source, line) = match found {
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

    /// The frame is one of ours. All of them show the same machine, so it does not matter which.
    pub(crate) fn frame(&self, id: Option<i64>) -> Result<(), Wrong> {
        match id {
            Some(id) if !(0..=DEEPEST as i64 + 1).contains(&id) => {
                Err(Wrong::new(wire::NOTHING, format!("there is no frame {id}")))
            }
            _ => Ok(()),
        }
    }
}

impl Machine {
    /// Where the machine stands, and the calls that it is in, the innermost first, as program words. A stack in memory holds
    /// other things too: what counts there is the address behind a call of the function that is on.
    fn callers(&mut self) -> Vec<u32> {
        let pc = self.session.target().pc();
        let mut found = vec![pc];
        let stack = self.session.target().return_stack();
        if !stack.is_empty() {
            let depth = self.session.target().depth() as usize;
            let calls = stack.into_iter().take(depth);
            found.extend(calls.filter_map(|ret| self.call_before(ret).map(|(at, _)| at)).take(DEEPEST));
            return found;
        }
        let mut here = pc;
        for ret in self.stack_words() {
            let Some((call, target)) = self.call_before(ret) else { continue };
            let begins = self.function(here).map(|symbol| symbol.addr / self.session.scope.chip().word_bytes);
            // Without symbols every address behind a call is believed.
            if target.is_none_or(|target| begins.is_none_or(|begins| begins == target)) {
                found.push(call);
                here = call;
            }
            if found.len() >= DEEPEST {
                break;
            }
        }
        found
    }

    /// The function that a program word belongs to.
    fn function(&self, word: u32) -> Option<&SymbolAt> {
        let scope = &self.session.scope;
        let byte = word.saturating_mul(scope.chip().word_bytes);
        let code = scope.symbols.iter().filter(|s| s.space == scope.chip().code && s.addr <= byte);
        // Labels within a function have no size.
        code.filter(|s| s.size > 0 && byte - s.addr < s.size).max_by_key(|s| s.addr)
    }

    /// The call whose return address this is, and where it goes, if it says so.
    fn call_before(&mut self, ret: u32) -> Option<(u32, Option<u32>)> {
        const LONGEST: u32 = 3;
        (1..=LONGEST).find_map(|len| {
            let at = ret.checked_sub(len)?;
            let (flow, long) = self.session.flow(at);
            let chip = self.session.scope.chip();
            (flow == Flow::Call && long == len).then(|| (at, self.call_target(chip, at)))
        })
    }

    fn call_target(&self, chip: &Chip, at: u32) -> Option<u32> {
        let words = [self.session.word(at), self.session.word(at + 1), self.session.word(at + 2)];
        let line = (chip.isa.disassemble)(&words, at);
        let target = line.operands.iter().find(|(kind, _)| *kind == "target").map(|(_, value)| *value)?;
        Some(u32::try_from(target).ok()? / chip.word_bytes)
    }

    /// What may be return addresses on a stack in memory, the innermost first.
    fn stack_words(&self) -> Vec<u32> {
        let (target, chip) = (self.session.target(), self.session.scope.chip());
        let Some(sp) = target.reg("SP") else { return Vec::new() };
        let peek = |at: u32| target.peek(chip.ram, at);
        let pair = |high: u32, low: u32| Some(u32::from(peek(high)?) << 8 | u32::from(peek(low)?));
        let end = u32::from(chip.ram_start) + u32::from(chip.ram_len);
        let words = chip.flash / chip.word_bytes.max(1);
        let found: Vec<Option<u32>> = match chip.family {
            // It grows down, the high byte on top.
            Family::Avr => (sp + 1..end.min(sp.saturating_add(STACK))).map(|at| pair(at, at + 1)).collect(),
            Family::Mcs51 => (1..=sp.min(0xFF)).rev().map(|at| pair(at, at - 1)).collect(),
            Family::Pic16 | Family::Ap101 => Vec::new(),
        };
        found.into_iter().flatten().filter(|word| *word > 0 && *word < words).collect()
    }
}
