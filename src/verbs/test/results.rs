//! Results of tests, as lines of text, JSON, JUnit XML and annotations of GitHub.

use std::time::Duration;

use quick_junit::{NonSuccessKind, Report, TestCase as JunitCase, TestCaseStatus, TestSuite};
use serde_json::{Value, json};

use crate::shared::fail::{VerbFailure, exit};
use crate::verbs::test::cases::TestCase;

/// Name of the report and of its only suite.
const NAME: &str = "emu test";

/// Maximum number of lines that are shown of each output of a failed test.
const MAX_LINES: usize = 60;

/// How a test ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestOutcome {
    /// The command ended with the expected exit code.
    Passed,
    /// An expectation was not met, or chip and reference differ.
    Failed,
    /// A limit came before the awaited event.
    NoResult,
    /// The program on the chip did something impossible.
    Fault,
    /// The command or a file was refused, or emu itself failed.
    Refused,
    /// The command ended with success, but another exit code was expected.
    Unexpected,
    /// The test took longer than --timeout.
    TimedOut,
    /// A signal ended the process.
    Crashed,
    /// Two runs of the test had different outputs.
    Differs,
}

impl TestOutcome {
    /// Returns the outcome of a command that ended with an exit code.
    pub fn of_exit_code(code: i32, expected: u8) -> TestOutcome {
        match u8::try_from(code) {
            Ok(code) if code == expected => TestOutcome::Passed,
            Ok(exit::OK) => TestOutcome::Unexpected,
            Ok(exit::FAILED) => TestOutcome::Failed,
            Ok(exit::LIMIT) => TestOutcome::NoResult,
            Ok(exit::FAULT) => TestOutcome::Fault,
            _ => TestOutcome::Refused,
        }
    }

    /// Returns the word at the beginning of the line of a test.
    fn word(self) -> &'static str {
        match self {
            TestOutcome::Passed => "PASS",
            TestOutcome::Failed => "FAIL",
            TestOutcome::NoResult => "LIMIT",
            TestOutcome::Fault => "FAULT",
            TestOutcome::Refused => "ERROR",
            TestOutcome::Unexpected => "NO FAIL",
            TestOutcome::TimedOut => "TIMEOUT",
            TestOutcome::Crashed => "CRASH",
            TestOutcome::Differs => "DIFFERS",
        }
    }

    /// Returns the outcome as a clause.
    fn clause(self) -> &'static str {
        match self {
            TestOutcome::Passed => "passed",
            TestOutcome::Failed => "an expectation was not met",
            TestOutcome::NoResult => "a limit came before the awaited event",
            TestOutcome::Fault => "the program did something impossible",
            TestOutcome::Refused => "the command or a file was refused",
            TestOutcome::Unexpected => "the command succeeded, but should not",
            TestOutcome::TimedOut => "the time of --timeout was over",
            TestOutcome::Crashed => "a signal ended the process",
            TestOutcome::Differs => "two runs gave different outputs",
        }
    }

    /// Returns true if the test itself says no; otherwise it could not be carried out.
    fn is_failure(self) -> bool {
        matches!(self, TestOutcome::Failed | TestOutcome::NoResult | TestOutcome::Unexpected | TestOutcome::Differs)
    }
}

/// The result of a test.
#[derive(Debug)]
pub struct TestResult<'a> {
    /// The test.
    pub case: &'a TestCase,
    /// How it ended.
    pub outcome: TestOutcome,
    /// The exit code of its command; `None` if there is none.
    pub exit_code: Option<i32>,
    /// Host time of the command.
    pub duration: Duration,
    /// What it wrote to standard output.
    pub stdout: String,
    /// What it wrote to standard error.
    pub stderr: String,
    /// Waveform of a failed scenario, as a picture (SVG).
    pub wave: Option<String>,
}

/// How lines are printed.
#[derive(Debug, Clone, Copy)]
pub struct LineStyle {
    color: bool,
    /// Whether nothing is printed, because standard output carries a document.
    pub is_quiet: bool,
    /// Number of tests.
    tests: usize,
}

impl LineStyle {
    /// Returns the style of a run of `tests` tests.
    pub fn new(color: bool, is_quiet: bool, tests: usize) -> LineStyle {
        LineStyle { color, is_quiet, tests }
    }

    /// Returns a word of eight columns, green or red if colours are wanted.
    fn word(self, word: &str, is_good: bool) -> String {
        match (self.color, is_good) {
            (false, _) => format!("{word:>8}"),
            (true, true) => format!("\x1b[1;32m{word:>8}\x1b[0m"),
            (true, false) => format!("\x1b[1;31m{word:>8}\x1b[0m"),
        }
    }
}

