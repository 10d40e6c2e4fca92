//! The report of a check, as text and as JSON.

use std::fmt::Write;

use diag::Diagnostic;
use serde::Serialize;

use crate::codes;
use crate::coverage::classes::LadderCoverage;

/// Version of the JSON report.
pub const SCHEMA: u32 = 2;

/// The result of a check. `docs/check.md` describes its JSON form.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CheckReport {
    /// Version of the JSON report, [`SCHEMA`].
    pub schema: u32,
    /// Name of the program's file.
    pub program: String,
    /// The name of the chip.
    pub mcu: String,
    /// Seed of all random choices.
    pub seed: u64,
    /// Number of scans done; if there is a difference, it is in the last one.
    pub scans: u64,
    /// Number of runs from reset that the scans belong to.
    pub runs: u64,
    /// Number of values compared: symbols, pins, start times and stack depths.
    pub compared: u64,
    /// True if nothing differed.
    pub agreed: bool,
    /// The first difference.
    pub difference: Option<CheckDifference>,
    /// Coverage of the program.
    pub coverage: LadderCoverage,
    /// Size and speed of the compiled program.
    pub figures: ProgramFigures,
    /// Notes of the compiler and of the check; none of them is an error.
    pub notes: Vec<Diagnostic>,
}

/// Size and speed of a compiled program.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProgramFigures {
    /// Bytes of code.
    pub code_bytes: u32,
    /// Bytes of RAM used for data.
    pub ram_bytes: u32,
    /// Period of a scan in machine cycles, as an integer or a fraction `num/den`.
    pub period_cycles: String,
    /// Oscillator clocks per machine cycle.
    pub clocks_per_cycle: u64,
    /// Machine cycles from the start of a scan until the chip waits again: the maximum observed.
    pub scan_cycles_max: u64,
    /// The mean of the same time.
    pub scan_cycles_mean: f64,
    /// Upper bound of the same time, computed by the compiler.
    pub scan_cycles_bound: u64,
    /// Machine cycles that remain of the shortest period after a scan of `scan_cycles_bound`.
    pub slack_cycles: u64,
    /// The figures of every rung.
    pub rungs: Vec<RungFigures>,
}

/// Size and speed of one rung.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RungFigures {
    /// Number of the rung, from 1.
    pub rung: u32,
    /// Bytes of code.
    pub code_bytes: u32,
    /// Longest path through the rung in machine cycles, computed by the compiler.
    pub cycles_bound: u64,
    /// Maximum machine cycles observed; `None` if the rung has no code or rungs were not timed.
    pub cycles_max: Option<u64>,
}

/// The kind of a difference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum DifferenceKind {
    /// A relay, output, timer, counter or variable at the end of a scan.
    Symbol,
    /// The level of an output pin, or the pull-up or driver of a pin that is driven from outside.
    Pin,
    /// The time at which a scan starts.
    Period,
    /// The chip stopped, hung, or did not reach the next point of a scan.
    Stop,
    /// The stack depth.
    Stack,
    /// The value of a symbol before the first scan.
    Reset,
    /// The length of a scan.
    Bound,
    /// A byte on the serial line.
    Serial,
    /// The PWM output.
    Pwm,
    /// A cell of the EEPROM.
    Eeprom,
    /// A transfer on a bus.
    Bus,
    /// The chip, timing or pins in the compiler's map.
    Map,
}

impl DifferenceKind {
    /// The diagnostic code of this kind, for `emu explain`.
    #[must_use]
    pub const fn code(self) -> &'static str {
        match self {
            DifferenceKind::Symbol => codes::DIFFERS_SYMBOL,
            DifferenceKind::Pin => codes::DIFFERS_PIN,
            DifferenceKind::Period => codes::DIFFERS_PERIOD,
            DifferenceKind::Stop => codes::DIFFERS_STOP,
            DifferenceKind::Stack => codes::DIFFERS_STACK,
            DifferenceKind::Reset => codes::DIFFERS_RESET,
            DifferenceKind::Map => codes::DIFFERS_MAP,
            DifferenceKind::Bound => codes::DIFFERS_BOUND,
            DifferenceKind::Serial => codes::DIFFERS_SERIAL,
            DifferenceKind::Pwm => codes::DIFFERS_PWM,
            DifferenceKind::Eeprom => codes::DIFFERS_EEPROM,
            DifferenceKind::Bus => codes::DIFFERS_BUS,
        }
    }
}

/// The first difference of a check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CheckDifference {
    /// Diagnostic code of the kind, for `emu explain`.
    pub code: &'static str,
    /// Number of the scan in the check, from 1.
    pub scan: u64,
    /// Number of the run from reset, from 1.
    pub run: u64,
    /// Number of the scan in that run, from 1.
    pub scan_of_run: u64,
    /// Machine cycle of that run in which the difference was observed.
    pub cycle: u64,
    /// The kind of the difference.
    pub what: DifferenceKind,
    /// The symbol that differs, if it is a symbol.
    pub symbol: Option<String>,
    /// The expected value or level, or a description.
    pub expected: String,
    /// The value or level found, or a description.
    pub found: String,
    /// Rung of the first element whose result differs, from 1; `None` if no element is to blame.
    pub rung: Option<u32>,
    /// Number of that element within its rung, from 1.
    pub element: Option<u32>,
    /// The element as `.ld` text.
    pub element_text: Option<String>,
    /// All symbols that differ at this point, each as `name: expected, found`.
    pub differing: Vec<String>,
    /// The command line that replays the check up to this scan.
    pub replay: String,
    /// The smallest stimulus found that causes the same difference, one line per scan from reset; empty if
    /// the difference needs no scan.
    pub smallest: Vec<String>,
}

