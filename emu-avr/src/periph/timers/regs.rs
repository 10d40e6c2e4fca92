//! Registers of a timer: reads and the effects of writes.

use emu_core::NEVER;

use super::mode::{MatchAction, TimerMode};
use super::{AvrOutbox, AvrTimer, ClockTap, TimerClock, TimerRegister};

/// Mask of ICNCn in TCCRnB: noise canceler on.
pub(super) const ICNC: u8 = 1 << 7;
/// Mask of ICESn in TCCRnB: rising edges are captured.
pub(super) const ICES: u8 = 1 << 6;
/// Mask of AS2 in ASSR.
pub(super) const AS2: u8 = 1 << 5;
/// Mask of EXCLK in ASSR.
const EXCLK: u8 = 1 << 6;
/// Masks of the update busy bits in ASSR: of TCNT, OCRA, OCRB, TCCRA and TCCRB.
pub(super) const BUSY: [u8; 5] = [1 << 4, 1 << 3, 1 << 2, 1 << 1, 1 << 0];
/// Mask of the busy bits that switch a compare unit off.
pub(super) const COMPARE_BUSY: u8 = 0x1C;
/// Mask of the busy bits after which a pin may be overridden or released.
pub(super) const CONTROL_BUSY: u8 = 0x03;
/// Cycles between an edge and the flag that it sets on the asynchronous timer (18.9).
pub(super) const FLAG_DELAY: u64 = 3;

const fn high(word: u16) -> u8 {
    (word >> 8) as u8
}

impl AvrTimer {
    /// Returns the read value of a register; everything up to `t` has been done.
    pub(super) fn read_register(&self, reg: TimerRegister, t: u64) -> u8 {
        let [a, b, c] = self.channels.map(|channel| channel.written);
        match reg {
            TimerRegister::TCCRA => self.tccra,
            TimerRegister::TCCRB => self.tccrb,
            TimerRegister::TCCRC => 0,
            TimerRegister::TCNTL if self.is_asynchronous() && self.tosc.index(t) < self.stale_count.1 => {
                self.stale_count.0 as u8
            }
            TimerRegister::TCNTL => self.value as u8,
            TimerRegister::ICRL => self.icr as u8,
            TimerRegister::TCNTH | TimerRegister::ICRH => self.temp,
            TimerRegister::OCRAL => a as u8,
            TimerRegister::OCRAH => high(a),
            TimerRegister::OCRBL => b as u8,
            TimerRegister::OCRBH => high(b),
            TimerRegister::OCRCL => c as u8,
            TimerRegister::OCRCH => high(c),
            TimerRegister::TIMSK => self.timsk,
            TimerRegister::TIFR => self.tifr,
            TimerRegister::ASSR => self.assr | self.busy,
        }
    }

    /// Writes the bits in `mask` of a register at the edge `t`.
    pub(super) fn write_register(&mut self, reg: TimerRegister, value: u8, mask: u8, t: u64, out: &mut AvrOutbox) {
        if reg == TimerRegister::TIFR {
            return self.clear(value & mask, t, out);
        }
        self.on_setup_changed(t, out);
        let old = self.read_register(reg, t);
        let byte = old & !mask | value & mask;
        let word = if self.shape.wide { u16::from_be_bytes([self.temp, byte]) } else { u16::from(byte) };
        match reg {
            TimerRegister::TCCRA => {
                self.tccra = byte & self.shape.tccra_bits();
                self.on_latch_due(3, t, out);
            }
            TimerRegister::TCCRB => {
                self.tccrb = byte & self.shape.tccrb_bits();
                // FOCnA and FOCnB are in TCCRnB only on timers without TCCRnC.
                self.strobe |= if self.shape.wide { 0 } else { value & mask };
                self.on_latch_due(4, t, out);
            }
            TimerRegister::TCCRC if self.shape.wide => {
                self.strobe = value & mask;
                self.force_compare(t, out);
            }
            TimerRegister::TCNTL => {
                self.tcnt_next = word;
                self.on_latch_due(0, t, out);
            }
            TimerRegister::OCRAL => self.write_ocr(0, word, t, out),
            TimerRegister::OCRBL => self.write_ocr(1, word, t, out),
            TimerRegister::OCRCL => self.write_ocr(2, word, t, out),
            TimerRegister::ICRL if self.shape.capture && (self.icr_is_top() || !self.shape.icr_only_as_top) => {
                self.icr = word
            }
            TimerRegister::TCNTH | TimerRegister::ICRH if self.shape.wide => self.temp = byte,
            // The mask applies to TEMP: a low byte written alone takes the value that another register has
            // left there, as measured on silicon.
            TimerRegister::OCRAH | TimerRegister::OCRBH | TimerRegister::OCRCH if self.shape.wide => {
                self.temp = byte & self.mode.high_bits()
            }
            TimerRegister::TIMSK => self.timsk = byte & self.shape.flags(),
            TimerRegister::ASSR if self.shape.asynchronous => self.write_assr(byte & (EXCLK | AS2), t, out),
            _ => {}
        }
    }

    /// Clears the flags written as ones. A flag set at the same edge stays set.
    fn clear(&mut self, ones: u8, t: u64, out: &mut AvrOutbox) {
        self.advance_to(t.saturating_sub(1), out);
        let gone = ones & self.tifr;
        self.tifr &= !gone;
        if gone & self.listened_interrupts == 0 && !self.is_asynchronous() {
            // Nothing else changes than the next time at which these flags are set.
            self.next_flag = self.next_flag.min(self.flag_time(gone));
            return self.advance_to(t, out);
        }
        // A flag that is set again at the same edge was never visible as clear, so it sends no signal.
        let listened = self.listened_interrupts;
        self.listened_interrupts &= !gone;
        (self.next_event, self.next_flag) = (0, 0);
        self.on_setup_changed(t, out);
        self.listened_interrupts = listened;
    }

