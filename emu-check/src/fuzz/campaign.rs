//! A campaign: which programs, on which chips, how far it is, and what was found. It can be spread over shards, whose records
//! are added again.

use std::time::Duration;

use diag::Diagnostic;
use ladder::LadderProgram;
use serde::{Deserialize, Serialize};

use super::generator::{generate_program, program_seed};
use super::shrink_program::{smallest_program, with_notes};
use super::tally::ChipTally;
use super::watchdog::{Cancellation, WorkFailure, run_with_limit};
use crate::{CheckError, CheckOptions, CheckReport, check};

/// Version of the record.
pub const FUZZ_SCHEMA: u32 = 1;

/// A chip of each family, for a campaign on all of them.
pub const FAMILIES: [&str; 4] = ["at89s52", "pic16f873", "atmega328p", "ap101"];

/// Code of a refusal in which the compiler contradicts itself.
const INTERNAL_ERROR_CODE: &str = "LC099";

/// What is to be done. The same plan gives the same programs and checks for ever, in whatever pieces.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CampaignPlan {
    /// Seed of the programs and of everything random in their checks.
    pub seed: u64,
    /// How many programs, numbered from 0.
    pub programs: u64,
    /// Scans of each check.
    pub scans: u64,
    /// The chips.
    pub mcus: Vec<String>,
}

/// Every `of`-th program, beginning with number `index` - 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct CampaignShard {
    /// Which, from 1.
    pub index: u64,
    /// How many there are, at least 1.
    pub of: u64,
    /// Programs of it that are done, in order.
    pub done: u64,
}

impl CampaignShard {
    /// How many of `programs` are its own.
    #[must_use]
    pub fn program_count(&self, programs: u64) -> u64 {
        match programs.checked_sub(self.index) {
            Some(after) => after / self.of.max(1) + 1,
            None => 0,
        }
    }

    /// The number of its `k`-th program, from 0.
    #[must_use]
    pub fn program_number(&self, k: u64) -> u64 {
        k * self.of + self.index.saturating_sub(1)
    }

    /// The first of `programs` that belongs to another shard too, which may be of another split.
    fn first_shared_program(&self, other: &CampaignShard, programs: u64) -> Option<u64> {
        let (dense, sparse) = if self.of <= other.of { (self, other) } else { (other, self) };
        // After as many numbers as the other split has shards, the places in it repeat.
        let mut numbers = (0..sparse.program_count(programs).min(dense.of)).map(|k| sparse.program_number(k));
        let of = dense.of.max(1);
        numbers.find(|number| number % of == dense.index.saturating_sub(1))
    }
}

/// Something that must not be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CampaignFinding {
    /// Number of the program.
    pub number: u64,
    /// The chip.
    pub mcu: String,
    /// What it is, in a line or in the text of a report.
    pub what: String,
    /// Name of a file for the program.
    pub file: String,
    /// The smallest program found that shows it, as `.ld` text with the command that replays it in a comment.
    pub program: String,
    /// The command that shows it again, once the program lies in `file`.
    pub replay: String,
}

/// How far a campaign is and what it found. `docs/fuzz.md` describes its JSON.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CampaignRecord {
    /// Version of this shape, [`FUZZ_SCHEMA`].
    pub schema: u32,
    /// What is to be done.
    pub plan: CampaignPlan,
    /// The parts that this record holds.
    pub shards: Vec<CampaignShard>,
    /// Every program of the plan is done.
    pub complete: bool,
    /// Figures by chip, in the order of the plan.
    pub tallies: Vec<ChipTally>,
    /// What was found, by number and chip.
    pub findings: Vec<CampaignFinding>,
}

/// What came of one program.
#[derive(Debug, Clone)]
pub struct ProgramTrial {
    tallies: Vec<ChipTally>,
    findings: Vec<CampaignFinding>,
    timed_out: usize,
}

impl ProgramTrial {
    /// On how many chips its compile and check took longer than the limit.
    #[must_use]
    pub fn timed_out_chips(&self) -> usize {
        self.timed_out
    }

    /// What was found with this program.
    #[must_use]
    pub fn findings(&self) -> &[CampaignFinding] {
        &self.findings
    }
}

/// Draws program `number`, compiles it for each chip and checks it, each within `limit` of wall-clock time: what takes
/// longer is a finding and is left alone. Its thread ends with the next scans of its check, or, where the compiler does not
/// end, with the process.
#[must_use]
pub fn run_trial(plan: &CampaignPlan, number: u64, limit: Duration) -> ProgramTrial {
    let (drawn, profile) = generate_program(plan.seed, number);
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
        let result = try_program(&drawn, &options, limit);
        match &result {
            TrialOutcome::Checked(program, report) => tally.count_check(program, report),
            TrialOutcome::Refused(code, message) => tally.count_refusal(code, message.clone()),
            TrialOutcome::Failed(WorkFailure::Panicked) => {}
            TrialOutcome::Failed(WorkFailure::TimedOut) => trial.timed_out += 1,
        }
        if let Some(kind) = result.to_fault() {
            trial.findings.push(make_finding(plan, number, &drawn, &options, kind, limit));
        }
        trial.tallies.push(tally);
    }
    trial
}

