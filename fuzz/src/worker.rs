//! What runs in the process of one target: input after input, until the time is over or one of them is a finding. Whoever started it
//! sees which by its exit code, and finds the input in the file that it was given.

use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;
use std::sync::Once;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::mutate::Mutator;
use crate::target_table::FuzzTarget;
use crate::{MAX_SECONDS, run};

/// Exit code of a process whose execution has taken longer than [`MAX_SECONDS`].
pub const HANG_EXIT_CODE: i32 = 77;

/// How long a worker goes on.
#[derive(Debug, Clone, Copy)]
pub enum WorkerBudget {
    /// So many executions.
    Executions(u64),
    /// So long.
    Time(Duration),
}

/// Number of the execution that is going on, from 1 on; 0 where none is.
static CURRENT_EXECUTION: AtomicU64 = AtomicU64::new(0);

/// An execution that waits for something may take so many times the limit, since it is asleep, or others have the processor.
const WALL_CLOCK_FACTOR: u64 = 6;

/// The limit of an execution: [`MAX_SECONDS`], or what EMU_FUZZ_LIMIT says.
fn time_limit() -> u64 {
    std::env::var("EMU_FUZZ_LIMIT").ok().and_then(|text| text.parse().ok()).unwrap_or(MAX_SECONDS)
}

/// Time of the processor that this process has taken, in hundredths of a second: utime and stime, proc(5). None where the system
/// does not say.
fn processor_time() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11).map(|field| field.parse::<u64>().ok());
    Some(fields.next()?? + fields.next()??)
}

/// Ends the process when an execution takes too long: in time of the processor, so that a busy machine makes no findings.
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

/// Executes inputs; each is in the file `current` while it is executed. Returns their number.
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

/// Executes one input under the same limit of time.
pub fn replay_input(target: &FuzzTarget, input: &[u8]) -> Duration {
    let start = Instant::now();
    start_watcher();
    static NUMBER: AtomicU64 = AtomicU64::new(1);
    CURRENT_EXECUTION.store(NUMBER.fetch_add(1, Ordering::Relaxed), Ordering::Relaxed);
    target.run(input);
    CURRENT_EXECUTION.store(0, Ordering::Relaxed);
    start.elapsed()
}
