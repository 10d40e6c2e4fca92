//! The registers of the chip by address: reading, writing, and how long a value stays the same.

use emu_core::NEVER;
use emu_core::cpu::Bus;
use emu_core::pins::PinId;

use super::{Mcs51Soc, SAMPLED_PINS, power, unit_index};
use crate::chips;
use crate::periph::map::sfr;
use crate::periph::{Device, SignalReceiver};

impl Mcs51Soc {
    /// Advances the timers to S5P2 of cycle `t`.
    pub(super) fn sync_timers(&mut self, t: u64) {
        self.timers.advance_to(t);
        self.timer2.advance_to(t);
        self.timers_synced_to = t;
    }

    /// As [`Mcs51Soc::sync_timers`], but at the boundary before cycle `t`, in which pins can still change.
    pub(super) fn sync_boundary(&mut self, t: u64) {
        self.timers.advance_before(t);
        self.timer2.advance_before(t);
        self.sync_timers(t);
    }

    /// Writes the bits in `mask` of a register for a user at the boundary before the machine cycle `now`.
    pub fn poke(&mut self, reg: u16, mask: u8, value: u8, now: u64) {
        self.run(now);
        self.sync_boundary(self.to_oscillator_time(now));
        self.write_bits(reg, mask, value, now);
    }

    /// The value that a register reads; everything must be advanced.
    pub(super) fn read_sfr(&self, addr: u8) -> u8 {
        match addr {
            sfr::P0 if self.part.has_bus => self.ports.input(0),
            sfr::P1 => self.ports.input(1),
            sfr::P2 if self.part.has_bus => self.ports.input(2),
            sfr::P3 => self.ports.input(3),
            sfr::PCON => self.pcon,
            sfr::TCON => self.tcon(),
            sfr::TMOD..=sfr::TH1 => self.timers.peek(addr, self.timers_synced_to),
            sfr::AUXR if self.part.is_at89s => self.auxr,
            sfr::SCON | sfr::SBUF => self.serial.peek(addr, self.timers_synced_to),
            sfr::IE => self.interrupts.ie,
            sfr::IP => self.interrupts.ip,
            _ => self.timer2.peek(addr, self.timers_synced_to),
        }
    }

    /// TCON: TF1 TR1 TF0 TR0 IE1 IT1 IE0 IT0.
    fn tcon(&self) -> u8 {
        let external = |n: usize| {
            let external = &self.interrupts.external[n];
            u8::from(external.flag()) << 1 | u8::from(external.edge)
        };
        let timer = |n: usize| u8::from(self.timers.flag(n)) << 1 | u8::from(self.timers.run(n));
        timer(1) << 6 | timer(0) << 4 | external(1) << 2 | external(0)
    }

    /// Writes the bits in `mask` at the end of cycle `t`; everything must be advanced to `t`.
    pub(super) fn write_sfr(&mut self, addr: u8, mask: u8, value: u8, t: u64) {
        let kept = |old: u8| old & !mask | value & mask;
        // Whether the baud clocks can depend on this register.
        let clocks = matches!(addr, sfr::PCON..=sfr::TMOD | sfr::TL1 | sfr::TH1 | sfr::T2CON..=sfr::TH2);
        if clocks {
            self.serial.run_due(t, &mut self.out);
        }
        match addr {
            sfr::PCON => {
                let writable = match (self.part.is_cmos, self.part.is_at89s) {
                    (false, _) => power::SMOD,
                    (true, at89s) => {
                        power::SMOD | power::GF | power::PD | power::IDL | if at89s { power::POF } else { 0 }
                    }
                };
                self.pcon = kept(self.pcon) & writable;
                self.enter_power_modes(t);
            }
            sfr::TCON => self.write_tcon(mask, value, t),
            sfr::TMOD..=sfr::TH1 => self.timers.write(addr, value, mask, t, &mut self.out),
            sfr::AUXR if self.part.is_at89s => {
                self.auxr = kept(self.auxr) & (power::DISRTO | power::WDIDLE | power::DISALE);
            }
            sfr::WDTRST if self.part.is_at89s => {
                self.schedule.touch(unit_index::WATCHDOG);
                self.watchdog.write(addr, value, mask, t, &mut self.out);
            }
            sfr::SCON | sfr::SBUF => {
                if addr == sfr::SCON {
                    self.poll(t);
                }
                self.schedule.touch(unit_index::SERIAL);
                self.serial.write(addr, value, mask, t, &mut self.out);
            }
            sfr::IE => self.interrupts.ie = kept(self.interrupts.ie) & (0x9F | self.timer2_bit()),
            sfr::IP => self.interrupts.ip = kept(self.interrupts.ip) & (0x1F | self.timer2_bit()),
            sfr::T2CON..=sfr::TH2 if self.has_timer2_register(addr) => {
                if matches!(addr, sfr::T2CON | sfr::T2MOD) {
                    self.poll(t);
                }
                self.schedule.touch(unit_index::TIMER2);
                self.timer2.write(addr, value, mask, t, &mut self.out);
            }
            _ => {}
        }
        if clocks {
            self.update_baud_clocks(t);
        }
        self.apply_signals(());
    }

