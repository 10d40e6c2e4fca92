//! Stimuli: what drives the pins and the supply, and when.

use crate::time::DecimalNumber;
use emu_core::ChipPin;
use emu_core::chip::Chip;
use emu_core::cpu::Cpu;
use emu_core::pins::{CycleTime, PinId, PinLevel};

use crate::text::input_error::{InputError, malformed};
use crate::text::time::{CycleClock, WrittenQuantity, parse_decimal};

/// Names of the supply for any chip: the usual one, and Atmel's.
const SUPPLY_NAMES: [&str; 2] = ["VDD", "VCC"];

/// The initial supply in millivolts.
pub const INITIAL_SUPPLY_MV: u32 = 5_000;

/// Number of converter counts for [`ExternalDrive::Counts`].
const ADC_COUNTS: u16 = 1024;

/// Maximum voltage in millivolts: above the limit of any pin of these chips.
const MAX_MILLIVOLTS: u128 = 20_000;

/// Summary of the pins of a controller.
const AP101_PIN_NAMES: &str = "I0 to I511, E0 to E255, POWER and CLEAR";

/// A drive from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExternalDrive {
    /// A pin is driven to a level, or released.
    Level(PinId, PinLevel),
    /// A pin is driven to a voltage, in millivolts.
    Volts(PinId, u32),
    /// A pin is driven to the voltage that a 10-bit converter, with the supply of that time as its reference,
    /// reads as this count.
    Counts(PinId, u16),
    /// The supply is set to a voltage, in millivolts.
    Supply(u32),
}

/// A drive from outside, with its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimedDrive {
    /// The time.
    pub at: CycleTime,
    /// The drive; it lasts until the next one.
    pub drive: ExternalDrive,
}

impl TimedDrive {
    /// Returns the pin; `None` for the supply.
    #[must_use]
    pub fn pin(&self) -> Option<PinId> {
        match self.drive {
            ExternalDrive::Level(pin, _) | ExternalDrive::Volts(pin, _) | ExternalDrive::Counts(pin, _) => Some(pin),
            ExternalDrive::Supply(_) => None,
        }
    }
}

/// A pin and a level for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PinAndLevel {
    /// The pin.
    pub pin: PinId,
    /// The level.
    pub level: PinLevel,
}

/// Parses a pin and a level: `PB0=1`, `PB0=0` or `PB0=z` (floating); case is ignored.
///
/// # Errors
/// No such pin or level.
pub fn parse_pin_level(chip: &Chip, text: &str) -> Result<PinAndLevel, InputError> {
    let NameAndValue { name, value: level } = split_at_equals(chip, text)?;
    let pin = find_pin(chip, name)?;
    let level = self::parse_level(level).ok_or_else(|| malformed(level, "level of a pin", "0, 1 or z"))?;
    Ok(PinAndLevel { pin, level })
}

/// Parses a drive: a level as in [`parse_pin_level`], where `z` releases the pin; a resistor (`RC3=pullup`,
/// `RC3=pulldown`); or a voltage (`RA0=1.25V`, `RA0=800mV`, or `RA0=512counts` of the 1024 into which a
/// converter divides the supply). `VDD=4.5V` sets the supply, and `VCC` is another name for it.
///
/// # Errors
/// No such pin, level or voltage.
pub fn parse_drive(chip: &Chip, text: &str) -> Result<ExternalDrive, InputError> {
    let NameAndValue { name, value } = split_at_equals(chip, text)?;
    let volts = value.ends_with(['V', 'v']);
    if SUPPLY_NAMES.iter().any(|supply| name.eq_ignore_ascii_case(supply)) && chip.pin(name).is_none() {
        return match volts {
            true => parse_millivolts(value).map(ExternalDrive::Supply),
            false => Err(malformed(value, "voltage", format!("{}=4.5V", supply_name(chip)))),
        };
    }
    let pin = find_pin(chip, name)?;
    if volts {
        return Ok(ExternalDrive::Volts(pin, parse_millivolts(value)?));
    }
    let lower = value.to_ascii_lowercase();
    if let Some(count) = lower.strip_suffix("counts") {
        let fits = count.trim().parse().ok().filter(|&count: &u16| count < ADC_COUNTS);
        let why = || malformed(value, "reading of a converter", format!("0counts to {}counts", ADC_COUNTS - 1));
        return fits.map(|count| ExternalDrive::Counts(pin, count)).ok_or_else(why);
    }
    let level = match lower.as_str() {
        "pullup" => Some(PinLevel::PullUp),
        "pulldown" => Some(PinLevel::PullDown),
        _ => parse_level(value),
    };
    level.map(|level| ExternalDrive::Level(pin, level)).ok_or_else(|| {
        // The 8051 and AP101 only have digital levels.
        let volts = match parse_decimal(value) {
            _ if !chip.family_traits().has_analog_levels => String::new(),
            Some(_)
                if parse_millivolts(&format!("{value}V")).is_ok_and(|millivolts| millivolts <= INITIAL_SUPPLY_MV) =>
            {
                format!(", or volts with their unit: {name}={value}V")
            }
            Some(DecimalNumber { mantissa: count, decimals: 0 }) if count < ADC_COUNTS.into() => {
                format!(", or what a converter reads: {name}={value}counts")
            }
            _ => format!(", or volts: {name}=1.25V"),
        };
        malformed(value, "level of a pin", format!("0, 1, z, pullup or pulldown{volts}"))
    })
}

