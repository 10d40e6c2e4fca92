//! Ladder programs on chips under a session.

use emu_core::cpu::{Cpu, RamInit};
use emu_core::image::load_hex;
use emu_core::pins::{Level, Time};
use emu_debug::debug::{Action, Options, Rig, Scope, Session, Target};
use emu_debug::stimulus::{Drive, Put};
use emu_debug::{Board, Clock};
use ladder_view::View;

fn rig<C: Cpu + 'static>(cpu: C, clock: Clock) -> Box<dyn Target> {
    Box::new(Rig::new(cpu, Board::new(Vec::new(), clock)))
}

/// Which chip, and how it is switched on.
#[derive(Clone, Copy)]
pub struct Setup {
    pub mcu: &'static str,
    pub clock_hz: Option<u64>,
    /// The watchdog of a PIC16 is on.
    pub watchdog: bool,
}

/// Compiles a program and switches the chip on, with all inputs low.
pub fn open(text: &str, setup: Setup) -> (Session, View) {
    let Setup { mcu, clock_hz, watchdog } = setup;
    let program = ladder::parse_bytes("program.ld", text.as_bytes(), ladder::Options::default());
    let program = program.expect("a program").program;
    let options = ladder_compile::Options { mcu: mcu.to_owned(), clock_hz, ..Default::default() };
    let compiled = ladder_compile::compile(&program, &options).expect("an image");
    let chip = ladder_compile::chip(mcu).expect("a chip");
    let image = load_hex("program", compiled.hex.as_bytes(), chip.hex).expect("a HEX file").image;
    let clock = Clock { hz: compiled.map.clock_hz, clocks_per_cycle: 1 };
    let target = match chip.family {
        emu_core::chip::Family::Avr => rig(emu_avr::Avr::new(chip, &image, RamInit::Zero), clock),
        emu_core::chip::Family::Mcs51 => {
            rig(emu_8051::Mcs51::with(chip, &image, RamInit::Zero, emu_8051::Options::default()), clock)
        }
        emu_core::chip::Family::Pic16 => {
            let options = emu_pic16::Options { hz: clock.hz, ..Default::default() };
            let config = watchdog.then_some(0x3FFF);
            rig(emu_pic16::Pic16::with(chip, &image, RamInit::Zero, emu_pic16::Options { config, ..options }), clock)
        }
        emu_core::chip::Family::Ap101 => rig(emu_ap101::Ap101::with(&image, emu_ap101::Options::default()), clock),
    };
    let view = View::new(program, compiled.map, chip).expect("they belong together");
    let mut scope = Scope::new(chip);
    scope.ladder = view.symbols();
    let options = Options { clock, history: 64 << 20, follow: Some(view.follower()) };
    let mut session = Session::new(target, scope, options);
    // Inputs have pull-ups; these programs are easier to follow when all are low.
    for pin in view.map().pins.clone().iter().filter(|pin| pin.direction == "in") {
        put(&mut session, &view, &pin.name, false);
    }
    (session, view)
}

/// Drives an input.
pub fn put(session: &mut Session, view: &View, name: &str, high: bool) {
    let pin = view.map().pins.iter().find(|pin| pin.name == name).expect("a pin of the program");
    let pin = session.scope.chip().pin(&pin.pin).expect("a pin of the chip");
    let at = Time::at(session.target().cycle());
    session.act(Action::Drive(Drive { at, put: Put::Level(pin, Level::of(high)) })).expect("a level");
}
