//! The coverage rules of Instruction List: which outcomes of each line a check should see.

use ladder::il::{IecType, IlAction, IlCondition, IlSource, IlStep};

use crate::coverage::classes::CoverageClass;
use crate::coverage::possible_outcomes::{FALSE_FALSE, FALSE_TRUE, TRUE_FALSE, TRUE_TRUE};
use crate::coverage::rules::{OutcomeCondition, WantedOutcome};

/// The outcomes of a line of Instruction List; `None` for a line that always does the same.
pub(crate) fn instruction_outcomes(
    step: &IlStep,
    symbol: &dyn Fn(&str) -> usize,
) -> Option<(CoverageClass, Vec<WantedOutcome>)> {
    use OutcomeCondition::{Always, Changed};
    const IN: u8 = TRUE_FALSE | TRUE_TRUE;
    const NOT_IN: u8 = FALSE_FALSE | FALSE_TRUE;
    const OUT: u8 = FALSE_TRUE | TRUE_TRUE;
    const NOT_OUT: u8 = FALSE_FALSE | TRUE_FALSE;
    let is_bool = step.after == Some(IecType::Bool);
    let by_condition = |condition: IlCondition| match condition {
        IlCondition::Always => None,
        IlCondition::IfTrue => Some(vec![("acts", IN, Always), ("rests", NOT_IN, Always)]),
        IlCondition::IfFalse => Some(vec![("acts", NOT_IN, Always), ("rests", IN, Always)]),
    };
    Some(match &step.action {
        IlAction::Load { source: IlSource::Constant(_), .. } | IlAction::Nothing => return None,
        IlAction::Open { source: None | Some(IlSource::Constant(_)), .. } => return None,
        IlAction::Load { .. }
        | IlAction::Not { .. }
        | IlAction::Binary { .. }
        | IlAction::Open { .. }
        | IlAction::Close { .. }
        | IlAction::Function(_) => {
            // A number has no two outcomes.
            let goals = vec![("gives TRUE", OUT, Always), ("gives FALSE", NOT_OUT, Always)];
            (CoverageClass::Contacts, is_bool.then_some(goals)?)
        }
        IlAction::Store { negated, target } if target.iec_type == IecType::Bool => {
            let (one, zero) = if *negated { (NOT_IN, IN) } else { (IN, NOT_IN) };
            (CoverageClass::Coils, vec![("stores 1", one, Always), ("stores 0", zero, Always)])
        }
        IlAction::Store { .. } => return None,
        IlAction::Set(_) | IlAction::Reset(_) => {
            (CoverageClass::Coils, vec![("acts", IN, Always), ("rests", NOT_IN, Always)])
        }
        IlAction::Jump { condition, .. } | IlAction::Return(condition) => {
            (CoverageClass::Actions, by_condition(*condition)?)
        }
        IlAction::Call { condition, call } => {
            let class = if call.block.is_timer() { CoverageClass::Timers } else { CoverageClass::Counters };
            let mut outcomes = by_condition(*condition).unwrap_or_default();
            let outputs = call.block.parts().iter().filter(|part| !part.is_input && part.iec_type() == IecType::Bool);
            outcomes.extend(
                outputs
                    .filter_map(|part| call.part(part.name))
                    .map(|output| ("changes an output", IN | NOT_IN, Changed(symbol(&output.name)))),
            );
            (class, outcomes)
        }
    })
}
