//! Random writes to all registers of every chip: a machine that is saved and restored must stay equal to one
//! that is not.

use emu_avr::chips::{AVR_PARTS, AvrPart};
use emu_avr::{Avr, Options};
use emu_core::image::{Image, Segment};
use emu_core::pins::PinId;
use emu_core::rng::Rng;
use emu_core::{Cpu, RamInit, StopReason};
use emu_test_support::cut_tests::{boundary_byte, random_slice_plan, search_restore_faults};
use emu_test_support::slices::{SlicePlan, pick_random};

/// Number of programs per chip; `EMU_STATE_PROGRAMS` overrides it.
const PROGRAMS: u64 = if cfg!(debug_assertions) { 10 } else { 60 };
const SPAN: u64 = 4_000;

const RETI: u16 = 0x9518;
const SEI: u16 = 0x9478;
const CLI: u16 = 0x94F8;
const SLEEP: u16 = 0x9588;
const WDR: u16 = 0x95A8;
const SPM: u16 = 0x95E8;

/// Registers that access RAM, and those of the core, are left out: they would end most programs early.
const CORE: [&str; 3] = ["SPL", "SPH", "SREG"];

/// A program under construction.
struct Text<'a> {
    words: Vec<u16>,
    part: &'static AvrPart,
    rng: &'a mut Rng,
}

impl Text<'_> {
    /// Adds an LDI of register 16 or 17.
    fn load(&mut self, register: u16, value: u8) {
        let value = u16::from(value);
        self.words.push(0xE000 | (value & 0xF0) << 4 | (register - 16) << 4 | value & 0xF);
    }

    /// Adds an STS of a register that holds `value`.
    fn write(&mut self, addr: u16, value: u8) {
        self.load(16, value);
        self.words.extend([0x9300, addr]);
    }

    /// Adds two writes within four cycles, if the chip has the register.
    fn unlock(&mut self, name: &str, first: u8, second: u8) {
        let Some(addr) = self.part.chip.reg(name) else { return };
        self.load(16, first);
        self.load(17, second);
        self.words.extend([0x9300, addr, 0x9310, addr]);
    }

    fn register(&mut self) -> u16 {
        loop {
            let register = pick_random(self.rng, self.part.chip.regs);
            if !CORE.contains(&register.name) {
                return register.addr;
            }
        }
    }

    fn named(&mut self, name: &str, value: u8) {
        if let Some(addr) = self.part.chip.reg(name) {
            self.write(addr, value);
        }
    }

    fn step(&mut self) {
        match self.rng.below(20) {
            // LDI, DEC, BRNE.
            0 => {
                let turns = self.rng.below(60) as u8 + 1;
                self.load(18, turns);
                self.words.extend([0x952A, 0xF7F1]);
            }
            1 => self.words.push(pick_random(self.rng, &[SLEEP, WDR, SEI, CLI, SEI])),
            2 => {
                let (addr, byte) = (boundary_byte(self.rng), boundary_byte(self.rng));
                self.named("EEARL", addr);
                self.named("EEDR", byte);
                let mode = pick_random(self.rng, &[0x00, 0x10, 0x20, 0x08]);
                self.unlock("EECR", mode | 4, mode | 6);
            }
            3 => {
                let byte = boundary_byte(self.rng);
                for name in ["WDTCSR", "WDTCR"] {
                    self.unlock(name, 0x18, byte);
                }
            }
            4 => {
                let shift = self.rng.below(9) as u8;
                self.unlock("CLKPR", 0x80, shift);
            }
            5 => {
                // Z, then SPM.
                let (page, order) =
                    (boundary_byte(self.rng) & 0x3F, pick_random(self.rng, &[0x03, 0x05, 0x01, 0x11, 0x09]));
                self.words.extend([0xE0E0, 0xE0F0 | u16::from(page & 0xF)]);
                for name in ["SPMCSR", "SPMCR"] {
                    self.named(name, order);
                }
                self.words.push(SPM);
            }
            6 => {
                // A sleep that is enabled, in any mode.
                let mode = (self.rng.below(8) as u8) << 1 | 1;
                for name in ["SMCR", "MCUCR"] {
                    self.named(name, mode);
                }
                self.words.push(SLEEP);
            }
            7 | 8 => {
                // LDS.
                let addr = self.register();
                self.words.extend([0x9100, addr]);
            }
            9 | 10 => {
                // SBI or CBI.
                let (addr, bit) = (self.register(), self.rng.below(8) as u16);
                if (0x20..0x40).contains(&addr) {
                    self.words.push(pick_random(self.rng, &[0x9A00, 0x9800]) | (addr - 0x20) << 3 | bit);
                }
            }
            _ => {
                let (addr, value) = (self.register(), boundary_byte(self.rng));
                self.write(addr, value);
            }
        }
    }
}

