//! Semantic checks of a parsed program: errors that prevent evaluation and compilation, and warnings.

use diag::{Diagnostic, Pos, Severity};

use crate::bit_checks;
use crate::bus_elements;
use crate::codes;
use crate::flow_checks;
use crate::integer_widths::{self, IntegerWidths};
use crate::model::{
    Element, ElementId, LadderDialect, LadderOperand, LadderProgram, MathOp, ProgramElement, RungNode, SegmentDisplay,
    TimerKind,
};
use crate::packages;
use crate::peripheral_checks;
use crate::program_checks;
use crate::register_checks;
use crate::write::element_text;

/// Checks a program against the rules of its dialect.
///
/// A program of dialect IEC was checked when it was read.
///
/// An error means that the program cannot be evaluated or compiled. The list is sorted by position. Every
/// message about an element names it as `rung N, element M`, followed by its text.
#[must_use]
pub fn check(program: &LadderProgram) -> Vec<Diagnostic> {
    if program.dialect == LadderDialect::Iec {
        // `il::to_ladder` has checked it.
        return Vec::new();
    }
    let mut found = Checker { program, widths: IntegerWidths::new(program), diagnostics: Vec::new() };
    if program.settings.cycle_us == 0 {
        let cause = "CYCLE=0: the scan has no fixed time";
        found.report_program(Severity::Error, codes::CYCLE_ZERO, cause, "choose a cycle, such as CYCLE=10000");
    }
    check_pins(&mut found);
    program_checks::check_head(&mut found);
    for at in program.elements() {
        check_element(&mut found, at);
    }
    for (index, rung) in (0..).zip(&program.rungs) {
        let mut next = ElementId { rung: index, index: 0 };
        check_last_elements(&mut found, &rung.series, true, &mut next);
    }
    program_checks::check_names(&mut found);
    flow_checks::check_flow(&mut found);
    peripheral_checks::check_pwm(&mut found);
    register_checks::check_registers(&mut found);
    found.diagnostics.sort_by_key(|d| d.pos);
    found.diagnostics
}

/// The program under check and the diagnostics found so far.
pub(crate) struct Checker<'a> {
    pub program: &'a LadderProgram,
    /// Widths of the integers of the program.
    pub widths: IntegerWidths<'a>,
    /// What has been found so far.
    pub(crate) diagnostics: Vec<Diagnostic>,
}

impl Checker<'_> {
    fn report_program(
        &mut self,
        severity: Severity,
        code: &'static str,
        cause: impl Into<String>,
        hint: impl Into<String>,
    ) {
        let new = Diagnostic::new(severity, code, &self.program.file, Pos::default(), cause, hint);
        self.diagnostics.push(new);
    }

    /// Adds an error about an element.
    pub(crate) fn error(
        &mut self,
        code: &'static str,
        at: ProgramElement<'_>,
        cause: impl AsRef<str>,
        hint: impl Into<String>,
    ) {
        self.report(Severity::Error, code, at, cause.as_ref(), hint);
    }

    /// Adds a warning about an element.
    pub(crate) fn warning(
        &mut self,
        code: &'static str,
        at: ProgramElement<'_>,
        cause: impl AsRef<str>,
        hint: impl Into<String>,
    ) {
        self.report(Severity::Warning, code, at, cause.as_ref(), hint);
    }

    /// Adds a diagnostic about an element; the message names the element and its text.
    pub(crate) fn report(
        &mut self,
        severity: Severity,
        code: &'static str,
        at: ProgramElement<'_>,
        cause: &str,
        hint: impl Into<String>,
    ) {
        let cause = format!("{} ({}): {cause}", at.id, crate::reader::message_text(&element_text(at.element)));
        self.diagnostics.push(Diagnostic::new(severity, code, &self.program.file, at.pos, cause, hint));
    }
}

/// Warns about pins that are no port pins of the chip's package, if the package is known.
fn check_pins(checker: &mut Checker<'_>) {
    let program = checker.program;
    let Some(micro) = program.settings.micro.as_deref() else { return };
    let Some(count) = packages::package_pin_count(micro) else { return };
    for entry in program.io.iter().filter(|e| e.pin != 0 && packages::package_pin(micro, e.pin).is_none()) {
        let cause = match packages::package_pin_name(micro, entry.pin) {
            Some(name) => format!("{}: pin {} of {micro} is {name}, no port pin", entry.name, entry.pin),
            None => format!("{}: {micro} has {count} pins, no pin {}", entry.name, entry.pin),
        };
        let hint = "choose a port pin, or 0 for not assigned";
        let new = Diagnostic::new(Severity::Warning, codes::NO_PORT_PIN, &program.file, entry.pos, cause, hint);
        checker.diagnostics.push(new);
    }
}

