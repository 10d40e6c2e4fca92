//! Finds the next line: nested files, macros and repetitions, and conditions.

mod included_files;

use std::ops::Range;
use std::rc::Rc;

use crate::NamedText;
use crate::arguments::{ArgumentJoin, substitute_parameters};
use crate::dialect::ReadFlow;
use crate::engine::{Assembler, DirectiveCall};
use crate::fault::LineFault;
use crate::lines::{AsmLine, RewrittenText, trim};
use crate::macros::MacroParameter;

/// Decides whether the lines after a directive are read.
type ReadCondition = fn(&mut Assembler<'_>, &DirectiveCall<'_>) -> bool;

/// The maximum nesting of includes.
const MAX_INCLUDES: usize = 32;
/// The maximum nesting of macros and repetitions.
const MAX_MACRO_DEPTH: usize = 64;
/// The maximum number of iterations of a `while`.
const MAX_WHILE_ITERATIONS: u32 = 65_536;
/// The maximum length in bytes of a line to which others are joined.
const MAX_JOINED_BYTES: usize = 1 << 16;
/// The maximum number of lines of a program in one pass; all passes may read four times as many.
const MAX_LINES: u64 = 1_000_000;

/// A text that is being read.
#[derive(Debug)]
pub(crate) struct TextFrame {
    lines: Rc<[AsmLine]>,
    next: usize,
    /// Number of conditions that were open before it.
    open_conditions: usize,
    /// What happens at its end.
    at_end: FrameEnd,
    /// The macro, and the file and line that called it.
    pub called_from: Option<(String, u32, u32)>,
    /// Number of arguments given to the macro.
    given: usize,
}

/// What happens at the end of a text.
#[derive(Debug)]
enum FrameEnd {
    /// It is a file.
    File,
    /// It is the body of a macro.
    Macro,
    /// It is read this many times more.
    Again(u64),
    /// It is read again for each of these texts, the last first.
    Texts(String, Vec<String>, Rc<[AsmLine]>, ArgumentJoin),
    /// It is read again while the condition in this line, from this byte on, holds; and the number of
    /// iterations so far.
    While(AsmLine, usize, u32),
}

/// An open condition.
#[derive(Debug, Clone)]
pub(crate) struct OpenCondition {
    /// The lines here are read.
    pub holds: bool,
    /// A branch was read, or none will be.
    pub branch_taken: bool,
    /// The last branch (`else`) was reached.
    pub else_seen: bool,
    /// Its first condition holds.
    pub true_value: bool,
    /// The lines around it are read.
    pub outer: bool,
    /// Where it began.
    pub line: Option<AsmLine>,
}

/// Lines between a directive and the one that ends it.
pub(crate) type LineBlock = Rc<[AsmLine]>;

/// A macro.
#[derive(Debug)]
pub(crate) struct AsmMacro {
    /// Its name as written.
    pub name: String,
    /// Its parameters.
    pub params: Vec<MacroParameter>,
    /// Names that are unique in each call.
    pub locals: Vec<String>,
    /// Its lines.
    pub body: Rc<[AsmLine]>,
    /// The mark that joins arguments to adjacent text.
    pub join: ArgumentJoin,
}

