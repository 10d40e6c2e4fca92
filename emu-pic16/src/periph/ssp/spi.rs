//! SPI, master and slave: DS39582 section 9.3, DS30292 section 9.1.
//!
//! A bit of the master has two halves. The output changes at the start of the bit. The clock is active in the
//! first half (CKE = 0) or in the second half (CKE = 1). The input is sampled in the middle (SMP = 0) or at
//! the end (SMP = 1): figure 9-3.

use emu_core::NEVER;

use super::super::Pic16Outbox;
use super::regs::{BF, CKE, CKP, SMP, SspMode, SspRegisters, raise_sspif};

/// Number of half bits in a byte.
const HALF_CLOCKS: u8 = 16;

/// The shift register of SPI, master or slave.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SpiShifter {
    /// Shift register SSPSR.
    sr: u8,
    /// Level on SDO.
    pub(super) sdo: bool,
    /// True while the master's clock is at its active level.
    pub(super) active: bool,
    /// True during a transfer: from the write (master) or the first edge (slave) to the last edge.
    shifting: bool,
    /// Master: number of half bits started, plus one for the end of the last; slave: number of bits shifted
    /// in.
    count: u8,
    /// Clock at which the master's next half bit starts; `NEVER` if timer 2 clocks it.
    edge: u64,
    /// Clock at which a complete byte goes to SSPBUF, `NEVER` without one; then the byte.
    done: (u64, u8),
}

emu_core::state! { SpiShifter { sr, sdo, active, shifting, count, edge, done } if |spi, _now| spi.count <= HALF_CLOCKS + 1 }

impl SpiShifter {
    /// A shift register without a transfer in progress.
    pub(super) const IDLE: SpiShifter =
        SpiShifter { sr: 0, sdo: false, active: false, shifting: false, count: 0, edge: NEVER, done: (NEVER, 0) };

    /// Returns the clock of the next event: a half bit of the master, or a complete byte.
    pub(super) fn next(&self) -> u64 {
        self.edge.min(self.done.0)
    }

    /// Reports whether a transfer is in progress.
    pub(super) fn is_shifting(&self) -> bool {
        self.shifting
    }

    /// Reports whether SSPBUF must not be written.
    pub(super) fn is_busy(&self) -> bool {
        self.shifting || self.done.0 != NEVER
    }

    /// Handles a write of SSPBUF: the byte also goes to SSPSR.
    pub(super) fn load(&mut self, regs: &SspRegisters, t: u64) {
        self.sr = regs.buf;
        match regs.mode() {
            SspMode::SpiMaster(half) => {
                self.shifting = true;
                self.count = 0;
                // The first bit starts at the end of Q2 of the next cycle, because figure 9-3 shows the last
                // bit ending there.
                self.edge = half.map_or(NEVER, |_| t.saturating_add(2));
            }
            _ => self.present(regs),
        }
    }

    /// With CKE = 1 the slave's first bit is on SDO before the clock starts.
    pub(super) fn present(&mut self, regs: &SspRegisters) {
        if regs.stat & CKE != 0 {
            self.sdo = self.sr & 0x80 != 0;
        }
    }

    /// Executes the event at [`Self::next`].
    pub(super) fn step(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        if self.done.0 == t {
            self.finish(regs, t, out);
        } else {
            self.half_clock(regs, t);
        }
    }

    /// Starts a half bit of the master; the last call ends the last half.
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

    /// Moves the byte to SSPBUF. The master never overruns: section 9.3.1, SSPOV.
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

    /// Handles a change of the slave's clock.
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

    /// Handles a change of SS: the bit counter is 0, and the partial byte is lost. SSPSR is loaded again from
    /// SSPBUF (DS39582 figure 9-4, where the sent byte starts again with bit 7), or, in the other reading,
    /// keeps the rest of the byte and the bits received.
    pub(super) fn restart(&mut self, regs: &SspRegisters) {
        if self.shifting && !regs.keeps_bits {
            self.sr = regs.buf;
        }
        (self.count, self.shifting) = (0, false);
    }

    /// Handles the stop of the oscillator: a complete byte of the slave does not wait for it.
    pub(super) fn sleep(&mut self, regs: &mut SspRegisters, t: u64, out: &mut Pic16Outbox) {
        if self.done.0 != NEVER && !matches!(regs.mode(), SspMode::SpiMaster(_)) {
            self.finish(regs, t, out);
        }
    }

    /// Delays everything by the clocks for which the oscillator was stopped.
    pub(super) fn shift(&mut self, clocks: u64) {
        self.edge = self.edge.saturating_add(clocks);
        self.done.0 = self.done.0.saturating_add(clocks);
    }
}

/// Returns the clock at which a byte complete at `t` becomes visible: the end of the first Q4 after a Q2 that
/// detects it (figures 9-3, 9-5, 9-6).
fn flag_clock(t: u64) -> u64 {
    t.saturating_add(5) / 4 * 4
}
