//! Random writes to all registers of every chip: a machine that is saved and restored must stay equal to one
//! that is not.

use emu_core::RamInit;
use emu_core::image::{Image, Segment};
use emu_core::pins::PinId;
use emu_core::rng::Rng;
use emu_pic16::chips::{FileSlot, PIC16_PARTS, Pic16Part};
use emu_pic16::periph::map::Sfr;
use emu_pic16::{Options, Pic16, Pic16Readings, TimingCorner};
use emu_test_support::cut_tests::{boundary_byte, random_slice_plan, search_restore_faults};
use emu_test_support::slices::{SlicePlan, pick_random};

/// Number of programs per chip; `EMU_STATE_PROGRAMS` overrides it.
const PROGRAMS: u64 = if cfg!(debug_assertions) { 10 } else { 60 };
const SPAN: u64 = 4_000;

const CLRWDT: u16 = 0x0064;
const SLEEP: u16 = 0x0063;
const RETFIE: u16 = 0x0009;
const RETURN: u16 = 0x0008;

/// Address of a byte of RAM that every chip has in bank 0.
const COUNTER: u16 = 0x20;

/// A program under construction.
struct Text<'a> {
    words: Vec<u16>,
    part: &'static Pic16Part,
    rng: &'a mut Rng,
}

impl Text<'_> {
    /// Adds a BCF or BSF.
    fn bit(&mut self, addr: u16, bit: u64, set: bool) {
        self.bank(addr);
        self.words.push(if set { 0x1400 } else { 0x1000 } | (bit as u16) << 7 | addr & 0x7F);
    }

    /// Selects the bank of an address.
    fn bank(&mut self, addr: u16) {
        for (bit, of) in [(5u16, 0x80), (6, 0x100)] {
            self.words.push(if addr & of == 0 { 0x1003 } else { 0x1403 } | bit << 7);
        }
    }

    fn write(&mut self, addr: u16, value: u8) {
        self.bank(addr);
        self.words.extend([0x3000 | u16::from(value), 0x0080 | addr & 0x7F]);
    }

    fn write_sfr(&mut self, sfr: Sfr, value: u8) {
        if let Some(addr) = self.part.addr(sfr) {
            self.write(addr, value);
        }
    }

    /// Returns the address of a register, except those that end the program or select banks.
    fn register(&mut self) -> u16 {
        let registers = self.part.sfr.iter().filter(|(_, sfr)| !matches!(sfr, Sfr::PCL | Sfr::PCLATH | Sfr::STATUS));
        let registers: Vec<u16> = registers.map(|row| row.0).collect();
        pick_random(self.rng, &registers)
    }

    /// Adds a loop of some cycles that only counts.
    fn delay(&mut self) {
        let turns = self.rng.below(40) as u8 + 1;
        self.write(COUNTER, turns);
        let here = self.words.len() as u16;
        self.words.extend([0x0B80 | COUNTER, 0x2800 | here]);
    }

    /// Unlocks EECON1 and starts a read or a write.
    fn memory(&mut self) {
        let value = pick_random(self.rng, &[0x04, 0x84, 0x94, 0x14, 0x80, 0x00]);
        self.write_sfr(Sfr::EECON1, value);
        let (byte, addr) = (boundary_byte(self.rng), boundary_byte(self.rng));
        self.write_sfr(Sfr::EEDATA, byte);
        self.write_sfr(Sfr::EEADR, addr);
        let Some(addr) = self.part.addr(Sfr::EECON2) else { return };
        self.bank(addr);
        let unlock = [0x3055, 0x0080 | addr & 0x7F, 0x30AA, 0x0080 | addr & 0x7F];
        self.words.extend(unlock);
        let control = self.part.addr(Sfr::EECON1).unwrap_or(0) & 0x7F;
        let bit = if self.rng.one_in(4) { 0 } else { 1 };
        self.words.extend([0x1400 | bit << 7 | control, 0, 0]);
    }

    fn step(&mut self) {
        match self.rng.below(20) {
            0 => self.delay(),
            1 => self.words.push(pick_random(self.rng, &[SLEEP, CLRWDT, CLRWDT])),
            2 => self.memory(),
            3..=5 => {
                let (addr, bit, set) = (self.register(), self.rng.below(8), self.rng.one_in(2));
                self.bit(addr, bit, set);
            }
            6 => {
                let addr = self.register();
                self.bank(addr);
                self.words.push(0x0800 | addr & 0x7F);
            }
            7 => {
                let value = pick_random(self.rng, &[0xC0, 0xE8, 0xF8, 0x40, 0x00]);
                self.write_sfr(Sfr::INTCON, value);
            }
            _ => {
                let (addr, value) = (self.register(), boundary_byte(self.rng));
                self.write(addr, value);
            }
        }
    }
}

