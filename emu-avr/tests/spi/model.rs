//! A model of the SPI that steps cycle by cycle, with a counting divider and a list of bits instead of a
//! shift register.

use emu_avr::periph::spi::SpiRegister;
use emu_avr::periph::{AvrDrive, AvrLine, AvrSignal};

#[derive(Default)]
pub struct Model {
    pub out: Vec<AvrSignal>,
    // Pins: SCK with its flip-flops.
    pub sck: bool,
    pub mosi: bool,
    pub miso: bool,
    pub ss: bool,
    pub ss_output: bool,
    first: bool,
    second: bool,
    mosi_first: bool,
    // Registers, bit by bit.
    spcr: u8,
    spif: bool,
    wcol: bool,
    double: bool,
    spif_read: bool,
    wcol_read: bool,
    received: u8,
    /// Bits to send, the first one at the front; then the bits received.
    bits: Vec<bool>,
    incoming: Vec<bool>,
    /// Output level during a transfer.
    level: bool,
    /// True during a transfer; then true if a transfer ended at the current edge.
    busy: bool,
    just_ended: bool,
    /// Clock of the master: remaining cycles of this half, then true at the active level.
    left: u32,
    active: bool,
    drives: Option<[AvrDrive; 4]>,
}

impl Model {
    pub fn new() -> Model {
        Model { bits: vec![false; 8], drives: Some([AvrDrive::Port; 4]), ..Model::default() }
    }

    fn spe(&self) -> bool {
        self.spcr & 0x40 != 0
    }

    fn mstr(&self) -> bool {
        self.spcr & 0x10 != 0
    }

    fn cpol(&self) -> bool {
        self.spcr & 8 != 0
    }

    fn cpha(&self) -> bool {
        self.spcr & 4 != 0
    }

    fn half(&self) -> u32 {
        [4, 16, 64, 128][usize::from(self.spcr & 3)] / if self.double { 4 } else { 2 }
    }

    /// Executes one clock edge; pins are as they were in the cycle that ends.
    pub fn tick(&mut self, t: u64) {
        self.just_ended = false;
        let edge = (self.first != self.second).then_some(self.first);
        let mosi = std::mem::replace(&mut self.mosi_first, self.mosi);
        (self.second, self.first) = (self.first, self.sck);
        let robbed = self.spe() && self.mstr() && !self.ss && !self.ss_output;
        if self.spe() && self.mstr() {
            if self.busy {
                self.left -= 1;
                if self.left == 0 {
                    self.left = self.half();
                    self.active = !self.active;
                    if self.active == self.cpha() {
                        self.level = self.next_bit();
                    }
                    self.clock(self.active, self.miso);
                }
            }
        } else if let Some(level) = edge.filter(|_| self.spe() && !self.ss) {
            self.clock(level != self.cpol(), mosi);
        }
        if robbed {
            self.spcr &= !0x10;
            self.spif = true;
            self.stop();
        }
        self.pins(t);
    }

    fn stop(&mut self) {
        // The received bits have shifted out as many bits.
        let n = self.incoming.len();
        let rest: Vec<bool> = self.bits[n.min(8)..].to_vec();
        self.bits = rest.into_iter().chain(self.incoming.drain(..)).collect();
        self.bits = self.bits[self.bits.len() - 8..].to_vec();
        (self.busy, self.active) = (false, false);
    }

    /// After the last bit to send, the first received bit follows.
    fn next_bit(&self) -> bool {
        let n = self.incoming.len();
        if n < 8 { self.bits[n] } else { self.incoming[n - 8] }
    }

    fn clock(&mut self, leading: bool, input: bool) {
        self.busy = true;
        if leading != self.cpha() {
            if self.incoming.is_empty() && !self.cpha() {
                self.level = self.bits[0];
            }
            self.incoming.push(input);
        }
        if !leading && self.incoming.len() >= 8 {
            let newest = &self.incoming[self.incoming.len() - 8..];
            self.received = newest.iter().fold(0, |byte, &bit| byte << 1 | u8::from(bit));
            if self.spcr & 0x20 != 0 {
                self.received = self.received.reverse_bits();
            }
            (self.spif, self.just_ended) = (true, true);
            self.stop();
        }
    }

