//! The registers of the chip by address: reading, writing, and how long a value lasts.

use emu_core::NEVER;
use emu_core::cpu::Bus;
use emu_core::pins::PinId;

use super::{SAMPLED, Soc, power};
use crate::chips;
use crate::periph::map::at;

impl Soc {
    /// Brings timers and serial port up to S5P2 of cycle `t`.
    pub(super) fn sync(&mut self, t: u64) {
        self.run_serial(t);
        self.timers.sync(t);
        if let Some(timer2) = &mut self.timer2 {
            timer2.sync(t);
        }
        self.synced = t;
    }

    /// The same at the boundary before cycle `t`, whose pins may still change.
    pub(super) fn sync_boundary(&mut self, t: u64) {
        self.timers.sync_ahead(t);
        if let Some(timer2) = &mut self.timer2 {
            timer2.sync_ahead(t);
        }
        self.sync(t);
    }

    /// Writes the bits of `mask` of a register by hand at the boundary before the machine cycle `now`.
    pub fn poke(&mut self, reg: u16, mask: u8, value: u8, now: u64) {
        self.run(now);
        self.sync_boundary(self.inner(now));
        self.write_bits(reg, mask, value, now);
    }

    /// What a register reads, everything being synced.
    pub(super) fn show(&self, addr: u8) -> u8 {
        let timers = &self.timers;
        match addr {
            at::P0 if self.part.bus => self.ports.input(0),
            at::P1 => self.ports.input(1),
            at::P2 if self.part.bus => self.ports.input(2),
            at::P3 => self.ports.input(3),
            at::PCON => self.pcon,
            at::TCON => self.tcon(),
            at::TMOD => timers.tmod(),
            at::TL0 => timers.tl(0),
            at::TL1 => timers.tl(1),
            at::TH0 => timers.th(0),
            at::TH1 => timers.th(1),
            at::AUXR if self.part.at89s => self.auxr,
            at::SCON => self.serial.scon(),
            at::SBUF => self.serial.sbuf(),
            at::IE => self.interrupts.ie,
            at::IP => self.interrupts.ip,
            _ => match &self.timer2 {
                Some(timer2) => match addr {
                    at::T2CON => timer2.t2con(),
                    at::T2MOD => timer2.t2mod(),
                    at::RCAP2L => timer2.rcapl(),
                    at::RCAP2H => timer2.rcaph(),
                    at::TL2 => timer2.tl(),
                    at::TH2 => timer2.th(),
                    _ => 0,
                },
                None => 0,
            },
        }
    }

    /// TF1 TR1 TF0 TR0 IE1 IT1 IE0 IT0.
    fn tcon(&self) -> u8 {
        let external = |n: usize| {
            let external = &self.interrupts.external[n];
            u8::from(external.flag()) << 1 | u8::from(external.edge)
        };
        let timer = |n: usize| u8::from(self.timers.flag(n)) << 1 | u8::from(self.timers.run(n));
        timer(1) << 6 | timer(0) << 4 | external(1) << 2 | external(0)
    }

