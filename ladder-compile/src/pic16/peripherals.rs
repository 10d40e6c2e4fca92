//! Serial line, converter, PWM and EEPROM: their settings, their set-up at reset, and the code of their
//! operations.

use emu_pic16::chips::{ComparatorKind, Pic16AdcKind as Converter};
use emu_pic16::isa::Pic16OpKind;
use emu_pic16::periph::map::Sfr;

use super::buses::{self, Pic16BusSetup};
use super::chip_data::{ANY_BANK, Pic16ChipData};
use super::select::{Pic16Routine, Pic16Selector};
use super::writer::{Pic16Writer, STATUS, Z};
use crate::CodegenError;
use crate::ir::{WordId, WordOperand};
use crate::map::{Ratio, SpecialPin};
use crate::target::{BuildRefusal, CompileJob, check_pwm_timers};

/// Settings of the serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pic16UartSetup {
    /// Value of SPBRG.
    pub divisor: u8,
    /// BRGH.
    pub high: bool,
    /// Machine cycles per bit.
    pub bit: u64,
}

/// Settings of the PWM output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pic16PwmSetup {
    /// Value of PR2.
    pub period: u8,
    /// Prescaler of timer 2: 1, 4 or 16.
    pub prescale: u16,
    /// CCP module that generates the pulse.
    pub module: CcpModule,
}

/// A CCP module: its registers, and the bits of its control register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CcpModule {
    /// Register of the whole counts of the pulse.
    pub duty: Sfr,
    /// Control register: mode, and the lowest two bits of the pulse.
    pub control: Sfr,
    /// Mode bits that select PWM.
    pub mode: [&'static str; 2],
    /// Names of the lowest two bits of the pulse.
    pub quarters: [&'static str; 2],
}

const CCP1: CcpModule =
    CcpModule { duty: Sfr::CCPR1L, control: Sfr::CCP1CON, mode: ["CCP1M3", "CCP1M2"], quarters: ["CCP1X", "CCP1Y"] };
const CCP2: CcpModule =
    CcpModule { duty: Sfr::CCPR2L, control: Sfr::CCP2CON, mode: ["CCP2M3", "CCP2M2"], quarters: ["CCP2X", "CCP2Y"] };

/// Settings of the converter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pic16AdcSetup {
    /// Value of ADCON0 for each input: clock, channel, ADON.
    pub select: Vec<u8>,
    /// Value of ADCON1 during a conversion.
    pub converting: u8,
    /// Value of ADCON1 at other times.
    pub resting: u8,
    /// Value of ANSEL, on chips that have it.
    pub ansel: u8,
    /// Number of iterations of the loop that waits for the sampling capacitor.
    pub acquisition_iterations: u8,
    /// Maximum number of iterations of the loop that waits for the conversion.
    pub max_conversion_iterations: u32,
}

/// Settings of the peripherals of a program.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pic16Peripherals {
    /// Serial line, if used.
    pub uart: Option<Pic16UartSetup>,
    /// PWM outputs in the order of their numbers; all have the same period.
    pub pwm: Vec<Pic16PwmSetup>,
    /// I2C or SPI bus, if used.
    pub bus: Option<Pic16BusSetup>,
    /// Converter, if used.
    pub adc: Option<Pic16AdcSetup>,
    /// Pins of the peripherals with their parameters.
    pub specials: Vec<SpecialPin>,
}

/// PCFG3:PCFG0 values without external references, and the inputs that are analog (DS30292 register 11-2;
/// DS39598 register 11-2).
const PCFG: [(u8, u8); 6] =
    [(0b0110, 0), (0b1110, 0b1), (0b0100, 0b1011), (0b0010, 0b1_1111), (0b1001, 0b11_1111), (0b0000, 0b1111_1111)];
/// Minimum conversion time per bit, and acquisition time of the capacitor, in nanoseconds (DS30292, 11.1 and
/// 11.2).
const TAD_NS: u64 = 1_600;
const ACQUIRE_NS: u64 = 20_000;

/// Bit times that a byte may take to go, and that the end of the one before it may take.
const SENT_BITS: u64 = 11;
const BEFORE_BITS: u64 = 2;

