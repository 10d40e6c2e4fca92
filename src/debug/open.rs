//! Where a session is made, for every face of the debugger: from an image with the flags of its machine, or from a ladder program.

use ::ladder::Dialect;
use clap::Args;
use emu_core::chip::Chip;
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::Image;
use emu_debug::debug::{Options, Rig, Scope, Session, Target};
use emu_debug::stimulus::{queue, supplies};
use emu_debug::{Clock, Drive, Names, Source};
use ladder_view::View;

use super::ladder;
use super::scenario::{Around, staged};
use crate::args::dialect;
use crate::compile::pin;
use crate::fail::Failure;
use crate::family::{Job, on_machine};
use crate::machine::{How, MachineArgs, Wired, there};
use crate::report::{Terminal, Texts, report};
use crate::run::{Ram, ram};
use crate::scenarios::{self, File};
use crate::snapshots::{self, Shelf};
use crate::sources::Sources;
use crate::{input, pic16, store};

/// What is debugged, and how its machine is wired.
#[derive(Debug, Args)]
pub struct Subject {
    /// A HEX or ELF file, for the 8051 family also an absolute object file (OMF-51), an assembly source by its name (.asm, .s, .a51,
    /// .src), or a ladder program (.ld), which is compiled first.
    #[arg(value_name = "FILE")]
    pub file: String,
    #[command(flatten)]
    pub machine: MachineArgs,
    /// What RAM and registers hold after power-up: random:SEED or zero.
    #[arg(long, value_name = "FILL", default_value = "zero", value_parser = fill)]
    ram: RamInit,
    /// The ladder program that the image was compiled from, for rungs and symbols; with --map.
    #[arg(long, value_name = "PROGRAM.ld", requires = "map")]
    pub(super) ladder: Option<String>,
    /// The map that was written with the image (`emu compile --map`); with --ladder.
    #[arg(long, value_name = "FILE", requires = "ladder")]
    pub(super) map: Option<String>,
    /// Put an input or output of a ladder program at a pin: Xstart=PD2. Goes before the pins of the program. Repeatable.
    #[arg(long = "pin", value_name = "NAME=PIN", value_parser = pin)]
    pub(super) pins: Vec<(String, String)>,
    /// What the elements of a ladder program mean: ldmicro-2.3 or ldmicro-5.
    #[arg(long, value_name = "DIALECT", value_parser = dialect)]
    pub(super) dialect: Option<Dialect>,
    /// Do what a scenario (docs/scenario.md) does from outside, beside --set and --at. One that expects or waits is played first, on a
    /// copy of the machine, and how it ends is told.
    #[arg(long, value_name = "FILE")]
    scenario: Option<String>,
    /// Bytes that copies of the machine may take, from which it goes back in time: 64M, 500k, 1G.
    #[arg(long, value_name = "BYTES", default_value = "64M", value_parser = bytes)]
    history: usize,
}

/// The value of `--ram`; reading RAM that was not written is no fault here.
fn fill(text: &str) -> Result<RamInit, String> {
    match ram(text) {
        Ok(Ram::Fill(init)) => Ok(init),
        _ => Err("write random:SEED or zero".to_owned()),
    }
}

/// A number of bytes: 64M, 500k, 1G, 4096.
fn bytes(text: &str) -> Result<usize, String> {
    let wrong = || format!("`{text}` is no number of bytes; write 64M, 500k or 1G");
    let (digits, shift) = match text.char_indices().last() {
        Some((at, 'k' | 'K')) => (&text[..at], 10),
        Some((at, 'm' | 'M')) => (&text[..at], 20),
        Some((at, 'g' | 'G')) => (&text[..at], 30),
        _ => (text, 0),
    };
    let number: usize = digits.parse().map_err(|_| wrong())?;
    number.checked_mul(1 << shift).ok_or_else(wrong)
}

/// A session, and what is known of its program.
pub struct Opened {
    /// The machine under the debugger.
    pub session: Session,
    /// The ladder program, where it is one.
    pub view: Option<View>,
    /// The texts of its source lines.
    pub sources: Sources,
    /// Where its snapshots are written.
    pub shelf: Shelf,
    /// The file of the program.
    pub file: String,
    /// What was queued from outside.
    pub drives: Vec<Drive>,
}

