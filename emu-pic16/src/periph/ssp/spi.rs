//! SPI, master and slave: DS39582 section 9.3, DS30292 section 9.1.
//!
//! A bit of the master has two halves. The output changes when the bit begins; the clock is active in the first half (CKE = 0)
//! or in the second one (CKE = 1), and the input is sampled in the middle (SMP = 0) or at the end (SMP = 1): figure 9-3.

use emu_core::NEVER;

use super::super::Pic16Outbox;
use super::regs::{BF, CKE, CKP, SMP, SspMode, SspRegisters, raise_sspif};

/// Halves of the eight bits.
const HALF_CLOCKS: u8 = 16;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SpiShifter {
    /// SSPSR.
    sr: u8,
    /// The level on SDO.
    pub(super) sdo: bool,
    /// The master's clock is active.
    pub(super) active: bool,
    /// A byte is on its way: from the write (master) or the first edge (slave) to its last edge.
    shifting: bool,
    /// Halves begun and, once, the end of the last one (master); bits shifted in (slave).
    count: u8,
    /// When the master's next half begins; `NEVER` where timer 2 says.
    edge: u64,
    /// A byte that is complete, and when it goes to SSPBUF; `NEVER` without one.
    done: (u64, u8),
}

emu_core::state! { SpiShifter { sr, sdo, active, shifting, count, edge, done } if |spi, _now| spi.count <= HALF_CLOCKS + 1 }

impl SpiShifter {
    pub(super) const IDLE: SpiShifter =
        SpiShifter { sr: 0, sdo: false, active: false, shifting: false, count: 0, edge: NEVER, done: (NEVER, 0) };

    pub(super) fn next(&self) -> u64 {
        self.edge.min(self.done.0)
    }

    /// A byte is between its first edge and its last one.
    pub(super) fn is_shifting(&self) -> bool {
        self.shifting
    }

    /// SSPBUF may not be written.
    pub(super) fn is_busy(&self) -> bool {
        self.shifting || self.done.0 != NEVER
    }

    /// SSPBUF was written: it goes to SSPSR, too.
    pub(super) fn load(&mut self, regs: &SspRegisters, t: u64) {
        self.sr = regs.buf;
        match regs.mode() {
            SspMode::SpiMaster(half) => {
                self.shifting = true;
                self.count = 0;
                // The first bit begins as Q2 of the next cycle ends: figure 9-3 has the last one end there.
                self.edge = half.map_or(NEVER, |_| t.saturating_add(2));
            }
            _ => self.present(regs),
        }
    }

    /// With CKE = 1 the slave's first bit is out before the clock comes.
    pub(super) fn present(&mut self, regs: &SspRegisters) {
        if regs.stat & CKE != 0 {
            self.sdo = self.sr & 0x80 != 0;
        }
    }

    /// What [`Spi::next_clock`] is about.
    pub(super) fn step(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        if self.done.0 == t {
            self.finish(regs, t, out);
        } else {
            self.half_clock(regs, t);
        }
    }

    /// A half of the master's bit begins; the last call ends the last one.
    pub(super) fn half_clock(&mut self, regs: &SspRegisters, t: u64) {
        let begins = self.count.is_multiple_of(2);
        let last = self.count >= HALF_CLOCKS;
        let at_end = regs.stat & SMP != 0;
        if self.count > 0 && begins == at_end {
            self.sample(regs);
        }
        if begins && !last {
            self.sdo = self.sr & 0x80 != 0;
        }
        self.active = begins != (regs.stat & CKE != 0) && !(begins && last);
        self.count = self.count.saturating_add(1);
        if last {
            self.shifting = false;
            self.edge = NEVER;
            self.done = (flag_clock(t), self.sr);
        } else if let SspMode::SpiMaster(Some(half)) = regs.mode() {
            self.edge = t.saturating_add(half);
        }
    }

    fn sample(&mut self, regs: &SspRegisters) {
        self.sr = self.sr << 1 | u8::from(regs.sda);
    }

    /// The byte goes to SSPBUF. The master never overruns: section 9.3.1, SSPOV.
    fn finish(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        let byte = self.done.1;
        self.done = (NEVER, 0);
        if matches!(regs.mode(), SspMode::SpiMaster(_)) {
            regs.buf = byte;
            regs.stat |= BF;
        } else {
            regs.receive(byte);
        }
        raise_sspif(t, out);
    }

    /// The slave's clock has changed.
    pub(super) fn clock(&mut self, regs: &mut SspRegisters, t: u64, asleep: bool, out: &mut Pic16Outbox) {
        let leading = regs.scl != (regs.con & CKP != 0);
        let late = regs.stat & CKE != 0;
        self.shifting = true;
        if leading == late {
            self.sample(regs);
        }
        if leading != late {
            self.sdo = self.sr & 0x80 != 0;
        }
        if leading {
            return;
        }
        self.count += 1;
        if self.count < 8 {
            return;
        }
        (self.count, self.shifting) = (0, false);
        self.done = (if asleep { t } else { flag_clock(t) }, self.sr);
        if asleep {
            self.finish(regs, t, out);
        }
    }

    /// SS has changed: the bit counter is 0, and what was shifted of a byte is lost. SSPSR has again what
    /// SSPBUF holds to be sent (DS39582 figure 9-4, where the byte that is sent begins anew with bit 7), or, as the other reading has
    /// it, what is left of the byte and what came in.
    pub(super) fn restart(&mut self, regs: &SspRegisters) {
        if self.shifting && !regs.keeps_bits {
            self.sr = regs.buf;
        }
        (self.count, self.shifting) = (0, false);
    }

    /// The oscillator stops: what the slave has complete does not wait for it.
    pub(super) fn sleep(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        if self.done.0 != NEVER && !matches!(regs.mode(), SspMode::SpiMaster(_)) {
            self.finish(regs, t, out);
        }
    }

    /// The oscillator stood for so many clocks.
    pub(super) fn shift(&mut self, clocks: u64) {
        self.edge = self.edge.saturating_add(clocks);
        self.done.0 = self.done.0.saturating_add(clocks);
    }
}

/// When a byte complete at `t` shows: at the end of the first Q4 after the end of a Q2 that sees it (figures 9-3, 9-5, 9-6).
fn flag_clock(t: u64) -> u64 {
    t.saturating_add(5) / 4 * 4
}
