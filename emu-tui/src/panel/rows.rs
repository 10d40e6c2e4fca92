//! The parts of the panel as lines of text: switches, lamps, relays, analog inputs, timers, counters,
//! integers, peripherals.

use ladder::SymbolKind;
use ladder_eval::PwmChannel;
use ratatui_core::style::Style;

use super::LadderPanel;
use super::parts::PartRow as Figures;
use super::update::SWITCH_KEYS;
use crate::ScreenStyle;
use crate::style::truncate_text;

/// A line of the panel.
pub(super) enum PanelRow {
    /// The heading of a part.
    Head(String),
    /// Styled texts side by side.
    Line(Vec<(String, Style)>),
}

/// Maximum number of characters of a name; longer names are truncated.
const MAX_NAME: usize = 16;

/// All lines of the panel for a width.
pub(super) fn rows(panel: &LadderPanel, width: u16, look: ScreenStyle) -> Vec<PanelRow> {
    let width = usize::from(width);
    let mut rows = Vec::new();
    let mut part = |name: &str, lines: Vec<PanelRow>| {
        if !lines.is_empty() {
            rows.push(PanelRow::Head(name.to_owned()));
            rows.extend(lines);
        }
    };
    part("Inputs", grid(switches(panel, look), width));
    part("Analog inputs", analog(panel, width, look));
    part("Outputs", grid(lamps(panel, SymbolKind::Output, ["○", "●"], look.lamp(), look), width));
    part("Relays", grid(lamps(panel, SymbolKind::Relay, ["□", "■"], look.live(), look), width));
    part(&timers_head(width), timers(panel, width, look));
    part("Numbers", grid(numbers(panel, look), width));
    part("Serial line", serial(panel, width, look));
    part("Pulse width", duty(panel, width, look));
    part("EEPROM", eeprom(panel, width, look));
    rows
}

type StyledSpans = Vec<(String, Style)>;

fn length(spans: &StyledSpans) -> usize {
    spans.iter().map(|(text, _)| text.chars().count()).sum()
}

/// Arranges items in as many columns as fit, column by column like a list.
fn grid(items: Vec<StyledSpans>, width: usize) -> Vec<PanelRow> {
    let widest = items.iter().map(length).max().unwrap_or(0) + 2;
    let columns = ((width + 2) / widest.max(1)).clamp(1, items.len().max(1));
    let lines = items.len().div_ceil(columns);
    let line = |line: usize| {
        let mut spans = StyledSpans::new();
        for item in items.iter().skip(line).step_by(lines.max(1)) {
            spans.extend(item.iter().cloned());
            spans.push((" ".repeat(widest.saturating_sub(length(item))), Style::new()));
        }
        PanelRow::Line(spans)
    };
    (0..lines).map(line).collect()
}

fn switches(panel: &LadderPanel, look: ScreenStyle) -> Vec<StyledSpans> {
    let machine = &panel.machine;
    let mut keys = SWITCH_KEYS.chars();
    let switch = |symbol: usize| {
        let on = machine.get(symbol) != 0;
        let picture = match (on, machine.is_pulsed(symbol)) {
            (true, false) => "──●",
            (false, false) => "○──",
            (true, true) => "─>●",
            (false, true) => "○<─",
        };
        let key = keys.next().map_or(" ".to_owned(), String::from);
        vec![
            (key, look.key()),
            (format!(" {picture} "), look.on(on)),
            (name(panel, symbol), if on { look.live() } else { look.text() }),
        ]
    };
    panel.inputs().map(switch).collect()
}

fn name(panel: &LadderPanel, symbol: usize) -> String {
    truncate_text(panel.machine.symbols().get(symbol).map_or("", |s| s.name.as_str()), MAX_NAME)
}

fn lamps(panel: &LadderPanel, kind: SymbolKind, signs: [&str; 2], lit: Style, look: ScreenStyle) -> Vec<StyledSpans> {
    let machine = &panel.machine;
    let lamp = |symbol: usize| {
        let on = machine.get(symbol) != 0;
        let [off_sign, on_sign] = signs;
        let (sign, style) = if on { (on_sign, lit) } else { (off_sign, look.dead()) };
        vec![(format!("{sign} "), style), (name(panel, symbol), if on { lit } else { look.text() })]
    };
    machine.symbols_of(|k| k == kind).map(lamp).collect()
}

fn analog(panel: &LadderPanel, width: usize, look: ScreenStyle) -> Vec<PanelRow> {
    let count = panel.machine.levels().count().max(1);
    let widest = panel.machine.levels().map(|(symbol, _)| name(panel, symbol).chars().count()).max().unwrap_or(0);
    let row = |(at, (symbol, level)): (usize, (usize, u16))| {
        let chosen = at == panel.analog % count;
        let bar = width.saturating_sub(widest + 8);
        PanelRow::Line(vec![
            (if chosen { "▸ " } else { "  " }.to_owned(), look.key()),
            (format!("{:<widest$} ", name(panel, symbol)), look.text()),
            (format!("{level:>4} "), look.live()),
            (self::bar(usize::from(level) * 1000 / 1023, bar), look.live()),
        ])
    };
    panel.machine.levels().enumerate().map(row).collect()
}

