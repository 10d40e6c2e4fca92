//! The outcomes of checks as JUnit XML, with one test case per program and chip.

use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

use crate::report::check_report::CheckReport;
use crate::report::summary_table::{CheckOutcome, RefusedCheck};

/// Name of the report and of its only suite.
const NAME: &str = "emu check";

/// One XML document of all outcomes: a difference is a failure, a refused check is skipped.
///
/// # Errors
/// The document cannot be written.
pub fn junit(outcomes: &[CheckOutcome]) -> std::io::Result<String> {
    let mut suite = TestSuite::new(NAME);
    suite.add_test_cases(outcomes.iter().map(|outcome| match outcome {
        CheckOutcome::Checked(report) => checked_case(report),
        CheckOutcome::Refused(refused) => refused_case(refused),
    }));
    let mut report = Report::new(NAME);
    report.add_test_suite(suite);
    report.to_string().map_err(std::io::Error::other)
}

fn test_case(program: &str, mcu: &str, status: TestCaseStatus) -> TestCase {
    let mut case = TestCase::new(mcu, status);
    case.set_classname(program);
    case
}

fn refused_case(refused: &RefusedCheck) -> TestCase {
    let why: Vec<String> = refused.errors.iter().map(|e| format!("{} [{}]", e.cause, e.code)).collect();
    let mut status = TestCaseStatus::skipped();
    status.set_message(why.join("; "));
    test_case(&refused.program, &refused.mcu, status)
}

fn checked_case(report: &CheckReport) -> TestCase {
    let Some(difference) = &report.difference else {
        let mut case = test_case(&report.program, &report.mcu, TestCaseStatus::success());
        case.set_system_out(report.text());
        return case;
    };
    let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
    status.set_type(difference.code.to_string());
    status.set_message(format!(
        "{}: expected {}, found {}",
        difference.subject(),
        difference.expected,
        difference.found
    ));
    status.set_description(report.text());
    test_case(&report.program, &report.mcu, status)
}
