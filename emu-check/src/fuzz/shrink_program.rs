//! Shrinks a program that shows a fault: removes or simplifies rungs, branches, elements and operands one by
//! one, as long as a fault of the same kind remains. The check itself shrinks the stimulus.

use diag::Pos;
use ladder::{Element, LadderOperand, LadderProgram, Rung, RungNode};

/// Maximum number of checks for shrinking one program.
const MAX_TRIES: u32 = 2_000;

/// The smallest program found, and the number of scans after which it shows the fault. `shows_fault` returns
/// the scan in which a program shows the fault, if it does; `program` shows it after `scans` scans.
pub(super) fn smallest_program(
    program: &LadderProgram,
    scans: u64,
    shows_fault: &mut dyn FnMut(&LadderProgram) -> Option<u64>,
) -> (LadderProgram, u64) {
    // The comments are added before shrinking, so that adding them later cannot change the result.
    let mut best = with_notes(program, &["", ""]);
    let mut scans = shows_fault(&best).unwrap_or(scans);
    let (mut n, mut tries, mut better) = (0, 0, false);
    while tries < MAX_TRIES {
        let Some(candidate) = nth_candidate(&best, n) else {
            // One change can make another one possible, so repeat from the first candidate until no change
            // helps.
            if !std::mem::take(&mut better) {
                break;
            }
            n = 0;
            continue;
        };
        tries += 1;
        match candidate.and_then(|candidate| shows_fault(&candidate).map(|at| (candidate, at))) {
            // Candidate n of the new program is a different change.
            Some((candidate, at)) => (best, scans, better) = (candidate, at, true),
            None => n += 1,
        }
    }
    (best, scans)
}

/// The program with two rungs of comments at its start, which are added or replaced.
pub(super) fn with_notes(program: &LadderProgram, lines: &[&str; 2]) -> LadderProgram {
    let mut program = program.clone();
    let noted = program.rungs.iter().take_while(|rung| is_note(rung)).count().min(lines.len());
    let notes = lines.iter().map(|line| Rung {
        series: vec![RungNode::Leaf(Element::Comment(format!("{NOTE_PREFIX}{line}")), Pos::default())],
        pos: Pos::default(),
    });
    program.rungs.splice(..noted, notes);
    program
}

/// The prefix of such a comment.
const NOTE_PREFIX: &str = "fuzz: ";

fn is_note(rung: &Rung) -> bool {
    matches!(rung.series.as_slice(), [RungNode::Leaf(Element::Comment(text), _)] if text.starts_with(NOTE_PREFIX))
}

/// The `n`-th way to make `program` smaller: `None` after the last; `Some(None)` if the result is not a valid
/// program.
fn nth_candidate(program: &LadderProgram, n: usize) -> Option<Option<LadderProgram>> {
    let mut left = n;
    let mut smaller = program.clone();
    // Rungs first, starting with the last one, because rungs after the fault are not needed.
    let rungs = program.rungs.iter().filter(|rung| !is_note(rung)).count();
    if left < rungs {
        let at = program.rungs.len() - 1 - left;
        smaller.rungs.remove(at);
        return Some((rungs > 1).then_some(smaller));
    }
    left -= rungs;
    for rung in smaller.rungs.iter_mut().filter(|rung| !is_note(rung)) {
        match change_series(&mut rung.series, left) {
            Ok(()) => return Some((!rung.series.is_empty()).then_some(smaller)),
            Err(count) => left -= count,
        }
    }
    match (&mut smaller.vars, left) {
        (Some(vars), left) if left < vars.len() => {
            vars.remove(left);
            Some(Some(smaller))
        }
        _ => None,
    }
}

/// Makes the `n`-th change of a series, or returns the number of possible changes as an error.
fn change_series(series: &mut Vec<RungNode>, n: usize) -> Result<(), usize> {
    let mut left = n;
    for at in 0..series.len() {
        if left == 0 {
            series.remove(at);
            return Ok(());
        }
        left -= 1;
        let Some(node) = series.get_mut(at) else { break };
        match node {
            RungNode::Leaf(element, _) => {
                let simpler = simpler_elements(element);
                match simpler.into_iter().nth(left) {
                    Some(new) => {
                        *element = new;
                        return Ok(());
                    }
                    None => left -= count_changes(element),
                }
            }
            RungNode::Parallel(branches, _) => {
                // Replaces the group by one of its branches.
                if left < branches.len() {
                    let branch = branches.swap_remove(left);
                    series.splice(at..=at, branch);
                    return Ok(());
                }
                left -= branches.len();
                // Removes one branch.
                if branches.len() > 1 && left < branches.len() {
                    branches.remove(left);
                    return Ok(());
                }
                left -= if branches.len() > 1 { branches.len() } else { 0 };
                for branch in branches {
                    match change_series(branch, left) {
                        Ok(()) => return Ok(()),
                        Err(count) => left -= count,
                    }
                }
            }
        }
    }
    Err(n - left)
}

