//! What the outside does to the pins and to the supply, and when.

use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::Cpu;
use emu_core::pins::{CycleTime, PinId, PinLevel};

use crate::input_error::{InputError, malformed};
use crate::time::{CycleClock, parse_decimal, split_unit};

/// What the supply is called, whatever the chip: by most makers, and by Atmel.
const SUPPLY_NAMES: [&str; 2] = ["VDD", "VCC"];

/// The supply before anything else is said of it, in millivolts.
pub const INITIAL_SUPPLY_MV: u32 = 5_000;

/// Counts of the converter that [`ExternalDrive::Counts`] speaks of.
const ADC_COUNTS: u16 = 1024;

/// Highest voltage, in millivolts: above what any pin of these chips bears.
const MAX_MILLIVOLTS: u128 = 20_000;

/// The pins of a controller in a few words.
const AP101_PIN_NAMES: &str = "I0 to I511, E0 to E255, POWER and CLEAR";

/// Something that is done from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExternalDrive {
    /// A pin is driven to a level, or let go.
    Level(PinId, PinLevel),
    /// A pin is driven to a voltage, in millivolts.
    Volts(PinId, u32),
    /// A pin is driven to the voltage that a converter of 10 bits, referred to the supply of that time, reads as this count.
    Counts(PinId, u16),
    /// The supply gets a voltage, in millivolts.
    Supply(u32),
}

/// Something that is done from outside, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimedDrive {
    /// When.
    pub at: CycleTime,
    /// What; it stays until something else is done.
    pub drive: ExternalDrive,
}

impl TimedDrive {
    /// The pin; nothing where it is the supply.
    #[must_use]
    pub fn pin(&self) -> Option<PinId> {
        match self.drive {
            ExternalDrive::Level(pin, _) | ExternalDrive::Volts(pin, _) | ExternalDrive::Counts(pin, _) => Some(pin),
            ExternalDrive::Supply(_) => None,
        }
    }
}

/// What a pin can be at: `PB0=1`, `PB0=0` or `PB0=z` (nothing drives it), case aside.
///
/// # Errors
/// No such pin or level.
pub fn parse_pin_level(chip: &Chip, text: &str) -> Result<(PinId, PinLevel), InputError> {
    let (name, level) = split_at_equals(chip, text)?;
    let pin = find_pin(chip, name)?;
    let level = self::parse_level(level).ok_or_else(|| malformed(level, "level of a pin", "0, 1 or z"))?;
    Ok((pin, level))
}

/// What is done to a pin: a level as [`parse_pin_level`] reads it, where `z` lets it go, a resistor (`RC3=pullup`, `RC3=pulldown`), or
/// a voltage (`RA0=1.25V`, `RA0=800mV`, or `RA0=512counts` of the 1024 in which a converter divides the supply); `VDD=4.5V` sets
/// the supply, and `VCC` is another name for it.
///
/// # Errors
/// No such pin, level or voltage.
pub fn parse_drive(chip: &Chip, text: &str) -> Result<ExternalDrive, InputError> {
    let (name, value) = split_at_equals(chip, text)?;
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
        // The 8051 and AP101 know levels only.
        let volts = match parse_decimal(value) {
            _ if matches!(chip.family, ChipFamily::Mcs51 | ChipFamily::Ap101) => String::new(),
            Some(_)
                if parse_millivolts(&format!("{value}V")).is_ok_and(|millivolts| millivolts <= INITIAL_SUPPLY_MV) =>
            {
                format!(", or volts with their unit: {name}={value}V")
            }
            Some((count, 0)) if count < ADC_COUNTS.into() => {
                format!(", or what a converter reads: {name}={value}counts")
            }
            _ => format!(", or volts: {name}=1.25V"),
        };
        malformed(value, "level of a pin", format!("0, 1, z, pullup or pulldown{volts}"))
    })
}

/// `10ms:PB0=0`: a time as in [`CycleClock::parse_moment`] and what is done as in [`put`].
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

/// Queues the drives, in order of time; of two at one time the one given last wins, and the supply comes before the pins.
///
/// # Errors
/// A machine that knows levels only was to get a voltage. The others are queued.
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

