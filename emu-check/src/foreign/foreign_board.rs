//! The board of a foreign image: its pins, derived from the program alone, and what can be compared there.

use diag::{Diagnostic, Pos, Severity};
use emu_core::chip::Chip;
use emu_core::pins::PinId;
use ladder::{ChipPart, Element, LadderOperand, LadderProgram, ProgramElement, SymbolKind};
use ladder_compile::{ImageMap, SpecialPin};
use ladder_eval::Evaluator;

use crate::CheckOptions;
use crate::chip::bus_devices::BusPins;
use crate::chip::map_contract::{ScanPace, requested_pin};
use crate::chip::peripherals::{CheckedPeripherals, SerialUse, reference_millivolts, serial_use};
use crate::chip::program_places::ProgramPlaces;
use crate::chip::serial_line::BitTime;

use super::codes;

/// A variable stored in the EEPROM: its symbol, first cell, and number of cells.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EepromVariable {
    pub symbol: usize,
    pub addr: u32,
    pub bytes: u32,
}

/// The pins of a foreign image, and what is compared at them.
#[derive(Debug, Clone)]
pub(crate) struct ForeignBoard {
    /// The chip.
    pub chip: &'static Chip,
    /// Timing of a scan.
    pub pace: ScanPace,
    /// Pins of the inputs, in the evaluator's order.
    pub inputs: Vec<PinId>,
    /// Outputs: symbol index and pin.
    pub outputs: Vec<(usize, PinId)>,
    /// The serial line, the analog inputs and the EEPROM; the PWM output is in `pwm`.
    pub peripherals: CheckedPeripherals,
    /// The PWM outputs in the evaluator's order: pin and frequency in Hz; none if they are not compared.
    pub pwm: Vec<(PinId, u64)>,
    /// The EEPROM variables that are compared.
    pub eeprom_variables: Vec<EepromVariable>,
    /// Per symbol: whether its value depends on the moment at which a byte is sent.
    pub timing_dependent: Vec<bool>,
    /// What is not compared, as text for the report.
    pub left_out: Vec<String>,
    /// True if the values of sent bytes are compared.
    pub compares_bytes: bool,
    /// True if the transfers on buses are compared.
    pub compares_buses: bool,
    /// Number of scans that a byte takes.
    pub scans_per_byte: u64,
    /// The locations of the symbols, if a map is given.
    pub places: Option<ProgramPlaces>,
}

