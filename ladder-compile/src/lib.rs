//! Ladder to machine code: a program becomes an image for a chip, a listing, and a map that says where everything is.
//!
//! ```text
//! ladder::Program -> refuse -> lower -> optimise -> avr (layout, pace, select, emit) -> HEX, listing, map
//! ```
//!
//! How it works and what the map holds stands in `docs/compile.md`.

#![forbid(unsafe_code)]

pub mod ap101;
pub mod avr;
pub mod code;
mod codes;
pub mod emit;
pub mod ir;
mod listing;
pub mod lower;
mod map;
pub mod mcs51;
mod modules;
#[cfg(feature = "mutants")]
mod mutants;
pub mod optimise;
pub mod pic16;
pub mod pins;
pub mod refuse;
pub mod target;
pub mod worst;

use diag::{Diagnostic, Pos, Severity};
use emu_avr::chips::{ATMEGA328, ATMEGA328P};
use emu_core::chip::Chip;
use ladder::{ElementId, Program};

use avr::emit::Mark;
use avr::pace::{NoPace, Pace};
use avr::{Image, NoImage};
use ir::Ir;
use pins::Pin;

pub use codes::{CODES, FUSES_NOTE};
pub use map::{EepromMap, ElementMap, Map, PinMap, Place, Ratio, RungMap, SCHEMA, Special, SymbolMap};
#[cfg(feature = "mutants")]
pub use mutants::{Mutant, compile_mutant, mutants};

/// Chips that there is a compiler for: fewer than there are emulators for.
pub const CHIPS: &[&Chip] = &[&ATMEGA328P, &ATMEGA328];

/// The chip `name` (case aside), where there is a compiler for it.
#[must_use]
pub fn chip(name: &str) -> Option<&'static Chip> {
    CHIPS.iter().copied().find(|chip| chip.name.eq_ignore_ascii_case(name))
}

/// What a program is compiled for.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Options {
    /// The chip, such as `atmega328p`.
    pub mcu: String,
    /// Pins by symbol, such as (`Xstart`, `PD2`); they go before those of `IO LIST`.
    pub pins: Vec<(String, String)>,
    /// Clock in Hz, instead of `CRYSTAL=`.
    pub clock_hz: Option<u64>,
}

/// A compiled program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Compiled {
    /// Intel HEX of program memory.
    pub hex: String,
    /// Program memory from address 0.
    pub code: Vec<u8>,
    /// The instructions with the elements that they come from.
    pub listing: String,
    /// Where everything is.
    pub map: Map,
    /// What the user should know: pins that were given out, fuses. Never errors.
    pub notes: Vec<Diagnostic>,
}

/// Compiles `program`. The warnings of `ladder::check` are the caller's to print.
///
/// # Errors
/// Every reason found why there is no image: the errors of `ladder::check`, elements without code, pins, time, size. There
/// is never a part of an image.
pub fn compile(program: &Program, options: &Options) -> Result<Compiled, Vec<Diagnostic>> {
    compile_with(program, options, |_| {})
}

/// Compiles `program`; `change` may change the intermediate code first.
fn compile_with(
    program: &Program,
    options: &Options,
    change: impl FnOnce(&mut Ir),
) -> Result<Compiled, Vec<Diagnostic>> {
    let error = |code, cause: String, hint: &str| {
        Diagnostic::new(Severity::Error, code, &program.file, Pos::default(), cause, hint)
    };
    let mut told: Vec<Diagnostic> = ladder::check(program).into_iter().filter(Diagnostic::is_error).collect();
    for refusal in refuse::refuse(program) {
        if !told.iter().any(|known| known.pos.line == refusal.pos.line) {
            told.push(refusal);
        }
    }
    told.sort_by_key(|diagnostic| diagnostic.pos);
    let Some(chip) = chip(&options.mcu) else {
        let known: Vec<&str> = CHIPS.iter().map(|chip| chip.name).collect();
        let cause = format!("there is no compiler for the chip `{}`", options.mcu);
        told.push(error(codes::UNKNOWN_CHIP, cause, &format!("known are {}", known.join(", "))));
        return Err(told);
    };
    let pins = pins::assign(program, &options.pins, chip, &mut told);
    let clock_hz = options.clock_hz.unwrap_or(program.settings.crystal_hz);
    let pace = match plan(program, clock_hz, chip) {
        Ok(pace) if !told.iter().any(Diagnostic::is_error) => pace,
        Ok(_) => return Err(errors(told)),
        // The checks of the language refuse a cycle of zero already.
        Err(refusal) => {
            if refusal.code != codes::NO_CYCLE || !told.iter().any(Diagnostic::is_error) {
                told.push(refusal);
            }
            return Err(errors(told));
        }
    };

    let mut ir = optimise::optimise(lower::lower(program));
    change(&mut ir);
    let image = avr::build(&ir, &pins, &pace, chip).map_err(|none| {
        vec![match none {
            NoImage::Flash(bytes) => {
                let cause = format!("the code needs {bytes} bytes, {} has {}", chip.name, chip.flash);
                error(codes::FLASH_FULL, cause, "shorten the program")
            }
            NoImage::Ram(bytes) => {
                let cause = format!("data and stack need {bytes} bytes of RAM, {} has {}", chip.name, chip.ram_len);
                error(codes::RAM_FULL, cause, "use fewer integers")
            }
            NoImage::Internal(what) => error(codes::INTERNAL, what, "please report this with the program"),
        }]
    })?;
    if image.worst + image.poll > pace.shortest() {
        let cause = format!(
            "a scan takes up to {} machine cycles (and {} to notice the match), but the cycle of {} us at {clock_hz} Hz \
             has only {}",
            image.worst,
            image.poll,
            program.settings.cycle_us,
            pace.shortest()
        );
        return Err(vec![error(codes::CYCLE_SHORT, cause, "choose a longer cycle or a faster clock")]);
    }

    let code: Vec<u8> = image.code.words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let map = map_of(program, &ir, &image, &pins, &pace, chip, clock_hz);
    let cause = format!("fuses: {}", map.fuses.join("; "));
    told.push(Diagnostic::new(Severity::Note, codes::FUSES_NOTE, &program.file, Pos::default(), cause, ""));
    Ok(Compiled {
        hex: emu_core::image::write_hex(&[(0, &code)]),
        listing: listing::listing(program, &image, &map),
        code,
        map,
        notes: told,
    })
}

