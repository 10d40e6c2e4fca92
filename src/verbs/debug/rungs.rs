//! Commands about ladder programs: scans, rungs, elements, and the causes of values.

use std::collections::BTreeSet;

use emu_core::cpu::LAST_CYCLE;
use emu_debug::debug::{DebugSession, FileLine, RunGoal, SessionStopReason};
use ladder_view::{ElementStart, LadderView};

use super::command_error::CommandError;
use super::shell::{CommandResult, DebugShell};
use super::steps::repeat_steps;

impl DebugShell {
    /// Returns the ladder program, or an error if there is none.
    pub(super) fn ladder(&self) -> Result<&LadderView, CommandError> {
        self.view
            .as_ref()
            .ok_or_else(|| "this is not a ladder program with a map (PROGRAM.ld, or --map and --ladder)".into())
    }

    /// Returns the program words of `rung 3`, `rung 3.2` (an element) or `welder.ld:12`; `None` if the text
    /// has another form.
    pub(super) fn rung_location(&self, text: &str) -> Option<Result<Vec<u32>, CommandError>> {
        let view = self.view.as_ref()?;
        if let Some(rest) = text.strip_prefix("rung").filter(|rest| rest.starts_with(char::is_whitespace)) {
            return Some(of_rung(view, rest.trim()));
        }
        let (file, line) = text.rsplit_once(':')?;
        let own = view.program().file.rsplit('/').next().unwrap_or_default();
        let line: u32 = line.trim().parse().ok()?;
        if file.rsplit('/').next() != Some(own) {
            let other = ::ladder::is_program_name(file);
            return other.then(|| Err(format!("the program is {own}, and has no lines of {file}").into()));
        }
        Some(match view.rung_of_line(line) {
            Some(rung) => of_rung(view, &rung.to_string()),
            None => Err(no_rung_message(view, own, line).into()),
        })
    }

    /// Returns a program word as users see it, with its rung if it has one.
    pub(super) fn word_with_rung(&self, word: u32) -> String {
        let place = self.session.scope.source().describe_word(word);
        match self.view.as_ref().and_then(|view| view.rung_at(word)) {
            Some(rung) => format!("{place} in rung {rung}"),
            None => place,
        }
    }

    /// Returns the next rung and element as text: `rung 3.2 (welder.ld:22)`.
    pub(super) fn rung_and_element(&self) -> Option<String> {
        let view = self.view.as_ref()?;
        let word = view.current_word(self.session.machine());
        let rung = view.rung_at(word)?;
        let element = view.element_at(word).map_or(String::new(), |element| format!(".{}", element.index + 1));
        let file = view.program().file.rsplit('/').next().unwrap_or_default();
        let line = view.rung_line(rung).map_or(String::new(), |line| format!(" ({file}:{line})"));
        Some(format!("rung {rung}{element}{line}"))
    }

    /// Draws the next rung.
    pub(super) fn draw_current_rung(&self) -> Vec<String> {
        let (follow, target) = (self.session.follower(), self.session.machine());
        self.view.as_ref().map_or(Vec::new(), |view| view.draw(follow, target, self.color))
    }
}

/// Returns the message that there is no rung on a line.
fn no_rung_message(view: &LadderView, own: &str, line: u32) -> String {
    let (last, end) = (view.program().rungs.len() as u32, view.last_line());
    match (view.rung_line(1), view.rung_line(last)) {
        (Some(first), _) if line < first => {
            format!("line {line} of {own} is before the first rung, which begins on line {first}")
        }
        (_, Some(begins)) => {
            format!("{own} has no line {line}: the last rung, rung {last}, is on lines {begins} to {end}")
        }
        _ => format!("{own} has no rungs"),
    }
}

fn of_rung(view: &LadderView, text: &str) -> Result<Vec<u32>, CommandError> {
    let (rung, element) = text.split_once('.').map_or((text, None), |(rung, element)| (rung, Some(element)));
    let number =
        |text: &str| text.parse::<u32>().map_err(|_| format!("`{text}` is not the number of a rung: rung 3, rung 3.2"));
    let rung = number(rung)?;
    let word = match element {
        None => view.rung_starts().into_iter().find(|start| start.rung == rung).map(|found| found.word),
        Some(element) => {
            let element = number(element)?;
            let is_wanted = |start: &ElementStart| start.rung == rung && start.element == element;
            view.element_starts().into_iter().find(is_wanted).map(|found| found.word)
        }
    };
    word.map(|word| vec![word]).ok_or_else(|| {
        let rungs: Vec<String> = view.rung_starts().iter().map(|start| start.rung.to_string()).collect();
        format!("rung {text} has no code; rungs with code are {}", rungs.join(", ")).into()
    })
}

