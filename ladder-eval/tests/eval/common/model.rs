//! Builds programs from parts of the model, for generators.

use ladder::{Element, LadderDialect, LadderOperand, LadderProgram, LdFormat, ProgramSettings, Rung, RungNode};

/// Creates a program with these rungs: dialect 2.3, a cycle of 10 ms.
pub fn program(rungs: Vec<Vec<RungNode>>) -> LadderProgram {
    LadderProgram {
        declarations: Vec::new(),
        file: "test.ld".to_owned(),
        format: LdFormat::V01,
        dialect: LadderDialect::Ldmicro23,
        style: Default::default(),
        settings: ProgramSettings {
            micro: None,
            cycle_us: 10_000,
            cycle_rest: String::new(),
            crystal_hz: 4_000_000,
            crystal_rest: String::new(),
            baud: Some(2400),
            baud_rest: String::new(),
            compiler: None,
            compiled: None,
        },
        io: Vec::new(),
        vars: None,
        pull_ups: None,
        rungs: rungs.into_iter().map(|series| Rung { series, pos: Default::default() }).collect(),
    }
}

pub fn leaf(element: Element) -> RungNode {
    RungNode::Leaf(element, Default::default())
}

pub fn parallel(branches: Vec<Vec<RungNode>>) -> RungNode {
    RungNode::Parallel(branches, Default::default())
}

pub fn contacts(name: &str, negated: bool) -> Element {
    Element::Contacts { name: name.to_owned(), negated, set1: None }
}

pub fn coil(name: &str) -> Element {
    Element::Coil { name: name.to_owned(), negated: false, set: false, reset: false, ttrigger: None }
}

pub fn constant(value: i64) -> LadderOperand {
    LadderOperand::Const { value, text: value.to_string() }
}

pub fn var(name: &str) -> LadderOperand {
    LadderOperand::Var(name.to_owned())
}