/// The first error among the messages of a command.
#[derive(Debug, PartialEq, Eq)]
struct ReportedError {
    /// Its sentence, with the code.
    text: String,
    /// File and position, if the message has them.
    place: Option<(String, u32, u32)>,
}

impl TestResult<'_> {
    /// Returns the result of a test whose process did not start.
    pub fn not_started<'a>(case: &'a TestCase, error: &std::io::Error) -> TestResult<'a> {
        TestResult {
            case,
            outcome: TestOutcome::Refused,
            exit_code: None,
            duration: Duration::ZERO,
            stdout: String::new(),
            stderr: format!("error: the process did not start: {error}\n"),
            wave: None,
        }
    }

    /// Returns true if the test passed.
    pub fn passed(&self) -> bool {
        self.outcome == TestOutcome::Passed
    }

    /// Returns the line of the test, and its output and command if it did not pass.
    pub fn text(&self, style: &LineStyle) -> String {
        let word = style.word(self.outcome.word(), self.passed());
        let mut text = format!("{word} [{:>8.3}s] {}\n", self.duration.as_secs_f64(), self.case.name);
        if self.passed() {
            return text;
        }
        let code = self.exit_code.map_or(String::new(), |code| format!(", exit code {code}"));
        text += &format!("  {}{code}\n", self.outcome.clause());
        for output in [&self.stderr, &self.stdout] {
            let lines: Vec<&str> = output.lines().collect();
            text.extend(lines.iter().take(MAX_LINES).map(|line| format!("  | {line}\n")));
            if lines.len() > MAX_LINES {
                text += &format!("  | ({} more lines)\n", lines.len() - MAX_LINES);
            }
        }
        text + &format!("  again: {}\n", self.case.command())
    }

    /// Returns the first error that the command reported.
    fn reported_error(&self) -> Option<ReportedError> {
        let mut lines = self.stderr.lines();
        let text = lines.find_map(|line| match line.split_once("error: ") {
            Some((code, text)) if code.is_empty() || code.starts_with('[') => Some(format!("{}{text}", code)),
            _ => None,
        })?;
        // As the messages are drawn: ,-[ file:line:column ]
        let place = lines.next().and_then(|line| {
            let inner = line.trim().strip_prefix(",-[ ")?.strip_suffix(" ]")?;
            let mut parts = inner.rsplitn(3, ':');
            let column = parts.next()?.parse().ok()?;
            let line = parts.next()?.parse().ok()?;
            Some((parts.next()?.to_owned(), line, column))
        });
        Some(ReportedError { text, place })
    }

    /// Returns the result in one sentence.
    pub fn sentence(&self) -> String {
        match self.reported_error().filter(|_| !self.passed()) {
            Some(error) => error.text,
            None => self.outcome.clause().to_owned(),
        }
    }

    /// Returns the line with which GitHub Actions marks the place of a failure; `None` if the test passed.
    pub fn github_annotation(&self) -> Option<String> {
        if self.passed() {
            return None;
        }
        let place = self.reported_error().and_then(|error| error.place);
        let (file, line, column) = place.unwrap_or_else(|| (self.case.file.clone(), self.case.line, 1));
        let file = match &self.case.folder {
            Some(folder) => folder.join(&file).display().to_string(),
            None => file,
        };
        let data = |text: &str| text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
        let property = |text: &str| data(text).replace(':', "%3A").replace(',', "%2C");
        Some(format!(
            "::error file={},line={line},col={column},title={}::{}\n",
            property(&file),
            property(&self.case.name),
            data(&format!("{}\nagain: {}", self.sentence(), self.case.command()))
        ))
    }

    /// Returns the result as JSON.
    pub fn json(&self) -> Value {
        json!({
            "name": self.case.name,
            "file": self.case.file,
            "line": self.case.line,
            "command": self.case.command(),
            "passed": self.passed(),
            "outcome": self.outcome.word().to_ascii_lowercase(),
            "exit": self.exit_code,
            "seconds": self.duration.as_secs_f64(),
            "why": (!self.passed()).then(|| self.sentence()),
            "stdout": self.stdout,
            "stderr": self.stderr,
        })
    }

    fn junit_case(&self) -> JunitCase {
        let status = if self.passed() {
            TestCaseStatus::success()
        } else {
            let kind = if self.outcome.is_failure() { NonSuccessKind::Failure } else { NonSuccessKind::Error };
            let mut status = TestCaseStatus::non_success(kind);
            status.set_type(self.outcome.word().to_ascii_lowercase());
            status.set_message(self.sentence());
            status.set_description(format!("{}{}again: {}\n", self.stderr, self.stdout, self.case.command()));
            status
        };
        let mut case = JunitCase::new(self.case.name.as_str(), status);
        case.set_classname(self.case.file.as_str());
        case.set_time(self.duration);
        case.set_system_out(self.stdout.as_str());
        case.set_system_err(self.stderr.as_str());
        case
    }
}

