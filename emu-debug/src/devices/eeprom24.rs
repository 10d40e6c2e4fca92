//! A serial EEPROM of the 24Cxx type at a two-wire bus: SDA, SCL, A0 to A2, WP.
//!
//! Sources: Atmel AT24C01A/02/04/08A/16A (0180), AT24C32/64 (0336), AT24C128/256 (0670), AT24C512 (1116),
//! AT24C1024 (1471); Microchip 24AA024 (DS21710), 24AA16 (DS21703), 24AA256 (DS21203): device addressing,
//! write and read operations.
//!
//! Written bytes wait in the page buffer. A stop condition between bytes starts the write cycle, during which
//! no address is acknowledged (polling). A start condition instead of the stop, or a stop within a byte,
//! discards them.

use super::cells::SharedBytes;

/// Size and addressing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Eeprom24Kind {
    name: &'static str,
    size: usize,
    page: usize,
    /// Number of address bytes after the control byte.
    address: u8,
    /// Bits of the control byte that must equal A2 to A0.
    select: u8,
    /// Bits of the control byte that are the upper bits of the address.
    block: u8,
}

/// The types by name; the size is in bytes.
#[rustfmt::skip]
const KINDS: [Eeprom24Kind; 11] = [
    Eeprom24Kind { name: "24c01",   size: 0x80,     page: 8,   address: 1, select: 0x0E, block: 0x00 },
    Eeprom24Kind { name: "24c02",   size: 0x100,    page: 8,   address: 1, select: 0x0E, block: 0x00 },
    Eeprom24Kind { name: "24c04",   size: 0x200,    page: 16,  address: 1, select: 0x0C, block: 0x02 },
    Eeprom24Kind { name: "24c08",   size: 0x400,    page: 16,  address: 1, select: 0x08, block: 0x06 },
    Eeprom24Kind { name: "24c16",   size: 0x800,    page: 16,  address: 1, select: 0x00, block: 0x0E },
    Eeprom24Kind { name: "24c32",   size: 0x1000,   page: 32,  address: 2, select: 0x0E, block: 0x00 },
    Eeprom24Kind { name: "24c64",   size: 0x2000,   page: 32,  address: 2, select: 0x0E, block: 0x00 },
    Eeprom24Kind { name: "24c128",  size: 0x4000,   page: 64,  address: 2, select: 0x0E, block: 0x00 },
    Eeprom24Kind { name: "24c256",  size: 0x8000,   page: 64,  address: 2, select: 0x0E, block: 0x00 },
    Eeprom24Kind { name: "24c512",  size: 0x1_0000, page: 128, address: 2, select: 0x0E, block: 0x00 },
    Eeprom24Kind { name: "24c1024", size: 0x2_0000, page: 256, address: 2, select: 0x0C, block: 0x02 },
];

/// The modules of gpsim, whose writes take no time.
#[rustfmt::skip]
const MODULES: [(&[&str], Eeprom24Kind); 3] = [
    (&["e24xx024", "I2C-EEPROM2k"],    Eeprom24Kind { name: "", size: 256,   page: 16, address: 1, select: 0x0E, block: 0x00 }),
    (&["e24xx16b", "I2C-EEPROM16k"],   Eeprom24Kind { name: "", size: 2048,  page: 16, address: 1, select: 0x00, block: 0x0E }),
    (&["e24xx256", "I2C-EEPROM256k"],  Eeprom24Kind { name: "", size: 32768, page: 64, address: 2, select: 0x0E, block: 0x00 }),
];

/// The write cycle in microseconds: tWR, the maximum in the data sheets.
const WRITE_US: u64 = 5_000;

/// The phase of a transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TransferPhase {
    /// Waiting for a start.
    Idle,
    /// Receiving the control byte, remaining address bytes, or data.
    Control,
    Address(u8),
    Data,
    /// Sending data.
    Send,
}

/// The EEPROM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Eeprom24 {
    kind: Eeprom24Kind,
    /// Its contents.
    pub cells: SharedBytes,
    /// Bytes waiting for the write cycle, by their position in the page.
    buffer: Vec<(usize, u8)>,
    /// The write cycle in microseconds, and the clock at which the current one ends.
    write_us: u64,
    busy_until: u64,
    phase: TransferPhase,
    /// Bits of the current byte, and how many have been clocked: 8 is the acknowledge.
    shift: u8,
    bits: u8,
    at: usize,
    /// Whether it pulls SDA low.
    pub pulls_sda: bool,
    /// Whether the master has acknowledged the last sent byte.
    acknowledged: bool,
    sda: bool,
    scl: bool,
    /// A0, A1, A2 in bits 1 to 3, as in the control byte.
    select: u8,
    protected: bool,
}

/// The pins, in the order of the package terminals.
pub const PINS: [&str; 6] = ["SDA", "SCL", "A0", "A1", "A2", "WP"];

impl Eeprom24 {
    /// Returns an erased EEPROM by its name, `24c01` to `24c1024`; the lines A0 to A2 give its address.
    #[must_use]
    pub fn new(name: &str) -> Option<Eeprom24> {
        let kind = KINDS.iter().find(|kind| kind.name.eq_ignore_ascii_case(name))?;
        Some(Eeprom24::of(*kind, 0xFF, WRITE_US))
    }

    /// Returns an EEPROM by the name of gpsim's module: `e24xx024`, `e24xx16b`, `e24xx256`. It contains
    /// zeros, and writes take no time.
    #[must_use]
    pub fn module(name: &str) -> Option<Eeprom24> {
        let (_, kind) = MODULES.iter().find(|(names, _)| names.contains(&name))?;
        Some(Eeprom24::of(*kind, 0, 0))
    }

