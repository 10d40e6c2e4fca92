//! Kinds of timers and counters, and operations on integers, named by their LDmicro keywords.

/// Kind of timer, by LDmicro's keyword.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TimerKind {
    /// Turn-on delay.
    Ton,
    /// Turn-off delay.
    Tof,
    /// Retentive turn-on delay.
    Rto,
    /// Retentive turn-on delay of a rung that is false (LDmicro 5).
    Rtl,
    /// Cyclic on and off (LDmicro 5).
    Tcy,
    /// One pulse of ones (LDmicro 5).
    Thi,
    /// One pulse of zeros (LDmicro 5).
    Tlo,
}

/// Kind of counter, by LDmicro's keyword.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CounterKind {
    /// Counts up.
    Ctu,
    /// Counts down.
    Ctd,
    /// Circular, up.
    Ctc,
    /// Circular, down (LDmicro 5).
    Ctr,
}

/// LDmicro 5's elements that name a place of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FlowOp {
    /// `LABEL`: marks its rung as a target.
    Label,
    /// `GOTO`: goes on at a rung.
    Goto,
    /// `GOSUB`: executes a subprogram.
    Gosub,
    /// `SUBPROG`: begins a subprogram.
    Subprogram,
    /// `ENDSUB`: ends a subprogram.
    EndSubprogram,
}
