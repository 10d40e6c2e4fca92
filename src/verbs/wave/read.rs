//! Reads a VCD file (IEEE 1364-2005, section 18) into memory: the selected signals and their changes.

use std::borrow::Cow;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader};

use diag::{Diagnostic, Pos, Severity};
use scenario::NewlineTerminated;
use vcd::{Command, IdCode, Parser, TimescaleUnit, Value, VarType, Vector};

use super::scale::WaveTimescale;
use crate::shared::codes::{
    CONTRADICTORY_WAVE, MALFORMED_WAVE, TOO_LARGE_WAVE, UNREADABLE, file_error, system_message,
};
use crate::shared::fail::VerbFailure;
use crate::shared::report::FileTexts;

/// Maximum number of changes that are kept. A value with a long text counts as several changes.
const MAX_CHANGES: usize = 4_000_000;

/// Bytes of text that count as one change.
const BYTES_PER_CHANGE: usize = 32;

/// The UTF-8 byte order mark, which some editors add. VCD is plain ASCII.
const BOM: &[u8] = b"\xEF\xBB\xBF";

/// Maximum number of signals that a file may declare.
const MAX_SIGNALS: usize = 100_000;

/// Maximum total size of all names with their scopes, in bytes. In deep scopes every name is long.
const MAX_NAME_BYTES: usize = 64 << 20;

/// Maximum number of characters of a name that are drawn.
const MAX_NAME_LENGTH: usize = 200;

/// A value of a signal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SignalValue {
    /// A bit that is 0.
    Low,
    /// A bit that is 1.
    High,
    /// Unknown; of several bits, all are unknown.
    Unknown,
    /// Not driven.
    Floating,
    /// A number or a text.
    Word(Box<str>),
    /// An event at this time.
    Event,
}

/// A signal and its changes in order of time.
#[derive(Debug)]
pub struct WaveSignal {
    /// The name with its scopes. The outermost scope is omitted if all signals share it.
    pub name: String,
    /// Number of bits; 0 for real numbers and texts.
    bits: u32,
    /// True for events, which have no value.
    pub event: bool,
    /// The changes: tick and new value.
    pub changes: Vec<(u64, SignalValue)>,
}

/// The contents of a VCD file.
#[derive(Debug)]
pub struct WaveFile {
    /// The time scale.
    pub scale: WaveTimescale,
    /// The signals in order of declaration.
    pub signals: Vec<WaveSignal>,
    /// The first time in the file, in ticks.
    pub start: u64,
    /// The last time in the file, in ticks.
    pub end: u64,
}

impl WaveSignal {
    /// Returns the name as it is drawn: of a long name only its end.
    pub fn drawn_name(&self) -> Cow<'_, str> {
        let name = self.name.as_str();
        match name.char_indices().rev().nth(MAX_NAME_LENGTH - 1) {
            None | Some((0, _)) => name.into(),
            Some((at, cut)) => format!("…{}", name.get(at + cut.len_utf8()..).unwrap_or_default()).into(),
        }
    }

    /// Returns true if a pattern matches the name, with or without scopes; `*` matches any text.
    pub fn is_named(&self, pattern: &str) -> bool {
        let (name, mut parts) = (self.name.as_str(), pattern.split('*'));
        let (front, last) = (parts.next().unwrap_or_default(), parts.next_back());
        let Some(last) = last else {
            return name.strip_suffix(front).is_some_and(|scopes| scopes.is_empty() || scopes.ends_with('.'));
        };
        // The earliest match of each part leaves the most text for the parts after it.
        let rest = name.strip_prefix(front).or_else(|| Some(name.split_once(&format!(".{front}"))?.1));
        let rest = parts.try_fold(rest, |rest, part| rest.map(|rest| Some(rest.split_once(part)?.1)));
        rest.flatten().is_some_and(|rest| rest.ends_with(last))
    }
}

/// Reads a file. If there are patterns, changes of signals that match none of them are dropped.
pub fn read(file: &str, only: &[String]) -> Result<WaveFile, VerbFailure> {
    if file == "-" {
        return VcdReader::new(file, only).read_all(BufReader::new(io::stdin()));
    }
    let open = File::open(file).map_err(|error| unreadable(file, &error))?;
    VcdReader::new(file, only).read_all(BufReader::new(open))
}

