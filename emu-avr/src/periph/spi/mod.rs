//! SPI (section 19), master and slave.
//!
//! What is on SCK, MOSI, MISO and SS comes by `AvrDevice::line`; that SS is an output, and so none that selects, by
//! `AvrDevice::direction`.

mod device;

use emu_core::NEVER;
use emu_core::state;

use super::edges::SynchronizedPin;
use super::{AvrDrive, AvrLine, AvrOutbox, AvrSignal};

/// SPCR: interrupt enable.
pub const SPIE: u8 = 1 << 7;
/// SPCR: enable.
pub const SPE: u8 = 1 << 6;
/// SPCR: data order, lowest bit first.
pub const DORD: u8 = 1 << 5;
/// SPCR: master.
pub const MSTR: u8 = 1 << 4;
/// SPCR: clock polarity, high when idle.
pub const CPOL: u8 = 1 << 3;
/// SPCR: clock phase, sampled with the second edge.
pub const CPHA: u8 = 1 << 2;
/// SPSR: interrupt flag.
pub const SPIF: u8 = 1 << 7;
/// SPSR: write collision.
pub const WCOL: u8 = 1 << 6;
/// SPSR: double speed.
pub const SPI2X: u8 = 1;

/// The registers.
#[allow(missing_docs)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SpiRegister {
    SPCR,
    SPSR,
    SPDR,
}

/// The serial peripheral interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AvrSpi {
    /// SPCR.
    control: u8,
    /// SPSR.
    status: u8,
    /// Flags that SPSR has shown since they were set: an access to SPDR clears them.
    shown: u8,
    /// The receive buffer.
    buffer: u8,
    /// The shift register, the end that goes out being bit 7.
    shift: u8,
    /// What goes out while a byte is on its way.
    bit: bool,
    /// Bits sampled.
    count: u8,
    /// A byte is on its way: from the write (master) or the first edge of SCK (slave) to its last edge.
    moving: bool,
    /// When the last byte ended.
    ended: u64,
    /// The master's clock is active, and when it changes next.
    active: bool,
    half: u64,
    /// When the master finds that it is selected by another one.
    selected: u64,
    sck: SynchronizedPin,
    /// A slave samples it behind the same flip-flops as SCK.
    mosi: SynchronizedPin,
    miso: bool,
    ss: bool,
    /// DDR makes SS an output.
    ss_output: bool,
    /// What is done to SCK, MISO, MOSI and SS.
    drives: [AvrDrive; 4],
    /// Since when the clock stands.
    asleep: Option<u64>,
}

state! {
    AvrSpi {
        control, status, shown, buffer, shift, bit, count, moving, ended, active, half, selected, sck, mosi, miso, ss, ss_output,
        drives, asleep,
    } if |spi, now| spi.count <= 8 && spi.is_valid_state(now)
}

impl AvrSpi {
    /// As after power-on; all wires are low until told otherwise.
    #[must_use]
    pub fn new() -> AvrSpi {
        AvrSpi {
            control: 0,
            status: 0,
            shown: 0,
            buffer: 0,
            shift: 0,
            bit: false,
            count: 0,
            moving: false,
            ended: NEVER,
            active: false,
            half: NEVER,
            selected: NEVER,
            sck: SynchronizedPin::new(false),
            mosi: SynchronizedPin::new(false),
            miso: false,
            ss: false,
            ss_output: false,
            drives: [AvrDrive::Port; 4],
            asleep: None,
        }
    }

    /// What was read can be of a part that has done everything up to `now`.
    fn is_valid_state(&self, now: u64) -> bool {
        let next = self.half.min(self.selected).min(self.sck.next());
        self.asleep.map_or(next > now, |since| since <= now + 1 && next >= since)
    }

    fn has(&self, bit: u8) -> bool {
        self.control & bit != 0
    }

    fn is_master(&self) -> bool {
        self.has(SPE) && self.has(MSTR)
    }

    /// A slave that is selected; SS is its input whatever DDR says (section 19.3.1, table 14-3).
    fn is_slave(&self) -> bool {
        self.has(SPE) && !self.has(MSTR) && !self.ss
    }

    /// Half a period of SCK, in cycles (table 19-5).
    fn period_half(&self) -> u64 {
        let half = match self.control & 3 {
            0 => 2,
            1 => 8,
            2 => 32,
            _ => 64,
        };
        if self.status & SPI2X != 0 { half / 2 } else { half }
    }