/// Queues one drive. `supply` is what the supply has been set to by those before it, in millivolts: 5,000 at first.
///
/// # Errors
/// As [`queue_drives`].
pub fn queue_drive<C: Cpu>(
    cpu: &mut C,
    TimedDrive { at, drive: put }: TimedDrive,
    supply: &mut u32,
) -> Result<(), InputError> {
    let done = match put {
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
    if done {
        return Ok(());
    }
    let (chip, pin) = (cpu.chip().name, example_pin(cpu.chip(), 0));
    let what = if matches!(put, ExternalDrive::Supply(_)) { "the supply" } else { "voltages on pins" };
    Err(InputError::LevelsOnly { what, chip, pin })
}

/// What drives make of the supply, in millivolts, and when.
#[must_use]
pub fn supply_changes(drives: &[TimedDrive]) -> Vec<(CycleTime, u32)> {
    let supply = |drive: &TimedDrive| match drive.drive {
        ExternalDrive::Supply(millivolts) => Some((drive.at, millivolts)),
        _ => None,
    };
    drives.iter().filter_map(supply).collect()
}

/// The machine can do it, whenever that is.
///
/// # Errors
/// Why not.
pub fn check_drive_supported<C: Cpu>(cpu: &C, put: ExternalDrive) -> Result<(), InputError> {
    match put {
        ExternalDrive::Level(..) => Ok(()),
        put => queue_drive(
            &mut cpu.clone(),
            TimedDrive { at: CycleTime::at(cpu.cycle()), drive: put },
            &mut INITIAL_SUPPLY_MV.clone(),
        ),
    }
}

/// The name of the pin at position `n` of those that the package has, for messages.
#[must_use]
pub fn example_pin(chip: &Chip, n: usize) -> &'static str {
    chip.present_pins().nth(n).map_or("PIN", |(_, pin)| pin.name)
}

/// Why the machine does not have a pin that its chip's row has.
#[must_use]
pub fn missing_pin_reason(chip: &Chip, pin: PinId) -> InputError {
    let name = chip.pins.get(usize::from(pin)).map_or("?", |def| def.name);
    if chip.packages.is_empty() {
        return InputError::MissingChannel { pin: name };
    }
    let packages = chip.packages.iter().filter(|of| of.pin_number(pin).is_some()).map(|of| of.name).collect();
    InputError::NotInPackage { pin: name, packages }
}

/// Both sides of the sign.
fn split_at_equals<'t>(chip: &Chip, text: &'t str) -> Result<(&'t str, &'t str), InputError> {
    let (name, value) = text.split_once('=').ok_or_else(|| {
        let pin = example_pin(chip, 0);
        InputError::MissingPart {
            text: text.to_owned(),
            part: "level",
            examples: format!("{pin}=1, {pin}=0 or {pin}=z"),
        }
    })?;
    Ok((name.trim(), value.trim()))
}

/// What the supply of a chip is called in its data sheet.
#[must_use]
pub fn supply_name(chip: &Chip) -> &'static str {
    let [vdd, vcc] = SUPPLY_NAMES;
    if chip.family == ChipFamily::Avr { vcc } else { vdd }
}

/// The pin of that name, case aside, or with that function among those that the chip's row notes: `MCLR` and `RESET` are the
/// reset pin also on chips where it is a pin of a port.
///
/// # Errors
/// The package has no such pin.
pub fn find_pin(chip: &Chip, name: &str) -> Result<PinId, InputError> {
    let pin = chip.pin(name).filter(|&pin| chip.has_pin(pin));
    // Its note says what else a pin is.
    let is = |note: &str| !name.is_empty() && note.split(", ").any(|function| function.eq_ignore_ascii_case(name));
    let shared = || chip.present_pins().find(|(_, def)| is(def.note)).map(|(pin, _)| pin);
    pin.or_else(shared).ok_or_else(|| {
        let names: Vec<&str> = chip.present_pins().map(|(_, def)| def.name).collect();
        let names = if chip.family == ChipFamily::Ap101 { AP101_PIN_NAMES.to_owned() } else { names.join(" ") };
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

/// A voltage in whole millivolts: a decimal number and `V` or `mV` (case of the V aside).
fn parse_millivolts(text: &str) -> Result<u32, InputError> {
    let wanted = || malformed(text, "voltage", "1.25V or 800mV");
    let (number, unit) = split_unit(text);
    let (mantissa, decimals) = parse_decimal(number).ok_or_else(wanted)?;
    let scaled = match unit {
        "V" | "v" => mantissa * 1_000,
        "mV" | "mv" => mantissa,
        _ => return Err(wanted()),
    };
    let down = 10u128.pow(decimals);
    match scaled / down {
        _ if scaled % down != 0 => Err(InputError::NotWhole { text: text.to_owned(), unit: "millivolts" }),
        millivolts @ 0..=MAX_MILLIVOLTS => Ok(millivolts as u32),
        _ => Err(InputError::VoltageTooHigh { text: text.to_owned(), most_volts: MAX_MILLIVOLTS / 1_000 }),
    }
}
