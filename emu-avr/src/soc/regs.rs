//! The registers of the chip by address (section 36): reading, showing, writing, and how long a value lasts.

use emu_core::cpu::{NEVER, Wake};

use super::Soc;
use crate::chips::{Own, Site, unit};
use crate::periph::usart::Reg::{UBRRH, UCSRC};
use crate::periph::{Device, adc, timers, usart};

/// GTCCR bits.
const TSM: u8 = 1 << 7;
const PSRASY: u8 = 1 << 1;
const PSRSYNC: u8 = 1 << 0;

/// MCUCR bits.
const BODS: u8 = 1 << 6;
const BODSE: u8 = 1 << 5;
const PUD: u8 = 1 << 4;
pub(super) const IVSEL: u8 = 1 << 1;
const IVCE: u8 = 1 << 0;

/// RAMPZ0, the one bit of RAMPZ.
pub(super) const RAMPZ: u8 = 1;

/// URSEL in UCSRC and UBRRH.
const URSEL: u8 = 1 << 7;

/// A read of one register of a unit; what it does besides is carried out.
macro_rules! read {
    ($soc:ident, $number:expr, $unit:expr, $reg:expr, $t:ident) => {{
        let value = $unit.read($reg, $t, &mut $soc.out);
        $soc.carry_out($number);
        value
    }};
}

/// A write.
macro_rules! write {
    ($soc:ident, $number:expr, $unit:expr, $reg:expr, $value:ident, $mask:ident, $t:ident) => {{
        $unit.write($reg, $value, $mask, $t, &mut $soc.out);
        $soc.touch($number);
        $soc.carry_out($number);
    }};
}

impl Soc {
    /// What stands at a data address.
    pub(super) fn site(&self, reg: u16) -> Site {
        self.part.site(reg)
    }

    /// The unit of a register, where it has one.
    const fn unit_of(site: Site) -> Option<usize> {
        Some(match site {
            Site::Timer(n, _) => unit::TIMER + n as usize % 4,
            Site::Usart(n, _) | Site::Ursel(n) => unit::USART + n as usize % 2,
            Site::Spi(_) => unit::SPI,
            Site::Twi(_) => unit::TWI,
            Site::Adc(_) => unit::ADC,
            Site::Comparator(_) => unit::COMPARATOR,
            Site::Eeprom(_) => unit::EEPROM,
            Site::Spm(_) => unit::SPM,
            Site::Watchdog(_) => unit::WATCHDOG,
            Site::External(_) => unit::EXTERNAL,
            _ => return None,
        })
    }

    /// A unit that PRR has switched off: its registers cannot be reached (10.10).
    fn shut(&self, site: Site) -> bool {
        self.prr != 0 && Soc::unit_of(site).is_some_and(|number| self.shut_off(number))
    }

    /// Reads a register, whatever it is and is due.
    #[inline(never)]
    pub(super) fn read_any(&mut self, reg: u16, now: u64) -> (u8, Wake) {
        let due = self.due <= now;
        self.run(now);
        let (value, acts) = match self.site(reg) {
            Site::Port(port, 0) => (self.show_pins(port, now), false),
            Site::Low(addr) => (self.low_byte(addr), false),
            site => self.load(site, now),
        };
        (value, if due || acts { Wake::DEADLINE } else { Wake::NONE })
    }

