//! A scenario as it was read, every part with its place.

use diag::Pos;

use crate::time::TimeSpan;

/// A name or a text, and where it stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocatedText {
    /// The text.
    pub text: String,
    /// Its place.
    pub pos: Pos,
}

/// A value that something is given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScenarioValue {
    /// A whole number; true is 1, false 0.
    Number(i64),
    /// Anything else: `z`, `pullup`, `1.25V`.
    Text(String),
}

/// As it is written on a command line.
impl std::fmt::Display for ScenarioValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ScenarioValue::Number(number) => write!(f, "{number}"),
            ScenarioValue::Text(text) => f.write_str(text),
        }
    }
}

/// Something is given a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// What.
    pub name: LocatedText,
    /// The value.
    pub value: ScenarioValue,
    /// Place of the value.
    pub pos: Pos,
}

/// What a value must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// This number.
    Equal(i64),
    /// Another one.
    NotEqual(i64),
    /// From the first to the second, both included; an open end is that of `i64`.
    Within(i64, i64),
    /// Nothing drives the pin.
    Floating,
}

/// Something must have a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueCondition {
    /// What.
    pub name: LocatedText,
    /// Which.
    pub comparison: Comparison,
    /// The value as it was written.
    pub text: String,
    /// Place of the value.
    pub pos: Pos,
}

/// All of these at the same time; at least one.
pub type ConditionList = Vec<ValueCondition>;

/// Bytes, and where they stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocatedBytes {
    /// The bytes; at least one.
    pub bytes: Vec<u8>,
    /// Their place.
    pub pos: Pos,
}

/// When a step is done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepTime {
    /// At once behind the step before.
    Immediately,
    /// This long after power-up, in a repetition after the start of the round.
    At(TimeSpan),
    /// This long after the step before.
    AfterPrevious(TimeSpan),
}

/// A step that is done again and again, beside those that follow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repetition {
    /// From one time to the next.
    pub period: TimeSpan,
    /// How often; without it and `until` as long as the scenario lasts.
    pub times: Option<u64>,
    /// Up to when, counted as [`StepTime::At`].
    pub until: Option<TimeSpan>,
}

/// What a step does.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepAction {
    /// Nothing: time passes.
    Pause,
    /// Values are given.
    Set(Vec<Assignment>),
    /// Values are given, and the opposite ones after a time; of bits.
    Pulse(Vec<Assignment>, TimeSpan),
    /// Bits change.
    Toggle(Vec<LocatedText>),
    /// Values go from one number to another in a time, in steps of a time.
    Ramp {
        /// What, its first and its last value.
        targets: Vec<(LocatedText, ScenarioValue, ScenarioValue, Pos)>,
        /// How long it takes.
        over: TimeSpan,
        /// How often the value changes; a hundredth of `over` if nothing.
        grain: Option<TimeSpan>,
    },
    /// Bytes are sent to the machine.
    Send(LocatedBytes),
    /// All of this is so; with a window, from its begin to its end.
    Expect(ConditionList, Option<(TimeSpan, TimeSpan)>),
    /// These bytes were received, or are within a time.
    ExpectUart(LocatedBytes, Option<TimeSpan>),
    /// The steps that follow are done when all of this is so; within a time, or up to the limit.
    Wait(ConditionList, Option<TimeSpan>),
    /// From now on, or in a window, this is never so.
    Never(ConditionList, Option<(TimeSpan, TimeSpan)>),
    /// Steps are done several times.
    Repeat(u64, Vec<ScenarioStep>),
    /// The whole machine is written to a file.
    Snapshot(LocatedText),
    /// A line is told; `{NAME}` is the value of something.
    Log(LocatedText),
    /// The supply goes off and on.
    PowerCycle,
}

/// A step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioStep {
    /// Where it stands: its verb, or its first key.
    pub pos: Pos,
    /// What it is called in messages.
    pub name: Option<String>,
    /// When it is done.
    pub time: StepTime,
    /// How often.
    pub repetition: Option<Repetition>,
    /// What it does.
    pub action: StepAction,
}

/// A scenario.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Scenario {
    /// Its file, for messages.
    pub file: String,
    /// The program that it is for.
    pub program: Option<LocatedText>,
    /// The chip that it is for.
    pub mcu: Option<LocatedText>,
    /// When it ends at the latest.
    pub limit: Option<TimeSpan>,
    /// Bits per second of what is sent to an image.
    pub baud: Option<(u64, Pos)>,
    /// The steps, in order.
    pub steps: Vec<ScenarioStep>,
}
