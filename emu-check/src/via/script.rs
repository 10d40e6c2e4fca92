//! What a served program is told, and what it tells, as bytes: see `serve.c`.

use ladder_compile::emit::{EmittedSource, SourceCell};

/// How a program's cells are numbered where it is served.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlotNumbering {
    /// In the order of [`EmittedSource::eeprom`].
    InOrder,
    /// Bits by their numbers, then integers by theirs: the interpreter's.
    Interpreter,
}

/// What a served program is told. It begins with nothing; [`ServeScript::reset`] comes before anything else.
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
    /// Nothing yet.
    #[must_use]
    pub fn new() -> ServeScript {
        ServeScript { bytes: Vec::new(), scans: 0 }
    }

    /// Everything is filled with `garbage`, then set as after power-up.
    pub fn reset(&mut self, garbage: u8) {
        self.bytes.extend([b'R', garbage]);
    }

    /// The level of an input, by its place in [`EmittedSource::inputs`].
    pub fn input(&mut self, input: u16, on: bool) {
        self.command(b'I', input, &[u8::from(on)]);
    }

    /// What an analog input converts to, 0 to 1023, by its place in [`EmittedSource::analog`].
    pub fn analog(&mut self, input: u16, value: u16) {
        self.command(b'A', input, &value.to_le_bytes());
    }

    /// A byte has been received.
    pub fn receive(&mut self, byte: u8) {
        self.bytes.extend([b'B', byte]);
    }

    /// The content of a cell of EEPROM.
    pub fn cell(&mut self, cell: u16, byte: u8) {
        self.command(b'E', cell, &[byte]);
    }

    /// The value of a bit or an integer, by its slot.
    pub fn write(&mut self, slot: u16, value: i32) {
        self.command(b'W', slot, &value.to_le_bytes());
    }

    /// One scan.
    pub fn scan(&mut self) {
        self.bytes.push(b'S');
        self.scans += 1;
    }

    fn command(&mut self, command: u8, number: u16, rest: &[u8]) {
        self.bytes.push(command);
        self.bytes.extend(number.to_le_bytes());
        self.bytes.extend(rest);
    }

    /// The scans so far.
    #[must_use]
    pub fn scans(&self) -> u64 {
        self.scans
    }

    /// The bytes so far.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// What a scan has left behind.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ScanRecord {
    /// Cells, in the order of [`EmittedSource::eeprom`].
    pub cells: Vec<i32>,
    /// Outputs as they were written, in the order of [`EmittedSource::outputs`].
    pub outputs: Vec<bool>,
    /// How many bytes were sent, and the last of them.
    pub sent: (u8, u8),
    /// The duty of the PWM output in percent, once it was set.
    pub duty: Option<u8>,
    /// The cells of EEPROM.
    pub eeprom: Vec<u8>,
}

impl SlotNumbering {
    /// What a record of `source` is made of.
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

/// How long a record is and where its parts stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordShape {
    /// All slots that are told.
    pub slots: usize,
    /// The slot of each cell.
    pub cells: Vec<u16>,
    /// Outputs.
    pub outputs: usize,
    /// Cells of EEPROM.
    pub eeprom: usize,
}

impl RecordShape {
    /// Bytes of a record.
    #[must_use]
    pub fn len(&self) -> usize {
        4 * self.slots + self.outputs + 3 + self.eeprom
    }

    /// A record is never empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Reads one record; `None` where there are not as many bytes.
    #[must_use]
    pub fn read_record(&self, bytes: &[u8]) -> Option<ScanRecord> {
        let (slots, rest) = bytes.split_at_checked(4 * self.slots)?;
        let (outputs, rest) = rest.split_at_checked(self.outputs)?;
        let ([count, last, duty], rest) = rest.split_first_chunk()?;
        let value = |slot: &u16| -> Option<i32> {
            let at = 4 * usize::from(*slot);
            Some(i32::from_le_bytes(slots.get(at..at + 4)?.try_into().ok()?))
        };
        Some(ScanRecord {
            cells: self.cells.iter().map(value).collect::<Option<_>>()?,
            outputs: outputs.iter().map(|&on| on != 0).collect(),
            sent: (*count, *last),
            duty: (*duty != 255).then_some(*duty),
            eeprom: rest.get(..self.eeprom)?.to_vec(),
        })
    }
}
