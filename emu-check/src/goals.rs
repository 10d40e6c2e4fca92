//! What a check should bring about, and what of it has happened: seen on the evaluator, element by element.

use std::collections::HashMap;

use ladder::{Element, ElementId, Node, Program};
use ladder_eval::Evaluator;

use crate::coverage::{Class, Coverage, Missing};
use crate::hints::Hints;
use crate::reach::{self, P00, P01, P10, P11};
use crate::stimulus::Step;
use crate::wanted::{Wanted, When, wanted};

/// One scan of the evaluator: values before and after, and the rung bit at every element in order of execution.
#[derive(Debug, Clone, Default)]
pub(crate) struct Seen {
    before: Vec<i32>,
    after: Vec<i32>,
    /// A byte was sent; a write to the EEPROM began.
    sent: bool,
    wrote: bool,
    /// Rung bit before and after each element.
    pub trace: Vec<(bool, bool)>,
}

impl Seen {
    /// Runs one scan and watches it.
    pub(crate) fn scan(eval: &mut Evaluator) -> Seen {
        let symbols = eval.symbols().len();
        let before = (0..symbols).map(|i| eval.get(i)).collect();
        let mut trace = Vec::new();
        let busy = eval.eeprom_busy();
        eval.scan_watched(&mut |_, input, output| trace.push((input, output)));
        let after = (0..symbols).map(|i| eval.get(i)).collect();
        // A count that went up is a write; one scan alone takes one away.
        let wrote = eval.eeprom_busy() > busy.saturating_sub(1);
        Seen { before, after, sent: eval.sent().is_some(), wrote, trace }
    }

    /// How far a symbol moved in the scan.
    pub(crate) fn moved(&self, symbol: usize) -> i32 {
        let of = |values: &[i32]| values.get(symbol).copied().unwrap_or(0);
        of(&self.after).wrapping_sub(of(&self.before))
    }

    /// True when a symbol other than `symbol` ends differently.
    pub(crate) fn differs_beside(&self, other: &Seen, symbol: usize) -> bool {
        self.after.iter().zip(&other.after).enumerate().any(|(n, (a, b))| n != symbol && a != b)
    }
}

#[derive(Debug, Clone)]
struct Goal {
    item: usize,
    /// The (in, out) that count.
    pairs: u8,
    when: When,
    says: &'static str,
    impossible: Option<&'static str>,
    reached: bool,
}

/// An element, or a branch (named by its first element).
#[derive(Debug, Clone)]
struct Item {
    id: ElementId,
    class: Class,
    /// Positions in the trace: the element's own, or those whose outs make the branch's.
    at: Vec<usize>,
}

/// All goals of a program.
#[derive(Debug, Clone)]
pub(crate) struct Goals {
    items: Vec<Item>,
    goals: Vec<Goal>,
    open: usize,
}

impl Goals {
    pub(crate) fn new(program: &Program, eval: &Evaluator) -> Goals {
        let mut goals = Goals { items: Vec::new(), goals: Vec::new(), open: 0 };
        let elements = program.elements().filter(|(_, element, _)| !matches!(element, Element::Comment(_)));
        for (position, (id, element, _)) in elements.enumerate() {
            let symbol = |name: &str| eval.index(name).unwrap_or(usize::MAX);
            if let Some((class, wanted)) = wanted(program, element, eval, &symbol) {
                goals.push(Item { id, class, at: vec![position] }, &wanted);
            }
        }
        let mut next = 0;
        for (number, rung) in (0..).zip(&program.rungs) {
            let mut id = ElementId { rung: number, index: 0 };
            goals.branches(&rung.series, &mut next, &mut id);
        }
        let worlds = reach::possible(program);
        for goal in &mut goals.goals {
            goal.impossible = goals.items.get(goal.item).and_then(|item| impossible(goal, item, &worlds));
        }
        goals.open = goals.goals.iter().filter(|g| g.impossible.is_none()).count();
        goals
    }

    fn push(&mut self, item: Item, wanted: &[Wanted]) {
        let goal = |&(says, pairs, when): &Wanted| Goal {
            item: self.items.len(),
            pairs,
            when,
            says,
            impossible: None,
            reached: false,
        };
        self.goals.extend(wanted.iter().map(goal));
        self.items.push(item);
    }

    /// Adds the branches of all groups in a series. Gives the positions whose outs make the out of the series; nothing
    /// where it holds comments only.
    fn branches(&mut self, series: &[Node], next: &mut usize, id: &mut ElementId) -> Option<Vec<usize>> {
        let mut last = None;
        for node in series {
            match node {
                Node::Leaf(element, _) => {
                    id.index += 1;
                    if !matches!(element, Element::Comment(_)) {
                        last = Some(vec![*next]);
                        *next += 1;
                    }
                }
                Node::Parallel(branches, _) => {
                    let mut outs = Some(Vec::new());
                    for branch in branches {
                        let first = *id;
                        let at = self.branches(branch, next, id);
                        // A branch of one element that only passes on or blocks says nothing that the element does not.
                        let leaves = (id.index - first.index) as usize;
                        if let Some(at) = at.as_ref().filter(|_| leaves > 1 || !is_plain(branch)) {
                            let both = [("is true", 0, When::Branch(true)), ("is false", 0, When::Branch(false))];
                            self.push(Item { id: first, class: Class::Branches, at: at.clone() }, &both);
                        }
                        outs = outs.zip(at).map(|(mut outs, at)| {
                            outs.extend(at);
                            outs
                        });
                    }
                    last = outs;
                }
            }
        }
        last
    }

    /// True while a possible goal has not been reached.
    pub(crate) fn open(&self) -> bool {
        self.open > 0
    }

    /// Possible goals that have not been reached.
    pub(crate) fn remaining(&self) -> usize {
        self.open
    }

