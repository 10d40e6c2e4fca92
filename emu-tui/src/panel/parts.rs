//! Timers and counters of a program: preset, accumulator, and done bit.

use ladder::{Element, ElementId, LadderOperand, LadderProgram, ProgramElement};

use super::scan_history::PanelMachine;
use crate::rung_picture::PowerFlowSource;

/// A timer or counter of the program.
#[derive(Debug, Clone)]
pub(super) struct CountingPart {
    id: ElementId,
    /// LDmicro's keyword of the element.
    pub word: &'static str,
    /// Name of the accumulator.
    pub name: String,
    limit: LadderOperand,
    timer: bool,
}

/// The current values of a timer or counter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PartRow {
    /// The preset.
    pub preset: String,
    /// The accumulator.
    pub accumulator: String,
    /// The accumulator in thousandths of the preset.
    pub thousandths: usize,
    /// The done bit: the output of the element in the last scan; for a circular counter, whether it is at its
    /// limit.
    pub done: bool,
}

/// The timers and counters of a program, in text order.
pub(super) fn counting_parts(program: &LadderProgram) -> Vec<CountingPart> {
    let part = |ProgramElement { id, element, .. }: ProgramElement<'_>| {
        let (name, limit, timer) = match element {
            Element::Timer { name, delay, .. } => (name, delay, true),
            Element::Counter { name, max, .. } => (name, max, false),
            // Other elements have no preset.
            _ => return None,
        };
        let word = element.facts().keyword;
        Some(CountingPart { id, word, name: name.clone(), limit: limit.clone(), timer })
    };
    program.elements().filter_map(part).collect()
}

impl CountingPart {
    /// The current values.
    pub(super) fn row(&self, machine: &PanelMachine) -> PartRow {
        let value = |name: &str| machine.index(name).map_or(0, |index| i64::from(machine.get(index)));
        let count = value(&self.name);
        let limit = match &self.limit {
            LadderOperand::Var(name) => value(name),
            LadderOperand::Const { value, .. } => *value,
        };
        let out = machine.power_flow(self.id).is_some_and(|power| power.after);
        let (preset, accumulator, at) = if self.timer {
            // The delay of a timer is in microseconds, its accumulator in scans.
            let at = count.saturating_mul(i64::try_from(machine.cycle_us()).unwrap_or(i64::MAX));
            (format_us(limit), format_us(at.min(limit.max(0))), at)
        } else {
            (limit.to_string(), count.to_string(), count)
        };
        let share = i128::from(at.clamp(0, limit.max(0))) * 1000 / i128::from(limit.max(1));
        let thousandths = usize::try_from(share).unwrap_or(0);
        PartRow { preset, accumulator, thousandths, done: if self.word == "CTC" { count >= limit } else { out } }
    }
}

/// A time in microseconds as text with a suitable unit.
pub(super) fn format_us(us: i64) -> String {
    let decimal = |unit: i64, digits: usize, name: &str| {
        let text = format!("{}.{:0digits$}", us / unit, us.abs() % unit);
        format!("{} {name}", text.trim_end_matches('0').trim_end_matches('.'))
    };
    match us.abs() {
        0 => "0".to_owned(),
        1..1_000 => format!("{us} us"),
        1_000..1_000_000 => decimal(1_000, 3, "ms"),
        _ => decimal(1_000_000, 6, "s"),
    }
}
