//! Random programs under random stimulus: the evaluator and the naive interpreter agree on every value after every scan
//! and on the rung bit at every element. proptest prints the smallest failing program and its seed.

#[path = "common/model.rs"]
mod model;
mod naive;

use ladder::{CompareOp, CounterKind, Element, MathOp, Node, Operand, TimerKind};
use ladder_eval::Evaluator;
use model::{constant, leaf, parallel, program, var};
use proptest::prelude::*;
use proptest::sample::select;

const BITS: &[&str] = &["Xa", "Xb", "Ya", "Ra", "Rb"];
const COILS: &[&str] = &["Ya", "Ra", "Rb"];
const INTEGERS: &[&str] = &["Ta", "Tb", "Ca", "n", "m"];
/// The limits of 16 bits, zero, small presets and their neighbours, byte boundaries.
const VALUES: &[i64] = &[
    -32768, -32767, -257, -256, -255, -129, -128, -3, -2, -1, 0, 1, 2, 3, 4, 5, 127, 128, 181, 182, 255, 256, 257, 300,
    32766, 32767,
];

fn integer() -> impl Strategy<Value = String> {
    select(INTEGERS).prop_map(str::to_owned)
}

fn operand() -> impl Strategy<Value = Operand> {
    prop_oneof![
        select(INTEGERS).prop_map(var),
        select(VALUES).prop_map(constant),
        any::<i16>().prop_map(|v| constant(v.into()))
    ]
}

fn element() -> impl Strategy<Value = Element> {
    let contact = (select(BITS), any::<bool>()).prop_map(|(name, negated)| model::contacts(name, negated));
    let coil = (select(COILS), 0..4u8).prop_map(|(name, kind)| Element::Coil {
        name: name.to_owned(),
        negated: kind == 1,
        set: kind == 2,
        reset: kind == 3,
        ttrigger: None,
    });
    let plain = select(vec![
        Element::Short,
        Element::Open,
        Element::MasterRelay,
        Element::Osr,
        Element::Osf,
        Element::Comment("remark".to_owned()),
    ]);
    // Delays of 2 to 6 cycles, some not whole, and the two longest.
    let delay = prop_oneof![4 => 20_000..69_999i64, 1 => select(vec![327_670_000i64, 327_689_999])];
    let timer = (select(vec![TimerKind::Ton, TimerKind::Tof, TimerKind::Rto]), integer(), delay)
        .prop_map(|(kind, name, delay)| Element::Timer { kind, name, delay: constant(delay), adjust: None });
    let limit = prop_oneof![0..4i64, select(VALUES)];
    let counter = (select(vec![CounterKind::Ctu, CounterKind::Ctd, CounterKind::Ctc]), integer(), limit)
        .prop_map(|(kind, name, max)| Element::Counter { kind, name, max: constant(max), init: None, input: None });
    let res = integer().prop_map(|name| Element::Res { name });
    let mv = (integer(), operand()).prop_map(|(dest, src)| Element::Move { dest, src });
    let math = (select(vec![MathOp::Add, MathOp::Sub, MathOp::Mul, MathOp::Div]), integer(), operand(), operand())
        .prop_map(|(op, dest, op1, op2)| Element::Math { op, dest, op1, op2 });
    use CompareOp::{Equ, Geq, Grt, Leq, Les, Neq};
    let compare = (select(vec![Equ, Neq, Grt, Geq, Les, Leq]), operand(), operand())
        .prop_map(|(op, op1, op2)| Element::Compare { op, op1, op2 });
    prop_oneof![6 => contact, 4 => coil, 4 => plain, 3 => timer, 3 => counter, 1 => res, 1 => mv, 3 => math, 2 => compare]
}

fn node() -> impl Strategy<Value = Node> {
    element().prop_map(leaf).prop_recursive(3, 12, 4, |inner| {
        let series = prop::collection::vec(inner, 1..4);
        prop::collection::vec(series, 1..4).prop_map(parallel)
    })
}

/// Before a scan: both inputs, and sometimes an integer or a relay written from outside.
type Stimulus = (bool, bool, Option<(&'static str, i64)>, Option<(&'static str, bool)>);

fn stimulus() -> impl Strategy<Value = Vec<Stimulus>> {
    let write = prop::option::weighted(0.3, (select(INTEGERS), select(VALUES)));
    let force = prop::option::weighted(0.1, (select(COILS), any::<bool>()));
    prop::collection::vec((any::<bool>(), any::<bool>(), write, force), 1..40)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn agrees_with_the_naive_interpreter(
        rungs in prop::collection::vec(prop::collection::vec(node(), 0..6), 1..5),
        stimulus in stimulus(),
    ) {
        let program = program(rungs);
        let mut eval = Evaluator::new(&program).map_err(|e| TestCaseError::fail(e.to_string()))?;
        let mut naive = naive::Naive::default();
        let symbols = eval.symbols().to_vec();
        prop_assert_eq!(&symbols, &program.symbols());
        for (scan, (a, b, write, force)) in stimulus.into_iter().enumerate() {
            let bits = [Some(("Xa", a)), Some(("Xb", b)), force];
            for (name, value) in bits.into_iter().flatten() {
                naive.bits.insert(name.to_owned(), value);
                if let Some(symbol) = eval.index(name) {
                    eval.set(symbol, value.into());
                }
            }
            if let Some((name, value)) = write {
                naive.store(name, value);
                if let Some(symbol) = eval.index(name) {
                    eval.set(symbol, value as i32);
                }
            }
            // A snapshot that scans unwatched must end in the same state as the watched original.
            let mut unwatched = eval.clone();
            unwatched.scan();
            let mut seen = Vec::new();
            eval.scan_watched(&mut |element, before, after| seen.push((element, before, after)));
            prop_assert_eq!(seen, naive.scan(&program), "scan {}", scan + 1);
            prop_assert_eq!(eval.scans(), scan as u64 + 1);
            for (i, symbol) in symbols.iter().enumerate() {
                let wanted = if symbol.kind.is_bit() { i64::from(naive.bit(&symbol.name)) } else { naive.integer(&symbol.name) };
                prop_assert_eq!(i64::from(eval.get(i)), wanted, "scan {}, {}", scan + 1, &symbol.name);
                prop_assert_eq!(unwatched.get(i), eval.get(i), "unwatched, scan {}, {}", scan + 1, &symbol.name);
            }
        }
    }
}
