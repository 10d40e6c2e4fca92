//! Reads the head of a `.ld` file: settings, `IO LIST`, `VAR LIST` and `PULL-UP LIST`.

use diag::{Pos, Severity, nearest};

use crate::codes;
use crate::lexer::{self, LdLine};
use crate::list_lines::read_list_line;
use crate::model::{IoEntry, LadderDialect, LadderProgram, LdFormat, ProgramSettings, Rung, SourceStyle, VarEntry};
use crate::reader::{LdReader, message_text};

/// Maximum value of CYCLE (microseconds), CRYSTAL (Hz) and BAUD (bits per second).
const MAX_SETTING: u64 = 1_000_000_000_000;
const SETTINGS: [&str; 10] = [
    "MICRO=",
    "CYCLE=",
    "CRYSTAL=",
    "BAUD=",
    "COMPILER=",
    "COMPILED=",
    "IO LIST",
    "VAR LIST",
    "PULL-UP LIST",
    "PROGRAM",
];

/// The settings and lists before the rungs, as far as they have been read.
#[derive(Default)]
pub(crate) struct ProgramHead {
    /// The microcontroller of the program, as the file names it.
    pub(crate) micro: Option<String>,
    cycle: Option<(u64, String)>,
    crystal: Option<(u64, String)>,
    baud: Option<(u64, String)>,
    compiler: Option<String>,
    compiled: Option<String>,
    /// Names of the settings and lists read so far, to find repeated ones.
    seen: Vec<&'static str>,
    /// The inputs and outputs with their pins.
    pub(crate) io: Vec<IoEntry>,
    /// The variables with their widths; None without such a list.
    pub(crate) vars: Option<Vec<VarEntry>>,
    /// The masks of pull-up resistors; None without such a list.
    pub(crate) pull_ups: Option<Vec<String>>,
}

impl ProgramHead {
    /// Builds the program with this head. A missing setting, which was reported as an error, becomes zero.
    pub(crate) fn into_program(
        self,
        file: &str,
        format: LdFormat,
        dialect: LadderDialect,
        style: SourceStyle,
        rungs: Vec<Rung>,
    ) -> LadderProgram {
        let (cycle_us, cycle_rest) = self.cycle.unwrap_or_default();
        let (crystal_hz, crystal_rest) = self.crystal.unwrap_or_default();
        let (baud, baud_rest) = self.baud.map_or((None, String::new()), |(value, rest)| (Some(value), rest));
        let settings = ProgramSettings {
            micro: self.micro,
            cycle_us,
            cycle_rest,
            crystal_hz,
            crystal_rest,
            baud,
            baud_rest,
            compiler: self.compiler,
            compiled: self.compiled,
        };
        let ProgramHead { io, vars, pull_ups, .. } = self;
        let declarations = Vec::new();
        LadderProgram {
            file: file.to_owned(),
            format,
            dialect,
            style,
            settings,
            io,
            vars,
            pull_ups,
            declarations,
            rungs,
        }
    }
}

