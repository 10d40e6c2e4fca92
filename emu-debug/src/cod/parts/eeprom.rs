//! A serial EEPROM of the 24xx kind at the pins: SDA, SCL, A0 to A2, WP.
//!
//! Sources: Microchip data sheets 24AA024 (DS21710), 24AA16 (DS21703), 24AA256 (DS21203), sections "Bus characteristics" and
//! "Write operations". What is written is there at once: the 5 ms of the write cycle are left out, as in gpsim's module.

/// Size and addressing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Kind {
    size: usize,
    page: usize,
    /// Bytes of the address that follow the control byte.
    address: u8,
    /// Bits of the control byte that A2 to A0 must equal.
    select: u8,
    /// Bits of the control byte that are the upper bits of the address.
    block: u8,
}

/// Where a transfer stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Waits for a start.
    Idle,
    /// Takes in the control byte, address bytes still to come, or data.
    Control,
    Address(u8),
    Data,
    /// Sends data.
    Send,
}

/// The EEPROM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Eeprom {
    kind: Kind,
    /// What it holds.
    pub cells: Vec<u8>,
    phase: Phase,
    /// Bits of the byte that is on its way, and how many have been clocked: 8 is the acknowledge.
    shift: u8,
    bits: u8,
    at: usize,
    /// It pulls SDA low.
    pub pulls: bool,
    /// The master has acknowledged the byte sent last.
    more: bool,
    sda: bool,
    scl: bool,
    /// A0, A1, A2 in bits 1 to 3, as they stand in the control byte.
    select: u8,
    protected: bool,
}

/// The pins, in the order of the terminals.
pub const PINS: [&str; 6] = ["SDA", "SCL", "A0", "A1", "A2", "WP"];

impl Eeprom {
    /// An EEPROM by the name of its module: `e24xx024`, `e24xx16b`, `e24xx256`. It holds zeros.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let kind = match name {
            "e24xx024" | "I2C-EEPROM2k" => Kind { size: 256, page: 16, address: 1, select: 0x0E, block: 0 },
            "e24xx16b" | "I2C-EEPROM16k" => Kind { size: 2048, page: 16, address: 1, select: 0, block: 0x0E },
            "e24xx256" | "I2C-EEPROM256k" => Kind { size: 32768, page: 64, address: 2, select: 0x0E, block: 0 },
            _ => return None,
        };
        Some(Eeprom {
            kind,
            cells: vec![0; kind.size],
            phase: Phase::Idle,
            shift: 0,
            bits: 0,
            at: 0,
            pulls: false,
            more: false,
            sda: true,
            scl: true,
            select: 0,
            protected: false,
        })
    }

    /// The level of a pin has changed.
    pub fn line(&mut self, pin: usize, high: bool) {
        match pin {
            0 => self.sda(high),
            1 => self.scl(high),
            2..=4 => self.select = self.select & !(1 << (pin - 1)) | u8::from(high) << (pin - 1),
            _ => self.protected = high,
        }
    }

    fn sda(&mut self, high: bool) {
        if std::mem::replace(&mut self.sda, high) == high || !self.scl {
            return;
        }
        // A change of SDA while SCL is high is a stop or a start.
        self.phase = if high { Phase::Idle } else { Phase::Control };
        (self.bits, self.shift, self.pulls) = (0, 0, false);
    }

    fn scl(&mut self, high: bool) {
        if std::mem::replace(&mut self.scl, high) == high || self.phase == Phase::Idle {
            return;
        }
        if high { self.rising() } else { self.falling() }
    }

    /// The master's bits are taken at the rising edge.
    fn rising(&mut self) {
        match self.bits {
            0..=7 if self.phase != Phase::Send => {
                self.shift = self.shift << 1 | u8::from(self.sda);
                self.bits += 1;
            }
            0..=7 => self.bits += 1,
            8 => {
                self.more = !self.sda;
                self.bits = 9;
            }
            _ => {}
        }
    }

    /// What the memory puts on SDA changes after the falling edge.
    fn falling(&mut self) {
        match (self.bits, self.phase) {
            (8, Phase::Send) => self.pulls = false,
            (8, _) => self.pulls = self.byte(self.shift),
            (9, Phase::Send) if !self.more => {
                (self.phase, self.bits, self.pulls) = (Phase::Idle, 0, false);
            }
            (9, phase) => {
                (self.bits, self.shift, self.pulls) = (0, 0, false);
                if phase == Phase::Send {
                    self.load();
                }
            }
            (1..=7, Phase::Send) => self.pulls = self.shift >> (7 - self.bits) & 1 == 0,
            _ => {}
        }
    }

    /// Puts the next cell on the bus.
    fn load(&mut self) {
        self.shift = self.cells.get(self.at).copied().unwrap_or(0xFF);
        self.at = (self.at + 1) % self.kind.size;
        self.pulls = self.shift & 0x80 == 0;
    }

    /// Takes a byte of the master; true where it is acknowledged.
    fn byte(&mut self, byte: u8) -> bool {
        match self.phase {
            Phase::Control => {
                if byte & 0xF0 != 0xA0 || (byte ^ self.select) & self.kind.select != 0 {
                    self.phase = Phase::Idle;
                    return false;
                }
                if byte & 1 == 1 {
                    self.phase = Phase::Send;
                } else {
                    self.at = usize::from((byte & self.kind.block) >> 1);
                    self.phase = Phase::Address(self.kind.address);
                }
            }
            Phase::Address(left) => {
                self.at = (self.at << 8 | usize::from(byte)) % self.kind.size;
                self.phase = if left > 1 { Phase::Address(left - 1) } else { Phase::Data };
            }
            Phase::Data => {
                if let Some(cell) = self.cells.get_mut(self.at).filter(|_| !self.protected) {
                    *cell = byte;
                }
                // Within a page the address rolls over.
                let page = self.at / self.kind.page * self.kind.page;
                self.at = page + (self.at + 1) % self.kind.page;
            }
            Phase::Send | Phase::Idle => return false,
        }
        true
    }
}
