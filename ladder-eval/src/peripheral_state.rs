//! What lies outside the program's own memory: converter, pulse width output, serial line, EEPROM; and the tables and
//! strings, which are more than one line of arithmetic.

use ladder::format::StringPiece;

use crate::flat_program::{FlatProgram, truncate};

/// The points of a PIECEWISE_LINEAR, at least two, x rising.
#[derive(Debug)]
pub(crate) struct PiecewiseCurve {
    pub points: Vec<(i32, i32)>,
    /// How the arithmetic is cut: 16 for 16 bits, 0 for 32.
    pub cut: u8,
}

impl PiecewiseCurve {
    /// The value at an index; nothing behind the last point (2.5).
    pub(crate) fn value_at(&self, index: i32) -> Option<i32> {
        let segment = self.points.windows(2).find(|pair| index <= pair[1].0)?;
        let [(x, y), (next_x, next_y)] = [segment[0], segment[1]].map(|(x, y)| (i64::from(x), i64::from(y)));
        let along = truncate(i64::from(index) - x, self.cut);
        let product = truncate(i64::from(along) * (next_y - y), self.cut);
        Some(truncate(y + i64::from(product) / (next_x - x), self.cut))
    }
}

/// A FORMATTED_STRING.
#[derive(Debug)]
pub(crate) struct FormattedText {
    pub pieces: Vec<StringPiece>,
    /// The symbol that its number shows.
    pub var: Option<u32>,
}

/// What a FORMATTED_STRING remembers.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TextTransmission {
    /// The rung bit of the last scan.
    last_rung: bool,
    /// The character that is next; there is none while nothing is being sent.
    position: usize,
    /// What is left of the number.
    remaining_number: i32,
    /// Only zeros so far.
    only_zeros_so_far: bool,
}

/// The state of everything outside.
#[derive(Debug, Clone)]
pub(crate) struct PeripheralState {
    /// Per analog input: what a conversion gives.
    pub adc: Vec<u16>,
    /// Duty of the pulse width output in percent, once it was set.
    pub duty: Option<u8>,
    /// Scans until the transmitter is free.
    pub transmitter_busy_scans: u32,
    /// The byte sent in this scan.
    pub sent: Option<u8>,
    /// The byte that waits in the receiver.
    pub received_byte: Option<u8>,
    /// The EEPROM.
    pub eeprom: Vec<u8>,
    /// Scans until a byte is written.
    pub eeprom_busy_scans: u32,
    texts: Vec<TextTransmission>,
}

impl PeripheralState {
    /// Nothing sent, received or set, the EEPROM erased.
    pub(crate) fn power_up(code: &FlatProgram) -> PeripheralState {
        PeripheralState {
            adc: vec![0; code.adc_symbols.len()],
            duty: None,
            transmitter_busy_scans: 0,
            sent: None,
            received_byte: None,
            eeprom: vec![0xFF; code.eeprom_cells as usize],
            eeprom_busy_scans: 0,
            texts: code
                .texts
                .iter()
                .map(|t| TextTransmission { position: t.pieces.len(), ..TextTransmission::default() })
                .collect(),
        }
    }

    /// What goes on by itself from scan to scan.
    pub(crate) fn start_scan(&mut self) {
        self.sent = None;
        self.transmitter_busy_scans = self.transmitter_busy_scans.saturating_sub(1);
        self.eeprom_busy_scans = self.eeprom_busy_scans.saturating_sub(1);
    }

    /// A byte goes out, whoever sends it.
    fn transmit(&mut self, code: &FlatProgram, byte: u8) {
        self.sent = Some(byte);
        self.transmitter_busy_scans = code.scans_per_byte;
    }

    /// UART_SEND: sends where the transmitter is free; gives whether it is busy.
    pub(crate) fn send(&mut self, code: &FlatProgram, value: i32, rung: bool) -> bool {
        if rung && self.transmitter_busy_scans == 0 {
            self.transmit(code, value as u8);
        }
        self.transmitter_busy_scans > 0
    }

    /// The byte that waits, which then waits no more.
    pub(crate) fn take_received(&mut self) -> Option<u8> {
        self.received_byte.take()
    }

    /// FORMATTED_STRING `number`: one character where the transmitter is free; gives whether characters are left.
    pub(crate) fn send_text(&mut self, code: &FlatProgram, number: usize, values: &[i32], rung: bool) -> bool {
        let text = &code.texts[number];
        let mut now = self.texts[number];
        if rung && !now.last_rung {
            now.position = 0;
        }
        now.last_rung = rung;
        if let (0, Some(&piece)) = (self.transmitter_busy_scans, text.pieces.get(now.position)) {
            let signed = text.pieces.contains(&StringPiece::Sign);
            let (value, width) = text.var.map_or((0, 0), |var| (values[var as usize], code.cut_bits[var as usize]));
            let byte = now.character(piece, signed, value, width);
            self.transmit(code, byte);
            now.position += 1;
        }
        self.texts[number] = now;
        now.position < text.pieces.len()
    }

    /// Whether no byte is being written to the EEPROM.
    pub(crate) fn is_eeprom_free(&self) -> bool {
        self.eeprom_busy_scans == 0
    }

    /// PERSIST of `width` bytes from `cell` on, while the EEPROM is free: the variable's new value. It is loaded first, then
    /// the lowest byte that differs is written.
    pub(crate) fn persist(&mut self, code: &FlatProgram, cell: usize, width: usize, value: i32, loaded: bool) -> i32 {
        let cells = &mut self.eeprom[cell..cell + width];
        if !loaded {
            return cells.iter().rev().fold(0, |value, byte| value << 8 | i32::from(*byte));
        }
        if let Some((cell, byte)) = cells.iter_mut().zip(value.to_le_bytes()).find(|(cell, byte)| **cell != *byte) {
            *cell = byte;
            self.eeprom_busy_scans = code.scans_per_eeprom_write;
        }
        value
    }
}

impl TextTransmission {
    /// The byte for a piece; `value` is the variable's value now, `width` how its width is cut.
    fn character(&mut self, piece: StringPiece, signed: bool, value: i32, width: u8) -> u8 {
        match piece {
            StringPiece::Byte(byte) => byte,
            StringPiece::Sign => {
                self.remaining_number = truncate(i64::from(value).abs(), width);
                if value < 0 { b'-' } else { b' ' }
            }
            StringPiece::Digit { divisor, first, last } => {
                if first {
                    self.only_zeros_so_far = true;
                    if !signed {
                        self.remaining_number = value;
                    }
                }
                let digit = self.remaining_number / divisor;
                self.remaining_number =
                    truncate(i64::from(self.remaining_number) - i64::from(digit) * i64::from(divisor), width);
                self.only_zeros_so_far &= digit == 0;
                // A number that has too many digits shows what the arithmetic gives, as the chips do.
                if self.only_zeros_so_far && !last { b' ' } else { digit.wrapping_add(48) as u8 }
            }
        }
    }
}