    /// How many open goals a scan with this step would reach.
    pub(crate) fn gain(&self, eval: &Evaluator, hints: &Hints, step: &Step) -> usize {
        let mut eval = eval.clone();
        step.apply_at_once(hints, &mut eval);
        let seen = Seen::scan(&mut eval);
        self.goals.iter().filter(|goal| !goal.reached && self.hit(goal, &seen)).count()
    }

    /// Notes what a scan reached.
    pub(crate) fn mark(&mut self, seen: &Seen) {
        if self.goals.iter().all(|goal| goal.reached) {
            return;
        }
        let hits: Vec<bool> = self.goals.iter().map(|goal| !goal.reached && self.hit(goal, seen)).collect();
        for (goal, hit) in self.goals.iter_mut().zip(hits) {
            if hit {
                goal.reached = true;
                self.open -= usize::from(goal.impossible.is_none());
            }
        }
    }

    fn hit(&self, goal: &Goal, seen: &Seen) -> bool {
        let Some(item) = self.items.get(goal.item) else { return false };
        let mut outs = item.at.iter().filter_map(|&at| seen.trace.get(at));
        if let When::Branch(out) = goal.when {
            return outs.any(|pair| pair.1) == out;
        }
        let Some(&(input, output)) = outs.next() else { return false };
        let of = |values: &[i32], symbol: usize| values.get(symbol).copied().unwrap_or(0);
        let (before, after) = (|s| of(&seen.before, s), |s| of(&seen.after, s));
        goal.pairs & pair(input, output) != 0
            && match goal.when {
                When::Always | When::Branch(_) => true,
                When::Ran(symbol) => before(symbol) != 0,
                When::Counted(symbol) => seen.moved(symbol).wrapping_abs() == 1,
                When::Overflowed(symbol, bytes) => {
                    let span = 1i64 << (8 * u32::from(bytes.clamp(1, 4)));
                    (i64::from(after(symbol)) - i64::from(before(symbol))).abs() == span - 1
                }
                When::Within { symbol, least, most, own } => {
                    let within = |value: i32| (least..=most).contains(&value.into());
                    within(before(symbol)) && (own || within(after(symbol)))
                }
                When::Changed(symbol) => seen.moved(symbol) != 0,
                When::Sent => seen.sent,
                When::Wrote => seen.wrote,
                When::Wrapped(symbol, max) => before(symbol) >= max && after(symbol) < before(symbol),
            }
    }

    /// The report.
    pub(crate) fn coverage(&self, program: &Program) -> Coverage {
        let elements: HashMap<ElementId, &Element> = program.elements().map(|(id, element, _)| (id, element)).collect();
        let text = |id| elements.get(&id).map_or_else(String::new, |element| ladder::element_text(element));
        // Per item: whether all of its goals have been reached; nothing where one of them is impossible.
        let mut states = vec![Some(true); self.items.len()];
        for goal in &self.goals {
            if let Some(state) = states.get_mut(goal.item) {
                *state = state.filter(|_| goal.impossible.is_none()).map(|all| all && goal.reached);
            }
        }
        let items = self.items.iter().map(|item| item.class).zip(states);
        let missing = self.goals.iter().filter(|goal| !goal.reached).filter_map(|goal| {
            let item = self.items.get(goal.item)?;
            Some(Missing {
                rung: item.id.rung + 1,
                element: item.id.index + 1,
                element_text: text(item.id),
                class: item.class,
                what: goal.says.to_owned(),
                impossible: goal.impossible.map(str::to_owned),
            })
        });
        Coverage::new(items, missing.collect())
    }

    /// Goals that were called impossible and reached all the same: a fault of the reasoning, for tests.
    #[cfg(test)]
    pub fn contradictions(&self) -> usize {
        self.goals.iter().filter(|goal| goal.reached && goal.impossible.is_some()).count()
    }
}

fn is_plain(branch: &[Node]) -> bool {
    let timed = |element: &Element| {
        matches!(
            element,
            Element::Timer { .. }
                | Element::Counter { .. }
                | Element::Osr
                | Element::Osf
                | Element::FormattedString { .. }
                | Element::UartSend { .. }
        )
    };
    !branch.iter().any(|node| matches!(node, Node::Leaf(element, _) if timed(element)))
}

fn pair(input: bool, output: bool) -> u8 {
    match (input, output) {
        (false, false) => P00,
        (false, true) => P01,
        (true, false) => P10,
        (true, true) => P11,
    }
}

/// Why a goal can never be reached, if that is known.
fn impossible(goal: &Goal, item: &Item, worlds: &[Vec<u8>]) -> Option<&'static str> {
    let at = |world: &Vec<u8>, at: &usize| world.get(*at).copied().unwrap_or(0);
    if let When::Branch(out) = goal.when {
        let set = worlds.iter().fold(0, |set, world| {
            let outs: Vec<u8> = item.at.iter().map(|p| reach::outs(at(world, p))).collect();
            set | reach::either(&outs)
        });
        return match (out, set) {
            (true, 1) => Some("it is always false"),
            (false, 2) => Some("it is always true"),
            _ => None,
        };
    }
    let pairs = item.at.iter().flat_map(|p| worlds.iter().map(move |w| at(w, p))).fold(0, |set, one| set | one);
    if pairs & goal.pairs != 0 {
        return None;
    }
    Some(if pairs & (P10 | P11) == 0 {
        "its rung is never true there"
    } else if pairs & (P00 | P01) == 0 && goal.pairs & (P10 | P11) == 0 {
        "its rung is always true there"
    } else if goal.pairs == P10 {
        "it passes whenever its rung is true"
    } else if goal.pairs == P11 {
        "it blocks whenever its rung is true"
    } else {
        "its limit leaves no other case"
    })
}
