//! Reads the text of grids.

use diag::{Diagnostic, Pos, Severity};

use super::checks::check;
use super::codes;
use super::model::{
    GridArea, GridCell, GridContact, GridOperand, GridOutput, GridOutputKind, GridProgram, LadderGrid, LinkShape,
};

const MAX_BYTES: usize = 4 << 20;
const MAX_ROWS: usize = 64;
const MAX_COLUMNS: usize = 63;
const MAX_GRIDS: usize = 1000;
const MAX_ERRORS: usize = 100;

struct GridReader<'a> {
    file: &'a str,
    program: GridProgram,
    /// The grid in work.
    grid: Option<LadderGrid>,
    comments: Vec<String>,
    has_head: bool,
    diagnostics: Vec<Diagnostic>,
}

/// Grids that were read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParsedGridProgram {
    /// The grids.
    pub program: GridProgram,
    /// Notes of the checks.
    pub notes: Vec<Diagnostic>,
}

/// Reads the grids of a program and makes CSLadder's checks.
///
/// # Errors
/// All errors, at most 100, in order of their positions. The number of errors of the four checks is a note.
pub fn read(file: &str, text: &str) -> Result<ParsedGridProgram, Vec<Diagnostic>> {
    let program = GridProgram { file: file.to_owned(), ..GridProgram::default() };
    let mut reader =
        GridReader { file, program, grid: None, comments: Vec::new(), has_head: false, diagnostics: Vec::new() };
    if text.len() > MAX_BYTES {
        reader.error(codes::GRID_SIZE, Pos::new(1, 1, 1), "the text has more than 4 MiB", "split the program");
        return Err(reader.diagnostics);
    }
    for (number, line) in (1..).zip(text.trim_start_matches('\u{feff}').lines()) {
        reader.line(number, line);
        if reader.diagnostics.len() >= MAX_ERRORS {
            return Err(reader.diagnostics);
        }
    }
    if let Some(grid) = reader.grid.take() {
        reader.error(codes::GRID_OPEN, grid.pos, "the grid has no END", "add END after its last row");
    }
    if !reader.has_head {
        let pos = Pos::new(1, 1, 1);
        reader.error(codes::GRID_LINE, pos, "the line CSLADDER is missing", "begin the file with CSLADDER");
    }
    if reader.diagnostics.is_empty() {
        reader.diagnostics = check(&reader.program);
    }
    match reader.diagnostics.iter().any(Diagnostic::is_error) {
        true => Err(reader.diagnostics),
        false => Ok(ParsedGridProgram { program: reader.program, notes: reader.diagnostics }),
    }
}

/// A word of a line and its position.
#[derive(Clone, Copy)]
struct Word<'a> {
    text: &'a str,
    pos: Pos,
}

