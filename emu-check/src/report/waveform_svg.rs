//! Draws the symbols over the scans as SVG: the evaluator's waveform, the chip's on top of it, and where they
//! differ.

use diag::escape_markup;
use std::fmt::Write;

use crate::comparison::symbol_trace::SymbolTrace;

/// Height of a symbol's row, in pixels.
const ROW_HEIGHT: usize = 26;
/// Height of the axis, in pixels.
const AXIS_HEIGHT: usize = 22;
/// Height of a signal within its row, in pixels.
const SIGNAL_HEIGHT: usize = 16;
/// Minimum width of a drawing, in pixels.
const MIN_WIDTH: usize = 900;
/// Maximum width of a scan, in pixels.
const MAX_SCAN_WIDTH: usize = 24;
/// Approximate width of a character, in pixels.
const CHAR_WIDTH: usize = 8;
/// Free space at the right end for the last number of the axis, in pixels.
const RIGHT_MARGIN: usize = 24;
/// Maximum number of characters of a name that are shown; the tooltip has the full name.
const MAX_NAME_CHARS: usize = 24;

/// Two SVG images with rows of equal height.
pub(crate) struct WaveformImages {
    /// The column of names.
    pub names: String,
    /// The drawing, which may be wider than the page.
    pub curves: String,
}

/// Draws the symbols of a trace.
pub(crate) fn waveform(trace: &SymbolTrace) -> WaveformImages {
    let rows = trace.rows.len().max(1);
    let step = (MIN_WIDTH / rows).clamp(2, MAX_SCAN_WIDTH);
    let drawn = rows * step;
    let height = trace.symbols.len() * ROW_HEIGHT + AXIS_HEIGHT;
    let signals: Vec<SymbolCurve<'_>> =
        (0..trace.symbols.len()).map(|symbol| SymbolCurve::new(trace, symbol)).collect();
    let widest = |length: fn(&SymbolCurve<'_>) -> usize| signals.iter().map(length).max().unwrap_or(0);
    let names_width =
        (widest(|s| s.shown_name().chars().count()) + 2) * CHAR_WIDTH + widest(|s| s.range_text().chars().count()) * 6;
    let mark = widest(|s| s.difference_text().map_or(0, |mark| mark.chars().count()));
    let width = drawn + if mark > 0 { (mark + 2) * CHAR_WIDTH } else { RIGHT_MARGIN };
    let mut names = svg_tag("names", names_width, height);
    let mut svg = svg_tag("wave", width, height);
    push_grid(&mut svg, trace, step, height);
    for (n, signal) in signals.iter().enumerate() {
        let top = AXIS_HEIGHT + n * ROW_HEIGHT;
        let (name, shown, range) =
            (escape_markup(signal.name), escape_markup(&signal.shown_name()), signal.range_text());
        let at = top + SIGNAL_HEIGHT;
        _ = writeln!(names, "<text class=\"name\" x=\"4\" y=\"{at}\"><title>{name} {range}</title>{shown}</text>");
        if !range.is_empty() {
            _ = writeln!(names, "<text class=\"range\" x=\"{}\" y=\"{at}\">{range}</text>", names_width - 6);
        }
        if signal.difference_text().is_some() {
            let x = drawn - step;
            _ = writeln!(svg, "<rect class=\"bad\" x=\"{x}\" y=\"{top}\" width=\"{step}\" height=\"{ROW_HEIGHT}\"/>");
        }
        _ = writeln!(svg, "<path class=\"grid\" d=\"M0 {}H{drawn}\"/>", at + 2);
        for (class, values) in [("expected", &signal.expected), ("found", &signal.found)] {
            let path = signal.path(values, step, top);
            _ = writeln!(svg, "<path class=\"{class}\" d=\"{path}\"><title>{name}</title></path>");
        }
        if let Some(mark) = signal.difference_text() {
            _ = writeln!(svg, "<text class=\"mark\" x=\"{}\" y=\"{}\">{mark}</text>", drawn + CHAR_WIDTH, at - 2);
        }
    }
    if trace.differs {
        // Drawn last, on top of everything else.
        _ = writeln!(
            svg,
            "<path class=\"first\" d=\"M{drawn} {AXIS_HEIGHT}V{height}\"><title>first difference</title></path>"
        );
    }
    WaveformImages { names: names + "</svg>", curves: svg + "</svg>" }
}

/// One symbol over all rows.
struct SymbolCurve<'a> {
    name: &'a str,
    bit: bool,
    expected: Vec<i32>,
    found: Vec<i32>,
    /// The range of the values, extended so that it contains 0.
    least: i32,
    most: i32,
}

