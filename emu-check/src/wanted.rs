//! What of a program counts as covered: for each element, what it should be seen doing.

use ladder::{CounterKind, Dialect, Element, Operand, Program, TimerKind};
use ladder_eval::Evaluator;

use crate::coverage::Class;
use crate::reach::{P00, P01, P10, P11};

/// What must hold besides the rung bits.
#[derive(Debug, Clone, Copy)]
pub(crate) enum When {
    Always,
    /// The accumulator was not 0 when the scan began.
    Ran(usize),
    /// The counter moved by one.
    Counted(usize),
    /// The counter, of so many bytes, went from one end of them to the other.
    Overflowed(usize, u8),
    /// The integer is in these bounds, before the scan and after it (of a table that writes its own index: before it).
    Within {
        symbol: usize,
        least: i64,
        most: i64,
        own: bool,
    },
    /// The integer is something else.
    Changed(usize),
    /// The program sent a byte.
    Sent,
    /// A write to the EEPROM began.
    Wrote,
    /// The circular counter went from its limit (or above) to 0.
    Wrapped(usize, i32),
    /// The OR of the outs at these elements is this.
    Branch(bool),
}

/// What it says in the report, the (in, out) that count, and what must hold besides.
pub(crate) type Wanted = (&'static str, u8, When);

/// What an element should be seen doing.
#[rustfmt::skip]
pub(crate) fn wanted(program: &Program, element: &Element, eval: &Evaluator, symbol: &dyn Fn(&str) -> usize) -> Option<(Class, Vec<Wanted>)> {
    use When::{Always, Changed, Counted, Overflowed, Ran, Sent, Wrapped, Wrote};
    const IN: u8 = P10 | P11;
    const NOT_IN: u8 = P00 | P01;
    const OUT: u8 = P01 | P11;
    const NOT_OUT: u8 = P00 | P10;
    const ANY: u8 = IN | NOT_IN;
    let acts = || vec![("acts", IN, Always), ("rests", NOT_IN, Always)];
    Some(match element {
        Element::Contacts { .. } => (Class::Contacts, vec![("passes", P11, Always), ("blocks", P10, Always)]),
        Element::Coil { set: false, reset: false, negated, .. } => {
            let (one, zero) = if *negated { (NOT_IN, IN) } else { (IN, NOT_IN) };
            (Class::Coils, vec![("stores 1", one, Always), ("stores 0", zero, Always)])
        }
        Element::Coil { .. } => (Class::Coils, acts()),
        Element::Compare { .. } => (Class::Compares, vec![("is true", P11, Always), ("is false", P10, Always)]),
        Element::Timer { kind, name, .. } => {
            let t = symbol(name);
            (Class::Timers, match kind {
                TimerKind::Ton => vec![("expires", P11, Always), ("runs", P10, Always), ("is reset", P00, Ran(t))],
                TimerKind::Tof => vec![("expires", P00, Always), ("runs", P01, Always), ("is reset", P11, Ran(t))],
                TimerKind::Rto => vec![("expires", OUT, Always), ("runs", P10, Counted(t)), ("holds", P00, Ran(t))],
            })
        }
        Element::Counter { kind: CounterKind::Ctc, name, max, .. } => {
            let (c, max) = (symbol(name), if let Operand::Const { value, .. } = max { *value as i32 } else { 0 });
            (Class::Counters, vec![("counts", P11, Counted(c)), ("wraps", P11, Wrapped(c, max))])
        }
        // In ldmicro-5 a counter stops at its limit.
        Element::Counter { name, .. } if program.dialect == Dialect::Ldmicro5 => {
            let c = symbol(name);
            (Class::Counters, vec![
                ("counts", ANY, Counted(c)), ("is at its limit", OUT, Always), ("is below its limit", NOT_OUT, Always),
            ])
        }
        Element::Counter { name, .. } => {
            let c = symbol(name);
            let bytes = eval.symbols().get(c).map_or(2, |s| s.bytes);
            (Class::Counters, vec![
                ("counts", IN, Counted(c)), ("wraps", IN, Overflowed(c, bytes)),
                ("is at its limit", OUT, Always), ("is below its limit", NOT_OUT, Always),
            ])
        }
        Element::Osr => (Class::OneShots, vec![("fires", P11, Always), ("stays quiet on a true rung", P10, Always)]),
        Element::Osf => (Class::OneShots, vec![("fires", P01, Always), ("stays quiet on a false rung", P00, Always)]),
        Element::MasterRelay => (Class::MasterRelays, vec![("has a true rung", IN, Always), ("has a false rung", NOT_IN, Always)]),
        Element::Res { .. } | Element::Move { .. } | Element::Math { .. } => (Class::Actions, acts()),
        Element::ShiftRegister { name, stages } => {
            let last = symbol(&format!("{name}{}", stages.saturating_sub(1)));
            let shifts = if *stages > 1 { Changed(last) } else { Always };
            (Class::ShiftRegisters, vec![("shifts", IN, shifts), ("rests", NOT_IN, Always)])
        }
        Element::LookUpTable { dest, index, values, .. } => {
            let last = values.len() as i64 - 1;
            let parts = [("reads its first value", 0, 0), ("reads its last value", last, last),
                ("is asked below its first value", i64::MIN, -1), ("is asked above its last value", last + 1, i64::MAX)];
            (Class::Tables, within(eval, symbol, dest, index, &parts))
        }
        Element::PiecewiseLinear { dest, index, points } => {
            let first = points.first().map_or(0, |p| p.0);
            let last = points.last().map_or(0, |p| p.0);
            let inner = points.get(1).map_or(0, |p| p.0);
            let mut parts = vec![("is asked below its first point", i64::MIN, first - 1), ("uses its first segment", first, inner),
                ("is asked above its last point", last + 1, i64::MAX)];
            parts.extend(points.windows(2).skip(1).map(|pair| match pair {
                [a, b] => ("uses every segment", a.0 + 1, b.0),
                _ => ("uses every segment", last, last),
            }));
            (Class::Tables, within(eval, symbol, dest, index, &parts))
        }
        Element::ReadAdc { .. } | Element::SetPwm { .. } => (Class::Peripherals, acts()),
        Element::Persist { .. } => (Class::Peripherals, vec![("writes", IN, Wrote), ("rests", NOT_IN, Always)]),
        Element::UartRecv { .. } => (Class::Serial, vec![("receives", P11, Always), ("finds no byte", P10, Always)]),
        Element::UartSend { .. } => {
            let mut goals = vec![("sends", P11, Sent), ("rests", P00, Always)];
            // Where a byte is over within its scan the line is never busy in the next.
            if byte_lasts(program) {
                goals.push(("is busy on a false rung", P01, Always));
            }
            (Class::Serial, goals)
        }
        Element::FormattedString { text, quoted, .. } => {
            let length = ladder::format::pieces(text, *quoted).map_or(0, |pieces| pieces.len());
            let mut goals = vec![("rests", NOT_OUT, Always)];
            if length > 0 {
                goals.push(("sends", ANY, Sent));
            }
            // The first one goes on a true rung, and with the last one the string is over.
            if length > 2 {
                goals.push(("sends on a false rung", P01, Sent));
            }
            (Class::Serial, goals)
        }
        _ => return None,
    })
}

/// The parts of a table, by bounds of its index; a constant index has but one, and that needs no goal.
fn within(
    eval: &Evaluator,
    symbol: &dyn Fn(&str) -> usize,
    dest: &str,
    index: &Operand,
    parts: &[(&'static str, i64, i64)],
) -> Vec<Wanted> {
    let Operand::Var(name) = index else { return vec![("acts", P10 | P11, When::Always)] };
    let (symbol, own) = (symbol(name), name == dest);
    // Parts that lie outside of what the index can hold are none.
    let end = 1i64 << (8 * u32::from(eval.symbols().get(symbol).map_or(2, |s| s.bytes).clamp(1, 4)) - 1);
    let parts = parts.iter().filter(|(_, least, most)| least <= most && *least < end && *most >= -end);
    parts.map(|&(says, least, most)| (says, P10 | P11, When::Within { symbol, least, most, own })).collect()
}

/// A byte on the line takes longer than a scan.
fn byte_lasts(program: &Program) -> bool {
    let (baud, cycle) = (program.settings.baud.unwrap_or(0), program.settings.cycle_us);
    u128::from(baud) * u128::from(cycle) < 10_000_000
}