/// Reads the bytes of a file; `file` is its name in messages.
pub fn read_bytes(file: &str, bytes: &[u8]) -> Result<WaveFile, VerbFailure> {
    VcdReader::new(file, &[]).read_all(bytes)
}

fn unreadable(file: &str, error: &io::Error) -> VerbFailure {
    let cause = format!("cannot be read: {}", system_message(error));
    let hint = "check the path; - is standard input";
    VerbFailure::Refused(vec![file_error(UNREADABLE, file, cause, hint)], FileTexts::default())
}

/// The state of a reader.
struct VcdReader<'a> {
    file: &'a str,
    only: &'a [String],
    scale: Option<WaveTimescale>,
    scopes: Vec<String>,
    signals: Vec<WaveSignal>,
    /// The indexes of the signals that share an identifier code.
    codes: HashMap<IdCode, Vec<usize>>,
    declared: bool,
    start: Option<u64>,
    now: u64,
    changes_kept: usize,
    /// Total bytes of all names.
    name_bytes: usize,
}

impl<'a> VcdReader<'a> {
    fn new(file: &'a str, only: &'a [String]) -> VcdReader<'a> {
        VcdReader {
            file,
            only,
            scale: None,
            scopes: Vec::new(),
            signals: Vec::new(),
            codes: HashMap::new(),
            declared: false,
            start: None,
            now: 0,
            changes_kept: 0,
            name_bytes: 0,
        }
    }

    fn read_all(mut self, mut input: impl BufRead) -> Result<WaveFile, VerbFailure> {
        // A directory can be opened but not read.
        let begin = input.fill_buf().map_err(|error| unreadable(self.file, &error))?;
        if begin.starts_with(BOM) {
            return Err(self.refuse(MALFORMED_WAVE, 1, "the file begins with a byte order mark".to_owned()));
        }
        let mut parser = Parser::new(BufReader::new(NewlineTerminated::new(input)));
        loop {
            match parser.next() {
                None => break,
                Some(Ok(command)) => {
                    self.command(command).map_err(|(code, cause)| self.refuse(code, parser.line(), cause))?;
                }
                Some(Err(error)) => {
                    let cause = match error.kind() {
                        io::ErrorKind::UnexpectedEof => "the file ends within a command".to_owned(),
                        io::ErrorKind::InvalidData => format!("this is not a VCD file: {}", parser_message(&error)),
                        _ => format!("cannot be read: {}", system_message(&error)),
                    };
                    return Err(self.refuse(MALFORMED_WAVE, parser.line(), cause));
                }
            }
        }
        if !self.declared {
            let cause = "the file ends before $enddefinitions".to_owned();
            return Err(self.refuse(MALFORMED_WAVE, parser.line(), cause));
        }
        if self.signals.is_empty() {
            return Err(self.refuse(CONTRADICTORY_WAVE, parser.line(), "the file declares no signal".to_owned()));
        }
        if self.start == Some(u64::MAX) {
            let cause = format!("the only time is {}, and there is no later time", u64::MAX);
            return Err(self.refuse(TOO_LARGE_WAVE, parser.line(), cause));
        }
        Ok(self.finish())
    }

    fn finish(mut self) -> WaveFile {
        // A scope that contains all signals carries no information.
        let first = self.signals.first().and_then(|signal| Some(signal.name.split_once('.')?.0.to_owned()));
        if let Some(prefix) = first.map(|scope| scope + ".")
            && self.signals.iter().all(|signal| signal.name.starts_with(&prefix))
        {
            for signal in &mut self.signals {
                signal.name.drain(..prefix.len());
            }
        }
        let scale = self.scale.unwrap_or(WaveTimescale::new(1, TimescaleUnit::NS));
        WaveFile { scale, signals: self.signals, start: self.start.unwrap_or(0), end: self.now }
    }

    fn command(&mut self, command: Command) -> Result<(), (&'static str, String)> {
        let wrong = |cause: &str| Err((CONTRADICTORY_WAVE, cause.to_owned()));
        match command {
            Command::Timescale(0, _) => wrong("the time scale is 0"),
            Command::Timescale(number, unit) => {
                self.scale = Some(WaveTimescale::new(number, unit));
                Ok(())
            }
            Command::ScopeDef(_, name) => {
                self.scopes.push(name);
                Ok(())
            }
            Command::Upscope if self.scopes.pop().is_none() => wrong("$upscope leaves a scope that was not entered"),
            Command::VarDef(kind, bits, code, name, index) => {
                if self.declared {
                    return wrong("a signal is declared after $enddefinitions");
                }
                if self.signals.len() >= MAX_SIGNALS {
                    return Err((TOO_LARGE_WAVE, format!("there are more than {MAX_SIGNALS} signals")));
                }
                self.name_bytes += self.scopes.iter().map(|scope| scope.len() + 1).sum::<usize>() + name.len();
                if self.name_bytes > MAX_NAME_BYTES {
                    return Err((
                        TOO_LARGE_WAVE,
                        format!("the names have more than {MAX_NAME_BYTES} bytes with their scopes"),
                    ));
                }
                let index = index.filter(|_| bits == 1).map_or_else(String::new, |index| index.to_string());
                let path = self.scopes.iter().map(String::as_str).chain([name.as_str()]).collect::<Vec<_>>().join(".");
                let bits = if matches!(kind, VarType::Real | VarType::String) { 0 } else { bits.max(1) };
                self.codes.entry(code).or_default().push(self.signals.len());
                let event = kind == VarType::Event;
                self.signals.push(WaveSignal { name: path + &index, bits, event, changes: Vec::new() });
                Ok(())
            }
            Command::Enddefinitions => {
                self.declared = true;
                let only = self.only;
                // Changes of signals that no pattern matches are dropped.
                let unwanted = |signal: &WaveSignal| !only.is_empty() && !only.iter().any(|name| signal.is_named(name));
                let unwanted: Vec<bool> = self.signals.iter().map(unwanted).collect();
                for list in self.codes.values_mut() {
                    list.retain(|index| unwanted.get(*index) == Some(&false));
                }
                Ok(())
            }
            Command::Timestamp(at) if at < self.now => {
                Err((CONTRADICTORY_WAVE, format!("time goes back from {} to {at}", self.now)))
            }
            Command::Timestamp(at) => {
                self.start.get_or_insert(at);
                self.now = at;
                Ok(())
            }
            Command::ChangeScalar(code, value) => self.change(code, |signal| Some(signal.shown(&[value]))),
            Command::ChangeVector(code, value) => self.change(code, |signal| signal.vector(&value)),
            Command::ChangeReal(code, value) => {
                self.change(code, |_| Some(SignalValue::Word(format!("{value}").into_boxed_str())))
            }
            Command::ChangeString(code, value) => {
                self.change(code, |_| Some(SignalValue::Word(value.clone().into_boxed_str())))
            }
            _ => Ok(()),
        }
    }

    fn change(
        &mut self,
        code: IdCode,
        value: impl Fn(&WaveSignal) -> Option<SignalValue>,
    ) -> Result<(), (&'static str, String)> {
        let Some(list) = self.codes.get(&code).filter(|_| self.declared) else {
            return Err((CONTRADICTORY_WAVE, format!("`{code}` changes, and is not a signal that was declared")));
        };
        for signal in list {
            let Some(signal) = self.signals.get_mut(*signal) else { continue };
            let Some(value) = value(signal) else {
                return Err((
                    CONTRADICTORY_WAVE,
                    format!("{} has {} bits, and its value has more", signal.name, signal.bits),
                ));
            };
            let same = signal.changes.last().is_some_and(|(_, last)| *last == value && value != SignalValue::Event);
            if !same {
                self.changes_kept +=
                    1 + if let SignalValue::Word(text) = &value { text.len() / BYTES_PER_CHANGE } else { 0 };
                signal.changes.push((self.now, value));
            }
        }
        if self.changes_kept > MAX_CHANGES {
            return Err((
                TOO_LARGE_WAVE,
                format!("there are more than {MAX_CHANGES} changes; name signals with --only"),
            ));
        }
        Ok(())
    }

    fn refuse(&self, code: &'static str, line: u64, cause: String) -> VerbFailure {
        let pos = Pos { line: u32::try_from(line).unwrap_or(u32::MAX), column: 1, width: 1 };
        let hint = "write the file again with the tool that it comes from";
        VerbFailure::Refused(
            vec![Diagnostic::new(Severity::Error, code, self.file, pos, cause, hint)],
            FileTexts::default(),
        )
    }
}

