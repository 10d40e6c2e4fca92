//! `emu fuzz`: random programs, compiled and checked on a chip of each family, in shards whose records are added again.

use std::path::Path;
use std::time::{Duration, Instant};

use clap::Args;
use emu_check::fuzz::{self, FAMILIES, Finding, Plan, Record, Shard, Trial};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::codes::{RECORD, about_file};
use crate::fail::{Failure, exit};
use crate::family::{ChipChoice, ChipChoiceParser};
use crate::input;
use crate::output;
use crate::report::{Terminal, Texts};

const EXAMPLES: &str = "\
Examples:
  emu fuzz --mcu all --programs 1000
  emu fuzz --mcu all --programs 10000 --seed 7 --shard 3/16 --out part3.json --resume --save found
  emu fuzz --merge part*.json --out whole.json
  emu fuzz --mcu pic16f873 --programs 200 --scans 1000 --json

Program n of a seed is the same in any shard and with any number of jobs, so a campaign can be spread over machines.

Exit codes: 0 no difference; 1 chip and reference differ somewhere, and the smallest program that shows it is told; 3 a record
cannot be used; 5 the records that were added are not yet the whole campaign.";

/// Time after which a bar shows how far the campaign is.
const PATIENCE: Duration = Duration::from_secs(1);

/// Time after which what is done is written. With the batch that is running it is at most about a second's work that gets lost,
/// or one program of each job.
const SAVING: Duration = Duration::from_millis(500);

/// Most programs of a job before results are collected.
const BATCH: usize = 16;

/// Programs beyond their time after which a campaign ends: each may keep a processor busy for as long as it goes on.
const TIMED_OUT_MAX: usize = 8;

/// The largest figure of a record that is believed; sums of very many of them still fit.
const FIGURE_MAX: u64 = 1 << 48;

/// Flags of `emu fuzz`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FuzzArgs {
    /// The chips, separated by commas, or `all` for one of each family.
    #[arg(long, value_name = "CHIP", value_parser = ChipChoiceParser { compiled: true }, hide_possible_values = true, value_delimiter = ',', required_unless_present = "merge")]
    mcu: Vec<ChipChoice>,
    /// Number of programs, numbered from 0.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), required_unless_present = "merge")]
    programs: Option<u64>,
    /// Seed of the programs and of everything random in their checks. It is fixed unless given, so that runs can be repeated.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Scans of each check.
    #[arg(long, value_name = "K", default_value_t = 250, value_parser = clap::value_parser!(u64).range(1..))]
    scans: u64,
    /// Programs at a time; by default as many as there are processors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Only every N-th program, beginning with the I-th.
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1")]
    shard: Shard,
    /// Longest time for a program on a chip, in seconds; one that takes longer is saved and counted as a finding.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "60")]
    timeout: Duration,
    /// Folder for the programs that show a difference, each with the command that replays it. It is made at the start.
    #[arg(long, value_name = "DIR")]
    save: Option<String>,
    /// File for the record, written at the start, about every second and at the end, always whole.
    #[arg(long, value_name = "FILE.json")]
    out: Option<String>,
    /// Go on where the record of --out stands, if there is one.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Add the records of shards instead, and tell whether they are the whole campaign.
    #[arg(long, value_name = "FILE.json", num_args = 1.., conflicts_with_all = ["mcu", "programs", "resume", "shard"])]
    merge: Vec<String>,
    /// The record as one JSON document.
    #[arg(long)]
    pub json: bool,
}

fn shard(text: &str) -> Result<Shard, String> {
    let numbers = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((index, of)) if (1..=of).contains(&index) => Ok(Shard { index, of, done: 0 }),
        _ => Err("write I/N with I from 1 to N, such as 3/16".to_owned()),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let limit = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    limit.filter(|limit| !limit.is_zero()).ok_or_else(|| "write seconds above 0, such as 60 or 0.5".to_owned())
}

