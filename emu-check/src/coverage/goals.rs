//! The outcomes that a check should reach, and which of them it has reached, observed on the evaluator
//! element by element.

use std::collections::HashMap;

use ladder::{Element, ElementId, LadderProgram, ProgramElement, RungNode};
use ladder_eval::Evaluator;

use crate::coverage::classes::{CoverageClass, LadderCoverage, MissingOutcome};
use crate::coverage::possible_outcomes::{self, FALSE_FALSE, FALSE_TRUE, TRUE_FALSE, TRUE_TRUE};
use crate::coverage::rules::{OutcomeCondition, WantedOutcome, wanted_outcomes};
use crate::stimulus::generator::ScanStimulus;
use crate::stimulus::stimulus_symbols::StimulusSymbols;

/// One scan of the evaluator: symbol values before and after, and the rung bit at every element in text
/// order.
#[derive(Debug, Clone, Default)]
pub(crate) struct EvaluatedScan {
    values_before: Vec<i32>,
    values_after: Vec<i32>,
    /// True if a byte was sent.
    sent: bool,
    /// True if a write to the EEPROM began.
    wrote_eeprom: bool,
    /// Rung bit before and after each element, when it was executed last; `None` if it was not.
    pub trace: Vec<Option<(bool, bool)>>,
}

impl EvaluatedScan {
    /// Runs one scan and records it.
    pub(crate) fn run(eval: &mut Evaluator) -> EvaluatedScan {
        let symbols = eval.symbols().len();
        let before = (0..symbols).map(|i| eval.get(i)).collect();
        let mut trace = Vec::new();
        let busy = eval.eeprom_busy_scans();
        if eval.has_jumps() {
            let elements: Vec<ElementId> = eval.elements().collect();
            trace = vec![None; elements.len()];
            eval.scan_watched(&mut |id, input, output| {
                let slot = elements.binary_search(&id).ok().and_then(|position| trace.get_mut(position));
                slot.into_iter().for_each(|slot| *slot = Some((input, output)));
            });
        } else {
            eval.scan_watched(&mut |_, input, output| trace.push(Some((input, output))));
        }
        let after = (0..symbols).map(|i| eval.get(i)).collect();
        // The busy count falls by one per scan, so a higher count means that a write began.
        let wrote = eval.eeprom_busy_scans() > busy.saturating_sub(1);
        EvaluatedScan {
            values_before: before,
            values_after: after,
            sent: eval.sent().is_some(),
            wrote_eeprom: wrote,
            trace,
        }
    }

    /// The change of a symbol's value in the scan.
    pub(crate) fn change_of(&self, symbol: usize) -> i32 {
        let of = |values: &[i32]| values.get(symbol).copied().unwrap_or(0);
        of(&self.values_after).wrapping_sub(of(&self.values_before))
    }

    /// Returns true if a symbol other than `symbol` has a different value after the two scans.
    pub(crate) fn differs_elsewhere(&self, other: &EvaluatedScan, symbol: usize) -> bool {
        self.values_after.iter().zip(&other.values_after).enumerate().any(|(n, (a, b))| n != symbol && a != b)
    }
}

/// One outcome of an element or branch.
#[derive(Debug, Clone)]
struct CoverageGoal {
    /// Index of the element or branch in [`CoverageGoals::items`].
    item: usize,
    /// Bit set of the (input, output) rung-bit pairs that count.
    rung_pairs: u8,
    /// The condition in addition to the rung bits.
    when: OutcomeCondition,
    /// The outcome in the words of the report.
    text: &'static str,
    /// Why it can never be reached, if that is known.
    impossible: Option<&'static str>,
    reached: bool,
}

/// An element, or a branch, which is named by its first element.
#[derive(Debug, Clone)]
struct CoverageItem {
    id: ElementId,
    class: CoverageClass,
    /// Positions in the trace: the element's own, or those whose outputs are combined into the branch's
    /// output.
    trace_positions: Vec<usize>,
}

/// All coverage goals of a program.
#[derive(Debug, Clone)]
pub(crate) struct CoverageGoals {
    items: Vec<CoverageItem>,
    goals: Vec<CoverageGoal>,
    /// Number of possible goals that are not reached yet.
    open_goals: usize,
}

