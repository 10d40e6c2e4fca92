//! Checks of tables, strings and the elements that use a part of the chip.

use diag::Severity;

use crate::check::{Checker, check_default_argument};
use crate::codes;
use crate::format::{self, StringPiece};
use crate::integer_widths::{max_value, min_bytes};
use crate::model::{CurvePoint, Element, LadderDialect, LadderOperand, ProgramElement, SerialTransfer};

/// Half a second in microseconds: half a pulse at 1 Hz.
const HALF_SECOND_US: u64 = 500_000;

/// True for the spellings of LDmicro 5's resolution of SET_PWM that mean percent, the only one that is
/// supported; a missing resolution means it too.
#[must_use]
pub fn is_percent_resolution(resolution: &str) -> bool {
    matches!(resolution, "" | "0-100" | "0-100%")
}

/// Runs the checks that need one of these elements and no other.
pub(crate) fn check_peripheral_element(checker: &mut Checker<'_>, at: ProgramElement<'_>) {
    match at.element {
        Element::LookUpTable { dest, index: LadderOperand::Var(index), .. } if dest == index => {
            check_alias(checker, at, dest)
        }
        Element::PiecewiseLinear { dest, index, points, .. } => {
            if *index == LadderOperand::Var(dest.clone()) {
                check_alias(checker, at, dest);
            }
            check_curve(checker, at, dest, index, points);
        }
        Element::ReadAdc { refs: Some(refs @ 1..), name } => check_reference(checker, at, name, *refs),
        Element::SetPwm { hertz, output, .. } => {
            match hertz {
                LadderOperand::Const { value: 1.., .. } => {}
                _ => {
                    let cause = "the frequency must be a constant of at least 1 Hz";
                    checker.error(codes::PWM, at, cause, "write a number, such as SET_PWM duty 1000");
                }
            }
            match output {
                Some(_) if checker.program.dialect == LadderDialect::Ldmicro23 => {
                    check_default_argument(checker, at, "the choice of the output", "");
                }
                Some(choice) if !is_percent_resolution(&choice.resolution) => {
                    let hint =
                        "write 0-100 and give the duty in percent: MUL by 100 and DIV by the full scale before SET_PWM";
                    check_default_argument(checker, at, "a resolution other than 0-100", hint);
                }
                _ => {}
            }
        }
        Element::UartRecv { name, rest } | Element::UartSend { name, rest } => {
            check_transfer(checker, at, name, rest.unwrap_or_default());
            check_baud(checker, at);
        }
        Element::Npulse { hertz, .. } => check_pulse_frequency(checker, at, hertz),
        Element::Segments { .. } => {
            note_outputs(checker, at, "bit 16 of 16SEGMENTS: its C output drops it, its simulator and emu keep it");
        }
        Element::UartRecvAvail | Element::UartSendReady => check_baud(checker, at),
        Element::Stepper { graph, .. } => {
            if *graph != 0 {
                let hint = "write 0 for size and graph, which steps at one speed; PULSER changes its speed from pulse to pulse";
                check_default_argument(checker, at, "an acceleration of STEPPER other than 0", hint);
            }
            note_outputs(checker, at, "the pulses of STEPPER, which it ends at once: no scan shows them, here neither");
        }
        Element::Pulser { .. } => {
            note_outputs(
                checker,
                at,
                "PULSER: an older source shortens the pulses, 5.4.1.1 makes them one scan longer each in its code",
            );
        }
        Element::FormattedString { var, text, quoted } => {
            check_string(checker, at, var.as_deref(), text, *quoted);
            check_baud(checker, at);
        }
        // No check of a single line applies to the other elements.
        _ => {}
    }
}

