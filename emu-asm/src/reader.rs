//! Which line comes next: files, macros and repetitions within each other, and conditions.

use std::ops::Range;
use std::rc::Rc;

use crate::arguments::{Join, put_in};
use crate::dialect::Flow;
use crate::engine::{Asm, Call};
use crate::fault::Fault;
use crate::macros::Param;
use crate::text::{Line, trim};

/// Whether the lines behind a directive are read.
type Condition = fn(&mut Asm<'_>, &Call<'_>) -> bool;

/// Includes within each other.
const INCLUDES: usize = 32;
/// Macros and repetitions within each other.
const MACROS: usize = 64;
/// Turns of a `while`.
const TURNS: u32 = 65_536;
/// Lines that a program may come to in one pass, and in all.
const LINES: u64 = 1_000_000;

/// A text that is being read.
#[derive(Debug)]
pub(crate) struct Frame {
    lines: Rc<[Line]>,
    next: usize,
    /// Conditions that were open before it.
    conds: usize,
    /// What is done when it is at its end.
    kind: Turn,
    /// Macro, and the file and line that called it.
    pub called: Option<(String, u32, u32)>,
}

/// What is done at the end of a text.
#[derive(Debug)]
enum Turn {
    /// It is a file.
    File,
    /// It is the body of a macro.
    Macro,
    /// It is read again so many times.
    Again(u64),
    /// It is read again for each of these texts, the last first.
    Texts(String, Vec<String>, Rc<[Line]>, Join),
    /// It is read again while the condition of this line holds, from this byte on; the turns so far.
    While(Line, usize, u32),
}

/// An open condition.
#[derive(Debug, Clone)]
pub(crate) struct Cond {
    /// The lines here are read.
    pub holds: bool,
    /// One of its parts was read, or none will be.
    pub done: bool,
    /// The last part has come.
    pub last: bool,
    /// Where it began.
    pub line: Option<Line>,
}

/// Lines between a directive and the one that ends it.
pub(crate) type Block = Rc<[Line]>;

/// A macro.
#[derive(Debug)]
pub(crate) struct Macro {
    /// Its name as written.
    pub name: String,
    /// Its parameters.
    pub params: Vec<Param>,
    /// Names that are others in each call.
    pub locals: Vec<String>,
    /// Its lines.
    pub body: Rc<[Line]>,
    /// What joins arguments to the text beside them.
    pub join: Join,
}

