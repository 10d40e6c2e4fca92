//! A serial flash memory of the 25Qxx type at an SPI bus: CS, SCK, MOSI, MISO; modes 0 and 3.
//!
//! Source: Winbond W25Q80DV, W25Q16JV, W25Q32JV, W25Q64JV, W25Q128JV: instruction set tables, AC
//! characteristics (typical times). It supports WREN, WRDI, RDSR (05h, 35h, 15h), READ, FAST_READ, PP, the
//! erases of 4, 32 and 64 KB and of the chip, RDID, 90h, and power-down with its release. Other instructions
//! are ignored up to the end of the transfer, including those for the protection bits of the status
//! registers: nothing is protected.

use super::cells::SharedBytes;

/// Size and timing of a type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Flash25Kind {
    name: &'static str,
    /// Base-2 logarithm of the size in bytes, as in the third byte of RDID.
    log2: u8,
    /// Microseconds of tPP, tSE, tBE1, tBE2, tCE.
    program_us: u64,
    erase_us: [u64; 3],
    erase_all_us: u64,
}

/// The types by name.
#[rustfmt::skip]
const KINDS: [Flash25Kind; 5] = [
    Flash25Kind { name: "25q80",  log2: 20, program_us: 700, erase_us: [30_000, 120_000, 150_000], erase_all_us:  2_000_000 },
    Flash25Kind { name: "25q16",  log2: 21, program_us: 400, erase_us: [45_000, 120_000, 150_000], erase_all_us:  5_000_000 },
    Flash25Kind { name: "25q32",  log2: 22, program_us: 400, erase_us: [45_000, 120_000, 150_000], erase_all_us: 10_000_000 },
    Flash25Kind { name: "25q64",  log2: 23, program_us: 400, erase_us: [45_000, 120_000, 150_000], erase_all_us: 20_000_000 },
    Flash25Kind { name: "25q128", log2: 24, program_us: 400, erase_us: [45_000, 120_000, 150_000], erase_all_us: 40_000_000 },
];

/// Manufacturer and memory type in RDID.
const WINBOND: u8 = 0xEF;
const MEMORY_TYPE: u8 = 0x40;

/// Bytes of a page, which is programmed at once.
const PAGE: usize = 256;

/// Instructions.
mod opcode {
    pub const PROGRAM: u8 = 0x02;
    pub const READ: u8 = 0x03;
    pub const WRITE_DISABLE: u8 = 0x04;
    pub const STATUS: [u8; 3] = [0x05, 0x35, 0x15];
    pub const WRITE_ENABLE: u8 = 0x06;
    pub const FAST_READ: u8 = 0x0B;
    pub const ERASES: [(u8, usize); 3] = [(0x20, 0x1000), (0x52, 0x8000), (0xD8, 0x1_0000)];
    pub const MANUFACTURER: u8 = 0x90;
    pub const ID: u8 = 0x9F;
    pub const RELEASE: u8 = 0xAB;
    pub const POWER_DOWN: u8 = 0xB9;
    pub const ERASE_ALL: [u8; 2] = [0x60, 0xC7];
}

/// WIP (BUSY) and WEL in the first status register.
const BUSY: u8 = 1;
const WEL: u8 = 1 << 1;

/// The flash memory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Flash25 {
    kind: Flash25Kind,
    /// Its contents.
    pub cells: SharedBytes,
    selected: bool,
    sck: bool,
    mosi: bool,
    /// The level that it drives on MISO.
    pub out: Option<bool>,
    /// Bits of the current byte, their number, and the number of whole bytes before it; then the instruction.
    shift: u8,
    bits: u8,
    count: usize,
    command: Option<u8>,
    addr: usize,
    /// The byte that is sent while the next one is received.
    answer: Option<u8>,
    /// Bytes to program, by their position in the page.
    page: Vec<Option<u8>>,
    write_enabled: bool,
    powered_down: bool,
    /// The clock at which the current operation ends.
    busy_until: u64,
}

/// The pins, in the order of the package terminals.
pub const PINS: [&str; 4] = ["CS", "SCK", "MOSI", "MISO"];

impl Flash25 {
    /// Returns an erased, unselected memory by its name, `25q80` to `25q128`.
    #[must_use]
    pub fn new(name: &str) -> Option<Flash25> {
        let kind = *KINDS.iter().find(|kind| kind.name.eq_ignore_ascii_case(name))?;
        Some(Flash25 {
            kind,
            cells: SharedBytes::new(1 << kind.log2, 0xFF),
            selected: false,
            sck: false,
            mosi: false,
            out: None,
            shift: 0,
            bits: 0,
            count: 0,
            command: None,
            addr: 0,
            answer: None,
            page: Vec::new(),
            write_enabled: false,
            powered_down: false,
            busy_until: 0,
        })
    }