/// What a check of a drawn program came to.
pub(super) enum TrialOutcome {
    /// It was compared.
    Checked(Box<LadderProgram>, Box<CheckReport>),
    /// It was refused: code and message of the first reason.
    Refused(String, String),
    /// Compiler or checker broke down or did not end.
    Failed(WorkFailure),
}

/// Sorts of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TrialFault {
    Differs,
    InternalError,
    Failed(WorkFailure),
}

impl TrialOutcome {
    pub(super) fn to_fault(&self) -> Option<TrialFault> {
        match self {
            TrialOutcome::Checked(_, report) => (!report.agreed).then_some(TrialFault::Differs),
            TrialOutcome::Refused(code, _) => (code == INTERNAL_ERROR_CODE).then_some(TrialFault::InternalError),
            TrialOutcome::Failed(lost) => Some(TrialFault::Failed(*lost)),
        }
    }
}

/// Checks the program as its text is read again, so that what is saved is what was checked.
pub(super) fn try_program(drawn: &LadderProgram, options: &CheckOptions, limit: Duration) -> TrialOutcome {
    let (file, text, options) = (drawn.file.clone(), ladder::write(drawn), options.clone());
    let work = move |cancellation: &Cancellation| check_text(&file, &text, &options, cancellation);
    run_with_limit(limit, work).unwrap_or_else(TrialOutcome::Failed)
}

fn check_text(file: &str, text: &str, options: &CheckOptions, cancellation: &Cancellation) -> TrialOutcome {
    let refused = |errors: Vec<Diagnostic>| {
        let first = errors.first();
        TrialOutcome::Refused(
            first.map_or_else(String::new, |d| d.code.to_owned()),
            first.map_or_else(String::new, |d| d.cause.clone()),
        )
    };
    let program = match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(errors) => return refused(errors),
    };
    match check(&program, options, &mut |_, _| cancellation.unwind_if_cancelled()) {
        Ok(report) => TrialOutcome::Checked(Box::new(program), Box::new(report)),
        Err(errors) => refused(errors),
    }
}

/// Shrinks what was found and writes it down. What took too long stays as it is: every smaller program could leave another
/// thread behind.
fn make_finding(
    plan: &CampaignPlan,
    number: u64,
    drawn: &LadderProgram,
    options: &CheckOptions,
    kind: TrialFault,
    limit: Duration,
) -> CampaignFinding {
    let file = format!("fuzz-{}-{number}-{}.ld", plan.seed, options.mcu);
    let mut shows = |program: &LadderProgram| {
        let outcome = try_program(program, options, limit);
        let scan = match &outcome {
            TrialOutcome::Checked(_, report) => report.difference.as_ref().map(|difference| difference.scan),
            _ => None,
        };
        (outcome.to_fault() == Some(kind)).then_some(scan.unwrap_or(options.scans))
    };
    let timed_out = kind == TrialFault::Failed(WorkFailure::TimedOut);
    let (program, scans) =
        if timed_out { (drawn.clone(), options.scans) } else { smallest_program(drawn, options.scans, &mut shows) };
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
    /// One with nothing done.
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

    /// Adds the next program of the only shard.
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

    /// Adds the records of shards of one plan.
    ///
    /// # Errors
    /// Why they do not belong together.
    pub fn merge_shards(records: Vec<CampaignRecord>) -> Result<CampaignRecord, CheckError> {
        let mut records = records.into_iter();
        let mut sum = records.next().ok_or(CheckError::NoRecords)?;
        for other in records {
            if other.plan != sum.plan {
                return Err(CheckError::DifferentCampaigns);
            }
            sum.tallies.iter_mut().zip(&other.tallies).for_each(|(mine, other)| mine.add(other));
            sum.findings.extend(other.findings);
            sum.shards.extend(other.shards);
        }
        sum.shards.sort();
        sum.check_shards()?;
        let programs = sum.plan.programs;
        for (n, shard) in sum.shards.iter().enumerate() {
            for other in sum.shards.iter().skip(n + 1) {
                check_mergeable(shard, other, programs)?;
            }
        }
        sum.findings.sort_by(|a, b| (a.number, &a.mcu).cmp(&(b.number, &b.mcu)));
        sum.update_complete();
        Ok(sum)
    }

    /// Every shard is one that the plan can have.
    ///
    /// # Errors
    /// The shard that is none.
    pub fn check_shards(&self) -> Result<(), CheckError> {
        let programs = self.plan.programs;
        let wrong = |shard: &&CampaignShard| {
            shard.index == 0 || shard.index > shard.of || shard.done > shard.program_count(programs)
        };
        match self.shards.iter().find(wrong) {
            Some(&shard) => Err(CheckError::NoSuchShard { shard, programs }),
            None => Ok(()),
        }
    }

    /// The record for people.
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

/// Two shards can be added: they are of one split, and not the same.
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