/// The hint of an argument that the dialect gives no meaning.
const LEAVE_OUT: &str = "write 0 or leave it out, or choose the dialect ldmicro-5";

/// Checks what one element alone shows.
fn check_element(checker: &mut Checker<'_>, at: ProgramElement<'_>) {
    let is_23 = checker.program.dialect == LadderDialect::Ldmicro23;
    if is_23 && at.element.facts().needs_ldmicro5 {
        let cause = "the element exists in LDmicro 5 only";
        checker.error(codes::ELEMENT_LDMICRO5, at, cause, "choose the dialect ldmicro-5");
    }
    match at.element {
        Element::Delay { .. } | Element::Sleep | Element::ClearWatchdog => {
            let cause = "it has no effect here: outputs change at the end of a scan, and scans begin by a timer";
            checker.report(Severity::Note, codes::NO_EFFECT, at, cause, "nothing to do");
        }
        Element::Text { .. } => {
            let cause =
                "it has no effect here: no element reads the text that it makes, and LDmicro's simulator makes none";
            checker.report(
                Severity::Note,
                codes::NO_EFFECT,
                at,
                cause,
                "FORMATTED_STRING sends a text on the serial line",
            );
        }
        Element::TimeValue { time: LadderOperand::Var(_), .. } => {
            let cause = "the time is a variable, and LDmicro computes it when it compiles";
            checker.error(codes::TIMER_RANGE, at, cause, "write the time as a number of microseconds");
        }
        Element::Placeholder => {
            checker.error(codes::PLACEHOLDER, at, "a placeholder remains", "put an element here or remove it");
        }
        Element::Contacts { set1: Some(1..), .. } if is_23 => {
            let cause = "the flag `set1` has a meaning in LDmicro 5 only";
            checker.error(codes::FLAG_LDMICRO5, at, cause, LEAVE_OUT);
        }
        Element::Coil { negated, set, reset, ttrigger, .. } => {
            let toggles = ttrigger.is_some_and(|t| t != 0);
            if toggles && is_23 {
                let cause = "the flag `ttrigger` has a meaning in LDmicro 5 only";
                checker.error(codes::FLAG_LDMICRO5, at, cause, LEAVE_OUT);
            }
            let flags = u8::from(*negated) + u8::from(*set) + u8::from(*reset) + u8::from(toggles);
            if flags > 1 && is_23 {
                let cause = format!("{flags} of negated, set and reset are 1, at most one may be");
                checker.error(codes::COIL_FLAGS, at, cause, "choose one of them");
            } else if flags > 1 {
                let cause = "several flags are 1: the first of negated, set, reset, ttrigger counts";
                checker.warning(codes::COIL_FLAGS, at, cause, "choose one of them");
            }
        }
        Element::Move { dest, src: LadderOperand::Const { value, .. } } => {
            check_stored_constant(checker, at, dest, *value)
        }
        Element::Timer { kind, name, delay, adjust } => check_timer(checker, at, *kind, name, delay, adjust.as_ref()),
        Element::Counter { max, init, input, .. } => check_counter(checker, at, max, init.as_ref(), *input),
        Element::Math { op: MathOp::Div, op2: LadderOperand::Const { value: 0, .. }, .. } => {
            let cause = "divides by 0, which gives -1 for a dividend from 0 and 1 below";
            checker.warning(codes::DIVISION_BY_ZERO, at, cause, "test the divisor first");
        }
        Element::Math { op: MathOp::Mod, .. }
        | Element::Unary { .. }
        | Element::Shift { .. }
        | Element::BitWrite { .. }
        | Element::BitTest { .. } => bit_checks::check_bit_element(checker, at),
        Element::BusTransfer(transfer) => bus_elements::check_bus_element(checker, at, transfer),
        Element::LookUpTable { .. }
        | Element::PiecewiseLinear { .. }
        | Element::ReadAdc { .. }
        | Element::SetPwm { .. }
        | Element::UartRecv { .. }
        | Element::UartSend { .. }
        | Element::UartRecvAvail
        | Element::UartSendReady
        | Element::Stepper { .. }
        | Element::Pulser { .. }
        | Element::Npulse { .. }
        | Element::Segments { display: SegmentDisplay::Sixteen, .. }
        | Element::FormattedString { .. } => peripheral_checks::check_peripheral_element(checker, at),
        Element::Comment(_)
        | Element::Contacts { .. }
        | Element::Short
        | Element::Open
        | Element::MasterRelay
        | Element::Osr
        | Element::Osf
        | Element::Odr
        | Element::Odf
        | Element::Osl
        | Element::Osc
        | Element::Res { .. }
        | Element::Move { .. }
        | Element::Math { .. }
        | Element::Bus { .. }
        | Element::Flow { .. }
        | Element::Segments { .. }
        | Element::TimeValue { .. }
        | Element::Random { .. }
        | Element::SeedRandom { .. }
        | Element::Lock
        | Element::Return
        | Element::Compare { .. }
        | Element::ShiftRegister { .. }
        | Element::NpulseOff
        | Element::QuadEncod { .. }
        | Element::Persist { .. }
        | Element::Instruction(_) => {}
    }
}

