//! The registers of the chip by address (section 36): reading, showing, writing, and how long a value lasts.

use emu_core::cpu::NEVER;

use super::Soc;
use crate::periph::map::{RXD, TXD, at};
use crate::periph::old_timer::{ICF, OCFA, OCFB, TOV, Timer, Top};

/// GTCCR bits.
const TSM: u8 = 1 << 7;
const PSRASY: u8 = 1 << 1;
const PSRSYNC: u8 = 1 << 0;

/// PUD in MCUCR.
const PUD: u8 = 1 << 4;

/// AS2 in ASSR.
const AS2: u8 = 1 << 5;

const BYTE_FLAGS: u8 = TOV | OCFA | OCFB;
const ALL_FLAGS: u8 = BYTE_FLAGS | ICF;

/// Divisors by clock select, timers 0 and 1 (table 15-9; 6 and 7 are pin T0 or T1) and timer 2 (table 18-9).
const DIVISORS: [[u16; 8]; 2] = [[0, 1, 8, 64, 256, 1024, 0, 0], [0, 1, 8, 32, 64, 128, 256, 1024]];

impl Soc {
    /// Reads a register as the program does.
    pub(super) fn load(&mut self, reg: u16, now: u64) -> u8 {
        match reg {
            at::UDR0 => self.usart.read(),
            at::TCNT1L => {
                self.timers[1].sync(now);
                self.latch(self.timers[1].count())
            }
            at::ICR1L => self.latch(self.timers[1].icr()),
            at::TIFR0 => self.timers[0].flags_at(now),
            at::TIFR1 => self.timers[1].flags_at(now),
            at::TIFR2 => self.timers[2].flags_at(now),
            _ => self.show(reg, now),
        }
    }

    /// What a register reads in the cycle `now`, without side effects.
    pub(super) fn show(&self, reg: u16, now: u64) -> u8 {
        let timer = |n: usize| self.timers[n].synced(now);
        match reg {
            at::PINB..=at::PORTD => {
                let (port, kind) = port_of(reg);
                match kind {
                    0 => self.ports.input(port, now) & !self.analog_only(port),
                    1 => self.ports.ddr(port),
                    _ => self.ports.port(port),
                }
            }
            at::TIFR0 => timer(0).flags(),
            at::TIFR1 => timer(1).flags(),
            at::TIFR2 => timer(2).flags(),
            at::TIMSK0 => self.timers[0].enabled(),
            at::TIMSK1 => self.timers[1].enabled(),
            at::TIMSK2 => self.timers[2].enabled(),
            at::TCNT0 => timer(0).count() as u8,
            at::TCNT2 => timer(2).count() as u8,
            at::TCNT1L => timer(1).count() as u8,
            at::ICR1L => self.timers[1].icr() as u8,
            at::TCNT1H | at::ICR1H => self.temp,
            at::OCR0A => self.timers[0].ocr(0) as u8,
            at::OCR0B => self.timers[0].ocr(1) as u8,
            at::OCR2A => self.timers[2].ocr(0) as u8,
            at::OCR2B => self.timers[2].ocr(1) as u8,
            at::OCR1AL => self.timers[1].ocr(0) as u8,
            at::OCR1AH => (self.timers[1].ocr(0) >> 8) as u8,
            at::OCR1BL => self.timers[1].ocr(1) as u8,
            at::OCR1BH => (self.timers[1].ocr(1) >> 8) as u8,
            at::GTCCR => self.gtccr,
            at::UCSR0A => self.usart.status(),
            at::UCSR0B => self.usart.control(),
            at::UCSR0C => self.usart.format(),
            at::UBRR0L => self.usart.ubrr() as u8,
            at::UBRR0H => (self.usart.ubrr() >> 8) as u8,
            at::UDR0 => self.usart.peek(),
            at::WDTCSR => self.watchdog.read(now),
            at::MCUSR => self.mcusr,
            _ => self.plain.get(reg),
        }
    }

