//! `display`, `undisplay`, and the expressions that every stop shows.

use emu_debug::debug::DebugExpression;

use super::command_error::CommandError;
use super::numbers::ExamineFormat;
use super::shell::{CommandResult, DebugShell};

/// An expression that every stop shows.
pub struct DisplayedExpression {
    id: u32,
    text: String,
    /// The format as it was written, such as `/x`; empty if there is none.
    written: String,
    format: ExamineFormat,
    enabled: bool,
    /// `None` for memory that is printed as by `x`.
    expr: Option<DebugExpression>,
}

impl DebugShell {
    /// Prints the expressions that every stop shows.
    pub(super) fn show_displays(&mut self, out: &mut String) {
        for display in self.displays.iter().filter(|display| display.enabled) {
            match &display.expr {
                Some(_) => {
                    let Some(expr) = self.displayed_expression(display) else { continue };
                    let value = self.value_text(&expr, display.format);
                    out.push_str(&format!("{}: {}{} = {value}\n", display.id, display.written, display.text));
                }
                None => {
                    out.push_str(&format!("{}: x{}{}\n", display.id, display.written, display.text));
                    let lines = self.examine_start(&display.text, display.format).and_then(|at| self.examine_lines(at));
                    out.push_str(&lines.map_or_else(|why| format!("{why}\n"), |(text, _)| text));
                }
            }
        }
    }

    /// Returns the expression of a display in the selected call, as gdb evaluates it. Returns `None` if the
    /// block that the expression was written in is not that of the selected call.
    fn displayed_expression(&self, display: &DisplayedExpression) -> Option<DebugExpression> {
        let written = display.expr.as_ref()?;
        if !written.is_local() {
            return Some(written.clone());
        }
        let here = self.parse_expression(&display.text).ok()?;
        (here.is_in_scope_of(written) && here.is_known(self.session.machine())).then_some(here)
    }

    /// `info display`: lists the displays.
    pub(super) fn list_displays(&self, out: &mut String) {
        if self.displays.is_empty() {
            out.push_str("There are no auto-display expressions now.\n");
            return;
        }
        out.push_str("Auto-display expressions now in effect:\nNum Enb Expression\n");
        for display in &self.displays {
            let lost = display.expr.is_some() && self.displayed_expression(display).is_none();
            let lost = if lost { "\n(cannot be evaluated in the current context)" } else { "" };
            let on = if display.enabled { 'y' } else { 'n' };
            out.push_str(&format!("{}:   {on}  {}{}{lost}\n", display.id, display.written, display.text));
        }
    }
}

/// Parses numbers of displays, `1 2` or `1-3`; without numbers all displays.
fn display_numbers(shell: &DebugShell, args: &str) -> Result<Vec<u32>, CommandError> {
    let all = shell.displays.iter().map(|display| display.id);
    if args.is_empty() {
        return Ok(all.collect());
    }
    let mut found = Vec::new();
    for word in args.split_whitespace() {
        let (first, last) = word.split_once('-').unwrap_or((word, word));
        let range = first.parse().ok().zip(last.parse().ok()).map(|(first, last): (u32, u32)| first..=last);
        let own: Vec<u32> = all.clone().filter(|id| range.as_ref().is_some_and(|range| range.contains(id))).collect();
        if own.is_empty() {
            return Err(format!("there is no display {word}; `info display` lists them").into());
        }
        found.extend(own);
    }
    Ok(found)
}

/// `enable display` and `disable display`.
pub(super) fn enable_displays(shell: &mut DebugShell, args: &str, on: bool) -> CommandResult {
    let ids = display_numbers(shell, args)?;
    shell.displays.iter_mut().filter(|display| ids.contains(&display.id)).for_each(|display| display.enabled = on);
    Ok(())
}

/// `display`: shows an expression at every stop.
pub(super) fn display(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let (format, text) = ExamineFormat::parse_front(args)?;
    if text.is_empty() {
        shell.show_displays(out);
        return Ok(());
    }
    let examined = format.letter == Some('i') || format.letter == Some('s') || format.count.is_some();
    let expr = if examined {
        shell.examine_start(text, format)?;
        None
    } else {
        Some(shell.parse_expression(text)?)
    };
    shell.last_display += 1;
    let id = shell.last_display;
    let written = match args.strip_suffix(text).map(str::trim) {
        Some(format) if !format.is_empty() => format!("{format} "),
        _ => String::new(),
    };
    shell.displays.push(DisplayedExpression { id, text: text.to_owned(), written, format, enabled: true, expr });
    let shown = shell.displays.split_off(shell.displays.len() - 1);
    let others = std::mem::replace(&mut shell.displays, shown);
    shell.show_displays(out);
    let shown = std::mem::replace(&mut shell.displays, others);
    shell.displays.extend(shown);
    Ok(())
}

/// `undisplay`: removes expressions that stops show.
pub(super) fn undisplay(shell: &mut DebugShell, args: &str, _: &mut String) -> CommandResult {
    let ids = display_numbers(shell, args)?;
    shell.displays.retain(|display| !ids.contains(&display.id));
    Ok(())
}