/// Chooses the settings of all peripherals.
///
/// # Errors
/// A baud rate or a frequency that the chip cannot generate.
pub fn plan_peripherals(job: &CompileJob<'_>, chip: &Pic16ChipData) -> Result<Pic16Peripherals, BuildRefusal> {
    let mut devices = Pic16Peripherals::default();
    let target = job.target;
    if (job.ir.uart.send || job.ir.uart.receive)
        && let (Some(baud), Some((transmit, receive))) = (job.baud, target.uart)
    {
        let uart = plan_uart(job.clock_hz, baud)?;
        if job.ir.uart.send {
            let bit = Ratio { num: uart.bit, den: 1 };
            devices.specials.push(SpecialPin::Transmit { pin: transmit.to_owned(), baud, bit });
        }
        if job.ir.uart.receive {
            devices.specials.push(SpecialPin::Receive { pin: receive.to_owned(), baud });
        }
        devices.uart = Some(uart);
    }
    devices.bus = buses::plan_bus(job, &mut devices.specials)?;
    if !job.ir.adcs.is_empty() {
        let adc = plan_adc(job, chip, &mut devices.specials)?;
        devices.adc = Some(adc);
    }
    check_pwm_timers(job)?;
    for (output, at) in job.pwm_outputs() {
        let module = if at.channel == 2 { CCP2 } else { CCP1 };
        let pwm = plan_pwm(job.clock_hz, output.hertz.into(), module)?;
        let count = u32::from(pwm.period) + 1;
        devices.specials.push(SpecialPin::Pwm {
            pin: at.pin.to_owned(),
            name: output.name.clone(),
            hertz: output.hertz.into(),
            period: Ratio { num: u64::from(count) * u64::from(pwm.prescale), den: 1 },
            // The step is a quarter of a timer count.
            steps: count * 4,
        });
        devices.pwm.push(pwm);
    }
    Ok(devices)
}

fn plan_uart(clock_hz: u64, baud: u64) -> Result<Pic16UartSetup, BuildRefusal> {
    let baud = baud.max(1);
    let fit = |scale: u64| {
        let divisor = ((clock_hz + scale * baud / 2) / (scale * baud)).clamp(1, 256);
        // Error relative to the requested rate, in millionths.
        let made = scale * divisor * baud;
        (made.abs_diff(clock_hz) * 1_000_000 / made, scale, divisor)
    };
    let (error, scale, divisor) = fit(16).min(fit(64));
    if error > 20_000 {
        return Err(BuildRefusal::BaudOutOfRange { nearest: (clock_hz + scale * divisor / 2) / (scale * divisor) });
    }
    Ok(Pic16UartSetup { divisor: (divisor - 1) as u8, high: scale == 16, bit: scale * divisor / 4 })
}

fn plan_pwm(clock_hz: u64, hertz: u64, module: CcpModule) -> Result<Pic16PwmSetup, BuildRefusal> {
    let hertz = hertz.max(1);
    // At most 255 counts: with 256, a duty cycle of 100 % would equal one that is a step lower.
    let fit = |prescale: u64| {
        let unit = 4 * prescale * hertz;
        let count = ((clock_hz + unit / 2) / unit).clamp(1, 255);
        let near = [count.saturating_sub(1).max(1), count, (count + 1).min(255)];
        let error = |count: u64| {
            (clock_hz as u128 * 1_000_000_000 / u128::from(4 * prescale * count))
                .abs_diff(u128::from(hertz) * 1_000_000_000)
        };
        near.into_iter().map(|count| (error(count), prescale, count)).min().unwrap_or((u128::MAX, prescale, count))
    };
    let (error, prescale, count) = [1, 4, 16].map(fit).into_iter().min().unwrap_or((u128::MAX, 1, 1));
    if error > u128::from(hertz) * 50_000_000 {
        let whole = 4 * prescale * count;
        return Err(BuildRefusal::PwmOutOfRange { hertz, nearest: (clock_hz + whole / 2) / whole });
    }
    Ok(Pic16PwmSetup { period: (count - 1) as u8, prescale: prescale as u16, module })
}

