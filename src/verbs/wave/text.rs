//! Draws a waveform as lines of text.

use super::WaveDrawing;
use super::read::{SignalValue, WaveSignal};
use crate::shared::scan_bits::glyph;

/// Minimum distance between two labels of the axis, in columns.
const MIN_FIGURE_DISTANCE: u32 = 12;

/// Draws one line per signal. Bits are high, low, in the middle when floating, or hatched when they change
/// within a column. Values of several bits appear where they begin.
pub fn draw(drawing: &WaveDrawing<'_>, columns: u32) -> String {
    let name = |signal: &&WaveSignal| signal.drawn_name().chars().count();
    let width = drawing.signals.iter().map(name).max().unwrap_or(0).max(4);
    let span = drawing.to - drawing.from;
    let column = |at: u64| (u128::from(at - drawing.from) * u128::from(columns) / u128::from(span)) as usize;
    let mut axis = vec![' '; columns as usize];
    let figures = drawing.waves.scale.axis_figures(drawing.from, drawing.to, columns / MIN_FIGURE_DISTANCE);
    for (at, text) in figures {
        let at = column(at);
        if at + text.chars().count() <= axis.len() {
            axis.splice(at..at + text.chars().count(), text.chars());
        }
    }
    let axis: String = axis.into_iter().collect();
    let mut out = format!("{:>width$}  {}\n", "time", axis.trim_end());
    for signal in &drawing.signals {
        let line = line(signal, drawing, columns as usize, &column);
        out.push_str(&format!("{:>width$}  {}\n", signal.drawn_name(), line.trim_end()));
    }
    out
}

/// Returns the columns of a signal.
fn line(signal: &WaveSignal, drawing: &WaveDrawing<'_>, columns: usize, column: &dyn Fn(u64) -> usize) -> String {
    let mut line: Vec<char> = Vec::with_capacity(columns);
    let inside = |at: u64| at >= drawing.from && at < drawing.to;
    let first = signal.changes.partition_point(|(at, _)| *at < drawing.from);
    let mut last = first.checked_sub(1).and_then(|before| signal.changes.get(before)).map(|(_, value)| value);
    let mut rest = signal.changes.get(first..).unwrap_or_default().iter().take_while(|(at, _)| inside(*at)).peekable();
    // The part of the current value that is still to be written, in reverse order.
    let mut word: Vec<char> = Vec::new();
    let label = |value: &SignalValue| match value {
        SignalValue::Word(text) => std::iter::once('|').chain(text.chars()).rev().collect(),
        _ => Vec::new(),
    };
    word.extend(last.map(label).unwrap_or_default().into_iter().filter(|c| *c != '|'));
    for here in 0..columns {
        // The values of this column: the value at its start, unless a change is at its start, and the values
        // that follow.
        let mut values: Vec<&SignalValue> = last.filter(|value| **value != SignalValue::Event).into_iter().collect();
        let mut changed = 0;
        while let Some((_, value)) = rest.next_if(|(at, _)| column(*at) == here) {
            if changed == 0 {
                values.clear();
            }
            changed += 1;
            values.push(value);
            last = Some(value);
            word = label(value);
        }
        let levels = values.iter().all(|value| matches!(value, SignalValue::Low | SignalValue::High));
        let high = |value: &&SignalValue| **value == SignalValue::High;
        line.push(match values.as_slice() {
            [] if signal.event => ' ',
            [] => '?',
            [SignalValue::Event, ..] => '↑',
            [SignalValue::Word(_)] => word.pop().unwrap_or(' '),
            [SignalValue::Unknown] => 'x',
            [SignalValue::Floating] => '─',
            _ if levels => {
                glyph(values.iter().all(high), values.iter().any(|value| matches!(value, SignalValue::High)))
            }
            _ => {
                // Too short to be legible; the text of the last value continues in the next column.
                word.retain(|c| *c != '|');
                '▒'
            }
        });
    }
    line.into_iter().collect()
}
