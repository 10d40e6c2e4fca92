//! Interface between the compiler and its back ends: the target, the job and the built image.

use diag::Severity;
use emu_core::chip::Chip;
use ladder::ElementId;

use crate::CodegenError;
use crate::ir::{Ir, IrPwm};
use crate::map::{CellLocation, Ratio, SpecialPin};
use crate::pins::AssignedPin;

/// A chip that the compiler supports.
#[derive(Debug)]
pub struct CompileTarget {
    /// Description of the chip.
    pub chip: &'static Chip,
    /// Pins that a program can use, in order of assignment; those with a second function come last.
    pub pins: &'static [&'static str],
    /// Transmit and receive pin of the serial line.
    pub uart: Option<(&'static str, &'static str)>,
    /// Pins that can be PWM outputs; the first one is that of an output without a pin of its own.
    pub pwm: &'static [PwmPin],
    /// Data and clock pin of the I2C bus.
    pub i2c: Option<(&'static str, &'static str)>,
    /// Pins of the SPI bus: select, clock, data out, data in.
    pub spi: Option<[&'static str; 4]>,
    /// Pins with a converter channel, and the channel.
    pub adc: &'static [(&'static str, u8)],
    /// Size of the EEPROM in bytes; 0 if there is none.
    pub eeprom: u16,
    /// Function of the back end that builds an image.
    pub build: fn(&CompileJob<'_>) -> Result<BuiltImage, BuildRefusal>,
}

impl CompileTarget {
    /// True if the chip has timers and counters as modules, which lowering then keeps.
    #[must_use]
    pub fn has_modules(&self) -> bool {
        self.chip.is_bit_controller()
    }

    /// True if a pin can be an output (`output`) or an input. Only controllers with channels have pins that
    /// cannot be both.
    #[must_use]
    pub fn can_use_pin(&self, pin: &str, output: bool) -> bool {
        !self.chip.is_bit_controller() || pin.starts_with('E') == output
    }
}

/// A pin that can be a PWM output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PwmPin {
    /// The pin.
    pub pin: &'static str,
    /// The timer that makes its period: pins of one timer have one frequency.
    pub timer: u8,
    /// The channel of the timer: 0 is A and 1 is B on an AVR; on a PIC16 it is the number of the CCP module.
    pub channel: u8,
}

impl PwmPin {
    /// A pin of a channel.
    #[must_use]
    pub const fn new(pin: &'static str, timer: u8, channel: u8) -> PwmPin {
        PwmPin { pin, timer, channel }
    }
}

/// Refuses two PWM outputs with different frequencies at pins of one timer.
///
/// # Errors
/// The refusal names both elements.
pub fn check_pwm_timers(job: &CompileJob<'_>) -> Result<(), BuildRefusal> {
    let outputs: Vec<(&IrPwm, PwmPin)> = job.pwm_outputs().collect();
    for (n, (output, at)) in outputs.iter().enumerate() {
        let earlier = outputs.iter().take(n);
        let other = earlier.into_iter().find(|(other, of)| of.timer == at.timer && other.hertz != output.hertz);
        let Some((other, of)) = other else { continue };
        let elsewhere: Vec<&str> =
            job.target.pwm.iter().filter(|pin| pin.timer != at.timer).map(|pin| pin.pin).collect();
        let elsewhere = match elsewhere.is_empty() {
            true => String::new(),
            false => format!(", or put one of them at {}", elsewhere.join(" or ")),
        };
        return Err(BuildRefusal::Unsupported {
            cause: format!(
                "{} at {} is to have {} Hz, but {} at {} has {} Hz in {}, and timer {} of {} makes both",
                output.label(),
                at.pin,
                output.hertz,
                other.label(),
                of.pin,
                other.hertz,
                other.element,
                at.timer,
                job.target.chip.name,
            ),
            hint: format!("give both one frequency{elsewhere}"),
            element: Some(output.element),
        });
    }
    Ok(())
}

