//! How many bytes an integer has, and how many a constant needs.

use std::collections::HashMap;

use crate::model::{Dialect, Element, Format, Operand, Program};

/// The width of the integers of release 2.3, and of those that nothing says more about, in bytes.
const USUAL: u8 = 2;

/// The widths of all integers of a program.
pub(crate) struct Widths<'a> {
    /// Those of `VAR LIST`, and of the accumulators that stand in none.
    known: HashMap<&'a str, u8>,
}

impl<'a> Widths<'a> {
    /// Looks through the whole program. In dialect 2.3 every integer has two bytes, whatever `VAR LIST` says.
    pub(crate) fn new(program: &'a Program) -> Widths<'a> {
        let mut known = HashMap::new();
        if program.dialect == Dialect::Ldmicro23 {
            return Widths { known };
        }
        let declared: HashMap<&str, u8> = program.vars.iter().flatten().map(|v| (v.name.as_str(), v.bytes)).collect();
        // A variable as the limit has the width that is declared for it, or the usual one; no chain of limits is followed.
        let operand = |operand: &Operand| match operand {
            Operand::Const { value, .. } => least(i128::from(*value)),
            Operand::Var(name) => declared.get(name.as_str()).copied().unwrap_or(USUAL),
        };
        for (_, element, _) in program.elements() {
            let (name, bytes) = match element {
                Element::Timer { name, delay, adjust, .. } => {
                    (name, preset(program, delay, adjust.as_ref()).map_or(USUAL, least))
                }
                Element::Counter { name, max, init, .. } => (name, operand(max).max(init.as_ref().map_or(0, operand))),
                _ => continue,
            };
            let slot = known.entry(name.as_str()).or_insert(bytes);
            *slot = bytes.max(*slot);
        }
        known.extend(declared);
        Widths { known }
    }

    /// The width of an integer in bytes, 1 to 4.
    pub(crate) fn of(&self, name: &str) -> u8 {
        self.known.get(name).copied().unwrap_or(USUAL)
    }

    /// The width of an operand in bytes: a constant has the least that holds it.
    pub(crate) fn operand(&self, operand: &Operand) -> u8 {
        match operand {
            Operand::Const { value, .. } => least(i128::from(*value)),
            Operand::Var(name) => self.of(name),
        }
    }
}

/// The fewest bytes, 1 to 4, that hold a number as two's complement; 4 for what none holds.
pub(crate) fn least(value: i128) -> u8 {
    (1..4).find(|bytes| (-largest(*bytes) - 1..=largest(*bytes)).contains(&value)).unwrap_or(4)
}

/// The largest number of a width in bytes.
pub(crate) const fn largest(bytes: u8) -> i128 {
    (1 << (8 * bytes as u32 - 1)) - 1
}

/// P, the scans that a timer counts: whole cycles in the delay, and the adjust. `None` where the delay or the adjust is a
/// variable, or where there is no cycle.
pub(crate) fn preset(program: &Program, delay: &Operand, adjust: Option<&Operand>) -> Option<i128> {
    let Operand::Const { value: delay, .. } = delay else { return None };
    let adjust = match adjust {
        Some(Operand::Const { value, .. }) => i128::from(*value),
        Some(Operand::Var(_)) => return None,
        None => default_adjust(program),
    };
    i128::from(*delay).checked_div(i128::from(program.settings.cycle_us)).map(|scans| scans + adjust)
}

/// The adjust of a timer that names none: release 2.3 takes one scan off, and LDmicro 5 does so for its files.
pub(crate) fn default_adjust(program: &Program) -> i128 {
    match (program.dialect, program.format) {
        (Dialect::Ldmicro23, _) | (Dialect::Ldmicro5, Format::V01) => -1,
        (Dialect::Ldmicro5, Format::V02) => 0,
    }
}