impl WaveSignal {
    /// Returns a value of several bits, which may be written with fewer bits. `None` if the value has more
    /// bits than the signal.
    fn vector(&self, value: &Vector) -> Option<SignalValue> {
        let bits: Vec<Value> = value.iter().collect();
        let wanted = self.bits.max(1) as usize;
        let (front, bits) = bits.split_at(bits.len().saturating_sub(wanted));
        // Tools may write leading zeros.
        front.iter().all(|bit| *bit == Value::V0).then(|| self.shown(bits))
    }

    /// Returns the value of some bits, most significant first, as it is drawn.
    fn shown(&self, bits: &[Value]) -> SignalValue {
        if self.event {
            return SignalValue::Event;
        }
        match bits {
            _ if bits.iter().all(|bit| *bit == Value::Z) => SignalValue::Floating,
            _ if bits.iter().all(|bit| *bit == Value::X) => SignalValue::Unknown,
            [Value::V0] if self.bits == 1 => SignalValue::Low,
            [Value::V1] if self.bits == 1 => SignalValue::High,
            _ => SignalValue::Word(self.hex(bits).into_boxed_str()),
        }
    }

    /// Returns bits as hexadecimal digits; x and z for digits with such bits.
    fn hex(&self, bits: &[Value]) -> String {
        // As the standard says, the first bit is extended to the left, except for 1.
        let fill = match bits.first() {
            Some(Value::X) => Value::X,
            Some(Value::Z) => Value::Z,
            _ => Value::V0,
        };
        let width = (self.bits.max(1) as usize).min(1 << 16).div_ceil(4);
        let front = bits.len().next_multiple_of(4) - bits.len();
        let all: Vec<Value> = std::iter::repeat_n(fill, front).chain(bits.iter().copied()).collect();
        let digit = |four: &[Value]| {
            if four.contains(&Value::X) {
                'x'
            } else if four.contains(&Value::Z) {
                'z'
            } else {
                let number = four.iter().fold(0, |high, bit| high << 1 | u32::from(*bit == Value::V1));
                char::from_digit(number, 16).unwrap_or('?')
            }
        };
        // Most values of a wide signal are short: the extension is one repeated digit.
        let again = width.saturating_sub(all.len() / 4);
        std::iter::repeat_n(digit(&[fill; 4]), again).chain(all.chunks(4).map(digit)).collect()
    }
}

