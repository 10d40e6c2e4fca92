//! Selects the faults to check, and runs a check for each.

use std::collections::{BTreeMap, HashSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use emu_check::fuzz::{generate_program, program_seed};
use emu_check::{CheckOptions, DifferenceKind, check_compiled};
use emu_core::rng::Rng;
use ladder::LadderProgram;
use ladder_compile::{Mutant, MutantKind, compile, compile_mutant, find_target, mutant_ir, mutants};

use crate::common;
use crate::proof::same_meaning;

/// All sorts of faults, in the order of the table.
pub const KINDS: [MutantKind; 9] = [
    MutantKind::Operation,
    MutantKind::Surrounding,
    MutantKind::Order,
    MutantKind::Aliasing,
    MutantKind::State,
    MutantKind::Bank,
    MutantKind::Pin,
    MutantKind::Period,
    MutantKind::OmittedInstruction,
];

/// Seed of the random programs and of the selection of faults.
const SEED: u64 = 1;

/// How many faults are selected.
#[derive(Clone, Copy)]
pub struct SampleSize {
    /// Faults per sort from each program of a folder.
    pub per_kind: usize,
    /// Number of random programs per chip.
    pub random_programs: usize,
    /// Number of sorts of which a random program contributes one fault; the sorts change from program to
    /// program.
    pub kinds_per_random_program: usize,
    /// Whether survivors are checked again, with other seeds and more scans.
    pub recheck_survivors: bool,
}

/// Seeds and number of scans of the repeated checks.
const RECHECK_SEEDS_AND_SCANS: ([u64; 3], u64) = ([2, 3, 4], 6_000);

/// The verdict of a check about a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultVerdict {
    /// The check differs, in this scan with this kind of difference.
    Found(u64, DifferenceKind),
    /// The check agrees.
    Survives,
}

/// A fault that was checked.
#[derive(Debug)]
pub struct FaultCase {
    pub mcu: &'static str,
    pub kind: MutantKind,
    /// `chip | program | element: fault`.
    pub name: String,
    pub verdict: FaultVerdict,
    /// Whether the fault survives, but a repeated check with other seeds and more scans finds it.
    pub found_by_recheck: bool,
}

/// The results for one program on one chip.
#[derive(Debug, Default)]
pub struct ProgramSample {
    pub mcu: &'static str,
    pub cases: Vec<FaultCase>,
    /// Selected faults without effect: the image equals that of the correct compiler or of another fault.
    pub identical_images: BTreeMap<MutantKind, usize>,
    /// Selected faults whose intermediate code is proved to have the same meaning.
    pub proved_equivalent: BTreeMap<MutantKind, usize>,
    /// Selected faults for which the compiler itself refuses the program.
    pub refused: BTreeMap<MutantKind, usize>,
}

/// One program on one chip, and how many of its faults are selected.
struct SampleJob {
    mcu: &'static str,
    program: LadderProgram,
    /// Seed of the check.
    seed: u64,
    wanted: Vec<(MutantKind, usize)>,
    /// Maximum number of faults of all sorts together.
    max_faults: usize,
}

fn target_options(mcu: &str) -> ladder_compile::CompileOptions {
    ladder_compile::CompileOptions { mcu: mcu.to_owned(), ..Default::default() }
}

/// The programs of the folders that a chip supports, followed by random ones.
fn jobs(mcu: &'static str, size: SampleSize) -> Vec<SampleJob> {
    let mut jobs = Vec::new();
    for path in common::folder("../examples").into_iter().chain(common::folder("tests/programs")) {
        let mut program = common::read(&path);
        program.file = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let wanted = KINDS.map(|kind| (kind, size.per_kind)).to_vec();
        jobs.push(SampleJob { mcu, program, seed: CheckOptions::default().seed, wanted, max_faults: usize::MAX });
    }
    let fits = find_target(mcu).expect("a chip");
    let drawn = (0..).map(|number| (number, generate_program(SEED, number)));
    let texts = drawn
        .filter(|(_, (_, profile))| profile.is_supported_by(fits))
        .map(|(number, (drawn, _))| (number, common::parse(&format!("random {number}"), &ladder::write(&drawn))));
    for (number, program) in texts.filter(|(_, p)| compile(p, &target_options(mcu)).is_ok()).take(size.random_programs)
    {
        // If a program has no fault of a sort, the next sort takes its place.
        let first = number as usize % KINDS.len();
        let wanted = (0..KINDS.len()).map(|n| (KINDS[(first + n * 4) % KINDS.len()], 1)).collect();
        jobs.push(SampleJob {
            mcu,
            program,
            seed: program_seed(SEED, number),
            wanted,
            max_faults: size.kinds_per_random_program,
        });
    }
    jobs.retain(|job| compile(&job.program, &target_options(mcu)).is_ok());
    jobs
}

