//! The keys of a scenario, a row each: the parser, the schema and the messages read these.

/// A key and what it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// It is a verb: a step has at most one of these.
    pub verb: bool,
    /// Keys that may stand beside it, of those that do not go with every verb.
    pub with: &'static [&'static str],
}

/// The keys of the file.
pub const KEYS: &[&str] = &["program", "mcu", "limit", "baud", "step"];

const fn verb(name: &'static str, with: &'static [&'static str]) -> Key {
    Key { name, verb: true, with }
}

const fn beside(name: &'static str) -> Key {
    Key { name, verb: false, with: &[] }
}

/// Keys of a step that is done again and again.
const AGAIN: &[&str] = &["every", "times", "until"];

/// The keys of a step.
#[rustfmt::skip]
pub const STEP_KEYS: &[Key] = &[
    beside("name"),
    beside("at"),
    beside("after"),
    beside("every"),
    beside("times"),
    beside("until"),
    beside("between"),
    beside("for"),
    beside("over"),
    beside("grain"),
    beside("within"),
    beside("steps"),
    verb("set",         AGAIN),
    verb("pulse",       &["every", "times", "until", "for"]),
    verb("toggle",      AGAIN),
    verb("ramp",        &["over", "grain"]),
    verb("uart-send",   AGAIN),
    verb("expect",      &["every", "times", "until", "between"]),
    verb("expect-uart", &["within"]),
    verb("wait",        &["within"]),
    verb("never",       &["between"]),
    verb("repeat",      &["steps"]),
    verb("snapshot",    &[]),
    verb("log",         AGAIN),
    verb("power-cycle", &[]),
];
