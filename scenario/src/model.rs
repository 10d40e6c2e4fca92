//! A scenario as it was read, every part with its place.

use diag::Pos;

use crate::time::Span;

/// A name or a text, and where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Named {
    /// The text.
    pub text: String,
    /// Its place.
    pub pos: Pos,
}

/// A value that something is given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Value {
    /// A whole number; true is 1, false 0.
    Number(i64),
    /// Anything else: `z`, `pullup`, `1.25V`.
    Text(String),
}

/// As it is written on a command line.
impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Number(number) => write!(f, "{number}"),
            Value::Text(text) => f.write_str(text),
        }
    }
}

/// Something is given a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assign {
    /// What.
    pub name: Named,
    /// The value.
    pub value: Value,
    /// Place of the value.
    pub pos: Pos,
}

/// What a value must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compare {
    /// This number.
    Is(i64),
    /// Another one.
    Not(i64),
    /// From the first to the second, both included; an open end is that of `i64`.
    Within(i64, i64),
    /// Nothing drives the pin.
    Floating,
}

/// Something must have a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Test {
    /// What.
    pub name: Named,
    /// Which.
    pub compare: Compare,
    /// The value as it was written.
    pub text: String,
    /// Place of the value.
    pub pos: Pos,
}

/// All of these at the same time; at least one.
pub type Cond = Vec<Test>;

/// Bytes, and where they stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bytes {
    /// The bytes; at least one.
    pub bytes: Vec<u8>,
    /// Their place.
    pub pos: Pos,
}

/// When a step is done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum When {
    /// At once behind the step before.
    Next,
    /// This long after power-up, in a repetition after the start of the round.
    At(Span),
    /// This long after the step before.
    After(Span),
}

/// A step that is done again and again, beside those that follow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Every {
    /// From one time to the next.
    pub period: Span,
    /// How often; without it and `until` as long as the scenario lasts.
    pub times: Option<u64>,
    /// Up to when, counted as [`When::At`].
    pub until: Option<Span>,
}

/// What a step does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verb {
    /// Nothing: time passes.
    Pause,
    /// Values are given.
    Set(Vec<Assign>),
    /// Values are given, and the opposite ones after a time; of bits.
    Pulse(Vec<Assign>, Span),
    /// Bits change.
    Toggle(Vec<Named>),
    /// Values go from one number to another in a time, in steps of a time.
    Ramp {
        /// What, its first and its last value.
        what: Vec<(Named, Value, Value, Pos)>,
        /// How long it takes.
        over: Span,
        /// How often the value changes; a hundredth of `over` if nothing.
        grain: Option<Span>,
    },
    /// Bytes are sent to the machine.
    Send(Bytes),
    /// All of this is so; with a window, from its begin to its end.
    Expect(Cond, Option<(Span, Span)>),
    /// These bytes were received, or are within a time.
    ExpectUart(Bytes, Option<Span>),
    /// The steps that follow are done when all of this is so; within a time, or up to the limit.
    Wait(Cond, Option<Span>),
    /// From now on, or in a window, this is never so.
    Never(Cond, Option<(Span, Span)>),
    /// Steps are done several times.
    Repeat(u64, Vec<Step>),
    /// The whole machine is written to a file.
    Snapshot(Named),
    /// A line is told; `{NAME}` is the value of something.
    Log(Named),
    /// The supply goes off and on.
    PowerCycle,
}

/// A step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// Where it stands: its verb, or its first key.
    pub pos: Pos,
    /// What it is called in messages.
    pub name: Option<String>,
    /// When it is done.
    pub when: When,
    /// How often.
    pub every: Option<Every>,
    /// What it does.
    pub verb: Verb,
}

/// A scenario.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Scenario {
    /// Its file, for messages.
    pub file: String,
    /// The program that it is for.
    pub program: Option<Named>,
    /// The chip that it is for.
    pub mcu: Option<Named>,
    /// When it ends at the latest.
    pub limit: Option<Span>,
    /// Bits per second of what is sent to an image.
    pub baud: Option<(u64, Pos)>,
    /// The steps, in order.
    pub steps: Vec<Step>,
}
