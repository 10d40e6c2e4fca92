//! State outside of the program's own memory: converter, PWM output, serial line, EEPROM.
//!
//! The curves and strings are here too, because they need more than one line of arithmetic.

use ladder::BusOp;
use ladder::format::StringPiece;

use crate::arithmetic::truncate;
use crate::flat_program::FlatProgram;

/// Points of a PIECEWISE_LINEAR: at least two, with increasing x.
#[derive(Debug)]
pub(crate) struct PiecewiseCurve {
    /// Points (x, y) in order of x.
    pub points: Vec<(i32, i32)>,
    /// Number of bits by which [`truncate`] cuts each result: 16 for 16-bit arithmetic, 0 for 32-bit.
    pub cut: u8,
}

impl PiecewiseCurve {
    /// Value of the curve at an index; `None` beyond the last point (2.5).
    pub(crate) fn value_at(&self, index: i32) -> Option<i32> {
        let segment = self.points.windows(2).find(|pair| index <= pair[1].0)?;
        let [(x, y), (next_x, next_y)] = [segment[0], segment[1]].map(|(x, y)| (i64::from(x), i64::from(y)));
        let along = truncate(i64::from(index) - x, self.cut);
        let product = truncate(i64::from(along) * (next_y - y), self.cut);
        Some(truncate(y + i64::from(product) / (next_x - x), self.cut))
    }
}

/// Text of a FORMATTED_STRING.
#[derive(Debug)]
pub(crate) struct FormattedText {
    /// Pieces of the text, one per character.
    pub pieces: Vec<StringPiece>,
    /// Symbol whose value the text shows.
    pub var: Option<u32>,
}

/// What a read gives if no device answers: the lines are high.
const BUS_AT_REST: u8 = 0xFF;

/// State of one FORMATTED_STRING.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TextTransmission {
    /// Rung bit of the previous scan.
    last_rung: bool,
    /// Index of the next character; the length of the text if nothing is being sent.
    position: usize,
    /// Remaining value of the number, after the digits sent so far.
    remaining_number: i32,
    /// True while all digits so far were zero.
    only_zeros_so_far: bool,
}

/// What a scan did on a bus of the chip (5.14).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BusEvent {
    /// A register of an I2C device was written.
    I2cWrite {
        /// Address of the device.
        device: u8,
        /// The register.
        register: u8,
        /// The byte.
        byte: u8,
    },
    /// A register of an I2C device was read.
    I2cRead {
        /// Address of the device.
        device: u8,
        /// The register.
        register: u8,
    },
    /// A byte was sent, and one received, on the SPI bus.
    Spi {
        /// The byte sent.
        byte: u8,
    },
}

/// The bytes of an UART_SEND or UART_RECV of several bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct ByteSequence {
    /// Index of its state.
    pub at: u32,
    /// Number of bytes.
    pub bytes: u8,
}

/// What an element on a bus talks to; both are 0 on SPI.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BusAddress {
    /// Address of an I2C device.
    pub device: u8,
    /// The register of the device.
    pub register: u8,
}

/// A PWM output of a program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PwmChannel {
    /// Its name, if SET_PWM has one.
    pub name: Option<String>,
    /// Its frequency in Hz.
    pub hertz: u32,
}

/// State of all peripherals.
#[derive(Debug, Clone)]
pub(crate) struct PeripheralState {
    /// For each analog input, the result of a conversion.
    pub adc: Vec<u16>,
    /// For each PWM output, its duty cycle in percent; `None` before it is set.
    pub duties: Vec<Option<u8>>,
    /// Number of scans until the transmitter is free.
    pub transmitter_busy_scans: u32,
    /// Bytes sent in this scan.
    pub sent: Vec<u8>,
    /// Byte that waits in the receiver.
    pub received_byte: Option<u8>,
    /// What this scan did on the buses, in order.
    pub transfers_of_scan: Vec<BusEvent>,
    /// The byte that devices answer in this scan.
    pub bus_answer: u8,
    /// EEPROM cells from address 0.
    pub eeprom: Vec<u8>,
    /// Number of scans until the current EEPROM write is complete.
    pub eeprom_busy_scans: u32,
    /// For each UART_SEND and UART_RECV of several bytes: those that wait for their turn, or that have come.
    transfers: Vec<Vec<u8>>,
    /// State of each FORMATTED_STRING.
    texts: Vec<TextTransmission>,
}

impl PeripheralState {
    /// State at power-up: nothing sent, received or set, and the EEPROM erased.
    pub(crate) fn power_up(code: &FlatProgram) -> PeripheralState {
        PeripheralState {
            adc: vec![0; code.adc_symbols.len()],
            duties: vec![None; code.pwm_outputs.len()],
            transmitter_busy_scans: 0,
            sent: Vec::new(),
            received_byte: None,
            transfers_of_scan: Vec::new(),
            bus_answer: BUS_AT_REST,
            eeprom: vec![0xFF; code.eeprom_cells as usize],
            eeprom_busy_scans: 0,
            transfers: vec![Vec::new(); code.transfers as usize],
            texts: code
                .texts
                .iter()
                .map(|t| TextTransmission { position: t.pieces.len(), ..TextTransmission::default() })
                .collect(),
        }
    }

