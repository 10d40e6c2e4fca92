//! Random intermediate code on emulated chips, against the interpreter.

mod common;

use common::bench::{Bench, Failed};
use common::programs::{Wish, ops, random};
use emu_avr::Avr;
use emu_avr::chips::ATMEGA328P;
use emu_core::rng::Rng;
use ladder_compile::Place;
use ladder_compile::avr::layout::Home;
use ladder_compile::ir::{Bit, Word};
use ladder_compile::target::{Built, Job, Mark, Refusal, Target};

/// The AVR back end as a target.
static AVR: Target =
    Target { chip: &ATMEGA328P, pins: ladder_compile::pins::ORDER, uart: None, pwm: None, adc: &[], eeprom: 0, build };

fn build(job: &Job<'_>) -> Result<Built, Refusal> {
    let pace = ladder_compile::avr::pace::pace(job.clock_hz, job.cycle_us).expect("paced");
    let image = ladder_compile::avr::build(job.ir, job.pins, &pace, job.target.chip)
        .map_err(|none| Refusal::Internal(format!("{none:?}")))?;
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
        ladder_compile::avr::emit::Mark::Poll => Some(Mark::Poll),
        ladder_compile::avr::emit::Mark::ScanStart => Some(Mark::ScanStart),
        ladder_compile::avr::emit::Mark::ScanEnd => Some(Mark::ScanEnd),
        _ => None,
    };
    Ok(Built {
        segments: vec![(0, image.code.words.iter().flat_map(|word| word.to_le_bytes()).collect())],
        lines: Vec::new(),
        marks: image.code.marks.iter().filter_map(|&(m, at)| Some((mark(m)?, at))).collect(),
        bits: bits.collect(),
        words: words.collect(),
        period: pace.period,
        shortest: pace.shortest(),
        tick: pace.prescale,
        poll: image.poll,
        worst: image.worst,
        rungs: Vec::new(),
        ram_bytes: image.layout.ram_bytes.into(),
        fuses: Vec::new(),
        specials: Vec::new(),
        warnings: Vec::new(),
    })
}

#[test]
fn avr_does_what_the_interpreter_does() {
    let words = Wish { ops: ops::INTEGERS & !ops::LOOKUP, tables: 0, ..Wish::WORDS };
    for seed in 0..200 {
        let wish = if seed % 2 == 0 { Wish::BITS } else { words };
        let mut ir = random(&mut Rng::new(seed), wish);
        ir.words.iter_mut().for_each(|cell| cell.initial = 0);
        let bench = Bench { target: &AVR, clock_hz: 16_000_000, cycle_us: 20_000, baud: None };
        match bench.run(&ir, seed, 20, Avr::new) {
            Ok(_) => {}
            Err(Failed::Refused(refusal)) => panic!("seed {seed}: {refusal:?}"),
            Err(Failed::Differs(how)) => panic!("seed {seed}: {how}"),
        }
    }
}
