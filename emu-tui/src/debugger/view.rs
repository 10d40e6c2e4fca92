//! Draws the debugger screen.
//!
//! ```text
//!   | title, time, run state           |
//!   | code             | registers     |     On a narrow screen registers and pins
//!   | rung, memory ..  | pins          |     are below the code.
//!   | waveforms                        |
//!   | output of the last command       |
//!   | keys                             |
//! ```

use ratatui_core::buffer::Buffer;
use ratatui_core::layout::Rect;

use super::panes;
use super::update::SCALES;
use super::{
    AutoRun, CodeLine, DebuggedMachine, DebuggerScreen, DebuggerSnapshot, LowerPane, MemoryExcerpt, NamedValue,
    PinTrace, ScreenQuery,
};
use crate::ScreenStyle;
use crate::rung_picture::{GlyphInk, PictureGlyph};
use crate::style::{KeyLabel, PaneArea, key_label, truncate_text};

/// Minimum size (columns, lines) of a useful screen.
const MIN_SIZE: (u16, u16) = (40, 12);

/// Minimum width at which registers are drawn next to the code.
const WIDE_FROM: u16 = 72;

/// Maximum number of lines for the output of commands.
const MESSAGE_LINES: u16 = 5;

/// The keys of the footer, in order of importance.
#[rustfmt::skip]
const KEYS: [KeyLabel; 12] = [
    key_label("s", "step"), key_label("n", "next"), key_label("S", "scan"), key_label("e", "element"), key_label("c", "continue"), key_label("space", "run"), key_label("b", "break"), key_label("u", "back"),
    key_label(":", "command"), key_label("?", "help"), key_label("q", "quit"), key_label("r", "rev-cont"),
];

/// Keys that are only useful with a ladder program.
const LADDER_KEYS: [&str; 2] = ["S", "e"];

const HELP: &str = "\
s      one instruction, or line  u   one instruction, or line, back
i      one instruction           o   one instruction back
n N    next line, instruction    U   next line back
f      finish this subroutine    r   back to the last hit of a point
S g e  next scan, rung, element  R   reset
c      continue, freely          p, space, esc, ctrl-c  pause
space  run as the clock goes     + -  faster, slower
up, down, home                   the cursor in the code
b      breakpoint at the cursor, or none
enter  run to the cursor
tab    rung, memory, serial ..   m   next memory
v      source or instructions
[ ]    scroll memory, page keys  z Z waveform: longer, shorter
:      any command of the debugger, such as watch PB5
ctrl-z to the shell              q   quit
";

/// The areas of the panes.
struct PaneAreas {
    code: Rect,
    lower: Rect,
    registers: Rect,
    pins: Rect,
    wave: Rect,
    message: Rect,
    keys: Rect,
}

fn pane_areas(area: Rect, sight: &DebuggerSnapshot) -> PaneAreas {
    let bottom = area.y + area.height;
    let keys = Rect { y: bottom - 1, height: 1, ..area };
    let message_height = MESSAGE_LINES.min(area.height / 8).max(1);
    let message_area = Rect { y: keys.y - message_height, height: message_height, ..area };
    let wanted = u16::try_from(sight.traces.len()).unwrap_or(u16::MAX).saturating_add(1);
    let wave_height = if sight.traces.is_empty() { 0 } else { wanted.min(area.height / 5) };
    let wave = Rect { y: message_area.y - wave_height, height: wave_height, ..area };
    let middle = Rect { y: area.y + 1, height: wave.y - area.y - 1, ..area };
    let (left, right) = if area.width >= WIDE_FROM {
        let right = (area.width * 2 / 5).clamp(28, 42);
        let left = Rect { width: area.width - right - 3, ..middle };
        (left, Rect { x: area.x + area.width - right, width: right, ..middle })
    } else {
        let height = middle.height / 3;
        let left = Rect { height: middle.height - height, ..middle };
        (left, Rect { y: left.y + left.height, height, ..middle })
    };
    let code_height = (left.height / 2).max(left.height.min(6));
    let code = Rect { height: code_height, ..left };
    let lower = Rect { y: left.y + code_height, height: left.height - code_height, ..left };
    let rows = u16::try_from(grid_rows(&sight.registers, right.width)).unwrap_or(u16::MAX).saturating_add(1);
    let pins = u16::try_from(grid_rows(&sight.pins, right.width)).unwrap_or(u16::MAX).saturating_add(1);
    // Pins are cut first, because a pin that changes is also in the waveforms.
    let rows = rows.min(right.height.saturating_sub(pins.min(3)));
    let registers = Rect { height: rows, ..right };
    let pins = Rect { y: right.y + rows, height: right.height - rows, ..right };
    PaneAreas { code, lower, registers, pins, wave, message: message_area, keys }
}