/// Warns about a constant wider than the variable that it is moved to. A register of a port holds 0 to 255.
fn check_stored_constant(checker: &mut Checker<'_>, at: ProgramElement<'_>, dest: &str, value: i64) {
    let bytes = checker.widths.bytes_of_symbol(dest);
    let most = integer_widths::max_value(bytes);
    let is_register_value = dest.starts_with('#') && (0..=255).contains(&value);
    if is_register_value || (-most - 1..=most).contains(&i128::from(value)) {
        return;
    }
    // The low bytes, with their sign.
    let size = 1i128 << (8 * u32::from(bytes));
    let kept = (i128::from(value) + most + 1).rem_euclid(size) - most - 1;
    let cause = format!("{dest} has {bytes} byte(s), from {} to {most}, so it gets {kept}", -most - 1);
    checker.warning(
        codes::NARROW_TARGET,
        at,
        cause,
        "give the variable more bytes in VAR LIST, or choose a smaller constant",
    );
}

/// Refuses an argument whose value differs from the value that an omitted argument has; in ldmicro-5 the hint
/// says what to write in its place.
pub(crate) fn check_default_argument(checker: &mut Checker<'_>, at: ProgramElement<'_>, what: &str, hint: &str) {
    let (cause, hint) = match checker.program.dialect {
        LadderDialect::Ldmicro23 => (format!("{what} has a meaning in LDmicro 5 only"), IN_LDMICRO5),
        LadderDialect::Ldmicro5 | LadderDialect::Iec => (format!("{what} has no meaning here"), hint),
    };
    checker.error(codes::ARGUMENT_LDMICRO5, at, cause, hint);
}

/// What to do with an argument of LDmicro 5 in a program of release 2.3.
const IN_LDMICRO5: &str = "leave the argument out, or read the program with --dialect ldmicro-5";

/// Refuses an argument that has a meaning in dialect ldmicro-5 only, if the program has dialect 2.3.
fn refuse_in_dialect_23(checker: &mut Checker<'_>, at: ProgramElement<'_>, what: &str) {
    if checker.program.dialect == LadderDialect::Ldmicro23 {
        check_default_argument(checker, at, what, IN_LDMICRO5);
    }
}

