//! A model of the port that steps clock by clock: registers, modes and lines. The models of SPI, slave and
//! master contain the modes.

use emu_pic16::periph::Pic16Drive;
use emu_pic16::periph::map::{InterruptFlag, Pic16Line, Sfr};

use crate::master::Master;
use crate::slave::Slave;
use crate::spi::Spi;

/// Registers and lines, each bit separately.
#[derive(Default)]
pub struct Chip {
    pub mssp: bool,
    pub stretch: bool,
    pub buf: u8,
    pub con: u8,
    pub con2: u8,
    pub add: u8,
    pub smp_cke: u8,
    pub da: bool,
    pub p: bool,
    pub s: bool,
    pub rw: bool,
    pub ua: bool,
    pub bf: bool,
    pub scl: bool,
    pub sda: bool,
    pub ss: bool,
    pub pull_scl: bool,
    pub pull_sda: bool,
    pub flags: Vec<(u64, InterruptFlag)>,
}

impl Chip {
    pub fn flag(&mut self, flag: InterruptFlag, t: u64) {
        self.flags.push((t, flag));
    }

    pub fn ckp(&self) -> bool {
        self.con & 0x10 != 0
    }

    pub fn set_ckp(&mut self, on: bool) {
        self.con = if on { self.con | 0x10 } else { self.con & !0x10 };
    }

    pub fn sspov(&self) -> bool {
        self.con & 0x40 != 0
    }

    pub fn set_sspov(&mut self) {
        self.con |= 0x40;
    }

    pub fn cke(&self) -> bool {
        self.smp_cke & 0x40 != 0
    }

    pub fn smp(&self) -> bool {
        self.smp_cke & 0x80 != 0
    }

    /// Returns SSPM if the port is on and the value is not reserved.
    pub fn mode(&self) -> Option<u8> {
        let mode = self.con & 15;
        let known = matches!(mode, 0..=7 | 11 | 14 | 15) || mode == 8 && self.mssp;
        (self.con & 0x20 != 0 && known).then_some(mode)
    }
}

#[derive(Default)]
pub struct Model {
    pub chip: Chip,
    pub spi: Spi,
    pub slave: Slave,
    pub master: Master,
    asleep: bool,
}

impl Model {
    pub fn new(mssp: bool, stretch: bool) -> Model {
        Model { chip: Chip { mssp, stretch, ..Chip::default() }, ..Model::default() }
    }

    pub fn tick(&mut self, t: u64) {
        if !self.asleep {
            self.spi.tick(&mut self.chip, t);
            self.master.tick(&mut self.chip, t);
        }
    }

    pub fn timer2(&mut self, t: u64) {
        if self.chip.mode() == Some(3) {
            self.spi.half_bit(&mut self.chip, t);
        }
    }

    pub fn line(&mut self, line: Pic16Line, high: bool, t: u64) {
        let chip = &mut self.chip;
        let mode = chip.mode();
        let i2c = mode.is_some_and(|mode| mode >= 6);
        let slave = matches!(mode, Some(6 | 7 | 14 | 15));
        match line {
            Pic16Line::Sck => {
                chip.scl = high;
                match mode {
                    Some(4 | 5) => self.spi.edge(chip, t, self.asleep),
                    _ if slave => self.slave.clock(chip, t),
                    _ => {}
                }
            }
            Pic16Line::Sdi => {
                chip.sda = high;
                if i2c && chip.scl {
                    (chip.s, chip.p) = (!high, high);
                    if slave {
                        self.slave.condition(chip, !high);
                    }
                    if matches!(mode, Some(11 | 14 | 15)) || mode == Some(8) && !self.master.makes_condition() {
                        chip.flag(InterruptFlag::SSPIF, t);
                    }
                }
            }
            Pic16Line::Ss => {
                chip.ss = high;
                if mode == Some(4) {
                    self.spi.select(chip);
                }
            }
            _ => {}
        }
        if mode == Some(8) && !self.asleep {
            self.master.go(chip, t);
        }
    }

