//! The symbols of a program that a stimulus can set, and the values worth trying for its integers: its
//! constants, presets and limits, and their neighbours.

use emu_core::rng::Rng;
use ladder::symbols::for_each_symbol_use;
use ladder::{Element, LadderDialect, LadderOperand, LadderProgram, LdFormat, ProgramElement, SymbolKind, UnaryOp};
use ladder_eval::Evaluator;

use crate::chip::{peripherals, port_pins};

/// Values at which arithmetic on 8-bit machines tends to fail, in addition to the limits of the widths.
#[rustfmt::skip]
const BOUNDARIES: &[i32] = &[
    0, 1, -1, 2, -2, 100, 127, 128, -128, -129, 255, 256, 257, -255, -256, -257, 0x7F00, 0x00FE,
];

/// The limits of two to four bytes, and their neighbours.
const WIDTH_ENDS: [&[i32]; 3] = [
    &[0x7FFF, -0x8000, 0x7FFE, -0x7FFF],
    &[0x7F_FFFF, -0x80_0000, 0x7F_FFFE, -0x7F_FFFF, 0x8000, -0x8001, 0xFFFF, 0x1_0000, -0x1_0000],
    &[i32::MAX, i32::MIN, i32::MAX - 1, i32::MIN + 1, 0xFF_FFFF, 0x100_0000, 0x80_0000, -0x80_0001],
];

/// Largest result of an A/D conversion.
const MAX_CONVERSION: i32 = 1023;

/// Truncates `value` to `bytes` bytes, as two's complement with sign extension.
pub(crate) fn truncate_to_bytes(value: i64, bytes: u8) -> i32 {
    let unused = 64 - 8 * u32::from(bytes.clamp(1, 4));
    (value << unused >> unused) as i32
}

/// The symbols of a program by the way in which a stimulus can set them, and the values worth trying.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct StimulusSymbols {
    /// Symbol indices of the inputs.
    pub inputs: Vec<usize>,
    /// Symbol indices of relays and outputs.
    pub bits: Vec<usize>,
    /// Symbol indices of timers, counters and variables.
    pub integers: Vec<usize>,
    /// Symbol indices of analog inputs.
    pub analog: Vec<usize>,
    /// True if the program receives bytes.
    pub receives: bool,
    /// Width of each symbol in bytes, 0 for a bit.
    pub bytes: Vec<u8>,
    /// Whether each symbol can be written on the chip; true for all by default.
    pub writable: Vec<bool>,
    /// Per symbol: the constants that occur with it in one element, and their neighbours.
    own_values: Vec<Vec<i32>>,
    /// All constants of the program, their neighbours and negatives.
    all_values: Vec<i32>,
}

impl StimulusSymbols {
    /// Collects the symbols and constants of a program.
    pub(crate) fn new(program: &LadderProgram, eval: &Evaluator) -> StimulusSymbols {
        let symbols = eval.symbols();
        let symbols_of_kind = |wanted: fn(SymbolKind) -> bool| -> Vec<usize> {
            (0..symbols.len()).filter(|&i| symbols.get(i).is_some_and(|s| wanted(s.kind))).collect()
        };
        let bytes: Vec<u8> = symbols.iter().map(|symbol| symbol.bytes).collect();
        let mut own_values = vec![Vec::new(); symbols.len()];
        let mut all = Vec::new();
        for ProgramElement { element, .. } in program.elements() {
            let constants = element_constants(program, element);
            for_each_symbol_use(element, &mut |name, _| {
                if let Some(own_values) = eval.index(name).and_then(|i| own_values.get_mut(i)) {
                    constants.iter().for_each(|&c| own_values.extend([c.saturating_sub(1), c, c.saturating_add(1)]));
                }
            });
            // A counter also wraps at the limits of its width.
            if let Element::Counter { name, .. } = element
                && let Some(index) = eval.index(name)
                && let Some(own_values) = own_values.get_mut(index)
            {
                let width = bytes.get(index).copied().unwrap_or(0);
                own_values.extend(
                    [0, -1].map(|n| truncate_to_bytes((1i64 << (8 * u32::from(width.clamp(1, 4)) - 1)) + n, width)),
                );
            }
            let around = |&c: &i32| [c.saturating_sub(1), c, c.saturating_add(1), c.saturating_neg()];
            all.extend(constants.iter().flat_map(around));
        }
        for values in own_values.iter_mut().chain([&mut all]) {
            values.sort_unstable();
            values.dedup();
        }
        StimulusSymbols {
            inputs: symbols_of_kind(|kind| kind == SymbolKind::Input),
            bits: symbols_of_kind(|kind| kind.is_bit() && kind != SymbolKind::Input),
            integers: symbols_of_kind(|kind| !kind.is_bit()),
            analog: eval.adc_symbols().collect(),
            receives: peripherals::serial_use(program).receives,
            writable: symbols.iter().map(|symbol| !port_pins::is_shared(program, &symbol.name)).collect(),
            bytes,
            own_values,
            all_values: all,
        }
    }

