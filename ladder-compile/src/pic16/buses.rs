//! The I2C and SPI buses of the MSSP: settings, set-up and subroutines.
//!
//! ```text
//! scratch 0    the byte that goes, and the one that comes
//! scratch 1    register of an I2C device
//! scratch 2    its address, shifted left by one
//! ```

use emu_pic16::isa::Pic16OpKind;
use emu_pic16::periph::map::Sfr;

use super::select::{Pic16Routine, Pic16Selector};
use super::writer::{Pic16Label, Pic16Writer};
use crate::ir::{BusAction, WordId, WordOperand};
use crate::map::{Ratio, SpecialPin};
use crate::target::{BuildRefusal, CodeMark, CompileJob};

/// Bytes of scratch that a transfer needs.
pub const SCRATCH_BYTES: u16 = 3;

/// Settings of the MSSP, which is one bus at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pic16BusSetup {
    /// I2C, with the value of SSPADD.
    I2c(u8),
    /// SPI, with bits SSPM1 and SSPM0, and the port and number of the pin that selects the device.
    Spi(u8, (char, u8)),
}

/// SSPM3: master of an I2C bus.
const I2C_MASTER: u8 = 0b1000;
/// Least SSPADD, which leaves a device the time to answer.
const MIN_ADDRESS: u64 = 4;
/// Clocks per bit of SPI, and SSPM1:SSPM0. A quarter of the clock is left out: a device has no time to
/// answer.
const SPI_RATES: [(u64, u8); 2] = [(16, 1), (64, 2)];
/// Bit times of a byte with its acknowledge, or of a start or stop.
const BYTE_BITS: u64 = 12;

impl Pic16BusSetup {
    /// Clocks of the oscillator per bit.
    fn bit_clocks(self) -> u64 {
        match self {
            Pic16BusSetup::I2c(address) => 4 * (u64::from(address) + 1),
            Pic16BusSetup::Spi(rate, _) => SPI_RATES.iter().find(|row| row.1 == rate).map_or(64, |row| row.0),
        }
    }

    /// Iterations of the loop that waits for a byte: three cycles each.
    fn iterations(self) -> u32 {
        (BYTE_BITS * self.bit_clocks() / 4 + 12).div_ceil(3) as u32
    }

    /// Pins that are outputs, with their level at rest; I2C has none.
    #[must_use]
    pub fn outputs(self, job: &CompileJob<'_>) -> Vec<(&'static str, bool)> {
        match (self, job.target.spi) {
            (Pic16BusSetup::Spi(..), Some([select, clock, out, _])) => {
                vec![(select, true), (clock, false), (out, false)]
            }
            _ => Vec::new(),
        }
    }

    /// Emits the set-up; the registers of bank 1 come first.
    pub fn start(self, out: &mut Pic16Writer<'_>) {
        let chip = out.chip;
        let control = match self {
            Pic16BusSetup::I2c(address) => {
                out.set_byte(chip.reg(Sfr::SSPADD), address);
                // The slew rate of 400 kHz also fits slower buses.
                out.set_byte(chip.reg(Sfr::SSPSTAT), 0);
                I2C_MASTER
            }
            Pic16BusSetup::Spi(rate, _) => {
                // With CKP 0 the rising edge is the one that samples.
                out.set_byte(chip.reg(Sfr::SSPSTAT), chip.mask(&["CKE"]));
                rate
            }
        };
        out.set_byte(chip.reg(Sfr::SSPCON), chip.mask(&["SSPEN"]) | control);
    }
}

/// Chooses the highest rate that is not above the wanted one; the lowest possible rate if all are above.
///
/// # Errors
/// The program uses both buses, and the chip has one MSSP.
pub fn plan_bus(job: &CompileJob<'_>, specials: &mut Vec<SpecialPin>) -> Result<Option<Pic16BusSetup>, BuildRefusal> {
    let hertz = |rate: u32| u64::from(rate).max(1);
    let setup = match (job.ir.buses.i2c, job.ir.buses.spi) {
        (None, None) => return Ok(None),
        (Some(_), Some(_)) => {
            return Err(BuildRefusal::Unsupported {
                cause: format!("{} has one MSSP, and the program uses I2C and SPI", job.target.chip.name),
                hint: "use one of the two, or an AVR, which has both".to_owned(),
                element: None,
            });
        }
        (Some(rate), None) => {
            let counts = job.clock_hz.div_ceil(4 * hertz(rate));
            Pic16BusSetup::I2c(counts.saturating_sub(1).clamp(MIN_ADDRESS, 127) as u8)
        }
        (None, Some(rate)) => {
            let fits = |row: &&(u64, u8)| job.clock_hz <= row.0.saturating_mul(hertz(rate));
            let row = SPI_RATES.iter().find(fits).copied().unwrap_or(SPI_RATES[1]);
            let select = job.target.spi.map_or("", |pins| pins[0]);
            let mut chars = select.chars().skip(1);
            let letter = chars.next().unwrap_or('C');
            Pic16BusSetup::Spi(row.1, (letter, chars.next().and_then(|c| c.to_digit(8)).unwrap_or(0) as u8))
        }
    };
    let bit = Ratio { num: setup.bit_clocks() / 4, den: 1 };
    match (setup, job.target.i2c, job.target.spi) {
        (Pic16BusSetup::I2c(_), Some((pin, clock)), _) => {
            specials.push(SpecialPin::I2c { pin: pin.to_owned(), clock: clock.to_owned(), bit });
        }
        (Pic16BusSetup::Spi(..), _, Some(pins)) => {
            let [pin, clock, out, input] = pins.map(str::to_owned);
            specials.push(SpecialPin::Spi { pin, clock, out, input, bit });
        }
        _ => {}
    }
    Ok(Some(setup))
}