fn plan_adc(
    job: &CompileJob<'_>,
    chip: &Pic16ChipData,
    specials: &mut Vec<SpecialPin>,
) -> Result<Pic16AdcSetup, BuildRefusal> {
    let hz = job.clock_hz;
    // 2, 8 or 32 clocks per bit.
    let (bits, clocks) = [(0u8, 2u64), (1, 8), (2, 32)]
        .into_iter()
        .find(|&(_, clocks)| clocks * 1_000_000_000 >= TAD_NS * hz)
        .unwrap_or((2, 32));
    let channel_of = |pin: &str| job.target.adc.iter().find(|(name, _)| *name == pin).map(|&(_, channel)| channel);
    let (mut select, mut wanted) = (Vec::new(), 0u8);
    for name in &job.ir.adcs {
        let pin = job.pins.iter().find(|pin| pin.analog && pin.name == *name);
        let Some((pin, channel)) = pin.and_then(|pin| Some((pin, channel_of(pin.pin)?))) else {
            return Err(BuildRefusal::Internal(CodegenError::NoAnalogPin { name: name.clone() }));
        };
        specials.push(SpecialPin::Analog { pin: pin.pin.to_owned(), name: name.clone() });
        wanted |= 1 << channel;
        select.push(bits << 6 | channel << 3 | chip.mask(&["ADON"]));
    }
    // Digital inputs of the program, by channel: a pin in analog mode reads 0.
    let digital = job.pins.iter().filter(|pin| !pin.analog && !pin.output);
    let digital = digital.filter_map(|pin| channel_of(pin.pin)).fold(0u8, |mask, channel| mask | 1 << channel);
    let right = chip.mask(&["ADFM"]);
    let cycles = |ns: u64| (ns * hz).div_ceil(4_000_000_000);
    let convert = (14 * clocks).div_ceil(4) + 4;
    let mut adc = Pic16AdcSetup {
        select,
        converting: right,
        resting: right,
        ansel: 0,
        acquisition_iterations: cycles(ACQUIRE_NS).div_ceil(3).clamp(1, 255) as u8,
        max_conversion_iterations: convert.div_ceil(3) as u32 + 1,
    };
    if chip.part.adc == Converter::Ansel {
        adc.ansel = wanted;
    } else {
        // The fewest analog pins that include all inputs. If a digital input is among them, they are analog
        // only while converting.
        let pcfg = PCFG.into_iter().find(|(_, analog)| analog & wanted == wanted);
        let (code, analog) = pcfg.unwrap_or((0, u8::MAX));
        adc.converting |= code;
        adc.resting |= if analog & digital == 0 { code } else { PCFG[0].0 };
    }
    Ok(adc)
}

impl Pic16Peripherals {
    /// Emits the set-up of the analog parts in bank 1: all pins that are not analog inputs of the program
    /// become digital.
    pub fn configure_analog(&self, out: &mut Pic16Writer<'_>) {
        let part = out.chip.part;
        if let Some(adc) = &self.adc {
            if part.adc == Converter::Ansel {
                out.set_byte(out.chip.reg(Sfr::ANSEL), adc.ansel);
            }
            out.set_byte(out.chip.reg(Sfr::ADCON1), adc.resting);
        } else if part.adc == Converter::Ansel {
            out.set_byte(out.chip.reg(Sfr::ANSEL), 0);
        } else if part.adc != Converter::None {
            out.set_byte(out.chip.reg(Sfr::ADCON1), PCFG[0].0);
        }
    }

    /// Emits the start of serial line and PWM; the registers of bank 1 come first.
    pub fn start(&self, out: &mut Pic16Writer<'_>, uses: crate::ir::UartUse) {
        let chip = out.chip;
        if let Some(uart) = self.uart {
            out.set_byte(chip.reg(Sfr::SPBRG), uart.divisor);
            let mut control = if uart.high { chip.mask(&["BRGH"]) } else { 0 };
            control |= if uses.send { chip.mask(&["TXEN"]) } else { 0 };
            out.set_byte(chip.reg(Sfr::TXSTA), control);
        }
        if let Some(pwm) = self.pwm.first() {
            out.set_byte(chip.reg(Sfr::PR2), pwm.period);
        }
        if let Some(bus) = self.bus {
            bus.start(out);
        }
        if self.uart.is_some() {
            let receive: &[&str] = if uses.receive { &["SPEN", "CREN"] } else { &["SPEN"] };
            out.set_byte(chip.reg(Sfr::RCSTA), chip.mask(receive));
        }
        for pwm in &self.pwm {
            // The pulse is 0 until a duty cycle is set; 11xx selects PWM.
            out.set_byte(chip.reg(pwm.module.duty), 0);
            out.set_byte(chip.reg(pwm.module.control), chip.mask(&pwm.module.mode));
        }
        if let Some(pwm) = self.pwm.first() {
            let prescale = match pwm.prescale {
                1 => 0,
                4 => chip.mask(&["T2CKPS0"]),
                _ => chip.mask(&["T2CKPS1"]),
            };
            out.set_byte(chip.reg(Sfr::T2CON), chip.mask(&["TMR2ON"]) | prescale);
        }
    }
}

/// Address of the duty register of a PWM output.
#[must_use]
pub fn duty_register(chip: &Pic16ChipData, devices: &Pic16Peripherals, output: u32) -> u16 {
    devices.pwm.get(output as usize).map_or(0, |pwm| chip.reg(pwm.module.duty))
}

