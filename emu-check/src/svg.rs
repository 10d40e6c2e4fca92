//! Symbols over scans as a drawing: the evaluator's line, the chip's over it, and where they part.

use std::fmt::Write;

use crate::html_trace::Trace;
use crate::junit::escaped;

/// Height of a symbol's row, and of the axis.
const ROW: usize = 26;
const AXIS: usize = 22;
/// Height of a signal within its row.
const SIGNAL: usize = 16;
/// Least width of a drawing, most width of a scan, in pixels.
const WIDTH: usize = 900;
const MOST: usize = 24;

/// The column of names, and the drawing that may be wider than the page: both as SVG, row by row at the same height.
pub(crate) fn waveform(trace: &Trace) -> (String, String) {
    let rows = trace.rows.len().max(1);
    let step = (WIDTH / rows).clamp(2, MOST);
    let (width, height) = (rows * step + 2, trace.symbols.len() * ROW + AXIS);
    let longest = trace.symbols.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).min(NAME);
    let names_width = longest * 8 + 16;
    let mut names = open("names", names_width, height);
    let mut svg = open("wave", width, height);
    for (n, row) in trace.rows.iter().enumerate() {
        let x = n * step;
        if row.expected != row.found {
            _ = writeln!(svg, "<rect class=\"bad\" x=\"{x}\" y=\"0\" width=\"{step}\" height=\"{height}\"/>");
        }
        if row.reset {
            let title = format!("reset before scan {}", row.scan);
            _ = writeln!(svg, "<path class=\"reset\" d=\"M{x} 0V{height}\"><title>{title}</title></path>");
        }
    }
    let every = (1..).map(|n| [1, 2, 5][(n - 1) % 3] * 10usize.pow((n as u32 - 1) / 3)).find(|n| n * step >= 60);
    let every = every.unwrap_or(1).max(1);
    for (n, row) in trace.rows.iter().enumerate().filter(|(_, row)| row.scan % every as u64 == 0) {
        _ = writeln!(svg, "<text class=\"axis\" x=\"{}\" y=\"14\">{}</text>", n * step + step / 2, row.scan);
    }
    for (symbol, (name, bit)) in trace.symbols.iter().enumerate() {
        let top = AXIS + symbol * ROW;
        let value = |of: &[i32]| of.get(symbol).copied().unwrap_or(0);
        let all = trace.rows.iter().flat_map(|row| [value(&row.expected), value(&row.found)]);
        let (least, most) = all.fold((0, 1), |(least, most): (i32, i32), v| (least.min(v), most.max(v)));
        let span = (i64::from(most) - i64::from(least)).max(1);
        let y = |v: i32| top + SIGNAL + 2 - ((i64::from(v) - i64::from(least)) * SIGNAL as i64 / span) as usize;
        let shown: String = match name.chars().count() > NAME {
            true => name.chars().take(NAME - 1).chain(['…']).collect(),
            false => name.clone(),
        };
        let range = if *bit { String::new() } else { format!(" {least} to {most}") };
        _ = writeln!(
            names,
            "<text class=\"name\" x=\"4\" y=\"{}\"><title>{}{range}</title>{}</text>",
            top + SIGNAL,
            escaped(name),
            escaped(&shown)
        );
        _ = writeln!(svg, "<path class=\"grid\" d=\"M0 {0}H{width}\"/>", top + SIGNAL + 2);
        for (class, found) in [("expected", false), ("found", true)] {
            let mut path = String::new();
            let mut last = None;
            for (n, row) in trace.rows.iter().enumerate() {
                let level = y(value(if found { &row.found } else { &row.expected }));
                if last != Some(level) {
                    let x = n * step;
                    _ = if last.is_none() { write!(path, "M{x} {level}") } else { write!(path, "H{x}V{level}") };
                    last = Some(level);
                }
            }
            _ = writeln!(
                svg,
                "<path class=\"{class}\" d=\"{path}H{}\"><title>{}</title></path>",
                rows * step,
                escaped(name)
            );
        }
        // Where both part, the values.
        let differs = trace.rows.iter().enumerate().find(|(_, row)| value(&row.expected) != value(&row.found));
        if let Some((n, row)) = differs {
            let (expected, found) = (value(&row.expected), value(&row.found));
            let x = (n * step).saturating_sub(4);
            let line = format!("{expected} expected, {found} found");
            _ = writeln!(svg, "<text class=\"mark\" x=\"{x}\" y=\"{}\">{line}</text>", top + SIGNAL - 2);
        }
    }
    (names + "</svg>", svg + "</svg>")
}

/// Characters of a name that are shown; all of them where the pointer rests.
const NAME: usize = 24;

fn open(class: &str, width: usize, height: usize) -> String {
    format!(
        "<svg class=\"{class}\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n"
    )
}
