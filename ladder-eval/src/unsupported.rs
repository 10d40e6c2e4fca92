//! Reasons for which an element is not supported.

use std::borrow::Cow;

use ladder::format::BadEscape;

/// Why an element is not supported, with the values found and expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnsupportedReason {
    /// PLACEHOLDER: the rung is incomplete.
    #[error("an empty place: the rung is not complete")]
    EmptyPlace,
    /// The semantics do not define this element.
    #[error("this element has no meaning here")]
    NoMeaning,
    /// A coil drives an input.
    #[error("a coil drives an output Y or a relay R, and `{name}` is an input")]
    CoilOfInput {
        /// Name of the input.
        name: String,
    },
    /// A coil has more than one of the modes negated, set and reset.
    #[error("a coil is at most one of negated, set and reset")]
    ConflictingCoilModes,
    /// A name is not a symbol of the program.
    #[error("`{name}` is not a symbol of the program")]
    UnknownSymbol {
        /// The name.
        name: String,
    },
    /// An integer is used as a bit.
    #[error("`{name}` is not a bit: bits are named X, Y or R and are not integers elsewhere")]
    NotABit {
        /// Name of the integer.
        name: String,
    },
    /// A bit is used as an integer.
    #[error("`{name}` is a bit (a contact, a coil or a pin) and is used as an integer")]
    NotAnInteger {
        /// Name of the bit.
        name: String,
    },
    /// A constant does not fit the integers of the dialect.
    #[error("{what} is {value}, wanted {low} to {high}")]
    ConstantOutOfRange {
        /// Role of the constant, such as `a coordinate`.
        what: &'static str,
        /// Value of the constant.
        value: i64,
        /// Minimum of the dialect.
        low: i64,
        /// Maximum of the dialect.
        high: i64,
    },
    /// Only dialect ldmicro-5 supports this feature.
    #[error("{feature} belongs to dialect ldmicro-5")]
    NeedsDialect5 {
        /// The feature, such as `an adjust other than -1`.
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
    /// The name of a jump, a call or an end of a subprogram leads nowhere.
    #[error("`{label}` leads nowhere")]
    NoTarget {
        /// The name.
        label: String,
    },
    /// A jump goes into a subprogram or out of one.
    #[error("`{label}` is on the other side of a subprogram's border")]
    JumpAcross {
        /// The name.
        label: String,
    },
    /// A subprogram calls itself, or calls nest too deep or multiply too much.
    #[error("the subprogram `{label}` calls itself, or too many others")]
    CallsTooDeep {
        /// Name of the subprogram that is called.
        label: String,
    },
    /// A variable is used where only a constant is supported.
    #[error("the variable `{name}` as {role} has no meaning")]
    VariableAs {
        /// Name of the variable.
        name: String,
        /// Role of the variable, such as `a start value`.
        role: &'static str,
    },
    /// The delay of a timer gives a number of scans that the timer cannot count.
    #[error(
        "the timer counts {delay_us} us / {cycle_us} us {} {} = {scans} scans, wanted 1 to {most}",
        if *.adjust < 0 { '-' } else { '+' },
        .adjust.unsigned_abs()
    )]
    TimerOutOfRange {
        /// Delay in microseconds.
        delay_us: i64,
        /// Time of a scan in microseconds.
        cycle_us: u64,
        /// Scans added to the delay; may be negative.
        adjust: i128,
        /// Scans that the timer would count.
        scans: i128,
        /// Maximum number of scans that the timer can count.
        most: i128,
    },
    /// The element counts scans, but CYCLE is 0, so a scan has no fixed time.
    #[error("it needs a cycle time, and CYCLE is 0 (free running)")]
    NoCycleTime,
    /// A timer of IEC counts milliseconds, but a scan does not take whole ones.
    #[error("it counts milliseconds, and a scan takes {cycle_us} us")]
    FractionalCycle {
        /// Time of a scan in microseconds.
        cycle_us: u64,
    },
    /// The input kind of a counter is unknown.
    #[error("input kind `{kind}` has no meaning")]
    UnknownInputKind {
        /// Character of the input kind.
        kind: char,
    },
    /// An argument without support is not 0.
    #[error("its {what} is {value}, which has no meaning here; wanted 0")]
    ArgumentNotZero {
        /// Name of the argument.
        what: &'static str,
        /// Value of the argument.
        value: u32,
    },
    /// The reference of READ_ADC is unknown, or differs from that of another READ_ADC of the input.
    #[error("its reference selection is {refs}; wanted 0 to 3 in dialect ldmicro-5, one for each input")]
    UnsupportedReference {
        /// Value of the argument.
        refs: u32,
    },
    /// The symbol of READ_ADC is not an analog input.
    #[error("its name is not an analog input")]
    NotAnalogInput,
    /// The text of a FORMATTED_STRING has an invalid escape.
    #[error(transparent)]
    BadText(#[from] BadEscape),
    /// A text has a number but no variable, or a variable but no number.
    #[error("a text with a number needs its variable, and a text without one takes none")]
    TextVariableMismatch,
    /// A curve has fewer than two points.
    #[error("{points} point(s) make no segment, wanted at least 2")]
    TooFewPoints {
        /// Number of points.
        points: usize,
    },
    /// The x coordinates of a curve are not increasing.
    #[error("x = {x} follows x = {before}, but x must rise")]
    PointsNotAscending {
        /// x of the previous point.
        before: i32,
        /// x of this point.
        x: i32,
    },
    /// A segment of a curve overflows the arithmetic.
    #[error("the segment of {dx} by {dy} does not fit -{limit} to {limit}")]
    SegmentTooLarge {
        /// Extent in x.
        dx: i64,
        /// Extent in y.
        dy: i64,
        /// Maximum of the product of both.
        limit: i64,
    },
    /// The frequency of SET_PWM is 0, too large, or a variable.
    #[error("its frequency is no constant of at least 1 Hz")]
    BadPwmFrequency,
    /// The frequency of NPULSE is a variable, 0, or too high for scans.
    #[error("half a pulse of NPULSE must take at least one scan of {cycle_us} us, and the frequency be constant")]
    BadPulseFrequency {
        /// Time of a scan in microseconds.
        cycle_us: u64,
    },
    /// The resolution of SET_PWM is not percent.
    #[error("the resolution `{resolution}` has no meaning here; wanted 0-100")]
    UnknownResolution {
        /// Resolution as written in the program.
        resolution: String,
    },
    /// Two SET_PWM of an output have different frequencies, or one names an output and another does not.
    #[error("another SET_PWM of the output has another frequency, or only one of two names an output")]
    ConflictingPwm,
    /// An element of the serial line transfers more bytes than its integer has, or waits.
    #[error("{bytes} byte(s) with wait {wait} have no meaning here; wanted 1 to {most} without waiting")]
    UnsupportedSerialTransfer {
        /// Number of bytes to transfer.
        bytes: u32,
        /// Wait flag; 0 means no.
        wait: u32,
        /// Most bytes that the integer allows.
        most: u8,
    },
    /// An element of a bus has an argument that is not supported.
    #[error("a bus has a master with a constant address, the highest bit first, and on SPI mode 0 and 8 bits")]
    UnsupportedBus,
    /// The serial line has no rate, because BAUD= is missing or 0.
    #[error("the serial line has no rate: BAUD= is missing or 0")]
    NoBaudRate,
}
