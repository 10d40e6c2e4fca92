//! What a random program is biased towards, and the names that it may use: drawn once for each program.

use emu_core::rng::Rng;
use ladder::Dialect;
use ladder_compile::target::Target;
use serde::{Deserialize, Serialize};

/// What a program may have, from what every family can express to what needs all parts of a chip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// Contacts, coils, edges, master relay, and timers and counters each with a name of its own.
    Bits,
    /// Besides, integers: moves, arithmetic, comparisons, shift registers, tables, shared timers and counters.
    Words,
    /// Besides, bytes and strings on the serial line.
    Serial,
    /// Besides, converter, PWM output and EEPROM.
    Whole,
}

impl Profile {
    /// True when a chip can express programs of this profile.
    #[must_use]
    pub fn fits(self, target: &Target) -> bool {
        let words = !target.has_modules();
        let serial = words && target.uart.is_some();
        match self {
            Profile::Bits => true,
            Profile::Words => words,
            Profile::Serial => serial,
            Profile::Whole => serial && target.pwm.is_some() && target.adc.len() >= 2 && target.eeprom >= 64,
        }
    }
}

/// Sorts of elements that are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sort {
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
const SORTS: &[(Sort, Profile, u64, bool)] = &[
    (Sort::Contact, Profile::Bits,   24, false),
    (Sort::OneShot, Profile::Bits,    3, false),
    (Sort::Timer,   Profile::Bits,    5, false),
    (Sort::Counter, Profile::Bits,    4, false),
    (Sort::Wire,    Profile::Bits,    2, false),
    (Sort::Compare, Profile::Words,   8, false),
    (Sort::Send,    Profile::Serial,  3, false),
    (Sort::Receive, Profile::Serial,  3, false),
    (Sort::Text,    Profile::Serial,  3, false),
    (Sort::Coil,    Profile::Bits,   24, true),
    (Sort::Res,     Profile::Bits,    3, true),
    (Sort::Master,  Profile::Bits,    1, true),
    (Sort::Move,    Profile::Words,   5, true),
    (Sort::Math,    Profile::Words,  10, true),
    (Sort::Shift,   Profile::Words,   2, true),
    (Sort::Table,   Profile::Words,   3, true),
    (Sort::Curve,   Profile::Words,   3, true),
    (Sort::Adc,     Profile::Whole,   4, true),
    (Sort::Pwm,     Profile::Whole,   4, true),
    (Sort::Persist, Profile::Whole,   3, true),
];

/// Clocks in Hz and cycles in microseconds that all families can pace, and rates in bits per second that all can make at
/// that clock.
#[rustfmt::skip]
const PACES: &[(u64, u64, u64)] = &[
    (11_059_200, 10_000, 9_600),
    ( 7_372_800,  5_000, 9_600),
    ( 3_686_400, 10_000, 9_600),
    (11_059_200,  5_000, 2_400),
    ( 7_372_800, 20_000, 4_800),
    (11_059_200,  3_125, 19_200),
];

/// Those of programs without a serial line, which need no clock that a rate divides.
const PLAIN: &[(u64, u64)] = &[(12_000_000, 7_001), (4_000_000, 10_000), (8_000_000, 3_333), (10_000_000, 2_500)];

/// Frequencies in Hz of the PWM output that the timers of PIC16 and AVR make at each of the clocks above.
const HERTZ: &[(u64, &[u64])] =
    &[(11_059_200, &[675, 5_420, 1_350]), (7_372_800, &[450, 3_600, 900]), (3_686_400, &[450, 1_800, 225])];

/// The bias of a program, and its names.
#[derive(Debug, Clone)]
pub(super) struct Style {
    pub profile: Profile,
    pub dialect: Dialect,
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
    middle: Vec<(Sort, u64)>,
    end: Vec<(Sort, u64)>,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    pub relays: Vec<String>,
    pub timers: Vec<String>,
    pub counters: Vec<String>,
    pub analog: Vec<String>,
    /// Integers that are none of the above.
    pub plain: Vec<String>,
    /// Everything that may be computed with.
    pub integers: Vec<String>,
}

