//! Random programs and their environment: chips, configurations, drives of pins, and changes from outside
//! between runs.

use emu_core::image::{Image, Segment};
use emu_core::pins::{CycleTime, PinId, PinLevel};
use emu_core::rng::Rng;
use emu_core::{Cpu, RamInit, ResetCause};
use emu_pic16::chips::PIC16_PARTS;
use emu_pic16::isa::find_row;
use emu_pic16::{Options, Pic16, Pic16Readings, TimingCorner};
use emu_test_support::slices::{RandomInput, SlicePlan, pick_random};

use super::rig::word;

fn byte(rng: &mut Rng) -> u8 {
    if rng.one_in(3) { pick_random(rng, &[0, 1, 2, 0x0F, 0x7F, 0x80, 0xFE, 0xFF]) } else { rng.next_u64() as u8 }
}

/// Returns the file registers of random code: often those of the core and of the first peripherals, otherwise
/// any.
fn file(rng: &mut Rng) -> u16 {
    match rng.below(8) {
        0..=2 => pick_random(rng, &[0u16, 0, 1, 2, 3, 4, 5, 6, 0x0A, 0x0B, 0x0B]),
        3 => rng.below(0x80) as u16,
        _ => 0x20 + rng.below(0x60) as u16,
    }
}

/// Returns random instructions of all rows, and one word in forty without a row; some rows are left out.
fn wild(len: usize, rng: &mut Rng) -> Vec<u16> {
    let mut words = Vec::with_capacity(len);
    while words.len() < len {
        let mut word = rng.next_u64() as u16 & 0x3FFF;
        if word < 0x2000 && word & 0x3F80 != 0 {
            word = word & !0x7F | file(rng);
        }
        if word & 0x3000 == 0x2000 && rng.one_in(2) {
            word = word & !0x7FF | (words.len() as u16 + rng.below(40) as u16).saturating_sub(20) & 0x7FF;
        }
        let control = word & 0x3F80 == 0;
        if find_row(word).is_some() && (!control || word != 0x63 || rng.one_in(3)) {
            words.push(word);
        }
    }
    words
}

/// Waits and work as compilers and people write them. Labels are line numbers (`L0` is the first line); %k is
/// a random byte, %b a random bit. The bank is 0 before and after, PCLATH is 0.
const SNIPPETS: &[&str] = &[
    "btfss 0x0B, 2; goto L0; bcf 0x0B, 2",
    "btfss 0x20, %b; goto L0; bcf 0x20, %b",
    "nop; btfss 0x20, %b; goto L0; bcf 0x20, %b; incf 0x31, F",
    "btfsc 0x06, %b; goto L0",
    "btfss 0x06, 0; goto L0; btfsc 0x06, 0; goto L2",
    "movf 0x06, W; andlw 0xF0; btfsc 0x03, 2; goto L0",
    "movf 0x05, W; xorwf 0x32, W; btfsc 0x03, 2; goto L0; xorwf 0x32, F",
    "movf 0x01, W; sublw %k; btfss 0x03, 2; goto L0",
    "movf 0x01, W; andlw 0x0F; btfss 0x03, 2; goto L0",
    "movlw %k; movwf 0x33; decfsz 0x33, F; goto L2",
    "movlw 3; movwf 0x34; movlw %k; movwf 0x33; decfsz 0x33, F; goto L4; decfsz 0x34, F; goto L2",
    "incfsz 0x35, F; goto L0",
    "movf 0x20, W; btfsc 0x03, 2; goto L0; clrf 0x20",
    "movlw 0x90; iorwf 0x0B, F; sleep; nop; bcf 0x0B, 1",
    "movlw 0x88; movwf 0x0B; sleep; movf 0x06, W; bcf 0x0B, 0",
    "movlw 0x18; movwf 0x0B; sleep; nop; movf 0x06, W; clrf 0x0B; movlw 0xF8; movwf 0x0B",
    "bcf 0x0B, 7; btfsc 0x0B, 7; goto L0; nop; bsf 0x0B, 7",
    "clrwdt; nop; clrwdt",
    "clrwdt; btfss 0x0B, 2; goto L0; bcf 0x0B, 2",
    "clrwdt; btfss 0x20, %b; goto L0; bcf 0x20, %b",
    "bcf 0x03, 5; bcf 0x03, 6; btfss 0x0B, 2; goto L0; bcf 0x0B, 2",
    "bsf 0x03, 5; clrwdt; btfss 0x05, %b; goto L0; bcf 0x03, 5",
    "clrwdt; bsf 0x03, 5; movf 0x05, W; bcf 0x03, 5; xorwf 0x06, W; bcf 0x0A, 3; btfsc 0x03, 2; goto L0",
    "movlw %k; movwf 0x06; bsf 0x06, %b; bcf 0x06, %b",
    "bsf 0x03, 5; movlw %k; movwf 0x06; bcf 0x03, 5; movf 0x06, W",
    "bsf 0x03, 5; movlw 0x5F; andwf 0x01, F; movlw %k; iorwf 0x01, F; bcf 0x03, 5",
    "bsf 0x03, 5; bcf 0x01, 5; bcf 0x01, 3; bcf 0x03, 5; clrf 0x01",
    "bsf 0x03, 5; movlw 0xD0; movwf 0x01; bcf 0x03, 5",
    "bsf 0x03, 5; movlw 0x88; movwf 0x01; bcf 0x03, 5",
    "movlw %k; movwf 0x01; movf 0x01, W; movf 0x01, W; movf 0x01, W; movf 0x01, W",
    "movlw 0x21; movwf 0x04; incf 0x00, F; incf 0x04, F; btfss 0x04, 6; goto L2",
    "movlw 0x06; movwf 0x04; movf 0x00, W; btfss 0x00, %b; goto L2",
    "movlw 0x0B; movwf 0x04; btfss 0x00, 2; goto L2; bcf 0x00, 2",
    "call L3; nop; goto L5; incf 0x36, F; return; nop",
    "call L2; goto L4; movf 0x02, W; retlw %k; nop",
    "movlw %k; addwf 0x37, F; subwf 0x38, F; rlf 0x37, F; rrf 0x38, F; swapf 0x37, W; xorwf 0x38, F",
    "btfss 0x20, %b; goto L4; clrf 0x20; nop; btfss 0x21, %b; goto L0; clrf 0x21",
];

