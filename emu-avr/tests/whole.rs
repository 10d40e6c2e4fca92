//! Any way of running the whole chip gives the same machine: random programs that write peripherals, wait for
//! them, sleep and are interrupted, while pins are driven.

use emu_avr::{Avr, AvrReadings, Options, chips};
use emu_core::chip::Chip;
use emu_core::engine::CpuEngine;
use emu_core::image::{Image, Segment};
use emu_core::rng::Rng;
use emu_core::{Cpu, CycleTime, PinId, PinLevel, RamInit, ResetCause};
use emu_test_support::slices::{RandomInput, SlicePlan, SliceSubject, pick_random};

const SEED: u64 = 0x5EED_A328;
/// Number of programs. A build without optimization runs only the first ones, because each program runs in
/// eleven ways.
const PROGRAMS: u64 = if cfg!(debug_assertions) { 40 } else { 400 };
const SPAN: u64 = 50_000;
const CHIPS: [&str; 6] = ["atmega328p", "atmega328p", "atmega328p", "atmega88", "atmega8", "atmega64"];

/// Program words of the start of the main program, and between two service routines before it.
const MAIN: u32 = 0x200;
const ROUTINE: u32 = 8;

/// A program under construction.
struct Text {
    words: Vec<u16>,
    heads: Vec<u32>,
}

impl Text {
    fn at(&self) -> u32 {
        self.words.len() as u32
    }

    fn put(&mut self, line: &str) {
        self.words.extend(
            emu_asm::assemble_line(&chips::ATMEGA328P, line, self.at()).unwrap_or_else(|e| panic!("{line}: {e}")),
        );
    }

    fn fill(&mut self, to: u32) {
        assert!(self.at() <= to, "{:x} behind {to:x}", self.at());
        self.words.resize(to as usize, 0);
    }

    fn store(&mut self, addr: u16, value: u8) {
        self.put(&format!("ldi r16, {value}"));
        self.put(&format!("sts {addr:#x}, r16"));
    }

    /// Adds a timed sequence: the second write is within four cycles of the first, or just too late.
    fn sequence(&mut self, addr: u16, first: u8, second: u8, late: u64) {
        self.put(&format!("ldi r16, {first}"));
        self.put(&format!("ldi r17, {second}"));
        self.put(&format!("sts {addr:#x}, r16"));
        (0..late).for_each(|_| self.put("nop"));
        self.put(&format!("sts {addr:#x}, r17"));
    }
}

fn byte(rng: &mut Rng) -> u8 {
    match rng.below(3) {
        0 => 1 << rng.below(8),
        1 => pick_random(rng, &[0, 1, 3, 7, 0x0F, 0x7F, 0x80, 0xFE, 0xFF]),
        _ => rng.next_u64() as u8,
    }
}

/// Returns a register of the peripherals.
fn register(chip: &Chip, rng: &mut Rng) -> u16 {
    let registers: Vec<u16> =
        chip.regs.iter().map(|register| register.addr).filter(|addr| !(0x5D..0x60).contains(addr)).collect();
    pick_random(rng, &registers)
}

/// Returns the address of a register by its name, or that of GPIOR or PORTB if the chip has none of them.
fn named(chip: &Chip, names: &[&str], rng: &mut Rng) -> u16 {
    let name = pick_random(rng, names);
    let found = chip.regs.iter().find(|register| register.name == name);
    found.map_or_else(|| register(chip, rng), |register| register.addr)
}

/// Adds writes that start operations with an end or an edge.
fn start(chip: &Chip, text: &mut Text, rng: &mut Rng) {
    let clock = pick_random(rng, &[1, 1, 2, 3, 4, 5, 6]);
    match rng.below(10) {
        0..3 => {
            let mask = named(chip, &["TIMSK0", "TIMSK1", "TIMSK2", "TIMSK"], rng);
            text.store(mask, byte(rng));
            let mode = named(chip, &["TCCR0A", "TCCR1A", "TCCR2A", "TCCR0", "TCCR2"], rng);
            text.store(mode, byte(rng));
            let control = named(chip, &["TCCR0B", "TCCR1B", "TCCR2B", "TCCR0", "TCCR1B", "TCCR2"], rng);
            text.store(control, clock | byte(rng) & 0x18);
            let compare = named(chip, &["OCR0A", "OCR1AL", "OCR2A", "OCR0", "OCR2", "ICR1L"], rng);
            text.store(compare, byte(rng));
        }
        3 => {
            text.store(named(chip, &["UBRR0L", "UBRRL"], rng), rng.below(4) as u8);
            text.store(named(chip, &["UCSR0B", "UCSRB"], rng), 0x18 | byte(rng));
            text.store(named(chip, &["UDR0", "UDR"], rng), byte(rng));
        }
        4 => {
            text.store(named(chip, &["SPCR"], rng), 0x50 | byte(rng));
            text.store(named(chip, &["SPDR"], rng), byte(rng));
        }
        5 => {
            text.store(named(chip, &["TWBR"], rng), rng.below(20) as u8);
            text.store(named(chip, &["TWCR"], rng), 0x84 | byte(rng));
        }
        6 => {
            text.store(named(chip, &["ADMUX"], rng), byte(rng));
            text.store(named(chip, &["ADCSRA"], rng), 0xC0 | byte(rng));
        }
        7 => {
            text.store(named(chip, &["EECR"], rng), 0x04 | byte(rng) & 0x38);
            text.put("nop");
            text.put(&format!(
                "sbi 0x{:x}, 1",
                if chip.name.contains("328") || chip.name.contains("88") { 0x1F } else { 0x1C }
            ));
        }
        8 => {
            text.store(named(chip, &["EICRA", "EIMSK", "PCICR", "GICR", "PCMSK2", "PCMSK0"], rng), byte(rng));
        }
        _ => {
            let port = named(chip, &["DDRB", "DDRD", "PORTB", "PORTD", "DDRC", "PORTC"], rng);
            text.store(port, byte(rng));
        }
    }
}