fn check_timer(
    checker: &mut Checker<'_>,
    at: ProgramElement<'_>,
    kind: TimerKind,
    name: &str,
    delay: &LadderOperand,
    adjust: Option<&LadderOperand>,
) {
    match adjust {
        Some(LadderOperand::Var(_)) => {
            let hint =
                "write the adjust as a number of scans, such as 0, or use a variable as the delay, which counts scans";
            check_default_argument(checker, at, "a variable as the adjust", hint);
        }
        // Release 2.3 subtracts one scan from every delay; LDmicro 5 writes this as an adjust of -1.
        Some(LadderOperand::Const { value, .. }) if *value != -1 => {
            refuse_in_dialect_23(checker, at, "an adjust other than -1")
        }
        _ => {}
    }
    let cycle = i128::from(checker.program.settings.cycle_us);
    let LadderOperand::Const { value, .. } = delay else {
        refuse_in_dialect_23(checker, at, "a variable as the delay");
        if matches!(kind, TimerKind::Rto | TimerKind::Rtl) {
            let cause =
                "a variable as the delay of a retentive timer has no meaning in LDmicro 5: it has expired at once";
            checker.warning(codes::TIMER_RANGE, at, cause, "write the delay as a number");
        }
        return;
    };
    let p = integer_widths::timer_preset(checker.program, delay, adjust);
    let delay = i128::from(*value);
    if delay < 0 {
        let cause = format!("the delay of {delay} us is negative");
        return checker.error(codes::TIMER_RANGE, at, cause, "choose a positive delay");
    }
    let Some(p) = p else { return };
    let (scans, most) = (delay / cycle, integer_widths::max_value(checker.widths.bytes_of_symbol(name)));
    let is_23 = checker.program.dialect == LadderDialect::Ldmicro23;
    if is_23 && !(1..=most).contains(&p) || p > integer_widths::max_value(4) {
        let most = if is_23 { most } else { integer_widths::max_value(4) };
        // The longest delay is the last microsecond that is still rounded down to the largest count.
        let taken = scans - p;
        let (shortest, longest) = ((1 + taken).max(0) * cycle, (most + taken + 1) * cycle - 1);
        let cause = format!(
            "a delay of {delay} us at a cycle of {cycle} us gives P = {p}, allowed is 1 to {most}: {shortest} us to {longest} us"
        );
        return checker.error(codes::TIMER_RANGE, at, cause, "change the delay or CYCLE=");
    }
    // LDmicro 5 makes code of these all the same.
    if p < 1 {
        let cause =
            format!("a delay of {delay} us at a cycle of {cycle} us gives P = {p}: the timer has expired at once");
        checker.warning(codes::TIMER_RANGE, at, cause, "choose a longer delay or a shorter CYCLE=");
    } else if p > most {
        let cause = format!("P = {p} is more than {name} holds, at most {most}: the timer never expires");
        let hint = "give the timer a name of its own and a delay whose scans with the adjust fit its width";
        checker.warning(codes::TIMER_RANGE, at, cause, hint);
    }
    if delay % cycle != 0 {
        let cause = format!(
            "the delay of {delay} us is not a multiple of the cycle of {cycle} us: it is cut to {} us",
            scans * cycle
        );
        let hint = match scans {
            0 => format!("write {cycle}, or shorten CYCLE="),
            _ => format!("write {} or {}", scans * cycle, (scans + 1) * cycle),
        };
        checker.warning(codes::TRUNCATED, at, cause, hint);
    }
}

fn check_counter(
    checker: &mut Checker<'_>,
    at: ProgramElement<'_>,
    max: &LadderOperand,
    init: Option<&LadderOperand>,
    input: Option<char>,
) {
    if let LadderOperand::Var(_) = max {
        refuse_in_dialect_23(checker, at, "a variable as the limit");
    }
    match init {
        Some(LadderOperand::Var(_)) => refuse_in_dialect_23(checker, at, "a variable as the start value"),
        Some(LadderOperand::Const { value, .. }) if *value != 0 => {
            refuse_in_dialect_23(checker, at, "a start value other than 0")
        }
        _ => {}
    }
    if input.is_some_and(|kind| kind != '/') {
        refuse_in_dialect_23(checker, at, "an input kind other than /");
    }
}

/// Notes elements that are usually last and are followed by another element.
///
/// `at_rail` says whether the right end of `series` is the right rail.
fn check_last_elements(checker: &mut Checker<'_>, series: &[RungNode], at_rail: bool, next: &mut ElementId) {
    // A comment is not part of the circuit, so it does not separate an element from the rail.
    let end = series.iter().rposition(|n| !matches!(n, RungNode::Leaf(Element::Comment(_), _)));
    for (i, node) in series.iter().enumerate() {
        let at_rail = at_rail && end.is_none_or(|end| i >= end);
        match node {
            RungNode::Leaf(element, pos) => {
                if !at_rail && element.facts().is_drawn_last() {
                    let at = ProgramElement { id: *next, element, pos: *pos };
                    let cause = "something follows it before the right rail; it gives on the power that it gets";
                    let hint = "nothing to do if this is meant; LDmicro's editor draws it at the end of a rung only";
                    checker.report(Severity::Note, codes::NOT_LAST, at, cause, hint);
                }
                next.index += 1;
            }
            RungNode::Parallel(branches, _) => {
                branches.iter().for_each(|b| check_last_elements(checker, b, at_rail, next))
            }
        }
    }
}
