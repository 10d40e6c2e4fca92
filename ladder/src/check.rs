//! What is wrong with a program that reads well: errors that keep it from being run, and warnings.

use diag::{Diagnostic, Pos, Severity};

use crate::chips;
use crate::codes;
use crate::model::{Dialect, Element, ElementId, MathOp, Node, Operand, Program, TimerKind};
use crate::whole;
use crate::write::element_text;

/// Checks a program against its dialect. Errors mean that it cannot be evaluated or compiled; the list is sorted by
/// place. Every message about an element names it as `rung N, element M` with its text.
#[must_use]
pub fn check(program: &Program) -> Vec<Diagnostic> {
    let mut found = Checker { program, diagnostics: Vec::new() };
    if program.settings.cycle_us == 0 {
        let cause = "CYCLE=0: the scan has no fixed time";
        found.whole(Severity::Error, codes::CYCLE_ZERO, cause, "choose a cycle, such as CYCLE=10000");
    }
    pins(&mut found);
    for (id, element, pos) in program.elements() {
        one(&mut found, At { id, element, pos });
    }
    for (index, rung) in (0..).zip(&program.rungs) {
        let mut next = ElementId { rung: index, index: 0 };
        last(&mut found, &rung.series, true, &mut next);
    }
    whole::names(&mut found);
    if program.dialect == Dialect::Ldmicro5 {
        whole::ldmicro5(&mut found);
    }
    found.diagnostics.sort_by_key(|d| d.pos);
    found.diagnostics
}

/// The largest count of scans that a timer can hold.
const MAX_COUNT: u128 = 32767;

#[derive(Clone, Copy)]
pub(crate) struct At<'a> {
    pub id: ElementId,
    pub element: &'a Element,
    pub pos: Pos,
}

pub(crate) struct Checker<'a> {
    pub program: &'a Program,
    diagnostics: Vec<Diagnostic>,
}

impl Checker<'_> {
    fn whole(&mut self, severity: Severity, code: &'static str, cause: impl Into<String>, hint: impl Into<String>) {
        let new = Diagnostic::new(severity, code, &self.program.file, Pos::default(), cause, hint);
        self.diagnostics.push(new);
    }

    pub fn error(&mut self, code: &'static str, at: At<'_>, cause: impl AsRef<str>, hint: impl Into<String>) {
        self.tell(Severity::Error, code, at, cause.as_ref(), hint);
    }

    pub fn warning(&mut self, code: &'static str, at: At<'_>, cause: impl AsRef<str>, hint: impl Into<String>) {
        self.tell(Severity::Warning, code, at, cause.as_ref(), hint);
    }

    pub fn tell(&mut self, severity: Severity, code: &'static str, at: At<'_>, cause: &str, hint: impl Into<String>) {
        let cause = format!("{} ({}): {cause}", at.id, crate::reader::shown(&element_text(at.element)));
        self.diagnostics.push(Diagnostic::new(severity, code, &self.program.file, at.pos, cause, hint));
    }
}

/// Pins that the chip's package does not have, where the package is known.
fn pins(found: &mut Checker<'_>) {
    let program = found.program;
    let Some(micro) = program.settings.micro.as_deref().filter(|m| chips::knows_pins(m)) else { return };
    for entry in program.io.iter().filter(|e| e.pin != 0 && chips::package_pin(micro, e.pin).is_none()) {
        let cause = format!("{}: pin {} of {micro} is no port pin", entry.name, entry.pin);
        let hint = "choose a port pin, or 0 for not assigned";
        let new = Diagnostic::new(Severity::Warning, codes::NO_PORT_PIN, &program.file, entry.pos, cause, hint);
        found.diagnostics.push(new);
    }
}

/// What can be told from one element alone.
fn one(found: &mut Checker<'_>, at: At<'_>) {
    match at.element {
        Element::Placeholder => {
            found.error(codes::PLACEHOLDER, at, "an empty place is left", "put an element here or remove it");
        }
        Element::Contacts { set1: Some(1..), .. } => {
            let cause = "the flag `set1` must be 0";
            found.error(codes::FLAG_LDMICRO5, at, cause, "write 0 or leave it out");
        }
        Element::Coil { negated, set, reset, ttrigger, .. } => {
            if ttrigger.is_some_and(|t| t != 0) {
                found.error(codes::FLAG_LDMICRO5, at, "the flag `ttrigger` must be 0", "write 0 or leave it out");
            }
            let flags = u8::from(*negated) + u8::from(*set) + u8::from(*reset);
            if flags > 1 {
                let cause = format!("{flags} of negated, set and reset are 1, at most one may be");
                found.error(codes::COIL_FLAGS, at, cause, "choose one of them");
            }
        }
        Element::Timer { kind, delay, adjust, .. } => timer(found, at, *kind, delay, adjust.as_ref()),
        Element::Counter { max, init, input, .. } => counter(found, at, max, init.as_ref(), *input),
        Element::Math { op: MathOp::Div, op2: Operand::Const { value: 0, .. }, .. } => {
            let cause = "divides by 0, which gives -1 for a dividend from 0 and 1 below";
            found.warning(codes::DIVISION_BY_ZERO, at, cause, "test the divisor first");
        }
        Element::LookUpTable { dest, index: Operand::Var(index), .. } if dest == index => alias(found, at, dest),
        Element::PiecewiseLinear { dest, index, points } => {
            if *index == Operand::Var(dest.clone()) {
                alias(found, at, dest);
            }
            for pair in points.windows(2) {
                if let [(a, _), (b, _)] = pair
                    && a >= b
                {
                    let cause = format!("x = {b} follows x = {a}, but x must rise");
                    found.error(codes::NOT_RISING, at, cause, "sort the points by x, each x once");
                }
            }
        }
        Element::ReadAdc { refs: Some(1..), .. } => only5(found, at, "the reference selection"),
        Element::SetPwm { output: Some(_), .. } => only5(found, at, "the choice of the output"),
        Element::UartRecv { rest: Some(rest), .. } | Element::UartSend { rest: Some(rest), .. } if *rest != (1, 0) => {
            only5(found, at, "another choice than one byte without waiting");
        }
        Element::FormattedString { text, quoted: false, .. } => {
            if let Some(code) = text.chars().map(u32::from).find(|c| *c < 32) {
                let cause = format!("the character code {code} is read as X");
                found.warning(codes::STRING_CODE, at, cause, "write a backslash escape, such as 92 110 for a new line");
            }
        }
        _ => {}
    }
}

