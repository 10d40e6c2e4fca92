//! A model of timer 0 and the watchdog that steps clock by clock.

use emu_pic16::periph::map::{InterruptFlag, Sfr};
use emu_pic16::periph::{Pic16Outbox, Pic16Signal};

/// The block diagram of DS33023 section 11, with one call per clock.
pub struct Model {
    pub tmr0: u8,
    pub option: u8,
    pub wdtcon: u8,
    wdte: bool,
    has_wdtcon: bool,
    wdt_clocks: u64,
    /// Clocks since the watchdog was cleared.
    wdt_age: u64,
    ripple: [bool; 8],
    pin: bool,
    clkout: bool,
    last: bool,
    /// Whether a rise was detected in Q4 of the last cycle, in Q2 of this one, in Q4 of this one.
    seen: [bool; 3],
    /// Number of cycles at whose end nothing counts, and of clocks in which prescaler and sampler are held in
    /// reset.
    blind: u32,
    held: u32,
    pub asleep: bool,
}

impl Model {
    pub fn new(wdte: bool, wdt_clocks: u64, has_wdtcon: bool) -> Model {
        Model {
            tmr0: 0,
            option: 0xFF,
            wdtcon: if has_wdtcon { 8 } else { 0 },
            wdte,
            has_wdtcon,
            wdt_clocks,
            wdt_age: 0,
            ripple: [false; 8],
            pin: false,
            clkout: false,
            last: true,
            seen: [false; 3],
            blind: 0,
            held: 0,
            asleep: false,
        }
    }

    fn t0cs(&self) -> bool {
        self.option & 0x20 != 0
    }

    fn psa(&self) -> bool {
        self.option & 0x08 != 0
    }

    fn stage(&self) -> bool {
        self.ripple[usize::from(self.option & 7)]
    }

    fn source(&self) -> bool {
        match (self.t0cs(), self.option & 0x10 != 0) {
            (false, _) => self.clkout,
            (true, false) => self.pin,
            (true, true) => !self.pin,
        }
    }

    fn ripple_clock(&self) -> bool {
        if self.psa() { false } else { self.source() }
    }

    fn toggle(&mut self) {
        for stage in &mut self.ripple {
            *stage = !*stage;
            if *stage {
                return;
            }
        }
    }

    fn clock_ripple_on_rise(&mut self, before: bool) {
        if !before && self.ripple_clock() && self.held == 0 {
            self.toggle();
        }
    }

    fn watchdog_on(&self) -> bool {
        self.wdte || self.wdtcon & 1 != 0
    }

    fn wdt_period(&self) -> u64 {
        if !self.has_wdtcon {
            return self.wdt_clocks;
        }
        // 1:32 at 0000, 1:512 at 0100, 1:65536 at 1011.
        let divider = 32u64 << (self.wdtcon >> 1 & 15).min(11);
        (self.wdt_clocks * divider / 512).max(1)
    }

    fn time_out(&mut self, t: u64, out: &mut Pic16Outbox) {
        out.push(Pic16Signal::Watchdog { t });
        if self.psa() {
            self.ripple = [false; 8];
        }
    }

    /// Executes the clock `t` before any write; `written` is true if TMR0 is written in this very clock.
    pub fn arrive(&mut self, t: u64, written: bool, out: &mut Pic16Outbox) {
        if t > 0 {
            self.wdt_age += 1;
        }
        if t.is_multiple_of(4) && t > 0 && !self.asleep {
            let count = self.seen[0] || self.seen[1];
            self.seen = [self.seen[2], false, false];
            if self.blind > 0 {
                self.blind -= 1;
            } else if count && !written {
                self.tmr0 = self.tmr0.wrapping_add(1);
                if self.tmr0 == 0 {
                    out.push(Pic16Signal::Flag { t, flag: InterruptFlag::T0IF });
                }
            }
        }
        if self.watchdog_on() && self.wdt_age > 0 && self.wdt_age.is_multiple_of(self.wdt_period()) {
            if !self.psa() {
                self.time_out(t, out);
            } else {
                let before = self.stage();
                self.toggle();
                if !before && self.stage() {
                    self.time_out(t, out);
                }
            }
        }
    }

    pub fn write(&mut self, reg: Sfr, value: u8, t: u64, out: &mut Pic16Outbox) {
        match reg {
            Sfr::TMR0 => {
                self.tmr0 = value;
                self.seen = [false; 3];
                if !self.psa() {
                    self.ripple = [false; 8];
                }
                self.blind = 2;
                self.held = 6;
            }
            Sfr::OPTION => {
                let before = self.ripple_clock();
                self.option = value;
                self.clock_ripple_on_rise(before);
                if self.watchdog_on() && self.psa() && self.stage() {
                    self.time_out(t, out);
                }
            }
            Sfr::WDTCON if self.has_wdtcon => {
                let was = self.watchdog_on();
                self.wdtcon = value & 0x1F;
                if !was && self.watchdog_on() {
                    self.clear();
                }
            }
            _ => {}
        }
    }

    pub fn clear(&mut self) {
        self.wdt_age = 0;
        if self.psa() {
            self.ripple = [false; 8];
        }
    }

    pub fn pin(&mut self, high: bool) {
        let before = self.ripple_clock();
        self.pin = high;
        self.clock_ripple_on_rise(before);
    }

    pub fn reset(&mut self) {
        let fresh = Model::new(self.wdte, self.wdt_clocks, self.has_wdtcon);
        // With OPTION = FFh falling edges of the pin count, past the prescaler.
        *self = Model { tmr0: self.tmr0, pin: self.pin, last: !self.pin, ..fresh };
    }

    /// Executes the clock that starts at `t`.
    pub fn tick(&mut self, t: u64) {
        if self.asleep {
            return;
        }
        let before = self.ripple_clock();
        match t % 4 {
            0 => self.clkout = true,
            2 => self.clkout = false,
            q => {
                let level = if self.psa() { self.source() } else { !self.stage() };
                if level && !self.last && self.held == 0 {
                    self.seen[if q == 1 { 1 } else { 2 }] = true;
                }
                self.last = level;
            }
        }
        self.clock_ripple_on_rise(before);
        self.held = self.held.saturating_sub(1);
    }
}
