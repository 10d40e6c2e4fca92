//! Prints diagnostics for people: the source line with a caret, the code, the cause and a hint.

use std::collections::BTreeSet;
use std::io::{IsTerminal, Write};

use ariadne::{CharSet, Color, Config, Label, LabelAttach, Report, ReportKind, Source};
use diag::text::printable;
use diag::{Diagnostic, Severity};

use crate::shared::codes;
use crate::shared::flags::ColorChoice;

/// Maximum length of a source line that is drawn, in bytes.
const MAX_LENGTH: usize = 600;

/// Maximum number of a source line that is drawn, because the time for drawing grows with the line number.
const MAX_NUMBER: u32 = 50_000;

/// The style of messages on standard error.
#[derive(Debug, Clone, Copy)]
pub struct MessageStyle {
    /// Use colours.
    pub color: bool,
    /// Standard error is a terminal.
    pub is_terminal: bool,
    /// Draw warnings and notes with their source lines, like errors.
    pub verbose: bool,
    /// Use colours in a full-screen view, which is on standard output.
    #[cfg(feature = "tui")]
    pub screen: bool,
}

impl MessageStyle {
    /// Chooses the style from the flags and the environment (<https://no-color.org>,
    /// <https://bixense.com/clicolors>).
    pub fn new(color: ColorChoice, verbose: bool) -> MessageStyle {
        let live = std::io::stderr().is_terminal();
        let set = |name| std::env::var_os(name).is_some_and(|v| !v.is_empty());
        let forced = set("CLICOLOR_FORCE") && std::env::var_os("CLICOLOR_FORCE").is_some_and(|v| v != "0");
        let wanted = |auto| match color {
            ColorChoice::Always => true,
            ColorChoice::Never => false,
            ColorChoice::Auto => !set("NO_COLOR") && auto,
        };
        MessageStyle {
            color: wanted(forced || live),
            is_terminal: live,
            verbose,
            #[cfg(feature = "tui")]
            screen: wanted(std::io::stdout().is_terminal()),
        }
    }
}

/// The texts of files by name, for drawing diagnostics.
#[derive(Debug, Default)]
pub struct FileTexts(pub Vec<(String, Vec<u8>)>);

impl FileTexts {
    /// No texts: diagnostics are printed without source lines.
    pub const NONE: &FileTexts = &FileTexts(Vec::new());

    /// Holds the text of one file.
    pub fn one(file: &str, text: Vec<u8>) -> FileTexts {
        FileTexts(vec![(file.to_owned(), text)])
    }

    /// Returns the text of a file, or an empty text if there is none.
    fn of(&self, file: &str) -> &[u8] {
        self.0.iter().find(|(name, _)| name == file).map_or(&[], |(_, text)| text)
    }
}

/// Prints diagnostics on standard error: an error with its source line if available, a warning or note as one
/// line. The last line counts the warnings and notes.
pub fn report_diagnostics(style: &MessageStyle, diagnostics: &[Diagnostic], texts: &FileTexts) {
    let mut drawn = Vec::new();
    let mut hints = BTreeSet::new();
    // Diagnostics of one file in sequence share its split lines.
    for about in diagnostics.chunk_by(|a, b| a.file == b.file) {
        let text = about.first().map_or(&[][..], |first| texts.of(&first.file));
        let text = diag::text::readable(text);
        let lines: Vec<&str> = text.split('\n').take(MAX_NUMBER as usize).collect();
        for diagnostic in about {
            if !diagnostic.is_error() && !style.verbose {
                one_line(style, diagnostic, hints.insert(&diagnostic.hint), &mut drawn);
                continue;
            }
            let line = (diagnostic.pos.line as usize).checked_sub(1).and_then(|n| lines.get(n));
            match line.filter(|line| line.len() <= MAX_LENGTH) {
                Some(line) => write_drawing(style, diagnostic, line, &mut drawn),
                None => write_plain(style, diagnostic, &mut drawn),
            }
        }
    }
    if !style.verbose {
        write_counts(diagnostics, &mut drawn);
    }
    _ = std::io::stderr().write_all(&drawn);
}

/// Writes `file:line:column: warning[CODE]: cause (hint: ..)`. A hint that several diagnostics share is
/// printed once.
fn one_line(style: &MessageStyle, diagnostic: &Diagnostic, with_hint: bool, out: &mut Vec<u8>) {
    let (name, _) = report_kind(diagnostic.severity);
    let (on, off) = ansi(style, diagnostic.severity);
    let hint = match diagnostic.hint.as_str() {
        hint if with_hint && !hint.is_empty() => format!(" (hint: {hint})"),
        _ => String::new(),
    };
    _ = writeln!(out, "{}: {on}{name}[{}]{off}: {}{hint}", place(diagnostic), diagnostic.code, diagnostic.cause);
}