    pub fn write(&mut self, reg: Sfr, value: u8, t: u64) {
        let chip = &mut self.chip;
        match reg {
            Sfr::SSPBUF => {
                let collision = match chip.mode() {
                    Some(0..=5) => self.spi.busy(),
                    Some(8) => self.master.busy(),
                    Some(6 | 7 | 14 | 15) => self.slave.sending(),
                    _ => false,
                };
                if collision {
                    chip.con |= 0x80;
                    return;
                }
                chip.buf = value;
                match chip.mode() {
                    Some(0..=5) => self.spi.load(chip),
                    Some(8) => self.master.transmit(chip, t),
                    Some(6 | 7 | 14 | 15) => self.slave.load(chip),
                    _ => {}
                }
            }
            Sfr::SSPCON => {
                let before = chip.mode();
                chip.con = value;
                if chip.mode() != before {
                    let i2c = |mode: Option<u8>| mode.is_some_and(|mode| mode >= 6);
                    if !i2c(before) || !i2c(chip.mode()) {
                        (chip.s, chip.p) = (false, false);
                    }
                    if chip.rw {
                        chip.bf = false;
                    }
                    (chip.rw, chip.ua) = (false, false);
                    (chip.pull_scl, chip.pull_sda) = (false, false);
                    self.spi = Spi::default();
                    self.slave = Slave::default();
                    self.master = Master::default();
                }
                if matches!(chip.mode(), Some(6 | 7 | 14 | 15)) {
                    self.slave.hold(chip);
                }
            }
            Sfr::SSPCON2 if chip.mssp && chip.mode() == Some(8) => {
                if self.master.busy() {
                    chip.con2 = chip.con2 & 31 | value & !31;
                } else {
                    self.master.command(chip, value, t);
                }
            }
            Sfr::SSPCON2 if chip.mssp => chip.con2 = value,
            Sfr::SSPADD => {
                chip.add = value;
                if matches!(chip.mode(), Some(6 | 7 | 14 | 15)) {
                    self.slave.address(chip);
                }
            }
            Sfr::SSPSTAT => chip.smp_cke = value & 0xC0,
            _ => {}
        }
    }

    pub fn read(&mut self, reg: Sfr) -> u8 {
        let value = self.peek(reg);
        if reg == Sfr::SSPBUF {
            self.chip.bf = false;
        }
        value
    }

    pub fn peek(&self, reg: Sfr) -> u8 {
        let chip = &self.chip;
        match reg {
            Sfr::SSPBUF => chip.buf,
            Sfr::SSPCON => chip.con,
            Sfr::SSPCON2 => chip.con2,
            Sfr::SSPADD => chip.add,
            Sfr::SSPSTAT => {
                let bits = [chip.da, chip.p, chip.s, chip.rw, chip.ua, chip.bf];
                chip.smp_cke | bits.into_iter().fold(0, |byte, bit| byte << 1 | u8::from(bit))
            }
            _ => 0,
        }
    }

    pub fn sleep(&mut self, t: u64) {
        self.asleep = true;
        if matches!(self.chip.mode(), Some(4 | 5)) {
            self.spi.deliver(&mut self.chip, t);
        }
    }

    pub fn wake(&mut self, t: u64) {
        self.asleep = false;
        if self.chip.mode() == Some(8) {
            self.master.go(&mut self.chip, t);
        }
    }

    /// Returns the overrides of SCK, SDI and SDO.
    pub fn drives(&self) -> [Pic16Drive; 3] {
        let wire = |pull| if pull { Pic16Drive::Low } else { Pic16Drive::Open };
        let chip = &self.chip;
        match chip.mode() {
            None => [Pic16Drive::Port; 3],
            Some(0..=3) => [
                Pic16Drive::from_bit(self.spi.active() != chip.ckp()),
                Pic16Drive::Port,
                Pic16Drive::from_bit(self.spi.sdo()),
            ],
            Some(4) if chip.ss => [Pic16Drive::Port, Pic16Drive::Port, Pic16Drive::Float],
            Some(4 | 5) => [Pic16Drive::Port, Pic16Drive::Port, Pic16Drive::from_bit(self.spi.sdo())],
            Some(_) => [wire(chip.pull_scl), wire(chip.pull_sda), Pic16Drive::Port],
        }
    }
}
