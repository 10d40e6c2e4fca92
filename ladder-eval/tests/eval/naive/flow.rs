//! Jumps and subprograms: rungs are found by their texts each time, and a call is a call of the interpreter.

use ladder::{Element, FlowOp, LadderProgram, RungNode};

use super::NaiveInterpreter;
use super::serial::LoggedStep;

/// How an element leaves its rung.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Departure {
    /// To the rung of this index.
    To(usize),
    /// Out of the subprogram, or of the program.
    Back,
}

impl NaiveInterpreter {
    /// Executes rungs until the end of the program, or of the subprogram.
    pub fn rungs_from(&mut self, mut at: usize, program: &LadderProgram) {
        while let Some(rung) = program.rungs.get(at) {
            self.current_element = (at as u32, 0);
            let start = LoggedStep { before: self.master_relay, after: self.master_relay, departure: None };
            let start = self.replay.pop_front().unwrap_or(start);
            self.log.push(start);
            self.series(&rung.series, start.after, program);
            match self.departure.take() {
                None => at += 1,
                Some(Departure::To(other)) => at = other,
                Some(Departure::Back) => return,
            }
        }
    }

    pub fn flow(&mut self, op: FlowOp, label: &str, power: bool, program: &LadderProgram) -> bool {
        let here = self.current_element.0 as usize;
        match op {
            FlowOp::Label => {}
            FlowOp::Goto => {
                let number = || label.parse::<usize>().expect("a number") - 1;
                let to = find(program, FlowOp::Label, label).unwrap_or_else(number).min(program.rungs.len());
                if power && to <= here {
                    if self.jumps_back == 100 {
                        return false;
                    }
                    self.jumps_back += 1;
                }
                self.departure = power.then_some(Departure::To(to));
            }
            FlowOp::Gosub if power => {
                let place = self.current_element;
                self.rungs_from(find(program, FlowOp::Subprogram, label).expect("a subprogram") + 1, program);
                self.current_element = place;
                if self.locked || self.ends {
                    self.departure = Some(Departure::To(program.rungs.len()));
                }
            }
            FlowOp::Gosub => {}
            FlowOp::Subprogram => {
                let end = find(program, FlowOp::EndSubprogram, label).expect("an end");
                self.departure = Some(Departure::To(end + 1));
            }
            FlowOp::EndSubprogram => self.departure = Some(Departure::Back),
        }
        power
    }
}

/// The rung that has this element.
fn find(program: &LadderProgram, wanted: FlowOp, name: &str) -> Option<usize> {
    fn has(nodes: &[RungNode], wanted: FlowOp, name: &str) -> bool {
        nodes.iter().any(|node| match node {
            RungNode::Leaf(Element::Flow { op, label }, _) => *op == wanted && label == name,
            RungNode::Leaf(..) => false,
            RungNode::Parallel(branches, _) => branches.iter().any(|branch| has(branch, wanted, name)),
        })
    }
    program.rungs.iter().position(|rung| has(&rung.series, wanted, name))
}