fn block(chip: &Chip, text: &mut Text, rng: &mut Rng) {
    match rng.below(16) {
        0..5 => start(chip, text, rng),
        5..7 => text.store(register(chip, rng), byte(rng)),
        7 => {
            text.put(&format!("lds r17, {:#x}", register(chip, rng)));
            text.put(&format!("sts {:#x}, r17", 0x180 + rng.below(64)));
        }
        8 => {
            let bit = rng.below(8);
            let word = pick_random(rng, &["sbi", "cbi", "sbic", "sbis"]);
            text.put(&format!("{word} {:#x}, {bit}", rng.below(32)));
            text.put("inc r22");
        }
        9 => text.put(pick_random(rng, &["sei", "sei", "sei", "cli", "wdr"])),
        10 => {
            text.put(&format!("ldi r18, {}", byte(rng)));
            text.put("dec r18");
            text.put("brne .-4");
        }
        // A wait that ends.
        11..13 => {
            let (bit, addr) = (rng.below(8), register(chip, rng));
            text.put(&format!("ldi r19, {}", byte(rng)));
            text.put(&format!("lds r17, {addr:#x}"));
            text.put(&format!("{} r17, {bit}", pick_random(rng, &["sbrs", "sbrc"])));
            text.put("rjmp .+4");
            text.put("dec r19");
            text.put("brne .-12");
        }
        // A wait that may not end.
        13 => {
            start(chip, text, rng);
            let wait = pick_random(rng, &["sbrs", "sbrs", "sbrc"]);
            if rng.one_in(3) {
                text.put(&format!("in r17, {:#x}", 0x15 + rng.below(3)));
                text.put(&format!("{wait} r17, {}", rng.below(3)));
                text.put("rjmp .-6");
            } else {
                let names = [
                    "UCSR0A", "UCSRA", "SPSR", "TWCR", "ADCSRA", "EECR", "ACSR", "PIND", "PINB", "TCNT0", "TCNT1L",
                    "ASSR", "TIFR",
                ];
                let (addr, bit) = (named(chip, &names, rng), pick_random(rng, &[7, 7, 6, 5, 4, 3, 2, 1, 0]));
                text.put(&format!("lds r17, {addr:#x}"));
                text.put(&format!("{wait} r17, {bit}"));
                text.put("rjmp .-8");
            }
        }
        14 => {
            start(chip, text, rng);
            let mode = named(chip, &["SMCR", "MCUCR"], rng);
            let value = if chip.name.contains("328") || chip.name.contains("88") {
                1 | byte(rng) & 0x0E
            } else {
                0x80 | byte(rng) & 0x70
            };
            text.store(mode, value);
            text.put("sei");
            text.put("sleep");
        }
        _ => {
            let late = rng.below(4);
            let (addr, first, second) = match rng.below(5) {
                0 => (named(chip, &["CLKPR"], rng), 0x80, rng.below(9) as u8),
                1 => (named(chip, &["WDTCSR", "WDTCR"], rng), 0x18, byte(rng) & 0x7F | 6),
                2 => (named(chip, &["GTCCR", "SFIOR"], rng), byte(rng), byte(rng)),
                3 => (named(chip, &["PRR", "OSCCAL"], rng), byte(rng), 0),
                _ => (named(chip, &["ASSR"], rng), 0x20, pick_random(rng, &[0x20, 0])),
            };
            text.sequence(addr, first, second, late);
        }
    }
}

