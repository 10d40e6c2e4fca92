//! Reads neutral text: rungs of instructions and branches.

use diag::Pos;

/// Greatest depth of branches.
const MAX_DEPTH: usize = 64;
/// Largest number of instructions.
const MAX_INSTRUCTIONS: usize = 20_000;

/// Instructions that are read, with their number of operands.
pub(super) const INSTRUCTIONS: [(&str, usize); 25] = [
    ("XIC", 1),
    ("XIO", 1),
    ("OTE", 1),
    ("OTL", 1),
    ("OTU", 1),
    ("ONS", 1),
    ("OSR", 2),
    ("OSF", 2),
    ("TON", 3),
    ("TOF", 3),
    ("RTO", 3),
    ("CTU", 3),
    ("CTD", 3),
    ("RES", 1),
    ("MOV", 2),
    ("ADD", 3),
    ("SUB", 3),
    ("MUL", 3),
    ("DIV", 3),
    ("EQU", 2),
    ("NEQ", 2),
    ("GRT", 2),
    ("GEQ", 2),
    ("LES", 2),
    ("LEQ", 2),
];

/// An operand as written.
#[derive(Debug, Clone)]
pub(super) struct NeutralOperand {
    pub text: String,
    pub pos: Pos,
}

/// A part of a rung.
#[derive(Debug, Clone)]
pub(super) enum NeutralItem {
    /// An instruction; its name in capitals.
    Instruction { name: String, operands: Vec<NeutralOperand>, pos: Pos },
    /// Parallel branches, each from left to right.
    Branch(Vec<Vec<NeutralItem>>),
}

/// A rung.
#[derive(Debug, Clone, Default)]
pub(super) struct NeutralRung {
    pub items: Vec<NeutralItem>,
    pub comments: Vec<String>,
}

/// What is wrong with a text.
#[derive(Debug)]
pub(super) struct TextFault {
    pub pos: Pos,
    pub cause: String,
    /// Whether the text is damaged; otherwise it has something that is not read.
    pub is_damaged: bool,
}

/// Whether a text begins like neutral text.
pub(crate) fn is_neutral_text(code: &str) -> bool {
    let length = code.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(code.len());
    let (word, rest) = code.split_at(length);
    match word.to_ascii_uppercase().as_str() {
        "XIC" | "XIO" => rest.starts_with('(') || rest.starts_with(char::is_whitespace),
        "BST" | "SOR" => rest.starts_with(char::is_whitespace),
        "EQU" | "NEQ" | "GRT" | "GEQ" | "LES" | "LEQ" | "OTE" | "OTL" | "OTU" => rest.starts_with('('),
        _ => false,
    }
}

struct NeutralReader<'a> {
    rest: &'a str,
    line: u32,
    column: u32,
    comments: Vec<String>,
    count: usize,
}

/// Reads rungs; the first character of the text is at `begin`.
pub(super) fn read_rungs(text: &str, begin: Pos) -> Result<Vec<NeutralRung>, TextFault> {
    let mut reader =
        NeutralReader { rest: text, line: begin.line, column: begin.column, comments: Vec::new(), count: 0 };
    let mut rungs = Vec::new();
    loop {
        reader.skip_space();
        if reader.rest.is_empty() {
            if let Some(last) = rungs.last_mut().filter(|_| !reader.comments.is_empty()) {
                let last: &mut NeutralRung = last;
                last.comments.append(&mut reader.comments);
            }
            return Ok(rungs);
        }
        let comments = std::mem::take(&mut reader.comments);
        let items = reader.series(0)?;
        reader.skip_space();
        let is_end = reader.take(";") || reader.take_word("EOR");
        if !is_end && !reader.rest.is_empty() {
            let found = reader.rest.chars().next().unwrap_or(' ');
            return Err(reader.fault(format!("`{found}` begins no instruction")));
        }
        rungs.push(NeutralRung { items, comments });
    }
}