impl CoverageGoals {
    /// Collects the coverage goals of a program, and excludes outcomes that are impossible.
    pub(crate) fn new(program: &LadderProgram, eval: &Evaluator) -> CoverageGoals {
        let mut goals = CoverageGoals { items: Vec::new(), goals: Vec::new(), open_goals: 0 };
        let elements = program.elements().filter(|at| !matches!(at.element, Element::Comment(_)));
        for (position, ProgramElement { id, element, .. }) in elements.enumerate() {
            let symbol = |name: &str| eval.index(name).unwrap_or(usize::MAX);
            if let Some((class, wanted)) = wanted_outcomes(program, element, eval, &symbol) {
                goals.add_item(CoverageItem { id, class, trace_positions: vec![position] }, &wanted);
            }
        }
        let mut next_position = 0;
        for (number, rung) in (0..).zip(&program.rungs) {
            let mut id = ElementId { rung: number, index: 0 };
            goals.add_branch_goals(&rung.series, &mut next_position, &mut id);
        }
        let outcomes_by_inputs = possible_outcomes::possible_outcomes(program);
        for goal in &mut goals.goals {
            goal.impossible =
                goals.items.get(goal.item).and_then(|item| why_impossible(goal, item, &outcomes_by_inputs));
        }
        goals.open_goals = goals.goals.iter().filter(|g| g.impossible.is_none()).count();
        goals
    }

    /// Adds an element or branch with its goals.
    fn add_item(&mut self, item: CoverageItem, wanted: &[WantedOutcome]) {
        let goal = |&(text, pairs, when): &WantedOutcome| CoverageGoal {
            item: self.items.len(),
            rung_pairs: pairs,
            when,
            text,
            impossible: None,
            reached: false,
        };
        self.goals.extend(wanted.iter().map(goal));
        self.items.push(item);
    }

    /// Adds goals for the branches of all parallel groups in a series. Returns the trace positions whose
    /// outputs form the output of the series, or `None` if it has only comments.
    fn add_branch_goals(
        &mut self,
        series: &[RungNode],
        next_position: &mut usize,
        id: &mut ElementId,
    ) -> Option<Vec<usize>> {
        let mut last = None;
        for node in series {
            match node {
                RungNode::Leaf(element, _) => {
                    id.index += 1;
                    if !matches!(element, Element::Comment(_)) {
                        last = Some(vec![*next_position]);
                        *next_position += 1;
                    }
                }
                RungNode::Parallel(branches, _) => {
                    let mut outputs = Some(Vec::new());
                    for branch in branches {
                        let first = *id;
                        let positions = self.add_branch_goals(branch, next_position, id);
                        // The goals of a branch of elements without memory are those of its single element.
                        let leaves = (id.index - first.index) as usize;
                        if let Some(positions) = positions.as_ref().filter(|_| leaves > 1 || !is_simple_branch(branch))
                        {
                            let both = [
                                ("is true", 0, OutcomeCondition::Branch(true)),
                                ("is false", 0, OutcomeCondition::Branch(false)),
                            ];
                            self.add_item(
                                CoverageItem {
                                    id: first,
                                    class: CoverageClass::Branches,
                                    trace_positions: positions.clone(),
                                },
                                &both,
                            );
                        }
                        outputs = outputs.zip(positions).map(|(mut outputs, positions)| {
                            outputs.extend(positions);
                            outputs
                        });
                    }
                    last = outputs;
                }
            }
        }
        last
    }

    /// Returns true if a possible goal has not been reached.
    pub(crate) fn has_open_goals(&self) -> bool {
        self.open_goals > 0
    }

    /// Number of possible goals that have not been reached.
    pub(crate) fn open_goal_count(&self) -> usize {
        self.open_goals
    }

    /// Number of open goals that a scan with `stimulus` would reach.
    pub(crate) fn count_gain(
        &self,
        eval: &Evaluator,
        stimulus_symbols: &StimulusSymbols,
        stimulus: &ScanStimulus,
    ) -> usize {
        let mut eval = eval.clone();
        stimulus.apply_immediately(stimulus_symbols, &mut eval);
        let scan = EvaluatedScan::run(&mut eval);
        self.goals.iter().filter(|goal| !goal.reached && self.is_reached(goal, &scan)).count()
    }

    /// Marks the goals that a scan reached.
    pub(crate) fn mark_reached(&mut self, scan: &EvaluatedScan) {
        if self.goals.iter().all(|goal| goal.reached) {
            return;
        }
        let hits: Vec<bool> = self.goals.iter().map(|goal| !goal.reached && self.is_reached(goal, scan)).collect();
        for (goal, hit) in self.goals.iter_mut().zip(hits) {
            if hit {
                goal.reached = true;
                self.open_goals -= usize::from(goal.impossible.is_none());
            }
        }
    }

