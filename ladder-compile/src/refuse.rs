//! What is not compiled: told for the whole program at once, before any code is made.

use diag::{Diagnostic, Severity};
use ladder::symbols::uses;
use ladder::{Element, Operand, Program, SymbolKind};

use crate::codes;
use crate::lower::scans;

/// Every reason why the elements of `program` cannot be compiled, in text order. What `ladder::check` already refuses at
/// the same place is the caller's to drop.
#[must_use]
pub fn refuse(program: &Program) -> Vec<Diagnostic> {
    let symbols = program.symbols();
    let is_bit = |name: &str| symbols.iter().find(|s| s.name == name).is_none_or(|s| s.kind.is_bit());
    let mut refusals = Vec::new();
    for (id, element, pos) in program.elements() {
        let mut error = |code, cause: String, hint: &str| {
            refusals.push(Diagnostic::new(Severity::Error, code, &program.file, pos, format!("{id}: {cause}"), hint));
        };
        if let Some(keyword) = not_compiled(element) {
            let hint = "compiled are contacts, coils, one shots, timers, counters, RES, MOVE, arithmetic and compares";
            error(codes::NOT_COMPILED, format!("{keyword} is not compiled yet"), hint);
            continue;
        }
        uses(element, &mut |name, kind| {
            if kind.is_bit() != is_bit(name) {
                error(codes::MIXED_NAME, format!("`{name}` is used as a bit and as a number"), "rename one of the two");
            }
        });
        for constant in constants(element) {
            if i16::try_from(constant).is_err() {
                error(
                    codes::WIDE_CONSTANT,
                    format!("the constant {constant} is not in -32768..32767"),
                    "integers have 16 bits",
                );
            }
        }
        match element {
            Element::Coil { name, .. } | Element::Contacts { name, .. }
                if !ladder::symbols::by_letter(name).is_bit() =>
            {
                error(codes::MIXED_NAME, format!("`{name}` is no bit"), "bits begin with X, Y or R");
            }
            Element::Coil { name, .. } if ladder::symbols::by_letter(name) == SymbolKind::Input => {
                error(codes::DRIVEN_INPUT, format!("the coil drives the input `{name}`"), "drive an output or a relay");
            }
            Element::Timer { delay, .. } if scans(delay, program.settings.cycle_us).is_none() => {
                error(
                    codes::TIMER_RANGE,
                    format!("delay / cycle - 1 is not a constant in 1..32767 (cycle {} us)", program.settings.cycle_us),
                    "choose a delay of at least two cycles",
                );
            }
            _ => {}
        }
    }
    refusals
}

/// The keyword of an element that has no lowering. Exhaustive on purpose: a new element of the model must be decided here.
fn not_compiled(element: &Element) -> Option<&'static str> {
    match element {
        Element::Comment(_)
        | Element::Contacts { .. }
        | Element::Coil { .. }
        | Element::Short
        | Element::Open
        | Element::MasterRelay
        | Element::Osr
        | Element::Osf
        | Element::Timer { .. }
        | Element::Counter { .. }
        | Element::Res { .. }
        | Element::Move { .. }
        | Element::Math { .. }
        | Element::Compare { .. } => None,
        Element::Placeholder => Some("PLACEHOLDER"),
        Element::ShiftRegister { .. } => Some("SHIFT_REGISTER"),
        Element::LookUpTable { .. } => Some("LOOK_UP_TABLE"),
        Element::PiecewiseLinear { .. } => Some("PIECEWISE_LINEAR"),
        Element::ReadAdc { .. } => Some("READ_ADC"),
        Element::SetPwm { .. } => Some("SET_PWM"),
        Element::UartRecv { .. } => Some("UART_RECV"),
        Element::UartSend { .. } => Some("UART_SEND"),
        Element::Persist { .. } => Some("PERSIST"),
        Element::FormattedString { .. } => Some("FORMATTED_STRING"),
    }
}

/// The 16-bit constants of an element (a delay is none).
fn constants(element: &Element) -> Vec<i64> {
    let operands: Vec<&Operand> = match element {
        Element::Counter { max, .. } => vec![max],
        Element::Move { src, .. } => vec![src],
        Element::Math { op1, op2, .. } | Element::Compare { op1, op2, .. } => vec![op1, op2],
        _ => Vec::new(),
    };
    operands.iter().filter_map(|o| if let Operand::Const { value, .. } = o { Some(*value) } else { None }).collect()
}