/// Parses `10ms:PB0=0`: a time as in [`CycleClock::parse_moment`] and a drive as in [`parse_drive`].
///
/// # Errors
/// As those.
pub fn parse_timed_drive(chip: &Chip, clock: CycleClock, text: &str) -> Result<TimedDrive, InputError> {
    let Some((time, rest)) = text.split_once(':') else {
        return Err(InputError::MissingPart {
            text: text.to_owned(),
            part: "time",
            examples: format!("10ms:{}=0", example_pin(chip, 0)),
        });
    };
    Ok(TimedDrive { at: clock.parse_moment(time)?, drive: parse_drive(chip, rest)? })
}

/// Queues drives in order of time. Of two drives at one time the last one counts, and the supply comes before
/// the pins.
///
/// # Errors
/// A voltage for a machine that only has digital levels. The other drives are queued.
pub fn queue_drives<C: Cpu>(cpu: &mut C, drives: &[TimedDrive]) -> Result<(), InputError> {
    let mut sorted = drives.to_vec();
    sorted.sort_by_key(|d| (d.at, !matches!(d.drive, ExternalDrive::Supply(_))));
    let mut refused = Ok(());
    let mut supply = INITIAL_SUPPLY_MV;
    for drive in sorted {
        refused = queue_drive(cpu, drive, &mut supply).and(refused);
    }
    refused
}

/// Queues one drive. `supply` is the supply set by previous drives, in millivolts: 5,000 at first.
///
/// # Errors
/// As [`queue_drives`].
pub fn queue_drive<C: Cpu>(
    cpu: &mut C,
    TimedDrive { at, drive }: TimedDrive,
    supply: &mut u32,
) -> Result<(), InputError> {
    let is_supported = match drive {
        ExternalDrive::Level(pin, level) => {
            cpu.drive(at, pin, level);
            true
        }
        ExternalDrive::Volts(pin, millivolts) => cpu.drive_volts(at, pin, millivolts),
        // The middle of the step.
        ExternalDrive::Counts(pin, count) => {
            let millivolts =
                ((2 * u32::from(count) + 1) * *supply + u32::from(ADC_COUNTS)) / (2 * u32::from(ADC_COUNTS));
            cpu.drive_volts(at, pin, millivolts)
        }
        ExternalDrive::Supply(millivolts) => {
            *supply = millivolts;
            cpu.set_supply(at, millivolts)
        }
    };
    if is_supported {
        return Ok(());
    }
    let (chip, pin) = (cpu.chip().name, example_pin(cpu.chip(), 0));
    let what = if matches!(drive, ExternalDrive::Supply(_)) { "the supply" } else { "voltages on pins" };
    Err(InputError::LevelsOnly { what, chip, pin })
}

/// A change of the supply voltage.
#[derive(Debug, Clone, Copy)]
pub struct SupplyChange {
    /// The time.
    pub at: CycleTime,
    /// The voltage from then on, in millivolts.
    pub millivolts: u32,
}

/// Returns the supply changes of drives, in millivolts, with their times.
#[must_use]
pub fn supply_changes(drives: &[TimedDrive]) -> Vec<SupplyChange> {
    let supply = |drive: &TimedDrive| match drive.drive {
        ExternalDrive::Supply(millivolts) => Some(SupplyChange { at: drive.at, millivolts }),
        _ => None,
    };
    drives.iter().filter_map(supply).collect()
}