fn program(chip: &Chip, rng: &mut Rng) -> Text {
    let mut text = Text { words: Vec::new(), heads: Vec::new() };
    let vectors = chip.vectors.len() as u32 + 1;
    for n in 0..vectors {
        text.fill(n * chip.words_per_vector);
        let to = if n == 0 { MAIN } else { MAIN - ROUTINE * (vectors - n) };
        let away = 2 * (i64::from(to) - i64::from(text.at()) - 1);
        text.put(&format!("rjmp .{away:+}"));
    }
    for n in 1..vectors {
        text.fill(MAIN - ROUTINE * (vectors - n));
        text.heads.push(text.at());
        text.put("inc r20");
        text.put(&format!("lds r21, {:#x}", register(chip, rng)));
        text.put(&format!("sts {:#x}, r21", 0x140 + n));
        text.put("reti");
    }
    text.fill(MAIN);
    for _ in 0..20 + rng.below(60) {
        text.heads.push(text.at());
        block(chip, &mut text, rng);
    }
    let away = 2 * (i64::from(MAIN) - i64::from(text.at()) - 1);
    text.put(&format!("rjmp .{away:+}"));
    text
}

fn level(rng: &mut Rng) -> PinLevel {
    pick_random(
        rng,
        &[
            PinLevel::Low,
            PinLevel::Low,
            PinLevel::High,
            PinLevel::High,
            PinLevel::Float,
            PinLevel::PullUp,
            PinLevel::PullDown,
        ],
    )
}

fn act(chip: &Chip, heads: &[u32], rng: &mut Rng) -> RandomInput {
    match rng.below(8) {
        0 => RandomInput::Poke("data", u32::from(register(chip, rng)), byte(rng)),
        1 => RandomInput::Pc(pick_random(rng, heads)),
        2 => RandomInput::Trap(pick_random(rng, heads), rng.one_in(2)),
        3 => RandomInput::Reset(pick_random(
            rng,
            &[ResetCause::PowerOn, ResetCause::External, ResetCause::Watchdog, ResetCause::BrownOut],
        )),
        4 => RandomInput::Nothing,
        _ => RandomInput::Drive(rng.below(chip.pins.len() as u64) as PinId, level(rng)),
    }
}

/// Creates a chip with a random program, wired and driven at random, from a seed.
fn plan(seed: u64) -> SlicePlan<Avr> {
    let mut rng = Rng::new(seed);
    let rng = &mut rng;
    let chip = chips::chip(pick_random(rng, &CHIPS)).expect("a chip");
    let text = program(chip, rng);
    let options = Options {
        hz: pick_random(rng, &[1_000_000, 8_000_000, 16_000_000, 100_000]),
        start_up: rng.one_in(4),
        readings: AvrReadings {
            edges_wake: pick_random(rng, &[None, Some(false), Some(true)]),
            icr_only_as_top: rng.one_in(4),
            erased_is_nop: rng.one_in(4),
        },
        ..Options::at_hz(0)
    };
    let bytes = text.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let image = Image { segments: vec![Segment { space: "flash", addr: 0, bytes }], ..Image::default() };
    let mut start = Avr::with(chip, &image, RamInit::Random(rng.next_u64()), options);
    let reset = chip.pin("PC6");
    let mut at = 0;
    // Drives come in groups and singly, some of them in the same cycle.
    while at < SPAN {
        at += if rng.one_in(3) { rng.below(4) } else { rng.below(SPAN / 10) };
        let on = rng.below(chip.pins.len() as u64) as PinId;
        if Some(on) != reset || rng.one_in(20) {
            start.drive(CycleTime::at(at), on, level(rng));
        } else if rng.one_in(4) {
            start.drive_volts(CycleTime::at(at), on, rng.below(5000) as u32);
        }
        if rng.one_in(200) {
            start.set_supply(CycleTime::at(at), 1000 + rng.below(5000) as u32);
        }
    }
    let mut acts: Vec<(u64, RandomInput)> =
        (0..rng.below(6)).map(|_| (rng.below(SPAN), act(chip, &text.heads, rng))).collect();
    acts.push((SPAN, RandomInput::Nothing));
    acts.sort_by_key(|act| act.0);
    SlicePlan {
        description: format!("seed {seed:#018x}, {}, {options:?}, {acts:x?}", chip.name),
        start,
        inputs: acts,
        breakpoint_candidates: text.heads,
    }
}

/// Returns registers and data memory, SREG, SP.
fn seen(avr: &Avr) -> Vec<Option<u8>> {
    (0..0x300).map(|addr| avr.peek("data", addr)).collect()
}

#[test]
fn random_programs_on_the_whole_chip() {
    let subject = SliceSubject {
        visible_state: seen,
        memories: |avr| {
            (0..0x1000).map(|a| avr.peek("data", a)).chain((0..0x400).map(|a| avr.peek("eeprom", a))).collect()
        },
        code_words: 0x400,
        set_skip_idle_loops: Avr::set_skip_idle_loops,
        asleep: CpuEngine::is_core_asleep,
        corrupt_state: |avr| {
            avr.poke("flash", 2 * avr.pc(), 0);
            avr.poke("data", 0x140, 0xFF);
        },
    };
    let mut rng = Rng::new(SEED);
    let far: u64 = (0..PROGRAMS).map(|_| subject.assert_slicing_invariant(&plan(rng.next_u64()), &mut rng)).sum();
    // If all runs stopped at once, nothing would be compared.
    assert!(far > PROGRAMS * SPAN / 2, "only {far} cycles in all");
}