/// Work of service routines, in addition to saving W and STATUS.
const SERVICE: &[&str] = &[
    "bsf 0x20, %b",
    "bsf 0x21, %b",
    "incf 0x20, F",
    "movlw 0xFF; movwf 0x20",
    "movlw 0xFF; movwf 0x21",
    "movlw %k; movwf 0x01",
    "movlw %k; xorwf 0x06, F",
    "btfsc 0x06, 0; nop",
    "movlw %k; movwf 0x3A; decfsz 0x3A, F; goto L2",
    "incf 0x3B, F; btfsc 0x3B, 2; bcf 0x0B, 5",
];

/// A program under construction, line by line.
#[derive(Default)]
struct Text {
    words: Vec<u16>,
    heads: Vec<u32>,
}

impl Text {
    /// Adds the lines of `text`, separated by semicolons.
    fn add(&mut self, text: &str, rng: &mut Rng) {
        let mut filled = text.replace("%b", &rng.below(8).to_string());
        while filled.contains("%k") {
            filled = filled.replacen("%k", &byte(rng).to_string(), 1);
        }
        let here = self.words.len();
        for (n, line) in filled.split(';').enumerate() {
            let line =
                (0..10).fold(line.trim().to_owned(), |l, n| l.replace(&format!(" L{n}"), &format!(" {}", here + n)));
            self.heads.push((here + n) as u32);
            self.words.push(word(&line));
        }
    }
}

/// Generates a service routine, a start that enables timer 0 and interrupts, and an endless loop of snippets.
fn orderly(rng: &mut Rng) -> Text {
    let mut text = Text { words: vec![word("nop"); 4], heads: Vec::new() };
    text.add("movwf 0x7E; swapf 0x03, W; bcf 0x03, 5; bcf 0x03, 6; movwf 0x7D", rng);
    (0..1 + rng.below(2)).for_each(|_| text.add(pick_random(rng, SERVICE), rng));
    text.add(
        pick_random(
            rng,
            &["movf 0x06, W; movlw 0xF8; andwf 0x0B, F", "bcf 0x0B, 2; bcf 0x0B, 1; movf 0x06, W; bcf 0x0B, 0"],
        ),
        rng,
    );
    text.add("swapf 0x7D, W; movwf 0x03; swapf 0x7E, F; swapf 0x7E, W; retfie", rng);
    let begin = text.words.len();
    text.words[0] = word(&format!("goto {begin}"));
    let option = pick_random(rng, &[0xD8u8, 0xD0, 0xD2, 0x81, 0x47, 0xDF, 0xE8, 0xC4]);
    text.add(&format!("clrf 0x0A; clrf 0x03; bsf 0x03, 5; movlw {option}; movwf 0x01; movlw 6; movwf 0x1F"), rng);
    text.add("bcf 0x03, 5; movf 0x06, W", rng);
    let enabled = pick_random(rng, &[0xF8u8, 0xB8, 0xA0, 0x90, 0x88, 0xB0, 0x38, 0]);
    text.add(&format!("movlw {enabled}; movwf 0x0B"), rng);
    let body = text.words.len();
    (0..3 + rng.below(14)).for_each(|_| text.add(pick_random(rng, SNIPPETS), rng));
    text.add(&if rng.one_in(8) { "goto L0".into() } else { format!("goto {body}") }, rng);
    text
}

