//! The outcomes of checks as one HTML file that needs nothing else.

use std::fmt::Write;

use ladder::Program;

use crate::Options;
use crate::html_trace::trace;
use crate::junit::escaped;
use crate::report::{Report, counted};
use crate::svg::waveform;
use crate::table::Outcome;

/// A check and what came of it.
#[derive(Debug, Clone, Copy)]
pub struct Entry<'a> {
    /// The program.
    pub program: &'a Program,
    /// How it was checked.
    pub options: &'a Options,
    /// What came of it.
    pub outcome: &'a Outcome,
}

/// So many checks that agree get a drawing of their symbols; those that differ all do.
const DRAWN: usize = 8;

/// Scans of a drawing where nothing differs.
const SCANS: u64 = 2_000;

/// Colours by the reader's choice of dark or light, names and drawings that do not widen the page.
const STYLE: &str = ":root{color-scheme:light dark;--back:#fff;--text:#1b1f24;--dim:#59636e;--line:#d1d9e0;--good:#1a7f37;--bad:#cf222e;--wash:#ffd8d3;--expected:#0969da}
@media (prefers-color-scheme:dark){:root{--back:#0d1117;--text:#e6edf3;--dim:#9198a1;--line:#3d444d;--good:#3fb950;--bad:#ff7b72;--wash:#5c1f22;--expected:#58a6ff}}
body{background:var(--back);color:var(--text);font:15px/1.5 system-ui,sans-serif;max-width:76rem;margin:2rem auto;padding:0 1rem}
h1,h2{overflow-wrap:anywhere}h2{border-top:1px solid var(--line);padding-top:1.5rem;margin-top:2.5rem}
.agrees{color:var(--good)}.differs{color:var(--bad)}.refused,.dim{color:var(--dim)}
table{border-collapse:collapse;display:block;overflow-x:auto}td,th{border:1px solid var(--line);padding:.25rem .6rem;text-align:left;vertical-align:top}td.n{text-align:right;font-variant-numeric:tabular-nums}
pre,code{font:13px/1.35 ui-monospace,'DejaVu Sans Mono',monospace}pre{overflow-x:auto;border:1px solid var(--line);padding:.7rem}code{overflow-wrap:anywhere}
.both{display:flex;border:1px solid var(--line)}.both>div{overflow-x:auto}.both>div:first-child{flex:none;max-width:45%}
svg{display:block}svg text{font:12px ui-monospace,'DejaVu Sans Mono',monospace;fill:var(--text)}svg .axis{fill:var(--dim);text-anchor:middle}svg .mark{fill:var(--bad);text-anchor:end;font-weight:bold}
svg path{fill:none;stroke-width:1.5}svg .grid{stroke:var(--line);stroke-width:1}svg .reset{stroke:var(--dim);stroke-dasharray:3 3;stroke-width:1}
svg .expected{stroke:var(--expected)}svg .found{stroke:var(--text);stroke-dasharray:4 3}svg .bad{fill:var(--wash)}";

/// One page of all checks; every tag is closed, so that it is well-formed XML, too.
#[must_use]
pub fn html(entries: &[Entry<'_>]) -> String {
    let outcomes: Vec<Outcome> = entries.iter().map(|entry| entry.outcome.clone()).collect();
    let differ = entries.iter().filter(|e| matches!(e.outcome, Outcome::Checked(report) if !report.agreed)).count();
    let title = match entries {
        [one] => format!("{} on {}", one.program.file, one.options.mcu),
        _ => format!("{}, {differ} differ", counted(entries.len() as u64, "check")),
    };
    let title = escaped(&title);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" content=\"width=device-width\"/>\n\
         <title>emu check: {title}</title>\n<style>\n{STYLE}\n</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
    );
    if entries.len() > 1 {
        _ = writeln!(page, "<pre>{}</pre>", escaped(&crate::table(&outcomes)));
    }
    let mut drawn = 0;
    for entry in entries {
        match entry.outcome {
            Outcome::Refused(refused) => {
                let why = refused
                    .errors
                    .iter()
                    .map(|e| format!("<li>{} [{}]</li>", escaped(&e.cause), e.code))
                    .collect::<String>();
                page += &head(entry, "refused", "refused");
                _ = writeln!(page, "<ul>{why}</ul>");
            }
            Outcome::Checked(report) => {
                drawn += usize::from(report.agreed);
                page += &checked(entry, report, !report.agreed || drawn <= DRAWN);
            }
        }
    }
    page + "</body>\n</html>\n"
}

fn head(entry: &Entry<'_>, class: &str, verdict: &str) -> String {
    let (program, mcu) = (escaped(&entry.program.file), escaped(&entry.options.mcu));
    format!("<h2>{program} on {mcu}: <span class=\"{class}\">{verdict}</span></h2>\n")
}

fn checked(entry: &Entry<'_>, report: &Report, draws: bool) -> String {
    let mut text = if report.agreed { head(entry, "agrees", "agrees") } else { head(entry, "differs", "DIFFERS") };
    let line = |name: &str, value: &str| format!("<tr><th>{name}</th><td>{value}</td></tr>\n");
    if let Some(difference) = &report.difference {
        text += "<table>\n";
        let what = difference.symbol.clone().unwrap_or_else(|| format!("{:?}", difference.what).to_lowercase());
        text += &line("what", &format!("{} [{}]", escaped(&what), difference.code));
        text += &line("expected", &escaped(&difference.expected));
        text += &line("found", &escaped(&difference.found));
        if let (Some(rung), Some(element), Some(of)) = (difference.rung, difference.element, &difference.element_text) {
            text += &line("element", &format!("rung {rung}, element {element} <code>{}</code>", escaped(of)));
        }
        let (scan, run, of_run) = (difference.scan, difference.run, difference.scan_of_run);
        text += &line("when", &format!("scan {scan}: cycle {} of run {run}, in its scan {of_run}", difference.cycle));
        text += &line("replay", &format!("<code>{}</code>", escaped(&difference.replay)));
        if !difference.smallest.is_empty() {
            text += &line("smallest stimulus", &format!("<pre>{}</pre>", escaped(&difference.smallest.join("\n"))));
        }
        text += "</table>\n";
    } else {
        let replay = crate::run::replay(entry.program, entry.options, report.scans);
        _ = writeln!(text, "<p>Again: <code>{}</code></p>", escaped(&replay));
    }
    let figures = &report.figures;
    let clocks = |cycles: u64| counted(cycles.saturating_mul(figures.clocks_per_cycle), "clock");
    text += "<h3>Figures</h3>\n<table>\n";
    for (name, value) in [
        ("scans", format!("{} in {} from reset", counted(report.scans, "scan"), counted(report.runs, "run"))),
        ("compared", counted(report.compared, "value")),
        ("code", counted(figures.code_bytes.into(), "byte")),
        ("RAM", counted(figures.ram_bytes.into(), "byte")),
        ("period", format!("{} machine cycles of {}", figures.period_cycles, clocks(1))),
        (
            "longest scan",
            format!("{}, {} by the compiler", clocks(figures.scan_cycles_max), clocks(figures.scan_cycles_bound)),
        ),
        ("mean scan", format!("{:.1} clocks", figures.scan_cycles_mean * figures.clocks_per_cycle as f64)),
        ("slack", clocks(figures.slack_cycles)),
    ] {
        text += &line(name, &escaped(&value));
    }
    text += "</table>\n<h3>Coverage</h3>\n<table>\n<tr><th>class</th><th>seen</th><th>can</th><th>cannot</th></tr>\n";
    for row in &report.coverage.classes {
        let class =
            serde_json::to_value(row.class).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default();
        let (covered, total, cannot) = (row.covered, row.total, row.impossible);
        _ = writeln!(
            text,
            "<tr><td>{}</td><td class=\"n\">{covered}</td><td class=\"n\">{total}</td><td class=\"n\">{cannot}</td></tr>",
            escaped(&class)
        );
    }
    text += "</table>\n";
    if !report.coverage.missing.is_empty() {
        _ = writeln!(
            text,
            "<details><summary>not seen</summary><pre>{}</pre></details>",
            escaped(&report.coverage.missed())
        );
    }
    if draws {
        text += &symbols(entry, report);
    }
    _ = writeln!(text, "<h3>Program</h3>\n<pre>{}</pre>", escaped(&ladder::draw(entry.program)));
    text
}

/// The drawing of symbols over scans.
fn symbols(entry: &Entry<'_>, report: &Report) -> String {
    let scans = if report.agreed { report.scans.min(SCANS) } else { report.scans };
    let Some(mut trace) = trace(entry.program, entry.options, scans) else { return String::new() };
    let reset = trace.rows.iter().rposition(|row| row.reset).unwrap_or(0);
    if !report.agreed {
        // The run that differs is what counts.
        trace.rows.drain(..reset);
    }
    let (Some(first), Some(last)) = (trace.rows.front(), trace.rows.back()) else { return String::new() };
    let (from, to) = (first.scan, last.scan);
    let (names, wave) = waveform(&trace);
    format!(
        "<h3>Symbols, scan {from} to {to}</h3>\n<p class=\"dim\">Solid: reference. Dashed: chip. A shaded scan differs; an upright \
         dashed line is a reset. Names and lines tell more where the pointer rests.</p>\n<div class=\"both\"><div>{names}</div><div>{wave}</div></div>\n"
    )
}
