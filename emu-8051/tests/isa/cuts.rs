//! Random writes to all registers of every chip: a machine that is saved and restored must equal one that is
//! not.

use emu_8051::chips::{MCS51_PARTS, Mcs51Part};
use emu_8051::{Mcs51, Mcs51Readings, Options};
use emu_core::RamInit;
use emu_core::image::{Image, Segment};
use emu_core::pins::PinId;
use emu_core::rng::Rng;
use emu_test_support::cut_tests::{boundary_byte, random_slice_plan, search_restore_faults};
use emu_test_support::slices::{SlicePlan, pick_random};

/// Number of programs per chip, unless `EMU_STATE_PROGRAMS` sets it.
const PROGRAMS: u64 = if cfg!(debug_assertions) { 10 } else { 60 };
const SPAN: u64 = 4_000;

/// Addresses of the registers of the core: SP, DPL, DPH, PSW, ACC and B.
const CORE: [u16; 6] = [0x81, 0x82, 0x83, 0xD0, 0xE0, 0xF0];

/// A random address of a register of the chip.
fn register(part: &'static Mcs51Part, rng: &mut Rng) -> u8 {
    loop {
        let addr = pick_random(rng, part.chip.regs).addr;
        if !CORE.contains(&addr) || rng.one_in(10) {
            return addr as u8;
        }
    }
}

/// Appends a random step: MOV of a constant, ORL, ANL, a single bit, a read, a delay loop, a power-saving
/// mode, the watchdog, or external memory.
fn step(part: &'static Mcs51Part, code: &mut Vec<u8>, rng: &mut Rng) {
    match rng.below(16) {
        // MOV R7,#n; DJNZ R7,$.
        0 => code.extend([0x7F, rng.below(60) as u8 + 1, 0xDF, 0xFE]),
        // ORL PCON,#n.
        1 => code.extend([0x43, 0x87, pick_random(rng, &[1, 1, 2, 0x80])]),
        // WDTRST.
        2 => code.extend([0x75, 0xA6, 0x1E, 0x75, 0xA6, 0xE1]),
        // Sets, clears or complements a bit of a bit-addressable register.
        3..=5 => {
            let bit = register(part, rng) & 0xF8 | rng.below(8) as u8;
            code.extend([pick_random(rng, &[0xD2, 0xC2, 0xB2]), bit]);
        }
        6 => code.extend([0xE5, register(part, rng)]),
        // ORL, ANL or XRL of a register with a constant.
        7 => code.extend([pick_random(rng, &[0x43, 0x53, 0x63]), register(part, rng), boundary_byte(rng)]),
        // MOV DPTR,#n; MOVX @DPTR,A.
        8 => code.extend([0x90, rng.below(256) as u8, boundary_byte(rng), 0xF0]),
        // MOV IE,#n.
        9 => code.extend([0x75, 0xA8, 0x80 | boundary_byte(rng)]),
        _ => code.extend([0x75, register(part, rng), boundary_byte(rng)]),
    }
}

/// A program of service routines, random steps, and a loop over some of the steps or a jump to itself.
fn program(part: &'static Mcs51Part, rng: &mut Rng) -> Vec<u8> {
    let mut code = vec![0; 3];
    for source in 0..6 {
        code.resize(3 + 8 * source, 0);
        if rng.one_in(2) {
            // ANL SCON,#FCh, or ANL T2CON,#3Fh, or CPL P1.0.
            code.extend(pick_random(rng, &[[0x53, 0x98, 0xFC], [0x53, 0xC8, 0x3F], [0xB2, 0x90, 0x00]]));
        }
        code.push(0x32);
    }
    code.resize(0x40, 0);
    let start = code.len();
    // MOV SP,#50h.
    code.extend([0x75, 0x81, 0x50]);
    (0..1 + rng.below(40)).for_each(|_| step(part, &mut code, rng));
    let body = code.len();
    (0..rng.below(6)).for_each(|_| step(part, &mut code, rng));
    let end = pick_random(rng, &[body, code.len()]);
    let jump = |to: usize| [0x02, (to >> 8) as u8, to as u8];
    code.extend(jump(end));
    code[..3].copy_from_slice(&jump(start));
    code
}

fn plan(part: &'static Mcs51Part, rng: &mut Rng) -> SlicePlan<Mcs51> {
    let bytes = program(part, rng);
    let readings = Mcs51Readings { samples_interrupt_at_once: rng.one_in(4), read_holds_interrupts: rng.one_in(4) };
    let options = Options { von_neumann: rng.one_in(6), ea: !rng.one_in(8), x2: rng.one_in(2), readings };
    let listing: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    let image = Image { segments: vec![Segment { space: "code", addr: 0, bytes }], ..Image::default() };
    let start = Mcs51::with(&part.chip, &image, RamInit::Random(rng.next_u64()), options);
    // The reset pin is included in one of three plans.
    let pins: Vec<PinId> = (0..32 + PinId::from(rng.one_in(3))).collect();
    let plan = random_slice_plan(start, &pins, SPAN, rng);
    let what = format!("{}, {options:?}\n{}\n{}", part.chip.name, listing.join(" "), plan.description);
    SlicePlan { description: what, ..plan }
}

#[test]
fn saved_and_restored() {
    let chips: Vec<(&str, &'static Mcs51Part)> = MCS51_PARTS.iter().map(|part| (part.chip.name, part)).collect();
    search_restore_faults(&chips, PROGRAMS, |part, rng| plan(part, rng));
}