impl NeutralReader<'_> {
    fn pos(&self) -> Pos {
        Pos::new(self.line, self.column, 1)
    }

    fn fault(&self, cause: String) -> TextFault {
        TextFault { pos: self.pos(), cause, is_damaged: true }
    }

    fn advance(&mut self, length: usize) {
        let (taken, rest) = self.rest.split_at(length);
        for c in taken.chars() {
            (self.line, self.column) = if c == '\n' { (self.line + 1, 1) } else { (self.line, self.column + 1) };
        }
        self.rest = rest;
    }

    fn skip_space(&mut self) {
        loop {
            let length =
                self.rest.len() - self.rest.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}').len();
            self.advance(length);
            if !self.rest.starts_with("//") {
                return;
            }
            let end = self.rest.find('\n').unwrap_or(self.rest.len());
            let comment = self.rest.get(2..end).unwrap_or_default().trim();
            if !comment.is_empty() {
                self.comments.push(comment.replace("*)", "* )"));
            }
            self.advance(end);
        }
    }

    fn take(&mut self, symbol: &str) -> bool {
        self.skip_space();
        let is_next = self.rest.starts_with(symbol);
        if is_next {
            self.advance(symbol.len());
        }
        is_next
    }

    fn word(&self) -> &str {
        let length = self.rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(self.rest.len());
        self.rest.get(..length).unwrap_or_default()
    }

    fn take_word(&mut self, word: &str) -> bool {
        self.skip_space();
        let is_next = self.word().eq_ignore_ascii_case(word);
        if is_next {
            self.advance(word.len());
        }
        is_next
    }

    /// Reads up to the end of a rung or branch.
    fn series(&mut self, depth: usize) -> Result<Vec<NeutralItem>, TextFault> {
        if depth > MAX_DEPTH {
            return Err(self.fault(format!("branches are nested deeper than {MAX_DEPTH}")));
        }
        let mut items = Vec::new();
        loop {
            self.skip_space();
            if self.take_word("SOR") {
                continue;
            }
            if self.take("[") {
                items.push(self.branches(depth, false)?);
                continue;
            }
            if self.take_word("BST") {
                items.push(self.branches(depth, true)?);
                continue;
            }
            let word = self.word().to_ascii_uppercase();
            if word.is_empty() || ["NXB", "BND", "EOR"].contains(&word.as_str()) {
                return Ok(items);
            }
            self.count += 1;
            if self.count > MAX_INSTRUCTIONS {
                return Err(self.fault(format!("the program has more than {MAX_INSTRUCTIONS} instructions")));
            }
            items.push(self.instruction(word)?);
        }
    }

    fn branches(&mut self, depth: usize, has_words: bool) -> Result<NeutralItem, TextFault> {
        let mut branches = vec![self.series(depth + 1)?];
        loop {
            let (is_next, is_end) = match has_words {
                true => (self.take_word("NXB"), self.take_word("BND")),
                false => (self.take(","), self.take("]")),
            };
            if is_next && !is_end {
                branches.push(self.series(depth + 1)?);
            } else if is_next {
                // An empty branch at the end: `[XIC(a),]`.
                branches.push(Vec::new());
                return Ok(NeutralItem::Branch(branches));
            } else if is_end {
                return Ok(NeutralItem::Branch(branches));
            } else {
                let end = if has_words { "BND" } else { "]" };
                return Err(self.fault(format!("the branch is not closed: `{end}` is missing")));
            }
        }
    }

    fn instruction(&mut self, name: String) -> Result<NeutralItem, TextFault> {
        let pos = Pos::new(self.line, self.column, u32::try_from(name.len()).unwrap_or(1));
        let known = INSTRUCTIONS.iter().find(|(known, _)| *known == name).map(|(_, count)| *count);
        let Some(count) = known else {
            let cause = format!("the instruction {name} is not read");
            return Err(TextFault { pos, cause, is_damaged: false });
        };
        self.advance(name.len());
        let mut operands = Vec::new();
        if self.rest.starts_with('(') {
            self.advance(1);
            while !self.take(")") {
                operands.push(self.operand(true)?);
                if !self.take(",") && !self.rest.starts_with(')') {
                    return Err(self.fault(format!("`)` of {name} is missing")));
                }
            }
        } else {
            for _ in 0..count {
                operands.push(self.operand(false)?);
                self.take(",");
            }
        }
        // Editors write `TON(T1)` and `TON(T1,?,?)` too: the numbers are data of the tag.
        let least = if count == 3 && ["TON", "TOF", "RTO", "CTU", "CTD"].contains(&name.as_str()) { 1 } else { count };
        if operands.len() < least || operands.len() > count {
            let cause = format!("{name} has {} operands and takes {count}", operands.len());
            return Err(TextFault { pos, cause, is_damaged: true });
        }
        Ok(NeutralItem::Instruction { name, operands, pos })
    }

    /// Reads an operand; brackets inside belong to it.
    fn operand(&mut self, is_inside: bool) -> Result<NeutralOperand, TextFault> {
        self.skip_space();
        let (mut depth, mut length) = (0_usize, 0);
        for (at, c) in self.rest.char_indices() {
            let is_end = match c {
                '[' => {
                    depth += 1;
                    false
                }
                ']' if depth > 0 => {
                    depth -= 1;
                    false
                }
                ',' => depth == 0,
                ')' | ']' | ';' => true,
                c => !is_inside && c.is_whitespace() || c == '\n',
            };
            if is_end {
                break;
            }
            length = at + c.len_utf8();
        }
        let text = self.rest.get(..length).unwrap_or_default().trim().to_owned();
        if text.is_empty() {
            return Err(self.fault("an operand is missing".to_owned()));
        }
        let pos = Pos::new(self.line, self.column, u32::try_from(text.chars().count()).unwrap_or(1));
        self.advance(length);
        Ok(NeutralOperand { text, pos })
    }
}