/// Turns the comparators off, so that their pins are digital, on chips where they are on after reset.
pub fn disable_comparators(out: &mut Pic16Writer<'_>) {
    if out.chip.part.comparators == ComparatorKind::F62x {
        out.set_byte(out.chip.reg(Sfr::CMCON), out.chip.mask(&["CM0", "CM1", "CM2"]));
    }
}

impl Pic16Selector<'_, '_> {
    /// At the start of a scan, sets the flag if a byte has been received.
    pub fn latch_received(&mut self) {
        if self.ir.uart.receive {
            self.out.set_bit(self.layout.byte_received_flag, false);
            let flag = super::rung_formula::BitLiteral { at: self.out.chip.bit("RCIF"), is: true };
            self.execute_if(
                &super::rung_formula::RungFormula::Lit(flag),
                &super::logic::GuardedInstruction::StoreBit(self.layout.byte_received_flag, true),
            );
        }
    }

    /// Stores the received byte in a word, and restarts the receiver if an overrun has stopped it.
    pub fn take_byte(&mut self, dst: WordId) {
        let (to, chip) = (self.layout.word(dst), self.out.chip);
        self.out.byte_op(Pic16OpKind::MovfW, chip.reg(Sfr::RCREG));
        self.out.byte_op(Pic16OpKind::Movwf, to);
        (1..u16::from(self.ir.bytes(dst))).for_each(|n| self.out.byte_op(Pic16OpKind::Clrf, to + n));
        let (overrun, enable) = (chip.bit("OERR"), chip.bit("CREN"));
        self.out.select_bank(chip.reachable_banks(enable.0));
        self.out.skip_unless(overrun, true);
        self.out.set_bit(enable, false);
        self.out.set_bit(enable, true);
        self.out.set_bit(self.layout.byte_received_flag, false);
    }

    /// Writes the low byte of a value to the transmitter.
    pub fn send(&mut self, value: WordOperand) {
        let to = self.out.chip.reg(Sfr::TXREG);
        match value {
            WordOperand::Const(k) => self.out.set_byte(to, k as u8),
            WordOperand::Cell(word) => {
                self.out.byte_op(Pic16OpKind::MovfW, self.layout.word(word));
                self.out.byte_op(Pic16OpKind::Movwf, to);
            }
        }
    }

    /// Waits until the transmitter has sent its byte: first TXREG is empty, then the shift register.
    pub fn wait_sent(&mut self) {
        for (flag, bits) in [("TXIF", BEFORE_BITS), ("TRMT", SENT_BITS)] {
            let turns = self.devices.uart.map_or(0, |uart| (bits * uart.bit).div_ceil(3)) as u32;
            let flag = self.out.chip.bit(flag);
            self.out.select_bank(self.out.chip.reachable_banks(flag.0));
            let wait = self.out.label();
            self.out.place(wait);
            self.out.skip_unless(flag, false);
            self.out.goto_back(wait, turns);
        }
    }

    /// dst := the result of converting an analog input.
    pub fn convert(&mut self, dst: WordId, input: u32) {
        let Some(adc) = &self.devices.adc else { return };
        let select = adc.select.get(input as usize).copied().unwrap_or(0);
        let routine = self.routine(Pic16Routine::Convert);
        self.out.select_bank(1);
        self.out.load_w(select);
        self.out.call(routine, 1, Some(1));
        let (to, bytes, chip) = (self.layout.word(dst), u16::from(self.ir.bytes(dst)), self.out.chip);
        if bytes > 1 {
            self.out.byte_op(Pic16OpKind::MovfW, chip.reg(Sfr::ADRESH));
            self.out.byte_op(Pic16OpKind::Movwf, to + 1);
        }
        (2..bytes).for_each(|n| self.out.byte_op(Pic16OpKind::Clrf, to + n));
        self.out.byte_op(Pic16OpKind::MovfW, chip.reg(Sfr::ADRESL));
        self.out.byte_op(Pic16OpKind::Movwf, to);
    }