/// Runs a campaign or a shard of one, or adds records.
pub fn fuzz(args: &FuzzArgs, terminal: &Terminal) -> Result<u8, Failure> {
    let printed = if args.json { "--json" } else { "the figures" };
    let outputs: Vec<_> =
        std::iter::once((printed, "-")).chain(args.out.as_deref().map(|out| ("--out", out))).collect();
    output::owners(&outputs)?;
    args.merge.iter().try_for_each(|file| output::spares(file, &outputs))?;
    if !args.merge.is_empty() {
        return merge(args);
    }
    let mut mcus: Vec<String> = Vec::new();
    for which in &args.mcu {
        let named = match which {
            ChipChoice::All => FAMILIES.to_vec(),
            ChipChoice::One(chip) => vec![chip.name],
        };
        mcus.extend(named.into_iter().map(str::to_owned).filter(|name| !mcus.contains(name)).collect::<Vec<_>>());
    }
    let plan = Plan { seed: args.seed, programs: args.programs.unwrap_or(1), scans: args.scans, mcus };
    let mut record = Record::new(plan, args.shard);
    if let (true, Some(out)) = (args.resume, &args.out)
        && Path::new(out).exists()
    {
        record = resumed(out, record)?;
    }
    let Some(Shard { done, .. }) = record.shards.first().copied() else { return Ok(exit::OK) };
    let mine = args.shard.programs(record.plan.programs);
    let jobs = args.jobs.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build();
    let pool = pool.map_err(|error| Failure::Usage(format!("no threads for --jobs {jobs}: {error}")))?;
    let threads = pool.current_num_threads();
    folder(args)?;
    // What was found before and could not be saved is saved now.
    keep(args, &record, &record.findings)?;
    if mine == 0 {
        let Shard { index, of, .. } = args.shard;
        output::tell(&format!("note: shard {index}/{of} has none of {} programs\n", record.plan.programs));
    }
    let (start, mut saved) = (Instant::now(), Instant::now());
    let (mut bar, mut next, mut batch, mut timed_out) = (None, done, threads, 0);
    while next < mine && timed_out < TIMED_OUT_MAX {
        let numbers: Vec<u64> = (next..mine).take(batch).map(|k| args.shard.number(k)).collect();
        next += numbers.len() as u64;
        let (plan, begun) = (&record.plan, Instant::now());
        let trial = |&number| fuzz::trial(plan, number, args.timeout);
        let trials: Vec<Trial> = pool.install(|| numbers.par_iter().map(trial).collect());
        timed_out += trials.iter().map(Trial::timed_out).sum::<usize>();
        // Jobs wait for each other at the end of a batch, so it is made longer, but not for long.
        batch = if begun.elapsed() > SAVING / 2 { threads } else { (batch * 2).min(threads * BATCH) };
        trials.iter().for_each(|trial| record.add(trial));
        let found: Vec<Finding> = trials.iter().flat_map(|trial| trial.findings().to_vec()).collect();
        if saved.elapsed() >= SAVING || !found.is_empty() {
            keep(args, &record, &found)?;
            saved = Instant::now();
        }
        if terminal.live && start.elapsed() >= PATIENCE {
            let done = record.shards.first().map_or(0, |shard| shard.done);
            bar.get_or_insert_with(|| progress_bar(mine)).set_position(done);
        }
    }
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    keep(args, &record, &[])?;
    if timed_out >= TIMED_OUT_MAX && next < mine {
        output::tell(&format!(
            "note: the campaign ends early: {timed_out} programs took longer than {} s and may still run beside it; \
             --resume goes on behind them\n",
            args.timeout.as_secs_f64()
        ));
    }
    finish(args, &record)
}

/// Adds records.
fn merge(args: &FuzzArgs) -> Result<u8, Failure> {
    let records = args.merge.iter().map(|file| read(file)).collect::<Result<Vec<Record>, Failure>>()?;
    let first = args.merge.first().map_or("-", String::as_str);
    let sum = Record::merge(records).map_err(|why| refused(first, why, "give each shard of one campaign once"))?;
    folder(args)?;
    keep(args, &sum, &sum.findings)?;
    let code = finish(args, &sum)?;
    Ok(if code == exit::OK && !sum.complete { exit::LIMIT } else { code })
}