/// Checks that the machine supports a drive, at any time.
///
/// # Errors
/// Why it does not.
pub fn check_drive_supported<C: Cpu>(cpu: &C, drive: ExternalDrive) -> Result<(), InputError> {
    match drive {
        ExternalDrive::Level(..) => Ok(()),
        drive => queue_drive(
            &mut cpu.clone(),
            TimedDrive { at: CycleTime::at(cpu.cycle()), drive },
            &mut INITIAL_SUPPLY_MV.clone(),
        ),
    }
}

/// Returns the name of the `n`-th pin that the package has, for messages.
#[must_use]
pub fn example_pin(chip: &Chip, n: usize) -> &'static str {
    chip.present_pins().nth(n).map_or("PIN", |ChipPin { def: pin, .. }| pin.name)
}

/// Returns why the machine does not have a pin of its chip row.
#[must_use]
pub fn missing_pin_reason(chip: &Chip, pin: PinId) -> InputError {
    let name = chip.pins.get(usize::from(pin)).map_or("?", |def| def.name);
    if chip.packages.is_empty() {
        return InputError::MissingChannel { pin: name };
    }
    let packages = chip.packages.iter().filter(|of| of.pin_number(pin).is_some()).map(|of| of.name).collect();
    InputError::NotInPackage { pin: name, packages }
}

/// The parts of `NAME=VALUE`.
#[derive(Debug, Clone, Copy)]
struct NameAndValue<'t> {
    /// The text before the equals sign.
    name: &'t str,
    /// The text after it.
    value: &'t str,
}

/// Splits a text at the equals sign.
fn split_at_equals<'t>(chip: &Chip, text: &'t str) -> Result<NameAndValue<'t>, InputError> {
    let (name, value) = text.split_once('=').ok_or_else(|| {
        let pin = example_pin(chip, 0);
        InputError::MissingPart {
            text: text.to_owned(),
            part: "level",
            examples: format!("{pin}=1, {pin}=0 or {pin}=z"),
        }
    })?;
    Ok(NameAndValue { name: name.trim(), value: value.trim() })
}

/// Returns the name of the supply in the chip's data sheet.
#[must_use]
pub fn supply_name(chip: &Chip) -> &'static str {
    chip.family_traits().supply
}

/// Finds a pin by its name, ignoring case, or by a function in the chip row's notes: `MCLR` and `RESET` also
/// find the reset pin on chips where it is a port pin.
///
/// # Errors
/// The package has no such pin.
pub fn find_pin(chip: &Chip, name: &str) -> Result<PinId, InputError> {
    let pin = chip.pin(name).filter(|&pin| chip.has_pin(pin));
    // The note lists the other functions of a pin.
    let has_function =
        |note: &str| !name.is_empty() && note.split(", ").any(|function| function.eq_ignore_ascii_case(name));
    let by_function =
        || chip.present_pins().find(|ChipPin { def, .. }| has_function(def.note)).map(|ChipPin { id: pin, .. }| pin);
    pin.or_else(by_function).ok_or_else(|| {
        let names: Vec<&str> = chip.present_pins().map(|ChipPin { def, .. }| def.name).collect();
        let names = if chip.is_bit_controller() { AP101_PIN_NAMES.to_owned() } else { names.join(" ") };
        InputError::UnknownPin { chip: chip.name, name: name.to_owned(), known: names }
    })
}

fn parse_level(text: &str) -> Option<PinLevel> {
    match text {
        "0" => Some(PinLevel::Low),
        "1" => Some(PinLevel::High),
        "z" | "Z" => Some(PinLevel::Float),
        _ => None,
    }
}

/// Parses a voltage in whole millivolts: a decimal number and `V` or `mV` (the case of the V is ignored).
fn parse_millivolts(text: &str) -> Result<u32, InputError> {
    let wanted = || malformed(text, "voltage", "1.25V or 800mV");
    let WrittenQuantity { number, unit } = WrittenQuantity::split(text);
    let DecimalNumber { mantissa, decimals } = parse_decimal(number).ok_or_else(wanted)?;
    let scaled = match unit {
        "V" | "v" => mantissa * 1_000,
        "mV" | "mv" => mantissa,
        _ => return Err(wanted()),
    };
    let divisor = 10u128.pow(decimals);
    match scaled / divisor {
        _ if scaled % divisor != 0 => Err(InputError::NotWhole { text: text.to_owned(), unit: "millivolts" }),
        millivolts @ 0..=MAX_MILLIVOLTS => Ok(millivolts as u32),
        _ => Err(InputError::VoltageTooHigh { text: text.to_owned(), most_volts: MAX_MILLIVOLTS / 1_000 }),
    }
}