impl GridReader<'_> {
    fn error(&mut self, code: &'static str, pos: Pos, cause: impl Into<String>, hint: &str) {
        self.diagnostics.push(Diagnostic::new(Severity::Error, code, self.file, pos, cause, hint));
    }

    fn line(&mut self, number: u32, line: &str) {
        let trimmed = line.trim();
        if trimmed.is_empty() {
            return;
        }
        if let Some(comment) = trimmed.strip_prefix(';') {
            self.comments.push(comment.trim().to_owned());
            return;
        }
        let words = words_of(number, line);
        let Some(first) = words.first().copied() else { return };
        let upper = first.text.to_ascii_uppercase();
        match (&mut self.grid, upper.as_str()) {
            (None, "CSLADDER") if !self.has_head => self.has_head = true,
            (None, "INPUTS") if words.get(1).is_some_and(|word| word.text.eq_ignore_ascii_case("ACTIVE-LOW")) => {
                self.program.is_active_low = true;
            }
            (None, "GRID") if words.len() == 1 => {
                let comments = std::mem::take(&mut self.comments);
                self.grid = Some(LadderGrid { comments, rows: Vec::new(), pos: first.pos });
            }
            (None, _) => {
                let cause = format!("`{trimmed}` is outside of a grid");
                self.error(codes::GRID_LINE, first.pos, cause, "a grid begins with the line GRID");
            }
            (Some(_), "END") => self.end_grid(),
            (Some(_), "GRID") => {
                self.error(codes::GRID_OPEN, first.pos, "the grid before has no END", "add END after its last row");
                self.end_grid();
                self.grid = Some(LadderGrid { pos: first.pos, ..LadderGrid::default() });
            }
            (Some(_), _) => self.row(&words),
        }
    }

    fn row(&mut self, words: &[Word<'_>]) {
        let rows = self.grid.as_ref().map_or(0, |grid| grid.rows.len());
        if words.len() > MAX_COLUMNS || rows >= MAX_ROWS {
            let pos = words.first().map_or(Pos::default(), |word| word.pos);
            let cause = format!("the grid has more than {MAX_ROWS} rows or {MAX_COLUMNS} columns");
            return self.error(codes::GRID_SIZE, pos, cause, "split the grid with a flag");
        }
        let cells: Vec<GridCell> = words.iter().enumerate().map(|(column, word)| self.cell(column, *word)).collect();
        if let Some(grid) = &mut self.grid {
            grid.rows.push(cells);
        }
    }

    /// Ends a grid: all its rows get one odd width, and outputs must be in the last column.
    fn end_grid(&mut self) {
        let Some(mut grid) = self.grid.take() else { return };
        let width = grid.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = width + usize::from(width % 2 == 0);
        grid.rows.iter_mut().for_each(|row| row.resize(width, GridCell::Empty));
        for row in &grid.rows {
            for (column, cell) in row.iter().enumerate() {
                let is_last = column + 1 == width;
                let (is_wrong, pos) = match cell {
                    GridCell::Output(output) => (!is_last, output.pos),
                    GridCell::Contact(contact) => (is_last, contact.pos),
                    GridCell::Wire => (is_last && width > 1, grid.pos),
                    GridCell::Empty | GridCell::Link(_) => (false, grid.pos),
                };
                if is_wrong {
                    let cause = format!(
                        "column {} of {width} takes {}",
                        column + 1,
                        if is_last { "outputs" } else { "no output" }
                    );
                    self.diagnostics.push(Diagnostic::new(
                        Severity::Error,
                        codes::GRID_PLACE,
                        self.file,
                        pos,
                        cause,
                        "outputs are in the last column, and nothing else is there",
                    ));
                }
            }
        }
        if self.program.grids.len() >= MAX_GRIDS {
            let cause = format!("the program has more than {MAX_GRIDS} grids");
            return self.error(codes::GRID_SIZE, grid.pos, cause, "split the program");
        }
        self.program.grids.push(grid);
    }

    fn cell(&mut self, column: usize, word: Word<'_>) -> GridCell {
        let is_odd = column.is_multiple_of(2);
        let mut symbols = word.text.chars();
        let link = symbols.next().and_then(LinkShape::from_symbol).filter(|_| symbols.next().is_none());
        match (word.text, link) {
            (".", _) => GridCell::Empty,
            ("---", _) if is_odd => GridCell::Wire,
            (_, Some(link)) if !is_odd => GridCell::Link(link),
            ("---", _) | (_, Some(_)) => {
                let cause = format!("`{}` in column {}", word.text, column + 1);
                let hint = "odd columns take contacts and wires (---), even columns links (-, +, |)";
                self.error(codes::GRID_PLACE, word.pos, cause, hint);
                GridCell::Empty
            }
            _ if word.text.contains(':') => self.output(word).map_or(GridCell::Empty, GridCell::Output),
            _ => self.contact(word, is_odd).map_or(GridCell::Empty, GridCell::Contact),
        }
    }

    fn contact(&mut self, word: Word<'_>, is_odd: bool) -> Option<GridContact> {
        let name = word.text.strip_prefix('/');
        let operand = self.operand(name.unwrap_or(word.text), word)?;
        if !is_odd {
            let hint = "odd columns take contacts and wires (---), even columns links (-, +, |)";
            self.error(codes::GRID_PLACE, word.pos, format!("`{}` in an even column", word.text), hint);
        }
        Some(GridContact { negated: name.is_some(), operand, pos: word.pos })
    }

    fn operand(&mut self, name: &str, word: Word<'_>) -> Option<GridOperand> {
        let upper = name.to_ascii_uppercase();
        let digits = upper.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        let letters = &upper[..upper.len() - digits.len()];
        let Some((area, _, first, last)) = GridArea::ALL.iter().find(|(_, known, ..)| *known == letters) else {
            let hint = "write EN0, /EN0, ---, OTE:S8, OTL:F0, OTU:S8, TON:T0:2, CTU:C0:5 or RES:C0";
            self.error(codes::GRID_CELL, word.pos, format!("unknown cell `{}`", word.text), hint);
            return None;
        };
        let number = digits.parse::<u8>().ok().filter(|number| (first..=last).contains(&number));
        if number.is_none() {
            let hint = format!("{letters}{first} to {letters}{last} exist");
            self.error(codes::GRID_OPERAND, word.pos, format!("there is no `{upper}`"), &hint);
        }
        number.map(|number| GridOperand { area: *area, number })
    }

    fn output(&mut self, word: Word<'_>) -> Option<GridOutput> {
        let mut parts = word.text.split(':');
        let keyword = parts.next().unwrap_or_default().to_ascii_uppercase();
        let name = parts.next().unwrap_or_default();
        let preset = parts.next();
        let is_known = matches!(keyword.as_str(), "OTE" | "OTL" | "OTU" | "TON" | "CTU" | "RES");
        if !is_known || parts.next().is_some() {
            let hint = "outputs are OTE, OTL, OTU, TON, CTU and RES, such as OTE:S8 or TON:T0:2";
            self.error(codes::GRID_CELL, word.pos, format!("unknown cell `{}`", word.text), hint);
            return None;
        }
        let operand = self.operand(name, word)?;
        let kind = match (keyword.as_str(), operand.area, preset) {
            ("OTE", GridArea::Output | GridArea::Flag, None) => Some(GridOutputKind::Ote),
            ("OTL", GridArea::Output | GridArea::Flag, None) => Some(GridOutputKind::Otl),
            ("OTU", GridArea::Output | GridArea::Flag, None) => Some(GridOutputKind::Otu),
            ("RES", GridArea::Timer | GridArea::Counter, None) => Some(GridOutputKind::Res),
            ("TON", GridArea::Timer, Some(text)) => {
                return self.preset(word, operand, milliseconds(text).map(GridOutputKind::Ton));
            }
            ("CTU", GridArea::Counter, Some(text)) => {
                let number = text.parse().ok().filter(|number| (1..=32767).contains(number));
                return self.preset(word, operand, number.map(GridOutputKind::Ctu));
            }
            ("TON", GridArea::Timer, None) | ("CTU", GridArea::Counter, None) => {
                return self.preset(word, operand, None);
            }
            _ => None,
        };
        if kind.is_none() {
            let hint =
                "OTE, OTL and OTU take S and F, TON takes T with seconds, CTU takes C with a number, RES takes T and C";
            self.error(codes::GRID_OPERAND, word.pos, format!("`{}` does not fit its operand", word.text), hint);
        }
        Some(GridOutput { kind: kind?, operand, pos: word.pos })
    }

    fn preset(&mut self, word: Word<'_>, operand: GridOperand, kind: Option<GridOutputKind>) -> Option<GridOutput> {
        if kind.is_none() {
            let hint = "TON:T0:2.5 gives seconds, CTU:C0:5 a number of 1 to 32767";
            self.error(codes::GRID_PRESET, word.pos, format!("bad preset in `{}`", word.text), hint);
        }
        Some(GridOutput { kind: kind?, operand, pos: word.pos })
    }
}

/// Splits a line into words with their positions.
fn words_of(number: u32, line: &str) -> Vec<Word<'_>> {
    let mut words = Vec::new();
    let mut rest = line;
    let mut column = 1_u32;
    while let Some(start) = rest.find(|c: char| !c.is_whitespace()) {
        column += rest[..start].chars().count() as u32;
        rest = &rest[start..];
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let text = &rest[..end];
        let width = text.chars().count() as u32;
        words.push(Word { text, pos: Pos::new(number, column, width) });
        column += width;
        rest = &rest[end..];
    }
    words
}

/// Returns seconds with up to three decimals as milliseconds.
fn milliseconds(text: &str) -> Option<i64> {
    let (whole, decimals) = text.split_once('.').unwrap_or((text, "0"));
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    if !is_number(whole) || !is_number(decimals) || decimals.len() > 3 || whole.len() > 7 {
        return None;
    }
    let fraction: i64 = format!("{decimals:0<3}").parse().ok()?;
    let total = whole.parse::<i64>().ok()? * 1000 + fraction;
    (1..=1_000_000_000).contains(&total).then_some(total)
}