/// Checks the reference of a conversion: REFS of an AVR, the same in all READ_ADC of a name.
fn check_reference(checker: &mut Checker<'_>, at: ProgramElement<'_>, name: &str, refs: u32) {
    if refs > 3 || checker.program.dialect == LadderDialect::Ldmicro23 {
        let hint = "write 0 for the supply (AVCC, VDD), or 1 (AVCC), 2 or 3 (internal) as REFS of the AVR";
        return check_default_argument(checker, at, "this reference selection", hint);
    }
    let other = checker.program.elements().find_map(|ProgramElement { id, element, .. }| match element {
        Element::ReadAdc { name: of, refs: other } if of == name => {
            Some((id, other.unwrap_or(0))).filter(|(_, other)| *other != refs)
        }
        _ => None,
    });
    if let Some((id, other)) = other {
        let cause = format!("the reference of {name} is {refs}, but {id} has {other}");
        checker.error(codes::ARGUMENT_LDMICRO5, at, cause, "let all READ_ADC of a name have the same one");
    }
}

/// Checks that all SET_PWM of an output name one frequency, and that all name an output or none does.
pub(crate) fn check_pwm(checker: &mut Checker<'_>) {
    let program = checker.program;
    let outputs = program.pwm_outputs();
    for at in program.elements() {
        let ProgramElement { id, element, .. } = at;
        let Element::SetPwm { hertz: LadderOperand::Const { value: hertz, .. }, output, .. } = element else {
            continue;
        };
        let name = output.as_ref().map(|choice| &choice.name);
        let Some(first) = outputs.iter().find(|output| output.name.as_ref() == name) else { continue };
        if let Some(one) = first.hertz.filter(|one| i64::from(*one) != *hertz && first.element != id) {
            let of = first.name.as_ref().map_or("the one output".to_owned(), |name| format!("the output {name}"));
            let cause = format!("{hertz} Hz, but {} sets {one} Hz for {of}", first.element);
            checker.error(codes::PWM, at, cause, "let all SET_PWM of an output name one frequency");
        }
        if let Some(other) =
            outputs.first().filter(|other| first.element == id && other.name.is_some() != name.is_some())
        {
            let cause = match name {
                None => format!("the output has no name, but {} has {}", other.element, other.label()),
                Some(name) => format!("the output is {name}, but {} has no name", other.element),
            };
            checker.error(codes::PWM, at, cause, "give all SET_PWM of the program the name of an output, or none");
        }
    }
}

fn check_alias(checker: &mut Checker<'_>, at: ProgramElement<'_>, dest: &str) {
    let cause = format!("{dest} is both index and result; LDmicro's own compilers get this wrong");
    checker.warning(codes::TABLE_ALIAS, at, cause, "use another variable for the result");
}

fn check_curve(
    checker: &mut Checker<'_>,
    at: ProgramElement<'_>,
    dest: &str,
    index: &LadderOperand,
    points: &[CurvePoint],
) {
    if points.len() < 2 {
        let cause = format!("{} point(s) make no segment", points.len());
        return checker.error(codes::CURVE, at, cause, "give at least two points");
    }
    let constants = points.iter().flat_map(|point| [point.x, point.y]).map(|v| min_bytes(v.into())).max().unwrap_or(0);
    let wide = constants.max(checker.widths.bytes_of_symbol(dest)).max(checker.widths.bytes_of_operand(index)) > 2;
    let limit = max_value(if wide { 4 } else { 2 });
    for pair in points.windows(2) {
        let [CurvePoint { x, y }, CurvePoint { x: next_x, y: next_y }] = pair else { continue };
        if x >= next_x {
            let cause = format!("x = {next_x} follows x = {x}, but x must rise");
            checker.error(codes::NOT_RISING, at, cause, "sort the points by x, each x once");
            continue;
        }
        let (dx, dy) = (i128::from(*next_x) - i128::from(*x), i128::from(*next_y) - i128::from(*y));
        if (dx * dy).abs() > limit || dx > limit {
            let cause = format!("from x = {x} to {next_x}: {dx} * {dy} leaves the range of -{limit} to {limit}");
            checker.error(codes::CURVE, at, cause, "put points between them, or scale the values down");
        }
    }
}