impl<'a> SymbolCurve<'a> {
    fn new(trace: &'a SymbolTrace, symbol: usize) -> SymbolCurve<'a> {
        let (name, bit) = trace.symbols.get(symbol).map_or(("", true), |(name, bit)| (name.as_str(), *bit));
        let value = |of: &[i32]| of.get(symbol).copied().unwrap_or(0);
        let expected: Vec<i32> = trace.rows.iter().map(|row| value(&row.expected)).collect();
        let found: Vec<i32> = trace.rows.iter().map(|row| value(&row.found)).collect();
        let all = || expected.iter().chain(&found).copied();
        let (least, most) = (all().min().unwrap_or(0).min(0), all().max().unwrap_or(1).max(1));
        SymbolCurve { name, bit, least, most, expected, found }
    }

    fn shown_name(&self) -> String {
        match self.name.chars().count() > MAX_NAME_CHARS {
            true => self.name.chars().take(MAX_NAME_CHARS - 1).chain(['…']).collect(),
            false => self.name.to_owned(),
        }
    }

    /// The range that an integer is scaled to, as text.
    fn range_text(&self) -> String {
        if self.bit { String::new() } else { format!("{}..{}", self.least, self.most) }
    }

    /// The values in the last row, if they differ.
    fn difference_text(&self) -> Option<String> {
        let (expected, found) = self.expected.last().zip(self.found.last())?;
        (expected != found).then(|| format!("{expected} expected, {found} found"))
    }

    fn path(&self, values: &[i32], step: usize, top: usize) -> String {
        let span = (i64::from(self.most) - i64::from(self.least)).max(1);
        let y = |v: i32| {
            top + SIGNAL_HEIGHT + 2 - ((i64::from(v) - i64::from(self.least)) * SIGNAL_HEIGHT as i64 / span) as usize
        };
        let (mut path, mut last) = (String::new(), None);
        for (n, &value) in values.iter().enumerate() {
            let level = y(value);
            if last != Some(level) {
                let x = n * step;
                _ = if last.is_none() { write!(path, "M{x} {level}") } else { write!(path, "H{x}V{level}") };
                last = Some(level);
            }
        }
        path + &format!("H{}", values.len() * step)
    }
}

/// Draws the scan numbers and the resets.
fn push_grid(svg: &mut String, trace: &SymbolTrace, step: usize, height: usize) {
    let every = (0..).map(|n| [1, 2, 5][n % 3] * 10usize.pow(n as u32 / 3)).find(|every| every * step >= 60);
    let every = every.unwrap_or(1).max(1);
    for (n, row) in trace.rows.iter().enumerate() {
        let x = n * step;
        if row.reset {
            let title = format!("reset before scan {}", row.scan);
            _ = writeln!(svg, "<path class=\"reset\" d=\"M{x} {AXIS_HEIGHT}V{height}\"><title>{title}</title></path>");
        }
        // A number that would extend over the left edge is left out.
        if row.scan.is_multiple_of(every as u64) && x + step / 2 >= CHAR_WIDTH {
            _ = writeln!(svg, "<text class=\"axis\" x=\"{}\" y=\"14\">{}</text>", x + step / 2, row.scan);
        }
    }
}

fn svg_tag(class: &str, width: usize, height: usize) -> String {
    format!(
        "<svg class=\"{class}\" xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">\n"
    )
}
