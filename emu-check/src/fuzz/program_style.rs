//! The style of a random program: the probabilities of its parts and the names that it may use, chosen once
//! per program.

use emu_core::rng::Rng;
use ladder::LadderDialect;
use ladder_compile::target::CompileTarget;
use serde::{Deserialize, Serialize};

/// What elements a program may have, from those that every family supports to those that need all
/// peripherals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ProgramProfile {
    /// Contacts, coils, edges, master relays, and timers and counters with one element per name.
    Bits,
    /// In addition, integers: moves, arithmetic, comparisons, shift registers, tables, shared timers and
    /// counters.
    Words,
    /// In addition, bytes and strings on the serial line.
    Serial,
    /// In addition, the A/D converter, the PWM output and the EEPROM.
    Whole,
    /// In addition, one of the buses, but no PWM output, which has a pin of the SPI bus on some chips.
    Buses,
    /// As Whole, with two PWM outputs in place of one.
    Outputs,
}

impl ProgramProfile {
    /// Returns true if a chip supports programs of this profile.
    #[must_use]
    pub fn is_supported_by(self, target: &CompileTarget) -> bool {
        let words = !target.has_modules();
        let serial = words && target.uart.is_some();
        match self {
            ProgramProfile::Bits => true,
            ProgramProfile::Words => words,
            ProgramProfile::Serial => serial,
            ProgramProfile::Buses => {
                ProgramProfile::Whole.is_supported_by(target) && target.i2c.is_some() && target.spi.is_some()
            }
            ProgramProfile::Outputs => ProgramProfile::Whole.is_supported_by(target) && target.pwm.len() > 1,
            ProgramProfile::Whole => serial && !target.pwm.is_empty() && target.adc.len() >= 2 && target.eeprom >= 64,
        }
    }
}

/// The sorts of elements that are generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ElementSort {
    Contact,
    Compare,
    /// OSR, OSF and their inverses.
    OneShot,
    Timer,
    Counter,
    /// SHORT and OPEN.
    Wire,
    /// UART_SEND.
    Send,
    /// UART_RECV.
    Receive,
    /// FORMATTED_STRING.
    Text,
    Coil,
    /// Reset of a timer or counter.
    Res,
    Move,
    Math,
    BitTest,
    /// Tests of the serial line.
    Line,
    /// PULSER, STEPPER and QUAD_ENCOD.
    Pulse,
    Bits,
    Shift,
    Table,
    Curve,
    Adc,
    Pwm,
    Persist,
    /// SPI, SPI_WR, I2C_RD and I2C_WR.
    Bus,
    Master,
}

/// The sorts of elements: the smallest profile that has the sort, its weight, and whether it ends a path to
/// the right rail.
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
    (ElementSort::Line,    ProgramProfile::Serial,  2, false),
    (ElementSort::Pulse,   ProgramProfile::Words,   3, false),
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
    (ElementSort::Bus,     ProgramProfile::Buses,   5, true),
];

/// (Clock in Hz, cycle in microseconds, baud rate): combinations that all families support.
#[rustfmt::skip]
const CLOCKS_AND_CYCLES: &[(u64, u64, u64)] = &[
    (11_059_200, 10_000, 9_600),
    ( 7_372_800,  5_000, 9_600),
    ( 3_686_400, 10_000, 9_600),
    (11_059_200,  5_000, 2_400),
    ( 7_372_800, 20_000, 4_800),
    (11_059_200,  3_125, 19_200),
];

/// (Clock in Hz, cycle in microseconds) of programs without a serial line, whose clock need not fit a baud
/// rate.
const PLAIN_CLOCKS_AND_CYCLES: &[(u64, u64)] =
    &[(12_000_000, 7_001), (4_000_000, 10_000), (8_000_000, 3_333), (10_000_000, 2_500)];

/// Per clock in Hz, the PWM frequencies in Hz that the timers of both PIC16 and AVR can generate.
const HERTZ: &[(u64, &[u64])] =
    &[(11_059_200, &[675, 5_420, 1_350]), (7_372_800, &[450, 3_600, 900]), (3_686_400, &[450, 1_800, 225])];

/// The probabilities of the parts of a program, and its names.
#[derive(Debug, Clone)]
pub(super) struct ProgramStyle {
    pub profile: ProgramProfile,
    /// Dialect of the program.
    pub dialect: LadderDialect,
    pub clock_hz: u64,
    pub cycle_us: u64,
    /// Bits per second of the serial line; `None` in programs without one.
    pub baud: Option<u64>,
    /// True if its bus is I2C, false for SPI: some chips have one at a time.
    pub uses_i2c: bool,
    /// Frequency of the PWM output in Hz.
    pub hertz: u64,
    /// Number of rungs.
    pub rungs: u64,
    /// Number of elements after which no more groups are started.
    pub elements: u64,
    /// Maximum number of elements and groups in a series.
    pub longest: u64,
    /// Maximum nesting depth of groups.
    pub depth: u32,
    /// Number of nodes per group, on average.
    pub nodes_per_group: u64,
    /// Number of operands per constant, on average.
    pub operands_per_constant: u64,
    /// Number of coils per set or reset coil, on average.
    pub coils_per_latch: u64,
    middle_weights: Vec<(ElementSort, u64)>,
    end_weights: Vec<(ElementSort, u64)>,
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    pub relays: Vec<String>,
    pub timers: Vec<String>,
    pub counters: Vec<String>,
    pub analog: Vec<String>,
    /// Integers that are not timers, counters or analog inputs.
    pub plain_integers: Vec<String>,
    /// All integers that may be operands.
    pub integers: Vec<String>,
}

