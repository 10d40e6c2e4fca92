//! Goals at the limits of comparisons, timers, counters, tables and divisions: an integer must take the
//! values around the limit, in a scan in which a value that is one higher or lower has a visible effect.
//!
//! Random values rarely bring an integer to its limit while all contacts next to the comparison pass, so an
//! off-by-one error in a limit would stay hidden. Each goal is tried with several states of the program;
//! after [`MAX_FAILED_TRIES`] failures it is dropped.

use ladder::{CompareOp, Element, LadderOperand, LadderProgram, MathOp, PowerEffect, ProgramElement, SymbolKind};
use ladder_eval::Evaluator;

use crate::coverage::goals::EvaluatedScan;
use crate::coverage::possible_outcomes::comparison_holds;
use crate::stimulus::generator::ScanStimulus;
use crate::stimulus::stimulus_symbols::{StimulusSymbols, element_constants, truncate_to_bytes};

/// Failed tries after which a goal is dropped.
const MAX_FAILED_TRIES: u32 = 1_000;

/// Maximum number of goals for the values of one look-up table.
const MAX_TABLE_GOALS: usize = 32;

/// The goal that one integer has one value while one element is executed.
#[derive(Debug, Clone)]
struct BoundaryGoal {
    /// Position of the element in execution order.
    position: usize,
    /// Index of the integer in the evaluator.
    symbol: usize,
    /// The value that it must have.
    target: GoalTarget,
    failed_tries: u32,
    is_reached: bool,
}

/// The value that a goal gives to its integer.
#[derive(Debug, Clone, Copy)]
enum GoalTarget {
    /// This value.
    Value(i32),
    /// The value of another integer at the start of the scan, plus this distance.
    NearSymbol(usize, i32),
    /// A value while the rung of the element is true, with an optional value of a second integer (symbol,
    /// value).
    WhenActing(i32, Option<(usize, i32)>),
}

/// Dividends at which a division overflows or has a special case. Each is combined with each of [`DIVISORS`];
/// `i32::MIN` and `i32::MAX` are replaced by the limits of the integer's own width.
const DIVIDENDS: [i32; 3] = [i32::MIN, -1, i32::MAX];
/// Divisors with a special case; see [`DIVIDENDS`].
const DIVISORS: [i32; 3] = [0, -1, i32::MIN];

/// All boundary goals of a program.
#[derive(Debug, Clone)]
pub(crate) struct BoundaryGoals {
    goals: Vec<BoundaryGoal>,
    /// Per element in execution order: true if the element stores something, false if it only passes the rung
    /// bit on.
    stores: Vec<bool>,
    /// Index of the goal that is looked at next.
    next: usize,
}

impl BoundaryGoals {
    /// Collects the boundary goals of a program.
    pub(crate) fn new(program: &LadderProgram, eval: &Evaluator) -> BoundaryGoals {
        let integer = |name: &str| {
            let index = eval.index(name)?;
            eval.symbols().get(index).filter(|s| !s.kind.is_bit() && s.kind != SymbolKind::Adc).map(|_| index)
        };
        let mut goals = Vec::new();
        let mut stores = Vec::new();
        let elements = program.elements().filter(|at| !matches!(at.element, Element::Comment(_)));
        for (at, ProgramElement { element, .. }) in elements.enumerate() {
            let facts = element.facts();
            stores.push(!matches!(facts.power, PowerEffect::Narrows | PowerEffect::Wire));
            let mut add_goals = |symbol: Option<usize>, targets: Vec<GoalTarget>| {
                let goal = |symbol| {
                    move |target| BoundaryGoal { position: at, symbol, target, failed_tries: 0, is_reached: false }
                };
                goals.extend(symbol.into_iter().flat_map(|symbol| targets.iter().copied().map(goal(symbol))));
            };
            match element {
                Element::Timer { name, .. } | Element::Counter { name, .. } => {
                    let around = |limit: i32| [limit.wrapping_sub(1), limit].map(GoalTarget::Value);
                    add_goals(
                        integer(name),
                        element_constants(program, element).into_iter().flat_map(around).collect(),
                    );
                }
                Element::Compare { op, op1, op2 } => match (op1, op2) {
                    (LadderOperand::Var(name), LadderOperand::Const { value, .. }) => {
                        let values =
                            deciding_distances(*op).map(|d| GoalTarget::Value((*value as i32).wrapping_add(d)));
                        add_goals(integer(name), values.collect());
                    }
                    (LadderOperand::Const { value, .. }, LadderOperand::Var(name)) => {
                        let values =
                            deciding_distances(*op).map(|d| GoalTarget::Value((*value as i32).wrapping_sub(d)));
                        add_goals(integer(name), values.collect());
                    }
                    (LadderOperand::Var(a), LadderOperand::Var(b)) if a != b => {
                        if let Some(other) = integer(b) {
                            add_goals(
                                integer(a),
                                deciding_distances(*op).map(|d| GoalTarget::NearSymbol(other, d)).collect(),
                            );
                        }
                    }
                    _ => {}
                },
                Element::LookUpTable { index: LadderOperand::Var(name), values, .. } => {
                    // One goal per value. `coverage/rules.rs` has goals for the first and last value of a
                    // long table.
                    let each = (0..).take(values.len().min(MAX_TABLE_GOALS)).map(|n| GoalTarget::WhenActing(n, None));
                    add_goals(integer(name), each.collect());
                }
                Element::Math {
                    op: MathOp::Div | MathOp::Mod,
                    op1: LadderOperand::Var(a),
                    op2: LadderOperand::Var(b),
                    ..
                } if a != b => {
                    if let (Some(a), Some(b)) = (integer(a), integer(b)) {
                        let width = |symbol: usize| eval.symbols().get(symbol).map_or(2, |s| s.bytes);
                        let end = |value: i32, symbol| match value {
                            i32::MIN | i32::MAX => value >> (32 - 8 * u32::from(width(symbol).clamp(1, 4))),
                            _ => value,
                        };
                        let goals_of = |n| DIVISORS.map(|d| GoalTarget::WhenActing(end(n, a), Some((b, end(d, b)))));
                        add_goals(Some(a), DIVIDENDS.into_iter().flat_map(goals_of).collect());
                    }
                }
                // Elements that do not compare, count or look up anything have no boundary.
                _ => {}
            }
        }
        BoundaryGoals { goals, stores, next: 0 }
    }