impl Assembler<'_> {
    /// Reads the text `file` to its end, with all that it includes.
    pub fn read_file(&mut self, file: u32) {
        if !self.check_encoding(file, 0..0) {
            return;
        }
        let lines = self.lines_of(file);
        self.push_frame(lines, FrameEnd::File, None);
        while let Some(line) = self.next_whole_line() {
            self.line = Some(line.clone());
            self.read_statement(&line);
            if self.ended {
                break;
            }
        }
        self.line = None;
    }

    /// Returns the lines of a file as the dialect reads them.
    fn lines_of(&self, file: u32) -> Rc<[AsmLine]> {
        let lines = self.texts.lines(file);
        let plain = self.dialect.hooks.plain_backslashes;
        match lines.iter().any(|line| plain(line).is_some()) {
            true => lines.iter().map(|line| plain(line).unwrap_or_else(|| line.clone())).collect(),
            false => lines,
        }
    }

    /// Reports a text with an encoding that is not supported.
    fn check_encoding(&mut self, file: u32, at: Range<usize>) -> bool {
        let Some(encoding) = self.texts.encoding(file) else { return true };
        let cause = format!("`{}` is written in {encoding}", self.texts.name(file));
        self.report(LineFault::new("ASM035", at, cause, "save it as UTF-8"));
        false
    }

    fn push_frame(&mut self, lines: Rc<[AsmLine]>, kind: FrameEnd, called: Option<(String, u32, u32)>) {
        self.frames.push(TextFrame {
            lines,
            next: 0,
            open_conditions: self.conditions.len(),
            at_end: kind,
            called_from: called,
            given: 0,
        });
    }

    /// Returns the next line; for Atmel's assembler with the lines that a final backslash joins to it.
    fn next_whole_line(&mut self) -> Option<AsmLine> {
        let mut line = self.next_line()?;
        while self.dialect.hooks.is_atmel
            && let Some(front) = line.text.trim_end().strip_suffix('\\')
            && front.len() < MAX_JOINED_BYTES
            && let Some(next) = self.next_line()
        {
            let mut joined = RewrittenText::default();
            joined.copy(&line.text, 0..front.len());
            joined.put(&next.text, front.len());
            line = joined.into_line(&line);
        }
        Some(line)
    }

    fn next_line(&mut self) -> Option<AsmLine> {
        loop {
            let frame = self.frames.last_mut()?;
            if let Some(line) = frame.lines.get(frame.next) {
                frame.next += 1;
                let line = line.clone();
                return self.count_lines(1).then_some(line);
            }
            self.end_frame();
            if self.ended {
                return None;
            }
        }
    }

    /// Counts lines; reports an error and returns false if there are too many.
    fn count_lines(&mut self, lines: u64) -> bool {
        self.lines_read += lines;
        let most = MAX_LINES * u64::from(self.pass.min(4));
        if self.lines_read <= most {
            return true;
        }
        let cause = format!("the program has more than {MAX_LINES} lines");
        self.report(LineFault::new("ASM017", 0..0, cause, "look for a repetition or a macro that calls itself"));
        self.ended = true;
        false
    }

    /// Reports whether another pass may exceed the limit on lines.
    pub fn is_near_line_limit(&self) -> bool {
        self.lines_read > 3 * MAX_LINES
    }

    fn end_frame(&mut self) {
        let Some(frame) = self.frames.last_mut() else { return };
        let open = frame.open_conditions;
        let mut kind = std::mem::replace(&mut frame.at_end, FrameEnd::File);
        while self.conditions.len() > open {
            let begun = self.conditions.pop().and_then(|cond| cond.line);
            let now = std::mem::replace(&mut self.line, begun);
            let all = 0..self.line.as_ref().map_or(0, |line| line.text.trim_end().len());
            self.report(LineFault::new(
                "ASM012",
                all,
                "the condition is not closed",
                "close it with endif in the same file or macro",
            ));
            self.line = now;
        }
        let again = match &mut kind {
            FrameEnd::File | FrameEnd::Macro => None,
            FrameEnd::Again(left) => {
                *left = left.saturating_sub(1);
                (*left > 0).then_some(None)
            }
            FrameEnd::Texts(name, texts, body, join) => texts.pop().map(|text| {
                let values = [NamedText::new(name.as_str(), text)];
                Some(body.iter().map(|line| substitute_parameters(self.dialect, line, &values, 0, *join)).collect())
            }),
            FrameEnd::While(line, from, turns) => {
                *turns += 1;
                let (now, text) = (self.line.replace(line.clone()), line.text.clone());
                let holds = self
                    .evaluate_number(&text, *from..crate::statement::code_end(self.dialect, &text))
                    .is_some_and(|n| n != 0);
                if holds && *turns >= MAX_WHILE_ITERATIONS {
                    let cause = format!("the repetition has more than {MAX_WHILE_ITERATIONS} iterations");
                    let hint = "its lines must change a value of the condition";
                    self.report(LineFault::new("ASM017", trim(&text, 0..text.len()), cause, hint));
                    self.ended = true;
                    return;
                }
                self.line = now;
                holds.then_some(None)
            }
        };
        match again {
            Some(lines) => {
                if !self.count_lines(1) {
                    return;
                }
                let Some(frame) = self.frames.last_mut() else { return };
                frame.at_end = kind;
                frame.next = 0;
                if let Some(lines) = lines {
                    frame.lines = lines;
                }
            }
            None => {
                self.frames.pop();
            }
        }
    }

    /// Reports whether the current lines are read or skipped by a condition.
    pub fn is_reading(&self) -> bool {
        self.conditions.last().is_none_or(|cond| cond.holds)
    }

    /// Executes a directive that decides which lines are read.
    pub fn run_flow_directive(&mut self, flow: ReadFlow, call: &DirectiveCall<'_>) {
        match flow {
            ReadFlow::If(holds) => {
                let reading = self.is_reading();
                let holds = reading && holds(self, call);
                let line = self.line.clone();
                self.conditions.push(OpenCondition {
                    holds,
                    branch_taken: holds || !reading,
                    else_seen: false,
                    true_value: holds,
                    outer: reading,
                    line,
                });
            }
            ReadFlow::Elif(holds) => self.next_branch(Some(holds), call),
            ReadFlow::Else => self.next_branch(None, call),
            ReadFlow::Within(asked) | ReadFlow::WithinLine(asked) => self.within(flow, asked, call),
            ReadFlow::Endif => {
                if self.conditions_of_frame() == 0 {
                    return self.report_unmatched(call, "if");
                }
                self.conditions.pop();
            }
            _ if !self.is_reading() => {}
            ReadFlow::Macro => self.define_macro(call),
            ReadFlow::Repeat(turns) => {
                let Some(body) = self.collect_block(call, flow) else { return };
                let turns = turns(self, call);
                self.repeat(turns, body, call);
            }
            ReadFlow::While => {
                let Some(body) = self.collect_block(call, flow) else { return };
                let Some(line) = self.line.clone() else { return };
                if self.evaluate_number(call.text, call.rest.clone()).is_some_and(|n| n != 0) && self.check_depth(call)
                {
                    self.push_frame(body, FrameEnd::While(line, call.rest.start, 0), None);
                }
            }
            ReadFlow::Block(run) => {
                if let Some(body) = self.collect_block(call, flow) {
                    run(self, call, body);
                }
            }
            ReadFlow::EndBlock => self.report_unmatched(call, "cblock"),
            ReadFlow::Endm => self.report_unmatched(call, "macro"),
            ReadFlow::Endr => self.report_unmatched(call, "rept"),
            ReadFlow::Endw => self.report_unmatched(call, "while"),
        }
    }

    /// Enters lines, or the statement after the directive, that are read depending on whether the enclosing
    /// condition holds.
    fn within(&mut self, flow: ReadFlow, asked: fn(bool) -> bool, call: &DirectiveCall<'_>) {
        let family_state = self.conditions_of_frame() > 0;
        let Some(cond) = self.conditions.last_mut().filter(|_| family_state) else {
            return self.report_unmatched(call, "if");
        };
        let holds = cond.outer && asked(cond.true_value);
        let before = std::mem::replace(&mut cond.holds, holds);
        if matches!(flow, ReadFlow::Within(_)) {
            return;
        }
        if holds {
            self.inner_statement(call, call.rest.start);
        }
        if let Some(cond) = self.conditions.last_mut() {
            cond.holds = before;
        }
    }

    fn conditions_of_frame(&self) -> usize {
        self.conditions.len() - self.frames.last().map_or(0, |frame| frame.open_conditions).min(self.conditions.len())
    }

    fn report_unmatched(&mut self, call: &DirectiveCall<'_>, partner: &str) {
        let code = if partner == "if" { "ASM012" } else { "ASM013" };
        let cause = format!("`{}` is here without a `{partner}` before it", call.get(call.word.clone()));
        self.report(LineFault::new(
            code,
            call.word.clone(),
            cause,
            "remove it, or look for the line that it was to end",
        ));
    }

    /// Enters the next branch of a condition; the last branch if `asked` is `None`.
    fn next_branch(&mut self, asked: Option<ReadCondition>, call: &DirectiveCall<'_>) {
        if self.conditions_of_frame() == 0 || self.conditions.last().is_some_and(|cond| cond.else_seen) {
            return self.report_unmatched(call, "if");
        }
        let open = self.conditions.last().is_some_and(|cond| !cond.branch_taken);
        let holds = open && asked.is_none_or(|asked| asked(self, call));
        if let Some(cond) = self.conditions.last_mut() {
            cond.holds = holds;
            cond.branch_taken |= holds;
            cond.else_seen = asked.is_none();
        }
    }

    /// Returns the lines up to the directive that ends the block of `call`: `endm` for a macro, `endr` or
    /// `endm` for a repetition, `endw` for a `while`, `endc` for a block.
    pub fn collect_block(&mut self, call: &DirectiveCall<'_>, opener: ReadFlow) -> Option<Rc<[AsmLine]>> {
        let mut open = vec![opener];
        let mut body = Vec::new();
        loop {
            let Some(line) = self.frames.last_mut().and_then(|frame| {
                frame.next += 1;
                frame.lines.get(frame.next - 1).cloned()
            }) else {
                let what = call.get(call.word.clone());
                let hint = "it ends with endm or endr (a while with endw, a cblock with endc) in the same file";
                self.report(LineFault::new("ASM013", call.word.clone(), format!("`{what}` is not closed"), hint));
                return None;
            };
            self.lines_read += 1;
            self.begin_listing_line(&line);
            let flow = self.flow_of(&line);
            match (flow, open.last()) {
                (Some(flow @ (ReadFlow::Macro | ReadFlow::Repeat(_) | ReadFlow::While | ReadFlow::Block(_))), _) => {
                    open.push(flow)
                }
                (Some(ReadFlow::Endm), Some(ReadFlow::Macro | ReadFlow::Repeat(_)))
                | (Some(ReadFlow::Endr), Some(ReadFlow::Repeat(_)))
                | (Some(ReadFlow::Endw), Some(ReadFlow::While))
                | (Some(ReadFlow::EndBlock), Some(ReadFlow::Block(_))) => {
                    open.pop();
                }
                _ => {}
            }
            if open.is_empty() {
                return Some(body.into());
            }
            body.push(line);
        }
    }

    /// Reports whether another macro or repetition may be nested; reports an error if not.
    fn check_depth(&mut self, call: &DirectiveCall<'_>) -> bool {
        let depth = self.frames.iter().filter(|frame| !matches!(frame.at_end, FrameEnd::File)).count();
        if depth >= MAX_MACRO_DEPTH {
            let what = call.get(call.word.clone());
            let cause =
                format!("`{what}` is reached through {MAX_MACRO_DEPTH} macros and repetitions within each other");
            self.report(LineFault::new(
                "ASM014",
                call.word.clone(),
                cause,
                "a macro that calls itself needs a condition that ends it",
            ));
            self.unwind(1);
        }
        depth < MAX_MACRO_DEPTH
    }

    /// Drops texts until `left` remain.
    fn unwind(&mut self, left: usize) {
        while self.frames.len() > left {
            if let Some(frame) = self.frames.pop() {
                self.conditions.truncate(frame.open_conditions);
            }
        }
    }

    fn repeat(&mut self, turns: crate::dialect::RepeatIterations, body: Rc<[AsmLine]>, call: &DirectiveCall<'_>) {
        let crate::dialect::RepeatIterations { name, mut texts, count } = turns;
        if !self.check_depth(call) {
            return;
        }
        match name {
            None if count > 0 => self.push_frame(body, FrameEnd::Again(count), None),
            None => {}
            Some(name) => {
                texts.reverse();
                self.push_frame(
                    Rc::default(),
                    FrameEnd::Texts(name, texts, body, ArgumentJoin::of(self.dialect, call.get(call.word.clone()))),
                    None,
                );
            }
        }
    }

    /// Reads a macro with its arguments substituted.
    pub fn enter_macro(&mut self, found: &AsmMacro, lines: Vec<AsmLine>, given: usize, call: &DirectiveCall<'_>) {
        if !self.check_depth(call) {
            return;
        }
        let place = self.line.as_ref().map_or((0, 0), |line| (line.file, line.number));
        self.push_frame(lines.into(), FrameEnd::Macro, Some((found.name.clone(), place.0, place.1)));
        if let Some(frame) = self.frames.last_mut() {
            frame.given = given;
        }
    }

    /// Returns the number of arguments of the current macro.
    pub fn arguments_given(&self) -> Option<i64> {
        self.frames.iter().rev().find(|frame| matches!(frame.at_end, FrameEnd::Macro)).map(|frame| frame.given as i64)
    }

    /// Leaves the current macro.
    pub fn leave_macro(&mut self, call: &DirectiveCall<'_>) {
        if !self.frames.iter().any(|frame| matches!(frame.at_end, FrameEnd::Macro)) {
            return self.report_unmatched(call, "macro");
        }
        while let Some(frame) = self.frames.pop() {
            self.conditions.truncate(frame.open_conditions);
            if matches!(frame.at_end, FrameEnd::Macro) {
                break;
            }
        }
    }
}
