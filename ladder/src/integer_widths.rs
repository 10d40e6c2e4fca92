//! Width in bytes of each integer of a program, and the width that a constant needs.

use std::collections::HashMap;

use crate::model::{Element, LadderDialect, LadderOperand, LadderProgram, LdFormat, ProgramElement};
use crate::pulse_elements::stepper_counters;
use crate::registers::PortRegister;

/// Width in bytes of all integers of release 2.3, and of every integer without a more specific rule.
const DEFAULT_BYTES: u8 = 2;

/// The widths of all integers of a program.
pub(crate) struct IntegerWidths<'a> {
    /// Widths from `VAR LIST`, and of the accumulators that it does not list.
    known: HashMap<&'a str, u8>,
    /// Widths of the counters of STEPPER elements.
    steppers: HashMap<String, u8>,
}

impl<'a> IntegerWidths<'a> {
    /// Computes the widths of a program. In dialect 2.3 every integer has two bytes, whatever `VAR LIST`
    /// says.
    pub(crate) fn new(program: &'a LadderProgram) -> IntegerWidths<'a> {
        let (mut known, mut steppers) = (HashMap::new(), HashMap::new());
        if program.dialect == LadderDialect::Ldmicro23 {
            return IntegerWidths { known, steppers };
        }
        known.extend(program.vars.iter().flatten().map(|v| (v.name.as_str(), v.bytes)));
        // Constants decide over VAR LIST, and of several elements of one name the last in text order decides.
        for ProgramElement { element, .. } in program.elements() {
            if let Element::Stepper { name, max, period, .. } = element {
                for (counter, operand) in stepper_counters(name).into_iter().zip([max, period]) {
                    let bytes = match operand {
                        LadderOperand::Const { value, .. } => min_bytes(i128::from(*value)),
                        LadderOperand::Var(name) => known.get(name.as_str()).copied().unwrap_or(DEFAULT_BYTES),
                    };
                    steppers.insert(counter, bytes);
                }
            }
            let (name, bytes) = match element {
                Element::Timer { name, delay: LadderOperand::Const { value, .. }, .. } => {
                    (name, i128::from(*value).checked_div(i128::from(program.settings.cycle_us)).map(min_bytes))
                }
                Element::Counter { name, max: LadderOperand::Const { value, .. }, init, .. } => {
                    let start = match init {
                        None => Some(0),
                        Some(LadderOperand::Const { value, .. }) => Some(*value),
                        Some(LadderOperand::Var(_)) => None,
                    };
                    (name, start.map(|start| min_bytes(i128::from(*value)).max(min_bytes(start.into()))))
                }
                // Nothing else has a width of its own.
                _ => continue,
            };
            if let Some(bytes) = bytes {
                known.insert(name, bytes);
            }
        }
        IntegerWidths { known, steppers }
    }

    /// Width of an integer in bytes, 1 to 4.
    pub(crate) fn bytes_of_symbol(&self, name: &str) -> u8 {
        if PortRegister::from_name(name).is_some() {
            return 1;
        }
        self.steppers.get(name).or_else(|| self.known.get(name)).copied().unwrap_or(DEFAULT_BYTES)
    }

    /// Width of an operand in bytes; for a constant, the fewest bytes that hold it.
    pub(crate) fn bytes_of_operand(&self, operand: &LadderOperand) -> u8 {
        match operand {
            LadderOperand::Const { value, .. } => min_bytes(i128::from(*value)),
            LadderOperand::Var(name) => self.bytes_of_symbol(name),
        }
    }
}

/// The fewest bytes, 1 to 4, that hold a value in two's complement; 4 if no width holds it.
pub(crate) fn min_bytes(value: i128) -> u8 {
    (1..4).find(|bytes| (-max_value(*bytes) - 1..=max_value(*bytes)).contains(&value)).unwrap_or(4)
}

/// The largest value of a signed integer of `bytes` bytes.
pub(crate) const fn max_value(bytes: u8) -> i128 {
    (1 << (8 * bytes as u32 - 1)) - 1
}

/// P, the number of scans that a timer counts: the whole cycles in its delay plus its adjust.
///
/// `None` if the delay or the adjust is a variable, or if the cycle is 0.
pub(crate) fn timer_preset(
    program: &LadderProgram,
    delay: &LadderOperand,
    adjust: Option<&LadderOperand>,
) -> Option<i128> {
    let LadderOperand::Const { value: delay, .. } = delay else { return None };
    let adjust = match adjust {
        Some(LadderOperand::Const { value, .. }) => i128::from(*value),
        Some(LadderOperand::Var(_)) => return None,
        None => default_adjust(program),
    };
    let (delay, cycle) = (i128::from(*delay), i128::from(program.settings.cycle_us));
    match program.dialect {
        LadderDialect::Ldmicro23 => delay.checked_div(cycle).map(|scans| scans + adjust),
        // LDmicro 5 divides once, so a negative number is cut towards 0.
        LadderDialect::Ldmicro5 | LadderDialect::Iec => (delay + cycle * adjust).checked_div(cycle),
    }
}

/// Adjust in scans of a timer without an adjust argument.
///
/// Release 2.3 subtracts one scan, and LDmicro 5 does the same for files with the 0.1 header.
pub(crate) fn default_adjust(program: &LadderProgram) -> i128 {
    match (program.dialect, program.format) {
        (LadderDialect::Ldmicro23, _) | (LadderDialect::Ldmicro5, LdFormat::V01) => -1,
        (LadderDialect::Ldmicro5, LdFormat::V02) | (LadderDialect::Iec, _) => 0,
    }
}
