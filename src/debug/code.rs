//! Commands about the program: instructions, source lines, the calls that led here.

use emu_core::chip::Family;
use emu_debug::debug::Flow;
use ladder_view::View;

use super::shell::{Done, Shell};

/// Instructions and lines that are shown at once.
const SHOWN: u32 = 10;

/// Words before the next instruction in which a function begins that `disas` shows from its beginning.
const NEAR: u32 = 24;

/// Frames that are shown at most.
const FRAMES: usize = 64;

pub(super) fn disas(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    let (place, count) = match args.rsplit_once(char::is_whitespace) {
        Some((place, count)) if count.parse::<u32>().is_ok() => (place.trim(), count.parse().unwrap_or(SHOWN)),
        _ => (args, SHOWN),
    };
    let word = if !place.is_empty() {
        shell.location(place)?.first().copied().unwrap_or_default()
    } else if let Some(next) = shell.disassembled() {
        next
    } else {
        shell.beginning()
    };
    let (text, next) = shell.instructions(word, count);
    shell.set_disassembled(next);
    out.push_str(&text);
    Ok(())
}

impl Shell {
    /// Where `disas` went on last, if the machine has not moved since.
    fn disassembled(&self) -> Option<u32> {
        self.disassembly.filter(|(at, _)| *at == self.session.target().cycle()).map(|(_, next)| next)
    }

    fn set_disassembled(&mut self, next: u32) {
        self.disassembly = Some((self.session.target().cycle(), next));
    }

    /// Where the function of the next instruction begins, if that is near.
    fn beginning(&self) -> u32 {
        let (pc, chip) = (self.session.target().pc(), self.session.scope.chip());
        let symbols = self.session.scope.symbols.iter().filter(|symbol| symbol.space == chip.code);
        let words = symbols.map(|symbol| symbol.addr / chip.word_bytes).filter(|word| *word <= pc);
        words.max().filter(|word| pc - word <= NEAR).unwrap_or(pc)
    }

    /// Some instructions as text, and the word behind them.
    pub(super) fn instructions(&self, from: u32, count: u32) -> (String, u32) {
        let (chip, source) = (self.session.scope.chip(), self.session.scope.source());
        let (mut text, mut word, pc) = (String::new(), from, self.session.target().pc());
        let end = chip.flash / chip.word_bytes.max(1);
        for _ in 0..count {
            if word >= end {
                break;
            }
            let labels = source.names.symbols.iter();
            let labels = labels.filter(|s| s.space == chip.code && s.addr == word * chip.word_bytes);
            labels.for_each(|label| text.push_str(&format!("{}:\n", label.name)));
            let rung = self.view.iter().flat_map(View::rung_words).find(|(_, start)| *start == word);
            rung.iter().for_each(|(rung, _)| text.push_str(&format!("; rung {rung}\n")));
            let line = self.instruction(word);
            let here = if word == pc { "=>" } else { "  " };
            let meant = source.operands(&line.operands).join(", ");
            let meant = if meant.is_empty() { meant } else { format!("  ; {meant}") };
            text.push_str(&format!("{here} 0x{:04x}  {}{meant}\n", chip.code_address(word), line.text));
            word += line.len.max(1) as u32;
        }
        (text, word)
    }