/// Bytes of memory per row.
pub(super) fn row_bytes(area: Rect) -> u32 {
    let left = if area.width >= WIDE_FROM { area.width - (area.width * 2 / 5).clamp(28, 42) - 3 } else { area.width };
    if left >= 74 { 16 } else { 8 }
}

/// Draws the whole screen.
pub(super) fn view<M: DebuggedMachine>(screen: &DebuggerScreen<M>, area: Rect, look: ScreenStyle) -> Buffer {
    let mut picture = Buffer::empty(area);
    if area.width < MIN_SIZE.0 || area.height < MIN_SIZE.1 {
        let text = format!("needs {}x{}", MIN_SIZE.0, MIN_SIZE.1);
        PaneArea::new(&mut picture, area).put(0, 0, &text, look.text());
        return picture;
    }
    let scale = SCALES.get(screen.zoom).copied().unwrap_or(1);
    let bytes = row_bytes(area);
    let left = if area.width >= WIDE_FROM { area.width - (area.width * 2 / 5).clamp(28, 42) - 3 } else { area.width };
    let below = screen.lower();
    let wants = |since| ScreenQuery {
        around: screen.cursor,
        lines: usize::from(area.height),
        rung: if below == LowerPane::Rung { usize::from(left) - 1 } else { 0 },
        line: screen.line,
        source: if screen.source { usize::from(area.height) } else { 0 },
        serial: below == LowerPane::Serial,
        memory: match below {
            LowerPane::Memory => (screen.memory.0, screen.memory.1, usize::from(area.height) * bytes as usize),
            _ => (0, 0, 0),
        },
        since,
    };
    let cycle = screen.machine.debugger_snapshot(&ScreenQuery { since: u64::MAX, ..ScreenQuery::default() }).cycle;
    let sight = screen.machine.debugger_snapshot(&wants(cycle.saturating_sub(scale.saturating_mul(area.width.into()))));
    let places = pane_areas(area, &sight);
    draw_title(screen, &sight, &mut PaneArea::new(&mut picture, area), look);
    match &sight.source {
        Some(source) => {
            panes::draw_source(source, screen.line.is_some(), &mut PaneArea::new(&mut picture, places.code), look)
        }
        None => draw_code(screen, &sight, &mut PaneArea::new(&mut picture, places.code), look),
    }
    draw_lower(below, &sight, bytes as usize, &mut PaneArea::new(&mut picture, places.lower), look);
    if area.width >= WIDE_FROM {
        let right = Rect { height: places.registers.height + places.pins.height, ..places.registers };
        let mut rule = PaneArea::new(&mut picture, Rect { x: right.x - 2, width: 1, ..right });
        (0..right.height).for_each(|y| _ = rule.put(0, y, "│", look.faint()));
    }
    draw_values("Registers", &sight.registers, &mut PaneArea::new(&mut picture, places.registers), look);
    draw_values("Pins", &sight.pins, &mut PaneArea::new(&mut picture, places.pins), look);
    draw_wave(&sight, scale, &mut PaneArea::new(&mut picture, places.wave), look);
    draw_message(screen, &mut PaneArea::new(&mut picture, places.message), look);
    draw_footer(screen, &sight, &mut PaneArea::new(&mut picture, places.keys), look);
    if screen.help {
        crate::style::draw_help(&mut picture, area, HELP, look);
    }
    picture
}

