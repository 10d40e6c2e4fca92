//! The table of `info breakpoints` and `info watchpoints`, and the location of a breakpoint, in the layout of
//! gdb.

use emu_debug::debug::{AccessKind, DebugPoint, PointTrigger};

use super::points::numbers;
use super::shell::{CommandResult, DebugShell};

/// Minimum width of the column of types.
const TYPE_WIDTH: usize = 14;

/// `info breakpoints` and `info watchpoints`: lists all points, or those with given numbers.
pub(super) fn list(shell: &DebugShell, args: &str, watched: bool, out: &mut String) -> CommandResult {
    let wanted = if args.is_empty() { None } else { Some(numbers(shell, args)?) };
    let points = shell.session.points.all().iter();
    let points = points.filter(|point| wanted.as_ref().is_none_or(|ids| ids.contains(&point.id)));
    let points: Vec<&DebugPoint> =
        points.filter(|point| !watched || !matches!(point.trigger, PointTrigger::Code(_))).collect();
    if points.is_empty() {
        out.push_str(if watched { "No watchpoints.\n" } else { "No breakpoints or watchpoints.\n" });
        return Ok(());
    }
    let width = points.iter().map(|point| type_name(point).len()).fold(TYPE_WIDTH, usize::max);
    out.push_str(&format!("{:<7} {:<width$} Disp Enb Address    What\n", "Num", "Type"));
    points.into_iter().for_each(|point| describe(shell, point, width, out));
    Ok(())
}

fn type_name(point: &DebugPoint) -> &'static str {
    match &point.trigger {
        PointTrigger::Code(_) => "breakpoint",
        PointTrigger::Access(_, AccessKind::Read) => "read watchpoint",
        PointTrigger::Access(..) => "acc watchpoint",
        PointTrigger::Change(_) => "hw watchpoint",
        PointTrigger::Pin(..) => "watchpoint",
    }
}

/// Prints the row of a point, its condition and counts, and its commands.
fn describe(shell: &DebugShell, point: &DebugPoint, width: usize, out: &mut String) {
    let (temporary, left) = (point.temporary, point.stops_left.unwrap_or(0));
    let disposition = match (temporary, left) {
        (true, _) => "del",
        (false, 1..) => "dis",
        _ => "keep",
    };
    let enabled = if point.enabled { "y" } else { "n" };
    let head = format!("{:<7} {:<width$} {disposition:<4} {enabled:<3} ", point.id, type_name(point));
    match &point.trigger {
        PointTrigger::Code(words) => match words.as_slice() {
            [word] => out.push_str(&format!("{head}{}\n", shell.row_of_word(*word))),
            words => {
                out.push_str(&format!("{head}<MULTIPLE>\n"));
                for (n, word) in (1..).zip(words) {
                    let number = format!("{}.{n}", point.id);
                    let row = shell.row_of_word(*word);
                    out.push_str(&format!("{number:<7} {:<width$} {:<4} {enabled:<3} {row}\n", "", ""));
                }
            }
        },
        _ => out.push_str(&format!("{head}{:<10} {}\n", "", point.text)),
    }
    let times = if point.hits == 1 { "time" } else { "times" };
    let more = if point.ignore > 0 { "additional" } else { "next" };
    let details = [
        (point.condition.is_some(), format!("\tstop only if {}\n", point.condition_text)),
        (point.hits > 0, format!("\tbreakpoint already hit {} {times}\n", point.hits)),
        (point.ignore > 0, format!("\tignore next {} hits\n", point.ignore)),
        (left > 1, format!("        disable after {more} {left} hits\n")),
    ];
    details.iter().filter(|(shown, _)| *shown).for_each(|(_, text)| out.push_str(text));
    point.commands.iter().for_each(|command| out.push_str(&format!("        {command}\n")));
}

impl DebugShell {
    /// Returns the address and meaning of a program word: `0x00000228 in turn at pump.c:11`.
    fn row_of_word(&self, word: u32) -> String {
        let scope = &self.session.scope;
        let address = scope.chip().code_address(word);
        let byte = word.saturating_mul(scope.chip().word_bytes);
        let source = scope.source();
        let meant = match (scope.calls().info.function_at(byte), source.line_at(word)) {
            (Some(function), Some(line)) if self.view.is_none() => {
                let inlined = scope.calls().inlined(byte);
                let name = inlined.first().and_then(|block| block.inlined.as_ref()).unwrap_or(&function.name);
                format!("in {name} at {}:{}", line.file, line.line)
            }
            _ => {
                let place = self.word_with_rung(word);
                let meant = place.split_once(' ').map_or("", |(_, meant)| meant);
                meant.strip_prefix('(').and_then(|meant| meant.strip_suffix(')')).unwrap_or(meant).to_owned()
            }
        };
        format!("0x{address:08x} {meant}").trim_end().to_owned()
    }

    /// Returns the location of a new breakpoint: `0x228: file pump.c, line 11.`; `places` if the program has
    /// no functions with lines.
    pub(super) fn places_of_point(&self, id: u32, places: &[String]) -> String {
        let scope = &self.session.scope;
        let Some((PointTrigger::Code(words), text)) =
            self.session.points.get(id).map(|point| (&point.trigger, &point.text))
        else {
            return places.join(", ");
        };
        let is_known = |word: &u32| scope.calls().info.function_at(word * scope.chip().word_bytes).is_some();
        let first = words.first().filter(|word| is_known(word) && self.view.is_none());
        let source = scope.source();
        match first.and_then(|word| Some((word, source.line_at(*word)?))) {
            None => places.join(", "),
            Some((word, line)) => {
                let address = scope.chip().code_address(*word);
                match words.len() {
                    1 => format!("0x{address:x}: file {}, line {}.", line.file, line.line),
                    count => format!("0x{address:x}: {text}. ({count} locations)"),
                }
            }
        }
    }
}
