//! A fuzzing campaign: its plan (programs and chips), its progress and its findings. A campaign can be split
//! into shards whose records are merged again.

use std::time::Duration;

use diag::Diagnostic;
use ladder::{LadderDialect, LadderProgram, ParseOptions};
use serde::{Deserialize, Serialize};

use super::generator::{generate_program, program_seed};
use super::shrink_program::{smallest_program, with_notes};
use super::tally::ChipTally;
use super::watchdog::{Cancellation, WorkFailure, run_with_limit};
use crate::{CheckError, CheckOptions, CheckReport, check};

/// Version of the JSON record.
pub const FUZZ_SCHEMA: u32 = 1;

/// One chip of each family, for a campaign on all families.
pub const FAMILIES: [&str; 4] = ["at89s52", "pic16f873", "atmega328p", "ap101"];

/// The code of a compiler error that means that the compiler contradicts itself.
const INTERNAL_ERROR_CODE: &str = "LC099";

/// The plan of a campaign. A plan always gives the same programs and checks, however it is split.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CampaignPlan {
    /// Seed of the programs and of all random choices in their checks.
    pub seed: u64,
    /// Number of programs; they are numbered from 0.
    pub programs: u64,
    /// Number of scans per check.
    pub scans: u64,
    /// The names of the chips.
    pub mcus: Vec<String>,
}

/// A part of a campaign: every `of`-th program, starting with number `index` - 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CampaignShard {
    /// Index of the shard, from 1.
    pub index: u64,
    /// Number of shards, at least 1.
    pub of: u64,
    /// Number of its programs that are done, in order.
    pub done: u64,
}

impl CampaignShard {
    /// How many of `programs` belong to this shard.
    #[must_use]
    pub fn program_count(&self, programs: u64) -> u64 {
        match programs.checked_sub(self.index) {
            Some(after) => after / self.of.max(1) + 1,
            None => 0,
        }
    }

    /// The number of the shard's `k`-th program; both count from 0.
    #[must_use]
    pub fn program_number(&self, k: u64) -> u64 {
        k * self.of + self.index.saturating_sub(1)
    }

    /// The first of `programs` that belongs to both shards, which may be of different splits.
    fn first_shared_program(&self, other: &CampaignShard, programs: u64) -> Option<u64> {
        let (dense, sparse) = if self.of <= other.of { (self, other) } else { (other, self) };
        // After as many programs as the other split has shards, the pattern repeats.
        let mut numbers = (0..sparse.program_count(programs).min(dense.of)).map(|k| sparse.program_number(k));
        let of = dense.of.max(1);
        numbers.find(|number| number % of == dense.index.saturating_sub(1))
    }
}

/// A fault that a campaign found: a difference, a contradiction of the compiler, a panic or a timeout.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CampaignFinding {
    /// Number of the program, from 0.
    pub number: u64,
    /// The name of the chip.
    pub mcu: String,
    /// Description of the fault: one line, or the text of a report.
    pub what: String,
    /// A file name for the program.
    pub file: String,
    /// The smallest program found that shows the fault, as `.ld` text with the replay command in a comment.
    pub program: String,
    /// The command that shows the fault again, once the program is saved as `file`.
    pub replay: String,
}

/// Progress and findings of a campaign. `docs/fuzz.md` describes its JSON form.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CampaignRecord {
    /// Version of the JSON record, [`FUZZ_SCHEMA`].
    pub schema: u32,
    /// The plan of the campaign.
    pub plan: CampaignPlan,
    /// The shards that this record covers.
    pub shards: Vec<CampaignShard>,
    /// True if every program of the plan is done.
    pub complete: bool,
    /// Statistics per chip, in the order of the plan.
    pub tallies: Vec<ChipTally>,
    /// The findings, sorted by program and chip.
    pub findings: Vec<CampaignFinding>,
}

/// The results of one program on all chips of the plan.
#[derive(Debug, Clone)]
pub struct ProgramTrial {
    tallies: Vec<ChipTally>,
    findings: Vec<CampaignFinding>,
    timed_out: usize,
}

impl ProgramTrial {
    /// On how many chips compiling and checking took longer than the limit.
    #[must_use]
    pub fn timed_out_chips(&self) -> usize {
        self.timed_out
    }

    /// The findings of this program.
    #[must_use]
    pub fn findings(&self) -> &[CampaignFinding] {
        &self.findings
    }
}

