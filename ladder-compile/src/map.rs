//! The map of an image: where everything of the program is, for tools. Its JSON is described in `docs/compile.md`.

use ladder::SymbolKind;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Version of the map's JSON.
pub const SCHEMA: u32 = 2;

/// Where everything of a compiled program is. Code addresses are byte addresses of program memory, ends are excluded; on a
/// chip whose word is wider than a byte that is the address of the word times [`Chip::word_bytes`](emu_core::chip::Chip::word_bytes).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImageMap {
    /// Version of this shape, [`SCHEMA`].
    pub schema: u32,
    /// The chip.
    pub mcu: String,
    /// Clock that the image was compiled for, in Hz.
    pub clock_hz: u64,
    /// Time of one scan in machine cycles, a reduced fraction: the k-th match comes at its k-fold, rounded down.
    pub cycle: Ratio,
    /// Machine cycles per tick of the pacing timer: a match is at most one tick before its exact moment, never after it.
    pub tick: u32,
    /// The instruction at whose end the pacing timer starts.
    pub timer_start: u32,
    /// The loop that waits for the match.
    pub poll: u32,
    /// The longest time in machine cycles from a match to the first instruction of its scan: one turn of the loop that just
    /// missed the match, and the look that sees it.
    pub poll_cycles: u32,
    /// First instruction of a scan, executed once per scan, before the inputs are latched.
    pub scan_start: u32,
    /// Last instruction of a scan, reached once per scan, after the outputs were written.
    pub scan_end: u32,
    /// The longest path from `scan_start` back to `poll`, in machine cycles.
    pub worst_scan_cycles: u32,
    /// Bytes of the image.
    pub code_bytes: u32,
    /// Bytes of RAM that hold data, the stack not counted.
    pub ram_bytes: u32,
    /// Machine cycles that the shortest period leaves beside the longest scan and the look at the timer.
    pub slack_cycles: u64,
    /// Pins with another job than input and output.
    pub specials: Vec<SpecialPin>,
    /// Cells of the EEPROM.
    pub eeprom: Vec<EepromMap>,
    /// Every rung, comments included.
    pub rungs: Vec<RungMap>,
    /// Every element, comments included, in text order.
    pub elements: Vec<ElementMap>,
    /// Every symbol.
    pub symbols: Vec<SymbolMap>,
    /// Every pin that the program uses.
    pub pins: Vec<PinMap>,
    /// What the image needs of the chip's fuses, one line each.
    pub fuses: Vec<String>,
}

/// A fraction in lowest terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ratio {
    /// Numerator.
    pub num: u64,
    /// Denominator, above 0.
    pub den: u64,
}

/// The code of a rung.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RungMap {
    /// Number, from 1.
    pub rung: u32,
    /// First byte.
    pub start: u32,
    /// Byte after the last.
    pub end: u32,
    /// The longest path through it in machine cycles.
    pub worst_cycles: u64,
}

/// A pin with another job than input and output.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "job")]
pub enum SpecialPin {
    /// The serial line sends here.
    Transmit {
        /// Pin.
        pin: String,
        /// Speed asked for, in bits per second.
        baud: u64,
        /// Machine cycles of a bit, as a fraction.
        bit: Ratio,
    },
    /// The serial line receives here.
    Receive {
        /// Pin.
        pin: String,
        /// Speed asked for, in bits per second.
        baud: u64,
    },
    /// The converter reads a symbol here.
    Analog {
        /// Pin.
        pin: String,
        /// Symbol.
        name: String,
    },
    /// The PWM output.
    Pwm {
        /// Pin.
        pin: String,
        /// Frequency asked for, in Hz.
        hertz: u64,
        /// Machine cycles of a period, as a fraction.
        period: Ratio,
        /// Steps of a period: a duty is exact to one of them.
        steps: u32,
    },
}

/// A variable in the EEPROM.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct EepromMap {
    /// The variable.
    pub name: String,
    /// Address of its lowest cell.
    pub addr: u16,
    /// Cells.
    pub bytes: u8,
}

/// The code of an element. The ranges of a rung's elements follow each other without a gap. A range is empty where nothing
/// is left to do: COMMENT and SHORT, and elements whose effect is known beforehand, such as a contact after OPEN.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ElementMap {
    /// Number of its rung, from 1.
    pub rung: u32,
    /// Number within the rung in text order, from 1.
    pub element: u32,
    /// Its text as in a `.ld` file.
    pub text: String,
    /// First byte.
    pub start: u32,
    /// Byte after the last.
    pub end: u32,
}

/// Where a symbol is kept between scans.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SymbolMap {
    /// Name.
    pub name: String,
    /// Kind.
    #[serde(deserialize_with = "kind")]
    pub kind: SymbolKind,
    /// Place; of an input the latched image, of an output the image that is written to the port.
    pub place: CellLocation,
}

/// A place in a memory space of the chip.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CellLocation {
    /// One bit.
    Bit {
        /// Memory space of the chip: AVR `data`, in which addresses below 0x20 are the registers; 8051 `idata`; PIC16 `data`; AP101
        /// `i`, `e`, `m` and `r`, one bit an address.
        space: String,
        /// Address of its byte.
        addr: u32,
        /// Bit in the byte, 0 to 7.
        bit: u8,
    },
    /// An integer, little endian, with sign.
    Word {
        /// Memory space of the chip.
        space: String,
        /// Address of its lowest byte.
        addr: u32,
        /// Width in bytes.
        bytes: u8,
    },
}

/// A pin of the program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PinMap {
    /// Symbol.
    pub name: String,
    /// Pin, such as `PB0`.
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
