//! A campaign: which programs, on which chips, how far it is, and what was found. It can be spread over shards, whose records
//! are added again.

use std::time::Duration;

use diag::Diagnostic;
use ladder::Program;
use serde::{Deserialize, Serialize};

use super::draw::{own_seed, program};
use super::smaller::{noted, smallest};
use super::tally::Tally;
use super::watchdog::{Cancellation, Lost, within};
use crate::{Options, Report, check};

/// Version of the record.
pub const FUZZ_SCHEMA: u32 = 1;

/// A chip of each family, for a campaign on all of them.
pub const FAMILIES: [&str; 4] = ["at89s52", "pic16f873", "atmega328p", "ap101"];

/// Code of a refusal in which the compiler contradicts itself.
const INTERNAL: &str = "LC099";

/// What is to be done. The same plan gives the same programs and checks for ever, in whatever pieces.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Plan {
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
pub struct Shard {
    /// Which, from 1.
    pub index: u64,
    /// How many there are, at least 1.
    pub of: u64,
    /// Programs of it that are done, in order.
    pub done: u64,
}

impl Shard {
    /// How many of `programs` are its own.
    #[must_use]
    pub fn programs(&self, programs: u64) -> u64 {
        match programs.checked_sub(self.index) {
            Some(after) => after / self.of.max(1) + 1,
            None => 0,
        }
    }

    /// The number of its `k`-th program, from 0.
    #[must_use]
    pub fn number(&self, k: u64) -> u64 {
        k * self.of + self.index.saturating_sub(1)
    }

    /// The first of `programs` that belongs to another shard too, which may be of another split.
    fn shares(&self, other: &Shard, programs: u64) -> Option<u64> {
        let (dense, sparse) = if self.of <= other.of { (self, other) } else { (other, self) };
        // After as many numbers as the other split has shards, the places in it repeat.
        let mut numbers = (0..sparse.programs(programs).min(dense.of)).map(|k| sparse.number(k));
        let of = dense.of.max(1);
        numbers.find(|number| number % of == dense.index.saturating_sub(1))
    }
}

/// Something that must not be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
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
pub struct Record {
    /// Version of this shape, [`FUZZ_SCHEMA`].
    pub schema: u32,
    /// What is to be done.
    pub plan: Plan,
    /// The parts that this record holds.
    pub shards: Vec<Shard>,
    /// Every program of the plan is done.
    pub complete: bool,
    /// Figures by chip, in the order of the plan.
    pub tallies: Vec<Tally>,
    /// What was found, by number and chip.
    pub findings: Vec<Finding>,
}

/// What came of one program.
#[derive(Debug, Clone)]
pub struct Trial {
    tallies: Vec<Tally>,
    findings: Vec<Finding>,
    timed_out: usize,
}

impl Trial {
    /// On how many chips its compile and check took longer than the limit.
    #[must_use]
    pub fn timed_out(&self) -> usize {
        self.timed_out
    }

    /// What was found with this program.
    #[must_use]
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }
}

/// Draws program `number`, compiles it for each chip and checks it, each within `limit` of wall-clock time: what takes
/// longer is a finding and is left alone. Its thread ends with the next scans of its check, or, where the compiler does not
/// end, with the process.
#[must_use]
pub fn trial(plan: &Plan, number: u64, limit: Duration) -> Trial {
    let (drawn, profile) = program(plan.seed, number);
    let mut trial = Trial { tallies: Vec::new(), findings: Vec::new(), timed_out: 0 };
    for mcu in &plan.mcus {
        let mut tally = Tally::new(mcu);
        if !ladder_compile::target(mcu).is_some_and(|target| profile.fits(target)) {
            tally.outside += 1;
            trial.tallies.push(tally);
            continue;
        }
        let options = Options {
            mcu: mcu.clone(),
            seed: own_seed(plan.seed, number),
            scans: plan.scans,
            rungs: false,
            explain: false,
            ..Options::default()
        };
        let result = attempt(&drawn, &options, limit);
        match &result {
            Outcome::Checked(program, report) => tally.check(program, report),
            Outcome::Refused(code, message) => tally.refuse(code, message.clone()),
            Outcome::Lost(Lost::Panicked) => {}
            Outcome::Lost(Lost::TimedOut) => trial.timed_out += 1,
        }
        if let Some(kind) = result.fault() {
            trial.findings.push(finding(plan, number, &drawn, &options, kind, limit));
        }
        trial.tallies.push(tally);
    }
    trial
}

