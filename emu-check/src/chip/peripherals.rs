//! Locates the peripherals that a program uses: the pins of serial line, converter and PWM output, and the
//! EEPROM cells.

use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;
use ladder::{ChipPart, Element, LadderProgram, ProgramElement};
use ladder_compile::{ImageMap, SpecialPin};
use ladder_eval::Evaluator;

use crate::chip::bus_devices::BusPins;
use crate::chip::map_contract::ScanPace;
use crate::chip::pwm_meter::ExpectedPwm;
use crate::chip::serial_line::{BitTime, byte_levels};

/// Number of steps of the converter.
const CONVERTER_STEPS: u32 = 1024;
/// The supply in millivolts, the usual reference of the converter.
const SUPPLY_MILLIVOLTS: u32 = 5_000;

/// Millivolts that convert to `value`: the middle of the step, or its lower end if steps are hardly wider
/// than a millivolt.
pub(crate) fn input_millivolts(value: u16, reference: u32) -> u32 {
    let value = u32::from(value);
    let middle = (2 * value + 1) * reference / (2 * CONVERTER_STEPS);
    let is_within = middle * CONVERTER_STEPS / reference.max(1) == value;
    if is_within { middle } else { (value * reference).div_ceil(CONVERTER_STEPS) }
}

/// Reference of the conversions of an analog input in millivolts: an internal one of the chip with REFS 2 and
/// 3.
pub(crate) fn reference_millivolts(program: &LadderProgram, chip: &Chip, name: &str) -> u32 {
    let refs = program.elements().find_map(|ProgramElement { element, .. }| match element {
        Element::ReadAdc { name: of, refs } if of == name => *refs,
        _ => None,
    });
    let kind = emu_avr::chips::part(chip.name).map(|part| part.adc_kind);
    match (refs, kind) {
        (Some(3), Some(kind)) => kind.reference_mv,
        (Some(2), Some(kind)) => kind.low_reference_mv.unwrap_or(SUPPLY_MILLIVOLTS),
        _ => SUPPLY_MILLIVOLTS,
    }
}

/// What a program uses of the chip besides port pins.
#[derive(Debug, Clone)]
pub(crate) struct CheckedPeripherals {
    /// The pin of the transmitter.
    pub transmit: Option<PinId>,
    /// The pin of the receiver.
    pub receive: Option<PinId>,
    /// Length of a bit on the serial line.
    pub bit_time: BitTime,
    /// The analog symbols in the evaluator's order, with their pins and their reference in millivolts.
    pub analog: Vec<(usize, PinId, u32)>,
    /// The pins of the PWM outputs in the evaluator's order, with their expected timing.
    pub pwm: Vec<(PinId, ExpectedPwm)>,
    /// The pins of the buses.
    pub buses: BusPins,
    /// Number of EEPROM cells in use, from address 0.
    pub eeprom_cells: u32,
    /// Clocks per machine cycle.
    pub clocks_per_cycle: u64,
}