    /// Whether the chip has a register of timer 2.
    fn has_timer2_register(&self, addr: u8) -> bool {
        match self.part.timer2 {
            chips::Timer2Kind::None => false,
            chips::Timer2Kind::Nmos => addr != sfr::T2MOD,
            chips::Timer2Kind::Full => true,
        }
    }

    /// The bit of timer 2 in IE and IP, on chips that have it.
    const fn timer2_bit(&self) -> u8 {
        if matches!(self.part.timer2, chips::Timer2Kind::None) { 0 } else { 0x20 }
    }

    fn write_tcon(&mut self, mask: u8, value: u8, t: u64) {
        self.poll(t);
        let bit = |n: usize| (mask >> n & 1 != 0).then_some(value >> n & 1 != 0);
        for n in 0..2 {
            if let Some(on) = bit(5 + 2 * n) {
                self.timers.set_flag(n, on);
            }
            if let Some(on) = bit(4 + 2 * n) {
                self.timers.set_run(n, on);
            }
            let external = &mut self.interrupts.external[n];
            if let Some(on) = bit(2 * n) {
                external.set_edge(on, t);
            }
            if let Some(on) = bit(1 + 2 * n) {
                external.set_flag(on, t);
            }
        }
    }

    /// Writes the bits in `mask` of a port's latch at the end of cycle `t`; the pins follow in the next
    /// cycle. Returns true if nothing but those pins can have changed.
    pub(super) fn write_port(&mut self, port: usize, mask: u8, value: u8, t: u64) -> bool {
        if self.is_port_missing(port) {
            return true;
        }
        let changed = self.ports.set_latch(port, self.ports.latch(port) & !mask | value & mask);
        let logged = self.log.len();
        let mut listens = false;
        for bit in (0..8).filter(|bit| changed >> bit & 1 == 1) {
            let pin = (port * 8) as PinId + bit;
            self.update_pin(pin, t + 1, 0);
            listens |= SAMPLED_PINS.contains(&pin);
        }
        if listens {
            self.update_deadline();
        }
        !listens && self.log.len() == logged
    }

    /// Whether a port is missing: ports 0 and 2 on chips without a bus.
    pub(super) const fn is_port_missing(&self, port: usize) -> bool {
        port & 1 == 0 && !self.part.has_bus
    }

    /// The cycle up to which a register keeps its value from the machine cycle `now` on; nothing may be due
    /// at `now`.
    pub(super) fn sfr_steady_until(&self, addr: u8, now: u64) -> u64 {
        let later = |t: u64| t.saturating_add(self.stopped_cycles);
        match addr {
            sfr::P0 | sfr::P1 | sfr::P2 | sfr::P3 | sfr::SCON | sfr::SBUF => self.next_due(),
            sfr::TCON => later(self.timers.next_flag(0).min(self.timers.next_flag(1))).min(self.next_due()),
            sfr::T2CON => later(self.timer2.next_flag()).min(self.next_due()),
            sfr::TL0 | sfr::TL1 | sfr::TH0 | sfr::TH1 | sfr::TL2 | sfr::TH2 => now,
            sfr::RCAP2L | sfr::RCAP2H => now,
            // The read itself has an effect.
            sfr::IE | sfr::IP if self.readings.read_holds_interrupts => now,
            _ => NEVER,
        }
    }
}
