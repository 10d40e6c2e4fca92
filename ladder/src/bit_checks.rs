//! Checks of MOD, of the shifts, and of what else LDmicro 5 does with the bits of integers.

use diag::Severity;

use crate::check::Checker;
use crate::codes;
use crate::model::{Element, LadderOperand, MathOp, ProgramElement, ShiftOp, UnaryOp};

/// What one of these elements shows by itself.
pub(crate) fn check_bit_element(checker: &mut Checker<'_>, at: ProgramElement<'_>) {
    match at.element {
        Element::Math { op: MathOp::Mod, op2, .. } => {
            if let LadderOperand::Const { value: 0, .. } = op2 {
                let cause = "the remainder of a division by 0, which is the dividend";
                checker.warning(codes::DIVISION_BY_ZERO, at, cause, "test the divisor first");
            }
            note_other_outputs(checker, at, "a negative dividend on PIC, and MOD on AVR");
        }
        Element::Shift { op, src, count, .. } => {
            let bits = 8 * i64::from(checker.widths.bytes_of_operand(src));
            if let LadderOperand::Const { value, .. } = count
                && !(0..=bits).contains(value)
            {
                let cause = format!("a shift by {value} bits of {bits}");
                let hint = match (src, *value) {
                    (_, ..=-1) => {
                        "write the opposite shift with a positive count, such as SHR in place of SHL".to_owned()
                    }
                    (LadderOperand::Var(name), 1..=32) if bits < 32 => {
                        format!("write a count from 0 to {bits}, or `{} bytes {name}` in VAR LIST", (value + 7) / 8)
                    }
                    (LadderOperand::Var(_), _) => format!("write a count from 0 to {bits}; MOVE 0 clears all bits"),
                    (LadderOperand::Const { .. }, _) => {
                        format!("write a count from 0 to {bits}, or MOVE the number to a wider variable first")
                    }
                };
                checker.error(codes::SHIFT_COUNT, at, cause, hint);
            }
            match op {
                ShiftOp::Shl => {}
                ShiftOp::Shr => note_other_outputs(checker, at, "a negative number on PIC"),
                ShiftOp::Sr0 => note_other_outputs(checker, at, "a negative number in C"),
                ShiftOp::Rol => note_other_outputs(checker, at, "ROL in the simulator"),
                ShiftOp::Ror => {}
            }
        }
        Element::Unary { op, src, .. } => match op {
            UnaryOp::BinToBcd => note_other_outputs(checker, at, "BIN2BCD on AVR"),
            UnaryOp::BcdToBin => note_other_outputs(checker, at, "BCD2BIN on AVR and PIC, where there is none"),
            UnaryOp::Opposite => note_other_outputs(checker, at, "OPPOSITE on AVR, where there is none"),
            UnaryOp::Swap if checker.widths.bytes_of_operand(src) == 4 => {
                note_other_outputs(checker, at, "SWAP of four bytes in the simulator");
            }
            UnaryOp::Not | UnaryOp::Neg | UnaryOp::Swap => {}
        },
        Element::BitWrite { name, bit, .. } | Element::BitTest { name, bit, .. } => {
            let bits = 8 * i64::from(checker.widths.bytes_of_symbol(name));
            if let LadderOperand::Const { value, .. } = bit
                && !(0..bits).contains(value)
            {
                let cause = format!("{name} has {bits} bits, from 0 to {}", bits - 1);
                checker.warning(codes::NO_SUCH_BIT, at, cause, "choose one of them");
            }
        }
        // The rest is none of these.
        _ => {}
    }
}

/// Outputs of LDmicro 5 that do something else than the element means here.
fn note_other_outputs(checker: &mut Checker<'_>, at: ProgramElement<'_>, what: &str) {
    let cause = format!("LDmicro 5 itself does something else with {what}");
    checker.report(Severity::Note, codes::OUTPUTS_DIFFER, at, &cause, "nothing to do; compare with its other outputs");
}