impl CheckedPeripherals {
    /// Finds the pins in the map. The error lists what has no pin.
    pub(crate) fn new(
        program: &LadderProgram,
        map: &ImageMap,
        chip: &Chip,
        eval: &Evaluator,
        pace: &ScanPace,
    ) -> Result<CheckedPeripherals, Vec<String>> {
        let mut faults = Vec::new();
        let mut pin = |what: &str, wanted: bool, of: &dyn Fn(&SpecialPin) -> Option<&String>| {
            let name = map.specials.iter().find_map(of).filter(|_| wanted)?;
            let found = chip.pin(name);
            if found.is_none() {
                faults.push(format!("{} has no pin {name} for {what}", chip.name));
            }
            found
        };
        let SerialUse { sends, receives } = serial_use(program);
        let transmit = pin("the transmitter", sends, &|special| match special {
            SpecialPin::Transmit { pin, .. } => Some(pin),
            _ => None,
        });
        let receive = pin("the receiver", receives, &|special| match special {
            SpecialPin::Receive { pin, .. } => Some(pin),
            _ => None,
        });
        let mut pwm = Vec::new();
        for output in eval.pwm_outputs() {
            let at = pin("a PWM output", true, &|special| match special {
                SpecialPin::Pwm { pin, name, .. } if *name == output.name => Some(pin),
                _ => None,
            });
            let wanted = map.specials.iter().find_map(|special| match special {
                SpecialPin::Pwm { period, steps, name, .. } if *name == output.name => Some(ExpectedPwm {
                    period: (u128::from(period.num) * u128::from(pace.clocks_per_cycle), period.den.into()),
                    steps: u64::from(*steps),
                    tolerance_clocks: pace.clocks_per_cycle,
                }),
                _ => None,
            });
            pwm.extend(at.zip(wanted));
        }
        let mut analog = Vec::new();
        for symbol in eval.adc_symbols() {
            let name = eval.symbols().get(symbol).map_or("", |s| s.name.as_str());
            let at = pin(name, true, &|special| match special {
                SpecialPin::Analog { pin, name: of } if of == name => Some(pin),
                _ => None,
            });
            analog.extend(at.map(|at| (symbol, at, reference_millivolts(program, chip, name))));
        }
        let mut buses = BusPins::default();
        for special in &map.specials {
            match special {
                SpecialPin::I2c { pin, clock, .. } => buses.i2c = chip.pin(pin).zip(chip.pin(clock)),
                SpecialPin::Spi { pin, clock, out, input, .. } => {
                    let found = [pin, clock, out, input].map(|name| chip.pin(name));
                    buses.spi =
                        if let [Some(a), Some(b), Some(c), Some(d)] = found { Some([a, b, c, d]) } else { None };
                }
                _ => {}
            }
        }
        let needs = [
            (program.uses_part(ChipPart::I2c) && buses.i2c.is_none(), "the I2C bus"),
            (program.uses_part(ChipPart::Spi) && buses.spi.is_none(), "the SPI bus"),
            (sends && transmit.is_none(), "the transmitter"),
            (receives && receive.is_none(), "the receiver"),
            (pwm.len() < eval.pwm_outputs().len(), "a PWM output"),
            (analog.len() < eval.adc_symbols().count(), "an analog input"),
        ];
        faults
            .extend(needs.iter().filter(|(lacks, _)| *lacks).map(|(_, what)| format!("the map has no pin for {what}")));
        if !faults.is_empty() {
            return Err(faults);
        }
        Ok(CheckedPeripherals {
            transmit,
            receive,
            bit_time: BitTime { hz: pace.clock_hz, baud: program.settings.baud.unwrap_or(1) },
            analog,
            pwm,
            buses,
            eeprom_cells: eval.eeprom().len() as u32,
            clocks_per_cycle: pace.clocks_per_cycle,
        })
    }

    /// All pins of these peripherals.
    pub(crate) fn pins(&self) -> impl Iterator<Item = PinId> {
        let serial = self.transmit.into_iter().chain(self.receive);
        serial
            .chain(self.buses.pins())
            .chain(self.pwm.iter().map(|pwm| pwm.0))
            .chain(self.analog.iter().map(|analog| analog.1))
    }

    /// Converts clocks since power-up to a time of the chip.
    pub(crate) fn to_time(&self, clock: u64) -> CycleTime {
        CycleTime { cycle: clock / self.clocks_per_cycle, phase: (clock % self.clocks_per_cycle) as u8 }
    }

    /// Converts a time of the chip to clocks since power-up.
    pub(crate) fn to_clock(&self, at: CycleTime) -> u64 {
        at.cycle * self.clocks_per_cycle + u64::from(at.phase)
    }

    /// Applies a voltage to an analog input, given with its reference, that converts to `value`.
    pub(crate) fn drive_analog<C: Cpu>(&self, cpu: &mut C, (pin, reference): (PinId, u32), value: u16) {
        let millivolts = input_millivolts(value, reference);
        cpu.drive_volts(CycleTime::at(cpu.cycle()), pin, millivolts);
    }

    /// Queues the edges of a byte for the receiver; its start bit begins at clock `start`.
    pub(crate) fn queue_byte<C: Cpu>(&self, cpu: &mut C, start: u64, byte: u8) {
        let Some(pin) = self.receive else { return };
        byte_levels(self.bit_time, byte)
            .for_each(|(after, high)| cpu.drive(self.to_time(start + after), pin, PinLevel::from_bit(high)));
    }

    /// The contents of the EEPROM at the start of a run with this seed: erased, or random as if left by
    /// earlier programs.
    pub(crate) fn initial_eeprom(&self, seed: u64) -> impl Iterator<Item = u8> + use<> {
        let mut rng = Rng::new(seed ^ 0xEE);
        let erased = rng.one_in(2);
        (0..self.eeprom_cells).map(move |_| if erased || rng.one_in(4) { 0xFF } else { rng.next_u64() as u8 })
    }
}

/// The directions of the serial line that a program uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SerialUse {
    /// The program sends bytes.
    pub sends: bool,
    /// The program receives bytes.
    pub receives: bool,
}

/// The use of the serial line by a program.
pub(crate) fn serial_use(program: &LadderProgram) -> SerialUse {
    SerialUse { sends: program.uses_part(ChipPart::Transmitter), receives: program.uses_part(ChipPart::Receiver) }
}