impl Asm<'_> {
    /// Reads the text `file` to its end, with all that it includes.
    pub fn read(&mut self, file: u32) {
        if !self.is_text(file, 0..0) {
            return;
        }
        let lines = self.lines_of(file);
        self.push(lines, Turn::File, None);
        while let Some(line) = self.next_line() {
            self.line = Some(line.clone());
            self.statement(&line);
            if self.ended {
                break;
            }
        }
        self.line = None;
    }

    /// The lines of a file as the dialect takes them.
    fn lines_of(&self, file: u32) -> Rc<[Line]> {
        let lines = self.texts.lines(file);
        let plain = self.d.hooks.plain_backslashes;
        match lines.iter().any(|line| plain(line).is_some()) {
            true => lines.iter().map(|line| plain(line).unwrap_or_else(|| line.clone())).collect(),
            false => lines,
        }
    }

    /// Tells of a text in an encoding that is not read.
    fn is_text(&mut self, file: u32, at: Range<usize>) -> bool {
        let Some(encoding) = self.texts.encoding(file) else { return true };
        let cause = format!("`{}` is written in {encoding}", self.texts.name(file));
        self.tell(Fault::new("ASM035", at, cause, "save it as UTF-8"));
        false
    }

    fn push(&mut self, lines: Rc<[Line]>, kind: Turn, called: Option<(String, u32, u32)>) {
        self.frames.push(Frame { lines, next: 0, conds: self.conds.len(), kind, called });
    }

    fn next_line(&mut self) -> Option<Line> {
        loop {
            let frame = self.frames.last_mut()?;
            if let Some(line) = frame.lines.get(frame.next) {
                frame.next += 1;
                let line = line.clone();
                return self.count(1).then_some(line);
            }
            self.end_of_text();
            if self.ended {
                return None;
            }
        }
    }

    /// Counts lines; false, and told, when there are too many.
    fn count(&mut self, lines: u64) -> bool {
        self.lines_read += lines;
        let most = LINES * u64::from(self.pass.min(4));
        if self.lines_read <= most {
            return true;
        }
        let cause = format!("the program comes to more than {LINES} lines");
        self.tell(Fault::new("ASM017", 0..0, cause, "look for a repetition or a macro that calls itself"));
        self.ended = true;
        false
    }

    /// So many lines were read in all passes that another pass may be too much.
    pub fn tired(&self) -> bool {
        self.lines_read > 3 * LINES
    }

    fn end_of_text(&mut self) {
        let Some(frame) = self.frames.last_mut() else { return };
        let open = frame.conds;
        let mut kind = std::mem::replace(&mut frame.kind, Turn::File);
        while self.conds.len() > open {
            let begun = self.conds.pop().and_then(|cond| cond.line);
            let now = std::mem::replace(&mut self.line, begun);
            let all = 0..self.line.as_ref().map_or(0, |line| line.text.trim_end().len());
            self.tell(Fault::new(
                "ASM012",
                all,
                "the condition is not closed",
                "close it with endif in the same file or macro",
            ));
            self.line = now;
        }
        let again = match &mut kind {
            Turn::File | Turn::Macro => None,
            Turn::Again(left) => {
                *left = left.saturating_sub(1);
                (*left > 0).then_some(None)
            }
            Turn::Texts(name, texts, body, join) => texts.pop().map(|text| {
                let values = [(name.clone(), text)];
                Some(body.iter().map(|line| put_in(self.d, line, &values, 0, *join)).collect())
            }),
            Turn::While(line, from, turns) => {
                *turns += 1;
                let (now, text) = (self.line.replace(line.clone()), line.text.clone());
                let holds =
                    self.number(&text, *from..crate::statement::code_end(self.d, &text)).is_some_and(|n| n != 0);
                if holds && *turns >= TURNS {
                    let cause = format!("the repetition comes to more than {TURNS} turns");
                    let hint = "its lines must change what the condition asks for";
                    self.tell(Fault::new("ASM017", trim(&text, 0..text.len()), cause, hint));
                    self.ended = true;
                    return;
                }
                self.line = now;
                holds.then_some(None)
            }
        };
        match again {
            Some(lines) => {
                if !self.count(1) {
                    return;
                }
                let Some(frame) = self.frames.last_mut() else { return };
                frame.kind = kind;
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

    /// The lines that are read now count.
    pub fn reading(&self) -> bool {
        self.conds.last().is_none_or(|cond| cond.holds)
    }

    /// A directive that decides which lines are read.
    pub fn flow(&mut self, flow: Flow, call: &Call<'_>) {
        match flow {
            Flow::If(holds) => {
                let reading = self.reading();
                let holds = reading && holds(self, call);
                self.conds.push(Cond { holds, done: holds || !reading, last: false, line: self.line.clone() });
            }
            Flow::Elif(holds) => self.otherwise(Some(holds), call),
            Flow::Else => self.otherwise(None, call),
            Flow::Endif => {
                if self.own_conds() == 0 {
                    return self.alone(call, "if");
                }
                self.conds.pop();
            }
            _ if !self.reading() => {}
            Flow::Macro => self.define_macro(call),
            Flow::Repeat(turns) => {
                let Some(body) = self.collect(call, flow) else { return };
                let turns = turns(self, call);
                self.repeat(turns, body, call);
            }
            Flow::While => {
                let Some(body) = self.collect(call, flow) else { return };
                let Some(line) = self.line.clone() else { return };
                if self.number(call.text, call.rest.clone()).is_some_and(|n| n != 0) && self.room(call) {
                    self.push(body, Turn::While(line, call.rest.start, 0), None);
                }
            }
            Flow::Block(run) => {
                if let Some(body) = self.collect(call, flow) {
                    run(self, call, body);
                }
            }
            Flow::EndBlock => self.alone(call, "cblock"),
            Flow::Endm => self.alone(call, "macro"),
            Flow::Endr => self.alone(call, "rept"),
            Flow::Endw => self.alone(call, "while"),
        }
    }

    fn own_conds(&self) -> usize {
        self.conds.len() - self.frames.last().map_or(0, |frame| frame.conds).min(self.conds.len())
    }

    fn alone(&mut self, call: &Call<'_>, partner: &str) {
        let code = if partner == "if" { "ASM012" } else { "ASM013" };
        let cause = format!("`{}` stands here without a `{partner}` before it", call.get(call.word.clone()));
        self.tell(Fault::new(code, call.word.clone(), cause, "remove it, or look for the line that it was to end"));
    }

    /// The next part of a condition; the last where none is asked.
    fn otherwise(&mut self, asked: Option<Condition>, call: &Call<'_>) {
        if self.own_conds() == 0 || self.conds.last().is_some_and(|cond| cond.last) {
            return self.alone(call, "if");
        }
        let open = self.conds.last().is_some_and(|cond| !cond.done);
        let holds = open && asked.is_none_or(|asked| asked(self, call));
        if let Some(cond) = self.conds.last_mut() {
            cond.holds = holds;
            cond.done |= holds;
            cond.last = asked.is_none();
        }
    }

    /// The lines up to the directive that ends what `call` has begun: `endm` a macro, `endr` or `endm` a repetition, `endw` a
    /// `while`, `endc` a block.
    pub fn collect(&mut self, call: &Call<'_>, opener: Flow) -> Option<Rc<[Line]>> {
        let mut open = vec![opener];
        let mut body = Vec::new();
        loop {
            let Some(line) = self.frames.last_mut().and_then(|frame| {
                frame.next += 1;
                frame.lines.get(frame.next - 1).cloned()
            }) else {
                let what = call.get(call.word.clone());
                let hint = "it ends with endm or endr (a while with endw, a cblock with endc) in the same file";
                self.tell(Fault::new("ASM013", call.word.clone(), format!("`{what}` is not closed"), hint));
                return None;
            };
            self.lines_read += 1;
            self.list(&line);
            let flow = self.flow_of(&line);
            match (flow, open.last()) {
                (Some(flow @ (Flow::Macro | Flow::Repeat(_) | Flow::While | Flow::Block(_))), _) => open.push(flow),
                (Some(Flow::Endm), Some(Flow::Macro | Flow::Repeat(_)))
                | (Some(Flow::Endr), Some(Flow::Repeat(_)))
                | (Some(Flow::Endw), Some(Flow::While))
                | (Some(Flow::EndBlock), Some(Flow::Block(_))) => {
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

    /// There is room for another macro or repetition.
    fn room(&mut self, call: &Call<'_>) -> bool {
        let depth = self.frames.iter().filter(|frame| !matches!(frame.kind, Turn::File)).count();
        if depth >= MACROS {
            let what = call.get(call.word.clone());
            let cause = format!("`{what}` is reached through {MACROS} macros and repetitions within each other");
            self.tell(Fault::new(
                "ASM014",
                call.word.clone(),
                cause,
                "a macro that calls itself needs a condition that ends it",
            ));
            self.unwind(1);
        }
        depth < MACROS
    }

    /// Goes back to the texts that were read first, so many of them.
    fn unwind(&mut self, left: usize) {
        while self.frames.len() > left {
            if let Some(frame) = self.frames.pop() {
                self.conds.truncate(frame.conds);
            }
        }
    }

    fn repeat(&mut self, turns: crate::dialect::Turns, body: Rc<[Line]>, call: &Call<'_>) {
        let crate::dialect::Turns { name, mut texts, count } = turns;
        if !self.room(call) {
            return;
        }
        match name {
            None if count > 0 => self.push(body, Turn::Again(count), None),
            None => {}
            Some(name) => {
                texts.reverse();
                self.push(
                    Rc::default(),
                    Turn::Texts(name, texts, body, Join::of(self.d, call.get(call.word.clone()))),
                    None,
                );
            }
        }
    }

    /// Reads a macro with its arguments put in.
    pub fn enter(&mut self, found: &Macro, lines: Vec<Line>, call: &Call<'_>) {
        if !self.room(call) {
            return;
        }
        let place = self.line.as_ref().map_or((0, 0), |line| (line.file, line.number));
        self.push(lines.into(), Turn::Macro, Some((found.name.clone(), place.0, place.1)));
    }

    /// Leaves the macro that is being read.
    pub fn leave_macro(&mut self, call: &Call<'_>) {
        if !self.frames.iter().any(|frame| matches!(frame.kind, Turn::Macro)) {
            return self.alone(call, "macro");
        }
        while let Some(frame) = self.frames.pop() {
            self.conds.truncate(frame.conds);
            if matches!(frame.kind, Turn::Macro) {
                break;
            }
        }
    }

    /// There is a file of this name for the text that is being read.
    pub fn can_open(&mut self, name: &str) -> bool {
        let from = self.line.as_ref().map_or(0, |line| line.file);
        self.files.open(name, self.texts.name(from)).is_ok()
    }

    /// Reads a file at this place.
    pub fn include(&mut self, name: &str, call: &Call<'_>) {
        let from = self.line.as_ref().map_or(0, |line| line.file);
        let depth = self.frames.iter().filter(|frame| matches!(frame.kind, Turn::File)).count();
        if depth >= INCLUDES {
            let cause = format!("`{name}` is reached through {INCLUDES} includes within each other");
            let hint = "a file that includes itself needs a condition around it";
            self.tell(Fault::new("ASM016", call.rest.clone(), cause, hint));
            return self.unwind(1);
        }
        let key = (name.to_owned(), from);
        let found = match self.opened.get(&key) {
            Some(found) => found.clone(),
            None => {
                let opened = self.files.open(name, self.texts.name(from));
                let found = match opened {
                    Ok((path, bytes)) => Ok(self.texts.add(&path, &bytes, self.d.block_comments)),
                    Err(error) => Err((format!("`{name}` cannot be read"), error.to_string())),
                };
                self.opened.insert(key, found.clone());
                found
            }
        };
        match found {
            Ok(file) => {
                if !self.is_text(file, call.rest.clone()) {
                    return;
                }
                let lines = self.lines_of(file);
                self.push(lines, Turn::File, None);
            }
            Err((cause, why)) => {
                self.tell(Fault::new(
                    "ASM015",
                    call.rest.clone(),
                    format!("{cause}: {why}"),
                    "check the path: it counts from the file that includes it",
                ));
            }
        }
    }
}