impl ForeignBoard {
    /// Finds the pins of the program.
    ///
    /// # Errors
    /// A pin that is not known, or a map that does not fit.
    pub(super) fn new(
        program: &LadderProgram,
        options: &CheckOptions,
        eval: &Evaluator,
        (chip, pace): (&'static Chip, ScanPace),
        map: Option<&ImageMap>,
    ) -> Result<ForeignBoard, Vec<Diagnostic>> {
        let mut faults = Vec::new();
        let mut fault = |cause: String| {
            let hint = "give the pin in the IO LIST (with MICRO=), by --pin NAME=PIN, or by --map";
            let pos = Pos::default();
            faults.push(Diagnostic::new(Severity::Error, codes::NO_PIN, &program.file, pos, cause, hint));
        };
        let of_map = |name: &str| {
            let map = map?;
            let analog = map.specials.iter().find_map(|special| match special {
                SpecialPin::Analog { pin, name: of } if of == name => Some(pin.as_str()),
                _ => None,
            });
            map.pins.iter().find(|pin| pin.name == name).map(|pin| pin.pin.as_str()).or(analog)
        };
        let pwm_of_map = |name: &str| {
            map?.specials.iter().find_map(|special| match special {
                SpecialPin::Pwm { pin, name: of, .. } if of.as_deref() == Some(name) => Some(pin.as_str()),
                _ => None,
            })
        };
        let mut pin = |name: &str| {
            let requested = requested_pin(program, options, chip, name).or_else(|| of_map(name));
            let found = requested.and_then(|pin| chip.pin(pin));
            if found.is_none() {
                fault(match requested {
                    Some(pin) => format!("{} has no pin {pin} for `{name}`", chip.name),
                    None => format!("the pin of `{name}` on {} is not known", chip.name),
                });
            }
            found
        };
        let (mut inputs, mut outputs, mut analog) = (Vec::new(), Vec::new(), Vec::new());
        let read_analog: Vec<usize> = eval.adc_symbols().collect();
        for (index, symbol) in eval.symbols().iter().enumerate() {
            match symbol.kind {
                SymbolKind::Input => inputs.extend(pin(&symbol.name)),
                SymbolKind::Output => outputs.extend(pin(&symbol.name).map(|pin| (index, pin))),
                SymbolKind::Adc if read_analog.contains(&index) => {
                    let reference = reference_millivolts(program, chip, &symbol.name);
                    analog.extend(pin(&symbol.name).map(|pin| (index, pin, reference)));
                }
                _ => {}
            }
        }
        let target = ladder_compile::find_target(chip.name);
        let SerialUse { sends, receives } = serial_use(program);
        let uart = target.and_then(|target| target.uart).filter(|_| sends || receives);
        let (transmit, receive) = uart.map_or((None, None), |(tx, rx)| (chip.pin(tx), chip.pin(rx)));
        let first_pwm = target.and_then(|target| target.pwm.first()).map(|at| at.pin);
        let mut pwm = Vec::new();
        for output in eval.pwm_outputs() {
            let name = output.name.as_deref();
            let chosen = name.and_then(|name| requested_pin(program, options, chip, name).or_else(|| pwm_of_map(name)));
            let found = chosen.or(first_pwm.filter(|_| eval.pwm_outputs().len() == 1)).and_then(|pin| chip.pin(pin));
            if found.is_none() {
                fault(match (name, first_pwm) {
                    (Some(name), Some(_)) => format!("the pin of `{name}` on {} is not known", chip.name),
                    _ => format!("{} has no PWM output that ladder programs can use", chip.name),
                });
            }
            pwm.extend(found.map(|pin| (pin, u64::from(output.hertz))));
        }
        if (sends || receives) && uart.is_none() {
            fault(format!("{} has no serial line that ladder programs can use", chip.name));
        }
        let buses = bus_pins(program, chip);
        if program.uses_part(ChipPart::I2c) && buses.i2c.is_none() {
            fault(format!("{} has no I2C bus that ladder programs can use", chip.name));
        }
        if program.uses_part(ChipPart::Spi) && buses.spi.is_none() {
            fault(format!("{} has no SPI bus that ladder programs can use", chip.name));
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let places = map.map(|map| ProgramPlaces::new(program, map, chip, eval, pace)).transpose()?;
        let baud = program.settings.baud.unwrap_or(1).max(1);
        let scans_per_byte = 10_000_000u64.div_ceil(baud.saturating_mul(program.settings.cycle_us).max(1)).max(1);
        let timing_dependent = timing_dependent_symbols(program, scans_per_byte);
        let is_timing_dependent_name = |name: &str| timing_dependent.iter().any(|other| other == name);
        let is_timing_dependent = |symbol: &ladder::LadderSymbol| is_timing_dependent_name(&symbol.name);
        let mut left_out = Vec::new();
        for symbol in eval.symbols().iter().filter(|s| s.kind == SymbolKind::Output && is_timing_dependent(s)) {
            left_out.push(format!("{}: depends on the moment at which a byte is sent", symbol.name));
        }
        let compares_bytes = !program.elements().map(|ProgramElement { element, .. }| element.facts()).any(|facts| {
            facts.part == Some(ChipPart::Transmitter)
                && facts.symbols.iter().any(|symbol| is_timing_dependent_name(&symbol.name))
        });
        if !compares_bytes {
            left_out.push("values of bytes: they depend on the moment at which others were sent".to_owned());
        }
        let compares_buses = timing_dependent.is_empty();
        if buses.pins().next().is_some() && !compares_buses {
            left_out.push("transfers on buses: they may depend on the moment at which a byte is sent".to_owned());
        }
        let mut addr = 0;
        let mut eeprom_variables = Vec::new();
        for ProgramElement { element, .. } in program.elements() {
            let Element::Persist { name } = element else { continue };
            let Some(symbol) = eval.index(name) else { continue };
            let bytes = eval.symbols().get(symbol).map_or(2, |symbol| u32::from(symbol.bytes));
            if !is_timing_dependent_name(name) {
                eeprom_variables.push(EepromVariable { symbol, addr, bytes });
            }
            addr += bytes;
        }
        let timing_dependent_duty = program.elements().any(
            |ProgramElement { element, .. }| matches!(element, Element::SetPwm { duty: LadderOperand::Var(name), .. } if is_timing_dependent_name(name)),
        );
        if timing_dependent_duty {
            left_out.push("the PWM output: its duty depends on the moment at which a byte is sent".to_owned());
        }
        let peripherals = CheckedPeripherals {
            transmit: transmit.filter(|_| sends),
            receive: receive.filter(|_| receives),
            bit_time: BitTime { hz: pace.clock_hz, baud },
            analog,
            pwm: Vec::new(),
            buses,
            eeprom_cells: addr,
            clocks_per_cycle: pace.clocks_per_cycle,
        };
        if timing_dependent_duty {
            pwm.clear();
        }
        let timing_dependent = eval.symbols().iter().map(is_timing_dependent).collect();
        Ok(ForeignBoard {
            chip,
            pace,
            inputs,
            outputs,
            peripherals,
            pwm,
            eeprom_variables,
            timing_dependent,
            left_out,
            compares_bytes,
            compares_buses,
            scans_per_byte,
            places,
        })
    }

    /// The chip's name of a pin, such as `PD2`.
    pub(super) fn pin_name(&self, pin: PinId) -> &'static str {
        self.chip.pins.get(usize::from(pin)).map_or("?", |p| p.name)
    }
}

/// The pins of the buses that a program uses: those at which the compiler puts them.
fn bus_pins(program: &LadderProgram, chip: &Chip) -> BusPins {
    let target = ladder_compile::find_target(chip.name);
    let i2c = target.and_then(|target| target.i2c).filter(|_| program.uses_part(ChipPart::I2c));
    let spi = target.and_then(|target| target.spi).filter(|_| program.uses_part(ChipPart::Spi));
    BusPins {
        i2c: i2c.and_then(|(data, clock)| chip.pin(data).zip(chip.pin(clock))),
        spi: spi.and_then(|names| match names.map(|name| chip.pin(name)) {
            [Some(select), Some(clock), Some(out), Some(input)] => Some([select, clock, out, input]),
            _ => None,
        }),
    }
}

/// The names of symbols whose value depends on the moment at which a byte is sent: those that elements after
/// a sending element write, and all that depend on them. The chip's transmitter becomes free by a flag of its
/// own, the transmitter of the language after a number of scans. After a FORMATTED_STRING this matters only
/// if a byte takes longer than a scan.
fn timing_dependent_symbols(program: &LadderProgram, scans_per_byte: u64) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    // A timing-dependent master relay makes everything after it timing-dependent, in every scan.
    let mut all = false;
    loop {
        let before = (names.len(), all);
        let (mut rung, mut is_timing_dependent) = (None, false);
        for ProgramElement { id, element, .. } in program.elements() {
            if rung != Some(id.rung) {
                (rung, is_timing_dependent) = (Some(id.rung), all);
            }
            let facts = element.facts();
            is_timing_dependent |= facts.symbols.iter().any(|symbol| names.iter().any(|other| *other == symbol.name))
                || facts.part == Some(ChipPart::Transmitter)
                    && (scans_per_byte > 1 || !matches!(element, Element::FormattedString { .. }));
            all |= is_timing_dependent && *element == Element::MasterRelay;
            for name in facts.written().filter(|_| is_timing_dependent) {
                if !names.iter().any(|other| other == name) {
                    names.push(name.to_owned());
                }
            }
        }
        if before == (names.len(), all) {
            return names;
        }
    }
}