    /// Returns the index of the next open goal. When no goal is open, all goals that were reached are open
    /// again.
    pub(crate) fn next_open(&mut self) -> Option<usize> {
        let open = |goal: &BoundaryGoal| !goal.is_reached && goal.failed_tries < MAX_FAILED_TRIES;
        if !self.goals.iter().any(open) {
            self.goals.iter_mut().for_each(|goal| goal.is_reached = false);
        }
        let count = self.goals.len();
        let found = (0..count).map(|n| (self.next + n) % count).find(|&n| self.goals.get(n).is_some_and(open))?;
        self.next = found + 1;
        Some(found)
    }

    /// Changes `stimulus` so that it writes the wanted value of the goal at index `goal`, and returns true if
    /// a scan with `stimulus` reaches the goal.
    ///
    /// A failed try is counted. A goal for a symbol that cannot be written is dropped.
    pub(crate) fn try_reach(
        &mut self,
        goal: usize,
        eval: &Evaluator,
        stimulus_symbols: &StimulusSymbols,
        stimulus: &mut ScanStimulus,
    ) -> bool {
        let Some(goal) = self.goals.get_mut(goal) else { return false };
        if stimulus_symbols.writable.get(goal.symbol) != Some(&true) {
            goal.failed_tries = MAX_FAILED_TRIES;
            return false;
        }
        stimulus.writes.retain(|(symbol, _)| *symbol != goal.symbol);
        let value = match goal.target {
            GoalTarget::Value(value) => value,
            GoalTarget::WhenActing(value, second) => {
                if let Some((other, second)) =
                    second.filter(|(other, _)| stimulus_symbols.writable.get(*other) == Some(&true))
                {
                    stimulus.writes.retain(|(symbol, _)| *symbol != other);
                    stimulus.writes.push((other, second));
                }
                value
            }
            GoalTarget::NearSymbol(other, distance) => {
                let written = stimulus.writes.iter().find(|(symbol, _)| *symbol == other);
                written.map_or_else(|| eval.get(other), |&(_, value)| value).wrapping_add(distance)
            }
        };
        let fit =
            |value: i32| truncate_to_bytes(value.into(), stimulus_symbols.bytes.get(goal.symbol).copied().unwrap_or(2));
        let value = fit(value);
        stimulus.writes.push((goal.symbol, value));
        let scan = |value: i32| {
            let mut eval = eval.clone();
            stimulus.apply_immediately(stimulus_symbols, &mut eval);
            eval.set(goal.symbol, value);
            EvaluatedScan::run(&mut eval)
        };
        let with = scan(value);
        goal.is_reached = if let GoalTarget::WhenActing(..) = goal.target {
            // The result of the element is visible, so a true rung is enough.
            with.trace.get(goal.position).copied().flatten().is_some_and(|pair| pair.0)
        } else {
            [value.wrapping_sub(1), value.wrapping_add(1)]
                .into_iter()
                .any(|other| is_visible(goal, &self.stores, &with, &scan(other)))
        };
        goal.failed_tries += u32::from(!goal.is_reached);
        goal.is_reached
    }
}

/// The distances from the right operand to the left one at which a change by one changes the outcome.
fn deciding_distances(op: CompareOp) -> impl Iterator<Item = i32> {
    let changes_outcome = move |d: i32| {
        comparison_holds(op, d, 0) != comparison_holds(op, d - 1, 0)
            || comparison_holds(op, d, 0) != comparison_holds(op, d + 1, 0)
    };
    (-1..=1).filter(move |d| changes_outcome(*d))
}

/// Returns true if two scans, whose starts differ by one in the integer of the goal, differ both in what the
/// element does and in what is stored because of it.
fn is_visible(goal: &BoundaryGoal, stores: &[bool], one: &EvaluatedScan, other: &EvaluatedScan) -> bool {
    let out = |seen: &EvaluatedScan| seen.trace.get(goal.position).copied().flatten().map(|pair| pair.1);
    // The change of the integer itself shows the difference, unless both scans change it by the same amount.
    let symbol_differs = one.change_of(goal.symbol) != other.change_of(goal.symbol);
    let stored = || {
        let later = one.trace.iter().zip(&other.trace).zip(stores).skip(goal.position);
        later.filter(|(_, stores)| **stores).any(|((a, b), _)| a.map(|pair| pair.0) != b.map(|pair| pair.0))
    };
    let element_stores = stores.get(goal.position).copied().unwrap_or(false);
    if element_stores && symbol_differs {
        return true;
    }
    out(one) != out(other) && stored() && (symbol_differs || one.differs_elsewhere(other, goal.symbol))
}