/// Generates a service routine and writes, followed by a loop over some of them, a sleep or a jump to itself.
fn program(part: &'static Pic16Part, rng: &mut Rng) -> Vec<u16> {
    let mut text = Text { words: vec![0; 5], part, rng };
    (0..text.rng.below(3)).for_each(|_| text.step());
    let flags = pick_random(text.rng, &[0x00, 0x78, 0xF8]);
    for sfr in [Sfr::PIR1, Sfr::PIR2] {
        text.write_sfr(sfr, 0);
    }
    text.write_sfr(Sfr::INTCON, flags);
    text.words.push(pick_random(text.rng, &[RETFIE, RETFIE, RETFIE, RETURN]));
    text.words[0] = 0x2800 | text.words.len() as u16;
    text.words[4] = 0;
    (0..1 + text.rng.below(40)).for_each(|_| text.step());
    let body = text.words.len() as u16;
    (0..text.rng.below(6)).for_each(|_| text.step());
    if text.rng.one_in(3) {
        text.words.push(SLEEP);
    }
    let end = pick_random(text.rng, &[body, text.words.len() as u16]);
    text.words.push(0x2800 | end);
    text.words
}

fn plan(part: &'static Pic16Part, rng: &mut Rng) -> SlicePlan<Pic16> {
    let words = program(part, rng);
    let options = Options {
        // The slower the clock, the sooner the watchdog times out and writes end.
        hz: pick_random(rng, &[4_000_000, 20_000_000, 200_000, 32_768]),
        corner: pick_random(rng, &[TimingCorner::Min, TimingCorner::Typ, TimingCorner::Max]),
        config: Some(if rng.one_in(2) { 0x3F38 | rng.below(8) as u16 } else { rng.next_u64() as u16 & 0x3FFF }),
        start_up: rng.one_in(4),
        readings: Pic16Readings { trmt_as_stop_begins: rng.one_in(4), ss_keeps_bits: rng.one_in(4) },
        timer1_hz: pick_random(rng, &[None, Some(32_768), Some(200_000), Some(3_000_000)]),
        ..Options::default()
    };
    let listing: Vec<String> = words.iter().enumerate().map(|(n, word)| format!("{n:03x}: {word:04x}")).collect();
    let bytes = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let image = Image { segments: vec![Segment { space: "flash", addr: 0, bytes }], ..Image::default() };
    let start = Pic16::with(&part.chip, &image, RamInit::Random(rng.next_u64()), options);
    let pins: Vec<PinId> =
        (0..part.chip.pins.len() as PinId).filter(|&pin| pin != part.mclr || rng.one_in(3)).collect();
    let plan = random_slice_plan(start, &pins, SPAN, rng);
    let what = format!("{}, {options:x?}\n{}\n{}", part.chip.name, listing.join(" "), plan.description);
    SlicePlan { description: what, ..plan }
}

#[test]
fn saved_and_restored() {
    let chips: Vec<(&str, &'static Pic16Part)> = PIC16_PARTS.iter().map(|part| (part.chip.name, part)).collect();
    search_restore_faults(&chips, PROGRAMS, |part, rng| plan(part, rng));
}

#[test]
fn every_chip_has_the_counter() {
    assert!(PIC16_PARTS.iter().all(|part| part.file_slot(COUNTER) == FileSlot::Ram(COUNTER)));
}