/// What a check of a drawn program came to.
pub(super) enum Outcome {
    /// It was compared.
    Checked(Box<Program>, Box<Report>),
    /// It was refused: code and message of the first reason.
    Refused(String, String),
    /// Compiler or checker broke down or did not end.
    Lost(Lost),
}

/// Sorts of findings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    Differs,
    Contradicts,
    Lost(Lost),
}

impl Outcome {
    pub(super) fn fault(&self) -> Option<Fault> {
        match self {
            Outcome::Checked(_, report) => (!report.agreed).then_some(Fault::Differs),
            Outcome::Refused(code, _) => (code == INTERNAL).then_some(Fault::Contradicts),
            Outcome::Lost(lost) => Some(Fault::Lost(*lost)),
        }
    }
}

/// Checks the program as its text is read again, so that what is saved is what was checked.
pub(super) fn attempt(drawn: &Program, options: &Options, limit: Duration) -> Outcome {
    let (file, text, options) = (drawn.file.clone(), ladder::write(drawn), options.clone());
    let work = move |cancellation: &Cancellation| checked(&file, &text, &options, cancellation);
    within(limit, work).unwrap_or_else(Outcome::Lost)
}

fn checked(file: &str, text: &str, options: &Options, cancellation: &Cancellation) -> Outcome {
    let refused = |errors: Vec<Diagnostic>| {
        let first = errors.first();
        Outcome::Refused(
            first.map_or_else(String::new, |d| d.code.to_owned()),
            first.map_or_else(String::new, |d| d.cause.clone()),
        )
    };
    let program = match ladder::parse(file, text) {
        Ok(parsed) => parsed.program,
        Err(errors) => return refused(errors),
    };
    match check(&program, options, &mut |_, _| cancellation.check()) {
        Ok(report) => Outcome::Checked(Box::new(program), Box::new(report)),
        Err(errors) => refused(errors),
    }
}

/// Shrinks what was found and writes it down. What took too long stays as it is: every smaller program could leave another
/// thread behind.
fn finding(plan: &Plan, number: u64, drawn: &Program, options: &Options, kind: Fault, limit: Duration) -> Finding {
    let file = format!("fuzz-{}-{number}-{}.ld", plan.seed, options.mcu);
    let mut shows = |program: &Program| {
        let outcome = attempt(program, options, limit);
        let scan = match &outcome {
            Outcome::Checked(_, report) => report.difference.as_ref().map(|difference| difference.scan),
            _ => None,
        };
        (outcome.fault() == Some(kind)).then_some(scan.unwrap_or(options.scans))
    };
    let timed_out = kind == Fault::Lost(Lost::TimedOut);
    let (program, scans) =
        if timed_out { (drawn.clone(), options.scans) } else { smallest(drawn, options.scans, &mut shows) };
    let command =
        |scans: u64| format!("emu check {file} --mcu {} --seed {} --scans {scans}", options.mcu, options.seed);
    let found = format!("found by emu fuzz --seed {} as program {number}", plan.seed);
    let program = noted(&program, &[&found, &command(scans)]);
    let last = Options { scans, explain: true, ..options.clone() };
    let outcome = if timed_out { Outcome::Lost(Lost::TimedOut) } else { attempt(&program, &last, limit) };
    let what = match outcome {
        Outcome::Checked(_, report) => report.text(),
        Outcome::Refused(code, message) => format!("{code}: {message}"),
        Outcome::Lost(Lost::Panicked) => "the compiler or the checker broke down".to_owned(),
        Outcome::Lost(Lost::TimedOut) => {
            format!("compile and check took longer than {} s", limit.as_secs_f64())
        }
    };
    let mcu = options.mcu.clone();
    Finding { number, mcu, what, program: ladder::write(&program), replay: command(scans), file }
}