    fn is_reached(&self, goal: &CoverageGoal, scan: &EvaluatedScan) -> bool {
        let Some(item) = self.items.get(goal.item) else { return false };
        let mut outputs =
            item.trace_positions.iter().filter_map(|&position| scan.trace.get(position).copied().flatten());
        if let OutcomeCondition::Branch(out) = goal.when {
            return outputs.any(|pair| pair.1) == out;
        }
        let Some((input, output)) = outputs.next() else { return false };
        let of = |values: &[i32], symbol: usize| values.get(symbol).copied().unwrap_or(0);
        let (before, after) = (|s| of(&scan.values_before, s), |s| of(&scan.values_after, s));
        goal.rung_pairs & pair_bit(input, output) != 0
            && match goal.when {
                OutcomeCondition::Always | OutcomeCondition::Branch(_) => true,
                OutcomeCondition::TimerRan(symbol) => before(symbol) != 0,
                OutcomeCondition::Counted(symbol) => scan.change_of(symbol).wrapping_abs() == 1,
                OutcomeCondition::Overflowed(symbol, bytes) => {
                    let span = 1i64 << (8 * u32::from(bytes.clamp(1, 4)));
                    (i64::from(after(symbol)) - i64::from(before(symbol))).abs() == span - 1
                }
                OutcomeCondition::Within { symbol, least, most, ignores_value_after } => {
                    let within = |value: i32| (least..=most).contains(&value.into());
                    within(before(symbol)) && (ignores_value_after || within(after(symbol)))
                }
                OutcomeCondition::Changed(symbol) => scan.change_of(symbol) != 0,
                OutcomeCondition::SentByte => scan.sent,
                OutcomeCondition::WroteEeprom => scan.wrote_eeprom,
                OutcomeCondition::Wrapped(symbol, max) => before(symbol) >= max && after(symbol) < before(symbol),
            }
    }

    /// The coverage for the report.
    pub(crate) fn coverage(&self, program: &LadderProgram) -> LadderCoverage {
        let elements: HashMap<ElementId, &Element> =
            program.elements().map(|ProgramElement { id, element, .. }| (id, element)).collect();
        let text = |id| elements.get(&id).map_or_else(String::new, |element| ladder::element_text(element));
        // Per item: whether all its goals are reached; `None` if one of them is impossible.
        let mut states = vec![Some(true); self.items.len()];
        for goal in &self.goals {
            if let Some(state) = states.get_mut(goal.item) {
                *state = state.filter(|_| goal.impossible.is_none()).map(|all| all && goal.reached);
            }
        }
        let items = self.items.iter().map(|item| item.class).zip(states);
        let missing = self.goals.iter().filter(|goal| !goal.reached).filter_map(|goal| {
            let item = self.items.get(goal.item)?;
            Some(MissingOutcome {
                rung: item.id.rung + 1,
                element: item.id.index + 1,
                element_text: text(item.id),
                class: item.class,
                what: goal.text.to_owned(),
                impossible: goal.impossible.map(str::to_owned),
            })
        });
        LadderCoverage::new(items, missing.collect())
    }

    /// Number of goals that were reached although the analysis called them impossible: an error of the
    /// analysis, for tests.
    #[cfg(test)]
    pub fn contradictions(&self) -> usize {
        self.goals.iter().filter(|goal| goal.reached && goal.impossible.is_some()).count()
    }
}

fn is_simple_branch(branch: &[RungNode]) -> bool {
    let timed = |element: &Element| element.facts().has_memory;
    !branch.iter().any(|node| matches!(node, RungNode::Leaf(element, _) if timed(element)))
}

fn pair_bit(input: bool, output: bool) -> u8 {
    match (input, output) {
        (false, false) => FALSE_FALSE,
        (false, true) => FALSE_TRUE,
        (true, false) => TRUE_FALSE,
        (true, true) => TRUE_TRUE,
    }
}

/// The reason why a goal can never be reached, if one is known.
fn why_impossible(goal: &CoverageGoal, item: &CoverageItem, outcomes_by_inputs: &[Vec<u8>]) -> Option<&'static str> {
    let pairs_at = |outcomes: &Vec<u8>, position: &usize| outcomes.get(*position).copied().unwrap_or(0);
    if let OutcomeCondition::Branch(out) = goal.when {
        let set = outcomes_by_inputs.iter().fold(0, |set, outcomes| {
            let outputs: Vec<u8> = item
                .trace_positions
                .iter()
                .map(|p| possible_outcomes::outputs_of_pairs(pairs_at(outcomes, p)))
                .collect();
            set | possible_outcomes::or_of_sets(&outputs)
        });
        return match (out, set) {
            (true, 1) => Some("it is always false"),
            (false, 2) => Some("it is always true"),
            _ => None,
        };
    }
    let pairs = item
        .trace_positions
        .iter()
        .flat_map(|p| outcomes_by_inputs.iter().map(move |outcomes| pairs_at(outcomes, p)))
        .fold(0, |set, one| set | one);
    if pairs & goal.rung_pairs != 0 {
        return None;
    }
    Some(if pairs & (TRUE_FALSE | TRUE_TRUE) == 0 {
        "its rung is never true there"
    } else if pairs & (FALSE_FALSE | FALSE_TRUE) == 0 && goal.rung_pairs & (TRUE_FALSE | TRUE_TRUE) == 0 {
        "its rung is always true there"
    } else if goal.rung_pairs == TRUE_FALSE {
        "it passes whenever its rung is true"
    } else if goal.rung_pairs == TRUE_TRUE {
        "it blocks whenever its rung is true"
    } else {
        "its limit leaves no other case"
    })
}
