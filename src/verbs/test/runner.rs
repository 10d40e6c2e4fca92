//! Runs tests: each command in a process of its own, several at the same time.

use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::shared::fail::VerbFailure;
use crate::verbs::test::cases::TestCase;
use crate::verbs::test::results::{TestOutcome, TestResult};

/// Time between two looks at a running process.
const POLL: Duration = Duration::from_millis(5);

/// What a process wrote, and how it ended.
#[derive(Debug, PartialEq, Eq)]
struct ProcessOutput {
    /// The exit code; `None` if a signal or the time limit ended the process.
    code: Option<i32>,
    stdout: Vec<u8>,
    stderr: Vec<u8>,
    timed_out: bool,
}

/// Runs tests.
pub struct TestRunner {
    /// This program.
    program: PathBuf,
    timeout: Duration,
    /// Whether each test runs twice.
    twice: bool,
    /// Whether a waveform is made of each test that failed.
    draws_waves: bool,
}

impl TestRunner {
    /// # Errors
    /// The operating system does not tell where this program is.
    pub fn new(timeout: Duration, twice: bool, draws_waves: bool) -> Result<TestRunner, VerbFailure> {
        let program = std::env::current_exe()
            .map_err(|error| VerbFailure::Usage(format!("the program emu cannot be found: {error}")))?;
        Ok(TestRunner { program, timeout, twice, draws_waves })
    }

    /// Runs all tests, `jobs` at the same time, and calls `report` for each result, one call at a time. The
    /// results are in the order of the tests; with `fail_fast`, tests that were not started have none.
    pub fn run_all<'a>(
        &self,
        cases: &'a [TestCase],
        jobs: usize,
        fail_fast: bool,
        report: impl Fn(&TestResult<'a>) -> Result<(), VerbFailure> + Sync,
    ) -> Vec<Result<TestResult<'a>, VerbFailure>> {
        let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
        let results: Mutex<Vec<(usize, Result<TestResult<'a>, VerbFailure>)>> = Mutex::new(Vec::new());
        let work = || {
            while !is_over.load(Ordering::Relaxed) {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(case) = cases.get(index) else { return };
                let result = self.run(case);
                let Ok(mut done) = results.lock() else { return };
                let reported = report(&result);
                if reported.is_err() || fail_fast && !result.passed() {
                    is_over.store(true, Ordering::Relaxed);
                }
                done.push((index, reported.map(|()| result)));
            }
        };
        thread::scope(|scope| (0..jobs.max(1)).for_each(|_| _ = scope.spawn(work)));
        let mut results = results.into_inner().unwrap_or_default();
        results.sort_by_key(|(index, _)| *index);
        results.into_iter().map(|(_, result)| result).collect()
    }

    /// Runs one test.
    fn run<'a>(&self, case: &'a TestCase) -> TestResult<'a> {
        let started = Instant::now();
        let output = self.output(case, &case.arguments);
        let duration = started.elapsed();
        let mut result = match output {
            Err(error) => TestResult::not_started(case, &error),
            Ok(output) => {
                let outcome = match output.code {
                    _ if output.timed_out => TestOutcome::TimedOut,
                    Some(code) => TestOutcome::of_exit_code(code, case.exit_code),
                    None => TestOutcome::Crashed,
                };
                let differs = self.twice && self.output(case, &case.arguments).map_or(true, |again| again != output);
                TestResult {
                    case,
                    outcome: if differs { TestOutcome::Differs } else { outcome },
                    exit_code: output.code,
                    duration,
                    stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
                    stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
                    wave: None,
                }
            }
        };
        if self.draws_waves && matches!(result.outcome, TestOutcome::Failed | TestOutcome::NoResult) {
            result.wave = case.replay_with_wave().and_then(|arguments| self.wave(case, &arguments));
        }
        result
    }

    /// Plays a scenario again, and returns its waveform as a picture (SVG).
    fn wave(&self, case: &TestCase, arguments: &[String]) -> Option<String> {
        let vcd = [arguments, &["--vcd=-".to_owned()]].concat();
        let played = self.output(case, &vcd).ok()?;
        let mut child = self.command(case, &["wave".to_owned(), "-".to_owned(), "--svg=-".to_owned()]);
        let mut child = child.stdin(Stdio::piped()).spawn().ok()?;
        let mut input = child.stdin.take()?;
        let writer = thread::spawn(move || std::io::Write::write_all(&mut input, &played.stdout));
        let drawn = wait(child, self.timeout).ok()?;
        _ = writer.join();
        (drawn.code == Some(0)).then(|| String::from_utf8_lossy(&drawn.stdout).into_owned())
    }

    fn output(&self, case: &TestCase, arguments: &[String]) -> std::io::Result<ProcessOutput> {
        wait(self.command(case, arguments).stdin(Stdio::null()).spawn()?, self.timeout)
    }

    fn command(&self, case: &TestCase, arguments: &[String]) -> Command {
        let mut command = Command::new(&self.program);
        command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        // A test uses one processor, and its output is the same on every machine.
        command.env("RAYON_NUM_THREADS", "1").env("NO_COLOR", "1").env_remove("CLICOLOR_FORCE");
        if let Some(folder) = &case.folder {
            command.current_dir(folder);
        }
        command
    }
}

/// Waits for a process, for at most `timeout`; then ends it.
fn wait(mut child: Child, timeout: Duration) -> std::io::Result<ProcessOutput> {
    fn reader(pipe: Option<impl Read + Send + 'static>) -> thread::JoinHandle<Vec<u8>> {
        thread::spawn(move || {
            let mut bytes = Vec::new();
            if let Some(mut pipe) = pipe {
                // What was read before an error is shown.
                _ = pipe.read_to_end(&mut bytes);
            }
            bytes
        })
    }
    let (stdout, stderr) = (reader(child.stdout.take()), reader(child.stderr.take()));
    let started = Instant::now();
    let (status, timed_out) = loop {
        if let Some(status) = child.try_wait()? {
            break (status, false);
        }
        if started.elapsed() >= timeout {
            child.kill()?;
            break (child.wait()?, true);
        }
        thread::sleep(POLL);
    };
    let read = |handle: thread::JoinHandle<Vec<u8>>| handle.join().unwrap_or_default();
    Ok(ProcessOutput { code: status.code(), stdout: read(stdout), stderr: read(stderr), timed_out })
}