/// Runs to the next of some program words; a halted AP101 is stepped to its next scan.
fn run_to(
    session: &mut DebugSession,
    words: &BTreeSet<u32>,
    keep_running: &mut dyn FnMut() -> bool,
) -> SessionStopReason {
    let halt = session.run(&RunGoal { words: words.clone(), ..RunGoal::default() }, keep_running);
    if halt != SessionStopReason::Halted {
        return halt;
    }
    session.step_until(LAST_CYCLE, true, keep_running, &mut |session, _, _| words.contains(&session.machine().pc()))
}

/// Runs to one of some words `count` times, and reports only the last stop.
fn run_to_words(
    shell: &mut DebugShell,
    args: &str,
    words: impl Fn(&LadderView) -> BTreeSet<u32>,
    out: &mut String,
) -> CommandResult {
    let words = words(shell.ladder()?);
    let count = shell.parse_count(args)?;
    shell.run_and_report(out, |session, keep_running| {
        repeat_steps(count, keep_running, |keep_running| run_to(session, &words, keep_running))
    });
    Ok(())
}

/// `scan`: runs to the beginning of the next scan.
pub(super) fn scan(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    run_to_words(shell, args, |view| BTreeSet::from([view.scan_start()]), out)
}

/// `rung`: runs to the beginning of the next rung.
pub(super) fn rung(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    run_to_words(shell, args, |view| view.rung_starts().into_iter().map(|start| start.word).collect(), out)
}

/// `element`: runs to the beginning of the next element.
pub(super) fn element(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    run_to_words(shell, args, |view| view.element_starts().into_iter().map(|start| start.word).collect(), out)
}

/// `why`: explains the value of a symbol of the ladder program.
pub(super) fn why(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let view = shell.ladder()?;
    if args.is_empty() {
        return Err("which symbol? why Ymotor".into());
    }
    let follow = shell.session.follower().ok_or("the scans of this program are not recorded")?;
    for line in view.explain_value(follow, shell.session.machine(), args).map_err(|error| error.to_string())? {
        out.push_str(&format!("{line}\n"));
    }
    Ok(())
}

/// `info rung`: draws the next rung, or the rung with a number.
pub(super) fn info(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    let view = shell.ladder()?;
    let target = shell.session.machine();
    let rung = match args {
        "" => {
            view.rung_at(view.current_word(target)).ok_or("the program is between its rungs; info rung 3 shows one")?
        }
        number => number.parse().map_err(|_| format!("`{number}` is not the number of a rung"))?,
    };
    let lines = view.draw_rung(rung, shell.session.follower(), target, shell.color);
    if lines.is_empty() {
        return Err(format!("there is no rung {rung}; the last rung is {}", view.program().rungs.len()).into());
    }
    lines.iter().for_each(|line| out.push_str(&format!("{line}\n")));
    Ok(())
}

/// Prints the symbols of the program with their values and pins.
pub(super) fn values(shell: &DebugShell, text: &str, out: &mut String) {
    let Some(view) = &shell.view else { return };
    let map = view.map();
    let values = view.values(shell.session.machine());
    let width = values.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    for (name, value) in values.iter().filter(|(name, _)| name.contains(text)) {
        let pin = map.pins.iter().find(|pin| pin.name == *name);
        let pin = pin.map_or(String::new(), |pin| format!("  {} {}", pin.direction, pin.pin));
        let value = value.map_or("-".to_owned(), |value| value.to_string());
        out.push_str(format!("{name:<width$}  {value:>6}{pin}").trim_end());
        out.push('\n');
    }
}

/// `list` of a ladder program: draws three rungs from a given one on, then the next ones.
pub(super) fn list(shell: &mut DebugShell, args: &str, out: &mut String) -> CommandResult {
    const SHOWN: u32 = 3;
    let view = shell.ladder()?;
    let target = shell.session.machine();
    let first = match (args, args.parse::<u32>(), &shell.listed) {
        ("", _, Some(FileLine { line: next, .. })) => *next,
        ("", _, None) => view.rung_at(view.current_word(target)).unwrap_or(1),
        (_, Ok(rung), _) => rung.max(1),
        (place, ..) => {
            let words = shell.parse_location(place)?;
            words.first().and_then(|word| view.rung_at(*word)).ok_or_else(|| format!("{place} is in no rung"))?
        }
    };
    let last = view.program().rungs.len() as u32;
    if first > last {
        return Err(format!("the program ends with rung {last}").into());
    }
    for rung in first..=last.min(first + SHOWN - 1) {
        let lines = view.draw_rung(rung, shell.session.follower(), target, shell.color);
        lines.iter().for_each(|line| out.push_str(&format!("{line}\n")));
    }
    shell.listed = Some(FileLine { file: view.program().file.clone(), line: first + SHOWN });
    Ok(())
}