    /// A byte as the shift register has it, or back.
    fn in_bit_order(&self, byte: u8) -> u8 {
        if self.has(DORD) { byte.reverse_bits() } else { byte }
    }

    fn due(&self) -> u64 {
        match self.asleep {
            Some(_) => NEVER,
            None => self.half.min(self.selected).min(self.sck.next()),
        }
    }

    fn step(&mut self, t: u64, out: &mut AvrOutbox) {
        if let Some(high) = self.sck.pop(t).filter(|_| self.is_slave()) {
            self.on_clock_edge(high != self.has(CPOL), t);
        }
        if self.half <= t {
            self.active = !self.active;
            self.half = t.saturating_add(self.period_half());
            self.put_bit(self.active);
            self.on_clock_edge(self.active, t);
        }
        if self.selected <= t {
            self.selected = NEVER;
            self.control &= !MSTR;
            self.abort();
            self.status |= SPIF;
        }
        self.drive_lines(t, out);
    }

    /// An edge of SCK, the leading one or the trailing one: the next bit goes out (table 19-2, figures 19-3 and 19-4). SCK itself
    /// clocks the output of a slave: no more than 15 ns lie between them (table 29-18), which is less than its synchroniser takes.
    fn put_bit(&mut self, leading: bool) {
        if leading == self.has(CPHA) {
            self.bit = self.shift & 0x80 != 0;
        }
    }

    /// The same edge: a bit comes in.
    fn on_clock_edge(&mut self, leading: bool, t: u64) {
        self.moving = true;
        if leading != self.has(CPHA) {
            let input = if self.is_master() { self.miso } else { self.mosi.level(t) };
            self.bit = self.output();
            self.shift = self.shift << 1 | u8::from(input);
            self.count += 1;
        }
        if leading || self.count < 8 {
            return;
        }
        self.abort();
        self.ended = t;
        self.buffer = self.in_bit_order(self.shift);
        self.status |= SPIF;
    }

    /// No byte is on its way any more.
    fn abort(&mut self) {
        (self.count, self.moving, self.active, self.half) = (0, false, false, NEVER);
    }

    /// SPDR is written.
    fn load(&mut self, byte: u8, t: u64) {
        self.clear_flag();
        if self.moving || self.ended == t {
            self.status |= WCOL;
            return;
        }
        self.shift = self.in_bit_order(byte);
        if self.is_master() {
            self.moving = true;
            self.half = t.saturating_add(self.period_half());
        }
    }

    /// SPDR is accessed.
    fn clear_flag(&mut self) {
        self.status &= !std::mem::take(&mut self.shown);
    }

    /// Looks whether the master is selected: what is so in cycle `t` is noticed at the edge that ends it.
    fn update_synchronizers(&mut self, t: u64) {
        let selected = self.is_master() && !self.ss_output && !self.ss;
        self.selected = match (selected, self.selected) {
            (true, NEVER) => t.saturating_add(1),
            (true, due) => due,
            (false, _) => NEVER,
        };
    }

    /// The level that goes out. With CPHA = 0 the first bit is there before the first edge.
    fn output(&self) -> bool {
        let waiting = !self.has(CPHA) && self.count == 0;
        if waiting { self.shift & 0x80 != 0 } else { self.bit }
    }

    /// Says what is done to the lines, where that has changed (tables 14-3 to 14-5).
    fn drive_lines(&mut self, t: u64, out: &mut AvrOutbox) {
        let drives = if self.is_master() {
            let sck = AvrDrive::Value(self.active != self.has(CPOL));
            [sck, AvrDrive::Input, AvrDrive::Value(self.output()), AvrDrive::Port]
        } else if self.has(SPE) {
            let miso = if self.ss { AvrDrive::Input } else { AvrDrive::Value(self.output()) };
            [AvrDrive::Input, miso, AvrDrive::Input, AvrDrive::Input]
        } else {
            [AvrDrive::Port; 4]
        };
        let lines = [AvrLine::Sck, AvrLine::Miso, AvrLine::Mosi, AvrLine::Ss].into_iter().zip(drives);
        for ((line, drive), held) in lines.zip(&mut self.drives) {
            if std::mem::replace(held, drive) != drive {
                out.push(AvrSignal::Drive { t, line, drive });
            }
        }
    }
}

impl Default for AvrSpi {
    fn default() -> AvrSpi {
        AvrSpi::new()
    }
}
