//! Registers of a timer: what is read and what a write does.

use emu_core::NEVER;

use super::mode::{Action, Mode};
use super::{Clock, Outbox, Reg, Tap, Timer};

/// ICNCn and ICESn in TCCRnB.
pub(super) const ICNC: u8 = 1 << 7;
/// Rising edges are captured.
pub(super) const ICES: u8 = 1 << 6;
/// AS2 in ASSR.
pub(super) const AS2: u8 = 1 << 5;
/// EXCLK in ASSR.
const EXCLK: u8 = 1 << 6;
/// Update busy bits in ASSR: of TCNT, OCRA, OCRB, TCCRA and TCCRB.
pub(super) const BUSY: [u8; 5] = [1 << 4, 1 << 3, 1 << 2, 1 << 1, 1 << 0];
/// Those during which a compare unit is off.
pub(super) const COMPARE_BUSY: u8 = 0x1C;
/// Those after which a pin may be taken from its port.
pub(super) const CONTROL_BUSY: u8 = 0x03;
/// Cycles by which a flag of the asynchronous timer comes after the edge that sets it (18.9).
pub(super) const LATE: u64 = 3;

const fn high(word: u16) -> u8 {
    (word >> 8) as u8
}

impl Timer {
    /// What a read gives, everything up to `t` being done.
    pub(super) fn look(&self, reg: Reg, t: u64) -> u8 {
        let [a, b, c] = self.channels.map(|channel| channel.written);
        match reg {
            Reg::TCCRA => self.tccra,
            Reg::TCCRB => self.tccrb,
            Reg::TCCRC => 0,
            Reg::TCNTL if self.asynchronous() && self.tosc.index(t) < self.stale.1 => self.stale.0 as u8,
            Reg::TCNTL => self.value as u8,
            Reg::ICRL => self.icr as u8,
            Reg::TCNTH | Reg::ICRH => self.temp,
            Reg::OCRAL => a as u8,
            Reg::OCRAH => high(a),
            Reg::OCRBL => b as u8,
            Reg::OCRBH => high(b),
            Reg::OCRCL => c as u8,
            Reg::OCRCH => high(c),
            Reg::TIMSK => self.timsk,
            Reg::TIFR => self.tifr,
            Reg::ASSR => self.assr | self.busy,
        }
    }

    /// Writes the bits `mask` of a register at the edge `t`.
    pub(super) fn put(&mut self, reg: Reg, value: u8, mask: u8, t: u64, out: &mut Outbox) {
        if reg == Reg::TIFR {
            return self.clear(value & mask, t, out);
        }
        self.change(t, out);
        let old = self.look(reg, t);
        let byte = old & !mask | value & mask;
        let word = if self.shape.wide { u16::from_be_bytes([self.temp, byte]) } else { u16::from(byte) };
        match reg {
            Reg::TCCRA => {
                self.tccra = byte & self.shape.tccra_bits();
                self.arrive(3, t, out);
            }
            Reg::TCCRB => {
                self.tccrb = byte & self.shape.tccrb_bits();
                // FOCnA and FOCnB are here only where there is no TCCRC.
                self.strobe |= if self.shape.wide { 0 } else { value & mask };
                self.arrive(4, t, out);
            }
            Reg::TCCRC if self.shape.wide => {
                self.strobe = value & mask;
                self.force(t, out);
            }
            Reg::TCNTL => {
                self.tcnt_next = word;
                self.arrive(0, t, out);
            }
            Reg::OCRAL => self.write_ocr(0, word, t, out),
            Reg::OCRBL => self.write_ocr(1, word, t, out),
            Reg::OCRCL => self.write_ocr(2, word, t, out),
            Reg::ICRL if self.shape.capture && (self.icr_is_top() || !self.shape.icr_only_as_top) => self.icr = word,
            Reg::TCNTH | Reg::ICRH if self.shape.wide => self.temp = byte,
            // The mask acts on TEMP: a low byte written alone takes what another register has left there, as measured on silicon.
            Reg::OCRAH | Reg::OCRBH | Reg::OCRCH if self.shape.wide => self.temp = byte & self.mode.high_bits(),
            Reg::TIMSK => self.timsk = byte & self.shape.flags(),
            Reg::ASSR if self.shape.asynchronous => self.write_assr(byte & (EXCLK | AS2), t, out),
            _ => {}
        }
    }

    /// Clears flags by ones. What is set at the very edge stays set.
    fn clear(&mut self, ones: u8, t: u64, out: &mut Outbox) {
        self.advance(t.saturating_sub(1), out);
        let gone = ones & self.tifr;
        self.tifr &= !gone;
        if gone & self.listened == 0 && !self.asynchronous() {
            // Nothing is new but when these flags are set.
            self.calm = self.calm.min(self.flag_time(gone));
            return self.advance(t, out);
        }
        // A flag that is set again at once has not been seen clear by anyone.
        let listened = self.listened;
        self.listened &= !gone;
        (self.quiet, self.calm) = (0, 0);
        self.change(t, out);
        self.listened = listened;
    }

