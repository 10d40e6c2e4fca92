//! Reports where the cycles of a run went: as a table, as JSON, and as folded stacks for flame graphs.

use std::collections::BTreeMap;

use emu_debug::ProgramSource;
use emu_debug::profile::{CycleProfile, InstructionCycles, InterruptCycles, InterruptStatistics};
use serde_json::{Value, json};

use super::rungs::MappedLadder;

/// The cycles of a run, by function, rung and interrupt.
pub struct CycleReport {
    total: u64,
    /// Cycles before the first instruction.
    before_first: u64,
    /// Idle cycles, in which the core executed nothing.
    idle: u64,
    /// Cycles of interrupt entries that another interrupt ended before an instruction ran.
    nested_entries: u64,
    /// By function, in descending order of cycles.
    functions: Vec<(String, u64)>,
    /// By rung, numbered from 1; `None` for code in no rung. Empty without a map.
    rungs: BTreeMap<Option<u32>, u64>,
    /// By interrupt, by its name.
    interrupts: Vec<(String, InterruptStatistics)>,
    /// By interrupt (or `program`) and function.
    stacks: BTreeMap<(String, String), u64>,
}

/// The name for idle cycles.
const IDLE: &str = "(idle)";
/// The name for interrupt entries that another interrupt ended before an instruction ran.
const NESTED_ENTRIES: &str = "(entry of an interrupt)";
/// The name for code before the first symbol.
const NO_SYMBOL: &str = "(no symbol)";

impl CycleReport {
    /// Adds up the counts of a profile.
    pub fn new(profile: &CycleProfile, source: &ProgramSource<'_>, rungs: Option<&MappedLadder>) -> CycleReport {
        let chip = source.names.chip;
        let vector_name =
            |number: u8| chip.vectors.get(usize::from(number)).map_or_else(|| number.to_string(), |n| (*n).to_owned());
        let serving = |vector: Option<u8>| vector.map_or("program".to_owned(), vector_name);
        let (mut functions, mut by_rung, mut stacks) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
        for InstructionCycles { interrupt: service, word: pc, cycles: count } in profile.cycles() {
            let symbol = source.names.nearest_symbol(pc * chip.word_bytes);
            let name = symbol.as_deref().map_or(NO_SYMBOL, |name| name.split('+').next().unwrap_or(name)).to_owned();
            if let Some(rungs) = rungs {
                *by_rung.entry(rungs.rung_at(pc)).or_default() += count;
            }
            *stacks.entry((serving(service), name.clone())).or_default() += count;
            *functions.entry(name).or_default() += count;
        }
        for InterruptCycles { serving: service, cycles: count } in profile.idle() {
            *stacks.entry((serving(service), IDLE.to_owned())).or_default() += count;
        }
        for InterruptCycles { serving: service, cycles: count } in profile.entries() {
            *stacks.entry((serving(service), NESTED_ENTRIES.to_owned())).or_default() += count;
        }
        let mut functions: Vec<(String, u64)> = functions.into_iter().collect();
        functions.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
        CycleReport {
            total: profile.total_cycles(),
            before_first: profile.cycles_before_first(),
            idle: profile.idle().map(|one| one.cycles).sum(),
            nested_entries: profile.entries().map(|one| one.cycles).sum(),
            functions,
            rungs: by_rung,
            interrupts: profile.services().map(|one| (vector_name(one.vector), one.service)).collect(),
            stacks,
        }
    }

    /// Returns the report as a table.
    pub fn text(&self) -> String {
        let share = |count: u64| {
            let part = (u128::from(count) * 1000).checked_div(u128::from(self.total)).unwrap_or(0);
            format!("{}.{} %", part / 10, part % 10)
        };
        let row = |name: &str, count: u64| format!("  {count:>14}  {:>7}  {name}\n", share(count));
        let mut out = format!("profile    {} cycles\n", self.total);
        for (name, count) in &self.functions {
            out.push_str(&row(name, *count));
        }
        for (name, count) in [
            (IDLE, self.idle),
            (NESTED_ENTRIES, self.nested_entries),
            ("(before the first instruction)", self.before_first),
        ] {
            if count > 0 {
                out.push_str(&row(name, count));
            }
        }
        if !self.rungs.is_empty() {
            out.push_str("by rung\n");
            let (none, of): (Vec<_>, Vec<_>) = self.rungs.iter().partition(|(rung, _)| rung.is_none());
            for (rung, count) in of.into_iter().chain(none) {
                let name = rung.map_or("(no rung)".to_owned(), |rung| format!("rung {rung}"));
                out.push_str(&row(&name, *count));
            }
        }
        if !self.interrupts.is_empty() {
            out.push_str(&format!("interrupt {:>6}  {:>7}  {:>7}\n", "cycles", "count", "longest"));
            for (name, InterruptStatistics { entry_count: count, total_cycles: total, longest_cycles: longest }) in
                &self.interrupts
            {
                out.push_str(&format!("  {total:>14}  {count:>7}  {longest:>7}  {name}\n"));
            }
        }
        out
    }

    /// Returns the report as a member of the JSON document.
    pub fn document(&self) -> Value {
        let function = |(name, cycles): &(String, u64)| json!({ "name": name, "cycles": cycles });
        let rung = |(rung, cycles): (&Option<u32>, &u64)| json!({ "rung": rung, "cycles": cycles });
        let interrupt = |(name, service): &(String, InterruptStatistics)| json!({ "name": name, "count": service.entry_count, "cycles": service.total_cycles, "longest": service.longest_cycles });
        json!({
            "cycles": self.total,
            "before": self.before_first,
            "idle": self.idle,
            "entries": self.nested_entries,
            "functions": self.functions.iter().map(function).collect::<Vec<_>>(),
            "rungs": self.rungs.iter().map(rung).collect::<Vec<_>>(),
            "interrupts": self.interrupts.iter().map(interrupt).collect::<Vec<_>>(),
        })
    }

    /// Returns one line per stack: its parts separated by `;`, and its cycles. The cycles of all lines add up
    /// to the total.
    pub fn folded_stacks(&self) -> String {
        let plain = |name: &str| name.replace([';', ' ', '\n'], "_");
        let line = |((serving, name), count): (&(String, String), &u64)| {
            format!("{};{} {count}\n", plain(serving), plain(name))
        };
        let mut out: String = self.stacks.iter().map(line).collect();
        if self.before_first > 0 {
            out.push_str(&format!("(before_the_first_instruction) {}\n", self.before_first));
        }
        out
    }
}
