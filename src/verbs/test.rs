//! `emu test`: runs the tests of a folder in parallel, each as a command of `emu` in a process of its own.

mod cases;
mod find;
mod manifest;
mod page;
mod results;
mod runner;

use std::io::IsTerminal;
use std::num::NonZeroUsize;
use std::time::{Duration, Instant};

use clap::Args;
use emu_debug::time;
use serde_json::json;

use crate::shared::fail::{VerbFailure, exit};
use crate::shared::output::{self, RequestedOutput};
use crate::shared::report::MessageStyle;
use crate::shared::usage_error::UsageError;
use cases::TestCase;
use results::{TestResult, TestSummary};
use runner::TestRunner;

const EXAMPLES: &str = "\
Examples:
  emu test                                     the tests of emu.toml, or all scenarios below this folder
  emu test examples --junit results.xml
  emu test examples/welder.toml                one scenario
  emu test --filter welder --fail-fast
  emu test --list

docs/test.md describes emu.toml. Exit codes: 0 all tests passed; 1 a test did not pass; 2 a usage error, or there is no
test; 3 a file was refused.";

/// Flags of `emu test`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct TestArgs {
    /// Folders with an emu.toml or with scenarios, and files: an emu.toml or a scenario. Default: the
    /// emu.toml of this folder or of the nearest one above it, otherwise this folder.
    #[arg(value_name = "DIR|FILE")]
    places: Vec<String>,
    /// Run only tests whose name contains this text. Repeatable; a test that contains one of them runs.
    #[arg(long, value_name = "TEXT")]
    filter: Vec<String>,
    /// Print the names of the tests and their commands, and run none.
    #[arg(long)]
    list: bool,
    /// Start no further test after one that did not pass.
    #[arg(long)]
    fail_fast: bool,
    /// Number of tests that run at the same time. Default: the number of processors.
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
    /// Run each test twice, and let it fail if its outputs differ. The same command always gives the same
    /// output, so a difference is a fault of emu or of a file that changes meanwhile.
    #[arg(long)]
    twice: bool,
    /// End a test after this much host time.
    #[arg(long, value_name = "TIME", default_value = "300s", value_parser = time::parse_duration)]
    timeout: Duration,
    /// Write the results as JUnit XML, with the time of each test.
    #[arg(long, value_name = "FILE")]
    junit: Option<String>,
    /// Write the results as one HTML page, with the output and the waveform of each test that failed.
    #[arg(long, value_name = "FILE")]
    report: Option<String>,
    /// Write a waveform (SVG) of each scenario that failed to this folder.
    #[arg(long, value_name = "DIR")]
    waves: Option<String>,
    /// One JSON document.
    #[arg(long)]
    pub json: bool,
}

/// Finds tests, runs them and reports the results.
pub fn test(args: &TestArgs, message_style: &MessageStyle) -> Result<u8, VerbFailure> {
    let json_output = RequestedOutput::printed("--json", args.json);
    let files = [("--junit", &args.junit), ("--report", &args.report)];
    let files = files.into_iter().filter_map(|(flag, file)| RequestedOutput::to_file(flag, file.as_deref()));
    output::check_distinct_outputs(&files.chain(json_output).collect::<Vec<_>>())?;
    let mut cases = find::find_cases(&args.places, message_style)?;
    let found = cases.len();
    let is_wanted = |case: &TestCase| args.filter.iter().any(|text| case.name.contains(text.as_str()));
    cases.retain(|case| args.filter.is_empty() || is_wanted(case));
    if cases.is_empty() {
        return Err(VerbFailure::usage(UsageError::NoTest { found }));
    }
    if args.list {
        return list(args, &cases);
    }
    let started = Instant::now();
    let is_quiet = args.json || [&args.junit, &args.report].iter().any(|file| file.as_deref() == Some("-"));
    let style = results::LineStyle::new(message_style.color && std::io::stdout().is_terminal(), is_quiet, cases.len());
    let runner = TestRunner::new(args.timeout, args.twice, args.waves.is_some() || args.report.is_some())?;
    let results = run_all(args, &runner, &cases, &style)?;
    let summary = TestSummary::new(&results, found, started.elapsed());
    if let Some(folder) = &args.waves {
        write_waves(folder, &results)?;
    }
    let texts = [
        args.junit.as_deref().map(|file| Ok::<_, VerbFailure>((file, results::junit(file, &results)?))).transpose()?,
        args.report.as_deref().map(|file| (file, page::html_page(&results, &summary))),
    ];
    let files: Vec<(&str, &[u8])> = texts.iter().flatten().map(|(file, text)| (*file, text.as_bytes())).collect();
    output::write_files(&files)?;
    if std::env::var_os("GITHUB_ACTIONS").is_some_and(|value| value == "true") {
        // Annotations must be lines of standard output or standard error; the latter carries no results.
        results.iter().filter_map(TestResult::github_annotation).for_each(|line| output::print_to_stderr(&line));
    }
    if args.json {
        output::print_json(&json!({
            "schema": 1,
            "summary": summary.json(),
            "tests": results.iter().map(TestResult::json).collect::<Vec<_>>(),
        }))?;
    } else if !is_quiet {
        output::print(summary.text(&style))?;
    }
    Ok(if summary.all_passed() { exit::OK } else { exit::FAILED })
}

/// Runs the tests in parallel, and prints the result of each when it ends.
fn run_all<'a>(
    args: &TestArgs,
    runner: &TestRunner,
    cases: &'a [TestCase],
    style: &results::LineStyle,
) -> Result<Vec<TestResult<'a>>, VerbFailure> {
    let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let jobs = args.jobs.map_or(processors, NonZeroUsize::get).min(cases.len());
    let results = runner.run_all(cases, jobs, args.fail_fast, |result| match style.is_quiet {
        true => Ok(()),
        false => output::print(result.text(style)),
    });
    results.into_iter().collect()
}

/// Prints the names of the tests and their commands.
fn list(args: &TestArgs, cases: &[TestCase]) -> Result<u8, VerbFailure> {
    if args.json {
        let tests: Vec<_> = cases.iter().map(TestCase::json).collect();
        output::print_json(&json!({ "schema": 1, "tests": tests }))?;
    } else {
        let line = |case: &TestCase| format!("{}\n    {}\n", case.name, case.command());
        output::print(cases.iter().map(line).collect::<String>())?;
    }
    Ok(exit::OK)
}

/// Writes the waveforms of failed tests to a folder.
fn write_waves(folder: &str, results: &[TestResult<'_>]) -> Result<(), VerbFailure> {
    output::ensure_writable_folder(folder)?;
    let wave = |result: &&TestResult<'_>| result.wave.is_some();
    let files: Vec<(String, &str)> = results
        .iter()
        .filter(wave)
        .filter_map(|result| Some((format!("{folder}/{}.svg", result.case.file_stem()), result.wave.as_deref()?)))
        .collect();
    let files: Vec<(&str, &[u8])> = files.iter().map(|(file, text)| (file.as_str(), text.as_bytes())).collect();
    output::write_files(&files)
}