fn errors(told: Vec<Diagnostic>) -> Vec<Diagnostic> {
    told.into_iter().filter(Diagnostic::is_error).collect()
}

/// How the scan is paced, or why it cannot be.
fn plan(program: &Program, clock_hz: u64, chip: &Chip) -> Result<Pace, Diagnostic> {
    let error = |code, cause: String, hint: &str| {
        Err(Diagnostic::new(Severity::Error, code, &program.file, Pos::default(), cause, hint))
    };
    let cycle = program.settings.cycle_us;
    if clock_hz == 0 || clock_hz > chip.max_hz {
        let cause = format!("the clock is {clock_hz} Hz, {} runs at 1 to {} Hz", chip.name, chip.max_hz);
        return error(codes::CLOCK, cause, "set CRYSTAL=, or give another clock on the command line");
    }
    match avr::pace::pace(clock_hz, cycle) {
        Ok(pace) => Ok(pace),
        Err(NoPace::Zero) => error(codes::NO_CYCLE, "the cycle time is 0 us".to_owned(), "set CYCLE="),
        Err(NoPace::Longer(longest)) => {
            let cause = format!(
                "the cycle of {cycle} us is longer than timer 1 can pace: at {clock_hz} Hz at most {longest} us"
            );
            error(codes::CYCLE_LONG, cause, "choose a shorter cycle")
        }
    }
}

fn map_of(program: &Program, ir: &Ir, image: &Image, pins: &[Pin], pace: &Pace, chip: &Chip, clock_hz: u64) -> Map {
    let byte = |mark| image.code.at(mark).unwrap_or(0) * 2;
    let rungs_end = byte(Mark::RungsEnd);
    let starts: Vec<u32> = (0..program.rungs.len() as u32).map(|n| byte(Mark::Rung(n))).collect();
    let end_of = |rung: usize| starts.get(rung + 1).copied().unwrap_or(rungs_end);
    let listed: Vec<(ElementId, u32)> = image
        .code
        .marks
        .iter()
        .filter_map(|&(mark, at)| if let Mark::Element(id) = mark { Some((id, at * 2)) } else { None })
        .collect();
    let elements = program.elements().map(|(id, element, _)| {
        let place = listed.iter().position(|(listed, _)| *listed == id);
        let start = place.and_then(|n| listed.get(n)).map_or(0, |&(_, at)| at);
        let next = place.and_then(|n| listed.get(n + 1)).filter(|(next, _)| next.rung == id.rung);
        ElementMap {
            rung: id.rung + 1,
            element: id.index + 1,
            text: ladder::element_text(element),
            start,
            end: next.map_or_else(|| end_of(id.rung as usize), |&(_, at)| at),
        }
    });
    let data = || "data".to_owned();
    let symbols = program.symbols().into_iter().filter_map(|symbol| {
        let place = if symbol.kind.is_bit() {
            let bit = ir.bits.iter().position(|cell| cell.name == symbol.name)?;
            let (home, bit) = image.layout.bit(ir::Bit(bit as u32));
            let addr = match home {
                avr::layout::Home::Reg(reg) => u32::from(reg),
                avr::layout::Home::Ram(addr) => u32::from(addr),
            };
            Place::Bit { space: data(), addr, bit }
        } else {
            let word = ir.words.iter().position(|cell| cell.name == symbol.name)?;
            Place::Word { space: data(), addr: image.layout.word(ir::Word(word as u32)).into(), bytes: 2 }
        };
        Some(SymbolMap { name: symbol.name, kind: symbol.kind, place })
    });
    Map {
        schema: SCHEMA,
        mcu: chip.name.to_owned(),
        clock_hz,
        cycle: pace.period,
        tick: pace.prescale,
        timer_start: byte(Mark::TimerStart),
        poll: byte(Mark::Poll),
        poll_cycles: image.poll as u32,
        scan_start: byte(Mark::ScanStart),
        scan_end: byte(Mark::ScanEnd),
        worst_scan_cycles: image.worst as u32,
        code_bytes: image.code.words.len() as u32 * 2,
        ram_bytes: image.layout.ram_bytes.into(),
        rungs: starts
            .iter()
            .enumerate()
            .map(|(n, &start)| {
                let worst_cycles = avr::worst::longest(&image.code, start / 2, end_of(n) / 2);
                RungMap { rung: n as u32 + 1, start, end: end_of(n), worst_cycles }
            })
            .collect(),
        elements: elements.collect(),
        symbols: symbols.collect(),
        pins: pins
            .iter()
            .map(|pin| PinMap {
                name: pin.name.clone(),
                pin: pin.pin.to_owned(),
                direction: if pin.output { "out" } else { "in" }.to_owned(),
            })
            .collect(),
        slack_cycles: pace.shortest().saturating_sub(image.worst + image.poll),
        specials: Vec::new(),
        eeprom: Vec::new(),
        fuses: fuses(clock_hz),
    }
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