    /// Returns the names of all types.
    pub fn names() -> impl Iterator<Item = &'static str> {
        KINDS.iter().map(|kind| kind.name)
    }

    /// Reports a level change of a pin at the clock `t`; there are `hz` clocks per second.
    pub fn on_pin_change(&mut self, pin: usize, high: bool, t: u64, hz: u64) {
        match pin {
            0 if self.selected == high => {
                self.selected = !high;
                if high { self.deselect(t, hz) } else { self.select() }
            }
            1 if self.sck != high => {
                self.sck = high;
                match (self.selected, high) {
                    (false, _) => {}
                    (true, true) => self.on_sck_rising(t),
                    (true, false) => self.on_sck_falling(),
                }
            }
            2 => self.mosi = high,
            _ => {}
        }
    }

    fn select(&mut self) {
        (self.bits, self.count, self.command, self.answer) = (0, 0, None, None);
        self.page.clear();
    }

    /// Samples a bit at the rising edge.
    fn on_sck_rising(&mut self, t: u64) {
        self.shift = self.shift << 1 | u8::from(self.mosi);
        self.bits += 1;
        if self.bits == 8 {
            self.bits = 0;
            self.answer = self.receive_byte(self.shift, t);
            self.count = self.count.saturating_add(1);
        }
    }

    /// Updates the output at the falling edge.
    fn on_sck_falling(&mut self) {
        self.out = self.answer.map(|byte| byte >> (7 - self.bits) & 1 == 1);
    }

    /// Receives a byte at the clock `t`; returns the next byte to send.
    fn receive_byte(&mut self, byte: u8, t: u64) -> Option<u8> {
        let busy = t < self.busy_until;
        if self.count == 0 {
            // During an operation only the status registers can be read; in power-down only the release is
            // accepted.
            let heard = (!busy || opcode::STATUS.contains(&byte)) && (!self.powered_down || byte == opcode::RELEASE);
            self.command = Some(byte).filter(|_| heard);
            self.addr = 0;
        } else if self.count <= 3 {
            self.addr = self.addr << 8 | usize::from(byte);
        }
        let (command, count) = (self.command?, self.count);
        let id = [WINBOND, self.kind.log2 - 1];
        match command {
            opcode::READ if count >= 3 => Some(self.next_cell()),
            opcode::FAST_READ if count >= 4 => Some(self.next_cell()),
            opcode::PROGRAM if count >= 4 => {
                self.page.resize(PAGE, None);
                // The page wraps around; if there are more bytes than it holds, the last ones count.
                let at = (self.addr + count - 4) % PAGE;
                if let Some(place) = self.page.get_mut(at) {
                    *place = Some(byte);
                }
                None
            }
            opcode::ID => Some(*[WINBOND, MEMORY_TYPE, self.kind.log2].get(count)?),
            opcode::MANUFACTURER if count >= 3 => id.get((count - 3 + (self.addr & 1)) % 2).copied(),
            opcode::RELEASE if count >= 3 => Some(id[1]),
            // The write enable is cleared at the end of the operation for which it was set.
            _ if command == opcode::STATUS[0] && busy => Some(BUSY | WEL),
            _ if command == opcode::STATUS[0] => Some(if self.write_enabled { WEL } else { 0 }),
            _ if opcode::STATUS.contains(&command) => Some(0),
            _ => None,
        }
    }

    fn next_cell(&mut self) -> u8 {
        let byte = self.cells.get(self.addr % self.cells.len());
        self.addr = (self.addr + 1) % self.cells.len();
        byte
    }

    /// Ends a transfer: instructions that change something act now, if the transfer ends at a byte boundary.
    fn deselect(&mut self, t: u64, hz: u64) {
        self.out = None;
        let Some(command) = self.command.filter(|_| self.bits == 0) else { return };
        match command {
            opcode::WRITE_ENABLE => self.write_enabled = true,
            opcode::WRITE_DISABLE => self.write_enabled = false,
            opcode::POWER_DOWN => self.powered_down = true,
            opcode::RELEASE => self.powered_down = false,
            opcode::PROGRAM if self.write_enabled && !self.page.is_empty() => {
                let first = self.addr % self.cells.len() / PAGE * PAGE;
                for (at, byte) in self.page.iter().enumerate() {
                    let Some(byte) = byte else { continue };
                    // Programming only changes ones to zeros.
                    let old = self.cells.get(first + at);
                    self.cells.set(first + at, old & byte);
                }
                self.start_operation(self.kind.program_us, t, hz);
            }
            _ if opcode::ERASE_ALL.contains(&command) && self.write_enabled => {
                self.cells = SharedBytes::new(self.cells.len(), 0xFF);
                self.start_operation(self.kind.erase_all_us, t, hz);
            }
            _ => {
                let erase = opcode::ERASES.iter().zip(self.kind.erase_us).find(|((code, _), _)| *code == command);
                if let Some((&(_, size), us)) = erase.filter(|_| self.write_enabled && self.count == 4) {
                    let first = self.addr % self.cells.len() / size * size;
                    (first..first + size).for_each(|at| self.cells.set(at, 0xFF));
                    self.start_operation(us, t, hz);
                }
            }
        }
    }

    /// Begins an operation that takes time, and clears the write enable.
    fn start_operation(&mut self, us: u64, t: u64, hz: u64) {
        let clocks = u128::from(us) * u128::from(hz) / 1_000_000;
        self.busy_until = t.saturating_add(u64::try_from(clocks).unwrap_or(u64::MAX));
        self.write_enabled = false;
    }
}