/// Returns the parser's message about a malformed place.
fn parser_message(error: &io::Error) -> String {
    let inner = error.get_ref().and_then(|inner| inner.downcast_ref::<vcd::ParseError>());
    inner.map_or_else(|| error.to_string(), |error| error.kind().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "$timescale 1 ns $end $scope module top $end $var wire 1 ! a $end $var reg 8 \" b $end \
                        $var event 1 # e $end $var real 64 $ r $end $upscope $end $enddefinitions $end\n";

    fn read(text: &str) -> Result<WaveFile, String> {
        let read = VcdReader::new("f.vcd", &[]).read_all(text.as_bytes());
        read.map_err(|failure| match failure {
            VerbFailure::Refused(why, _) => {
                why.iter().map(|d| format!("{} {} {}", d.code, d.pos.line, d.cause)).collect()
            }
            _ => "another failure".to_owned(),
        })
    }

    #[test]
    fn values() {
        let body = "#5\n1! b101 \" 1# r1.5 $\n#9\nx! bx \" 1#\n#10 z! b1x0z0001 \"\n#12\n0! b000011111111 \"\n#20\n";
        let waves = read(&format!("{HEAD}{body}")).unwrap_or_else(|why| panic!("{why}"));
        let word = |text: &str| SignalValue::Word(text.into());
        assert_eq!((waves.start, waves.end), (5, 20));
        let names: Vec<&str> = waves.signals.iter().map(|signal| signal.name.as_str()).collect();
        assert_eq!(names, ["a", "b", "e", "r"]);
        let of = |index: usize| waves.signals[index].changes.clone();
        assert_eq!(
            of(0),
            [(5, SignalValue::High), (9, SignalValue::Unknown), (10, SignalValue::Floating), (12, SignalValue::Low)]
        );
        assert_eq!(of(1), [(5, word("05")), (9, SignalValue::Unknown), (10, word("x1")), (12, word("ff"))]);
        assert_eq!(of(2), [(5, SignalValue::Event), (9, SignalValue::Event)]);
        assert_eq!(of(3), [(5, word("1.5"))]);
    }

    /// File bodies that are refused, with code and line.
    const DAMAGED: &[(&str, &str)] = &[
        ("#5\n1!\n#4\n", "WAV002 4"),
        ("#5\n1?\n", "WAV002 3"),
        ("#5\nb111111111 \"\n", "WAV002 3"),
        ("#5\nQ!\n", "WAV001 3"),
        ("#5\nb1", "WAV001 3"),
        ("#99999999999999999999\n", "WAV001 2"),
        ("$upscope $end\n", "WAV002 2"),
        ("$var wire 1 % c $end\n", "WAV002 2"),
        ("#5\nU!\n", "WAV001 3"),
        ("#5\nbU1 \"\n", "WAV001 3"),
        ("#5\nb10 !\n", "WAV002 3"),
        ("#5\nbxxxxxxxxx \"\n", "WAV002 3"),
        ("$timescale 0 ns $end\n", "WAV002 2"),
        ("#18446744073709551615\n1!\n", "WAV003 4"),
    ];

    #[test]
    fn damaged_files() {
        for (body, wanted) in DAMAGED {
            let why = read(&format!("{HEAD}{body}")).map(|_| ()).expect_err(body);
            assert!(why.starts_with(wanted), "{body}: {why}");
        }
        let marked = read(&format!("\u{feff}{HEAD}#5\n1!\n")).map(|_| ()).expect_err("a mark");
        assert_eq!(marked, "WAV001 1 the file begins with a byte order mark");
        for text in ["", "hello\n", "$timescale 1 ns $end\n", "\u{7f}ELF", "$enddefinitions $end\n"] {
            assert!(read(text).is_err(), "{text}");
        }
    }

    #[test]
    fn patterns() {
        for (name, pattern, wanted) in [
            ("a", "a", true),
            ("PB5", "PB*", true),
            ("signals.TCNT0", "TCNT0", true),
            ("signals.TCNT0", "sig*0", true),
            ("signals.TCNT0", "TCNT", false),
            ("x", "*", true),
            ("PB5", "*B*5*", true),
            ("PB5", "*C*", false),
            ("a.bc.bd", "b*d", true),
            ("a.bc.bd", "c*d", false),
            ("ab", "ab*b", false),
            ("a.b", "", false),
        ] {
            assert_eq!(bit(name).is_named(pattern), wanted, "{name} {pattern}");
        }
        // The matcher must not try all combinations.
        assert!(!bit(&"a".repeat(2000)).is_named(&("*a".repeat(40) + "b")));
    }

    fn bit(name: &str) -> WaveSignal {
        WaveSignal { name: name.to_owned(), bits: 1, event: false, changes: Vec::new() }
    }

    #[test]
    fn long_names_are_cut_in_front() {
        for (length, wanted) in [(1, 1), (200, 200), (201, 200), (70_000, 200)] {
            let signal = bit(&("é".repeat(length - 1) + "z"));
            let drawn = signal.drawn_name();
            assert_eq!(
                (drawn.chars().count(), drawn.starts_with('…'), drawn.ends_with('z')),
                (wanted, length > 200, true)
            );
        }
    }
}
