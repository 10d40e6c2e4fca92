//! What runs in the process of one target: input after input, until the time is over or one of them is a finding. Whoever started it
//! sees which by its exit code, and finds the input in the file that it was given.

use std::fs::File;
use std::io::{self, Seek, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use crate::mutate::Mutator;
use crate::table::Target;
use crate::{SECONDS, run};

/// Exit code of a process whose execution has taken longer than [`SECONDS`].
pub const HANGS: i32 = 77;

/// How long a worker goes on.
#[derive(Debug, Clone, Copy)]
pub enum Budget {
    /// So many executions.
    Executions(u64),
    /// So long.
    Time(Duration),
}

/// Milliseconds since the start at which the execution began that is going on; 0 where none is.
static BEGAN: AtomicU64 = AtomicU64::new(0);

/// Ends the process when an execution takes too long.
fn watch(start: Instant) {
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_millis(200));
            let began = BEGAN.load(Ordering::Relaxed);
            let now = start.elapsed().as_millis() as u64;
            if began > 0 && now.saturating_sub(began) > SECONDS * 1000 {
                eprintln!("an execution takes longer than {SECONDS} s");
                std::process::exit(HANGS);
            }
        }
    });
}

/// Executes inputs; each is in the file `current` while it is executed. Returns their number.
///
/// # Errors
/// The file cannot be written.
pub fn work(target: &Target, seed: u64, budget: Budget, current: &Path) -> io::Result<u64> {
    let mutator = Mutator::new(target, seed, run::regressions(target.name));
    let start = Instant::now();
    watch(start);
    let mut file = File::create(current)?;
    let mut number = 0;
    while match budget {
        Budget::Executions(most) => number < most,
        Budget::Time(most) => start.elapsed() < most,
    } {
        let input = mutator.input(number);
        file.set_len(0)?;
        file.rewind()?;
        file.write_all(&input)?;
        BEGAN.store((start.elapsed().as_millis() as u64).max(1), Ordering::Relaxed);
        target.run(&input);
        BEGAN.store(0, Ordering::Relaxed);
        number += 1;
    }
    drop(file);
    std::fs::remove_file(current)?;
    Ok(number)
}

/// Executes one input under the same limit of time.
pub fn replay(target: &Target, input: &[u8]) -> Duration {
    let start = Instant::now();
    watch(start);
    BEGAN.store(1, Ordering::Relaxed);
    target.run(input);
    BEGAN.store(0, Ordering::Relaxed);
    start.elapsed()
}
