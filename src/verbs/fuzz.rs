//! `emu fuzz`: compiles random programs and checks them on one chip of each family, in shards whose records
//! can be merged.

use std::path::Path;
use std::time::{Duration, Instant};

use clap::Args;
use emu_check::fuzz::{self, CampaignFinding, CampaignPlan, CampaignRecord, CampaignShard, FAMILIES, ProgramTrial};
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::shared::codes::{CAMPAIGN_RECORD, file_error};
use crate::shared::fail::{VerbFailure, exit};
use crate::shared::family::{ChipChoice, ChipChoiceParser};
use crate::shared::output::RequestedOutput;
use crate::shared::report::{FileTexts, MessageStyle};
use crate::shared::usage_error::UsageError;
use crate::shared::{input, output};

const EXAMPLES: &str = "\
Examples:
  emu fuzz --mcu all --programs 1000
  emu fuzz --mcu all --programs 10000 --seed 7 --shard 3/16 --out part3.json --resume --save found
  emu fuzz --merge part*.json --out whole.json
  emu fuzz --mcu pic16f873 --programs 200 --scans 1000 --json

Program n of a seed is the same in any shard and with any number of jobs, so a campaign can be spread over machines.

Exit codes: 0 no difference; 1 chip and reference differ: the smallest such program is reported; 3 a record
cannot be used; 5 the merged records do not yet contain the whole campaign.";

/// Time after which a progress bar appears.
const PROGRESS_DELAY: Duration = Duration::from_secs(1);

/// Interval at which the record is written. A crash loses at most about one second of work including the
/// current batch, or one program per job.
const SAVE_INTERVAL: Duration = Duration::from_millis(500);

/// Maximum number of programs per job between two collections of results.
const BATCH: usize = 16;

/// Number of timed-out programs that ends a campaign. A program that timed out may keep a processor busy
/// until the process ends.
const TIMED_OUT_MAX: usize = 8;

/// The largest number that is accepted in a record. It leaves room for sums of very many records.
const FIGURE_MAX: u64 = 1 << 48;

/// Flags of `emu fuzz`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct FuzzArgs {
    /// The chips, separated by commas, or `all` for one chip of each family.
    #[arg(long, value_name = "CHIP", value_parser = ChipChoiceParser { compiled: true }, hide_possible_values = true, value_delimiter = ',', required_unless_present = "merge")]
    mcu: Vec<ChipChoice>,
    /// Number of programs; the first has number 0.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), required_unless_present = "merge")]
    programs: Option<u64>,
    /// Seed of the programs and of all random choices in their checks. The default is fixed, so that runs can
    /// be repeated.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Number of scans in each check.
    #[arg(long, value_name = "K", default_value_t = 250, value_parser = clap::value_parser!(u64).range(1..))]
    scans: u64,
    /// Number of programs that run in parallel. Default: the number of processors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Run only every N-th program, starting with the I-th.
    #[arg(long, value_name = "I/N", value_parser = shard, default_value = "1/1")]
    shard: CampaignShard,
    /// Maximum time for a program on a chip, in seconds. A program that takes longer is saved and counted as
    /// a finding.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "60")]
    timeout: Duration,
    /// Folder for the programs that show a difference, each with the command that replays it. It is created
    /// at the start.
    #[arg(long, value_name = "DIR")]
    save: Option<String>,
    /// File for the record. It is written at the start, about every second and at the end, and is always
    /// complete.
    #[arg(long, value_name = "FILE.json")]
    out: Option<String>,
    /// Continue from the record of --out, if it exists.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Merge the records of shards instead, and report whether they form the complete campaign.
    #[arg(long, value_name = "FILE.json", num_args = 1.., conflicts_with_all = ["mcu", "programs", "resume", "shard"])]
    merge: Vec<String>,
    /// The record as one JSON document.
    #[arg(long)]
    pub json: bool,
}

