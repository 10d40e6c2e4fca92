//! Limits that should be seen to matter: for each comparison, timer and counter, the values around its limit, in states in
//! which one more or less shows somewhere else.
//!
//! Random values rarely bring an integer to its limit while all contacts beside the comparison pass, so a limit that
//! is off by one would hide. Each wish is tried with several states; one that cannot be granted is dropped.

use ladder::{CompareOp, Element, MathOp, Operand, Program, SymbolKind};
use ladder_eval::Evaluator;

use crate::goals::Seen;
use crate::hints::{Hints, constants, fit};
use crate::reach::holds;
use crate::stimulus::Step;

/// A wish that failed so often is dropped.
const PATIENCE: u32 = 1_000;

/// Most values of a table that are wished for.
const VALUES: usize = 32;

/// An integer at one value.
#[derive(Debug, Clone)]
struct Wish {
    /// Position of the element in order of execution.
    at: usize,
    symbol: usize,
    target: Target,
    failed: u32,
    granted: bool,
}

#[derive(Debug, Clone, Copy)]
enum Target {
    Value(i32),
    /// This far from what another integer holds when the scan starts.
    Near(usize, i32),
    /// A value when the element acts, and with it one of another integer.
    Acting(i32, Option<(usize, i32)>),
}

/// Quotients at which division turns over or has a rule of its own: each of these by each of those. The ends of four bytes stand
/// for those of the integer's own width.
const DIVIDENDS: [i32; 3] = [i32::MIN, -1, i32::MAX];
const DIVISORS: [i32; 3] = [0, -1, i32::MIN];

/// All wishes of a program.
#[derive(Debug, Clone)]
pub(crate) struct Wishes {
    wishes: Vec<Wish>,
    /// Elements that store something, by position: the others only pass the rung bit on.
    stores: Vec<bool>,
    next: usize,
}

impl Wishes {
    pub(crate) fn new(program: &Program, eval: &Evaluator) -> Wishes {
        let integer = |name: &str| {
            let index = eval.index(name)?;
            eval.symbols().get(index).filter(|s| !s.kind.is_bit() && s.kind != SymbolKind::Adc).map(|_| index)
        };
        let mut wishes = Vec::new();
        let mut stores = Vec::new();
        let elements = program.elements().filter(|(_, element, _)| !matches!(element, Element::Comment(_)));
        for (at, (_, element, _)) in elements.enumerate() {
            let plain = matches!(element, Element::Contacts { .. } | Element::Compare { .. } | Element::Short);
            stores.push(!plain);
            let mut wish = |symbol: Option<usize>, targets: Vec<Target>| {
                let wish = |symbol| move |target| Wish { at, symbol, target, failed: 0, granted: false };
                wishes.extend(symbol.into_iter().flat_map(|symbol| targets.iter().copied().map(wish(symbol))));
            };
            match element {
                Element::Timer { name, .. } | Element::Counter { name, .. } => {
                    let around = |limit: i32| [limit.wrapping_sub(1), limit].map(Target::Value);
                    wish(integer(name), constants(program, element).into_iter().flat_map(around).collect());
                }
                Element::Compare { op, op1, op2 } => match (op1, op2) {
                    (Operand::Var(name), Operand::Const { value, .. }) => {
                        let values = turns(*op).map(|d| Target::Value((*value as i32).wrapping_add(d)));
                        wish(integer(name), values.collect());
                    }
                    (Operand::Const { value, .. }, Operand::Var(name)) => {
                        let values = turns(*op).map(|d| Target::Value((*value as i32).wrapping_sub(d)));
                        wish(integer(name), values.collect());
                    }
                    (Operand::Var(a), Operand::Var(b)) if a != b => {
                        if let Some(other) = integer(b) {
                            wish(integer(a), turns(*op).map(|d| Target::Near(other, d)).collect());
                        }
                    }
                    _ => {}
                },
                Element::LookUpTable { index: Operand::Var(name), values, .. } => {
                    // Each of the values; the ends of a long table are goals.
                    let each = (0..).take(values.len().min(VALUES)).map(|n| Target::Acting(n, None));
                    wish(integer(name), each.collect());
                }
                Element::Math { op: MathOp::Div, op1: Operand::Var(a), op2: Operand::Var(b), .. } if a != b => {
                    if let (Some(a), Some(b)) = (integer(a), integer(b)) {
                        let width = |symbol: usize| eval.symbols().get(symbol).map_or(2, |s| s.bytes);
                        let end = |value: i32, symbol| match value {
                            i32::MIN | i32::MAX => value >> (32 - 8 * u32::from(width(symbol).clamp(1, 4))),
                            _ => value,
                        };
                        let by = |n| DIVISORS.map(|d| Target::Acting(end(n, a), Some((b, end(d, b)))));
                        wish(Some(a), DIVIDENDS.into_iter().flat_map(by).collect());
                    }
                }
                _ => {}
            }
        }
        Wishes { wishes, stores, next: 0 }
    }