    /// Reads a register as the program does in cycle `t`. Whether that may have moved a deadline or an interrupt.
    pub(super) fn load(&mut self, site: Site, t: u64) -> (u8, bool) {
        if self.shut(site) {
            return (0, false);
        }
        let acts = match site {
            Site::Timer(n, reg) => {
                let n = usize::from(n) % 4;
                return (read!(self, unit::TIMER + n, self.timers[n], reg, t), false);
            }
            Site::Usart(n, reg) => {
                let n = usize::from(n) % 2;
                (read!(self, unit::USART + n, self.usarts[n], reg, t), reg == usart::Reg::UDR)
            }
            Site::Spi(reg) => (read!(self, unit::SPI, self.spi, reg, t), true),
            Site::Twi(reg) => (read!(self, unit::TWI, self.twi, reg, t), false),
            Site::Adc(reg) => {
                (read!(self, unit::ADC, self.adc, reg, t), matches!(reg, adc::Reg::ADCL | adc::Reg::ADCH))
            }
            Site::Ursel(n) => {
                let value = self.show(site, t);
                self.ursel_read[usize::from(n) % 2] = t;
                return (value, false);
            }
            Site::Split(bits) => {
                let mut all = (0, false);
                for &(bit, site, its) in bits {
                    let (value, acts) = self.load(site, t);
                    all = (all.0 | (value >> its & 1) << bit, all.1 | acts);
                }
                all
            }
            _ => return (self.show(site, t), false),
        };
        if let (true, Some(number)) = (acts.1, Soc::unit_of(site)) {
            self.touch(number);
            self.plan();
        }
        acts
    }

    /// PINx.
    #[inline(always)]
    pub(super) fn show_pins(&self, port: u8, t: u64) -> u8 {
        let port = usize::from(port);
        self.ports.input(port, t) & !self.analog_only(port)
    }

    /// What a register reads in cycle `t`, without side effects.
    pub(super) fn show(&self, site: Site, t: u64) -> u8 {
        if self.shut(site) {
            return 0;
        }
        match site {
            Site::Reserved | Site::Core => 0,
            Site::Low(addr) => self.low_byte(addr),
            Site::Port(port, kind) => {
                let port = usize::from(port);
                match kind {
                    0 => self.show_pins(port as u8, t),
                    1 => self.ports.ddr(port),
                    _ => self.ports.port(port),
                }
            }
            Site::Timer(n, reg) => self.timers[usize::from(n) % 4].peek(reg, t),
            Site::Usart(n, reg) => self.usarts[usize::from(n) % 2].peek(reg, t),
            // The first read gives UBRRH, one in the cycle that follows UCSRC.
            Site::Ursel(n) => {
                let n = usize::from(n) % 2;
                if self.ursel_read[n].checked_add(1) == Some(t) {
                    URSEL | self.usarts[n].peek(UCSRC, t)
                } else {
                    self.usarts[n].peek(UBRRH, t)
                }
            }
            Site::Spi(reg) => self.spi.peek(reg, t),
            Site::Twi(reg) => self.twi.peek(reg, t),
            Site::Adc(reg) => self.adc.peek(reg, t),
            Site::Comparator(reg) => self.comparator.peek(reg, t),
            Site::Eeprom(reg) => self.eeprom.peek(reg, t),
            Site::Spm(reg) => self.spm.peek(reg, t),
            Site::Watchdog(reg) => self.watchdog.peek(reg, t),
            Site::External(reg) => self.external.peek(reg, t),
            Site::Kept(n) => self.kept[usize::from(n) % 4],
            Site::Split(bits) => {
                bits.iter().fold(0, |all, &(bit, site, its)| all | (self.show(site, t) >> its & 1) << bit)
            }
            Site::Own(own) => match own {
                Own::MCUCR => self.mcucr | if self.power.ivce_open(t) { IVCE } else { 0 },
                Own::MCUSR => self.mcusr,
                Own::SMCR => self.smcr,
                Own::CLKPR => self.power.clkpr(t),
                Own::PRR => self.prr,
                Own::OSCCAL => self.osccal,
                Own::GTCCR => self.gtccr,
                Own::RAMPZ => self.rampz,
            },
        }
    }