    /// Return addresses of open calls, as program words, the innermost first: places on the stack that follow a call.
    pub(super) fn frames(&self) -> Vec<u32> {
        let (chip, target) = (self.session.scope.chip(), self.session.target());
        let peek = |addr: u32| target.peek(chip.ram, addr).unwrap_or(0);
        let sp = target.reg("SP").unwrap_or(0);
        let mut frames = Vec::new();
        match chip.family {
            Family::Avr => {
                let end = u32::from(chip.ram_start) + u32::from(chip.ram_len);
                let mut at = sp + 1;
                while at + 1 < end && frames.len() < FRAMES {
                    // The higher byte lies lower.
                    let word = u32::from(peek(at)) << 8 | u32::from(peek(at + 1));
                    let found = self.follows_call(word);
                    frames.extend(found.then_some(word));
                    at += if found { 2 } else { 1 };
                }
            }
            Family::Mcs51 => {
                let mut at = sp;
                while at > 0x08 && frames.len() < FRAMES {
                    let word = u32::from(peek(at)) << 8 | u32::from(peek(at - 1));
                    let found = self.follows_call(word);
                    frames.extend(found.then_some(word));
                    at -= if found { 2 } else { 1 };
                }
            }
            Family::Pic16 => {
                let stack = target.return_stack().into_iter().take(target.depth() as usize);
                frames.extend(stack.filter(|word| self.follows_call(*word)));
            }
            Family::Ap101 => {}
        }
        frames
    }

    /// The instruction before a program word is a call.
    fn follows_call(&self, word: u32) -> bool {
        let chip = self.session.scope.chip();
        (1..=3).filter_map(|len| Some((len, word.checked_sub(len)?))).any(|(len, start)| {
            emu_debug::debug::flow(chip, |word| self.session.word(word), start) == (Flow::Call, len)
        })
    }

    /// There may be something to return to: a call, or an interrupt, of which the stack does not tell.
    pub(super) fn may_return(&self) -> bool {
        let (chip, target) = (self.session.scope.chip(), self.session.target());
        if !self.frames().is_empty() {
            return true;
        }
        let sp = target.reg("SP").unwrap_or(0);
        match chip.family {
            // An entry clears the flag I, and leaves two bytes.
            Family::Avr => {
                let end = u32::from(chip.ram_start) + u32::from(chip.ram_len);
                sp != 0 && sp + 2 < end && target.reg("SREG").unwrap_or(0) & 0x80 == 0
            }
            Family::Mcs51 => sp > 0x08 && target.peek("sfr", 0xA8).unwrap_or(0) & 0x80 != 0,
            Family::Pic16 => target.depth() > 0,
            Family::Ap101 => false,
        }
    }
}

pub(super) fn backtrace(shell: &mut Shell, _: &str, out: &mut String) -> Done {
    let source = shell.session.scope.source();
    out.push_str(&format!("#0  {}\n", source.place(shell.session.target().pc())));
    for (n, word) in (1..).zip(shell.frames()) {
        out.push_str(&format!("#{n}  {}\n", source.place(word)));
    }
    Ok(())
}

pub(super) fn list(shell: &mut Shell, args: &str, out: &mut String) -> Done {
    if shell.view.is_some() {
        return super::rungs::list(shell, args, out);
    }
    let go_on = shell.listed.clone().filter(|_| args.is_empty());
    let (file, first) = match go_on {
        Some((file, next)) => (file, next),
        None => {
            let word = match args {
                "" => shell.session.target().pc(),
                place => shell.location(place)?.first().copied().unwrap_or_default(),
            };
            let line = shell.session.scope.source().line_at(word).cloned();
            let line = line.ok_or("there is no source line here; disas shows the instructions")?;
            (line.file.to_string(), line.line.saturating_sub(SHOWN / 2).max(1))
        }
    };
    let pc = shell.session.scope.source().line_at(shell.session.target().pc()).cloned();
    let here = pc.filter(|line| *line.file == *file).map(|line| line.line);
    let lines = shell.sources.file(&shell.session.scope.lines, &file);
    let lines = lines.ok_or_else(|| format!("the source file {file} is not found"))?;
    let shown: Vec<(u32, &String)> =
        (1..).zip(lines).skip(first.saturating_sub(1) as usize).take(SHOWN as usize).collect();
    if shown.is_empty() {
        return Err(format!("{file} ends before line {first}"));
    }
    for (number, text) in &shown {
        let mark = if here == Some(*number) { "=>" } else { "  " };
        out.push_str(format!("{mark}{number:>5}  {text}").trim_end());
        out.push('\n');
    }
    shell.listed = Some((file, first + shown.len() as u32));
    Ok(())
}