/// Generates program `number`, and compiles and checks it on each chip within `limit` of wall-clock time. A
/// program that takes longer is a finding and is not shrunk. Its thread ends at the next progress call of its
/// check or, if the compiler does not return, with the process.
#[must_use]
pub fn run_trial(plan: &CampaignPlan, number: u64, limit: Duration) -> ProgramTrial {
    let (generated, profile) = generate_program(plan.seed, number);
    let mut trial = ProgramTrial { tallies: Vec::new(), findings: Vec::new(), timed_out: 0 };
    for mcu in &plan.mcus {
        let mut tally = ChipTally::new(mcu);
        if !ladder_compile::find_target(mcu).is_some_and(|target| profile.is_supported_by(target)) {
            tally.outside += 1;
            trial.tallies.push(tally);
            continue;
        }
        let options = CheckOptions {
            mcu: mcu.clone(),
            seed: program_seed(plan.seed, number),
            scans: plan.scans,
            rungs: false,
            explain: false,
            ..CheckOptions::default()
        };
        let result = try_program(&generated, &options, limit);
        match &result {
            TrialOutcome::Checked(program, report) => tally.count_check(program, report),
            TrialOutcome::Refused(code, message) => tally.count_refusal(code, message.clone()),
            TrialOutcome::Failed(WorkFailure::Panicked) => {}
            TrialOutcome::Failed(WorkFailure::TimedOut) => trial.timed_out += 1,
        }
        if let Some(kind) = result.to_fault() {
            trial.findings.push(make_finding(plan, number, &generated, &options, kind, limit));
        }
        trial.tallies.push(tally);
    }
    trial
}

/// The outcome of checking a generated program.
pub(super) enum TrialOutcome {
    /// The program was compiled and compared.
    Checked(Box<LadderProgram>, Box<CheckReport>),
    /// The program was refused: code and message of the first diagnostic.
    Refused(String, String),
    /// The compiler or the checker panicked or exceeded the time limit.
    Failed(WorkFailure),
}

/// The kinds of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TrialFault {
    /// Chip and evaluator differ.
    Differs,
    /// The compiler reported a contradiction in itself (LC099).
    InternalError,
    /// The compiler or the checker panicked or exceeded the time limit.
    Failed(WorkFailure),
}

impl TrialOutcome {
    /// The fault that this outcome shows; `None` for an agreement or an ordinary refusal.
    pub(super) fn to_fault(&self) -> Option<TrialFault> {
        match self {
            TrialOutcome::Checked(_, report) => (!report.agreed).then_some(TrialFault::Differs),
            TrialOutcome::Refused(code, _) => (code == INTERNAL_ERROR_CODE).then_some(TrialFault::InternalError),
            TrialOutcome::Failed(lost) => Some(TrialFault::Failed(*lost)),
        }
    }
}

/// Checks the program as parsed again from its text, so that exactly the saved program is checked.
pub(super) fn try_program(generated: &LadderProgram, options: &CheckOptions, limit: Duration) -> TrialOutcome {
    let (file, text, options) = (generated.file.clone(), ladder::write(generated), options.clone());
    let dialect = generated.dialect;
    let work = move |cancellation: &Cancellation| check_text(&file, &text, dialect, &options, cancellation);
    run_with_limit(limit, work).unwrap_or_else(TrialOutcome::Failed)
}

fn check_text(
    file: &str,
    text: &str,
    dialect: LadderDialect,
    options: &CheckOptions,
    cancellation: &Cancellation,
) -> TrialOutcome {
    let refused = |errors: Vec<Diagnostic>| {
        let first = errors.first();
        TrialOutcome::Refused(
            first.map_or_else(String::new, |d| d.code.to_owned()),
            first.map_or_else(String::new, |d| d.cause.clone()),
        )
    };
    let program = match ladder::parse_with(file, text, ParseOptions { dialect: Some(dialect) }) {
        Ok(parsed) => parsed.program,
        Err(errors) => return refused(errors),
    };
    match check(&program, options, &mut |_, _| cancellation.unwind_if_cancelled()) {
        Ok(report) => TrialOutcome::Checked(Box::new(program), Box::new(report)),
        Err(errors) => refused(errors),
    }
}

/// Shrinks a program that shows a fault, and describes it. A program that timed out is not shrunk, because
/// every try could leave another thread running.
fn make_finding(
    plan: &CampaignPlan,
    number: u64,
    generated: &LadderProgram,
    options: &CheckOptions,
    kind: TrialFault,
    limit: Duration,
) -> CampaignFinding {
    let file = format!("fuzz-{}-{number}-{}.ld", plan.seed, options.mcu);
    let mut shows_fault = |program: &LadderProgram| {
        let outcome = try_program(program, options, limit);
        let scan = match &outcome {
            TrialOutcome::Checked(_, report) => report.difference.as_ref().map(|difference| difference.scan),
            _ => None,
        };
        (outcome.to_fault() == Some(kind)).then_some(scan.unwrap_or(options.scans))
    };
    let timed_out = kind == TrialFault::Failed(WorkFailure::TimedOut);
    let (program, scans) = if timed_out {
        (generated.clone(), options.scans)
    } else {
        smallest_program(generated, options.scans, &mut shows_fault)
    };
    let command =
        |scans: u64| format!("emu check {file} --mcu {} --seed {} --scans {scans}", options.mcu, options.seed);
    let found = format!("found by emu fuzz --seed {} as program {number}", plan.seed);
    let program = with_notes(&program, &[&found, &command(scans)]);
    let last = CheckOptions { scans, explain: true, ..options.clone() };
    let outcome =
        if timed_out { TrialOutcome::Failed(WorkFailure::TimedOut) } else { try_program(&program, &last, limit) };
    let what = match outcome {
        TrialOutcome::Checked(_, report) => report.text(),
        TrialOutcome::Refused(code, message) => format!("{code}: {message}"),
        TrialOutcome::Failed(WorkFailure::Panicked) => "the compiler or the checker broke down".to_owned(),
        TrialOutcome::Failed(WorkFailure::TimedOut) => {
            format!("compile and check took longer than {} s", limit.as_secs_f64())
        }
    };
    let mcu = options.mcu.clone();
    CampaignFinding { number, mcu, what, program: ladder::write(&program), replay: command(scans), file }
}

