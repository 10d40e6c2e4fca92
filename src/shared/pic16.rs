//! Flags of `emu run` for the PIC16 family.

use clap::{Args, ValueEnum};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::image::Image;
use emu_debug::{InputError, address_names, time};
use emu_pic16::chips::{self, OscillatorMode, Pic16Part};
use emu_pic16::{Options, TimingCorner};

use crate::shared::fail::VerbFailure;
use crate::shared::output;
use crate::shared::usage_error::UsageError;

/// The bits of a program memory word and of a configuration word.
const WORD: u32 = 0x3FFF;

/// Word address at which the memory `config` begins (DS33023, section 27).
const CONFIG: u16 = 0x2000;

/// Flags that only the PIC16 family accepts.
#[derive(Debug, Args)]
#[group(id = "pic16")]
#[command(next_help_heading = "Only for the PIC16 family")]
pub struct Pic16Flags {
    /// The configuration word at 2007h, which replaces that of the image: 0x3F3A.
    #[arg(long, value_name = "WORD", value_parser = parse_config_word)]
    config: Option<u16>,
    /// The corner of times that data sheets give as a range: min, typ or max. It applies to the watchdog, the
    /// power-up timer, writes to EEPROM and flash, the ADC's own oscillator, and the brown-out voltage.
    /// Default: typ.
    #[arg(long, value_name = "CORNER", hide_possible_values = true)]
    corner: Option<CornerChoice>,
    /// The crystal of timer 1's oscillator: 32.768kHz, 100kHz, or none. Default: 32.768kHz.
    #[arg(long, value_name = "HZ", value_parser = parse_crystal)]
    timer1_crystal: Option<Timer1Crystal>,
}

/// The values of `--corner`; see [`TimingCorner`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CornerChoice {
    /// The shortest times.
    Min,
    /// The typical times.
    Typ,
    /// The longest times.
    Max,
}

/// The crystal of timer 1 in Hz, if there is one. It is a separate type because clap treats an `Option` as a
/// flag that may be absent.
#[derive(Debug, Clone, Copy)]
struct Timer1Crystal(Option<u64>);

fn parse_config_word(text: &str) -> Result<u16, UsageError> {
    // Configuration words are always written in hexadecimal, so digits without a prefix are not read as a
    // decimal number.
    let digits = text.trim_end_matches(['h', 'H']);
    if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        let expected = format!("a configuration word is written with 0x in front: 0x{}", digits.to_ascii_uppercase());
        return Err(UsageError::malformed(expected));
    }
    let word = address_names::parse_number(text).filter(|&word| word <= WORD);
    let expected = || format!("a configuration word is 0x0 to 0x{WORD:X}, as in 0x3F3A");
    word.map(|word| word as u16).ok_or_else(|| UsageError::malformed(expected()))
}

fn parse_crystal(text: &str) -> Result<Timer1Crystal, InputError> {
    if text == "none" { Ok(Timer1Crystal(None)) } else { time::parse_hertz(text).map(|hz| Timer1Crystal(Some(hz))) }
}

impl Pic16Flags {
    /// Returns the options of a machine of `chip` with an oscillator of `hz` Hz. With `start_up`, the machine
    /// waits for its oscillator to start. Refuses flags that do not apply to the chip.
    pub fn options(&self, chip: &Chip, hz: u64, start_up: bool) -> Result<Options, VerbFailure> {
        let part = part(chip);
        let can = |able: fn(&Pic16Part) -> bool| part.is_some_and(able);
        let given_flags = [
            ("--config", self.config.is_some(), part.is_some(), ""),
            ("--corner", self.corner.is_some(), part.is_some(), ""),
            ("--timer1-crystal", self.timer1_crystal.is_some(), can(|part| part.timers), " with timer 1"),
        ];
        if let Some((flag, _, _, which)) = given_flags.into_iter().find(|(_, is_given, can, _)| *is_given && !can) {
            let which = if part.is_some() { which } else { "" };
            let why = format!("{flag} is for chips of the PIC16 family{which}; {} is not one", chip.name);
            return Err(VerbFailure::Usage(why));
        }
        let defaults = Options::default();
        Ok(Options {
            hz,
            corner: match self.corner {
                None => defaults.corner,
                Some(CornerChoice::Min) => TimingCorner::Min,
                Some(CornerChoice::Typ) => TimingCorner::Typ,
                Some(CornerChoice::Max) => TimingCorner::Max,
            },
            config: self.config,
            start_up,
            timer1_hz: self.timer1_crystal.map_or(defaults.timer1_hz, |crystal| crystal.0),
            ..defaults
        })
    }
}

/// Returns the row of PIC16-only data of a chip, or `None` for other families.
fn part(chip: &Chip) -> Option<&'static Pic16Part> {
    chips::part(chip.name).filter(|_| chip.family == ChipFamily::Pic16)
}

/// Prints a note on standard error if neither the image nor the command line gives a configuration word, with
/// the settings of an erased one.
pub fn warn_missing_config(chip: &Chip, image: &Image, options: &Options) {
    let Some(part) = part(chip).filter(|_| options.config.is_none()) else { return };
    let (Some(&addr), Some(&erased)) = (part.config.words.first(), part.config.erased.first()) else { return };
    let first = 2 * u32::from(addr - CONFIG);
    if image.bytes_in("config").any(|one| one.addr == first) {
        return;
    }
    output::print_to_stderr(&format!(
        "note: the image has no configuration word, so it is erased, 0x{erased:04X}: {}\n  \
         hint: --config WORD gives one; in the program __CONFIG or #pragma config does\n",
        describe_config(part, erased)
    ));
}

/// Describes the settings of a configuration word.
fn describe_config(part: &Pic16Part, word: u16) -> String {
    let layout = &part.config;
    let oscillator = match layout.oscillator_mode(word) {
        OscillatorMode::Lp => "LP crystal",
        OscillatorMode::Xt => "XT crystal",
        OscillatorMode::Hs => "HS crystal",
        OscillatorMode::Ec => "clock from outside",
        OscillatorMode::Rc => "RC oscillator",
        OscillatorMode::Internal => "oscillator on the chip",
    };
    let on = |on: bool| if on { "on" } else { "off" };
    let mut list = vec![
        format!("watchdog {}", on(word & layout.wdte != 0)),
        oscillator.to_owned(),
        format!("power-up timer {}", on(layout.has_power_up_timer(word))),
    ];
    if layout.boren != 0 {
        list.push(format!("brown-out reset {}", on(word & layout.boren != 0)));
    }
    if layout.lvp != 0 && word & layout.lvp != 0 {
        let pin = part.chip.pins.get(usize::from(layout.pgm)).map_or("PGM", |pin| pin.name);
        list.push(format!("{pin} is PGM, no port (LVP)"));
    }
    list.join(", ")
}