impl CheckReport {
    /// The report as text of several lines.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = String::new();
        let CheckReport { program, mcu, seed, scans, runs, compared, .. } = self;
        if let Some(difference) = &self.difference {
            _ = writeln!(text, "{program} on {mcu} DIFFERS in scan {} (seed {seed})", difference.scan);
            text += &difference.text();
        } else {
            let (scans, runs) = (count_text(*scans, "scan"), count_text(*runs, "run"));
            _ = writeln!(
                text,
                "{program} on {mcu} agrees: {scans} in {runs} from reset, {} compared, seed {seed}",
                count_text(*compared, "value")
            );
        }
        text += &self.coverage.summary_line();
        if self.agreed {
            text += &self.coverage.missing_lines();
        }
        text += &self.figures.text();
        text
    }
}

impl ProgramFigures {
    fn text(&self) -> String {
        let ProgramFigures { code_bytes, ram_bytes, period_cycles, clocks_per_cycle, scan_cycles_max, .. } = self;
        let cycles = if *clocks_per_cycle == 1 { "cycles" } else { "machine cycles" };
        let mut text = format!(
            "figures: {code_bytes} bytes of code, {ram_bytes} of RAM; period {period_cycles} {cycles}, scan at most {scan_cycles_max} \
             ({} by the compiler) and on average {:.1} {cycles}, slack {}",
            self.scan_cycles_bound, self.scan_cycles_mean, self.slack_cycles
        );
        let longest = self.rungs.iter().max_by_key(|rung| rung.cycles_max);
        if let Some((rung, most)) = longest.and_then(|rung| Some((rung, rung.cycles_max?))) {
            _ = write!(text, "; longest rung {}, {most} {cycles} ({} by the compiler)", rung.rung, rung.cycles_bound);
        }
        text + "\n"
    }
}

impl CheckDifference {
    /// What differs, as a noun for messages.
    pub(crate) fn subject(&self) -> String {
        match (self.what, &self.symbol) {
            (DifferenceKind::Pin, Some(symbol)) => format!("the pin of {symbol}"),
            (_, Some(symbol)) => symbol.clone(),
            (DifferenceKind::Pin, None) => "the behaviour of a pin".to_owned(),
            (DifferenceKind::Period, None) => "the start of the scan".to_owned(),
            (DifferenceKind::Map, None) => "the compiler's map".to_owned(),
            (DifferenceKind::Bound, None) => "the length of the scan".to_owned(),
            (DifferenceKind::Serial, None) => "the serial line".to_owned(),
            (DifferenceKind::Pwm, None) => "the PWM output".to_owned(),
            (DifferenceKind::Eeprom, None) => "the EEPROM".to_owned(),
            (DifferenceKind::Bus, None) => "a bus".to_owned(),
            (DifferenceKind::Stack, None) => "the stack pointer".to_owned(),
            (_, None) => "the sequence of the scan".to_owned(),
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        _ = writeln!(text, "  what      {} [{}]", self.subject(), self.code);
        _ = writeln!(text, "  expected  {}", self.expected);
        _ = writeln!(text, "  found     {}", self.found);
        if let (Some(rung), Some(element), Some(of)) = (self.rung, self.element, &self.element_text) {
            _ = writeln!(text, "  element   rung {rung}, element {element} `{of}`");
        }
        let CheckDifference { run, scan_of_run, cycle, .. } = self;
        _ = match self.what {
            DifferenceKind::Map => writeln!(text, "  when      before anything has run"),
            _ => writeln!(text, "  when      cycle {cycle} of run {run}, in its scan {scan_of_run}"),
        };
        if self.differing.len() > 1 {
            _ = writeln!(text, "  all       {}", self.differing.join("; "));
        }
        _ = writeln!(text, "  replay    {}", self.replay);
        if !self.smallest.is_empty() {
            _ = writeln!(text, "  smallest  from reset, {}:", count_text(self.smallest.len() as u64, "scan"));
        }
        self.smallest.iter().for_each(|line| _ = writeln!(text, "    {line}"));
        text
    }
}

/// A number with its unit in singular or plural: `1 scan`, `2,000 scans`.
pub(crate) fn count_text(n: u64, what: &str) -> String {
    format!("{} {what}{}", grouped_number(n), if n == 1 { "" } else { "s" })
}

/// A number with thousands separators: `2,000`.
pub(crate) fn grouped_number(n: u64) -> String {
    let digits = n.to_string();
    let mut number = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            number.push(',');
        }
        number.push(digit);
    }
    number
}
