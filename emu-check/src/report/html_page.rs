//! The outcomes of checks as one self-contained HTML file.

use std::fmt::Write;

use ladder::{ElementId, LadderProgram};
use ladder_compile::CompiledProgram;

use diag::escape_markup;

use crate::CheckOptions;
use crate::comparison::symbol_trace::symbol_trace;
use crate::report::check_report::{CheckDifference, CheckReport, DifferenceKind, count_text, grouped_number};
use crate::report::summary_table::{COLUMN_HEADS, CheckOutcome, report_cells, verdict_line};
use crate::report::waveform_svg::{WaveformImages, waveform};

/// A check and its outcome, for [`html_report`].
#[derive(Debug, Clone, Copy)]
pub struct ReportEntry<'a> {
    /// The program.
    pub program: &'a LadderProgram,
    /// The options of the check.
    pub options: &'a CheckOptions,
    /// The image that was checked, if it is not the one that the compiler makes with these options.
    pub compiled: Option<&'a CompiledProgram>,
    /// The outcome of the check.
    pub outcome: &'a CheckOutcome,
}

/// Maximum number of agreeing checks whose symbols are drawn; every check that differs is drawn.
const MAX_DRAWN_CHECKS: usize = 8;

/// Number of scans drawn for a check without a difference.
const DRAWN_SCANS: u64 = 2_000;

/// Minimum number of scans drawn before a difference, if the check has that many.
const SCANS_BEFORE_DIFFERENCE: usize = 40;

const STYLE: &str = include_str!("report.css");

/// One HTML page of all checks. All tags are closed, so the page is also well-formed XML.
#[must_use]
pub fn html_report(entries: &[ReportEntry<'_>]) -> String {
    let outcomes: Vec<CheckOutcome> = entries.iter().map(|entry| entry.outcome.clone()).collect();
    let differ =
        entries.iter().filter(|e| matches!(e.outcome, CheckOutcome::Checked(report) if !report.agreed)).count();
    let title = match entries {
        [one] => format!("{} on {}", one.program.file, one.options.mcu),
        _ => format!("{}, {differ} differ", count_text(entries.len() as u64, "check")),
    };
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" content=\"width=device-width\"/>\n\
         <title>emu check: {0}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n",
        escape_markup(&title)
    );
    if entries.len() > 1 {
        _ = writeln!(page, "<h1>{}</h1>", escape_markup(&title));
        page += &overview_table(entries);
        _ = writeln!(page, "<p>{}</p>", escape_markup(&verdict_line(&outcomes)));
    }
    let mut drawn = 0;
    for (n, entry) in entries.iter().enumerate() {
        page += &section_head(entry, n, entries.len() > 1);
        match entry.outcome {
            CheckOutcome::Refused(refused) => {
                let why = |e: &diag::Diagnostic| format!("<li>{} [{}]</li>", escape_markup(&e.cause), e.code);
                _ = writeln!(page, "<ul>{}</ul>", refused.errors.iter().map(why).collect::<String>());
            }
            CheckOutcome::Checked(report) => {
                drawn += usize::from(report.agreed);
                page += &checked_section(entry, report, !report.agreed || drawn <= MAX_DRAWN_CHECKS);
                // The program is drawn once for all chips.
                let before = entries.iter().take(n).position(|other| {
                    std::ptr::eq(other.program, entry.program) && matches!(other.outcome, CheckOutcome::Checked(_))
                });
                page += &match before {
                    Some(first) => format!("<p><a href=\"#program-{}\">The program</a></p>\n", first + 1),
                    None => format!(
                        "<h3 id=\"program-{}\">Program</h3>\n<pre>{}</pre>\n",
                        n + 1,
                        escape_markup(&ladder::draw(entry.program))
                    ),
                };
            }
        }
    }
    page + "</body>\n</html>\n"
}

/// CSS class of an outcome, and the text of its verdict.
fn verdict_class_and_text(outcome: &CheckOutcome) -> (&'static str, &'static str) {
    match outcome {
        CheckOutcome::Refused(_) => ("refused", "refused"),
        CheckOutcome::Checked(report) if report.agreed => ("agrees", "agrees"),
        CheckOutcome::Checked(_) => ("differs", "DIFFERS"),
    }
}

