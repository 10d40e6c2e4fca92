//! Tests every nesting of up to four elements over two inputs, for all four input combinations.
//!
//! The expected column is computed on truth tables (bit `i` is the value for inputs `i`): series is AND,
//! parallel is OR.

use crate::common::model::{coil, contacts, leaf, parallel, program};
use ladder::{Element, RungNode};
use ladder_eval::Evaluator;

/// A series and its truth table.
type SeriesTruthTable = (Vec<RungNode>, u8);

/// Truth tables of the inputs: Xa is bit 0 of the combination, Xb bit 1.
const A: u8 = 0b1010;
const B: u8 = 0b1100;
const ALL: u8 = 0b1111;

#[test]
fn every_nesting_of_up_to_four_elements() {
    let leaves: Vec<(Element, u8)> = vec![
        (contacts("Xa", false), A),
        (contacts("Xa", true), !A & ALL),
        (contacts("Xb", false), B),
        (contacts("Xb", true), !B & ALL),
        (Element::Short, ALL),
        (Element::Open, 0),
    ];
    let leaves: Vec<SeriesTruthTable> = leaves.into_iter().map(|(e, t)| (vec![leaf(e)], t)).collect();
    // bodies[n]: all series of n leaves; groups[n]: all parallel groups of n leaves, each as a series of one
    // node.
    let mut bodies: Vec<Vec<SeriesTruthTable>> = vec![Vec::new(), leaves.clone()];
    let mut groups: Vec<Vec<SeriesTruthTable>> = vec![Vec::new(), Vec::new()];
    for n in 2..=4 {
        let mut group = Vec::new();
        branches(&bodies, n, &mut Vec::new(), 0, &mut group);
        groups.push(group);
        let mut body = groups[n].clone();
        for first in 1..n {
            let heads = if first == 1 { &leaves } else { &groups[first] };
            for (head, t) in heads {
                for (rest, u) in &bodies[n - first] {
                    body.push(([head.clone(), rest.clone()].concat(), t & u));
                }
            }
        }
        bodies.push(body);
    }
    // Number of shapes with 1, 2, 3 and 4 leaves, including groups that are the only node of a branch: 0, 1,
    // 5, 27 groups and 1, 2, 8, 42 series (a series is a group, or a leaf or a group before a shorter
    // series), with six kinds of leaf.
    let counts: Vec<usize> = bodies.iter().map(Vec::len).collect();
    assert_eq!(counts, [0, 6, 2 * 36, 8 * 216, 42 * 1296]);
    for (series, table) in bodies.iter().flatten() {
        check(series, *table);
    }
}

/// Generates all groups of `left` leaves: at least two branches, each of any series.
fn branches(
    bodies: &[Vec<SeriesTruthTable>],
    left: usize,
    so_far: &mut Vec<Vec<RungNode>>,
    table: u8,
    out: &mut Vec<SeriesTruthTable>,
) {
    if left == 0 {
        out.push((vec![parallel(so_far.clone())], table));
        return;
    }
    let most = if so_far.is_empty() { left - 1 } else { left };
    for n in 1..=most {
        for (series, t) in &bodies[n] {
            so_far.push(series.clone());
            branches(bodies, left - n, so_far, table | t, out);
            so_far.pop();
        }
    }
}

fn check(series: &[RungNode], table: u8) {
    // A separate rung uses the input names, so that all programs have all symbols.
    let known = vec![leaf(contacts("Xa", false)), leaf(contacts("Xb", false))];
    let rung = [series, &[leaf(coil("Yq"))]].concat();
    let mut eval = Evaluator::new(&program(vec![known, rung])).expect("simple elements");
    let [a, b, q] = ["Xa", "Xb", "Yq"].map(|n| eval.index(n).expect("a symbol"));
    for inputs in 0..4 {
        eval.set(a, inputs & 1);
        eval.set(b, inputs >> 1);
        eval.scan();
        assert_eq!(eval.get(q), i32::from(table >> inputs & 1), "Xb Xa = {inputs:02b}: {series:?}");
    }
}
