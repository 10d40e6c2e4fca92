//! What a random program is biased towards, and the names that it may use: drawn once for each program.

use emu_core::rng::Rng;
use ladder::LadderDialect;
use ladder_compile::target::CompileTarget;
use serde::{Deserialize, Serialize};

/// What a program may have, from what every family can express to what needs all parts of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProgramProfile {
    /// Contacts, coils, edges, master relay, and timers and counters each with a name of its own.
    Bits,
    /// Besides, integers: moves, arithmetic, comparisons, shift registers, tables, shared timers and counters.
    Words,
    /// Besides, bytes and strings on the serial line.
    Serial,
    /// Besides, converter, PWM output and EEPROM.
    Whole,
}

impl ProgramProfile {
    /// True when a chip can express programs of this profile.
    #[must_use]
    pub fn is_supported_by(self, target: &CompileTarget) -> bool {
        let words = !target.has_modules();
        let serial = words && target.uart.is_some();
        match self {
            ProgramProfile::Bits => true,
            ProgramProfile::Words => words,
            ProgramProfile::Serial => serial,
            ProgramProfile::Whole => serial && target.pwm.is_some() && target.adc.len() >= 2 && target.eeprom >= 64,
        }
    }
}

/// Sorts of elements that are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementSort {
    Contact,
    Compare,
    OneShot,
    Timer,
    Counter,
    Wire,
    Send,
    Receive,
    Text,
    Coil,
    Res,
    Move,
    Math,
    BitTest,
    Bits,
    Shift,
    Table,
    Curve,
    Adc,
    Pwm,
    Persist,
    Master,
}

/// The sorts, the least profile that has them, their weight, and whether they end a path to the right rail.
#[rustfmt::skip]
const SORTS: &[(ElementSort, ProgramProfile, u64, bool)] = &[
    (ElementSort::Contact, ProgramProfile::Bits,   24, false),
    (ElementSort::OneShot, ProgramProfile::Bits,    3, false),
    (ElementSort::Timer,   ProgramProfile::Bits,    5, false),
    (ElementSort::Counter, ProgramProfile::Bits,    4, false),
    (ElementSort::Wire,    ProgramProfile::Bits,    2, false),
    (ElementSort::Compare, ProgramProfile::Words,   8, false),
    (ElementSort::BitTest, ProgramProfile::Words,   4, false),
    (ElementSort::Send,    ProgramProfile::Serial,  3, false),
    (ElementSort::Receive, ProgramProfile::Serial,  3, false),
    (ElementSort::Text,    ProgramProfile::Serial,  3, false),
    (ElementSort::Coil,    ProgramProfile::Bits,   24, true),
    (ElementSort::Res,     ProgramProfile::Bits,    3, true),
    (ElementSort::Master,  ProgramProfile::Bits,    1, true),
    (ElementSort::Move,    ProgramProfile::Words,   5, true),
    (ElementSort::Math,    ProgramProfile::Words,  10, true),
    (ElementSort::Bits,    ProgramProfile::Words,  25, true),
    (ElementSort::Shift,   ProgramProfile::Words,   2, true),
    (ElementSort::Table,   ProgramProfile::Words,   3, true),
    (ElementSort::Curve,   ProgramProfile::Words,   3, true),
    (ElementSort::Adc,     ProgramProfile::Whole,   4, true),
    (ElementSort::Pwm,     ProgramProfile::Whole,   4, true),
    (ElementSort::Persist, ProgramProfile::Whole,   3, true),
];

/// Clocks in Hz and cycles in microseconds that all families can pace, and rates in bits per second that all can make at
/// that clock.
#[rustfmt::skip]
const CLOCKS_AND_CYCLES: &[(u64, u64, u64)] = &[
    (11_059_200, 10_000, 9_600),
    ( 7_372_800,  5_000, 9_600),
    ( 3_686_400, 10_000, 9_600),
    (11_059_200,  5_000, 2_400),
    ( 7_372_800, 20_000, 4_800),
    (11_059_200,  3_125, 19_200),
];

/// Those of programs without a serial line, which need no clock that a rate divides.
const PLAIN_CLOCKS_AND_CYCLES: &[(u64, u64)] =
    &[(12_000_000, 7_001), (4_000_000, 10_000), (8_000_000, 3_333), (10_000_000, 2_500)];

/// Frequencies in Hz of the PWM output that the timers of PIC16 and AVR make at each of the clocks above.
const HERTZ: &[(u64, &[u64])] =
    &[(11_059_200, &[675, 5_420, 1_350]), (7_372_800, &[450, 3_600, 900]), (3_686_400, &[450, 1_800, 225])];

/// The bias of a program, and its names.
#[derive(Debug, Clone)]
pub(super) struct ProgramStyle {
    pub profile: ProgramProfile,
    pub dialect: LadderDialect,
    pub clock_hz: u64,
    pub cycle_us: u64,
    pub baud: Option<u64>,
    pub hertz: u64,
    pub rungs: u64,
    /// Elements after which no more groups are begun.
    pub elements: u64,
    /// Most elements and groups of a series.
    pub longest: u64,
    /// Deepest nesting of groups.
    pub depth: u32,
    /// One node in so many is a group.
    pub group: u64,
    /// One operand in so many is a constant.
    pub constant: u64,
    /// Coils that latch instead of following their rung: one in so many.
    pub latch: u64,
    middle_weights: Vec<(ElementSort, u64)>,
    end_weights: Vec<(ElementSort, u64)>,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    pub relays: Vec<String>,
    pub timers: Vec<String>,
    pub counters: Vec<String>,
    pub analog: Vec<String>,
    /// Integers that are none of the above.
    pub plain_integers: Vec<String>,
    /// Everything that may be computed with.
    pub integers: Vec<String>,
}