/// A table with one row per check, linked to its section.
fn overview_table(entries: &[ReportEntry<'_>]) -> String {
    let head = |(n, head): (usize, &&str)| format!("<th{}>{head}</th>", if n > 2 { " class=\"n\"" } else { "" });
    let heads: String = COLUMN_HEADS.iter().enumerate().map(head).collect();
    let mut text = format!("<table>\n<tr>{heads}</tr>\n");
    for (n, entry) in entries.iter().enumerate() {
        let (class, verdict) = verdict_class_and_text(entry.outcome);
        let (program, mcu) = (escape_markup(&entry.program.file), escape_markup(&entry.options.mcu));
        let figures: String = match entry.outcome {
            CheckOutcome::Checked(report) => report_cells(report)
                .iter()
                .skip(3)
                .map(|cell| format!("<td class=\"n\">{}</td>", escape_markup(cell)))
                .collect(),
            CheckOutcome::Refused(refused) => {
                let why = refused.errors.first().map_or("", |error| error.cause.as_str());
                format!("<td class=\"dim\" colspan=\"{}\">{}</td>", COLUMN_HEADS.len() - 3, escape_markup(why))
            }
        };
        _ = writeln!(
            text,
            "<tr><td>{program}</td><td>{mcu}</td><td><a class=\"{class}\" href=\"#check-{}\">{verdict}</a></td>{figures}</tr>",
            n + 1
        );
    }
    text + "</table>\n<p class=\"dim\">Code and RAM are in bytes. Times are in clocks of the oscillator and leave out the wait at the end of a scan. The worst rung has its time and its number.</p>\n"
}

fn section_head(entry: &ReportEntry<'_>, n: usize, many: bool) -> String {
    let (program, mcu) = (escape_markup(&entry.program.file), escape_markup(&entry.options.mcu));
    let (class, verdict) = verdict_class_and_text(entry.outcome);
    let level = if many { "h2" } else { "h1" };
    format!("<{level} id=\"check-{}\">{program} on {mcu}: <span class=\"{class}\">{verdict}</span></{level}>\n", n + 1)
}

/// One row of a table with a heading; both arguments are HTML already.
fn table_line(name: &str, value: &str) -> String {
    format!("<tr><th>{name}</th><td>{value}</td></tr>\n")
}

fn checked_section(entry: &ReportEntry<'_>, report: &CheckReport, draws: bool) -> String {
    let mut text = match &report.difference {
        Some(difference) => difference_section(entry.program, difference),
        None => {
            let replay = crate::comparison::check_run::replay_command(entry.program, entry.options, report.scans);
            format!("<p>Replay: <code>{}</code></p>\n", escape_markup(&replay))
        }
    };
    text += &figures_section(report);
    text += "<h3>Coverage</h3>\n<table>\n<tr><th>class</th><th class=\"n\">seen</th><th class=\"n\">of</th><th class=\"n\">impossible</th></tr>\n";
    for row in &report.coverage.classes {
        let class = serde_json::to_value(row.class).ok();
        let class = class.as_ref().and_then(serde_json::Value::as_str).unwrap_or_default();
        let cells = [row.covered, row.total, row.impossible].map(|cell| format!("<td class=\"n\">{cell}</td>"));
        _ = writeln!(text, "<tr><td>{}</td>{}</tr>", escape_markup(class), cells.concat());
    }
    text += "</table>\n";
    if !report.coverage.missing.is_empty() {
        let missed = escape_markup(&report.coverage.missing_lines());
        _ = writeln!(text, "<details><summary>not seen</summary><pre>{missed}</pre></details>");
    }
    if draws {
        text += &symbol_drawing(entry, report);
    }
    text
}

/// The section with all details of a difference.
fn difference_section(program: &LadderProgram, difference: &CheckDifference) -> String {
    let (mut text, mut drawing) = ("<table>\n".to_owned(), String::new());
    text += &table_line("what", &format!("{} [{}]", escape_markup(&difference.subject()), difference.code));
    text += &table_line("expected", &escape_markup(&difference.expected));
    text += &table_line("found", &escape_markup(&difference.found));
    if difference.differing.len() > 1 {
        text += &table_line("all", &escape_markup(&difference.differing.join("; ")));
    }
    if let (Some(rung), Some(element), Some(of)) = (difference.rung, difference.element, &difference.element_text) {
        text += &table_line("element", &format!("rung {rung}, element {element} <code>{}</code>", escape_markup(of)));
        let id = ElementId { rung: rung.saturating_sub(1), index: element.saturating_sub(1) };
        drawing = format!("<pre>{}</pre>\n", marked_rung(program, id));
    }
    let (scan, run, of_run) = (difference.scan, difference.run, difference.scan_of_run);
    text += &match difference.what {
        DifferenceKind::Map => table_line("when", "before anything has run"),
        _ => table_line("when", &format!("scan {scan}: cycle {} of run {run}, in its scan {of_run}", difference.cycle)),
    };
    text += &table_line("replay", &format!("<code>{}</code>", escape_markup(&difference.replay)));
    if !difference.smallest.is_empty() {
        text +=
            &table_line("smallest stimulus", &format!("<pre>{}</pre>", escape_markup(&difference.smallest.join("\n"))));
    }
    text + "</table>\n" + &drawing
}

/// The drawing of a rung with one element marked.
fn marked_rung(program: &LadderProgram, id: ElementId) -> String {
    let drawing = ladder::draw_rung(program, id.rung as usize);
    let cell = drawing.elements.iter().find(|cell| cell.id == id);
    let lines = drawing.lines.iter().enumerate().map(|(n, line)| match cell.filter(|cell| cell.line == n) {
        Some(cell) => {
            let part =
                |from: usize, most: usize| escape_markup(&line.chars().skip(from).take(most).collect::<String>());
            let end = cell.column.saturating_add(cell.width);
            let (before, symbol, after) = (part(0, cell.column), part(cell.column, cell.width), part(end, usize::MAX));
            format!("{before}<mark>{symbol}</mark>{}", after.trim_end())
        }
        None => escape_markup(line.trim_end()),
    });
    lines.collect::<Vec<_>>().join("\n")
}

fn figures_section(report: &CheckReport) -> String {
    let figures = &report.figures;
    let clocks = |cycles: u64| count_text(cycles.saturating_mul(figures.clocks_per_cycle), "clock");
    let period = figures.period_cycles.parse().map_or_else(|_| figures.period_cycles.clone(), grouped_number);
    let longest = (clocks(figures.scan_cycles_max), clocks(figures.scan_cycles_bound));
    let rows = [
        ("scans", format!("{} in {} from reset", count_text(report.scans, "scan"), count_text(report.runs, "run"))),
        ("compared", count_text(report.compared, "value")),
        ("code", count_text(figures.code_bytes.into(), "byte")),
        ("RAM", count_text(figures.ram_bytes.into(), "byte")),
        ("period", format!("{period} machine cycles of {}", clocks(1))),
        ("longest scan", format!("{}, at most {} by the compiler", longest.0, longest.1)),
        ("mean scan", format!("{:.1} clocks", figures.scan_cycles_mean * figures.clocks_per_cycle as f64)),
        ("slack", clocks(figures.slack_cycles)),
    ];
    let rows: String = rows.iter().map(|(name, value)| table_line(name, &escape_markup(value))).collect();
    format!("<h3>Figures</h3>\n<table>\n{rows}</table>\n")
}

/// The waveforms of the symbols over the scans.
fn symbol_drawing(entry: &ReportEntry<'_>, report: &CheckReport) -> String {
    let nothing_ran = report.difference.as_ref().is_some_and(|difference| difference.what == DifferenceKind::Map);
    let scans = if report.agreed { report.scans.min(DRAWN_SCANS) } else { report.scans };
    let Some(mut trace) = symbol_trace(entry, scans).filter(|_| !nothing_ran) else { return String::new() };
    let reset = trace.rows.iter().rposition(|row| row.reset).unwrap_or(0);
    if !report.agreed {
        // Only the run that differs matters; before a short run, the end of the previous one is drawn too.
        trace.rows.drain(..reset.min(trace.rows.len().saturating_sub(SCANS_BEFORE_DIFFERENCE)));
        trace.differs = true;
    }
    let (Some(first), Some(last)) = (trace.rows.front(), trace.rows.back()) else { return String::new() };
    let (from, to) = (first.scan, last.scan);
    let WaveformImages { names, curves } = waveform(&trace);
    let (end, marks) = match report.agreed {
        true => ("", ""),
        false => (
            " class=\"end\"",
            " The upright red line is the scan of the first difference; what differs in it is shaded.",
        ),
    };
    format!(
        "<h3>Symbols, scan {from} to {to}</h3>\n<p class=\"dim\">Solid: reference. Dashed: chip. An upright dashed line is a reset.{marks} \
         Point at a name or line for details.</p>\n<div class=\"both\"><div class=\"names\">{names}</div><div{end}>{curves}</div></div>\n"
    )
}
