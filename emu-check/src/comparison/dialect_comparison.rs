//! Runs one program in two dialects side by side and finds what differs: `emu migrate`.

use std::collections::BTreeSet;

use diag::Pos;
use ladder::symbols::for_each_symbol_use;
use ladder::{
    CounterKind, Element, ElementId, LadderDialect, LadderOperand, LadderProgram, LadderSymbol, LdFormat,
    ProgramElement,
};
use ladder_eval::{Evaluator, UnsupportedElement};

use crate::coverage::goals::CoverageGoals;
use crate::stimulus::boundary_goals::BoundaryGoals;
use crate::stimulus::generator::{ScanStimulus, StimulusGenerator};
use crate::stimulus::stimulus_symbols::StimulusSymbols;

/// The long run after each round, in which inputs may keep a level for long, has the number of all scans
/// divided by this.
const LONG_RUN_DIVISOR: u64 = 8;

/// One element or symbol that has another meaning in the other dialect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeaningChange {
    /// The element; `None` if the change is one of a symbol as a whole.
    pub element: Option<ElementId>,
    /// The place of the element, or of the first element that uses the symbol.
    pub pos: Pos,
    /// What changes, as a phrase: `CTC Ca 3: ...`.
    pub text: String,
}

/// The first scan in which a symbol differs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SymbolDifference {
    /// The name of the symbol; `serial line` for the bytes that are sent.
    pub name: String,
    /// Number of the scan since reset, from 1: the lowest one of all runs in which the symbol differs.
    pub scan: u64,
    /// The value after that scan in the dialect of the file; -1 if the serial line sent nothing.
    pub before: i32,
    /// The value after that scan in the other dialect; -1 if the serial line sent nothing.
    pub after: i32,
}

/// The levels of the inputs and analog inputs in one scan.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputRow {
    /// One value for each of [`DialectComparison::inputs`].
    pub values: Vec<i32>,
    /// The byte that arrives before the scan.
    pub byte: Option<u8>,
}

/// The result of running a program in two dialects.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DialectComparison {
    /// Number of scans executed in each dialect.
    pub scans: u64,
    /// Number of runs from reset.
    pub runs: u64,
    /// Each symbol that differs, with its first scan; earliest first.
    pub differences: Vec<SymbolDifference>,
    /// Names of the inputs and analog inputs.
    pub inputs: Vec<String>,
    /// The inputs from reset to the first difference, one row a scan; empty if there is none.
    pub stimulus: Vec<InputRow>,
}

/// Name of the serial line among the symbols that differ.
pub const SERIAL_LINE: &str = "serial line";

/// The two evaluators with the same inputs.
struct DialectPair<'a> {
    /// For each symbol of `before` that `after` has too: name, and index in both.
    symbols: Vec<(&'a str, usize, usize)>,
    /// The inputs of `before`, and those of `after` in the same order.
    stimulus_symbols: &'a StimulusSymbols,
    symbols_after: &'a StimulusSymbols,
    before: Evaluator,
    after: Evaluator,
}

impl DialectPair<'_> {
    /// Executes one scan in both dialects.
    fn scan(&mut self, stimulus: &ScanStimulus) {
        stimulus.apply_immediately(self.stimulus_symbols, &mut self.before);
        stimulus.apply_immediately(self.symbols_after, &mut self.after);
        self.before.scan();
        self.after.scan();
    }

    /// The symbols that differ now, with both values.
    fn differing(&self) -> impl Iterator<Item = (&str, i32, i32)> {
        let values =
            self.symbols.iter().map(|&(name, before, after)| (name, self.before.get(before), self.after.get(after)));
        let sent = |eval: &Evaluator| eval.sent_bytes().iter().fold(-1, |all, byte| all << 8 | i32::from(*byte));
        values
            .chain([(SERIAL_LINE, sent(&self.before), sent(&self.after))])
            .filter(|(_, before, after)| before != after)
    }
}