/// Selects and checks the faults of `size` on these chips, on all processors. The result does not depend on
/// their number.
pub fn run_campaign(mcus: &[&'static str], size: SampleSize) -> Vec<ProgramSample> {
    let jobs: Vec<SampleJob> = mcus.iter().flat_map(|mcu| jobs(mcu, size)).collect();
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((at, job)) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|at| Some((at, jobs.get(at)?)))
                {
                    let sample = sample_program(job, size.recheck_survivors);
                    done.lock().expect("a lock").push((at, sample));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("a lock");
    done.sort_unstable_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, sample)| sample).collect()
}

/// Selects faults of one program, sort by sort, until there are enough different images, and checks each.
fn sample_program(job: &SampleJob, again: bool) -> ProgramSample {
    let mut sample = ProgramSample { mcu: job.mcu, ..ProgramSample::default() };
    let target = target_options(job.mcu);
    let sound = compile(&job.program, &target).expect("it compiled before");
    let mut images = HashSet::from([(sound.hex, format!("{:?}", sound.map))]);
    let mut sorts: BTreeMap<MutantKind, Vec<Mutant>> = BTreeMap::new();
    mutants(&job.program, &target).into_iter().for_each(|m| sorts.entry(m.kind).or_default().push(m));
    for &(kind, wanted) in &job.wanted {
        let mut all = sorts.remove(&kind).unwrap_or_default();
        let mut rng = Rng::new(job.seed ^ SEED);
        let mut left = wanted.min(job.max_faults.saturating_sub(sample.cases.len()));
        while left > 0 && !all.is_empty() {
            let mutant = all.swap_remove(rng.below(all.len() as u64) as usize);
            let Ok(faulty) = compile_mutant(&job.program, &target, mutant.id) else {
                *sample.refused.entry(kind).or_default() += 1;
                continue;
            };
            if !images.insert((faulty.hex.clone(), format!("{:?}", faulty.map))) {
                *sample.identical_images.entry(kind).or_default() += 1;
                continue;
            }
            let place = mutant.element.map_or_else(String::new, |id| format!("{id}: "));
            let name = format!("{} | {} | {place}{}", job.mcu, job.program.file, mutant.description);
            let options = CheckOptions {
                mcu: job.mcu.to_owned(),
                seed: job.seed,
                rungs: false,
                explain: false,
                ..CheckOptions::default()
            };
            let verdict = match check_compiled(&job.program, &faulty, &options, &mut |_, _| {}) {
                Ok(report) => report.difference.map_or(FaultVerdict::Survives, |d| FaultVerdict::Found(d.scan, d.what)),
                // The image does not load.
                Err(_) => FaultVerdict::Found(0, DifferenceKind::Map),
            };
            let irs = mutant_ir(&job.program, &target, mutant.id);
            if irs.is_some_and(|irs| same_meaning(&irs.sound, &irs.faulty)) {
                // If a check finds a difference, the proof is wrong.
                assert_eq!(verdict, FaultVerdict::Survives, "{name}: proved to mean the same, but it differs");
                *sample.proved_equivalent.entry(kind).or_default() += 1;
                continue;
            }
            left -= 1;
            let differs = |seed: &u64| {
                let options = CheckOptions { seed: *seed, scans: RECHECK_SEEDS_AND_SCANS.1, ..options.clone() };
                check_compiled(&job.program, &faulty, &options, &mut |_, _| {}).is_ok_and(|report| !report.agreed)
            };
            let later = again && verdict == FaultVerdict::Survives && RECHECK_SEEDS_AND_SCANS.0.iter().any(differs);
            sample.cases.push(FaultCase { mcu: job.mcu, kind, name, verdict, found_by_recheck: later });
        }
    }
    sample
}