    /// Writes the bits of `mask` in the cycle `now`; they act at the edge that ends it. True when no deadline can have moved
    /// but by a pin.
    pub(super) fn store(&mut self, reg: u16, mask: u8, value: u8, now: u64) -> bool {
        let at = now + 1;
        if matches!(reg, at::UCSR0A..=at::UDR0) {
            // The port's own steps at that edge still see what was there before; but what completes there stays complete.
            self.usart.clear(if reg == at::UCSR0A { value } else { 0 });
            self.run_serial(at);
        }
        // What a register that acts on ones gets, and what a register that keeps its bits gets.
        let ones = value & mask;
        let kept = |old: u8| old & !mask | ones;
        match reg {
            at::PINB..=at::PORTD => return self.store_port(reg, mask, value, at),
            at::TIFR0 => self.timers[0].clear_flags(ones, now),
            at::TIFR1 => self.timers[1].clear_flags(ones, now),
            at::TIFR2 => self.timers[2].clear_flags(ones, now),
            at::TIMSK0 => self.timers[0].set_enabled(ones & BYTE_FLAGS),
            at::TIMSK1 => self.timers[1].set_enabled(ones & ALL_FLAGS),
            at::TIMSK2 => self.timers[2].set_enabled(ones & BYTE_FLAGS),
            at::TCNT0 => self.timers[0].set_count(value.into(), at),
            at::TCNT2 => self.timers[2].set_count(value.into(), at),
            at::OCR0A => self.timers[0].set_ocr(0, value.into(), at),
            at::OCR0B => self.timers[0].set_ocr(1, value.into(), at),
            at::OCR2A => self.timers[2].set_ocr(0, value.into(), at),
            at::OCR2B => self.timers[2].set_ocr(1, value.into(), at),
            at::TCNT1H | at::ICR1H | at::OCR1AH | at::OCR1BH => self.temp = value,
            at::TCNT1L => self.timers[1].set_count(self.word(value), at),
            at::OCR1AL => self.timers[1].set_ocr(0, self.word(value), at),
            at::OCR1BL => self.timers[1].set_ocr(1, self.word(value), at),
            // Only modes that take their top from ICR1 let a program write it (16.11.7).
            at::ICR1L if matches!(self.mode(1), 8 | 10 | 12 | 14) => self.timers[1].set_icr(self.word(value), at),
            at::ICR1L => {}
            at::TCCR0A | at::TCCR0B | at::TCCR1A | at::TCCR1B | at::TCCR2A | at::TCCR2B | at::ASSR => {
                self.plain.put(reg, mask, value);
                self.set_modes(at);
            }
            at::GTCCR => self.store_gtccr(value, at),
            at::UCSR0A => self.usart.set_status(value, at),
            at::UCSR0B => {
                self.usart.set_control(value, at);
                self.own_serial_pins(at);
            }
            at::UCSR0C => self.usart.set_format(value),
            at::UBRR0L => self.usart.set_ubrr_low(value, at),
            at::UBRR0H => self.usart.set_ubrr_high(value, at),
            at::UDR0 => self.usart.write(value, at),
            at::WDTCSR => self.watchdog.write(value, now, self.mcusr & super::WDRF != 0),
            at::MCUSR => self.mcusr &= kept(self.mcusr),
            at::MCUCR => {
                self.plain.put(reg, mask, value);
                self.ports.pull_ups_off = self.plain.get(reg) & PUD != 0;
                for pin in 0..super::PINS as u8 {
                    self.settle(pin, at);
                }
            }
            _ => {
                self.plain.put(reg, mask, value);
                return true;
            }
        }
        false
    }

    /// How long a register keeps its value from `now` on, nothing being due at `now`.
    pub(super) fn steady(&self, reg: u16, now: u64) -> u64 {
        let flags = |timer: &Timer| timer.synced(now).next(ALL_FLAGS);
        let count = |timer: &Timer| if timer.running() { now } else { NEVER };
        match reg {
            at::PINB | at::PINC | at::PIND if !self.ports.settled(port_of(reg).0, now) => now,
            at::PINB | at::PINC | at::PIND | at::UCSR0A => self.deadline,
            at::TIFR0 => flags(&self.timers[0]),
            at::TIFR1 => flags(&self.timers[1]),
            at::TIFR2 => flags(&self.timers[2]),
            at::TCNT0 => count(&self.timers[0]),
            at::TCNT2 => count(&self.timers[2]),
            at::WDTCSR if !self.watchdog.open(now) => self.deadline,
            at::WDTCSR | at::TCNT1L | at::ICR1L | at::UDR0 => now,
            _ => NEVER,
        }
    }