/// Reads up to and including the line `PROGRAM`; returns true if that line was found.
pub(crate) fn read_head<'a>(
    reader: &mut LdReader<'_>,
    lines: &mut impl Iterator<Item = LdLine<'a>>,
    out: &mut ProgramHead,
) -> bool {
    let mut found = false;
    let mut last = Pos::default();
    let mut list: Option<(&'static str, Pos)> = None;
    for line in lines.by_ref() {
        last = line.pos;
        let section = section_keyword(&line);
        if let Some((name, opened)) = list {
            match section {
                Some("END") => list = None,
                None => read_list_line(reader, name, &line, out),
                Some(_) => {
                    reader.error(
                        codes::LIST_OPEN,
                        opened,
                        format!("{name} is not closed"),
                        "put END after its last line",
                    );
                    list = None;
                }
            }
            if list.is_some() || section == Some("END") {
                continue;
            }
        }
        match section {
            Some("PROGRAM") => {
                found = true;
                break;
            }
            Some("END") => {
                reader.error(codes::STRAY_END, line.pos, "END closes no list", "remove it");
            }
            Some(name) => {
                refuse_repeated(reader, out, name, line.pos);
                list = Some((name, line.pos));
                match name {
                    "VAR LIST" => drop(out.vars.get_or_insert_default()),
                    "PULL-UP LIST" => drop(out.pull_ups.get_or_insert_default()),
                    _ => {}
                }
            }
            None => read_setting(reader, &line, out),
        }
        if reader.has_too_many_errors() {
            break;
        }
    }
    if let Some((name, opened)) = list {
        reader.error(codes::LIST_OPEN, opened, format!("{name} is not closed"), "put END after its last line");
    }
    if !found && !reader.has_too_many_errors() {
        let cause = "the file ends before the line PROGRAM";
        reader.error(codes::NO_PROGRAM, last, cause, "put PROGRAM before the first RUNG");
    }
    for (name, given) in [("CYCLE=", out.cycle.is_some()), ("CRYSTAL=", out.crystal.is_some())] {
        if !given && !out.seen.contains(&name) {
            let hint =
                if name == "CYCLE=" { "such as CYCLE=10000 (microseconds)" } else { "such as CRYSTAL=4000000 (Hz)" };
            reader.error(codes::SETTING_MISSING, Pos::default(), format!("the line {name} is missing"), hint);
        }
    }
    found
}

/// Returns the keyword of a section line; any white space may separate its words.
fn section_keyword(line: &LdLine<'_>) -> Option<&'static str> {
    let words: Vec<&str> = line.tokens.iter().map(|t| t.text).take(3).collect();
    match words.as_slice() {
        ["IO", "LIST"] => Some("IO LIST"),
        ["VAR", "LIST"] => Some("VAR LIST"),
        ["PULL-UP", "LIST"] => Some("PULL-UP LIST"),
        ["END"] => Some("END"),
        ["PROGRAM"] => Some("PROGRAM"),
        _ => None,
    }
}

fn refuse_repeated(reader: &mut LdReader<'_>, out: &mut ProgramHead, name: &'static str, pos: Pos) {
    if out.seen.contains(&name) {
        reader.error(codes::SETTING_TWICE, pos, format!("{name} occurs twice"), "remove one of them");
    }
    out.seen.push(name);
}

fn read_setting(reader: &mut LdReader<'_>, line: &LdLine<'_>, out: &mut ProgramHead) {
    let known =
        SETTINGS.iter().filter(|s| s.ends_with('=')).find_map(|s| Some((*s, line.text.strip_prefix(s)?.trim())));
    let Some((name, value)) = known else {
        let word = line.text.split_inclusive('=').next().unwrap_or("");
        let hint = match (line.keyword(), nearest(word, SETTINGS.into_iter())) {
            ("RUNG", _) => "rungs come after the line PROGRAM".to_owned(),
            (_, Some(near)) => format!("did you mean {near}?"),
            (_, None) => format!("known are {}", SETTINGS.join(", ")),
        };
        // LDmicro 5 ignores lines that it does not know.
        let severity = match reader.dialect {
            LadderDialect::Ldmicro5 if line.keyword() != "RUNG" => Severity::Warning,
            _ => Severity::Error,
        };
        let cause = match severity {
            Severity::Error => format!("`{}` is not a line of the head", message_text(line.text)),
            _ => format!("`{}` is not a line of the head and has no effect", message_text(line.text)),
        };
        reader.report(severity, codes::UNKNOWN_SETTING, line.pos, cause, hint);
        return;
    };
    refuse_repeated(reader, out, name, line.pos);
    match name {
        "MICRO=" => {
            out.micro = Some(value.to_owned()).filter(|v| !v.is_empty());
            reader.micro.clone_from(&out.micro);
            // LDmicro 5 reads the list only after a chip; written back it stands after MICRO=, where it would
            // have an effect.
            if out.micro.is_some() {
                out.pull_ups.iter_mut().for_each(Vec::clear);
            }
        }
        "CYCLE=" => out.cycle = read_quantity(reader, line, name, value, "us", 0),
        "CRYSTAL=" => out.crystal = read_quantity(reader, line, name, value, "hz", 1),
        "BAUD=" => out.baud = read_quantity(reader, line, name, value, "hz", 0),
        "COMPILER=" => out.compiler = Some(value.to_owned()),
        _ => out.compiled = Some(value.to_owned()),
    }
}

/// Duration of a scan in microseconds where LDmicro 5 finds no number in `CYCLE=`.
const DEFAULT_CYCLE_US: u64 = 10_000;

/// Reads a decimal number and the text after it, which must be empty or begin with the unit.
fn read_quantity(
    reader: &mut LdReader<'_>,
    line: &LdLine<'_>,
    name: &str,
    value: &str,
    unit: &str,
    low: u64,
) -> Option<(u64, String)> {
    let digits = value.len() - value.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let (digits, rest) = value.split_at_checked(digits)?;
    let rest = rest.trim();
    let number = digits.parse::<u64>().ok().filter(|n| (low..=MAX_SETTING).contains(n));
    let unit_ok = rest.is_empty() || rest.get(..unit.len()).is_some_and(|u| u.eq_ignore_ascii_case(unit));
    // Mark only the text after the equals sign, or the whole line if there is none.
    let width = value.chars().count() as u32;
    let before = line.pos.width.saturating_sub(width);
    let pos = if width == 0 { line.pos } else { Pos::new(line.pos.line, line.pos.column + before, width) };
    if let Some(number) = number
        && (unit_ok || unit == "us")
    {
        if !unit_ok {
            let cause = format!("{name} is {number} microseconds, `{}` has no effect", message_text(rest));
            let hint = format!("write {name}{number} us, with the number in microseconds");
            reader.report(Severity::Warning, codes::SETTING_NUMBER, pos, cause, hint);
        }
        if unit == "us" {
            note_ignored_tails(reader, pos, rest);
        }
        return Some((number, rest.to_owned()));
    }
    let is_no_number = lexer::split_decimal(value).is_none();
    if unit == "us" && is_no_number && reader.dialect == LadderDialect::Ldmicro5 {
        let cause = format!("CYCLE= has no number, so LDmicro 5 takes {DEFAULT_CYCLE_US} microseconds");
        let hint = format!("write CYCLE={DEFAULT_CYCLE_US}");
        reader.report(Severity::Warning, codes::SETTING_NUMBER, pos, cause, hint);
        return Some((DEFAULT_CYCLE_US, String::new()));
    }
    let cause = format!("{name} needs a whole number from {low} to {MAX_SETTING}, found `{}`", message_text(value));
    let hint = match unit {
        "us" => "write microseconds, such as CYCLE=10000".to_owned(),
        _ => format!("write Hz, such as {name}{}", if name == "BAUD=" { 2400 } else { 4_000_000 }),
    };
    reader.error(codes::SETTING_NUMBER, pos, cause, hint);
    None
}

/// Notes what LDmicro 5 writes after the number of `CYCLE=` and has no effect here.
fn note_ignored_tails(reader: &mut LdReader<'_>, pos: Pos, rest: &str) {
    let after = |name: &str| rest.split_once(name).map(|(_, value)| value.split([',', ' ']).next().unwrap_or(""));
    if let Some(duty) = after("YPlcCycleDuty:").filter(|duty| duty.trim_start_matches('0') == "1") {
        let cause = format!("YPlcCycleDuty:{duty} has no effect: no output shows how long a scan takes");
        let hint = "nothing to do; emu sim and emu compile say how long scans take";
        reader.report(Severity::Note, codes::IGNORED_SETTING, pos, cause, hint);
    }
    let is_zero = |word: &str| word.trim_start_matches("0x").trim_matches('0').is_empty();
    if let Some(word) = after("ConfigurationWord(s):").filter(|word| !is_zero(word)) {
        let shown = message_text(word);
        let cause = format!("ConfigurationWord(s):{shown} has no effect: a compiled image has a word of its own");
        let hint = "nothing to do; emu compile names the word or the fuses (LC041)";
        reader.report(Severity::Note, codes::IGNORED_SETTING, pos, cause, hint);
    }
}