/// Input of a back end.
#[derive(Debug, Clone, Copy)]
pub struct CompileJob<'a> {
    /// Intermediate code of the scan.
    pub ir: &'a Ir,
    /// Target chip.
    pub target: &'static CompileTarget,
    /// Pins of inputs, outputs and analog inputs.
    pub pins: &'a [AssignedPin],
    /// Pins of the PWM outputs in the order of their numbers; those that are missing have the first pins of
    /// the target.
    pub pwm_pins: &'a [PwmPin],
    /// Clock frequency in Hz, above 0.
    pub clock_hz: u64,
    /// Time of a scan in microseconds, above 0.
    pub cycle_us: u64,
    /// Rate of the serial line in bits per second, above 0; always present if the program uses the line.
    pub baud: Option<u64>,
}

impl<'a> CompileJob<'a> {
    /// The PWM outputs with their pins.
    pub fn pwm_outputs(&self) -> impl Iterator<Item = (&'a IrPwm, PwmPin)> + use<'a> {
        let (given, target) = (self.pwm_pins, self.target.pwm);
        let pin = move |number: usize| given.get(number).or(target.get(number)).copied();
        self.ir.pwms.iter().enumerate().filter_map(move |(number, output)| Some((output, pin(number)?)))
    }

    /// What the I2C bus needs outside of the chip, if the program uses it.
    #[must_use]
    pub fn bus_needs(&self) -> Vec<PinNeed> {
        let (Some((data, clock)), Some(_)) = (self.target.i2c, self.ir.buses.i2c) else { return Vec::new() };
        vec![PinNeed {
            severity: Severity::Note,
            cause: format!("the I2C bus is at {data} (SDA) and {clock} (SCL), which only pull their lines low"),
            hint: "each line needs a resistor to the supply, such as 4.7 kOhm; many modules have them",
        }]
    }

    /// Pins of the buses that the program uses.
    pub fn bus_pins(&self) -> impl Iterator<Item = &'static str> {
        let i2c = self.target.i2c.filter(|_| self.ir.buses.i2c.is_some());
        let spi = self.target.spi.filter(|_| self.ir.buses.spi.is_some());
        i2c.into_iter().flat_map(|(data, clock)| [data, clock]).chain(spi.into_iter().flatten())
    }

    /// Mask of the bits of a port whose pins symbols or peripherals of the program use, or that no program
    /// can use.
    #[must_use]
    pub fn used_pins(&self, letter: char) -> u8 {
        let (ir, target) = (self.ir, self.target);
        let mask = |pin: &str| {
            let bit = pin.chars().nth(2).and_then(|digit| digit.to_digit(8));
            bit.filter(|_| pin.chars().nth(1) == Some(letter)).map_or(0, |bit| 1_u8 << bit)
        };
        let usable = target.pins.iter().fold(0, |all, pin| all | mask(pin));
        let uart = target.uart.iter().flat_map(|&(transmit, receive)| {
            [(ir.uart.send, transmit), (ir.uart.receive, receive)]
                .into_iter()
                .filter(|(used, _)| *used)
                .map(|(_, pin)| pin)
        });
        let pins = self.pins.iter().map(|pin| pin.pin);
        let used = pins.chain(uart).chain(self.bus_pins()).chain(self.pwm_outputs().map(|(_, pin)| pin.pin));
        used.fold(!usable, |all, pin| all | mask(pin))
    }
}

/// Reason for which no image can be built.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum BuildRefusal {
    /// The code does not fit program memory.
    CodeTooLarge {
        /// Size of the code in bytes.
        needed: u64,
        /// Size of program memory in bytes.
        available: u64,
        /// Size of each rung in bytes, by its index from 0.
        rungs: Vec<u64>,
    },
    /// The data do not fit the RAM.
    RamTooSmall {
        /// Number of bytes needed for data and stack.
        needed: u64,
        /// Size of the RAM in bytes.
        available: u64,
    },
    /// No timer can pace the period.
    PeriodOutOfRange {
        /// Shortest possible period in microseconds.
        shortest: u64,
        /// Longest possible period in microseconds.
        longest: u64,
    },
    /// The serial line cannot have the requested rate.
    BaudOutOfRange {
        /// Nearest possible rate in bits per second.
        nearest: u64,
    },
    /// The PWM output cannot have the requested frequency.
    PwmOutOfRange {
        /// Requested frequency in Hz.
        hertz: u64,
        /// Nearest possible frequency in Hz.
        nearest: u64,
    },
    /// The chip does not support something else that the program needs.
    Unsupported {
        /// Description of the problem.
        cause: String,
        /// Hint for the user.
        hint: String,
        /// Element that causes the refusal, if there is one.
        element: Option<ElementId>,
    },
    /// Several reasons of the kinds above.
    Several(Vec<BuildRefusal>),
    /// An internal error of the compiler.
    Internal(CodegenError),
}