/// What starts a step of the bus.
enum BusStep {
    /// A bit of SSPCON2.
    Bit(&'static str),
    /// A byte, from this address of data memory.
    Byte(u16),
}

/// Emits a step of the bus and the wait for its end.
fn step(out: &mut Pic16Writer<'_>, begin: BusStep, turns: u32) {
    let chip = out.chip;
    let done = chip.bit("SSPIF");
    out.set_bit(done, false);
    match begin {
        BusStep::Bit(name) => out.set_bit(chip.bit(name), true),
        BusStep::Byte(from) => {
            out.byte_op(Pic16OpKind::MovfW, from);
            out.byte_op(Pic16OpKind::Movwf, chip.reg(Sfr::SSPBUF));
        }
    }
    out.select_bank(1);
    let wait = out.label();
    out.place(wait);
    out.skip_unless(done, false);
    out.goto_back(wait, turns);
}

/// Emits a subroutine of a transfer; its operands and its result are in scratch.
pub fn emit_transfer(
    out: &mut Pic16Writer<'_>,
    (routine, label): (Pic16Routine, Pic16Label),
    setup: Option<Pic16BusSetup>,
    scratch: u16,
) {
    let Some(setup) = setup else { return };
    let (chip, turns) = (out.chip, setup.iterations());
    let (byte, register, address) = (scratch, scratch + 1, scratch + 2);
    out.mark(CodeMark::Section("transfer on a bus"));
    out.assume_banks(chip.reachable_banks(scratch));
    out.place(label);
    if let Pic16BusSetup::Spi(_, (letter, bit)) = setup {
        let port =
            chip.part.ports.iter().find(|row| row.port.name().ends_with(letter)).map_or(0, |row| chip.reg(row.port));
        out.set_bit((port, bit), false);
        step(out, BusStep::Byte(byte), turns);
        out.set_bit((port, bit), true);
    } else {
        step(out, BusStep::Bit("SEN"), turns);
        step(out, BusStep::Byte(address), turns);
        step(out, BusStep::Byte(register), turns);
        if routine == Pic16Routine::I2cRead {
            step(out, BusStep::Bit("RSEN"), turns);
            out.set_bit((address, 0), true);
            step(out, BusStep::Byte(address), turns);
            // Without a device the lines are high, and the byte is FFh.
            step(out, BusStep::Bit("RCEN"), turns);
            out.set_bit(chip.bit("ACKDT"), true);
            step(out, BusStep::Bit("ACKEN"), turns);
        } else {
            step(out, BusStep::Byte(byte), turns);
        }
        step(out, BusStep::Bit("PEN"), turns);
    }
    out.byte_op(Pic16OpKind::MovfW, chip.reg(Sfr::SSPBUF));
    out.byte_op(Pic16OpKind::Movwf, byte);
    out.select_bank(1);
    out.implied_op(Pic16OpKind::Return);
}

impl Pic16Selector<'_, '_> {
    /// A transfer on a bus, and its wait.
    pub fn transfer(&mut self, action: BusAction, register: WordOperand, value: WordOperand, dst: Option<WordId>) {
        let scratch = self.layout.scratch;
        let routine = match action {
            BusAction::I2cWrite(_) => Pic16Routine::I2cWrite,
            BusAction::I2cRead(_) => Pic16Routine::I2cRead,
            BusAction::Spi => Pic16Routine::Spi,
        };
        if let BusAction::I2cWrite(device) | BusAction::I2cRead(device) = action {
            self.put_low_byte(scratch + 1, register);
            self.out.set_byte(scratch + 2, device << 1);
        }
        if !matches!(action, BusAction::I2cRead(_)) {
            self.put_low_byte(scratch, value);
        }
        let label = self.routine(routine);
        self.out.call(label, self.out.chip.reachable_banks(scratch), Some(1));
        let Some(dst) = dst else { return };
        let (to, bytes) = (self.layout.word(dst), u16::from(self.ir.bytes(dst)));
        self.out.byte_op(Pic16OpKind::MovfW, scratch);
        self.out.byte_op(Pic16OpKind::Movwf, to);
        (1..bytes).for_each(|n| self.out.byte_op(Pic16OpKind::Clrf, to + n));
    }

    fn put_low_byte(&mut self, to: u16, value: WordOperand) {
        match value {
            WordOperand::Const(constant) => self.out.set_byte(to, constant as u8),
            WordOperand::Cell(word) => {
                self.out.byte_op(Pic16OpKind::MovfW, self.layout.word(word));
                self.out.byte_op(Pic16OpKind::Movwf, to);
            }
        }
    }
}
