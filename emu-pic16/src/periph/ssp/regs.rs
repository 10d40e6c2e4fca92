//! Registers, lines and modes that the SPI and I2C parts of the port share.

use super::super::map::{InterruptFlag, Pic16Line};
use super::super::{Pic16Drive, Pic16Outbox, Pic16Signal};

/// SSPSTAT: input is sampled at the end of a bit (SPI master).
pub(super) const SMP: u8 = 0x80;
/// SSPSTAT: output changes when the clock goes from active to idle (SPI).
pub(super) const CKE: u8 = 0x40;
/// SSPSTAT: the last byte was data, not an address.
pub(super) const DA: u8 = 0x20;
/// SSPSTAT: the last condition was Stop.
pub(super) const P: u8 = 0x10;
/// SSPSTAT: the last condition was Start.
pub(super) const S: u8 = 0x08;
/// SSPSTAT: slave: the address requested a read; master: a byte is being sent.
pub(super) const RW: u8 = 0x04;
/// SSPSTAT: SSPADD must be updated with the other half of the address.
pub(super) const UA: u8 = 0x02;
/// SSPSTAT: SSPBUF is full.
pub(super) const BF: u8 = 0x01;

/// SSPCON: SSPBUF was written while a write was not allowed.
pub(super) const WCOL: u8 = 0x80;
/// SSPCON: a byte was received while SSPBUF was full.
pub(super) const SSPOV: u8 = 0x40;
/// SSPCON: the port is on.
pub(super) const SSPEN: u8 = 0x20;
/// SSPCON: idle level of the clock (SPI); the clock is released (I2C slave).
pub(super) const CKP: u8 = 0x10;

/// SSPCON2: general call enabled.
pub(super) const GCEN: u8 = 0x80;
/// SSPCON2: the slave did not acknowledge.
pub(super) const ACKSTAT: u8 = 0x40;
/// SSPCON2: acknowledge bit to send.
pub(super) const ACKDT: u8 = 0x20;
/// SSPCON2: acknowledge sequence.
pub(super) const ACKEN: u8 = 0x10;
/// SSPCON2: reception.
pub(super) const RCEN: u8 = 0x08;
/// SSPCON2: Stop sequence.
pub(super) const PEN: u8 = 0x04;
/// SSPCON2: repeated Start sequence.
pub(super) const RSEN: u8 = 0x02;
/// SSPCON2: Start sequence (master); the clock is stretched after a received byte (slave of the 16F87XA).
pub(super) const SEN: u8 = 0x01;
/// SSPCON2: mask of all sequences.
pub(super) const SEQUENCES: u8 = ACKEN | RCEN | PEN | RSEN | SEN;

/// Mode that SSPEN and SSPM select.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SspMode {
    /// Off, or a reserved value of SSPM.
    Off,
    /// SPI master with half a bit of this many clocks; None if half a bit is a period of timer 2.
    SpiMaster(Option<u64>),
    /// SPI slave, with or without slave select.
    SpiSlave { select: bool },
    /// I2C slave of 7 or 10 bits, with or without interrupts on Start and Stop.
    Slave { ten: bool, notice: bool },
    /// I2C master in software: only Start and Stop are detected.
    Firmware,
    /// I2C master.
    Master,
}

impl SspMode {
    /// Returns the mode by SSPCON (DS39582 registers 9-2 and 9-4; DS30292 register 9-2).
    fn from_sspcon(con: u8, master: bool) -> SspMode {
        if con & SSPEN == 0 {
            return SspMode::Off;
        }
        match con & 0x0F {
            0 => SspMode::SpiMaster(Some(2)),
            1 => SspMode::SpiMaster(Some(8)),
            2 => SspMode::SpiMaster(Some(32)),
            3 => SspMode::SpiMaster(None),
            4 => SspMode::SpiSlave { select: true },
            5 => SspMode::SpiSlave { select: false },
            6 => SspMode::Slave { ten: false, notice: false },
            7 => SspMode::Slave { ten: true, notice: false },
            8 if master => SspMode::Master,
            11 => SspMode::Firmware,
            14 => SspMode::Slave { ten: false, notice: true },
            15 => SspMode::Slave { ten: true, notice: true },
            _ => SspMode::Off,
        }
    }

