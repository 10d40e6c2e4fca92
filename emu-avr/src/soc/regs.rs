//! The registers of the chip by address (section 36): reads, writes, and how long a value stays the same.

use emu_core::RegisterRead;
use emu_core::cpu::{BusEffect, NEVER};

use super::AvrSoc;
use crate::chips::{RegisterSlot, SocRegister, SplitBit, unit_index};
use crate::periph::usart::UsartRegister::{UBRRH, UCSRC};
use crate::periph::{Device, SignalReceiver, adc, timers, usart};

/// Bits of GTCCR.
const TSM: u8 = 1 << 7;
const PSRASY: u8 = 1 << 1;
const PSRSYNC: u8 = 1 << 0;

/// Bits of MCUCR.
const JTD: u8 = 1 << 7;
const BODS: u8 = 1 << 6;
const BODSE: u8 = 1 << 5;
const PUD: u8 = 1 << 4;
/// MCUCR: the interrupt vectors are in the boot section.
pub(super) const IVSEL: u8 = 1 << 1;
const IVCE: u8 = 1 << 0;

/// Mask of RAMPZ0, the only bit of RAMPZ.
pub(super) const RAMPZ: u8 = 1;

/// Mask of URSEL in UCSRC and UBRRH.
const URSEL: u8 = 1 << 7;

/// Reads a register of a unit and processes the unit's signals.
macro_rules! read {
    ($soc:ident, $number:expr, $unit:expr, $reg:expr, $t:ident) => {{
        let value = $unit.read($reg, $t, &mut $soc.out);
        $soc.apply_signals($number);
        value
    }};
}

/// Writes a register of a unit and processes the unit's signals.
macro_rules! write {
    ($soc:ident, $number:expr, $unit:expr, $reg:expr, $value:ident, $mask:ident, $t:ident) => {{
        $unit.write($reg, $value, $mask, $t, &mut $soc.out);
        $soc.schedule.touch($number);
        $soc.apply_signals($number);
    }};
}

/// What a program reads from a register.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReadValue {
    /// The value.
    pub(super) value: u8,
    /// Whether the read may have moved a deadline or an interrupt.
    pub(super) acts: bool,
}

impl AvrSoc {
    /// Returns the register slot at a data address.
    pub(super) fn register_slot(&self, reg: u16) -> RegisterSlot {
        self.part.register_slot(reg)
    }

    /// Returns the unit of a register, if it belongs to one.
    const fn unit_index_of(site: RegisterSlot) -> Option<usize> {
        Some(match site {
            RegisterSlot::Timer(n, _) => unit_index::TIMER + n as usize % 4,
            RegisterSlot::Usart(n, _) | RegisterSlot::Ursel(n) => unit_index::USART + n as usize % 2,
            RegisterSlot::Spi(_) => unit_index::SPI,
            RegisterSlot::Twi(_) => unit_index::TWI,
            RegisterSlot::Adc(_) => unit_index::ADC,
            RegisterSlot::Comparator(_) => unit_index::COMPARATOR,
            RegisterSlot::Eeprom(_) => unit_index::EEPROM,
            RegisterSlot::Spm(_) => unit_index::SPM,
            RegisterSlot::Watchdog(_) => unit_index::WATCHDOG,
            RegisterSlot::External(_) => unit_index::EXTERNAL,
            RegisterSlot::Reserved | RegisterSlot::Core | RegisterSlot::Low(_) | RegisterSlot::Port(..) => return None,
            RegisterSlot::Kept(_) | RegisterSlot::Split(_) | RegisterSlot::Own(_) => return None,
        })
    }

    /// Reports whether PRR has switched off the register's unit: then the register is not accessible (10.10).
    fn is_register_shut_off(&self, site: RegisterSlot) -> bool {
        self.prr != 0 && AvrSoc::unit_index_of(site).is_some_and(|number| self.is_shut_off(number))
    }

    /// Reads any register, after everything that is due.
    #[inline(never)]
    pub(super) fn read_any(&mut self, reg: u16, now: u64) -> RegisterRead {
        let due = self.schedule.due <= now;
        self.run(now);
        let ReadValue { value, acts } = match self.register_slot(reg) {
            RegisterSlot::Port(port, 0) => ReadValue { value: self.peek_pins(port, now), acts: false },
            RegisterSlot::Low(addr) => ReadValue { value: self.low_byte(addr), acts: false },
            site => self.read_register(site, now),
        };
        RegisterRead { value, effect: if due || acts { BusEffect::RECHECK } else { BusEffect::NONE } }
    }