    fn of(kind: Eeprom24Kind, value: u8, write_us: u64) -> Eeprom24 {
        Eeprom24 {
            kind,
            cells: SharedBytes::new(kind.size, value),
            buffer: Vec::new(),
            write_us,
            busy_until: 0,
            phase: TransferPhase::Idle,
            shift: 0,
            bits: 0,
            at: 0,
            pulls_sda: false,
            acknowledged: false,
            sda: true,
            scl: true,
            select: 0,
            protected: false,
        }
    }

    /// Returns the names of all types.
    pub fn names() -> impl Iterator<Item = &'static str> {
        KINDS.iter().map(|kind| kind.name)
    }

    /// Ties A0 to A2 so that it answers to a seven-bit address; returns false if that is not possible.
    pub fn tie_address(&mut self, address: u8) -> bool {
        let control = address << 1;
        self.select = control & 0x0E;
        address < 0x80 && control & 0xF0 == 0xA0 && control & 0x0E & !self.kind.select == 0
    }

    /// Returns true if it answers to a seven-bit address with the current levels of A0 to A2; types with
    /// fewer of these lines answer to several.
    #[must_use]
    pub fn is_addressed_by(&self, address: u8) -> bool {
        let control = address << 1;
        address < 0x80 && control & 0xF0 == 0xA0 && (control ^ self.select) & self.kind.select == 0
    }

    /// Reports a level change of a pin at the clock `t`; there are `hz` clocks per second.
    pub fn on_pin_change(&mut self, pin: usize, high: bool, t: u64, hz: u64) {
        match pin {
            0 => self.on_sda(high, t, hz),
            1 => self.on_scl(high, t),
            2..=4 => self.select = self.select & !(1 << (pin - 1)) | u8::from(high) << (pin - 1),
            _ => self.protected = high,
        }
    }

    fn on_sda(&mut self, high: bool, t: u64, hz: u64) {
        if std::mem::replace(&mut self.sda, high) == high || !self.scl {
            return;
        }
        // A change of SDA while SCL is high is a stop or a start. The clock pulse around it has already begun
        // a bit.
        if high && self.phase == TransferPhase::Data && self.bits <= 1 && !self.buffer.is_empty() {
            self.write(t, hz);
        }
        self.buffer.clear();
        self.phase = if high { TransferPhase::Idle } else { TransferPhase::Control };
        (self.bits, self.shift, self.pulls_sda) = (0, 0, false);
    }

    /// Begins the write cycle.
    fn write(&mut self, t: u64, hz: u64) {
        for &(at, byte) in &self.buffer {
            self.cells.set(at, byte);
        }
        let clocks = u128::from(self.write_us) * u128::from(hz) / 1_000_000;
        self.busy_until = t.saturating_add(u64::try_from(clocks).unwrap_or(u64::MAX));
    }

    fn on_scl(&mut self, high: bool, t: u64) {
        if std::mem::replace(&mut self.scl, high) == high || self.phase == TransferPhase::Idle {
            return;
        }
        if high { self.on_scl_rising() } else { self.on_scl_falling(t) }
    }

    /// Samples the master's bit at the rising edge.
    fn on_scl_rising(&mut self) {
        match self.bits {
            0..=7 if self.phase != TransferPhase::Send => {
                self.shift = self.shift << 1 | u8::from(self.sda);
                self.bits += 1;
            }
            0..=7 => self.bits += 1,
            8 => {
                self.acknowledged = !self.sda;
                self.bits = 9;
            }
            _ => {}
        }
    }

    /// Updates the output on SDA after the falling edge.
    fn on_scl_falling(&mut self, t: u64) {
        match (self.bits, self.phase) {
            (8, TransferPhase::Send) => self.pulls_sda = false,
            (8, _) => self.pulls_sda = self.receive_byte(self.shift, t),
            (9, TransferPhase::Send) if !self.acknowledged => {
                (self.phase, self.bits, self.pulls_sda) = (TransferPhase::Idle, 0, false);
            }
            (9, phase) => {
                (self.bits, self.shift, self.pulls_sda) = (0, 0, false);
                if phase == TransferPhase::Send {
                    self.load();
                }
            }
            (1..=7, TransferPhase::Send) => self.pulls_sda = self.shift >> (7 - self.bits) & 1 == 0,
            _ => {}
        }
    }

    /// Puts the next cell on the bus.
    fn load(&mut self) {
        self.shift = self.cells.get(self.at);
        self.at = (self.at + 1) % self.kind.size;
        self.pulls_sda = self.shift & 0x80 == 0;
    }

    /// Receives a byte of the master at the clock `t`; returns whether it is acknowledged.
    fn receive_byte(&mut self, byte: u8, t: u64) -> bool {
        match self.phase {
            TransferPhase::Control => {
                if t < self.busy_until || byte & 0xF0 != 0xA0 || (byte ^ self.select) & self.kind.select != 0 {
                    self.phase = TransferPhase::Idle;
                    return false;
                }
                if byte & 1 == 1 {
                    self.phase = TransferPhase::Send;
                } else {
                    self.at = usize::from((byte & self.kind.block) >> 1);
                    self.phase = TransferPhase::Address(self.kind.address);
                }
            }
            TransferPhase::Address(left) => {
                self.at = (self.at << 8 | usize::from(byte)) % self.kind.size;
                self.phase = if left > 1 { TransferPhase::Address(left - 1) } else { TransferPhase::Data };
            }
            TransferPhase::Data => {
                if !self.protected {
                    let at = self.at;
                    self.buffer.retain(|waiting| waiting.0 != at);
                    self.buffer.push((at, byte));
                }
                // The address wraps around within a page.
                let page = self.at / self.kind.page * self.kind.page;
                self.at = page + (self.at + 1) % self.kind.page;
            }
            TransferPhase::Send | TransferPhase::Idle => return false,
        }
        true
    }
}