/// Writes `2 warnings and 1 note` and the command that explains a code. Writes nothing for fewer than two.
fn write_counts(diagnostics: &[Diagnostic], out: &mut Vec<u8>) {
    if diagnostics.iter().filter(|diagnostic| !diagnostic.is_error()).count() < 2 {
        return;
    }
    let counted = |severity| {
        let n = diagnostics.iter().filter(|diagnostic| diagnostic.severity == severity).count();
        (n > 0).then(|| format!("{n} {}{}", report_kind(severity).0, if n == 1 { "" } else { "s" }))
    };
    let counts: Vec<String> = [Severity::Warning, Severity::Note].into_iter().filter_map(counted).collect();
    let code = diagnostics.iter().find(|diagnostic| !diagnostic.is_error()).map(|diagnostic| diagnostic.code);
    if let Some(code) = code {
        _ = writeln!(out, "{}; `emu explain {code}` says more about a code", counts.join(" and "));
    }
}

/// Returns `file:line:column`, without numbers that are 0.
fn place(diagnostic: &Diagnostic) -> String {
    let mut place = printable(&diagnostic.file).into_owned();
    for number in [diagnostic.pos.line, diagnostic.pos.column].into_iter().take_while(|n| *n > 0) {
        place.push_str(&format!(":{number}"));
    }
    place
}

/// Returns the escape sequences that begin and end the colour of a severity.
fn ansi(style: &MessageStyle, severity: Severity) -> (&'static str, &'static str) {
    match (style.color, severity) {
        (false, _) => ("", ""),
        (true, Severity::Error) => ("\x1b[31m", "\x1b[0m"),
        (true, Severity::Warning) => ("\x1b[33m", "\x1b[0m"),
        (true, Severity::Note) => ("\x1b[34m", "\x1b[0m"),
    }
}

fn report_kind(severity: Severity) -> (&'static str, Color) {
    match severity {
        Severity::Error => ("error", Color::Red),
        Severity::Warning => ("warning", Color::Yellow),
        Severity::Note => ("note", Color::Blue),
    }
}

/// Writes a diagnostic without a source line.
fn write_plain(style: &MessageStyle, diagnostic: &Diagnostic, out: &mut Vec<u8>) {
    let (name, _) = report_kind(diagnostic.severity);
    let (on, off) = ansi(style, diagnostic.severity);
    let place = place(diagnostic);
    _ = writeln!(out, "{on}[{}] {name}:{off} {place}: {}", diagnostic.code, diagnostic.cause);
    if !diagnostic.hint.is_empty() {
        _ = writeln!(out, "  hint: {}", diagnostic.hint);
    }
}

/// Writes a diagnostic with its source line: the cause, the line, and the title of the code at the caret.
///
/// The drawing library sees only that line, after as many empty lines as its line number needs, so the rest
/// of the file cannot affect the drawing.
fn write_drawing(style: &MessageStyle, diagnostic: &Diagnostic, line: &str, out: &mut Vec<u8>) {
    let clean: String = line.trim_end().chars().map(|c| if c.is_control() || is_break(c) { ' ' } else { c }).collect();
    let length = clean.chars().count();
    let (name, color) = report_kind(diagnostic.severity);
    let (start, width) = match (diagnostic.pos.column as usize).checked_sub(1) {
        Some(start) => (start.min(length), (diagnostic.pos.width as usize).max(1)),
        None => (length - clean.trim_start().chars().count(), length),
    };
    let above = (diagnostic.pos.line as usize).saturating_sub(1);
    // One space more, so that a caret can point after the end of the line.
    let source = Source::from(format!("{}{clean} ", "\n".repeat(above)));
    let end = (start + width).min(length).max(start + 1);
    let file = printable(&diagnostic.file);
    let span = (&*file, above + start..above + end);
    let config = Config::default()
        .with_color(style.color)
        .with_label_attach(LabelAttach::Start)
        .with_char_set(if style.is_terminal { CharSet::Unicode } else { CharSet::Ascii });
    let title = codes::find_code(diagnostic.code).map_or("", |code| code.title);
    let mut report = Report::build(ReportKind::Custom(name, color), span.clone())
        .with_config(config)
        .with_code(diagnostic.code)
        .with_message(&diagnostic.cause)
        .with_label(Label::new(span).with_color(color).with_message(title));
    if !diagnostic.hint.is_empty() {
        report = report.with_help(&diagnostic.hint);
    }
    let mut piece = Vec::new();
    match report.finish().write((&*file, source), &mut piece) {
        Ok(()) => write_tidied(style, &String::from_utf8_lossy(&piece), out),
        Err(_) => write_plain(style, diagnostic, out),
    }
}

/// Removes trailing spaces, and colours that the library writes for the kind of a message even when colours
/// are off.
fn write_tidied(style: &MessageStyle, piece: &str, out: &mut Vec<u8>) {
    for line in piece.lines() {
        let mut rest = line;
        let mut clean = String::new();
        while let Some((before, after)) = rest.split_once('\x1b').filter(|_| !style.color) {
            clean.push_str(before);
            rest = after.split_once('m').map_or("", |(_, rest)| rest);
        }
        clean.push_str(rest);
        out.extend_from_slice(clean.trim_end().as_bytes());
        out.push(b'\n');
    }
}

/// Returns true for characters at which the drawing library would break a line.
fn is_break(c: char) -> bool {
    matches!(c, '\u{2028}' | '\u{2029}')
}