/// Generates service routines and writes, followed by a loop over some of them, a sleep or a jump to itself.
fn program(part: &'static AvrPart, rng: &mut Rng) -> Vec<u16> {
    let chip = part.chip;
    let vectors = chip.vectors.len() * chip.words_per_vector as usize;
    let mut text = Text { words: vec![RETI; vectors], part, rng };
    // Some vectors share a routine that writes a register.
    let routine = text.words.len();
    (0..text.rng.below(3)).for_each(|_| text.step());
    text.words.push(RETI);
    for vector in 1..chip.vectors.len() {
        if text.rng.one_in(3) {
            let at = vector * chip.words_per_vector as usize;
            text.words[at] = 0xC000 | (routine - at - 1) as u16 & 0xFFF;
        }
    }
    text.words[0] = 0xC000 | (text.words.len() - 1) as u16;
    if text.rng.one_in(2) {
        text.words.push(SEI);
    }
    (0..1 + text.rng.below(40)).for_each(|_| text.step());
    let body = text.words.len();
    (0..text.rng.below(6)).for_each(|_| text.step());
    let here = text.words.len();
    let end = pick_random(text.rng, &[body, here]);
    text.words.push(0xC000 | (end.wrapping_sub(here + 1)) as u16 & 0xFFF);
    text.words
}

fn plan(part: &'static AvrPart, rng: &mut Rng) -> SlicePlan<Avr> {
    let words = program(part, rng);
    let fuses = |rng: &mut Rng| rng.next_u64().to_le_bytes();
    let [low, high, extended, lock, ..] = fuses(rng);
    let hz = pick_random(rng, &[16_000_000, 8_000_000, 1_000_000, 128_000, 32_768]);
    let options = Options {
        fuses: rng.one_in(2).then_some([low, high, extended]),
        lock: rng.one_in(4).then_some(lock),
        start_up: rng.one_in(4),
        ..Options::at_hz(hz)
    };
    let listing: Vec<String> = words.iter().enumerate().map(|(n, word)| format!("{n:03x}: {word:04x}")).collect();
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    // The program is also in the boot section, from which it can write program memory.
    let boot = part.chip.flash_bytes - 0x400;
    let segments =
        vec![Segment { space: "flash", addr: 0, bytes: bytes.clone() }, Segment { space: "flash", addr: boot, bytes }];
    let image = Image { segments, ..Image::default() };
    let mut start = Avr::with(part.chip, &image, RamInit::Random(rng.next_u64()), options);
    if rng.one_in(3) {
        start.set_pc(boot / 2);
    }
    let pins: Vec<PinId> = (0..part.chip.pins.len() as PinId).collect();
    let plan = random_slice_plan(start, &pins, SPAN, rng);
    let what = format!("{}, {options:x?}\n{}\n{}", part.chip.name, listing.join(" "), plan.description);
    SlicePlan { description: what, ..plan }
}

#[test]
fn saved_and_restored() {
    let chips: Vec<(&str, &'static AvrPart)> = AVR_PARTS.iter().map(|&part| (part.chip.name, part)).collect();
    search_restore_faults(&chips, PROGRAMS, |part, rng| plan(part, rng));
}

/// Earlier findings: a watchdog time-out at the end of WDR, and lock bits that change while no event is
/// pending.
#[test]
fn found_before() {
    for (name, seed) in [("atmega168", 0x57A7_E84C), ("atmega328p", 0x57A7_E75B), ("atmega328p", 0x57A7_E8CC)] {
        let part = emu_avr::chips::part(name).expect("a chip");
        let mut rng = Rng::new(name.bytes().fold(seed, |sum, byte| Rng::new(sum ^ u64::from(byte)).next_u64()));
        let start = plan(part, &mut rng).start;
        let (mut whole, mut restored) = (start.clone(), start);
        while restored.cycle() < SPAN && restored.run(restored.cycle() + 1, &mut ()) == StopReason::Limit {
            let state = restored.save();
            assert_eq!(restored.restore(&state), Ok(()), "{name}, seed {seed:#x}, cycle {}", restored.cycle());
        }
        whole.run(restored.cycle(), &mut ());
        assert!(whole.save() == restored.save(), "{name}, seed {seed:#x}");
    }
}
