//! The coverage rules: which outcomes of each element a check should see.

use ladder::{CounterKind, Element, FlowOp, LadderDialect, LadderOperand, LadderProgram, SerialTransfer, TimerKind};
use ladder_eval::Evaluator;

use crate::coverage::classes::CoverageClass;
use crate::coverage::instruction_rules::instruction_outcomes;
use crate::coverage::possible_outcomes::{FALSE_FALSE, FALSE_TRUE, TRUE_FALSE, TRUE_TRUE};

/// The condition of an outcome in addition to the rung bits. `usize` fields are symbol indices.
#[derive(Debug, Clone, Copy)]
pub(crate) enum OutcomeCondition {
    Always,
    /// The accumulator of the timer was not 0 when the scan began.
    TimerRan(usize),
    /// The counter changed by one.
    Counted(usize),
    /// The counter, of this many bytes, went from one end of its range to the other.
    Overflowed(usize, u8),
    /// The integer is within `least..=most` before and after the scan; if `ignores_value_after`, only
    /// before it, because the table writes its result into its own index.
    Within {
        symbol: usize,
        least: i64,
        most: i64,
        ignores_value_after: bool,
    },
    /// The value of the integer changed.
    Changed(usize),
    /// The program sent a byte.
    SentByte,
    /// A write to the EEPROM began.
    WroteEeprom,
    /// The circular counter went from its limit, or above it, to 0. The second field is the limit.
    Wrapped(usize, i32),
    /// The OR of the outputs at these elements has this value.
    Branch(bool),
}

