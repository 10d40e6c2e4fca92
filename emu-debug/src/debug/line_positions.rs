//! Where steps by source lines end, with inlined functions as calls of their own, as in gdb.

use super::session::DebugSession;

/// What a step leaves: a line, its row of the line table, and the inlined functions around it, the outermost
/// first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineOrigin {
    /// The line that the step leaves.
    pub line: Option<FileLine>,
    /// First byte of its row of the line table.
    pub row: Option<u32>,
    /// The inlined functions around it, the outermost first.
    pub inlined: Vec<usize>,
}

/// The location of the machine in the line table and in inlined functions.
#[derive(Debug, Clone)]
pub struct LinePosition {
    line: Option<FileLine>,
    /// First byte of the row of the line table.
    pub row: Option<u32>,
    /// The machine is at the first instruction of the row.
    pub begins: bool,
    /// A statement of the source begins here (`is_stmt` of the line table).
    is_statement: bool,
    /// The inlined functions around it, the outermost first.
    pub inlined: Vec<usize>,
    /// Number of the innermost of these functions that begin here: their calls are not executed yet.
    pub not_entered: usize,
    /// The lines of their calls, the outermost first.
    calls: Vec<u32>,
}

/// A line of a source file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileLine {
    /// The file.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
}

impl LinePosition {
    /// Returns the line of the next instruction.
    #[must_use]
    pub fn line_of(session: &DebugSession) -> Option<FileLine> {
        let source = session.scope.source();
        let line = source.line_at(session.machine().pc())?;
        Some(FileLine { file: line.file.to_string(), line: line.line })
    }

    /// Returns where the machine is.
    #[must_use]
    pub fn of(session: &DebugSession) -> LinePosition {
        let (scope, pc) = (&session.scope, session.machine().pc());
        let byte = pc.saturating_mul(scope.chip().word_bytes);
        let row = scope.source().line_at(pc).map(|line| line.addr);
        let blocks = scope.calls().inlined(byte);
        LinePosition {
            line: LinePosition::line_of(session),
            row,
            begins: row == Some(byte),
            is_statement: scope.lines.begins_statement(byte),
            inlined: blocks.iter().rev().map(|block| std::ptr::from_ref(*block) as usize).collect(),
            not_entered: scope.calls().call_sites(byte),
            calls: blocks.iter().rev().map(|block| block.call_site.1).collect(),
        }
    }

    /// Returns the inlined functions that the machine is in, if `not_entered` of those around it are not
    /// entered yet.
    fn entered(&self, not_entered: usize) -> &[usize] {
        self.inlined.get(..self.inlined.len().saturating_sub(not_entered)).unwrap_or_default()
    }

    /// Returns the line of the next call of an inlined function, if `not_entered` of them are not entered
    /// yet.
    fn call(&self, not_entered: usize) -> Option<u32> {
        self.calls.get(self.inlined.len().checked_sub(not_entered)?).copied().filter(|_| not_entered > 0)
    }

    /// Returns what a step that starts here leaves, if `not_entered` inlined functions are still to be
    /// entered.
    #[must_use]
    pub fn origin(&self, not_entered: usize) -> LineOrigin {
        let line = self.line.clone().map(|own| FileLine { line: self.call(not_entered).unwrap_or(own.line), ..own });
        LineOrigin { line, row: self.row, inlined: self.entered(not_entered).to_vec() }
    }
}

/// What a step does at a position.
#[derive(Debug, Clone)]
pub enum StepVerdict {
    /// It continues.
    GoOn,
    /// It continues, and from now on it leaves this line.
    LeaveFrom(LineOrigin),
    /// It ends, before this number of calls of inlined functions.
    Stop(usize),
}

impl LineOrigin {
    /// Returns what a step does at a position: `over` calls or into them; `same_frame` is false if the
    /// function of the start has returned.
    #[must_use]
    pub fn verdict(&self, now: &LinePosition, over: bool, same_frame: bool) -> StepVerdict {
        let entered = now.entered(now.not_entered);
        if same_frame && entered == self.inlined && now.not_entered > 0 {
            // An inlined function begins.
            let is_own = self.line.as_ref().map(|line| line.line) == now.call(now.not_entered);
            return match (over, is_own) {
                (true, true) => StepVerdict::GoOn,
                (false, true) => StepVerdict::Stop(now.not_entered - 1),
                (_, false) => StepVerdict::Stop(now.not_entered),
            };
        }
        if same_frame && entered.len() > self.inlined.len() && entered.starts_with(&self.inlined) {
            return if over { StepVerdict::GoOn } else { StepVerdict::Stop(now.not_entered) };
        }
        let Some(FileLine { file, .. }) = &now.line else { return StepVerdict::Stop(now.not_entered) };
        match now.line != self.line && now.begins {
            true if now.is_statement => StepVerdict::Stop(now.not_entered),
            true if same_frame && entered == self.inlined => StepVerdict::GoOn,
            // The step has reached another function, but not at a place to stop: it stops at the next line.
            true => StepVerdict::LeaveFrom(LineOrigin {
                line: Some(FileLine { file: file.clone(), line: 0 }),
                ..now.origin(now.not_entered)
            }),
            // In the middle of a line, the step continues to the end of that line, as in gdb.
            false => StepVerdict::LeaveFrom(now.origin(now.not_entered)),
        }
    }
}