/// Runs `before` and `after`, which are one program in two dialects, with the same random inputs from reset,
/// `scans` scans in all. The inputs depend only on the program and `seed`.
///
/// # Errors
/// One of the two has an element without a meaning in its dialect.
pub fn compare_dialects(
    before: &LadderProgram,
    after: &LadderProgram,
    scans: u64,
    seed: u64,
) -> Result<DialectComparison, UnsupportedElement> {
    let (eval_before, eval_after) = (Evaluator::new(before)?, Evaluator::new(after)?);
    let (mut stimulus_symbols, symbols_after) =
        (StimulusSymbols::new(before, &eval_before), StimulusSymbols::new(after, &eval_after));
    // Only what a user can do from outside: nothing is written.
    stimulus_symbols.writable.fill(false);
    let goals = CoverageGoals::new(before, &eval_before);
    let long = usize::try_from(scans / LONG_RUN_DIVISOR).unwrap_or(usize::MAX);
    let mut generator = StimulusGenerator::with_long_runs(seed, BoundaryGoals::new(before, &eval_before), long);
    let names: Vec<LadderSymbol> = eval_before.symbols().to_vec();
    let indices = names.iter().enumerate();
    let symbols = indices
        .filter_map(|(index, symbol)| Some((symbol.name.as_str(), index, eval_after.index(&symbol.name)?)))
        .collect();
    let mut pair = DialectPair {
        symbols,
        stimulus_symbols: &stimulus_symbols,
        symbols_after: &symbols_after,
        before: eval_before.clone(),
        after: eval_after.clone(),
    };
    let inputs = stimulus_symbols
        .inputs
        .iter()
        .chain(&stimulus_symbols.analog)
        .map(|&symbol| names[symbol].name.clone())
        .collect();
    let mut result = DialectComparison { scans, inputs, ..DialectComparison::default() };
    let (mut rows, mut scan) = (Vec::new(), 0);
    for _ in 0..scans {
        if generator.begin_run(&stimulus_symbols).is_some() {
            (pair.before, pair.after) = (eval_before.clone(), eval_after.clone());
            rows.clear();
            (result.runs, scan) = (result.runs + 1, 0);
        }
        let mut stimulus = generator.next_stimulus(&stimulus_symbols, &pair.before, &goals);
        stimulus.writes.clear();
        let first = result.differences.first().map_or(u64::MAX, |known| known.scan);
        scan += 1;
        if scan < first {
            let values =
                stimulus.inputs.iter().map(|on| i32::from(*on)).chain(stimulus.analog.iter().map(|v| i32::from(*v)));
            rows.push(InputRow { values: values.collect(), byte: stimulus.byte });
        }
        pair.scan(&stimulus);
        let mut found = false;
        for (name, before, after) in pair.differing() {
            found = true;
            let difference = SymbolDifference { name: name.to_owned(), scan, before, after };
            match result.differences.iter_mut().find(|known| known.name == name) {
                Some(known) if known.scan > scan => *known = difference,
                Some(_) => {}
                None => result.differences.push(difference),
            }
        }
        if found {
            if scan < first {
                result.stimulus.clone_from(&rows);
            }
            // The sort is stable: symbols of one scan keep their order.
            result.differences.sort_by_key(|known| known.scan);
        }
    }
    Ok(result)
}

/// Lists what has another meaning in the dialect of `after`, which is the program `before` read in the other
/// dialect.
#[must_use]
pub fn meaning_changes(before: &LadderProgram, after: &LadderProgram) -> Vec<MeaningChange> {
    let mut changes: Vec<MeaningChange> = Vec::new();
    for ProgramElement { id, element, pos } in before.elements() {
        let rule = element_change(before, element, after.dialect);
        changes.extend(rule.map(|text| MeaningChange {
            element: Some(id),
            pos,
            text: format!("{}: {text}", ladder::element_text(element)),
        }));
    }
    for (old, new) in before.elements().zip(after.elements()) {
        changes.extend(literal_changes(old.element, new.element).map(|text| MeaningChange {
            element: Some(old.id),
            pos: old.pos,
            text: format!("{}: {text}", ladder::element_text(old.element)),
        }));
    }
    let mut seen = BTreeSet::new();
    let others = after.symbols();
    for ProgramElement { element, pos, .. } in before.elements() {
        for_each_symbol_use(element, &mut |name, kind| {
            if kind.is_bit() || !seen.insert(name.to_owned()) {
                return;
            }
            let bytes =
                |list: &[LadderSymbol]| list.iter().find(|symbol| symbol.name == name).map(|symbol| symbol.bytes);
            let (Some(old), Some(new)) = (bytes(&before.symbols()), bytes(&others)) else { return };
            if old != new {
                let text = format!("{name}: {}, was {}", range_text(new), range_text(old));
                changes.push(MeaningChange { element: None, pos, text });
            }
        });
    }
    changes
}

