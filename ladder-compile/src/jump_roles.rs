//! Jumps of the program in generated code: their labels, and what the longest path must know of them.

use std::collections::BTreeMap;

use crate::ir::{JumpKind, LabelId};

/// What the longest path must know of a jump; `L` is a label, or its address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JumpRole<L> {
    /// Taken back at most so many times in a row; 1 if it goes forward.
    Repeats(u32),
    /// One of the program's jumps back, which all together are limited.
    ProgramLoop,
    /// A call: the code from its target to `end` comes back to `back`.
    ProgramCall {
        /// Behind the code that is called.
        end: L,
        /// Where the call goes on.
        back: L,
    },
    /// The end of code that is called.
    ProgramReturn,
}

impl<L> JumpRole<L> {
    /// The role with each label converted.
    pub fn map<M>(self, label: impl Fn(L) -> M) -> JumpRole<M> {
        match self {
            JumpRole::Repeats(times) => JumpRole::Repeats(times),
            JumpRole::ProgramLoop => JumpRole::ProgramLoop,
            JumpRole::ProgramCall { end, back } => JumpRole::ProgramCall { end: label(end), back: label(back) },
            JumpRole::ProgramReturn => JumpRole::ProgramReturn,
        }
    }
}

/// Labels of the positions of the intermediate code that jumps reach, made where they are first needed.
#[derive(Debug, Clone)]
pub struct JumpLabels<L>(BTreeMap<LabelId, L>);

impl<L> Default for JumpLabels<L> {
    fn default() -> Self {
        JumpLabels(BTreeMap::new())
    }
}

impl<L: Copy> JumpLabels<L> {
    /// The label of a position; `new` makes one.
    pub fn label(&mut self, id: LabelId, new: impl FnOnce() -> L) -> L {
        *self.0.entry(id).or_insert_with(new)
    }

    /// The role of a jump; `new` makes labels.
    pub fn role(&mut self, kind: JumpKind, mut new: impl FnMut() -> L) -> JumpRole<L> {
        match kind {
            JumpKind::Forward => JumpRole::Repeats(1),
            JumpKind::Back => JumpRole::ProgramLoop,
            JumpKind::Call { end, back } => {
                JumpRole::ProgramCall { end: self.label(end, &mut new), back: self.label(back, &mut new) }
            }
            JumpKind::Return => JumpRole::ProgramReturn,
        }
    }
}