/// A bar filled to `thousandths` thousandths of its width.
fn bar(thousandths: usize, width: usize) -> String {
    let full = (thousandths * width + 500) / 1000;
    "█".repeat(full.min(width)) + &"░".repeat(width.saturating_sub(full))
}

const DONE: &str = "DN";

fn timers_head(width: usize) -> String {
    let name = if width >= 44 { "Timers, counters: preset, now" } else { "Timers: preset, now" };
    let fill = width.saturating_sub(name.chars().count() + DONE.len() + 2);
    format!("{name} {} {DONE}", "─".repeat(fill))
}

fn timers(panel: &LadderPanel, width: usize, look: ScreenStyle) -> Vec<PanelRow> {
    let rows: Vec<(&super::parts::CountingPart, Figures)> =
        panel.parts.iter().map(|p| (p, p.row(&panel.machine))).collect();
    let most =
        |length: &dyn Fn(&(&super::parts::CountingPart, Figures)) -> usize| rows.iter().map(length).max().unwrap_or(0);
    let names = most(&|(part, _)| part.name.chars().count()).min(12);
    let presets = most(&|(_, row)| row.preset.chars().count());
    // The column is as wide as the preset, so that it does not change while the program counts.
    let counts = most(&|(_, row)| row.accumulator.chars().count()).max(presets).max(6);
    let bar_width = width.saturating_sub(4 + names + 1 + presets + 1 + counts + 1 + 2);
    let line = |(part, row): &(&super::parts::CountingPart, Figures)| {
        let bar = if bar_width >= 3 { self::bar(row.thousandths, bar_width) } else { " ".repeat(bar_width) };
        PanelRow::Line(vec![
            (format!("{} ", part.word), look.faint()),
            (
                format!("{:<names$} ", truncate_text(&part.name, names)),
                if row.done { look.live() } else { look.text() },
            ),
            (format!("{:>presets$} ", row.preset), look.text()),
            (format!("{:>counts$} ", row.accumulator), look.change()),
            (bar, look.on(row.thousandths > 0)),
            (format!(" {}", if row.done { "●" } else { "○" }), look.on(row.done)),
        ])
    };
    rows.iter().map(line).collect()
}

fn numbers(panel: &LadderPanel, look: ScreenStyle) -> Vec<StyledSpans> {
    let machine = &panel.machine;
    let of = machine.symbols_of(|k| matches!(k, SymbolKind::Variable | SymbolKind::Adc));
    let shown = |symbol: usize| {
        let value = machine.get(symbol);
        machine.symbols().get(symbol).map_or(value.into(), |symbol| symbol.shown_value(value))
    };
    of.map(|symbol| vec![(name(panel, symbol), look.text()), (format!(" {:>6}", shown(symbol)), look.change())])
        .collect()
}

/// The last sent bytes as text, and the state of the receiver.
fn serial(panel: &LadderPanel, width: usize, look: ScreenStyle) -> Vec<PanelRow> {
    let machine = &panel.machine;
    let mut rows = Vec::new();
    if machine.can_send() || !machine.sent().is_empty() {
        let text: String = machine.sent().iter().map(|byte| byte.escape_ascii().to_string()).collect();
        let room = width.saturating_sub(5);
        let count = text.chars().count();
        let shown = text.chars().skip(count.saturating_sub(room)).collect();
        rows.push(PanelRow::Line(vec![("sent ".to_owned(), look.faint()), (shown, look.change())]));
    }
    if machine.can_receive() || machine.incoming_bytes() > 0 {
        let waiting = if machine.evaluator().has_received_byte() { ", one waits" } else { "" };
        let text = format!("{} byte(s) to arrive{waiting}", machine.incoming_bytes());
        rows.push(PanelRow::Line(vec![("in   ".to_owned(), look.faint()), (text, look.text())]));
    }
    rows
}

fn duty(panel: &LadderPanel, width: usize, look: ScreenStyle) -> Vec<PanelRow> {
    let evaluator = panel.machine.evaluator();
    let outputs = evaluator.pwm_outputs();
    let line = |(output, duty): (&PwmChannel, &Option<u8>)| {
        let name =
            output.name.as_ref().filter(|_| outputs.len() > 1).map_or_else(String::new, |name| format!("{name} "));
        let text = name + &duty.map_or("  off".to_owned(), |duty| format!("{duty:>3} %"));
        let tail = format!(" at {} Hz ", output.hertz);
        let room = width.saturating_sub(text.chars().count() + tail.len());
        let bar = bar(usize::from(duty.unwrap_or(0)) * 10, room);
        PanelRow::Line(vec![(text, look.change()), (tail, look.text()), (bar, look.on(duty.is_some()))])
    };
    outputs.iter().zip(evaluator.pwm_duties()).map(line).collect()
}

fn eeprom(panel: &LadderPanel, width: usize, look: ScreenStyle) -> Vec<PanelRow> {
    let cells: Vec<String> = panel.machine.evaluator().eeprom().iter().map(|byte| format!("{byte:02X}")).collect();
    let each = (width / 3).max(1);
    cells.chunks(each).map(|line| PanelRow::Line(vec![(line.join(" "), look.text())])).collect()
}
