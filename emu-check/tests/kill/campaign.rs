//! Which faults are taken, and what a check says to each.

use std::collections::{BTreeMap, HashSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use emu_check::fuzz::{own_seed, program};
use emu_check::{Options, What, check_compiled};
use emu_core::rng::Rng;
use ladder::Program;
use ladder_compile::{Mutant, MutantKind, compile, compile_mutant, mutant_ir, mutants, target};

use crate::common;
use crate::proof::same_meaning;

/// All sorts, in the order of the table.
pub const KINDS: [MutantKind; 9] = [
    MutantKind::Operation,
    MutantKind::Around,
    MutantKind::Order,
    MutantKind::Aliasing,
    MutantKind::State,
    MutantKind::Bank,
    MutantKind::Pin,
    MutantKind::Period,
    MutantKind::LeftOut,
];

/// Seed of the random programs, and of which faults are taken.
const SEED: u64 = 1;

/// How many faults are taken.
#[derive(Clone, Copy)]
pub struct Size {
    /// Of each sort from each program of a folder.
    pub each: usize,
    /// Random programs for a chip.
    pub random: usize,
    /// Sorts of which one fault is taken from a random program; which ones changes from program to program.
    pub sorts: usize,
    /// What survives is checked again, with other seeds and more scans.
    pub again: bool,
}

/// Seeds and scans of these checks.
const AGAIN: ([u64; 3], u64) = ([2, 3, 4], 6_000);

/// What a check says to a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It differs, in this scan and so.
    Found(u64, What),
    /// It agrees.
    Survives,
}

/// A fault that was checked.
#[derive(Debug)]
pub struct Case {
    pub mcu: &'static str,
    pub kind: MutantKind,
    /// `chip | program | element: fault`.
    pub name: String,
    pub verdict: Verdict,
    /// It survives, but not checks with other seeds and more scans, where these were asked for.
    pub later: bool,
}

/// What came of one program on one chip.
#[derive(Debug, Default)]
pub struct Sample {
    pub mcu: &'static str,
    pub cases: Vec<Case>,
    /// Faults drawn that are none: the image is that of the sound compiler, or that of another fault.
    pub same: BTreeMap<MutantKind, usize>,
    /// Faults drawn whose intermediate code is proved to mean the same.
    pub proved: BTreeMap<MutantKind, usize>,
    /// Faults drawn for which the compiler itself finds that there is no image.
    pub refused: BTreeMap<MutantKind, usize>,
}

/// One program for one chip, and how much is taken of it.
struct Job {
    mcu: &'static str,
    program: Program,
    /// Of its check.
    seed: u64,
    wanted: Vec<(MutantKind, usize)>,
    /// Of all sorts together.
    most: usize,
}

fn target_options(mcu: &str) -> ladder_compile::Options {
    ladder_compile::Options { mcu: mcu.to_owned(), ..Default::default() }
}

/// The programs of the folders that a chip takes, then random ones.
fn jobs(mcu: &'static str, size: Size) -> Vec<Job> {
    let mut jobs = Vec::new();
    for path in common::folder("../examples").into_iter().chain(common::folder("tests/programs")) {
        let mut program = common::read(&path);
        program.file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let wanted = KINDS.map(|kind| (kind, size.each)).to_vec();
        jobs.push(Job { mcu, program, seed: Options::default().seed, wanted, most: usize::MAX });
    }
    let fits = target(mcu).expect("a chip");
    let drawn = (0..).map(|number| (number, program(SEED, number)));
    let texts = drawn
        .filter(|(_, (_, profile))| profile.fits(fits))
        .map(|(number, (drawn, _))| (number, common::parse(&format!("random {number}"), &ladder::write(&drawn))));
    for (number, program) in texts.filter(|(_, p)| compile(p, &target_options(mcu)).is_ok()).take(size.random) {
        // A sort that a program has none of is made up for by the next.
        let first = number as usize % KINDS.len();
        let wanted = (0..KINDS.len()).map(|n| (KINDS[(first + n * 4) % KINDS.len()], 1)).collect();
        jobs.push(Job { mcu, program, seed: own_seed(SEED, number), wanted, most: size.sorts });
    }
    jobs.retain(|job| compile(&job.program, &target_options(mcu)).is_ok());
    jobs
}

/// Takes the faults of `size` on these chips and checks them, on all processors. The result does not depend on their number.
pub fn campaign(mcus: &[&'static str], size: Size) -> Vec<Sample> {
    let jobs: Vec<Job> = mcus.iter().flat_map(|mcu| jobs(mcu, size)).collect();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((at, job)) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|at| Some((at, jobs.get(at)?)))
                {
                    let sample = sample(job, size.again);
                    done.lock().expect("a lock").push((at, sample));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("a lock");
    done.sort_unstable_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, sample)| sample).collect()
}

/// Draws faults of one program, sort by sort, until there are enough different images, and checks each.
fn sample(job: &Job, again: bool) -> Sample {
    let mut sample = Sample { mcu: job.mcu, ..Sample::default() };
    let target = target_options(job.mcu);
    let sound = compile(&job.program, &target).expect("it compiled before");
    let mut images = HashSet::from([(sound.hex, format!("{:?}", sound.map))]);
    let mut sorts: BTreeMap<MutantKind, Vec<Mutant>> = BTreeMap::new();
    mutants(&job.program, &target).into_iter().for_each(|m| sorts.entry(m.kind).or_default().push(m));
    for &(kind, wanted) in &job.wanted {
        let mut all = sorts.remove(&kind).unwrap_or_default();
        let mut rng = Rng::new(job.seed ^ SEED);
        let mut left = wanted.min(job.most.saturating_sub(sample.cases.len()));
        while left > 0 && !all.is_empty() {
            let mutant = all.swap_remove(rng.below(all.len() as u64) as usize);
            let Ok(faulty) = compile_mutant(&job.program, &target, mutant.id) else {
                *sample.refused.entry(kind).or_default() += 1;
                continue;
            };
            if !images.insert((faulty.hex.clone(), format!("{:?}", faulty.map))) {
                *sample.same.entry(kind).or_default() += 1;
                continue;
            }
            let place = mutant.element.map_or_else(String::new, |id| format!("{id}: "));
            let name = format!("{} | {} | {place}{}", job.mcu, job.program.file, mutant.what);
            let options =
                Options { mcu: job.mcu.to_owned(), seed: job.seed, rungs: false, explain: false, ..Options::default() };
            let verdict = match check_compiled(&job.program, &faulty, &options, &mut |_, _| {}) {
                Ok(report) => report.difference.map_or(Verdict::Survives, |d| Verdict::Found(d.scan, d.what)),
                // An image that does not load.
                Err(_) => Verdict::Found(0, What::Map),
            };
            let irs = mutant_ir(&job.program, &target, mutant.id);
            if irs.is_some_and(|(sound, faulty)| same_meaning(&sound, &faulty)) {
                // A proof of what a check refutes would be a wrong one.
                assert_eq!(verdict, Verdict::Survives, "{name}: proved to mean the same, but it differs");
                *sample.proved.entry(kind).or_default() += 1;
                continue;
            }
            left -= 1;
            let differs = |seed: &u64| {
                let options = Options { seed: *seed, scans: AGAIN.1, ..options.clone() };
                check_compiled(&job.program, &faulty, &options, &mut |_, _| {}).is_ok_and(|report| !report.agreed)
            };
            let later = again && verdict == Verdict::Survives && AGAIN.0.iter().any(differs);
            sample.cases.push(Case { mcu: job.mcu, kind, name, verdict, later });
        }
    }
    sample
}
