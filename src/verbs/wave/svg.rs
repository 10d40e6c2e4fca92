//! Draws a waveform as an SVG picture that follows the reader's colour scheme, light or dark.

use diag::escape_markup;
use std::fmt::Write as _;

use super::WaveDrawing;
use super::read::{SignalValue, WaveSignal};

/// Height of a row, of the signal within it, and of the axis above.
const ROW: f64 = 28.0;
const HEIGHT: f64 = 18.0;
const AXIS: f64 = 34.0;

/// Maximum width of a character, in pixels.
const CHARACTER: f64 = 7.4;

/// Minimum distance between two labels of the axis, in pixels.
const MIN_FIGURE_DISTANCE: u32 = 110;

/// Minimum width of a drawn value, in pixels. Narrower values merge into a busy area.
const MIN_STRETCH_WIDTH: f64 = 1.5;

// Viewers without media queries keep the light colours.
const STYLE: &str = "\
:root { color-scheme: light dark; }
text { font: 12px ui-monospace, 'DejaVu Sans Mono', Menlo, Consolas, monospace; fill: #1f2328; }
.paper { fill: #ffffff; }
.time { fill: #6e7781; }
.rule { stroke: #e4e7eb; }
.bit { fill: none; stroke: #0a6640; stroke-width: 1.5; }
.busy { fill: #0a6640; opacity: .45; }
.word { fill: #e8f1fb; stroke: #0b57a4; }
.value { fill: #0b57a4; }
.odd { fill: url(#hatch); stroke: #b42318; }
.hatch { stroke: #b42318; opacity: .5; }
.unknown { fill: #b42318; }
.float { fill: none; stroke: #9a6700; stroke-width: 1.5; stroke-dasharray: 4 3; }
@media (prefers-color-scheme: dark) {
text { fill: #e6e8eb; }
.paper { fill: #15181c; }
.time { fill: #9aa4af; }
.rule { stroke: #2b3138; }
.bit { stroke: #5fd39a; }
.busy { fill: #5fd39a; }
.word { fill: #1d2c3d; stroke: #7ab8ff; }
.value { fill: #7ab8ff; }
.odd { stroke: #ff8a7a; }
.hatch { stroke: #ff8a7a; }
.unknown { fill: #ff8a7a; }
.float { stroke: #e3b341; }
}
";

/// Draws the picture; `width` is in pixels.
pub fn draw(drawing: &WaveDrawing<'_>, width: u32) -> String {
    let longest = drawing.signals.iter().map(|signal| signal.drawn_name().chars().count()).max().unwrap_or(0);
    let left = longest.max(4) as f64 * CHARACTER + 20.0;
    let (width, right) = (f64::from(width).max(left + 100.0), 16.0);
    let plot = TimeAxis { left, width: width - left - right, from: drawing.from, span: drawing.to - drawing.from };
    let height = AXIS + ROW * drawing.signals.len() as f64 + 8.0;
    let mut out = String::new();
    // Writing to a string cannot fail.
    _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\">"
    );
    let scale = drawing.waves.scale;
    _ = writeln!(
        out,
        "<title>{} signals from {} to {}</title>",
        drawing.signals.len(),
        scale.text(drawing.from),
        scale.text(drawing.to)
    );
    _ = writeln!(out, "<style>{STYLE}</style>");
    out.push_str(
        "<defs><pattern id=\"hatch\" width=\"6\" height=\"6\" patternUnits=\"userSpaceOnUse\">\
         <path class=\"hatch\" d=\"M0 6L6 0\"/></pattern></defs>\n<rect class=\"paper\" width=\"100%\" height=\"100%\"/>\n",
    );
    for (at, text) in scale.axis_figures(drawing.from, drawing.to, (plot.width as u32 / MIN_FIGURE_DISTANCE).max(1)) {
        let x = plot.x(at);
        let end = height - 8.0;
        _ = writeln!(out, "<path class=\"rule\" d=\"M{x:.1} {:.1}V{end:.1}\"/>", AXIS - 8.0);
        let anchor = if x + CHARACTER * text.len() as f64 / 2.0 > width { "end" } else { "middle" };
        _ = writeln!(
            out,
            "<text class=\"time\" x=\"{x:.1}\" y=\"16\" text-anchor=\"{anchor}\">{}</text>",
            escape_markup(&text)
        );
    }
    for (row, signal) in drawing.signals.iter().enumerate() {
        let top = AXIS + ROW * row as f64 + (ROW - HEIGHT) / 2.0;
        let (x, y) = (left - 10.0, top + HEIGHT - 5.0);
        _ = writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{}</text>",
            escape_markup(&signal.drawn_name())
        );
        line(&mut out, signal, &plot, top);
    }
    out.push_str("</svg>\n");
    out
}

/// Maps ticks to x coordinates.
struct TimeAxis {
    left: f64,
    width: f64,
    from: u64,
    span: u64,
}

impl TimeAxis {
    fn x(&self, at: u64) -> f64 {
        self.left + at.saturating_sub(self.from).min(self.span) as f64 / self.span as f64 * self.width
    }
}

/// A part of a signal.
#[derive(Debug, Clone)]
struct SignalStretch<'a> {
    /// The coordinate of its start.
    start: f64,
    /// The coordinate of its end.
    end: f64,
    /// Its value, or `None` if it changes too often to be drawn.
    value: Option<&'a SignalValue>,
}

/// Returns the parts of a signal; neighbours that are too narrow are merged.
fn stretches<'a>(signal: &'a WaveSignal, plot: &TimeAxis) -> Vec<SignalStretch<'a>> {
    let (from, to) = (plot.from, plot.from + plot.span);
    let first = signal.changes.partition_point(|(at, _)| *at <= from).saturating_sub(1);
    let shown = signal.changes.get(first..).unwrap_or_default();
    let mut all: Vec<SignalStretch> = Vec::new();
    for (i, (at, value)) in shown.iter().enumerate() {
        if *at >= to {
            break;
        }
        let end = shown.get(i + 1).map_or(to, |next| next.0);
        if end <= from {
            continue;
        }
        let (x, end) = (plot.x(*at), plot.x(end));
        let narrow = end - x < MIN_STRETCH_WIDTH;
        match all.last_mut() {
            Some(SignalStretch { end: last, value: None, .. }) if narrow => *last = end,
            _ => all.push(SignalStretch { start: x, end, value: Some(value).filter(|_| !narrow) }),
        }
    }
    // A single narrow part is a pulse that is still visible.
    let single = |SignalStretch { start, end, value }: SignalStretch<'a>| {
        let here = || shown.iter().find(|(at, _)| (plot.x(*at) - start).abs() < 1e-9).map(|(_, value)| value);
        let value = if value.is_none() && end - start < MIN_STRETCH_WIDTH { here() } else { value };
        SignalStretch { start, end, value }
    };
    all.into_iter().map(single).collect()
}

fn line(out: &mut String, signal: &WaveSignal, plot: &TimeAxis, top: f64) {
    let (bottom, middle) = (top + HEIGHT, top + HEIGHT / 2.0);
    let mut bits = String::new();
    let mut pen: Option<(f64, f64)> = None;
    if signal.event {
        let mut last = f64::MIN;
        for (at, _) in signal.changes.iter().filter(|(at, _)| (plot.from..=plot.from + plot.span).contains(at)) {
            let x = plot.x(*at);
            if x - last >= MIN_STRETCH_WIDTH {
                last = x;
                _ = write!(bits, "M{x:.1} {bottom:.1}V{top:.1}m-3 5l3 -5l3 5");
            }
        }
    }
    for SignalStretch { start: x, end, value } in stretches(signal, plot) {
        let wide = end - x;
        match value {
            Some(level @ (SignalValue::Low | SignalValue::High)) => {
                let y = if *level == SignalValue::High { top } else { bottom };
                match pen {
                    Some((at, last)) if (at - x).abs() < 1e-9 => {
                        if (last - y).abs() > 1e-9 {
                            _ = write!(bits, "V{y:.1}");
                        }
                    }
                    _ => _ = write!(bits, "M{x:.1} {y:.1}"),
                }
                _ = write!(bits, "H{end:.1}");
                pen = Some((end, y));
            }
            Some(SignalValue::Floating) => {
                _ = writeln!(out, "<path class=\"float\" d=\"M{x:.1} {middle:.1}H{end:.1}\"/>");
            }
            Some(SignalValue::Unknown) => draw_value_box(out, ("odd", "x"), (x, end), (top, bottom)),
            Some(SignalValue::Word(text)) => {
                // An unknown digit marks the whole value. In a real number, `x` and `z` are not digits.
                let digits = text.chars().all(|c| c.is_ascii_hexdigit() || matches!(c, 'x' | 'z'));
                let odd = digits && text.contains(['x', 'z']);
                draw_value_box(out, (if odd { "odd" } else { "word" }, text), (x, end), (top, bottom));
            }
            Some(SignalValue::Event) => {}
            None => {
                _ = writeln!(
                    out,
                    "<rect class=\"busy\" x=\"{x:.1}\" y=\"{top:.1}\" width=\"{wide:.1}\" height=\"{HEIGHT:.1}\"/>"
                );
            }
        }
    }
    if !bits.is_empty() {
        _ = writeln!(out, "<path class=\"bit\" d=\"{bits}\"/>");
    }
}

/// Draws a box with pointed ends, and as much of its text as fits.
fn draw_value_box(out: &mut String, (class, text): (&str, &str), (x, end): (f64, f64), (top, bottom): (f64, f64)) {
    let (wide, middle) = (end - x, (top + bottom) / 2.0);
    let tip = (wide / 2.0).min(4.0);
    let (near, far) = (x + tip, end - tip);
    _ = writeln!(
        out,
        "<path class=\"{class}\" d=\"M{x:.1} {middle:.1}L{near:.1} {top:.1}H{far:.1}L{end:.1} {middle:.1}L{far:.1} {bottom:.1}H{near:.1}Z\"><title>{}</title></path>",
        escape_markup(text)
    );
    let room = ((wide - 2.0 * tip) / CHARACTER).floor() as usize;
    let length = text.chars().count();
    let shown: String = match text {
        _ if length <= room => text.to_owned(),
        _ if room >= 4 => text.chars().take(room - 1).chain(['…']).collect(),
        _ => return,
    };
    let ink = if class == "odd" { "unknown" } else { "value" };
    let (x, y) = ((x + end) / 2.0, bottom - 5.0);
    _ = writeln!(
        out,
        "<text class=\"{ink}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{}</text>",
        escape_markup(&shown)
    );
}