    /// Writes the bits of `mask` at the end of cycle `t`, everything being synced to it.
    pub(super) fn store(&mut self, addr: u8, mask: u8, value: u8, t: u64) {
        let kept = |old: u8| old & !mask | value & mask;
        // What the baud clocks hang on.
        let clocks = !matches!(addr, at::TL0 | at::TH0 | at::IE | at::IP);
        let sources = self.sources();
        if clocks {
            self.pass_ticks(t);
        }
        match addr {
            at::PCON => {
                let writable = match (self.part.cmos, self.part.at89s) {
                    (false, _) => power::SMOD,
                    (true, at89s) => {
                        power::SMOD | power::GF | power::PD | power::IDL | if at89s { power::POF } else { 0 }
                    }
                };
                self.pcon = kept(self.pcon) & writable;
                self.enter_power_modes(t);
            }
            at::TCON => self.store_tcon(mask, value, t),
            at::TMOD => self.timers.set_tmod(kept(self.timers.tmod())),
            at::TL0 => self.timers.set_tl(0, value),
            at::TL1 => self.timers.set_tl(1, value),
            at::TH0 => self.timers.set_th(0, value),
            at::TH1 => self.timers.set_th(1, value),
            at::AUXR if self.part.at89s => self.auxr = value & (power::DISRTO | power::WDIDLE | power::DISALE),
            at::WDTRST if self.part.at89s => self.watchdog.write(value, t),
            at::SCON => {
                self.poll(t);
                let step = self.serial.set_scon(kept(self.serial.scon()), t);
                self.took(step, t);
            }
            at::SBUF => {
                let step = self.serial.write_sbuf(value, t);
                self.took(step, t);
            }
            at::IE => self.interrupts.ie = kept(self.interrupts.ie) & (0x9F | self.timer2_bit()),
            at::IP => self.interrupts.ip = kept(self.interrupts.ip) & (0x1F | self.timer2_bit()),
            at::T2CON | at::T2MOD => self.poll(t),
            _ => {}
        }
        if let Some(timer2) = &mut self.timer2 {
            match addr {
                at::T2CON => timer2.set_t2con(kept(timer2.t2con())),
                at::T2MOD if self.part.timer2 == chips::Timer2::Full => timer2.set_t2mod(value & 3),
                at::RCAP2L => timer2.set_rcapl(value),
                at::RCAP2H => timer2.set_rcaph(value),
                at::TL2 => timer2.set_tl(value),
                at::TH2 => timer2.set_th(value),
                _ => {}
            }
        }
        if matches!(addr, at::T2CON..=at::TH2) {
            self.clock_written(t);
        }
        if clocks {
            self.rebase(sources, t);
        }
    }

    /// The bit of timer 2 in IE and IP, on chips that have it.
    const fn timer2_bit(&self) -> u8 {
        if self.timer2.is_some() { 0x20 } else { 0 }
    }

    fn store_tcon(&mut self, mask: u8, value: u8, t: u64) {
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

    /// Writes the bits of `mask` of a port's latch at the end of cycle `t`; pins follow in the next. True when nothing but
    /// those pins can have changed.
    pub(super) fn store_port(&mut self, port: usize, mask: u8, value: u8, t: u64) -> bool {
        if self.absent(port) {
            return true;
        }
        let changed = self.ports.set_latch(port, self.ports.latch(port) & !mask | value & mask);
        let logged = self.log.len();
        let mut listens = false;
        for bit in (0..8).filter(|bit| changed >> bit & 1 == 1) {
            let pin = (port * 8) as PinId + bit;
            self.settle(pin, t + 1, 0);
            listens |= SAMPLED.contains(&pin);
        }
        if listens {
            self.schedule();
        }
        !listens && self.log.len() == logged
    }

    /// True for ports 0 and 2 of the chips without them.
    pub(super) const fn absent(&self, port: usize) -> bool {
        port & 1 == 0 && !self.part.bus
    }

    /// How long a register keeps its value from the machine cycle `now` on, nothing being due at it.
    pub(super) fn steady(&self, addr: u8, now: u64) -> u64 {
        let later = |t: u64| t.saturating_add(self.frozen);
        match addr {
            at::P0 | at::P1 | at::P2 | at::P3 | at::SCON | at::SBUF => self.due(),
            at::TCON => later(self.timers.next_flag(0).min(self.timers.next_flag(1))).min(self.due()),
            at::T2CON => later(self.timer2.as_ref().map_or(NEVER, |t| t.next_flag())).min(self.due()),
            at::TL0 | at::TL1 | at::TH0 | at::TH1 | at::TL2 | at::TH2 => now,
            at::RCAP2L | at::RCAP2H => now,
            // The read itself does something.
            at::IE | at::IP if self.readings.hold_on_read => now,
            _ => NEVER,
        }
    }
}
