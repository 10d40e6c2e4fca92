//! The driver: runs a process per target, with limits, and saves its findings.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use crate::target_table::FuzzTarget;
use crate::worker::{HANG_EXIT_CODE, WorkerBudget};
use crate::{MAX_MEMORY_BYTES, workspace_root};

/// Options of the driver.
pub struct DriverOptions {
    /// The targets to execute.
    pub targets: Vec<&'static FuzzTarget>,
    /// Seed of the inputs.
    pub seed: u64,
    /// The budget of each target.
    pub budget: WorkerBudget,
    /// The folder for findings.
    pub findings_folder: PathBuf,
}

/// The result of executing one target.
pub struct TargetRun {
    /// The target.
    pub target: &'static FuzzTarget,
    /// Number of executions; unknown after a finding.
    pub executions: Option<u64>,
    /// A description of the finding, and the file with its input.
    pub finding: Option<(String, PathBuf)>,
}

/// Inputs of a target that were findings in the past, ordered by file name.
#[must_use]
pub fn regressions(target: &str) -> Vec<Vec<u8>> {
    let entries = std::fs::read_dir(workspace_root().join("fuzz/regressions").join(target));
    let mut files: Vec<PathBuf> = entries.into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    files.sort();
    files.iter().filter_map(|file| std::fs::read(file).ok()).collect()
}

/// Executes all targets, as many in parallel as there are processors; `tell` gets each result as soon as it
/// is available.
///
/// # Errors
/// A process cannot be started, or a finding cannot be saved.
pub fn run_targets(options: &DriverOptions, tell: &(dyn Fn(&TargetRun) + Sync)) -> io::Result<Vec<TargetRun>> {
    std::fs::create_dir_all(&options.findings_folder)?;
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let worker = || {
        while let Some(target) = options.targets.get(next.fetch_add(1, Ordering::SeqCst)) {
            let ended = run_target(target, options);
            if let Ok(ended) = &ended {
                tell(ended);
            }
            done.lock().unwrap_or_else(PoisonError::into_inner).push(ended);
        }
    };
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(worker);
        }
    });
    done.into_inner().unwrap_or_else(PoisonError::into_inner).into_iter().collect()
}

/// A command that starts this program with a memory limit. On systems other than Unix, memory is not limited.
#[must_use]
pub fn memory_limited_command(arguments: &[&str]) -> Command {
    let own = std::env::current_exe().unwrap_or_else(|_| PathBuf::from("emu-fuzz"));
    let mut command = if cfg!(unix) {
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("ulimit -v {} && exec \"$0\" \"$@\"", MAX_MEMORY_BYTES / 1024)).arg(own);
        shell
    } else {
        Command::new(own)
    };
    command.args(arguments);
    command
}

fn run_target(target: &'static FuzzTarget, options: &DriverOptions) -> io::Result<TargetRun> {
    let current = options.findings_folder.join(format!("{}.current", target.name));
    let (seed, file) = (options.seed.to_string(), current.display().to_string());
    let budget = match options.budget {
        WorkerBudget::Executions(number) => ["--executions".to_owned(), number.to_string()],
        WorkerBudget::Time(time) => ["--milliseconds".to_owned(), time.as_millis().to_string()],
    };
    let arguments = ["work", target.name, "--seed", &seed, &budget[0], &budget[1], "--current", &file];
    let ended = memory_limited_command(&arguments).stdin(Stdio::null()).output()?;
    if ended.status.success() {
        let executions = String::from_utf8_lossy(&ended.stdout).trim().parse().ok();
        return Ok(TargetRun { target, executions, finding: None });
    }
    let said = String::from_utf8_lossy(&ended.stderr);
    let said = said.lines().filter(|line| !line.starts_with("note:")).take(3).collect::<Vec<_>>().join(" ");
    let what = match ended.status.code() {
        Some(HANG_EXIT_CODE) => format!("it hangs: {said}"),
        Some(code) => format!("exit code {code}: {said}"),
        None => format!("it is killed ({}): {said}", ended.status),
    };
    let saved = save_finding(target, &options.findings_folder, &current)?;
    Ok(TargetRun { target, executions: None, finding: Some((what, saved)) })
}

/// Names an input by the hash of its contents, so that equal findings are one file.
fn save_finding(target: &FuzzTarget, folder: &Path, current: &Path) -> io::Result<PathBuf> {
    let bytes = std::fs::read(current)?;
    let hash = bytes
        .iter()
        .fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01B3));
    let folder = folder.join(target.name);
    std::fs::create_dir_all(&folder)?;
    let file = folder.join(format!("{hash:016x}"));
    std::fs::rename(current, &file)?;
    Ok(file)
}