    pub fn line(&mut self, line: AvrLine, high: bool, t: u64) {
        match line {
            AvrLine::Sck => {
                let moved = std::mem::replace(&mut self.sck, high) != high;
                let selected = self.spe() && !self.mstr() && !self.ss;
                if moved && selected && (high != self.cpol()) == self.cpha() {
                    self.level = self.next_bit();
                }
            }
            AvrLine::Mosi => self.mosi = high,
            AvrLine::Miso => self.miso = high,
            _ => {
                self.ss = high;
                if high && !(self.spe() && self.mstr()) {
                    self.stop();
                }
            }
        }
        self.pins(t);
    }

    pub fn peek(&self, reg: SpiRegister) -> u8 {
        match reg {
            SpiRegister::SPCR => self.spcr,
            SpiRegister::SPSR => u8::from(self.spif) << 7 | u8::from(self.wcol) << 6 | u8::from(self.double),
            SpiRegister::SPDR => self.received,
        }
    }

    pub fn requests(&self) -> u8 {
        u8::from(self.spif && self.spcr & 0x80 != 0)
    }

    pub fn taken(&mut self) {
        (self.spif, self.spif_read) = (false, false);
    }

    fn access(&mut self) {
        if self.spif_read {
            self.spif = false;
        }
        if self.wcol_read {
            self.wcol = false;
        }
        (self.spif_read, self.wcol_read) = (false, false);
    }

    pub fn read(&mut self, reg: SpiRegister) -> u8 {
        let value = self.peek(reg);
        match reg {
            SpiRegister::SPSR => (self.spif_read, self.wcol_read) = (self.spif, self.wcol),
            SpiRegister::SPDR => self.access(),
            SpiRegister::SPCR => {}
        }
        value
    }

    pub fn write(&mut self, reg: SpiRegister, value: u8, mask: u8, t: u64) {
        match reg {
            SpiRegister::SPCR => {
                let old = self.spcr;
                self.spcr = old & !mask | value & mask;
                if (old ^ self.spcr) & 0x50 != 0 {
                    self.stop();
                }
            }
            SpiRegister::SPSR if mask & 1 != 0 => self.double = value & 1 != 0,
            SpiRegister::SPSR => {}
            SpiRegister::SPDR => {
                self.access();
                if self.busy || self.just_ended {
                    self.wcol = true;
                } else {
                    let lowest_first = self.spcr & 0x20 != 0;
                    let bit = |n: u8| value & mask & 1 << if lowest_first { n } else { 7 - n } != 0;
                    self.bits = (0..8).map(bit).collect();
                    if self.spe() && self.mstr() {
                        (self.busy, self.left) = (true, self.half());
                    }
                }
            }
        }
        self.pins(t);
    }

    pub fn reset(&mut self, t: u64) {
        let old = std::mem::replace(self, Model::new());
        (self.sck, self.mosi, self.miso, self.ss) = (old.sck, old.mosi, old.miso, old.ss);
        (self.ss_output, self.first, self.second) = (old.ss_output, old.first, old.second);
        self.mosi_first = old.mosi_first;
        (self.out, self.drives) = (old.out, old.drives);
        self.pins(t);
    }

    fn pins(&mut self, t: u64) {
        let first = !self.cpha() && self.incoming.is_empty();
        let level = if first { self.bits[0] } else { self.level };
        let drives = match (self.spe(), self.mstr()) {
            (false, _) => [AvrDrive::Port; 4],
            (true, true) => {
                [AvrDrive::Value(self.active != self.cpol()), AvrDrive::Input, AvrDrive::Value(level), AvrDrive::Port]
            }
            (true, false) if self.ss => [AvrDrive::Input; 4],
            (true, false) => [AvrDrive::Input, AvrDrive::Value(level), AvrDrive::Input, AvrDrive::Input],
        };
        let old = self.drives.replace(drives).unwrap_or_default();
        for (n, line) in [AvrLine::Sck, AvrLine::Miso, AvrLine::Mosi, AvrLine::Ss].into_iter().enumerate() {
            if old[n] != drives[n] {
                self.out.push(AvrSignal::Drive { t, line, drive: drives[n] });
            }
        }
    }
}
