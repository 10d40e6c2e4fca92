//! Locations of breakpoints on functions and source lines, as in gdb.

use emu_core::image::{BlockInfo, FunctionInfo};

use super::scope::NameScope;

impl NameScope {
    /// Returns the program words of a function by its name, or by `file.c:name`: of all functions with that
    /// name, and of inlined copies. If variables have their locations only after the prologue, the word is
    /// after the prologue. Empty if there is no such function.
    #[must_use]
    pub fn function_words(&self, text: &str) -> Vec<u32> {
        let (file, name) = text.rsplit_once(':').map_or((None, text), |(file, name)| (Some(file), name));
        let info = &self.calls().info;
        let mut found = Vec::new();
        for function in info.functions.iter().filter(|own| file.is_none_or(|file| info.is_defined_in(own, file))) {
            if function.name == name {
                found.extend(first_byte(&function.block).map(|byte| self.byte_after_prologue(function, byte)));
            }
            let mut blocks: Vec<&BlockInfo> = function.block.blocks.iter().collect();
            while let Some(block) = blocks.pop() {
                if block.inlined.as_deref() == Some(name) {
                    found.extend(first_byte(block));
                }
                blocks.extend(&block.blocks);
            }
        }
        self.words_of(found)
    }

    /// Returns the first program words of the functions with a name, or of `file.c:name`.
    #[must_use]
    pub fn function_starts(&self, text: &str) -> Vec<u32> {
        let (file, name) = text.rsplit_once(':').map_or((None, text), |(file, name)| (Some(file), name));
        let info = &self.calls().info;
        let named = info.functions.iter().filter(|own| own.name == name);
        let named = named.filter(|own| file.is_none_or(|file| info.is_defined_in(own, file)));
        self.words_of(named.filter_map(|own| first_byte(&own.block)).collect())
    }

    /// Returns the program words of a source line from the byte addresses at which its code begins: only the
    /// first in each block of a function.
    #[must_use]
    pub fn line_words(&self, bytes: &[u32]) -> Vec<u32> {
        let info = &self.calls().info;
        let mut seen: Vec<&BlockInfo> = Vec::new();
        let mut found = Vec::new();
        for &byte in bytes {
            let Some(function) = info.function_at(byte) else {
                found.push(byte);
                continue;
            };
            if let Some(&block) = function.block.blocks_around(byte).first() {
                if seen.iter().any(|own| std::ptr::eq(*own, block)) {
                    continue;
                }
                seen.push(block);
            }
            found.push(self.byte_after_prologue(function, byte));
        }
        self.words_of(found)
    }

    /// Returns the word after the prologue of the function that begins at a word; `None` if no function
    /// begins there, or if it has no second row in the line table.
    #[must_use]
    pub fn word_after_prologue(&self, word: u32) -> Option<u32> {
        let (byte, width) = (word.saturating_mul(self.chip().word_bytes), self.chip().word_bytes.max(1));
        let function = self.calls().info.function_at(byte)?;
        self.second_row(function, byte).map(|byte| byte / width)
    }

    fn byte_after_prologue(&self, function: &FunctionInfo, byte: u32) -> u32 {
        let has = self.calls().info.has_prologue(function);
        self.second_row(function, byte).filter(|_| has).unwrap_or(byte)
    }

    /// Returns the second row of a function's line table, for any line, if `byte` is the function's first
    /// address.
    fn second_row(&self, function: &FunctionInfo, byte: u32) -> Option<u32> {
        let code = function.block.ranges.iter().find(|range| range.start == byte)?;
        if self.lines.is_doubled(byte) {
            return Some(byte);
        }
        let first = self.lines.line_at(byte, byte)?;
        let rows = self.lines.all_lines().iter().filter(|line| line.kind == first.kind && code.contains(&line.addr));
        rows.map(|line| line.addr).find(|addr| *addr > byte)
    }

    fn words_of(&self, bytes: Vec<u32>) -> Vec<u32> {
        let width = self.chip().word_bytes.max(1);
        let mut words: Vec<u32> = bytes.into_iter().map(|byte| byte / width).collect();
        words.sort_unstable();
        words.dedup();
        words
    }
}

/// Returns the first byte of a block.
fn first_byte(block: &BlockInfo) -> Option<u32> {
    block.ranges.iter().map(|range| range.start).min()
}
