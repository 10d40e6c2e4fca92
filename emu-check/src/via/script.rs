//! The protocol between the checker and a served program, as bytes; the other side is `serve.c`.

use ladder_compile::emit::{EmittedSource, SourceCell};

/// How the slots of a served program are numbered. A slot is the number of a cell (a bit or an integer of the
/// program) in the protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlotNumbering {
    /// In the order of [`EmittedSource::cells`].
    InOrder,
    /// In the order of the interpreter: bits by number, then integers by number.
    Interpreter,
}

/// The commands for a served program. A script is empty at first; [`ServeScript::reset`] must be its first
/// command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ServeScript {
    bytes: Vec<u8>,
    scans: u64,
}

impl Default for ServeScript {
    fn default() -> Self {
        ServeScript::new()
    }
}

impl ServeScript {
    /// An empty script.
    #[must_use]
    pub fn new() -> ServeScript {
        ServeScript { bytes: Vec::new(), scans: 0 }
    }

    /// Fills all memory with `garbage`, then initializes the program as after power-up.
    pub fn reset(&mut self, garbage: u8) {
        self.bytes.extend([b'R', garbage]);
    }

    /// Sets the level of an input, by its index in [`EmittedSource::inputs`].
    pub fn input(&mut self, input: u16, on: bool) {
        self.command(b'I', input, &[u8::from(on)]);
    }

    /// Sets the conversion result of an analog input, 0 to 1023, by its index in [`EmittedSource::analog`].
    pub fn analog(&mut self, input: u16, value: u16) {
        self.command(b'A', input, &value.to_le_bytes());
    }

    /// Makes the program receive a byte.
    pub fn receive(&mut self, byte: u8) {
        self.bytes.extend([b'B', byte]);
    }

    /// Sets the contents of a cell of the EEPROM.
    pub fn eeprom_cell(&mut self, cell: u16, byte: u8) {
        self.command(b'E', cell, &[byte]);
    }

    /// Sets the value of a bit or an integer, by its slot.
    pub fn write(&mut self, slot: u16, value: i32) {
        self.command(b'W', slot, &value.to_le_bytes());
    }

    /// Runs one scan.
    pub fn scan(&mut self) {
        self.bytes.push(b'S');
        self.scans += 1;
    }

    fn command(&mut self, command: u8, number: u16, rest: &[u8]) {
        self.bytes.push(command);
        self.bytes.extend(number.to_le_bytes());
        self.bytes.extend(rest);
    }

    /// Number of scans in the script.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.scans
    }

    /// The script as bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// The state of a served program after a scan.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ScanRecord {
    /// Values of the cells, in the order of [`EmittedSource::cells`].
    pub cells: Vec<i32>,
    /// Outputs as the program wrote them, in the order of [`EmittedSource::outputs`].
    pub outputs: Vec<bool>,
    /// Number of bytes sent, and the last one.
    pub sent: (u8, u8),
    /// Duty cycle of the PWM output in percent; `None` before it is set.
    pub duty: Option<u8>,
    /// A number that the transfers on buses give.
    pub buses: u16,
    /// Contents of the EEPROM.
    pub eeprom: Vec<u8>,
}

impl SlotNumbering {
    /// The layout of a record of `source`.
    #[must_use]
    pub fn record_shape(self, source: &EmittedSource) -> RecordShape {
        let slot = |(cell, n): (&SourceCell, u32)| match (self, cell.bytes) {
            (SlotNumbering::InOrder, _) => n,
            (SlotNumbering::Interpreter, None) => cell.index,
            (SlotNumbering::Interpreter, Some(_)) => source.bits + cell.index,
        };
        RecordShape {
            slots: match self {
                SlotNumbering::InOrder => source.cells.len(),
                SlotNumbering::Interpreter => (source.bits + source.words) as usize,
            },
            cells: source.cells.iter().zip(0..).map(|cell| u16::try_from(slot(cell)).unwrap_or(u16::MAX)).collect(),
            outputs: source.outputs.len(),
            eeprom: source.eeprom.into(),
        }
    }
}

/// The layout of a record: its length and the positions of its parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordShape {
    /// Number of slots in a record.
    pub slots: usize,
    /// The slot of each cell.
    pub cells: Vec<u16>,
    /// Number of outputs.
    pub outputs: usize,
    /// Number of EEPROM cells.
    pub eeprom: usize,
}

impl RecordShape {
    /// Length of a record in bytes.
    #[must_use]
    pub fn len(&self) -> usize {
        4 * self.slots + self.outputs + 5 + self.eeprom
    }

    /// Always false: a record has at least 5 bytes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Parses one record; `None` if there are not enough bytes.
    #[must_use]
    pub fn read_record(&self, bytes: &[u8]) -> Option<ScanRecord> {
        let (slots, rest) = bytes.split_at_checked(4 * self.slots)?;
        let (outputs, rest) = rest.split_at_checked(self.outputs)?;
        let ([count, last, duty, bus_low, bus_high], rest) = rest.split_first_chunk()?;
        let value = |slot: &u16| -> Option<i32> {
            let at = 4 * usize::from(*slot);
            Some(i32::from_le_bytes(slots.get(at..at + 4)?.try_into().ok()?))
        };
        Some(ScanRecord {
            cells: self.cells.iter().map(value).collect::<Option<_>>()?,
            outputs: outputs.iter().map(|&on| on != 0).collect(),
            sent: (*count, *last),
            duty: (*duty != 255).then_some(*duty),
            buses: u16::from_le_bytes([*bus_low, *bus_high]),
            eeprom: rest.get(..self.eeprom)?.to_vec(),
        })
    }
}
