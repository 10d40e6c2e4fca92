//! Queries of the diagnostics to the chip. None of them changes anything.

use super::AvrSoc;
use crate::chips::{AvrPart, unit_index};
use crate::periph::{Device, adc, comparator, eeprom, external, spi, spm, timers, twi, usart, watchdog};

use emu_core::pins::{PinId, PinLevel};

/// The speed of a serial port.
pub(crate) struct BaudClock {
    /// The clock in Hz.
    pub hz: u64,
    /// Its clocks to a bit.
    pub clocks_per_bit: u64,
}

impl AvrSoc {
    /// Returns the chip's row.
    pub(crate) const fn part(&self) -> &'static AvrPart {
        self.part
    }

    /// Returns a byte of the RAM below 100h.
    pub(crate) fn low_at(&self, addr: u16) -> u8 {
        u8::try_from(addr).map_or(0, |addr| self.low_byte(addr))
    }

    /// Returns the pins of a port that float and whose level an instruction would read.
    pub(crate) fn floating(&self, port: usize) -> u8 {
        let exist = self.part.ports.get(port).copied().unwrap_or(0) & !self.analog_only(port);
        let floats = |bit: &PinId| self.ports.pin(port as PinId * 8 + bit).level() == PinLevel::Float;
        (0..8).filter(|bit| exist >> bit & 1 == 1).filter(floats).fold(0, |bits, bit| bits | 1 << bit)
    }

    /// Reports whether ICR is TOP in the mode of the timer `n`.
    pub(crate) fn icr_is_top(&self, n: u8) -> bool {
        self.timers[usize::from(n) % 4].icr_is_top()
    }

    /// Returns the channel that ADMUX selects, if it has a pin that is missing in the package.
    pub(crate) fn absent_channel(&self, admux: u8) -> Option<u8> {
        let channel = admux & self.part.adc_kind.mux;
        let pin = self.part.analog_pins.get(usize::from(channel))?;
        (!self.has_pin(*pin)).then_some(channel)
    }

    /// Returns the INT input whose edge wakes the chip although the data sheet says that only a level does.
    pub(crate) fn edge_that_wakes(&self) -> Option<u8> {
        let source =
            self.first_vector.and_then(|vector| self.part.interrupt_sources.get(usize::from(vector).checked_sub(1)?));
        let &(_, int) = source.filter(|source| source.0 == unit_index::EXTERNAL)?;
        (self.power.stopped_units >> unit_index::EXTERNAL & 1 == 1 && self.external.wakes_by_edge(int)).then_some(int)
    }

    /// Reports whether the receiver of the serial port `n` is on.
    pub(crate) fn listens_at(&self, n: usize, t: u64) -> bool {
        self.usarts[n % 2].peek(usart::UsartRegister::UCSRB, t) & usart::RXEN != 0
    }

    /// Reports whether the transmitter of the serial port `n` is on.
    pub(crate) fn sends_at(&self, n: usize, t: u64) -> bool {
        self.usarts[n % 2].peek(usart::UsartRegister::UCSRB, t) & usart::TXEN != 0
    }

    /// The speed of an asynchronous serial port (20.3.1).
    pub(crate) fn baud(&self, n: usize, t: u64) -> Option<BaudClock> {
        let usart = &self.usarts[n % 2];
        let [a, c, low, high] = [
            usart::UsartRegister::UCSRA,
            usart::UsartRegister::UCSRC,
            usart::UsartRegister::UBRRL,
            usart::UsartRegister::UBRRH,
        ]
        .map(|reg| usart.peek(reg, t));
        // On chips without master SPI mode UMSEL has one bit; 0 means asynchronous there too.
        let asynchronous = c >> 6 == 0;
        let per_bit = if a & usart::U2X != 0 { 8 } else { 16 };
        let clocks_per_bit = per_bit * (u64::from(u16::from_be_bytes([high, low])) + 1);
        asynchronous.then(|| BaudClock { hz: self.power.hz(), clocks_per_bit })
    }

    /// Returns the interrupts that are enabled, as a mask of their vectors.
    pub(crate) fn enabled(&self, t: u64) -> u64 {
        let units: [u8; unit_index::COUNT] = std::array::from_fn(|number| self.enables(number, t));
        let vectors = self.part.interrupt_sources.iter().zip(1u32..64);
        vectors.fold(0, |all, (&(number, irq), vector)| {
            all | u64::from(units.get(number).copied().unwrap_or(0) >> irq & 1) << vector
        })
    }

    /// Returns the interrupts of a unit that are enabled.
    fn enables(&self, number: usize, t: u64) -> u8 {
        let bit = |value: u8, bit: u8| value >> bit & 1;
        match number {
            n @ unit_index::TIMER..unit_index::USART => {
                let shape = self.part.timers.get(n - unit_index::TIMER);
                shape.map_or(0, |shape| {
                    shape.irqs_of(self.timers[n - unit_index::TIMER].peek(timers::TimerRegister::TIMSK, t))
                })
            }
            n @ unit_index::USART..unit_index::SPI => {
                let b = self.usarts[n - unit_index::USART].peek(usart::UsartRegister::UCSRB, t);
                bit(b, 7) | bit(b, 5) << 1 | bit(b, 6) << 2
            }
            unit_index::SPI => bit(self.spi.peek(spi::SpiRegister::SPCR, t), 7),
            unit_index::TWI => bit(self.twi.peek(twi::TwiRegister::TWCR, t), 0),
            unit_index::ADC => bit(self.adc.peek(adc::AdcRegister::ADCSRA, t), 3),
            unit_index::COMPARATOR => bit(self.comparator.peek(comparator::ComparatorRegister::ACSR, t), 3),
            unit_index::EEPROM => bit(self.eeprom.peek(eeprom::EepromRegister::EECR, t), 3),
            unit_index::SPM => bit(self.spm.peek(spm::SpmRegister::SPMCSR, t), 7),
            unit_index::WATCHDOG => bit(self.watchdog.peek(watchdog::WatchdogRegister::WDTCSR, t), 6),
            _ => {
                let ints = self.part.external_kind.int_mask();
                let pins = self.external.peek(external::ExternalRegister::PCICR, t);
                self.external.peek(external::ExternalRegister::EIMSK, t) & ints
                    | pins.checked_shl(ints.count_ones()).unwrap_or(0)
            }
        }
    }
}