impl ProgramStyle {
    /// Chooses a random style.
    pub(super) fn draw(rng: &mut Rng) -> ProgramStyle {
        let profile = match rng.below(12) {
            0..4 => ProgramProfile::Bits,
            4..7 => ProgramProfile::Words,
            7..9 => ProgramProfile::Serial,
            11 => ProgramProfile::Buses,
            _ => ProgramProfile::Whole,
        };
        // The buses are elements of LDmicro 5.
        let dialect = if rng.one_in(3) || profile == ProgramProfile::Buses {
            LadderDialect::Ldmicro5
        } else {
            LadderDialect::Ldmicro23
        };
        let (clock_hz, mut cycle_us, rate) = CLOCKS_AND_CYCLES[rng.below(CLOCKS_AND_CYCLES.len() as u64) as usize];
        let (mut clock_hz, baud) = (clock_hz, (profile >= ProgramProfile::Serial).then_some(rate));
        if baud.is_none() && rng.one_in(2) {
            (clock_hz, cycle_us) = PLAIN_CLOCKS_AND_CYCLES[rng.below(PLAIN_CLOCKS_AND_CYCLES.len() as u64) as usize];
        }
        // Several transfers on a bus take some milliseconds.
        if profile == ProgramProfile::Buses {
            cycle_us = cycle_us.max(10_000);
        }
        // A few programs are larger than a page of code memory; they get a longer cycle.
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
            uses_i2c: profile == ProgramProfile::Buses && rng.one_in(2),
            hertz: random_hertz(clock_hz, rng),
            rungs: if large { 40 + rng.below(30) } else { 1 + rng.below(8) },
            elements: if large { 400 } else { 10 + rng.below(80) },
            longest: 1 + rng.below(4),
            depth: 1 + rng.below(4) as u32,
            nodes_per_group: [3, 5, 8][rng.below(3) as usize],
            operands_per_constant: [2, 3, 6][rng.below(3) as usize],
            coils_per_latch: [2, 4, 8][rng.below(3) as usize],
            middle_weights: Vec::new(),
            end_weights: Vec::new(),
            inputs: lettered_names("X", 1 + rng.below(6)),
            outputs: lettered_names("Y", 1 + rng.below(5)),
            relays: lettered_names("R", 1 + rng.below(7)),
            timers: lettered_names("T", 1 + rng.below(4)),
            counters: lettered_names("C", 1 + rng.below(4)),
            analog: lettered_names("A", 1 + rng.below(2)),
            plain_integers: lettered_names("n", 1 + rng.below(6)),
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
            // Stages of the shift register `s`.
            style.integers.extend(["s0", "s1", "s2"].map(str::to_owned));
        }
        if profile >= ProgramProfile::Whole {
            style.integers.extend(style.analog.iter().cloned());
        }
        // Names of outputs are an argument of LDmicro 5.
        let names_outputs = dialect == LadderDialect::Ldmicro5 && style.plain_integers.len().is_multiple_of(2);
        if profile == ProgramProfile::Whole && names_outputs {
            style.profile = ProgramProfile::Outputs;
        }
        style
    }

    /// Sets deep nesting with few rungs.
    fn make_deep(&mut self) {
        (self.depth, self.nodes_per_group, self.rungs) = (7, 2, self.rungs.min(3));
    }

    /// Sets the weights of the sorts: those of [`SORTS`], some of them raised.
    fn set_weights(&mut self, rng: &mut Rng) {
        let five = self.dialect == LadderDialect::Ldmicro5;
        let has_meaning = |sort| {
            let newer =
                [ElementSort::BitTest, ElementSort::Bits, ElementSort::Line, ElementSort::Pulse, ElementSort::Bus];
            five || !newer.contains(&sort)
        };
        let has_part = |sort| sort != ElementSort::Pwm || self.profile != ProgramProfile::Buses;
        let rows = SORTS.iter().filter(|row| row.1 <= self.profile && has_meaning(row.0) && has_part(row.0));
        for &(sort, least, weight, last) in rows {
            // The sorts that a profile adds to the next smaller one get a higher weight.
            let own_factor = if least == self.profile && least > ProgramProfile::Words { 3 } else { 1 };
            let raised = weight * own_factor * if rng.one_in(4) { 5 } else { 1 };
            if last {
                self.end_weights.push((sort, raised));
            } else {
                self.middle_weights.push((sort, raised));
            }
        }
    }

    /// A random sort by weight; `last` if the element ends a path to the right rail.
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

/// A random PWM frequency in Hz that all chips of the profile can generate.
fn random_hertz(clock: u64, rng: &mut Rng) -> u64 {
    let known = HERTZ.iter().find(|(hz, _)| *hz == clock).map_or(&[1_000][..], |(_, all)| all);
    known[rng.below(known.len() as u64) as usize]
}

/// Names with a common first letter: `Xa`, `Xb`, ..
fn lettered_names(letter: &str, count: u64) -> Vec<String> {
    ('a'..='z').take(count as usize).map(|c| format!("{letter}{c}")).collect()
}