    /// The next wish that is still open; when all are done, all are open again.
    pub(crate) fn choose(&mut self) -> Option<usize> {
        let open = |wish: &Wish| !wish.granted && wish.failed < PATIENCE;
        if !self.wishes.iter().any(open) {
            self.wishes.iter_mut().for_each(|wish| wish.granted = false);
        }
        let count = self.wishes.len();
        let found = (0..count).map(|n| (self.next + n) % count).find(|&n| self.wishes.get(n).is_some_and(open))?;
        self.next = found + 1;
        Some(found)
    }

    /// Tries to grant a wish with `step`, changed to write the wanted value: true when it does.
    pub(crate) fn grant(&mut self, wish: usize, eval: &Evaluator, hints: &Hints, step: &mut Step) -> bool {
        let Some(wish) = self.wishes.get_mut(wish) else { return false };
        if hints.writable.get(wish.symbol) != Some(&true) {
            wish.failed = PATIENCE;
            return false;
        }
        step.writes.retain(|(symbol, _)| *symbol != wish.symbol);
        let value = match wish.target {
            Target::Value(value) => value,
            Target::Acting(value, beside) => {
                if let Some((other, beside)) = beside.filter(|(other, _)| hints.writable.get(*other) == Some(&true)) {
                    step.writes.retain(|(symbol, _)| *symbol != other);
                    step.writes.push((other, beside));
                }
                value
            }
            Target::Near(other, distance) => {
                let written = step.writes.iter().find(|(symbol, _)| *symbol == other);
                written.map_or_else(|| eval.get(other), |&(_, value)| value).wrapping_add(distance)
            }
        };
        let fit = |value: i32| fit(value.into(), hints.bytes.get(wish.symbol).copied().unwrap_or(2));
        let value = fit(value);
        step.writes.push((wish.symbol, value));
        let scan = |value: i32| {
            let mut eval = eval.clone();
            step.apply_at_once(hints, &mut eval);
            eval.set(wish.symbol, value);
            Seen::scan(&mut eval)
        };
        let with = scan(value);
        wish.granted = if let Target::Acting(..) = wish.target {
            // What becomes of it shows.
            with.trace.get(wish.at).is_some_and(|pair| pair.0)
        } else {
            [value.wrapping_sub(1), value.wrapping_add(1)]
                .into_iter()
                .any(|other| matters(wish, &self.stores, &with, &scan(other)))
        };
        wish.failed += u32::from(!wish.granted);
        wish.granted
    }
}

/// The distances of the left operand from the right one at which one more or less changes the outcome.
fn turns(op: CompareOp) -> impl Iterator<Item = i32> {
    let turns = move |d: i32| holds(op, d, 0) != holds(op, d - 1, 0) || holds(op, d, 0) != holds(op, d + 1, 0);
    (-1..=1).filter(move |d| turns(*d))
}

/// True when the two scans, which differ by one in the wished integer, differ in what the element does and in what is
/// stored because of it.
fn matters(wish: &Wish, stores: &[bool], one: &Seen, other: &Seen) -> bool {
    let out = |seen: &Seen| seen.trace.get(wish.at).map(|pair| pair.1);
    // The integer itself shows it when it does not simply stay one apart.
    let itself = one.moved(wish.symbol) != other.moved(wish.symbol);
    let stored = || {
        let later = one.trace.iter().zip(&other.trace).zip(stores).skip(wish.at);
        later.filter(|(_, stores)| **stores).any(|((a, b), _)| a.0 != b.0)
    };
    let keeps = stores.get(wish.at).copied().unwrap_or(false);
    if keeps && itself {
        return true;
    }
    out(one) != out(other) && stored() && (itself || one.differs_beside(other, wish.symbol))
}