    /// Advances the peripherals by one scan.
    pub(crate) fn start_scan(&mut self) {
        self.sent.clear();
        self.transfers_of_scan.clear();
        self.transmitter_busy_scans = self.transmitter_busy_scans.saturating_sub(1);
        self.eeprom_busy_scans = self.eeprom_busy_scans.saturating_sub(1);
    }

    /// Sends a byte, for UART_SEND or FORMATTED_STRING.
    fn transmit(&mut self, code: &FlatProgram, byte: u8) {
        self.sent.push(byte);
        self.transmitter_busy_scans = code.scans_per_byte;
    }

    /// Executes UART_SEND: sends if the transmitter is free, and returns whether it is busy.
    pub(crate) fn send(&mut self, code: &FlatProgram, value: i32, rung: bool) -> bool {
        if rung && self.transmitter_busy_scans == 0 {
            self.transmit(code, value as u8);
        }
        self.transmitter_busy_scans > 0
    }

    /// Executes UART_SEND of several bytes: a true rung begins if nothing is left, and each free scan sends a
    /// byte of the value as it is then. Returns whether the transmitter is busy.
    pub(crate) fn send_bytes(&mut self, code: &FlatProgram, bytes: ByteSequence, value: i32, rung: bool) -> bool {
        let ByteSequence { at, bytes } = bytes;
        let mut left = std::mem::take(&mut self.transfers[at as usize]);
        if rung && left.is_empty() {
            left = (0..bytes).rev().collect();
        }
        if self.transmitter_busy_scans == 0
            && let Some(number) = left.pop()
        {
            self.transmit(code, (value >> (8 * number)) as u8);
        }
        self.transfers[at as usize] = left;
        self.transmitter_busy_scans > 0
    }

    /// Executes UART_SEND that waits: on a true rung all bytes go in this scan. A single byte has gone when
    /// the element ends, on a false rung also that of another element. Returns whether the transmitter is
    /// busy.
    pub(crate) fn send_at_once(&mut self, code: &FlatProgram, bytes: u8, value: i32, rung: bool) -> bool {
        if rung {
            value.to_le_bytes().into_iter().take(bytes.into()).for_each(|byte| self.transmit(code, byte));
        }
        if bytes == 1 {
            self.transmitter_busy_scans = 0;
        }
        self.transmitter_busy_scans > 0
    }

    /// Executes UART_RECV of several bytes on a true rung: the number that they make, once all have come.
    pub(crate) fn receive_bytes(&mut self, at: u32, bytes: u8) -> Option<i64> {
        let byte = self.take_received();
        let come = &mut self.transfers[at as usize];
        come.extend(byte);
        if come.len() < usize::from(bytes) {
            return None;
        }
        let number = come.drain(..).rev().fold(0, |number, byte| number << 8 | i64::from(byte));
        let spare = 64 - 8 * u32::from(bytes);
        Some(number << spare >> spare)
    }

    /// Takes a byte for an UART_RECV that holds the scan: the number that its bytes make, without sign, once
    /// all have come.
    pub(crate) fn receive_all(&mut self, bytes: ByteSequence) -> Option<i64> {
        let byte = self.take_received();
        let come = &mut self.transfers[bytes.at as usize];
        come.extend(byte);
        let whole = come.len() >= usize::from(bytes.bytes);
        whole.then(|| come.drain(..).rev().fold(0, |number, byte| number << 8 | i64::from(byte)))
    }

    /// True if some, but not all, bytes of an UART_RECV have come.
    pub(crate) fn has_begun(&self, at: u32) -> bool {
        !self.transfers[at as usize].is_empty()
    }

    /// Executes a transfer on a bus, and returns the byte that its device answers.
    pub(crate) fn transfer(&mut self, op: BusOp, at: BusAddress, byte: u8) -> u8 {
        let BusAddress { device, register } = at;
        self.transfers_of_scan.push(match op {
            BusOp::I2cRead => BusEvent::I2cRead { device, register },
            BusOp::I2cWrite => BusEvent::I2cWrite { device, register, byte },
            BusOp::Spi | BusOp::SpiText => BusEvent::Spi { byte },
        });
        self.bus_answer
    }

    /// Executes SPI_WR.
    pub(crate) fn send_bus_text(&mut self, text: &[u8]) {
        self.transfers_of_scan.extend(text.iter().map(|&byte| BusEvent::Spi { byte }));
    }

    /// Takes the received byte, if one waits.
    pub(crate) fn take_received(&mut self) -> Option<u8> {
        self.received_byte.take()
    }

    /// Executes FORMATTED_STRING `number`: sends one character if the transmitter is free.
    ///
    /// Returns whether characters are left.
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

    /// True if no byte is being written to the EEPROM.
    pub(crate) fn is_eeprom_free(&self) -> bool {
        self.eeprom_busy_scans == 0
    }

    /// Executes PERSIST for `width` bytes from `cell` on, while the EEPROM is free; returns the new value of
    /// the variable.
    ///
    /// The first execution loads the variable. Later ones write the lowest byte that differs from its cell.
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
    /// Byte for a piece; `value` is the current value of the variable, `width` the cut of its width.
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
                // A number with too many digits shows the result of the arithmetic, as on the chips.
                if self.only_zeros_so_far && !last { b' ' } else { digit.wrapping_add(48) as u8 }
            }
        }
    }
}
