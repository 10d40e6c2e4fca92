//! Labels, jumps and subprograms: where they lead, and the order of execution in a scan.

use ladder::flow::{MAX_CALL_DEPTH, MAX_EXECUTED, MAX_JUMPS_BACK};
use ladder::{Element, FlowOp};

use crate::UnsupportedReason;
use crate::flat_program::FlatProgram;
use crate::flatten::FlatBuilder;
use crate::il_ops::IlNext;

/// What an element does to the order of execution. `to` is the index of a rung; the number of rungs is the
/// end.
#[derive(Debug, Clone, Copy)]
pub(crate) enum FlowStep {
    /// LABEL: nothing.
    Stay,
    /// GOTO.
    Goto { to: u32, is_back: bool },
    /// GOSUB.
    Call { to: u32 },
    /// SUBPROG, which is never executed as a part of what is above it.
    Skip { to: u32 },
    /// LOCK.
    Lock,
    /// RETURN: true if only with power.
    Return { if_powered: bool },
}

impl FlatBuilder<'_> {
    /// Resolves the name of an element that changes the order of execution.
    pub(crate) fn flow_step(&self, element: &Element) -> Result<FlowStep, UnsupportedReason> {
        // The element itself has been counted already.
        let rung = self.next.rung;
        let around = self.flow.subprogram_around(rung);
        let Element::Flow { op, label } = element else {
            return Ok(if *element == Element::Lock { FlowStep::Lock } else { FlowStep::Return { if_powered: true } });
        };
        let lost = || UnsupportedReason::NoTarget { label: label.clone() };
        Ok(match op {
            FlowOp::Label => FlowStep::Stay,
            FlowOp::Goto => {
                let to = self.flow.target(label).ok_or_else(lost)?;
                if self.flow.subprogram_around(to) != around {
                    return Err(UnsupportedReason::JumpAcross { label: label.clone() });
                }
                FlowStep::Goto { to, is_back: to <= rung }
            }
            FlowOp::Gosub => {
                let sub = self.flow.subprogram(label).ok_or_else(lost)?;
                let depth = self.flow.call_depths().get(sub.name).copied().unwrap_or(0);
                let most = MAX_CALL_DEPTH.min(self.flow.subprograms.len());
                if depth > most || self.flow.executed_elements() > MAX_EXECUTED {
                    return Err(UnsupportedReason::CallsTooDeep { label: label.clone() });
                }
                FlowStep::Call { to: sub.first + 1 }
            }
            FlowOp::Subprogram => {
                let sub = self.flow.subprogram(label).filter(|sub| sub.first == rung).ok_or_else(lost)?;
                FlowStep::Skip { to: sub.last + 1 }
            }
            FlowOp::EndSubprogram => {
                around.filter(|sub| sub.last == rung).ok_or_else(lost)?;
                FlowStep::Return { if_powered: false }
            }
        })
    }
}

/// The state of a parallel group while its branches run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ParallelGroup {
    /// Rung bit at the start of the group.
    pub at_start: bool,
    /// OR of the branches so far.
    pub any: bool,
}

/// The rung bits around a step that may change the flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FollowedRung {
    /// Rung bit after the step.
    pub after: bool,
    /// Rung bit of the step that is executed next.
    pub next: bool,
}

/// Position in the steps of a scan.
#[derive(Debug, Clone, Default)]
pub(crate) struct ScanPosition {
    /// The step to execute.
    pub next: usize,
    /// For each active call: the step behind it, and the parallel groups that its rung is in.
    calls: Vec<(usize, Vec<ParallelGroup>)>,
    jumps_back: u8,
}

impl ScanPosition {
    /// Goes where a line of Instruction List, behind which `next` already is, leads.
    pub(crate) fn follow_line(&mut self, code: &FlatProgram, to: IlNext) {
        match to {
            IlNext::Line => {}
            IlNext::End => self.next = code.steps.len(),
            IlNext::Jump { is_back: true, .. } if self.jumps_back == MAX_JUMPS_BACK => {}
            IlNext::Jump { to, is_back } => {
                self.jumps_back += u8::from(is_back);
                self.next = code.rung_starts.get(to as usize).copied().unwrap_or(code.steps.len());
            }
        }
    }

    /// The position at which a later scan goes on with a step; that scan may jump back as often as any other.
    pub(crate) fn held_at(&self, step: usize) -> ScanPosition {
        ScanPosition { next: step, calls: self.calls.clone(), jumps_back: 0 }
    }

    /// Executes an element behind which `next` already is.
    pub(crate) fn follow(
        &mut self,
        code: &FlatProgram,
        step: FlowStep,
        rung: bool,
        groups: &mut Vec<ParallelGroup>,
    ) -> FollowedRung {
        let start = |to: u32| code.rung_starts.get(to as usize).copied().unwrap_or(code.steps.len());
        match step {
            FlowStep::Goto { is_back: true, .. } if rung && self.jumps_back == MAX_JUMPS_BACK => {
                return FollowedRung { after: false, next: false };
            }
            FlowStep::Goto { to, is_back } if rung => {
                self.jumps_back += u8::from(is_back);
                self.next = start(to);
            }
            FlowStep::Call { to } if rung => {
                self.calls.push((self.next, groups.clone()));
                self.next = start(to);
            }
            FlowStep::Lock if rung => self.next = code.steps.len(),
            FlowStep::Skip { to } => self.next = start(to),
            FlowStep::Return { if_powered } if rung || !if_powered => match self.calls.pop() {
                Some((behind, kept)) => {
                    (self.next, *groups) = (behind, kept);
                    // The rung of the call had power.
                    return FollowedRung { after: rung, next: true };
                }
                None => self.next = code.steps.len(),
            },
            FlowStep::Stay
            | FlowStep::Lock
            | FlowStep::Goto { .. }
            | FlowStep::Call { .. }
            | FlowStep::Return { .. } => {}
        }
        FollowedRung { after: rung, next: rung }
    }
}
