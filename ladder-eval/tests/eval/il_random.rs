//! Random typed programs in Instruction List: all are accepted, written as the same program, and every value
//! stays in the range of its type.

use ladder_eval::Evaluator;
use proptest::prelude::*;

#[path = "../../../tests/ladder/il_programs.rs"]
mod il_programs;

use il_programs::{Draw, program};

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]
    #[test]
    fn values_stay_in_the_ranges_of_their_types(seed in any::<u64>()) {
        let text = program(seed);
        let read = ladder::il::read("t.il", &text);
        prop_assert!(read.is_ok(), "{read:?}\n{text}");
        let settings = ladder::il::il_settings(10_000);
        let resolved = ladder::il::to_ladder(&read.expect("checked").program, settings.clone());
        prop_assert!(resolved.is_ok(), "{resolved:?}\n{text}");
        let program = resolved.expect("checked").program;
        let written = ladder::write(&program);
        let again = ladder::il::read("t.il", &written).map(|read| ladder::il::to_ladder(&read.program, settings));
        let again = again.expect("reads").expect("resolves").program;
        let elements = |program: &ladder::LadderProgram| {
            program.elements().map(|at| (at.id, at.element.clone())).collect::<Vec<_>>()
        };
        prop_assert_eq!(elements(&again), elements(&program), "{}", written);
        let mut eval = Evaluator::new(&program).expect("an evaluator");
        let mut draw = Draw(seed.rotate_left(17) | 1);
        for _ in 0..30 {
            for symbol in 0..eval.symbols().len() {
                if draw.below(4) == 0 && !eval.symbols()[symbol].name.contains('.') {
                    eval.set(symbol, draw.0 as i32);
                }
            }
            eval.scan();
            for (index, symbol) in eval.symbols().iter().enumerate() {
                let value = symbol.shown_value(eval.get(index));
                prop_assert!(symbol.range().contains(&value), "{} is {value}\n{text}", symbol.name);
                // A value is stored with the sign of its width.
                let width = 32 - 8 * u32::from(symbol.bytes.clamp(1, 4));
                let stored = eval.get(index);
                prop_assert!(symbol.kind.is_bit() || stored << width >> width == stored, "{}", symbol.name);
            }
        }
    }
}
