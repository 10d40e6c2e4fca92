//! The model of a parsed scenario; every part has its position in the file.

use diag::Pos;

use crate::time::TimeSpan;

/// A name or a text with its position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocatedText {
    /// The text.
    pub text: String,
    /// Position in the file.
    pub pos: Pos,
}

/// A value for an input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ScenarioValue {
    /// An integer; `true` is 1, `false` is 0.
    Number(i64),
    /// Any other value, such as `z`, `pullup`, `1.25V`.
    Text(String),
}

/// Formats the value as it is written on a command line.
impl std::fmt::Display for ScenarioValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ScenarioValue::Number(number) => write!(f, "{number}"),
            ScenarioValue::Text(text) => f.write_str(text),
        }
    }
}

/// An assignment of a value to a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assignment {
    /// The name.
    pub name: LocatedText,
    /// The value.
    pub value: ScenarioValue,
    /// Position of the value.
    pub pos: Pos,
}

/// A comparison with the value of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// The value equals this number.
    Equal(i64),
    /// The value differs from this number.
    NotEqual(i64),
    /// The value is between the two numbers, both included; an open end is the minimum or maximum of `i64`.
    Within(i64, i64),
    /// Nothing drives the pin.
    Floating,
}

/// A condition on a named value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueCondition {
    /// The name.
    pub name: LocatedText,
    /// The comparison.
    pub comparison: Comparison,
    /// The comparison as written.
    pub text: String,
    /// Position of the comparison.
    pub pos: Pos,
}

/// Conditions that must hold at the same time; at least one.
pub type ConditionList = Vec<ValueCondition>;

/// Bytes with their position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LocatedBytes {
    /// The bytes; at least one.
    pub bytes: Vec<u8>,
    /// Position in the file.
    pub pos: Pos,
}

/// When a step is executed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepTime {
    /// Immediately after the previous step.
    Immediately,
    /// This long after power-up or, within a repetition, after the start of the round.
    At(TimeSpan),
    /// This long after the previous step.
    AfterPrevious(TimeSpan),
}

/// The repetition of a step, which continues in parallel with the steps that follow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repetition {
    /// Time from one execution to the next.
    pub period: TimeSpan,
    /// Number of executions; without it and without `until`, the step repeats until the scenario ends.
    pub times: Option<u64>,
    /// Time of the last possible execution, counted like [`StepTime::At`].
    pub until: Option<TimeSpan>,
}

/// An input that a ramp changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RampTarget {
    /// Name of the input.
    pub name: LocatedText,
    /// The first value.
    pub from: ScenarioValue,
    /// The last value.
    pub to: ScenarioValue,
    /// Position of the values.
    pub pos: Pos,
}

/// The action of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepAction {
    /// Waits for the time of the step.
    Pause,
    /// Sets inputs.
    Set(Vec<Assignment>),
    /// Sets bits, and sets them to the opposite values after a time.
    Pulse(Vec<Assignment>, TimeSpan),
    /// Inverts bits.
    Toggle(Vec<LocatedText>),
    /// Changes inputs linearly from one value to another.
    Ramp {
        /// The inputs that change.
        targets: Vec<RampTarget>,
        /// Duration of the ramp.
        over: TimeSpan,
        /// Time between two changes of the value; `None` is a hundredth of `over`.
        grain: Option<TimeSpan>,
    },
    /// Sends bytes to the machine.
    Send(LocatedBytes),
    /// Expects that all conditions hold: now or, with a window, from its start to its end.
    Expect(ConditionList, Option<(TimeSpan, TimeSpan)>),
    /// Expects that these bytes are received: now or within a time.
    ExpectUart(LocatedBytes, Option<TimeSpan>),
    /// Waits until all conditions hold: within a time, or up to the limit of the scenario.
    Wait(ConditionList, Option<TimeSpan>),
    /// Expects that the conditions never hold together: from now on, or in a window.
    Never(ConditionList, Option<(TimeSpan, TimeSpan)>),
    /// Executes steps several times.
    Repeat(u64, Vec<ScenarioStep>),
    /// Writes the state of the whole machine to a file.
    Snapshot(LocatedText),
    /// Logs a line, in which `{NAME}` is replaced by a value.
    Log(LocatedText),
    /// Switches the supply off and on.
    PowerCycle,
}

/// A step of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioStep {
    /// Position of the action, or of the first key.
    pub pos: Pos,
    /// The name of the step in messages.
    pub name: Option<String>,
    /// When the step is executed.
    pub time: StepTime,
    /// How often the step is repeated.
    pub repetition: Option<Repetition>,
    /// The action.
    pub action: StepAction,
}

/// A parsed scenario.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Scenario {
    /// Name of the file, for messages.
    pub file: String,
    /// The program that the scenario is for.
    pub program: Option<LocatedText>,
    /// The chip that the scenario is for.
    pub mcu: Option<LocatedText>,
    /// The time at which the scenario ends at the latest.
    pub limit: Option<TimeSpan>,
    /// Bits per second of the bytes that are sent to an image.
    pub baud: Option<(u64, Pos)>,
    /// The steps, in order.
    pub steps: Vec<ScenarioStep>,
}
