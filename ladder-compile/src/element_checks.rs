//! What cannot be compiled: told for the whole program at once, before any code is made.

use diag::{Diagnostic, Severity};
use ladder::symbols::for_each_symbol_use;
use ladder::{Element, LadderDialect, LadderOperand, LadderProgram, SymbolKind};

use crate::codes;
use crate::lower;
use crate::target::CompileTarget;

/// Every reason why the elements of `program` cannot be compiled for `target`, in text order. What `ladder::check` already
/// refuses at the same place is the caller's to drop.
#[must_use]
pub fn unsupported_elements(program: &LadderProgram, target: Option<&CompileTarget>) -> Vec<Diagnostic> {
    let symbols = program.symbols();
    let is_bit = |name: &str| symbols.iter().find(|s| s.name == name).is_none_or(|s| s.kind.is_bit());
    let mut cells = lower::eeprom_cells(program).into_iter();
    let mut refusals = Vec::new();
    for (id, element, pos) in program.elements() {
        let mut error = |code, cause: String, hint: &str| {
            refusals.push(Diagnostic::new(Severity::Error, code, &program.file, pos, format!("{id}: {cause}"), hint));
        };
        if let Some(target) = target {
            let last = if matches!(element, Element::Persist { .. }) { cells.next() } else { None };
            let needed = last.map_or(0, |(addr, bytes)| u32::from(addr) + u32::from(bytes));
            let chip = target.chip.name;
            if let Some((keyword, part)) = missing_peripheral(element, target) {
                error(codes::LACKS, format!("{keyword}: {chip} has no {part}"), "take a chip that has one");
            } else if needed > u32::from(target.eeprom) {
                let cause = format!("PERSIST needs cells up to {needed} of the EEPROM, {chip} has {}", target.eeprom);
                error(codes::LACKS, cause, "keep fewer variables");
            }
        }
        for_each_symbol_use(element, &mut |name, kind| {
            if kind.is_bit() != is_bit(name) {
                error(codes::MIXED_NAME, format!("`{name}` is used as a bit and as a number"), "rename one of the two");
            }
        });
        for constant in operand_constants(element) {
            let (low, high) = match program.dialect {
                LadderDialect::Ldmicro23 => (i64::from(i16::MIN), i64::from(i16::MAX)),
                LadderDialect::Ldmicro5 => (i64::from(i32::MIN), i64::from(i32::MAX)),
            };
            if !(low..=high).contains(&constant) {
                let cause = format!("the constant {constant} is not in {low}..{high}");
                error(codes::WIDE_CONSTANT, cause, "choose a smaller number");
            }
        }
        match element {
            Element::Placeholder => {
                error(codes::NOT_COMPILED, "PLACEHOLDER stands for nothing".to_owned(), "put an element here");
            }
            Element::Coil { name, .. } | Element::Contacts { name, .. }
                if !ladder::symbols::kind_by_letter(name).is_bit() =>
            {
                error(codes::MIXED_NAME, format!("`{name}` is no bit"), "bits begin with X, Y or R");
            }
            Element::Coil { name, .. } if ladder::symbols::kind_by_letter(name) == SymbolKind::Input => {
                error(codes::DRIVEN_INPUT, format!("the coil drives the input `{name}`"), "drive an output or a relay");
            }
            Element::Timer { delay, adjust, .. } if lower::timer_scans(program, delay, adjust.as_ref()).is_none() => {
                error(
                    codes::TIMER_RANGE,
                    format!(
                        "the scans of the delay are no constant of at least 1 (cycle {} us)",
                        program.settings.cycle_us
                    ),
                    "choose a delay of at least two cycles",
                );
            }
            _ => {}
        }
    }
    refusals
}

/// The keyword of an element that needs a part that the chip lacks, and that part.
fn missing_peripheral(element: &Element, target: &CompileTarget) -> Option<(&'static str, &'static str)> {
    let (keyword, there, part) = match element {
        Element::ReadAdc { .. } => ("READ_ADC", !target.adc.is_empty(), "converter"),
        Element::SetPwm { .. } => ("SET_PWM", target.pwm.is_some(), "PWM output"),
        Element::UartRecv { .. } => ("UART_RECV", target.uart.is_some(), "serial line"),
        Element::UartSend { .. } => ("UART_SEND", target.uart.is_some(), "serial line"),
        Element::FormattedString { .. } => ("FORMATTED_STRING", target.uart.is_some(), "serial line"),
        Element::Persist { .. } => ("PERSIST", target.eeprom > 0, "EEPROM"),
        _ => return None,
    };
    (!there).then_some((keyword, part))
}

/// The constants of an element that are operands (a delay is none).
fn operand_constants(element: &Element) -> Vec<i64> {
    let operands: Vec<&LadderOperand> = match element {
        Element::Counter { max, init, .. } => std::iter::once(max).chain(init).collect(),
        Element::Move { src, .. } => vec![src],
        Element::Math { op1, op2, .. } | Element::Compare { op1, op2, .. } => vec![op1, op2],
        Element::SetPwm { duty, .. } => vec![duty],
        Element::LookUpTable { index, values, .. } => {
            return operand_constant(index).into_iter().chain(values.iter().copied()).collect();
        }
        Element::PiecewiseLinear { index, points, .. } => {
            return operand_constant(index).into_iter().chain(points.iter().flat_map(|&(x, y)| [x, y])).collect();
        }
        _ => Vec::new(),
    };
    operands.into_iter().filter_map(operand_constant).collect()
}

fn operand_constant(operand: &LadderOperand) -> Option<i64> {
    if let LadderOperand::Const { value, .. } = operand { Some(*value) } else { None }
}
