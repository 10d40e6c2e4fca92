//! The registers of the chip: the unit that holds each, reads, writes, and how long a value stays the same.

use emu_core::cpu::NEVER;

use super::{Pic16Soc, unit_index};
use crate::chips::InternalOscillator;
use crate::periph::map::Sfr;
use crate::periph::{Device, SignalReceiver};

/// Bits of PCON that a program can write: OSCF if the chip has it, POR and BOR.
const PCON: u8 = 0x0B;

/// Mask of TUN5 to TUN0 in OSCTUNE (DS30487, register 4-1).
const OSCTUNE: u8 = 0x3F;

/// Bits of OSCCON that a program can write: IRCF2 to IRCF0, and on chips that can switch their clock SCS1 and
/// SCS0 (DS39598, register 4-2; DS30487, register 4-2).
const IRCF: u8 = 0x70;
const SCS: u8 = 3;
/// Mask of IOFS: the internal oscillator is stable.
const IOFS: u8 = 1 << 2;
/// Mask of OSTS: the chip runs from its primary clock; only on chips with SCS.
const OSTS: u8 = 1 << 3;

/// Returns the unit that holds a register; None for those of ports, interrupts, power and oscillators. It is
/// inlined, so that its match and that of [`with_unit`] become one.
#[inline(always)]
#[rustfmt::skip]
const fn unit_of(reg: Sfr) -> Option<usize> {
    Some(match reg {
        Sfr::TMR0 | Sfr::OPTION | Sfr::WDTCON => unit_index::TIMER0,
        Sfr::TMR1L | Sfr::TMR1H | Sfr::T1CON | Sfr::TMR2 | Sfr::T2CON | Sfr::PR2
        | Sfr::CCPR1L | Sfr::CCPR1H | Sfr::CCP1CON | Sfr::CCPR2L | Sfr::CCPR2H | Sfr::CCP2CON => unit_index::TIMERS,
        Sfr::SSPBUF | Sfr::SSPCON | Sfr::SSPCON2 | Sfr::SSPADD | Sfr::SSPSTAT => unit_index::SSP,
        Sfr::RCSTA | Sfr::TXSTA | Sfr::TXREG | Sfr::RCREG | Sfr::SPBRG => unit_index::USART,
        Sfr::ADRESH | Sfr::ADRESL | Sfr::ADCON0 | Sfr::ADCON1 | Sfr::ANSEL => unit_index::ADC,
        Sfr::CMCON | Sfr::CVRCON => unit_index::COMPARATORS,
        Sfr::EEDATA | Sfr::EEADR | Sfr::EEDATH | Sfr::EEADRH | Sfr::EECON1 | Sfr::EECON2 => unit_index::EEPROM,
        Sfr::INDF | Sfr::PCL | Sfr::STATUS | Sfr::FSR | Sfr::PCLATH | Sfr::INTCON
        | Sfr::PORTA | Sfr::PORTB | Sfr::PORTC | Sfr::PORTD | Sfr::PORTE
        | Sfr::TRISA | Sfr::TRISB | Sfr::TRISC | Sfr::TRISD | Sfr::TRISE
        | Sfr::PIR1 | Sfr::PIR2 | Sfr::PIE1 | Sfr::PIE2 | Sfr::PCON | Sfr::OSCCON | Sfr::OSCTUNE => return None,
    })
}

const _: () = assert!(
    unit_index::COUNT == unit_index::PSP + 1,
    "a new unit needs a line in for_each_unit! and, if it has registers, an arm in with_unit!"
);

/// Evaluates `$what` with `$part` as the unit with this number, borrowed like `soc` (`[&self]`, `[&mut
/// self]`); `$none` if there is no number.
macro_rules! with_unit {
    ($number:expr, [$($soc:tt)+], $part:ident => $what:expr, $none:expr) => {
        match $number {
            Some(unit_index::TIMER0) => { let $part = $($soc)+.timer0; $what }
            Some(unit_index::TIMERS) => { let $part = $($soc)+.timers; $what }
            Some(unit_index::SSP) => { let $part = $($soc)+.ssp; $what }
            Some(unit_index::USART) => { let $part = $($soc)+.usart; $what }
            Some(unit_index::ADC) => { let $part = $($soc)+.adc; $what }
            Some(unit_index::COMPARATORS) => { let $part = $($soc)+.comparators; $what }
            Some(unit_index::EEPROM) => { let $part = $($soc)+.eeprom; $what }
            _ => $none,
        }
    };
}