impl CampaignRecord {
    /// A record of a shard with no program done.
    #[must_use]
    pub fn new(plan: CampaignPlan, shard: CampaignShard) -> CampaignRecord {
        let tallies = plan.mcus.iter().map(|mcu| ChipTally::new(mcu)).collect();
        let mut record = CampaignRecord {
            schema: FUZZ_SCHEMA,
            plan,
            shards: vec![shard],
            complete: false,
            tallies,
            findings: Vec::new(),
        };
        record.update_complete();
        record
    }

    /// Adds the results of the next program; the record must have exactly one shard.
    pub fn add_trial(&mut self, trial: &ProgramTrial) {
        self.tallies.iter_mut().zip(&trial.tallies).for_each(|(mine, other)| mine.add(other));
        self.findings.extend(trial.findings.iter().cloned());
        if let [shard] = self.shards.as_mut_slice() {
            shard.done += 1;
        }
        self.update_complete();
    }

    fn update_complete(&mut self) {
        let programs = self.plan.programs;
        let of = self.shards.first().map_or(1, |shard| shard.of);
        self.complete =
            self.shards.len() as u64 == of && self.shards.iter().all(|s| s.done == s.program_count(programs));
    }

    /// Merges the records of several shards of one plan.
    ///
    /// # Errors
    /// There are no records, the plans differ, a shard is impossible, or two shards overlap or have different
    /// splits.
    pub fn merge_shards(records: Vec<CampaignRecord>) -> Result<CampaignRecord, CheckError> {
        let mut records = records.into_iter();
        let mut merged = records.next().ok_or(CheckError::NoRecords)?;
        for other in records {
            if other.plan != merged.plan {
                return Err(CheckError::DifferentCampaigns);
            }
            merged.tallies.iter_mut().zip(&other.tallies).for_each(|(mine, other)| mine.add(other));
            merged.findings.extend(other.findings);
            merged.shards.extend(other.shards);
        }
        merged.shards.sort();
        merged.check_shards()?;
        let programs = merged.plan.programs;
        for (n, shard) in merged.shards.iter().enumerate() {
            for other in merged.shards.iter().skip(n + 1) {
                check_mergeable(shard, other, programs)?;
            }
        }
        merged.findings.sort_by(|a, b| (a.number, &a.mcu).cmp(&(b.number, &b.mcu)));
        merged.update_complete();
        Ok(merged)
    }

    /// Checks that the plan can have all shards of the record.
    ///
    /// # Errors
    /// The first shard that is impossible.
    pub fn check_shards(&self) -> Result<(), CheckError> {
        let programs = self.plan.programs;
        let is_impossible = |shard: &&CampaignShard| {
            shard.index == 0 || shard.index > shard.of || shard.done > shard.program_count(programs)
        };
        match self.shards.iter().find(is_impossible) {
            Some(&shard) => Err(CheckError::NoSuchShard { shard, programs }),
            None => Ok(()),
        }
    }

    /// The record as text.
    #[must_use]
    pub fn text(&self) -> String {
        let CampaignPlan { seed, programs, scans, mcus } = &self.plan;
        let done: u64 = self.shards.iter().map(|shard| shard.done).sum();
        let state = if self.complete { "complete" } else { "not complete" };
        let mut out = format!(
            "fuzz: seed {seed}, {done} of {programs} programs of {scans} scans on {}: {state}\n",
            mcus.join(", ")
        );
        self.tallies.iter().for_each(|tally| out += &tally.text());
        for finding in &self.findings {
            let CampaignFinding { number, mcu, what, replay, .. } = finding;
            out += &format!("\nprogram {number} on {mcu}:\n{}\nreplay: {replay}\n", what.trim_end());
        }
        out += &match self.findings.len() {
            0 => "no differences\n".to_owned(),
            1 => "1 finding\n".to_owned(),
            findings => format!("{findings} findings\n"),
        };
        out
    }
}

/// Checks that two shards can be merged: they belong to the same split and are different.
fn check_mergeable(a: &CampaignShard, b: &CampaignShard, programs: u64) -> Result<(), CheckError> {
    let (a, b) = (*a, *b);
    if a.of == b.of {
        return if a.index == b.index { Err(CheckError::DuplicateShard { shard: a }) } else { Ok(()) };
    }
    Err(match a.first_shared_program(&b, programs) {
        Some(first) => CheckError::OverlappingShards { a, b, first },
        None => CheckError::DifferentSplits { a, b },
    })
}