impl Record {
    /// One with nothing done.
    #[must_use]
    pub fn new(plan: Plan, shard: Shard) -> Record {
        let tallies = plan.mcus.iter().map(|mcu| Tally::new(mcu)).collect();
        let mut record =
            Record { schema: FUZZ_SCHEMA, plan, shards: vec![shard], complete: false, tallies, findings: Vec::new() };
        record.judge();
        record
    }

    /// Adds the next program of the only shard.
    pub fn add(&mut self, trial: &Trial) {
        self.tallies.iter_mut().zip(&trial.tallies).for_each(|(mine, other)| mine.add(other));
        self.findings.extend(trial.findings.iter().cloned());
        if let [shard] = self.shards.as_mut_slice() {
            shard.done += 1;
        }
        self.judge();
    }

    fn judge(&mut self) {
        let programs = self.plan.programs;
        let of = self.shards.first().map_or(1, |shard| shard.of);
        self.complete = self.shards.len() as u64 == of && self.shards.iter().all(|s| s.done == s.programs(programs));
    }

    /// Adds the records of shards of one plan.
    ///
    /// # Errors
    /// Why they do not belong together.
    pub fn merge(records: Vec<Record>) -> Result<Record, String> {
        let mut records = records.into_iter();
        let mut sum = records.next().ok_or("there is nothing to add")?;
        for other in records {
            if other.plan != sum.plan {
                return Err("the records are of different campaigns".to_owned());
            }
            sum.tallies.iter_mut().zip(&other.tallies).for_each(|(mine, other)| mine.add(other));
            sum.findings.extend(other.findings);
            sum.shards.extend(other.shards);
        }
        sum.shards.sort();
        sum.possible()?;
        let programs = sum.plan.programs;
        for (n, shard) in sum.shards.iter().enumerate() {
            for other in sum.shards.iter().skip(n + 1) {
                together(shard, other, programs)?;
            }
        }
        sum.findings.sort_by(|a, b| (a.number, &a.mcu).cmp(&(b.number, &b.mcu)));
        sum.judge();
        Ok(sum)
    }

    /// Every shard is one that the plan can have.
    ///
    /// # Errors
    /// The shard that is none.
    pub fn possible(&self) -> Result<(), String> {
        let programs = self.plan.programs;
        let wrong =
            |shard: &&Shard| shard.index == 0 || shard.index > shard.of || shard.done > shard.programs(programs);
        match self.shards.iter().find(wrong) {
            Some(Shard { index, of, done }) => {
                Err(format!("there is no shard {index}/{of} of {programs} programs with {done} of them done"))
            }
            None => Ok(()),
        }
    }

    /// The record for people.
    #[must_use]
    pub fn text(&self) -> String {
        let Plan { seed, programs, scans, mcus } = &self.plan;
        let done: u64 = self.shards.iter().map(|shard| shard.done).sum();
        let state = if self.complete { "complete" } else { "not complete" };
        let mut out = format!(
            "fuzz: seed {seed}, {done} of {programs} programs of {scans} scans on {}: {state}\n",
            mcus.join(", ")
        );
        self.tallies.iter().for_each(|tally| out += &tally.text());
        for finding in &self.findings {
            let Finding { number, mcu, what, replay, .. } = finding;
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
fn together(a: &Shard, b: &Shard, programs: u64) -> Result<(), String> {
    let name = |shard: &Shard| format!("{}/{}", shard.index, shard.of);
    if a.of == b.of {
        return if a.index == b.index { Err(format!("shard {} is there twice", name(a))) } else { Ok(()) };
    }
    Err(match a.shares(b, programs) {
        Some(number) => {
            format!("shards {} and {} hold the same programs, the first is program {number}", name(a), name(b))
        }
        None => format!("shards {} and {} are of different splits", name(a), name(b)),
    })
}