fn alias(found: &mut Checker<'_>, at: At<'_>, dest: &str) {
    let cause = format!("{dest} is both index and result; LDmicro's own compilers get this wrong");
    found.warning(codes::TABLE_ALIAS, at, cause, "use another variable for the result");
}

/// An argument that may not say anything but what release 2.3 does.
fn only5(found: &mut Checker<'_>, at: At<'_>, what: &str) {
    if found.program.dialect == Dialect::Ldmicro23 {
        let cause = format!("{what} has a meaning in LDmicro 5 only");
        found.error(codes::ARGUMENT_LDMICRO5, at, cause, "leave the argument out");
    }
}

fn timer(found: &mut Checker<'_>, at: At<'_>, kind: TimerKind, delay: &Operand, adjust: Option<&Operand>) {
    if found.program.dialect == Dialect::Ldmicro5 {
        return refuse(found, at, crate::write::timer(kind));
    }
    // In release 2.3 one scan is taken off the delay, which LDmicro 5 writes as an adjust of -1.
    if adjust.is_some_and(|a| !matches!(a, Operand::Const { value: -1, .. })) {
        only5(found, at, "an adjust other than -1");
    }
    let cycle = u128::from(found.program.settings.cycle_us);
    let Operand::Const { value, .. } = delay else {
        return only5(found, at, "a variable as the delay");
    };
    let Ok(delay) = u128::try_from(*value) else {
        let cause = format!("the delay of {value} us is negative");
        return found.error(codes::TIMER_RANGE, at, cause, "choose a positive delay");
    };
    if cycle == 0 {
        return;
    }
    let scans = delay / cycle;
    if !(2..=MAX_COUNT + 1).contains(&scans) {
        // The longest delay is the last microsecond that is still rounded down to the largest count.
        let (shortest, longest) = (2 * cycle, (MAX_COUNT + 2) * cycle - 1);
        let p = scans as i128 - 1;
        let cause = format!(
            "a delay of {delay} us at a cycle of {cycle} us gives P = {p}, allowed is 1 to {MAX_COUNT}: {shortest} us to {longest} us"
        );
        return found.error(codes::TIMER_RANGE, at, cause, "change the delay or CYCLE=");
    }
    if delay % cycle != 0 {
        let cause = format!(
            "the delay of {delay} us is no multiple of the cycle of {cycle} us: it is cut to {} us",
            scans * cycle
        );
        let hint = format!("write {} or {}", scans * cycle, (scans + 1) * cycle);
        found.warning(codes::TRUNCATED, at, cause, hint);
    }
}

fn counter(found: &mut Checker<'_>, at: At<'_>, max: &Operand, init: Option<&Operand>, input: Option<char>) {
    if let Operand::Var(_) = max {
        only5(found, at, "a variable as the limit");
    }
    if init.is_some_and(|i| !matches!(i, Operand::Const { value: 0, .. })) {
        only5(found, at, "a start value other than 0");
    }
    if input.is_some_and(|kind| kind != '/') {
        only5(found, at, "an input kind other than /");
    }
}

/// Elements that may only end their path to the right rail.
pub(crate) const fn must_be_last(element: &Element) -> bool {
    matches!(
        element,
        Element::Coil { .. }
            | Element::Res { .. }
            | Element::Move { .. }
            | Element::Math { .. }
            | Element::ShiftRegister { .. }
            | Element::LookUpTable { .. }
            | Element::PiecewiseLinear { .. }
            | Element::ReadAdc { .. }
            | Element::SetPwm { .. }
            | Element::MasterRelay
            | Element::Persist { .. }
    )
}

/// Walks a series whose right end is (or is not) the right rail.
fn last(found: &mut Checker<'_>, series: &[Node], at_rail: bool, next: &mut ElementId) {
    // A comment is no part of the circuit, so it does not separate an element from the rail.
    let end = series.iter().rposition(|n| !matches!(n, Node::Leaf(Element::Comment(_), _)));
    for (i, node) in series.iter().enumerate() {
        let at_rail = at_rail && end.is_none_or(|end| i >= end);
        match node {
            Node::Leaf(element, pos) => {
                if must_be_last(element) && !at_rail {
                    let at = At { id: *next, element, pos: *pos };
                    let cause = "must be the last element before the right rail, but something follows it";
                    found.error(
                        codes::NOT_LAST,
                        at,
                        cause,
                        "put it in a parallel branch at the end, or in a rung of its own",
                    );
                }
                next.index += 1;
            }
            Node::Parallel(branches, _) => branches.iter().for_each(|b| last(found, b, at_rail, next)),
        }
    }
}

pub(crate) fn refuse(found: &mut Checker<'_>, at: At<'_>, keyword: &str) {
    let cause = format!("{keyword} means something else in ldmicro-5, which is not built yet");
    found.error(codes::DIALECT, at, cause, "choose the dialect ldmicro-2.3 if the program was made for it");
}
