//! The AVR back end: intermediate code to an image of program memory.

pub mod emit;
pub mod layout;
pub mod pace;
pub mod runtime;
pub mod select;
mod target;
pub mod worst;

use emu_avr::isa::{Kind, ROWS};
use emu_core::chip::Chip;
use ladder::ElementId;

use crate::ir::Ir;
use crate::pins::Pin;
use emit::{Asm, Code, Fault, Mark};
use layout::Layout;
use pace::Pace;
use select::{Regs, Select};

pub use target::TARGETS;

/// Bit of TIFR1 that timer 1 sets at a match with OCR1A (DS40002061, section 16.11.9).
const MATCH: i32 = 1;

/// A finished image with what is known of it.
#[derive(Debug)]
pub struct Image {
    /// The code.
    pub code: Code,
    /// Where the cells are.
    pub layout: Layout,
    /// The longest path of a scan in clocks, from its first instruction back to the loop that waits.
    pub worst: u64,
    /// The longest time from a match to the first instruction of its scan, in clocks.
    pub poll: u64,
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoImage {
    /// The code needs so many bytes.
    Flash(u64),
    /// The data need so many bytes of RAM, the stack included.
    Ram(u64),
    /// An instruction could not be encoded.
    Internal(String),
}

/// Makes the image of `ir`. Programs that take too long are the caller's to refuse.
///
/// # Errors
/// The image does not fit the chip.
pub fn build(ir: &Ir, pins: &[Pin], pace: &Pace, chip: &'static Chip) -> Result<Image, NoImage> {
    let layout = layout::layout(ir, pins, chip, pace.fraction.map_or(0, |f| f.bytes)).map_err(NoImage::Ram)?;
    let regs = Regs::new(chip);
    let mut asm = Asm::default();
    asm.mark(Mark::Part("reset: stack, RAM, bits, ports"));
    runtime::reset(&mut asm, &regs, &layout, chip);
    asm.mark(Mark::Part("pacing timer"));
    pace.start(&mut asm, &regs, layout.fraction);

    let poll = asm.label();
    asm.mark(Mark::Part("wait for the match"));
    asm.mark(Mark::Poll);
    asm.place(poll);
    asm.op(Kind::Sbis, &[regs.io("TIFR1"), MATCH]);
    asm.jump(poll);
    asm.mark(Mark::ScanStart);
    asm.mark(Mark::Part("scan: take the match, latch the inputs"));
    asm.op(Kind::Sbi, &[regs.io("TIFR1"), MATCH]);
    pace.next(&mut asm, &regs, layout.fraction);
    for port in &layout.ports {
        if let Some(reg) = port.input {
            asm.op(Kind::In, &[reg.into(), regs.port("PIN", port.letter)]);
        }
    }
    let mut select = Select::new(&mut asm, &layout);
    select.ops(&ir.begin);
    rungs(ir, &mut select);
    select.ops(&ir.end);
    let (multiply, divide) = (select.multiply, select.divide);
    asm.mark(Mark::Part("write the outputs"));
    for port in &layout.ports {
        if let Some(reg) = port.output {
            asm.op(Kind::Out, &[regs.port("PORT", port.letter), reg.into()]);
        }
    }
    asm.mark(Mark::ScanEnd);
    asm.jump(poll);
    asm.mark(Mark::ScanOver);
    if let Some(entry) = multiply {
        asm.mark(Mark::Part("r25:r24 * r23:r22"));
        runtime::multiply(&mut asm, entry);
    }
    if let Some(entry) = divide {
        asm.mark(Mark::Part("r25:r24 / r23:r22"));
        runtime::divide(&mut asm, entry);
    }

    let code = asm.finish(chip.flash).map_err(|fault| match fault {
        Fault::TooLarge(bytes) => NoImage::Flash(bytes),
        Fault::Encode(what) => NoImage::Internal(what),
    })?;
    let at = |mark| code.at(mark).unwrap_or(0);
    let worst = worst::longest(&code, at(Mark::ScanStart), at(Mark::ScanOver));
    // One turn that just missed the match (the look and the jump back), and the look that sees it.
    let cycles = |kind: Kind, outcome: usize| {
        ROWS.get(kind as usize).and_then(|row| row.cycles.outcomes().get(outcome)).copied().map_or(0, u64::from)
    };
    let poll = cycles(Kind::Sbis, 0) + cycles(Kind::Rjmp, 0) + cycles(Kind::Sbis, 1);
    Ok(Image { code, layout, worst, poll })
}

/// The rungs, with a mark at every element of the program, also at those without code.
fn rungs(ir: &Ir, select: &mut Select<'_>) {
    for (number, rung) in ir.rungs.iter().enumerate() {
        let number = number as u32;
        select.asm.mark(Mark::Rung(number));
        let mut steps = rung.steps.iter().peekable();
        for index in 0..rung.elements {
            let id = ElementId { rung: number, index };
            select.asm.mark(Mark::Element(id));
            while let Some(step) = steps.next_if(|step| step.at <= id) {
                select.op(&step.op);
            }
        }
    }
    select.asm.mark(Mark::RungsEnd);
}
