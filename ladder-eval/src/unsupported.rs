//! Why an element has no meaning.

use std::borrow::Cow;

use ladder::format::BadEscape;

/// Why an element has no meaning here, with the values found and wanted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnsupportedReason {
    /// A place of the rung has no element.
    #[error("an empty place: the rung is not complete")]
    EmptyPlace,
    /// No section of the semantics is about this element.
    #[error("this element has no meaning here")]
    NoMeaning,
    /// A coil drives an input.
    #[error("a coil drives an output Y or a relay R, and `{name}` is an input")]
    CoilOfInput {
        /// The input.
        name: String,
    },
    /// A coil is two of negated, set and reset.
    #[error("a coil is at most one of negated, set and reset")]
    ConflictingCoilModes,
    /// A name stands for nothing.
    #[error("`{name}` is no symbol of the program")]
    UnknownSymbol {
        /// The name.
        name: String,
    },
    /// An integer is used as a bit.
    #[error("`{name}` is not a bit: bits are named X, Y or R and are no integers elsewhere")]
    NotABit {
        /// The integer.
        name: String,
    },
    /// A bit is used as an integer.
    #[error("`{name}` is a bit (a contact, a coil or a pin) and is used as an integer")]
    NotAnInteger {
        /// The bit.
        name: String,
    },
    /// A constant does not fit the integers of the dialect.
    #[error("{what} is {value}, wanted {low} to {high}")]
    ConstantOutOfRange {
        /// What the constant is, such as `a coordinate`.
        what: &'static str,
        /// The constant.
        value: i64,
        /// The least of the dialect.
        low: i64,
        /// The most of the dialect.
        high: i64,
    },
    /// The dialect of the program has no meaning for it, and ldmicro-5 has.
    #[error("{feature} belongs to dialect ldmicro-5")]
    NeedsDialect5 {
        /// What needs the dialect, such as `an adjust other than -1`.
        feature: Cow<'static, str>,
    },
    /// A constant shifts by more bits than there are, or by a negative number.
    #[error("a shift by {count} bits, of a number of {bits}")]
    ShiftOutOfRange {
        /// The count.
        count: i64,
        /// Bits of what is shifted.
        bits: u32,
    },
    /// A variable stands where only a constant has a meaning.
    #[error("the variable `{name}` as {role} has no meaning")]
    VariableAs {
        /// The variable.
        name: String,
        /// What it stands for, such as `a start value`.
        role: &'static str,
    },
    /// The delay of a timer is a variable.
    #[error("a delay held in a variable has no meaning")]
    DelayInVariable,
    /// The delay of a timer is no count of scans that the timer can hold.
    #[error(
        "the timer counts {delay_us} us / {cycle_us} us {} {} = {scans} scans, wanted 1 to {most}",
        if *.adjust < 0 { '-' } else { '+' },
        .adjust.unsigned_abs()
    )]
    TimerOutOfRange {
        /// The delay in microseconds.
        delay_us: i64,
        /// The time of a scan in microseconds.
        cycle_us: u64,
        /// Scans that are added.
        adjust: i128,
        /// Scans that the timer would count.
        scans: i128,
        /// Most scans that it can count.
        most: i128,
    },
    /// It counts scans, and they have no time.
    #[error("it needs a cycle time, and CYCLE is 0 (free running)")]
    NoCycleTime,
    /// The input of a counter is of no known kind.
    #[error("input kind `{kind}` has no meaning")]
    UnknownInputKind {
        /// The letter of the kind.
        kind: char,
    },
    /// An argument that has a meaning nowhere here is not 0.
    #[error("its {what} is {value}, which has no meaning here; wanted 0")]
    ArgumentNotZero {
        /// Which argument.
        what: &'static str,
        /// Its value.
        value: u32,
    },
    /// READ_ADC names no analog input.
    #[error("its name is no analog input")]
    NotAnalogInput,
    /// The text of a FORMATTED_STRING has a bad escape.
    #[error(transparent)]
    BadText(#[from] BadEscape),
    /// A text has a number and no variable, or a variable and no number.
    #[error("a text with a number needs its variable, and a text without one takes none")]
    TextVariableMismatch,
    /// A curve has no segment.
    #[error("{points} point(s) make no segment, wanted at least 2")]
    TooFewPoints {
        /// How many points it has.
        points: usize,
    },
    /// The points of a curve are not in ascending order.
    #[error("x = {x} follows x = {before}, but x must rise")]
    PointsNotAscending {
        /// The x of the point before.
        before: i32,
        /// The x of the point.
        x: i32,
    },
    /// A segment of a curve is too large for the arithmetic.
    #[error("the segment of {dx} by {dy} does not fit -{limit} to {limit}")]
    SegmentTooLarge {
        /// Its extent in x.
        dx: i64,
        /// Its extent in y.
        dy: i64,
        /// The most that the product may be.
        limit: i64,
    },
    /// The frequency of SET_PWM is 0, too large, or a variable.
    #[error("its frequency is no constant of at least 1 Hz")]
    BadPwmFrequency,
    /// The resolution of SET_PWM is not percent.
    #[error("the resolution `{resolution}` has no meaning here; wanted 0-100")]
    UnknownResolution {
        /// The resolution as the program has it.
        resolution: String,
    },
    /// Two SET_PWM differ, and share an output.
    #[error("another SET_PWM of the program has another frequency or output, and there is one output")]
    ConflictingPwm,
    /// An element of the serial line takes several bytes, or waits.
    #[error("{bytes} byte(s) with wait {wait} have no meaning here; wanted 1 and 0")]
    UnsupportedSerialTransfer {
        /// Bytes that it transfers.
        bytes: u32,
        /// Whether it waits: 0 for no.
        wait: u32,
    },
    /// The serial line has no rate.
    #[error("the serial line has no rate: BAUD= is missing or 0")]
    NoBaudRate,
}
