//! The disassembly of the program as a source: every instruction with its address, symbols, rungs and
//! elements.

use emu_debug::debug::DebugSession;

use crate::files::LineStart;
use crate::ladder_source::LadderSource;

/// Minimum number of consecutive erased words that are left out.
const ERASED_RUN: u32 = 4;

/// The text of the disassembly, and the instructions in its lines.
pub(crate) struct DisassemblyListing {
    text: String,
    /// Instructions as (line from 1, program word), both ascending.
    lines: Vec<(u32, u32)>,
    /// Start of every instruction in program memory, including erased memory.
    starts: Vec<u32>,
}

impl DisassemblyListing {
    /// Disassembles the current contents of program memory.
    pub fn new(session: &DebugSession, ladder: Option<&LadderSource>) -> DisassemblyListing {
        let scope = &session.scope;
        let (chip, names) = (scope.chip(), scope.source().names);
        let words = chip.flash_bytes / chip.word_bytes.max(1);
        let mut listing = DisassemblyListing { text: String::new(), lines: Vec::new(), starts: Vec::new() };
        let mut number = 0;
        let mut push = |text: &mut String, line: String| {
            number += 1;
            text.push_str(&line);
            text.push('\n');
            number
        };
        let mut word = 0;
        while word < words {
            let erased = (word..words).take_while(|at| session.word(*at) == chip.isa.erased_word).count() as u32;
            if erased >= ERASED_RUN {
                listing.starts.extend(word..word + erased);
                word += erased;
                push(&mut listing.text, "        ..".to_owned());
                continue;
            }
            let here = [session.word(word), session.word(word + 1), session.word(word + 2)];
            let line = (chip.isa.disassemble)(&here, word);
            let len = (line.len as u32).max(1);
            if let Some(label) = names.nearest_symbol(word * chip.word_bytes).filter(|label| !label.contains("+0x")) {
                push(&mut listing.text, format!("{label}:"));
            }
            for head in ladder.into_iter().flat_map(|ladder| ladder.headings_at(word)) {
                push(&mut listing.text, head);
            }
            let (address, bytes) = (chip.code_address(word), hex_words(session, word, len));
            let at = push(&mut listing.text, format!("{address:04x}    {bytes:<9}  {}", line.text));
            listing.lines.push((at, word));
            listing.starts.push(word);
            word += len;
        }
        listing
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The line that contains a program word.
    pub fn line_of(&self, word: u32) -> Option<u32> {
        let after = self.lines.partition_point(|(_, at)| *at <= word);
        self.lines.get(after.checked_sub(1)?).map(|(line, _)| *line)
    }

    /// Returns the first instruction at or after a line, with its line.
    pub fn word_at(&self, line: u32) -> Option<LineStart> {
        let &(line, word) = self.lines.get(self.lines.partition_point(|(at, _)| *at < line))?;
        Some(LineStart { word, line })
    }

    /// The instruction that is `instructions` instructions before the program word.
    pub fn instruction_before(&self, word: u32, instructions: usize) -> Option<u32> {
        let at = self.starts.partition_point(|start| *start < word);
        self.starts.get(at.checked_sub(instructions)?).copied()
    }
}

/// Program words as hexadecimal digits.
pub(crate) fn hex_words(session: &DebugSession, word: u32, len: u32) -> String {
    let digits = if session.scope.chip().word_bytes == 1 { 2 } else { 4 };
    let words = (0..len).map(|n| format!("{:0digits$x}", session.word(word.saturating_add(n))));
    words.collect::<Vec<_>>().join(" ")
}