/// The result out.
fn finish(args: &FuzzArgs, record: &Record) -> Result<u8, Failure> {
    if args.json {
        output::json(record)?;
    } else {
        output::print(record.text())?;
    }
    Ok(if record.findings.is_empty() { exit::OK } else { exit::FAILED })
}

/// Makes the folder of --save. A campaign of days must not find out at its first difference that it cannot.
fn folder(args: &FuzzArgs) -> Result<(), Failure> {
    args.save.as_deref().map_or(Ok(()), output::folder)
}

/// Writes the record, whole or not at all, and then the programs that show something: where there is no room for them, the
/// record has them.
fn keep(args: &FuzzArgs, record: &Record, found: &[Finding]) -> Result<(), Failure> {
    if let Some(out) = &args.out {
        let text = serde_json::to_string_pretty(record).map_err(|e| Failure::writing(out, &e.into()))?;
        output::files(&[(out, (text + "\n").as_bytes())])?;
    }
    let Some(folder) = &args.save else { return Ok(()) };
    found.iter().try_for_each(|finding| {
        let file = Path::new(folder).join(&finding.file);
        output::files(&[(&file.to_string_lossy(), finding.program.as_bytes())])
    })
}

/// A figure that is too large to be added up with others.
fn beyond(value: &serde_json::Value) -> Option<u64> {
    use serde_json::Value;
    match value {
        Value::Number(figure) => figure.as_u64().filter(|&figure| figure > FIGURE_MAX),
        Value::Array(values) => values.iter().find_map(beyond),
        Value::Object(values) => values.values().find_map(beyond),
        Value::Null | Value::Bool(_) | Value::String(_) => None,
    }
}

fn read(file: &str) -> Result<Record, Failure> {
    let bytes = input::bytes(file)?;
    let record: Record = serde_json::from_slice(&bytes).map_err(|error| {
        refused(file, format!("is no record of a campaign: {error}"), "give a file of emu fuzz --out")
    })?;
    if record.schema != fuzz::FUZZ_SCHEMA {
        let cause = format!("has the schema {}, known is {}", record.schema, fuzz::FUZZ_SCHEMA);
        return Err(refused(file, cause, "take the emu that wrote it"));
    }
    let figures = serde_json::json!([record.tallies, record.shards.iter().map(|shard| shard.done).collect::<Vec<_>>()]);
    if let Some(figure) = beyond(&figures) {
        let cause = format!("has the figure {figure}, which no campaign reaches");
        return Err(refused(file, cause, "give a file of emu fuzz --out"));
    }
    // Programs are written into the folder of --save and nowhere else.
    let plain = |name: &str| Path::new(name).file_name().is_some_and(|own| own == name);
    if let Some(finding) = record.findings.iter().find(|finding| !plain(&finding.file)) {
        let cause = format!("has a program whose file is no plain name: {:?}", finding.file);
        return Err(refused(file, cause, "give a file of emu fuzz --out"));
    }
    Ok(record)
}

/// The record of a shard that was begun, where it is the one that `wanted` begins.
fn resumed(file: &str, wanted: Record) -> Result<Record, Failure> {
    let found = read(file)?;
    let place = |record: &Record| record.shards.iter().map(|shard| (shard.index, shard.of)).collect::<Vec<_>>();
    if found.plan != wanted.plan || place(&found) != place(&wanted) {
        let cause = "is the record of another campaign or shard".to_owned();
        return Err(refused(file, cause, "give the same flags as before, or another --out"));
    }
    found.possible().map_err(|cause| refused(file, cause, "give the record as emu fuzz wrote it, or another --out"))?;
    Ok(found)
}

fn refused(file: &str, cause: String, hint: &str) -> Failure {
    Failure::Refused(vec![about_file(RECORD, file, cause, hint)], Texts::default())
}

fn progress_bar(total: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} programs");
    ProgressBar::new(total).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
