//! What a program tells about values worth trying: its constants, presets and limits, and their neighbours.

use emu_core::rng::Rng;
use ladder::symbols::uses;
use ladder::{Element, Operand, Program, SymbolKind};
use ladder_eval::Evaluator;

/// Values at which 16-bit arithmetic on 8-bit machines goes wrong.
#[rustfmt::skip]
const BOUNDARIES: &[i32] = &[
    0, 1, -1, 2, -2, 100, 127, 128, -128, -129, 255, 256, 257, -255, -256, -257, 0x7FFF, -0x8000, 0x7FFE, -0x7FFF,
    0x7F00, 0x00FE,
];

/// Symbols by what may be done to them, and the values worth writing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Hints {
    /// Inputs, by index of the evaluator.
    pub inputs: Vec<usize>,
    /// Relays and outputs.
    pub bits: Vec<usize>,
    /// Timers, counters, variables.
    pub integers: Vec<usize>,
    /// Per symbol: constants that meet it in one element, and their neighbours.
    own: Vec<Vec<i32>>,
    /// All constants of the program, their neighbours and negatives.
    all: Vec<i32>,
}

impl Hints {
    pub fn new(program: &Program, eval: &Evaluator) -> Hints {
        let symbols = eval.symbols();
        let which = |wanted: fn(SymbolKind) -> bool| -> Vec<usize> {
            (0..symbols.len()).filter(|&i| symbols.get(i).is_some_and(|s| wanted(s.kind))).collect()
        };
        let mut own = vec![Vec::new(); symbols.len()];
        let mut all = Vec::new();
        for (_, element, _) in program.elements() {
            let constants = constants(program, element);
            uses(element, &mut |name, _| {
                if let Some(own) = eval.index(name).and_then(|i| own.get_mut(i)) {
                    constants.iter().for_each(|&c| own.extend([c - 1, c, c + 1]));
                }
            });
            // A counter turns over at the ends of 16 bits, too.
            if let Element::Counter { name, .. } = element
                && let Some(own) = eval.index(name).and_then(|i| own.get_mut(i))
            {
                own.extend([i32::from(i16::MIN), i32::from(i16::MAX)]);
            }
            constants.iter().for_each(|&c| all.extend([c - 1, c, c + 1, -c]));
        }
        for values in own.iter_mut().chain([&mut all]) {
            values.sort_unstable();
            values.dedup();
        }
        Hints {
            inputs: which(|kind| kind == SymbolKind::Input),
            bits: which(|kind| kind.is_bit() && kind != SymbolKind::Input),
            integers: which(|kind| !kind.is_bit()),
            own,
            all,
        }
    }

    /// A value for the integer `symbol`: mostly one at which something may turn over.
    pub fn value(&self, symbol: usize, eval: &Evaluator, rng: &mut Rng) -> i32 {
        let own = self.own.get(symbol).map_or(&[][..], Vec::as_slice);
        let drawn = match rng.below(16) {
            0..7 => pick(own, rng).or_else(|| pick(BOUNDARIES, rng)),
            7..10 => pick(BOUNDARIES, rng),
            10..12 => pick(&self.all, rng),
            // Another integer's value or its neighbour, for those that are compared with each other.
            12..14 => pick(&self.integers, rng).map(|other| eval.get(other) + rng.below(3) as i32 - 1),
            _ => None,
        };
        i32::from(drawn.unwrap_or_else(|| rng.next_u64() as i32) as i16)
    }
}

fn pick<T: Copy>(from: &[T], rng: &mut Rng) -> Option<T> {
    from.get(rng.below(from.len() as u64) as usize).copied()
}

/// The constants of an element, with a timer's delay as the scans that it counts.
pub(crate) fn constants(program: &Program, element: &Element) -> Vec<i32> {
    let value = |o: &Operand| match o {
        Operand::Const { value, .. } => i32::try_from(*value).ok(),
        Operand::Var(_) => None,
    };
    match element {
        Element::Timer { delay, .. } => {
            let Operand::Const { value, .. } = delay else { return Vec::new() };
            let scans = i64::try_from(program.settings.cycle_us).ok().and_then(|cycle| value.checked_div(cycle));
            scans.and_then(|n| i32::try_from(n - 1).ok()).into_iter().collect()
        }
        Element::Counter { max, .. } => value(max).into_iter().collect(),
        Element::Move { src, .. } => value(src).into_iter().collect(),
        Element::Math { op1, op2, .. } | Element::Compare { op1, op2, .. } => {
            [op1, op2].into_iter().filter_map(value).collect()
        }
        _ => Vec::new(),
    }
}
