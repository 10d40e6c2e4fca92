//! Tests the optimised intermediate code of small programs, and the element that each operation belongs to.

use crate::common::{cases, program};
use ladder_compile::{lower::lower, optimise::optimise};

#[test]
fn small_programs_become_what_the_table_says() {
    for (name, sections) in cases(include_str!("data/ir.txt")) {
        let [text, wanted] = sections.as_slice() else { panic!("{name}: a program and its code") };
        let found = optimise(lower(&program(text))).to_string();
        assert_eq!(found.trim_end(), wanted.trim_end(), "{name}:\n{found}");
    }
}
