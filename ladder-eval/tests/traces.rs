//! The evaluator gives the hand-written traces of `tests/ladder`.

mod common;

#[path = "../../tests/ladder/mod.rs"]
mod table;

#[test]
fn every_line_of_every_trace() {
    let mut faults = Vec::new();
    for case in table::cases() {
        let mut eval = common::evaluator(&common::parse("test.ld", &case.program));
        let index = |names: &[String]| -> Vec<usize> { names.iter().map(|n| common::index(&eval, n)).collect() };
        let (given, wanted) = (index(&case.given), index(&case.wanted));
        for row in &case.rows {
            for _ in 0..row.times {
                for (&symbol, value) in given.iter().zip(&row.given) {
                    value.iter().for_each(|&v| eval.set(symbol, v));
                }
                eval.scan();
            }
            let found: Vec<i32> = wanted.iter().map(|&symbol| eval.get(symbol)).collect();
            if found != row.wanted {
                faults.push(format!("{}: {}: found {found:?}, wanted {:?}", case.name, row.text, row.wanted));
            }
        }
    }
    assert!(faults.is_empty(), "{faults:#?}");
}