    /// Reads a register as the program does in cycle `t`. The second value is true if the read may have moved
    /// a deadline or an interrupt.
    pub(super) fn read_register(&mut self, site: RegisterSlot, t: u64) -> ReadValue {
        if self.is_register_shut_off(site) {
            return ReadValue { value: 0, acts: false };
        }
        let read = match site {
            RegisterSlot::Timer(n, reg) => {
                let n = usize::from(n) % 4;
                return ReadValue { value: read!(self, unit_index::TIMER + n, self.timers[n], reg, t), acts: false };
            }
            RegisterSlot::Usart(n, reg) => {
                let n = usize::from(n) % 2;
                let value = read!(self, unit_index::USART + n, self.usarts[n], reg, t);
                ReadValue { value, acts: reg == usart::UsartRegister::UDR }
            }
            RegisterSlot::Spi(reg) => ReadValue { value: read!(self, unit_index::SPI, self.spi, reg, t), acts: true },
            RegisterSlot::Twi(reg) => ReadValue { value: read!(self, unit_index::TWI, self.twi, reg, t), acts: false },
            RegisterSlot::Adc(reg) => ReadValue {
                value: read!(self, unit_index::ADC, self.adc, reg, t),
                acts: matches!(reg, adc::AdcRegister::ADCL | adc::AdcRegister::ADCH),
            },
            RegisterSlot::Ursel(n) => {
                let value = self.peek_register(site, t);
                self.ursel_read[usize::from(n) % 2] = t;
                return ReadValue { value, acts: false };
            }
            RegisterSlot::Split(bits) => {
                let mut all = ReadValue { value: 0, acts: false };
                for &SplitBit { bit, slot: site, its_bit: its } in bits {
                    let ReadValue { value, acts } = self.read_register(site, t);
                    all.value |= (value >> its & 1) << bit;
                    all.acts |= acts;
                }
                all
            }
            _ => return ReadValue { value: self.peek_register(site, t), acts: false },
        };
        if let (true, Some(number)) = (read.acts, AvrSoc::unit_index_of(site)) {
            self.schedule.touch(number);
            self.update_deadlines();
        }
        read
    }

    /// Returns PINx.
    #[inline(always)]
    pub(super) fn peek_pins(&self, port: u8, t: u64) -> u8 {
        let port = usize::from(port);
        self.ports.input(port, t) & !self.analog_only(port)
    }

    /// Returns the value of a register in cycle `t`, without side effects.
    pub(super) fn peek_register(&self, site: RegisterSlot, t: u64) -> u8 {
        if self.is_register_shut_off(site) {
            return 0;
        }
        match site {
            RegisterSlot::Reserved | RegisterSlot::Core => 0,
            RegisterSlot::Low(addr) => self.low_byte(addr),
            RegisterSlot::Port(port, kind) => {
                let port = usize::from(port);
                match kind {
                    0 => self.peek_pins(port as u8, t),
                    1 => self.ports.ddr(port),
                    _ => self.ports.port(port),
                }
            }
            RegisterSlot::Timer(n, reg) => self.timers[usize::from(n) % 4].peek(reg, t),
            RegisterSlot::Usart(n, reg) => self.usarts[usize::from(n) % 2].peek(reg, t),
            // The first read gives UBRRH; a read in the next cycle gives UCSRC.
            RegisterSlot::Ursel(n) => {
                let n = usize::from(n) % 2;
                if self.ursel_read[n].checked_add(1) == Some(t) {
                    URSEL | self.usarts[n].peek(UCSRC, t)
                } else {
                    self.usarts[n].peek(UBRRH, t)
                }
            }
            RegisterSlot::Spi(reg) => self.spi.peek(reg, t),
            RegisterSlot::Twi(reg) => self.twi.peek(reg, t),
            RegisterSlot::Adc(reg) => self.adc.peek(reg, t),
            RegisterSlot::Comparator(reg) => self.comparator.peek(reg, t),
            RegisterSlot::Eeprom(reg) => self.eeprom.peek(reg, t),
            RegisterSlot::Spm(reg) => self.spm.peek(reg, t),
            RegisterSlot::Watchdog(reg) => self.watchdog.peek(reg, t),
            RegisterSlot::External(reg) => self.external.peek(reg, t),
            RegisterSlot::Kept(n) => self.kept_bytes[usize::from(n) % 4],
            RegisterSlot::Split(bits) => bits.iter().fold(0, |all, &SplitBit { bit, slot: site, its_bit: its }| {
                all | (self.peek_register(site, t) >> its & 1) << bit
            }),
            RegisterSlot::Own(own) => match own {
                SocRegister::MCUCR => self.mcucr | if self.power.ivce_open(t) { IVCE } else { 0 },
                SocRegister::MCUSR => self.mcusr,
                SocRegister::SMCR => self.smcr,
                SocRegister::CLKPR => self.power.clkpr(t),
                SocRegister::PRR => self.prr.to_le_bytes()[0],
                SocRegister::PRR1 => self.prr.to_le_bytes()[1],
                SocRegister::OSCCAL => self.osccal,
                SocRegister::GTCCR => self.gtccr,
                SocRegister::RAMPZ => self.rampz,
            },
        }
    }