    /// A random value for the integer `symbol`, mostly near a boundary.
    pub(crate) fn random_value(&self, symbol: usize, eval: &Evaluator, rng: &mut Rng) -> i32 {
        let own_values = self.own_values.get(symbol).map_or(&[][..], Vec::as_slice);
        let bytes = self.bytes.get(symbol).copied().unwrap_or(2);
        let boundary = |rng: &mut Rng| match usize::from(bytes).checked_sub(2).filter(|_| rng.one_in(4)) {
            Some(extra_bytes) => {
                WIDTH_ENDS.get(rng.below(extra_bytes as u64 + 1) as usize).and_then(|ends| pick_random(ends, rng))
            }
            None => pick_random(BOUNDARIES, rng),
        };
        let drawn = match rng.below(16) {
            0..7 => pick_random(own_values, rng).or_else(|| boundary(rng)),
            7..10 => boundary(rng),
            10..12 => pick_random(&self.all_values, rng),
            // The value of another integer or a neighbour of it, for integers that are compared with each
            // other.
            12..14 => {
                pick_random(&self.integers, rng).map(|other| eval.get(other).wrapping_add(rng.below(3) as i32 - 1))
            }
            _ => None,
        };
        truncate_to_bytes(drawn.unwrap_or_else(|| rng.next_u64() as i32).into(), bytes)
    }

    /// A random result of an A/D conversion, mostly an end of the scale or a value near a boundary.
    pub(crate) fn random_conversion(&self, symbol: usize, rng: &mut Rng) -> u16 {
        let own_values = self.own_values.get(symbol).map_or(&[][..], Vec::as_slice);
        let drawn = match rng.below(8) {
            0..3 => pick_random(own_values, rng),
            3 => pick_random(&self.all_values, rng),
            4 => Some(0),
            5 => Some(MAX_CONVERSION),
            _ => None,
        };
        drawn
            .filter(|value| (0..=MAX_CONVERSION).contains(value))
            .map_or_else(|| rng.below(MAX_CONVERSION as u64 + 1) as u16, |v| v as u16)
    }

    /// A random byte for the receiver, mostly a constant of the program, a boundary value, or a printable
    /// character.
    pub(crate) fn random_byte(&self, rng: &mut Rng) -> u8 {
        let drawn = match rng.below(8) {
            0..4 => pick_random(&self.all_values, rng).map(|value| value as u8),
            4 => pick_random(&[0, 1, 0x7F, 0x80, 0xFF], rng),
            5 => Some(b' ' + rng.below(95) as u8),
            _ => None,
        };
        drawn.unwrap_or_else(|| rng.next_u64() as u8)
    }
}

fn pick_random<T: Copy>(from: &[T], rng: &mut Rng) -> Option<T> {
    from.get(rng.below(from.len() as u64) as usize).copied()
}

/// The constants of an element; the delay of a timer is given as the number of scans that it counts.
pub(crate) fn element_constants(program: &LadderProgram, element: &Element) -> Vec<i32> {
    let value = |o: &LadderOperand| match o {
        LadderOperand::Const { value, .. } => i32::try_from(*value).ok(),
        LadderOperand::Var(_) => None,
    };
    match element {
        Element::Timer { delay, adjust, .. } => {
            let LadderOperand::Const { value: delay, .. } = delay else { return Vec::new() };
            let scans = i64::try_from(program.settings.cycle_us).ok().and_then(|cycle| delay.checked_div(cycle));
            let adjust = adjust.as_ref().and_then(value).unwrap_or(match program.format {
                LdFormat::V01 => -1,
                LdFormat::V02 if program.dialect == LadderDialect::Ldmicro23 => -1,
                LdFormat::V02 => 0,
            });
            scans.and_then(|n| i32::try_from(n + i64::from(adjust)).ok()).into_iter().collect()
        }
        Element::LookUpTable { index, values, .. } => {
            let last = i32::try_from(values.len()).unwrap_or(i32::MAX);
            value(index).into_iter().chain([0, last]).collect()
        }
        Element::PiecewiseLinear { index, points, .. } => {
            let points = points.iter().filter_map(|point| i32::try_from(point.x).ok());
            value(index).into_iter().chain(points).collect()
        }
        Element::SetPwm { duty, .. } => value(duty).into_iter().chain([0, 100]).collect(),
        Element::FormattedString { var: Some(_), .. } => vec![0, 9, 10, 99, 100, 999, 1_000, 9_999, 10_000],
        Element::Unary { op: UnaryOp::BinToBcd, .. } => vec![0, 9, 10, 99, 100, 999, 1_000, 9_999, 10_000],
        // The first and the last bits, and those behind them.
        Element::Shift { .. } | Element::BitWrite { .. } | Element::BitTest { .. } => {
            let constants = element.facts().constants.into_iter().filter_map(|value| i32::try_from(value).ok());
            constants.chain([0, 8, 16, 24, 32]).collect()
        }
        // The constants of all other elements are worth trying.
        _ => element.facts().constants.into_iter().filter_map(|value| i32::try_from(value).ok()).collect(),
    }
}
