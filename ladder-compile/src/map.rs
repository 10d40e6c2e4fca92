//! Map of an image: places of all symbols, elements and pins, for tools. `docs/compile.md` describes its
//! JSON.

use ladder::SymbolKind;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Version of the map's JSON format.
pub const SCHEMA: u32 = 2;

/// Places of all parts of a compiled program.
///
/// Code addresses are byte addresses of program memory, and ends are exclusive. On a chip with words wider
/// than a byte, a byte address is the word address times
/// [`Chip::word_bytes`](emu_core::chip::Chip::word_bytes).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageMap {
    /// Version of this format, [`SCHEMA`].
    pub schema: u32,
    /// Name of the chip.
    pub mcu: String,
    /// Clock frequency in Hz that the image was compiled for.
    pub clock_hz: u64,
    /// Time of one scan in machine cycles, as a reduced fraction; the k-th match is at k times this, rounded
    /// down.
    pub cycle: Ratio,
    /// Machine cycles per tick of the pacing timer: a match is at most one tick early and never late.
    pub tick: u32,
    /// Address of the instruction at whose end the pacing timer starts.
    pub timer_start: u32,
    /// Address of the loop that waits for the match.
    pub poll: u32,
    /// Maximum number of machine cycles from a match to the first instruction of its scan.
    ///
    /// It covers one iteration of the loop that just missed the match and the test that detects it.
    pub poll_cycles: u32,
    /// Address of the first instruction of a scan, executed once per scan before the inputs are latched.
    pub scan_start: u32,
    /// Address of the last instruction of a scan, executed once per scan after the outputs are written.
    pub scan_end: u32,
    /// Longest path from `scan_start` back to `poll`, in machine cycles.
    pub worst_scan_cycles: u32,
    /// Size of the image in bytes.
    pub code_bytes: u32,
    /// Number of bytes of RAM that hold data, without the stack.
    pub ram_bytes: u32,
    /// Machine cycles of the shortest period that remain after the longest scan and the poll.
    pub slack_cycles: u64,
    /// Pins with a special function: neither input nor output.
    pub specials: Vec<SpecialPin>,
    /// EEPROM cells of the program.
    pub eeprom: Vec<EepromMap>,
    /// All rungs, comments included.
    pub rungs: Vec<RungMap>,
    /// All elements, comments included, in text order.
    pub elements: Vec<ElementMap>,
    /// All symbols.
    pub symbols: Vec<SymbolMap>,
    /// All pins that the program uses.
    pub pins: Vec<PinMap>,
    /// Fuse settings that the image needs, one line each.
    pub fuses: Vec<String>,
}

/// A fraction in lowest terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ratio {
    /// Numerator.
    pub num: u64,
    /// Denominator, at least 1.
    pub den: u64,
}

/// Code range of a rung.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RungMap {
    /// Number of the rung, from 1.
    pub rung: u32,
    /// Address of its first byte.
    pub start: u32,
    /// Address after its last byte.
    pub end: u32,
    /// Longest path through the rung in machine cycles.
    pub worst_cycles: u64,
}

/// A pin with a special function: neither input nor output.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "job")]
pub enum SpecialPin {
    /// Transmit pin of the serial line.
    Transmit {
        /// Pin.
        pin: String,
        /// Requested rate in bits per second.
        baud: u64,
        /// Machine cycles per bit, as a fraction.
        bit: Ratio,
    },
    /// Receive pin of the serial line.
    Receive {
        /// Pin.
        pin: String,
        /// Requested rate in bits per second.
        baud: u64,
    },
    /// Pin of an analog input.
    Analog {
        /// Pin.
        pin: String,
        /// Symbol.
        name: String,
    },
    /// Pins of the I2C bus.
    I2c {
        /// Data pin.
        pin: String,
        /// Clock pin.
        clock: String,
        /// Machine cycles per bit.
        bit: Ratio,
    },
    /// Pins of the SPI bus.
    Spi {
        /// Pin that selects the device.
        pin: String,
        /// Clock pin.
        clock: String,
        /// Pin of the bytes that are sent.
        out: String,
        /// Pin of the bytes that are received.
        input: String,
        /// Machine cycles per bit.
        bit: Ratio,
    },
    /// Pin of a PWM output.
    Pwm {
        /// Pin.
        pin: String,
        /// Name of the output, if the program gives one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        /// Requested frequency in Hz.
        hertz: u64,
        /// Machine cycles per period, as a fraction.
        period: Ratio,
        /// Number of steps per period; a duty cycle is accurate to one step.
        steps: u32,
    },
}

/// EEPROM cells of a variable.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EepromMap {
    /// Name of the variable.
    pub name: String,
    /// Address of the lowest cell.
    pub addr: u16,
    /// Number of cells.
    pub bytes: u8,
}

/// Code range of an element.
///
/// The ranges of a rung's elements are contiguous. A range is empty if there is nothing to do: for COMMENT,
/// SHORT, and elements whose effect is known at compile time, such as a contact after OPEN.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ElementMap {
    /// Number of the rung, from 1.
    pub rung: u32,
    /// Number of the element within the rung in text order, from 1.
    pub element: u32,
    /// Text of the element as in a `.ld` file.
    pub text: String,
    /// Address of its first byte.
    pub start: u32,
    /// Address after its last byte.
    pub end: u32,
}

/// Place of a symbol between scans.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SymbolMap {
    /// Name of the symbol.
    pub name: String,
    /// Kind of the symbol.
    #[serde(deserialize_with = "kind")]
    pub kind: SymbolKind,
    /// Place: for an input its latched image, for an output the image that is written to the port.
    pub place: CellLocation,
}

/// A place in a memory space of the chip.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CellLocation {
    /// One bit.
    Bit {
        /// Memory space: AVR `data` (addresses below 0x20 are the registers), 8051 `idata`, PIC16 `data`,
        /// AP101 `i`, `e`, `m` and `r` (one bit per address).
        space: String,
        /// Address of the byte.
        addr: u32,
        /// Number of the bit in the byte, 0 to 7.
        bit: u8,
    },
    /// A signed integer in little-endian order.
    Word {
        /// Memory space of the chip.
        space: String,
        /// Address of the lowest byte.
        addr: u32,
        /// Width in bytes.
        bytes: u8,
    },
}

/// Pin of a symbol.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PinMap {
    /// Name of the symbol.
    pub name: String,
    /// Name of the pin, such as `PB0`.
    pub pin: String,
    /// `in` (with pull-up) or `out`.
    pub direction: String,
}

fn kind<'de, D: Deserializer<'de>>(from: D) -> Result<SymbolKind, D::Error> {
    use SymbolKind::{Adc, Counter, Input, Output, Relay, Timer, Variable};
    let name = String::deserialize(from)?;
    let all = [Input, Output, Relay, Timer, Counter, Adc, Variable];
    let named = |kind: &SymbolKind| serde_json::to_value(kind).is_ok_and(|v| v == name.as_str());
    all.into_iter().find(named).ok_or_else(|| D::Error::custom(format!("no kind of symbol is called `{name}`")))
}