    /// Writes the bits of `mask` at the edge `t` that ends the cycle of the write.
    pub(super) fn store(&mut self, site: Site, mask: u8, value: u8, t: u64) {
        if self.shut(site) {
            return;
        }
        match site {
            Site::Reserved | Site::Core => {}
            Site::Low(addr) => self.set_low_byte(addr, self.low_byte(addr) & !mask | value & mask),
            Site::Port(port, kind) => self.store_port(usize::from(port), kind, mask, value, t),
            Site::Timer(n, reg) => {
                let n = usize::from(n) % 4;
                write!(self, unit::TIMER + n, self.timers[n], reg, value, mask, t);
                match reg {
                    timers::Reg::TIFR => self.tell_trigger(unit::TIMER + n, t),
                    // PRTIM2 counts for the synchronous timer alone.
                    timers::Reg::ASSR if self.prr != 0 => self.clocks(t),
                    _ => {}
                }
            }
            Site::Usart(n, reg) => {
                let n = usize::from(n) % 2;
                write!(self, unit::USART + n, self.usarts[n], reg, value, mask, t);
            }
            Site::Ursel(n) => {
                let (reg, bits) = if value & URSEL != 0 { (UCSRC, !URSEL) } else { (UBRRH, 0xFF) };
                self.store(Site::Usart(n, reg), mask & bits, value & bits, t);
            }
            Site::Spi(reg) => write!(self, unit::SPI, self.spi, reg, value, mask, t),
            Site::Twi(reg) => write!(self, unit::TWI, self.twi, reg, value, mask, t),
            Site::Adc(reg) => {
                self.tell_triggers(t);
                write!(self, unit::ADC, self.adc, reg, value, mask, t);
                self.listen(t);
            }
            Site::Comparator(reg) => {
                write!(self, unit::COMPARATOR, self.comparator, reg, value, mask, t);
                self.tell_trigger(unit::COMPARATOR, t);
            }
            Site::Eeprom(reg) => {
                write!(self, unit::EEPROM, self.eeprom, reg, value, mask, t);
                self.spm.block_until(self.eeprom.busy_until(), t);
                self.touch(unit::SPM);
            }
            Site::Spm(reg) => {
                write!(self, unit::SPM, self.spm, reg, value, mask, t);
                self.eeprom.block_until(self.spm.busy_until(), t);
                self.touch(unit::EEPROM);
            }
            Site::Watchdog(reg) => write!(self, unit::WATCHDOG, self.watchdog, reg, value, mask, t),
            Site::External(reg) => {
                write!(self, unit::EXTERNAL, self.external, reg, value, mask, t);
                self.tell_trigger(unit::EXTERNAL, t);
            }
            Site::Kept(n) => {
                let kept = &mut self.kept[usize::from(n) % 4];
                *kept = *kept & !mask | value & mask;
            }
            Site::Split(bits) => self.store_split(bits, mask, value, t),
            Site::Own(own) => self.store_own(own, mask, value, t),
        }
    }

    /// Bits that belong to several registers: each register is written once.
    fn store_split(&mut self, bits: &[(u8, Site, u8)], mask: u8, value: u8, t: u64) {
        let mut done = 0u8;
        for (i, &(_, site, _)) in bits.iter().enumerate() {
            if done >> (i % 8) & 1 == 1 {
                continue;
            }
            let (mut its_mask, mut its_value) = (0, 0);
            for (j, &(bit, other, its)) in bits.iter().enumerate().skip(i) {
                if other == site {
                    done |= 1 << (j % 8);
                    its_mask |= (mask >> bit & 1) << its;
                    its_value |= (value >> bit & 1) << its;
                }
            }
            if its_mask != 0 {
                self.store(site, its_mask, its_value, t);
            }
        }
    }

    fn store_own(&mut self, own: Own, mask: u8, value: u8, t: u64) {
        let kept = |old: u8, bits: u8| old & !(mask & bits) | value & mask & bits;
        match own {
            Own::MCUCR => self.store_mcucr(value, mask & self.part.mcucr, t),
            // Flags are cleared by a zero (11.9.1).
            Own::MCUSR => {
                self.mcusr &= kept(self.mcusr, 0xFF);
                self.watchdog.forced(self.mcusr & super::power::WDRF != 0, t, &mut self.out);
                self.touch(unit::WATCHDOG);
                self.carry_out(unit::WATCHDOG);
            }
            Own::SMCR => self.smcr = kept(self.smcr, 0x0F),
            Own::CLKPR => self.store_clkpr(value, t),
            Own::PRR => {
                self.prr = kept(self.prr, self.part.prr.iter().fold(0, |bits, row| bits | 1 << row.0));
                self.clocks(t);
            }
            Own::OSCCAL => self.osccal = kept(self.osccal, 0xFF),
            Own::GTCCR => self.store_gtccr(value, mask, t),
            Own::RAMPZ => self.rampz = kept(self.rampz, RAMPZ),
        }
    }