/// The width and the range of a signed integer of `bytes` bytes.
fn range_text(bytes: u8) -> String {
    let most = 1i64 << (8 * u32::from(bytes.clamp(1, 4)) - 1);
    let unit = if bytes == 1 { "byte" } else { "bytes" };
    format!("{bytes} {unit} (-{most} to {})", most - 1)
}

/// Literals of one spelling that are another number in the other dialect.
fn literal_changes(before: &Element, after: &Element) -> impl Iterator<Item = String> {
    let literals = |element: &Element| -> Vec<LadderOperand> {
        let mut copy = element.clone();
        let mut all: Vec<LadderOperand> = copy.operands_mut().into_iter().map(|operand| operand.clone()).collect();
        if let Element::Timer { delay, adjust, .. } = element {
            all.extend(std::iter::once(delay).chain(adjust).cloned());
        }
        all
    };
    literals(before).into_iter().zip(literals(after)).filter_map(|pair| match pair {
        (LadderOperand::Const { value: old, text }, LadderOperand::Const { value: new, .. }) if old != new => {
            Some(format!("{text} is {new}, was {old}"))
        }
        _ => None,
    })
}

/// Says what an element does in the dialect `to` that it does not do in the other; `None` if it does the
/// same.
fn element_change(program: &LadderProgram, element: &Element, to: LadderDialect) -> Option<&'static str> {
    let counts = |name: &str| {
        let has_start =
            |init: &Option<LadderOperand>| !matches!(init, None | Some(LadderOperand::Const { value: 0, .. }));
        program.elements().any(
            |ProgramElement { element: other, .. }| matches!(other, Element::Counter { name: n, init, .. } if n == name && has_start(init)),
        )
    };
    let newer = to == LadderDialect::Ldmicro5;
    match element {
        Element::Counter { kind: CounterKind::Ctu, .. } if newer => Some("stops at its limit; 2.3 counts on"),
        Element::Counter { kind: CounterKind::Ctu, .. } => Some("counts on at its limit; 5.x stops there"),
        Element::Counter { kind: CounterKind::Ctd, .. } if newer => {
            Some("counts down to its limit, and its output is n > limit; 2.3 counts on, and its output is n >= limit")
        }
        Element::Counter { kind: CounterKind::Ctd, .. } => Some(
            "counts on below its limit, and its output is n >= limit; 5.x stops there, and its output is n > limit",
        ),
        Element::Counter { kind: CounterKind::Ctc, .. } if newer => {
            Some("its output is a carry of one scan; 2.3 passes the rung on")
        }
        Element::Counter { kind: CounterKind::Ctc, .. } => {
            Some("passes the rung on; in 5.x its output is a carry of one scan")
        }
        Element::Res { name } if counts(name) && newer => Some("stores the start value of the counter; 2.3 stores 0"),
        Element::Res { name } if counts(name) => Some("stores 0; 5.x stores the start value of the counter"),
        Element::Timer { delay: LadderOperand::Const { .. }, adjust: None, .. }
            if !newer && program.format == LdFormat::V02 =>
        {
            Some("takes one scan less: the adjust is -1 in 2.3, and 0 in a file of 5.x")
        }
        // Timers of old files compute the same; the widths of their integers are listed by symbol. What one
        // dialect lacks is refused.
        _ => None,
    }
}
