//! Checks of the tables, the strings and the elements that use a part of the chip.

use crate::check::{At, Checker, argument};
use crate::codes;
use crate::format::{self, Piece};
use crate::model::{Dialect, Element, Operand};
use crate::widths::{largest, least};

/// The spellings of LDmicro 5's resolution of SET_PWM that mean percent, which is all that is understood here.
const PERCENT: [&str; 2] = ["0-100", "0-100%"];

/// What can be told from one of these elements alone.
pub(crate) fn one(found: &mut Checker<'_>, at: At<'_>) {
    match at.element {
        Element::LookUpTable { dest, index: Operand::Var(index), .. } if dest == index => alias(found, at, dest),
        Element::PiecewiseLinear { dest, index, points } => {
            if *index == Operand::Var(dest.clone()) {
                alias(found, at, dest);
            }
            curve(found, at, dest, index, points);
        }
        Element::ReadAdc { refs: Some(1..), .. } => argument(found, at, "the reference selection"),
        Element::SetPwm { hertz, output, .. } => {
            match hertz {
                Operand::Const { value: 1.., .. } => {}
                _ => {
                    let cause = "the frequency must be a constant of at least 1 Hz";
                    found.error(codes::PWM, at, cause, "write a number, such as SET_PWM duty 1000");
                }
            }
            match output {
                Some(_) if found.program.dialect == Dialect::Ldmicro23 => {
                    argument(found, at, "the choice of the output");
                }
                Some((_, resolution)) if !PERCENT.contains(&resolution.as_str()) => {
                    argument(found, at, "a resolution other than 0-100");
                }
                _ => {}
            }
        }
        Element::UartRecv { rest, .. } | Element::UartSend { rest, .. } => {
            if rest.is_some_and(|rest| rest != (1, 0)) {
                argument(found, at, "another choice than one byte without waiting");
            }
            baud(found, at);
        }
        Element::FormattedString { var, text, quoted } => {
            string(found, at, var.as_deref(), text, *quoted);
            baud(found, at);
        }
        _ => {}
    }
}

/// One pulse width output serves the whole program, so all elements must agree about it.
pub(crate) fn pwm(found: &mut Checker<'_>) {
    let program = found.program;
    let mut all = program.elements().filter_map(|(id, element, pos)| match element {
        Element::SetPwm { hertz, output, .. } => {
            let hertz = match hertz {
                Operand::Const { value, .. } => Some(*value),
                Operand::Var(_) => None,
            };
            Some((At { id, element, pos }, hertz, output.as_ref().map(|o| o.0.as_str())))
        }
        _ => None,
    });
    let Some((first, hertz, output)) = all.next() else { return };
    for (at, other, to) in all {
        if let (Some(one), Some(other)) = (hertz, other)
            && one != other
        {
            let cause = format!("{other} Hz, but {} sets {one} Hz, and there is one output", first.id);
            found.error(codes::PWM, at, cause, "let all SET_PWM of the program name one frequency");
        }
        if output != to {
            let name = |output: Option<&str>| output.unwrap_or("no name").to_owned();
            let cause =
                format!("the output is {}, but {} has {}, and there is one output", name(to), first.id, name(output));
            found.error(codes::PWM, at, cause, "let all SET_PWM of the program name one output");
        }
    }
}

fn alias(found: &mut Checker<'_>, at: At<'_>, dest: &str) {
    let cause = format!("{dest} is both index and result; LDmicro's own compilers get this wrong");
    found.warning(codes::TABLE_ALIAS, at, cause, "use another variable for the result");
}

fn curve(found: &mut Checker<'_>, at: At<'_>, dest: &str, index: &Operand, points: &[(i64, i64)]) {
    if points.len() < 2 {
        let cause = format!("{} point(s) make no segment", points.len());
        return found.error(codes::CURVE, at, cause, "give at least two points");
    }
    let constants = points.iter().flat_map(|(x, y)| [*x, *y]).map(|v| least(v.into())).max().unwrap_or(0);
    let wide = constants.max(found.widths.of(dest)).max(found.widths.operand(index)) > 2;
    let limit = largest(if wide { 4 } else { 2 });
    for pair in points.windows(2) {
        let [(x, y), (next_x, next_y)] = pair else { continue };
        if x >= next_x {
            let cause = format!("x = {next_x} follows x = {x}, but x must rise");
            found.error(codes::NOT_RISING, at, cause, "sort the points by x, each x once");
            continue;
        }
        let (dx, dy) = (i128::from(*next_x) - i128::from(*x), i128::from(*next_y) - i128::from(*y));
        if (dx * dy).abs() > limit || dx > limit {
            let cause = format!("from x = {x} to {next_x}: {dx} * {dy} leaves the range of -{limit} to {limit}");
            found.error(codes::CURVE, at, cause, "put points between them, or scale the values down");
        }
    }
}

fn string(found: &mut Checker<'_>, at: At<'_>, var: Option<&str>, text: &str, quoted: bool) {
    if let Some(code) = text.chars().map(u32::from).find(|c| *c < 32 && !quoted) {
        let cause = format!("the character code {code} is read as X");
        found.warning(codes::STRING_CODE, at, cause, "write a backslash escape, such as 92 110 for a new line");
    }
    match format::pieces(text, quoted) {
        Err(bad) => {
            let cause = format!("at character {}: {}", bad.at + 1, bad.cause);
            found.error(codes::STRING_ESCAPE, at, cause, bad.hint);
        }
        Ok(pieces) => {
            let number = pieces.iter().any(|p| matches!(p, Piece::Digit { .. }));
            match var {
                None if number => {
                    let hint = "name the variable in place of (none)";
                    found.error(codes::STRING_VARIABLE, at, "the text shows a number, but names no variable", hint);
                }
                Some(name) if !number => {
                    let cause = format!("{name} is shown nowhere in the text");
                    found.error(
                        codes::STRING_VARIABLE,
                        at,
                        cause,
                        "write \\5 or \\-5 where it is to stand, or (none) for it",
                    );
                }
                _ => {}
            }
        }
    }
}

fn baud(found: &mut Checker<'_>, at: At<'_>) {
    if found.program.settings.baud.is_none_or(|baud| baud == 0) {
        let cause = "the serial line has no rate, since BAUD= is missing or 0";
        found.error(codes::NO_BAUD, at, cause, "write the rate above the lists, such as BAUD=2400");
    }
}