/// Makes a session. Warnings and notes are told.
pub fn open(subject: &Subject, terminal: &Terminal) -> Result<Opened, Failure> {
    let machine = &subject.machine;
    let chosen = machine.mcu.choose(&subject.file)?;
    let chip = chosen.chip;
    let compiled = if subject.is_ladder() { Some(subject.compiled(chip, terminal)?) } else { None };
    let mapped = if compiled.is_none() { subject.mapped(chip, terminal)? } else { None };
    let own = compiled.as_ref().map(|compiled| &compiled.view).or(mapped.as_ref()).map(|view| view.map().clock_hz);
    let clock = chosen.clock(machine.clock.or(own));
    let how = How { ram: subject.ram, bus: false, clock, start_up: !machine.no_start_up };
    let wired = machine.wired(chip, &how, || match &compiled {
        Some(compiled) => compiled.image(&subject.file, chip),
        None => input::image_with_symbols(&subject.file, &machine.symbols, chip, terminal),
    })?;
    let view = compiled.map(|compiled| compiled.view).or(mapped);
    let mut scope = scope(chip, &wired.image, terminal);
    scope.ladder = view.as_ref().map_or(Vec::new(), View::symbols);
    let (image, setup) = (wired.image.clone(), wired.setup);
    let head = snapshots::head(chip, &image, &setup);
    let scene = subject.scenario.as_deref().map(scenarios::read).transpose()?;
    let files = || std::iter::once(&subject.file).chain(&machine.symbols);
    let taken: Vec<String> = files()
        .chain(&subject.ladder)
        .chain(&subject.map)
        .chain(&subject.scenario)
        .chain(&machine.eeprom)
        .cloned()
        .collect();
    let shelf = Shelf { head, taken };
    let fit = Fit {
        machine,
        program: &subject.file,
        wired,
        view: view.as_ref(),
        scene: scene.as_ref(),
        shelf: shelf.clone(),
    };
    let Fitted { target, clock, drives } = on_machine(chip, &image, &setup, fit)?;
    let follow = view.as_ref().map(View::follower);
    let options = Options { clock, history: subject.history, follow };
    let sources = Sources::new(files().map(String::as_str));
    let session = Session::new(target, scope, options);
    Ok(Opened { session, view, sources, shelf, file: subject.file.clone(), drives })
}

/// The names of the program; damaged debugging information is told.
fn scope(chip: &'static Chip, image: &Image, terminal: &Terminal) -> Scope {
    let mut scope = Scope::new(chip);
    scope.symbols.clone_from(&image.symbols);
    scope.lines = image.lines.clone();
    // They are read when they are first asked for.
    _ = scope.lines.all();
    report(terminal, scope.lines.warnings(), Texts::NONE);
    scope
}

/// Makes a machine with what is around it.
struct Fit<'a> {
    machine: &'a MachineArgs,
    program: &'a str,
    wired: Wired,
    view: Option<&'a View>,
    scene: Option<&'a File>,
    shelf: Shelf,
}

/// A machine before its first cycle, and what is queued for it.
struct Fitted {
    target: Box<dyn Target>,
    clock: Clock,
    drives: Vec<Drive>,
}

impl Job for Fit<'_> {
    type Out = Result<Fitted, Failure>;

    fn on<C: Cpu + 'static>(self, mut cpu: C) -> Self::Out {
        let Wired { image, setup, hz, avr, eeprom, bench } = self.wired;
        let chip = cpu.chip();
        if let Some((_, held)) = eeprom {
            store::fill(&mut cpu, &held.unwrap_or_default());
        }
        let clock = Clock { hz, clocks_per_cycle: cpu.clocks_per_cycle() * avr.divider };
        let source = Source { names: Names { chip, symbols: &image.symbols }, lines: &image.lines };
        let alias = |text: &str| self.view.map_or_else(|| text.to_owned(), |view| view.own_pin(text));
        let asked = self.machine.drives(&source, clock, &alias)?;
        there(&cpu, &asked, std::iter::empty())?;
        let mut board = bench.board(chip, clock, &asked)?;
        // Of two that drive a pin at once the later counts.
        let mut drives = self.view.map_or(Vec::new(), |view| ladder::wires(view, chip));
        drives.retain(|drive| !board.driven().any(|pin| ladder::is_of(drive, pin)));
        drives.extend(asked);
        if let Some(file) = self.scene {
            let (mut copy, mut around) = (cpu.clone(), board.clone());
            queue(&mut copy, &drives).map_err(Failure::Usage)?;
            around.connect(&mut copy);
            let driven = drives.iter().filter_map(Drive::pin).chain(board.driven()).collect();
            let (baud, deaf) = (self.machine.baud, !self.machine.uart_in.is_empty());
            let (names, shelf) = (source.names, self.shelf);
            let supplies = supplies(&drives);
            let known = Around { program: self.program, names, clock, baud, deaf, driven, supplies, shelf };
            drives.extend(staged(file, self.view, (copy, around), &known)?);
        }
        queue(&mut cpu, &drives).map_err(Failure::Usage)?;
        pic16::warn(chip, &image, &setup.pic16);
        board.connect(&mut cpu);
        Ok(Fitted { target: Box::new(Rig::new(cpu, board)), clock, drives })
    }
}