    /// Writes the bits in `mask` at the edge `t`, which ends the cycle of the write.
    pub(super) fn write_register(&mut self, site: RegisterSlot, mask: u8, value: u8, t: u64) {
        if self.is_register_shut_off(site) {
            return;
        }
        match site {
            RegisterSlot::Reserved | RegisterSlot::Core => {}
            RegisterSlot::Low(addr) => self.set_low_byte(addr, self.low_byte(addr) & !mask | value & mask),
            RegisterSlot::Port(port, kind) => self.write_port(usize::from(port), kind, mask, value, t),
            RegisterSlot::Timer(n, reg) => {
                let n = usize::from(n) % 4;
                write!(self, unit_index::TIMER + n, self.timers[n], reg, value, mask, t);
                match reg {
                    timers::TimerRegister::TIFR => self.notify_trigger(unit_index::TIMER + n, t),
                    // PRTIM2 stops only the synchronous timer.
                    timers::TimerRegister::ASSR if self.prr != 0 => self.update_clocks(t),
                    _ => {}
                }
            }
            RegisterSlot::Usart(n, reg) => {
                let n = usize::from(n) % 2;
                write!(self, unit_index::USART + n, self.usarts[n], reg, value, mask, t);
            }
            RegisterSlot::Ursel(n) => {
                let (reg, bits) = if value & URSEL != 0 { (UCSRC, !URSEL) } else { (UBRRH, 0xFF) };
                self.write_register(RegisterSlot::Usart(n, reg), mask & bits, value & bits, t);
            }
            RegisterSlot::Spi(reg) => write!(self, unit_index::SPI, self.spi, reg, value, mask, t),
            RegisterSlot::Twi(reg) => write!(self, unit_index::TWI, self.twi, reg, value, mask, t),
            RegisterSlot::Adc(reg) => {
                self.notify_triggers(t);
                write!(self, unit_index::ADC, self.adc, reg, value, mask, t);
                self.update_trigger_listeners(t);
            }
            RegisterSlot::Comparator(reg) => {
                write!(self, unit_index::COMPARATOR, self.comparator, reg, value, mask, t);
                self.notify_trigger(unit_index::COMPARATOR, t);
            }
            RegisterSlot::Eeprom(reg) => {
                write!(self, unit_index::EEPROM, self.eeprom, reg, value, mask, t);
                self.spm.block_until(self.eeprom.busy_until(), t);
                self.schedule.touch(unit_index::SPM);
            }
            RegisterSlot::Spm(reg) => {
                write!(self, unit_index::SPM, self.spm, reg, value, mask, t);
                self.eeprom.block_until(self.spm.busy_until(), t);
                self.schedule.touch(unit_index::EEPROM);
            }
            RegisterSlot::Watchdog(reg) => write!(self, unit_index::WATCHDOG, self.watchdog, reg, value, mask, t),
            RegisterSlot::External(reg) => {
                write!(self, unit_index::EXTERNAL, self.external, reg, value, mask, t);
                self.notify_trigger(unit_index::EXTERNAL, t);
            }
            RegisterSlot::Kept(n) => {
                let kept = &mut self.kept_bytes[usize::from(n) % 4];
                *kept = *kept & !mask | value & mask;
            }
            RegisterSlot::Split(bits) => self.write_split(bits, mask, value, t),
            RegisterSlot::Own(own) => self.write_soc_register(own, mask, value, t),
        }
    }

    /// Writes bits that belong to several registers; each register is written once.
    fn write_split(&mut self, bits: &[SplitBit], mask: u8, value: u8, t: u64) {
        let mut done = 0u8;
        for (i, &SplitBit { slot: site, .. }) in bits.iter().enumerate() {
            if done >> (i % 8) & 1 == 1 {
                continue;
            }
            let (mut its_mask, mut its_value) = (0, 0);
            for (j, &SplitBit { bit, slot: other, its_bit: its }) in bits.iter().enumerate().skip(i) {
                if other == site {
                    done |= 1 << (j % 8);
                    its_mask |= (mask >> bit & 1) << its;
                    its_value |= (value >> bit & 1) << its;
                }
            }
            if its_mask != 0 {
                self.write_register(site, its_mask, its_value, t);
            }
        }
    }

