//! The flags of `emu run` that belong to the PIC16 family.

use clap::{Args, ValueEnum};
use emu_core::chip::{Chip, Family};
use emu_core::image::Image;
use emu_debug::{place, time};
use emu_pic16::chips::{self, Oscillator, Part};
use emu_pic16::{Corner, Options};

use crate::fail::Failure;
use crate::output;

/// Bits of a word of program memory and of a configuration word.
const WORD: u32 = 0x3FFF;

/// Word address at which the memory `config` begins (DS33023, section 27).
const CONFIG: u16 = 0x2000;

/// The flags.
#[derive(Debug, Args)]
#[group(id = "pic16")]
#[command(next_help_heading = "Only for the PIC16 family")]
pub struct Flags {
    /// The configuration word at 2007h, in place of that of the image: 0x3F3A.
    #[arg(long, value_name = "WORD", value_parser = word)]
    config: Option<u16>,
    /// Which of the times that data sheets give in bounds a run takes: of the watchdog, the power-up timer, writes to EEPROM
    /// and flash, the ADC's own oscillator, and the brown-out voltage. Default: typ.
    #[arg(long, value_name = "CORNER", hide_possible_values = true)]
    corner: Option<Bound>,
    /// The crystal at timer 1's oscillator: 32.768kHz, 100kHz, or none. Default: 32.768kHz.
    #[arg(long, value_name = "HZ", value_parser = crystal)]
    timer1_crystal: Option<Crystal>,
}

/// See [`Corner`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Bound {
    /// The shortest times.
    Min,
    /// The typical ones.
    Typ,
    /// The longest.
    Max,
}

/// The crystal of timer 1, in Hz, if there is one (a type of its own, since clap takes an option for a flag that may lack).
#[derive(Debug, Clone, Copy)]
struct Crystal(Option<u64>);

fn word(text: &str) -> Result<u16, String> {
    // Everybody writes these words in hexadecimal, so digits alone are not taken for a decimal number.
    let digits = text.trim_end_matches(['h', 'H']);
    if !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
        return Err(format!("a configuration word is written with 0x in front: 0x{}", digits.to_ascii_uppercase()));
    }
    let word = place::number(text).filter(|&word| word <= WORD);
    word.map(|word| word as u16).ok_or_else(|| format!("a configuration word is 0x0 to 0x{WORD:X}, as in 0x3F3A"))
}

fn crystal(text: &str) -> Result<Crystal, String> {
    if text == "none" { Ok(Crystal(None)) } else { time::hertz(text).map(|hz| Crystal(Some(hz))) }
}

impl Flags {
    /// How the machine of `chip` is wired, with an oscillator of `hz`, waiting for it where `start_up` says so; refuses flags that are not for the chip.
    pub fn options(&self, chip: &Chip, hz: u64, start_up: bool) -> Result<Options, Failure> {
        let part = part(chip);
        let can = |able: fn(&Part) -> bool| part.is_some_and(able);
        let given = [
            ("--config", self.config.is_some(), part.is_some(), ""),
            ("--corner", self.corner.is_some(), part.is_some(), ""),
            ("--timer1-crystal", self.timer1_crystal.is_some(), can(|part| part.timers), " with timer 1"),
        ];
        if let Some((flag, _, _, which)) = given.into_iter().find(|(_, given, can, _)| *given && !can) {
            let which = if part.is_some() { which } else { "" };
            let why = format!("{flag} is for chips of the PIC16 family{which}; {} is none", chip.name);
            return Err(Failure::Usage(why));
        }
        let defaults = Options::default();
        Ok(Options {
            hz,
            corner: match self.corner {
                None => defaults.corner,
                Some(Bound::Min) => Corner::Min,
                Some(Bound::Typ) => Corner::Typ,
                Some(Bound::Max) => Corner::Max,
            },
            config: self.config,
            start_up,
            timer1_hz: self.timer1_crystal.map_or(defaults.timer1_hz, |crystal| crystal.0),
            ..defaults
        })
    }
}

/// What only this family's rows have.
fn part(chip: &Chip) -> Option<&'static Part> {
    chips::part(chip.name).filter(|_| chip.family == Family::Pic16)
}

/// Says on standard error which settings a chip has whose image brings no configuration word and for which none was given.
pub fn warn(chip: &Chip, image: &Image, options: &Options) {
    let Some(part) = part(chip).filter(|_| options.config.is_none()) else { return };
    let (Some(&addr), Some(&erased)) = (part.config.words.first(), part.config.erased.first()) else { return };
    let first = 2 * u32::from(addr - CONFIG);
    if image.bytes_in("config").any(|(at, _)| at == first) {
        return;
    }
    output::tell(&format!(
        "note: the image has no configuration word, so it is erased, 0x{erased:04X}: {}\n  \
         hint: --config WORD gives one; in the program __CONFIG or #pragma config does\n",
        settings(part, erased)
    ));
}

/// What a configuration word says, in words.
fn settings(part: &Part, word: u16) -> String {
    let layout = &part.config;
    let oscillator = match layout.oscillator(word) {
        Oscillator::Lp => "LP crystal",
        Oscillator::Xt => "XT crystal",
        Oscillator::Hs => "HS crystal",
        Oscillator::Ec => "clock from outside",
        Oscillator::Rc => "RC oscillator",
        Oscillator::Internal => "oscillator on the chip",
    };
    let on = |on: bool| if on { "on" } else { "off" };
    let mut list = vec![
        format!("watchdog {}", on(word & layout.wdte != 0)),
        oscillator.to_owned(),
        format!("power-up timer {}", on(layout.waits_at_power_on(word))),
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