/// A position in the code that the map or the listing needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CodeMark {
    /// Start of a part of the image outside of rungs, with its title.
    Section(&'static str),
    /// The timer starts at the end of the next instruction.
    TimerStart,
    /// Start of the poll loop, which waits for the match.
    PollLoop,
    /// First instruction of a scan.
    ScanStart,
    /// Start of a rung, by its index from 0.
    Rung(u32),
    /// Start of an element.
    Element(ElementId),
    /// Start of an operation of a rung, for listings of unoptimised code.
    ///
    /// If a back end sets no such marks, the listing shows the operations per element.
    Step {
        /// Index of the rung, from 0.
        rung: u32,
        /// Index of the operation in its steps, from 0.
        step: u32,
    },
    /// End of the last rung.
    RungsEnd,
    /// Last instruction of a scan.
    ScanEnd,
    /// Position after the scan.
    AfterScan,
}

/// One instruction, or one line of data, of a finished image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageLine {
    /// Address in words of the chip.
    pub addr: u32,
    /// Words of the line.
    pub words: Vec<u16>,
    /// Text from the chip's disassembler; empty for data.
    pub text: String,
    /// Target of a branch, jump or call, in words of the chip.
    pub target: Option<u32>,
}

/// A finished image with its properties. Code addresses count words of the chip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BuiltImage {
    /// Content of the HEX file: byte address in the file, and bytes.
    pub segments: Vec<(u32, Vec<u8>)>,
    /// Lines of code, sorted by address.
    pub lines: Vec<ImageLine>,
    /// Marks, sorted by address.
    pub marks: Vec<(CodeMark, u32)>,
    /// Place of each bit cell.
    pub bit_places: Vec<CellLocation>,
    /// Place of each word cell.
    pub word_places: Vec<CellLocation>,
    /// Time of a scan in machine cycles.
    pub period: Ratio,
    /// Shortest period in machine cycles.
    pub shortest_period_cycles: u64,
    /// Machine cycles per tick of the pacing timer.
    pub tick_cycles: u32,
    /// Maximum machine cycles from a match to the first instruction of its scan.
    pub poll_cycles: u64,
    /// Longest path of a scan in machine cycles, from its first instruction back to the poll loop.
    pub worst_scan_cycles: u64,
    /// Longest path of each rung in machine cycles.
    pub rung_cycles: Vec<u64>,
    /// Number of bytes of RAM in use, without the stack.
    pub ram_bytes: u32,
    /// Required fuses or configuration words, one line each.
    pub fuses: Vec<String>,
    /// Pins with a special function, with their parameters.
    pub specials: Vec<SpecialPin>,
    /// What pins need outside of the chip.
    pub pin_needs: Vec<PinNeed>,
}

/// Something that a pin needs outside of the chip, such as a resistor at an output that cannot drive high.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PinNeed {
    /// [`Severity::Warning`] if the pin cannot do its job without it, [`Severity::Note`] if many circuits
    /// have it anyway.
    pub severity: Severity,
    /// The pin and what it lacks.
    pub cause: String,
    /// What to add or to choose.
    pub hint: &'static str,
}

impl PinNeed {
    /// Returns the need of the inputs that `lacks_pull_up` selects; `None` if it selects none. Without a
    /// pull-up an open input floats: its level is that of the last charge.
    pub fn of_floating_inputs(pins: &[AssignedPin], lacks_pull_up: impl Fn(&AssignedPin) -> bool) -> Option<PinNeed> {
        let floating = pins.iter().filter(|pin| !pin.output && !pin.analog && lacks_pull_up(pin));
        let names: Vec<String> = floating.map(|pin| format!("{}={}", pin.name, pin.pin)).collect();
        (!names.is_empty()).then(|| PinNeed {
            severity: Severity::Note,
            cause: format!("inputs without a pull-up, which float when nothing drives them: {}", names.join(" ")),
            hint: "a switch there needs a resistor to the supply or to ground",
        })
    }
}
