//! What lies outside the program's own memory: converter, pulse width output, serial line, EEPROM; and the tables and
//! strings, which are more than one line of arithmetic.

use ladder::format::Piece;

use crate::exec::{Code, cut};

/// The points of a PIECEWISE_LINEAR, at least two, x rising.
#[derive(Debug)]
pub(crate) struct Curve {
    pub points: Vec<(i32, i32)>,
    /// How the arithmetic is cut: 16 for 16 bits, 0 for 32.
    pub cut: u8,
}

impl Curve {
    /// The value at an index; nothing behind the last point (2.5).
    pub(crate) fn at(&self, index: i32) -> Option<i32> {
        let segment = self.points.windows(2).find(|pair| index <= pair[1].0)?;
        let [(x, y), (next_x, next_y)] = [segment[0], segment[1]].map(|(x, y)| (i64::from(x), i64::from(y)));
        let along = cut(i64::from(index) - x, self.cut);
        let product = cut(i64::from(along) * (next_y - y), self.cut);
        Some(cut(y + i64::from(product) / (next_x - x), self.cut))
    }
}

/// A FORMATTED_STRING.
#[derive(Debug)]
pub(crate) struct Text {
    pub pieces: Vec<Piece>,
    /// The symbol that its number shows.
    pub var: Option<u32>,
}

/// What a FORMATTED_STRING remembers.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Sending {
    /// The rung bit of the last scan.
    before: bool,
    /// The character that is next; there is none while nothing is being sent.
    position: usize,
    /// What is left of the number.
    rest: i32,
    /// Only zeros so far.
    leading: bool,
}

/// The state of everything outside.
#[derive(Debug, Clone)]
pub(crate) struct Parts {
    /// Per analog input: what a conversion gives.
    pub adc: Vec<u16>,
    /// Duty of the pulse width output in percent, once it was set.
    pub duty: Option<u8>,
    /// Scans until the transmitter is free.
    pub busy: u32,
    /// The byte sent in this scan.
    pub sent: Option<u8>,
    /// The byte that waits in the receiver.
    pub waiting: Option<u8>,
    /// The EEPROM.
    pub cells: Vec<u8>,
    /// Scans until a byte is written.
    pub writing: u32,
    texts: Vec<Sending>,
}

impl Parts {
    /// Nothing sent, received or set, the EEPROM erased.
    pub(crate) fn power_up(code: &Code) -> Parts {
        Parts {
            adc: vec![0; code.adc.len()],
            duty: None,
            busy: 0,
            sent: None,
            waiting: None,
            cells: vec![0xFF; code.cells as usize],
            writing: 0,
            texts: code.texts.iter().map(|t| Sending { position: t.pieces.len(), ..Sending::default() }).collect(),
        }
    }

    /// What goes on by itself from scan to scan.
    pub(crate) fn start_scan(&mut self) {
        self.sent = None;
        self.busy = self.busy.saturating_sub(1);
        self.writing = self.writing.saturating_sub(1);
    }

    /// A byte goes out, whoever sends it.
    fn transmit(&mut self, code: &Code, byte: u8) {
        self.sent = Some(byte);
        self.busy = code.byte_scans;
    }

    /// UART_SEND: sends where the transmitter is free; gives whether it is busy.
    pub(crate) fn send(&mut self, code: &Code, value: i32, rung: bool) -> bool {
        if rung && self.busy == 0 {
            self.transmit(code, value as u8);
        }
        self.busy > 0
    }

    /// The byte that waits, which then waits no more.
    pub(crate) fn take(&mut self) -> Option<u8> {
        self.waiting.take()
    }

    /// FORMATTED_STRING `number`: one character where the transmitter is free; gives whether characters are left.
    pub(crate) fn text(&mut self, code: &Code, number: usize, values: &[i32], rung: bool) -> bool {
        let text = &code.texts[number];
        let mut now = self.texts[number];
        if rung && !now.before {
            now.position = 0;
        }
        now.before = rung;
        if let (0, Some(&piece)) = (self.busy, text.pieces.get(now.position)) {
            let signed = text.pieces.contains(&Piece::Sign);
            let (value, width) = text.var.map_or((0, 0), |var| (values[var as usize], code.cut[var as usize]));
            let byte = now.character(piece, signed, value, width);
            self.transmit(code, byte);
            now.position += 1;
        }
        self.texts[number] = now;
        now.position < text.pieces.len()
    }

    /// Whether no byte is being written to the EEPROM.
    pub(crate) fn cells_are_free(&self) -> bool {
        self.writing == 0
    }

    /// PERSIST of `width` bytes from `cell` on, while the EEPROM is free: the variable's new value. It is loaded first, then
    /// the lowest byte that differs is written.
    pub(crate) fn persist(&mut self, code: &Code, cell: usize, width: usize, value: i32, loaded: bool) -> i32 {
        let cells = &mut self.cells[cell..cell + width];
        if !loaded {
            return cells.iter().rev().fold(0, |value, byte| value << 8 | i32::from(*byte));
        }
        if let Some((cell, byte)) = cells.iter_mut().zip(value.to_le_bytes()).find(|(cell, byte)| **cell != *byte) {
            *cell = byte;
            self.writing = code.cell_scans;
        }
        value
    }
}

impl Sending {
    /// The byte for a piece; `value` is the variable's value now, `width` how its width is cut.
    fn character(&mut self, piece: Piece, signed: bool, value: i32, width: u8) -> u8 {
        match piece {
            Piece::Byte(byte) => byte,
            Piece::Sign => {
                self.rest = cut(i64::from(value).abs(), width);
                if value < 0 { b'-' } else { b' ' }
            }
            Piece::Digit { divisor, first, last } => {
                if first {
                    self.leading = true;
                    if !signed {
                        self.rest = value;
                    }
                }
                let digit = self.rest / divisor;
                self.rest = cut(i64::from(self.rest) - i64::from(digit) * i64::from(divisor), width);
                self.leading &= digit == 0;
                // A number that has too many digits shows what the arithmetic gives, as the chips do.
                if self.leading && !last { b' ' } else { digit.wrapping_add(48) as u8 }
            }
        }
    }
}