fn count_changes(element: &Element) -> usize {
    simpler_elements(element).len()
}

/// Simpler elements of the same sort, with simpler operands or fewer values.
fn simpler_elements(element: &Element) -> Vec<Element> {
    let mut out = Vec::new();
    match element {
        Element::Contacts { name, negated: true, set1 } => {
            out.push(Element::Contacts { name: name.clone(), negated: false, set1: *set1 });
        }
        Element::LookUpTable { dest, index, as_string, values, name } if values.len() > 1 => {
            let values = values[..values.len() / 2].to_vec();
            let (dest, index, name) = (dest.clone(), index.clone(), name.clone());
            out.push(Element::LookUpTable { dest, index, as_string: *as_string, values, name });
        }
        Element::PiecewiseLinear { dest, index, points, name } if points.len() > 2 => {
            for points in [&points[1..], &points[..points.len() - 1]] {
                let (dest, index, points) = (dest.clone(), index.clone(), points.to_vec());
                out.push(Element::PiecewiseLinear { dest, index, points, name: name.clone() });
            }
        }
        Element::ShiftRegister { name, stages: 2.. } => {
            out.push(Element::ShiftRegister { name: name.clone(), stages: 1 });
        }
        // Of the other elements only the operands can be simpler.
        _ => {}
    }
    for at in 0..element.clone().operands_mut().len() {
        let simpler = |operand: LadderOperand| {
            let mut new = element.clone();
            new.operands_mut().into_iter().nth(at).into_iter().for_each(|old| *old = operand.clone());
            new
        };
        let operand = element.clone().operands_mut().into_iter().nth(at).map(|operand| simpler_operands(operand));
        out.extend(operand.into_iter().flatten().map(simpler));
    }
    out
}

fn simpler_operands(operand: &LadderOperand) -> Vec<LadderOperand> {
    let known = |value: i64| LadderOperand::Const { value, text: value.to_string() };
    match operand {
        LadderOperand::Var(_) => vec![known(0), known(1), known(-1)],
        LadderOperand::Const { value: 0, .. } => Vec::new(),
        LadderOperand::Const { value: 1, .. } => vec![known(0)],
        LadderOperand::Const { value, .. } => vec![known(0), known(value / 2)],
    }
}

#[cfg(test)]
mod tests {
    use super::super::generator::generate_program;
    use super::*;

    /// Shrinking leaves only the element that the fault needs, with operands 0.
    #[test]
    fn only_what_shows_the_fault_is_left() {
        let subtracts = |program: &LadderProgram| {
            program.elements().any(|at| matches!(at.element, Element::Math { op: ladder::MathOp::Sub, .. }))
        };
        let mut tried = 0;
        for number in 0..400 {
            let (drawn, _) = generate_program(3, number);
            if !subtracts(&drawn) {
                continue;
            }
            tried += 1;
            // A program that cannot be parsed again does not show the fault.
            let mut shows =
                |p: &LadderProgram| (ladder::parse("x.ld", &ladder::write(p)).is_ok() && subtracts(p)).then_some(7);
            let (small, scans) = smallest_program(&drawn, 250, &mut shows);
            let text = ladder::write(&with_notes(&small, &["one", "two"]));
            let rungs =
                text.split("PROGRAM\n").nth(1).unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ");
            let left = rungs.strip_prefix("RUNG COMMENT fuzz: one END RUNG COMMENT fuzz: two END RUNG SUB ");
            let operands = left.map(|left| left.split(' ').skip(1).collect::<Vec<_>>());
            assert_eq!(operands.as_deref(), Some(&["0", "0", "END"][..]), "program {number}: {text}");
            assert_eq!(scans, 7);
        }
        assert!(tried >= 20, "only {tried} programs");
    }
}