impl Style {
    pub(super) fn draw(rng: &mut Rng) -> Style {
        let profile = match rng.below(12) {
            0..4 => Profile::Bits,
            4..7 => Profile::Words,
            7..9 => Profile::Serial,
            _ => Profile::Whole,
        };
        let dialect = if rng.one_in(3) { Dialect::Ldmicro5 } else { Dialect::Ldmicro23 };
        let (clock_hz, mut cycle_us, rate) = PACES[rng.below(PACES.len() as u64) as usize];
        let (mut clock_hz, baud) = (clock_hz, (profile >= Profile::Serial).then_some(rate));
        if baud.is_none() && rng.one_in(2) {
            (clock_hz, cycle_us) = PLAIN[rng.below(PLAIN.len() as u64) as usize];
        }
        // Few programs are as large as a page of code memory; they get the time that they need.
        let large = profile != Profile::Bits && rng.one_in(40);
        if large {
            (clock_hz, cycle_us) = (11_059_200, 50_000);
        }
        let mut style = Style {
            profile,
            dialect,
            clock_hz,
            cycle_us,
            baud: baud.map(|rate| if large { 9_600 } else { rate }),
            hertz: hertz(clock_hz, rng),
            rungs: if large { 40 + rng.below(30) } else { 1 + rng.below(8) },
            elements: if large { 400 } else { 10 + rng.below(80) },
            longest: 1 + rng.below(4),
            depth: 1 + rng.below(4) as u32,
            group: [3, 5, 8][rng.below(3) as usize],
            constant: [2, 3, 6][rng.below(3) as usize],
            latch: [2, 4, 8][rng.below(3) as usize],
            middle: Vec::new(),
            end: Vec::new(),
            inputs: names("X", 1 + rng.below(6)),
            outputs: names("Y", 1 + rng.below(5)),
            relays: names("R", 1 + rng.below(7)),
            timers: names("T", 1 + rng.below(4)),
            counters: names("C", 1 + rng.below(4)),
            analog: names("A", 1 + rng.below(2)),
            plain: names("n", 1 + rng.below(6)),
            integers: Vec::new(),
        };
        if rng.one_in(6) {
            style.deep();
        }
        style.weights(rng);
        style.integers.clone_from(&style.plain);
        for (from, often) in [(&style.timers, 3), (&style.counters, 2)] {
            style.integers.extend(from.iter().filter(|_| rng.one_in(often)).cloned());
        }
        if rng.one_in(3) {
            // Stages of the shift register.
            style.integers.extend(["s0", "s1", "s2"].map(str::to_owned));
        }
        if profile == Profile::Whole {
            style.integers.extend(style.analog.iter().cloned());
        }
        style
    }

    /// Deep nesting in few rungs.
    fn deep(&mut self) {
        (self.depth, self.group, self.rungs) = (7, 2, self.rungs.min(3));
    }

    /// The weights of the sorts: those of the table, some of them raised.
    fn weights(&mut self, rng: &mut Rng) {
        for &(sort, least, weight, last) in SORTS.iter().filter(|row| row.1 <= self.profile) {
            // What a profile has beyond the next smaller one is what its programs are there for.
            let own = if least == self.profile && least > Profile::Words { 3 } else { 1 };
            let raised = weight * own * if rng.one_in(4) { 5 } else { 1 };
            if last {
                self.end.push((sort, raised));
            } else {
                self.middle.push((sort, raised));
            }
        }
    }

    /// A sort by its weight; `last` where the element ends a path to the right rail.
    pub(super) fn sort(&self, rng: &mut Rng, last: bool) -> Sort {
        let from = if last { &self.end } else { &self.middle };
        let mut left = rng.below(from.iter().map(|(_, weight)| weight).sum());
        for (sort, weight) in from {
            if left < *weight {
                return *sort;
            }
            left -= weight;
        }
        Sort::Wire
    }
}

/// A frequency for the PWM output that all its chips can make.
fn hertz(clock: u64, rng: &mut Rng) -> u64 {
    let known = HERTZ.iter().find(|(hz, _)| *hz == clock).map_or(&[1_000][..], |(_, all)| all);
    known[rng.below(known.len() as u64) as usize]
}

/// Names with one first letter: `Xa`, `Xb`, ..
fn names(letter: &str, count: u64) -> Vec<String> {
    ('a'..='z').take(count as usize).map(|c| format!("{letter}{c}")).collect()
}