    fn write_soc_register(&mut self, own: SocRegister, mask: u8, value: u8, t: u64) {
        let kept = |old: u8, bits: u8| old & !(mask & bits) | value & mask & bits;
        match own {
            SocRegister::MCUCR => self.write_mcucr(value, mask & self.part.mcucr, t),
            // Writing a zero clears a flag (11.9.1).
            SocRegister::MCUSR => {
                self.mcusr &= kept(self.mcusr, 0xFF);
                self.watchdog.set_forced_on(self.mcusr & super::power::WDRF != 0, t, &mut self.out);
                self.schedule.touch(unit_index::WATCHDOG);
                self.apply_signals(unit_index::WATCHDOG);
            }
            SocRegister::SMCR => self.smcr = kept(self.smcr, 0x0F),
            SocRegister::CLKPR => self.write_clkpr(value, t),
            SocRegister::PRR | SocRegister::PRR1 => {
                let there: u16 = self.part.power_reduction_bits.iter().fold(0, |bits, row| bits | 1 << row.0);
                let ([low, high], [low_bits, high_bits]) = (self.prr.to_le_bytes(), there.to_le_bytes());
                self.prr = u16::from_le_bytes(match own {
                    SocRegister::PRR => [kept(low, low_bits), high],
                    _ => [low, kept(high, high_bits)],
                });
                self.update_clocks(t);
            }
            SocRegister::OSCCAL => self.osccal = kept(self.osccal, 0xFF),
            SocRegister::GTCCR => self.write_gtccr(value, mask, t),
            SocRegister::RAMPZ => self.rampz = kept(self.rampz, RAMPZ),
        }
    }

    /// Writes MCUCR: PUD, JTD, which is only stored, and the timed sequences of IVSEL (12.5.1) and of BODS
    /// (10.11.2).
    fn write_mcucr(&mut self, value: u8, mask: u8, t: u64) {
        let value = self.mcucr & !mask | value & mask;
        let mut new = self.mcucr & !(JTD | PUD) | value & (JTD | PUD);
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
            self.update_all_pins(t);
        }
    }

    /// Clears the prescalers, or holds them while TSM is set (17.4.1).
    fn write_gtccr(&mut self, value: u8, mask: u8, t: u64) {
        let value = self.gtccr & !mask | value & mask;
        let hold = value & TSM != 0;
        for (group, bit) in [PSRSYNC, PSRASY].into_iter().enumerate() {
            let clear = value & bit != 0;
            if clear || self.prescalers[group].is_held() {
                self.prescalers[group].restart(t, hold && clear);
                self.notify_prescaler(group, t);
            }
        }
        self.gtccr = if hold { value & (TSM | PSRASY | PSRSYNC) } else { 0 };
    }

    /// Passes a changed prescaler to its timers: group 0 has the timers with a pin T, group 1 the
    /// asynchronous timer.
    pub(super) fn notify_prescaler(&mut self, group: usize, t: u64) {
        for n in 0..self.part.timers.len().min(4) {
            if usize::from(self.part.timers[n].asynchronous) == group {
                self.timers[n].prescaler(self.prescalers[group], t, &mut self.out);
                self.schedule.touch(unit_index::TIMER + n);
                self.apply_signals(unit_index::TIMER + n);
            }
        }
    }

    /// Returns the cycle up to which a register keeps its value from `t` on; nothing may be due at `t`.
    pub(super) fn register_steady_until(&self, site: RegisterSlot, t: u64) -> u64 {
        if self.is_register_shut_off(site) {
            return NEVER;
        }
        match site {
            RegisterSlot::Port(port, 0) if !self.ports.is_stable(usize::from(port), t) => t,
            RegisterSlot::Timer(n, reg) => self.timers[usize::from(n) % 4].steady_until(reg, t),
            RegisterSlot::Usart(n, reg) => self.usarts[usize::from(n) % 2].steady_until(reg, t),
            RegisterSlot::Spi(reg) => self.spi.steady_until(reg, t),
            RegisterSlot::Twi(reg) => self.twi.steady_until(reg, t),
            RegisterSlot::Adc(reg) => self.adc.steady_until(reg, t),
            RegisterSlot::Comparator(reg) => self.comparator.steady_until(reg, t),
            RegisterSlot::Eeprom(reg) => self.eeprom.steady_until(reg, t),
            RegisterSlot::Spm(reg) => self.spm.steady_until(reg, t),
            RegisterSlot::Watchdog(reg) => self.watchdog.steady_until(reg, t),
            RegisterSlot::External(reg) => self.external.steady_until(reg, t),
            RegisterSlot::Own(SocRegister::MCUCR | SocRegister::CLKPR) | RegisterSlot::Ursel(_) => t,
            RegisterSlot::Split(bits) => bits
                .iter()
                .map(|&SplitBit { slot: site, .. }| self.register_steady_until(site, t))
                .min()
                .unwrap_or(NEVER),
            RegisterSlot::Reserved | RegisterSlot::Core | RegisterSlot::Low(_) | RegisterSlot::Port(..) => NEVER,
            RegisterSlot::Kept(_) | RegisterSlot::Own(_) => NEVER,
        }
    }
}