    /// Sets the duty cycle of a PWM output to the value, clamped to 0 to 100 percent.
    pub fn set_duty(&mut self, output: u32, duty: WordOperand) {
        let routine = self.routine(Pic16Routine::Duty(output));
        let low = self.layout.scratch;
        match duty {
            WordOperand::Const(k) => self.out.load_w(k.clamp(0, 100) as u8),
            WordOperand::Cell(word) => {
                // Check for values above 100 or below 0 first; then the low byte is the duty cycle.
                let (at, bytes) = (self.layout.word(word), u16::from(self.ir.bytes(word)));
                let (fine, end, negative) = (self.out.label(), self.out.label(), self.out.label());
                let sign = super::rung_formula::RungFormula::Lit(super::rung_formula::BitLiteral {
                    at: (at + bytes - 1, 7),
                    is: true,
                });
                self.execute_if(&sign, &super::logic::GuardedInstruction::Goto(negative));
                let over = super::rung_formula::RungFormula::Cmp(crate::ir::WordComparison {
                    a: word,
                    rel: crate::ir::RelationOp::Ge,
                    b: WordOperand::Const(100),
                });
                self.execute_if(&over.opposite(), &super::logic::GuardedInstruction::Goto(fine));
                self.out.literal_op(Pic16OpKind::Movlw, 100);
                self.out.goto(end);
                self.out.place(negative);
                self.out.literal_op(Pic16OpKind::Movlw, 0);
                self.out.goto(end);
                self.out.place(fine);
                self.out.byte_op(Pic16OpKind::MovfW, at);
                self.out.place(end);
            }
        }
        let near = self.out.common_banks(&[low, duty_register(self.out.chip, self.devices, output)]);
        self.out.call(routine, near, Some(near));
    }

    /// dst := EEPROM from `addr` on.
    pub fn recall(&mut self, dst: WordId, addr: u16) {
        let read = self.routine(Pic16Routine::ReadEeprom);
        let to = self.layout.word(dst);
        for n in 0..u16::from(self.ir.bytes(dst)) {
            self.out.load_w((addr + n) as u8);
            self.out.call(read, ANY_BANK, Some(1));
            self.out.byte_op(Pic16OpKind::Movwf, to + n);
        }
    }

    /// Starts to write the lowest byte that differs from its cell, if any, and sets `busy`.
    pub fn persist(&mut self, src: WordId, addr: u16, busy: (WordId, WordOperand)) {
        let (read, write) = (self.routine(Pic16Routine::ReadEeprom), self.routine(Pic16Routine::WriteEeprom));
        let from = self.layout.word(src);
        let (end, found) = (self.out.label(), self.out.label());
        let last = u16::from(self.ir.bytes(src)) - 1;
        for n in 0..=last {
            let equal = self.out.label();
            self.out.load_w((addr + n) as u8);
            self.out.call(read, ANY_BANK, Some(1));
            self.out.byte_op(Pic16OpKind::XorwfW, from + n);
            self.out.skip_unless((STATUS, Z), true);
            self.out.goto(if n == last { end } else { equal });
            self.out.byte_op(Pic16OpKind::MovfW, from + n);
            if n < last {
                self.out.goto(found);
                self.out.place(equal);
            }
        }
        self.out.place(found);
        self.out.call(write, ANY_BANK, Some(1));
        self.copy_value(self.layout.word(busy.0), self.ir.bytes(busy.0), busy.1);
        self.out.place(end);
    }

    /// dst := `table[index]`.
    pub fn lookup(&mut self, dst: WordId, index: WordId, table: u32) {
        let Some(values) = self.ir.tables.get(table as usize).map(|table| &table.values) else { return };
        let (to, bytes) = (self.layout.word(dst), self.ir.bytes(dst));
        let short = values.iter().all(|&v| i8::try_from(v).is_ok());
        // Write the lowest byte last, because the destination may be the index.
        for n in (0..bytes).rev() {
            let byte = |v: &i32| v.to_le_bytes().get(usize::from(n)).copied().unwrap_or(0);
            let first = values.first().map_or(0, byte);
            if values.iter().all(|v| byte(v) == first) {
                self.out.set_byte(to + u16::from(n), first);
            } else if n == 0 || !short {
                let routine = self.routine(Pic16Routine::Table(table, n, index));
                self.out.call(routine, self.out.chip.reachable_banks(self.layout.word(index)), None);
                self.out.byte_op(Pic16OpKind::Movwf, to + u16::from(n));
            }
        }
        let signed = short && values.iter().any(|&v| v < 0) && values.iter().any(|&v| v >= 0);
        if signed {
            self.sign_extend(to, 1, bytes);
        }
    }

    /// Calls a subroutine that works in scratch.
    pub fn call(&mut self, routine: Pic16Routine) {
        let label = self.routine(routine);
        let banks = self.out.chip.reachable_banks(self.layout.scratch);
        self.out.call(label, banks, None);
    }
}
