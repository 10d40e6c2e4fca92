//! Timers and counters, one row each: what they count to, where they are, and whether they are done.

use ladder::{Element, ElementId, LadderOperand, LadderProgram};

use super::scan_history::PanelMachine;
use crate::rung_picture::PowerFlowSource;

/// A timer or counter of the program.
#[derive(Debug, Clone)]
pub(super) struct CountingPart {
    id: ElementId,
    /// LDmicro's word for it.
    pub word: &'static str,
    /// The accumulator's name.
    pub name: String,
    limit: LadderOperand,
    timer: bool,
}

/// A row of the panel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PartRow {
    /// What it counts to.
    pub preset: String,
    /// Where it is.
    pub accumulator: String,
    /// How far that is, in thousandths.
    pub thousandths: usize,
    /// Its done bit: what it let out in the last scan; of a circular counter, that it stands at its limit.
    pub done: bool,
}

/// Those of a program, in text order.
pub(super) fn counting_parts(program: &LadderProgram) -> Vec<CountingPart> {
    let part = |(id, element, _): (ElementId, &Element, _)| {
        let (name, limit, timer) = match element {
            Element::Timer { name, delay, .. } => (name, delay, true),
            Element::Counter { name, max, .. } => (name, max, false),
            // Nothing else counts to a preset.
            _ => return None,
        };
        let word = element.facts().keyword;
        Some(CountingPart { id, word, name: name.clone(), limit: limit.clone(), timer })
    };
    program.elements().filter_map(part).collect()
}

impl CountingPart {
    /// How it stands.
    pub(super) fn row(&self, machine: &PanelMachine) -> PartRow {
        let value = |name: &str| machine.index(name).map_or(0, |index| i64::from(machine.get(index)));
        let count = value(&self.name);
        let limit = match &self.limit {
            LadderOperand::Var(name) => value(name),
            LadderOperand::Const { value, .. } => *value,
        };
        let out = machine.power_flow(self.id).is_some_and(|(_, went)| went);
        let (preset, accumulator, at) = if self.timer {
            // A delay is in microseconds and its accumulator in scans.
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

/// Microseconds as people say them.
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
