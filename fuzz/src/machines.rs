//! Chips and machines for the targets; one chip represents each family.

pub(crate) use emu::fuzzing::{MachineVisitor, visit_machine};
use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::Cpu;
use emu_core::image::{Image, Segment};
use emu_debug::debug::{DebugSession, DynMachine, MachineWithDevices, NameScope, SessionOptions};
use emu_debug::{AttachedDevices, CycleClock};

/// The families, in the order of [`family_chips`].
pub(crate) const FAMILIES: [ChipFamily; 4] = [ChipFamily::Avr, ChipFamily::Mcs51, ChipFamily::Pic16, ChipFamily::Ap101];

/// The chip that represents a family.
pub(crate) fn family_chip(family: ChipFamily) -> &'static Chip {
    let found = match family {
        ChipFamily::Avr => emu_avr::chips::chip("atmega328p"),
        ChipFamily::Mcs51 => emu_8051::chips::chip("at89s52"),
        ChipFamily::Pic16 => emu_pic16::chips::chip("pic16f877a"),
        ChipFamily::Ap101 => Some(&emu_ap101::chips::AP101),
    };
    found.expect("the families have these chips")
}

/// The chips of all families.
pub(crate) fn family_chips() -> impl Iterator<Item = &'static Chip> {
    FAMILIES.into_iter().map(family_chip)
}

/// A program in the assembly language of a family that counts and writes memory in an endless loop.
pub(crate) fn family_program(family: ChipFamily) -> &'static str {
    match family {
        ChipFamily::Avr => {
            "ldi r16, 0x40\nloop: sts 0x100, r16\ninc r16\nout 5, r16\nrcall sub\nrjmp loop\nsub: push r16\npop r16\nret\n"
        }
        ChipFamily::Mcs51 => "loop: inc 30h\nmov p1, 30h\nlcall sub\nsjmp loop\nsub: push acc\npop acc\nret\n",
        ChipFamily::Pic16 => "loop: incf 0x20, f\nmovf 0x20, w\nmovwf 6\ncall sub\ngoto loop\nsub: nop\nreturn\n",
        ChipFamily::Ap101 => "channels 8, 4\nld i1\nand i2\nsto e1\nld i3\nand i4\nsto e2\n",
    }
}

/// Assembles a source; the image is empty if the source is refused.
pub(crate) fn assemble(chip: &'static Chip, source: &str) -> Image {
    emu_asm::assemble_text(chip, source).unwrap_or_default()
}

/// An image whose program memory starts with these bytes, as many as fit.
pub(crate) fn image_of_bytes(chip: &'static Chip, bytes: &[u8]) -> Image {
    let end = bytes.len().min(chip.flash_bytes as usize) & !(chip.word_bytes as usize - 1);
    let bytes: Vec<u8> = bytes.get(..end).unwrap_or_default().to_vec();
    let segments = if bytes.is_empty() { Vec::new() } else { vec![Segment { space: chip.code_space, addr: 0, bytes }] };
    Image { segments, ..Image::default() }
}

/// Converts a machine to the debugger's machine type.
pub(crate) struct ToDynMachine;

impl MachineVisitor for ToDynMachine {
    type Output = (Box<dyn DynMachine>, CycleClock);

    fn visit<C: Cpu + 'static>(self, mut cpu: C) -> Self::Output {
        let clock = CycleClock { hz: cpu.chip().default_hz, clocks_per_cycle: cpu.clocks_per_cycle() };
        let mut board = AttachedDevices::new(Vec::new(), clock);
        board.connect(&mut cpu);
        (Box::new(MachineWithDevices::new(cpu, board)), clock)
    }
}

/// A debugger session on a machine with an image.
pub(crate) fn open_session(chip: &'static Chip, image: Image) -> DebugSession {
    let (target, clock) = visit_machine(chip, &image, ToDynMachine);
    let mut scope = NameScope::new(chip);
    (scope.symbols, scope.lines) = (image.symbols, image.lines);
    DebugSession::new(target, scope, SessionOptions { clock, max_copy_bytes: 4 << 20, follower: None })
}