fn draw_title<M>(screen: &DebuggerScreen<M>, sight: &DebuggerSnapshot, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let width = paper.area.width;
    paper.put(0, 0, &" ".repeat(usize::from(width)), look.bar());
    let pace = match screen.run {
        None => "▪ stopped".to_owned(),
        Some(AutoRun::Free) => "▶ running".to_owned(),
        Some(AutoRun::Clock) => format!("▶ clock x{}", screen.speed),
    };
    let right = format!("{}   {pace} ", sight.time);
    let room = usize::from(width).saturating_sub(right.chars().count() + 2);
    paper.put(1, 0, &truncate_text(&sight.title, room), look.bar());
    paper.put_right(width, 0, &right, look.bar());
}

/// Draws the code with the cursor in the middle if there are enough lines on both sides.
fn draw_code<M>(screen: &DebuggerScreen<M>, sight: &DebuggerSnapshot, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    paper.put_heading(0, "Code", look);
    let cursor = screen.cursor.unwrap_or(sight.pc);
    let mut rows: Vec<(Option<&CodeLine>, &str)> = Vec::new();
    let mut at = 0;
    for line in &sight.code {
        rows.extend(line.source.as_deref().map(|text| (None, text)));
        rows.extend(line.label.as_deref().map(|text| (None, text)));
        if line.word == cursor {
            at = rows.len();
        }
        rows.push((Some(line), ""));
    }
    let height = usize::from(paper.area.height.saturating_sub(1));
    let first = at.saturating_sub(height / 2).min(rows.len().saturating_sub(height));
    let texts = rows.iter().filter_map(|(line, _)| line.map(|line| line.text.chars().count()));
    let widest = texts.max().unwrap_or(0).min(30);
    for (y, (line, text)) in (1..paper.area.height).zip(rows.iter().skip(first)) {
        let Some(line) = line else {
            paper.put(2, y, text, look.comment());
            continue;
        };
        let (next, marked) = (line.word == sight.pc, line.word == cursor);
        paper.put(0, y, if line.breakpoint.is_some() { "●" } else { " " }, look.wrong());
        paper.put(
            1,
            y,
            if next {
                "▶"
            } else if marked {
                ">"
            } else {
                " "
            },
            look.live(),
        );
        let style = if next { look.live() } else { look.text() };
        let x = paper.put(3, y, line.address.trim_start_matches("0x"), look.faint());
        paper.put(x + 2, y, &line.text, style);
        if !line.operand_meaning.is_empty() {
            let column = x + 2 + u16::try_from(widest + 2).unwrap_or(0);
            paper.put(column, y, &format!("; {}", line.operand_meaning), look.comment());
        }
        if marked && screen.cursor.is_some() {
            paper.style_line(y, look.bar());
        }
    }
}

fn draw_lower(below: LowerPane, sight: &DebuggerSnapshot, bytes: usize, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    match below {
        LowerPane::Serial => panes::draw_serial(&sight.serial, paper, look),
        LowerPane::Rung => {
            paper.put_heading(0, "Rung", look);
            let used = draw_rung(sight.rung.as_deref().unwrap_or(&[]), paper, look);
            // The remaining space shows the symbols.
            let Rect { y, height, .. } = paper.area;
            if used + 2 < height && !sight.symbols.is_empty() {
                paper.area = Rect { y: y + used, height: height - used, ..paper.area };
                draw_values("Symbols", &sight.symbols, paper, look);
            }
        }
        LowerPane::Symbols => draw_values("Symbols", &sight.symbols, paper, look),
        LowerPane::Memory => draw_memory(sight.memory.as_ref(), bytes, paper, look),
    }
}

