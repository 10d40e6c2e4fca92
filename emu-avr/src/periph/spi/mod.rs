//! SPI (section 19), master and slave.
//!
//! The levels of SCK, MOSI, MISO and SS arrive by [`on_line_changed`](super::Device::on_line_changed).
//! [`on_direction_changed`](super::Device::on_direction_changed) reports whether SS is an output; as an
//! output it does not select the SPI.

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
/// SPCR: master mode.
pub const MSTR: u8 = 1 << 4;
/// SPCR: clock polarity, high when idle.
pub const CPOL: u8 = 1 << 3;
/// SPCR: clock phase, data sampled at the second edge.
pub const CPHA: u8 = 1 << 2;
/// SPSR: interrupt flag.
pub const SPIF: u8 = 1 << 7;
/// SPSR: write collision.
pub const WCOL: u8 = 1 << 6;
/// SPSR: double speed.
pub const SPI2X: u8 = 1;

/// The registers of the SPI.
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
    /// Flags that a read of SPSR has shown since they were set; an access to SPDR clears them.
    shown: u8,
    /// Receive buffer.
    buffer: u8,
    /// Shift register; bit 7 is sent next.
    shift: u8,
    /// Bit on the output during a transfer.
    bit: bool,
    /// Number of bits sampled.
    count: u8,
    /// True during a transfer: from the write (master) or the first edge of SCK (slave) to the last edge.
    moving: bool,
    /// Cycle at which the last byte ended.
    ended: u64,
    /// True while the master's clock is at its active level; then the cycle of its next change.
    active: bool,
    half: u64,
    /// Cycle at which the master detects that another master selects it.
    selected: u64,
    sck: SynchronizedPin,
    /// MOSI, which a slave samples after the same flip-flops as SCK.
    mosi: SynchronizedPin,
    miso: bool,
    ss: bool,
    /// True if DDR makes SS an output.
    ss_output: bool,
    /// Overrides of SCK, MISO, MOSI and SS.
    drives: [AvrDrive; 4],
    /// Cycle at which the clock was stopped; None while it runs.
    asleep: Option<u64>,
}

state! {
    AvrSpi {
        control, status, shown, buffer, shift, bit, count, moving, ended, active, half, selected, sck, mosi, miso, ss, ss_output,
        drives, asleep,
    } if |spi, now| spi.count <= 8 && spi.is_valid_state(now)
}

impl AvrSpi {
    /// Returns the SPI after power-on, with all lines low.
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

    /// Checks that a restored state is possible for an SPI that has executed everything up to `now`.
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

    /// Reports whether this is a selected slave. SS is its input regardless of DDR (section 19.3.1, table
    /// 14-3).
    fn is_slave(&self) -> bool {
        self.has(SPE) && !self.has(MSTR) && !self.ss
    }

    /// Returns half a period of SCK, in cycles (table 19-5).
    fn period_half(&self) -> u64 {
        let half = match self.control & 3 {
            0 => 2,
            1 => 8,
            2 => 32,
            _ => 64,
        };
        if self.status & SPI2X != 0 { half / 2 } else { half }
    }

    /// Converts a byte to the bit order of the shift register, or back.
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

    /// Puts the next bit on the output at an edge of SCK, leading or trailing (table 19-2, figures 19-3 and
    /// 19-4). SCK itself clocks the output of a slave: the delay is at most 15 ns (table 29-18), less than
    /// that of its synchronizer.
    fn put_bit(&mut self, leading: bool) {
        if leading == self.has(CPHA) {
            self.bit = self.shift & 0x80 != 0;
        }
    }

    /// Samples a bit at an edge of SCK; ends the byte after eight bits.
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

    /// Ends the current transfer.
    fn abort(&mut self) {
        (self.count, self.moving, self.active, self.half) = (0, false, false, NEVER);
    }

    /// Handles a write of SPDR.
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

    /// Clears the flags that SPSR has shown; called at an access to SPDR.
    fn clear_flag(&mut self) {
        self.status &= !std::mem::take(&mut self.shown);
    }

    /// Checks whether another master selects this one. A state in cycle `t` is detected at the edge that ends
    /// the cycle.
    fn update_synchronizers(&mut self, t: u64) {
        let selected = self.is_master() && !self.ss_output && !self.ss;
        self.selected = match (selected, self.selected) {
            (true, NEVER) => t.saturating_add(1),
            (true, due) => due,
            (false, _) => NEVER,
        };
    }

    /// Returns the level of the data output. With CPHA = 0 the first bit is there before the first edge.
    fn output(&self) -> bool {
        let waiting = !self.has(CPHA) && self.count == 0;
        if waiting { self.shift & 0x80 != 0 } else { self.bit }
    }

    /// Sends the overrides of the lines that have changed (tables 14-3 to 14-5).
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
