//! The results of tests as one HTML page without scripts.

use std::fmt::Write;

use diag::escape_markup;

use crate::verbs::test::results::{TestResult, TestSummary};

const STYLE: &str = include_str!("page.css");

/// Returns the page. All tags are closed, so that it is also well-formed XML.
pub fn html_page(results: &[TestResult<'_>], summary: &TestSummary) -> String {
    let title = escape_markup(&summary.sentence());
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width\"/>\n<title>emu test: {title}</title>\n\
         <style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<table>\n\
         <tr><th>test</th><th>result</th><th>time</th></tr>\n"
    );
    for (number, result) in (1..).zip(results) {
        let class = if result.passed() { "pass" } else { "fail" };
        let name = escape_markup(&result.case.name);
        let name = if result.passed() { name } else { format!("<a href=\"#test{number}\">{name}</a>") };
        // Writing to a String cannot fail.
        _ = writeln!(
            page,
            "<tr class=\"{class}\"><td>{name}</td><td>{}</td><td>{:.3} s</td></tr>",
            escape_markup(&result.sentence()),
            result.duration.as_secs_f64()
        );
    }
    page += "</table>\n";
    for (number, result) in (1..).zip(results).filter(|(_, result)| !result.passed()) {
        _ = write!(
            page,
            "<h2 id=\"test{number}\">{}</h2>\n<p>Replay: <code>{}</code></p>\n<pre>{}{}</pre>\n",
            escape_markup(&result.case.name),
            escape_markup(&result.case.command()),
            escape_markup(&result.stderr),
            escape_markup(&result.stdout)
        );
        if let Some(wave) = &result.wave {
            page += wave;
        }
    }
    page + "</body>\n</html>\n"
}
