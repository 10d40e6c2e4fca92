//! `emu check`: compiles a program, runs it on the chip, and compares every scan with the reference
//! evaluator.

mod scenario;
mod via;

use std::collections::BTreeSet;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use diag::{Diagnostic, Pos, Severity};
use emu_check::{CheckOptions, CheckOutcome, CheckSummary, RefusedCheck, ReportEntry};
use emu_core::chip::Chip;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::family::{ChipChoice, ChipChoiceParser};
use crate::shared::flags::ReadFlags;
use crate::shared::input::ReadProgram;
use crate::shared::output::RequestedOutput;
use crate::shared::report::{FileTexts, MessageStyle, report_diagnostics};
use crate::shared::{chosen_chip, codes, family, input, output};
use crate::verbs::compile::TargetFlags;

const EXAMPLES: &str = "\
Examples:
  emu check examples/welder.ld --mcu atmega328p
  emu check examples/*.ld --mcu all
  emu check examples/traffic.ld --mcu atmega328p --scans 100000 --seed 7
  emu check examples/tank.ld --mcu atmega328p,pic16f877 --pin Ypump=PB5 --json
  emu check welder.ld --image welder.hex --dialect ldmicro-2.3     an image that LDmicro made
  emu check examples/*.ld --mcu all --junit out.xml --report out.html
  emu check examples/welder.ld --mcu all --scenario examples/welder.toml

Exit codes: 0 chip and reference agree; 1 they differ: the report says where, and has the command that replays
it; 2 a usage error; 3 the program is refused (with --mcu all: by every chip). The same seed always gives the
same run.";

/// Time after which a progress bar appears.
const PROGRESS_DELAY: Duration = Duration::from_secs(1);

/// Flags of `emu check`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct CheckArgs {
    /// The programs: .ld, .il, .xml, .l5x and .grid files; - is standard input.
    #[arg(value_name = "PROGRAM.ld", required = true)]
    files: Vec<String>,
    #[command(flatten)]
    read: ReadFlags,
    /// The chips, separated by commas, or `all` for every chip with a compiler. With `all`, a chip that lacks
    /// what a program needs is listed with the reason. Default: the chip in MICRO= of each program.
    #[arg(long, value_name = "CHIP", value_parser = ChipChoiceParser { compiled: false }, hide_possible_values = true, value_delimiter = ',')]
    mcu: Vec<ChipChoice>,
    /// Check an emitted source instead of the image, with compilers on the PATH: `native`, C by gcc on this
    /// computer; `c`, by avr-gcc or sdcc on the chip; `bytecode` on the chip; `arduino`, a sketch on the
    /// atmega328p. Without --mcu the chip is the atmega328p.
    #[arg(long, value_name = "ROUTE", value_parser = crate::verbs::check::via::parse_via)]
    via: Option<emu_check::via::SourceRoute>,
    /// Seed of all random choices, of stimulus and RAM: a number. The default is fixed, so that runs can be
    /// repeated.
    #[arg(long, value_name = "N", default_value_t = CheckOptions::default().seed)]
    seed: u64,
    /// Number of scans to compare, at least 1. Default: 2,000; with --image 20,000 or more, as long as new
    /// states appear.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    scans: Option<u64>,
    #[command(flatten)]
    target: TargetFlags,
    /// Check this HEX or ELF file, which another compiler made from the program, instead of our own image.
    /// The chip is that of --mcu, otherwise that of MICRO=, otherwise the one that the image names.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["via", "junit", "report"])]
    image: Option<String>,
    /// A map file as `emu compile --map` writes it, with the locations of the symbols in that image. The
    /// symbols are then compared too.
    #[arg(long, value_name = "FILE", requires = "image")]
    map: Option<String>,
    /// Play a scenario (docs/scenario.md) instead of random stimuli, on the evaluator and on the chips. The
    /// verdicts must be the same, and so must everything that a check compares, scan by scan. Exit code 1 if
    /// an expectation was not met or the verdicts differ, 5 if a step was still waiting at the limit.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["via", "image", "junit", "report"])]
    scenario: Option<String>,
    /// Write the outcomes as JUnit XML, one test case for each program and chip.
    #[arg(long, value_name = "FILE", conflicts_with = "via")]
    junit: Option<String>,
    /// Write the outcomes as one HTML page: verdicts, statistics, the drawn programs, and their symbols over
    /// the scans.
    #[arg(long, value_name = "FILE", conflicts_with = "via")]
    report: Option<String>,
    /// One JSON document.
    #[arg(long)]
    pub json: bool,
}

/// Checks programs on chips.
pub fn check(args: &CheckArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    if args.files.iter().filter(|file| *file == "-").count() > 1 {
        return Err(VerbFailure::Usage("standard input (-) can be only one of the programs".to_owned()));
    }
    let json_output = RequestedOutput::printed("--json", args.json);
    let outputs: Vec<RequestedOutput<'_>> = [("--junit", &args.junit), ("--report", &args.report)]
        .into_iter()
        .filter_map(|(flag, file)| RequestedOutput::to_file(flag, file.as_deref()))
        .collect();
    output::check_distinct_outputs(&outputs.iter().copied().chain(json_output).collect::<Vec<_>>())?;
    for file in &args.files {
        output::check_input_not_overwritten(file, &outputs)?;
    }
    let programs =
        args.files.iter().map(|file| input::read_program_for_pins(file, args.read.options(), &args.target.pins, style));
    let programs = programs.collect::<Result<Vec<ReadProgram>, VerbFailure>>()?;
    let all = args.mcu.iter().any(|choice| matches!(choice, ChipChoice::All));
    let mut chips: Vec<&'static str> = Vec::new();
    for choice in &args.mcu {
        let named: Vec<&'static Chip> = match choice {
            ChipChoice::All => ladder_compile::CHIPS.to_vec(),
            ChipChoice::One(chip) => vec![chip],
        };
        for chip in named {
            if !chips.contains(&chip.name) {
                chips.push(chip.name);
            }
        }
    }
    if let ([chip], false) = (chips.as_slice(), all) {
        programs.iter().for_each(|read| read.note_other_chip(chip));
    }
    if let Some(image) = &args.image {
        return check_foreign_image(args, image, &chips, &programs, style);
    }
    if let Some(file) = &args.scenario {
        scenario::check_flags(args, programs.len())?;
        let Some(read) = programs.first() else { return Ok(exit::USAGE) };
        let chips = selected_chips(&chips, read)?;
        let options: Vec<CheckOptions> =
            chips.iter().map(|chip| with_supported_clock(options(args, chip), read, all)).collect();
        return scenario::check(args, file, read, &options, all, style);
    }
    if let Some(via) = args.via {
        let sketch = via == emu_check::via::SourceRoute::Arduino;
        if via == emu_check::via::SourceRoute::Native && !args.mcu.is_empty() {
            return Err(VerbFailure::Usage("--via native runs on this computer, so --mcu has no meaning".to_owned()));
        }
        if args.target.clock.is_some() {
            return Err(VerbFailure::Usage(
                "--clock has no meaning with --via: emitted sources are checked without it".to_owned(),
            ));
        }
        if !sketch && !args.target.pins.is_empty() {
            return Err(VerbFailure::Usage(
                "--pin has a meaning with --via arduino only: other sources have no pins".to_owned(),
            ));
        }
        let chips = if chips.is_empty() {
            vec![CheckOptions::default().mcu]
        } else {
            chips.iter().map(|c| (*c).to_owned()).collect()
        };
        let options: Vec<CheckOptions> = chips.iter().map(|chip| options(args, chip)).collect();
        return crate::verbs::check::via::check(via, &options, programs, all, args.json);
    }
    let mut pairs: Vec<(&ReadProgram, CheckOptions)> = Vec::new();
    for read in &programs {
        let chips = selected_chips(&chips, read)?;
        pairs.extend(chips.iter().map(|chip| (read, with_supported_clock(options(args, chip), read, all))));
    }
    let bar = CheckProgress::new(
        style,
        (pairs.len() as u64).saturating_mul(args.scans.unwrap_or(CheckOptions::default().scans)),
    );
    let clock_notes: BTreeSet<String> =
        pairs.iter().filter_map(|(_, options)| lowered_clock_note(args, options)).collect();
    let outcomes: Vec<CheckOutcome> = pairs
        .par_iter()
        .map(|(read, options)| {
            let mut done_before = 0;
            let mut progress = |done: u64, _: u64| bar.add(done - std::mem::replace(&mut done_before, done));
            match emu_check::check(&read.program, options, &mut progress) {
                Ok(report) => CheckOutcome::Checked(Box::new(report)),
                Err(errors) => {
                    let (program, mcu) = (read.program.file.clone(), options.mcu.clone());
                    CheckOutcome::Refused(RefusedCheck { program, mcu, errors })
                }
            }
        })
        .collect();
    bar.finish();
    let junit = |file: &'_ str| emu_check::junit(&outcomes).map_err(|error| VerbFailure::write_failed(file, &error));
    let texts = [
        args.junit.as_deref().map(|file| Ok::<_, VerbFailure>((file, junit(file)?))).transpose()?,
        args.report.as_deref().map(|file| (file, report_page(&pairs, &outcomes))),
    ];
    let files: Vec<(&str, &[u8])> = texts.iter().flatten().map(|(file, text)| (*file, text.as_bytes())).collect();
    output::write_files(&files)?;
    match <[CheckOutcome; 1]>::try_from(outcomes) {
        Ok([outcome]) => report_single(args, outcome, programs, style),
        Err(outcomes) => {
            if !clock_notes.is_empty() {
                let clock_notes: Vec<String> = clock_notes.into_iter().collect();
                let cause = format!(
                    "CRYSTAL= is above the highest clock of a chip, which is used instead: {}",
                    clock_notes.join(", ")
                );
                let file = programs.first().map_or("-", |read| read.program.file.as_str());
                let note =
                    Diagnostic::new(Severity::Note, codes::SLOWED, file, Pos::default(), cause, "--clock sets another");
                report_diagnostics(style, &[note], &FileTexts::default());
            }
            report_many(args, all, outcomes)
        }
    }
}

/// Builds the HTML page of `--report`.
fn report_page(pairs: &[(&ReadProgram, CheckOptions)], outcomes: &[CheckOutcome]) -> String {
    let entries: Vec<ReportEntry<'_>> = pairs
        .iter()
        .zip(outcomes)
        .map(|((read, options), outcome)| ReportEntry { program: &read.program, options, compiled: None, outcome })
        .collect();
    emu_check::html_report(&entries)
}

/// Returns the chips that the user named, or otherwise the chip of the program.
fn selected_chips(named: &[&'static str], read: &ReadProgram) -> Result<Vec<&'static str>, VerbFailure> {
    if named.is_empty() { Ok(vec![read.chip()?]) } else { Ok(named.to_vec()) }
}

/// Checks an image that another compiler made.
fn check_foreign_image(
    args: &CheckArgs,
    file: &str,
    chips: &[&'static str],
    programs: &[ReadProgram],
    style: &MessageStyle,
) -> Result<u8, VerbFailure> {
    let [read] = programs else {
        return Err(VerbFailure::Usage("--image is of one program; give one".to_owned()));
    };
    let micro = read.program.settings.micro.as_deref().and_then(ladder::chip_of);
    let chip = match (chips, micro) {
        ([chip], _) => *chip,
        ([], Some(chip)) => chip,
        ([], None) => match chosen_chip::named_chip(file, &input::read_bytes_twice(file)?).and_then(|named| named.chip)
        {
            Some(chip) => chip.name,
            None => {
                let why = "neither the program, in MICRO=, nor the image names a known chip; give --mcu CHIP";
                return Err(VerbFailure::Usage(why.to_owned()));
            }
        },
        _ => return Err(VerbFailure::Usage("--image is for one chip; give one with --mcu".to_owned())),
    };
    let row = family::parse_chip(chip).map_err(VerbFailure::usage)?;
    let image = input::read_image(file, row, style)?;
    let map = args.map.as_deref().map(read_map_file).transpose()?;
    let wanted =
        emu_check::ForeignImage { file, image: &image, map: args.map.as_deref().zip(map.as_ref()), scans: args.scans };
    let bar = CheckProgress::new(style, args.scans.unwrap_or(emu_check::MAX_SCANS));
    let mut done_before = 0;
    let mut progress = |done: u64, of: u64| {
        bar.set_total(of);
        bar.add(done - std::mem::replace(&mut done_before, done));
    };
    let checked = emu_check::check_foreign(&read.program, &wanted, &options(args, chip), &mut progress);
    bar.finish();
    match checked {
        Err(errors) => Err(VerbFailure::Refused(errors, FileTexts::default())),
        Ok(checked) => {
            if args.json {
                output::print_json(&checked)?;
            } else {
                report_diagnostics(style, &checked.notes, &FileTexts::default());
                output::print(checked.text())?;
            }
            Ok(if checked.agreed { exit::OK } else { exit::FAILED })
        }
    }
}

/// Reads a map file.
fn read_map_file(file: &str) -> Result<ladder_compile::ImageMap, VerbFailure> {
    emu_check::read_map(file, &input::read_bytes(file)?)
        .map_err(|fault| VerbFailure::Refused(vec![fault], FileTexts::default()))
}

fn options(args: &CheckArgs, chip: &str) -> CheckOptions {
    CheckOptions {
        mcu: chip.to_owned(),
        seed: args.seed,
        scans: args.scans.unwrap_or(CheckOptions::default().scans),
        pins: args.target.pins.clone(),
        clock_hz: args.target.clock,
        rungs: true,
        explain: true,
    }
}

/// With `all`, a chip whose highest clock is below that of the program runs at its highest clock, unless the
/// user gives a clock.
fn with_supported_clock(options: CheckOptions, read: &ReadProgram, all: bool) -> CheckOptions {
    let highest = ladder_compile::find_chip(&options.mcu).map(|chip| chip.max_hz);
    let lowered = highest.filter(|highest| all && read.program.settings.crystal_hz > *highest);
    CheckOptions { clock_hz: options.clock_hz.or(lowered), ..options }
}

/// Returns a note about a clock that was lowered automatically.
fn lowered_clock_note(args: &CheckArgs, options: &CheckOptions) -> Option<String> {
    let hz = options.clock_hz.filter(|_| args.target.clock.is_none())?;
    Some(format!("{} at {hz} Hz", options.mcu))
}

/// Reports one program on one chip: only its own report.
fn report_single(
    args: &CheckArgs,
    outcome: CheckOutcome,
    programs: Vec<ReadProgram>,
    style: &MessageStyle,
) -> Result<u8, VerbFailure> {
    let texts = programs.into_iter().next().map(|read| read.texts).unwrap_or_default();
    let checked = match outcome {
        CheckOutcome::Checked(checked) => checked,
        CheckOutcome::Refused(RefusedCheck { errors, .. }) => return Err(VerbFailure::Refused(errors, texts)),
    };
    if args.json {
        output::print_json(&checked)?;
    } else {
        // Notes about fuses matter only when the user programs a real chip.
        let notes: Vec<_> = checked.notes.iter().filter(|n| n.code != ladder_compile::FUSES_NOTE).cloned().collect();
        report_diagnostics(style, &notes, &texts);
        output::print(checked.text())?;
    }
    Ok(if checked.agreed { exit::OK } else { exit::FAILED })
}

/// Reports several checks: the reports of those that differ, and a table of all.
fn report_many(args: &CheckArgs, all: bool, outcomes: Vec<CheckOutcome>) -> Result<u8, VerbFailure> {
    let code = exit_code(&outcomes, all);
    if args.json {
        output::print_json(&CheckSummary::new(outcomes))?;
    } else {
        let reports = outcomes.iter().filter_map(|outcome| match outcome {
            CheckOutcome::Checked(report) if !report.agreed => Some(report.text() + "\n"),
            _ => None,
        });
        output::print(reports.collect::<String>() + &emu_check::summary_table(&outcomes))?;
    }
    Ok(code)
}

/// Returns the exit code of several checks: a difference overrides a refusal. With `all`, a refusal counts
/// only if no chip accepts the program, which was then not checked at all.
fn exit_code(outcomes: &[CheckOutcome], all: bool) -> u8 {
    let report = |outcome: &'_ CheckOutcome| match outcome {
        CheckOutcome::Checked(report) => Some((report.program.clone(), report.agreed)),
        CheckOutcome::Refused(_) => None,
    };
    let reports: Vec<(String, bool)> = outcomes.iter().filter_map(report).collect();
    let is_lost = |refused: &RefusedCheck| !all || !reports.iter().any(|(program, _)| *program == refused.program);
    if reports.iter().any(|(_, agreed)| !agreed) {
        exit::FAILED
    } else if outcomes.iter().any(|outcome| matches!(outcome, CheckOutcome::Refused(refused) if is_lost(refused))) {
        exit::REFUSED
    } else {
        exit::OK
    }
}

/// A progress bar over all checks, which appears on a terminal after [`PROGRESS_DELAY`].
struct CheckProgress {
    start: Instant,
    is_terminal: bool,
    done: AtomicU64,
    total: AtomicU64,
    bar: Mutex<Option<ProgressBar>>,
}

impl CheckProgress {
    fn new(style: &MessageStyle, total: u64) -> CheckProgress {
        CheckProgress {
            start: Instant::now(),
            is_terminal: style.is_terminal,
            done: AtomicU64::new(0),
            total: AtomicU64::new(total),
            bar: Mutex::new(None),
        }
    }

    /// Sets the total number of scans.
    fn set_total(&self, scans: u64) {
        self.total.store(scans, Ordering::Relaxed);
    }

    fn add(&self, scans: u64) {
        let done = self.done.fetch_add(scans, Ordering::Relaxed) + scans;
        if self.is_terminal
            && self.start.elapsed() >= PROGRESS_DELAY
            && let Ok(mut bar) = self.bar.lock()
        {
            let total = self.total.load(Ordering::Relaxed);
            let bar = bar.get_or_insert_with(|| progress_bar(total));
            bar.set_length(total);
            bar.set_position(done);
        }
    }

    fn finish(&self) {
        if let Ok(mut bar) = self.bar.lock()
            && let Some(bar) = bar.take()
        {
            bar.finish_and_clear();
        }
    }
}

fn progress_bar(total: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} scans");
    ProgressBar::new(total).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the outcome of a check of a good image, or of a broken one whose coil is inverted, under the
    /// name `file`.
    fn checked(file: &str, broken: bool) -> CheckOutcome {
        let text = |negated: &str| {
            format!(
                "LDmicro0.1\nCYCLE=1000\nCRYSTAL=1000000\n\nPROGRAM\nRUNG\n CONTACTS Xa 0\n COIL Ya {negated} 0 0\nEND\n"
            )
        };
        let program = |text: &str| ladder::parse(file, text).expect("a program").program;
        let options = CheckOptions { scans: 20, ..CheckOptions::default() };
        let target =
            ladder_compile::CompileOptions { mcu: options.mcu.clone(), ..ladder_compile::CompileOptions::default() };
        let image =
            ladder_compile::compile(&program(&text(if broken { "1" } else { "0" })), &target).expect("an image");
        let report = emu_check::check_compiled(&program(&text("0")), &image, &options, &mut |_, _| {});
        CheckOutcome::Checked(Box::new(report.expect("a report")))
    }

    fn refused(file: &str) -> CheckOutcome {
        CheckOutcome::Refused(RefusedCheck { program: file.to_owned(), mcu: "ap101".to_owned(), errors: Vec::new() })
    }

    #[test]
    fn exit_codes() {
        let (good, bad) = (checked("a.ld", false), checked("a.ld", true));
        #[rustfmt::skip]
        let cases: [(&[CheckOutcome], u8, u8); 6] = [
            // Outcomes, exit code for a list of chips, exit code with `all`.
            (&[good.clone(), checked("b.ld", false)],   exit::OK,      exit::OK),
            (&[good.clone(), bad.clone()],              exit::FAILED,  exit::FAILED),
            (&[bad, refused("a.ld")],                   exit::FAILED,  exit::FAILED),
            (&[good.clone(), refused("a.ld")],          exit::REFUSED, exit::OK),
            (&[good, refused("b.ld")],                  exit::REFUSED, exit::REFUSED),
            (&[refused("a.ld"), refused("a.ld")],       exit::REFUSED, exit::REFUSED),
        ];
        for (n, (outcomes, list, all)) in cases.into_iter().enumerate() {
            assert_eq!((exit_code(outcomes, false), exit_code(outcomes, true)), (list, all), "case {n}");
        }
    }
}
