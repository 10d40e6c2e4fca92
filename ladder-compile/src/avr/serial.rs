//! Set-up of the serial line and choice of its baud rate.

use super::arch::AvrCodeWriter;
use super::buses::wait_set;
use super::registers::{self, AvrRegisters, SCRATCH};
use super::runtime::wait_clocks;
use crate::map::Ratio;
use crate::target::{BuildRefusal, CompileJob};

/// Settings of the serial line; the format keeps its reset value of eight bits, no parity, one stop bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AvrUartSetup {
    /// Value of UBRR.
    pub rate: u16,
    /// U2X: eight clocks per step instead of sixteen.
    pub double: bool,
    /// Clocks per bit.
    pub bit: u64,
}

/// Maximum error of the baud rate in percent; a larger error is refused.
const MAX_BAUD_ERROR_PERCENT: u64 = 2;

/// Chooses the setting nearest to the requested baud rate, with sixteen samples per bit if both are equally
/// near.
///
/// # Errors
/// The nearest rate is more than 2 % off.
pub fn plan_uart(job: &CompileJob<'_>) -> Result<Option<AvrUartSetup>, BuildRefusal> {
    if !job.ir.uart.send && !job.ir.uart.receive {
        return Ok(None);
    }
    let (clock, baud) = (job.clock_hz, job.baud.unwrap_or(0).max(1));
    let settings = [false, true].map(|double| {
        let step = if double { 8 } else { 16 };
        let steps = ((2 * clock / (step * baud)).div_ceil(2)).clamp(1, 4096);
        AvrUartSetup { rate: (steps - 1) as u16, double, bit: step * steps }
    });
    // |clock / bit - baud|, with the common denominator.
    let off = |serial: &AvrUartSetup| clock.abs_diff(baud.saturating_mul(serial.bit));
    let near = |serial: &AvrUartSetup| u128::from(off(serial)) * 1_000_000_000 / u128::from(serial.bit);
    let [slow, fast] = settings;
    let best = if near(&fast) < near(&slow) { fast } else { slow };
    if u128::from(off(&best)) * 100 > u128::from(MAX_BAUD_ERROR_PERCENT) * u128::from(baud) * u128::from(best.bit) {
        return Err(BuildRefusal::BaudOutOfRange { nearest: (2 * clock / best.bit).div_ceil(2) });
    }
    Ok(Some(best))
}

/// Data register of the serial line that [`AvrRegisters::serial`] selects: second, first, only one.
pub const DATA: &[&str] = &["UDR1", "UDR0", "UDR"];
/// Status register.
pub const STATUS: &[&str] = &["UCSR1A", "UCSR0A", "UCSRA"];
/// Status bit: a byte has been received.
pub const RECEIVED: &[&str] = &["RXC1", "RXC0", "RXC"];
/// Status bit: the last byte has gone.
const SENT: &[&str] = &["TXC1", "TXC0", "TXC"];
/// Bit times that a byte may take to go, with those of a byte before it.
const SENT_BITS: u64 = 12;
const CONTROL: &[&str] = &["UCSR1B", "UCSR0B", "UCSRB"];
const RATE_HIGH: &[&str] = &["UBRR1H", "UBRR0H", "UBRRH"];
const RATE_LOW: &[&str] = &["UBRR1L", "UBRR0L", "UBRRL"];
const TRANSMIT: &[&str] = &["TXEN1", "TXEN0", "TXEN"];
const RECEIVE: &[&str] = &["RXEN1", "RXEN0", "RXEN"];
const DOUBLE: &[&str] = &["U2X1", "U2X0", "U2X"];

impl AvrUartSetup {
    /// Emits the start of the serial line; its registers have their reset values.
    pub fn start(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters, job: &CompileJob<'_>) {
        let [low, high] = self.rate.to_le_bytes();
        if high != 0 {
            registers::write_constant(asm, regs.serial(RATE_HIGH), high.into(), 24);
        }
        registers::write_constant(asm, regs.serial(RATE_LOW), low.into(), 24);
        if self.double {
            registers::write_constant(asm, regs.serial(STATUS), regs.mask(&[DOUBLE]), 24);
        }
        let parts = [(job.ir.uart.send, TRANSMIT), (job.ir.uart.receive, RECEIVE)];
        let parts: Vec<&[&str]> = parts.into_iter().filter(|part| part.0).map(|part| part.1).collect();
        registers::write_constant(asm, regs.serial(CONTROL), regs.mask(&parts), 24);
    }

    /// Emits the end of the flag of a byte that has gone; the other flags are not written.
    pub fn clear_sent(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters) {
        let double = if self.double { regs.mask(&[DOUBLE]) } else { 0 };
        registers::write_constant(asm, regs.serial(STATUS), regs.mask(&[SENT]) | double, SCRATCH);
    }

    /// Emits the wait for the end of a byte.
    pub fn wait_sent(&self, asm: &mut AvrCodeWriter, regs: &AvrRegisters) {
        let status = regs.serial(STATUS);
        let turns = (SENT_BITS * self.bit).div_ceil(wait_clocks(status).into());
        wait_set(asm, status, regs.bit(SENT), turns as u32);
    }

    /// Clocks per bit, as a fraction.
    #[must_use]
    pub fn bit(&self) -> Ratio {
        Ratio { num: self.bit, den: 1 }
    }
}
