//! Makes the machines of the sessions: like `emu dap`, without its options.

use std::path::{Path, PathBuf};

use emu_8051::Mcs51;
use emu_ap101::Ap101;
use emu_avr::Avr;
use emu_core::chip::{Chip, ChipFamily};
use emu_core::cpu::RamInit;
use emu_core::image::{ElfMachine, Image, SourceLines, load};
use emu_dap::{LaunchArguments, LaunchError, OpenedMachine};
use emu_debug::CycleClock;
use emu_debug::debug::{DebugSession, DynMachine, NameScope, SessionOptions};
use emu_test_machines::DebugMachine;
use ladder_view::LadderView;

/// The folder of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace").to_path_buf()
}

fn chip(name: &str) -> Result<&'static Chip, String> {
    emu_test_machines::find_chip(name).ok_or_else(|| format!("no chip `{name}`"))
}

fn machine(chip: &'static Chip, image: &Image, hz: u64) -> Box<dyn DynMachine> {
    let ram = RamInit::Zero;
    match chip.family {
        ChipFamily::Avr => Avr::new(chip, image, ram).boxed(hz),
        ChipFamily::Mcs51 => Mcs51::new(chip, image, ram).boxed(hz),
        ChipFamily::Pic16 => {
            let options = emu_pic16::Options { hz, start_up: false, ..emu_pic16::Options::default() };
            emu_pic16::Pic16::with(chip, image, ram, options).boxed(hz)
        }
        ChipFamily::Ap101 => Ap101::new(image).boxed(hz),
    }
}

/// Loads an image, or assembles a source.
fn image(path: &Path, chip: &'static Chip) -> Result<Image, String> {
    let bytes = std::fs::read(path).map_err(|_| format!("{} cannot be read", path.display()))?;
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("");
    if matches!(ending, "asm" | "s") {
        return emu_asm::assemble_text(chip, &String::from_utf8_lossy(&bytes)).map_err(|why| why.to_string());
    }
    let loaded = load("image", &bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine));
    let mut image = loaded.map_err(|faults| faults[0].cause.clone())?.image;
    if ending == "elf" {
        image.lines = SourceLines::from_elf("image", bytes);
    }
    Ok(image)
}

fn ladder(path: &Path, chip: &'static Chip) -> Result<(Image, LadderView, u64), String> {
    let text = std::fs::read_to_string(path).map_err(|_| format!("{} cannot be read", path.display()))?;
    let parsed = ladder::parse(&path.display().to_string(), &text).map_err(|faults| faults[0].cause.clone())?;
    let options =
        ladder_compile::CompileOptions { mcu: chip.name.to_owned(), ..ladder_compile::CompileOptions::default() };
    let compiled = ladder_compile::compile(&parsed.program, &options).map_err(|faults| faults[0].cause.clone())?;
    let bytes = compiled.hex.as_bytes();
    let loaded = load("image", bytes, chip.hex_spaces, chip.elf_spaces, ElfMachine(chip.elf_machine));
    let image = loaded.map_err(|faults| faults[0].cause.clone())?.image;
    let hz = compiled.map.clock_hz;
    let view = LadderView::new(parsed.program, compiled.map, chip).map_err(|faults| faults[0].cause.clone())?;
    Ok((image, view, hz))
}

/// The function that makes the machines of the tests.
pub fn open(arguments: &LaunchArguments) -> Result<OpenedMachine, LaunchError> {
    let chip = chip(arguments.mcu.as_deref().unwrap_or("atmega328p"))?;
    let path = root().join(&arguments.program);
    let (image, view, hz) = if arguments.program.ends_with(".ld") {
        let (image, view, hz) = ladder(&path, chip)?;
        (image, Some(view), hz)
    } else {
        (image(&path, chip)?, None, chip.default_hz)
    };
    let target = machine(chip, &image, hz);
    let clock = CycleClock { hz, clocks_per_cycle: target.clocks_per_cycle() };
    let mut scope = NameScope::new(chip);
    scope.symbols = image.symbols;
    scope.lines = image.lines;
    scope.ladder = view.as_ref().map(LadderView::symbols).unwrap_or_default();
    let follow = view.as_ref().map(LadderView::follower);
    let session = DebugSession::new(target, scope, SessionOptions { clock, max_copy_bytes: 4 << 20, follower: follow });
    Ok(OpenedMachine { session, view })
}