/// An outcome: its text in the report, the set of (input, output) pairs that count, and a further condition.
pub(crate) type WantedOutcome = (&'static str, u8, OutcomeCondition);

/// The outcomes that a check should see of `element`, with its class; `None` for an element without outcomes.
#[rustfmt::skip]
pub(crate) fn wanted_outcomes(program: &LadderProgram, element: &Element, eval: &Evaluator, symbol: &dyn Fn(&str) -> usize) -> Option<(CoverageClass, Vec<WantedOutcome>)> {
    use OutcomeCondition::{Always, Changed, Counted, Overflowed, TimerRan, SentByte, Wrapped, WroteEeprom};
    const IN: u8 = TRUE_FALSE | TRUE_TRUE;
    const NOT_IN: u8 = FALSE_FALSE | FALSE_TRUE;
    const OUT: u8 = FALSE_TRUE | TRUE_TRUE;
    const NOT_OUT: u8 = FALSE_FALSE | TRUE_FALSE;
    const ANY: u8 = IN | NOT_IN;
    let acts = || vec![("acts", IN, Always), ("rests", NOT_IN, Always)];
    Some(match element {
        Element::Contacts { .. } => (CoverageClass::Contacts, vec![("passes", TRUE_TRUE, Always), ("blocks", TRUE_FALSE, Always)]),
        Element::Coil { negated, set, reset, ttrigger, .. } if *negated || !(*set || *reset || *ttrigger == Some(1)) => {
            let (one, zero) = if *negated { (NOT_IN, IN) } else { (IN, NOT_IN) };
            (CoverageClass::Coils, vec![("stores 1", one, Always), ("stores 0", zero, Always)])
        }
        Element::Coil { .. } => (CoverageClass::Coils, acts()),
        Element::Compare { .. } | Element::BitTest { .. } => (CoverageClass::Compares, vec![("is true", TRUE_TRUE, Always), ("is false", TRUE_FALSE, Always)]),
        Element::Timer { kind, name, .. } => {
            let t = symbol(name);
            (CoverageClass::Timers, match kind {
                TimerKind::Ton => vec![("expires", TRUE_TRUE, Always), ("runs", TRUE_FALSE, Always), ("is reset", FALSE_FALSE, TimerRan(t))],
                TimerKind::Tof => vec![("expires", FALSE_FALSE, Always), ("runs", FALSE_TRUE, Always), ("is reset", TRUE_TRUE, TimerRan(t))],
                TimerKind::Rtl => vec![("expires", OUT, Always), ("runs", FALSE_FALSE, Counted(t)), ("holds", TRUE_FALSE, TimerRan(t))],
                TimerKind::Tcy => vec![("is on", TRUE_TRUE, Always), ("is off", TRUE_FALSE, Always), ("is reset", FALSE_FALSE, TimerRan(t))],
                TimerKind::Thi => vec![("gives its pulse", OUT, Always), ("is over", TRUE_FALSE, Always), ("rests", FALSE_FALSE, Always)],
                TimerKind::Tlo => vec![("gives its pulse", NOT_OUT, Counted(t)), ("is over", FALSE_TRUE, Always), ("passes", TRUE_TRUE, Always)],
                TimerKind::Rto => vec![("expires", OUT, Always), ("runs", TRUE_FALSE, Counted(t)), ("holds", FALSE_FALSE, TimerRan(t))],
            })
        }
        // In ldmicro-5 a circular counter gives a carry.
        Element::Counter { kind: CounterKind::Ctc | CounterKind::Ctr, name, .. } if program.dialect == LadderDialect::Ldmicro5 => {
            (CoverageClass::Counters, vec![("counts", ANY, Counted(symbol(name))), ("carries", OUT, Always)])
        }
        Element::Counter { kind: CounterKind::Ctc, name, max, .. } => {
            let (c, max) = (symbol(name), if let LadderOperand::Const { value, .. } = max { *value as i32 } else { 0 });
            (CoverageClass::Counters, vec![("counts", TRUE_TRUE, Counted(c)), ("wraps", TRUE_TRUE, Wrapped(c, max))])
        }
        // In the dialect ldmicro-5 a counter stops at its limit.
        Element::Counter { name, .. } if program.dialect == LadderDialect::Ldmicro5 => {
            let c = symbol(name);
            (CoverageClass::Counters, vec![
                ("counts", ANY, Counted(c)), ("is at its limit", OUT, Always), ("is below its limit", NOT_OUT, Always),
            ])
        }
        Element::Counter { name, .. } => {
            let c = symbol(name);
            let bytes = eval.symbols().get(c).map_or(2, |s| s.bytes);
            (CoverageClass::Counters, vec![
                ("counts", IN, Counted(c)), ("wraps", IN, Overflowed(c, bytes)),
                ("is at its limit", OUT, Always), ("is below its limit", NOT_OUT, Always),
            ])
        }
        Element::Osr => (CoverageClass::OneShots, vec![("fires", TRUE_TRUE, Always), ("stays quiet on a true rung", TRUE_FALSE, Always)]),
        Element::Osf => (CoverageClass::OneShots, vec![("fires", FALSE_TRUE, Always), ("stays quiet on a false rung", FALSE_FALSE, Always)]),
        Element::Odr => (CoverageClass::OneShots, vec![("fires", TRUE_FALSE, Always), ("stays quiet on a true rung", TRUE_TRUE, Always)]),
        Element::Odf | Element::Osl => (CoverageClass::OneShots, vec![("gives 0 on a false rung", FALSE_FALSE, Always), ("gives 1 on a false rung", FALSE_TRUE, Always)]),
        Element::Osc => (CoverageClass::OneShots, vec![("is on", TRUE_TRUE, Always), ("is off on a true rung", TRUE_FALSE, Always)]),
        Element::MasterRelay => (CoverageClass::MasterRelays, vec![("has a true rung", IN, Always), ("has a false rung", NOT_IN, Always)]),
        Element::Res { .. } | Element::Move { .. } | Element::Math { .. } => (CoverageClass::Actions, acts()),
        Element::Unary { .. } | Element::Shift { .. } | Element::BitWrite { .. } | Element::Bus { .. } => (CoverageClass::Actions, acts()),
        Element::ShiftRegister { name, stages } => {
            let last = symbol(&format!("{name}{}", stages.saturating_sub(1)));
            let shifts = if *stages > 1 { Changed(last) } else { Always };
            (CoverageClass::ShiftRegisters, vec![("shifts", IN, shifts), ("rests", NOT_IN, Always)])
        }
        Element::LookUpTable { dest, index, values, .. } => {
            let last = values.len() as i64 - 1;
            let parts = [("reads its first value", 0, 0), ("reads its last value", last, last),
                ("is asked below its first value", i64::MIN, -1), ("is asked above its last value", last + 1, i64::MAX)];
            (CoverageClass::Tables, index_outcomes(eval, symbol, dest, index, &parts))
        }
        Element::PiecewiseLinear { dest, index, points, .. } => {
            let first = points.first().map_or(0, |p| p.x);
            let last = points.last().map_or(0, |p| p.x);
            let inner = points.get(1).map_or(0, |p| p.x);
            let mut parts = vec![("is asked below its first point", i64::MIN, first - 1), ("uses its first segment", first, inner),
                ("is asked above its last point", last + 1, i64::MAX)];
            parts.extend(points.windows(2).skip(1).map(|pair| match pair {
                [a, b] => ("uses every segment", a.x + 1, b.x),
                _ => ("uses every segment", last, last),
            }));
            (CoverageClass::Tables, index_outcomes(eval, symbol, dest, index, &parts))
        }
        Element::BusTransfer(_) => (CoverageClass::Peripherals, acts()),
        Element::ReadAdc { .. } | Element::SetPwm { .. } => (CoverageClass::Peripherals, acts()),
        Element::Persist { .. } => (CoverageClass::Peripherals, vec![("writes", IN, WroteEeprom), ("rests", NOT_IN, Always)]),
        Element::UartRecv { .. } => (CoverageClass::Serial, vec![("receives", TRUE_TRUE, Always), ("finds no byte", TRUE_FALSE, Always)]),
        Element::UartRecvAvail => (CoverageClass::Serial, vec![("finds a byte", TRUE_TRUE, Always), ("finds no byte", TRUE_FALSE, Always)]),
        Element::UartSendReady => (CoverageClass::Serial, vec![("finds it free", TRUE_TRUE, Always)]),
        Element::Pulser { .. } | Element::Npulse { .. } | Element::Stepper { .. } => (CoverageClass::Peripherals, vec![("runs", OUT, Always), ("rests", NOT_OUT, Always)]),
        Element::QuadEncod { counter, .. } => {
            let c = symbol(counter);
            (CoverageClass::Counters, vec![("steps", IN, Changed(c)), ("rests on a true rung", TRUE_FALSE, Always)])
        }
        // With `wait`, the element waits until its byte is sent, so the line is never busy afterwards.
        Element::UartSend { rest: Some(SerialTransfer { bytes: 1, wait: 1.. }), .. } => {
            (CoverageClass::Serial, vec![("sends", TRUE_FALSE, SentByte), ("rests", FALSE_FALSE, Always)])
        }
        Element::UartSend { .. } => {
            let mut goals = vec![("sends", TRUE_TRUE, SentByte), ("rests", FALSE_FALSE, Always)];
            // If a byte takes less than a scan, the line is never busy in the next scan.
            if byte_exceeds_scan(program) {
                goals.push(("is busy on a false rung", FALSE_TRUE, Always));
            }
            (CoverageClass::Serial, goals)
        }
        Element::FormattedString { text, quoted, .. } => {
            let length = ladder::format::split_format_string(text, *quoted).map_or(0, |pieces| pieces.len());
            let mut goals = vec![("rests", NOT_OUT, Always)];
            if length > 0 {
                goals.push(("sends", ANY, SentByte));
            }
            // The first byte is sent on a true rung; the string ends with the last byte.
            if length > 2 {
                goals.push(("sends on a false rung", FALSE_TRUE, SentByte));
            }
            (CoverageClass::Serial, goals)
        }
        Element::Flow { op: FlowOp::Goto | FlowOp::Gosub, .. } | Element::Return => (CoverageClass::Actions, acts()),
        Element::Segments { .. } | Element::TimeValue { .. } | Element::Random { .. } => (CoverageClass::Actions, acts()),
        Element::SeedRandom { .. } | Element::Lock | Element::NpulseOff => (CoverageClass::Actions, acts()),
        Element::Flow { .. } | Element::Delay { .. } | Element::Sleep | Element::ClearWatchdog | Element::Text { .. } => {
            return None;
        }
        Element::Instruction(step) => return instruction_outcomes(step, symbol),
        Element::Comment(_) | Element::Short | Element::Open | Element::Placeholder => return None,
    })
}

/// The outcomes of a table by ranges of its index. A table with a constant index has only one outcome.
fn index_outcomes(
    eval: &Evaluator,
    symbol: &dyn Fn(&str) -> usize,
    dest: &str,
    index: &LadderOperand,
    parts: &[(&'static str, i64, i64)],
) -> Vec<WantedOutcome> {
    let LadderOperand::Var(name) = index else {
        return vec![("acts", TRUE_FALSE | TRUE_TRUE, OutcomeCondition::Always)];
    };
    let (symbol, ignores_value_after) = (symbol(name), name == dest);
    // Ranges outside of what the index can hold are left out.
    let end = 1i64 << (8 * u32::from(eval.symbols().get(symbol).map_or(2, |s| s.bytes).clamp(1, 4)) - 1);
    let parts = parts.iter().filter(|(_, least, most)| least <= most && *least < end && *most >= -end);
    parts
        .map(|&(text, least, most)| {
            (text, TRUE_FALSE | TRUE_TRUE, OutcomeCondition::Within { symbol, least, most, ignores_value_after })
        })
        .collect()
}

/// Returns true if a byte on the serial line takes longer than a scan.
fn byte_exceeds_scan(program: &LadderProgram) -> bool {
    let (baud, cycle) = (program.settings.baud.unwrap_or(0), program.settings.cycle_us);
    u128::from(baud) * u128::from(cycle) < 10_000_000
}