impl Pic16Soc {
    /// Returns the value of a register at the clock `t`, without side effects; everything due has been
    /// executed.
    pub(super) fn peek_register(&self, reg: Sfr, t: u64) -> u8 {
        with_unit!(unit_of(reg), [&self], part => part.peek(reg, t), self.peek_own(reg, t))
    }

    fn peek_own(&self, reg: Sfr, t: u64) -> u8 {
        match reg {
            Sfr::INTCON => self.irq.enables.intcon,
            Sfr::PIR1 => self.irq.pir[0] | self.levels(reg, 0xFF, t),
            Sfr::PIR2 => self.irq.pir[1],
            Sfr::PIE1 => self.irq.enables.pie[0],
            Sfr::PIE2 => self.irq.enables.pie[1],
            Sfr::PCON => self.pcon,
            Sfr::OSCCON => self.show_osccon(),
            Sfr::OSCTUNE => self.osc[1],
            _ => self.peek_port(reg, t),
        }
    }

    /// Returns the mask of SCS1 and SCS0 on chips that can switch their clock, which are those with WDTCON.
    fn scs(&self) -> u8 {
        if self.part.has(Sfr::WDTCON) { SCS } else { 0 }
    }

    /// Returns OSCCON. In the model, oscillators are stable at once: IOFS is always set, and OSTS follows the
    /// selection without delay.
    fn show_osccon(&self) -> u8 {
        let kept = self.osc[0];
        let primary = self.scs() != 0 && kept & SCS == 0;
        kept | IOFS | if primary { OSTS } else { 0 }
    }

    fn peek_port(&self, reg: Sfr, t: u64) -> u8 {
        if let Some(port) = self.ports.port(|row| row.port == reg) {
            return match reg {
                Sfr::PORTD if self.psp.is_enabled() => self.psp.peek_port(),
                _ => self.ports.input(port),
            };
        }
        if let Some(port) = self.ports.port(|row| row.tris == reg) {
            return self.ports.tris(port) | if reg == Sfr::TRISE && self.part.psp { self.psp.peek(reg, t) } else { 0 };
        }
        0
    }

    /// Returns the flags of PIR1 under `mask` that are levels of the USART.
    pub(super) fn levels(&self, reg: Sfr, mask: u8, t: u64) -> u8 {
        let [rcif, txif] = self.irq.levels.map(|bit| if reg == Sfr::PIR1 { bit & mask } else { 0 });
        let on = |bit: u8, level: &dyn Fn() -> bool| if bit != 0 && level() { bit } else { 0 };
        on(rcif, &|| self.usart.rcif()) | on(txif, &|| self.usart.txif(t))
    }

    /// Marks the unit of a register as touched, before a read or write, and returns it.
    #[inline(always)]
    fn touch(&mut self, reg: Sfr) -> Option<usize> {
        let part = unit_of(reg);
        self.schedule.touched |= part.map_or(0, |number| 1 << number);
        part
    }

    /// Reads a register as a program does, at the clock `t`.
    pub(super) fn read_register(&mut self, reg: Sfr, t: u64) -> u8 {
        let part = self.touch(reg);
        let value = with_unit!(part, [&mut self], part => part.read(reg, t, &mut self.out), {
            let value = self.peek_own(reg, t);
            match reg {
                Sfr::PORTD if self.psp.is_enabled() => self.psp.read_port(t),
                _ => return value,
            }
        });
        self.apply_signals(());
        if matches!(reg, Sfr::RCREG | Sfr::CMCON | Sfr::SSPBUF | Sfr::PORTD) {
            self.update_request(t / 4 + 1);
            self.update_deadlines();
        }
        value
    }

    /// Writes a register at the clock `t`, the end of an instruction cycle.
    #[inline]
    pub(super) fn write_register(&mut self, reg: Sfr, value: u8, t: u64) {
        if let Some(port) = super::port_latch_index(reg) {
            return self.write_latch(port, reg, value, t);
        }
        let part = self.touch(reg);
        with_unit!(part, [&mut self], part => part.write(reg, value, 0xFF, t, &mut self.out), self.write_own(reg, value, t));
        self.apply_signals(());
        self.on_register_written(reg, value, t);
        // Ports cause interrupts only by their pins.
        if !(Sfr::TRISA..=Sfr::TRISE).contains(&reg) {
            self.update_request(t / 4);
        }
        self.update_deadlines();
    }