    /// Reports whether the mode is an I2C mode.
    pub(super) fn is_i2c(self) -> bool {
        matches!(self, SspMode::Slave { .. } | SspMode::Firmware | SspMode::Master)
    }
}

/// Registers and line levels of the port.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SspRegisters {
    /// True for an MSSP.
    pub(super) master: bool,
    /// True if SEN stretches the clock of the slave.
    pub(super) stretch: bool,
    /// SSPBUF.
    pub(super) buf: u8,
    /// SSPCON.
    pub(super) con: u8,
    /// SSPCON2.
    pub(super) con2: u8,
    /// SSPADD.
    pub(super) add: u8,
    /// SSPSTAT.
    pub(super) stat: u8,
    /// Level of SCK or SCL.
    pub(super) scl: bool,
    /// Level of SDI or SDA.
    pub(super) sda: bool,
    /// Level of SS.
    pub(super) ss: bool,
    /// True while this port pulls SCL low.
    pub(super) pull_scl: bool,
    /// True while this port pulls SDA low.
    pub(super) pull_sda: bool,
    /// True if SS raised within a byte leaves SSPSR unchanged.
    pub(super) keeps_bits: bool,
    /// Last overrides of SDI, SCK and SDO that were sent.
    drives: [Pic16Drive; 3],
}

emu_core::state! {
    SspRegisters { buf, con, con2, add, stat, scl, sda, ss, pull_scl, pull_sda, drives } stays { master, stretch, keeps_bits }
}

impl SspRegisters {
    /// Returns the registers after power-up, with all lines low.
    pub(super) fn new(master: bool) -> SspRegisters {
        SspRegisters {
            master,
            stretch: false,
            buf: 0,
            con: 0,
            con2: 0,
            add: 0,
            stat: 0,
            scl: false,
            sda: false,
            ss: false,
            keeps_bits: false,
            pull_scl: false,
            pull_sda: false,
            drives: [Pic16Drive::Port; 3],
        }
    }

    /// Returns the selected mode.
    pub(super) fn mode(&self) -> SspMode {
        SspMode::from_sspcon(self.con, self.master)
    }

    /// Sets or clears bits of SSPSTAT.
    pub(super) fn set_stat_bits(&mut self, bits: u8, on: bool) {
        self.stat = self.stat & !bits | if on { bits } else { 0 };
    }

    /// Stores a received byte in SSPBUF, or loses it if SSPBUF is full; returns whether it was stored.
    pub(super) fn receive(&mut self, byte: u8) -> bool {
        let room = self.stat & BF == 0;
        if room {
            self.buf = byte;
            self.stat |= BF;
        } else {
            self.con |= SSPOV;
        }
        room
    }

    /// Sends the overrides that have changed. SDA comes before SCL, so that no false Start or Stop appears.
    pub(super) fn settle(&mut self, sck: Pic16Drive, sdi: Pic16Drive, sdo: Pic16Drive, t: u64, out: &mut Pic16Outbox) {
        let now = [sdi, sck, sdo];
        for ((line, was), drive) in
            [Pic16Line::Sdi, Pic16Line::Sck, Pic16Line::Sdo].into_iter().zip(self.drives).zip(now)
        {
            if was != drive {
                out.push(Pic16Signal::Drive { t, line, drive });
            }
        }
        self.drives = now;
    }
}

/// Sends the signal that sets SSPIF.
pub(super) fn raise_sspif(t: u64, out: &mut Pic16Outbox) {
    out.push(Pic16Signal::Flag { t, flag: InterruptFlag::SSPIF });
}