    fn store_port(&mut self, reg: u16, mask: u8, value: u8, at: u64) -> bool {
        let (port, kind) = port_of(reg);
        let (ddr, out) = (self.ports.ddr(port), self.ports.port(port));
        let changed = match kind {
            // Writing one to PINx toggles PORTx (14.2.2).
            0 => self.ports.set_port(port, out ^ value & mask),
            1 => self.ports.set_ddr(port, ddr & !mask | value & mask),
            _ => self.ports.set_port(port, out & !mask | value & mask),
        };
        let mut listens = false;
        for bit in (0..8).filter(|bit| changed >> bit & 1 == 1) {
            let pin = (port * 8) as u8 + bit;
            self.settle(pin, at);
            listens |= pin == RXD;
        }
        !listens
    }

    /// Pins whose digital input is switched off read 0 (DIDR0 is PC0 to PC5, DIDR1 is PD6 and PD7; 24.9.5, 23.3.3).
    fn analog_only(&self, port: usize) -> u8 {
        match port {
            1 => self.plain.get(at::DIDR0),
            2 => self.plain.get(at::DIDR1) << 6,
            _ => 0,
        }
    }

    fn own_serial_pins(&mut self, at: u64) {
        self.ports.rxd = self.usart.receives();
        self.ports.txd = match self.ports.txd {
            _ if !self.usart.transmits() => None,
            // Between frames the line rests high.
            Some(line) => Some(line),
            None => Some(true),
        };
        self.settle(RXD, at);
        self.settle(TXD, at);
    }

    fn latch(&mut self, word: u16) -> u8 {
        self.temp = (word >> 8) as u8;
        word as u8
    }

    fn word(&self, low: u8) -> u16 {
        u16::from_be_bytes([self.temp, low])
    }

    /// WGM of a timer.
    fn mode(&self, timer: usize) -> u8 {
        let (a, b) = self.control(timer);
        a & 3 | if timer == 1 { b >> 1 & 0x0C } else { b >> 1 & 0x04 }
    }

    fn control(&self, timer: usize) -> (u8, u8) {
        let (a, b) = match timer {
            0 => (at::TCCR0A, at::TCCR0B),
            1 => (at::TCCR1A, at::TCCR1B),
            _ => (at::TCCR2A, at::TCCR2B),
        };
        (self.plain.get(a), self.plain.get(b))
    }

    /// Gives all timers the mode and the clock that their registers say, for the edges after the cycle `at`.
    fn set_modes(&mut self, at: u64) {
        for n in 0..3 {
            // Tables 15-8, 16-4 and 18-8.
            let top = match (n, self.mode(n)) {
                (0 | 2, 2) | (1, 4) => Top::OcrA,
                (1, 12) => Top::Icr,
                _ => Top::Max,
            };
            let select = usize::from(self.control(n).1 & 7);
            let group = usize::from(n == 2);
            let asynchronous = n == 2 && self.plain.get(at::ASSR) & AS2 != 0;
            let div = if asynchronous { 0 } else { DIVISORS[group][select] };
            let ticks = self.prescalers[group].tap(div);
            self.timers[n].set_top(top, at);
            self.timers[n].set_ticks(ticks, at);
        }
    }

    /// Clears prescalers, or holds them while TSM is set (17.4.1).
    fn store_gtccr(&mut self, value: u8, at: u64) {
        let hold = value & TSM != 0;
        for (prescaler, bit) in self.prescalers.iter_mut().zip([PSRSYNC, PSRASY]) {
            let clear = value & bit != 0;
            if clear || prescaler.held() {
                prescaler.clear(at, hold && clear);
            }
        }
        self.gtccr = if hold { value & (TSM | PSRASY | PSRSYNC) } else { 0 };
        self.set_modes(at);
    }
}

/// Port of a port register, and 0, 1 or 2 for PINx, DDRx or PORTx: they stand three by three.
fn port_of(reg: u16) -> (usize, u16) {
    let place = reg.saturating_sub(at::PINB);
    (usize::from(place / 3).min(2), place % 3)
}