    fn write_ocr(&mut self, i: usize, word: u16, t: u64, out: &mut Outbox) {
        if i < usize::from(self.shape.channels) {
            self.channels[i].written = word;
            // The asynchronous timer has no channel C.
            if i < 2 { self.arrive(i + 1, t, out) } else { self.load(i) }
        }
    }

    /// A write gets to register `i` of [`BUSY`]: at once, or after two edges of TOSC1.
    fn arrive(&mut self, i: usize, t: u64, out: &mut Outbox) {
        if self.asynchronous() {
            self.busy |= BUSY.get(i).copied().unwrap_or(0);
            if let Some(due) = self.due.get_mut(i) {
                *due = if self.asleep.is_some() { NEVER } else { self.tosc.index(t).saturating_add(2) };
            }
        } else {
            self.land(i, t, out);
        }
    }

    /// Latches the temporary registers whose time has come.
    pub(super) fn latch(&mut self, t: u64, out: &mut Outbox) {
        let edge = self.tosc.index(t);
        for i in self.pending() {
            if self.due[i] <= edge {
                self.land(i, t, out);
            }
        }
    }

    /// What was written to register `i` of [`BUSY`] acts.
    fn land(&mut self, i: usize, t: u64, out: &mut Outbox) {
        self.busy &= !BUSY.get(i).copied().unwrap_or(0);
        match i {
            0 => {
                self.value = self.tcnt_next;
                self.down &= self.value != 0;
                self.blocked = true;
            }
            3 => {
                self.acting[0] = self.tccra;
                self.decode(t, out);
            }
            4 => {
                self.acting[1] = self.tccrb;
                self.decode(t, out);
                self.force(t, out);
            }
            _ => self.load(i - 1),
        }
    }

    /// OCR of a channel is taken to the buffer register, and to the compare register where that is open.
    fn load(&mut self, i: usize) {
        let buffered = self.mode.buffered();
        if let Some(channel) = self.channels.get_mut(i) {
            channel.buffer = channel.written;
            if !buffered {
                channel.compare = channel.buffer;
            }
        }
    }

    /// Mode and actions, by the control registers that act.
    pub(super) fn choose(&mut self) {
        let [a, b] = self.acting;
        let wgm = match (self.shape.channels, self.shape.wide) {
            (0, _) => 0,
            (_, false) => a & 3 | b >> 1 & 4,
            (_, true) => a & 3 | b >> 1 & 12,
        };
        self.mode = Mode::of(self.shape.wide, wgm);
        for (i, channel) in self.channels.iter_mut().enumerate() {
            channel.action = self.mode.action(i, a >> (6 - 2 * i));
            if i >= usize::from(self.shape.channels) {
                channel.action = Action::None;
            }
        }
    }

    /// The control registers act as they are now.
    fn decode(&mut self, t: u64, out: &mut Outbox) {
        self.choose();
        self.down &= self.mode.dual();
        if !self.mode.buffered() {
            self.channels.iter_mut().for_each(|channel| channel.compare = channel.buffer);
        }
        self.select(t);
        self.show(t, out);
    }

    /// Force compare of the strobes, in non-PWM modes (15.9.2, 16.11.3): no flag, no clear.
    fn force(&mut self, t: u64, out: &mut Outbox) {
        let strobe = std::mem::take(&mut self.strobe);
        if self.mode.buffered() {
            return;
        }
        for (i, channel) in self.channels.iter_mut().enumerate() {
            if strobe << i & 0x80 != 0 {
                match channel.action {
                    Action::Toggle => channel.level = !channel.level,
                    Action::Level(to) => channel.level = to,
                    Action::None | Action::Wave(_) => {}
                }
            }
        }
        self.show(t, out);
    }

    /// The clock that the bits CS select counts from the edge after `t` on.
    pub(super) fn select(&mut self, t: u64) {
        let tap = self.shape.taps[usize::from(self.acting[1] & 7)];
        self.clock = match (tap, self.asynchronous()) {
            (Tap::Div(0) | Tap::Off, _) => Clock::Stopped,
            (Tap::Div(div), true) if div > 1 && self.prescaler.held() => Clock::Stopped,
            (Tap::Div(div), true) => Clock::Tosc { div: u64::from(div), base: self.cleared },
            _ if self.asleep.is_some() => Clock::Stopped,
            (Tap::Div(div), false) => Clock::Io(self.prescaler.tap(div)),
            (Tap::Falling, _) => Clock::Pin { rising: false },
            (Tap::Rising, _) => Clock::Pin { rising: true },
        };
        self.done = self.edges(t);
    }

    /// AS2 and EXCLK (18.11.8). What is on its way to the registers arrives when the clock is switched.
    fn write_assr(&mut self, bits: u8, t: u64, out: &mut Outbox) {
        let switched = (self.assr ^ bits) & AS2 != 0;
        self.assr = bits;
        self.tosc.set_external(bits & EXCLK != 0, t);
        if switched {
            for i in self.pending() {
                self.land(i, t, out);
            }
            self.stale.1 = 0;
            self.cleared = self.tosc.index(t);
            self.select(t);
        }
    }
}
