//! The AVR back end as a target.

use emu_avr::chips::{ATMEGA328, ATMEGA328P};
use emu_avr::isa;

use super::emit::Mark as Old;
use super::layout::Home;
use super::pace::{self, NoPace};
use crate::ir::{Bit, Word};
use crate::map::Place;
use crate::target::{Built, Job, Line, Mark, Refusal, Target};

/// The pins that a program may use. PC6 is reset, PB6 and PB7 carry the crystal; PD0 and PD1 come last because boards put the
/// serial line there.
const ORDER: &[&str] = &[
    "PD2", "PD3", "PD4", "PD5", "PD6", "PD7", "PB0", "PB1", "PB2", "PB3", "PB4", "PB5", "PC0", "PC1", "PC2", "PC3",
    "PC4", "PC5", "PD0", "PD1",
];

const NONE: Target = Target { chip: &ATMEGA328P, pins: ORDER, uart: None, pwm: None, adc: &[], eeprom: 0, build };

/// The chips of this back end.
pub const TARGETS: &[Target] = &[NONE, Target { chip: &ATMEGA328, ..NONE }];

fn build(job: &Job<'_>) -> Result<Built, Refusal> {
    let pace = pace::pace(job.clock_hz, job.cycle_us).map_err(|none| match none {
        NoPace::Zero => Refusal::Period { shortest: 1, longest: 1 },
        NoPace::Longer(longest) => Refusal::Period { shortest: 1, longest },
    })?;
    let chip = job.target.chip;
    let image = super::build(job.ir, job.pins, &pace, chip).map_err(|none| match none {
        super::NoImage::Flash(needed) => Refusal::Code { needed, available: chip.flash.into(), rungs: Vec::new() },
        super::NoImage::Ram(needed) => Refusal::Ram { needed, available: chip.ram_len.into() },
        super::NoImage::Internal(what) => Refusal::Internal(what),
    })?;
    let space = || "data".to_owned();
    let bits = (0..job.ir.bits.len() as u32).map(|n| {
        let (home, bit) = image.layout.bit(Bit(n));
        let addr = match home {
            Home::Reg(reg) => reg.into(),
            Home::Ram(addr) => addr.into(),
        };
        Place::Bit { space: space(), addr, bit }
    });
    let words = (0..job.ir.words.len() as u32).map(|n| Place::Word {
        space: space(),
        addr: image.layout.word(Word(n)).into(),
        bytes: 2,
    });
    let mark = |mark| match mark {
        Old::Part(title) => Mark::Part(title),
        Old::TimerStart => Mark::TimerStart,
        Old::Poll => Mark::Poll,
        Old::ScanStart => Mark::ScanStart,
        Old::Rung(rung) => Mark::Rung(rung),
        Old::Element(id) => Mark::Element(id),
        Old::RungsEnd => Mark::RungsEnd,
        Old::ScanEnd => Mark::ScanEnd,
        Old::ScanOver => Mark::ScanOver,
    };
    let rung = |number: u32| image.code.at(Old::Rung(number)).or(image.code.at(Old::RungsEnd)).unwrap_or(0);
    let rungs = (0..job.ir.rungs.len() as u32).map(|n| super::worst::longest(&image.code, rung(n), rung(n + 1)));
    let lines = image.code.insns.iter().map(|insn| {
        let at = insn.addr as usize;
        let words = image.code.words.get(at..at + insn.len as usize).unwrap_or_default().to_vec();
        let text = isa::disassemble(&words, insn.addr).text;
        Line { addr: insn.addr, words, text, target: insn.target }
    });
    Ok(Built {
        segments: vec![(0, image.code.words.iter().flat_map(|word| word.to_le_bytes()).collect())],
        lines: lines.collect(),
        marks: image.code.marks.iter().map(|&(m, at)| (mark(m), at)).collect(),
        bits: bits.collect(),
        words: words.collect(),
        period: pace.period,
        shortest: pace.shortest(),
        tick: pace.prescale,
        poll: image.poll,
        worst: image.worst,
        rungs: rungs.collect(),
        ram_bytes: image.layout.ram_bytes.into(),
        fuses: fuses(job.clock_hz),
        specials: Vec::new(),
        warnings: Vec::new(),
    })
}

/// What the image needs of the fuses (DS40002061, sections 9.3, 9.4 and 28.2).
fn fuses(clock_hz: u64) -> Vec<String> {
    let select = match clock_hz {
        0..900_000 => "CKSEL3..1 = 100",
        900_000..3_000_000 => "CKSEL3..1 = 101",
        3_000_000..8_000_000 => "CKSEL3..1 = 110",
        8_000_000..=16_000_000 => "CKSEL3..1 = 111",
        _ => "CKSEL3..1 = 011, full swing",
    };
    vec![
        format!("clock: crystal of {clock_hz} Hz at XTAL1 and XTAL2 ({select})"),
        "CKDIV8 = 1: the clock is not divided".to_owned(),
        "WDTON = 1: the watchdog is off".to_owned(),
        "BOOTRST = 1: reset starts at address 0".to_owned(),
    ]
}