fn check_string(checker: &mut Checker<'_>, at: ProgramElement<'_>, var: Option<&str>, text: &str, quoted: bool) {
    if let Some(code) = text.chars().map(u32::from).find(|c| *c < 32 && !quoted) {
        let cause = format!("the character code {code} is read as X");
        checker.warning(codes::STRING_CODE, at, cause, "write a backslash escape, such as 92 110 for a new line");
    }
    match format::split_format_string(text, quoted) {
        Err(bad) => {
            let cause = format!("at character {}: {}", bad.char_offset + 1, bad.cause);
            checker.error(codes::STRING_ESCAPE, at, cause, bad.hint);
        }
        Ok(pieces) => {
            let number = pieces.iter().any(|p| matches!(p, StringPiece::Digit { .. }));
            match var {
                None if number => {
                    let hint = "name the variable in place of (none)";
                    checker.error(codes::STRING_VARIABLE, at, "the text shows a number, but names no variable", hint);
                }
                Some(name) if !number => {
                    let cause = format!("{name} is shown nowhere in the text");
                    checker.error(
                        codes::STRING_VARIABLE,
                        at,
                        cause,
                        "write \\5 or \\-5 for its place, or (none) for it",
                    );
                }
                _ => {}
            }
        }
    }
}

/// Checks how many bytes UART_SEND or UART_RECV transfers, and whether it waits.
fn check_transfer(checker: &mut Checker<'_>, at: ProgramElement<'_>, name: &str, transfer: SerialTransfer) {
    let bytes = transfer.bytes;
    if checker.program.dialect == LadderDialect::Ldmicro23 {
        if transfer != SerialTransfer::default() {
            check_default_argument(checker, at, "another choice than one byte without waiting", "");
        }
        return;
    }
    let width = u32::from(checker.widths.bytes_of_symbol(name));
    if bytes > width {
        let cause = format!("{bytes} bytes are transferred, but {name} has {width}");
        let hint = format!("write 1 to {width} bytes, or, up to 4, `{} bytes {name}` in VAR LIST", bytes.min(4));
        checker.error(codes::ARGUMENT_LDMICRO5, at, cause, hint);
    }
}

/// Checks that scans can make the pulses of NPULSE, whose halves take whole scans.
fn check_pulse_frequency(checker: &mut Checker<'_>, at: ProgramElement<'_>, hertz: &LadderOperand) {
    let LadderOperand::Const { value: hertz @ 1.., .. } = hertz else {
        let cause = "the frequency must be a constant of at least 1 Hz";
        return checker.error(codes::PULSE_FREQUENCY, at, cause, "write a number, such as NPULSE n 10 Ypulse");
    };
    let cycle = checker.program.settings.cycle_us;
    // The checks refuse a program whose cycle is 0.
    if cycle > 0 && hertz.unsigned_abs().saturating_mul(cycle) > HALF_SECOND_US {
        let cause = format!("half a pulse at {hertz} Hz is shorter than the scan of {cycle} us");
        let hint = match HALF_SECOND_US / cycle {
            0 => format!("write a CYCLE= of at most {} us", HALF_SECOND_US / hertz.unsigned_abs().max(1)),
            most => format!("write at most {most} Hz, or a shorter CYCLE="),
        };
        return checker.error(codes::PULSE_FREQUENCY, at, cause, hint);
    }
    note_outputs(checker, at, "NPULSE: its PIC and C code refuse it, its AVR code uses a timer of its own");
}

fn note_outputs(checker: &mut Checker<'_>, at: ProgramElement<'_>, what: &str) {
    let cause = format!("LDmicro 5 itself disagrees about {what}");
    checker.report(Severity::Note, codes::OUTPUTS_DIFFER, at, &cause, "nothing to do if this is meant");
}

fn check_baud(checker: &mut Checker<'_>, at: ProgramElement<'_>) {
    if checker.program.settings.baud.is_none_or(|baud| baud == 0) {
        let cause = "the serial line has no rate, since BAUD= is missing or 0";
        checker.error(codes::NO_BAUD, at, cause, "write the rate above the lists, such as BAUD=2400");
    }
}
