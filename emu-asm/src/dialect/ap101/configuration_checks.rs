//! Checks for words beyond program memory, and for uses of parts that the configuration does not have.

use std::ops::Range;

use super::{Ap101PassState, MAX_INPUTS, MAX_OUTPUTS, PROGRAM_WORDS};
use crate::engine::Assembler;
use crate::fault::LineFault;
use crate::lines::{AsmLine, trim};
use crate::output::ListedLine;
use crate::statement::code_end;

/// The last operation with the address of a bit.
const XOR: u16 = 0xA;
/// The bit for an address relative to RX, which is known only while the program runs.
const INDEXED: u16 = 0x800;

/// Reports the first line that overruns program memory into the block; returns whether there is one.
pub(super) fn report_overrun(asm: &mut Assembler<'_>, orgs: &[(usize, bool)]) -> bool {
    let mut orgs = orgs.iter().copied().peekable();
    let mut raw = false;
    let line = asm.out.list.iter().enumerate().find_map(|(i, listed)| {
        while let Some((_, here)) = orgs.next_if(|(from, _)| *from <= i) {
            raw = here;
        }
        let words = listed.bytes.len().div_ceil(2) as i64;
        (!raw && words > 0 && listed.addr + words > PROGRAM_WORDS).then(|| listed.line.clone())
    });
    let Some(line) = line else { return false };
    let hint = "make it shorter; put words of the configuration block itself after `org 0x800`";
    let at = trim(&line.text, 0..code_end(asm.dialect, &line.text));
    asm.line = Some(line);
    asm.report(LineFault::new("ASM020", at, "program memory ends at 07FFh", hint));
    true
}

/// Warns of channels and modules beyond the configuration, and of programs that end after the last word. Does
/// nothing if the source gives the words of the block itself, or if an error has left words undefined.
pub(super) fn warn_beyond_configuration(asm: &mut Assembler<'_>, state: &Ap101PassState) {
    let ends = asm.out.list.iter().filter(|listed| listed.unit == 2 && !listed.bytes.is_empty());
    let end = ends.map(|listed| listed.addr + listed.bytes.len() as i64 / 2).max().unwrap_or(0);
    if end > PROGRAM_WORDS || asm.error_count() > 0 {
        return;
    }
    let mut found: Vec<(AsmLine, LineFault)> = Vec::new();
    for (program, (line, at)) in state.programs.iter().zip(&state.program_ends) {
        if i64::from(program[1]) >= end && end > 0 {
            let cause = format!("the program ends at 0x{:03X}, after the last given word", program[1]);
            let hint = format!("the last word is 0x{:03X}; those after it are NOPs", end - 1);
            found.push((line.clone(), LineFault::new("ASM061", at.clone(), cause, hint)));
        }
    }
    for listed in asm.out.list.iter().filter(|listed| listed.unit == 2) {
        let fault = operand(asm, listed).zip(word(asm, listed)).and_then(|(at, word)| address_fault(state, word, at));
        found.extend(fault.map(|fault| (listed.line.clone(), fault)));
    }
    for (line, fault) in found {
        asm.line = Some(line);
        asm.report(fault.warning());
    }
}

/// Returns the first word of a line.
fn word(asm: &Assembler<'_>, listed: &ListedLine) -> Option<u16> {
    let bytes = asm.out.bytes.get(listed.bytes.clone())?;
    Some(u16::from_le_bytes([*bytes.first()?, *bytes.get(1)?]))
}

/// Returns the operands of the instruction of a line; data has none.
fn operand(asm: &Assembler<'_>, listed: &ListedLine) -> Option<Range<usize>> {
    let text: &str = &listed.line.text;
    let (end, mut from) = (code_end(asm.dialect, text), 0);
    loop {
        let head = asm.parse_head(text, from, end);
        let word = text.get(head.word)?.to_ascii_lowercase();
        if !word.is_empty() {
            let instruction = word == "tim" || !asm.table.forms(&word).is_empty();
            return instruction.then(|| trim(text, head.rest));
        }
        if head.label.is_none() || head.rest.start <= from {
            return None;
        }
        from = head.rest.start;
    }
}

/// Returns what is wrong with the address in a word.
fn address_fault(state: &Ap101PassState, word: u16, at: Range<usize>) -> Option<LineFault> {
    if word >> 12 > XOR || word & INDEXED != 0 {
        return None;
    }
    let (inputs, outputs) = state.channels.unwrap_or((MAX_INPUTS as u16, MAX_OUTPUTS as u16));
    let (zone, n) = (word % INDEXED / 512, word % 512);
    let (what, hint) = match zone {
        0 if n >= inputs => (format!("channel I{n}"), format!("there are {inputs} inputs; `channels` says how many")),
        1 if n >= outputs => {
            (format!("channel E{n}"), format!("there are {outputs} outputs; `channels` says how many"))
        }
        2 if !state.modules.get(usize::from(n % 128)).is_some_and(Option::is_some) => {
            (format!("module R{}", n % 128), format!("write `module R{}, TON, 100ms, 50`, or another type", n % 128))
        }
        _ => return None,
    };
    let cause = format!("the configuration has no {what}: it reads 0, and writing it does nothing");
    Some(LineFault::new("ASM061", at, cause, hint))
}