/// Draws a rung, or the part around the marked element if the rung is higher than the pane. Returns the
/// number of rows used, with the heading.
fn draw_rung(lines: &[Vec<PictureGlyph>], paper: &mut PaneArea<'_>, look: ScreenStyle) -> u16 {
    if lines.is_empty() {
        paper.put(1, 1, "the program is in no rung here", look.faint());
    }
    let height = usize::from(paper.area.height.saturating_sub(1));
    let marked = lines.iter().rposition(|line| line.iter().any(|sign| sign.marked)).unwrap_or(0);
    let first = (marked + 2).saturating_sub(height).min(lines.len().saturating_sub(height));
    for (y, line) in (1..paper.area.height).zip(lines.iter().skip(first)) {
        // The first column is for the marker.
        let mut x = 1;
        for sign in line {
            let style = match sign.ink {
                GlyphInk::Power(power) => look.on(power),
                GlyphInk::Name(true) => look.live(),
                GlyphInk::Name(false) => look.text(),
                GlyphInk::Comment => look.comment(),
                GlyphInk::Number => look.faint(),
            };
            let style = if sign.marked && sign.glyph != ' ' { style.patch(look.bar()) } else { style };
            x = paper.put(x, y, sign.glyph.encode_utf8(&mut [0; 4]), style);
        }
        // A sign in the first column marks the element even without colours.
        if line.iter().any(|sign| sign.marked && matches!(sign.ink, GlyphInk::Power(_))) {
            paper.put(0, y, "▶", look.change());
        }
    }
    u16::try_from(lines.len().max(1) + 1).unwrap_or(u16::MAX).min(paper.area.height)
}

fn draw_memory(memory: Option<&MemoryExcerpt>, row: usize, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let Some(memory) = memory else {
        paper.put_heading(0, "Memory", look);
        return;
    };
    paper.put_heading(0, &format!("Memory {}", memory.name), look);
    for (y, (n, line)) in (1..paper.area.height).zip(memory.bytes.chunks(row.max(1)).enumerate()) {
        if line.iter().all(|(byte, _)| byte.is_none()) {
            break;
        }
        let address = memory.address.saturating_add(u32::try_from(n * row).unwrap_or(u32::MAX));
        let mut x = paper.put(0, y, &format!("{address:04x}"), look.faint()) + 1;
        for (byte, changed) in line {
            let text = byte.map_or("  ".to_owned(), |byte| format!("{byte:02x}"));
            let style = if *changed { look.change() } else { look.text() };
            x = paper.put(x, y, if *changed { "*" } else { " " }, style);
            x = paper.put(x, y, &text, style);
        }
        let letter = |byte: Option<u8>| byte.filter(|b| b.is_ascii_graphic()).map_or('·', char::from);
        let text: String = line.iter().map(|(byte, _)| letter(*byte)).collect();
        paper.put(x + 2, y, &text, look.faint());
    }
}

/// Columns of the longest value: name, space or star, text, and a space after it.
fn widest_value(values: &[NamedValue]) -> usize {
    values.iter().map(|value| value.name.chars().count() + value.text.chars().count() + 2).max().unwrap_or(2)
}

/// Number of rows of the values in a grid.
fn grid_rows(values: &[NamedValue], width: u16) -> usize {
    values.len().div_ceil((usize::from(width) / widest_value(values)).max(1))
}

