//! The model of the grids of a program.

use std::fmt;

use diag::Pos;

/// A program of CSLadder.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct GridProgram {
    /// Name of the file, as the user gave it.
    pub file: String,
    /// Whether a contact of an input is closed while its pin is low, as on the board of reference 003.
    pub is_active_low: bool,
    /// Grids from top to bottom.
    pub grids: Vec<LadderGrid>,
}

/// A grid (matrix) of cells.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct LadderGrid {
    /// Comments before it.
    pub comments: Vec<String>,
    /// Rows of one odd width: columns 1, 3, .. are contacts and wires, 2, 4, .. links, the last is outputs.
    pub rows: Vec<Vec<GridCell>>,
    /// Position of GRID.
    pub pos: Pos,
}

/// A cell of a grid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum GridCell {
    /// Nothing.
    Empty,
    /// A wire from left to right.
    Wire,
    /// A contact.
    Contact(GridContact),
    /// A link to the cells around it.
    Link(LinkShape),
    /// An output.
    Output(GridOutput),
}

/// A contact.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GridContact {
    /// Whether it is closed while its operand is FALSE (NF).
    pub negated: bool,
    /// What it reads.
    pub operand: GridOperand,
    /// Position in the file.
    pub pos: Pos,
}

/// Areas of operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum GridArea {
    /// EN: inputs.
    Input,
    /// S: outputs.
    Output,
    /// T: timers.
    Timer,
    /// C: counters.
    Counter,
    /// F: flags.
    Flag,
}

impl GridArea {
    /// All areas with their letters, first and last numbers.
    pub const ALL: [(GridArea, &'static str, u8, u8); 5] = [
        (GridArea::Input, "EN", 0, 7),
        (GridArea::Output, "S", 8, 13),
        (GridArea::Timer, "T", 0, 4),
        (GridArea::Counter, "C", 0, 7),
        (GridArea::Flag, "F", 0, 15),
    ];
}

/// An operand such as EN0 or S8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GridOperand {
    /// Area.
    pub area: GridArea,
    /// Number.
    pub number: u8,
}

impl fmt::Display for GridOperand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let letters =
            GridArea::ALL.iter().find(|(area, ..)| *area == self.area).map_or("F", |(_, letters, ..)| letters);
        write!(f, "{letters}{}", self.number)
    }
}

/// Sides of a cell to which a link leads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LinkShape {
    /// Its character.
    pub symbol: char,
    /// To the left.
    pub left: bool,
    /// To the right.
    pub right: bool,
    /// Upwards.
    pub up: bool,
    /// Downwards.
    pub down: bool,
}

/// Each character with left, right, up, down.
const SHAPES: [(char, [bool; 4]); 13] = [
    ('-', [true, true, false, false]),
    ('+', [true, true, true, true]),
    ('|', [false, false, true, true]),
    ('─', [true, true, false, false]),
    ('│', [false, false, true, true]),
    ('┬', [true, true, false, true]),
    ('┴', [true, true, true, false]),
    ('┼', [true, true, true, true]),
    ('├', [false, true, true, true]),
    ('┤', [true, false, true, true]),
    ('└', [false, true, true, false]),
    ('┘', [true, false, true, false]),
    ('┐', [true, false, false, true]),
];

impl LinkShape {
    /// Returns the link of a character; `+` leads to all sides where the other cell leads to it.
    #[must_use]
    pub fn from_symbol(symbol: char) -> Option<LinkShape> {
        let (_, [left, right, up, down]) = *SHAPES.iter().find(|(known, _)| *known == symbol)?;
        Some(LinkShape { symbol, left, right, up, down })
    }
}

/// An output in the last column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GridOutput {
    /// What it does.
    pub kind: GridOutputKind,
    /// On what it acts.
    pub operand: GridOperand,
    /// Position in the file.
    pub pos: Pos,
}

/// What an output does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum GridOutputKind {
    /// OTE: the bit follows the power.
    Ote,
    /// OTL: power sets the bit.
    Otl,
    /// OTU: power resets the bit.
    Otu,
    /// TON with its preset in milliseconds.
    Ton(i64),
    /// CTU with its preset.
    Ctu(i64),
    /// RES of a timer or counter.
    Res,
}

impl GridOutputKind {
    /// Returns the keyword.
    #[must_use]
    pub const fn keyword(self) -> &'static str {
        match self {
            GridOutputKind::Ote => "OTE",
            GridOutputKind::Otl => "OTL",
            GridOutputKind::Otu => "OTU",
            GridOutputKind::Ton(_) => "TON",
            GridOutputKind::Ctu(_) => "CTU",
            GridOutputKind::Res => "RES",
        }
    }
}

/// The text of a cell.
pub(super) struct CellText<'a>(pub &'a GridCell);

impl fmt::Display for CellText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            GridCell::Empty => f.write_str("."),
            GridCell::Wire => f.write_str("---"),
            GridCell::Contact(contact) => write!(f, "{}{}", if contact.negated { "/" } else { "" }, contact.operand),
            GridCell::Link(link) => write!(f, "{}", link.symbol),
            GridCell::Output(output) => {
                write!(f, "{}:{}", output.kind.keyword(), output.operand)?;
                match output.kind {
                    GridOutputKind::Ton(ms) if ms % 1000 == 0 => write!(f, ":{}", ms / 1000),
                    GridOutputKind::Ton(ms) => {
                        let decimals = format!("{:03}", ms % 1000);
                        write!(f, ":{}.{}", ms / 1000, decimals.trim_end_matches('0'))
                    }
                    GridOutputKind::Ctu(preset) => write!(f, ":{preset}"),
                    GridOutputKind::Ote | GridOutputKind::Otl | GridOutputKind::Otu | GridOutputKind::Res => Ok(()),
                }
            }
        }
    }
}
