//! Machines for the sessions: what `emu dap` opens with all its flags, here with none.

use std::path::{Path, PathBuf};

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_avr::Avr;
use emu_core::chip::{Chip, Family};
use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::{ElfMachine, Image, Lines, load};
use emu_dap::{LaunchArguments, Opened};
use emu_debug::debug::{Options, Rig, Scope, Session, Target};
use emu_debug::{Board, Clock};
use ladder_view::View;

/// The folder of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_path_buf()
}

fn chip(name: &str) -> Result<&'static Chip, String> {
    let avr = emu_avr::chips::CHIPS.iter().copied();
    let mut all = avr.chain(emu_8051::chips::chips()).chain(emu_pic16::chips::chips()).chain(emu_ap101::chips::chips());
    all.find(|chip| chip.name == name).ok_or_else(|| format!("no chip `{name}`"))
}

fn rig<C: Cpu + 'static>(cpu: C, hz: u64) -> (Box<dyn Target>, Clock) {
    let clock = Clock { hz, clocks_per_cycle: cpu.clocks_per_cycle() };
    let mut cpu = cpu;
    let mut board = Board::new(Vec::new(), clock);
    board.connect(&mut cpu);
    (Box::new(Rig::new(cpu, board)), clock)
}

fn machine(chip: &'static Chip, image: &Image, hz: u64) -> (Box<dyn Target>, Clock) {
    let ram = RamInit::Zero;
    match chip.family {
        Family::Avr => rig(Avr::new(chip, image, ram), hz),
        Family::Mcs51 => rig(Mcs51::new(chip, image, ram), hz),
        Family::Pic16 => {
            let options = emu_pic16::Options { hz, start_up: false, ..emu_pic16::Options::default() };
            rig(emu_pic16::Pic16::with(chip, image, ram, options), hz)
        }
        Family::Ap101 => rig(Ap101::new(image), hz),
    }
}

/// Reads an image, or makes one of a source.
fn image(path: &Path, chip: &'static Chip) -> Result<Image, String> {
    let bytes = std::fs::read(path).map_err(|_| format!("{} cannot be read", path.display()))?;
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("");
    if matches!(ending, "asm" | "s") {
        return emu_asm::image(chip, &String::from_utf8_lossy(&bytes)).map_err(|why| format!("{why:?}"));
    }
    let loaded = load("image", &bytes, chip.hex, chip.elf, ElfMachine(chip.elf_machine));
    let mut image = loaded.map_err(|faults| faults[0].cause.clone())?.image;
    if ending == "elf" {
        image.lines = Lines::of_elf("image", bytes);
    }
    Ok(image)
}

fn ladder(path: &Path, chip: &'static Chip) -> Result<(Image, View, u64), String> {
    let text = std::fs::read_to_string(path).map_err(|_| format!("{} cannot be read", path.display()))?;
    let parsed = ladder::parse(&path.display().to_string(), &text).map_err(|faults| faults[0].cause.clone())?;
    let options = ladder_compile::Options { mcu: chip.name.to_owned(), ..ladder_compile::Options::default() };
    let compiled = ladder_compile::compile(&parsed.program, &options).map_err(|faults| faults[0].cause.clone())?;
    let bytes = compiled.hex.as_bytes();
    let loaded = load("image", bytes, chip.hex, chip.elf, ElfMachine(chip.elf_machine));
    let image = loaded.map_err(|faults| faults[0].cause.clone())?.image;
    let hz = compiled.map.clock_hz;
    let view = View::new(parsed.program, compiled.map, chip).map_err(|faults| faults[0].cause.clone())?;
    Ok((image, view, hz))
}

/// The opener of the tests.
pub fn open(arguments: &LaunchArguments) -> Result<Opened, String> {
    let chip = chip(arguments.mcu.as_deref().unwrap_or("atmega328p"))?;
    let path = root().join(&arguments.program);
    let (image, view, hz) = if arguments.program.ends_with(".ld") {
        let (image, view, hz) = ladder(&path, chip)?;
        (image, Some(view), hz)
    } else {
        (image(&path, chip)?, None, chip.default_hz)
    };
    let (target, clock) = machine(chip, &image, hz);
    let mut scope = Scope::new(chip);
    scope.symbols = image.symbols;
    scope.lines = image.lines;
    scope.ladder = view.as_ref().map(View::symbols).unwrap_or_default();
    let follow = view.as_ref().map(View::follower);
    let session = Session::new(target, scope, Options { clock, history: 4 << 20, follow });
    Ok(Opened { session, view })
}