    /// Writes the latch of a port, the most frequent kind of write.
    fn write_latch(&mut self, port: usize, reg: Sfr, value: u8, t: u64) {
        self.write_port(port, reg, value, t);
        match self.schedule.touched {
            // No unit is affected; only samples of pins can be due.
            0 => self.schedule.due = self.schedule.due.min(self.irq.next_sample_clock()),
            _ => self.update_deadlines(),
        }
    }

    fn write_own(&mut self, reg: Sfr, value: u8, t: u64) {
        match reg {
            Sfr::INTCON => self.write_intcon(value, t),
            Sfr::PIR1 => self.irq.pir[0] = value & self.writable(reg),
            Sfr::PIR2 => self.irq.pir[1] = value & self.writable(reg),
            Sfr::PIE1 | Sfr::PIE2 => {
                self.irq.remember(t / 4);
                self.irq.enables.pie[usize::from(reg == Sfr::PIE2)] = value & self.writable(reg);
            }
            Sfr::PCON => {
                let oscf = matches!(self.part.internal, InternalOscillator::F62x(_));
                self.pcon = value & if oscf { PCON } else { PCON & 3 };
            }
            Sfr::OSCCON => self.osc[0] = value & (IRCF | self.scs()),
            Sfr::OSCTUNE => self.osc[1] = value & OSCTUNE,
            _ => {
                if let Some(port) = self.ports.port(|row| row.tris == reg) {
                    self.write_tris(port, reg, value, t);
                }
            }
        }
    }

    /// Returns the existing bits of PIR1, PIR2, PIE1 or PIE2; flags that are levels of the USART cannot be
    /// written.
    fn writable(&self, reg: Sfr) -> u8 {
        use crate::periph::map::InterruptFlag;
        self.part.flags.iter().fold(0, |byte, row| {
            let flag = row.at.sfr == reg && !matches!(row.flag, InterruptFlag::RCIF | InterruptFlag::TXIF);
            byte | u8::from(flag) << row.at.bit | u8::from(row.enable.sfr == reg) << row.enable.bit
        })
    }

    /// Returns the bits of a register, given by its number, that are pins used as analog inputs.
    #[must_use]
    pub fn analog_bits(&self, reg: u16) -> u8 {
        let port = Sfr::ALL.get(usize::from(reg)).and_then(|&sfr| self.ports.port(|row| row.port == sfr));
        port.map_or(0, |port| self.ports.analog_bits(port))
    }

    /// Returns the latch of the port whose register has this number.
    #[must_use]
    pub fn latch(&self, reg: u16) -> Option<u8> {
        let port = Sfr::ALL.get(usize::from(reg)).and_then(|&sfr| self.ports.port(|row| row.port == sfr))?;
        Some(self.ports.latch(port) & self.ports.mask(port))
    }

    /// Returns the analog input on which a write of a register, given by its number, in the machine cycle
    /// `now` would start a conversion before the acquisition time has passed.
    #[must_use]
    pub fn converts_early(&self, reg: u16, value: u8, now: u64) -> Option<u8> {
        let converter = Sfr::ALL.get(usize::from(reg)) == Some(&Sfr::ADCON0);
        converter.then(|| self.adc.acquisition_error_channel(value, 4 * now + 4)).flatten()
    }

    /// Returns the clock up to which a register keeps its value from `t` on; nothing may be due at `t`.
    pub(super) fn register_steady_until(&self, reg: Sfr, t: u64) -> u64 {
        with_unit!(unit_of(reg), [&self], part => part.steady_until(reg, t), match reg {
            Sfr::PORTD if self.psp.is_enabled() => t,
            // A read of PORTB ends a mismatch.
            Sfr::PORTB if self.irq.sampled[1] != NEVER => t,
            Sfr::PIR1 | Sfr::PIR2 => self.usart.steady_until(reg, t),
            _ => NEVER,
        })
    }
}
