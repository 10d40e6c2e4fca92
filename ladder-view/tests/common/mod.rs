//! Opens debugger sessions of ladder programs on chips.

use emu_core::cpu::RamInit;
use emu_core::image::load_hex;
use emu_core::pins::{CycleTime, PinLevel};
use emu_debug::CycleClock;
use emu_debug::debug::{DebugSession, NameScope, SessionOptions, UserAction};
use emu_debug::stimulus::{ExternalDrive, TimedDrive};
use emu_test_machines::DebugMachine;
use ladder_view::LadderView;

/// Chip and power-up options.
#[derive(Clone, Copy)]
pub struct ChipSetup {
    pub mcu: &'static str,
    pub clock_hz: Option<u64>,
    /// True to enable the watchdog of a PIC16.
    pub watchdog: bool,
}

/// Compiles a program and powers the chip up, with all inputs low.
pub fn open(text: &str, setup: ChipSetup) -> (DebugSession, LadderView) {
    let ChipSetup { mcu, clock_hz, watchdog } = setup;
    let program = ladder::parse_bytes("program.ld", text.as_bytes(), ladder::ParseOptions::default());
    let program = program.expect("a program").program;
    let options = ladder_compile::CompileOptions { mcu: mcu.to_owned(), clock_hz, ..Default::default() };
    let compiled = ladder_compile::compile(&program, &options).expect("an image");
    let chip = ladder_compile::find_chip(mcu).expect("a chip");
    let image = load_hex("program", compiled.hex.as_bytes(), chip.hex_spaces).expect("a HEX file").image;
    let clock = CycleClock { hz: compiled.map.clock_hz, clocks_per_cycle: 1 };
    let machine = match chip.family {
        emu_core::chip::ChipFamily::Avr => emu_avr::Avr::new(chip, &image, RamInit::Zero).boxed(clock.hz),
        emu_core::chip::ChipFamily::Mcs51 => emu_8051::Mcs51::new(chip, &image, RamInit::Zero).boxed(clock.hz),
        emu_core::chip::ChipFamily::Pic16 => {
            let options = emu_pic16::Options { hz: clock.hz, ..Default::default() };
            let config = watchdog.then_some(0x3FFF);
            let options = emu_pic16::Options { config, ..options };
            emu_pic16::Pic16::with(chip, &image, RamInit::Zero, options).boxed(clock.hz)
        }
        emu_core::chip::ChipFamily::Ap101 => emu_ap101::Ap101::new(&image).boxed(clock.hz),
    };
    let view = LadderView::new(program, compiled.map, chip).expect("they belong together");
    let mut scope = NameScope::new(chip);
    scope.ladder = view.symbols();
    let options = SessionOptions { clock, max_copy_bytes: 64 << 20, follower: Some(view.follower()) };
    let mut session = DebugSession::new(machine, scope, options);
    // Inputs have pull-ups, but the tests are easier to follow with all inputs low.
    for pin in view.map().pins.clone().iter().filter(|pin| pin.direction == "in") {
        drive_input(&mut session, &view, &pin.name, false);
    }
    (session, view)
}

/// Drives an input to a level.
pub fn drive_input(session: &mut DebugSession, view: &LadderView, name: &str, high: bool) {
    let pin = view.map().pins.iter().find(|pin| pin.name == name).expect("a pin of the program");
    let pin = session.scope.chip().pin(&pin.pin).expect("a pin of the chip");
    let at = CycleTime::at(session.machine().cycle());
    session
        .apply_action(UserAction::Drive(TimedDrive { at, drive: ExternalDrive::Level(pin, PinLevel::from_bit(high)) }))
        .expect("a level");
}
