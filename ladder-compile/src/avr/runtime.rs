//! What stands around the rungs: reset, and the subroutines that a program uses.

use emu_avr::isa::Kind;
use emu_core::chip::Chip;

use super::emit::{Asm, Label};
use super::layout::Layout;
use super::select::Regs;

/// RAM is cleared byte by byte up to this size, by a loop above it.
const UNROLLED: u16 = 6;

/// From reset to the start of the timer: stack, RAM, registers and ports, whatever they held. Pull-ups and low levels are
/// set before the directions, so no output glitches.
pub fn reset(asm: &mut Asm, regs: &Regs, layout: &Layout, chip: &Chip) {
    let [sp_low, sp_high] = (chip.ram_start + (chip.ram_len - 1)).to_le_bytes();
    asm.op(Kind::Eor, &[1, 1]);
    asm.op(Kind::Ldi, &[24, i32::from(sp_low)]);
    asm.op(Kind::Ldi, &[25, i32::from(sp_high)]);
    asm.op(Kind::Out, &[regs.io("SPH"), 25]);
    asm.op(Kind::Out, &[regs.io("SPL"), 24]);
    let [low, high] = layout.ram_start.to_le_bytes();
    asm.op(Kind::Ldi, &[28, i32::from(low)]);
    asm.op(Kind::Ldi, &[29, i32::from(high)]);
    if layout.ram_bytes <= UNROLLED {
        (0..i32::from(layout.ram_bytes)).for_each(|n| asm.op(Kind::StdY, &[n, 1]));
    } else {
        let [low, high] = (layout.ram_start + layout.ram_bytes).to_le_bytes();
        asm.op(Kind::Movw, &[26, 28]);
        asm.op(Kind::Ldi, &[25, i32::from(high)]);
        let again = asm.label();
        asm.place(again);
        asm.op(Kind::StXi, &[1]);
        asm.op(Kind::Cpi, &[26, i32::from(low)]);
        asm.op(Kind::Cpc, &[27, 25]);
        asm.repeat(Kind::Brne, again, u32::from(layout.ram_bytes));
    }
    layout.flags.iter().for_each(|&reg| asm.op(Kind::Eor, &[reg.into(), reg.into()]));
    for port in &layout.ports {
        if let Some(reg) = port.input {
            asm.op(Kind::Eor, &[reg.into(), reg.into()]);
        }
        let pull_ups = match (port.output, port.inputs) {
            (Some(reg), 0) => {
                asm.op(Kind::Eor, &[reg.into(), reg.into()]);
                i32::from(reg)
            }
            (Some(reg), inputs) => {
                asm.op(Kind::Ldi, &[24, inputs.into()]);
                asm.op(Kind::Mov, &[reg.into(), 24]);
                24
            }
            (None, inputs) => {
                asm.op(Kind::Ldi, &[24, inputs.into()]);
                24
            }
        };
        asm.op(Kind::Out, &[regs.port("PORT", port.letter), pull_ups]);
        if port.outputs != 0 {
            asm.op(Kind::Ldi, &[24, port.outputs.into()]);
            asm.op(Kind::Out, &[regs.port("DDR", port.letter), 24]);
        }
    }
}

/// r25:r24 := low word of r25:r24 * r23:r22.
pub fn multiply(asm: &mut Asm, entry: Label) {
    asm.place(entry);
    asm.op(Kind::Mul, &[24, 22]);
    asm.op(Kind::Movw, &[18, 0]);
    asm.op(Kind::Mul, &[25, 22]);
    asm.op(Kind::Add, &[19, 0]);
    asm.op(Kind::Mul, &[24, 23]);
    asm.op(Kind::Add, &[19, 0]);
    asm.op(Kind::Eor, &[1, 1]);
    asm.op(Kind::Movw, &[24, 18]);
    asm.op(Kind::Ret, &[]);
}

/// r25:r24 := r25:r24 / r23:r22, signed, truncated. Magnitudes are divided bit by bit; with a divisor of 0 every bit of
/// the quotient is 1, which with the dividend's sign is -1 or 1, as the language has it.
pub fn divide(asm: &mut Asm, entry: Label) {
    const REMAINDER: (i32, i32) = (18, 19);
    const COUNT: i32 = 20;
    const SIGN: i32 = 21;
    let negate = |asm: &mut Asm, low: i32| {
        asm.op(Kind::Com, &[low + 1]);
        asm.op(Kind::Neg, &[low]);
        asm.op(Kind::Sbci, &[low + 1, 0xFF]);
    };
    asm.place(entry);
    asm.op(Kind::Mov, &[SIGN, 25]);
    asm.op(Kind::Eor, &[SIGN, 23]);
    for low in [24, 22] {
        let positive = asm.label();
        asm.op(Kind::And, &[low + 1, low + 1]);
        asm.branch(Kind::Brpl, positive);
        negate(asm, low);
        asm.place(positive);
    }
    asm.op(Kind::Eor, &[REMAINDER.0, REMAINDER.0]);
    asm.op(Kind::Eor, &[REMAINDER.1, REMAINDER.1]);
    asm.op(Kind::Ldi, &[COUNT, 16]);
    let (again, smaller, positive) = (asm.label(), asm.label(), asm.label());
    asm.place(again);
    asm.op(Kind::Add, &[24, 24]);
    asm.op(Kind::Adc, &[25, 25]);
    asm.op(Kind::Adc, &[REMAINDER.0, REMAINDER.0]);
    asm.op(Kind::Adc, &[REMAINDER.1, REMAINDER.1]);
    asm.op(Kind::Cp, &[REMAINDER.0, 22]);
    asm.op(Kind::Cpc, &[REMAINDER.1, 23]);
    asm.branch(Kind::Brcs, smaller);
    asm.op(Kind::Sub, &[REMAINDER.0, 22]);
    asm.op(Kind::Sbc, &[REMAINDER.1, 23]);
    asm.op(Kind::Inc, &[24]);
    asm.place(smaller);
    asm.op(Kind::Dec, &[COUNT]);
    asm.repeat(Kind::Brne, again, 16);
    asm.op(Kind::And, &[SIGN, SIGN]);
    asm.branch(Kind::Brpl, positive);
    negate(asm, 24);
    asm.place(positive);
    asm.op(Kind::Ret, &[]);
}
