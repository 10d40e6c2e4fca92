//! Code from reset to the start of the timer: sets up RAM, ports and everything that a reset leaves
//! undefined.

use diag::Severity;
use emu_pic16::isa::Kind;
use emu_pic16::periph::map::Sfr;

use super::layout::Pic16Layout;
use super::pacing::Pic16Pacing;
use super::peripherals::{self, Pic16Peripherals};
use super::writer::{Pic16Writer, STATUS, Z};
use crate::pins::AssignedPin;
use crate::target::{CodeMark, CompileJob, PinNeed};

/// Up to this many bytes are cleared one by one, more by a loop.
const MAX_UNROLLED_BYTES: usize = 6;

/// Emits everything before the poll loop. Outputs are low before their pins become outputs.
pub fn emit_reset(
    out: &mut Pic16Writer<'_>,
    job: &CompileJob<'_>,
    layout: &Pic16Layout,
    devices: &Pic16Peripherals,
    pace: &Pic16Pacing,
) {
    let chip = out.chip;
    out.mark(CodeMark::Section("reset: RAM, ports"));
    for bank in 0..4 {
        let used: Vec<u16> = layout.used.iter().copied().filter(|addr| addr >> 7 == bank).collect();
        clear_bytes(out, &used);
    }
    for (&at, cell) in layout.words.iter().zip(&job.ir.words) {
        for (at, k) in (at..).zip(cell.initial.to_le_bytes()).take(cell.bytes.into()) {
            if k != 0 {
                out.set_byte(at, k);
            }
        }
    }
    let latched = |letter| job.ir.port_cells(letter).is_some_and(|cells| cells.latch.or(cells.direction).is_some());
    for port in layout.ports.iter().filter(|port| port.output_bits != 0 || latched(port.letter)) {
        out.byte_op(Kind::Clrf, port.port);
    }
    let pwm = job.target.pwm.filter(|_| devices.pwm.is_some());
    if chip.part.comparators == emu_pic16::chips::ComparatorKind::F62x {
        peripherals::disable_comparators(out);
    }
    devices.configure_analog(out);
    let pwm_bit = pwm.and_then(|pin| Some((pin.chars().nth(1)?, pin.chars().nth(2)?.to_digit(8)?)));
    for port in &layout.ports {
        let pwm = pwm_bit.filter(|(letter, _)| *letter == port.letter).map_or(0, |(_, bit)| 1u8 << bit);
        let directions = port.existing_bits & !(port.output_bits | pwm);
        if port.output_bits | pwm != 0 {
            out.set_byte(port.tris, directions);
        }
        if port.letter == 'B' && port.input_bits != 0 {
            // Enable the pull-ups of port B for its inputs.
            out.set_bit(chip.bit("NOT_RBPU"), false);
        }
    }
    if let Some((letter, bit)) = pwm_bit
        && !layout.ports.iter().any(|port| port.letter == letter)
    {
        let row = chip.part.ports.iter().find(|row| row.port.name().ends_with(letter));
        if let Some(row) = row {
            out.byte_op(Kind::Bcf, 0);
            out.items.pop();
            out.set_bit((chip.reg(row.tris), bit as u8), false);
        }
    }
    pace.prepare(out);
    devices.start(out, job.ir.uart);
    out.mark(CodeMark::Section("pacing timer"));
    pace.start(out, layout.fraction, layout.extension);
}

/// Clears bytes that are all in one bank.
fn clear_bytes(out: &mut Pic16Writer<'_>, used: &[u16]) {
    let (Some(&first), Some(&last)) = (used.iter().min(), used.iter().max()) else { return };
    if used.len() <= MAX_UNROLLED_BYTES {
        used.iter().for_each(|&addr| out.byte_op(Kind::Clrf, addr));
        return;
    }
    // Clear all RAM from the first to the last byte in use. FSR has eight address bits, IRP is the ninth.
    let chip = out.chip;
    let (fsr, irp) = (chip.reg(Sfr::FSR), chip.bit("IRP"));
    if first > 0xFF {
        out.set_bit(irp, true);
    }
    out.set_byte(fsr, first as u8);
    let again = out.label();
    out.place(again);
    out.byte_op(Kind::Clrf, chip.reg(Sfr::INDF));
    let whole = |from: u16, to: u16| {
        (from..=to).all(|addr| matches!(chip.part.file_slot(addr), emu_pic16::chips::FileSlot::Ram(_)))
    };
    if first & 0x80 == 0 && whole(first, first | 0x7F) {
        out.byte_op(Kind::IncfF, fsr);
        out.skip_unless((fsr, 7), false);
    } else if first & 0x80 != 0 && whole(first, first | 0x7F) {
        out.byte_op(Kind::IncfszF, fsr);
    } else {
        out.byte_op(Kind::IncfF, fsr);
        out.byte_op(Kind::MovfW, fsr);
        out.literal_op(Kind::Xorlw, (last + 1) as u8);
        out.skip_unless((STATUS, Z), false);
    }
    out.goto_back(again, 0x80);
    if first > 0xFF {
        out.set_bit(irp, false);
    }
}

/// What pins need outside of the chip: outputs with an open drain, and inputs of all ports but B, which alone has pull-ups
/// (DS30292, section 3.2).
#[must_use]
pub fn pin_needs(job: &CompileJob<'_>, layout: &Pic16Layout) -> Vec<PinNeed> {
    let open = |pin: &&AssignedPin| {
        pin.output
            && layout
                .ports
                .iter()
                .any(|port| port.letter == pin.port_letter() && port.open_drain_bits >> pin.bit_number() & 1 == 1)
    };
    let drain = |pin: &AssignedPin| PinNeed {
        severity: Severity::Warning,
        cause: format!("`{}` is at {}, which has an open drain: it never goes high by itself", pin.name, pin.pin),
        hint: "use another pin, or a resistor to the supply",
    };
    let floating = PinNeed::of_floating_inputs(job.pins, |pin| pin.port_letter() != 'B');
    job.pins.iter().filter(open).map(drain).chain(floating).collect()
}
