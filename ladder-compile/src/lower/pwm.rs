//! Lowers PWM outputs.

use ladder::{Element, ProgramElement, PwmChoice, PwmOutput};

use super::{Lowering, if_accumulator};
use crate::ir::{BitRole, BranchCondition, IrOp, IrPwm, WordOperand, WordRole, min_bytes};

impl Lowering<'_> {
    /// Collects the PWM outputs.
    ///
    /// An output must not follow each of several SET_PWM within one scan: the last active one sets it after
    /// the rungs.
    pub(super) fn set_up_pwm(&mut self) {
        let program = self.program;
        for output in program.pwm_outputs() {
            let PwmOutput { name, hertz, element } = output;
            let number = self.ir.pwms.len() as u32;
            let mut duties = Vec::new();
            for ProgramElement { element, .. } in program.elements() {
                if let Element::SetPwm { duty, output, .. } = element
                    && output.as_ref().map(|choice| &choice.name) == name.as_ref()
                {
                    duties.push(self.value(duty));
                }
            }
            // The checks refuse a frequency that is no constant.
            self.ir.pwms.push(IrPwm { name, hertz: hertz.unwrap_or(1), element });
            if duties.len() < 2 {
                self.duties.push(None);
                continue;
            }
            let width = |duty: &WordOperand| match duty {
                WordOperand::Cell(word) => self.ir.bytes(*word),
                WordOperand::Const(constant) => min_bytes(*constant),
            };
            let bytes = duties.iter().map(width).max().unwrap_or(2);
            let suffix = if number == 0 { String::new() } else { format!(" {number}") };
            let word = self.new_word_cell(format!("duty{suffix}"), WordRole::Temporary, bytes, 0);
            let given = self.new_bit(format!("duty given{suffix}"), BitRole::Temporary);
            self.ir.prologue.push(IrOp::SetBit { bit: given, value: false });
            let set = IrOp::SetPwm { output: number, duty: WordOperand::Cell(word) };
            self.ir.epilogue.push(IrOp::If {
                cond: BranchCondition::Bit(given),
                if_true: vec![set],
                if_false: Vec::new(),
            });
            self.duties.push(Some((word, given)));
        }
    }

    /// Lowers SET_PWM.
    pub(super) fn set_pwm(&mut self, duty: &ladder::LadderOperand, choice: Option<&PwmChoice>) {
        let duty = self.value(duty);
        let name = choice.map(|choice| &choice.name);
        let output = self.ir.pwms.iter().position(|output| output.name.as_ref() == name).unwrap_or(0);
        self.push(if_accumulator(match self.duties.get(output).copied().flatten() {
            Some((dst, given)) => vec![IrOp::Move { dst, src: duty }, IrOp::SetBit { bit: given, value: true }],
            None => vec![IrOp::SetPwm { output: output as u32, duty }],
        }));
    }
}