fn shard(text: &str) -> Result<CampaignShard, UsageError> {
    let numbers = text.split_once('/').and_then(|(index, of)| Some((index.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((index, of)) if (1..=of).contains(&index) => Ok(CampaignShard { index, of, done: 0 }),
        _ => Err(UsageError::malformed("write I/N with I from 1 to N, such as 3/16")),
    }
}

fn seconds(text: &str) -> Result<Duration, UsageError> {
    let limit = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    limit
        .filter(|limit| !limit.is_zero())
        .ok_or_else(|| UsageError::malformed("write seconds above 0, such as 60 or 0.5"))
}

/// Runs a campaign or one of its shards, or merges records.
pub fn fuzz(args: &FuzzArgs, style: &MessageStyle) -> Result<u8, VerbFailure> {
    let printed = if args.json { "--json" } else { "the figures" };
    let mut outputs = vec![RequestedOutput::new(printed, "-")];
    outputs.extend(RequestedOutput::to_file("--out", args.out.as_deref()));
    output::check_distinct_outputs(&outputs)?;
    args.merge.iter().try_for_each(|file| output::check_input_not_overwritten(file, &outputs))?;
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
    let plan = CampaignPlan { seed: args.seed, programs: args.programs.unwrap_or(1), scans: args.scans, mcus };
    let mut record = CampaignRecord::new(plan, args.shard);
    if let (true, Some(out)) = (args.resume, &args.out)
        && Path::new(out).exists()
    {
        record = resume_record(out, record)?;
    }
    let Some(CampaignShard { done, .. }) = record.shards.first().copied() else { return Ok(exit::OK) };
    let shard_programs = args.shard.program_count(record.plan.programs);
    let jobs = args.jobs.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build();
    let pool = pool.map_err(|error| VerbFailure::Usage(format!("no threads for --jobs {jobs}: {error}")))?;
    let threads = pool.current_num_threads();
    make_save_folder(args)?;
    // Save findings that an interrupted run could not save.
    save_record(args, &record, &record.findings)?;
    if shard_programs == 0 {
        let CampaignShard { index, of, .. } = args.shard;
        output::print_to_stderr(&format!("note: shard {index}/{of} has none of {} programs\n", record.plan.programs));
    }
    let (start, mut saved) = (Instant::now(), Instant::now());
    let (mut bar, mut next, mut batch, mut timed_out) = (None, done, threads, 0);
    while next < shard_programs && timed_out < TIMED_OUT_MAX {
        let numbers: Vec<u64> = (next..shard_programs).take(batch).map(|k| args.shard.program_number(k)).collect();
        next += numbers.len() as u64;
        let (plan, begun) = (&record.plan, Instant::now());
        let trial = |&number| fuzz::run_trial(plan, number, args.timeout);
        let trials: Vec<ProgramTrial> = pool.install(|| numbers.par_iter().map(trial).collect());
        timed_out += trials.iter().map(ProgramTrial::timed_out_chips).sum::<usize>();
        // The jobs wait for each other at the end of a batch, so batches grow while they stay short.
        batch = if begun.elapsed() > SAVE_INTERVAL / 2 { threads } else { (batch * 2).min(threads * BATCH) };
        trials.iter().for_each(|trial| record.add_trial(trial));
        let found: Vec<CampaignFinding> = trials.iter().flat_map(|trial| trial.findings().to_vec()).collect();
        if saved.elapsed() >= SAVE_INTERVAL || !found.is_empty() {
            save_record(args, &record, &found)?;
            saved = Instant::now();
        }
        if style.is_terminal && start.elapsed() >= PROGRESS_DELAY {
            let done = record.shards.first().map_or(0, |shard| shard.done);
            bar.get_or_insert_with(|| progress_bar(shard_programs)).set_position(done);
        }
    }
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    save_record(args, &record, &[])?;
    if timed_out >= TIMED_OUT_MAX && next < shard_programs {
        output::print_to_stderr(&format!(
            "note: the campaign ends early: {timed_out} programs took longer than {} s and may still run in parallel; \
             --resume continues after them\n",
            args.timeout.as_secs_f64()
        ));
    }
    finish(args, &record)
}

/// Merges records.
fn merge(args: &FuzzArgs) -> Result<u8, VerbFailure> {
    let records =
        args.merge.iter().map(|file| read_record(file)).collect::<Result<Vec<CampaignRecord>, VerbFailure>>()?;
    let first = args.merge.first().map_or("-", String::as_str);
    let sum = CampaignRecord::merge_shards(records)
        .map_err(|why| refused(first, why.to_string(), "give each shard of one campaign once"))?;
    make_save_folder(args)?;
    save_record(args, &sum, &sum.findings)?;
    let code = finish(args, &sum)?;
    Ok(if code == exit::OK && !sum.complete { exit::LIMIT } else { code })
}

/// Prints the result and returns the exit code.
fn finish(args: &FuzzArgs, record: &CampaignRecord) -> Result<u8, VerbFailure> {
    if args.json {
        output::print_json(record)?;
    } else {
        output::print(record.text())?;
    }
    Ok(if record.findings.is_empty() { exit::OK } else { exit::FAILED })
}

/// Creates the folder of --save, so that a long campaign does not fail at its first difference.
fn make_save_folder(args: &FuzzArgs) -> Result<(), VerbFailure> {
    args.save.as_deref().map_or(Ok(()), output::ensure_writable_folder)
}

/// Writes the record, completely or not at all, then the programs of the findings. If there is no space for
/// the programs, the record still contains them.
fn save_record(args: &FuzzArgs, record: &CampaignRecord, found: &[CampaignFinding]) -> Result<(), VerbFailure> {
    if let Some(out) = &args.out {
        let text = serde_json::to_string_pretty(record).map_err(|e| VerbFailure::write_failed(out, &e.into()))?;
        output::write_files(&[(out, (text + "\n").as_bytes())])?;
    }
    let Some(folder) = &args.save else { return Ok(()) };
    found.iter().try_for_each(|finding| {
        let file = Path::new(folder).join(&finding.file);
        output::write_files(&[(&file.to_string_lossy(), finding.program.as_bytes())])
    })
}

/// Returns a number in a record that is too large for sums.
fn oversized_figure(value: &serde_json::Value) -> Option<u64> {
    use serde_json::Value;
    match value {
        Value::Number(figure) => figure.as_u64().filter(|&figure| figure > FIGURE_MAX),
        Value::Array(values) => values.iter().find_map(oversized_figure),
        Value::Object(values) => values.values().find_map(oversized_figure),
        Value::Null | Value::Bool(_) | Value::String(_) => None,
    }
}

fn read_record(file: &str) -> Result<CampaignRecord, VerbFailure> {
    let bytes = input::read_bytes(file)?;
    let record: CampaignRecord = serde_json::from_slice(&bytes).map_err(|error| {
        refused(file, format!("is not a record of a campaign: {error}"), "give a file of emu fuzz --out")
    })?;
    if record.schema != fuzz::FUZZ_SCHEMA {
        let cause = format!("has the schema {}, known is {}", record.schema, fuzz::FUZZ_SCHEMA);
        return Err(refused(file, cause, "take the emu that wrote it"));
    }
    let figures = serde_json::json!([record.tallies, record.shards.iter().map(|shard| shard.done).collect::<Vec<_>>()]);
    if let Some(figure) = oversized_figure(&figures) {
        let cause = format!("has the figure {figure}, which no campaign reaches");
        return Err(refused(file, cause, "give a file of emu fuzz --out"));
    }
    // Programs are written only into the folder of --save.
    let plain = |name: &str| Path::new(name).file_name().is_some_and(|own| own == name);
    if let Some(finding) = record.findings.iter().find(|finding| !plain(&finding.file)) {
        let cause = format!("has a program whose file is not a plain name: {:?}", finding.file);
        return Err(refused(file, cause, "give a file of emu fuzz --out"));
    }
    Ok(record)
}

/// Reads the record of an interrupted shard. Refuses a record with a plan or shard other than `wanted`.
fn resume_record(file: &str, wanted: CampaignRecord) -> Result<CampaignRecord, VerbFailure> {
    let found = read_record(file)?;
    let place = |record: &CampaignRecord| record.shards.iter().map(|shard| (shard.index, shard.of)).collect::<Vec<_>>();
    if found.plan != wanted.plan || place(&found) != place(&wanted) {
        let cause = "is the record of another campaign or shard".to_owned();
        return Err(refused(file, cause, "give the same flags as before, or another --out"));
    }
    found
        .check_shards()
        .map_err(|error| refused(file, error.to_string(), "give the record as emu fuzz wrote it, or another --out"))?;
    Ok(found)
}

fn refused(file: &str, cause: String, hint: &str) -> VerbFailure {
    VerbFailure::Refused(vec![file_error(CAMPAIGN_RECORD, file, cause, hint)], FileTexts::default())
}

fn progress_bar(total: u64) -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} programs");
    ProgressBar::new(total).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