    /// MCUCR: PUD, the timed sequences of IVSEL (12.5.1) and of BODS (10.11.2).
    fn store_mcucr(&mut self, value: u8, mask: u8, t: u64) {
        let value = self.mcucr & !mask | value & mask;
        let mut new = self.mcucr & !PUD | value & PUD;
        if mask & IVCE != 0 && value & IVCE != 0 {
            self.power.open_ivce(t);
        } else if self.power.ivce_open(t.saturating_sub(1)) && mask & IVSEL != 0 {
            new = new & !IVSEL | value & IVSEL;
            self.power.close_ivce();
        }
        if value & (BODS | BODSE) == BODS | BODSE {
            self.power.open_bods(t);
        } else if value & (BODS | BODSE) == BODS {
            self.power.set_bods(t);
        }
        self.mcucr = new;
        if self.ports.pull_ups_off != (new & PUD != 0) {
            self.ports.pull_ups_off = new & PUD != 0;
            self.settle_all(t);
        }
    }

    /// Clears prescalers, or holds them while TSM is set (17.4.1).
    fn store_gtccr(&mut self, value: u8, mask: u8, t: u64) {
        let value = self.gtccr & !mask | value & mask;
        let hold = value & TSM != 0;
        for (group, bit) in [PSRSYNC, PSRASY].into_iter().enumerate() {
            let clear = value & bit != 0;
            if clear || self.prescalers[group].held() {
                self.prescalers[group].clear(t, hold && clear);
                self.tell_prescaler(group, t);
            }
        }
        self.gtccr = if hold { value & (TSM | PSRASY | PSRSYNC) } else { 0 };
    }

    /// The timers behind a prescaler, 0 that of timers with a pin T or 1 that of the asynchronous one, are told of it.
    pub(super) fn tell_prescaler(&mut self, group: usize, t: u64) {
        for n in 0..self.part.timers.len().min(4) {
            if usize::from(self.part.timers[n].asynchronous) == group {
                self.timers[n].prescaler(self.prescalers[group], t, &mut self.out);
                self.touch(unit::TIMER + n);
                self.carry_out(unit::TIMER + n);
            }
        }
    }

    /// How long a register keeps its value from `t` on, nothing being due at `t`.
    pub(super) fn steady(&self, site: Site, t: u64) -> u64 {
        if self.shut(site) {
            return NEVER;
        }
        match site {
            Site::Port(port, 0) if !self.ports.settled(usize::from(port), t) => t,
            Site::Timer(n, reg) => self.timers[usize::from(n) % 4].steady(reg, t),
            Site::Usart(n, reg) => self.usarts[usize::from(n) % 2].steady(reg, t),
            Site::Spi(reg) => self.spi.steady(reg, t),
            Site::Twi(reg) => self.twi.steady(reg, t),
            Site::Adc(reg) => self.adc.steady(reg, t),
            Site::Comparator(reg) => self.comparator.steady(reg, t),
            Site::Eeprom(reg) => self.eeprom.steady(reg, t),
            Site::Spm(reg) => self.spm.steady(reg, t),
            Site::Watchdog(reg) => self.watchdog.steady(reg, t),
            Site::External(reg) => self.external.steady(reg, t),
            Site::Own(Own::MCUCR | Own::CLKPR) | Site::Ursel(_) => t,
            Site::Split(bits) => bits.iter().map(|&(_, site, _)| self.steady(site, t)).min().unwrap_or(NEVER),
            _ => NEVER,
        }
    }
}