/// Draws values in a grid; a star marks a value that has changed.
fn draw_values(name: &str, values: &[NamedValue], paper: &mut PaneArea<'_>, look: ScreenStyle) {
    if paper.area.height == 0 {
        return;
    }
    paper.put_heading(0, name, look);
    let each = widest_value(values);
    let columns = (usize::from(paper.area.width) / each).max(1);
    let rows = values.len().div_ceil(columns).max(1);
    let hidden = rows.saturating_sub(usize::from(paper.area.height) - 1);
    for (at, value) in values.iter().enumerate() {
        // Column by column, like a list.
        let (column, row) = (at / rows, at % rows);
        let x = u16::try_from(column * each).unwrap_or(u16::MAX);
        let y = u16::try_from(row + 1).unwrap_or(u16::MAX);
        let style = if value.changed { look.change() } else { look.text() };
        let end = paper.put(x, y, &value.name, look.faint());
        let end = paper.put(end, y, if value.changed { "*" } else { " " }, style);
        paper.put(end, y, &value.text, style);
    }
    if hidden > 0 {
        paper.put_right(paper.area.width, 0, &format!(" {hidden} more below"), look.faint());
    }
}

/// Draws the waveforms of the pins; the current time is at the right.
fn draw_wave(sight: &DebuggerSnapshot, scale: u64, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    if paper.area.height == 0 {
        return;
    }
    paper.put_heading(0, &format!("Pins over time, {scale} cycle{} a column", if scale == 1 { "" } else { "s" }), look);
    let widest = sight.traces.iter().map(|trace| trace.name.chars().count()).max().unwrap_or(0);
    let columns = usize::from(paper.area.width).saturating_sub(widest + 2);
    for (y, trace) in (1..paper.area.height).zip(&sight.traces) {
        let edge = u16::try_from(widest).unwrap_or(0);
        paper.put_right(edge, y, &trace.name, look.on(trace.high));
        let mut x = edge + 2;
        for (low, high) in levels_by_column(trace, sight.cycle, scale, columns) {
            let (sign, style) = match (low, high) {
                (true, true) => ("▒", look.live()),
                (false, true) => ("▔", look.live()),
                _ => ("▁", look.dead()),
            };
            x = paper.put(x, y, sign, style);
        }
    }
}

/// For each column, (whether the pin was low in it, whether it was high). Columns begin at multiples of the
/// scale, so that the picture does not flicker; columns before power-up are left out.
fn levels_by_column(trace: &PinTrace, now: u64, scale: u64, columns: usize) -> Vec<(bool, bool)> {
    let last = now / scale;
    let first = (last + 1).saturating_sub(columns as u64);
    let mut edges = trace.edges.iter().peekable();
    // Before its first edge, a pin had the opposite level.
    let mut level = trace.edges.first().map_or(trace.high, |(_, to)| !to);
    while let Some((_, to)) = edges.next_if(|(at, _)| *at < first * scale) {
        level = *to;
    }
    let column = |column: u64| {
        let (mut low, mut high) = (!level, level);
        while let Some((at, to)) = edges.next_if(|(at, _)| *at < (column + 1).saturating_mul(scale)) {
            if *at == column * scale {
                (low, high) = (false, false);
            }
            level = *to;
            (low, high) = (low | !level, high | level);
        }
        (low, high)
    };
    (first..=last).map(column).collect()
}

fn draw_message<M>(screen: &DebuggerScreen<M>, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    let (text, failed) = &screen.last_message;
    let lines: Vec<&str> = text.lines().collect();
    let height = usize::from(paper.area.height);
    let first = lines.len().saturating_sub(height);
    for (y, line) in (0..paper.area.height).zip(lines.iter().skip(first)) {
        paper.put(0, y, line, if *failed { look.wrong() } else { look.text() });
    }
    if first > 0 {
        paper.put_right(paper.area.width, 0, &format!(" {first} more above"), look.faint());
    }
}

fn draw_footer<M>(screen: &DebuggerScreen<M>, sight: &DebuggerSnapshot, paper: &mut PaneArea<'_>, look: ScreenStyle) {
    if let Some(line) = &screen.prompt {
        return crate::style::draw_prompt(paper, line, look);
    }
    let ladder = !sight.symbols.is_empty();
    let keys: Vec<_> = KEYS.into_iter().filter(|label| ladder || !LADDER_KEYS.contains(&label.key)).collect();
    crate::style::draw_keys(paper, &keys, look);
}