    fn write_ocr(&mut self, i: usize, word: u16, t: u64, out: &mut AvrOutbox) {
        if i < usize::from(self.shape.channels) {
            self.channels[i].written = word;
            // The asynchronous timer has no channel C.
            if i < 2 { self.on_latch_due(i + 1, t, out) } else { self.load_compare(i) }
        }
    }

    /// Passes a write to register `i` of [`BUSY`]: at once, or after two edges of TOSC1.
    fn on_latch_due(&mut self, i: usize, t: u64, out: &mut AvrOutbox) {
        if self.is_asynchronous() {
            self.busy |= BUSY.get(i).copied().unwrap_or(0);
            if let Some(due) = self.due.get_mut(i) {
                *due = if self.asleep.is_some() { NEVER } else { self.tosc.index(t).saturating_add(2) };
            }
        } else {
            self.apply_latched(i, t, out);
        }
    }

    /// Latches the temporary registers that are due.
    pub(super) fn latch(&mut self, t: u64, out: &mut AvrOutbox) {
        let edge = self.tosc.index(t);
        for i in self.pending_registers() {
            if self.due[i] <= edge {
                self.apply_latched(i, t, out);
            }
        }
    }

    /// Applies the written value of register `i` of [`BUSY`].
    fn apply_latched(&mut self, i: usize, t: u64, out: &mut AvrOutbox) {
        self.busy &= !BUSY.get(i).copied().unwrap_or(0);
        match i {
            0 => {
                self.value = self.tcnt_next;
                self.down &= self.value != 0;
                self.match_blocked = true;
            }
            3 => {
                self.effective_control[0] = self.tccra;
                self.decode(t, out);
            }
            4 => {
                self.effective_control[1] = self.tccrb;
                self.decode(t, out);
                self.force_compare(t, out);
            }
            _ => self.load_compare(i - 1),
        }
    }

    /// Copies OCR of a channel to the buffer register, and in modes without buffer also to the compare
    /// register.
    fn load_compare(&mut self, i: usize) {
        let buffered = self.mode.is_buffered();
        if let Some(channel) = self.channels.get_mut(i) {
            channel.buffer = channel.written;
            if !buffered {
                channel.compare = channel.buffer;
            }
        }
    }

    /// Recomputes mode and match actions from the effective control registers.
    pub(super) fn update_actions(&mut self) {
        let [a, b] = self.effective_control;
        let wgm = match (self.shape.channels, self.shape.wide) {
            (0, _) => 0,
            (_, false) => a & 3 | b >> 1 & 4,
            (_, true) => a & 3 | b >> 1 & 12,
        };
        self.mode = TimerMode::from_wgm(self.shape.wide, wgm);
        for (i, channel) in self.channels.iter_mut().enumerate() {
            channel.action = self.mode.action(i, a >> (6 - 2 * i));
            if i >= usize::from(self.shape.channels) {
                channel.action = MatchAction::None;
            }
        }
    }

    /// Applies changed control registers.
    fn decode(&mut self, t: u64, out: &mut AvrOutbox) {
        self.update_actions();
        self.down &= self.mode.is_dual_slope();
        if !self.mode.is_buffered() {
            self.channels.iter_mut().for_each(|channel| channel.compare = channel.buffer);
        }
        self.select_clock(t);
        self.drive_outputs(t, out);
    }

    /// Executes a force compare by FOC in non-PWM modes (15.9.2, 16.11.3): sets no flag, does not clear the
    /// counter.
    fn force_compare(&mut self, t: u64, out: &mut AvrOutbox) {
        let strobe = std::mem::take(&mut self.strobe);
        if self.mode.is_buffered() {
            return;
        }
        for (i, channel) in self.channels.iter_mut().enumerate() {
            if strobe << i & 0x80 != 0 {
                match channel.action {
                    MatchAction::Toggle => channel.level = !channel.level,
                    MatchAction::Level(to) => channel.level = to,
                    MatchAction::None | MatchAction::Wave(_) => {}
                }
            }
        }
        self.drive_outputs(t, out);
    }

    /// Selects the clock given by the bits CS, which counts from the edge after `t` on.
    pub(super) fn select_clock(&mut self, t: u64) {
        let tap = self.shape.taps[usize::from(self.effective_control[1] & 7)];
        self.clock = match (tap, self.is_asynchronous()) {
            (ClockTap::Div(0) | ClockTap::Off, _) => TimerClock::Stopped,
            (ClockTap::Div(div), true) if div > 1 && self.prescaler.is_held() => TimerClock::Stopped,
            (ClockTap::Div(div), true) => TimerClock::Tosc { div: u64::from(div), base: self.cleared },
            _ if self.asleep.is_some() => TimerClock::Stopped,
            (ClockTap::Div(div), false) => TimerClock::Io(self.prescaler.tap(div)),
            (ClockTap::Falling, _) => TimerClock::Pin { rising: false },
            (ClockTap::Rising, _) => TimerClock::Pin { rising: true },
        };
        self.edges_counted = self.edges(t);
    }

    /// Writes AS2 and EXCLK (18.11.8). Pending register writes take effect when the clock is switched.
    fn write_assr(&mut self, bits: u8, t: u64, out: &mut AvrOutbox) {
        let switched = (self.assr ^ bits) & AS2 != 0;
        self.assr = bits;
        self.tosc.set_external(bits & EXCLK != 0, t);
        if switched {
            for i in self.pending_registers() {
                self.apply_latched(i, t, out);
            }
            self.stale_count.1 = 0;
            self.cleared = self.tosc.index(t);
            self.select_clock(t);
        }
    }
}
