//! State shared by all parts of the reader: diagnostics, and uses of names that need the whole file to be
//! judged.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use diag::{Diagnostic, Pos, Severity};

use crate::codes;
use crate::lexer::{self, LdToken};
use crate::model::LadderDialect;
use crate::registers::{self, PortRegister};

/// Elements whose name cannot be a register: it is an accumulator, a stem of names, or kept when power is
/// off.
const NO_REGISTERS: [&str; 15] = [
    "TON",
    "TOF",
    "RTO",
    "RTL",
    "TCY",
    "THI",
    "TLO",
    "CTU",
    "CTD",
    "CTC",
    "CTR",
    "RES",
    "SHIFT_REGISTER",
    "PERSIST",
    "READ_ADC",
];

/// Maximum number of errors reported for one file.
const MAX_ERRORS: usize = 100;

/// State of reading one file.
pub(crate) struct LdReader<'a> {
    /// Name of the file, for messages.
    pub file: &'a str,
    /// Dialect, which sets the range of constants; 2.3 until the header is read.
    pub dialect: LadderDialect,
    diagnostics: Vec<Diagnostic>,
    /// Number of errors among the diagnostics.
    errors: usize,
    /// `MICRO=`, once it was read.
    pub micro: Option<String>,
    /// Names used as bits.
    bits: BTreeSet<String>,
    /// Names of bits used as integers: name, position and keyword of the element.
    misused_names: Vec<(String, Pos, &'static str)>,
}

impl<'a> LdReader<'a> {
    /// Starts to read a file.
    pub(crate) fn new(file: &'a str) -> Self {
        LdReader {
            file,
            dialect: LadderDialect::Ldmicro23,
            diagnostics: Vec::new(),
            errors: 0,
            micro: None,
            bits: BTreeSet::new(),
            misused_names: Vec::new(),
        }
    }

    /// Adds an error at a position, with its cause and a hint.
    pub(crate) fn error(&mut self, code: &'static str, pos: Pos, cause: impl Into<String>, hint: impl Into<String>) {
        self.report(Severity::Error, code, pos, cause, hint);
    }

    /// Adds a diagnostic at a position, with its cause and a hint.
    pub(crate) fn report(
        &mut self,
        severity: Severity,
        code: &'static str,
        pos: Pos,
        cause: impl Into<String>,
        hint: impl Into<String>,
    ) {
        self.errors += usize::from(severity == Severity::Error);
        self.diagnostics.push(Diagnostic::new(severity, code, self.file, pos, cause, hint));
    }

    /// True if there are so many errors that reading on is useless.
    pub(crate) fn has_too_many_errors(&self) -> bool {
        self.errors + self.misused_names.len() > 2 * MAX_ERRORS
    }

    /// Records that a contact, a coil or `IO LIST` uses the name as a bit.
    pub(crate) fn use_as_bit(&mut self, name: &str) {
        self.bits.insert(name.to_owned());
    }

    /// Range of constants in the dialect.
    pub(crate) const fn constant_range(&self) -> RangeInclusive<i64> {
        match self.dialect {
            LadderDialect::Ldmicro23 => i16::MIN as i64..=i16::MAX as i64,
            LadderDialect::Ldmicro5 | LadderDialect::Iec => i32::MIN as i64..=i32::MAX as i64,
        }
    }

    /// Reads a name of any kind.
    pub(crate) fn read_name(&mut self, token: LdToken<'_>) -> Option<String> {
        if lexer::is_name(token.text) {
            return Some(token.text.to_owned());
        }
        let shown = message_text(token.text);
        if token.text.starts_with('#') {
            self.error(
                codes::LDMICRO5_ONLY,
                token.pos,
                format!("`{shown}` is a register of LDmicro 5, which cannot be used in this place"),
                "#PORTx, #PINx and #TRISx are integers for MOVE, arithmetic, comparisons and the like",
            );
        } else {
            self.error(
                codes::BAD_NAME,
                token.pos,
                format!("`{shown}` is not a name"),
                "a name has letters A-Z a-z, digits and _, does not begin with a digit, and has at most 127 of them",
            );
        }
        None
    }

    /// Reads the name of an integer for the element `keyword`. Names of bits are reported at the end of the
    /// file.
    pub(crate) fn read_integer_name(&mut self, keyword: &'static str, token: LdToken<'_>) -> Option<String> {
        if token.text.starts_with('#') && !NO_REGISTERS.contains(&keyword) {
            return self.read_register(token);
        }
        let name = self.read_name(token)?;
        if name.starts_with(['X', 'Y', 'R']) {
            self.misused_names.push((name, token.pos, keyword));
            return None;
        }
        Some(name)
    }

    /// Reads the name of a register: that of a port, or the address of one.
    fn read_register(&mut self, token: LdToken<'_>) -> Option<String> {
        if PortRegister::from_name(token.text).is_some() {
            return Some(token.text.to_owned());
        }
        let shown = message_text(token.text);
        let number = token.text.strip_prefix('#').and_then(lexer::split_c_number);
        let Some((address, _)) = number.filter(|(_, rest)| rest.is_empty()) else {
            let cause = format!("`{shown}` is a pointer in LDmicro 5, which stores at an address that nothing sets");
            let hint = "registers are #PORTx, #PINx and #TRISx, with x the letter of a port: #TRISB is DDRB on AVR";
            self.error(codes::LDMICRO5_ONLY, token.pos, cause, hint);
            return None;
        };
        let micro = self.micro.clone().unwrap_or_default();
        let register = u32::try_from(address).ok().and_then(|address| registers::register_at(&micro, address));
        match register {
            Some(register) => {
                let cause = format!("`{shown}` is {} on the chip that MICRO= names", register.name());
                let hint = format!("write {}", register.name());
                self.report(Severity::Note, codes::REGISTER_ADDRESS, token.pos, cause, hint);
                Some(register.name())
            }
            None => {
                let chip =
                    if micro.is_empty() { "no chip is named by MICRO=".to_owned() } else { message_text(&micro) };
                let cause = format!("`{shown}` is no register of a port: {chip}");
                let hint = "only the registers of ports have a meaning here: #PORTx, #PINx and #TRISx";
                self.error(codes::LDMICRO5_ONLY, token.pos, cause, hint);
                None
            }
        }
    }