fn level(rng: &mut Rng) -> PinLevel {
    pick_random(rng, &[PinLevel::Low, PinLevel::High, PinLevel::Low, PinLevel::High, PinLevel::Float])
}

fn act(pins: u64, words: u64, rng: &mut Rng) -> RandomInput {
    match rng.below(12) {
        0 => RandomInput::Poke("data", rng.below(0x200) as u32, byte(rng)),
        1 => RandomInput::Poke("data", pick_random(rng, &[3u32, 4, 0x0A, 0x0B, 0x20, 0x21, 0x81, 0x86]), byte(rng)),
        2 => RandomInput::Poke("flash", rng.below(2 * words) as u32, byte(rng)),
        3 => RandomInput::Pc(rng.below(words) as u32),
        4 | 5 => RandomInput::Trap(rng.below(words) as u32, true),
        6 => RandomInput::Trap(rng.below(words) as u32, false),
        7 => RandomInput::Reset(pick_random(
            rng,
            &[ResetCause::PowerOn, ResetCause::External, ResetCause::Watchdog, ResetCause::BrownOut],
        )),
        8 => RandomInput::Nothing,
        _ => RandomInput::Drive(rng.below(pins) as PinId, level(rng)),
    }
}

/// Creates a chip with a random program, wired and driven at random, from a seed.
pub fn plan(seed: u64, span: u64) -> SlicePlan<Pic16> {
    let mut rng = Rng::new(seed);
    let rng = &mut rng;
    let part = &PIC16_PARTS[rng.below(PIC16_PARTS.len() as u64) as usize];
    let chip = &part.chip;
    let text = if rng.one_in(3) { Text { words: wild(0x400, rng), heads: Vec::new() } } else { orderly(rng) };
    // All kinds of oscillators; sometimes the watchdog.
    let config = 0x3F38 | rng.below(4) as u16 | if rng.one_in(4) { 4 } else { 0 };
    let options = Options {
        // The slower the clock, the more often the watchdog times out.
        hz: pick_random(rng, &[4_000_000, 20_000_000, 200_000]),
        corner: pick_random(rng, &[TimingCorner::Min, TimingCorner::Typ, TimingCorner::Max]),
        config: Some(config),
        start_up: rng.one_in(4),
        readings: Pic16Readings { trmt_as_stop_begins: rng.one_in(4), ss_keeps_bits: rng.one_in(4) },
        ..Options::default()
    };
    let bytes = text.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let image = Image { segments: vec![Segment { space: "flash", addr: 0, bytes }], ..Image::default() };
    let mut start = Pic16::with(chip, &image, RamInit::Random(rng.next_u64()), options);
    let pins = chip.pins.len() as u64;
    let mclr = part.mclr;
    // Drives come in groups and singly, some of them at the same clock.
    let mut at = 0;
    while at < span {
        at += if rng.one_in(3) { rng.below(4) } else { rng.below(span / 10) };
        let on = rng.below(pins) as PinId;
        if on != mclr {
            start.drive(CycleTime { cycle: at, phase: rng.below(4) as u8 }, on, level(rng));
        }
    }
    if rng.one_in(10) {
        let at = rng.below(span);
        start.drive(CycleTime::at(at), mclr, PinLevel::Low);
        start.drive(CycleTime::at(at + rng.below(6)), mclr, PinLevel::High);
    }
    let mut acts: Vec<(u64, RandomInput)> =
        (0..rng.below(6)).map(|_| (rng.below(span), act(pins, text.words.len() as u64, rng))).collect();
    acts.push((span, RandomInput::Nothing));
    acts.sort_by_key(|act| act.0);
    let what = format!("seed {seed:#018x}, {}, {options:x?}, {acts:x?}", chip.name);
    SlicePlan { description: what, start, inputs: acts, breakpoint_candidates: text.heads }
}