/// Returns the results as JUnit XML; `file` is the file for which it is made, for messages.
pub fn junit(file: &str, results: &[TestResult<'_>]) -> Result<String, VerbFailure> {
    let mut suite = TestSuite::new(NAME);
    suite.add_test_cases(results.iter().map(TestResult::junit_case));
    suite.set_time(results.iter().map(|result| result.duration).sum());
    let mut report = Report::new(NAME);
    report.add_test_suite(suite);
    report.to_string().map_err(|error| VerbFailure::write_failed(file, &std::io::Error::other(error)))
}

/// The numbers of a run.
#[derive(Debug, Clone, Copy)]
pub struct TestSummary {
    /// Number of tests that were found.
    found: usize,
    /// Number of tests that ran.
    ran: usize,
    /// Number of tests that passed.
    passed: usize,
    /// Host time of the whole run.
    duration: Duration,
}

impl TestSummary {
    /// Counts the results.
    pub fn new(results: &[TestResult<'_>], found: usize, duration: Duration) -> TestSummary {
        let passed = results.iter().filter(|result| result.passed()).count();
        TestSummary { found, ran: results.len(), passed, duration }
    }

    /// Returns true if every test that ran passed.
    pub fn all_passed(&self) -> bool {
        self.passed == self.ran
    }

    /// Returns the summary as a sentence.
    pub fn sentence(&self) -> String {
        let tests = if self.ran == 1 { "test" } else { "tests" };
        let failed = match self.ran - self.passed {
            0 => String::new(),
            failed => format!(", {failed} failed"),
        };
        format!("{} {tests} run: {} passed{failed}", self.ran, self.passed)
    }

    /// Returns the last line of a run.
    pub fn text(&self, style: &LineStyle) -> String {
        let word = style.word("Summary", self.all_passed());
        let skipped = match self.found - style.tests {
            0 => String::new(),
            skipped => format!(", {skipped} not selected"),
        };
        let not_run = match style.tests - self.ran {
            0 => String::new(),
            not_run => format!(", {not_run} not run"),
        };
        format!("{word} [{:>8.3}s] {}{skipped}{not_run}\n", self.duration.as_secs_f64(), self.sentence())
    }

    /// Returns the summary as JSON.
    pub fn json(&self) -> Value {
        json!({
            "found": self.found,
            "run": self.ran,
            "passed": self.passed,
            "failed": self.ran - self.passed,
            "seconds": self.duration.as_secs_f64(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failed(case: &TestCase, stderr: &str) -> String {
        let result = TestResult {
            case,
            outcome: TestOutcome::Failed,
            exit_code: Some(1),
            duration: Duration::ZERO,
            stdout: String::new(),
            stderr: stderr.to_owned(),
            wave: None,
        };
        result.github_annotation().expect("an annotation")
    }

    #[test]
    fn annotations_have_the_place_of_the_message() {
        let mut case = TestCase {
            name: "a, b: c".to_owned(),
            file: "emu.toml".to_owned(),
            line: 7,
            folder: None,
            arguments: vec!["run".to_owned(), "x.hex".to_owned()],
            exit_code: 0,
        };
        let drawn = "x: note[LC040]: pins\n[SCN020] error: 50% is wrong\n   ,-[ s.toml:12:3 ]\n   |\n";
        let line = failed(&case, drawn);
        assert_eq!(
            line,
            "::error file=s.toml,line=12,col=3,title=a%2C b%3A c::[SCN020] 50%25 is wrong%0Aagain: emu run x.hex\n"
        );
        let line = failed(&case, "error: the scenario has ended\n");
        assert!(line.starts_with("::error file=emu.toml,line=7,col=1,"), "{line}");
        case.folder = Some("sub".into());
        let line = failed(&case, "nothing");
        assert!(line.starts_with("::error file=sub/emu.toml,line=7,"), "{line}");
    }

    #[test]
    fn exit_codes_have_outcomes() {
        let outcomes = [0, 1, 2, 3, 4, 5, 70, 101].map(|code| TestOutcome::of_exit_code(code, 0).word());
        assert_eq!(outcomes, ["PASS", "FAIL", "ERROR", "ERROR", "FAULT", "LIMIT", "ERROR", "ERROR"]);
        assert_eq!(TestOutcome::of_exit_code(0, 4), TestOutcome::Unexpected);
        assert_eq!(TestOutcome::of_exit_code(4, 4), TestOutcome::Passed);
    }
}