    /// Reads a number from `low` to `high`; `what` names it in messages.
    pub(crate) fn read_number(&mut self, token: LdToken<'_>, what: &str, low: i64, high: i64) -> Option<i64> {
        let shown = message_text(token.text);
        match lexer::parse_number(token.text) {
            None => {
                self.error(
                    codes::NOT_A_NUMBER,
                    token.pos,
                    format!("{what} must be a number, found `{shown}`"),
                    "write a number such as 12, -3, 0x1F or 'a'",
                );
                None
            }
            Some(value) => self.require_range(token, what, value, low, high),
        }
    }

    /// Reads a constant of an element from `low` to `high` in the spelling of the dialect.
    ///
    /// LDmicro 5 reads it with C's `strtol`, which ends at the first character that is no digit.
    pub(crate) fn read_constant(&mut self, token: LdToken<'_>, what: &str, low: i64, high: i64) -> Option<i64> {
        let number = lexer::split_c_number(token.text).filter(|_| self.dialect == LadderDialect::Ldmicro5);
        let Some((value, rest)) = number else {
            return self.read_number(token, what, low, high);
        };
        let shown = message_text(token.text);
        if !rest.is_empty() {
            let cause = format!("{what} `{shown}` is {value}: LDmicro 5 does not read `{}`", message_text(rest));
            let hint = format!("write {value}, or the number meant in decimal or as 0x..");
            self.report(Severity::Warning, codes::NOT_A_NUMBER, token.pos, cause, hint);
        } else if lexer::split_decimal(token.text).is_some_and(|(decimal, rest)| rest.is_empty() && decimal != value) {
            let cause = format!("{what} `{shown}` is octal: {value}");
            self.report(Severity::Note, codes::NOT_A_NUMBER, token.pos, cause, format!("write {value}"));
        }
        self.require_range(token, what, value, low, high)
    }

    fn require_range(&mut self, token: LdToken<'_>, what: &str, value: i64, low: i64, high: i64) -> Option<i64> {
        if (low..=high).contains(&value) {
            return Some(value);
        }
        let cause = format!("{what} is {}, allowed is {low} to {high}", message_text(token.text));
        self.error(codes::OUT_OF_RANGE, token.pos, cause, format!("choose a value from {low} to {high}"));
        None
    }

    /// Reads a number that is stored as `u32`.
    pub(crate) fn read_u32(&mut self, token: LdToken<'_>, what: &str, low: u32, high: u32) -> Option<u32> {
        let value = self.read_number(token, what, i64::from(low), i64::from(high))?;
        u32::try_from(value).ok()
    }

    /// Reads a flag, 0 or 1; LDmicro 5 takes any other number for 1.
    pub(crate) fn read_flag(&mut self, token: LdToken<'_>, what: &str) -> Option<u32> {
        let number = lexer::split_decimal(token.text).filter(|(_, rest)| rest.is_empty());
        match number {
            Some((value, _)) if self.dialect == LadderDialect::Ldmicro5 && !(0..=1).contains(&value) => {
                let cause = format!("{what} is {}, which is 1", message_text(token.text));
                self.report(Severity::Note, codes::OUT_OF_RANGE, token.pos, cause, "write 1");
                Some(1)
            }
            _ => self.read_u32(token, what, 0, 1),
        }
    }

    /// Returns all diagnostics sorted by position, with at most [`MAX_ERRORS`] errors.
    pub(crate) fn finish(mut self) -> Vec<Diagnostic> {
        for (name, pos, keyword) in std::mem::take(&mut self.misused_names) {
            if self.bits.contains(&name) {
                let cause = format!("{name} is used as a bit elsewhere, and {keyword} uses it as an integer");
                self.error(codes::BIT_AND_INTEGER, pos, cause, "give one of the two another name");
            } else {
                let cause = format!("{keyword} needs an integer, but {name} begins with {}", &name[..1]);
                self.error(codes::INTEGER_ON_BIT, pos, cause, "X.., Y.. and R.. are bits: choose another name");
            }
        }
        self.diagnostics.sort_by_key(|d| d.pos);
        if self.errors > MAX_ERRORS {
            let (mut kept, mut last) = (0, Pos::default());
            self.diagnostics.retain(|d| {
                kept += usize::from(d.is_error());
                let keep = kept <= MAX_ERRORS;
                if keep {
                    last = d.pos;
                }
                keep
            });
            let cause = format!("more than {MAX_ERRORS} errors: the rest is not shown");
            self.error(codes::TOO_MANY_ERRORS, last, cause, "fix those above first");
        }
        self.diagnostics
    }
}

/// Shortens a word of the file for a message to 40 characters and replaces control characters.
pub(crate) fn message_text(text: &str) -> String {
    let mut short: String = text.chars().take(40).map(|c| if c.is_control() { '?' } else { c }).collect();
    if text.chars().nth(40).is_some() {
        short.push_str("..");
    }
    short
}
