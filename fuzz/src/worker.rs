//! The code in the process of one target: executes input after input until the budget is used up or one of
//! them is a finding. The driver sees a finding by the exit code, and finds its input in the current file.

use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::mutate::Mutator;
use crate::target_table::FuzzTarget;
use crate::{MAX_SECONDS, run};

/// Exit code of a process whose execution took longer than [`MAX_SECONDS`].
pub const HANG_EXIT_CODE: i32 = 77;

/// The budget of a worker.
#[derive(Debug, Clone, Copy)]
pub enum WorkerBudget {
    /// A number of executions.
    Executions(u64),
    /// A duration.
    Time(Duration),
}

/// Number of the current execution, from 1; 0 if there is none.
static CURRENT_EXECUTION: AtomicU64 = AtomicU64::new(0);

/// Factor of the time limit for an execution that waits, because it sleeps or other processes use the
/// processor.
const WALL_CLOCK_FACTOR: u64 = 6;

/// The time limit of an execution in seconds: [`MAX_SECONDS`], or the value of EMU_FUZZ_LIMIT.
fn time_limit() -> u64 {
    std::env::var("EMU_FUZZ_LIMIT").ok().and_then(|text| text.parse().ok()).unwrap_or(MAX_SECONDS)
}

/// Processor time of this process in hundredths of a second: utime and stime, proc(5). `None` if the system
/// does not report it.
fn processor_time() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11).map(|field| field.parse::<u64>().ok());
    Some(fields.next()?? + fields.next()??)
}

/// Starts a thread that ends the process if an execution takes too long. Processor time counts, so that a
/// busy machine does not cause findings.
fn start_watcher() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| drop(std::thread::spawn(run_watcher)));
}

fn run_watcher() {
    let limit = time_limit();
    let (mut seen, mut since, mut taken) = (0, Instant::now(), processor_time());
    loop {
        std::thread::sleep(Duration::from_millis(100));
        let running = CURRENT_EXECUTION.load(Ordering::Relaxed);
        if running != seen || running == 0 {
            (seen, since, taken) = (running, Instant::now(), processor_time());
            continue;
        }
        let computed = processor_time().zip(taken).map(|(now, then)| now.saturating_sub(then) / 100);
        let waited = since.elapsed().as_secs();
        let most = if computed.is_some() { limit * WALL_CLOCK_FACTOR } else { limit };
        if computed.is_some_and(|seconds| seconds >= limit) || waited >= most {
            eprintln!("an execution takes longer than {limit} s");
            std::process::exit(HANG_EXIT_CODE);
        }
    }
}

/// Executes inputs and returns their number. Each input is in the file `current` while it is executed.
///
/// # Errors
/// The file cannot be written.
pub fn run_worker(target: &FuzzTarget, seed: u64, budget: WorkerBudget, current: &Path) -> io::Result<u64> {
    let mutator = Mutator::new(target, seed, run::regressions(target.name));
    let start = Instant::now();
    start_watcher();
    let mut file = File::create(current)?;
    let mut number = 0;
    while match budget {
        WorkerBudget::Executions(most) => number < most,
        WorkerBudget::Time(most) => start.elapsed() < most,
    } {
        let input = mutator.input(number);
        file.set_len(0)?;
        file.rewind()?;
        file.write_all(&input)?;
        number += 1;
        CURRENT_EXECUTION.store(number, Ordering::Relaxed);
        target.run(&input);
        CURRENT_EXECUTION.store(0, Ordering::Relaxed);
    }
    drop(file);
    std::fs::remove_file(current)?;
    Ok(number)
}

/// Executes one input with the same time limit.
pub fn replay_input(target: &FuzzTarget, input: &[u8]) -> Duration {
    let start = Instant::now();
    start_watcher();
    static NUMBER: AtomicU64 = AtomicU64::new(1);
    CURRENT_EXECUTION.store(NUMBER.fetch_add(1, Ordering::Relaxed), Ordering::Relaxed);
    target.run(input);
    CURRENT_EXECUTION.store(0, Ordering::Relaxed);
    start.elapsed()
}