impl ProgramStyle {
    pub(super) fn draw(rng: &mut Rng) -> ProgramStyle {
        let profile = match rng.below(12) {
            0..4 => ProgramProfile::Bits,
            4..7 => ProgramProfile::Words,
            7..9 => ProgramProfile::Serial,
            _ => ProgramProfile::Whole,
        };
        let dialect = if rng.one_in(3) { LadderDialect::Ldmicro5 } else { LadderDialect::Ldmicro23 };
        let (clock_hz, mut cycle_us, rate) = CLOCKS_AND_CYCLES[rng.below(CLOCKS_AND_CYCLES.len() as u64) as usize];
        let (mut clock_hz, baud) = (clock_hz, (profile >= ProgramProfile::Serial).then_some(rate));
        if baud.is_none() && rng.one_in(2) {
            (clock_hz, cycle_us) = PLAIN_CLOCKS_AND_CYCLES[rng.below(PLAIN_CLOCKS_AND_CYCLES.len() as u64) as usize];
        }
        // Few programs are as large as a page of code memory; they get the time that they need.
        let large = profile != ProgramProfile::Bits && rng.one_in(40);
        if large {
            (clock_hz, cycle_us) = (11_059_200, 50_000);
        }
        let mut style = ProgramStyle {
            profile,
            dialect,
            clock_hz,
            cycle_us,
            baud: baud.map(|rate| if large { 9_600 } else { rate }),
            hertz: random_hertz(clock_hz, rng),
            rungs: if large { 40 + rng.below(30) } else { 1 + rng.below(8) },
            elements: if large { 400 } else { 10 + rng.below(80) },
            longest: 1 + rng.below(4),
            depth: 1 + rng.below(4) as u32,
            group: [3, 5, 8][rng.below(3) as usize],
            constant: [2, 3, 6][rng.below(3) as usize],
            latch: [2, 4, 8][rng.below(3) as usize],
            middle_weights: Vec::new(),
            end_weights: Vec::new(),
            inputs: numbered_names("X", 1 + rng.below(6)),
            outputs: numbered_names("Y", 1 + rng.below(5)),
            relays: numbered_names("R", 1 + rng.below(7)),
            timers: numbered_names("T", 1 + rng.below(4)),
            counters: numbered_names("C", 1 + rng.below(4)),
            analog: numbered_names("A", 1 + rng.below(2)),
            plain_integers: numbered_names("n", 1 + rng.below(6)),
            integers: Vec::new(),
        };
        if rng.one_in(6) {
            style.make_deep();
        }
        style.set_weights(rng);
        style.integers.clone_from(&style.plain_integers);
        for (from, often) in [(&style.timers, 3), (&style.counters, 2)] {
            style.integers.extend(from.iter().filter(|_| rng.one_in(often)).cloned());
        }
        if rng.one_in(3) {
            // Stages of the shift register.
            style.integers.extend(["s0", "s1", "s2"].map(str::to_owned));
        }
        if profile == ProgramProfile::Whole {
            style.integers.extend(style.analog.iter().cloned());
        }
        style
    }

    /// Deep nesting in few rungs.
    fn make_deep(&mut self) {
        (self.depth, self.group, self.rungs) = (7, 2, self.rungs.min(3));
    }

    /// The weights of the sorts: those of the table, some of them raised.
    fn set_weights(&mut self, rng: &mut Rng) {
        let five = self.dialect == LadderDialect::Ldmicro5;
        let has_meaning = |sort| five || !matches!(sort, ElementSort::BitTest | ElementSort::Bits);
        for &(sort, least, weight, last) in SORTS.iter().filter(|row| row.1 <= self.profile && has_meaning(row.0)) {
            // What a profile has beyond the next smaller one is what its programs are there for.
            let own = if least == self.profile && least > ProgramProfile::Words { 3 } else { 1 };
            let raised = weight * own * if rng.one_in(4) { 5 } else { 1 };
            if last {
                self.end_weights.push((sort, raised));
            } else {
                self.middle_weights.push((sort, raised));
            }
        }
    }

    /// A sort by its weight; `last` where the element ends a path to the right rail.
    pub(super) fn random_sort(&self, rng: &mut Rng, last: bool) -> ElementSort {
        let from = if last { &self.end_weights } else { &self.middle_weights };
        let mut left = rng.below(from.iter().map(|(_, weight)| weight).sum());
        for (sort, weight) in from {
            if left < *weight {
                return *sort;
            }
            left -= weight;
        }
        ElementSort::Wire
    }
}

/// A frequency for the PWM output that all its chips can make.
fn random_hertz(clock: u64, rng: &mut Rng) -> u64 {
    let known = HERTZ.iter().find(|(hz, _)| *hz == clock).map_or(&[1_000][..], |(_, all)| all);
    known[rng.below(known.len() as u64) as usize]
}

/// Names with one first letter: `Xa`, `Xb`, ..
fn numbered_names(letter: &str, count: u64) -> Vec<String> {
    ('a'..='z').take(count as usize).map(|c| format!("{letter}{c}")).collect()
}
